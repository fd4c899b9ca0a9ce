"""Traffic lights of the network as scenarios see them."""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING

from odscen.convert.model.net import CROSSED, UNUSED
from odscen.convert.signals.signal_programs import SignalGroup
from odscen.scenario.signals.light import Light, Meeting, SignalMovement
from odscen.sumo.realize.sumo_lane_places import lane_segments

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from odscen.convert.lane_table.table import SumoLight
    from odscen.convert.model.net import LightLink
    from odscen.sumo.realize.sumo_map import SumoMap

_TURNS = {"l": "left", "s": "straight", "r": "right", "t": "turnaround", CROSSED: "walk"}


@lru_cache(maxsize=4)
def scenario_lights(sumo_map: SumoMap) -> tuple[Light, ...]:
    """Traffic lights as scenarios see them, in the order of the network."""
    if not sumo_map.lights:
        return ()
    segments = lane_segments(sumo_map)
    return tuple(_make_light(light, sumo_map, segments) for light in sumo_map.lights)


def _make_light(
    light: SumoLight, sumo_map: SumoMap, segments: Mapping[str, Sequence[str]]
) -> Light:
    return Light(
        tuple(light.junctions) or (light.id,),
        tuple(phase.duration for phase in light.phases if phase.is_stage),
        tuple(_make_movement(link, sumo_map, segments) for link in light.links),
        tuple(Meeting(*conflict) for conflict in light.conflicts),
    )


def _make_movement(
    link: LightLink, sumo_map: SumoMap, segments: Mapping[str, Sequence[str]]
) -> SignalMovement:
    if link.turn == UNUSED:
        return SignalMovement("", "", "")
    turn = _TURNS[link.turn]
    if link.turn == CROSSED:
        lanes = sumo_map.net.edge_lanes
        crossed = [lane.id for edge in link.crossed for lane in lanes.get(edge, ())]
        legs = tuple(dict.fromkeys(name for lane in crossed for name in segments.get(lane, ())))
        legs = legs or (link.source,)
        return SignalMovement(legs[0], legs[0], turn, legs=legs)
    source, target = (
        _segment_at_stop_line(lane, sumo_map, segments, back=back)
        for lane, back in ((link.source, True), (link.target, False))
    )
    names = sumo_map.lane_names
    lanes_named = names.get(link.source, link.source), names.get(link.target, link.target)
    yellow = SignalGroup((), "", walkers=False, speed=link.speed).yellow
    return SignalMovement(source, target, turn, lanes_named, yellow)


def _segment_at_stop_line(
    lane: str, sumo_map: SumoMap, segments: Mapping[str, Sequence[str]], *, back: bool
) -> str:
    """Segment at the stop line (or behind the junction) of a lane, or of the next one with any.

    Lanes for bicycles have that of the lane beside them.
    """
    links = sumo_map.net.links
    seen = {lane}
    todo = [lane]
    while todo:
        name = todo.pop(0)
        for beside in _lanes_of_edge(name, sumo_map):
            if segments.get(beside):
                return segments[beside][-1 if back else 0]
        for link in links:
            near, far = (link.target, link.source) if back else (link.source, link.target)
            if near == name and far not in seen:
                seen.add(far)
                todo.append(far)
    return lane


def _lanes_of_edge(lane: str, sumo_map: SumoMap) -> list[str]:
    """A lane and the others of its edge, the nearest first."""
    own = sumo_map.net.lanes[lane]
    others = sumo_map.net.edge_lanes.get(own.edge, ())
    return [lane, *(lane.id for lane in sorted(others, key=lambda x: abs(x.index - own.index)))]
