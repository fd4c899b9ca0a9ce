"""A program of the scenario on its light: groups with their movements, intergreens, plans."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

from odscen.scenario.signals.movement_names import find_movements

if TYPE_CHECKING:
    from collections.abc import Mapping

    from odscen.scenario.document.signals_document import (
        Control,
        DayPlan,
        JunctionTiming,
        ProgramGroup,
    )
    from odscen.scenario.signals.light import Light

ONLY_PLAN = "scenario"
"""Id of the plan of a program without plans of the day."""


@dataclass(frozen=True, slots=True)
class DesignedGroup:
    """A signal group: its movements as places in the light's states; seconds of yellow."""

    id: str
    movements: tuple[int, ...]
    walk: bool
    yellow: float
    all_red: float | None = None


class PlannedStage(NamedTuple):
    """A stage in one plan: groups that have green, those of them that give way, and seconds."""

    id: str
    groups: frozenset[str]
    permissive: frozenset[str]
    green: float
    least: float
    most: float
    on_call: bool


class TimedPlan(NamedTuple):
    """A plan: its stages in order, seconds, and the times of day (s) at which it begins."""

    id: str
    stages: tuple[PlannedStage, ...]
    cycle: float | None
    offset: float
    times: tuple[float, ...]


class TooShort(NamedTuple):
    """An intergreen that does not do: given and needed seconds, and the movements that need it."""

    ending: str
    beginning: str
    given: float
    needed: float
    places: tuple[int, int]


class DesignedProgram:
    """A program whose groups and stages are known to be there.

    Parameters
    ----------
    control
        Of the light, after what the scenario says of all.
    groups
        Groups by their ids, in place of those of ``timing``.
    """

    def __init__(
        self,
        timing: JunctionTiming,
        light: Light,
        control: Control,
        *,
        groups: Mapping[str, DesignedGroup] | None = None,
    ) -> None:
        self.timing = timing
        self.light = light
        self.control = control
        self.groups: Mapping[str, DesignedGroup] = (
            {group.id: designed_group(group, light) for group in timing.groups}
            if groups is None
            else groups
        )
        self.group_of = {n: g.id for g in self.groups.values() for n in g.movements}
        self._given = {(one, other): s for one, other, s in timing.intergreens}

    def plans(self) -> tuple[TimedPlan, ...]:
        """Plans of the day in order; without any, the one that is always active."""
        timing = self.timing
        if not timing.plans:
            ids = tuple(stage.id for stage in timing.stages)
            return (TimedPlan(ONLY_PLAN, self._stages(ids), timing.cycle, timing.offset, ()),)
        return tuple(
            TimedPlan(
                plan.id,
                self._stages(plan.stages or tuple(stage.id for stage in timing.stages), plan),
                timing.cycle if plan.cycle is None else plan.cycle,
                plan.offset,
                tuple(map(seconds_of_day, plan.times)),
            )
            for plan in timing.plans
        )

    def _stages(
        self, ids: tuple[str, ...], plan: DayPlan | None = None
    ) -> tuple[PlannedStage, ...]:
        design = {stage.id: stage for stage in self.timing.stages}
        result = []
        for name in ids:
            stage = design[name]
            green = plan.green.get(name, stage.green) if plan else stage.green
            least = plan.min_green.get(name, stage.min_green) if plan else stage.min_green
            most = plan.max_green.get(name, stage.max_green) if plan else stage.max_green
            result.append(
                PlannedStage(
                    name,
                    frozenset(stage.groups),
                    frozenset(stage.permissive),
                    green,
                    green if least is None else least,
                    green if most is None else most,
                    stage.on_call,
                )
            )
        return tuple(result)

    def intergreen(self, ending: str, beginning: str) -> float:
        """Seconds from the end of green of a group to the begin of green of another.

        What is given, or else what is needed; 0 for groups that do not meet.
        """
        given = self._given.get((ending, beginning))
        if given is not None:
            return given
        needed, _ = self.needed(ending, beginning)
        group = self.groups[ending]
        if needed and group.all_red is not None:
            return group.yellow + group.all_red
        return needed

    def needed(self, ending: str, beginning: str) -> tuple[float, tuple[int, int]]:
        """Seconds that an intergreen has to last at least, and the movements that need them."""
        one, other = self.groups[ending], self.groups[beginning]
        most, places = 0.0, (-1, -1)
        for i in one.movements:
            for j in other.movements:
                clearing = self.light.clearing(i, j)
                if clearing is not None and one.yellow + clearing > most:
                    most, places = one.yellow + clearing, (i, j)
        return most, places

    def too_short(self) -> list[TooShort]:
        """Intergreens that were given and are shorter than what the paths need."""
        found = []
        for ending in self.groups:
            for beginning in self.groups:
                if ending != beginning:
                    given = self.intergreen(ending, beginning)
                    needed, places = self.needed(ending, beginning)
                    if given < needed:
                        found.append(TooShort(ending, beginning, given, needed, places))
        return found


def designed_group(group: ProgramGroup, light: Light) -> DesignedGroup:
    """Find the movements of a group; those that are not there are left out."""
    found = dict.fromkeys(
        n for name in group.movements for n in find_movements(name, light.movements)
    )
    movements = tuple(sorted(found))
    yellow = max((light.movements[n].yellow for n in movements), default=0.0)
    walk = bool(movements) and all(light.movements[n].walk for n in movements)
    return DesignedGroup(
        group.id, movements, walk, yellow if group.yellow is None else group.yellow, group.all_red
    )


def seconds_of_day(clock: str) -> float:
    """Seconds after midnight of ``06:30`` or ``06:30:15``."""
    hours, minutes, *seconds = map(float, clock.split(":"))
    return hours * 3600.0 + minutes * 60.0 + sum(seconds)
