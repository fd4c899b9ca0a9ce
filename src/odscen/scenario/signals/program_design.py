"""A program of the scenario on its light: plans of the day, stages and their steps, detectors.

All that begins in the next stage begins at once, as soon as the last intergreen is over. All that
ends does so as late as its intergreens allow: crossings turn red while vehicles still go.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING, NamedTuple

from odscen.scenario.signals.light import find_movements

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from odscen.scenario.document.signals_document import (
        Control,
        DayPlan,
        JunctionTiming,
        ProgramGroup,
        Signals,
    )
    from odscen.scenario.signals.light import Light, SignalMovement


def detector_movements(at: str, movements: Sequence[SignalMovement]) -> tuple[int, ...]:
    """Movements over the lanes of an approach (``r12``), or of one lane (``12.0.-1``)."""
    return tuple(
        n
        for n, movement in enumerate(movements)
        if movement.drive and at in (movement.approach, movement.lanes[0])
    )


def without_detectors(signals: Signals) -> Signals:
    """All lights fixed-time and every stage in every cycle: the mesoscopic model sees nobody."""
    junctions = [
        timing.model_copy(
            update={
                "control": None,
                "stages": tuple(
                    stage.model_copy(update={"on_call": False}) for stage in timing.stages
                ),
            }
        )
        for timing in signals.junctions
    ]
    return signals.model_copy(update={"control": "fixed", "junctions": tuple(junctions)})


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
            return (
                TimedPlan(ONLY_PLAN, self._planned_stages(ids), timing.cycle, timing.offset, ()),
            )
        return tuple(
            TimedPlan(
                plan.id,
                self._planned_stages(
                    plan.stages or tuple(stage.id for stage in timing.stages), plan
                ),
                timing.cycle if plan.cycle is None else plan.cycle,
                plan.offset,
                tuple(map(seconds_of_day, plan.times)),
            )
            for plan in timing.plans
        )

    def _planned_stages(
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


DAY = 86_400.0


def active_plans(
    plans: Iterable[TimedPlan], *, clock: float, until: float | None
) -> tuple[tuple[float, str], ...]:
    """Plans of a run and the seconds after its start from which on they are to run.

    The first begins at 0: what is active at ``clock``. Every day is alike.

    Parameters
    ----------
    clock
        Time of day at the start, seconds.
    until
        Seconds that the run lasts; a day if not given.
    """
    listed = list(plans)
    begins = sorted((time, plan.id) for plan in listed for time in plan.times)
    if not begins:
        return ((0.0, listed[0].id),)
    end = DAY if until is None else until
    now = [name for time, name in begins if time <= clock] or [begins[-1][1]]
    found = [(0.0, now[-1])]
    days = range(int((clock + end) // DAY) + 1)
    for day in days:
        for time, name in begins:
            after = day * DAY + time - clock
            if 0.0 < after < end and name != found[-1][1]:
                found.append((after, name))
    return tuple(found)


YELLOW, ALL_RED, CLEARANCE = "yellow", "all red", "pedestrian clearance"


class ShownStep(NamedTuple):
    """Seconds for which the letters of a state are shown."""

    seconds: float
    state: str
    name: str


def stage_state(program: DesignedProgram, stage: PlannedStage) -> str:
    """Letters of a stage: ``G``; ``g`` where a movement gives way to another that has green.

    Movements of one group that meet give way as the junction's right of way says.
    """
    green = {n for name in stage.groups for n in program.groups[name].movements}
    letters = []
    for n in range(len(program.light.movements)):
        if n not in green:
            letters.append("r")
        else:
            letters.append("g" if _gives_way(program, stage, n, green) else "G")
    return "".join(letters)


def _gives_way(
    program: DesignedProgram, stage: PlannedStage, movement: int, green: set[int]
) -> bool:
    own = program.group_of[movement]
    for meeting in program.light.meetings:
        if meeting.yields == movement and {meeting.one, meeting.other} <= green:
            other = meeting.other if meeting.one == movement else meeting.one
            if own in stage.permissive or program.group_of[other] == own:
                return True
    return False


def beginning_groups(stage: PlannedStage, following: PlannedStage) -> frozenset[str]:
    """Groups that need a free path from the next stage on: they begin, or no longer give way."""
    protected = (stage.permissive & following.groups) - following.permissive
    return (following.groups - stage.groups) | protected


def change_steps(
    program: DesignedProgram, stage: PlannedStage, following: PlannedStage
) -> tuple[ShownStep, ...]:
    """Steps from the end of a stage's green to the begin of the next one's."""
    ending = sorted(stage.groups - following.groups)
    beginning = beginning_groups(stage, following)
    needs = {name: _seconds_before_stage(program, name, beginning) for name in ending}
    length = max(needs.values(), default=0.0)
    before, behind = stage_state(program, stage), stage_state(program, following)
    starts = {name: length - needs[name] for name in ending}
    cuts = {0.0, length, *starts.values()}
    cuts |= {min(starts[name] + program.groups[name].yellow, length) for name in ending}
    times = sorted(cuts)
    steps = []
    for begin, end in pairwise(times):
        state = list(before)
        for n, (one, other) in enumerate(zip(before, behind, strict=True)):
            name = program.group_of.get(n)
            if name in starts:
                since = begin - starts[name]
                group = program.groups[name]
                state[n] = one if since < 0 else "y" if since < group.yellow else "r"
            elif one == "G" and other == "g":
                state[n] = "g"
        text = "".join(state)
        going = any(begin < start for start in starts.values())
        name = YELLOW if "y" in text else CLEARANCE if going else ALL_RED
        steps.append(ShownStep(end - begin, text, name))
    return _merge_steps(steps)


def _seconds_before_stage(
    program: DesignedProgram, ending: str, beginning: frozenset[str]
) -> float:
    """Seconds before the next stage at which a group has to end."""
    group = program.groups[ending]
    return (
        max((program.intergreen(ending, name) for name in beginning), default=0.0) or group.yellow
    )


def _merge_steps(steps: list[ShownStep]) -> tuple[ShownStep, ...]:
    result: list[ShownStep] = []
    for step in steps:
        if result and result[-1].state == step.state:
            longer = result[-1].seconds + step.seconds
            result[-1] = result[-1]._replace(seconds=longer)
        else:
            result.append(step)
    return tuple(result)


def change_length(program: DesignedProgram, stage: PlannedStage, following: PlannedStage) -> float:
    """Seconds from the end of a stage's green to the begin of the next one's."""
    return sum(step.seconds for step in change_steps(program, stage, following))


def cycle_length(program: DesignedProgram, stages: tuple[PlannedStage, ...]) -> float:
    """Seconds of all greens and of what is between them."""
    pairs = zip(stages, (*stages[1:], *stages[:1]), strict=True)
    return sum(one.green + change_length(program, one, other) for one, other in pairs)
