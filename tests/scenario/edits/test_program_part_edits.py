"""Edits of groups, stages, intergreens, detectors and plans of a light's program."""

from __future__ import annotations

import json
import re
from typing import TYPE_CHECKING, Any

import pytest

from odscen.base.errors import InputError, NotFoundError, ScenarioError
from odscen.scenario import edits
from odscen.scenario.document.json_form import dumps
from odscen.scenario.edits.edit_messages import read_edit
from odscen.scenario.edits.edit_registry import EDIT_ENTRIES
from odscen.scenario.signals.program_design import DesignedProgram, cycle_length
from tests.scenario.edits.test_signal_edits import TWO, empty, timing
from tests.signal_case import JUNCTION, ROOT, light, one_plan, program

if TYPE_CHECKING:
    from odscen.scenario.document.scenario_document import Scenario

LIGHTS = [light()]


def members(one: Scenario) -> dict[str, tuple[str, ...]]:
    return {group.id: group.movements for group in timing(one).groups}


def stages(one: Scenario) -> dict[str, tuple[tuple[str, ...], tuple[str, ...]]]:
    return {stage.id: (stage.protected, stage.permissive) for stage in timing(one).stages}


def cycles(one: Scenario) -> list[float]:
    designed = DesignedProgram(timing(one), light(), "fixed")
    return [cycle_length(designed, plan.stages) for plan in designed.plans()]


def test_a_turn_moves_into_a_new_group_which_shows_what_it_showed_before() -> None:
    one = edits.set_group(empty(TWO), LIGHTS, JUNCTION, "V1L", movements=["r1 left"])
    assert members(one)["V1L"] == ("r1 left",)
    assert set(members(one)["V1"]) == {"r1 straight", "r1 right"}
    assert stages(one)["1"] == (("P2", "P4"), ("V1", "V3", "V1L"))
    assert cycles(one) == cycles(empty(TWO))
    back = edits.remove_group(one, LIGHTS, JUNCTION, group="V1L", into="V1")
    assert timing(back) == timing(empty(TWO))


def test_the_guides_program_is_made_by_edits_alone_with_the_same_bytes() -> None:
    guide = empty(program())
    groups = {group["id"]: group for group in TWO["groups"]}
    order = ("V1", "V2", "V3", "V4", "P1", "P2", "P3", "P4")
    one = empty({**TWO, "groups": [groups[name] for name in order]})
    for name in ("V1", "V3"):
        leg = f"r{name[1]}"
        one = edits.set_group(one, LIGHTS, JUNCTION, f"{name}L", movements=[f"{leg} left"])
        one = edits.set_group(
            one, LIGHTS, JUNCTION, name, movements=[f"{leg} straight", f"{leg} right"]
        )
    # The pedestrian stage on call takes its crossing out of stage 2.
    one = edits.add_stage(
        one, LIGHTS, JUNCTION, "4", protected=["P1"], green=7, on_call=True, after="2"
    )
    one = edits.add_stage(
        one, LIGHTS, JUNCTION, "3", protected=["P3"], permissive=["V2", "V4"], green=12, after="2"
    )
    one = edits.add_stage(
        one, LIGHTS, JUNCTION, "new", protected=["V1L", "V3L"], green=6, after="1"
    )
    one = edits.remove_stage(one, LIGHTS, JUNCTION, stage="2")
    one = edits.add_stage(one, LIGHTS, JUNCTION, "2", protected=["V1L", "V3L"], green=6, after="1")
    one = edits.remove_stage(one, LIGHTS, JUNCTION, stage="new")
    one = edits.set_stage(
        one, LIGHTS, JUNCTION, "1", max_green=35,
        permissive=["V1", "V1L", "V3", "V3L"],
    )  # fmt: skip
    one = edits.set_intergreen(one, LIGHTS, JUNCTION, ending="V2", beginning="P1", seconds=9)
    one = edits.set_detector(one, LIGHTS, JUNCTION, "D1", at="r1", before=30, stages=["1"])
    one = edits.set_plan(one, LIGHTS, JUNCTION, "day", times=["06:00"], cycle=84, offset=12)
    one = edits.set_plan(
        one, LIGHTS, JUNCTION, "evening", times=["18:30"], cycle=76, green={"1": 14, "3": 10}
    )
    assert dumps(one) == dumps(guide)


def test_a_group_of_a_file_and_of_a_message_are_the_same_edit() -> None:
    data = {
        "kind": "set_group", "junction": JUNCTION, "group": "V1L", "movements": ["r1 left"],
        "permissive": ["1"], "min_green": 8,
    }  # fmt: skip
    message = read_edit(json.loads(json.dumps(data)))
    by_message = EDIT_ENTRIES[message.kind].function(empty(TWO), lights=LIGHTS, **message.arguments)
    by_hand = edits.set_group(
        empty(TWO), LIGHTS, JUNCTION, "V1L", movements=["r1 left"], permissive=["1"], min_green=8
    )
    assert dumps(by_message) == dumps(by_hand)
    assert message.label == f"Signal group V1L in junction {JUNCTION}"


