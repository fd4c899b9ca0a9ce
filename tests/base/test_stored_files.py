from __future__ import annotations

from pathlib import Path

import polars as pl
import pytest

from odscen.base.errors import InputError
from odscen.base.stored_files import documents, read_document, read_json, tables, typed_rows
from odscen.records.run_events import Event, EventKind

HEAD = '"format": "f", "version": 1'


@pytest.mark.parametrize(
    "text",
    ["", "[]", "{", '{"a": NaN}', "[" * 100_000, '{"a": ' + "9" * 400 + "}", '{"a": 1e400}'],
)
def test_what_is_no_json_object_of_numbers_is_refused_by_its_name(text: str) -> None:
    with pytest.raises(InputError, match="not a thing: "):
        read_json(text, what="a thing")


def test_another_format_or_version_is_named() -> None:
    assert read_document("{" + HEAD + "}", form="f", version=1, what="a thing")["version"] == 1
    with pytest.raises(InputError, match="format 'f' version 1 is not a thing"):
        read_document("{" + HEAD + "}", form="f", version=2, what="a thing")
    with pytest.raises(InputError, match="format None version None is not a thing"):
        read_document("{}", form="f", version=2, what="a thing")


def test_a_missing_part_is_told_in_words_and_not_as_python_does() -> None:
    with pytest.raises(InputError) as refused, documents("a thing"):
        _ = {"rows": 1}["seeds"]  # type: ignore[index]
    assert str(refused.value) == "not a thing: 'seeds' is missing or not known"


def test_a_row_has_each_value_of_the_type_of_its_field() -> None:
    make = typed_rows(Event)
    event = make({"time": 3, "kind": "arrived", "actor": "a", "x": None})
    assert event == Event(3, EventKind.ARRIVED, "a")
    for wrong in ({"time": "3"}, {"time": True}, {"actor": 3}, {"queue": 1.5}, {"actor": None}):
        (name,) = wrong
        with pytest.raises(TypeError, match=f"{name} cannot be "):
            make({"time": 3, "kind": "arrived", "actor": "a", **wrong})
    with pytest.raises(ValueError, match="'flew' is not a valid"):
        make({"time": 3, "kind": "flew", "actor": "a"})


@pytest.mark.parametrize("kept", [0, 4, 60, 200])
def test_a_torn_table_is_named_with_the_folder_of_its_run(tmp_path: Path, kept: int) -> None:
    file = tmp_path / "trips.parquet"
    pl.DataFrame({"a": list(range(100))}).write_parquet(file)
    file.write_bytes(file.read_bytes()[:kept])
    words = "files of the run cannot be read"
    with pytest.raises(InputError, match=words) as refused, tables(str(tmp_path)):
        pl.read_parquet(file)
    assert refused.value.file == str(tmp_path)
