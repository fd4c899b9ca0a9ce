"""What a baseline says of new runs, without running any."""

from __future__ import annotations

from odscen.experiments.baseline import Baseline
from odscen.experiments.measure import FigureKey
from odscen.experiments.tolerance import Tolerance, Tolerances
from odscen.experiments.verdict import BaselineVerdict, Effect, hold_against

DELAY, ARRIVED, OLD = (
    FigureKey("run", "", name) for name in ("mean_delay", "arrived", "old_delay")
)
NEW = FigureKey("run", "", "mean_stops")
USUAL = Tolerances({})


def baseline(**figures: float | None) -> Baseline:
    return Baseline(
        (1,), {}, {FigureKey("run", "", name): (value,) for name, value in figures.items()}
    )


def test_a_figure_that_is_newer_than_the_baseline_is_not_judged() -> None:
    verdict = hold_against(baseline(arrived=3.0), {1: {ARRIVED: 3.0, NEW: 2.0}}, USUAL)
    assert verdict.failing == ()


def test_a_figure_that_is_not_there_any_more_fails_also_if_nobody_knows_it() -> None:
    verdict = hold_against(baseline(arrived=3.0, old_delay=7.5), {1: {ARRIVED: 3.0}}, USUAL)
    (change,) = verdict.failing
    assert change.key == OLD
    assert change.words == "old_delay is none, was 7.5 (allowed 0)"


def test_a_figure_without_a_value_before_and_with_one_now_fails() -> None:
    verdict = hold_against(baseline(mean_delay=None), {1: {DELAY: 7.5}}, USUAL)
    assert [change.key for change in verdict.failing] == [DELAY]


def test_what_is_allowed_is_what_the_registry_says_unless_the_suite_does() -> None:
    before, now = baseline(mean_delay=10.0), {1: {DELAY: 10.4}}
    assert hold_against(before, now, USUAL).failing == ()  # 2 % or 0.5 s
    strict = Tolerances({("run", "mean_delay"): Tolerance(absolute=0.25)})
    (change,) = hold_against(before, now, strict).failing
    assert change.words == ("mean_delay is 10.40 s, was 10.00 s (+0.40 s, +4.0 %; allowed 0.25 s)")


R1, R2, J1 = (
    FigureKey(kind, place, figure)
    for kind, place, figure in (
        ("segment", "r1", "mean_speed"),
        ("segment", "r2", "mean_speed"),
        ("junction", "j1", "waiting_time"),
    )
)
WALKER = FigureKey("actor", "walker", "travel_time")


def held(now: dict[FigureKey, float]) -> BaselineVerdict:
    before = {R1: 10.0, R2: 10.0, J1: 5.0, WALKER: 60.0}
    passed = {key._replace(figure="vehicles"): 20.0 for key in (R1, R2, J1)}
    old = Baseline((1,), {}, {key: (value,) for key, value in (before | passed).items()})
    return hold_against(old, {1: {**before, **passed, **now}}, USUAL)


def test_where_all_places_are_within_their_tolerance_the_strongest_of_them_is_named() -> None:
    verdict = held({R1: 10.5, R2: 9.2, J1: 5.3, WALKER: 64.0})  # allowed 1 m/s, 1.5 s, 6 s
    assert (verdict.failing, verdict.places, verdict.actors) == ((), (), ())
    assert [change.key for change in verdict.allowed] == [R2, R1, J1, WALKER]
    assert verdict.where is not None
    assert (verdict.where.key, verdict.where.effect) == (R2, Effect.ALLOWED)


def test_a_place_beyond_its_tolerance_goes_before_stronger_ones_within() -> None:
    verdict = held({R1: 9.05, WALKER: 70.0})
    assert verdict.where is not None
    assert (verdict.where.key, verdict.where.effect) == (WALKER, Effect.EXPLAINS)


def test_of_an_unchanged_rerun_no_place_is_named() -> None:
    assert held({}).where is None
