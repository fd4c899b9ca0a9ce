"""The rules on traffic lights: how a scenario times them, and on their programs."""

from __future__ import annotations

from collections import Counter
from itertools import groupby
from typing import TYPE_CHECKING

from odscen.base.shown import shown, some_of
from odscen.scenario.document.problems import error, warning
from odscen.scenario.signals.light import find_movements, known_names, lights_by_name
from odscen.scenario.signals.program_design import (
    DesignedProgram,
    active_plans,
    beginning_groups,
    cycle_length,
    detector_movements,
    stage_state,
)

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

    from odscen.scenario.document.problems import Problem
    from odscen.scenario.document.signals_document import Control, JunctionTiming, Signals
    from odscen.scenario.signals.light import Light, Meeting
    from odscen.scenario.signals.program_design import PlannedStage, TimedPlan


_SAME = 1e-6
_NAMED = 60
"""Groups, stages or movements that a message names; a light has fewer."""


def program_problems(
    timing: JunctionTiming,
    light: Light,
    control: Control,
    where: str,
    *,
    clock: float,
    until: float | None,
) -> Iterator[Problem]:
    """Yield what is wrong with the program of a light; ``where`` is its place in the document."""
    names = list(_name_problems(timing, light, where))
    yield from names
    stages = (
        {stage.id for stage in timing.stages}
        if timing.stages
        else {str(number + 1) for number in range(len(light.green))}
    )
    yield from _detector_problems(timing, light, stages, where)
    if names or not timing.stages:
        return
    program = DesignedProgram(timing, light, control)
    plans = program.plans()
    yield from _conflict_problems(program, plans[0].stages, where)
    yield from _intergreen_problems(program, where)
    for index, plan in enumerate(plans):
        place = f"{where}.plans[{index}]" if timing.plans else where
        yield from _plan_problems(program, plan, place)
        yield from _group_green_problems(program, plan, where)
    yield from _never_active(plans, where, clock=clock, until=until)


def _name_problems(timing: JunctionTiming, light: Light, where: str) -> Iterator[Problem]:
    for kind in ("groups", "stages", "detectors", "plans"):
        ids = [part.id for part in getattr(timing, kind)]
        for name in sorted(name for name, count in Counter(ids).items() if count > 1):
            message = f"id {name!r} is taken twice; give one of them another"
            yield error("duplicate_id", f"{where}.{kind}", message)
    if timing.groups:
        yield from _movement_problems(timing, light, where)
    groups = {group.id for group in timing.groups}
    stages = {stage.id for stage in timing.stages}
    for index, stage in enumerate(timing.stages):
        yield from _find_unknown("group", stage.groups, groups, f"{where}.stages[{index}]")
    for index, row in enumerate(timing.intergreens):
        yield from _find_unknown("group", row[:2], groups, f"{where}.intergreens[{index}]")
    for index, plan in enumerate(timing.plans):
        named = (*plan.stages, *plan.green, *plan.min_green, *plan.max_green)
        yield from _find_unknown("stage", dict.fromkeys(named), stages, f"{where}.plans[{index}]")
        shown = [s for s in timing.stages if s.id in (plan.stages or stages)]
        yield from _without_green(groups, shown, f"{where}.plans[{index}].stages")
    if not timing.plans and timing.stages:
        yield from _without_green(groups, timing.stages, f"{where}.stages")


def _without_green(
    groups: Iterable[str], stages: Iterable[object], where: str
) -> Iterator[Problem]:
    green = {name for stage in stages for name in getattr(stage, "groups", ())}
    for name in sorted(set(groups) - green):
        message = f"group {name!r} has green in no stage; add it to one"
        yield error("movement_without_green", where, message)


def _find_unknown(
    kind: str, names: Iterable[str], known: Iterable[str], where: str
) -> Iterator[Problem]:
    for name in names:
        if name not in known:
            listed = some_of([repr(other) for other in sorted(known)], most=_NAMED, between=", ")
            yield error(
                f"unknown_{kind}", where, f"there is no {kind} {name!r}; there are {listed}"
            )


