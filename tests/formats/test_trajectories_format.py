"""Recorded trajectories as tables: rows for a rule, or what is wrong with them."""

from __future__ import annotations

import math
from io import BytesIO

import polars as pl
import pytest

from odscen.base.errors import InputError
from odscen.formats.trajectories_format import read_trajectories_table, trajectory_rows

CSV = b"time,id,x,y\n2.5,a,10,0\n2.0,a,8,0\n3.0,a,10,2\n2.0,b,0,0\n3.0,b,0,0\n"


def test_rows_are_of_one_road_user_in_order_and_begin_at_0() -> None:
    begin, rows = trajectory_rows(read_trajectories_table(CSV, parquet=False), of="a")
    assert begin == 2.0
    assert [row[:3] for row in rows] == [(0.0, 8.0, 0.0), (0.5, 10.0, 0.0), (1.0, 10.0, 2.0)]
    assert [row[3] for row in rows] == pytest.approx([0.0, math.pi / 2, math.pi / 2])


def test_a_heading_that_is_given_is_taken_and_parquet_reads_as_csv_does() -> None:
    table = pl.DataFrame({"time": [0, 1], "x": [0, 1], "y": [0, 0], "hdg": [7.0, -0.5]})
    file = BytesIO()
    table.write_parquet(file)
    _, rows = trajectory_rows(read_trajectories_table(file.getvalue(), parquet=True))
    assert [row[3] for row in rows] == pytest.approx([7.0 - math.tau, -0.5])


def test_who_never_moves_looks_along_x() -> None:
    _, rows = trajectory_rows(read_trajectories_table(CSV, parquet=False), of="b")
    assert [row[3] for row in rows] == [0.0, 0.0]


@pytest.mark.parametrize(
    ("text", "of", "words"),
    [
        (CSV, None, "there are 2 road users: a, b; name one"),
        (CSV, "c", "there is no road user 'c'"),
        (b"t,x,y\n1,2,3\n", None, "no column time; there are t, x, y"),
        (b"time,x,y\n1,2,3\n", None, "1 rows"),
        (b"time,x,y\n1,2,3\n1,3,3\n", None, "two rows at 1 s"),
        (b"time,x,y\n1,2,3\n2,,3\n", None, "missing or no number"),
        (b"time,x,y\n1,2,3\n2,left,3\n", None, "have to be numbers"),
        (b"time,x,y\n1,2,3\n2,3,3\n", "a", "no column id"),
    ],
)
def test_what_is_wrong_is_said(text: bytes, of: str | None, words: str) -> None:
    with pytest.raises(InputError, match=words):
        trajectory_rows(read_trajectories_table(text, parquet=False), of=of)


def test_what_is_no_table_is_refused() -> None:
    with pytest.raises(InputError, match="not a table of Parquet"):
        read_trajectories_table(b"PAR1 and nothing", parquet=True)
