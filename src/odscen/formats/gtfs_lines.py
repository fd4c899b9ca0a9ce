"""The trips of a GTFS feed as lines of a scenario: stops on lanes, timetables as relative times."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from odscen.lanegraph.query import node_id
from odscen.scenario.demand.inflow import entries
from odscen.scenario.document.scenario_document import (
    ServedStop,
    Transit,
    TransitLine,
    TransitStop,
)
from odscen.scenario.placing.region import NodePlace

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence

    from odscen.base.arrays import FloatArray
    from odscen.formats.gtfs_feed import Feed, FeedStop, FeedTrip
    from odscen.scenario.placing.region import Region

APPROACH_SPEED = 8.0
"""m/s at which a vehicle comes to its first stop, to set off in time."""

AT_STOP = 20.0
"""Seconds before its first departure that a vehicle is to be there."""

BESIDE = 1.5
"""Metres that a stop may lie on the other side of the middle of its lane."""

ROOM = 8.0
"""Metres of lane before and behind a stop."""

_ODD = re.compile(r"[^A-Za-z0-9_.-]+")


@dataclass(frozen=True, slots=True)
class PlacedFeed:
    """Stops and lines, and what was left out and why: numbers by reason."""

    transit: Transit
    left_out: dict[str, int]


class _Run(NamedTuple):
    """Stops of a trip on the map, and seconds after midnight at which they are left."""

    stops: tuple[str, ...]
    times: tuple[float, ...]


def place_feed(
    feed: Feed,
    region: Region,
    project: Callable[[FloatArray, FloatArray], tuple[FloatArray, FloatArray]],
    *,
    clock: float,
    duration: float,
    within: float,
    routes: Iterable[str] = (),
) -> PlacedFeed:
    """Put the trips of a feed on a region.

    A stop is on the nearest outermost lane on whose outer side it lies. Trips with the same stops
    and running times become a line. They set off where vehicles enter the region, as near to the
    first stop as possible, and leave it at its nearest end.

    Parameters
    ----------
    project
        From degrees of longitude and latitude to metres of the map.
    clock, duration
        Time of day at the start of the run, and how long it is, seconds.
    within
        Metres that a stop may be from its lane.
    routes
        Names of routes that are wanted; all without.
    """
    left_out: dict[str, int] = {"trips of other modes": feed.other_modes}
    wanted = set(routes)
    trips = [trip for trip in feed.trips if not wanted or trip.route in wanted]
    served = {visit.stop for trip in trips for visit in trip.visits}
    known = [stop for stop in feed.stops.values() if stop.id in served]
    nodes = _find_stop_nodes(known, region, project, within)
    left_out["stops away from the region"] = len(known) - len(nodes)
    groups: dict[tuple[str, tuple[str, ...], tuple[float, ...]], list[float]] = {}
    for trip in trips:
        run = _keep_stops_on_map(trip, nodes)
        if not run.stops:
            continue
        first = run.times[0]
        relative = tuple(round(time - first, 1) for time in run.times)
        groups.setdefault((trip.route, run.stops, relative), []).append(first)
    lines: list[TransitLine] = []
    for (route, stops, relative), firsts in sorted(groups.items()):
        name = _choose_free_name(route, {line.id for line in lines})
        line = _make_line(name, stops, relative, [nodes[stop] for stop in stops], region)
        if line is None:
            _count_left_out(left_out, "trips without a route inside the region", len(firsts))
            continue
        start = line.stops[0].after or 0.0
        departs = sorted({round(first - clock - start, 1) for first in firsts})
        inside = tuple(time for time in departs if 0.0 <= time < duration)
        _count_left_out(left_out, "trips outside the time of the run", len(departs) - len(inside))
        if inside:
            lines.append(line.model_copy(update={"departures": inside}))
    used = {stop.stop for line in lines for stop in line.stops}
    places = tuple(
        TransitStop(
            id=_clean_identifier(stop.id), name=stop.name[:200], node=node_id(region.graph, node)
        )
        for stop in known
        if (node := nodes.get(stop.id)) is not None and _clean_identifier(stop.id) in used
    )
    counted = {why: number for why, number in left_out.items() if number}
    return PlacedFeed(Transit(stops=places, lines=tuple(lines)), counted)


def _find_stop_nodes(
    stops: Sequence[FeedStop],
    region: Region,
    project: Callable[[FloatArray, FloatArray], tuple[FloatArray, FloatArray]],
    within: float,
) -> dict[str, int]:
    """Node of each stop that lies beside a lane of the region."""
    lanes = region.graph.lanes
    rows = np.array([junction is None for junction in lanes.lanes.junctions], dtype=np.bool_)
    ids = np.array([key.lane for key in lanes.lanes.keys])
    right = np.where((ids < 0) == lanes.lanes.forward, -1.0, 1.0)[lanes.lane]
    outer = np.where(right < 0, lanes.right_lane, lanes.left_lane) < 0
    ends = lanes.lanes.lengths[lanes.lane] - lanes.offset
    room = np.minimum(lanes.offset, ends) >= ROOM
    nodes = np.flatnonzero(region.lanes & rows[lanes.lane] & outer & room)
    if not len(nodes) or not stops:
        return {}
    x, y = project(np.array([stop.lon for stop in stops]), np.array([stop.lat for stop in stops]))
    found: dict[str, int] = {}
    for stop, east, north in zip(stops, x.tolist(), y.tolist(), strict=True):
        if not (math.isfinite(east) and math.isfinite(north)):
            continue  # so far away that the projection has no place for it
        dx, dy = east - lanes.x[nodes], north - lanes.y[nodes]
        hdg = lanes.hdg[nodes]
        aside = (np.cos(hdg) * dy - np.sin(hdg) * dx) * right[nodes]
        distance = np.where(aside >= -BESIDE, np.hypot(dx, dy), np.inf)
        if distance.min() <= within:
            found[stop.id] = int(nodes[int(np.argmin(distance))])
    return found


def _keep_stops_on_map(trip: FeedTrip, nodes: dict[str, int]) -> _Run:
    """Stops of a trip that are on the map and have a time."""
    kept = [
        (visit.stop, visit.departure)
        for visit in trip.visits
        if visit.stop in nodes and visit.departure is not None
    ]
    return _Run(tuple(stop for stop, _ in kept), tuple(time for _, time in kept))


def _make_line(
    name: str,
    stops: Sequence[str],
    relative: Sequence[float],
    nodes: Sequence[int],
    region: Region,
) -> TransitLine | None:
    """A line over these nodes; ``None`` if no route leads over them, or times do not grow."""
    places = [NodePlace(walk=False, node=node) for node in nodes]
    grows = all(one < other for one, other in pairwise(relative))
    if not grows or not all(region.leads(one, other) for one, other in pairwise(places)):
        return None
    start, metres = _find_start(region, nodes[0])
    goals = region.router.goal_candidates(nodes[-1])
    if not len(goals):
        return None
    distances = region.router.distances(nodes[-1])[goals]
    lead = round(metres / APPROACH_SPEED + AT_STOP, 1)
    return TransitLine(
        id=name,
        start=node_id(region.graph, start),
        goal=node_id(region.graph, int(goals[int(np.argmin(distances))])),
        stops=tuple(
            ServedStop(stop=_clean_identifier(stop), after=round(lead + time, 1))
            for stop, time in zip(stops, relative, strict=True)
        ),
        departures=(0.0,),
    )


def _find_start(region: Region, first: int) -> tuple[int, float]:
    """Where trips set off, and metres from there to their first stop."""
    best: tuple[float, int] | None = None
    for entry in entries(region):
        for lane in entry.lanes:
            metres = float(region.router.distances(lane.node)[first])
            if np.isfinite(metres) and metres > 0 and (best is None or (metres, lane.node) < best):
                best = metres, lane.node
    if best is not None:
        return best[1], best[0]
    lanes = region.graph.lanes
    begin = int(lanes.lanes.first_node[lanes.lane[first]])
    inside = [node for node in range(begin, first) if region.lanes[node]]
    start = inside[0] if inside else first
    return start, float(lanes.offset[first] - lanes.offset[start])


def _clean_identifier(name: str) -> str:
    """Name as an identifier of the document."""
    text = _ODD.sub("-", name).strip("-._")[:60]
    return text or "stop"


def _choose_free_name(name: str, taken: set[str]) -> str:
    stem = _clean_identifier(f"line-{name}")
    names = (stem if n == 1 else f"{stem}-{n}" for n in range(1, len(taken) + 2))
    return next(name for name in names if name not in taken)


def _count_left_out(left_out: dict[str, int], why: str, number: int) -> None:
    left_out[why] = left_out.get(why, 0) + number
