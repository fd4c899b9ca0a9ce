"""Making the lane table from a network and a road model, by geometry and connectivity."""

from __future__ import annotations

from itertools import combinations, pairwise
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from odscen.convert.chains import (
    Chain,
    InternalLane,
    Place,
    chain_pieces,
    chains_of,
    shortest_way,
)
from odscen.convert.lane_table import LaneTable, SumoEdge, SumoLane, SumoLink
from odscen.convert.matching import match, pieces_of
from odscen.convert.net import CROSSING, NORMAL, WALKING_AREA
from odscen.convert.pieces import LEAST_STEP, Piece, monotone, simplified
from odscen.convert.sampling import STEP, LaneSamples, Polylines, sample_shapes
from odscen.convert.table_json import rounded
from odscen.opendrive.model import DRIVABLE_TYPES, WALKABLE_TYPES

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from odscen.convert.net import Net, NetLane
    from odscen.ids import LaneKey, SumoEdgeId
    from odscen.opendrive.lanes import RoadTable
    from odscen.opendrive.model import OpenDrive

FloatArray = NDArray[np.float64]
IndexArray = NDArray[np.intp]

BICYCLE_TYPES = frozenset({"biking"})
KINDS = (DRIVABLE_TYPES, WALKABLE_TYPES, BICYCLE_TYPES)
_DRIVE, _WALK, _BICYCLE = range(3)

_INSIDE_PENALTY = 0.5
"""Metres: lanes of connecting roads must lie this much nearer to be taken for a normal lane's."""

STUB = 0.5
"""Metres: shorter SUMO lanes are matched by what they connect, not by where they are."""

LONGEST_FACTOR = 1.5
LONGEST_EXTRA = 20.0
"""Metres: internal lanes stand for a way at most this much longer than they are drawn."""

_MOTOR = ("passenger", "bus", "taxi")


class BuiltTable(NamedTuple):
    """The table, and how its connections differ from those of the map.

    Attributes
    ----------
    wanted
        Number of relations between drivable lanes outside junctions.
    missing
        Those of them that the network has not, sorted.
    invented
        Pairs of lanes that the network connects although the map does not, sorted.
    """

    table: LaneTable
    wanted: int
    missing: tuple[tuple[LaneKey, LaneKey], ...]
    invented: tuple[tuple[LaneKey, LaneKey], ...]


def build_lane_table(
    net: Net,
    odr: OpenDrive,
    table: RoadTable,
    successors: Mapping[LaneKey, Sequence[LaneKey]],
) -> BuiltTable:
    """Relate the lanes of a network to those of the map that it was made from.

    Parameters
    ----------
    successors
        Lanes after each lane in driving direction: ``odscen.opendrive.topology.lane_successors``.
    """
    return _Builder(net, odr, table, successors).build()


def kind_of_type(lane_type: str) -> int:
    """0 drivable, 1 walkable, 2 for bicycles, -1 anything else."""
    return next((kind for kind, types in enumerate(KINDS) if lane_type in types), -1)


def _kind_of_lane(lane: NetLane) -> int:
    if any(lane.allows(vclass) for vclass in _MOTOR):
        return _DRIVE
    if lane.allows("pedestrian"):
        return _WALK
    return _BICYCLE if lane.allows("bicycle") else -1


