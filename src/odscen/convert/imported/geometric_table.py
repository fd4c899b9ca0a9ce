"""The lane table of a network that odscen has not written: by geometry and connectivity.

Lanes outside junctions lie on the lanes of the map that they are drawn along; lanes inside stand
for the path through the map between what they connect.
"""

from __future__ import annotations

import heapq
from collections import Counter, defaultdict
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from odscen.base.ids import Roadside
from odscen.convert.imported.imported_lights import imported_letters
from odscen.convert.imported.lane_matching import (
    STEP,
    LaneSamples,
    SampledLines,
    intervals_of,
    match,
    middle_points,
    sample_shapes,
)
from odscen.convert.lane_table.table import (
    LEAST_STEP,
    LaneTable,
    MappingInterval,
    SumoEdge,
    SumoLane,
    SumoLight,
    SumoLink,
    monotone,
    simplified,
)
from odscen.convert.lane_table.table_json import rounded
from odscen.convert.model.access import BICYCLE_TYPES
from odscen.convert.model.net import INTERNAL, NORMAL
from odscen.opendrive.road_model import DRIVABLE_TYPES, WALKABLE_TYPES
from odscen.opendrive.topology import lane_successors

if TYPE_CHECKING:
    from collections.abc import Container, Iterable, Mapping, Sequence

    from odscen.base.ids import JunctionId, LaneKey, SumoLaneId
    from odscen.convert.imported.net_import import ImportedLane, ImportedNet
    from odscen.lanegraph.graphs import PedestrianGraph
    from odscen.opendrive.lanes import RoadTable
    from odscen.opendrive.road_model import OpenDrive


MOST_LINKS = 12
"""Lanes in a chain; two for a junction, three for each stub between junctions."""

MOST_PATHS = 1000
"""Beginnings of chains from one lane that are followed: no junction has so many."""


class LanePoint(NamedTuple):
    """A place on an OpenDRIVE lane; ``lane`` is a position in ``LaneSamples.rows``."""

    lane: int
    s: float


@dataclass(frozen=True, slots=True)
class InnerChain:
    """Lanes that one after the other connect two normal lanes: internal ones and stubs."""

    before: SumoLaneId
    via: tuple[SumoLaneId, ...]
    after: SumoLaneId


def chains_of(net: ImportedNet, stubs: Container[SumoLaneId]) -> list[InnerChain]:
    """Return the chains of a network, in the order of its connections.

    Parameters
    ----------
    stubs
        Normal lanes that count as inner links of a chain: what netconvert leaves, a few decimetres
        long, of a road whose ends it has trimmed away.
    """
    after: dict[SumoLaneId, list[SumoLaneId]] = {}
    starts: list[SumoLaneId] = []
    for link in net.links:
        function = net.function(link.source)
        target = net.function(link.target)
        if function not in (NORMAL, INTERNAL) or target != NORMAL:
            continue
        after.setdefault(link.source, []).append(link.via or link.target)
        if function == NORMAL and link.source not in stubs:
            starts.append(link.source)
    chains: list[InnerChain] = []
    for start in dict.fromkeys(starts):
        open_paths: list[tuple[SumoLaneId, ...]] = [(lane,) for lane in reversed(after[start])]
        for _ in range(MOST_PATHS):
            if not open_paths:
                break
            path = open_paths.pop()
            last = path[-1]
            if last not in stubs and net.function(last) == NORMAL:
                chains.append(InnerChain(start, path[:-1], last))
            elif len(path) < MOST_LINKS:
                further = [lane for lane in after.get(last, ()) if lane not in path]
                open_paths += [(*path, lane) for lane in reversed(further)]
    return chains


class PathStretch(NamedTuple):
    """A part of an OpenDRIVE lane in driving direction; ``start`` and ``end`` in metres of arc."""

    lane: int
    start: float
    end: float


