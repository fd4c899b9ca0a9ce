"""Programs of traffic lights that a scenario changes, as an additional file for SUMO.

Only stages are timed anew. Yellow, clearing of crossings and all-red follow from speeds and lengths
of the map (:mod:`odscen.convert.signals.signal_programs`) and stay as they are.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from odscen.convert.model.net import TrafficLight, light_xml
from odscen.scenario.checks.signal_timing import Light
from odscen.scenario.document.scenario_document import JunctionTiming

if TYPE_CHECKING:
    from collections.abc import Sequence

    from odscen.convert.lane_table.table import SumoLight
    from odscen.convert.model.net import Phase
    from odscen.scenario.document.scenario_document import Control, Signals

PROGRAM = "scenario"
"""``programID``; the network's own is ``0``. SUMO runs the one that it has read last."""

TYPES: dict[Control, str] = {"fixed": "static", "actuated": "actuated"}
"""``type`` of a ``<tlLogic>``."""


def scenario_lights(lights: Sequence[SumoLight]) -> tuple[Light, ...]:
    """Traffic lights as scenarios see them, in the same order."""
    return tuple(
        Light(
            tuple(light.junctions) or (light.id,),
            tuple(phase.duration for phase in light.phases if phase.is_stage),
        )
        for light in lights
    )


def signals_xml(signals: Signals, lights: Sequence[SumoLight]) -> str | None:
    """Text of ``signals.add.xml``; ``None`` if all lights keep the program of the network.

    Parameters
    ----------
    signals
        Without errors, see :func:`odscen.scenario.checks.signal_timing.signal_problems`.
    """
    timings = {timing.junction: timing for timing in signals.junctions}
    lines: list[str] = []
    for light, known in zip(lights, scenario_lights(lights), strict=True):
        own = [timings[name] for name in known.names if name in timings]
        timing = own[0] if own else JunctionTiming(junction=known.names[0])
        kind = TYPES[timing.control or signals.control]
        phases = _timed(light.phases, timing.green or known.green)
        offset = timing.offset or light.offset
        if (kind, phases, offset) != (TYPES["fixed"], light.phases, light.offset):
            lines += light_xml(TrafficLight(light.id, phases, kind, offset, PROGRAM, light.signals))
    if not lines:
        return None
    head = ['<?xml version="1.0" encoding="UTF-8"?>', "<additional>"]
    return "\n".join([*head, *lines, "</additional>", ""])


def _timed(phases: Sequence[Phase], greens: Sequence[float]) -> tuple[Phase, ...]:
    """Phases with other greens; the bounds of an actuated green move with it."""
    left = iter(greens)
    return tuple(_stretched(phase, next(left)) if phase.is_stage else phase for phase in phases)


def _stretched(phase: Phase, green: float) -> Phase:
    return replace(
        phase,
        duration=green,
        least=min(phase.least, green),
        most=phase.most * green / phase.duration,
    )
