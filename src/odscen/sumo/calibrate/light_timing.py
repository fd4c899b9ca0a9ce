"""A light timed after its demand: its stages as Webster sees them, and the scenario's entry."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from odscen.base.errors import InputError
from odscen.convert.signals.signal_programs import LEAST_GREEN, WALK_GREEN
from odscen.scenario.document.signals_document import JunctionTiming
from odscen.scenario.signals.webster import SATURATION_FLOW, StageNeed, divided_greens, webster
from odscen.sumo.calibrate.lane_loads import LaneLoad, LightDemand, MovementVolume

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from odscen.convert.lane_table.table import SumoLight
    from odscen.records.light_programs import LightProgram, ProgramPhase, ShownPlan
    from odscen.scenario.document.scenario_document import Scenario
    from odscen.scenario.document.signals_document import DayPlan, ProgramStage
    from odscen.scenario.signals.light import Light
    from odscen.scenario.signals.webster import Splits
    from odscen.sumo.calibrate.turning_volumes import Turn, TurnVolume
    from odscen.sumo.realize.sumo_map import SumoMap

_SAME = 1e-6
"""Seconds by which cycles may differ that are one."""

SATURATED = 1.0
"""Degree of saturation (v/c) above which a lane is oversaturated."""


@dataclass(frozen=True, slots=True)
class TimedLane:
    """A lane with its load, and what the new program gives it.

    ``green`` in seconds of a cycle; ``degree`` is volume over capacity (v/c), ``None`` if movements
    of the lane never have green together.
    """

    load: LaneLoad
    green: float
    degree: float | None


@dataclass(frozen=True, slots=True)
class LightTimes:
    """Seconds of the stages of a light.

    Attributes
    ----------
    junctions
        What scenarios call it.
    plan
        Plan of the day; ``None`` without such plans.
    stages
        Ids of the stages in order.
    green
        Seconds of each.
    cycle
        Seconds.
    """

    junctions: tuple[str, ...]
    plan: str | None
    stages: tuple[str, ...]
    green: tuple[float, ...]
    cycle: float


@dataclass(frozen=True, slots=True)
class TimedLight:
    """A light with cycle and greens for its demand.

    Attributes
    ----------
    times, before
        As timed, and as it was.
    splits
        What Webster's method says.
    movements, lanes
        Where vehicles come from and go to; lanes without any are left out.
    """

    times: LightTimes
    before: LightTimes
    splits: Splits
    movements: tuple[MovementVolume, ...]
    lanes: tuple[TimedLane, ...]

    @property
    def oversaturated(self) -> tuple[TimedLane, ...]:
        """Lanes to which more vehicles come than have green."""
        return tuple(lane for lane in self.lanes if (lane.degree or 0.0) > SATURATED)


def timed_light(
    light: SumoLight,
    view: Light,
    shown: LightProgram,
    sumo_map: SumoMap,
    volumes: Mapping[Turn, TurnVolume],
    *,
    timing: JunctionTiming | None,
    begin: float = 0.0,
    bounds: tuple[float, float],
    saturation: float = SATURATION_FLOW,
    cycle: float | None = None,
) -> TimedLight | None:
    """Time one light; ``None`` if no vehicle comes to it.

    Parameters
    ----------
    shown
        The light's program.
    timing
        What the scenario says of it.
    begin
        Seconds of the scenario at which the plan of the day is active that is timed.
    bounds
        Shortest and longest cycle, seconds.
    saturation
        Base saturation flow, passenger cars an hour and lane.
    cycle
        Seconds, if given.
    """
    plan = plan_at(shown, begin)
    phases = merged_phases(plan.phases)
    demand = LightDemand(light, view, sumo_map, volumes, phases=phases, saturation=saturation)
    if not demand.lanes:
        return None
    needs = stage_needs(phases, view, timing)
    between = sum(phase.seconds for phase in phases if not phase.stage)
    splits = webster(needs, demand.needs(), between=between, bounds=bounds, cycle=cycle)
    new = with_greens(phases, splits.greens)
    lanes = tuple(TimedLane(load, load.green(new), load.degree(new)) for load in demand.lanes)
    before = light_times(shown, timing, begin)
    times = replace(before, green=splits.greens, cycle=splits.cycle)
    return TimedLight(times, before, splits, demand.movements, lanes)


def light_times(shown: LightProgram, timing: JunctionTiming | None, begin: float) -> LightTimes:
    """Times of a light as it is."""
    plan = plan_at(shown, begin)
    stages = [phase for phase in merged_phases(plan.phases) if phase.stage]
    return LightTimes(
        shown.junctions,
        plan.id if timing is not None and timing.plans else None,
        tuple(phase.stage for phase in stages),
        tuple(phase.seconds for phase in stages),
        plan.cycle,
    )


def plan_at(shown: LightProgram, time: float) -> ShownPlan:
    """Plan of the day that is active ``time`` seconds after the begin of the scenario."""
    begun = [(at, plan) for plan in shown.plans for at in plan.begins if at <= time]
    return max(begun, key=lambda pair: pair[0])[1] if begun else shown.plans[0]


def merged_phases(phases: Sequence[ProgramPhase]) -> tuple[ProgramPhase, ...]:
    """Phases, with the parts of one green as one."""
    program_phases: list[ProgramPhase] = []
    for phase in phases:
        if program_phases and phase.stage and program_phases[-1].stage == phase.stage:
            program_phases[-1] = program_phases[-1]._replace(
                seconds=program_phases[-1].seconds + phase.seconds
            )
        else:
            program_phases.append(phase)
    return tuple(program_phases)


def with_greens(
    phases: Sequence[ProgramPhase], greens: Sequence[float]
) -> tuple[ProgramPhase, ...]:
    """Phases with other seconds of green."""
    left = iter(greens)
    return tuple(phase._replace(seconds=next(left)) if phase.stage else phase for phase in phases)


def stage_needs(
    phases: Sequence[ProgramPhase], view: Light, timing: JunctionTiming | None
) -> tuple[StageNeed, ...]:
    """Least greens of the stages, and what vehicles have beyond the green of each.

    Stages in which only crossings have green keep their seconds. The least green of others is
    their ``min_green``, or 8 s (less where the stage has less), and 7 s with a crossing.
    """
    own = {stage.id: stage.min_green for stage in timing.stages} if timing else {}
    letters = list(zip(*(phase.state for phase in phases if phase.stage), strict=True))
    both = {n for n, shown in enumerate(letters) if {"g", "G"} <= set(shown)}
    needs = []
    for number, phase in enumerate(phases):
        if not phase.stage:
            continue
        green = {n for n, letter in enumerate(phase.state) if letter in "Gg"}
        cars = {n for n in green if not view.movements[n].walk}
        if not cars:
            needs.append(StageNeed(phase.seconds, fixed=True))
            continue
        given = own.get(phase.stage)
        least = min(LEAST_GREEN, phase.seconds) if given is None else given
        if green - cars:
            least = max(least, min(WALK_GREEN, phase.seconds))
        shown = {n: "G" if n in both and phase.state[n] == "G" else "Gg" for n in cars}
        more = _green_beside(phases[number + 1 :], shown) + _green_beside(
            phases[:number][::-1], shown
        )
        needs.append(StageNeed(least, more))
    return tuple(needs)


def _green_beside(phases: Sequence[ProgramPhase], shown: Mapping[int, str]) -> float:
    """Seconds in which links keep their greens (letters) in the phases next to a stage.

    A protected-permissive turn that is protected in the stage does not keep that by giving way.
    """
    seconds = 0.0
    for phase in phases:
        if phase.stage or any(phase.state[n] not in greens for n, greens in shown.items()):
            break
        seconds += phase.seconds
    return seconds


def stretched(
    shown: LightProgram, view: Light, timing: JunctionTiming | None, cycle: float
) -> LightTimes:
    """Times of a light in another cycle: greens in proportion to what they are.

    Raises
    ------
    InputError
        If least greens and intergreens do not fit into it.
    """
    before = light_times(shown, timing, 0.0)
    phases = merged_phases(plan_at(shown, 0.0).phases)
    needs = stage_needs(phases, view, timing)
    between = sum(phase.seconds for phase in phases if not phase.stage)
    least = between + sum(need.least for need in needs)
    if least > cycle:
        raise InputError(
            f"the light of junction {', '.join(shown.junctions)} needs a cycle of {least:g} s for "
            f"its least greens and intergreens, but it is to be {cycle:g} s"
        )
    if abs(before.cycle - cycle) < _SAME:
        return before
    weights = [green + need.more for green, need in zip(before.green, needs, strict=True)]
    return replace(before, green=divided_greens(needs, weights, cycle - between), cycle=cycle)


def retimed(
    scenario: Scenario, times: LightTimes, *, hold: bool = False, **changes: object
) -> JunctionTiming:
    """Entry of the scenario for a light with new times.

    Parameters
    ----------
    hold
        Whether the entry is to say the cycle even where it did not.
    changes
        Further fields of the entry; ``offset`` of one with plans of the day is the plan's.
    """
    timing = timing_of(scenario, times.junctions)
    if timing is None:
        timing = JunctionTiming(junction=times.junctions[0])
    if not timing.stages:
        return timing.model_copy(update={"green": times.green, **changes})
    greens = dict(zip(times.stages, times.green, strict=True))
    if times.plan is None:
        stages = tuple(_with_green(stage, greens.get(stage.id)) for stage in timing.stages)
        cycle = times.cycle if hold or timing.cycle is not None else None
        return timing.model_copy(update={"stages": stages, "cycle": cycle, **changes})
    own = {"offset": changes.pop("offset")} if "offset" in changes else {}
    plans = tuple(
        _retimed_plan(plan, times, greens, kept=hold or timing.cycle is not None).model_copy(
            update=own
        )
        if plan.id == times.plan
        else plan
        for plan in timing.plans
    )
    return timing.model_copy(update={"plans": plans, **changes})


def timing_of(scenario: Scenario, junctions: Sequence[str]) -> JunctionTiming | None:
    """What a scenario says of the light of these junctions."""
    own = (junction for junction in scenario.signals.junctions if junction.junction in junctions)
    return next(own, None)


def _with_green(stage: ProgramStage, green: float | None) -> ProgramStage:
    if green is None:
        return stage
    most = None if stage.max_green is None else max(stage.max_green, green)
    return stage.model_copy(update={"green": green, "max_green": most})


def _retimed_plan(
    plan: DayPlan, times: LightTimes, greens: Mapping[str, float], *, kept: bool
) -> DayPlan:
    most = {name: max(s, greens.get(name, s)) for name, s in plan.max_green.items()}
    cycle = times.cycle if kept or plan.cycle is not None else None
    changes = {"green": {**plan.green, **greens}, "max_green": most, "cycle": cycle}
    return plan.model_copy(update=changes)


def with_timings(scenario: Scenario, timings: Sequence[JunctionTiming]) -> Scenario:
    """Return a scenario in which lights have these entries in place of their own."""
    new = {timing.junction: timing for timing in timings}
    kept = tuple(new.pop(junction.junction, junction) for junction in scenario.signals.junctions)
    signals = scenario.signals.model_copy(update={"junctions": (*kept, *new.values())})
    return scenario.model_copy(update={"signals": signals})
