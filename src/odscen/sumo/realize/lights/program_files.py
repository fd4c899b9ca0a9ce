"""Programs of traffic lights that a scenario changes, as an additional file for SUMO."""

from __future__ import annotations

from typing import TYPE_CHECKING
from xml.sax.saxutils import quoteattr

from odscen.sumo.realize.lights.light_detectors import AREA_END

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

    from odscen.sumo.realize.lights.actuated.call_areas import CallArea
    from odscen.sumo.realize.lights.light_detectors import BusArea, PlacedLoop
    from odscen.sumo.realize.lights.light_realization import RealizedLight, SumoProgram
    from odscen.sumo.realize.lights.stage_phases import SumoPhase

FLASHING = "flashing"
"""Program of a light that is out of order and flashes."""

DETECTOR_PARAM = "odscen.detector"
"""Parameter of a loop that has the detector's name in the scenario."""

_PERIOD = 86_400
"""Seconds over which SUMO would aggregate what a loop counts; nothing of it is written."""


def signals_xml(lights: Iterable[RealizedLight], *, buses: Sequence[str] = ()) -> str | None:
    """Text of ``signals.add.xml``; ``None`` if all lights keep the program of the network.

    Parameters
    ----------
    buses
        Ids of the vTypes that have priority where buses have it.
    """
    lines: list[str] = []
    for light in lights:
        if light.programs or light.switches:
            lines += [_loop_xml(loop) for loop in light.loops]
            lines += [_bus_xml(area, buses) for area in light.buses]
            lines += [_area_xml(area) for area in light.areas]
            for program in light.programs:
                lines += _program_xml(light.shown.id, program)
            lines += _switches_xml(light)
    if not lines:
        return None
    head = ['<?xml version="1.0" encoding="UTF-8"?>', "<additional>"]
    return "\n".join([*head, *lines, "</additional>", ""])


def _loop_xml(loop: PlacedLoop) -> str:
    walking = ' detectPersons="walk"' if loop.walk else ""
    text = (
        f'    <inductionLoop id="{loop.id}" lane="{loop.lane}" pos="{loop.pos:.4f}"'
        f' length="{loop.length:.4f}"{walking} file="NUL" period="{_PERIOD}"'
    )
    if not loop.name:
        return text + "/>"
    return f'{text}><param key="{DETECTOR_PARAM}" value="{loop.name}"/></inductionLoop>'


def _bus_xml(area: BusArea, buses: Sequence[str]) -> str:
    # Without types SUMO would count all vehicles; a type that is not there counts none.
    return (
        f'    <laneAreaDetector id="{area.id}" lane="{area.lane}" endPos="-{AREA_END:g}"'
        f' length="{area.length:g}" friendlyPos="true" vTypes="{" ".join(buses) or "bus"}"'
        f' file="NUL" period="{_PERIOD}"/>'
    )


def _area_xml(area: CallArea) -> str:
    return (
        f'    <laneAreaDetector id="{area.id}" lane="{area.lane}" endPos="-{AREA_END:g}"'
        f' length="{area.length:g}" friendlyPos="true" file="NUL" period="{_PERIOD}"/>'
    )


def _program_xml(light: str, program: SumoProgram) -> Iterator[str]:
    yield (
        f'    <tlLogic id="{light}" type="{program.kind}" programID="{program.id}"'
        f' offset="{program.offset:g}">'
    )
    for phase in program.plan.phases:
        yield f"        <phase {' '.join(_phase_attributes(phase, program.kind))}/>"
    for name, expression in program.conditions.items():
        yield f"        <condition id={quoteattr(name)} value={quoteattr(expression)}/>"
    for key, value in program.params.items():
        yield f"        <param key={quoteattr(key)} value={quoteattr(value)}/>"
    yield "    </tlLogic>"


def _phase_attributes(phase: SumoPhase, kind: str) -> Iterator[str]:
    yield f'duration="{phase.seconds:g}" state="{phase.state}"'
    if kind == "actuated" and phase.prolonged:
        yield f'minDur="{phase.least:g}" maxDur="{phase.most:g}"'
    if phase.earliest_end is not None:
        yield f'earliestEnd="{phase.earliest_end:g}"'
    if phase.latest_end is not None:
        yield f'latestEnd="{phase.latest_end:g}"'
    if phase.following:
        yield f'next="{" ".join(map(str, phase.following))}"'
    if phase.early:
        yield f"earlyTarget={quoteattr(phase.early)}"
    if phase.final:
        yield f"finalTarget={quoteattr(phase.final)}"
    if (
        phase.name
    ):  # networks of other converters have phases without one; SUMO refuses an empty one
        yield f"name={quoteattr(phase.name)}"


def _switches_xml(light: RealizedLight) -> Iterator[str]:
    """Plans of the day, or outages: SUMO switches plans at the begin of the first stage."""
    if len(light.programs) < 2 and len(light.switches) < 2:
        return
    known = {program.id for program in light.programs}
    outage = any(program not in known for _, program in light.switches) or FLASHING in known
    name = light.shown.id
    yield f'    <WAUT id="plans.{name}" refTime="0" startProg="{light.switches[0][1]}">'
    for time, program in light.switches[1:]:
        yield f'        <wautSwitch time="{time:.10g}" to="{program}"/>'
    yield "    </WAUT>"
    # Plans wait for a stage that both have; a light that fails does so at once.
    procedure = "" if outage else ' procedure="GSP" synchron="true"'
    yield f'    <wautJunction wautID="plans.{name}" junctionID="{name}"{procedure}/>'
