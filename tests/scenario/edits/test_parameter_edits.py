from __future__ import annotations

import pytest

from odscen.base.errors import InputError, NotFoundError, ScenarioError
from odscen.scenario import edits
from odscen.scenario.document.json_form import dumps, loads
from odscen.scenario.document.rules_document import StoryRule
from odscen.scenario.document.scenario_document import Scenario
from odscen.scenario.edits.edit_messages import read_edit
from tests.graphs import fork

GRAPH = fork()
BELOW = "rules/halt/when/ttc/below"


def scenario() -> Scenario:
    """A car that halts below a time to collision of 2 s, which is the parameter ttc."""
    empty = edits.new_scenario(GRAPH, name="test", roi=("r1", "j9", "r2", "r3"))
    for spawn in ("1.0.-1.10", "1.0.-1.20"):
        empty = edits.add_actor(empty, GRAPH, category="car", spawn=spawn)
    when = {"ttc": {"of": "car-1", "to": "car-2", "below": 5}}
    about = {"id": "halt", "actor": "car-1", "when": when, "then": [{"brake": {"by": 4}}]}
    ruled = edits.set_rule(empty, GRAPH, rule=StoryRule.model_validate(about))
    named = edits.set_parameter(ruled, parameter="ttc", value=2.0, unit="s", min=1.0, max=4.0)
    return edits.set_formula(named, place=BELOW, formula="$ttc")


def below(one: Scenario) -> float | None:
    ttc = one.rules[0].when.ttc
    assert ttc is not None
    return ttc.below


def test_what_is_computed_from_a_parameter_follows_its_value() -> None:
    first = scenario()
    assert (below(first), first.formulas) == (2.0, {BELOW: "$ttc"})
    faster = edits.set_formula(first, place="actors/car-1/speed", formula="4 * $ttc")
    assert faster.actors[0].speed == 8.0
    later = edits.set_parameter(faster, parameter="ttc", value=3.5)
    assert (below(later), later.actors[0].speed) == (3.5, 14.0)
    assert later.parameters["ttc"].unit == "s"
    assert loads(dumps(later)) == later


def test_a_value_outside_the_bounds_is_refused_with_both() -> None:
    with pytest.raises(ScenarioError, match=r"value 5 is outside 1\.\.4 s"):
        edits.set_parameter(scenario(), parameter="ttc", value=5.0)
    wider = edits.set_parameter(scenario(), parameter="ttc", value=5.0, max=None)
    assert (wider.parameters["ttc"].max, below(wider)) == (None, 5.0)


def test_a_value_that_makes_something_impossible_is_refused_with_its_place() -> None:
    slow = edits.set_formula(scenario(), place="actors/car-1/speed", formula="$ttc - 1.5")
    with pytest.raises(ScenarioError, match="speed"):
        edits.set_parameter(slow, parameter="ttc", value=1.0)


def test_a_renamed_parameter_keeps_its_place_and_its_formulas() -> None:
    more = edits.set_parameter(scenario(), parameter="ttc_2", value=1.0)
    more = edits.set_formula(more, place="actors/car-1/speed", formula="$ttc_2 + $ttc")
    renamed = edits.set_parameter(more, parameter="gap", instead_of="ttc")
    assert list(renamed.parameters) == ["gap", "ttc_2"]
    assert renamed.formulas == {BELOW: "$gap", "actors/car-1/speed": "$ttc_2 + $gap"}
    with pytest.raises(ScenarioError, match="a parameter 'ttc_2' already"):
        edits.set_parameter(more, parameter="ttc_2", instead_of="ttc")


def test_without_its_parameter_a_number_stays_as_it_was() -> None:
    left = edits.remove_parameter(scenario(), parameter="ttc")
    assert (left.parameters, left.formulas, below(left)) == ({}, {}, 2.0)
    with pytest.raises(NotFoundError, match="no parameter named 'ttc'"):
        edits.remove_parameter(left, parameter="ttc")


def test_a_formula_is_taken_away_and_the_number_stays() -> None:
    left = edits.set_formula(scenario(), place=BELOW, formula=None)
    assert (left.formulas, below(left)) == ({}, 2.0)
    assert below(edits.set_parameter(left, parameter="ttc", value=3.0)) == 2.0


@pytest.mark.parametrize(
    ("place", "formula", "words"),
    [
        ("rules/none/when/ttc/below", "$ttc", "rules/none/when/ttc/below"),
        (BELOW, "$gap", r"names \$gap, which is no parameter; there are \$ttc"),
        (BELOW, "2 + 3", "names no parameter"),
        (BELOW, "$ttc / 0", "has no value"),
        ("actors/car-1/category", "$ttc", "only a number can be computed"),
    ],
)
def test_a_formula_that_cannot_be_is_refused(place: str, formula: str, words: str) -> None:
    with pytest.raises(InputError, match=words):
        edits.set_formula(scenario(), place=place, formula=formula)


def test_edits_of_parameters_are_read_from_messages() -> None:
    read = read_edit({"kind": "set_parameter", "parameter": "ttc", "value": 3, "max": None})
    assert read.arguments == {"parameter": "ttc", "value": 3.0, "max": None}
    assert read.label == "Parameter ttc"
