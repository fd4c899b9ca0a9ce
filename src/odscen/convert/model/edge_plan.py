"""Edges: every road divided into stretches of unchanging lanes, one edge per driving direction.

A road is cut where the lanes of its sections do not simply continue, where speed limits,
permissions or the right to change lanes change, where a curve is driven slower, and at crosswalks,
which become junctions of their own: cars give way to persons only where SUMO has a crossing, and
crossings belong to junctions.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from odscen.convert.model.access import allowed, speed, vehicle_classes
from odscen.convert.model.curve_speed import (
    BINDING,
    HEAVY,
    RoadCurves,
    comfortable_speed,
    speed_bands,
)
from odscen.convert.model.lane_alignment import LaneAlignment, Stretch
from odscen.opendrive.lanes import LANE_CHANGE_DECREASE, LANE_CHANGE_INCREASE

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from odscen.base.ids import LaneKey, RoadId
    from odscen.opendrive.lanes import RoadTable
    from odscen.opendrive.road_model import OpenDrive, Road
    from odscen.opendrive.topology import SideLink


TO_JUNCTION = 12.0
"""Metres between a gap and a junction: with less, the gap belongs to the junction."""

BETWEEN = 8.0
"""Metres between gaps of one road: with less, no edge lies between them."""

SHORTEST = 1.0
"""Metres of an edge, at least, that stays between gaps of two junctions."""

MOST_TRIMMED = 1.0
"""Metres that each of these gaps gives for it, at most: what stop lines are off crosswalks."""

STUB = 0.5
"""Metres of road that stay beyond a gap at a dead end."""

SIDE_MARGIN = 2.0
"""Metres of road before and behind a place where side roads turn off."""

TOGETHER = 30.0
"""Metres between side links of one junction that share a gap."""


class RoadGap(NamedTuple):
    """Part of a road that belongs to a junction, metres of s.

    ``at`` is the place that it is made for, the middle of a crosswalk, where that is known.
    """

    start: float
    end: float
    at: float = math.nan

    @property
    def middle(self) -> float:
        """The place that it is made for, else halfway along it."""
        return 0.5 * (self.start + self.end) if math.isnan(self.at) else self.at


def side_gaps(sides: Sequence[SideLink]) -> dict[RoadId, list[RoadGap]]:
    """Gaps around the places where lanes begin or end beside a road."""
    places: dict[RoadId, set[float]] = {}
    for side in sides:
        places.setdefault(side.main.road, set()).add(side.s)
    found: dict[RoadId, list[RoadGap]] = {}
    for road, own in places.items():
        gaps = found.setdefault(road, [])
        for s in sorted(own):
            if gaps and s - gaps[-1].end < TOGETHER:
                gaps[-1] = RoadGap(gaps[-1].start, s + SIDE_MARGIN)
            else:
                gaps.append(RoadGap(s - SIDE_MARGIN, s + SIDE_MARGIN))
    return found


def merge_gaps(
    odr: OpenDrive, *parts: Mapping[RoadId, Sequence[RoadGap]]
) -> dict[RoadId, tuple[RoadGap, ...]]:
    """Gaps of each road: sorted, disjoint, widened to junctions that are near."""
    roads = dict.fromkeys(road for part in parts for road in part)
    return {
        road: _merge_gaps(odr.roads[road], sorted(g for part in parts for g in part.get(road, ())))
        for road in roads
    }


def _merge_gaps(road: Road, gaps: list[RoadGap]) -> tuple[RoadGap, ...]:
    """Gaps of a road, widened to junctions that are near, and joined if they are close."""
    road_gaps: list[RoadGap] = []
    for gap in gaps:
        # At a dead end a stub stays: without an edge there no vehicle would come over the gap.
        start = max(gap.start, 0.0 if road.predecessor else min(STUB, 0.1 * road.length))
        end = min(gap.end, road.length - (0.0 if road.successor else min(STUB, 0.1 * road.length)))
        before, behind = start, road.length - end
        if before < min(TO_JUNCTION, behind) and _ends_at_junction(road, "start"):
            start = 0.0
        if behind < min(TO_JUNCTION, before) and _ends_at_junction(road, "end"):
            end = road.length
        road_gaps.append(RoadGap(start, end, gap.at))
    groups: list[list[RoadGap]] = []
    for gap in road_gaps:
        if groups and gap.start - max(group.end for group in groups[-1]) < BETWEEN:
            groups[-1].append(gap)
        else:
            groups.append([gap])
    return tuple(gap for group in groups for gap in _joined_gaps(road, group))


def _joined_gaps(road: Road, gaps: list[RoadGap]) -> list[RoadGap]:
    """One gap of several that are close; two where one would make two junctions one.

    A short road between two junctions keeps an edge, where its gaps are farthest apart, or, if they
    leave no road, in the middle between the crosswalks or at the end far from the only one: without
    it both junctions would be one, their lights lost, and turns back on the road.
    """
    start, end = gaps[0].start, max(gap.end for gap in gaps)
    whole = [RoadGap(start, end)]
    if start > 0.0 or end < road.length or not is_between_junctions(road):
        return whole
    if len(gaps) == 1:
        kept = min(SHORTEST, road.length)
        if gaps[0].middle > 0.5 * road.length:
            return [RoadGap(0.0, 0.0), RoadGap(kept, road.length)]
        return [RoadGap(0.0, road.length - kept), RoadGap(road.length, road.length)]
    ends = [max(gap.end for gap in gaps[: n + 1]) for n in range(len(gaps) - 1)]
    spaces = [gap.start - before for gap, before in zip(gaps[1:], ends, strict=True)]
    widest = max(range(len(spaces)), key=lambda n: (spaces[n], -n))
    before, behind = ends[widest], gaps[widest + 1].start
    short = max(0.0, SHORTEST - spaces[widest]) / 2.0
    if short > MOST_TRIMMED:
        place = 0.5 * (gaps[widest].middle + gaps[widest + 1].middle)
        kept = min(SHORTEST, road.length)
        before = min(max(place - 0.5 * kept, 0.0), road.length - kept)
        return [RoadGap(0.0, before), RoadGap(before + kept, road.length)]
    return [RoadGap(start, before - short), RoadGap(behind + short, end)]


def is_between_junctions(road: Road) -> bool:
    """Whether a road leads from one junction to another one."""
    both = _ends_at_junction(road, "start") and _ends_at_junction(road, "end")
    if not both or road.predecessor is None or road.successor is None:
        return False
    return road.predecessor.element_id != road.successor.element_id


def _ends_at_junction(road: Road, end: str) -> bool:
    link = road.predecessor if end == "start" else road.successor
    return link is not None and link.element_type == "junction"


LEAST_EDGE = 0.05
"""Metres: shorter stretches of lanes are passed over on the way from one edge to the next."""

LEAST_CUT = 1.0
"""Metres that a change of limit or mark must lie from the next cut to be one of its own."""

LEAST_WIDTH = 0.3
"""Metres: lanes that are nowhere wider are none; bad files have them where a lane has ended."""

NO_WIDTH = 0.05
"""Metres: where a lane is narrower there is no SUMO lane."""

WIDTH_STEP = 0.5
"""Metres between the places at which widths are looked at."""

LEAST_CURVE_CUT = 6.0
"""Metres that the end of a curve must lie from the next cut to be one of its own."""

MARKS_LEAST = 10.0
"""Metres: a stretch on which only the right to change lanes differs must be this long.

