"""Phases of SUMO for a plan of stages, with what decides on the way from one to the next.

A stage on call comes only if somebody waits: SUMO chooses among the ways that ``next`` lists, by
``earlyTarget`` while the green may end and by ``finalTarget`` when it must. With a fixed cycle the
stage before is held for as long as one that was not called would have taken.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise
from typing import TYPE_CHECKING

from odscen.convert.model.extended_greens import longer_by
from odscen.convert.model.net import CROSSED, STAGE
from odscen.convert.signals.signal_programs import LEAST_GREEN, PROLONGED
from odscen.scenario.signals.program_design import (
    change_length,
    change_steps,
    cycle_length,
    stage_state,
)
from odscen.sumo.realize.lights.light_detectors import BUS_GREEN, bus_in

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from odscen.convert.lane_table.table import SumoLight
    from odscen.scenario.signals.program_design import DesignedProgram, PlannedStage, TimedPlan
    from odscen.sumo.realize.lights.light_detectors import BusArea

HOLD = "hold "
"""How the names of phases begin that hold a stage for one that was not called."""


@dataclass(frozen=True, slots=True)
class SumoPhase:
    """One ``<phase>``; ``following`` are indices, ``early`` and ``final`` expressions.

    ``earliest_end`` and ``latest_end`` are seconds of the cycle; ``stage`` is the id of a stage.
    """

    seconds: float
    state: str
    name: str
    stage: str = ""
    least: float = 0.0
    most: float = 0.0
    following: tuple[int, ...] = ()
    early: str = ""
    final: str = ""
    earliest_end: float | None = None
    latest_end: float | None = None
    on_call: bool = False

    @property
    def prolonged(self) -> bool:
        """Whether vehicles prolong it."""
        return self.most > self.least


@dataclass(frozen=True, slots=True)
class PhasePlan:
    """Phases; the first ``main`` are one cycle in which every stage comes.

    ``first`` is where the first stage is.
    """

    phases: tuple[SumoPhase, ...]
    main: int
    first: int = 0

    @property
    def cycle(self) -> tuple[SumoPhase, ...]:
        """The phases of one cycle from the first stage on."""
        return (*self.phases[self.first : self.main], *self.phases[: self.first])

    @property
    def chooses(self) -> bool:
        """Whether SUMO has to choose among ways."""
        return any(len(phase.following) > 1 for phase in self.phases)


def kept_phases(light: SumoLight, green: Sequence[float]) -> list[SumoPhase]:
    """Phases of the network's program, with other seconds of green if there is one for each stage.

    Times for other stages are those of a network that the map had before. A network by another
    converter may have no bounds: vehicles then prolong its stages as those of ours.
    """
    stages = sum(phase.is_stage for phase in light.phases)
    bounded = any(phase.most > phase.least for phase in light.phases)
    greens = iter(green if len(green) == stages else ())
    phases = []
    for phase in light.phases:
        stage = phase.name.removeprefix(STAGE) if phase.is_stage else ""
        seconds = next(greens, phase.duration) if phase.is_stage else phase.duration
        least = min(phase.least, seconds)
        most = phase.most * seconds / phase.duration if phase.is_stage else phase.most
        if phase.is_stage and not bounded and _vehicles_have_green(phase.state, light):
            least, most = min(LEAST_GREEN, seconds), PROLONGED * seconds
        phases.append(SumoPhase(seconds, phase.state, phase.name, stage, least, most))
    return phases


def extended_phases(phases: Sequence[SumoPhase]) -> list[SumoPhase]:
    """Phases of which each green for vehicles may last longer, by as much as each other."""
    more = longer_by(phases, sum(phase.seconds for phase in phases))
    return [
        replace(phase, least=phase.seconds, most=phase.seconds + more) if phase.prolonged else phase
        for phase in phases
    ]


def _vehicles_have_green(state: str, light: SumoLight) -> bool:
    """Whether a vehicle has green."""
    return any(
        letter in "Gg" and link.turn != CROSSED
        for letter, link in zip(state, light.links, strict=False)
    )


def kept_cycle(program: DesignedProgram, plan: TimedPlan) -> float | None:
    """Seconds of the cycle that SUMO has to keep to by itself; ``None`` if there is none to keep.

    Fixed times keep their cycle anyhow, unless stages are left out.
    """
    if program.control == "actuated":
        return plan.cycle
    if any(stage.on_call for stage in plan.stages):
        return cycle_length(program, plan.stages)
    return None


def started_offset(plan: PhasePlan, offset: float) -> float:
    """Offset by which SUMO, which counts all phases as one cycle, starts where ours does."""
    cycle = sum(phase.seconds for phase in plan.cycle)
    total = sum(phase.seconds for phase in plan.phases)
    return offset if total == cycle else (total - (-offset % cycle)) % total


def calling_movements(program: DesignedProgram) -> dict[str, set[int]]:
    """Movements whose road users call each stage on call.

    Those that have no green otherwise; if all have, those on foot, or without any all of them.
    """
    stages = program.timing.stages
    walks = {name for name, group in program.groups.items() if group.walk}
    served = {name for stage in stages if not stage.on_call for name in stage.groups}
    movements_by_stage = {}
    for stage in stages:
        if stage.on_call:
            own = set(stage.groups)
            calling = own - served or own & walks or own
            movements_by_stage[stage.id] = {
                n for name in calling for n in program.groups[name].movements
            }
    return movements_by_stage


def plan_phases(
    program: DesignedProgram,
    plan: TimedPlan,
    *,
    ends: Mapping[str, str],
    calls: Mapping[str, str],
    switched: bool = False,
) -> PhasePlan:
    """Phases of a plan.

    Parameters
    ----------
    ends
        Names of conditions under which a stage may end; stages without one last their green.
    calls
        Names of conditions under which somebody calls a stage.
    switched
        Whether other plans are switched to this one. SUMO then begins with the first stage, but
        asks whether to end it when another phase would have ended: so its least green is a phase
        of its own, which only time ends.
    """
    return _Phases(program, plan, dict(ends), dict(calls), switched=switched).build()


class _Phases:
    def __init__(
        self,
        program: DesignedProgram,
        plan: TimedPlan,
        ends: dict[str, str],
        calls: dict[str, str],
        *,
        switched: bool,
    ) -> None:
        self._program = program
        self._plan = plan
        self._stages = plan.stages
        self._ends = ends
        self._calls = calls
        self._cycle = kept_cycle(program, plan)
        if self._cycle is not None:
            self._ends[plan.stages[0].id] = "1"
        self._switched = switched
        self._phases: list[SumoPhase] = []
        self._first: list[int] = []
        self._last: list[int] = []

    def build(self) -> PhasePlan:
        for number, stage in enumerate(self._stages):
            self._first.append(len(self._phases))
            self._phases += self._green_phases(number, stage)
            self._last.append(len(self._phases) - 1)
            self._append_change(number, self._stage_after(number))
        main = len(self._phases)
        for number in range(len(self._stages)):
            self._decide_ways(number)
        if len(self._phases) > main and not self._phases[main - 1].following:
            self._phases[main - 1] = replace(self._phases[main - 1], following=(0,))
        if self._cycle is not None:
            self._coordinate_stages(self._cycle)
            return _rotate_to_stage_end(self._phases, main, self._last[0])
        return PhasePlan(tuple(self._phases), main)

    def _stage_after(self, number: int) -> int:
        return (number + 1) % len(self._stages)

    def _green_phases(self, number: int, stage: PlannedStage) -> list[SumoPhase]:
        """Phase of a stage; of the first one perhaps two, of which the other may be ended."""
        green = self._green_phase(stage)
        if not (self._switched and number == 0 and stage.id in self._ends and green.least > 1.0):
            return [green]
        fixed = green.least - 1.0
        return [
            replace(green, seconds=fixed, least=0.0, most=0.0, following=(1,)),
            replace(
                green,
                seconds=green.seconds - fixed,
                least=1.0,
                most=green.most - fixed,
                final="1",
            ),
        ]

    def _green_phase(self, stage: PlannedStage) -> SumoPhase:
        bounds = (stage.least, stage.most) if stage.id in self._ends else (0.0, 0.0)
        state = stage_state(self._program, stage)
        name = f"{STAGE}{stage.id}"
        return SumoPhase(stage.green, state, name, stage.id, *bounds, on_call=stage.on_call)

    def _append_change(self, number: int, following: int) -> None:
        """Append the steps from one stage to another."""
        steps = change_steps(self._program, self._stages[number], self._stages[following])
        self._phases += [SumoPhase(*step) for step in steps]

    def _decide_ways(self, number: int) -> None:
        """Say where a stage leads, and lay the ways past stages that were not called."""
        stage, at = self._stages[number], self._last[number]
        end = self._ends.get(stage.id, "")
        way = self._stage_after(number)
        ways: list[int] = [self._entry_phase(number, way)]
        passed = [way]
        while self._stages[way].on_call and len(passed) < len(self._stages):
            self._add_conditions(ways[-1], end, self._calls[self._stages[way].id])
            way = self._stage_after(way)
            ways.append(self._append_way_past(number, way, passed))
            passed.append(way)
        self._add_conditions(ways[-1], end, "")
        if self._switched and number == 0:
            self._phases[ways[-1]] = replace(self._phases[ways[-1]], final="1")
        if len(ways) > 1:
            self._phases[at] = replace(self._phases[at], following=tuple(ways))

    def _entry_phase(self, number: int, following: int) -> int:
        """First phase on the direct way from a stage to the next."""
        after = self._last[number] + 1
        return (
            after
            if self._phases[after : after + 1] and not self._phases[after].stage
            else (self._first[following])
        )

    def _append_way_past(self, number: int, following: int, passed: list[int]) -> int:
        """Append the way past stages, and return its first phase."""
        stage, target = self._stages[number], self._stages[following]
        first = len(self._phases)
        if self._cycle is not None:
            order = [number, *passed, following]
            pairs = pairwise(order)
            between = sum(
                change_length(self._program, self._stages[a], self._stages[b]) for a, b in pairs
            )
            greens = sum(self._stages[n].green for n in passed)
            rest = between + greens - change_length(self._program, stage, target)
            green = self._phases[self._last[number]]
            self._phases.append(SumoPhase(rest, green.state, f"{HOLD}{stage.id}", stage.id))
        self._append_change(number, following)
        last = len(self._phases) - 1
        if last < first:
            return self._first[following]
        for index in range(first, last):
            self._phases[index] = replace(self._phases[index], following=(index + 1,))
        self._phases[last] = replace(self._phases[last], following=(self._first[following],))
        return first

    def _add_conditions(self, phase: int, end: str, call: str) -> None:
        """Say when a phase is the one to go to: if the green may end, and somebody has called."""
        early = " and ".join(name for name in (end, call) if name)
        self._phases[phase] = replace(
            self._phases[phase], early=early if end else "", final=call or ("1" if end else "")
        )

    def _coordinate_stages(self, cycle: float) -> None:
        """End stages at their places in the cycle at the latest, and the first exactly there.

        What the others leave over, the first stage has. SUMO counts the cycle from its end: only
        so it can be held past the end of a cycle.
        """
        at = self._last[0]
        first = self._phases[at]
        self._phases[at] = replace(first, most=2.0 * cycle, earliest_end=cycle)
        now = 0.0
        for index, phase in enumerate(self._phases[at + 1 :], start=at + 1):
            now += phase.seconds
            if phase.prolonged:
                self._phases[index] = replace(phase, latest_end=now)


def _rotate_to_stage_end(phases: list[SumoPhase], main: int, last: int) -> PhasePlan:
    """Phases in the order in which SUMO counts the cycle: the first stage comes last."""
    order = [*range(last + 1, main), *range(last + 1), *range(main, len(phases))]
    place = {old: new for new, old in enumerate(order)}
    phases[last] = replace(phases[last], following=phases[last].following or (last + 1,))
    turned = [
        replace(phases[old], following=tuple(place[n] for n in phases[old].following))
        for old in order
    ]
    return PhasePlan(tuple(turned), main, place[0])


def bus_phases(
    plan: PhasePlan,
    green: Mapping[str, set[int]],
    areas: Sequence[BusArea],
    conditions: dict[str, str],
) -> PhasePlan:
    """Phases of a fixed-time program in which buses have priority.

    A green with a bus coming to it is followed by one of the same state, which ends with the bus;
    one for which none comes ends early, after its least green, while one waits elsewhere.

    Parameters
    ----------
    green
        Movements that have green in each stage.
    conditions
        Conditions of the program, to which those of buses are added.
    """
    phases = list(plan.phases)
    main = len(phases)
    for at in range(main):
        stage = phases[at]
        own, other = bus_in(areas, green[stage.stage]) if stage.stage else ("0", "0")
        after = (at + 1) % main
        if own == "0" or phases[after].stage:
            continue
        came, waits = f"bus{stage.stage}", f"waits{stage.stage}"
        conditions |= {came: own, waits: other}
        longer = len(phases)
        phases += _bus_green(phases[:main], at, longer, came)
        least = min(stage.least or LEAST_GREEN, stage.seconds)
        following = (longer, after)
        phases[at] = replace(stage, least=least, most=stage.seconds, following=following)
        early = f"({waits} > 0) and ({came} < 1)"
        phases[after] = replace(phases[after], early=early, final="1")
    if len(phases) > main and not phases[main - 1].following:
        phases[main - 1] = replace(phases[main - 1], following=(0,))
    return PhasePlan(tuple(phases), main, plan.first)


def _bus_green(main: Sequence[SumoPhase], at: int, first: int, came: str) -> list[SumoPhase]:
    """Longer green of the stage at ``at``, and its own change to the next stage.

    ``first`` is the index that it will have; ``came`` the condition that a bus comes to it.
    """
    count = len(main)
    order = [n % count for n in range(at + 1, at + count)]
    behind = next((n for n in order if main[n].stage), at)
    change = [main[n] for n in order[: order.index(behind) if behind != at else None]]
    longer = replace(
        main[at], seconds=BUS_GREEN, name=f"{HOLD}{main[at].stage}", least=1.0, most=BUS_GREEN,
        following=(first + 1,), early="0", final=came,
    )  # fmt: skip
    phases = [longer]
    for number, phase in enumerate(change, start=first + 1):
        last = number == first + len(change)
        early, final = (f"({came} < 1)", "1") if number == first + 1 else ("", "")
        following = (behind if last else number + 1,)
        phases.append(replace(phase, following=following, early=early, final=final))
    return phases