class _Builder:
    def __init__(
        self,
        net: Net,
        odr: OpenDrive,
        table: RoadTable,
        successors: Mapping[LaneKey, Sequence[LaneKey]],
    ) -> None:
        self.net = net
        self.roads = table
        kinds = np.array([kind_of_type(name) for name in table.lane_type], dtype=np.intp)
        rows = np.flatnonzero(kinds >= 0)
        self.kinds = kinds[rows]
        # Sections of no length are there in real maps: they connect, but nothing lies on them.
        self.long = (table.lane_s1 - table.lane_s0)[rows] > LEAST_STEP
        self.keys = tuple(table.lane_keys[row] for row in rows)
        self.samples = LaneSamples.of(table, rows)
        self.position = {int(row): i for i, row in enumerate(rows)}
        self.inside = np.array(
            [odr.roads[key.road].junction is not None for key in self.keys], dtype=np.bool_
        )
        position = {key: i for i, key in enumerate(self.keys)}
        self.successors = {
            position[key]: tuple(position[other] for other in others if other in position)
            for key, others in successors.items()
            if key in position
        }
        self.lanes = list(net.lanes.values())
        self.row = {lane.id: i for i, lane in enumerate(self.lanes)}
        self.drawn = Polylines.of([lane.shape for lane in self.lanes])
        self.stubs = {
            lane.id
            for lane, length in zip(self.lanes, self.drawn.length, strict=True)
            if length < STUB and net.edges[lane.edge].function == NORMAL
        }
        self.served: set[tuple[int, int]] = set()
        self.invented: set[tuple[int, int]] = set()

    def build(self) -> BuiltTable:
        pieces = self._normal()
        for one, two in pairwise(pieces):
            if one.sumo == two.sumo:
                self.served.add((one.lane, two.lane))
        pieces += self._internal(pieces)
        finished = (_finished(piece) for piece in pieces)
        wanted = self._wanted()
        return BuiltTable(
            self._table(tuple(piece for piece in finished if piece is not None)),
            len(wanted),
            self._pairs(wanted - self.served),
            self._pairs(self.invented),
        )

    def _pairs(self, pairs: set[tuple[int, int]]) -> tuple[tuple[LaneKey, LaneKey], ...]:
        return tuple((self.keys[one], self.keys[other]) for one, other in sorted(pairs))

    def _wanted(self) -> set[tuple[int, int]]:
        """Find relations between drivable lanes outside junctions, through any lanes inside."""
        wanted: set[tuple[int, int]] = set()
        for lane in np.flatnonzero(~self.inside & (self.kinds == _DRIVE)).tolist():
            seen: set[int] = set()
            todo = list(self.successors.get(lane, ()))
            while todo:
                other = todo.pop()
                if other in seen or self.kinds[other] != _DRIVE:
                    continue
                seen.add(other)
                if self.inside[other]:
                    todo += self.successors.get(other, ())
                else:
                    wanted.add((lane, other))
        return wanted

    def _table(self, pieces: tuple[Piece, ...]) -> LaneTable:
        net = self.net
        edges = {
            edge.id: SumoEdge(
                edge.id,
                edge.function,
                edge.from_junction,
                edge.to_junction,
                max((net.lanes[lane].length for lane in edge.lanes), default=0.0),
                edge.lanes,
            )
            for edge in net.edges.values()
        }
        return LaneTable(
            lane_keys=self.keys,
            lanes={
                lane.id: SumoLane(
                    lane.id,
                    lane.edge,
                    lane.index,
                    lane.length,
                    lane.speed,
                    lane.width,
                    lane.allowed,
                )
                for lane in self.lanes
            },
            edges=edges,
            links=tuple(SumoLink(c.from_lane, c.to_lane, c.via, c.tl) for c in net.connections),
            walk_links=walk_links(net),
            pieces=pieces,
            net_offset=net.net_offset,
            boundary=net.boundary,
            lefthand=net.lefthand,
            counts=net.counts(),
            elevation=any(bool(lane.shape[:, 2].any()) for lane in self.lanes),
        )

    def _normal(self) -> list[Piece]:
        """Pieces of lanes outside junctions, kind by kind."""
        functions = [self.net.edges[lane.edge].function for lane in self.lanes]
        kinds = np.array(
            [
                _kind_of_lane(lane) if function == NORMAL and lane.id not in self.stubs else -1
                for lane, function in zip(self.lanes, functions, strict=True)
            ]
        )
        pieces: list[Piece] = []
        for kind in range(len(KINDS)):
            rows = np.flatnonzero(kinds == kind)
            eligible = np.flatnonzero((self.kinds == kind) & self.long)
            chosen = self.samples.chosen(eligible)
            if not len(rows) or not len(chosen.rows):
                continue
            places = sample_shapes([self.lanes[row].shape for row in rows])
            found = match(
                places,
                chosen,
                self.roads,
                penalty=np.where(self.inside[eligible], _INSIDE_PENALTY, 0.0),
                either_way=kind != _DRIVE,
            )
            lengths = np.array([self.lanes[row].length for row in rows])
            made = pieces_of(places, found, chosen, self.roads, sumo_rows=rows, lengths=lengths)
            pieces += [piece._replace(lane=self.position[piece.lane]) for piece in made]
        return pieces

    def _internal(self, normal: Sequence[Piece]) -> list[Piece]:
        """Pieces of lanes inside junctions, with measured deviations."""
        firsts: dict[int, Piece] = {}
        lasts: dict[int, Piece] = {}
        for piece in normal:
            firsts.setdefault(piece.sumo, piece)
            lasts[piece.sumo] = piece
        pieces: dict[tuple[int, int, float, float], Piece] = {}
        for chain in chains_of(self.net, self.stubs):
            for made in self._chain(chain, firsts, lasts):
                piece = made._replace(lane=self.position[made.lane])
                key = piece.lane, piece.sumo, float(piece.s[0]), float(piece.s[-1])
                pieces.setdefault(key, piece)
        return self._measured(list(pieces.values()))

    def _chain(
        self, chain: Chain, firsts: Mapping[int, Piece], lasts: Mapping[int, Piece]
    ) -> list[Piece]:
        before = lasts.get(self.row[chain.before])
        after = firsts.get(self.row[chain.after])
        if before is None or after is None or self.kinds[before.lane] != _DRIVE:
            return []
        start, end = Place(before.lane, float(before.s[-1])), Place(after.lane, float(after.s[0]))
        drawn = sum(float(self.drawn.length[self.row[lane]]) for lane in chain.via)
        longest = LONGEST_FACTOR * drawn + LONGEST_EXTRA
        way = shortest_way(start, end, self.successors, self.samples, longest=longest)
        if way is None and start.lane == end.lane and abs(start.s - end.s) < STUB:
            return []  # two SUMO lanes meet on one lane, with nothing between them
        if way is None:
            self.invented.add((before.lane, after.lane))
            return []
        outside = [part.lane for part in way if not self.inside[part.lane]]
        self.served.update(pairwise(outside))
        rows = [self.row[lane] for lane in chain.via]
        via = [
            InternalLane(row, float(self.drawn.length[row]), self.lanes[row].length) for row in rows
        ]
        return chain_pieces(way, via, self.samples, step=STEP)

    def _measured(self, pieces: list[Piece]) -> list[Piece]:
        """Fill in the distances between the lane centres."""
        if not pieces:
            return []
        counts = [len(piece.s) for piece in pieces]
        sumo = np.repeat([piece.sumo for piece in pieces], counts)
        lengths = np.array([lane.length for lane in self.lanes])
        pos = np.concatenate([piece.pos for piece in pieces])
        share = np.divide(pos, lengths[sumo], out=np.zeros_like(pos), where=lengths[sumo] > 0)
        drawn, _ = self.drawn.at(sumo, share * self.drawn.length[sumo])
        lane = self.samples.rows[np.repeat([piece.lane for piece in pieces], counts)]
        points = self.roads.lane_points(lane, np.concatenate([piece.s for piece in pieces]))
        deviation = np.hypot(points.x - drawn[:, 0], points.y - drawn[:, 1])
        parts = np.split(deviation, np.cumsum(counts)[:-1])
        return [piece._replace(deviation=part) for piece, part in zip(pieces, parts, strict=True)]


