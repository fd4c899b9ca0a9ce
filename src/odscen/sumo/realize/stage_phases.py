"""Phases of SUMO for a plan of stages, with what decides on the way from one to the next.

A stage on call comes only if somebody waits: SUMO chooses among the ways that ``next`` lists, by
``earlyTarget`` while the green may end and by ``finalTarget`` when it must. With a fixed cycle the
stage before is held for as long as one that was not called would have taken.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise
from typing import TYPE_CHECKING

from odscen.convert.model.net import STAGE
from odscen.scenario.signals.stage_sequence import change_length, change_steps, stage_state

if TYPE_CHECKING:
    from collections.abc import Mapping

    from odscen.scenario.signals.program_design import DesignedProgram, PlannedStage, TimedPlan

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
    """Phases; the first ``main`` are one cycle in which every stage comes."""

    phases: tuple[SumoPhase, ...]
    main: int

    @property
    def chooses(self) -> bool:
        """Whether SUMO has to choose among ways."""
        return any(len(phase.following) > 1 for phase in self.phases)


def plan_phases(
    program: DesignedProgram, plan: TimedPlan, *, ends: Mapping[str, str], calls: Mapping[str, str]
) -> PhasePlan:
    """Phases of a plan.

    Parameters
    ----------
    ends
        Names of conditions under which a stage may end; stages without one last their green.
    calls
        Names of conditions under which somebody calls a stage.
    """
    return _Phases(program, plan, dict(ends), dict(calls)).build()


class _Phases:
    def __init__(
        self,
        program: DesignedProgram,
        plan: TimedPlan,
        ends: dict[str, str],
        calls: dict[str, str],
    ) -> None:
        self._program = program
        self._plan = plan
        self._stages = plan.stages
        self._ends = ends
        self._calls = calls
        self._coordinated = program.control == "actuated" and plan.cycle is not None
        if self._coordinated:
            self._ends[plan.stages[0].id] = "1"
        self._keeps_cycle = program.control == "fixed" or plan.cycle is not None
        self._phases: list[SumoPhase] = []
        self._first: list[int] = []

    def build(self) -> PhasePlan:
        for number, stage in enumerate(self._stages):
            self._first.append(len(self._phases))
            self._phases.append(self._green(stage))
            self._change(number, self._after(number))
        main = len(self._phases)
        for number in range(len(self._stages)):
            self._decide(number)
        if len(self._phases) > main and not self._phases[main - 1].following:
            self._phases[main - 1] = replace(self._phases[main - 1], following=(0,))
        if self._coordinated:
            self._coordinate(self._plan.cycle or 0.0)
        return PhasePlan(tuple(self._phases), main)

    def _after(self, number: int) -> int:
        return (number + 1) % len(self._stages)

    def _green(self, stage: PlannedStage) -> SumoPhase:
        bounds = (stage.least, stage.most) if stage.id in self._ends else (0.0, 0.0)
        state = stage_state(self._program, stage)
        name = f"{STAGE}{stage.id}"
        return SumoPhase(stage.green, state, name, stage.id, *bounds, on_call=stage.on_call)

    def _change(self, number: int, following: int) -> None:
        """Append the steps from one stage to another."""
        steps = change_steps(self._program, self._stages[number], self._stages[following])
        self._phases += [SumoPhase(*step) for step in steps]

    def _decide(self, number: int) -> None:
        """Say where a stage leads, and lay the ways past stages that were not called."""
        stage, at = self._stages[number], self._first[number]
        end = self._ends.get(stage.id, "")
        way = self._after(number)
        ways: list[int] = [self._entry(number, way)]
        passed = [way]
        while self._stages[way].on_call and len(passed) < len(self._stages):
            self._condition(ways[-1], end, self._calls[self._stages[way].id])
            way = self._after(way)
            ways.append(self._past(number, way, passed))
            passed.append(way)
        self._condition(ways[-1], end, "")
        if len(ways) > 1:
            self._phases[at] = replace(self._phases[at], following=tuple(ways))

    def _entry(self, number: int, following: int) -> int:
        """First phase on the direct way from a stage to the next."""
        after = self._first[number] + 1
        return (
            after
            if self._phases[after : after + 1] and not self._phases[after].stage
            else (self._first[following])
        )

    def _past(self, number: int, following: int, passed: list[int]) -> int:
        """Append the way past stages, and return its first phase."""
        stage, target = self._stages[number], self._stages[following]
        first = len(self._phases)
        if self._keeps_cycle:
            order = [number, *passed, following]
            pairs = pairwise(order)
            between = sum(
                change_length(self._program, self._stages[a], self._stages[b]) for a, b in pairs
            )
            greens = sum(self._stages[n].green for n in passed)
            rest = between + greens - change_length(self._program, stage, target)
            green = self._phases[self._first[number]]
            self._phases.append(SumoPhase(rest, green.state, f"{HOLD}{stage.id}", stage.id))
        self._change(number, following)
        last = len(self._phases) - 1
        if last < first:
            return self._first[following]
        for index in range(first, last):
            self._phases[index] = replace(self._phases[index], following=(index + 1,))
        self._phases[last] = replace(self._phases[last], following=(self._first[following],))
        return first

    def _condition(self, phase: int, end: str, call: str) -> None:
        """Say when a phase is the one to go to: if the green may end, and somebody has called."""
        early = " and ".join(one for one in (end, call) if one)
        self._phases[phase] = replace(
            self._phases[phase], early=early if end else "", final=call or ("1" if end else "")
        )

    def _coordinate(self, cycle: float) -> None:
        """End stages at their places in the cycle at the latest, and the first exactly there.

        What the others leave over, the first stage has. SUMO counts the cycle from its end: only
        so it can be held past the end of a cycle.
        """
        first = self._phases[0]
        self._phases[0] = replace(first, most=2.0 * cycle, earliest_end=cycle)
        now = 0.0
        for index, phase in enumerate(self._phases[1:], start=1):
            now += phase.seconds
            if phase.prolonged:
                self._phases[index] = replace(phase, latest_end=now)