def _movement_problems(timing: JunctionTiming, light: Light, where: str) -> Iterator[Problem]:
    owner: dict[int, str] = {}
    for index, group in enumerate(timing.groups):
        for number, name in enumerate(group.movements):
            place = f"{where}.groups[{index}].movements[{number}]"
            found = find_movements(name, light.movements)
            if not found:
                listed = some_of(known_names(light.movements), most=_NAMED, between=", ")
                message = f"no movement of this light is called {name!r}; there are {listed}"
                yield error("unknown_movement", place, message)
            for n in found:
                other = owner.setdefault(n, group.id)
                if other != group.id:
                    message = (
                        f"{light.movements[n].exact_name} is in group {other!r} already; "
                        "a movement has one light"
                    )
                    yield error("movement_twice", place, message)
    missing = [one for n, one in enumerate(light.movements) if one.turn and n not in owner]
    if missing:
        listed = ", ".join(dict.fromkeys(movement.exact_name for movement in missing))
        message = f"no group has {listed}; they would never have green"
        yield error("movement_without_green", f"{where}.groups", message)


def _conflict_problems(
    program: DesignedProgram, stages: Iterable[PlannedStage], where: str
) -> Iterator[Problem]:
    order = {stage.id: index for index, stage in enumerate(program.timing.stages)}
    for stage in stages:
        told: set[tuple[str, str]] = set()
        for meeting in program.light.meetings:
            pair = program.group_of[meeting.one], program.group_of[meeting.other]
            if set(pair) <= stage.groups and pair not in told:
                message = _find_conflict(program, stage, meeting)
                if message:
                    told.add(pair)
                    place = f"{where}.stages[{order[stage.id]}]"
                    yield error("conflicting_greens", place, message)


def _find_conflict(program: DesignedProgram, stage: PlannedStage, meeting: Meeting) -> str | None:
    """Why two movements that meet may not both have green in a stage, if they may not."""
    one, other = (
        f"{program.light.movements[n].name} (group {program.group_of[n]!r})"
        for n in (meeting.one, meeting.other)
    )
    own, their = program.group_of[meeting.one], program.group_of[meeting.other]
    what = f"stage {stage.id!r} gives green to {one} and {other}, which meet"
    if not meeting.shares or meeting.yields < 0:
        return f"{what}; they cannot have green together"
    if own == their or program.group_of[meeting.yields] in stage.permissive:
        return None
    return (
        f"{what}; make group {program.group_of[meeting.yields]!r}, which gives way, permissive, or "
        "put them in different stages"
    )


def _intergreen_problems(program: DesignedProgram, where: str) -> Iterator[Problem]:
    # Plans that have the same stages, of whatever length, are looked at once.
    orders = {
        frozenset(stage._replace(id="", green=0, least=0, most=0) for stage in plan.stages)
        for plan in program.plans()
    }
    follows = {
        (group, other)
        for stages in orders
        for stage in stages
        for following in stages
        for group in stage.groups - following.groups
        for other in beginning_groups(stage, following)
    }
    rows = {row[:2]: n for n, row in enumerate(program.timing.intergreens)}
    order = [group.id for group in program.timing.groups]
    for short in program.too_short():
        pair = short.ending, short.beginning
        if pair not in follows:
            continue
        row = rows.get(pair)
        place = (
            f"{where}.groups[{order.index(short.ending)}]"
            if row is None
            else f"{where}.intergreens[{row}]"
        )
        one, other = (program.light.movements[n].name for n in short.places)
        message = (
            f"{short.given:g} s between group {short.ending!r} and group {short.beginning!r} is "
            f"too short: {one} needs {short.needed:g} s to clear the path of {other}"
        )
        yield error("intergreen_too_short", place, message)


def _plan_problems(program: DesignedProgram, plan: TimedPlan, where: str) -> Iterator[Problem]:
    for stage in plan.stages:
        if not stage.least <= stage.green <= stage.most:
            message = (
                f"stage {stage.id!r} has {stage.green:g} s of green, which is not between its "
                f"min_green of {stage.least:g} s and its max_green of {stage.most:g} s"
            )
            yield error("green_out_of_bounds", where, message)
        if "G" not in (state := stage_state(program, stage)) and "g" not in state:
            yield error("empty_stage", where, f"stage {stage.id!r} gives no green")
    if plan.stages[0].on_call:
        message = f"stage {plan.stages[0].id!r} is the first and cannot wait for a call"
        yield error("first_stage_on_call", where, message)
    length = cycle_length(program, plan.stages)
    if plan.cycle is not None and abs(length - plan.cycle) > _SAME:
        message = (
            f"greens and intergreens add up to {length:g} s, but the cycle is {plan.cycle:g} s; "
            "change one of them"
        )
        yield error("cycle_differs", f"{where}.cycle", message)


