"""Where detectors of lights lie on the map, for those who draw them."""

from __future__ import annotations

from math import hypot
from typing import TYPE_CHECKING

import numpy as np

from odscen.convert.model.net import CROSSED, UNUSED
from odscen.records.light_programs import ShownDetector
from odscen.sumo.realize.lights.light_detectors import lane_before

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

    from odscen.convert.lane_table.table import SumoLight
    from odscen.records.light_programs import ShownPlan
    from odscen.sumo.realize.lights.light_detectors import BusArea, PlacedLoop
    from odscen.sumo.realize.sumo_map import SumoMap

_Place = tuple[tuple[float, float], ...]
"""Points in driving direction, x and y in metres."""

_TOLERANCE = 0.05
"""Metres by which the line of an area may be off."""


def shown_detectors(
    loops: Iterable[PlacedLoop], light: SumoLight, sumo_map: SumoMap
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


def shown_bus_areas(
    areas: Iterable[BusArea], plans: Sequence[ShownPlan], sumo_map: SumoMap
) -> Iterator[ShownDetector]:
    """Areas in which buses are seen, each with the stages in which its lane has green.

    Those on lanes that buses may not use, or that have no place on the map, are not shown.
    """
    green = {phase.stage: phase.state for plan in plans for phase in plan.phases if phase.stage}
    for area in areas:
        stages = tuple(
            stage for stage, state in green.items() if any(state[n] in "Gg" for n in area.movements)
        )
        admits = sumo_map.net.lanes[area.lane].allows("bus")
        place = _area_place(area.lane, area.length, sumo_map) if stages and admits else ()
        if place:
            yield ShownDetector(area.id, "", stages, place=place, bus=True)


def lane_lines(light: SumoLight, sumo_map: SumoMap, metres: float) -> dict[int, _Place]:
    """Line of the last metres before the stop line, for the first movement of each lane.

    Movements are by their places in the light's states; lanes too short for a node have none.
    """
    lanes: dict[str, int] = {}
    for n, link in enumerate(light.links):
        if link.turn not in (UNUSED, CROSSED):
            lanes.setdefault(link.source, n)
    lines = {n: _area_place(lane, metres, sumo_map) for lane, n in lanes.items()}
    return {n: line for n, line in lines.items() if line}


def _loop_place(loop: PlacedLoop, light: SumoLight, sumo_map: SumoMap) -> _Place:
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
    points = _points_along(loop.lane, loop.pos, loop.pos + loop.length, sumo_map)
    if not points:
        return _place_before_stop_line(loop, light)
    return points[0], points[-1]


def _area_place(lane: str | None, length: float, sumo_map: SumoMap) -> _Place:
    """Line of so many metres before the end of a lane, over the lanes before it where it ends."""
    import shapely

    pieces: list[_Place] = []
    while lane is not None and length > 0.0:
        whole = sumo_map.net.lanes[lane].length
        pieces.append(_points_along(lane, max(whole - length, 0.0), whole, sumo_map))
        length -= whole
        lane = lane_before(sumo_map.net, lane)
    points = [point for piece in reversed(pieces) for point in piece]
    if len(points) < 2:
        return ()
    line = shapely.simplify(shapely.LineString(points), _TOLERANCE)
    return tuple((float(x), float(y)) for x, y in shapely.get_coordinates(line))


def _points_along(lane: str, begin: float, end: float, sumo_map: SumoMap) -> _Place:
    """Points between two positions of a lane, ends included; none of a lane too short for nodes."""
    places, lanes = sumo_map.lane_places, sumo_map.graph.lanes
    row = places.lanes.index(lane) if lane in places.lanes else -2
    nodes = np.flatnonzero(places.lane == row)
    nodes = nodes[np.argsort(places.pos[nodes], kind="stable")]
    if len(nodes) < 2:
        return ()
    pos = places.pos[nodes]
    inside = pos[(pos > begin) & (pos < end)]
    points = []
    for at in (begin, *inside.tolist(), end):
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


def _place_before_stop_line(loop: PlacedLoop, light: SumoLight) -> _Place:
    """Straight back from where a movement of its lane begins, for a lane too short for a node."""
    paths = (light.links[n].path for n in loop.movements)
    (x, y), (x1, y1) = next((path[:2] for path in paths if len(path) > 1), ((0, 0), (0, 0)))
    length = hypot(x1 - x, y1 - y)
    if not length:
        return ()
    ux, uy = (x1 - x) / length, (y1 - y) / length
    ends = (loop.ahead + loop.length, loop.ahead)
    return tuple((round(x - ux * away, 2), round(y - uy * away, 2)) for away in ends)