def shortest_path(
    start: LanePoint,
    end: LanePoint,
    successors: Mapping[int, Sequence[int]],
    lanes: LaneSamples,
    *,
    longest: float,
) -> tuple[PathStretch, ...] | None:
    """Return the shortest path between two places through successors, or ``None``.

    Dijkstra's algorithm over lengths of lanes; ties go to the smaller number.

    Parameters
    ----------
    successors
        Lanes after each lane, as positions in ``LaneSamples.rows``.
    longest
        Metres; longer ways do not count.
    """
    here, there = lanes.arc_at(start.lane, start.s), lanes.arc_at(end.lane, end.s)
    if start.lane == end.lane and there > here:
        return (PathStretch(start.lane, here, there),)
    queue: list[tuple[float, int, int]] = [(lanes.length(start.lane) - here, start.lane, -1)]
    before: dict[int, int] = {}
    while queue:
        length, lane, previous = heapq.heappop(queue)
        if lane in before:
            continue
        before[lane] = previous
        if lane == end.lane:
            break
        for other in successors.get(lane, ()):
            further = length + (there if other == end.lane else lanes.length(other))
            if other not in before and further <= longest:
                heapq.heappush(queue, (further, other, lane))
    if end.lane not in before or end.lane == start.lane:
        return None
    path = [end.lane]
    while before[path[-1]] >= 0:
        path.append(before[path[-1]])
    first = PathStretch(start.lane, here, lanes.length(start.lane))
    inner = (PathStretch(lane, 0.0, lanes.length(lane)) for lane in path[-2:0:-1])
    return (first, *inner, PathStretch(end.lane, 0.0, there))


class InnerLane(NamedTuple):
    """An internal lane: its row, and its length by shape and by attribute, metres."""

    row: int
    drawn: float
    length: float


def chain_intervals(
    path: Iterable[PathStretch], via: Sequence[InnerLane], lanes: LaneSamples, *, step: float
) -> list[MappingInterval]:
    """Divide a path among internal lanes in proportion; deviations are still to be measured.

    Pieces end where an OpenDRIVE lane or an internal lane ends.
    """
    stretches = [part for part in path if part.end - part.start > 1e-6]
    drawn = np.concatenate(([0.0], np.cumsum([lane.drawn for lane in via])))
    passed = np.concatenate(([0.0], np.cumsum([part.end - part.start for part in stretches])))
    if drawn[-1] <= 1e-6 or passed[-1] <= 1e-6:
        return []
    borders = drawn * (passed[-1] / drawn[-1])
    intervals: list[MappingInterval] = []
    for index, part in enumerate(stretches):
        for other, lane in enumerate(via):
            low = max(passed[index], borders[other])
            high = min(passed[index + 1], borders[other + 1])
            if high - low < 1e-4:
                continue
            arc = np.linspace(low, high, max(2, int(np.ceil((high - low) / step)) + 1))
            share = (arc - borders[other]) / (borders[other + 1] - borders[other])
            s = lanes.s_at(part.lane, arc - passed[index] + part.start)
            intervals.append(
                MappingInterval(part.lane, lane.row, share * lane.length, s, np.zeros(len(s)))
            )
    return intervals


_DRIVE, _WALK, _BICYCLE = range(3)
_TYPES = (DRIVABLE_TYPES, WALKABLE_TYPES, BICYCLE_TYPES)

_INSIDE_PENALTY = 0.5
"""Metres: lanes of connecting roads must lie this much nearer to be taken for a normal lane's."""

STUB = 0.5
"""Metres: shorter SUMO lanes are matched by what they connect, not by where they are."""

LONGEST_FACTOR = 1.5
LONGEST_EXTRA = 20.0
"""Metres: internal lanes stand for a path at most this much longer than they are drawn."""

_MOTOR = ("passenger", "bus", "taxi", "truck")
_WALKERS = frozenset({"pedestrian"})


def geometric_table(
    net: ImportedNet, odr: OpenDrive, table: RoadTable, walks: PedestrianGraph
) -> LaneTable:
    """Relate the lanes of a network to those of the map.

    Parameters
    ----------
    odr, table
        The road model and its evaluation.
    walks
        The pedestrian graph of the map: it says where there are walks beside lanes.
    """
    return _TableBuilder(net, odr, table, walks).build()


def _kind_of_type(lane_type: str) -> int:
    """0 drivable, 1 walkable, 2 for bicycles, -1 anything else."""
    return next((kind for kind, types in enumerate(_TYPES) if lane_type in types), -1)


def _kind_of_lane(lane: ImportedLane) -> int:
    if any(lane.allows(vclass) for vclass in _MOTOR):
        return _DRIVE
    if lane.allows("pedestrian"):
        return _WALK
    return _BICYCLE if lane.allows("bicycle") else -1


