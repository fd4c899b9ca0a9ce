"""Where those who turn across oncoming traffic wait inside a junction: SUMO's internal junctions.

The lane of such a turn is divided where it first comes near a path that it gives way to. Up to
there one drives with the green; the rest is entered when there is a gap, or when the oncoming
traffic has stopped.
Source: sumo.dlr.de/docs/Networks/SUMO_Road_Networks.html#internal_junctions.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import shapely

from odscen.convert.building.swept_paths import bent_aside
from odscen.convert.model.net import NetJunction
from odscen.convert.model.net_ids import internal_edge_id, lane_id
from odscen.convert.model.right_of_way import MOST_WIDTH, OPPOSING, wrapped

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from odscen.convert.model.net import NetLane, Request
    from odscen.convert.model.right_of_way import Movement, Walkway

LEAST_ROOM = 4.0
"""Metres between the stop line and the waiting place, at least."""

WIDEST = 3.0
"""Metres from the path of others at which one waits, at most; less between narrow lanes."""

BEFORE = 0.5
"""Metres that are left free before the other path."""

_TURN = math.radians(30.0)


def waiting_places(
    movements: Sequence[Movement],
    walkways: Sequence[Walkway],
    rights: Sequence[Request],
    waiting: Sequence[bool],
    *,
    side: float,
    lit: bool,
) -> dict[int, float]:
    """Metres along the path to the waiting place, of each movement that has one.

    Parameters
    ----------
    rights
        Of the movements, then of the crossings over ``walkways``.
    waiting
        Whether those of a movement wait inside at all.
    side
        1 where traffic keeps right, -1 where it keeps left.
    lit
        Whether lights hold back those who cross near the stop line.
    """
    lines = [shapely.LineString(movement.shape[:, :2]) for movement in movements]
    areas = [
        shapely.LineString(w.axis[:, :2]).buffer(w.width / 2.0 + 1.0, cap_style="flat")
        for w in walkways
    ]
    found: dict[int, float] = {}
    for number, movement in enumerate(movements):
        if not waiting[number] or side * movement.turn < _TURN:
            continue
        before = rights[number].yields_to
        towards = {
            _comes_towards(movement, movements[n]) or movements[n].source[0] == movement.source[0]
            for n in before
            if n < len(movements)
        }
        # Without lights nobody holds back traffic from the sides for those who stand inside.
        if not (towards == {True} or (lit and True in towards)):
            continue
        line = lines[number]
        places = [
            lines[n].buffer(_clear(movement, movements[n]))
            if n < len(movements)
            else areas[n - len(movements)]
            for n in sorted(before)
        ]
        ways = [_reached(line, place) for place in places]
        if lit:
            crossings = [n >= len(movements) for n in sorted(before)]
            ways = [
                way
                for way, walked in zip(ways, crossings, strict=True)
                if not (walked and way < LEAST_ROOM)
            ]
        place = min(ways, default=0.0) - BEFORE
        if place >= LEAST_ROOM and line.length - place >= 1.0:
            found[number] = round(place, 2)
    return found


def _clear(one: Movement, other: Movement) -> float:
    """Metres between paths at which even a lorry that waits is not in the way of a bus."""
    apart = max(MOST_WIDTH, min(WIDEST, 0.9 * min(one.width, other.width)))
    return apart + bent_aside(other)


def _comes_towards(one: Movement, other: Movement) -> bool:
    return abs(wrapped(other.heading_in - one.heading_in)) > OPPOSING


def _reached(line: shapely.LineString, place: shapely.Geometry) -> float:
    """Metres along a line to where it first is in a place."""
    shared = line.intersection(place)
    if shared.is_empty:
        return float(line.length)
    return float(min(line.project(shapely.Point(xy)) for xy in shapely.get_coordinates(shared)))


def inner_junctions(
    name: str,
    movements: Sequence[Movement],
    rights: Sequence[Request],
    beyond: Mapping[int, NetLane],
) -> tuple[NetJunction, ...]:
    """SUMO's internal junctions of a junction.

    SUMO sees vehicles on the internal lane of another path only if the two centre lines cross, or
    lead to one lane. Of paths that only come near each other, as of two opposing turns, the lane
    that leads out is therefore one to give way to as well, like the lanes that lead in.

    Parameters
    ----------
    beyond
        Lane after the waiting place, by movement.
    """
    lines = [shapely.LineString(movement.shape[:, :2]) for movement in movements]
    result = []
    for number, lane in beyond.items():
        right = rights[number]
        before = [n for n in sorted(right.yields_to) if n < len(movements)]
        leading_out = [
            beyond[n].id if n in beyond else lane_id(internal_edge_id(name, n))
            for n in before
            if movements[n].target != movements[number].target
            and not lines[number].intersects(lines[n])
        ]
        towards = dict.fromkeys([*(lane_id(*movements[n].source) for n in before), *leading_out])
        paths = [
            lane_id(internal_edge_id(name, n)) for n in sorted(right.foes) if n < len(movements)
        ]
        x, y, z = (float(value) for value in lane.shape[0])
        own = lane_id(internal_edge_id(name, number))
        result.append(
            NetJunction(lane.id, "internal", (x, y, z), lane.shape, (own, *towards), tuple(paths))
        )
    return tuple(result)
