"""The road model: OpenDRIVE's elements as frozen values, with the standard's own names.

Lengths in metres, angles in radians, speeds in m/s (converted at parsing), ids as strings. One
class per element of the standard; section numbers refer to ASAM OpenDRIVE 1.8.0. Nothing here
evaluates geometry: see :mod:`odscen.opendrive.lanes`.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import StrEnum
from typing import TYPE_CHECKING, Literal, NamedTuple

if TYPE_CHECKING:
    from odscen.base.ids import JunctionId, RoadId

ContactPoint = Literal["start", "end"]
TrafficRule = Literal["RHT", "LHT"]
LaneChange = Literal["both", "increase", "decrease", "none"]


class Cubic(NamedTuple):
    """``a + b ds + c ds^2 + d ds^3`` with ``ds = s - self.s``; valid until the next one starts.

    ``s`` is a road coordinate for road-level profiles and for lanes alike: ``sOffset`` of the file
    has been added to the ``s`` of its lane section.
    """

    s: float
    a: float
    b: float
    c: float
    d: float


class GeometryKind(StrEnum):
    """Plan-view primitives (section 9)."""

    LINE = "line"
    ARC = "arc"
    SPIRAL = "spiral"
    POLY3 = "poly3"
    PARAM_POLY3 = "paramPoly3"


class Geometry(NamedTuple):
    """One ``<geometry>``; ``params`` by kind.

    line ``()``; arc ``(curvature,)``; spiral ``(curvStart, curvEnd)``; poly3 ``(a, b, c, d)``;
    paramPoly3 ``(aU, bU, cU, dU, aV, bV, cV, dV)`` already in terms of p = ds (``arcLength``); for
    ``normalized`` files the coefficients have been divided by powers of the length.
    """

    s: float
    x: float
    y: float
    hdg: float
    length: float
    kind: GeometryKind
    params: tuple[float, ...]


class RoadMark(NamedTuple):
    """``<roadMark>`` on the outer border of a lane (section 11.9). ``s`` is a road coordinate."""

    s: float
    type: str
    color: str
    weight: str
    width: float
    lane_change: LaneChange


class LaneSpeed(NamedTuple):
    """``<speed>`` of a lane; ``max`` in m/s, infinite for "no limit". ``s`` is that of the road."""

    s: float
    max: float


class LaneHeight(NamedTuple):
    """``<height>`` of a lane, metres above the road surface at its inner and outer border."""

    s: float
    inner: float
    outer: float


class LaneAccess(NamedTuple):
    """``<access>``: ``rule`` is ``allow``, ``deny`` or empty; ``restriction`` as in the file."""

    s: float
    rule: str
    restriction: str


@dataclass(frozen=True, slots=True)
class Lane:
    """One ``<lane>`` of a lane section; id > 0 left of the reference line, < 0 right of it."""

    id: int
    type: str
    level: bool = False
    widths: tuple[Cubic, ...] = ()
    borders: tuple[Cubic, ...] = ()
    heights: tuple[LaneHeight, ...] = ()
    road_marks: tuple[RoadMark, ...] = ()
    speeds: tuple[LaneSpeed, ...] = ()
    access: tuple[LaneAccess, ...] = ()
    predecessors: tuple[int, ...] = ()
    successors: tuple[int, ...] = ()
    direction: str = "standard"


@dataclass(frozen=True, slots=True)
class LaneSection:
    """One ``<laneSection>`` from ``s`` to ``s_end``; ``lanes`` from leftmost id to rightmost.

    The centre lane (id 0, no width) is among them, for its road marks.
    """

    s: float
    s_end: float
    lanes: dict[int, Lane]
    single_side: bool = False


class RoadLink(NamedTuple):
    """Predecessor or successor of a road; ``element_s``, ``element_dir`` for virtual junctions."""

    element_type: Literal["road", "junction"]
    element_id: str
    contact_point: ContactPoint | None
    element_s: float | None = None
    element_dir: str | None = None


class RoadType(NamedTuple):
    """``<type>`` of a road from ``s`` on; ``speed`` in m/s (infinite: "no limit") or ``None``."""

    s: float
    type: str
    speed: float | None


class Corner(NamedTuple):
    """A corner of an outline: road coordinates (``local`` false: s, t) or local (u, v); metres."""

    local: bool
    a: float
    b: float
    z: float
    height: float


class Outline(NamedTuple):
    """``<outline>`` of an object."""

    corners: tuple[Corner, ...]
    closed: bool
    outer: bool


class Validity(NamedTuple):
    """``<validity>``: lane ids from ``from_lane`` to ``to_lane``, both included."""

    from_lane: int
    to_lane: int


class ObjectRepeat(NamedTuple):
    """``<repeat>`` of an object."""

    s: float
    length: float
    distance: float
    t_start: float
    t_end: float


@dataclass(frozen=True, slots=True)
class RoadObject:
    """One ``<object>`` (section 13): crosswalk, stop line, pole, parking space, ..."""

    id: str
    type: str
    subtype: str
    name: str
    s: float
    t: float
    z_offset: float
    hdg: float
    pitch: float
    roll: float
    orientation: str
    length: float | None
    width: float | None
    height: float | None
    radius: float | None
    valid_length: float | None
    outlines: tuple[Outline, ...] = ()
    repeats: tuple[ObjectRepeat, ...] = ()
    validities: tuple[Validity, ...] = ()


@dataclass(frozen=True, slots=True)
class Signal:
    """One ``<signal>`` (section 14); ``value`` in m/s if ``unit`` is a speed, else as written."""

    id: str
    name: str
    s: float
    t: float
    z_offset: float
    h_offset: float
    orientation: str
    dynamic: bool
    country: str
    type: str
    subtype: str
    value: float | None
    unit: str
    text: str
    width: float | None
    height: float | None
    validities: tuple[Validity, ...] = ()
    dependencies: tuple[tuple[str, str], ...] = ()


@dataclass(frozen=True, slots=True)
class SignalReference:
    """One ``<signalReference>``: signal ``id`` also acts here."""

    id: str
    s: float
    t: float
    orientation: str
    validities: tuple[Validity, ...] = ()


@dataclass(frozen=True, slots=True)
class Road:
    """One ``<road>``. ``junction`` is ``None`` for a road that is not a connecting road.

    Profiles (``elevation``, ``superelevation``, ``lane_offset``) are sorted by s; none stands for
    zero everywhere.
    """

    id: RoadId
    name: str
    length: float
    junction: JunctionId | None
    rule: TrafficRule
    predecessor: RoadLink | None
    successor: RoadLink | None
    types: tuple[RoadType, ...]
    geometry: tuple[Geometry, ...]
    elevation: tuple[Cubic, ...]
    superelevation: tuple[Cubic, ...]
    lane_offset: tuple[Cubic, ...]
    sections: tuple[LaneSection, ...]
    objects: tuple[RoadObject, ...] = ()
    signals: tuple[Signal, ...] = ()
    signal_references: tuple[SignalReference, ...] = ()


class Connection(NamedTuple):
    """``<connection>`` of a junction; a direct junction's linked road is ``connecting_road``."""

    id: str
    incoming_road: RoadId
    connecting_road: RoadId
    contact_point: ContactPoint
    lane_links: tuple[tuple[int, int], ...]


