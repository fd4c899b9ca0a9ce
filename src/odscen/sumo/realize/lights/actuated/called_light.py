"""An actuated light that keeps the stages of the map: phases, detectors and conditions."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from odscen.sumo.realize.lights.actuated.call_areas import CallDetectors, call_areas
from odscen.sumo.realize.lights.actuated.called_phases import called_phases
from odscen.sumo.realize.lights.actuated.stage_variants import StageVariants, shorter
from odscen.sumo.realize.lights.light_detectors import (
    ended_with_buses,
    may_end,
    vehicle_loops,
    waiting_places,
)

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from odscen.convert.lane_table.table import SumoLight
    from odscen.scenario.document.signals_document import SignalDetector
    from odscen.scenario.signals.light import Light
    from odscen.sumo.realize.lights.actuated.call_areas import CallArea
    from odscen.sumo.realize.lights.light_detectors import BusArea, PlacedLoop
    from odscen.sumo.realize.lights.stage_phases import PhasePlan, SumoPhase
    from odscen.sumo.realize.road_net import RoadNet


@dataclass(frozen=True, slots=True)
class CalledLight:
    """What SUMO needs to run one."""

    plan: PhasePlan
    loops: tuple[PlacedLoop, ...]
    areas: tuple[CallArea, ...]
    conditions: Mapping[str, str]


def called_light(
    light: SumoLight,
    view: Light,
    net: RoadNet,
    phases: Sequence[SumoPhase],
    *,
    detectors: Sequence[SignalDetector],
    buses: Sequence[BusArea],
) -> CalledLight | None:
    """Let vehicles and people call the stages of a light.

    Parameters
    ----------
    phases
        Of the map's program, with the greens of the scenario.
    detectors
        Those of the scenario.
    buses
        Where buses are seen that have priority.

    Returns
    -------
    ``None`` where there is nothing to choose: fewer than two stages, one for vehicles that none
    prolong, or movements of which is not known where they meet.
    """
    green = {p.stage: _green_links(p.state) for p in phases if p.stage}
    variants = StageVariants(phases, view)
    if not variants.usable:
        return None
    prolonged = {p.stage: shorter(p).least for p in phases if p.stage and p.prolonged}
    loops = vehicle_loops(
        light, view, net, designed=detectors, green={name: green[name] for name in prolonged},
        least=prolonged,
    )  # fmt: skip
    ends, conditions = {}, {}
    for name in prolonged:
        if ended := may_end(loops, name, green[name]):
            ends[name] = f"end{name}"
            conditions[ends[name]] = ended_with_buses(ended, buses, green[name])
    if not all(
        kind.green.stage in ends for kinds in variants.of_stage for kind in kinds if kind.drive
    ):
        return None
    walks = {n for n, movement in enumerate(view.movements) if movement.walk}
    places = waiting_places(light, net, {name: own & walks for name, own in green.items()})
    areas = call_areas(light, view, net, loops)
    callers = CallDetectors(areas, places, buses)
    plan = called_phases(variants, callers, ends=ends, conditions=conditions)
    return CalledLight(plan, (*loops, *places), areas, conditions)


def _green_links(state: str) -> set[int]:
    return {n for n, letter in enumerate(state) if letter in "Gg"}
