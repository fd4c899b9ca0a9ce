"""Ways: how one leaves an edge and enters the next.

A way runs over the connecting lanes of a junction, over what crosswalks take from a road, and over
stretches too short for an edge; SUMO gets one internal lane for each.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import islice
from typing import TYPE_CHECKING, NamedTuple

from odscen.convert.model.access import allowed
from odscen.convert.model.edge_plan import LEAST_EDGE
from odscen.convert.model.lane_alignment import Course, Stretch

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from scipy.cluster.hierarchy import DisjointSet

    from odscen.base.ids import LaneKey
    from odscen.convert.model.edge_plan import EdgePlan
    from odscen.opendrive.lanes import RoadTable
    from odscen.opendrive.topology import SideLink

NodeKey = tuple[object, ...]
"""What is joined in groups: a kind and what tells things of a kind apart."""

LONGEST_WAY = 400
"""Lanes in one way; more is a circle in a file that links a junction to itself."""

MOST_WAYS = 2_000
"""Ways from one lane; a file with more has junctions that only consist of junctions."""


class PlannedConnection(NamedTuple):
    """From a lane of an edge to a lane of another one (positions in the plans), over ``course``."""

    source: int
    source_lane: int
    target: int
    target_lane: int
    course: Course


class LostConnection(NamedTuple):
    """A way that has no place in the network, and why."""

    lane: LaneKey
    reason: str


@dataclass(frozen=True, slots=True)
class PlannedConnections:
    """All ways, the edges with their ends trimmed, and what was lost."""

    edges: tuple[EdgePlan, ...]
    ways: tuple[PlannedConnection, ...]
    lost: tuple[LostConnection, ...]


class _Visit(NamedTuple):
    """A lane of an edge on a row of the table; ``first`` if the edge begins there."""

    entry: float
    leave: float
    edge: int
    lane: int
    first: bool


def find_ways(
    table: RoadTable,
    successors: Mapping[LaneKey, Sequence[LaneKey]],
    edges: Sequence[EdgePlan],
    sides: Sequence[SideLink] = (),
) -> PlannedConnections:
    """Follow the lanes of all edges to where the next edges begin, side links included.

    Where several ways lead from one lane to the same other lane, the shortest is taken.
    """
    finder = _ConnectionFinder(table, successors, edges, sides)
    found: list[PlannedConnection] = []
    for number, edge in enumerate(edges):
        for index in range(len(edge.lanes)):
            found += finder.ways_from(number, index)
    plans, ways = _with_room(edges, found)
    return PlannedConnections(plans, ways, tuple(finder.lost))


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
                for position, stretch in enumerate(lane.course):
                    visit = _Visit(stretch.start, stretch.end, number, index, position == 0)
                    self._visits.setdefault(stretch.row, []).append(visit)
        for row, visits in self._visits.items():
            visits.sort(key=lambda v: v.entry if table.lane_forward[row] else -v.entry)

    def ways_from(self, edge: int, lane: int) -> list[PlannedConnection]:
        """All ways from the end of a lane, the shortest to each other lane."""
        last = self._edges[edge].lanes[lane].course[-1]
        best: dict[tuple[int, int], Course] = {}
        ways = self._onwards(last.row, last.end, ())
        for target, course in islice(ways, MOST_WAYS):
            known = best.get(target)
            if known is None or _extent(course) < _extent(known):
                best[target] = course
            if known is not None:
                self._note(last.row, target)
        return [PlannedConnection(edge, lane, *target, course) for target, course in best.items()]

    def _note(self, row: int, target: tuple[int, int]) -> None:
        there = self._edges[target[0]].lanes[target[1]].course[0].row
        other = self._table.lane_keys[there]
        reason = f"of several ways to lane {other} only the shortest is in the network"
        self.lost.append(LostConnection(self._table.lane_keys[row], reason))

    def _onwards(
        self, row: int, s: float, course: Course
    ) -> Iterator[tuple[tuple[int, int], Course]]:
        """Follow a lane from s; yields each edge lane reached and the way to it."""
        todo: list[tuple[int, float, Course]] = [(row, s, course)]
        while todo:
            row, s, course = todo.pop()
            ahead = bool(self._table.lane_forward[row])
            sign = 1.0 if ahead else -1.0
            end = float(self._table.lane_s1[row] if ahead else self._table.lane_s0[row])
            visit = next(
                (v for v in self._visits.get(row, ()) if sign * (v.entry - s) >= -1e-6), None
            )
            until = visit.entry if visit is not None else end
            todo += self._turning_off(row, s, until, course)
            if visit is not None and visit.first:
                yield (visit.edge, visit.lane), _extended(course, Stretch(row, s, visit.entry))
                continue
            if visit is not None or len(course) > LONGEST_WAY:
                continue
            course = _extended(course, Stretch(row, s, end))
            todo += [(main, place, course) for place, main in self._entries.get(row, ())]
            following = [
                self._table.lane_index[key]
                for key in self._successors[self._table.lane_keys[row]]
                if self._open(key)
            ]
            for other in reversed(following):
                if any(stretch.row == other for stretch in course):
                    continue
                forward = bool(self._table.lane_forward[other])
                start = self._table.lane_s0[other] if forward else self._table.lane_s1[other]
                todo.append((other, float(start), course))

    def _turning_off(
        self, row: int, s: float, until: float, course: Course
    ) -> Iterator[tuple[int, float, Course]]:
        """Lanes that begin beside a lane between two places, with the way to them."""
        low, high = sorted((s, until))
        for place, other in self._exits.get(row, ()):
            if low - 1e-6 <= place <= high + 1e-6 and self._open(self._table.lane_keys[other]):
                forward = bool(self._table.lane_forward[other])
                start = self._table.lane_s0[other] if forward else self._table.lane_s1[other]
                yield other, float(start), _extended(course, Stretch(row, s, place))

    def _open(self, key: LaneKey) -> bool:
        return bool(allowed(self._table.lane_type[self._table.lane_index[key]]))


def _extended(course: Course, stretch: Stretch) -> Course:
    return (*course, stretch) if stretch.extent > 1e-6 else course


def _extent(course: Course) -> float:
    return sum(stretch.extent for stretch in course)


def _with_room(
    edges: Sequence[EdgePlan], ways: Sequence[PlannedConnection]
) -> tuple[tuple[EdgePlan, ...], tuple[PlannedConnection, ...]]:
    """Give ways of no length the last decimetre of the edge before: internal lanes need one."""
    short = {way.source for way in ways if _extent(way.course) < LEAST_EDGE}
    plans = list(edges)
    rests: dict[tuple[int, int], Stretch] = {}
    for number in sorted(short):
        plan = plans[number]
        lanes = []
        for index, lane in enumerate(plan.lanes):
            last = lane.course[-1]
            room = min(LEAST_EDGE, last.extent / 3.0)
            cut = last.end - room if last.end > last.start else last.end + room
            rests[number, index] = Stretch(last.row, cut, last.end)
            lanes.append(
                replace(lane, course=(*lane.course[:-1], Stretch(last.row, last.start, cut)))
            )
        plans[number] = replace(plan, lanes=tuple(lanes))
    longer = [
        way._replace(course=_joined(rests[way.source, way.source_lane], way.course))
        if way.source in short
        else way
        for way in ways
    ]
    return tuple(plans), tuple(longer)


def _joined(first: Stretch, course: Course) -> Course:
    if course and course[0].row == first.row:
        return (Stretch(first.row, first.start, course[0].end), *course[1:])
    return (first, *course)


def join_groups(groups: DisjointSet[NodeKey], one: NodeKey, other: NodeKey) -> None:
    """Make the groups of two things one; things not seen before are groups of their own."""
    groups.add(one)
    groups.add(other)
    groups.merge(one, other)


def first_members(groups: DisjointSet[NodeKey]) -> dict[NodeKey, NodeKey]:
    """Of each thing the one of its group that was seen first, which stands for the group."""
    first: dict[NodeKey, NodeKey] = {}
    return {item: first.setdefault(groups[item], item) for item in groups}
