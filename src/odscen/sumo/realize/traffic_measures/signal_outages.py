"""Traffic lights out of order: SUMO's WAUT switches them off, or to flashing, and back."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from odscen.convert.model.net import CROSSED
from odscen.scenario.document.measures_document import SignalOutage
from odscen.sumo.realize.lights.light_realization import SumoProgram
from odscen.sumo.realize.lights.program_files import FLASHING
from odscen.sumo.realize.lights.stage_phases import PhasePlan, SumoPhase
from odscen.sumo.realize.traffic_measures.measure_actions import end_of

if TYPE_CHECKING:
    from odscen.convert.lane_table.table import SumoLight
    from odscen.scenario.document.scenario_document import Scenario
    from odscen.sumo.realize.lights.light_realization import RealizedLight
    from odscen.sumo.realize.sumo_map import SumoMap

NET_PROGRAM = "0"
"""Program of a light in our networks."""

_AROUND = 90.0
"""Seconds of the only phase of a flashing light."""


def with_outages(
    lights: tuple[RealizedLight, ...], scenario: Scenario, sumo_map: SumoMap, *, until: float
) -> tuple[RealizedLight, ...]:
    """Let lights switch as the measures of a scenario say; without any, the same lights."""
    outages = [
        measure
        for measure in scenario.measures
        if isinstance(measure, SignalOutage) and measure.begin < until
    ]
    if not outages:
        return lights
    return tuple(
        _switch_light(
            light, sumo, [o for o in outages if o.junction in (sumo.id, *sumo.junctions)], until
        )
        for light, sumo in zip(lights, sumo_map.lights, strict=True)
    )


def _switch_light(
    light: RealizedLight, sumo: SumoLight, outages: list[SignalOutage], until: float
) -> RealizedLight:
    if not outages:
        return light
    usual = light.programs[0].id if light.programs else NET_PROGRAM
    switches: list[tuple[float, str]] = [(0.0, usual)]
    for signal_outage in sorted(outages, key=lambda outage: outage.begin):
        switches.append((signal_outage.begin, signal_outage.shows))
        if signal_outage.end is not None and signal_outage.end < until:
            switches.append((end_of(signal_outage, until), usual))
    programs = light.programs
    if any(outage.shows == FLASHING for outage in outages):
        programs = (*programs, _flashing_program(sumo))
    return replace(light, programs=programs, switches=tuple(switches))


def _flashing_program(light: SumoLight) -> SumoProgram:
    """All vehicles give way; who walks has right of way, as at any crosswalk."""
    state = "".join("O" if link.turn == CROSSED else "o" for link in light.links)
    phase = SumoPhase(_AROUND, state, FLASHING)
    return SumoProgram(FLASHING, "static", 0.0, PhasePlan((phase,), 1), {}, {})
