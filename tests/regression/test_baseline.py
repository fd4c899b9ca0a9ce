"""What a baseline says of itself."""

from __future__ import annotations

from odscen.regression.baseline import Baseline, seeds_that_hardly_vary
from odscen.regression.measure import FigureKey


def of_travel_times(*values: float | None) -> Baseline:
    key = FigureKey("run", "", "mean_travel_time")
    return Baseline(tuple(range(len(values))), {}, {key: values})


def test_seeds_that_hardly_vary_are_warned_of_with_their_range() -> None:
    (words,) = seeds_that_hardly_vary(of_travel_times(107.44, 107.35, 107.31))
    assert words.startswith("the seeds hardly vary: mean_travel_time is 107.31 to 107.44 s")


def test_seeds_that_vary_and_single_runs_are_not_warned_of() -> None:
    assert seeds_that_hardly_vary(of_travel_times(44.84, 45.16, 39.11)) == ()
    assert seeds_that_hardly_vary(of_travel_times(44.84)) == ()
    assert seeds_that_hardly_vary(of_travel_times(None, None)) == ()
