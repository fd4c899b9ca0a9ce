"""Objects and signals with a meaning for traffic: crosswalks, stop lines, kinds of signals."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, Literal

import numpy as np

from odscen.opendrive.sign_catalogue import OWN_NUMBERS, country_of, sign_meaning

if TYPE_CHECKING:
    from collections.abc import Iterator

    from odscen.base.arrays import FloatArray
    from odscen.base.ids import RoadId
    from odscen.opendrive.lanes import RoadTable
    from odscen.opendrive.road_model import OpenDrive, Outline, RoadObject, Signal, Validity

SignalKind = Literal["traffic_light", "pedestrian_light", "stop", "yield", "speed_limit", "other"]

_CIRCLE_CORNERS = 16

LINE_WIDTH = 3.0
"""Metres of a crosswalk that is drawn as a mere line: about what zebra crossings have at least."""


@dataclass(frozen=True, slots=True, eq=False)
class Crosswalk:
    """A crosswalk on the ground, OpenDRIVE frame, metres.

    Attributes
    ----------
    road, object_id
        Where it is in the file; ``object_id`` is unique within the road only.
    polygon
        Corners, shape ``(K, 2)``, not closed, counter-clockwise.
    z
        Mean height of the corners.
    axis
        Shape ``(2, 2)``: where a walker steps on and off, along the middle of the crosswalk.
    width
        Extent across ``axis``.
    """

    road: RoadId
    object_id: str
    polygon: FloatArray
    z: float
    axis: FloatArray
    width: float


@dataclass(frozen=True, slots=True, eq=False)
class StopLine:
    """A stop line: ``ends`` has shape ``(2, 2)``, OpenDRIVE frame, metres."""

    road: RoadId
    object_id: str
    s: float
    orientation: str
    validities: tuple[Validity, ...]
    ends: FloatArray
    z: float


def is_crosswalk(obj: RoadObject) -> bool:
    """Whether an object is a crosswalk, by type, subtype or name."""
    return any(
        word in text.lower().replace(" ", "")
        for text in (obj.type, obj.subtype, obj.name)
        for word in ("crosswalk", "zebra", "pedestriancrossing")
    )


def is_stop_line(obj: RoadObject) -> bool:
    """Whether an object is a stop line, by type, subtype or name."""
    return any(
        "stopline" in re.sub(r"[ _-]", "", text.lower())
        for text in (obj.type, obj.subtype, obj.name)
    )


def object_outline(table: RoadTable, road: RoadId, obj: RoadObject) -> tuple[FloatArray, ...]:
    """Outlines of an object, shape ``(K, 3)`` each, inertial coordinates, not closed.

    An object without outlines has its box of length and width, or the circle of its radius; one
    without any size has none. ``pitch`` and ``roll`` of the object are not applied.
    """
    row = table.road_index[road]
    outlines = [outline for outline in obj.outlines if len(outline.corners) >= 2]
    if outlines:
        return tuple(_outline_corners(table, row, obj, outline) for outline in outlines)
    if obj.length and obj.width:
        u, v = 0.5 * obj.length, 0.5 * obj.width
        local = np.array([[u, v, 0.0], [-u, v, 0.0], [-u, -v, 0.0], [u, -v, 0.0]])
    elif obj.radius:
        angle = np.linspace(0.0, 2.0 * np.pi, _CIRCLE_CORNERS, endpoint=False)
        local = obj.radius * np.stack([np.cos(angle), np.sin(angle), 0.0 * angle], axis=1)
    else:
        return ()
    return (_local_to_inertial(table, row, obj, local),)


def _outline_corners(table: RoadTable, road: int, obj: RoadObject, outline: Outline) -> FloatArray:
    values = np.array([(c.a, c.b, c.z) for c in outline.corners], dtype=np.float64)
    is_local = np.array([c.local for c in outline.corners])
    points = np.empty_like(values)
    points[is_local] = _local_to_inertial(table, road, obj, values[is_local])
    s, t, z = values[~is_local].T
    points[~is_local] = np.stack(table.points(np.full(s.shape, road), s, t, z), axis=1)
    # Files of the 1.4 age repeat the first corner at the end.
    closed = len(points) > 2 and np.allclose(points[0], points[-1], rtol=0.0, atol=1e-6)
    return points[:-1].copy() if closed else points


def _local_to_inertial(
    table: RoadTable, road: int, obj: RoadObject, local: FloatArray
) -> FloatArray:
    """Inertial points of the object's (u, v, z): its place on the road, turned by its heading."""
    row, s, t = np.array([road]), np.array([obj.s]), np.array([obj.t])
    line = table.reference(row, s)
    origin = np.concatenate(table.points(row, s, t, obj.z_offset))
    hdg, pitch, roll = line.hdg[0], line.pitch[0], line.roll[0]
    ahead = np.array([np.cos(hdg) * np.cos(pitch), np.sin(hdg) * np.cos(pitch), np.sin(pitch)])
    level = np.array([-np.sin(hdg), np.cos(hdg), 0.0])
    left = np.cos(roll) * level + np.sin(roll) * np.cross(ahead, level)
    up = np.cross(ahead, left)
    cos, sin = np.cos(obj.hdg), np.sin(obj.hdg)
    u, v, z = local.T
    e_s, e_t = u * cos - v * sin, u * sin + v * cos
    return origin + np.outer(e_s, ahead) + np.outer(e_t, left) + np.outer(z, up)


