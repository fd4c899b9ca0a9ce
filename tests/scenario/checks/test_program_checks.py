"""Rules on the signal programs of a scenario."""

from __future__ import annotations

import json
from typing import Any

import pytest

from odscen.base.errors import ScenarioError
from odscen.scenario.checks.signal_checks import signal_problems
from odscen.scenario.document.problems import Problem
from odscen.scenario.document.signals_document import Signals
from odscen.sumo.realize.realization import realize
from tests.signal_case import crossing, light, one_plan, program, scenario


def problems(*junctions: dict[str, Any], **times: float) -> list[Problem]:
    signals = Signals.model_validate_json(json.dumps({"junctions": junctions}), strict=True)
    return list(signal_problems(signals, [light()], **times))


def stages(**changes: dict[str, Any]) -> list[dict[str, Any]]:
    """Stages of the guide with other fields, by id."""
    return [{**stage, **changes.get(f"s{stage['id']}", {})} for stage in program()["stages"]]


def only(found: list[Problem]) -> Problem:
    (problem,) = found
    return problem


def test_the_program_of_the_guide_has_no_problem() -> None:
    assert problems(program()) == []


def test_conflicting_greens_are_refused_with_both_movements_named() -> None:
    wrong = stages(s2={"protected": ["V1L", "V2"]})
    found = [p for p in problems(one_plan(stages=wrong)) if p.code == "conflicting_greens"]
    problem = only(found)
    assert problem.where == "signals.junctions[0].stages[1]"
    assert "r1>r4 (group 'V1L')" in problem.message
    assert "(group 'V2')" in problem.message
    assert "they cannot have green together" in problem.message


def test_a_turn_across_has_to_be_called_permissive() -> None:
    wrong = stages(s1={"protected": ["P2", "P4", "V1L"], "permissive": ["V1", "V3", "V3L"]})
    found = [p for p in problems(one_plan(stages=wrong)) if p.code == "conflicting_greens"]
    assert {p.where for p in found} == {"signals.junctions[0].stages[0]"}
    assert all("make group 'V1L', which gives way, permissive" in p.message for p in found)


def test_an_intergreen_that_is_too_short_is_refused_with_both_times() -> None:
    problem = only(problems(one_plan(intergreens=[["V2", "P1", 5]])))
    assert problem.code == "intergreen_too_short"
    assert problem.where == "signals.junctions[0].intergreens[0]"
    assert "5 s between group 'V2' and group 'P1'" in problem.message
    assert "needs 8 s to clear the path of walk r1" in problem.message


def test_all_red_that_is_too_short_names_the_group() -> None:
    groups = [{**g, "all_red": 1} if g["id"] == "V4" else g for g in program()["groups"]]
    found = problems(one_plan(groups=groups))
    assert {p.code for p in found} == {"intergreen_too_short"}
    assert {p.where for p in found} == {"signals.junctions[0].groups[5]"}
    assert any("4 s between group 'V4' and group 'P1' is too short" in p.message for p in found)


def test_names_that_are_not_there_are_answered_with_those_that_are() -> None:
    groups = [{"id": "V1", "movements": ["r1>r9"]}, *program()["groups"][1:]]
    found = problems(one_plan(groups=groups))
    assert found[0].code == "unknown_movement"
    assert found[0].where == "signals.junctions[0].groups[0].movements[0]"
    assert "there are r1>r2, r1>r3, r1>r4" in found[0].message
    assert found[1].code == "movement_without_green"
    wrong = stages(s4={"protected": ["P9"]})
    found = problems(one_plan(stages=wrong))
    assert [p.code for p in found] == ["unknown_group", "movement_without_green"]
    found = problems(program(plans=[{"id": "day", "times": ["06:00"], "green": {"7": 5}}]))
    assert [p.code for p in found] == ["unknown_stage"]


def test_a_movement_has_one_group_and_every_movement_has_one() -> None:
    groups = [*program()["groups"], {"id": "V9", "movements": ["r4 left"]}]
    found = problems(one_plan(groups=groups))
    assert [p.code for p in found] == ["movement_twice", "movement_without_green"]
    missing = [group for group in program()["groups"] if group["id"] != "P3"]
    codes = {p.code for p in problems(one_plan(groups=missing))}
    assert {"movement_without_green", "unknown_group"} <= codes


def test_greens_and_intergreens_have_to_be_the_cycle() -> None:
    problem = only(problems(one_plan(cycle=90)))
    assert (problem.code, problem.where) == ("cycle_differs", "signals.junctions[0].cycle")
    assert "add up to 84 s, but the cycle is 90 s" in problem.message
    assert problems(one_plan(cycle=84)) == []


@pytest.mark.parametrize(
    ("change", "code"),
    [
        ({"s1": {"max_green": 10}}, "green_out_of_bounds"),
        ({"s1": {"on_call": True}}, "first_stage_on_call"),
    ],
)
def test_stages_that_cannot_be_run_are_refused(change: dict[str, Any], code: str) -> None:
    assert only(problems(one_plan(stages=stages(**change)))).code == code


def test_a_detector_lies_on_a_lane_before_the_light() -> None:
    detector = {"id": "D1", "at": "r7", "stages": ["1", "9"]}
    found = problems(one_plan(detectors=[detector]))
    assert [p.code for p in found] == ["unknown_stage", "unknown_detector_place"]
    assert "approaches are r1, r2, r3, r4" in found[1].message


def test_a_plan_without_a_time_is_never_active() -> None:
    plans = [*program()["plans"], {"id": "sunday"}]
    problem = only(problems(program(plans=plans)))
    assert (problem.severity, problem.code) == ("error", "plan_never_active")
    assert problem.where == "signals.junctions[0].plans[2].times"


def test_a_plan_that_the_run_does_not_come_to_is_a_warning() -> None:
    problem = only(problems(program(), clock=8 * 3600.0, until=3600.0))
    assert (problem.severity, problem.code) == ("warning", "plan_never_active")
    assert "'evening'" in problem.message


def test_lights_of_one_coordination_have_one_cycle() -> None:
    found = problems(one_plan(coordination="main"))
    assert [p.code for p in found] == ["cycle_missing"]


def test_a_program_with_errors_is_refused_before_anything_is_written() -> None:
    wrong = scenario(one_plan(intergreens=[["V2", "P1", 5]]))
    with pytest.raises(ScenarioError, match="is too short"):
        realize(wrong, crossing().sumo)


def test_old_timings_and_programs_cannot_be_mixed() -> None:
    with pytest.raises(ValueError, match="give the green in the stages"):
        problems(one_plan(green=[20, 20]))


def test_an_offset_that_buses_undo_is_warned_of() -> None:
    own = {"junction": "10001", "offset": 12, "bus_priority": True}
    problem = only(problems(own))
    assert (problem.code, problem.severity) == ("offset_lost_to_buses", "warning")
    assert problem.where == "signals.junctions[0].bus_priority"
    assert "offset of 12 s" in problem.message
    assert problems({**own, "offset": 0}) == []
    assert problems({**own, "bus_priority": False}) == []
    kept = one_plan(control="actuated", cycle=84, offset=12, bus_priority=True)
    assert problems(kept) == []
