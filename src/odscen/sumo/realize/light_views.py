"""Traffic lights of the network as scenarios see them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from odscen.convert.model.net import CROSSED, UNUSED
from odscen.convert.signals.signal_programs import SignalGroup
from odscen.results.records.light_programs import ShownDetector
from odscen.scenario.signals.light import Light, Meeting, SignalMovement
from odscen.sumo.realize.sumo_lane_places import lane_segments

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from odscen.convert.lane_table.table import SumoLight
    from odscen.convert.model.net import LightLink
    from odscen.sumo.realize.light_detectors import PlacedLoop
    from odscen.sumo.realize.sumo_map import SumoMap

_TURNS = {"l": "left", "s": "straight", "r": "right", "t": "turnaround", CROSSED: "walk"}


def scenario_lights(sumo_map: SumoMap) -> tuple[Light, ...]:
    """Traffic lights as scenarios see them, in the order of the network."""
    if not sumo_map.lights:
        return ()
    segments = lane_segments(sumo_map)
    return tuple(_light(light, sumo_map, segments) for light in sumo_map.lights)


def shown_detectors(
    loops: Sequence[PlacedLoop], light: SumoLight, sumo_map: SumoMap
) -> tuple[ShownDetector, ...]:
    """Detectors of a light that prolong or call a stage, with their places on the map."""
    return tuple(
        ShownDetector(
            loop.id, loop.name, loop.stages, loop.walk, _loop_place(loop, light, sumo_map),
            loop.ahead, 0.0 if loop.walk else loop.gap,
        )
        for loop in loops
        if loop.stages
    )  # fmt: skip


def _loop_place(
    loop: PlacedLoop, light: SumoLight, sumo_map: SumoMap
) -> tuple[tuple[float, float], ...]:
    """Rear and front end of a loop; the end of the crossing where people wait; else nothing."""
    if loop.walk:
        waiting = [
            path[end]
            for link, path in ((light.links[n], light.links[n].path) for n in loop.movements)
            if path
            for end, area in ((0, link.source), (-1, link.target))
            if loop.lane.startswith(area) or area.startswith(loop.lane)
        ]
        return tuple(waiting[:1])
    places, lanes = sumo_map.lane_places, sumo_map.graph.lanes
    row = places.lanes.index(loop.lane) if loop.lane in places.lanes else -2
    nodes = np.flatnonzero(places.lane == row)
    nodes = nodes[np.argsort(places.pos[nodes], kind="stable")]
    if len(nodes) < 2:
        return _before_stop_line(loop, light)
    pos = places.pos[nodes]
    points = []
    for at in (loop.pos, loop.pos + loop.length):
        # Beyond the first and the last node the lane goes on straight.
        n = min(max(int(np.searchsorted(pos, at)), 1), len(nodes) - 1)
        step = max(pos[n] - pos[n - 1], 1e-6)
        share = (at - pos[n - 1]) / step
        a, b = nodes[n - 1], nodes[n]
        points.append(
            (
                round(float(lanes.x[a] + share * (lanes.x[b] - lanes.x[a])), 2),
                round(float(lanes.y[a] + share * (lanes.y[b] - lanes.y[a])), 2),
            )
        )
    return tuple(points)


def _before_stop_line(loop: PlacedLoop, light: SumoLight) -> tuple[tuple[float, float], ...]:
    """Straight back from where a movement of its lane begins, for a lane too short for a node."""
    paths = (light.links[n].path for n in loop.movements)
    (x, y), (x1, y1) = next((path[:2] for path in paths if len(path) > 1), ((0, 0), (0, 0)))
    length = float(np.hypot(x1 - x, y1 - y))
    if not length:
        return ()
    ux, uy = (x1 - x) / length, (y1 - y) / length
    ends = (loop.ahead + loop.length, loop.ahead)
    return tuple((round(x - ux * away, 2), round(y - uy * away, 2)) for away in ends)


def _light(light: SumoLight, sumo_map: SumoMap, segments: Mapping[str, Sequence[str]]) -> Light:
    return Light(
        tuple(light.junctions) or (light.id,),
        tuple(phase.duration for phase in light.phases if phase.is_stage),
        tuple(_movement(link, sumo_map, segments) for link in light.links),
        tuple(Meeting(*conflict) for conflict in light.conflicts),
    )


def _movement(
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
        _segment(lane, sumo_map, segments, back=back)
        for lane, back in ((link.source, True), (link.target, False))
    )
    names = sumo_map.lane_names
    lanes_named = names.get(link.source, link.source), names.get(link.target, link.target)
    yellow = SignalGroup((), "", walkers=False, speed=link.speed).yellow
    return SignalMovement(source, target, turn, lanes_named, yellow)


def _segment(
    lane: str, sumo_map: SumoMap, segments: Mapping[str, Sequence[str]], *, back: bool
) -> str:
    """Segment at the stop line (or behind the junction) of a lane, or of the next one with any.

    Lanes for bicycles have that of the lane beside them.
    """
    links = sumo_map.net.links
    seen = {lane}
    todo = [lane]
    while todo:
        one = todo.pop(0)
        for beside in _beside(one, sumo_map):
            if segments.get(beside):
                return segments[beside][-1 if back else 0]
        for link in links:
            near, far = (link.target, link.source) if back else (link.source, link.target)
            if near == one and far not in seen:
                seen.add(far)
                todo.append(far)
    return lane


def _beside(lane: str, sumo_map: SumoMap) -> list[str]:
    """A lane and the others of its edge, the nearest first."""
    own = sumo_map.net.lanes[lane]
    others = sumo_map.net.edge_lanes.get(own.edge, ())
    return [lane, *(one.id for one in sorted(others, key=lambda x: abs(x.index - own.index)))]