def crosswalks(odr: OpenDrive, table: RoadTable) -> tuple[Crosswalk, ...]:
    """All crosswalks, in the order of the file; objects without a size are left out."""
    found = (
        _make_crosswalk(table, road, obj, outline)
        for road, obj in _iterate_objects(odr)
        if is_crosswalk(obj)
        for outline in object_outline(table, road, obj)[:1]
    )
    return tuple(crosswalk for crosswalk in found if crosswalk is not None)


def _iterate_objects(odr: OpenDrive) -> Iterator[tuple[RoadId, RoadObject]]:
    return ((road.id, obj) for road in odr.roads.values() for obj in road.objects)


def _make_crosswalk(
    table: RoadTable, road: RoadId, obj: RoadObject, outline: FloatArray
) -> Crosswalk | None:
    polygon = outline[:, :2]
    if len(polygon) < 3 or abs(_signed_area(polygon)) < 0.01:
        polygon = _widen_line(polygon)
    if len(polygon) < 3:
        return None
    area = _signed_area(polygon)
    if area < 0.0:
        polygon = polygon[::-1]
    line = table.reference(np.array([table.road_index[road]]), np.array([obj.s]))
    normal = np.array([-np.sin(line.hdg[0]), np.cos(line.hdg[0])])
    along = _crossing_direction(polygon, normal)
    across = np.array([-along[1], along[0]])
    return Crosswalk(
        road=road,
        object_id=obj.id,
        polygon=polygon.copy(),
        z=float(outline[:, 2].mean()),
        axis=_middle_chord(polygon, along),
        width=float(np.ptp(polygon @ across)),
    )


def _widen_line(line: FloatArray) -> FloatArray:
    """Rectangle of :data:`LINE_WIDTH` around a line across the road; nothing around a point."""
    gaps = np.linalg.norm(line[:, None] - line[None], axis=2)
    start, end = np.unravel_index(np.argmax(gaps), gaps.shape)
    if gaps[start, end] < 1.0:
        return np.empty((0, 2))
    ahead = (line[end] - line[start]) / gaps[start, end]
    side = np.array([-ahead[1], ahead[0]]) * (LINE_WIDTH / 2.0)
    return np.array([line[start] - side, line[end] - side, line[end] + side, line[start] + side])


def _signed_area(polygon: FloatArray) -> float:
    x, y = polygon.T
    x, y = x - x.mean(), y - y.mean()
    return 0.5 * float(np.sum(x * np.roll(y, -1) - y * np.roll(x, -1)))


def _crossing_direction(polygon: FloatArray, normal: FloatArray) -> FloatArray:
    """Direction in which a walker crosses: a side of the smallest rectangle around the crosswalk.

    Of its two sides that one which leads farther across the road: crosswalks are mostly longer than
    wide and mostly square to their road; the product decides when only one of both holds.
    """
    edges = np.roll(polygon, -1, axis=0) - polygon
    lengths = np.hypot(*edges.T)
    directions = edges[lengths > 1e-6] / lengths[lengths > 1e-6, None]
    sideways = np.stack([-directions[:, 1], directions[:, 0]], axis=1)
    along, across = np.ptp(polygon @ directions.T, axis=0), np.ptp(polygon @ sideways.T, axis=0)
    best = int(np.argmin(np.round(along * across, 9)))
    sides = ((directions[best], along[best]), (sideways[best], across[best]))
    side: FloatArray = max(sides, key=lambda item: abs(float(item[0] @ normal)) * item[1])[0]
    return side if float(side @ normal) >= 0.0 else -side


