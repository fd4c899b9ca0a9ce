from __future__ import annotations

from pathlib import Path

import pytest

from odscen.base.errors import InputError
from odscen.results.by_place.traffic import TABLES
from odscen.results.measures.traffic_files import places_from_json, read_tables


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
