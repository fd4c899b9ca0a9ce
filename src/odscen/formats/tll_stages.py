"""Stages in the phases of a SUMO program: what begins where, what follows, and what calls it."""

from __future__ import annotations

import re
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

from odscen.base.errors import InputError
from odscen.formats.tll_file import FilePhase

if TYPE_CHECKING:
    from collections.abc import Sequence

    from odscen.formats.tll_file import FileProgram

STAGE_NAME = re.compile(r"stage\s+([A-Za-z0-9][A-Za-z0-9_.-]*)$")
"""Name of the phase of a stage; its id."""

SEEN = re.compile(r"\b[aw]:")
"""What a condition asks of a detector: vehicles that are on it, or how long one waits there."""

GAP = re.compile(r"z:(\S+) > ([0-9.]+)")
"""A loop of a condition, and the seconds without vehicles that it asks for."""


@dataclass(slots=True)
class FileStage:
    """A stage of one program of the file, and the steps after it; seconds.

    ``gaps`` are the seconds of the loops that prolong it.
    """

    id: str
    state: str
    seconds: float
    least: float
    most: float
    on_call: bool
    gaps: dict[str, float]
    held: bool
    steps: list[FilePhase] = field(default_factory=list)

    def lengthen(self, phase: FilePhase) -> None:
        """Add a phase that goes on showing the same."""
        self.seconds += phase.seconds
        self.least += phase.least
        self.most += phase.most
        self.held |= phase.held


def shown_need(links: Sequence[int], stage: FileStage) -> float:
    """Seconds from the end of a group's green to the begin of the next stage."""
    rest = sum(step.seconds for step in stage.steps)
    for step in stage.steps:
        if step.state[links[0]] not in "Gg":
            break
        rest -= step.seconds
    return rest


def green_phase(stage: FileStage) -> FilePhase:
    """Phase of the green of a stage."""
    return FilePhase(stage.seconds, stage.state, "", stage.least, stage.most, (), "", "")


def joined_steps(steps: Sequence[FilePhase]) -> list[FilePhase]:
    """Steps, of which those that show the same are one."""
    result: list[FilePhase] = []
    for step in steps:
        if result and result[-1].state == step.state:
            result[-1] = replace(result[-1], seconds=result[-1].seconds + step.seconds)
        else:
            result.append(step)
    return result


def first_stage_at(program: FileProgram) -> float:
    """Seconds in the file's cycle before its first stage."""
    order = main_phases(program)
    lead = 0.0
    for at, before in zip(order, (order[-1], *order), strict=False):
        if _something_begins(program.phases[before].state, program.phases[at].state):
            return lead
        lead += program.phases[at].seconds
    return 0.0


def main_phases(program: FileProgram) -> list[int]:
    """Phases of one cycle in which every stage comes: of several ways the first.

    Raises
    ------
    InputError
        If it does not come back to its first phase.
    """
    order, at = [], 0
    while at not in order:
        order.append(at)
        following = program.phases[at].following
        at = following[0] if following else (at + 1) % len(program.phases)
    if at != 0:
        raise InputError(
            f"{program.place}: phase {order[-1]} leads back to phase {at}, not to the first"
        )
    return order


def _something_begins(before: str, after: str) -> bool:
    """Whether something begins, or no longer gives way."""
    return any(
        (new in "Gg" and old not in "Gg") or (new == "G" and old == "g")
        for old, new in zip(before, after, strict=True)
    )


def file_stages(program: FileProgram) -> list[FileStage]:
    """Stages of a program, each with the steps that follow.

    Raises
    ------
    InputError
        If nothing begins in it, or it does not come back to its first phase.
    """
    order = main_phases(program)
    phases = [program.phases[n] for n in order]
    states = [phase.state for phase in phases]
    firsts = [n for n in range(len(phases)) if _something_begins(states[n - 1], states[n])]
    if not firsts:
        raise InputError(f"{program.place}: nothing ever begins to have green")
    held = next((n for n, phase in enumerate(phases) if phase.held), firsts[0])
    start = max((n for n in firsts if n <= held), default=firsts[-1])
    turned = [*range(start, len(phases)), *range(start)]
    stages: list[FileStage] = []
    for n in turned:
        phase = phases[n]
        if n in firsts:
            match = STAGE_NAME.search(phase.name)
            stages.append(
                FileStage(
                    match[1] if match else "",
                    phase.state,
                    phase.seconds,
                    phase.least,
                    phase.most,
                    _is_called(program, order, n),
                    _gap_times(program, order[(n + 1) % len(order)]),
                    phase.held,
                )
            )
        elif phase.state == stages[-1].state and not stages[-1].steps:
            stages[-1].lengthen(phase)
            stages[-1].gaps = _gap_times(program, order[(n + 1) % len(order)])
        elif phase.most > phase.least:
            raise InputError(
                f"{program.place}: phase {order[n]} is prolonged, but nothing begins in it"
            )
        else:
            stages[-1].steps.append(phase)
    for stage in stages:
        if stage.held:  # how long is a matter of the cycle
            stage.least = stage.most = stage.seconds
    return stages


def _gap_times(program: FileProgram, at: int) -> dict[str, float]:
    """Loops whose gaps let a phase come, and the seconds."""
    words = program.phases[at].early.split()
    text = " ".join(program.conditions.get(word, word) for word in words)
    return {name: float(gap) for name, gap in GAP.findall(text)}


def _is_called(program: FileProgram, order: Sequence[int], n: int) -> bool:
    """Whether a stage comes only if its way is chosen."""
    return any(
        len(program.phases[at].following) > 1
        and any(
            SEEN.search(program.conditions.get(word, ""))
            for word in _condition_of_phase(program, at).split()
        )
        for at in order
        if _leads_to(program, order, at, order[n])
    )


def _condition_of_phase(program: FileProgram, at: int) -> str:
    return program.phases[program.phases[at].following[0]].final


def _leads_to(program: FileProgram, order: Sequence[int], at: int, stage: int) -> bool:
    """Whether the first way from a phase comes to a stage before any other one begins."""
    place = order.index(at)
    states = [program.phases[n].state for n in order]
    for step in range(1, len(order) + 1):
        now = (place + step) % len(order)
        if _something_begins(states[now - 1], states[now]):
            return order[now] == stage
    return False


def refuse_repeated(place: str, cycle: Sequence[FileStage], *, known: int) -> None:
    """Refuse a cycle that has a stage twice: of its stages a plan has each once, ``known`` then.

    Raises
    ------
    InputError
        Names the stage and the program.
    """
    if len(cycle) != known:
        ids = [stage.id for stage in cycle]
        twice = next((name for name in ids if ids.count(name) > 1), "")
        raise InputError(
            f"{place}: stage {twice!r} comes twice in a cycle; a plan has each stage once"
        )
