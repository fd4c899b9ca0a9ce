"""Changes to the parts of a light's program: groups, stages, intergreens, detectors, plans."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any

from odscen.base.errors import NotFoundError
from odscen.scenario.document.signals_document import (
    DayPlan,
    ProgramGroup,
    ProgramStage,
    SignalDetector,
)
from odscen.scenario.document.validation import validated
from odscen.scenario.edits.edit_registry import edit
from odscen.scenario.edits.edited_parts import changed_part, drop_part, put_part
from odscen.scenario.edits.edited_timings import own_program, timing_of_light, with_timing
from odscen.scenario.edits.group_changes import (
    with_greens_of,
    with_group,
    with_new_stage,
    without_group,
    without_stage,
)
from odscen.scenario.edits.program_changes import fitted_cycles
from odscen.scenario.signals.program_design import seconds_of_day

if TYPE_CHECKING:
    from collections.abc import Sequence

    from odscen.scenario.document.scenario_document import Scenario
    from odscen.scenario.signals.light import Light


@edit("Signal group {group} in junction {junction}")
def set_group(
    scenario: Scenario,
    lights: Sequence[Light],
    junction: str,
    group: str,
    *,
    protected: Sequence[str] | None = None,
    permissive: Sequence[str] | None = None,
    **fields: Annotated[Any, ProgramGroup],
) -> Scenario:
    """Put a signal group in, or change it; its movements leave the groups that had them.

    Parameters
    ----------
    lights
        Traffic lights of the map.
    group
        Id. A new one has green with the group from which its first movement comes, unless stages
        are given; one that is there keeps its stages.
    protected, permissive
        Stages in which it has green, and in which it has and gives way: instead of those before.
    fields
        Fields of :class:`~odscen.scenario.document.signals_document.ProgramGroup`; ``id`` renames.

    Raises
    ------
    InputError
        If the light has no program of its own, or a new group no movements.
    NotFoundError
        If there is no such stage.
    ScenarioError
        If greens conflict, or a movement would have no group.
    """
    light, old = own_program(scenario, lights, junction)
    new = with_group(old, light, group, fields)
    name = fields.get("id", group)
    new = with_greens_of(new, name, protected=protected, permissive=permissive)
    return with_timing(scenario, lights, fitted_cycles(new, light))


@edit("Remove signal group {group} from junction {junction}")
def remove_group(
    scenario: Scenario, lights: Sequence[Light], junction: str, *, group: str, into: str
) -> Scenario:
    """Take a signal group out; its movements join the group ``into``.

    Raises
    ------
    InputError
        If the light has no program of its own, or ``into`` is the same group.
    NotFoundError
        If there is no such group.
    ScenarioError
        If greens conflict then.
    """
    light, old = own_program(scenario, lights, junction)
    new = without_group(old, light, group, into)
    return with_timing(scenario, lights, fitted_cycles(new, light))


@edit("New stage {stage} in junction {junction}")
def add_stage(
    scenario: Scenario,
    lights: Sequence[Light],
    junction: str,
    stage: str,
    *,
    after: str | None = None,
    **fields: Annotated[Any, ProgramStage],
) -> Scenario:
    """Put a stage in, behind the stage ``after`` or at the end.

    Raises
    ------
    InputError
        If the light has no program of its own, or the id is taken.
    NotFoundError
        If there is no stage ``after``.
    ScenarioError
        If greens conflict, or the stage gives none.
    """
    light, old = own_program(scenario, lights, junction)
    new = validated(ProgramStage, {**fields, "id": stage})
    made = fitted_cycles(with_new_stage(old, new, after=after), light)
    return with_timing(scenario, lights, made)


@edit("Remove stage {stage} from junction {junction}")
def remove_stage(
    scenario: Scenario, lights: Sequence[Light], junction: str, *, stage: str
) -> Scenario:
    """Take a stage out, and detectors that prolong nothing else.

    Raises
    ------
    InputError
        If the light has no program of its own, or the stage is the only one.
    NotFoundError
        If there is no such stage.
    ScenarioError
        If a group would have no green.
    """
    light, old = own_program(scenario, lights, junction)
    return with_timing(scenario, lights, fitted_cycles(without_stage(old, stage), light))


@edit("Intergreen of {ending} and {beginning} in junction {junction}")
def set_intergreen(
    scenario: Scenario,
    lights: Sequence[Light],
    junction: str,
    *,
    ending: str,
    beginning: str,
    seconds: float | None,
) -> Scenario:
    """Say how long after the end of green of a group another may begin.

    Parameters
    ----------
    lights
        Traffic lights of the map.
    ending, beginning
        Groups.
    seconds
        From the end of green to the begin of green; ``None`` for what the paths need.

    Raises
    ------
    InputError
        If the light has no program of its own.
    ScenarioError
        If there is no such group, or one stage follows the other in which it would be too short.
    """
    light, old = own_program(scenario, lights, junction)
    rows = {row[:2]: row[2] for row in old.intergreens}
    if seconds is None:
        rows.pop((ending, beginning), None)
    else:
        rows[(ending, beginning)] = seconds
    new = changed_part(old, {"intergreens": tuple((*pair, s) for pair, s in rows.items())})
    known = {one.id for one in old.groups}
    if known.issuperset((ending, beginning)):
        new = fitted_cycles(new, light)
    return with_timing(scenario, lights, new)


@edit("Detector {detector} of light {junction}")
def set_detector(
    scenario: Scenario,
    lights: Sequence[Light],
    junction: str,
    detector: str,
    **fields: Annotated[Any, SignalDetector],
) -> Scenario:
    """Lay a loop before a light, or change one.

    Parameters
    ----------
    lights
        Traffic lights of the map.
    fields
        Fields of :class:`~odscen.scenario.document.signals_document.SignalDetector`; a new one
        needs ``at`` and ``stages``, ``id`` renames.

    Raises
    ------
    ScenarioError
        If no light is in the junction, there is no such stage, approach or lane, or a new one lacks
        a field.
    """
    _, old = timing_of_light(scenario, lights, junction)
    known = next((one for one in old.detectors if one.id == detector), None)
    new = (
        validated(SignalDetector, {"id": detector, **fields})
        if known is None
        else changed_part(known, fields)
    )
    detectors, _ = put_part(
        old.detectors, new, what="detector", instead_of=None if known is None else detector
    )
    return with_timing(scenario, lights, changed_part(old, {"detectors": detectors}))


@edit("Remove detector {detector} of light {junction}")
def remove_detector(
    scenario: Scenario, lights: Sequence[Light], junction: str, *, detector: str
) -> Scenario:
    """Take a detector out.

    Raises
    ------
    NotFoundError
        If there is none of this id.
    """
    _, old = timing_of_light(scenario, lights, junction)
    left = drop_part(old.detectors, "detector", detector)
    return with_timing(scenario, lights, changed_part(old, {"detectors": left}))


@edit("Plan {plan} of light {junction}")
def set_plan(
    scenario: Scenario,
    lights: Sequence[Light],
    junction: str,
    plan: str,
    **fields: Annotated[Any, DayPlan],
) -> Scenario:
    """Put a plan of the day in, or change one.

    Parameters
    ----------
    lights
        Traffic lights of the map.
    plan
        Id. The first one of a light begins at midnight unless ``times`` are given, and has the
        light's offset.
    fields
        Fields of :class:`~odscen.scenario.document.signals_document.DayPlan`; ``id`` renames. At
        the ``times`` no other plan begins any more.

    Raises
    ------
    InputError
        If the light has no program of its own.
    ScenarioError
        If a plan would never begin, or its cycle is not what its greens add up to.
    """
    light, old = own_program(scenario, lights, junction)
    first = {} if old.plans else {"times": ("00:00",), "offset": old.offset}
    known = next((one for one in old.plans if one.id == plan), None)
    new = (
        validated(DayPlan, {"id": plan, **first, **fields})
        if known is None
        else changed_part(known, fields)
    )
    plans, at = put_part(
        old.plans, new, what="plan of the day", instead_of=None if known is None else plan
    )
    own = set(map(seconds_of_day, new.times))
    left = tuple(
        one
        if index == at or "times" not in fields
        else changed_part(
            one, {"times": tuple(t for t in one.times if seconds_of_day(t) not in own)}
        )
        for index, one in enumerate(plans)
    )
    made = changed_part(old, {"plans": left, "offset": 0.0})
    orders = {name for one in left for name in (*one.stages, *one.green)}
    unknown = orders - {one.id for one in old.stages}
    return with_timing(
        scenario, lights, made if unknown or "cycle" in fields else fitted_cycles(made, light)
    )


@edit("Remove plan {plan} of light {junction}")
def remove_plan(
    scenario: Scenario, lights: Sequence[Light], junction: str, *, plan: str
) -> Scenario:
    """Take a plan of the day out; after the last one the program has its offset.

    Raises
    ------
    InputError
        If the light has no program of its own.
    NotFoundError
        If there is no such plan.
    ScenarioError
        If a plan that is left would never begin.
    """
    light, old = own_program(scenario, lights, junction)
    gone = next((one for one in old.plans if one.id == plan), None)
    if gone is None:
        raise NotFoundError("plan of the day", plan, [one.id for one in old.plans])
    left = tuple(one for one in old.plans if one is not gone)
    changes: dict[str, Any] = {"plans": left}
    if not left:
        changes["offset"] = gone.offset
    return with_timing(scenario, lights, fitted_cycles(changed_part(old, changes), light))
