"""Signal groups and stages of a program put in, changed, merged and taken out.

What refers to a group or a stage follows: stages, intergreens, detectors and plans of the day.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Literal

from odscen.base.errors import InputError, NotFoundError
from odscen.scenario.document.signals_document import ProgramGroup, ProgramStage
from odscen.scenario.document.validation import validated
from odscen.scenario.edits.edited_parts import changed_part
from odscen.scenario.signals.movement_names import shortest_names
from odscen.scenario.signals.program_design import designed_group

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping

    from odscen.scenario.document.signals_document import DayPlan, JunctionTiming
    from odscen.scenario.signals.light import Light

_Kind = Literal["protected", "permissive"]
_KINDS: tuple[_Kind, _Kind] = ("protected", "permissive")


def with_group(
    timing: JunctionTiming, light: Light, name: str, fields: Mapping[str, Any]
) -> JunctionTiming:
    """Put a group in, or change fields of one; its movements leave the groups that had them.

    A new one shows what its first movement has shown: it has the stages and intergreens of that
    movement's group. A group that is left without movements goes.

    Raises
    ------
    InputError
        If a new group has no movements.
    """
    ids = [one.id for one in timing.groups]
    if name in ids:
        old = timing.groups[ids.index(name)]
        timing = _replaced(timing, old, changed_part(old, fields))
        name = fields.get("id", name)
    elif not fields.get("movements"):
        raise InputError(
            f"the light of junction {timing.junction!r} has no group {name!r}; a new one needs "
            f"movements, an old one is one of {', '.join(ids)}"
        )
    else:
        new = validated(ProgramGroup, {**fields, "id": name})
        timing = _joined(timing, light, new)
    return _moved_here(timing, light, name) if "movements" in fields else timing


def _replaced(timing: JunctionTiming, old: ProgramGroup, new: ProgramGroup) -> JunctionTiming:
    timing = changed_part(
        timing, {"groups": tuple(new if one is old else one for one in timing.groups)}
    )
    return _renamed(timing, lambda name: new.id if name == old.id else name)


def _joined(timing: JunctionTiming, light: Light, new: ProgramGroup) -> JunctionTiming:
    """A program with a new group behind that of its first movement, and with what that shows."""
    movements = set(designed_group(new, light).movements)
    from_group = next(
        (one.id for one in timing.groups if movements & set(designed_group(one, light).movements)),
        None,
    )
    beside = [
        (*(new.id if name == from_group else name for name in row[:2]), row[2])
        for row in timing.intergreens
        if from_group in row[:2]
    ]
    stages = tuple(
        changed_part(
            stage,
            {
                kind: (*getattr(stage, kind), new.id)
                for kind in _KINDS
                if from_group in getattr(stage, kind)
            },
        )
        for stage in timing.stages
    )
    at = next((n + 1 for n, one in enumerate(timing.groups) if one.id == from_group), 0)
    changes = {
        "groups": (*timing.groups[:at], new, *timing.groups[at:]),
        "stages": stages,
        "intergreens": (*timing.intergreens, *beside),
    }
    return changed_part(timing, changes)


def _moved_here(timing: JunctionTiming, light: Light, name: str) -> JunctionTiming:
    """A program in which no other group has the movements of this one."""
    groups = {one.id: set(designed_group(one, light).movements) for one in timing.groups}
    own = groups[name]
    left: list[ProgramGroup] = []
    for one in timing.groups:
        if one.id == name or not groups[one.id] & own:
            left.append(one)
        elif groups[one.id] - own:
            names = shortest_names(groups[one.id] - own, light.movements)
            left.append(changed_part(one, {"movements": names}))
    gone = set(groups) - {one.id for one in left}
    timing = changed_part(timing, {"groups": tuple(left)})
    return _renamed(timing, lambda group: None if group in gone else group)


def _renamed(timing: JunctionTiming, name_of: Callable[[str], str | None]) -> JunctionTiming:
    """What refers to groups by other names of them; none takes the reference out."""

    def names(of: Iterable[str]) -> tuple[str, ...]:
        found = (name_of(one) for one in of)
        return tuple(dict.fromkeys(one for one in found if one is not None))

    stages = tuple(
        changed_part(stage, {kind: names(getattr(stage, kind)) for kind in _KINDS})
        for stage in timing.stages
    )
    rows = tuple(
        (one, other, seconds)
        for one, other, seconds in (
            (name_of(row[0]), name_of(row[1]), row[2]) for row in timing.intergreens
        )
        if one is not None and other is not None
    )
    return changed_part(timing, {"stages": stages, "intergreens": rows})


def with_greens_of(
    timing: JunctionTiming,
    group: str,
    *,
    protected: Iterable[str] | None,
    permissive: Iterable[str] | None,
) -> JunctionTiming:
    """Give a group green in just these stages; a kind that is not given stays, but for the other.

    Raises
    ------
    NotFoundError
        If there is no such stage.
    """
    wanted: dict[_Kind, set[str]] = {}
    for kind, given in zip(_KINDS, (protected, permissive), strict=True):
        if given is not None:
            wanted[kind] = set(given)
            for name in sorted(wanted[kind]):
                stage_of(timing, name)
    stages: list[ProgramStage] = []
    for stage in timing.stages:
        has: _Kind | None = next((k for k in _KINDS if group in getattr(stage, k)), None)
        named: _Kind | None = next((k for k in _KINDS if stage.id in wanted.get(k, ())), None)
        shows = named or (None if has in wanted else has)
        if shows == has:
            stages.append(stage)
            continue
        without: dict[str, tuple[str, ...]] = {
            k: tuple(name for name in getattr(stage, k) if name != group) for k in _KINDS
        }
        if shows is not None:
            without[shows] = (*without[shows], group)
        stages.append(changed_part(stage, without))
    return changed_part(timing, {"stages": tuple(stages)})


def without_group(timing: JunctionTiming, light: Light, name: str, into: str) -> JunctionTiming:
    """Take a group out; its movements join another.

    Raises
    ------
    InputError
        If it is to join itself.
    NotFoundError
        If there is no such group.
    """
    groups = {one.id: one for one in timing.groups}
    for one in (name, into):
        if one not in groups:
            raise NotFoundError(
                f"signal group of the light of junction {timing.junction!r}", one, list(groups)
            )
    if name == into:
        raise InputError(f"the movements of group {name!r} have to join another group")
    members = {n for one in (name, into) for n in designed_group(groups[one], light).movements}
    return with_group(timing, light, into, {"movements": shortest_names(members, light.movements)})


def stage_of(timing: JunctionTiming, name: str) -> ProgramStage:
    """Stage with this id.

    Raises
    ------
    NotFoundError
        If there is none.
    """
    found = {one.id: one for one in timing.stages}
    if name not in found:
        raise NotFoundError(
            f"stage of the light of junction {timing.junction!r}", name, list(found)
        )
    return found[name]


def with_new_stage(
    timing: JunctionTiming, new: ProgramStage, *, after: str | None
) -> JunctionTiming:
    """Put a stage in behind another, or at the end; plans with an own order have it there too.

    Raises
    ------
    InputError
        If its id is taken.
    NotFoundError
        If there is no stage ``after``.
    """
    ids = [one.id for one in timing.stages]
    if new.id in ids:
        raise InputError(
            f"the light of junction {timing.junction!r} has a stage {new.id!r} already"
        )
    if after is not None:
        stage_of(timing, after)
    at = len(ids) if after is None else ids.index(after) + 1
    plans = tuple(_with_stage_after(plan, new.id, after) for plan in timing.plans)
    stages = (*timing.stages[:at], new, *timing.stages[at:])
    return changed_part(timing, {"stages": stages, "plans": plans})


def _with_stage_after(plan: DayPlan, new: str, after: str | None) -> DayPlan:
    if not plan.stages:
        return plan
    at = plan.stages.index(after) + 1 if after in plan.stages else len(plan.stages)
    return changed_part(plan, {"stages": (*plan.stages[:at], new, *plan.stages[at:])})


def without_stage(timing: JunctionTiming, name: str) -> JunctionTiming:
    """Take a stage out, and with it what prolongs nothing else.

    Raises
    ------
    InputError
        If it is the only one.
    NotFoundError
        If there is no such stage.
    """
    stage_of(timing, name)
    if len(timing.stages) == 1:
        raise InputError(
            f"stage {name!r} is the only one of the light of junction {timing.junction!r}"
        )
    detectors = tuple(
        changed_part(one, {"stages": tuple(s for s in one.stages if s != name)})
        for one in timing.detectors
        if set(one.stages) != {name}
    )
    changes = {
        "stages": tuple(one for one in timing.stages if one.id != name),
        "detectors": detectors,
        "plans": tuple(_plan_without(plan, name) for plan in timing.plans),
    }
    return changed_part(timing, changes)


def _plan_without(plan: DayPlan, stage: str) -> DayPlan:
    times = {
        kind: {name: s for name, s in getattr(plan, kind).items() if name != stage}
        for kind in ("green", "min_green", "max_green")
    }
    return changed_part(
        plan, {**times, "stages": tuple(name for name in plan.stages if name != stage)}
    )
