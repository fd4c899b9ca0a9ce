"""Parking places of a map, grouped to areas along the lanes that they are reached from.

A place is a ``<object type="parkingSpace">``, or a stretch of a lane of type ``parking``. Which way
cars stand in it follows from its shape: along the longer side of an object, along the road on a
narrow parking lane and across it on a wide one.
"""

from __future__ import annotations

import math
from itertools import groupby
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    import shapely

    from odscen.base.arrays import BoolArray, FloatArray, Int32Array
    from odscen.lanegraph.graphs import LaneGraph

REACH = 3.0
"""Metres between the edge of a lane and a place that is reached from it, at most."""

LEAST_LENGTH, LEAST_WIDTH = 4.0, 1.8
"""Metres of a place at least: smaller ones are for bicycles, or mistakes."""

MOST_WIDTH = 8.0
"""Metres: what is wider is no row of places, and says nothing of how cars stand in it."""

ALONG_LENGTH, ACROSS_WIDTH = 6.0, 2.5
"""Metres that a car takes of a row in which cars stand one behind, or one beside, the other."""

ACROSS_FROM = 4.0
"""Metres of width of a row from which cars stand across it."""

ROW_FROM = 11.0
"""Metres of length from which an object is a row of places."""

AREA_LENGTH, AREA_GAP = 100.0, 12.0
"""Metres along the lane of an area, and between its places, at most."""

_CLOSED_TO_CARS = frozenset({"bus", "taxi", "HOV"})


class ParkingPlace(NamedTuple):
    """Where a car stands: middle (m), direction of its front (rad, counter-clockwise), size (m)."""

    x: float
    y: float
    hdg: float
    length: float
    width: float


