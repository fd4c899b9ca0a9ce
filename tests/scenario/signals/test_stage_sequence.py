"""What is shown between the stages of a program."""

from __future__ import annotations

from odscen.scenario.signals.program_design import (
    DesignedProgram,
    change_length,
    change_steps,
    cycle_length,
    stage_state,
)
from tests.signal_case import light, one_plan, timing


def designed() -> DesignedProgram:
    return DesignedProgram(timing(**one_plan()), light(), "fixed")


def letters(state: str, group: str) -> set[str]:
    return {state[n] for n in designed().groups[group].movements}


def test_permissive_movements_give_way_only_where_they_meet_others_that_have_green() -> None:
    program = designed()
    (plan,) = program.plans()
    state = stage_state(program, plan.stages[0])
    assert letters(state, "V1L") == {"g"}
    assert letters(state, "V1") == {"g", "G"}
    assert letters(state, "P2") == {"G"}
    assert letters(state, "V2") == {"r"}
    assert letters(stage_state(program, plan.stages[1]), "V1L") == {"G"}


def test_crossings_turn_red_while_vehicles_still_go_and_all_begin_together() -> None:
    program = designed()
    (plan,) = program.plans()
    first, second = plan.stages[:2]
    steps = change_steps(program, first, second)
    assert program.intergreen("P4", "V1L") == 12.0
    assert [step.seconds for step in steps] == [7.0, 3.0, 2.0]
    assert [step.name for step in steps] == ["pedestrian clearance", "yellow", "all red"]
    assert letters(steps[0].state, "P4") == {"r"}
    assert letters(steps[0].state, "V1") == {"g", "G"}
    assert letters(steps[1].state, "V1") == {"y"}
    # Whose way is protected from the next stage on goes on giving way until then.
    assert {one for step in steps for one in letters(step.state, "V1L")} == {"g"}


def test_every_intergreen_between_two_stages_is_kept() -> None:
    program = designed()
    (plan,) = program.plans()
    for stage, following in zip(plan.stages, (*plan.stages[1:], plan.stages[0]), strict=True):
        steps = change_steps(program, stage, following)
        for ending in stage.groups - following.groups:
            place = program.groups[ending].movements[0]
            shown = [step for step in steps if step.state[place] in "Gg"]
            rest = change_length(program, stage, following) - sum(step.seconds for step in shown)
            for beginning in following.groups - stage.groups:
                assert rest >= program.intergreen(ending, beginning)


def test_a_given_intergreen_makes_the_cycle_longer() -> None:
    program = designed()
    shorter = DesignedProgram(timing(**one_plan(intergreens=None)), light(), "fixed")
    assert program.needed("V2", "P1")[0] == 8.0
    assert program.intergreen("V2", "P1") == 9.0
    lengths = [cycle_length(one, one.plans()[0].stages) for one in (program, shorter)]
    assert lengths == [84.0, 83.0]
