"""Edits of traffic lights: greens, cycles, offsets, stages and turns."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest

from odscen.base.errors import InputError, NotFoundError, ScenarioError
from odscen.scenario import edits
from odscen.scenario.edits.turn_treatment import crossing_turns
from odscen.scenario.signals.program_design import DesignedProgram, cycle_length, stage_state
from tests.signal_case import JUNCTION, light, one_plan, program, scenario

if TYPE_CHECKING:
    from odscen.scenario.document.scenario_document import Scenario
    from odscen.scenario.document.signals_document import JunctionTiming

TWO: dict[str, Any] = {
    "junction": JUNCTION,
    "groups": [
        {"id": "V1", "movements": ["r1"]},
        {"id": "V3", "movements": ["r3"]},
        {"id": "V2", "movements": ["r2"]},
        {"id": "V4", "movements": ["r4"]},
        {"id": "P1", "movements": ["walk r1"]},
        {"id": "P2", "movements": ["walk r2"]},
        {"id": "P3", "movements": ["walk r3"]},
        {"id": "P4", "movements": ["walk r4"]},
    ],
    "stages": [
        {"id": "1", "protected": ["P2", "P4"], "permissive": ["V1", "V3"], "green": 20},
        {"id": "2", "protected": ["P1", "P3"], "permissive": ["V2", "V4"], "green": 15},
    ],
}


def empty(junction: dict[str, Any] | None = None) -> Scenario:
    return scenario(junction, vehicles=1.0, walkers=0.0)


def timing(one: Scenario) -> JunctionTiming:
    (found,) = one.signals.junctions
    return found


def greens(one: Scenario) -> dict[str, float]:
    return {stage.id: stage.green for stage in timing(one).stages}


def cycle(one: Scenario, plan: int = 0) -> float:
    designed = DesignedProgram(timing(one), light(), "fixed")
    return cycle_length(designed, designed.plans()[plan].stages)


def test_a_longer_green_makes_the_cycle_longer_or_takes_from_the_next_stage() -> None:
    one = empty({**TWO, "cycle": None})
    before = cycle(one)
    longer = edits.set_green(one, [light()], JUNCTION, stage="1", green=25)
    assert greens(longer) == {"1": 25.0, "2": 15.0}
    assert cycle(longer) == before + 5
    assert timing(longer).cycle is None
    kept = edits.set_green(one, [light()], JUNCTION, stage="1", green=25, keep_cycle=True)
    assert greens(kept) == {"1": 25.0, "2": 10.0}
    assert cycle(kept) == before


def test_a_cycle_that_is_said_follows_the_greens_unless_others_keep_to_it() -> None:
    said = {**TWO, "cycle": cycle(empty(TWO))}
    longer = edits.set_green(empty(said), [light()], JUNCTION, stage="2", green=18)
    assert timing(longer).cycle == said["cycle"] + 3


def test_the_stages_of_the_map_are_timed_by_their_numbers() -> None:
    one = edits.set_green(empty(), [light()], JUNCTION, stage="2", green=18)
    assert timing(one).green == (13.0, 18.0)
    kept = edits.set_green(one, [light()], JUNCTION, stage="2", green=20, keep_cycle=True)
    assert timing(kept).green == (11.0, 20.0)


def test_a_green_too_short_for_drivers_or_out_of_its_bounds_is_refused_with_the_reason() -> None:
    for one in (empty(), empty(TWO)):
        with pytest.raises(ScenarioError, match=r"4 s is too short .* at least 5 s"):
            edits.set_green(one, [light()], JUNCTION, stage="1", green=4)
        with pytest.raises(ScenarioError, match=r"stage 2 .* would have [13] s of green"):
            edits.set_green(
                one, [light()], JUNCTION, stage="1", green=32 if one.signals.junctions else 25,
                keep_cycle=True,
            )  # fmt: skip
    bounded = empty(one_plan())
    with pytest.raises(ScenarioError, match=r"36 s of green, .* max_green of 35 s"):
        edits.set_green(bounded, [light()], JUNCTION, stage="1", green=36)
    with pytest.raises(NotFoundError, match="stage"):
        edits.set_green(bounded, [light()], JUNCTION, stage="9", green=20)


def test_of_plans_of_the_day_one_is_changed_and_its_cycle_with_it() -> None:
    one = empty(program())
    with pytest.raises(InputError, match="name one of day, evening"):
        edits.set_green(one, [light()], JUNCTION, stage="1", green=18)
    new = edits.set_green(one, [light()], JUNCTION, stage="1", green=18, plan="evening")
    day, evening = timing(new).plans
    assert (day, day.cycle) == (timing(one).plans[0], 84)
    assert (evening.green, evening.cycle) == ({"1": 18.0, "3": 10.0}, 80.0)
    assert cycle(new, 1) == 80.0
    moved = edits.set_offset(new, [light()], JUNCTION, offset=7, plan="evening")
    assert [plan.offset for plan in timing(moved).plans] == [12.0, 7.0]


def test_an_offset_of_the_maps_program_is_an_entry_of_its_own() -> None:
    one = edits.set_offset(empty(), [light()], JUNCTION, offset=12)
    assert (timing(one).junction, timing(one).offset, timing(one).green) == (JUNCTION, 12.0, ())
    with pytest.raises(ScenarioError, match="no traffic light in junction '99'"):
        edits.set_offset(one, [light()], "99", offset=12)


def test_a_stage_can_wait_for_a_call_but_not_the_first_one_and_keeps_its_id() -> None:
    one = empty(one_plan())
    always = edits.set_stage(one, [light()], JUNCTION, "4", on_call=False)
    assert [stage.on_call for stage in timing(always).stages] == [False] * 4
    arrows = edits.set_stage(one, [light()], JUNCTION, "2", on_call=True)
    assert [stage.on_call for stage in timing(arrows).stages] == [False, True, False, True]
    with pytest.raises(ScenarioError, match="'1' is the first and cannot wait for a call"):
        edits.set_stage(one, [light()], JUNCTION, "1", on_call=True)
    with pytest.raises(InputError, match="keeps its id"):
        edits.set_stage(one, [light()], JUNCTION, "2", id="5")
    with pytest.raises(InputError, match="take over that of the map first"):
        edits.set_stage(empty(), [light()], JUNCTION, "2", on_call=True)


def test_the_turns_across_oncoming_traffic_of_the_crossing_are_known() -> None:
    assert [(one.approach, one.turn, one.alone) for one in crossing_turns(light())] == [
        (approach, "left", True) for approach in ("r1", "r2", "r3", "r4")
    ]


def letters(one: Scenario, approach: str) -> list[str]:
    """What the left turn from an approach shows in each stage."""
    designed = DesignedProgram(timing(one), light(), "fixed")
    (left,) = [
        n for n, m in enumerate(light().movements) if (m.approach, m.turn) == (approach, "left")
    ]
    return [stage_state(designed, stage)[left] for stage in designed.plans()[0].stages]


def turned(one: Scenario, approach: str, treatment: Any) -> Scenario:
    return edits.set_turn(one, [light()], JUNCTION, approach=approach, treatment=treatment)


def test_a_left_turn_gets_an_arrow_and_the_opposite_one_shares_its_stage() -> None:
    one = empty({**TWO, "cycle": cycle(empty(TWO))})
    assert letters(one, "r1") == ["g", "r"]
    first = turned(one, "r1", "protected")
    assert letters(first, "r1") == ["r", "G", "r"]
    assert [stage.id for stage in timing(first).stages] == ["1", "3", "2"]
    assert timing(first).cycle == cycle(first) > cycle(one) + 6
    both = turned(first, "r3", "both")
    assert letters(both, "r3") == ["g", "G", "r"]
    assert [stage.groups for stage in timing(both).stages][1] == ("V1L", "V3L")
    back = turned(turned(both, "r1", "permissive"), "r3", "permissive")
    assert letters(back, "r1") == letters(back, "r3") == ["g", "r"]
    assert cycle(back) == cycle(one) == timing(back).cycle


def test_a_turn_of_the_guides_program_keeps_its_stage_in_every_plan() -> None:
    one = empty(program())
    only = turned(turned(one, "r1", "protected"), "r3", "protected")
    assert letters(only, "r1") == ["r", "G", "r", "r"]
    none = turned(turned(only, "r1", "permissive"), "r3", "permissive")
    assert [stage.id for stage in timing(none).stages] == ["1", "3", "4"]
    assert [plan.cycle for plan in timing(none).plans] == [cycle(none), cycle(none, 1)]


def test_what_is_no_turn_across_or_has_no_lane_for_itself_is_refused() -> None:
    one = empty(TWO)
    with pytest.raises(InputError, match="r1 right is no turn across oncoming traffic"):
        edits.set_turn(
            one, [light()], JUNCTION, approach="r1", turn="right", treatment="permissive"
        )