def test_greens_that_are_never_allowed_together_are_refused_with_both_movements() -> None:
    one = empty(one_plan())
    with pytest.raises(ScenarioError, match=r"stage '1' gives green to .*; they cannot have"):
        edits.set_group(one, LIGHTS, JUNCTION, "V2", permissive=["1", "3"])
    with pytest.raises(ScenarioError, match=r"make group 'V1L', which gives way, permissive"):
        edits.set_group(one, LIGHTS, JUNCTION, "V1L", protected=["1", "2"], permissive=[])
    with pytest.raises(NotFoundError, match="stage"):
        edits.set_group(one, LIGHTS, JUNCTION, "V1L", protected=["9"])


def test_a_movement_must_have_a_group_and_a_group_a_green() -> None:
    one = empty(one_plan())
    with pytest.raises(ScenarioError, match="they would never have green"):
        edits.set_group(one, LIGHTS, JUNCTION, "V1", movements=["r1 straight"])
    with pytest.raises(ScenarioError, match="'V2' has green in no stage"):
        edits.set_group(one, LIGHTS, JUNCTION, "V2", permissive=[])
    with pytest.raises(InputError, match="no group 'V9'; a new one needs movements"):
        edits.set_group(one, LIGHTS, JUNCTION, "V9", yellow=4)
    with pytest.raises(InputError, match="has no program of this scenario"):
        edits.set_group(empty(), LIGHTS, JUNCTION, "V9", movements=["r1"])
    with pytest.raises(InputError, match="join another group"):
        edits.remove_group(one, LIGHTS, JUNCTION, group="V1", into="V1")


def test_a_renamed_group_keeps_its_stages_and_intergreens() -> None:
    one = edits.set_group(empty(one_plan()), LIGHTS, JUNCTION, "V2", id="KX")
    assert stages(one)["3"] == (("P3",), ("KX", "V4"))
    assert timing(one).intergreens == (("KX", "P1", 9.0),)
    assert cycles(one) == cycles(empty(one_plan()))


def test_a_least_green_of_a_group_counts_over_its_stages_and_is_asked_for_in_seconds() -> None:
    one = empty(one_plan())
    # V1L has green in stages 1 (20 s) and 2 (6 s), which follow each other.
    fits = edits.set_group(one, LIGHTS, JUNCTION, "V1L", min_green=26)
    assert timing(fits).groups[1].min_green == 26.0
    with pytest.raises(ScenarioError, match=r"V1L' may have only 26 s .* stage '1', '2'"):
        edits.set_group(one, LIGHTS, JUNCTION, "V1L", min_green=27)
    with pytest.raises(ScenarioError, match=r"'P1' may have only 7 s of green in stage '4'"):
        edits.set_group(one, LIGHTS, JUNCTION, "P1", min_green=8)
    actuated = empty(one_plan(control="actuated"))
    short = edits.set_stage(actuated, LIGHTS, JUNCTION, "3", min_green=6)
    with pytest.raises(ScenarioError, match=r"'V2' may have only 6 s of green in stage '3'"):
        edits.set_group(short, LIGHTS, JUNCTION, "V2", min_green=10)


def test_an_intergreen_lengthens_the_cycle_and_goes_back_to_what_the_paths_need() -> None:
    one = empty(one_plan(intergreens=None))
    before = cycles(one)
    longer = edits.set_intergreen(one, LIGHTS, JUNCTION, ending="V2", beginning="P1", seconds=11)
    assert timing(longer).intergreens == (("V2", "P1", 11.0),)
    assert cycles(longer)[0] - before[0] == 3.0  # the paths need 8 s
    back = edits.set_intergreen(longer, LIGHTS, JUNCTION, ending="V2", beginning="P1", seconds=None)
    assert (timing(back).intergreens, cycles(back)) == ((), before)
    with pytest.raises(ScenarioError, match=r"7 s between group 'V2' and group 'P1' is too short"):
        edits.set_intergreen(one, LIGHTS, JUNCTION, ending="V2", beginning="P1", seconds=7)
    with pytest.raises(ScenarioError, match="no group 'X'"):
        edits.set_intergreen(one, LIGHTS, JUNCTION, ending="X", beginning="P1", seconds=7)


def test_a_cycle_that_is_said_grows_with_an_intergreen() -> None:
    new = edits.set_intergreen(
        empty(program()), LIGHTS, JUNCTION, ending="V2", beginning="P1", seconds=11
    )
    assert [plan.cycle for plan in timing(new).plans] == [86.0, 78.0]


