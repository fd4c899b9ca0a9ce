"""Roads and their cross-sections, written with ``scenariogeneration``'s elements.

Everything is designed for right-hand traffic; :func:`tools.make_maps.document.mirrored` makes a
left-hand map of a right-hand one.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from scenariogeneration import xodr


class Pose(NamedTuple):
    """Position in metres and heading in radians."""

    x: float
    y: float
    h: float

    def ahead(self, distance: float) -> Pose:
        """Return the pose ``distance`` metres further on a straight line."""
        return Pose(
            self.x + distance * math.cos(self.h), self.y + distance * math.sin(self.h), self.h
        )

    def left(self, distance: float) -> Pose:
        """Return the pose ``distance`` metres to the left."""
        return Pose(
            self.x - distance * math.sin(self.h), self.y + distance * math.cos(self.h), self.h
        )

    def back(self) -> Pose:
        """Return the same place, looking the other way."""
        return Pose(self.x, self.y, self.h + math.pi)


@dataclass(frozen=True)
class LaneSpec:
    """A lane: type, width at its section's start and end, mark on its outer border.

    ``key`` ties lanes of successive sections of one road together.
    """

    kind: str
    width: float
    mark: str = "none"
    change: str = "none"
    width_end: float | None = None
    key: str = ""


@dataclass(frozen=True)
class Profile:
    """Cross-section: lanes from the centre outwards, and the centre line's mark."""

    right: tuple[LaneSpec, ...]
    left: tuple[LaneSpec, ...] = ()
    centre: tuple[tuple[float, str, str], ...] = ((0.0, "none", "none"),)

    def lanes(self, side: int) -> tuple[LaneSpec, ...]:
        """Lanes of a side: 1 left, -1 right."""
        return self.left if side > 0 else self.right


DRIVING = LaneSpec("driving", 3.25, "solid")
INNER = LaneSpec("driving", 3.25, "broken", "both")
BIKE = LaneSpec("biking", 1.75, "none")
WALK = LaneSpec("sidewalk", 2.5, "none")


def street(
    inner: int = 0, inner_left: int | None = None, *, bikes: bool = False, width: float = 3.25
) -> Profile:
    """Two-way street with sidewalks; ``inner`` lanes more than one on the right (and left)."""
    curb = (replace(BIKE), WALK) if bikes else (WALK,)

    def side(more: int) -> tuple[LaneSpec, ...]:
        return (
            *[replace(INNER, width=width)] * more,
            replace(DRIVING, width=width),
            *curb,
        )

    wide = inner > 0
    return Profile(
        side(inner),
        side(inner if inner_left is None else inner_left),
        ((0.0, "solid_solid", "none") if wide else (0.0, "broken", "both"),),
    )


@dataclass(eq=False)
class RoadRecord:
    """A road that has been made, and what its neighbours need to know of it."""

    id: int
    road: xodr.Road
    first: Profile
    last: Profile
    start: Pose
    end: Pose
    length: float


class End(NamedTuple):
    """One end of a road, as a junction sees it."""

    record: RoadRecord
    contact: str

    @property
    def approach(self) -> Pose:
        """Pose of traffic that arrives at this end."""
        return self.record.end if self.contact == "end" else self.record.start.back()

    @property
    def departure(self) -> Pose:
        """Pose of traffic that leaves by this end."""
        return self.approach.back()

    def side(self, *, arriving: bool) -> int:
        """Sign of the ids of the lanes that arrive or leave here."""
        return -1 if (self.contact == "end") == arriving else 1

    def lanes(self, *, arriving: bool) -> tuple[LaneSpec, ...]:
        """Lanes that arrive or leave here, from the centre outwards."""
        profile = self.record.last if self.contact == "end" else self.record.first
        return profile.lanes(self.side(arriving=arriving))

    def at(self, back: float) -> float:
        """S of the place ``back`` metres before this end."""
        return self.record.length - back if self.contact == "end" else back

    @property
    def contact_point(self) -> xodr.ContactPoint:
        """The same in the library's terms."""
        return xodr.ContactPoint.end if self.contact == "end" else xodr.ContactPoint.start


def driving(lanes: Sequence[LaneSpec]) -> list[int]:
    """Positions of the driving lanes among ``lanes``."""
    return [i for i, lane in enumerate(lanes) if lane.kind == "driving"]