A shorter one is joined to its neighbours, and the change is permitted on all of it: what a driver
does within a few metres of broken line SUMO's drivers need the length of an edge for.
"""


@dataclass(frozen=True, slots=True)
class EdgeLane:
    """A lane to be; ``alignment`` runs in driving direction.

    ``limit`` is the legal one, ``speed`` what is driven in its sharpest curve, if that is less, and
    ``heavy_speed`` what trucks and buses drive there; infinite without a curve.
    """

    alignment: LaneAlignment
    allowed: frozenset[str]
    limit: float
    speed: float
    change_left: bool
    change_right: bool
    type: str
    heavy_speed: float = math.inf


@dataclass(frozen=True, slots=True)
class EdgePlan:
    """An edge to be: ``lanes`` by index, from s ``start`` to ``end`` in driving direction.

    ``stretch`` counts the stretches of the road from its start; ``road`` is a row of the table.
    """

    road: int
    stretch: int
    forward: bool
    start: float
    end: float
    lanes: tuple[EdgeLane, ...]


class _LaneState(NamedTuple):
    """What one lane is like between two cuts; equal ones can be joined.

    ``curve`` is the speed of its sharpest curve, infinite if that is none to slow down for.
    """

    row: int
    allowed: frozenset[str]
    limit: float
    change_left: bool
    change_right: bool
    type: str
    curve: float
    heavy: float


class _RoadPart(NamedTuple):
    """A road between two cuts: its lanes in SUMO's order, those with growing s first."""

    start: float
    end: float
    forward: tuple[_LaneState, ...]
    backward: tuple[_LaneState, ...]


