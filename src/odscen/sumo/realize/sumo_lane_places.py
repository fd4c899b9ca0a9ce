"""From a map to the places of its SUMO lanes: segments, junctions, movements."""

from __future__ import annotations

from collections import defaultdict, deque
from functools import lru_cache
from itertools import groupby
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from odscen.figures.by_place.lane_places import LanePlaces
from odscen.sumo.realize.road_net import PEDESTRIAN

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from odscen.figures.by_place.level_of_service import JunctionControl
    from odscen.sumo.realize.road_net import RoadNet, RoadNetLane
    from odscen.sumo.realize.sumo_map import SumoMap

_ONLY_WALKERS = frozenset({PEDESTRIAN})
_NO_MOTOR = frozenset({PEDESTRIAN, "bicycle"})


class _SegmentShare(NamedTuple):
    """A segment in which a share of a lane lies."""

    segment: str
    share: float


_Parts = dict[str, tuple[_SegmentShare, ...]]
"""Segments of each lane, in driving direction."""


class _LaneChain(NamedTuple):
    """A connection between normal lanes, and the lanes inside of the SUMO junction."""

    source: RoadNetLane
    inside: tuple[RoadNetLane, ...]
    target: RoadNetLane


class _JunctionPath(NamedTuple):
    """One connection of a junction: a lane, the lanes inside, and the movement that it is of."""

    source: RoadNetLane
    inside: tuple[RoadNetLane, ...]
    junction: str
    movement: str


@lru_cache(maxsize=4)
def lane_places(sumo_map: SumoMap) -> LanePlaces:
    """Places of all lanes that vehicles may use.

    A lane is where the nodes of the lane graph on it are, or on a lane beside it; of the lanes
    inside of a SUMO junction those that touch a junction of the map belong to it as a whole. A lane
    that crosses no junction of the map, and is too short for a node, is in the segment that it is
    entered from.
    """
    net, junctions = sumo_map.net, _junction_segments(sumo_map)
    parts = _road_parts(sumo_map, junctions)
    chains = list(_lane_chains(net))
    parts |= _places_inside(chains, parts, junctions, net)
    connections = list(_junction_paths(chains, parts, junctions))
    control = _junction_controls(sumo_map)
    movements = {connection.movement: connection.junction for connection in connections}
    lengths: dict[str, list[float]] = defaultdict(list)
    for connection in connections:
        length = sum(lane.length for lane in connection.inside)
        lengths[connection.junction].append(length)
        lengths[connection.movement].append(length)
    mean = {name: float(np.mean(some)) for name, some in lengths.items()}
    return LanePlaces.of(
        lanes=list(_lane_rows(parts, net)),
        ways=list(_connection_rows(connections, net)),
        segments=list(_segment_rows(parts, sumo_map)),
        junctions=[
            (name, control[name], mean[name]) for name in sorted(dict.fromkeys(movements.values()))
        ],
        movements=[
            (name, junction, control[junction], mean[name])
            for name, junction in sorted(movements.items())
        ],
    )


@lru_cache(maxsize=4)
def lane_segments(sumo_map: SumoMap) -> dict[str, tuple[str, ...]]:
    """Segments in which each lane lies that has nodes, or lies beside one; in driving direction."""
    parts = _road_parts(sumo_map, _junction_segments(sumo_map))
    return {lane: tuple(part.segment for part in some) for lane, some in parts.items()}


def _junction_segments(sumo_map: SumoMap) -> set[str]:
    segments = sumo_map.graph.segments
    return {
        str(name)
        for name, kind in zip(segments.ids, segments.kinds, strict=True)
        if kind == "junction"
    }


def _road_parts(sumo_map: SumoMap, junctions: set[str]) -> _Parts:
    parts = dict(_parts_of_lanes(sumo_map, junctions))
    return parts | _places_beside(parts, sumo_map.net)


def _parts_of_lanes(
    sumo_map: SumoMap, junctions: set[str]
) -> Iterator[tuple[str, tuple[_SegmentShare, ...]]]:
    """Segments of the lanes with nodes, in driving direction."""
    places, segments = sumo_map.lane_places, sumo_map.graph.segments
    on_lane = np.flatnonzero(places.lane >= 0)
    order = on_lane[np.lexsort((places.pos[on_lane], places.lane[on_lane]))]
    for row, nodes in groupby(order.tolist(), key=lambda node: int(places.lane[node])):
        lane = sumo_map.net.lanes[places.lanes[row]]
        names = [str(segments.ids[sumo_map.graph.lanes.segment[node]]) for node in nodes]
        crossed = [name for name in names if name in junctions]
        if lane.internal and crossed:
            yield lane.id, (_SegmentShare(max(crossed, key=crossed.count), 1.0),)
        else:
            counts = [(name, len(list(same))) for name, same in groupby(names)]
            yield (
                lane.id,
                tuple(_SegmentShare(name, number / len(names)) for name, number in counts),
            )


def _places_beside(parts: _Parts, net: RoadNet) -> _Parts:
    """Places of lanes without nodes beside a lane that has some: lanes of bicycles."""
    return {
        lane.id: beside
        for lanes in net.edge_lanes.values()
        if (beside := next((parts[lane.id] for lane in lanes if lane.id in parts), None))
        for lane in lanes
        if lane.id not in parts and not lane.internal and _admits_vehicles(lane)
    }


def _lane_chains(net: RoadNet) -> Iterator[_LaneChain]:
    for link in net.links:
        source = net.lanes[link.source]
        if source.internal or not _admits_vehicles(source):
            continue
        if link.via is None:
            yield _LaneChain(source, (), net.lanes[link.target])
        elif onwards := net.leaving(link.via):
            yield _LaneChain(source, (net.lanes[link.via], *onwards[:-1]), onwards[-1])