def _group_green_problems(
    program: DesignedProgram, plan: TimedPlan, where: str
) -> Iterator[Problem]:
    """Groups whose green may be over before their own shortest green."""
    for index, group in enumerate(program.timing.groups):
        if group.min_green is None:
            continue
        shortest = _shortest_green(program, plan.stages, group.id)
        if shortest is not None and shortest[0] < group.min_green - _SAME:
            seconds, stages = shortest
            message = (
                f"group {group.id!r} may have only {seconds:g} s of green in stage "
                f"{', '.join(map(repr, stages))}, but its min_green is {group.min_green:g} s; "
                "give the stage a longer green"
            )
            yield error("group_green_too_short", f"{where}.groups[{index}].min_green", message)


def _shortest_green(
    program: DesignedProgram, stages: tuple[PlannedStage, ...], group: str
) -> tuple[float, tuple[str, ...]] | None:
    """Least seconds for which a group has green at a time, and the stages in which it has them.

    Stages on call may be left out, but those in which it has no other green.
    """
    if all(group in stage.groups for stage in stages):
        return None
    begin = next((n for n, one in enumerate(stages) if group not in one.groups), 0)
    turned = (*stages[begin:], *stages[:begin])
    actuated = program.control == "actuated"
    found: list[tuple[float, tuple[str, ...]]] = []
    for has, same in groupby(turned, lambda stage: group in stage.groups):
        if not has:
            continue
        run = list(same)
        sure = [stage for stage in run if not stage.on_call]
        for chain in [sure] if sure else [[stage] for stage in run]:
            seconds = sum(stage.least if actuated else stage.green for stage in chain)
            found.append((seconds, tuple(stage.id for stage in chain)))
    return min(found, default=None)


def _never_active(
    plans: tuple[TimedPlan, ...], where: str, *, clock: float, until: float | None
) -> Iterator[Problem]:
    if len(plans) < 2 and not plans[0].times:
        return
    active = {name for _, name in active_plans(plans, clock=clock, until=until)}
    for index, plan in enumerate(plans):
        place = f"{where}.plans[{index}].times"
        if not plan.times:
            message = f"plan {plan.id!r} is never active: give a time at which it begins"
            yield error("plan_never_active", place, message)
        elif plan.id not in active:
            message = f"plan {plan.id!r} is not active at any time of the run"
            yield warning("plan_never_active", place, message)


def _detector_problems(
    timing: JunctionTiming, light: Light, stages: set[str], where: str
) -> Iterator[Problem]:
    for index, detector in enumerate(timing.detectors):
        place = f"{where}.detectors[{index}]"
        yield from _find_unknown("stage", detector.stages, stages, f"{place}.stages")
        if light.movements and not detector_movements(detector.at, light.movements):
            ends = dict.fromkeys(
                movement.approach for movement in light.movements if movement.drive
            )
            message = (
                f"no approach or lane before this light is called {detector.at!r}; approaches are "
                f"{', '.join(ends)}"
            )
            yield error("unknown_detector_place", f"{place}.at", message)


LEAST_GREEN = 5.0
"""Seconds of green of a stage, at least: drivers who see less of it stop taking it for green."""

_LISTED = 10
"""Names in a message, at most."""