class _TableBuilder:
    def __init__(
        self, net: ImportedNet, odr: OpenDrive, table: RoadTable, walks: PedestrianGraph
    ) -> None:
        self._net, self._odr, self._roads = net, odr, table
        kinds = np.array([_kind_of_type(name) for name in table.lane_type], dtype=np.int64)
        lanes = np.flatnonzero(kinds >= 0)
        beside = [
            table.lane_index[key]
            for key, roadside in zip(walks.lane_keys, walks.roadside, strict=True)
            if roadside
        ]
        rows = np.concatenate([lanes, np.array(beside, dtype=np.int64)])
        roadside = np.arange(len(rows)) >= len(lanes)
        self._kinds = np.where(roadside, _WALK, kinds[rows])
        # Sections of no length are there in real maps: they connect, but nothing lies on them.
        self._long = (table.lane_s1 - table.lane_s0)[rows] > LEAST_STEP
        self._keys: tuple[LaneKey | Roadside, ...] = tuple(
            Roadside(*table.lane_keys[row]) if aside else table.lane_keys[row]
            for row, aside in zip(rows.tolist(), roadside.tolist(), strict=True)
        )
        self._samples = LaneSamples.of(table, rows, roadside=roadside)
        self._inside = np.array(
            [odr.roads[key.road].junction is not None for key in self._keys], dtype=np.bool_
        )
        position = {key: number for number, key in enumerate(self._keys)}
        self._successors = {
            position[key]: tuple(position[other] for other in others if other in position)
            for key, others in lane_successors(odr).items()
            if key in position
        }
        self._lanes = list(net.lanes.values())
        self._row = {lane.id: row for row, lane in enumerate(self._lanes)}
        self._drawn = SampledLines.of([lane.shape for lane in self._lanes])
        self._stubs = {
            lane.id
            for lane, length in zip(self._lanes, self._drawn.length.tolist(), strict=True)
            if length < STUB and net.function(lane.id) == NORMAL
        }

    def build(self) -> LaneTable:
        normal = self._map_normal_lanes()
        finished = (
            _finish_interval(found) for found in [*normal, *self._map_internal_lanes(normal)]
        )
        intervals = tuple(found for found in finished if found is not None)
        net = self._net
        lanes = {
            lane.id: SumoLane(
                lane.id, lane.edge, lane.index, lane.length, lane.speed, lane.width, lane.allowed
            )
            for lane in self._lanes
        }
        return LaneTable(
            lane_keys=self._keys,
            lanes=lanes,
            edges={
                edge.id: SumoEdge(
                    edge.id,
                    edge.function,
                    edge.start,
                    edge.end,
                    max((net.lanes[lane].length for lane in edge.lanes), default=0.0),
                    edge.lanes,
                )
                for edge in net.edges.values()
            },
            links=tuple(
                SumoLink(*link[:4])
                for link in net.links
                if _WALKERS not in (lanes[link.source].allowed, lanes[link.target].allowed)
            ),
            walk_links=net.walk_links(),
            intervals=intervals,
            net_offset=net.offset,
            boundary=net.boundary,
            lefthand=net.lefthand,
            counts=net.counts(),
            elevation=any(bool(lane.shape[:, 2].any()) for lane in self._lanes),
            lights=self._find_lights(intervals),
        )

    def _map_normal_lanes(self) -> list[MappingInterval]:
        """Intervals of lanes outside junctions, kind by kind."""
        kinds = np.array(
            [
                _kind_of_lane(lane)
                if self._net.function(lane.id) == NORMAL and lane.id not in self._stubs
                else -1
                for lane in self._lanes
            ]
        )
        intervals: list[MappingInterval] = []
        for kind in range(len(_TYPES)):
            rows = np.flatnonzero(kinds == kind)
            eligible = np.flatnonzero((self._kinds == kind) & self._long)
            chosen = self._samples.chosen(eligible)
            if not len(rows) or not len(chosen.rows):
                continue
            places = sample_shapes([self._lanes[row].shape for row in rows])
            matched = match(
                places,
                chosen,
                self._roads,
                penalty=np.where(self._inside[eligible], _INSIDE_PENALTY, 0.0),
                either_way=kind != _DRIVE,
            )
            lengths = np.array([self._lanes[row].length for row in rows])
            made = intervals_of(
                places, matched, chosen, self._roads, sumo_rows=rows, lengths=lengths
            )
            intervals += [interval._replace(lane=int(eligible[interval.lane])) for interval in made]
        return intervals

    def _map_internal_lanes(self, normal: Sequence[MappingInterval]) -> list[MappingInterval]:
        """Intervals of lanes inside junctions, with measured deviations."""
        firsts: dict[int, MappingInterval] = {}
        lasts: dict[int, MappingInterval] = {}
        for interval in normal:
            firsts.setdefault(interval.sumo, interval)
            lasts[interval.sumo] = interval
        intervals: dict[tuple[int, int, float, float], MappingInterval] = {}
        for chain in chains_of(self._net, self._stubs):
            for interval in self._map_chain(chain, firsts, lasts):
                key = interval.lane, interval.sumo, float(interval.s[0]), float(interval.s[-1])
                intervals.setdefault(key, interval)
        return self._measure_intervals(list(intervals.values()))

    def _map_chain(
        self,
        chain: InnerChain,
        firsts: Mapping[int, MappingInterval],
        lasts: Mapping[int, MappingInterval],
    ) -> list[MappingInterval]:
        before = lasts.get(self._row[chain.before])
        after = firsts.get(self._row[chain.after])
        if before is None or after is None or self._kinds[before.lane] == _WALK:
            return []
        start = LanePoint(before.lane, float(before.s[-1]))
        end = LanePoint(after.lane, float(after.s[0]))
        drawn = sum(float(self._drawn.length[self._row[lane]]) for lane in chain.via)
        longest = LONGEST_FACTOR * drawn + LONGEST_EXTRA
        path = shortest_path(start, end, self._successors, self._samples, longest=longest)
        if path is None:
            return []  # a connection that the map has not: nothing of the map lies under it
        rows = [self._row[lane] for lane in chain.via]
        via = [
            InnerLane(row, float(self._drawn.length[row]), self._lanes[row].length) for row in rows
        ]
        return chain_intervals(path, via, self._samples, step=STEP)

    def _measure_intervals(self, intervals: list[MappingInterval]) -> list[MappingInterval]:
        """Fill in the distances between the lane centres."""
        if not intervals:
            return []
        counts = [len(interval.s) for interval in intervals]
        sumo = np.repeat([interval.sumo for interval in intervals], counts)
        lengths = np.array([lane.length for lane in self._lanes])
        pos = np.concatenate([interval.pos for interval in intervals])
        share = np.divide(pos, lengths[sumo], out=np.zeros_like(pos), where=lengths[sumo] > 0)
        drawn, _ = self._drawn.at(sumo, share * self._drawn.length[sumo])
        lane = np.repeat([interval.lane for interval in intervals], counts)
        xyz, _ = middle_points(
            self._roads,
            self._samples.rows[lane],
            np.concatenate([interval.s for interval in intervals]),
            roadside=self._samples.roadside[lane],
        )
        deviation = np.hypot(xyz[:, 0] - drawn[:, 0], xyz[:, 1] - drawn[:, 1])
        parts = np.split(deviation, np.cumsum(counts)[:-1])
        return [
            interval._replace(deviation=part)
            for interval, part in zip(intervals, parts, strict=True)
        ]

    def _find_lights(self, intervals: Sequence[MappingInterval]) -> tuple[SumoLight, ...]:
        """Traffic lights with the OpenDRIVE junctions that they are in.

        A junction belongs to the light with most of its lanes, so that each has one light.
        """
        under: dict[int, set[JunctionId]] = defaultdict(set)
        for interval in intervals:
            junction = self._odr.roads[self._keys[interval.lane].road].junction
            if junction is not None:
                under[interval.sumo].add(junction)
        counts: dict[JunctionId, Counter[str]] = defaultdict(Counter)
        for link in self._net.links:
            if link.light and link.via and self._net.function(link.via) == INTERNAL:
                for junction in under[self._row[link.via]]:
                    counts[junction][link.light] += 1
        owner = {
            junction: max(sorted(lights), key=lambda light: lights[light])
            for junction, lights in counts.items()
        }
        letters = imported_letters(self._net)
        return tuple(
            SumoLight(
                light.id,
                tuple(sorted(junction for junction in owner if owner[junction] == light.id)),
                light.phases,
                light.offset,
                light.signals,
                *letters[light.id],
            )
            for light in self._net.lights
        )


def _finish_interval(interval: MappingInterval) -> MappingInterval | None:
    """Round and thin out the knots of an interval."""
    kept = monotone(
        interval._replace(
            pos=rounded(interval.pos), s=rounded(interval.s), deviation=rounded(interval.deviation)
        ),
        growing=bool(interval.s[-1] > interval.s[0]),
    )
    return None if kept is None else simplified(kept)
