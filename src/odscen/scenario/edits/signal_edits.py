"""Changes to traffic lights: control, greens, offset, stages, turns, and whole timings."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any, Literal

from odscen.base.errors import InputError, NotFoundError
from odscen.scenario.document.signals_document import JunctionTiming, ProgramStage
from odscen.scenario.edits.edit_registry import changed_part, edit, with_fields
from odscen.scenario.edits.program_changes import (
    own_program,
    timing_of_light,
    with_green,
    with_offset,
    with_stage,
    with_timing,
)
from odscen.scenario.edits.turn_treatment import with_turn

if TYPE_CHECKING:
    from collections.abc import Sequence

    from odscen.scenario.document.scenario_document import Scenario
    from odscen.scenario.document.signals_document import Control
    from odscen.scenario.signals.light import Light


@edit("Control of traffic lights")
def set_signal_control(scenario: Scenario, *, control: Control | None) -> Scenario:
    """Say how all traffic lights are run that have no control of their own.

    ``None`` leaves them as the map has them, and those that the scenario times to their times.
    """
    return with_fields(scenario, signals=changed_part(scenario.signals, {"control": control}))


@edit("Timing of light {junction}")
def set_timing(
    scenario: Scenario,
    lights: Sequence[Light],
    junction: str,
    **fields: Annotated[Any, JunctionTiming],
) -> Scenario:
    """Change how the traffic light of one junction is timed.

    Parameters
    ----------
    lights
        Traffic lights of the map.
    fields
        Fields of a :class:`~odscen.scenario.document.signals_document.JunctionTiming`,
        such as ``green``; those not given stay as they are.

    Raises
    ------
    ScenarioError
        If no light is in the junction, or if it cannot be timed so.
    """
    _, old = timing_of_light(scenario, lights, junction)
    return with_timing(scenario, lights, changed_part(old, fields), strict="green" in fields)


@edit("Timing of light {junction} as in the map")
def clear_timing(scenario: Scenario, junction: str) -> Scenario:
    """Give the traffic light of one junction back to the map's program.

    Raises
    ------
    NotFoundError
        If the scenario has no timing for it.
    """
    timings = scenario.signals.junctions
    names = [timing.junction for timing in timings]
    if junction not in names:
        raise NotFoundError("timing of junction", junction, names)
    left = tuple(timing for timing in timings if timing.junction != junction)
    return with_fields(scenario, signals=changed_part(scenario.signals, {"junctions": left}))


@edit("Green of stage {stage} in junction {junction}")
def set_green(
    scenario: Scenario,
    lights: Sequence[Light],
    junction: str,
    *,
    stage: str,
    green: float,
    plan: str | None = None,
    keep_cycle: bool = False,
) -> Scenario:
    """Give one stage of a light another green; intergreens stay.

    Parameters
    ----------
    lights
        Traffic lights of the map.
    stage
        Id; of the map's stages its number from 1.
    green
        Seconds.
    plan
        Plan of the day, of a program that has several.
    keep_cycle
        Take the seconds from the next stage, or give them to it; else the cycle becomes another.

    Raises
    ------
    NotFoundError
        If there is no such stage or plan.
    ScenarioError
        If no light is in the junction, or a green is too short or out of the stage's bounds.
    """
    light, old = timing_of_light(scenario, lights, junction)
    new = with_green(old, light, stage=stage, green=green, plan=plan, keep_cycle=keep_cycle)
    return with_timing(scenario, lights, new, strict=True)


@edit("Offset of light {junction}")
def set_offset(
    scenario: Scenario,
    lights: Sequence[Light],
    junction: str,
    *,
    offset: float,
    plan: str | None = None,
) -> Scenario:
    """Let the program of a light begin so many seconds into the scenario.

    Raises
    ------
    NotFoundError
        If there is no such plan.
    ScenarioError
        If no light is in the junction.
    """
    _, old = timing_of_light(scenario, lights, junction)
    return with_timing(scenario, lights, with_offset(old, offset, plan=plan))


@edit("Stage {stage} in junction {junction}")
def set_stage(
    scenario: Scenario,
    lights: Sequence[Light],
    junction: str,
    stage: str,
    **fields: Annotated[Any, ProgramStage],
) -> Scenario:
    """Change fields of a stage of a program of the scenario's own, such as ``on_call``.

    Raises
    ------
    InputError
        If the light has no program of its own, or the stage is to have another id.
    NotFoundError
        If there is no such stage.
    ScenarioError
        If greens conflict, or the stage cannot be timed so.
    """
    if "id" in fields:
        raise InputError(
            f"stage {stage!r} keeps its id: detectors and plans of the day refer to it"
        )
    _, old = own_program(scenario, lights, junction)
    return with_timing(scenario, lights, with_stage(old, stage, fields))


@edit("Turn from {approach}: {treatment}")
def set_turn(
    scenario: Scenario,
    lights: Sequence[Light],
    junction: str,
    *,
    approach: str,
    treatment: Literal["permissive", "protected", "both"],
    turn: Literal["left", "right"] = "left",
) -> Scenario:
    """Let a turn across oncoming traffic go through its gaps, with an arrow of its own, or both.

    Parameters
    ----------
    lights
        Traffic lights of the map.
    approach
        Segment before the junction.
    treatment
        ``protected``: only in a stage in which nobody meets it, which is made if there is none;
        ``both``: there and, giving way, with its approach.

    Raises
    ------
    InputError
        If the light has no program of its own, the approach has no such turn, or the turn has no
        lane for itself.
    ScenarioError
        If greens would conflict.
    """
    light, old = own_program(scenario, lights, junction)
    new = with_turn(old, light, approach=approach, turn=turn, treatment=treatment)
    return with_timing(scenario, lights, new)