def plan_edges(
    odr: OpenDrive,
    table: RoadTable,
    successors: Mapping[LaneKey, Sequence[LaneKey]],
    gaps: Mapping[RoadId, Sequence[RoadGap]],
    *,
    lefthand: bool,
) -> tuple[EdgePlan, ...]:
    """Divide all roads outside junctions into edges.

    Parameters
    ----------
    successors
        Lanes after each lane in driving direction.
    gaps
        By road: parts that are left to junctions, sorted, disjoint.
    lefthand
        Whether the network numbers lanes from the left.
    """
    planner = _Planner(odr, table, successors, lefthand=lefthand)
    plans: list[EdgePlan] = []
    for road in odr.roads.values():
        if road.junction is None:
            plans += planner.road(road, gaps.get(road.id, ()))
    return tuple(plans)


class _Planner:
    def __init__(
        self,
        odr: OpenDrive,
        table: RoadTable,
        successors: Mapping[LaneKey, Sequence[LaneKey]],
        *,
        lefthand: bool,
    ) -> None:
        self._odr = odr
        self._table = table
        self._successors = successors
        self._lefthand = lefthand
        outside = [road for road in odr.roads.values() if road.junction is None]
        self._curves = RoadCurves(table, [table.road_index[road.id] for road in outside])

    def road(self, road: Road, gaps: Sequence[RoadGap]) -> list[EdgePlan]:
        row = self._table.road_index[road.id]
        groups: list[list[_RoadPart]] = []
        for part in self._divide_road(road, row, gaps):
            if groups and self._continues_in(groups[-1][-1], part):
                groups[-1].append(part)
            else:
                groups.append([part])
        plans: list[EdgePlan] = []
        for number, group in enumerate(groups):
            for forward in (True, False):
                plan = self._plan_edge(row, number, group, forward=forward)
                if plan is not None:
                    plans.append(plan)
        return plans

    def _divide_road(self, road: Road, row: int, gaps: Sequence[RoadGap]) -> list[_RoadPart]:
        borders = {0.0, road.length, *(section.s for section in road.sections)}
        borders |= {bound for gap in gaps for bound in (gap.start, gap.end)}
        others = {kind.s for kind in road.types} | self._narrow_ends(road)
        for section in road.sections:
            for lane in section.lanes.values():
                others |= {speed.s for speed in lane.speeds}
                others |= {mark.s for mark in lane.road_marks}
                others |= {record.s for record in lane.access}
        kept = sorted(s for s in borders if 0.0 <= s <= road.length)
        for place in sorted(others):
            if 0.0 < place < road.length and all(abs(place - s) >= LEAST_CUT for s in kept):
                kept.append(place)
        kept += self._curve_ends(road, row, kept)
        kept.sort()
        parts: list[_RoadPart] = []
        for start, end in pairwise(kept):
            middle = 0.5 * (start + end)
            if end - start < LEAST_EDGE or any(gap.start < middle < gap.end for gap in gaps):
                continue
            parts.append(self._make_part(road, row, start, end))
        return parts

    def _curve_ends(self, road: Road, row: int, kept: Sequence[float]) -> list[float]:
        """Where another speed is driven because of a curve; not near a cut that is there anyway."""
        table = self._table
        first = int(table.section_first[row])
        begin, end = table.section_lanes[[first, first + len(road.sections)]].tolist()
        lanes = np.array(
            [lane for lane in range(begin, end) if allowed(table.lane_type[lane])], dtype=np.int64
        )
        places = [*(kind.s for kind in road.types), *(section.s for section in road.sections), 0.0]
        at = np.clip(np.array(places), 0.0, road.length)
        kinds = [kind.type for kind in road.types] or [""]
        highest = max(
            (
                speed(limit, table.lane_type[lane], kind)
                for lane in lanes.tolist()
                for limit in table.speed_limit(np.full(len(at), lane), at).tolist()
                for kind in kinds
            ),
            default=0.0,
        )
        return [
            place
            for place in self._curves.cuts(row, highest)
            if all(abs(place - s) >= LEAST_CURVE_CUT for s in kept)
        ]

    def _make_part(self, road: Road, row: int, start: float, end: float) -> _RoadPart:
        table, middle = self._table, 0.5 * (start + end)
        kinds = [kind.type for kind in road.types if kind.s <= middle + 1e-6]
        road_type = kinds[-1] if kinds else ""
        rows = [
            int(r)
            for r in table.lanes_at(row, middle)
            if self._classes_of_lane(int(r), middle)
            and float(table.lane_s1[r] - table.lane_s0[r]) >= LEAST_EDGE
            and self._widest_in_part(int(r), start, end) >= LEAST_WIDTH
        ]
        if not rows:
            return _RoadPart(start, end, (), ())
        lanes, at = np.array(rows), np.full(len(rows), middle)
        outer = table.lane_change_at(lanes, at)
        inner = table.inner_lane_change_at(lanes, at)
        limits = table.speed_limit(lanes, at)
        centre = 0.5 * np.sum(table.lane_borders(lanes, at), axis=0)
        bends = self._curves.lane_bends(row, centre, start, end)
        curves, heavy = comfortable_speed(bends), comfortable_speed(bends, share=HEAVY)
        states: dict[bool, list[_LaneState]] = {True: [], False: []}
        # Rows ascend in lane id, from right to left as s grows.
        for index, lane in enumerate(rows):
            kind, forward = table.lane_type[lane], bool(table.lane_forward[lane])
            positive = table.lane_id[lane] > 0
            upper, lower = (outer, inner) if positive else (inner, outer)
            limit = round(speed(float(limits[index]), kind, road_type), 2)
            curve = float(curves[index])
            up = bool(upper[index] & LANE_CHANGE_INCREASE)
            down = bool(lower[index] & LANE_CHANGE_DECREASE)
            states[forward].append(
                _LaneState(
                    lane,
                    self._classes_of_lane(lane, middle),
                    limit,
                    up if forward else down,
                    down if forward else up,
                    kind,
                    *((curve, float(heavy[index])) if curve < BINDING * limit else (math.inf,) * 2),
                )
            )
        right_first = (tuple(states[True]), tuple(reversed(states[False])))
        if self._lefthand:
            right_first = (right_first[0][::-1], right_first[1][::-1])
        return _RoadPart(start, end, *right_first)

    def _classes_of_lane(self, row: int, s: float) -> frozenset[str]:
        """Vehicle classes that may use a lane at s."""
        key = self._table.lane_keys[row]
        return vehicle_classes(self._odr.roads[key.road].sections[key.section].lanes[key.lane], s)

    def _narrow_ends(self, road: Road) -> set[float]:
        """Where lanes become too narrow to be one, or wide enough."""
        found: set[float] = set()
        first = int(self._table.section_first[self._table.road_index[road.id]])
        for number, section in enumerate(road.sections):
            rows = range(*(int(n) for n in self._table.section_lanes[first + number :][:2]))
            lanes = [r for r in rows if allowed(self._table.lane_type[r])]
            if not lanes:
                continue
            count = max(2, int(np.ceil((section.s_end - section.s) / WIDTH_STEP)) + 1)
            s = np.linspace(section.s, section.s_end, count)
            width = self._table.lane_width(np.repeat(lanes, count), np.tile(s, len(lanes)))
            narrow = (width < NO_WIDTH).reshape(len(lanes), count)
            lane, place = np.nonzero(narrow[:, 1:] != narrow[:, :-1])
            found |= {
                self._find_width_change(lanes[i], float(s[j]), float(s[j + 1]))
                for i, j in zip(lane.tolist(), place.tolist(), strict=True)
            }
        return found

    def _find_width_change(self, row: int, low: float, high: float) -> float:
        """Where between two places a lane's width passes :data:`NO_WIDTH`, to a millimetre."""
        ends = self._table.lane_width(np.array([row, row]), np.array([low, high])) < NO_WIDTH
        while high - low > 1e-3:
            middle = 0.5 * (low + high)
            narrow = self._table.lane_width(np.array([row]), np.array([middle]))[0] < NO_WIDTH
            low, high = (middle, high) if narrow == ends[0] else (low, middle)
        return high if ends[0] else low

    def _widest_in_part(self, row: int, start: float, end: float) -> float:
        s = np.linspace(start, end, 5)
        return float(self._table.lane_width(np.full(5, row), s).max())

    def _continues_in(self, one: _RoadPart, other: _RoadPart) -> bool:
        if other.start - one.end > 1e-6:
            return False
        # A few metres of another mark are no reason for an edge of their own.
        short = min(one.end - one.start, other.end - other.start) < MARKS_LEAST
        return all(
            len(before) == len(after)
            and all(
                self._same_edge(*pair, marks=not short, forward=forward)
                for pair in zip(before, after, strict=True)
            )
            for before, after, forward in (
                (one.forward, other.forward, True),
                (one.backward, other.backward, False),
            )
        )

    def _same_edge(self, one: _LaneState, other: _LaneState, *, marks: bool, forward: bool) -> bool:
        if (one.allowed, one.limit, one.type) != (other.allowed, other.limit, other.type):
            return False
        if speed_bands(one.curve) != speed_bands(other.curve):
            return False
        if marks and one[3:5] != other[3:5]:
            return False
        if one.row == other.row:
            return True
        source, target = (one, other) if forward else (other, one)
        keys = self._table.lane_keys
        return tuple(self._successors[keys[source.row]]) == (keys[target.row],)

    def _plan_edge(
        self, road: int, number: int, group: list[_RoadPart], *, forward: bool
    ) -> EdgePlan | None:
        parts = group if forward else group[::-1]
        sides = [part.forward if forward else part.backward for part in parts]
        if not sides[0]:
            return None
        longest = max(range(len(parts)), key=lambda i: parts[i].end - parts[i].start)
        lanes: list[EdgeLane] = []
        for index, state in enumerate(sides[longest]):
            alignment: list[Stretch] = []
            for part, side in zip(parts, sides, strict=True):
                start, end = (part.start, part.end) if forward else (part.end, part.start)
                row = side[index].row
                if alignment and alignment[-1].row == row:
                    alignment[-1] = Stretch(row, alignment[-1].start, end)
                else:
                    alignment.append(Stretch(row, start, end))
            lanes.append(
                EdgeLane(
                    tuple(alignment),
                    state.allowed,
                    state.limit,
                    round(min(state.limit, *(side[index].curve for side in sides)), 2),
                    any(side[index].change_left for side in sides),
                    any(side[index].change_right for side in sides),
                    state.type,
                    round(min(side[index].heavy for side in sides), 2),
                )
            )
        start, end = group[0].start, group[-1].end
        if not forward:
            start, end = end, start
        return EdgePlan(road, number, forward, start, end, tuple(lanes))