class JunctionPriority(NamedTuple):
    """``<priority>``: road ``high`` has priority over road ``low``."""

    high: RoadId
    low: RoadId


@dataclass(frozen=True, slots=True)
class Junction:
    """One ``<junction>``; ``type`` ``default`` (common), ``direct``, ``virtual``, ``crossing``."""

    id: JunctionId
    name: str
    type: str
    connections: tuple[Connection, ...]
    priorities: tuple[JunctionPriority, ...] = ()
    controllers: tuple[str, ...] = ()
    main_road: RoadId | None = None


@dataclass(frozen=True, slots=True)
class Controller:
    """One ``<controller>``: the signals it controls, as ``(signal id, control type)``."""

    id: str
    name: str
    sequence: int | None
    controls: tuple[tuple[str, str], ...]


@dataclass(frozen=True, slots=True)
class Header:
    """``<header>``; ``geo_reference`` as given, ``crs`` its WKT if pyproj understands it."""

    rev_major: int
    rev_minor: int
    name: str
    north: float | None
    south: float | None
    east: float | None
    west: float | None
    geo_reference: str
    crs: str | None
    offset: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 0.0)


@dataclass(frozen=True, slots=True)
class OpenDrive:
    """A whole map. Dictionaries keep the order of the file.

    ``notes`` lists every tolerance that was used and every oddity met, one sentence each, with the
    element's path; they go into the conversion report.
    """

    header: Header
    roads: dict[RoadId, Road]
    junctions: dict[JunctionId, Junction]
    controllers: dict[str, Controller] = field(default_factory=dict)
    notes: tuple[str, ...] = ()

    @property
    def rule(self) -> Literal["RHT", "LHT", "mixed"]:
        """Side of the road that the map's traffic keeps to."""
        rules = {road.rule for road in self.roads.values()} or {"RHT"}
        return next(iter(rules)) if len(rules) == 1 else "mixed"


