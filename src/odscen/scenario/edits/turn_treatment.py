"""Turns across oncoming traffic: through its gaps, with an arrow of their own, or both.

A turn that is treated on its own has a signal group of its own. Its arrow is a stage in which
nobody meets it: one that is there, or a new one after the last stage of its approach.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal, NamedTuple

from odscen.base.errors import InputError
from odscen.scenario.document.signals_document import DayPlan, ProgramGroup, ProgramStage
from odscen.scenario.edits.edit_registry import changed_part
from odscen.scenario.edits.program_changes import fitted_cycles
from odscen.scenario.signals.light import shortest_names
from odscen.scenario.signals.program_design import DesignedProgram

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from odscen.scenario.document.signals_document import JunctionTiming
    from odscen.scenario.signals.light import Light

TurnTreatment = Literal["permissive", "protected", "both"]

ARROW_GREEN = 6.0
"""Seconds of green of a new stage for turns."""


class CrossingTurn(NamedTuple):
    """A turn across oncoming traffic: its approach, ``left`` or ``right``, and its movements.

    ``alone`` if no other movement uses its lanes.
    """

    approach: str
    turn: str
    movements: tuple[int, ...]
    alone: bool


def crossing_turns(light: Light) -> tuple[CrossingTurn, ...]:
    """Turns of a light that may give way to vehicles from other approaches, in its order."""
    movements = light.movements
    found: dict[tuple[str, str], set[int]] = {}
    for meeting in light.meetings:
        if meeting.yields < 0 or not meeting.shares:
            continue
        other = meeting.other if meeting.yields == meeting.one else meeting.one
        one, first = movements[meeting.yields], movements[other]
        if one.turn in ("left", "right") and first.drive and first.approach != one.approach:
            found.setdefault((one.approach, one.turn), set())
    result = []
    for approach, turn in sorted(found, key=lambda key: _place_of_turn(light, *key)):
        own = [n for n, m in enumerate(movements) if (m.approach, m.turn) == (approach, turn)]
        lanes = {movements[n].lanes[0] for n in own}
        others = {m.lanes[0] for n, m in enumerate(movements) if m.drive and n not in own}
        result.append(CrossingTurn(approach, turn, tuple(own), not lanes & others))
    return tuple(result)


def _place_of_turn(light: Light, approach: str, turn: str) -> int:
    return next(
        n for n, m in enumerate(light.movements) if (m.approach, m.turn) == (approach, turn)
    )


def with_turn(
    timing: JunctionTiming, light: Light, *, approach: str, turn: str, treatment: TurnTreatment
) -> JunctionTiming:
    """Treat a turn of a program of the scenario's own in another way.

    Raises
    ------
    InputError
        If the approach has no such turn, it has no lane for itself but is to be stopped while its
        approach goes, or nothing else of its approach ever has green.
    """
    known = crossing_turns(light)
    asked = next(
        (
            crossing_turn
            for crossing_turn in known
            if (crossing_turn.approach, crossing_turn.turn) == (approach, turn)
        ),
        None,
    )
    if asked is None:
        names = ", ".join(f"{turn.approach} {turn.turn}" for turn in known) or "none"
        raise InputError(
            f"{approach} {turn} is no turn across oncoming traffic of the light of junction "
            f"{timing.junction!r}; there are {names}"
        )
    if treatment != "permissive" and not asked.alone:
        lanes = ", ".join(sorted({light.movements[n].lanes[0] for n in asked.movements}))
        raise InputError(
            f"the {turn} turn from {approach} shares lane {lanes} with other movements: who waits "
            "for an arrow would stop those behind; it can only be permissive"
        )
    return _Treatment(timing, light, asked, treatment).timing()


class _Treatment:
    """One turn of one program, treated anew."""

    def __init__(
        self, timing: JunctionTiming, light: Light, turn: CrossingTurn, treatment: TurnTreatment
    ) -> None:
        self._light, self._turn, self._treatment = light, turn, treatment
        self._timing = self._give_own_group(timing)
        program = DesignedProgram(self._timing, light, "fixed")
        self._movements = {name: group.movements for name, group in program.groups.items()}
        self._own = {program.group_of[n] for n in turn.movements}
        self._mates = {
            name
            for name, movements in self._movements.items()
            if name not in self._own
            and any(light.movements[n].drive for n in movements)
            and all(light.movements[n].approach == turn.approach for n in movements)
        }

    def timing(self) -> JunctionTiming:
        """Find the new timing.

        Raises
        ------
        InputError
            If nothing else of the approach ever has green.
        """
        stages = list(self._timing.stages)
        with_approach = [stage.id for stage in stages if self._mates & set(stage.groups)]
        if not with_approach:
            raise InputError(
                f"nothing but the {self._turn.turn} turn comes from {self._turn.approach} with "
                "green of its own: there is no stage beside which it could be treated otherwise"
            )
        cleared = [_remove_groups(stage, self._own) for stage in stages]
        if self._treatment != "protected":
            cleared = [
                _add_groups(stage, self._own, "permissive") if stage.id in with_approach else stage
                for stage in cleared
            ]
        plans = self._timing.plans
        if self._treatment != "permissive":
            arrow = self._find_arrow_stage(cleared, stages, with_approach)
            if arrow is None:
                new = ProgramStage(
                    id=_choose_free_id({stage.id for stage in stages}),
                    protected=tuple(sorted(self._own)),
                    green=ARROW_GREEN,
                )  # fmt: skip
                at = [stage.id for stage in cleared].index(with_approach[-1]) + 1
                cleared.insert(at, new)
                plans = tuple(_insert_stage_after(plan, with_approach, new.id) for plan in plans)
            else:
                cleared = [
                    _add_groups(stage, self._own, "protected") if stage.id == arrow else stage
                    for stage in cleared
                ]
        empty = {stage.id for stage in cleared if not stage.groups}
        changes = {
            "stages": tuple(stage for stage in cleared if stage.id not in empty),
            "plans": tuple(_without_stages(plan, empty) for plan in plans),
            "detectors": tuple(
                changed_part(
                    detector, {"stages": tuple(s for s in detector.stages if s not in empty)}
                )
                for detector in self._timing.detectors
                if set(detector.stages) - empty
            ),
        }
        return fitted_cycles(changed_part(self._timing, changes), self._light)

    def _find_arrow_stage(
        self,
        cleared: Sequence[ProgramStage],
        stages: Sequence[ProgramStage],
        with_approach: Sequence[str],
    ) -> str | None:
        """A stage without the approach in which nobody meets the turn; where it was, if it may."""
        fits = [
            stage.id
            for stage in cleared
            if stage.id not in with_approach
            and stage.groups
            and not self._turn_is_met(stage.groups)
        ]
        before = {stage.id for stage in stages if self._own & set(stage.protected)}
        alone = {stage.id for stage in cleared if not stage.groups}
        kept = [name for name in (*fits, *sorted(alone)) if name in before]
        turns = [
            stage.id for stage in cleared if stage.id in fits and self._has_only_turns(stage.groups)
        ]
        return next(iter((*kept, *turns)), None)

    def _turn_is_met(self, groups: Iterable[str]) -> bool:
        return any(
            (min(i, j), max(i, j)) in self._light.met
            for name in groups
            for i in self._movements[name]
            for j in self._turn.movements
        )

    def _has_only_turns(self, groups: Iterable[str]) -> bool:
        turns = {
            n for crossing_turn in crossing_turns(self._light) for n in crossing_turn.movements
        }
        return all(turns.issuperset(self._movements[name]) for name in groups)

    def _give_own_group(self, timing: JunctionTiming) -> JunctionTiming:
        """Give the turn a group of its own where it shares one, which shows the same as before."""
        program = DesignedProgram(timing, self._light, "fixed")
        own = set(self._turn.movements)
        for name in sorted({program.group_of[n] for n in own}):
            members = program.groups[name].movements
            if set(members) <= own:
                continue
            new = _choose_free_id({group.id for group in timing.groups}, f"{name}L")
            timing = self._divide_group(timing, name, new, set(members) & own, set(members) - own)
        return timing

    def _divide_group(
        self, timing: JunctionTiming, name: str, new: str, turns: set[int], others: set[int]
    ) -> JunctionTiming:
        groups: list[ProgramGroup] = []
        for group in timing.groups:
            if group.id != name:
                groups.append(group)
                continue
            for key, members in ((name, others), (new, turns)):
                names = shortest_names(members, self._light.movements)
                groups.append(changed_part(group, {"id": key, "movements": names}))
        rows = [
            (first, second, seconds)
            for a, b, seconds in timing.intergreens
            for first in ((a, new) if a == name else (a,))
            for second in ((b, new) if b == name else (b,))
        ]
        stages = []
        for stage in timing.stages:
            kind = "permissive" if name in stage.permissive else "protected"
            stages.append(_add_groups(stage, {new}, kind) if name in stage.groups else stage)
        changes = {"groups": tuple(groups), "stages": tuple(stages), "intergreens": tuple(rows)}
        return changed_part(timing, changes)


def _add_groups(stage: ProgramStage, groups: set[str], kind: str) -> ProgramStage:
    listed = getattr(stage, kind)
    return changed_part(stage, {kind: (*listed, *sorted(groups - set(listed)))})


def _remove_groups(stage: ProgramStage, groups: set[str]) -> ProgramStage:
    return changed_part(
        stage,
        {
            kind: tuple(name for name in getattr(stage, kind) if name not in groups)
            for kind in ("protected", "permissive")
        },
    )


def _insert_stage_after(plan: DayPlan, stages: Sequence[str], new: str) -> DayPlan:
    """A plan with its own order of stages, in which a new one follows the last of these."""
    there = [n for n, name in enumerate(plan.stages) if name in stages]
    if not there:
        return plan
    at = there[-1] + 1
    return changed_part(plan, {"stages": (*plan.stages[:at], new, *plan.stages[at:])})


def _without_stages(plan: DayPlan, gone: set[str]) -> DayPlan:
    if not gone:
        return plan
    times = {
        kind: {name: s for name, s in getattr(plan, kind).items() if name not in gone}
        for kind in ("green", "min_green", "max_green")
    }
    left = tuple(name for name in plan.stages if name not in gone)
    return changed_part(plan, {**times, "stages": left})


def _choose_free_id(taken: set[str], wish: str | None = None) -> str:
    """An id that nobody has: the one wished for, or a number."""
    if wish is not None and wish not in taken:
        return wish
    number = 1 if wish is None else 2
    while (name := f"{wish or ''}{number}") in taken:
        number += 1
    return name