def _places_inside(
    chains: Sequence[_LaneChain], parts: _Parts, junctions: set[str], net: RoadNet
) -> _Parts:
    """Places of lanes inside of SUMO junctions that have no node, or only nodes of roads.

    They are in the junction that their connection crosses; if it has no nodes at all, in another
    one that the SUMO junction represents, as of a road that continues past a side road.
    """

    def crossed(lane: RoadNetLane) -> str | None:
        own = parts[lane.id][0].segment if lane.id in parts else None
        return own if own in junctions else None

    at_node: dict[str, str] = {}
    for source, inside, _ in chains:
        for own in filter(None, map(crossed, inside)):
            at_node.setdefault(net.ends[source.edge][1], own)
    parts_by_lane: _Parts = {}
    for source, inside, _ in chains:
        first = next(filter(None, map(crossed, inside)), None)
        other = first or at_node.get(net.ends[source.edge][1])
        for lane in inside:
            if crossed(lane) is None and (first is not None or lane.id not in parts):
                if other is not None:
                    parts_by_lane[lane.id] = (_SegmentShare(other, 1.0),)
                elif source.id in parts:
                    parts_by_lane[lane.id] = (_SegmentShare(parts[source.id][-1].segment, 1.0),)
    return parts_by_lane


def _junction_paths(
    chains: Sequence[_LaneChain], parts: _Parts, junctions: set[str]
) -> Iterator[_JunctionPath]:
    """Connections that cross a junction of the map."""
    for source, inside, target in chains:
        places = [parts[lane.id][0].segment for lane in inside if lane.id in parts]
        junction = next((name for name in places if name in junctions), None)
        if junction is not None and source.id in parts and target.id in parts:
            ends = parts[source.id][-1].segment, junction, parts[target.id][0].segment
            yield _JunctionPath(source, inside, junction, ">".join(ends))


def _junction_controls(sumo_map: SumoMap) -> dict[str, JunctionControl]:
    """How each junction is controlled, by its segment."""
    graph = sumo_map.graph
    lit = {name for light in sumo_map.lights for name in light.junctions}
    controls: dict[str, JunctionControl] = {}
    for lane, segment in np.unique(np.stack([graph.lanes.lane, graph.lanes.segment]), axis=1).T:
        junction = graph.lanes.lanes.junctions[lane]
        if junction is not None:
            controls[str(graph.segments.ids[segment])] = "signal" if junction in lit else "priority"
    return controls


def _lane_rows(parts: _Parts, net: RoadNet) -> Iterator[tuple[str, float, bool, str, float, bool]]:
    before: dict[str, set[str]] = defaultdict(set)
    for link in net.links:
        if link.source in parts:
            onto = net.lanes[link.via or link.target]
            before[onto.edge].add(parts[link.source][-1].segment)
    for name, lane in sorted(net.lanes.items()):
        if _admits_vehicles(lane):
            motor = lane.allowed is None or not lane.allowed <= _NO_MOTOR
            for number, part in enumerate(parts.get(name, ())):
                entry = number > 0 or bool(before[lane.edge] - {part.segment})
                yield name, lane.length, motor, part.segment, part.share, entry


def _connection_rows(
    connections: Sequence[_JunctionPath], net: RoadNet
) -> Iterator[tuple[str | None, ...]]:
    inside = {
        lane.id: (
            connection.junction,
            connection.source.edge,
            connection.source.id,
            connection.inside[0].id,
            connection.movement,
        )
        for connection in reversed(connections)
        for lane in connection.inside
    }
    for name, row in sorted(inside.items()):
        yield name, *row
    ahead = {connection.source.edge: connection.junction for connection in reversed(connections)}
    for edge, last in sorted(_last_edges(ahead, inside, net).items()):
        for lane in net.edge_lanes[edge]:
            if _admits_vehicles(lane):
                yield lane.id, ahead[last], last, None, None, None


def _last_edges(
    ahead: Mapping[str, str], inside: Mapping[str, object], net: RoadNet
) -> dict[str, str]:
    """Last edge before a junction of each edge from which one gets there without crossing another.

    The nearest by number of edges, where roads part.
    """
    before: dict[str, set[str]] = defaultdict(set)
    for link in net.links:
        onto = net.lanes[link.via or link.target]
        if not {link.source, onto.id} & inside.keys():
            before[onto.edge].add(net.lanes[link.source].edge)
    last_edges = {edge: edge for edge in sorted(ahead)}
    todo = deque(last_edges)
    while todo:
        edge = todo.popleft()
        for previous in sorted(before[edge]):
            if previous not in last_edges:
                last_edges[previous] = last_edges[edge]
                todo.append(previous)
    return last_edges


def _segment_rows(parts: _Parts, sumo_map: SumoMap) -> Iterator[tuple[str, float]]:
    """Length of each road segment along the road: that of its edges over its directions."""
    segments = sumo_map.graph.segments
    total: dict[str, float] = defaultdict(float)
    for lanes in sumo_map.net.edge_lanes.values():
        driven = [lane for lane in lanes if lane.id in parts and _admits_vehicles(lane)]
        for lane in driven:
            for part in parts[lane.id]:
                total[part.segment] += part.share * lane.length / len(driven)
    for name, kind, length in zip(
        map(str, segments.ids), segments.kinds, segments.lengths.tolist(), strict=True
    ):
        if kind == "road" and name in total:
            yield name, total[name] / max(1, round(total[name] / length))


def _admits_vehicles(lane: RoadNetLane) -> bool:
    return lane.allowed != _ONLY_WALKERS
