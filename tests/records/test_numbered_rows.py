"""Names of trajectories as numbers, in the order of vehicles and times."""

from __future__ import annotations

import numpy as np
import polars as pl
import pytest

from odscen.records.row_text import (
    among,
    by_vehicle_and_time,
    numbers,
    numbers_among,
    with_numbered_names,
)

ROWS = pl.DataFrame(
    {"id": ["car-2", "bus", "car-10", "bus"], "lane": ["b", None, "a", "b"], "time": [0, 1, 1, 2]}
)


@pytest.mark.parametrize("table", [ROWS, with_numbered_names(ROWS)], ids=["text", "numbered"])
def test_names_are_numbered_in_alphabetical_order(table: pl.DataFrame) -> None:
    number, names = numbers(table["id"])
    assert names == ["bus", "car-10", "car-2"]
    assert number.tolist() == [2, 0, 1, 0]
    known = pl.Series(["car-10", "car-2", "truck", "bus"])
    assert numbers_among(table["id"], known).tolist() == [1, 3, 0, 3]


@pytest.mark.parametrize("table", [ROWS, with_numbered_names(ROWS)], ids=["text", "numbered"])
def test_rows_are_chosen_by_names_of_which_some_never_occur(table: pl.DataFrame) -> None:
    chosen = among("lane", pl.Series(["b", "c"]), table.schema["lane"])
    assert table.filter(chosen)["time"].to_list() == [0, 2], "who is on no lane is left out"


def test_numbered_names_are_still_the_same_names() -> None:
    table = with_numbered_names(ROWS)
    assert table.cast({"id": pl.String, "lane": pl.String}).equals(ROWS)


@pytest.mark.parametrize("times", [[0.0, 1.0, 1.0, 2.0], [2.0, 1.0, 0.5, 0.0]])
def test_rows_are_put_in_the_order_of_vehicles_and_times(times: list[float]) -> None:
    vehicle = np.array([1, 0, 1, 0])
    order = by_vehicle_and_time(vehicle, pl.Series(times))
    placed = [(int(vehicle[k]), times[k]) for k in order]
    assert placed == sorted(placed)
