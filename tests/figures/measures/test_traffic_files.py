from __future__ import annotations

from pathlib import Path

import polars as pl
import pytest

from odscen.base.errors import InputError
from odscen.figures.by_place.traffic import TABLES, over_run
from odscen.figures.measures.traffic_files import places_from_json, read_tables, write_tables
from odscen.reports.place_names import NO_NAMES
from odscen.reports.report_sections import service_values
from tests.figures.made_traffic import made_figures


@pytest.mark.parametrize(
    "content", [b"", b"\x00" * 64, b"segment,begin\nr1,soon\n", b"a,b\n1\n2,3,4\n"]
)
def test_a_torn_table_of_figures_is_named(tmp_path: Path, content: bytes) -> None:
    for name in TABLES:
        (tmp_path / f"{name}.csv").write_bytes(b"begin,end\n0,300\n")
    assert read_tables(tmp_path) is not None
    torn = tmp_path / "segments.csv"
    torn.write_bytes(content)
    with pytest.raises(InputError) as refused:
        read_tables(tmp_path)
    assert refused.value.file == str(torn)


@pytest.mark.parametrize(
    "text",
    [
        "",
        "[]",
        '{"format": "odscen-figures", "version": 1}',
        '{"format": "odscen-figures", "version": 1, "segments": [{"flow": {"a": []}}]}',
    ],
)
def test_a_torn_list_of_figures_is_refused(text: str) -> None:
    with pytest.raises(InputError, match="not figures of a run"):
        places_from_json(text, "segments")


def test_tables_of_an_earlier_version_are_read_and_shown_by_their_delay(tmp_path: Path) -> None:
    write_tables(made_figures(), tmp_path)
    new = ("facility", "control_delay", "passages", "control_seconds", "lane_density",
           "car_seconds", "lane_metres")  # fmt: skip
    for name in TABLES:
        table = pl.read_csv(tmp_path / f"{name}.csv")
        table.drop(new, strict=False).write_csv(tmp_path / f"{name}.csv")
    found = read_tables(tmp_path)
    assert found is not None
    (junction,) = over_run(found.junctions).to_dicts()
    assert (junction["control_delay"], junction["level"]) == (None, "D")
    service = service_values(found, NO_NAMES)
    assert service is not None
    assert round(service["junctions"][0]["shown"], 1) == 47.4