class ParkingArea(NamedTuple):
    """Places along a lane.

    Attributes
    ----------
    id
        ``P1`` and so on, in the order of the lanes of the map.
    nodes
        Of the lane graph: beside each place, ascending.
    places
        In the order of their nodes.
    """

    id: str
    nodes: tuple[int, ...]
    places: tuple[ParkingPlace, ...]

    @property
    def node(self) -> int:
        """Node in the middle of the area."""
        return self.nodes[len(self.nodes) // 2]


class MapParking(NamedTuple):
    """Parking of a map; ``unreached`` places have no lane of cars beside them, or no usual size."""

    areas: tuple[ParkingArea, ...] = ()
    unreached: int = 0


NO_PARKING = MapParking()


class _ReachedPlace(NamedTuple):
    """A place with the node beside it, and whether it is to the left of the lane."""

    node: int
    left: bool
    place: ParkingPlace


def map_parking(
    lanes: LaneGraph, *, spaces: Sequence[FloatArray], strips: Sequence[FloatArray]
) -> MapParking:
    """Find the parking areas of a map.

    Parameters
    ----------
    lanes
        The lane graph.
    spaces
        Outlines of parking spaces, shape ``(K, 2)`` each, metres.
    strips
        Outlines of parking lanes, one for each lane of a lane section.
    """
    if not spaces and not strips:
        return NO_PARKING
    beside = _LaneFinder(lanes)
    reached: list[_ReachedPlace] = []
    unreached = 0
    for outline in spaces:
        places = list(_places_of(outline))
        parkings = [parking for place in places if (parking := beside.lane_of(place)) is not None]
        reached += parkings
        unreached += max(len(places), 1) - len(parkings)
    for outline in strips:
        cut = list(beside.cut(outline))
        reached += cut
        unreached += not cut
    return MapParking(tuple(_group_places(lanes, reached)), unreached)


def _places_of(outline: FloatArray) -> Iterator[ParkingPlace]:
    """Yield the place, or the row of places, that an outline is; nothing if it is neither."""
    import shapely

    sides = np.roll(outline, -1, axis=0) - outline
    longest = sides[int(np.argmax(np.hypot(*sides.T)))]
    hdg = math.atan2(longest[1], longest[0])
    along = np.array([math.cos(hdg), math.sin(hdg)])
    across = np.array([-along[1], along[0]])
    width = float(np.ptp(outline @ across))
    polygon = shapely.make_valid(shapely.polygons(outline))
    length = float(polygon.area) / max(width, 1e-9)
    middle = np.array([polygon.centroid.x, polygon.centroid.y])
    if not (length >= LEAST_LENGTH and LEAST_WIDTH <= width <= MOST_WIDTH):
        return
    if length < ROW_FROM:
        yield ParkingPlace(float(middle[0]), float(middle[1]), hdg, length, width)
        return
    stands = width >= ACROSS_FROM
    pitch = ACROSS_WIDTH if stands else ALONG_LENGTH
    count = int(length / pitch + 1e-6)
    for number in range(count):
        x, y = (middle + along * (number + 0.5 - count / 2.0) * pitch).tolist()
        if stands:
            yield ParkingPlace(x, y, hdg + math.pi / 2.0, width, pitch)
        else:
            yield ParkingPlace(x, y, hdg, pitch, width)


class _LaneFinder:
    """Finds the lanes beside places."""

    def __init__(self, lanes: LaneGraph) -> None:
        from scipy.spatial import cKDTree

        self._lanes = lanes
        own = lanes.lanes
        rows = [
            junction is None and kind not in _CLOSED_TO_CARS
            for junction, kind in zip(own.junctions, own.types, strict=True)
        ]
        self._nodes = np.flatnonzero(np.array(rows, dtype=np.bool_)[lanes.lane])
        self._xy = np.stack([lanes.x, lanes.y], axis=1)
        self._tree = cKDTree(self._xy[self._nodes]) if len(self._nodes) else None

    def lane_of(self, place: ParkingPlace) -> _ReachedPlace | None:
        """Nearest lane within reach, one that the place is not on if there is such a lane."""
        if self._tree is None:
            return None
        lanes = self._lanes
        near = self._tree.query_ball_point((place.x, place.y), place.length + MOST_WIDTH + REACH)
        nodes = self._nodes[np.array(sorted(near), dtype=np.intp)]
        hdg = lanes.hdg[nodes]
        dx, dy = place.x - lanes.x[nodes], place.y - lanes.y[nodes]
        along, across = dx * np.cos(hdg) + dy * np.sin(hdg), dy * np.cos(hdg) - dx * np.sin(hdg)
        turned = place.hdg - hdg
        half = np.abs(np.sin(turned)) * place.length + np.abs(np.cos(turned)) * place.width
        gap = np.abs(across) - half / 2.0 - lanes.width[nodes] / 2.0
        good = (np.abs(along) <= lanes.spacing) & (gap <= REACH)
        if not good.any():
            return None
        on_it = np.abs(across) <= lanes.width[nodes] / 2.0
        order = np.lexsort((np.abs(along), np.round(np.abs(across), 2), on_it, ~good))
        best = int(order[0])
        return self._turn_to_entry(int(nodes[best]), place, bool(across[best] > 0.0))

    def _turn_to_entry(self, node: int, place: ParkingPlace, left: bool) -> _ReachedPlace:
        """Turn a place so that cars enter it forwards."""
        hdg = float(self._lanes.hdg[node])
        inwards = hdg + (math.pi / 2.0 if left else -math.pi / 2.0)
        aside = math.cos(place.hdg - inwards)
        forwards = aside if abs(aside) > 0.3 else math.cos(place.hdg - hdg)
        turned = place.hdg if forwards >= 0.0 else place.hdg + math.pi
        return _ReachedPlace(node, left, place._replace(hdg=math.remainder(turned, 2.0 * math.pi)))

    def cut(self, outline: FloatArray) -> Iterator[_ReachedPlace]:
        """Yield the places on a parking lane, along the nearest lane beside it."""
        import shapely

        polygon = shapely.make_valid(shapely.polygons(outline))
        hits = self._nodes_hitting(outline, polygon)
        if hits is None:
            return
        nodes, left, near, far = hits
        rows = self._lanes.lane[nodes] * 2 + left
        best = min(np.unique(rows).tolist(), key=lambda row: float(np.median(near[rows == row])))
        mine = rows == best
        yield from self._row_places(nodes[mine], bool(best % 2), near[mine], far[mine])

    def _nodes_hitting(
        self, outline: FloatArray, polygon: shapely.Geometry
    ) -> tuple[Int32Array, BoolArray, FloatArray, FloatArray] | None:
        """Nodes from which a line to the side meets the lane: side, and where it begins and ends.

        All shape ``(n,)``; metres from the centre of the node's lane.
        """
        import shapely

        low, high = outline.min(axis=0) - 12.0, outline.max(axis=0) + 12.0
        xy = self._xy[self._nodes]
        nodes = self._nodes[np.all((xy >= low) & (xy <= high), axis=1)]
        nodes = np.repeat(nodes, 2)
        left = np.arange(len(nodes)) % 2 == 1
        hdg = self._lanes.hdg[nodes] + np.where(left, math.pi / 2.0, -math.pi / 2.0)
        side = np.stack([np.cos(hdg), np.sin(hdg)], axis=1)
        reach = self._lanes.width[nodes] / 2.0 + REACH
        start = self._xy[nodes]
        end = start + side * (reach + MOST_WIDTH)[:, None]
        lines = shapely.linestrings(np.stack([start, end], axis=1))
        cut = shapely.intersection(lines, polygon)
        some = ~shapely.is_empty(cut)
        if not some.any():
            return None
        box = shapely.bounds(cut[some])
        corners = np.stack([box[:, [0, 1]], box[:, [2, 3]], box[:, [0, 3]], box[:, [2, 1]]], axis=1)
        away = np.einsum("nkc,nc->nk", corners - start[some][:, None], side[some])
        near, far = away.min(axis=1), away.max(axis=1)
        good = (near <= reach[some]) & (far - near >= LEAST_WIDTH)
        if not good.any():
            return None
        kept = np.flatnonzero(some)[good]
        return nodes[kept].astype(np.int32), left[kept], near[good], far[good]

    def _row_places(
        self, nodes: Int32Array, left: bool, near: FloatArray, far: FloatArray
    ) -> Iterator[_ReachedPlace]:
        """Places of stretches of consecutive nodes."""
        order = np.argsort(nodes)
        nodes, near, far = nodes[order], near[order], far[order]
        spacing = self._lanes.spacing
        for _, group in groupby(range(len(nodes)), key=lambda at: int(nodes[at]) - at):
            run = list(group)
            width = float(np.median(far[run] - near[run]))
            across = width >= ACROSS_FROM
            pitch = ACROSS_WIDTH if across else ALONG_LENGTH
            count = int(len(run) * spacing / pitch)
            for number in range(count):
                at = run[min(int((number + 0.5) * pitch / spacing), len(run) - 1)]
                ahead = ((number + 0.5) * pitch / spacing - 0.5 - (at - run[0])) * spacing
                middle = float(near[at] + far[at]) / 2.0
                yield self._place_beside(int(nodes[at]), left, ahead, middle, across, width, pitch)

    def _place_beside(
        self, node: int, left: bool, ahead: float, aside: float, across: bool, width: float,
        pitch: float,
    ) -> _ReachedPlace:  # fmt: skip
        hdg = float(self._lanes.hdg[node])
        turn = hdg + (math.pi / 2.0 if left else -math.pi / 2.0)
        x = float(self._lanes.x[node]) + ahead * math.cos(hdg) + aside * math.cos(turn)
        y = float(self._lanes.y[node]) + ahead * math.sin(hdg) + aside * math.sin(turn)
        place = ParkingPlace(x, y, turn, width, pitch)
        if not across:
            place = ParkingPlace(x, y, hdg, pitch, width)
        return _ReachedPlace(node, left, place._replace(hdg=math.remainder(place.hdg, 2 * math.pi)))


def _group_places(lanes: LaneGraph, reached: Sequence[_ReachedPlace]) -> Iterator[ParkingArea]:
    """Yield areas of places on the same lane and side, near each other."""
    ordered = sorted(
        reached,
        key=lambda reached: (
            int(lanes.lane[reached.node]),
            reached.left,
            reached.node,
            reached.place,
        ),
    )
    group: list[_ReachedPlace] = []
    number = 0
    for reached_place in ordered:
        if group and not _belong_together(lanes, group, reached_place):
            number += 1
            yield _make_area(number, group)
            group = []
        group.append(reached_place)
    if group:
        yield _make_area(number + 1, group)


def _belong_together(
    lanes: LaneGraph, group: Sequence[_ReachedPlace], reached: _ReachedPlace
) -> bool:
    first, last = group[0], group[-1]
    if lanes.lane[first.node] != lanes.lane[reached.node] or first.left != reached.left:
        return False
    offset = lanes.offset
    gap, length = (
        offset[reached.node] - offset[last.node],
        offset[reached.node] - offset[first.node],
    )
    return bool(gap <= AREA_GAP and length <= AREA_LENGTH)


def _make_area(number: int, group: Sequence[_ReachedPlace]) -> ParkingArea:
    nodes, places = (tuple(getattr(reached, key) for reached in group) for key in ("node", "place"))
    return ParkingArea(f"P{number}", nodes, places)