def signal_problems(
    signals: Signals, lights: Sequence[Light], *, clock: float = 0.0, until: float | None = None
) -> Iterator[Problem]:
    """Yield what is wrong with the timing of traffic lights.

    Parameters
    ----------
    clock
        Time of day at which the scenario begins, seconds.
    until
        Seconds that it lasts, for the plans that it does not come to.
    """
    timed: dict[tuple[str, ...], str] = {}
    light_of = lights_by_name(lights)
    for index, timing in enumerate(signals.junctions):
        where = f"signals.junctions[{index}]"
        light = light_of.get(timing.junction)
        if light is None:
            message = no_light_in(timing.junction, lights)
            yield error("unknown_light", f"{where}.junction", message)
            continue
        if light.names in timed:
            message = (
                f"the light of junction {timing.junction!r} is timed by {timed[light.names]} "
                "already; keep one of them"
            )
            yield error("light_twice", f"{where}.junction", message)
        timed.setdefault(light.names, where)
        yield from _green_problems(timing, light, where)
        control = signals.control_of(timing) or "fixed"
        if timing.stages and timing.control == "extended":
            message = (
                f"the light of junction {timing.junction!r} has a program of its own; extended "
                "control is for stages of the map, make it fixed or actuated"
            )
            yield error("extended_needs_map_stages", f"{where}.control", message)
        yield from program_problems(timing, light, control, where, clock=clock, until=until)
        asked = signals.bus_priority if timing.bus_priority is None else timing.bus_priority
        if asked:
            yield from _priority_problems(timing, control, where)
    yield from _coordination_problems(signals)


def _priority_problems(timing: JunctionTiming, control: Control, where: str) -> Iterator[Problem]:
    """Buses at a program that they cannot change, or whose offset they undo."""
    if timing.stages and control == "fixed":
        message = (
            f"the light of junction {timing.junction!r} has a fixed-time program of its own, "
            "which buses cannot change; make its control actuated or its bus_priority false"
        )
        yield error("bus_priority_needs_actuation", f"{where}.bus_priority", message)
    elif timing.offset and not timing.stages:
        message = (
            f"the light of junction {timing.junction!r} has an offset of {timing.offset:g} s, but "
            "does not come back to it after a bus that has priority: in a green wave make its "
            "bus_priority false, or give it an actuated program of its own with a cycle, which "
            "it keeps to"
        )
        yield warning("offset_lost_to_buses", f"{where}.bus_priority", message)


def _green_problems(timing: JunctionTiming, light: Light, where: str) -> Iterator[Problem]:
    if timing.green and len(timing.green) != len(light.green):
        program = ", ".join(f"{seconds:g}" for seconds in light.green)
        message = (
            f"the light of junction {timing.junction!r} has {len(light.green)} stages, but "
            f"green has {len(timing.green)} times; they are not used: give one for each (the map's "
            f"are {program})"
        )
        yield warning("wrong_number_of_greens", f"{where}.green", message)
    for stage, seconds in enumerate(timing.green):
        if seconds < LEAST_GREEN:
            message = (
                f"{seconds:g} s is too short for a green; give stage {stage + 1} at least "
                f"{LEAST_GREEN:g} s"
            )
            yield error("green_too_short", f"{where}.green[{stage}]", message)


def _coordination_problems(signals: Signals) -> Iterator[Problem]:
    """Lights of one coordination with different cycles, plan by plan."""
    first: dict[tuple[str, str], tuple[float, str]] = {}
    for index, timing in enumerate(signals.junctions):
        if timing.coordination is None:
            continue
        where = f"signals.junctions[{index}]"
        cycles = {plan.id: plan.cycle or timing.cycle for plan in timing.plans}
        for plan, cycle in (cycles or {"": timing.cycle}).items():
            if cycle is None:
                message = f"lights of coordination {timing.coordination!r} need a cycle"
                yield error("cycle_missing", f"{where}.cycle", message)
                continue
            seconds, other = first.setdefault((timing.coordination, plan), (cycle, where))
            if seconds != cycle:
                message = (
                    f"the cycle is {cycle:g} s, but {other} of the same coordination "
                    f"{timing.coordination!r} has {seconds:g} s; give both one"
                )
                yield error("cycles_of_coordination", f"{where}.cycle", message)


def no_light_in(junction: str, lights: Sequence[Light]) -> str:
    """Say that a junction has no light, and some that have one."""
    return (
        f"there is no traffic light in junction {shown(junction)}; {_describe_known_lights(lights)}"
    )


def _describe_known_lights(lights: Sequence[Light]) -> str:
    names = [name for light in lights for name in light.names]
    if not names:
        return "the map has no traffic lights"
    more = ", ..." if len(names) > _LISTED else ""
    return f"there are lights in {', '.join(map(repr, names[:_LISTED]))}{more}"
