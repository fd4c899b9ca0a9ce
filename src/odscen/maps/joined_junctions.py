"""Two junctions made one: the roads between them become connecting roads of it."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from odscen.base.ids import RoadId
from odscen.maps.importers.osm.road_plan import write_geometry
from odscen.maps.importers.osm.scenery import hermite
from odscen.maps.importers.osm.street_line import Pose, curve_between
from odscen.opendrive import road_model as model
from odscen.opendrive.objects import is_crosswalk
from odscen.opendrive.topology import lane_successors

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from odscen.base.arrays import FloatArray
    from odscen.base.ids import JunctionId, LaneKey
    from odscen.maps.importers.osm.street_line import Cubic
    from odscen.opendrive.lanes import RoadTable

LONGEST = 100.0
"""Metres of a road between two junctions that are joined."""
_STEP = 2.0
"""Metres between the places by which a line is drawn anew."""
_OFF = 0.02
"""Metres by which it may be beside them."""
_PIECE = 30.0
"""Metres of a cubic, at most."""


class _Chain(NamedTuple):
    """Lanes one after the other: before the junctions, through them, and behind."""

    start: LaneKey
    through: tuple[LaneKey, ...]
    end: LaneKey


@dataclass(frozen=True, slots=True)
class JoinedMap:
    """A map whose two junctions are one.

    Attributes
    ----------
    between
        Roads that were between them.
    turns
        Connecting roads drawn in their place.
    signals
        Ids of the signals that stood on roads that are gone, with these roads.
    crosswalks
        Number of those that were on them.
    """

    map: model.OpenDrive
    between: tuple[RoadId, ...]
    turns: tuple[RoadId, ...]
    signals: tuple[tuple[RoadId, str], ...]
    crosswalks: int


def find_roads_between(
    odr: model.OpenDrive, first: JunctionId, second: JunctionId
) -> tuple[RoadId, ...]:
    """Plain roads that lead from one junction directly to the other."""
    return tuple(
        road.id
        for road in odr.roads.values()
        if road.junction is None and {_junction_at(road, end) for end in _ENDS} == {first, second}
    )


_ENDS: tuple[model.ContactPoint, model.ContactPoint] = ("start", "end")


def _junction_at(road: model.Road, end: model.ContactPoint) -> str | None:
    link = road.predecessor if end == "start" else road.successor
    return link.element_id if link is not None and link.element_type == "junction" else None


def join_junctions(
    odr: model.OpenDrive, table: RoadTable, first: JunctionId, second: JunctionId
) -> JoinedMap:
    """Make one junction of two, named by the first.

    Who could drive from a lane over a road between them to another lane has a connecting road of
    one lane along the same path. Priorities are those of the turns that it consists of.
    """
    between = find_roads_between(odr, first, second)
    after = lane_successors(odr)
    chains = list(_find_chains(odr, after, set(between), {first, second}))
    gone = set(between)
    gone |= {
        road.id
        for road in odr.roads.values()
        if road.junction in (first, second)
        and any(
            link is not None and link.element_type == "road" and link.element_id in between
            for link in (road.predecessor, road.successor)
        )
    }
    roads = {
        number: _relink_road(road, first, second) for number, road in odr.roads.items()
        if number not in gone
    }  # fmt: skip
    connections = [
        connection
        for name in (first, second)
        for connection in odr.junctions[name].connections
        if connection.connecting_road not in gone and connection.incoming_road not in gone
    ]
    free = max((int(key) for key in odr.roads if key.isascii() and key.isdigit()), default=0)
    turns, parts = [], {}
    for chain in chains:
        free += 1
        road = _draw_turn(odr, table, chain, RoadId(str(free)), first)
        roads[road.id] = road
        turns.append(road.id)
        parts[road.id] = {key.road for key in chain.through if key.road in gone}
        own = next(number for number in road.sections[0].lanes if number)
        links = ((chain.start.lane, own),)
        connections.append(model.Connection("", chain.start.road, road.id, "start", links))
    junctions = dict(odr.junctions)
    joined = junctions[first]
    junctions[first] = replace(
        joined,
        connections=tuple(
            connection._replace(id=str(number)) for number, connection in enumerate(connections)
        ),
        priorities=_join_priorities(odr, (first, second), roads, parts),
        controllers=tuple(
            dict.fromkeys((*joined.controllers, *junctions[second].controllers))
        ),
    )  # fmt: skip
    del junctions[second]
    lost = [odr.roads[number] for number in odr.roads if number in gone]
    return JoinedMap(
        map=replace(odr, roads=roads, junctions=junctions),
        between=between,
        turns=tuple(turns),
        signals=tuple((road.id, signal.id) for road in lost for signal in road.signals),
        crosswalks=sum(is_crosswalk(item) for road in lost for item in road.objects),
    )


def _find_chains(
    odr: model.OpenDrive,
    after: Mapping[LaneKey, Sequence[LaneKey]],
    between: set[RoadId],
    junctions: set[JunctionId],
) -> Iterator[_Chain]:
    """Ways through both junctions, each pair of lanes once."""
    seen_pairs = set()

    def follow(path: tuple[LaneKey, ...]) -> Iterator[tuple[LaneKey, ...]]:
        for key in after[path[-1]]:
            road = odr.roads[key.road]
            if key in path:
                continue
            if key.road in between or road.junction in junctions:
                yield from follow((*path, key))
            else:
                yield (*path, key)

    for start, following in after.items():
        road = odr.roads[start.road]
        if start.road in between or road.junction in junctions:
            continue
        for key in following:
            if odr.roads[key.road].junction not in junctions:
                continue
            for path in follow((start, key)):
                over = {step.road for step in path} & between
                end = path[-1]
                # Not there and back: who leaves by the junction he came from has not been between.
                entered = {odr.roads[step.road].junction for step in path[1:-1]} - {None}
                if len(over) != 1 or len(entered) != 2 or (start, end) in seen_pairs:
                    continue
                seen_pairs.add((start, end))
                yield _Chain(start, path[1:-1], end)


def _relink_road(road: model.Road, first: JunctionId, second: JunctionId) -> model.Road:
    """A road of the second junction, or at it, as one of the first."""

    def of_first(link: model.RoadLink | None) -> model.RoadLink | None:
        if link is None or link.element_type != "junction" or link.element_id != second:
            return link
        return link._replace(element_id=first)

    links = (of_first(road.predecessor), of_first(road.successor))
    junction = first if road.junction == second else road.junction
    if (*links, junction) == (road.predecessor, road.successor, road.junction):
        return road
    return replace(road, predecessor=links[0], successor=links[1], junction=junction)


def _draw_turn(
    odr: model.OpenDrive, table: RoadTable, chain: _Chain, road_id: RoadId, junction: JunctionId
) -> model.Road:
    """A connecting road of one lane along the inner borders of lanes that follow each other."""
    poses, widths, heights = _trace_lanes(table, chain.through)
    curves = draw_line(poses)
    length = sum(curve.length for curve in curves)
    steps = np.hypot(*np.diff(poses[:, :2], axis=0).T)
    s = np.concatenate([[0.0], np.cumsum(steps)]) * (length / max(float(steps.sum()), 1e-9))
    source = odr.roads[chain.start.road]
    own = 1 if source.rule == "LHT" else -1
    models = [odr.roads[k.road].sections[k.section].lanes[k.lane] for k in chain.through]
    access = tuple({(rule.rule, rule.restriction): None for m in models for rule in m.access})
    lane = model.Lane(
        own,
        models[0].type,
        widths=_write_profile(s, widths),
        access=tuple(model.LaneAccess(0.0, *rule) for rule in access),
        predecessors=(chain.start.lane,),
        successors=(chain.end.lane,),
    )
    middle = model.Lane(0, "none")
    rows = np.array([table.lane_index[key] for key in chain.through])
    middles = (table.lane_s0[rows] + table.lane_s1[rows]) / 2.0
    speed = float(table.speed_limit(rows, middles).min())
    ends = [table.lane_forward[table.lane_index[key]] for key in (chain.start, chain.end)]
    kind = source.types[0].type if source.types else "town"
    level = float(np.abs(heights).max()) < 1e-6
    return model.Road(
        id=road_id,
        name="",
        length=length,
        junction=junction,
        rule=source.rule,
        predecessor=model.RoadLink("road", source.id, "end" if ends[0] else "start"),
        successor=model.RoadLink("road", chain.end.road, "start" if ends[1] else "end"),
        types=(model.RoadType(0.0, kind, speed if math.isfinite(speed) else None),),
        geometry=write_geometry(curves),
        elevation=() if level else _write_profile(s, heights),
        superelevation=(),
        lane_offset=(),
        sections=(
            model.LaneSection(
                0.0, length, {own: lane, 0: middle} if own > 0 else {0: middle, own: lane}
            ),
        ),
    )


def _trace_lanes(
    table: RoadTable, lanes: Sequence[LaneKey]
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Inner border of lanes one after the other: x, y and heading; widths; heights."""
    rows, stations = [], []
    for key in lanes:
        row = table.lane_index[key]
        low, high = float(table.lane_s0[row]), float(table.lane_s1[row])
        count = max(2, math.ceil((high - low) / _STEP) + 1)
        s = np.linspace(low, high, count)
        rows.append(np.full(count, row))
        stations.append(s if table.lane_forward[row] else s[::-1])
    every, s = np.concatenate(rows), np.concatenate(stations)
    points = table.lane_points(every, s, at=0.0)
    hdg = points.hdg + np.where(table.lane_forward[every], 0.0, math.pi)
    poses = np.stack([points.x, points.y, hdg], axis=1)
    # Where lanes meet there are two places: the first of them stays.
    steps = np.hypot(*np.diff(poses[:, :2], axis=0).T)
    keep = np.concatenate([[True], steps > 0.05])
    keep[-1] = True
    if len(keep) > 2 and steps[-1] <= 0.05:
        keep[-2] = False
    return poses[keep], points.width[keep], points.z[keep]