def inner_border(lanes: Sequence[LaneSpec], index: int) -> float:
    """Distance from the centre to the inner border of lane ``index``."""
    return sum(lane.width for lane in lanes[:index])


def carriageway(lanes: Sequence[LaneSpec]) -> float:
    """Width from the centre to the inner border of the sidewalk."""
    return sum(lane.width for lane in lanes if lane.kind != "sidewalk")


def lane_section(
    s: float, length: float, profile: Profile, links: dict[int, dict[str, int]] | None = None
) -> xodr.LaneSection:
    """Make a lane section; ``links`` gives predecessor and successor by lane id."""
    centre = xodr.Lane(xodr.LaneType.none)
    for offset, kind, change in profile.centre:
        centre.add_roadmark(_mark(kind, change, offset))
    section = xodr.LaneSection(s, centre)
    for sign in (1, -1):
        for index, spec in enumerate(profile.lanes(sign)):
            lane = _lane(spec, length)
            (section.add_left_lane if sign > 0 else section.add_right_lane)(lane)
            for which, target in (links or {}).get(sign * (index + 1), {}).items():
                lane.add_link(which, target)
    return section


def _lane(spec: LaneSpec, length: float) -> xodr.Lane:
    end = spec.width if spec.width_end is None else spec.width_end
    change = end - spec.width
    lane = xodr.Lane(
        getattr(xodr.LaneType, spec.kind),
        a=spec.width,
        c=3.0 * change / length**2,
        d=-2.0 * change / length**3,
    )
    lane.add_roadmark(_mark(spec.mark, spec.change))
    if spec.kind == "sidewalk":
        lane.add_height(0.12)
    return lane


def _mark(kind: str, change: str, offset: float = 0.0) -> xodr.RoadMark:
    return xodr.RoadMark(
        getattr(xodr.RoadMarkType, kind),
        width=0.12 if kind != "none" else 0.0,
        soffset=offset,
        color=xodr.RoadMarkColor.white,
        laneChange=getattr(xodr.LaneChange, change),
    )


Piece = tuple[xodr.geometry._BaseGeometry, Pose]


def plan(start: Pose, geometries: Sequence[object]) -> tuple[xodr.PlanView, Pose, float]:
    """String geometries together from ``start``; also the end and the total length."""
    view = xodr.PlanView()
    pose, s = start, 0.0
    for geometry in geometries:
        x, y, h, length = geometry.get_end_data(*pose)  # type: ignore[attr-defined]
        view.add_fixed_geometry(geometry, *pose, s)
        pose, s = Pose(x, y, h), s + length
    return view, pose, s


def curve(start: Pose, end: Pose) -> tuple[list[object], float]:
    """One smooth geometry from pose to pose; a line where that will do.

    A cubic Bezier curve whose handles are those of a circle for the turn between the poses
    (``4/3 tan(angle / 4)`` radii), as paramPoly3.
    """
    dx, dy = end.x - start.x, end.y - start.y
    cos, sin = math.cos(start.h), math.sin(start.h)
    u, v = dx * cos + dy * sin, dy * cos - dx * sin
    turn = math.remainder(end.h - start.h, 2.0 * math.pi)
    if abs(turn) < 1e-9 and abs(v) < 1e-9:
        return [xodr.Line(u)], u
    chord = math.hypot(u, v)
    half = abs(turn) / 2.0
    handle = chord / 3.0 if half < 1e-6 else chord * 2.0 / 3.0 * math.tan(half / 2) / math.sin(half)
    points = np.array(
        [
            (0.0, 0.0),
            (handle, 0.0),
            (u - handle * math.cos(turn), v - handle * math.sin(turn)),
            (u, v),
        ]
    )
    p0, p1, p2, p3 = points
    b, c, d = 3 * (p1 - p0), 3 * (p2 - 2 * p1 + p0), p3 - 3 * p2 + 3 * p1 - p0
    p = np.linspace(0.0, 1.0, 2001)[:, None]
    speed = np.hypot(*(b + 2 * c * p + 3 * d * p**2).T)
    length = float(np.trapezoid(speed, dx=1.0 / 2000))
    coefficients = (0.0, b[0], c[0], d[0], 0.0, b[1], c[1], d[1])
    return [xodr.ParamPoly3(*map(float, coefficients), "normalized", length)], length
