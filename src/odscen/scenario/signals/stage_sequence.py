"""What a light shows when: stages, and the steps from one stage to the next.

All that begins in the next stage begins at once, as soon as the last intergreen is over. All that
ends does so as late as its intergreens allow: crossings turn red while vehicles still go.
"""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from odscen.scenario.signals.program_design import DesignedProgram, PlannedStage

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
    needs = {name: _need(program, name, beginning) for name in ending}
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
    return _merged(steps)


def _need(program: DesignedProgram, ending: str, beginning: frozenset[str]) -> float:
    """Seconds before the next stage at which a group has to end."""
    group = program.groups[ending]
    return max((program.intergreen(ending, one) for one in beginning), default=0.0) or group.yellow


def _merged(steps: list[ShownStep]) -> tuple[ShownStep, ...]:
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