def draw_line(poses: FloatArray) -> list[Cubic]:
    """Cubics through places with headings, shape ``(N, 3)``, each as long as it keeps to them."""
    rows = [Pose(*row) for row in poses.tolist()]
    curves, start, last = [], 0, len(rows) - 1
    while start < last:
        end = start + 1
        best = curve_between(rows[start], rows[end])
        while end < last:
            longer = curve_between(rows[start], rows[end + 1])
            beside = _distance_off(longer, poses[start + 1 : end + 1, :2])
            if longer.length > _PIECE or beside > _OFF:
                break
            best, end = longer, end + 1
        curves.append(best)
        start = end
    return curves


def _distance_off(curve: Cubic, places: FloatArray) -> float:
    import shapely

    line = shapely.LineString(curve.places(40))
    return float(shapely.distance(line, shapely.points(places)).max())


def _write_profile(s: FloatArray, values: FloatArray) -> tuple[model.Cubic, ...]:
    """A profile through values, level at both ends."""
    slopes = np.gradient(values, s)
    slopes[[0, -1]] = 0.0
    cubics, last = [], 0
    for end in range(1, len(s)):
        steady = np.ptp(values[last : end + 1]) < 1e-4
        if steady and end < len(s) - 1 and abs(values[end + 1] - values[end]) < 1e-4:
            continue
        length = float(s[end] - s[last])
        pair = np.array([last, end])
        cubics.append(hermite(float(s[last]), length, values[pair], slopes[pair]))
        last = end
    return tuple(cubics)


def _join_priorities(
    odr: model.OpenDrive,
    junctions: Sequence[JunctionId],
    roads: Mapping[RoadId, model.Road],
    parts: Mapping[RoadId, set[RoadId]],
) -> tuple[model.JunctionPriority, ...]:
    """Who goes first, of roads that stay and of turns made of those that are gone."""
    turns: dict[RoadId, list[RoadId]] = {}
    for turn, pieces in parts.items():
        for piece in pieces:
            turns.setdefault(piece, []).append(turn)
    pairs = {
        (high, low): None
        for name in junctions
        for priority in odr.junctions[name].priorities
        for high in ([priority.high] if priority.high in roads else turns.get(priority.high, []))
        for low in ([priority.low] if priority.low in roads else turns.get(priority.low, []))
    }
    return tuple(
        model.JunctionPriority(high, low)
        for high, low in pairs
        if high != low and (low, high) not in pairs
    )
