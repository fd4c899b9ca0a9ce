"""Cross-sections of roads, and the ends of roads as junctions see them.

Everything is designed for right-hand traffic; :func:`tools.make_maps.document.mirrored` makes a
left-hand map of a right-hand one.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, NamedTuple

from scenariogeneration import xodr

from tools.make_maps.geometry import Pose, smooth

if TYPE_CHECKING:
    from collections.abc import Sequence

CAR_LANES = {"driving", "entry", "exit"}
"""Lane types of these maps on which cars drive."""

MARK_WIDTH = 0.12
CURB_HEIGHT = 0.12


class Mark(NamedTuple):
    """A road mark from ``offset`` metres into its section on, and the lane changes it allows."""

    offset: float
    kind: str
    change: str


BROKEN = (Mark(0.0, "broken", "both"),)
SOLID = (Mark(0.0, "solid", "none"),)


@dataclass(frozen=True)
class LaneSpec:
    """A lane: type, width at its section's start (and end), marks on its outer border.

    ``key`` ties lanes of successive sections of one road together. ``only`` names the one vehicle
    class of OpenDRIVE's access restrictions that may use the lane.
    """

    kind: str
    width: float
    marks: tuple[Mark, ...] = ()
    width_end: float | None = None
    key: str = ""
    only: str = ""


@dataclass(frozen=True)
class Profile:
    """Cross-section: lanes from the centre outwards, the centre line's marks, the lane offset."""

    right: tuple[LaneSpec, ...]
    left: tuple[LaneSpec, ...] = ()
    centre: tuple[Mark, ...] = ()
    offset: float = 0.0
    offset_end: float | None = None

    def lanes(self, side: int) -> tuple[LaneSpec, ...]:
        """Lanes of a side: 1 left, -1 right."""
        return self.left if side > 0 else self.right


def street(lanes: int = 1, *, bikes: bool = False, width: float = 3.25) -> Profile:
    """Two-way street with ``lanes`` lanes each way, bicycle lanes if wanted, and sidewalks."""
    inner = tuple(
        LaneSpec("driving", width, BROKEN, key=f"car {i}") for i in range(lanes - 1, 0, -1)
    )
    outer = LaneSpec("driving", width, SOLID, key="car 0")
    bike = (LaneSpec("biking", 1.75, key="bike"),) if bikes else ()
    side = (*inner, outer, *bike, LaneSpec("sidewalk", 2.5, key="walk"))
    return Profile(side, side, BROKEN if lanes == 1 else (Mark(0.0, "solid_solid", "none"),))


@dataclass(eq=False)
class RoadRecord:
    """A road that has been made, and what its neighbours need to know of it.

    Attributes
    ----------
    sections
        Start of each lane section and its cross-section.
    start, end
        Poses of the reference line.
    heights
        Height at start and end, metres.
    """

    id: int
    road: xodr.Road
    sections: tuple[tuple[float, Profile], ...]
    start: Pose
    end: Pose
    length: float
    heights: tuple[float, float]


class End(NamedTuple):
    """One end of a road, as a junction sees it."""

    record: RoadRecord
    contact: str

    @property
    def at_end(self) -> bool:
        """Whether this is the end at the greatest s."""
        return self.contact == "end"

    @property
    def section(self) -> xodr.LaneSection:
        """Lane section at this end."""
        return self.record.road.lanes.lanesections[-1 if self.at_end else 0]

    @property
    def section_length(self) -> float:
        """Length of that section."""
        starts = [s for s, _ in self.record.sections]
        if self.at_end:
            return self.record.length - starts[-1]
        return [*starts, self.record.length][1]

    @property
    def profile(self) -> Profile:
        """Cross-section at this end."""
        return self.record.sections[-1 if self.at_end else 0][1]

    @property
    def offset(self) -> float:
        """Lane offset at this end."""
        profile = self.profile
        grown = self.at_end and profile.offset_end is not None
        return profile.offset_end or 0.0 if grown else profile.offset

    @property
    def height(self) -> float:
        """Height at this end."""
        return self.record.heights[1 if self.at_end else 0]

    @property
    def approach(self) -> Pose:
        """Pose of the lanes' centre line, as traffic that arrives here looks."""
        if self.at_end:
            return self.record.end.left(self.offset)
        return self.record.start.left(self.offset).back()

    @property
    def departure(self) -> Pose:
        """The same as traffic that leaves looks."""
        return self.approach.back()

    def side(self, *, arriving: bool) -> int:
        """Sign of the ids of the lanes that arrive or leave here."""
        return -1 if self.at_end == arriving else 1

    def lanes(self, *, arriving: bool) -> tuple[LaneSpec, ...]:
        """Lanes that arrive or leave here, from the centre outwards, as wide as they are here."""
        return tuple(
            replace(lane, width=lane.width_end, width_end=None)
            if self.at_end and lane.width_end is not None
            else lane
            for lane in self.profile.lanes(self.side(arriving=arriving))
        )

    def at(self, back: float) -> float:
        """Return s of the place ``back`` metres before this end."""
        return self.record.length - back if self.at_end else back

    @property
    def contact_point(self) -> xodr.ContactPoint:
        """The same in the library's terms."""
        return xodr.ContactPoint.end if self.at_end else xodr.ContactPoint.start

    @property
    def orientation(self) -> xodr.Orientation:
        """Orientation of what is meant for traffic that arrives here."""
        return xodr.Orientation.positive if self.at_end else xodr.Orientation.negative


