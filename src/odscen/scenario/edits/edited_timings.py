"""The timing of one light in a scenario: found, and put back with its problems refused."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from odscen.base.errors import InputError
from odscen.scenario.checks.signal_timing import signal_problems
from odscen.scenario.document.problems import refuse_errors
from odscen.scenario.document.signals_document import JunctionTiming
from odscen.scenario.edits.edited_parts import changed_part, with_fields
from odscen.scenario.signals.light import find_light

if TYPE_CHECKING:
    from collections.abc import Sequence

    from odscen.scenario.document.scenario_document import Scenario
    from odscen.scenario.signals.light import Light


def timing_of_light(
    scenario: Scenario, lights: Sequence[Light], junction: str
) -> tuple[Light | None, JunctionTiming]:
    """The light in a junction, and what the scenario says of it."""
    light = find_light(lights, junction)
    names = () if light is None else light.names
    known = (one for one in scenario.signals.junctions if one.junction in names)
    return light, next(known, JunctionTiming(junction=junction))


def own_program(
    scenario: Scenario, lights: Sequence[Light], junction: str
) -> tuple[Light, JunctionTiming]:
    """A light with a program of the scenario's own.

    Raises
    ------
    InputError
        If it has none.
    """
    light, timing = timing_of_light(scenario, lights, junction)
    if light is None or not timing.stages:
        raise InputError(
            f"the light of junction {junction!r} has no program of this scenario; take over that "
            "of the map first"
        )
    return light, timing


def with_timing(
    scenario: Scenario, lights: Sequence[Light], new: JunctionTiming, *, strict: bool = False
) -> Scenario:
    """Put a timing in the place of that of its junction, or at the end.

    ``strict`` if its greens are new: a file may have greens of a former network, but who changes
    them now gives one for each stage.
    """
    timings = scenario.signals.junctions
    names = [one.junction for one in timings]
    index = names.index(new.junction) if new.junction in names else len(names)
    changed = (*timings[:index], new, *timings[index + 1 :])
    signals = changed_part(scenario.signals, {"junctions": changed})
    place = f"signals.junctions[{index}].green"
    refuse_errors(
        replace(one, severity="error") if strict and one.where == place else one
        for one in signal_problems(signals, lights)
    )
    return with_fields(scenario, signals=signals)