def _middle_chord(polygon: FloatArray, along: FloatArray) -> FloatArray:
    """Where the line through the middle of the polygon enters and leaves it; shape ``(2, 2)``."""
    across = np.array([-along[1], along[0]])
    u, v = polygon @ along, polygon @ across
    middle = 0.5 * (v.min() + v.max())
    at = u
    if np.ptp(v) > 1e-6:  # else it is a line drawn there and back
        u1, v1 = np.roll(u, -1), np.roll(v, -1)
        crossing = (np.minimum(v, v1) <= middle) & (np.maximum(v, v1) >= middle) & (v != v1)
        share = (middle - v[crossing]) / (v1 - v)[crossing]
        at = u[crossing] + share * (u1 - u)[crossing]
    ends: FloatArray = np.outer([at.min(), at.max()], along) + middle * across
    return ends


def stop_lines(odr: OpenDrive, table: RoadTable) -> tuple[StopLine, ...]:
    """All stop lines, in the order of the file; objects without any length are left out."""
    found = (
        _stop_line(table, road, obj) for road, obj in _iterate_objects(odr) if is_stop_line(obj)
    )
    return tuple(line for line in found if line is not None)


def _stop_line(table: RoadTable, road: RoadId, obj: RoadObject) -> StopLine | None:
    outlines = object_outline(table, road, obj)
    if outlines:
        points = outlines[0]
    elif obj.length or obj.width:
        # A line without thickness: its length lies along u, its width along v.
        u, v = 0.5 * (obj.length or 0.0), 0.0 if obj.length else 0.5 * (obj.width or 0.0)
        local = np.array([[-u, -v, 0.0], [u, v, 0.0]])
        points = _local_to_inertial(table, table.road_index[road], obj, local)
    else:
        return None
    if len(points) > 2:
        ends = _middle_chord(points[:, :2], _long_side(points[:, :2]))
    else:
        ends = points[:, :2].copy()
    z = float(points[:, 2].mean())
    return StopLine(road, obj.id, obj.s, obj.orientation, obj.validities, ends, z)


def _long_side(polygon: FloatArray) -> FloatArray:
    centred = polygon - polygon.mean(axis=0)
    side: FloatArray = np.linalg.svd(centred, full_matrices=False)[2][0]
    return side


# Codes that files write whatever country they name: of the StVO (the choice of the standard and of
# CARLA), and of Sweden for speed limits.
_ANYWHERE: Final[dict[str, SignalKind]] = {
    "206": "stop",
    "r1-1": "stop",
    "205": "yield",
    "r1-2": "yield",
    "274": "speed_limit",
    "274.1": "speed_limit",
    "r2-1": "speed_limit",
    "c31": "speed_limit",
}
_KIND_OF_MEANING: Final[dict[str, SignalKind]] = {
    "traffic_light": "traffic_light",
    "pedestrian_light": "pedestrian_light",
    "stop": "stop",
    "yield": "yield",
    "speed_limit": "speed_limit",
}
_NAMES: Final[tuple[tuple[str, SignalKind], ...]] = (
    (r"pedestrian.*(light|signal)|(light|signal).*pedestrian", "pedestrian_light"),
    (r"traffic.?light|\dlight", "traffic_light"),
    (r"stop", "stop"),
    (r"yield|give.?way", "yield"),
    (r"speed|(^|\D)274(\D|$)", "speed_limit"),
)


# Types in words, as converters from OpenStreetMap and some editors write them; letters only.
_WORDS: Final[tuple[tuple[str, SignalKind], ...]] = (
    (r"(pedestrian|walk|crossing)(traffic)?(light|signal)s?", "pedestrian_light"),
    (r"traffic(light|signal)s?", "traffic_light"),
    (r"(allway)?stop(sign)?", "stop"),
    (r"(yield|giveway)(sign)?", "yield"),
    (r"(max)?speed(limit)?(sign)?", "speed_limit"),
)


def signal_kind(signal: Signal) -> SignalKind:
    """What a signal means for traffic: by its type, or by its name where there is no type.

    A type is a number of the catalogue of its country
    (:mod:`odscen.opendrive.sign_catalogue`), or a word: ``traffic_light``, ``give_way``, ``stop``.
    """
    meaning = sign_meaning(signal)
    if meaning is not None:
        return _KIND_OF_MEANING.get(meaning, "other")
    code = signal.type.lower()
    if code.startswith("1.000."):  # as the tables of 1.4 print them
        code = code.replace(".", "")
    kind = _ANYWHERE.get(code) or _ANYWHERE.get(f"{code}{signal.subtype.lower()}")
    if kind is not None and country_of(signal) not in OWN_NUMBERS:
        return kind
    if signal.dynamic and code.startswith("10000"):
        return "traffic_light"
    if code in {"", "-1", "none"}:
        name = signal.name.lower()
        return next((kind for pattern, kind in _NAMES if re.search(pattern, name)), "other")
    word = re.sub(r"[^a-z]", "", code)
    return next((kind for pattern, kind in _WORDS if re.fullmatch(pattern, word)), "other")
