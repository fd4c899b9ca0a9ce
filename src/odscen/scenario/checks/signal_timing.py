"""Traffic lights as a scenario sees them, and the rules on their timing."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from odscen.scenario.document.problems import error

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from odscen.scenario.document.problems import Problem
    from odscen.scenario.document.scenario_document import Signals

LEAST_GREEN = 5.0
"""Seconds of green of a stage, at least: drivers who see less of it stop taking it for green."""

_LISTED = 10
"""Names in a message, at most."""


class Light(NamedTuple):
    """A traffic light of the map.

    Attributes
    ----------
    names
        What a scenario may call it: its OpenDRIVE junctions, or the SUMO id of a light in none.
    green
        Seconds of green of each stage in the map's program.
    """

    names: tuple[str, ...]
    green: tuple[float, ...]


def find_light(lights: Sequence[Light], junction: str) -> Light | None:
    """Light that a scenario means by ``junction``, if there is one."""
    return next((light for light in lights if junction in light.names), None)


def signal_problems(signals: Signals, lights: Sequence[Light]) -> Iterator[Problem]:
    """Yield what is wrong with the timing of traffic lights."""
    timed: dict[Light, str] = {}
    for index, timing in enumerate(signals.junctions):
        where = f"signals.junctions[{index}]"
        light = find_light(lights, timing.junction)
        if light is None:
            message = f"there is no traffic light in junction {timing.junction!r}; {_known(lights)}"
            yield error("unknown_light", f"{where}.junction", message)
            continue
        if light in timed:
            message = (
                f"the light of junction {timing.junction!r} is timed by {timed[light]} already; "
                "keep one of them"
            )
            yield error("light_twice", f"{where}.junction", message)
        timed.setdefault(light, where)
        if timing.green and len(timing.green) != len(light.green):
            program = ", ".join(f"{seconds:g}" for seconds in light.green)
            message = (
                f"the light of junction {timing.junction!r} has {len(light.green)} stages, but "
                f"green has {len(timing.green)} times; give one for each (the map's are {program})"
            )
            yield error("wrong_number_of_greens", f"{where}.green", message)
        for stage, seconds in enumerate(timing.green):
            if seconds < LEAST_GREEN:
                message = (
                    f"{seconds:g} s is too short for a green; give stage {stage + 1} at least "
                    f"{LEAST_GREEN:g} s"
                )
                yield error("green_too_short", f"{where}.green[{stage}]", message)


def _known(lights: Sequence[Light]) -> str:
    names = [name for light in lights for name in light.names]
    if not names:
        return "the map has no traffic lights"
    more = ", ..." if len(names) > _LISTED else ""
    return f"there are lights in {', '.join(map(repr, names[:_LISTED]))}{more}"
