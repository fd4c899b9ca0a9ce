"""Counts and traffic: by slice, and by the hour that slices make up."""

from __future__ import annotations

import pytest

from odscen.scenario.demand.count_stations import geh
from odscen.sumo.calibrate.count_fit import CountFit, CountFits


def slices(
    place: str, *numbers: tuple[float, int], begin: float = 0.0, step: float = 900.0
) -> list[CountFit]:
    return [
        CountFit("survey", place, at, at + step, counted, made, geh(made, counted, step), "")
        for n, (counted, made) in enumerate(numbers)
        for at in (begin + n * step,)
    ]


def test_four_quarters_are_held_against_counts_as_one_hour() -> None:
    rows = slices("r1", (100.0, 130), (100.0, 80), (100.0, 120), (100.0, 90))
    found = CountFits("run", tuple(rows), 420, ())
    [hour] = found.hours
    assert (hour.place, hour.begin, hour.counted, hour.modelled) == ("r1", 0.0, 400.0, 420)
    # sqrt(2 * 20^2 / 820)
    assert hour.geh == pytest.approx(0.9877, abs=1e-4)
    assert [round(row.geh, 2) for row in rows] == [5.6, 4.22, 3.81, 2.05]
    assert found.share_met == 0.75
    assert found.hours_met == 1.0


def test_only_whole_hours_without_gaps_are_formed() -> None:
    rows = [
        *slices("three quarters", (10.0, 9), (10.0, 9), (10.0, 9)),
        *slices("a gap", (10.0, 9), (10.0, 9)),
        *slices("a gap", (10.0, 9), (10.0, 9), begin=2700.0),
        *slices("hours already", (10.0, 9), (10.0, 9), step=3600.0),
        *slices("six half hours", *[(10.0, 9)] * 6, begin=600.0, step=1800.0),
    ]
    hours = CountFits("run", tuple(rows), 0, ()).hours
    assert [(one.place, one.begin) for one in hours] == [
        ("six half hours", 600.0 + 3600.0 * n) for n in range(3)
    ]


def test_without_hours_no_share_of_them_is_said() -> None:
    found = CountFits("run", tuple(slices("r1", (10.0, 9))), 9, ())
    assert found.hours_met is None
    assert (found.to_dict()["hours"], found.to_dict()["hours_met"]) == (0, None)
