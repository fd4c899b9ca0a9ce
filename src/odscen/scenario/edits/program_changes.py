"""The timing of a light with one thing changed: the green of a stage, the offset, a stage.

A green that becomes another changes the cycle where the document says one, or the stage after it.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

from odscen.base.errors import InputError, NotFoundError, ScenarioError
from odscen.scenario.checks.signal_checks import LEAST_GREEN, no_light_in, signal_problems
from odscen.scenario.document.problems import refuse_errors, validated
from odscen.scenario.document.signals_document import JunctionTiming
from odscen.scenario.edits.edit_registry import changed_part, with_fields
from odscen.scenario.signals.light import find_light
from odscen.scenario.signals.program_design import DesignedProgram, PlannedStage, cycle_length

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from odscen.scenario.document.scenario_document import Scenario
    from odscen.scenario.document.signals_document import DayPlan
    from odscen.scenario.signals.light import Light


def timing_of_light(
    scenario: Scenario, lights: Sequence[Light], junction: str
) -> tuple[Light, JunctionTiming]:
    """The light in a junction, and what the scenario says of it.

    Raises
    ------
    ScenarioError
        If no light is in the junction.
    """
    light = find_light(lights, junction)
    timings = scenario.signals.junctions
    if light is None:
        element = f"signals.junctions[{len(timings)}].junction"
        raise ScenarioError(no_light_in(junction, lights), element=element)
    known = next((timing for timing in timings if timing.junction in light.names), None)
    return light, known or validated(JunctionTiming, {"junction": junction})


def own_program(
    scenario: Scenario, lights: Sequence[Light], junction: str
) -> tuple[Light, JunctionTiming]:
    """A light with a program of the scenario's own.

    Raises
    ------
    InputError
        If it has none.
    ScenarioError
        If no light is in the junction.
    """
    light, timing = timing_of_light(scenario, lights, junction)
    if not timing.stages:
        raise InputError(
            f"the light of junction {junction!r} has no program of this scenario; take over that "
            "of the map first"
        )
    return light, timing


def with_timing(
    scenario: Scenario, lights: Sequence[Light], new: JunctionTiming, *, strict: bool = False
) -> Scenario:
    """Put a timing in the place of that of its junction, or at the end.

    ``strict`` if its greens are new: a file may have greens of a former network, but who changes
    them now gives one for each stage.
    """
    timings = scenario.signals.junctions
    names = [timing.junction for timing in timings]
    index = names.index(new.junction) if new.junction in names else len(names)
    changed = (*timings[:index], new, *timings[index + 1 :])
    signals = changed_part(scenario.signals, {"junctions": changed})
    place = f"signals.junctions[{index}].green"
    refuse_errors(
        replace(signal_problem, severity="error")
        if strict and signal_problem.where == place
        else signal_problem
        for signal_problem in signal_problems(signals, lights)
    )
    return with_fields(scenario, signals=signals)


def with_green(
    timing: JunctionTiming,
    light: Light,
    *,
    stage: str,
    green: float,
    plan: str | None,
    keep_cycle: bool,
) -> JunctionTiming:
    """Give a stage another green.

    Parameters
    ----------
    stage
        Id; of the map's stages its number from 1.
    green
        Seconds.
    plan
        Plan of the day, of a program that has several.
    keep_cycle
        The next stage gives or takes the seconds, so that the cycle stays.

    Raises
    ------
    NotFoundError
        If there is no such stage or plan.
    ScenarioError
        If the green of this stage, or of the next one, becomes too short.
    """
    stages = stages_in_plan(timing, light, plan)
    old = {stage.id: stage.green for stage in stages}
    if stage not in old:
        raise NotFoundError(f"stage of the light of junction {timing.junction!r}", stage, list(old))
    greens = {stage: green}
    if keep_cycle:
        other = _next_stage(stages, stage)
        greens[other] = round(old[other] + old[stage] - green, 6)
    for name, seconds in greens.items():
        _refuse_short(timing, name, seconds, old[name], given=name == stage)
    if not timing.stages:
        return changed_part(
            timing, {"green": tuple(greens.get(stage.id, stage.green) for stage in stages)}
        )
    return _with_greens(timing, light, greens, plan)


def _next_stage(stages: Sequence[PlannedStage], stage: str) -> str:
    """The stage that gives or takes seconds: the next one that is not on call."""
    ids = [stage.id for stage in stages]
    at = ids.index(stage)
    turned = (*stages[at + 1 :], *stages[:at])
    found = next((stage.id for stage in turned if not stage.on_call), None)
    if found is None:
        raise ScenarioError(
            f"stage {stage!r} has no stage beside it that could give or take its seconds"
        )
    return found


def _refuse_short(
    timing: JunctionTiming, stage: str, green: float, before: float, *, given: bool
) -> None:
    """Raise for a green that drivers would not take for one; shorter ones of before may stay."""
    if green >= min(LEAST_GREEN, before):
        return
    where = f"the light of junction {timing.junction!r}"
    msg = (
        f"{green:g} s is too short for a green; give stage {stage} of {where} at least "
        f"{LEAST_GREEN:g} s"
        if given
        else f"stage {stage} of {where} would have {green:g} s of green, but needs at least "
        f"{LEAST_GREEN:g} s; let the cycle become longer instead"
    )
    raise ScenarioError(msg)


def stages_in_plan(
    timing: JunctionTiming, light: Light, plan: str | None
) -> tuple[PlannedStage, ...]:
    """Stages with their greens in one plan; of a light with the map's stages those.

    Raises
    ------
    InputError
        If the program has plans of the day and none is named.
    NotFoundError
        If there is no such plan.
    """
    if timing.stages:
        designed = DesignedProgram(timing, light, "fixed").plans()
        if timing.plans:
            plan = _plan_named(timing, plan).id
            return next(timed_plan.stages for timed_plan in designed if timed_plan.id == plan)
        return designed[0].stages
    greens = timing.green if len(timing.green) == len(light.green) else light.green
    none: frozenset[str] = frozenset()
    return tuple(
        PlannedStage(str(n + 1), none, none, green, green, green, on_call=False)
        for n, green in enumerate(greens)
    )


def _plan_named(timing: JunctionTiming, name: str | None) -> DayPlan:
    ids = [plan.id for plan in timing.plans]
    if name is None:
        raise InputError(
            f"the light of junction {timing.junction!r} has plans of the day: name one of "
            f"{', '.join(ids)}"
        )
    if name not in ids:
        raise NotFoundError("plan of the day", name, ids)
    return timing.plans[ids.index(name)]


def _with_greens(
    timing: JunctionTiming, light: Light, greens: Mapping[str, float], plan: str | None
) -> JunctionTiming:
    if not timing.plans:
        stages = tuple(
            changed_part(stage, {"green": greens[stage.id]}) if stage.id in greens else stage
            for stage in timing.stages
        )
        return fitted_cycles(changed_part(timing, {"stages": stages}), light)
    own = _plan_named(timing, plan)
    new = changed_part(own, {"green": {**own.green, **greens}})
    return fitted_cycles(_with_plan(timing, new), light)


def fitted_cycles(timing: JunctionTiming, light: Light) -> JunctionTiming:
    """Let the cycles that a program says be what its greens and intergreens add up to."""
    lengths = {
        plan.id: cycle_length(DesignedProgram(timing, light, "fixed"), plan.stages)
        for plan in DesignedProgram(timing, light, "fixed").plans()
        if plan.cycle is not None
    }
    if not lengths:
        return timing
    if not timing.plans:
        return changed_part(timing, {"cycle": next(iter(lengths.values()))})
    for plan in timing.plans:
        if plan.id in lengths:
            timing = _with_plan(timing, changed_part(plan, {"cycle": lengths[plan.id]}))
    return timing


def _with_plan(timing: JunctionTiming, new: DayPlan) -> JunctionTiming:
    plans = tuple(new if plan.id == new.id else plan for plan in timing.plans)
    return changed_part(timing, {"plans": plans})


def with_offset(timing: JunctionTiming, offset: float, *, plan: str | None) -> JunctionTiming:
    """Let a program, or one plan of the day, begin so many seconds into the scenario.

    Raises
    ------
    NotFoundError
        If there is no such plan.
    """
    if not timing.plans:
        return changed_part(timing, {"offset": offset})
    return _with_plan(timing, changed_part(_plan_named(timing, plan), {"offset": offset}))


def with_stage(timing: JunctionTiming, stage: str, fields: Mapping[str, Any]) -> JunctionTiming:
    """Change fields of a stage.

    Raises
    ------
    NotFoundError
        If there is no such stage.
    """
    ids = [stage.id for stage in timing.stages]
    if stage not in ids:
        raise NotFoundError(f"stage of the light of junction {timing.junction!r}", stage, ids)
    stages = tuple(
        changed_part(program_stage, fields) if program_stage.id == stage else program_stage
        for program_stage in timing.stages
    )
    return changed_part(timing, {"stages": stages})
