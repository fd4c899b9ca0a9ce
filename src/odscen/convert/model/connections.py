"""Connections: from the end of an edge into the next one, and the nodes where that happens.

A connection runs over the connecting lanes of a junction, over what crosswalks take from a road,
and over stretches too short for an edge; SUMO gets one internal lane for each.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from itertools import islice
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from odscen.convert.model.access import allowed
from odscen.convert.model.edge_plan import LEAST_EDGE
from odscen.convert.model.lane_alignment import DENSE, LaneAlignment, Stretch

if TYPE_CHECKING:
    from collections.abc import Collection, Iterator, Mapping, Sequence

    from scipy.cluster.hierarchy import DisjointSet

    from odscen.base.ids import LaneKey
    from odscen.convert.model.edge_plan import EdgePlan
    from odscen.opendrive.lanes import RoadTable
    from odscen.opendrive.topology import SideLink

NodeKey = tuple[object, ...]
"""What is joined in groups: a kind and what distinguishes items of a kind."""

MOST_LANES = 400
"""Lanes under one connection; more is a circle in a file that links a junction to itself."""

_STEP_BACK = 0.05
"""Metres; converters round places by less."""

MOST_CONNECTIONS = 2_000
"""Connections from one lane; a file with more has junctions that only consist of junctions."""


class PlannedConnection(NamedTuple):
    """From a lane of an edge to one of another (positions in the plans), over ``alignment``."""

    source: int
    source_lane: int
    target: int
    target_lane: int
    alignment: LaneAlignment


class LostConnection(NamedTuple):
    """A connection that has no place in the network, and why."""

    lane: LaneKey
    reason: str


@dataclass(frozen=True, slots=True)
class PlannedConnections:
    """All connections, the edges with their ends trimmed, and what was lost."""

    edges: tuple[EdgePlan, ...]
    connections: tuple[PlannedConnection, ...]
    lost: tuple[LostConnection, ...]


class _Visit(NamedTuple):
    """A lane of an edge on a row of the table; ``first`` if the edge begins there."""

    entry: float
    leave: float
    edge: int
    lane: int
    first: bool


def find_connections(
    table: RoadTable,
    successors: Mapping[LaneKey, Sequence[LaneKey]],
    edges: Sequence[EdgePlan],
    sides: Sequence[SideLink] = (),
    folded: Collection[LaneKey] = (),
) -> PlannedConnections:
    """Follow the lanes of all edges to where the next edges begin, side links included.

    Where several connections lead from one lane to the same other lane, the shortest is taken.
    Lanes that are ``folded`` (:func:`odscen.opendrive.topology.folded_lanes`) are passed over.
    """
    finder = _ConnectionFinder(table, successors, edges, sides)
    planned_connections: list[PlannedConnection] = []
    for number, edge in enumerate(edges):
        for index in range(len(edge.lanes)):
            planned_connections += finder.connections_from(number, index)
    planned_connections, overlaps = _without_folds(table, edges, planned_connections, folded)
    plans, connections = _with_room(edges, planned_connections, overlaps)
    return PlannedConnections(plans, connections, tuple(finder.lost))


class _ConnectionFinder:
    def __init__(
        self,
        table: RoadTable,
        successors: Mapping[LaneKey, Sequence[LaneKey]],
        edges: Sequence[EdgePlan],
        sides: Sequence[SideLink],
    ) -> None:
        self._table = table
        self._exits: dict[int, list[tuple[float, int]]] = {}
        self._entries: dict[int, list[tuple[float, int]]] = {}
        for side in sides:
            main, other = table.lane_index[side.main], table.lane_index[side.other]
            if side.leaves:
                self._exits.setdefault(main, []).append((side.s, other))
            else:
                self._entries.setdefault(other, []).append((side.s, main))
        self._successors = successors
        self._edges = edges
        self.lost: list[LostConnection] = []
        self._visits: dict[int, list[_Visit]] = {}
        for number, edge in enumerate(edges):
            for index, lane in enumerate(edge.lanes):
                for position, stretch in enumerate(lane.alignment):
                    visit = _Visit(stretch.start, stretch.end, number, index, position == 0)
                    self._visits.setdefault(stretch.row, []).append(visit)
        for row, visits in self._visits.items():
            visits.sort(key=lambda v: v.entry if table.lane_forward[row] else -v.entry)

    def connections_from(self, edge: int, lane: int) -> list[PlannedConnection]:
        """All connections from the end of a lane, the shortest to each other lane."""
        last = self._edges[edge].lanes[lane].alignment[-1]
        best: dict[tuple[int, int], LaneAlignment] = {}
        paths = self._follow_lane(last.row, last.end, ())
        for target, alignment in islice(paths, MOST_CONNECTIONS):
            known = best.get(target)
            if known is None or _alignment_length(alignment) < _alignment_length(known):
                best[target] = alignment
            if known is not None:
                self._note_lost(last.row, target)
        return [
            PlannedConnection(edge, lane, *target, alignment) for target, alignment in best.items()
        ]

    def _note_lost(self, row: int, target: tuple[int, int]) -> None:
        there = self._edges[target[0]].lanes[target[1]].alignment[0].row
        other = self._table.lane_keys[there]
        reason = f"of several connections to lane {other} only the shortest is in the network"
        self.lost.append(LostConnection(self._table.lane_keys[row], reason))

    def _follow_lane(
        self, row: int, s: float, alignment: LaneAlignment
    ) -> Iterator[tuple[tuple[int, int], LaneAlignment]]:
        """Follow a lane from s; yields each edge lane reached and the path to it."""
        todo: list[tuple[int, float, LaneAlignment]] = [(row, s, alignment)]
        while todo:
            row, s, alignment = todo.pop()
            ahead = bool(self._table.lane_forward[row])
            sign = 1.0 if ahead else -1.0
            end = float(self._table.lane_s1[row] if ahead else self._table.lane_s0[row])
            visit = next(
                (v for v in self._visits.get(row, ()) if sign * (v.entry - s) >= -1e-6), None
            )
            until = visit.entry if visit is not None else end
            todo += self._turning_off(row, s, until, alignment)
            if visit is not None and visit.first:
                yield (
                    (visit.edge, visit.lane),
                    _extend_alignment(alignment, Stretch(row, s, visit.entry)),
                )
                continue
            if visit is not None or len(alignment) > MOST_LANES:
                continue
            alignment = _extend_alignment(alignment, Stretch(row, s, end))
            todo += [(main, place, alignment) for place, main in self._entries.get(row, ())]
            following = [
                self._table.lane_index[key]
                for key in self._successors[self._table.lane_keys[row]]
                if self._is_open(key)
            ]
            for other in reversed(following):
                if any(stretch.row == other for stretch in alignment):
                    continue
                forward = bool(self._table.lane_forward[other])
                start = self._table.lane_s0[other] if forward else self._table.lane_s1[other]
                todo.append((other, float(start), alignment))

    def _turning_off(
        self, row: int, s: float, until: float, alignment: LaneAlignment
    ) -> Iterator[tuple[int, float, LaneAlignment]]:
        """Lanes that begin beside a lane between two places, with the path to them."""
        low, high = sorted((s, until))
        for place, other in self._exits.get(row, ()):
            if low - 1e-6 <= place <= high + 1e-6 and self._is_open(self._table.lane_keys[other]):
                forward = bool(self._table.lane_forward[other])
                start = self._table.lane_s0[other] if forward else self._table.lane_s1[other]
                yield other, float(start), _extend_alignment(alignment, Stretch(row, s, place))

    def _is_open(self, key: LaneKey) -> bool:
        return bool(allowed(self._table.lane_type[self._table.lane_index[key]]))


def _extend_alignment(alignment: LaneAlignment, stretch: Stretch) -> LaneAlignment:
    return (*alignment, stretch) if stretch.extent > 1e-6 else alignment


def _alignment_length(alignment: LaneAlignment) -> float:
    return sum(stretch.extent for stretch in alignment)


def _without_folds(
    table: RoadTable,
    edges: Sequence[EdgePlan],
    connections: Sequence[PlannedConnection],
    folded: Collection[LaneKey],
) -> tuple[list[PlannedConnection], dict[tuple[int, int], float]]:
    """Leave out lanes that lead back, and cut what lies before them where the next lane begins.

    Returns
    -------
    The connections, and for those of them without a lane of their own (by source and target edge)
    metres by which the source ends behind the start of the target.
    """
    rows = {table.lane_index[key] for key in folded}
    straight: list[PlannedConnection] = []
    overlaps: dict[tuple[int, int], float] = {}
    for connection in connections:
        if any(stretch.row in rows for stretch in connection.alignment):
            leaving = edges[connection.source].lanes[connection.source_lane].alignment[-1]
            arriving = edges[connection.target].lanes[connection.target_lane].alignment[0]
            kept: list[Stretch] = []
            joins = False
            for stretch in (*connection.alignment, arriving):
                if stretch.row in rows:
                    joins = True
                    continue
                if joins:
                    _cut_before(table, kept, stretch)
                joins = False
                kept.append(stretch)
            straight.append(connection._replace(alignment=tuple(kept[:-1])))
            if len(kept) == 1:
                back = max(0.0, _metres_back(table, leaving, arriving))
                key = (connection.source, connection.target)
                overlaps[key] = max(overlaps.get(key, 0.0), back)
        else:
            straight.append(connection)
    return straight, overlaps


def _metres_back(table: RoadTable, stretch: Stretch, following: Stretch) -> float:
    """Metres that a stretch ends behind the start of another one, in its own direction."""
    rows = np.array([stretch.row, following.row], dtype=np.int64)
    places = table.lane_points(rows, np.array([stretch.end, following.start]))
    away = (float(places.x[1] - places.x[0]), float(places.y[1] - places.y[0]))
    sense = 1.0 if stretch.end >= stretch.start else -1.0
    heading = float(places.hdg[0])
    return -sense * (away[0] * math.cos(heading) + away[1] * math.sin(heading))


def _cut_before(table: RoadTable, kept: list[Stretch], following: Stretch) -> None:
    """Cut the last stretches where the following one starts; those all behind it are dropped."""
    while kept:
        stretch = kept[-1]
        back = _metres_back(table, stretch, following)
        if back <= _STEP_BACK:
            return
        kept.pop()
        if stretch.extent - back >= DENSE:
            sense = 1.0 if stretch.end > stretch.start else -1.0
            kept.append(stretch._replace(end=stretch.end - sense * back))
            return


def _with_room(
    edges: Sequence[EdgePlan],
    connections: Sequence[PlannedConnection],
    overlaps: Mapping[tuple[int, int], float],
) -> tuple[tuple[EdgePlan, ...], tuple[PlannedConnection, ...]]:
    """Give connections of no length the last decimetre of the edge before, for internal lanes.

    Where the next edge begins before the end of that edge (``overlaps``), as much more.
    """
    short = {c.source for c in connections if _alignment_length(c.alignment) < LEAST_EDGE}
    plans = list(edges)
    rests: dict[tuple[int, int], Stretch] = {}
    for number in sorted(short):
        plan = plans[number]
        over = max((back for key, back in overlaps.items() if key[0] == number), default=0.0)
        lanes = []
        for index, lane in enumerate(plan.lanes):
            last = lane.alignment[-1]
            room = min(over + LEAST_EDGE, last.extent / 3.0)
            cut = last.end - room if last.end > last.start else last.end + room
            rests[number, index] = Stretch(last.row, cut, last.end)
            lanes.append(
                replace(lane, alignment=(*lane.alignment[:-1], Stretch(last.row, last.start, cut)))
            )
        plans[number] = replace(plan, lanes=tuple(lanes))
    longer = []
    for connection in connections:
        alignment = connection.alignment
        if connection.source in short:
            rest = rests[connection.source, connection.source_lane]
            if not alignment:
                # Something of the room stays: an internal lane has a length.
                over = overlaps.get((connection.source, connection.target), 0.0)
                back = min(over, max(rest.extent - LEAST_EDGE, rest.extent / 2.0))
                sense = 1.0 if rest.end > rest.start else -1.0
                rest = rest._replace(end=rest.end - sense * back)
            alignment = _join_alignments(rest, alignment)
        longer.append(connection._replace(alignment=alignment))
    return tuple(plans), tuple(longer)


def _join_alignments(first: Stretch, alignment: LaneAlignment) -> LaneAlignment:
    if alignment and alignment[0].row == first.row:
        return (Stretch(first.row, first.start, alignment[0].end), *alignment[1:])
    return (first, *alignment)


def join_groups(groups: DisjointSet[NodeKey], one: NodeKey, other: NodeKey) -> None:
    """Make the groups of two things one; things not seen before are groups of their own."""
    groups.add(one)
    groups.add(other)
    groups.merge(one, other)


def first_members(groups: DisjointSet[NodeKey]) -> dict[NodeKey, NodeKey]:
    """Of each thing the one of its group that was seen first, which stands for the group."""
    first: dict[NodeKey, NodeKey] = {}
    return {item: first.setdefault(groups[item], item) for item in groups}
