"""Changes to the parts of a light's program: groups, stages, intergreens, detectors, plans.

What refers to a group or a stage follows: stages, intergreens, detectors and plans of the day.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any, Literal

from odscen.base.errors import InputError, NotFoundError
from odscen.scenario.document.problems import validated
from odscen.scenario.document.signals_document import (
    DayPlan,
    ProgramGroup,
    ProgramStage,
    SignalDetector,
)
from odscen.scenario.edits.edit_registry import changed_part, drop_part, edit, put_part
from odscen.scenario.edits.program_changes import (
    fitted_cycles,
    own_program,
    timing_of_light,
    with_timing,
)
from odscen.scenario.signals.light import shortest_names
from odscen.scenario.signals.program_design import designed_group, seconds_of_day

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping, Sequence

    from odscen.scenario.document.scenario_document import Scenario
    from odscen.scenario.document.signals_document import JunctionTiming
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
    ids = [group.id for group in timing.groups]
    if name in ids:
        old = timing.groups[ids.index(name)]
        timing = _replace_group(timing, old, changed_part(old, fields))
        name = fields.get("id", name)
    elif not fields.get("movements"):
        raise InputError(
            f"the light of junction {timing.junction!r} has no group {name!r}; a new one needs "
            f"movements, an old one is one of {', '.join(ids)}"
        )
    else:
        new = validated(ProgramGroup, {**fields, "id": name})
        timing = _join_group(timing, light, new)
    return _take_movements(timing, light, name) if "movements" in fields else timing


def _replace_group(timing: JunctionTiming, old: ProgramGroup, new: ProgramGroup) -> JunctionTiming:
    timing = changed_part(
        timing, {"groups": tuple(new if group is old else group for group in timing.groups)}
    )
    return _rename_groups(timing, lambda name: new.id if name == old.id else name)


def _join_group(timing: JunctionTiming, light: Light, new: ProgramGroup) -> JunctionTiming:
    """A program with a new group behind that of its first movement, and with what that shows."""
    movements = set(designed_group(new, light).movements)
    from_group = next(
        (
            group.id
            for group in timing.groups
            if movements & set(designed_group(group, light).movements)
        ),
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
    at = next((n + 1 for n, group in enumerate(timing.groups) if group.id == from_group), 0)
    changes = {
        "groups": (*timing.groups[:at], new, *timing.groups[at:]),
        "stages": stages,
        "intergreens": (*timing.intergreens, *beside),
    }
    return changed_part(timing, changes)


def _take_movements(timing: JunctionTiming, light: Light, name: str) -> JunctionTiming:
    """A program in which no other group has the movements of this one."""
    groups = {group.id: set(designed_group(group, light).movements) for group in timing.groups}
    own = groups[name]
    left: list[ProgramGroup] = []
    for program_group in timing.groups:
        if program_group.id == name or not groups[program_group.id] & own:
            left.append(program_group)
        elif groups[program_group.id] - own:
            names = shortest_names(groups[program_group.id] - own, light.movements)
            left.append(changed_part(program_group, {"movements": names}))
    gone = set(groups) - {group.id for group in left}
    timing = changed_part(timing, {"groups": tuple(left)})
    return _rename_groups(timing, lambda group: None if group in gone else group)


def _rename_groups(timing: JunctionTiming, name_of: Callable[[str], str | None]) -> JunctionTiming:
    """What refers to groups by other names of them; none takes the reference out."""

    def names(of: Iterable[str]) -> tuple[str, ...]:
        found = (name_of(name) for name in of)
        return tuple(dict.fromkeys(name for name in found if name is not None))

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
    groups = {group.id: group for group in timing.groups}
    for group_name in (name, into):
        if group_name not in groups:
            raise NotFoundError(
                f"signal group of the light of junction {timing.junction!r}",
                group_name,
                list(groups),
            )
    if name == into:
        raise InputError(f"the movements of group {name!r} have to join another group")
    members = {
        n
        for group_name in (name, into)
        for n in designed_group(groups[group_name], light).movements
    }
    return with_group(timing, light, into, {"movements": shortest_names(members, light.movements)})


def stage_of(timing: JunctionTiming, name: str) -> ProgramStage:
    """Stage with this id.

    Raises
    ------
    NotFoundError
        If there is none.
    """
    found = {stage.id: stage for stage in timing.stages}
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
    ids = [stage.id for stage in timing.stages]
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
        changed_part(detector, {"stages": tuple(s for s in detector.stages if s != name)})
        for detector in timing.detectors
        if set(detector.stages) != {name}
    )
    changes = {
        "stages": tuple(stage for stage in timing.stages if stage.id != name),
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


@edit("Signal group {group} in junction {junction}")
def set_group(
    scenario: Scenario,
    lights: Sequence[Light],
    junction: str,
    group: str,
    *,
    protected: Sequence[str] | None = None,
    permissive: Sequence[str] | None = None,
    **fields: Annotated[Any, ProgramGroup],
) -> Scenario:
    """Put a signal group in, or change it; its movements leave the groups that had them.

    Parameters
    ----------
    lights
        Traffic lights of the map.
    group
        Id. A new one has green with the group from which its first movement comes, unless stages
        are given; one that is there keeps its stages.
    protected, permissive
        Stages in which it has green, and in which it has and gives way: instead of those before.
    fields
        Fields of :class:`~odscen.scenario.document.signals_document.ProgramGroup`; ``id`` renames.

    Raises
    ------
    InputError
        If the light has no program of its own, or a new group no movements.
    NotFoundError
        If there is no such stage.
    ScenarioError
        If greens conflict, or a movement would have no group.
    """
    light, old = own_program(scenario, lights, junction)
    new = with_group(old, light, group, fields)
    name = fields.get("id", group)
    new = with_greens_of(new, name, protected=protected, permissive=permissive)
    return with_timing(scenario, lights, fitted_cycles(new, light))


@edit("Remove signal group {group} from junction {junction}")
def remove_group(
    scenario: Scenario, lights: Sequence[Light], junction: str, *, group: str, into: str
) -> Scenario:
    """Take a signal group out; its movements join the group ``into``.

    Raises
    ------
    InputError
        If the light has no program of its own, or ``into`` is the same group.
    NotFoundError
        If there is no such group.
    ScenarioError
        If greens conflict then.
    """
    light, old = own_program(scenario, lights, junction)
    new = without_group(old, light, group, into)
    return with_timing(scenario, lights, fitted_cycles(new, light))


@edit("New stage {stage} in junction {junction}")
def add_stage(
    scenario: Scenario,
    lights: Sequence[Light],
    junction: str,
    stage: str,
    *,
    after: str | None = None,
    **fields: Annotated[Any, ProgramStage],
) -> Scenario:
    """Put a stage in, behind the stage ``after`` or at the end.

    Raises
    ------
    InputError
        If the light has no program of its own, or the id is taken.
    NotFoundError
        If there is no stage ``after``.
    ScenarioError
        If greens conflict, or the stage gives none.
    """
    light, old = own_program(scenario, lights, junction)
    new = validated(ProgramStage, {**fields, "id": stage})
    made = fitted_cycles(with_new_stage(old, new, after=after), light)
    return with_timing(scenario, lights, made)


@edit("Remove stage {stage} from junction {junction}")
def remove_stage(
    scenario: Scenario, lights: Sequence[Light], junction: str, *, stage: str
) -> Scenario:
    """Take a stage out, and detectors that prolong nothing else.

    Raises
    ------
    InputError
        If the light has no program of its own, or the stage is the only one.
    NotFoundError
        If there is no such stage.
    ScenarioError
        If a group would have no green.
    """
    light, old = own_program(scenario, lights, junction)
    return with_timing(scenario, lights, fitted_cycles(without_stage(old, stage), light))


@edit("Intergreen of {ending} and {beginning} in junction {junction}")
def set_intergreen(
    scenario: Scenario,
    lights: Sequence[Light],
    junction: str,
    *,
    ending: str,
    beginning: str,
    seconds: float | None,
) -> Scenario:
    """Say how long after the end of green of a group another may begin.

    Parameters
    ----------
    lights
        Traffic lights of the map.
    ending, beginning
        Groups.
    seconds
        From the end of green to the begin of green; ``None`` for what the paths need.

    Raises
    ------
    InputError
        If the light has no program of its own.
    ScenarioError
        If there is no such group, or one stage follows the other in which it would be too short.
    """
    light, old = own_program(scenario, lights, junction)
    rows = {row[:2]: row[2] for row in old.intergreens}
    if seconds is None:
        rows.pop((ending, beginning), None)
    else:
        rows[(ending, beginning)] = seconds
    new = changed_part(old, {"intergreens": tuple((*pair, s) for pair, s in rows.items())})
    known = {group.id for group in old.groups}
    if known.issuperset((ending, beginning)):
        new = fitted_cycles(new, light)
    return with_timing(scenario, lights, new)


@edit("Detector {detector} of light {junction}")
def set_detector(
    scenario: Scenario,
    lights: Sequence[Light],
    junction: str,
    detector: str,
    **fields: Annotated[Any, SignalDetector],
) -> Scenario:
    """Lay a loop before a light, or change one.

    Parameters
    ----------
    lights
        Traffic lights of the map.
    fields
        Fields of :class:`~odscen.scenario.document.signals_document.SignalDetector`; a new one
        needs ``at`` and ``stages``, ``id`` renames.

    Raises
    ------
    ScenarioError
        If no light is in the junction, there is no such stage, approach or lane, or a new one lacks
        a field.
    """
    _, old = timing_of_light(scenario, lights, junction)
    known = next(
        (signal_detector for signal_detector in old.detectors if signal_detector.id == detector),
        None,
    )
    new = (
        validated(SignalDetector, {"id": detector, **fields})
        if known is None
        else changed_part(known, fields)
    )
    detectors, _ = put_part(
        old.detectors, new, what="detector", instead_of=None if known is None else detector
    )
    return with_timing(scenario, lights, changed_part(old, {"detectors": detectors}))


@edit("Remove detector {detector} of light {junction}")
def remove_detector(
    scenario: Scenario, lights: Sequence[Light], junction: str, *, detector: str
) -> Scenario:
    """Take a detector out.

    Raises
    ------
    NotFoundError
        If there is none of this id.
    """
    _, old = timing_of_light(scenario, lights, junction)
    left = drop_part(old.detectors, "detector", detector)
    return with_timing(scenario, lights, changed_part(old, {"detectors": left}))


@edit("Plan {plan} of light {junction}")
def set_plan(
    scenario: Scenario,
    lights: Sequence[Light],
    junction: str,
    plan: str,
    **fields: Annotated[Any, DayPlan],
) -> Scenario:
    """Put a plan of the day in, or change one.

    Parameters
    ----------
    lights
        Traffic lights of the map.
    plan
        Id. The first one of a light begins at midnight unless ``times`` are given, and has the
        light's offset.
    fields
        Fields of :class:`~odscen.scenario.document.signals_document.DayPlan`; ``id`` renames. At
        the ``times`` no other plan begins any more.

    Raises
    ------
    InputError
        If the light has no program of its own.
    ScenarioError
        If a plan would never begin, or its cycle is not what its greens add up to.
    """
    light, old = own_program(scenario, lights, junction)
    first = {} if old.plans else {"times": ("00:00",), "offset": old.offset}
    known = next((day_plan for day_plan in old.plans if day_plan.id == plan), None)
    new = (
        validated(DayPlan, {"id": plan, **first, **fields})
        if known is None
        else changed_part(known, fields)
    )
    plans, at = put_part(
        old.plans, new, what="plan of the day", instead_of=None if known is None else plan
    )
    own = set(map(seconds_of_day, new.times))
    left = tuple(
        plan
        if index == at or "times" not in fields
        else changed_part(
            plan, {"times": tuple(t for t in plan.times if seconds_of_day(t) not in own)}
        )
        for index, plan in enumerate(plans)
    )
    made = changed_part(old, {"plans": left, "offset": 0.0})
    orders = {name for day_plan in left for name in (*day_plan.stages, *day_plan.green)}
    unknown = orders - {stage.id for stage in old.stages}
    return with_timing(
        scenario, lights, made if unknown or "cycle" in fields else fitted_cycles(made, light)
    )


@edit("Remove plan {plan} of light {junction}")
def remove_plan(
    scenario: Scenario, lights: Sequence[Light], junction: str, *, plan: str
) -> Scenario:
    """Take a plan of the day out; after the last one the program has its offset.

    Raises
    ------
    InputError
        If the light has no program of its own.
    NotFoundError
        If there is no such plan.
    ScenarioError
        If a plan that is left would never begin.
    """
    light, old = own_program(scenario, lights, junction)
    gone = next((day_plan for day_plan in old.plans if day_plan.id == plan), None)
    if gone is None:
        raise NotFoundError("plan of the day", plan, [plan.id for plan in old.plans])
    left = tuple(plan for plan in old.plans if plan is not gone)
    changes: dict[str, Any] = {"plans": left}
    if not left:
        changes["offset"] = gone.offset
    return with_timing(scenario, lights, fitted_cycles(changed_part(old, changes), light))