def _finished(piece: Piece) -> Piece | None:
    """Round and thin out the knots of a piece."""
    kept = monotone(
        piece._replace(
            pos=rounded(piece.pos), s=rounded(piece.s), deviation=rounded(piece.deviation)
        ),
        growing=bool(piece.s[-1] > piece.s[0]),
    )
    return None if kept is None else simplified(kept)


def walk_links(net: Net) -> tuple[tuple[SumoEdgeId, SumoEdgeId], ...]:
    """Pairs of edges between which a person can walk, smaller id first, sorted.

    Through walking areas and crossings where a junction has them; else SUMO lets persons change
    between all edges for walking that meet at the junction.
    """
    special = {CROSSING, WALKING_AREA}
    walkable = {lane.edge for lane in net.lanes.values() if lane.allows("pedestrian")}
    pairs: set[tuple[SumoEdgeId, SumoEdgeId]] = set()
    served: set[str] = set()
    for connection in net.connections:
        one, other = (net.edges[net.lanes[lane].edge] for lane in connection[:2])
        if one.id not in walkable or other.id not in walkable:
            continue
        if one.function in special or other.function in special:
            pairs.add((min(one.id, other.id), max(one.id, other.id)))
            served |= {one.to_junction, other.from_junction}
    meeting: dict[str, set[SumoEdgeId]] = {}
    for edge in net.edges.values():
        if edge.function == NORMAL and edge.id in walkable:
            for junction in {edge.from_junction, edge.to_junction} - served:
                meeting.setdefault(junction, set()).add(edge.id)
    for edges in meeting.values():
        pairs.update(combinations(sorted(edges), 2))
    return tuple(sorted(pairs))
