"""The track of one road user as rows for a rule, or what is wrong with it."""

from __future__ import annotations

import math
from pathlib import Path

import polars as pl
import pytest

from odscen.app.exchange.recorded_traffic import read_recorded_traffic
from odscen.base.errors import InputError
from odscen.formats.tracks.recorded_traffic import trajectory_rows

CSV = "time,id,x,y\n2.5,a,10,0\n2.0,a,8,0\n3.0,a,12,0\n2.0,b,0,0\n3.0,b,0,0\n2.0,c,1,1\n"


@pytest.fixture
def tracks(tmp_path: Path) -> pl.DataFrame:
    file = tmp_path / "tape.csv"
    file.write_text(CSV, encoding="utf-8")
    return read_recorded_traffic(file).rows


def test_rows_are_of_one_road_user_in_order_and_begin_at_0(tracks: pl.DataFrame) -> None:
    begin, rows = trajectory_rows(tracks, of="a")
    assert begin == 2.0
    assert rows == ((0.0, 8.0, 0.0, 0.0), (0.5, 10.0, 0.0, 0.0), (1.0, 12.0, 0.0, 0.0))


def test_a_heading_that_is_given_is_taken_and_parquet_reads_as_csv_does(tmp_path: Path) -> None:
    table = pl.DataFrame({"time": [0, 1], "x": [0, 1], "y": [0, 0], "hdg": [7.0, -0.5]})
    table.write_parquet(tmp_path / "tape.parquet")
    _, rows = trajectory_rows(read_recorded_traffic(tmp_path / "tape.parquet").rows)
    assert [row[3] for row in rows] == pytest.approx([7.0 - math.tau, -0.5])


def test_who_never_moves_looks_along_x(tracks: pl.DataFrame) -> None:
    _, rows = trajectory_rows(tracks, of="b")
    assert [row[3] for row in rows] == [0.0, 0.0]


@pytest.mark.parametrize(
    ("of", "words"),
    [
        (None, "there are 3 road users: a, b, c; name one"),
        ("d", "there is no road user 'd'"),
        ("c", "1 rows; a trajectory has 2"),
    ],
)
def test_what_is_wrong_is_said(tracks: pl.DataFrame, of: str | None, words: str) -> None:
    with pytest.raises(InputError, match=words):
        trajectory_rows(tracks, of=of)
