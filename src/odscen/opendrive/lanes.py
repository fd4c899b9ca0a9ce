"""Lanes and road surface evaluated: positions, headings, widths, marks and limits of any lane.

A :class:`RoadTable` holds all roads of a map as flat arrays; every method takes arrays of roads or
lanes with an s each and answers all of them at once.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from odscen.base.arrays import BoolArray, FloatArray, IntArray, offsets
from odscen.base.ids import LaneKey, RoadId
from odscen.opendrive.geometry import PlanView
from odscen.opendrive.profiles import CubicTable, StepTable, locate
from odscen.opendrive.road_model import lane_use
from odscen.opendrive.surface import (
    LineOffset,
    ReferencePoints,
    line_curvature,
    line_direction,
    on_surface,
)

if TYPE_CHECKING:
    from odscen.opendrive.road_model import Lane, LaneSection, OpenDrive, Road


LANE_CHANGE_NONE = 0
LANE_CHANGE_INCREASE = 1
"""Bit: the mark may be crossed towards growing lane ids (to the left as s grows)."""
LANE_CHANGE_DECREASE = 2
"""Bit: the mark may be crossed towards falling lane ids (to the right as s grows)."""
LANE_CHANGE_BOTH = 3
_LANE_CHANGE_CODES = {
    "none": LANE_CHANGE_NONE,
    "increase": LANE_CHANGE_INCREASE,
    "decrease": LANE_CHANGE_DECREASE,
    "both": LANE_CHANGE_BOTH,
}


class LanePoints(NamedTuple):
    """Points of lane lines, shape ``(N,)`` each; metres, radians, 1/m.

    ``hdg`` and ``pitch`` are those of the line itself, along growing s; ``curvature`` is positive
    to the left; ``width`` is that of the lane.
    """

    x: FloatArray
    y: FloatArray
    z: FloatArray
    hdg: FloatArray
    pitch: FloatArray
    curvature: FloatArray
    width: FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class RoadTable:
    """All roads of a map as arrays.

    Attributes
    ----------
    road_ids, road_index
        Roads in file order and their rows. ``road_length`` and ``road_rht`` have shape ``(R,)``.
    lane_keys, lane_index
        All lanes but the centre lanes, by road (file order), section, lane id ascending.
    lane_road, lane_section, lane_id
        Row of the road, index of the section within its road, id; shape ``(L,)``.
    lane_type
        Lane type as in the file, or what access makes of a lane for driving
        (:func:`~odscen.opendrive.road_model.lane_use`).
    lane_s0, lane_s1
        Road coordinates between which the lane lies, metres.
    lane_forward
        Whether traffic of the lane runs with growing s.
    lane_rank
        1 for the lane next to the centre line, 2 for the one beside it, and so on.
    section_first, section_s, section_lanes
        Sections of road ``i`` are rows ``section_first[i]`` to ``section_first[i + 1]``; their
        start, and the first of their lanes, shape ``(sections + 1,)``.
    """

    road_ids: tuple[RoadId, ...]
    road_index: dict[RoadId, int]
    road_length: FloatArray
    road_rht: BoolArray
    lane_keys: tuple[LaneKey, ...]
    lane_index: dict[LaneKey, int]
    lane_road: IntArray
    lane_section: IntArray
    lane_id: IntArray
    lane_type: tuple[str, ...]
    lane_s0: FloatArray
    lane_s1: FloatArray
    lane_forward: BoolArray
    lane_rank: IntArray
    section_first: IntArray
    section_s: FloatArray
    section_lanes: IntArray
    plan: PlanView
    elevation: CubicTable
    superelevation: CubicTable
    offset: CubicTable
    widths: CubicTable
    borders: CubicTable
    inner_heights: StepTable
    outer_heights: StepTable
    lane_speeds: StepTable
    road_speeds: StepTable
    marks: StepTable
    centre_marks: StepTable

    @classmethod
    def of(cls, odr: OpenDrive) -> RoadTable:
        """Flatten a road model."""
        roads = list(odr.roads.values())
        rows = [
            (index, road, number, section, lane)
            for index, road in enumerate(roads)
            for number, section in enumerate(road.sections)
            for lane in reversed(section.lanes.values())
            if lane.id
        ]
        keys = tuple(LaneKey(road.id, number, lane.id) for _, road, number, _, lane in rows)
        sections = [section for road in roads for section in road.sections]
        lanes = [row[4] for row in rows]
        return cls(
            road_ids=tuple(road.id for road in roads),
            road_index={road.id: index for index, road in enumerate(roads)},
            road_length=np.array([road.length for road in roads]),
            road_rht=np.array([road.rule == "RHT" for road in roads], dtype=bool),
            lane_keys=keys,
            lane_index={key: index for index, key in enumerate(keys)},
            lane_road=np.array([row[0] for row in rows], dtype=np.int64),
            lane_section=np.array([row[2] for row in rows], dtype=np.int64),
            lane_id=np.array([lane.id for lane in lanes], dtype=np.int64),
            lane_type=tuple(lane_use(lane) for lane in lanes),
            lane_s0=np.array([row[3].s for row in rows], dtype=np.float64),
            lane_s1=np.array([row[3].s_end for row in rows], dtype=np.float64),
            lane_forward=np.array([is_forward(row[1], row[4]) for row in rows], dtype=bool),
            lane_rank=_rank_sections(sections),
            section_first=offsets(len(road.sections) for road in roads),
            section_s=np.array([section.s for section in sections]),
            section_lanes=offsets(len(section.lanes) - 1 for section in sections),
            plan=PlanView.of([road.geometry for road in roads]),
            elevation=CubicTable.of([road.elevation for road in roads]),
            superelevation=CubicTable.of([road.superelevation for road in roads]),
            offset=CubicTable.of([road.lane_offset for road in roads]),
            widths=CubicTable.of([lane.widths for lane in lanes]),
            borders=CubicTable.of([() if lane.widths else lane.borders for lane in lanes]),
            inner_heights=StepTable.of([[(h.s, h.inner) for h in ln.heights] for ln in lanes]),
            outer_heights=StepTable.of([[(h.s, h.outer) for h in ln.heights] for ln in lanes]),
            lane_speeds=StepTable.of([lane.speeds for lane in lanes]),
            road_speeds=StepTable.of([_road_speeds(road) for road in roads]),
            marks=StepTable.of([_mark_codes(lane) for lane in lanes]),
            centre_marks=StepTable.of([_mark_codes(section.lanes[0]) for section in sections]),
        )

    # ------------------------------------------------------------------------- reference line
    def reference(self, road: IntArray, s: FloatArray) -> ReferencePoints:
        """Points of the reference line of each road (row) at s.

        Beyond the ends of a road it continues straight, with the height and roll of its end.
        """
        road, s = np.asarray(road), np.asarray(s, dtype=np.float64)
        plan = self.plan.at(road, s)
        s = np.minimum(np.maximum(s, 0.0), self.road_length[road])
        z, slope, _ = self.elevation.at(road, s)
        roll, _, _ = self.superelevation.at(road, s)
        return ReferencePoints(plan.x, plan.y, z, plan.hdg, plan.curvature, np.arctan(slope), roll)

    def points(
        self, road: IntArray, s: FloatArray, t: FloatArray, z: FloatArray | float = 0.0
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Inertial x, y, z of road coordinates (s, t, h); ``z`` is h, metres above the surface."""
        line = self.reference(road, s)
        return on_surface(line, np.asarray(t, dtype=np.float64), np.asarray(z, dtype=np.float64))

    def lane_offset(self, road: IntArray, s: FloatArray) -> FloatArray:
        """Give t of the centre line of each road at s."""
        return self.offset.at(np.asarray(road), np.asarray(s, dtype=np.float64))[0]

    # ------------------------------------------------------------------------- lanes
    def lane_borders(self, lane: IntArray, s: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Give t of the inner and the outer border of each lane (row) at s."""
        lane = np.asarray(lane)
        inner, outer = self._lane_borders(lane, self._clamp_to_section(lane, s))
        return inner.t, outer.t

    def lane_width(self, lane: IntArray, s: FloatArray) -> FloatArray:
        """Width of each lane at s, metres, never negative."""
        inner, outer = self.lane_borders(lane, s)
        return np.abs(outer - inner)

    def lane_points(
        self, lane: IntArray, s: FloatArray, *, at: float | FloatArray = 0.5
    ) -> LanePoints:
        """Points of lane lines.

        Parameters
        ----------
        lane
            Rows of ``lane_keys``, shape ``(N,)``.
        s
            Road coordinates, shape ``(N,)``; held within the section of the lane.
        at
            0 for the inner border, 0.5 for the lane centre, 1 for the outer border; a number or
            shape ``(N,)``.
        """
        lane = np.asarray(lane)
        s = self._clamp_to_section(lane, s)
        road = self.lane_road[lane]
        inner, outer = self._lane_borders(lane, s)
        line = LineOffset(*(a + at * (b - a) for a, b in zip(inner, outer, strict=True)))
        plan = self.plan.at(road, s)
        elevation = self.elevation.at(road, s)
        roll = self.superelevation.at(road, s)
        low = self.inner_heights.at(lane, s, default=0.0)
        high = self.outer_heights.at(lane, s, default=0.0)
        reference = ReferencePoints(
            plan.x, plan.y, elevation[0], plan.hdg, plan.curvature, np.arctan(elevation[1]), roll[0]
        )
        x, y, z = on_surface(reference, line.t, low + at * (high - low))
        turn, pitch = line_direction(plan, elevation, roll, line)
        return LanePoints(
            x=x,
            y=y,
            z=z,
            hdg=plan.hdg + turn,
            pitch=pitch,
            curvature=line_curvature(plan, line),
            width=np.abs(outer.t - inner.t),
        )

    def _clamp_to_section(self, lane: IntArray, s: FloatArray) -> FloatArray:
        """Hold s within the lane's section.

        The end belongs to the next section, whose lane offset may differ: the last number before
        it is used instead, so that a lane is continuous up to its end.
        """
        last = np.nextafter(self.lane_s1[lane], -np.inf)
        return np.maximum(np.minimum(s, last), self.lane_s0[lane])

    def _lane_borders(self, lane: IntArray, s: FloatArray) -> tuple[LineOffset, LineOffset]:
        """Inner and outer border: widths are summed from the centre line outwards.

        A ``border`` record is the t of the lane's outer border, counted like widths from the centre
        line (section 11.7.2).
        """
        centre = self.offset.at(self.lane_road[lane], s)
        inner = [part.copy() for part in centre]
        outer = [part.copy() for part in centre]
        rank = self.lane_rank[lane]
        side = np.sign(self.lane_id[lane])
        has_borders = self.borders.starts.size > 0
        for k in range(1, int(np.max(rank, initial=0)) + 1):
            at = np.flatnonzero(rank >= k)
            row = lane[at] - side[at] * (rank[at] - np.int64(k))
            for part, done in zip(outer, inner, strict=True):
                done[at] = part[at]
            width = _clip_negative_width(self.widths.at(row, s[at]))
            for part, value in zip(outer, width, strict=True):
                part[at] += side[at] * value
            if has_borders:
                self._use_borders(outer, centre, at, row, s)
        return LineOffset(*inner), LineOffset(*outer)

    def _use_borders(
        self,
        outer: list[FloatArray],
        centre: tuple[FloatArray, FloatArray, FloatArray],
        at: IntArray,
        row: IntArray,
        s: FloatArray,
    ) -> None:
        given = self.borders.present(row)
        at, row = at[given], row[given]
        border = self.borders.at(row, s[at])
        for part, base, value in zip(outer, centre, border, strict=True):
            part[at] = base[at] + value

    # ------------------------------------------------------------------------- look-ups
    def section_at(self, road: IntArray, s: FloatArray) -> IntArray:
        """Index, within its road, of the lane section that holds at s."""
        road = np.asarray(road)
        row = locate(self.section_s, self.section_first, road, np.asarray(s, dtype=np.float64))
        return row - self.section_first[road]

    def lanes_at(self, road: int, s: float) -> IntArray:
        """Rows of the lanes of one road that lie at s, lane id ascending."""
        section = int(self.section_at(np.array([road]), np.array([s]))[0])
        row = int(self.section_first[road]) + section
        return np.arange(self.section_lanes[row], self.section_lanes[row + 1])

    def lane_change_at(self, lane: IntArray, s: FloatArray) -> IntArray:
        """Bits ``LANE_CHANGE_*`` of the mark on the outer border of each lane at s.

        Where the file has no mark, nothing forbids the change: both ways.
        """
        code = self.marks.at(np.asarray(lane), np.asarray(s, dtype=np.float64), default=3.0)
        return code.astype(np.int64)

    def inner_lane_change_at(self, lane: IntArray, s: FloatArray) -> IntArray:
        """Bits ``LANE_CHANGE_*`` of the mark on the inner border of each lane at s.

        That is the outer border of the lane before it, or the centre line.
        """
        lane, s = np.asarray(lane), np.asarray(s, dtype=np.float64)
        section = self.section_first[self.lane_road[lane]] + self.lane_section[lane]
        code = self.centre_marks.at(section, s, default=3.0).astype(np.int64)
        at = np.flatnonzero(self.lane_rank[lane] > 1)
        inner = lane[at] - np.where(self.lane_id[lane[at]] > 0, 1, -1)
        code[at] = self.lane_change_at(inner, s[at])
        return code

    def speed_limit(self, lane: IntArray, s: FloatArray) -> FloatArray:
        """Limit of each lane at s in m/s: of the lane, else of the road; infinite for "no limit".

        NaN where the map gives none.
        """
        lane, s = np.asarray(lane), np.asarray(s, dtype=np.float64)
        road = self.road_speeds.at(self.lane_road[lane], s, default=np.nan)
        own = self.lane_speeds.at(lane, s, default=np.nan)
        return np.where(np.isnan(own), road, own)


def is_forward(road: Road, lane: Lane) -> bool:
    """Whether traffic of a lane runs with growing s (sections 8.3 and 11.4)."""
    with_s = (lane.id < 0) == (road.rule == "RHT")
    return with_s != (lane.direction == "reversed")


def _rank_sections(sections: list[LaneSection]) -> IntArray:
    ranks: list[int] = []
    for section in sections:
        ids = [lane_id for lane_id in section.lanes if lane_id]
        right = sum(1 for lane_id in ids if lane_id < 0)
        ranks.extend(range(right, 0, -1))
        ranks.extend(range(1, len(ids) - right + 1))
    return np.array(ranks, dtype=np.int64)


def _mark_codes(lane: Lane) -> list[tuple[float, float]]:
    return [(mark.s, _LANE_CHANGE_CODES[mark.lane_change]) for mark in lane.road_marks]


def _road_speeds(road: Road) -> list[tuple[float, float]]:
    return [(t.s, np.nan if t.speed is None else t.speed) for t in road.types]


def _clip_negative_width(
    width: tuple[FloatArray, FloatArray, FloatArray],
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Zero where a width polynomial dips below zero."""
    negative = width[0] < 0.0
    if not negative.any():
        return width
    value, slope, bend = (np.where(negative, 0.0, part) for part in width)
    return value, slope, bend
