"""Warm-up and intervals: what is left out, what is summed up, and what cannot be had."""

from __future__ import annotations

import polars as pl
import pytest

from odscen.base.errors import InputError
from odscen.figures.by_place.analysis_times import AnalysisTimes, begins_at
from odscen.figures.by_place.traffic import over_run, traffic_figures
from tests.figures.made_traffic import PLACES, lane_rows

END = 3600.0


def lanes() -> pl.DataFrame:
    """Ten vehicles in the first quarter, twenty in the second, and so on."""
    rows = []
    for index in range(4):
        said = {"length": 100.0, "lost": 5.0, "co2": 2.0, "sink": False}
        rows.append(lane_rows(index, "a_0", 10 * (index + 1), source=True, **said))
        rows.append(lane_rows(index, ":j_0_0", 10 * (index + 1), source=False, **said))
    return pl.DataFrame(rows)


def test_figures_of_an_hour_are_sums_and_means_of_its_quarters() -> None:
    quarters = traffic_figures(lanes(), PLACES, end=END)
    hour = traffic_figures(lanes(), PLACES, end=END, times=AnalysisTimes(interval=3600.0))
    assert quarters.junctions.height == 4
    assert hour.junctions.height == 1
    for name in ("network", "segments", "junctions", "movements"):
        assert over_run(getattr(hour, name)).equals(over_run(getattr(quarters, name))), name


def test_a_warm_up_is_in_no_figure_but_who_was_under_way_still_is() -> None:
    times = AnalysisTimes(warm_up=900.0, interval=1800.0)
    found = traffic_figures(lanes(), PLACES, end=END, times=times)
    assert found.junctions.select("begin", "end", "vehicles").rows() == [
        (900.0, 2700.0, 50),
        (2700.0, 3600.0, 40),
    ]
    network = found.network.row(0, named=True)
    assert network["departed"] == 50
    assert network["vehicles"] == 60, "ten had departed before and were still there"


@pytest.mark.parametrize(
    ("times", "words"),
    [
        (AnalysisTimes(interval=600.0), "must be multiples of 900 s, not 0 s and 600 s"),
        (AnalysisTimes(warm_up=100.0), "must be multiples of 900 s, not 100 s and none"),
        (AnalysisTimes(warm_up=3600.0), "leaves nothing of a run of 3600 s"),
    ],
)
def test_times_that_do_not_fit_what_was_measured_are_refused(
    times: AnalysisTimes, words: str
) -> None:
    with pytest.raises(InputError, match=words):
        times.clock(lanes(), end=END)


def test_a_summary_says_what_was_analysed_only_if_it_is_not_all() -> None:
    assert AnalysisTimes().to_dict() == {}
    times = AnalysisTimes(warm_up=300.0, interval=900.0)
    assert AnalysisTimes.of_summary(times.to_dict()) == times


def test_a_time_belongs_to_the_interval_that_it_begins_or_lies_in():
    clock = pl.DataFrame({"begin": [0.0, 300.0], "end": [300.0, 600.0]})
    times = pl.Series("time", [-1.0, 0.0, 299.9, 300.0, 900.0])
    assert begins_at(times, clock).to_list() == [None, 0.0, 0.0, 300.0, 300.0]
    assert begins_at(times.clear(), clock).to_list() == []
    assert begins_at(times, clock.clear()).to_list() == [None] * 5
