"""How far the body of a vehicle was beyond the lane that it drove in."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    import polars as pl

    from odscen.base.arrays import FloatArray

_NEAR = 15.0
"""Metres around the centre of a body in which its lanes are looked for."""


@dataclass(frozen=True, slots=True, eq=False)
class DrivenLanes:
    """Lanes of vehicles, those inside junctions included.

    Attributes
    ----------
    shapes
        Points of the centre line of each lane in driving direction, ``(K, 2)``, metres, in the
        OpenDRIVE frame.
    widths
        Metres.
    follows
        The lanes by which one drives on from a lane.
    """

    shapes: Mapping[str, FloatArray]
    widths: Mapping[str, float]
    follows: Mapping[str, Sequence[str]]


class LaneDeparture(NamedTuple):
    """``beyond``: metres from the border of the lane to the furthest corner of a body outside."""

    time: float
    beyond: float


def lane_departures(bodies: pl.DataFrame, lanes: DrivenLanes) -> list[LaneDeparture]:
    """How far a body was beyond its lane at each record; negative while it was inside.

    Its lane is the one that its centre was in, and stays so until the whole body is inside another
    or outside of it; a lane change is a departure as wide as the body. The lanes before and behind
    belong to it, and in a junction all that begin at the same lane. Records before the centre was
    in any lane are left out.

    Parameters
    ----------
    bodies
        ``time``, ``x``, ``y`` (m), ``hdg`` (rad), ``length`` and ``width`` (m), in order of time.
    """
    places = _LanePlaces(lanes)
    current: int | None = None
    departures = []
    columns = ("time", "x", "y", "hdg", "length", "width")
    for time, x, y, hdg, length, width in bodies.select(columns).iter_rows():
        corners = _find_corners(x, y, hdg, length, width)
        near = places.near(x, y)
        inside = places.inside(near, x, y, hdg)
        if current is None:
            if not inside:
                continue
            current = inside[0]
        beyond = places.beyond(places.family(current), corners)
        for lane in inside:
            if lane == current:
                break
            own = places.beyond(places.family(lane), corners)
            # Driving on, or a change of lanes that is over.
            if lane in places.family(current) or own.max() <= 0.0 or beyond.min() > 0.0:
                current, beyond = lane, own
                break
        departures.append(LaneDeparture(time, float(beyond.max())))
    return departures


def _find_corners(x: float, y: float, hdg: float, length: float, width: float) -> FloatArray:
    """Corners of a body, ``(4, 2)``."""
    ahead = np.array([math.cos(hdg), math.sin(hdg)]) * length / 2.0
    aside = np.array([-math.sin(hdg), math.cos(hdg)]) * width / 2.0
    centre = np.array([x, y])
    return np.array([centre + i * ahead + j * aside for i in (1, -1) for j in (1, -1)])


class _LanePlaces:
    """Lanes by their place."""

    def __init__(self, lanes: DrivenLanes) -> None:
        import shapely

        names = [
            name for name in lanes.widths if name in lanes.shapes and len(lanes.shapes[name]) > 1
        ]
        rows = {name: row for row, name in enumerate(names)}
        self._lines = np.array([shapely.linestrings(lanes.shapes[name]) for name in names])
        self._half = np.array([lanes.widths[name] / 2.0 for name in names])
        self._tree = shapely.STRtree(self._lines)
        after: list[set[int]] = [set() for _ in names]
        before: list[set[int]] = [set() for _ in names]
        for name, behind in lanes.follows.items():
            for other in behind:
                if name in rows and other in rows:
                    after[rows[name]].add(rows[other])
                    before[rows[other]].add(rows[name])
        self._families = [
            tuple(
                {
                    row,
                    *after[row],
                    *before[row],
                    *(k for other in before[row] for k in after[other]),
                }
            )
            for row in range(len(names))
        ]

    def near(self, x: float, y: float) -> list[int]:
        import shapely

        found = self._tree.query(shapely.points(x, y), predicate="dwithin", distance=_NEAR)
        return [int(row) for row in found]

    def inside(self, near: Sequence[int], x: float, y: float, hdg: float) -> list[int]:
        """Lanes that a point is in and whose direction it has, the one it is nearest to first."""
        import shapely

        point = shapely.points(x, y)
        chosen = []
        for row in near:
            line = self._lines[row]
            away = float(shapely.distance(line, point))
            if away > self._half[row]:
                continue
            along = float(shapely.line_locate_point(line, point))
            ends = shapely.line_interpolate_point(line, [max(0.0, along - 0.5), along + 0.5])
            (x0, y0), (x1, y1) = shapely.get_coordinates(ends)
            turn = math.remainder(math.atan2(y1 - y0, x1 - x0) - hdg, math.tau)
            if abs(turn) <= math.pi / 2.0:
                chosen.append((away, row))
        return [row for _, row in sorted(chosen)]

    def family(self, row: int) -> tuple[int, ...]:
        """A lane, those before and behind it, and those that begin where it does."""
        return self._families[row]

    def beyond(self, family: Sequence[int], corners: FloatArray) -> FloatArray:
        """Metres of each corner from the border of the nearest of some lanes, outside positive."""
        import shapely

        rows = list(family)
        away = shapely.distance(self._lines[rows][:, None], shapely.points(corners)[None, :])
        least: FloatArray = (away - self._half[rows][:, None]).min(axis=0)
        return least