def test_detectors_are_laid_moved_and_taken_out_of_any_light() -> None:
    one = edits.set_detector(empty(), LIGHTS, JUNCTION, "D1", at="r1", stages=["1"])
    moved = edits.set_detector(one, LIGHTS, JUNCTION, "D1", before=45.5, gap=2, id="D7")
    (found,) = timing(moved).detectors
    assert (found.id, found.at, found.before, found.length, found.gap, found.stages) == (
        "D7", "r1", 45.5, 2.0, 2.0, ("1",),
    )  # fmt: skip
    none = edits.remove_detector(moved, LIGHTS, JUNCTION, detector="D7")
    assert timing(none).detectors == ()
    with pytest.raises(ScenarioError, match="no approach or lane before this light"):
        edits.set_detector(one, LIGHTS, JUNCTION, "D2", at="r99", stages=["1"])
    with pytest.raises(ScenarioError, match="no stage '9'"):
        edits.set_detector(one, LIGHTS, JUNCTION, "D1", stages=["9"])
    with pytest.raises(NotFoundError, match="detector"):
        edits.remove_detector(one, LIGHTS, JUNCTION, detector="D9")


def test_the_day_is_divided_into_plans_and_a_time_has_one_plan() -> None:
    one = empty(one_plan(offset=5))
    first = edits.set_plan(one, LIGHTS, JUNCTION, "B")
    assert [(p.id, p.times, p.offset) for p in timing(first).plans] == [("B", ("00:00",), 5.0)]
    two = edits.set_plan(first, LIGHTS, JUNCTION, "A", times=["06:00"], green={"1": 30})
    two = edits.set_plan(two, LIGHTS, JUNCTION, "B", times=["00:00", "09:00"])
    assert [(p.id, p.times) for p in timing(two).plans] == [
        ("B", ("00:00", "09:00")), ("A", ("06:00",)),
    ]  # fmt: skip
    assert cycles(two)[1] - cycles(two)[0] == 10.0
    taken = edits.set_plan(two, LIGHTS, JUNCTION, "A", times=["06:00", "09:00:00"])
    assert timing(taken).plans[0].times == ("00:00",)
    with pytest.raises(ScenarioError, match="'A' is never active"):
        edits.set_plan(two, LIGHTS, JUNCTION, "B", times=["06:00"])
    with pytest.raises(ScenarioError, match="add up to"):
        edits.set_plan(two, LIGHTS, JUNCTION, "A", cycle=60)
    none = edits.remove_plan(edits.remove_plan(two, LIGHTS, JUNCTION, plan="A"), LIGHTS, JUNCTION,
                             plan="B")  # fmt: skip
    assert timing(none) == timing(one)
    with pytest.raises(NotFoundError, match="plan of the day"):
        edits.remove_plan(two, LIGHTS, JUNCTION, plan="C")


def test_a_stage_that_goes_takes_its_detectors_and_times_along() -> None:
    made: dict[str, Any] = one_plan(
        detectors=[{"id": "D1", "at": "r1", "stages": ["2"]},
                   {"id": "D2", "at": "r2", "stages": ["2", "3"]}],
    )  # fmt: skip
    one = edits.remove_stage(empty(made), LIGHTS, JUNCTION, stage="2")
    assert [(d.id, d.stages) for d in timing(one).detectors] == [("D2", ("3",))]
    with pytest.raises(ScenarioError, match="has green in no stage"):
        edits.remove_stage(one, LIGHTS, JUNCTION, stage="3")
    with pytest.raises(InputError, match="has a stage '1' already"):
        edits.add_stage(one, LIGHTS, JUNCTION, "1", protected=["V1L"], green=6)


def test_the_edits_of_the_guide_can_be_made_on_its_program() -> None:
    guide = (ROOT / "docs" / "signals.md").read_text(encoding="utf-8")
    block = next(
        found for found in re.findall(r"```json\n(.*?)```", guide, re.DOTALL) if '"kind"' in found
    )
    one = empty(program())
    for data in json.loads(block):
        message = read_edit(data)
        one = EDIT_ENTRIES[message.kind].function(one, lights=LIGHTS, **message.arguments)
    assert members(one)["V2L"] == ("r2 left",)
    assert timing(one).intergreens == (
        ("V2", "P1", 9.0), ("V2L", "P1", 9.0), ("V4", "P1", 11.0),
    )  # fmt: skip
    assert [(d.id, d.before, d.gap) for d in timing(one).detectors] == [
        ("D1", 30.0, 3.0), ("D2", 25.0, 2.5),
    ]  # fmt: skip
    assert [plan.id for plan in timing(one).plans] == ["day", "evening", "night"]
