"""Who may use a lane, and how fast: SUMO's vehicle classes and default speeds by lane type."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from odscen.opendrive.road_model import DRIVABLE_TYPES, WALKABLE_TYPES, access_at, lane_use

if TYPE_CHECKING:
    from odscen.opendrive.road_model import Lane, LaneAccess

BICYCLE_TYPES = frozenset({"biking"})

TRACK_TYPES = {
    "tram": frozenset({"tram"}),
    "rail": frozenset({"rail", "rail_electric", "rail_fast", "rail_urban"}),
}
"""Classes on lanes for rail vehicles: no road user of a scenario, but some of a SUMO project."""

PEDESTRIAN = frozenset({"pedestrian"})
BICYCLE = frozenset({"bicycle"})

_MOTOR = frozenset(
    {"private", "emergency", "authority", "army", "vip", "passenger", "hov", "taxi", "bus", "coach"}
    | {"delivery", "truck", "trailer", "motorcycle", "evehicle", "custom1", "custom2"}
)
_SLOW = frozenset({"bicycle", "moped"})
_RAMP_TYPES = frozenset({"onRamp", "offRamp", "connectingRamp", "mwyEntry", "mwyExit"})
_RESERVED = {
    "bus": frozenset({"bus", "coach", "emergency", "authority"}),
    "taxi": frozenset({"taxi", "emergency", "authority"}),
    "HOV": frozenset({"hov", "bus", "coach", "motorcycle", "emergency", "authority"}),
}

DEFAULT_SPEED = 50.0 / 3.6
"""m/s, where neither lane nor road says anything."""

NO_LIMIT = 130.0 / 3.6
"""m/s for "no limit": the advisory speed of German motorways."""

WALKING_SPEED = 2.78
"""m/s, SUMO's own limit for sidewalks."""

CYCLING_SPEED = 25.0 / 3.6

_ROAD_SPEEDS = {
    "motorway": NO_LIMIT,
    "rural": 100.0 / 3.6,
    "town": DEFAULT_SPEED,
    "townArterial": 70.0 / 3.6,
    "townPrivate": 30.0 / 3.6,
    "lowSpeed": 30.0 / 3.6,
    "pedestrian": 10.0 / 3.6,
    "bicycle": CYCLING_SPEED,
}


def allowed(lane_type: str) -> frozenset[str]:
    """Vehicle classes on a lane; empty for lanes that no vehicle drives on.

    Walkable lanes are not asked for here: persons have edges of their own.
    """
    if lane_type in BICYCLE_TYPES:
        return BICYCLE
    if lane_type in TRACK_TYPES:
        return TRACK_TYPES[lane_type]
    if lane_type in _RESERVED:
        return _RESERVED[lane_type]
    if lane_type in DRIVABLE_TYPES:
        return _MOTOR if lane_type in _RAMP_TYPES else _MOTOR | _SLOW
    return frozenset()


_BY_RESTRICTION = {
    "passengercar": frozenset({"private", "passenger", "evehicle", "hov", "vip"}),
    "bus": frozenset({"bus", "coach"}),
    "delivery": frozenset({"delivery"}),
    "emergency": frozenset({"emergency", "authority"}),
    "taxi": frozenset({"taxi"}),
    "truck": frozenset({"truck", "trailer"}),
    "trucks": frozenset({"truck", "trailer"}),
    "bicycle": frozenset({"bicycle"}),
    "motorcycle": frozenset({"motorcycle", "moped"}),
    "hov": frozenset({"hov"}),
    "pedestrian": PEDESTRIAN,
}
"""SUMO's classes by the standard's names of road users (``e_accessRestrictionType``), lower case.

``simulator``, ``autonomousTraffic`` and ``throughTraffic`` tell vehicles of one class apart by who
drives them and where to, which no lane of SUMO does.
"""
_UNNAMED = frozenset({"army", "custom1", "custom2"})
"""Classes that no name of the standard stands for."""
_RIGHT_OF_WAY = frozenset({"emergency", "authority"})
"""Who may use every lane for vehicles that is reserved for some."""


def has_class(access: LaneAccess) -> bool:
    """Whether SUMO can have an access record: it has a rule and names a class, or nobody."""
    name = access.restriction.lower()
    return access.rule in ("allow", "deny") and (name in _BY_RESTRICTION or name == "none")


def vehicle_classes(lane: Lane, s: float) -> frozenset[str]:
    """Vehicle classes on a lane at s of its road, by its type and by ``<access>``.

    Of the records that hold there those that allow name all who may use the lane, and those that
    deny take classes from them: all, where every class that has a name is denied. ``none``
    restricts nobody. On a lane whose type is reserved, or for rail vehicles, those whom access
    allows are added.
    """
    kind = lane_use(lane)
    base = allowed(kind)
    if not lane.access or not base:
        return base
    records = [
        record
        for record in access_at(lane, s)
        if has_class(record) and record.restriction != "none"
    ]
    granted = [
        _BY_RESTRICTION[record.restriction.lower()] for record in records if record.rule == "allow"
    ]
    denied = [
        _BY_RESTRICTION[record.restriction.lower()] for record in records if record.rule == "deny"
    ]
    classes = base
    if granted:
        named = frozenset[str]().union(*granted) - PEDESTRIAN
        if kind in TRACK_TYPES:
            classes = base
        elif kind in _RESERVED or kind in BICYCLE_TYPES:
            classes = base | named
        elif named and named != BICYCLE:
            classes = named | _RIGHT_OF_WAY
        else:
            classes = named
    left = classes - frozenset[str]().union(*denied)
    # A lane that is closed to each road user by name is closed.
    if left <= _UNNAMED:
        return frozenset()
    return left | TRACK_TYPES[lane.type] if lane.type in TRACK_TYPES else left


def is_used(lane_type: str) -> bool:
    """Whether lanes of a type become part of the network."""
    return lane_type in DRIVABLE_TYPES | WALKABLE_TYPES | BICYCLE_TYPES | TRACK_TYPES.keys()


def speed(limit: float, lane_type: str, road_type: str) -> float:
    """Speed of a lane in m/s from its limit: infinite for "no limit", NaN for not given."""
    if lane_type in BICYCLE_TYPES:
        return CYCLING_SPEED
    if math.isinf(limit):
        return NO_LIMIT
    if math.isnan(limit) or limit <= 0.0:
        return _ROAD_SPEEDS.get(road_type, DEFAULT_SPEED)
    return limit
