"""What is placed or painted on the roads: crosswalks, stop lines, signs, lights, parking spaces."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from odscen.base.arrays import FloatArray, offsets
from odscen.drawing.map_drawing import NO_LINES, Lines, MapDrawing, Symbol
from odscen.opendrive.objects import crosswalks, object_outline, signal_kind, stop_lines

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from odscen.opendrive.lanes import RoadTable
    from odscen.opendrive.road_model import OpenDrive, RoadObject, Signal


BAR, GAP = 0.5, 0.5
"""Metres painted and left out along the path across a crosswalk."""

_MOST_BARS = 200
"""Per crosswalk: one of hundreds of metres is a mistake in the map, not a reason to stall."""

_MOST_COPIES = 500
"""Repetitions drawn of one object."""

MPH = 0.44704


def add_furniture(drawing: MapDrawing, odr: OpenDrive, table: RoadTable) -> MapDrawing:
    """Add to ``drawing`` everything that is not a lane or its marking."""
    walks = crosswalks(odr, table)
    return replace(
        drawing,
        crosswalks=rings_of([walk.polygon for walk in walks]),
        bars=_zebra_bars([(walk.polygon, walk.axis) for walk in walks]),
        stop_lines=_join_strokes([line.ends for line in stop_lines(odr, table)]),
        parking_spaces=_object_outlines(odr, table, "parkingSpace"),
        buildings=_object_outlines(odr, table, "building"),
        symbols=symbols(odr, table),
    )


def rings_of(polygons: Sequence[NDArray[Any]]) -> Lines:
    """Rings from polygons of shape ``(K, 2)`` or more columns; repeated last points are dropped."""
    rings: list[FloatArray] = []
    for polygon in polygons:
        xy = np.asarray(polygon, dtype=np.float64)[:, :2]
        if len(xy) > 1 and np.allclose(xy[0], xy[-1], atol=1e-6):
            xy = xy[:-1]
        if len(xy) >= 3 and np.isfinite(xy).all():
            rings.append(xy if _signed_area(xy) >= 0 else xy[::-1])
    if not rings:
        return NO_LINES
    return Lines(np.concatenate(rings).round(2), offsets(np.array([len(r) for r in rings])))


def _signed_area(xy: FloatArray) -> float:
    x, y = xy.T
    return float(np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y) / 2.0)


def _join_strokes(ends: Sequence[FloatArray]) -> Lines:
    """Lines between two points each, from arrays of shape ``(2, 2)``."""
    if not ends:
        return NO_LINES
    xy = np.concatenate(ends).round(2)
    return Lines(xy, offsets(np.full(len(ends), 2)))


def _zebra_bars(walks: Sequence[tuple[FloatArray, FloatArray]]) -> Lines:
    """Bars of all zebra stripes: across the walker's path, cut to the crosswalk's outline."""
    import shapely

    boxes, owners = [], []
    for index, (polygon, axis) in enumerate(walks):
        along = (axis[1] - axis[0]) / max(float(np.hypot(*(axis[1] - axis[0]))), 1e-9)
        side = np.array([-along[1], along[0]]) * 60.0
        # The whole outline, not the axis: a slanted crosswalk reaches farther at one edge.
        reach = (polygon - axis[0]) @ along
        length = float(np.ptp(reach))
        n = int((length - BAR) // (BAR + GAP)) + 1
        first = float(reach.min()) + (length - (n * (BAR + GAP) - GAP)) / 2.0
        for k in range(min(n, _MOST_BARS)):
            low = axis[0] + along * (first + k * (BAR + GAP))
            high = low + along * BAR
            boxes.append([low - side, high - side, high + side, low + side])
            owners.append(index)
    if not boxes:
        return NO_LINES
    outlines = [shapely.make_valid(shapely.polygons(polygon[:, :2])) for polygon, _ in walks]
    cut = shapely.intersection(shapely.polygons(np.array(boxes)), np.array(outlines)[owners])
    parts = shapely.get_parts(cut)
    parts = parts[(shapely.get_type_id(parts) == 3) & (shapely.area(parts) > 0.02)]
    return rings_of([shapely.get_coordinates(shapely.get_exterior_ring(part)) for part in parts])


def _object_outlines(odr: OpenDrive, table: RoadTable, kind: str) -> Lines:
    return rings_of(
        [
            outline
            for name, road in odr.roads.items()
            for item in road.objects
            if item.type == kind
            for copy in _repeat_object(item)
            for outline in object_outline(table, name, copy)
        ]
    )


def _repeat_object(item: RoadObject) -> list[RoadObject]:
    """Give the object itself, or its repetitions along the road (section 13.3.1)."""
    copies = []
    for repeat in item.repeats:
        n = int(np.ceil(repeat.length / repeat.distance)) if repeat.distance > 0.0 else 1
        for k in range(min(max(n, 1), _MOST_COPIES)):
            share = k * repeat.distance / repeat.length if repeat.length > 0.0 else 0.0
            t = repeat.t_start + share * (repeat.t_end - repeat.t_start)
            copies.append(_move_object(item, repeat.s + k * repeat.distance, t))
    return copies or [item]


def _move_object(item: RoadObject, s: float, t: float) -> RoadObject:
    """Copy of an object at another place; corners in road coordinates move with it."""
    outlines = tuple(
        outline._replace(
            corners=tuple(
                corner
                if corner.local
                else corner._replace(a=corner.a + s - item.s, b=corner.b + t - item.t)
                for corner in outline.corners
            )
        )
        for outline in item.outlines
    )
    return replace(item, s=s, t=t, outlines=outlines)


def symbols(odr: OpenDrive, table: RoadTable) -> tuple[Symbol, ...]:
    """Signs and lights of known kinds with their places, sorted."""
    found = [
        (table.road_index[name], signal, kind)
        for name, road in odr.roads.items()
        for signal in road.signals
        for kind in [signal_kind(signal)]
        if kind != "other"
    ]
    if not found:
        return ()
    road = np.array([index for index, _, _ in found], dtype=np.int64)
    s, t = np.array([(signal.s, signal.t) for _, signal, _ in found]).T
    x, y, _z = table.points(road, s, t)
    hdg = table.reference(road, s).hdg
    drawn = []
    for k, (_, signal, kind) in enumerate(found):
        # A sign for traffic along +s faces against it.
        turned = np.pi if signal.orientation == "+" else 0.0
        facing = float(np.angle(np.exp(1j * (hdg[k] + turned + signal.h_offset))))
        drawn.append(
            Symbol(
                kind,
                round(float(x[k]), 2),
                round(float(y[k]), 2),
                round(facing, 4),
                _speed_text(signal) if kind == "speed_limit" else "",
            )
        )
    return tuple(sorted(set(drawn)))


def _speed_text(signal: Signal) -> str:
    if signal.value is None or not np.isfinite(signal.value):
        return ""
    unit = MPH if signal.unit == "mph" else 1.0 / 3.6
    return str(round(signal.value / unit))
