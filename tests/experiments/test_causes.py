"""What fingerprints say of why figures differ."""

from __future__ import annotations

from odscen.experiments.measure import FigureKey
from odscen.experiments.tolerance import EXACT
from odscen.experiments.verdict import Change, Effect, causes_between, likeliest_first
from odscen.figures.measures.comparison import Difference

OLD = {
    "map": "1",
    "scenario.signals": "1",
    "scenario.flows": "1",
    "scenario.simulation": "1",
    "sumo": "1.27.0",
    "odscen": "0.1.0",
}


def change(kind, figure):
    key = FigureKey(kind, "" if kind == "run" else "j1", figure)
    difference = Difference(1.0, 2.0, 1.0, None, None, paired=True, runs=1)
    return Change(key, key.entry, difference, EXACT, 1.0, Effect.FAILS)


def test_nothing_has_caused_a_change_where_nothing_is_different():
    assert causes_between(OLD, dict(OLD)) == ()


def test_every_input_that_differs_is_a_cause_and_the_likeliest_is_first():
    new = dict.fromkeys(OLD, "2") | {"sumo": "1.28.0", "odscen": "0.2.0"}
    causes = causes_between(OLD, new)
    assert [cause.name for cause in causes] == [
        "map",
        "signals",
        "demand",
        "settings",
        "SUMO",
        "odscen",
    ]
    assert causes[0].words == "the map"
    assert causes[2].words == "the scenario's flows"
    assert causes[4].words == "sumo 1.27.0 -> 1.28.0"


def test_a_part_that_only_one_side_has_is_a_cause():
    (cause,) = causes_between(OLD, OLD | {"scenario.drivers": "1"})
    assert cause.name == "drivers"


def test_figures_speak_for_causes_when_several_inputs_have_changed():
    causes = causes_between(OLD, OLD | {"map": "2", "scenario.signals": "2", "scenario.flows": "2"})
    planned, waiting = change("run", "planned"), change("junction", "waiting_time")

    def first(*worst):
        return [cause.name for cause in likeliest_first(causes, worst)]

    assert first() == ["map", "signals", "demand"]
    assert first(planned, waiting) == ["demand", "signals", "map"]
    assert first(waiting) == ["signals", "map", "demand"]


def test_measures_rules_and_lines_are_called_by_their_names():
    names = ("measures", "rules", "transit")
    before = {f"scenario.{name}": "1" for name in names}
    after = {f"scenario.{name}": "2" for name in names}
    found = [cause.name for cause in causes_between(before, after)]
    assert found == ["measures", "rules", "public transport"]
