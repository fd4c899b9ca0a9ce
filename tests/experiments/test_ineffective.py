"""Variables that change nothing are named, with why, before a sweep runs."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import pytest

from odscen.experiments.ineffective import variables_without_effect
from odscen.scenario.document.json_form import dumps, loads
from odscen.scenario.sweeps.sweep_plan import SweepPlan, axis_from_text, concrete
from tests.sumo.story_case import MIDDLE, document, node_at, run

if TYPE_CHECKING:
    from pathlib import Path

MOTORWAY = "motorway_weave"
AT_ONCE = {"time": {"after": 0}}


def found(
    then: list[Any] | None = None, *, vary: str = "x=5..20:4", **parts: Any
) -> dict[str, str]:
    return variables_without_effect(scene(then, **parts), SweepPlan((axis_from_text(vary),)))


def scene(
    then: list[Any] | None = None,
    *,
    when: Any = AT_ONCE,
    parameters: Any = None,
    actor: dict[str, Any] | None = None,
    **parts: Any,
) -> Any:
    """A car on a motorway, its speed `x`, whose rule `cruise` does what `then` has."""
    data = json.loads(dumps(document(MOTORWAY, [], [], until=6.0)))
    goal = node_at(MOTORWAY, 900.0, MIDDLE)
    car = {"id": "van", "category": "van", "spawn": node_at(MOTORWAY, 300.0, MIDDLE), "goal": goal}
    data["actors"] = [car | ({"speed": "$x"} if actor is None else actor)]
    if then:
        data["rules"] = [{"id": "cruise", "actor": "van", "when": when, "then": then}]
    data["parameters"] = parameters or {"x": {"value": 10}}
    return loads(json.dumps(data | parts))


SPEED = {"speed": {"to": 20, "shape": "step"}}


def test_a_rule_that_sets_the_speed_at_once_is_named() -> None:
    assert found([SPEED]) == {"x": "rule cruise sets the speed"}
    # The desired speed counts again once the rule lets go, or until it begins.
    assert found([SPEED, {"release": {}}]) == {}
    assert found([SPEED], when={"time": {"after": 2}}) == {}
    assert found([{"lane": {"by": 1}}]) == {}
    assert found() == {}


@pytest.mark.slow
def test_runs_with_such_a_variable_are_the_same(tmp_path: Path) -> None:
    def driven(then: list[Any] | None) -> list[Any]:
        cases = [concrete(scene(then), {"x": value}, name="case") for value in (8.0, 25.0)]
        folders = [tmp_path / f"{bool(then)}-{number}" for number in range(2)]
        return [
            run(case, folder).tracks["van"].x.tolist()
            for case, folder in zip(cases, folders, strict=True)
        ]

    slow, fast = driven([SPEED])
    assert slow == fast
    slow, fast = driven(None)
    assert slow != fast


def test_recordings_and_the_story_set_speeds() -> None:
    rows = [[0, 0, 0, 0], [5, 50, 0, 0]]
    assert found([{"replay": {"rows": rows}}]) == {"x": "rule cruise moves van as it was recorded"}
    story = {"speed": "$x", "initial_speed": 20, "driver": "story"}
    assert found(actor=story) == {"x": "the story drives van, which keeps its initial speed"}
    assert found(actor={"initial_speed": "$x", "driver": "story"}) == {}


def test_a_variable_that_nothing_is_computed_from_is_named() -> None:
    unused = "no number of the scenario is computed from it"
    assert found(actor={"speed": 12}) == {"x": unused}
    # What another parameter is computed from counts as far as that one does.
    parameters = {"x": {"value": 10}, "y": {"value": "2 * $x"}}
    assert found(actor={"speed": 12}, parameters=parameters) == {"x": unused}
    assert found(actor={"speed": "$y"}, parameters=parameters) == {}


def test_a_formula_with_one_value_for_all_is_named() -> None:
    assert found(actor={"speed": "max($x, 30)"}) == {
        "x": "max($x, 30) is the same for all its values"
    }
    assert found(vary="x=5..40:4", actor={"speed": "max($x, 30)"}) == {}
    # Two places, of which one changes.
    assert found(actor={"speed": "max($x, 30)", "initial_speed": "$x"}) == {}


def test_weather_that_drivers_do_not_react_to_is_named() -> None:
    def of_weather(name: str, **fields: Any) -> dict[str, str]:
        environment = {"preset": "ClearNoon", "parameters": {name: "$x"}, **fields}
        return found(actor={}, environment=environment)

    assert of_weather("cloudiness") == {"x": "drivers in SUMO do not react to cloudiness"}
    assert of_weather("precipitation") == {}
    assert of_weather("precipitation", affects_driving=False) == {
        "x": "weather does not affect driving in this scenario"
    }


def test_what_begins_after_the_run_is_named() -> None:
    late = found(vary="x=5..20:4", actor={"depart": "$x"})
    assert late == {}  # 5 s is within the run
    assert found(vary="x=6..20:3", actor={"depart": "$x"}) == {
        "x": "van departs at 6 s, the run ends at 6 s"
    }
    rule = {"to": "$x", "shape": "step"}
    assert found([{"speed": rule}], when={"time": {"after": 9}}, actor={}) == {
        "x": "rule cruise begins at 9 s, the run ends at 6 s"
    }
