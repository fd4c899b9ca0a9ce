"""The rules on how a scenario times traffic lights."""

from __future__ import annotations

from typing import TYPE_CHECKING

from odscen.scenario.checks.program_checks import program_problems
from odscen.scenario.document.problems import error, warning
from odscen.scenario.signals.light import find_light

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from odscen.scenario.document.problems import Problem
    from odscen.scenario.document.signals_document import Control, JunctionTiming, Signals
    from odscen.scenario.signals.light import Light

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
    for index, timing in enumerate(signals.junctions):
        where = f"signals.junctions[{index}]"
        light = find_light(lights, timing.junction)
        if light is None:
            message = f"there is no traffic light in junction {timing.junction!r}; {_known(lights)}"
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
        control = timing.control or signals.control
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


def _known(lights: Sequence[Light]) -> str:
    names = [name for light in lights for name in light.names]
    if not names:
        return "the map has no traffic lights"
    more = ", ..." if len(names) > _LISTED else ""
    return f"there are lights in {', '.join(map(repr, names[:_LISTED]))}{more}"