DRIVABLE_TYPES = frozenset(
    {"driving", "entry", "exit", "onRamp", "offRamp", "connectingRamp", "slipLane"}
    | {"bus", "taxi", "HOV", "mwyEntry", "mwyExit", "shared"}
)
"""Lane types (1.4 to 1.8) on whose lanes motor vehicles are placed and routed.

``shared`` is for all road users; a lane for cyclists and walkers is one by its access (1.8).
"""

WALKABLE_TYPES = frozenset({"sidewalk", "walking"})
"""Lane types on which pedestrians are placed and routed; ``walking`` is 1.8's name."""

CLOSED_TYPES = WALKABLE_TYPES | {"restricted", "biking"}
"""Lane types that are no motor vehicle's, unless the lane's access says so."""

_USES_BY_ACCESS: tuple[tuple[str, frozenset[str]], ...] = (
    ("biking", frozenset({"bicycle", "pedestrian"})),
    ("walking", frozenset({"pedestrian"})),
    ("taxi", frozenset({"taxi", "emergency"})),
    ("bus", frozenset({"bus", "taxi", "emergency"})),
    ("HOV", frozenset({"HOV", "bus", "taxi", "motorcycle", "emergency"})),
)
"""What a lane is that only these may use: the first of which it admits the namesake and no other.

Version 1.8 has no types ``bus``, ``taxi`` and ``HOV`` any more; its files say the same by access.
"""
_NAMESAKES = {"biking": "bicycle", "walking": "pedestrian"}
_VEHICLES = frozenset(
    {"passengerCar", "bus", "delivery", "emergency", "taxi", "truck", "trucks", "motorcycle", "HOV"}
)
"""Who drives, by the standard's names of road users."""
_USERS = tuple(sorted(_VEHICLES - {"truck", "trucks", "HOV"} | {"bicycle"}))
"""Road users whom a lane that is closed to all of them must deny; a name of trucks comes to it."""
_RAIL_TYPES = frozenset({"tram", "rail"})


def access_at(lane: Lane, s: float) -> tuple[LaneAccess, ...]:
    """Access records that hold at s of the road: all that begin where the last one began."""
    begun = [record for record in lane.access if record.s <= s + 1e-6]
    return tuple(record for record in begun if record.s == begun[-1].s)


def lane_use(lane: Lane) -> str:
    """What a lane is used as: its type, or what its access makes of a lane for driving.

    Only access that holds along the whole lane makes it another one. On a ``restricted`` lane no
    cars drive, but those do whom its access allows, as on a ``tram`` or ``rail`` lane beside the
    rail vehicles. A lane that denies every road user by name is ``restricted``.
    """
    if not lane.access or lane.type not in {"driving", "shared", "restricted", *_RAIL_TYPES}:
        return lane.type
    first = lane.access[0].s
    if any(record.s != first for record in lane.access):
        return lane.type
    if lane.widths and first > lane.widths[0].s + 1e-3:
        return lane.type
    denied = {record.restriction for record in lane.access if record.rule == "deny"}
    if lane.type not in _RAIL_TYPES and denied.issuperset(_USERS) and denied & {"truck", "trucks"}:
        return "restricted"
    if any(record.rule != "allow" for record in lane.access):
        return lane.type
    admitted = {record.restriction for record in lane.access}
    if lane.type in _RAIL_TYPES and not admitted & _VEHICLES:
        return lane.type
    for use, names in _USES_BY_ACCESS:
        if _NAMESAKES.get(use, use) in admitted and admitted <= names:
            return use
    if lane.type in {"restricted", *_RAIL_TYPES} and admitted & _VEHICLES:
        return "driving"
    return lane.type
