"""Stages of the map's program with and without their crossings, and the ways between all of them.

What a way shows follows from the paths of what ends and what begins, as in programs of the
scenario; the way from one stage to the next, people walking in both, is the map's own.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple

from odscen.scenario.document.signals_document import JunctionTiming
from odscen.scenario.signals.program_design import (
    DesignedGroup,
    DesignedProgram,
    PlannedStage,
    change_steps,
    stage_state,
)
from odscen.sumo.realize.lights.stage_phases import SumoPhase

if TYPE_CHECKING:
    from collections.abc import Sequence

    from odscen.scenario.signals.light import Light

LEAST_CALLED = 5.0
"""Seconds of green of a stage in which nobody walks, at least (RiLSA 2015, section 2.7)."""


class StageVariant(NamedTuple):
    """A stage, with its crossings (``walk``) or without.

    ``green`` is its phase; ``planned`` the groups that have green.
    """

    stage: int
    walk: bool
    drive: bool
    green: SumoPhase
    planned: PlannedStage


class StageVariants:
    """What a light can show.

    Parameters
    ----------
    phases
        Of the map's program, with the greens of the scenario.
    """

    def __init__(self, phases: Sequence[SumoPhase], light: Light) -> None:
        self._light = light
        self._walks = {n for n, movement in enumerate(light.movements) if movement.walk}
        groups = _group_movements(phases, light)
        self._program = DesignedProgram(
            JunctionTiming(junction=light.names[0]), light, "actuated", groups=groups
        )
        self.phases = list(phases)
        self.stages = [n for n, phase in enumerate(phases) if phase.stage]
        self.of_stage = [self._variants_of_stage(n, phases[at]) for n, at in enumerate(self.stages)]

    @property
    def usable(self) -> bool:
        """Whether there is something to choose: stages for vehicles and others, known to meet."""
        drives = any(variant.drive for variants in self.of_stage for variant in variants)
        several = all(self.of_stage) and len(self.of_stage) > 1 and self.stages[0] == 0
        return several and drives and bool(self._light.meetings)

    def between(self, number: int) -> list[SumoPhase]:
        """Phases of the map from a stage to the next one."""
        ends = [*self.stages[1:], len(self.phases)]
        return self.phases[self.stages[number] + 1 : ends[number]]

    def way(self, one: StageVariant, other: StageVariant) -> list[SumoPhase]:
        """Phases from one variant to another; a second of its own where nothing has to end."""
        before, behind = one.green.state, other.green.state
        phases = []
        for seconds, state, name in change_steps(self._program, one.planned, other.planned):
            letters = (
                _careful_letter(letter, was, then)
                for letter, was, then in zip(state, before, behind, strict=True)
            )
            phases.append(SumoPhase(seconds, "".join(letters), name))
        return phases or [SumoPhase(1.0, before, one.green.name)]

    def _variants_of_stage(self, number: int, phase: SumoPhase) -> tuple[StageVariant, ...]:
        """With crossings first; none for a stage in which nobody has green."""
        green = {n for n, letter in enumerate(phase.state) if letter in "Gg"}
        walks, drive = green & self._walks, bool(green - self._walks)
        full = self._planned_stage(phase)
        variants = []
        if walks or drive:
            variants.append(StageVariant(number, bool(walks), drive, phase, full))
        if walks and drive:
            names = frozenset(self._program.group_of[n] for n in walks if self._is_known(n))
            rest = full._replace(
                groups=full.groups - names, permissive=full.permissive - names, least=LEAST_CALLED
            )
            variants.append(
                StageVariant(number, False, True, self._without_crossings(phase, full, rest), rest)
            )
        elif drive:
            variants[0] = variants[0]._replace(green=shorter(phase))
        return tuple(variants)

    def _is_known(self, movement: int) -> bool:
        return movement in self._program.group_of

    def _planned_stage(self, phase: SumoPhase) -> PlannedStage:
        names = {n: self._program.group_of[n] for n in range(len(phase.state)) if self._is_known(n)}
        groups = frozenset(name for n, name in names.items() if phase.state[n] in "Gg")
        permissive = frozenset(name for n, name in names.items() if phase.state[n] == "g")
        return PlannedStage(
            phase.stage, groups, permissive, phase.seconds, phase.least, phase.most, False
        )

    def _without_crossings(
        self, phase: SumoPhase, full: PlannedStage, rest: PlannedStage
    ) -> SumoPhase:
        """Phase without its crossings: who gave way to those who walk need not any more."""
        busy, free = (stage_state(self._program, stage) for stage in (full, rest))
        letters = []
        for n, letter in enumerate(phase.state):
            if n in self._walks:
                letters.append("r")
            else:
                letters.append("G" if letter == "g" == busy[n] and free[n] == "G" else letter)
        return shorter(replace(phase, state="".join(letters)))


def shorter(phase: SumoPhase) -> SumoPhase:
    """Green in which nobody walks: it may end sooner."""
    return replace(phase, least=min(phase.least, LEAST_CALLED)) if phase.prolonged else phase


def _careful_letter(letter: str, was: str, then: str) -> str:
    """Letter on a way; what gives way before or behind it does so on it, too."""
    return "g" if letter == "G" and "g" in (was, then) else letter


def _group_movements(phases: Sequence[SumoPhase], light: Light) -> dict[str, DesignedGroup]:
    """Movements of one approach that always show the same, but for who gives way."""
    columns: dict[tuple[str, ...], list[int]] = {}
    for n, movement in enumerate(light.movements):
        if movement.turn:
            shown = (phase.state[n].lower() for phase in phases)
            columns.setdefault((movement.approach, str(movement.walk), *shown), []).append(n)
    groups = {}
    for number, movements in enumerate(columns.values()):
        walk = light.movements[movements[0]].walk
        yellow = max(light.movements[n].yellow for n in movements)
        groups[str(number)] = DesignedGroup(str(number), tuple(movements), walk, yellow)
    return groups