def car_lanes(lanes: Sequence[LaneSpec]) -> list[int]:
    """Positions of the lanes for cars among ``lanes``."""
    return [i for i, lane in enumerate(lanes) if lane.kind in CAR_LANES]


def inner_border(lanes: Sequence[LaneSpec], index: int) -> float:
    """Distance from the centre to the inner border of lane ``index``."""
    return sum(lane.width for lane in lanes[:index])


def carriageway(lanes: Sequence[LaneSpec]) -> float:
    """Width from the centre to the inner border of the sidewalk."""
    return sum(lane.width for lane in lanes if lane.kind != "sidewalk")


def lane_section(
    s: float, length: float, profile: Profile, links: dict[int, dict[str, int]]
) -> xodr.LaneSection:
    """Make a lane section; ``links`` gives predecessor and successor by lane id."""
    centre = xodr.Lane(xodr.LaneType.none)
    for mark in profile.centre:
        centre.add_roadmark(road_mark(mark))
    section = xodr.LaneSection(s, centre)
    for sign in (1, -1):
        for index, spec in enumerate(profile.lanes(sign)):
            lane = _lane(spec, length)
            (section.add_left_lane if sign > 0 else section.add_right_lane)(lane)
            for which, target in links.get(sign * (index + 1), {}).items():
                lane.add_link(which, target)
    return section


class RestrictedLane(xodr.Lane):
    """A lane with the ``<access>`` that the library lacks."""

    only = ""

    def get_element(self) -> ET.Element:
        """Return the element, with access where the schema wants it: before heights."""
        element: ET.Element = super().get_element()
        if self.only:
            heights = len(element.findall("height"))
            access = ET.Element("access", sOffset="0", rule="allow", restriction=self.only)
            element.insert(len(element) - heights, access)
        return element


def _lane(spec: LaneSpec, length: float) -> xodr.Lane:
    end = spec.width if spec.width_end is None else spec.width_end
    lane = RestrictedLane(getattr(xodr.LaneType, spec.kind), *smooth(spec.width, end, length))
    lane.only = spec.only
    for mark in spec.marks:
        lane.add_roadmark(road_mark(mark))
    if spec.kind == "sidewalk":
        lane.add_height(CURB_HEIGHT)
    return lane


def road_mark(mark: Mark) -> xodr.RoadMark:
    """The mark as an element."""
    return xodr.RoadMark(
        getattr(xodr.RoadMarkType, mark.kind),
        width=MARK_WIDTH,
        soffset=mark.offset,
        color=xodr.RoadMarkColor.white,
        laneChange=getattr(xodr.LaneChange, mark.change),
    )


def section_links(profiles: Sequence[Profile], index: int) -> dict[int, dict[str, int]]:
    """Links between the lane sections of one road, by the lanes' keys."""
    links: dict[int, dict[str, int]] = {}
    for which, other in (("predecessor", index - 1), ("successor", index + 1)):
        if not 0 <= other < len(profiles):
            continue
        for sign in (1, -1):
            keys = [lane.key for lane in profiles[other].lanes(sign)]
            for place, lane in enumerate(profiles[index].lanes(sign)):
                if lane.key in keys:
                    target = sign * (keys.index(lane.key) + 1)
                    links.setdefault(sign * (place + 1), {})[which] = target
    return links
