"""A map that is being mended: places are found on it, and its roads and junctions replaced."""

from __future__ import annotations

import math
from copy import copy
from dataclasses import replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

import numpy as np

from odscen.base.ids import RoadId
from odscen.maps.importers.osm.road_plan import ease, write_geometry
from odscen.maps.importers.osm.scenery import hermite
from odscen.maps.importers.osm.street_line import Pose, curve_between
from odscen.maps.joined_junctions import LONGEST, find_roads_between, join_junctions
from odscen.maps.reshaped_roads import Displacement, add_profiles, redraw_road, reshape_road
from odscen.opendrive import road_model as model
from odscen.opendrive.lanes import RoadTable, is_forward
from odscen.opendrive.objects import is_crosswalk, is_stop_line, object_outline, signal_kind
from odscen.opendrive.topology import lane_successors

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence

    from odscen.base.arrays import FloatArray, IntArray
    from odscen.base.ids import JunctionId, LaneKey

REACH = 6.0
"""Metres from an edit's place within which a line, light, sign or crosswalk is the one meant."""
JUNCTION_REACH = 25.0
"""Metres from a place within which a junction is the one meant."""
BESIDE = 1.5
"""Metres beside a lane within which a place is still on it."""
_TAPER = 20.0
"""Metres over which a lane becomes wider or narrower, but at most a third of its section."""
_STEP = 4.0
"""Metres between the points by which roads near a place are found."""
_ALIGNED = math.pi / 3
"""Radians that a lane's direction may differ from that of the edit."""
_STOP_LINE = 0.4
"""Metres of a stop line along the road."""
_STANDING = 0.6
"""Metres from the carriageway to a pole."""
_SHOWN_SIGNAL = 0.4
"""Metres to each side of a light or sign by which it is shown."""
_LEAST_WIDTH = 0.3
"""Metres that a lane keeps beside a border that is bent."""
_LEAST_BEND = 2.0
"""Metres on each side over which a lane border is bent, at least."""
_LEAST_ROAD_BEND = 10.0
"""Metres on each side over which a road is bent, at least."""
_END_BEND = 60.0
"""Metres before a road's end that move along with it, at most."""
_END_REACH = 20.0
"""Metres from an end of a road within which that end is the one meant."""
_LEAST_RADIUS = 8.0
"""Metres, of a road that is bent."""
_LEAST_TURN = 2.0
"""Metres, of the line of a connecting road that is drawn anew."""

ObjectKind = Literal["stop line", "crosswalk", "island", "object"]

Done = tuple[str, str]
"""Path of the element that was changed, and what became of it."""


class EditRefusedError(Exception):
    """An edit does not fit the map; says why."""


class FoundLane(NamedTuple):
    """A lane at a place: its row of the road table, and s and t of the place."""

    row: int
    key: LaneKey
    s: float
    t: float


class FoundPart(NamedTuple):
    """An object or signal of a road."""

    road: RoadId
    id: str


class PlaceOnMap(NamedTuple):
    """What is at a place: what one sees before one mends it.

    Attributes
    ----------
    road, type
        Of the lane.
    width
        Of the lane there, metres.
    limit
        Speed limit there, km/h; ``None`` if there is none.
    hdg
        Direction of driving, rad.
    ring
        The lane from begin to end of its section, x and y in turn, metres.
    parts
        What is within :data:`REACH`: ``stop_line``, ``crosswalk``, ``light``, ``sign``,
        ``island``, or another ``object``.
    """

    road: str
    type: str
    width: float
    limit: float | None
    hdg: float
    ring: tuple[float, ...]
    parts: tuple[str, ...]


class EditedMap:
    """A map on which edits are done one after the other.

    Attributes
    ----------
    map
        As it is by now.
    """

    def __init__(self, before: model.OpenDrive) -> None:
        self.map = replace(
            before,
            roads=dict(before.roads),
            junctions=dict(before.junctions),
            controllers=dict(before.controllers),
        )
        self._table: RoadTable | None = None
        self._points: tuple[IntArray, FloatArray, FloatArray] | None = None
        self._outlines: list[tuple[ObjectKind, FoundPart, FloatArray]] | None = None
        roads = before.roads.values()
        self._taken = {item.id for road in roads for item in road.objects}
        self._taken |= {item.id for road in roads for item in road.signals}
        self._taken |= set(before.controllers)
        self._numbers = iter(range(9_000_000, 10_000_000))

    def copy(self) -> EditedMap:
        """The map as it is by now, to be edited without changing this one."""
        self.table  # noqa: B018  # once for all copies
        twin = copy(self)
        twin.map = replace(
            self.map,
            roads=dict(self.map.roads),
            junctions=dict(self.map.junctions),
            controllers=dict(self.map.controllers),
        )
        twin._taken = set(self._taken)
        twin._numbers = iter(range(9_000_000, 10_000_000))
        return twin

    def outline_changes(self, before: EditedMap) -> list[tuple[float, ...]]:
        """Outlines of what is other than on a map before: x and y in turn, metres.

        Lanes of the roads whose lanes or line have changed, objects and signals.
        """
        changed = {
            key: road
            for key, road in self.map.roads.items()
            if road is not before.map.roads.get(key)
        }
        if not changed:
            return []
        table = RoadTable.of(replace(self.map, roads=changed, junctions={}))
        rings = []
        for road in changed.values():
            old = before.map.roads.get(road.id)
            row = table.road_index[road.id]
            if old is None or (road.geometry, road.lane_offset, road.sections) != (
                old.geometry, old.lane_offset, old.sections
            ):  # fmt: skip
                lanes = np.flatnonzero(table.lane_road == row).tolist()
                rings += [_outline_lane(table, lane) for lane in lanes]
            known = () if old is None else (*old.objects, *old.signals)
            for item in road.objects:
                if item not in known:
                    outlines = object_outline(table, road.id, item)
                    rings += [tuple(ring[:, :2].ravel().tolist()) for ring in outlines[:1]]
            for signal in road.signals:
                if signal not in known:
                    side = np.array([-_SHOWN_SIGNAL, _SHOWN_SIGNAL])
                    s, t = np.repeat(signal.s + side, 2), signal.t + side[[0, 1, 1, 0]]
                    x, y, _ = table.points(np.full(4, row), s, t)
                    rings.append(tuple(np.stack([x, y], axis=1).ravel().tolist()))
        return rings

    @property
    def table(self) -> RoadTable:
        """The roads as arrays."""
        if self._table is None:
            self._table = RoadTable.of(self.map)
        return self._table

    # ------------------------------------------------------------------ places
    @cached_property
    def _project_corners(self) -> tuple[Callable[..., Any], Callable[..., Any]] | None:
        """Degrees to metres of the map, and back; ``None`` without a usable georeference."""
        header = self.map.header
        if header.crs is None or header.offset[3]:
            return None
        import pyproj

        there = pyproj.Transformer.from_crs("EPSG:4326", header.crs, always_xy=True)
        back = pyproj.Transformer.from_crs(header.crs, "EPSG:4326", always_xy=True)
        return there.transform, back.transform

    def place_of(self, place: Any) -> tuple[float, float]:
        """Metres of a :class:`~odscen.maps.map_edits.MapPlace` on this map.

        Raises
        ------
        EditRefusedError
            If it is in degrees and the map has no usable georeference.
        """
        if place.lat is not None and self._project_corners is not None:
            x, y = self._project_corners[0](place.lon, place.lat)
            return float(x) - self.map.header.offset[0], float(y) - self.map.header.offset[1]
        if place.x is None:
            raise EditRefusedError(
                "its place is in degrees, and the map has no usable georeference"
            )
        return place.x, place.y

    def degrees_of(self, x: float, y: float) -> tuple[float, float] | None:
        """Longitude and latitude of a place, or ``None`` without a usable georeference."""
        if self._project_corners is None:
            return None
        offset = self.map.header.offset
        lon, lat = self._project_corners[1](x + offset[0], y + offset[1])
        return float(lon), float(lat)

    def _roads_near(self, x: float, y: float) -> list[tuple[int, float, float]]:
        """Row of each road near a place, with s and t of the place on it."""
        if self._points is None:
            table = self.table
            rows, stations = [], []
            for row, length in enumerate(table.road_length.tolist()):
                count = max(2, math.ceil(length / _STEP) + 1)
                rows.append(np.full(count, row))
                stations.append(np.linspace(0.0, length, count))
            road, s = np.concatenate(rows), np.concatenate(stations)
            line = table.reference(road, s)
            self._points = (road, s, np.stack([line.x, line.y], axis=1))
        road, s, points = self._points
        away = np.hypot(*(points - (x, y)).T)
        near = []
        for row in np.unique(road[away < 60.0]).tolist():
            of_road = np.flatnonzero(road == row)
            here = float(s[of_road[np.argmin(away[of_road])]])
            length = float(self.table.road_length[row])
            t = 0.0
            for _ in range(6):
                line = self.table.reference(np.array([row]), np.array([here]))
                dx, dy = x - float(line.x[0]), y - float(line.y[0])
                cos, sin = math.cos(line.hdg[0]), math.sin(line.hdg[0])
                ahead, t = dx * cos + dy * sin, dy * cos - dx * sin
                bend = max(1.0 - float(line.curvature[0]) * t, 0.3)
                here = min(max(here + ahead / bend, 0.0), length)
            if abs(ahead) < BESIDE or 0.0 < here < length:
                near.append((row, here, t))
        return near

    def _lanes_near(
        self, x: float, y: float, hdg: float | None, *, connecting: bool
    ) -> list[tuple[float, FoundLane]]:
        """Lanes near a place, and how far it is outside each of them, metres."""
        lanes = []
        for road, s, t in self._roads_near(x, y):
            if self.map.roads[self.table.road_ids[road]].junction is not None and not connecting:
                continue
            rows = self.table.lanes_at(road, s)
            inner, outer = self.table.lane_borders(rows, np.full(len(rows), s))
            outside = np.maximum(np.minimum(inner, outer) - t, t - np.maximum(inner, outer))
            for row, gap in zip(rows.tolist(), outside.tolist(), strict=True):
                if gap > BESIDE:
                    continue
                if hdg is not None:
                    line = self.table.lane_points(np.array([row]), np.array([s]))
                    turn = 0.0 if self.table.lane_forward[row] else math.pi
                    off = math.remainder(float(line.hdg[0]) + turn - hdg, 2.0 * math.pi)
                    if abs(off) > _ALIGNED:
                        continue
                lanes.append((max(gap, 0.0), FoundLane(row, self.table.lane_keys[row], s, t)))
        return lanes

    def find_lane(
        self, x: float, y: float, hdg: float | None, *, connecting: bool = True
    ) -> FoundLane:
        """Find the lane at a place: of a plain road, if one of a junction is there, too.

        Raises
        ------
        EditRefusedError
            If there is none.
        """
        lanes = self._lanes_near(x, y, hdg, connecting=connecting)
        if not lanes:
            raise EditRefusedError(f"there is no such lane at x {x:.1f} m, y {y:.1f} m")

        def rank(lane: tuple[float, FoundLane]) -> tuple[float, bool, bool, float]:
            gap, found = lane
            in_junction = self.map.roads[found.key.road].junction is not None
            width = self.table.lane_width(np.array([found.row]), np.array([found.s]))
            middle = self.table.lane_borders(np.array([found.row]), np.array([found.s]))
            off = abs(float(middle[0][0] + middle[1][0]) / 2.0 - found.t)
            return (round(gap, 2), in_junction, float(width[0]) < 0.1, off)

        return min(lanes, key=rank)[1]

    def find_object(self, xy: tuple[float, float], kind: ObjectKind) -> FoundPart:
        """Find the stop line, crosswalk, island or other object nearest to a place."""
        if self._outlines is None:
            self._outlines = [
                (_kind_of(item), FoundPart(road.id, item.id), outline[:, :2])
                for road in self.map.roads.values()
                for item in road.objects
                for outline in object_outline(self.table, road.id, item)[:1]
            ]
        parts = [(_distance_to(ring, xy), part) for of, part, ring in self._outlines if of == kind]
        return self._nearest_part(parts, kind, xy)

    def find_signal(self, xy: tuple[float, float], kind: Literal["light", "sign"]) -> FoundPart:
        """Find the light or sign nearest to a place."""
        parts = []
        for road in self.map.roads.values():
            for signal in road.signals:
                is_light = signal_kind(signal) in ("traffic_light", "pedestrian_light")
                if is_light == (kind == "light"):
                    place = self._read_point(road.id, signal.s, signal.t)
                    away = math.hypot(place[0] - xy[0], place[1] - xy[1])
                    parts.append((away, FoundPart(road.id, signal.id)))
        return self._nearest_part(parts, kind, xy)

    def describe_place(self, x: float, y: float) -> PlaceOnMap:
        """Say what is at a place.

        Raises
        ------
        EditRefusedError
            If there is no lane.
        """
        found = self.find_lane(x, y, None)
        lane = np.array([found.row])
        here = self.table.lane_points(lane, np.array([found.s]))
        speed = float(self.table.speed_limit(lane, np.array([found.s]))[0])
        turn = 0.0 if self.table.lane_forward[found.row] else math.pi
        parts = []
        for kind in ("stop line", "crosswalk", "light", "sign", "island", "object"):
            try:
                if kind in ("light", "sign"):
                    self.find_signal((x, y), kind)  # type: ignore[arg-type]
                else:
                    self.find_object((x, y), kind)  # type: ignore[arg-type]
            except EditRefusedError:
                continue
            parts.append(kind.replace(" ", "_"))
        return PlaceOnMap(
            road=self.map.roads[found.key.road].name or str(found.key.road),
            type=self.table.lane_type[found.row],
            width=round(float(here.width[0]), 3),
            limit=round(speed * 3.6, 3) if math.isfinite(speed) else None,
            hdg=math.remainder(float(here.hdg[0]) + turn, 2.0 * math.pi),
            ring=_outline_lane(self.table, found.row),
            parts=tuple(parts),
        )

    def _nearest_part(
        self, parts: Sequence[tuple[float, FoundPart]], kind: str, xy: tuple[float, float]
    ) -> FoundPart:
        near = [part for part in parts if part[0] <= REACH]
        if not near:
            where = f"x {xy[0]:.1f} m, y {xy[1]:.1f} m"
            nearest = f"; the nearest is {min(parts)[0]:.0f} m away" if parts else ""
            raise EditRefusedError(f"there is no {kind} within {REACH:g} m of {where}{nearest}")
        return min(near)[1]

    def _read_point(self, road: RoadId, s: float, t: float) -> tuple[float, float]:
        row = np.array([self.table.road_index[road]])
        x, y, _ = self.table.points(row, np.array([s]), np.array([t]))
        return float(x[0]), float(y[0])

    # ------------------------------------------------------------------ changes
    def _replace_road(self, road: model.Road, *, shape: bool = False) -> None:
        self.map.roads[road.id] = road
        self._outlines = None
        if shape:
            self._table = self._points = None

    def _replace_lane(self, key: LaneKey, lane: model.Lane, *, shape: bool = False) -> None:
        road = self.map.roads[key.road]
        sections = list(road.sections)
        section = sections[key.section]
        sections[key.section] = replace(section, lanes={**section.lanes, key.lane: lane})
        self._replace_road(replace(road, sections=tuple(sections)), shape=shape)

    def _lane_model(self, key: LaneKey) -> model.Lane:
        return self.map.roads[key.road].sections[key.section].lanes[key.lane]

    def _new_id(self) -> str:
        number = next(str(n) for n in self._numbers if str(n) not in self._taken)
        self._taken.add(number)
        return number

    def _same_way(self, lane: FoundLane) -> list[int]:
        """Ids of lanes for motor vehicles of the section that run as the lane does."""
        road = self.map.roads[lane.key.road]
        lanes = road.sections[lane.key.section].lanes
        forward = is_forward(road, lanes[lane.key.lane])
        return sorted(
            other.id
            for other in lanes.values()
            if other.id
            and is_forward(road, other) == forward
            and model.lane_use(other) in model.DRIVABLE_TYPES
        )

    def _lane_edges(self, lane: FoundLane, ids: Iterable[int]) -> tuple[float, float]:
        """Least and largest t of lanes of the section at the place."""
        index = self.table.lane_index
        rows = np.array([index[lane.key._replace(lane=number)] for number in ids])
        borders = np.concatenate(self.table.lane_borders(rows, np.full(len(rows), lane.s)))
        return float(borders.min()), float(borders.max())

    def widen_lane(self, found: FoundLane, width: float) -> Done:
        """Give a lane a width; what lies outside of it moves along.

        Raises
        ------
        EditRefusedError
            If its lanes are given by borders.
        """
        lane, road = self._lane_model(found.key), self.map.roads[found.key.road]
        section = road.sections[found.key.section]
        if any(other.borders and not other.widths for other in section.lanes.values()):
            raise EditRefusedError("its lanes are given by borders, not by widths")
        s0, s1 = section.s, section.s_end
        row = np.array([found.row, found.row])
        first, last = self.table.lane_width(row, np.array([s0, s1])).tolist()
        taper = min(_TAPER, (s1 - s0) / 3.0)
        before = self._widths_at(found.row)
        widths = (
            *ease(s0, first, width, taper),
            *(ease(s1 - taper, width, last, taper)[:1] if abs(last - width) > 1e-9 else ()),
        )
        if abs(first - width) < 1e-9:
            widths = (model.Cubic(s0, width, 0.0, 0.0, 0.0), *widths[1:])
        border = self._outer_border(found.row)
        self._replace_lane(found.key, replace(lane, widths=widths), shape=True)
        after = self._widths_at(self.table.lane_index[found.key])
        self._move_beside(found.key, border, lambda s: after(s) - before(s))
        was = before((s0 + s1) / 2.0)
        return _lane_path(found.key), f"{width:g} m wide, was {was:.2f} m"

    def _move_beside(
        self, key: LaneKey, border: Callable[[float], float], by: Callable[[float], float]
    ) -> None:
        """Move objects and signals outside of a lane's outer border away from the middle."""
        road = self.map.roads[key.road]
        section, side = road.sections[key.section], math.copysign(1.0, key.lane)

        def moved(s: float, t: float) -> float:
            if not section.s <= s < section.s_end or side * t < side * border(s) - 1e-6:
                return t
            return t + side * by(s)

        objects = tuple(
            replace(item, t=moved(item.s, item.t), outlines=tuple(
                outline._replace(corners=tuple(
                    corner if corner.local else corner._replace(b=moved(corner.a, corner.b))
                    for corner in outline.corners
                ))
                for outline in item.outlines
            ))
            for item in road.objects
        )  # fmt: skip
        signals = tuple(replace(item, t=moved(item.s, item.t)) for item in road.signals)
        references = tuple(
            replace(item, t=moved(item.s, item.t)) for item in road.signal_references
        )
        self._replace_road(
            replace(road, objects=objects, signals=signals, signal_references=references)
        )

    def _widths_at(self, row: int) -> Callable[[float], float]:
        table = self.table
        return lambda s: float(table.lane_width(np.array([row]), np.array([s]))[0])

    def _outer_border(self, row: int) -> Callable[[float], float]:
        table = self.table
        return lambda s: float(table.lane_borders(np.array([row]), np.array([s]))[1][0])

    def limit_speed(
        self, found: FoundLane, speed: float, lanes: Literal["lane", "direction", "road"]
    ) -> Done:
        """Give lanes of the section a limit, m/s."""
        road = self.map.roads[found.key.road]
        section = road.sections[found.key.section]
        ids = [found.key.lane]
        if lanes == "direction":
            ids = sorted({*ids, *self._same_way(found)})
        elif lanes == "road":
            ids = [number for number in section.lanes if number]
        for number in ids:
            key = found.key._replace(lane=number)
            limits = (model.LaneSpeed(section.s, speed),)
            self._replace_lane(key, replace(self._lane_model(key), speeds=limits), shape=True)
        return _lane_path(found.key), f"{lanes}: limit {speed * 3.6:g} km/h"

    def set_access(
        self, found: FoundLane, kind: str | None, allow: Sequence[str], deny: Sequence[str]
    ) -> Done:
        """Give a lane a type, and access rules in place of those that it has."""
        lane = self._lane_model(found.key)
        start = self.map.roads[found.key.road].sections[found.key.section].s
        rules = [("allow", name) for name in allow] + [("deny", name) for name in deny]
        access = tuple(model.LaneAccess(start, rule, name) for rule, name in rules)
        changed = replace(lane, type=kind or lane.type, access=access)
        self._replace_lane(found.key, changed, shape=True)
        words = [f"type {changed.type}", *(f"{rule} {name}" for rule, name in rules)]
        return _lane_path(found.key), ", ".join(words)

    def _find_border(self, xy: tuple[float, float], hdg: float | None) -> LaneKey:
        """The lane whose outer border is the nearest to a place; 0 for the line in the middle."""
        borders = []
        for _, found in self._lanes_near(*xy, hdg, connecting=True):
            inner, outer = self.table.lane_borders(np.array([found.row]), np.array([found.s]))
            number = found.key.lane
            towards = number - 1 if number > 0 else number + 1
            borders.append((abs(float(outer[0]) - found.t), found.key))
            borders.append((abs(float(inner[0]) - found.t), found.key._replace(lane=towards)))
        if not borders:
            raise EditRefusedError(f"there is no lane border at x {xy[0]:.1f} m, y {xy[1]:.1f} m")
        return min(borders, key=lambda border: (round(border[0], 6), border[1]))[1]

    def paint_border(
        self,
        xy: tuple[float, float],
        hdg: float | None,
        mark: str,
        lane_change: model.LaneChange | None,
    ) -> Done:
        """Paint the lane border nearest to a place, along the section.

        Raises
        ------
        EditRefusedError
            If there is none.
        """
        key = self._find_border(xy, hdg)
        lane = self._lane_model(key)
        start = self.map.roads[key.road].sections[key.section].s
        solid = mark.startswith("solid") or mark == "curb"
        change = lane_change or ("none" if solid else "both")
        old = lane.road_marks[0] if lane.road_marks else None
        color, weight = (old.color, old.weight) if old else ("standard", "standard")
        painted = model.RoadMark(start, mark, color, weight, old.width if old else 0.12, change)
        self._replace_lane(key, replace(lane, road_marks=(painted,)), shape=True)
        return _lane_path(key), f"road mark {mark}, lane change {change}"

    # ------------------------------------------------------------------ shapes
    def _station_on(self, road: RoadId, xy: tuple[float, float]) -> tuple[float, float]:
        """S and t of a place on a certain road."""
        row = self.table.road_index[road]
        for near, s, t in self._roads_near(*xy):
            if near == row:
                return s, t
        raise EditRefusedError(f"the second place is not beside road {road}")

    def bend_border(
        self, xy: tuple[float, float], hdg: float | None, to: tuple[float, float], length: float
    ) -> Done:
        """Lead the lane border nearest to a place through another; the next borders stay.

        Raises
        ------
        EditRefusedError
            If there is none, the other place is not beside it, or a lane would be too narrow.
        """
        key = self._find_border(xy, hdg)
        road = self.map.roads[key.road]
        section = road.sections[key.section]
        if any(lane.borders and not lane.widths for lane in section.lanes.values()):
            raise EditRefusedError("its lanes are given by borders, not by widths")
        s, t = self._station_on(key.road, to)
        before = min(length / 2.0, s - section.s)
        after = min(length / 2.0, section.s_end - s)
        if min(before, after) < _LEAST_BEND:
            raise EditRefusedError(
                f"the second place is within {_LEAST_BEND:g} m of an end of its lane section"
            )
        rows = np.array([self.table.road_index[key.road]])
        at = np.array([s])
        now = float(self.table.lane_offset(rows, at)[0])
        if key.lane:
            now = self._outer_border(self.table.lane_index[key])(s)
        by = t - now
        bump = (*ease(s - before, 0.0, by, before)[:1], *ease(s, by, 0.0, after))
        # Positive on the left: what a lane gains on one side of its border, its neighbour loses.
        inside, outside = (key.lane, key.lane + (1 if key.lane > 0 else -1))
        shares = {inside: math.copysign(1.0, key.lane), outside: -math.copysign(1.0, outside)}
        if not key.lane:
            shares = {1: -1.0, -1: 1.0}
        shares = {number: share for number, share in shares.items() if number in section.lanes}
        steps = np.arange(s - before, s + after, 0.5)
        outer = self._outer_border(self.table.lane_index[key]) if key.lane else None
        for number, share in shares.items():
            lane_key = key._replace(lane=number)
            row = np.full(steps.size, self.table.lane_index[lane_key])
            widths = self.table.lane_width(row, steps)
            gained = [share * value for value in _values_of(bump, steps)]
            narrow = float(np.min(np.where(np.abs(gained) > 1e-6, widths + gained, np.inf)))
            if narrow < _LEAST_WIDTH:
                raise EditRefusedError(f"lane {number} would be {max(narrow, 0.0):.2f} m wide")
        for number, share in shares.items():
            lane_key = key._replace(lane=number)
            lane = self._lane_model(lane_key)
            gain = [
                model.Cubic(c.s, *(share * value for value in c[1:]))
                for c in bump
                if c.s < section.s_end - 1e-6
            ]
            bent = add_profiles(lane.widths, gain)
            self._replace_lane(lane_key, replace(lane, widths=bent), shape=True)
        if not key.lane:
            road = self.map.roads[key.road]
            offset = add_profiles(road.lane_offset or (model.Cubic(0.0, 0.0, 0.0, 0.0, 0.0),), bump)
            self._replace_road(replace(road, lane_offset=offset), shape=True)
        elif outer is not None and outside not in section.lanes:
            self._move_beside(
                key, outer, lambda at: shares[inside] * _values_of(bump, np.array([at]))[0]
            )
        path = f"{_lane_path(key)} > border"
        return path, f"led {abs(by):.2f} m to the {'left' if by > 0 else 'right'} at s {s:.1f} m"

    def bend_road(self, found: FoundLane, to: tuple[float, float], length: float) -> Done:
        """Lead a road through a place beside it, over a length; its ends stay.

        Raises
        ------
        EditRefusedError
            If it is in a junction, too near an end, or the bend would be too tight.
        """
        road = self.map.roads[found.key.road]
        if road.junction is not None:
            raise EditRefusedError("a connecting road of a junction: move the ends of its roads")
        s, t = self._station_on(road.id, to)
        begin, end = max(0.0, s - length / 2.0), min(road.length, s + length / 2.0)
        if min(s - begin, end - s) < _LEAST_ROAD_BEND:
            raise EditRefusedError(
                f"it is within {_LEAST_ROAD_BEND:g} m of an end of the road: move that end"
            )
        line = self.table.reference(np.array([self.table.road_index[road.id]]), np.array([s]))
        by = t - found.t
        hdg = float(line.hdg[0])
        shift = Displacement(-by * math.sin(hdg), by * math.cos(hdg), begin, s, end)
        self._set_reshaped([reshape_road(road, self.table, shift)])
        return (
            f"road {road.id}",
            f"led {abs(by):.2f} m to the {'left' if by > 0 else 'right'} at s {s:.1f} m",
        )

    def _set_reshaped(self, reshaped: Sequence[tuple[model.Road, float]]) -> None:
        """Take roads with another line, if none is too tight to drive."""
        for road, radius in reshaped:
            allowed = _LEAST_RADIUS if road.junction is None else _LEAST_TURN
            if radius < allowed:
                raise EditRefusedError(
                    f"road {road.id} would have a bend of {radius:.1f} m, at least {allowed:g} m "
                    "are needed"
                )
        for road, _ in reshaped:
            self._replace_road(road, shape=True)

    def move_road_end(
        self, found: FoundLane, xy: tuple[float, float], to: tuple[float, float]
    ) -> Done:
        """Move the end of a road nearest to a place; what is linked to it follows.

        The road keeps its direction there; connecting roads are drawn anew.

        Raises
        ------
        EditRefusedError
            If the place is too far from an end, or a bend would be too tight.
        """
        road = self.map.roads[found.key.road]
        if road.junction is not None:
            raise EditRefusedError("a connecting road of a junction: move the ends of its roads")
        at_end = found.s > road.length / 2.0
        away = road.length - found.s if at_end else found.s
        if away > _END_REACH:
            raise EditRefusedError(f"the end of its road is {away:.0f} m away")
        by = (to[0] - xy[0], to[1] - xy[1])
        contact = "end" if at_end else "start"
        reshaped = [self._move_end(road, contact, by)]
        link = road.successor if at_end else road.predecessor
        if link is not None and link.element_type == "road":
            other = self.map.roads[RoadId(link.element_id)]
            if link.contact_point is not None and other.id != road.id:
                reshaped.append(self._move_end(other, link.contact_point, by))
        elif link is not None:
            still = (0.0, 0.0)
            for other in self.map.roads.values():
                if other.junction != link.element_id or other.id == road.id:
                    continue
                ends = [
                    by if _leads_to(end, road.id, contact) else still
                    for end in (other.predecessor, other.successor)
                ]
                if ends != [still, still]:
                    reshaped.append(redraw_road(other, self.table, *ends))
        self._set_reshaped(reshaped)
        return (
            f"road {road.id}",
            f"{contact} moved by {math.hypot(*by):.2f} m; roads that follow it: "
            f"{len(reshaped) - 1}",
        )

    def _move_end(
        self, road: model.Road, contact: str, by: tuple[float, float]
    ) -> tuple[model.Road, float]:
        reach = min(_END_BEND, 0.8 * road.length)
        if contact == "end":
            shift = Displacement(*by, road.length - reach, road.length, road.length)
        else:
            shift = Displacement(*by, 0.0, 0.0, reach)
        return reshape_road(road, self.table, shift)

    # ------------------------------------------------------------------ objects
    def _add_object(
        self, road_id: RoadId, kind: str, name: str, s: float, t: float, *, length: float,
        width: float, height: float = 0.0, orientation: str = "none",
        validities: tuple[model.Validity, ...] = (), outlined: bool = False,
    ) -> str:  # fmt: skip
        u, v = length / 2.0, width / 2.0
        # CARLA expects the first corner of a crosswalk once more at the end.
        ring = ((-u, -v), (u, -v), (u, v), (-u, v), (-u, -v))
        corners = tuple(model.Corner(True, a, b, 0.0, height) for a, b in ring)
        item = model.RoadObject(
            id=self._new_id(), type=kind, subtype="", name=name, s=s, t=t, z_offset=0.0, hdg=0.0,
            pitch=0.0, roll=0.0, orientation=orientation, length=length, width=width,
            height=height, radius=None, valid_length=None,
            outlines=(model.Outline(corners, True, True),) if outlined else (),
            validities=validities,
        )  # fmt: skip
        road = self.map.roads[road_id]
        self._replace_road(replace(road, objects=(*road.objects, item)))
        return f"road {road_id} > object {item.id}"

    def add_stop_line(self, found: FoundLane) -> Done:
        """Paint a stop line over the lanes for motor vehicles of a direction.

        Raises
        ------
        EditRefusedError
            If the direction has no lane for motor vehicles.
        """
        ids = self._same_way(found)
        if not ids:
            raise EditRefusedError("there is no lane for motor vehicles in this direction")
        low, high = self._lane_edges(found, ids)
        element = self._add_object(
            found.key.road, "roadMark", "StopLine", found.s, (low + high) / 2.0,
            length=_STOP_LINE, width=high - low, orientation=self._find_facing(found),
        )  # fmt: skip
        return element, f"stop line of {high - low:.1f} m at s {found.s:.1f} m"

    def _find_facing(self, found: FoundLane) -> str:
        return "+" if self.table.lane_forward[found.row] else "-"

    def add_crosswalk(self, found: FoundLane, width: float) -> Done:
        """Lay a crosswalk over the carriageway, from sidewalk to sidewalk.

        Raises
        ------
        EditRefusedError
            If there is no carriageway, or no room before the end of the road.
        """
        road = self.map.roads[found.key.road]
        lanes = road.sections[found.key.section].lanes.values()
        beside = model.WALKABLE_TYPES | {"none", "shoulder", "border", "curb"}
        ids = [lane.id for lane in lanes if lane.id and lane.type not in beside]
        if not ids:
            raise EditRefusedError("there is no carriageway to cross")
        if not width / 2.0 <= found.s <= road.length - width / 2.0:
            raise EditRefusedError(f"its road ends within {width / 2.0:g} m")
        low, high = self._lane_edges(found, ids)
        low, high = low - 0.5, high + 0.5  # on to the sidewalks, where pedestrians come from
        element = self._add_object(
            road.id, "crosswalk", "Crosswalk", found.s, (low + high) / 2.0,
            length=width, width=high - low, outlined=True,
        )  # fmt: skip
        return element, f"crosswalk of {high - low:.1f} m at s {found.s:.1f} m"

    def add_island(
        self, found: FoundLane, xy: tuple[float, float], length: float, width: float
    ) -> Done:
        """Put a traffic island on a place."""
        element = self._add_object(
            found.key.road, "trafficIsland", "Island", found.s, found.t,
            length=length, width=width, height=0.15, outlined=True,
        )  # fmt: skip
        return element, f"island of {length:g} m x {width:g} m at x {xy[0]:.1f} m, y {xy[1]:.1f} m"

    def remove_object(self, part: FoundPart) -> Done:
        """Remove an object."""
        road = self.map.roads[part.road]
        rest = tuple(item for item in road.objects if item.id != part.id)
        self._replace_road(replace(road, objects=rest))
        return f"road {part.road} > object {part.id}", "removed"

    def move_object(
        self, part: FoundPart, by: float, to: tuple[float, float] | None, *, beside: bool = False
    ) -> Done:
        """Move an object along its road, in the direction that it is for, or to a place.

        Only what may be ``beside`` its place on the road changes its t, too.
        """
        road = self.map.roads[part.road]
        item = next(item for item in road.objects if item.id == part.id)
        t = item.t
        if to is None:
            s = self._clamp_to_road(road, item.s, by, item.orientation)
        else:
            s, there = self._station_on(road.id, to)
            t = there if beside else t
        items = tuple(
            replace(other, s=s, t=t, outlines=_shifted_along(other, s - other.s, t - other.t))
            if other.id == part.id
            else other
            for other in road.objects
        )
        self._replace_road(replace(road, objects=items))
        return f"road {part.road} > object {part.id}", _say_moved(item.s, item.t, s, t)

    def _clamp_to_road(self, road: model.Road, s: float, by: float, orientation: str) -> float:
        moved = s - by if orientation == "-" else s + by
        if not 0.0 <= moved <= road.length:
            raise EditRefusedError(f"moved by {by:g} m it is not on road {road.id} any more")
        return moved

    # ------------------------------------------------------------------ lights and signs
    def add_signal(
        self, found: FoundLane, kind: str, subtype: str, country: str, value: float | None,
        unit: str, *, light: bool,
    ) -> Done:  # fmt: skip
        """Put up a light or sign beside the lanes for motor vehicles of a direction.

        Raises
        ------
        EditRefusedError
            If the direction has no lane for motor vehicles.
        """
        ids = self._same_way(found)
        if not ids:
            raise EditRefusedError("there is no lane for motor vehicles in this direction")
        road = self.map.roads[found.key.road]
        low, high = self._lane_edges(found, ids)
        side = math.copysign(1.0, found.key.lane)
        factor = {"km/h": 1.0 / 3.6, "mph": 0.44704}.get(unit)
        signal = model.Signal(
            id=self._new_id(), name="Light" if light else "Sign", s=found.s,
            t=high + _STANDING if side > 0 else low - _STANDING,
            z_offset=3.0 if light else 2.0, h_offset=0.0, orientation=self._find_facing(found),
            dynamic=light, country=country, type=kind, subtype=subtype,
            value=value if value is None or factor is None else value * factor,
            unit=unit if factor is None else "m/s", text="", width=0.4 if light else 0.6,
            height=1.0 if light else 0.6,
            validities=tuple(model.Validity(number, number) for number in ids),
        )  # fmt: skip
        self._replace_road(replace(road, signals=(*road.signals, signal)))
        element = f"road {road.id} > signal {signal.id}"
        if not light:
            return element, f"sign {country} {kind} at s {found.s:.1f} m"
        controller = self._new_id()
        controls = ((signal.id, "0"),)
        self.map.controllers[controller] = model.Controller(controller, "mended", 0, controls)
        link = road.successor if self.table.lane_forward[found.row] else road.predecessor
        if link is None or link.element_type != "junction":
            return element, f"light at s {found.s:.1f} m, of its own"
        number: JunctionId = link.element_id  # type: ignore[assignment]
        junction = self.map.junctions[number]
        controllers = (*junction.controllers, controller)
        self.map.junctions[number] = replace(junction, controllers=controllers)
        return element, f"light at s {found.s:.1f} m, of junction {number}"

    def remove_signal(self, part: FoundPart) -> Done:
        """Remove a light or sign, and what refers to it."""
        for road in list(self.map.roads.values()):
            rest = tuple(s for s in road.signals if s.id != part.id or road.id != part.road)
            references = tuple(r for r in road.signal_references if r.id != part.id)
            if (rest, references) != (road.signals, road.signal_references):
                self._replace_road(replace(road, signals=rest, signal_references=references))
        emptied = set()
        for controller in list(self.map.controllers.values()):
            controls = tuple(c for c in controller.controls if c[0] != part.id)
            if controls == controller.controls:
                continue
            if controls:
                self.map.controllers[controller.id] = replace(controller, controls=controls)
            else:
                emptied.add(controller.id)
                del self.map.controllers[controller.id]
        for junction in list(self.map.junctions.values()):
            if emptied & set(junction.controllers):
                left = tuple(c for c in junction.controllers if c not in emptied)
                self.map.junctions[junction.id] = replace(junction, controllers=left)
        return f"road {part.road} > signal {part.id}", "removed"

    def move_signal(self, part: FoundPart, by: float, to: tuple[float, float] | None) -> Done:
        """Move a light or sign along its road, in the direction that it is for, or to a place."""
        road = self.map.roads[part.road]
        signal = next(signal for signal in road.signals if signal.id == part.id)
        if to is None:
            s, t = self._clamp_to_road(road, signal.s, by, signal.orientation), signal.t
        else:
            s, t = self._station_on(road.id, to)
        signals = tuple(replace(o, s=s, t=t) if o.id == part.id else o for o in road.signals)
        self._replace_road(replace(road, signals=signals))
        return f"road {part.road} > signal {part.id}", _say_moved(signal.s, signal.t, s, t)

    # ------------------------------------------------------------------ junctions
    def find_junction(self, xy: tuple[float, float]) -> JunctionId:
        """Find the junction at a place, or the nearest within :data:`JUNCTION_REACH`.

        Raises
        ------
        EditRefusedError
            If there is none.
        """
        near: list[tuple[float, JunctionId]] = []
        for row, s, t in self._roads_near(*xy):
            road = self.map.roads[self.table.road_ids[row]]
            if road.junction is not None:
                near.append((abs(t), road.junction))
                continue
            for link, away in ((road.predecessor, s), (road.successor, road.length - s)):
                if link is not None and link.element_type == "junction":
                    near.append((math.hypot(away, t) + 1.0, link.element_id))  # type: ignore[arg-type]
        near = [(away, name) for away, name in near if away <= JUNCTION_REACH]
        if not near:
            where = f"x {xy[0]:.1f} m, y {xy[1]:.1f} m"
            raise EditRefusedError(f"there is no junction within {JUNCTION_REACH:g} m of {where}")
        return min(near)[1]

    def join_junctions(self, first: JunctionId, second: JunctionId) -> Done:
        """Make one junction of two and the roads between them.

        Raises
        ------
        EditRefusedError
            If they are the same, or no short road leads from the one to the other.
        """
        if first == second:
            raise EditRefusedError(f"both places are at junction {first}")
        between = find_roads_between(self.map, first, second)
        if not between:
            raise EditRefusedError(
                f"no road leads from junction {first} directly to junction {second}"
            )
        longest = max(self.map.roads[number].length for number in between)
        if longest > LONGEST:
            raise EditRefusedError(
                f"{longest:.0f} m are between the junctions, more than {LONGEST:g} m"
            )
        joined = join_junctions(self.map, self.table, first, second)
        for road, signal in joined.signals:
            self.remove_signal(FoundPart(road, signal))
        controllers = tuple(
            name for name in joined.map.junctions[first].controllers if name in self.map.controllers
        )
        junctions = dict(joined.map.junctions)
        junctions[first] = replace(junctions[first], controllers=controllers)
        roads = {
            number: replace(road, signal_references=self.map.roads[number].signal_references)
            if number in self.map.roads
            else road
            for number, road in joined.map.roads.items()
        }
        self.map = replace(self.map, roads=roads, junctions=junctions)
        self._table = self._points = self._outlines = None
        return (
            f"junction {first}",
            f"joined with junction {second}; turns drawn: {len(joined.turns)}, signals removed: "
            f"{len(joined.signals)}, crosswalks removed: {joined.crosswalks}",
        )

    # ------------------------------------------------------------------ turns
    def _find_lanes_through(
        self, start: FoundLane, end: FoundLane
    ) -> tuple[JunctionId, list[LaneKey]]:
        """The junction between two lanes, and its lanes that lead from one to the other."""
        road = self.map.roads[start.key.road]
        forward = bool(self.table.lane_forward[start.row])
        link = road.successor if forward else road.predecessor
        last = len(road.sections) - 1 if forward else 0
        if link is None or link.element_type != "junction" or start.key.section != last:
            raise EditRefusedError("the first lane does not end at a junction")
        onto = self.map.roads[end.key.road]
        leaving = bool(self.table.lane_forward[end.row])
        behind = onto.predecessor if leaving else onto.successor
        first = 0 if leaving else len(onto.sections) - 1
        if behind is None or behind.element_id != link.element_id or end.key.section != first:
            raise EditRefusedError(
                "the second lane does not begin at the junction where the first ends"
            )
        after = lane_successors(self.map)
        number: JunctionId = link.element_id  # type: ignore[assignment]
        return number, [key for key in after[start.key] if end.key in after.get(key, ())]

    def remove_turn(self, start: FoundLane, end: FoundLane) -> Done:
        """Let a lane lead to another no more; refused if it is the only way on.

        Raises
        ------
        EditRefusedError
            If there is no such turn, or it is the only way on.
        """
        number, through = self._find_lanes_through(start, end)
        if not through:
            raise EditRefusedError("the first lane does not lead to the second")
        after = lane_successors(self.map)[start.key]
        if set(after) <= set(through):
            raise EditRefusedError("it is the only way on from this lane")
        junction = self.map.junctions[number]
        for key in through:
            kept = []
            for connection in junction.connections:
                links = connection.lane_links
                if connection.connecting_road == key.road:
                    links = tuple(pair for pair in links if pair != (start.key.lane, key.lane))
                    if not links:
                        continue
                kept.append(connection._replace(lane_links=links))
            junction = replace(junction, connections=tuple(kept))
            if not any(connection.connecting_road == key.road for connection in kept):
                self._remove_road(key.road)
            else:
                lane = replace(
                    self._lane_model(key), type="restricted", predecessors=(), successors=()
                )
                self._replace_lane(key, lane, shape=True)
        self.map.junctions[number] = junction
        return (
            f"junction {number}",
            f"no turn from {_lane_path(start.key)} to {_lane_path(end.key)}",
        )

    def _remove_road(self, road_id: RoadId) -> None:
        for signal in self.map.roads[road_id].signals:
            self.remove_signal(FoundPart(road_id, signal.id))
        del self.map.roads[road_id]
        for junction in list(self.map.junctions.values()):
            rest = tuple(p for p in junction.priorities if road_id not in p)
            if rest != junction.priorities:
                self.map.junctions[junction.id] = replace(junction, priorities=rest)
        self._table = self._points = self._outlines = None

    def add_turn(self, start: FoundLane, end: FoundLane) -> Done:
        """Draw a connecting road of one lane from lane to lane.

        Raises
        ------
        EditRefusedError
            If no junction is between the lanes, or the turn is there already.
        """
        number, through = self._find_lanes_through(start, end)
        if through:
            raise EditRefusedError("the first lane leads to the second already")
        (begin, z0, w0), (finish, z1, w1) = (
            self._inner_end(start, arriving=True),
            self._inner_end(end, arriving=False),
        )
        curve = curve_between(begin, finish)
        if curve.length < 0.5:
            raise EditRefusedError("the lanes touch each other: there is no room for a turn")
        road, onto = self.map.roads[start.key.road], self.map.roads[end.key.road]
        own = 1 if road.rule == "LHT" else -1
        road_id = RoadId(self._new_road_id())
        lane = model.Lane(
            own,
            self._lane_model(start.key).type,
            widths=tuple(ease(0.0, w0, w1, curve.length)[:1]),
            access=tuple(rule._replace(s=0.0) for rule in self._lane_model(start.key).access),
            predecessors=(start.key.lane,),
            successors=(end.key.lane,),
        )
        middle = model.Lane(0, "none")
        lanes = {own: lane, 0: middle} if own > 0 else {0: middle, own: lane}
        level = max(abs(z0[0]), abs(z1[0]), abs(z0[1]), abs(z1[1])) < 1e-6
        heights, grades = np.array([z0[0], z1[0]]), np.array([z0[1], z1[1]])
        ends = (self.table.lane_forward[start.row], self.table.lane_forward[end.row])
        speed = float(self.table.speed_limit(np.array([start.row]), np.array([start.s]))[0])
        kind = road.types[0].type if road.types else "town"
        self.map.roads[road_id] = model.Road(
            id=road_id,
            name="",
            length=curve.length,
            junction=number,
            rule=road.rule,
            predecessor=model.RoadLink("road", road.id, "end" if ends[0] else "start"),
            successor=model.RoadLink("road", onto.id, "start" if ends[1] else "end"),
            types=(model.RoadType(0.0, kind, speed if math.isfinite(speed) else None),),
            geometry=write_geometry([curve]),
            elevation=() if level else (hermite(0.0, curve.length, heights, grades),),
            superelevation=(),
            lane_offset=(),
            sections=(model.LaneSection(0.0, curve.length, lanes),),
        )
        junction = self.map.junctions[number]
        ids = {connection.id for connection in junction.connections}
        free = next(str(k) for k in range(len(ids) + 1) if str(k) not in ids)
        links = ((start.key.lane, own),)
        connection = model.Connection(free, road.id, road_id, "start", links)
        self.map.junctions[number] = replace(
            junction, connections=(*junction.connections, connection)
        )
        self._table = self._points = None
        return f"road {road_id}", f"turn from {_lane_path(start.key)} to {_lane_path(end.key)}"

    def _new_road_id(self) -> str:
        numbers = [int(key) for key in self.map.roads if key.isascii() and key.isdigit()]
        return str(max(numbers, default=0) + 1)

    def _inner_end(
        self, found: FoundLane, *, arriving: bool
    ) -> tuple[Pose, tuple[float, float], float]:
        """Inner border of a lane where it meets a junction.

        Its pose in the direction of driving, its height and grade, and the lane's width.
        """
        forward = bool(self.table.lane_forward[found.row])
        at_end = forward == arriving
        road = self.map.roads[found.key.road]
        s = np.array([road.length if at_end else 0.0])
        row = np.array([found.row])
        inner = self.table.lane_points(row, s, at=0.0)
        turn = 0.0 if forward else math.pi
        pose = Pose(float(inner.x[0]), float(inner.y[0]), float(inner.hdg[0]) + turn)
        grade = math.tan(float(inner.pitch[0])) * (1.0 if forward else -1.0)
        return pose, (float(inner.z[0]), grade), float(inner.width[0])


def _lane_path(key: LaneKey) -> str:
    return f"road {key.road} > laneSection {key.section} > lane {key.lane}"


def _outline_lane(table: RoadTable, lane: int) -> tuple[float, ...]:
    """A lane from begin to end of its section: x and y in turn, metres."""
    s0, s1 = float(table.lane_s0[lane]), float(table.lane_s1[lane])
    s = np.linspace(s0, s1, max(2, math.ceil((s1 - s0) / 2.0) + 1))
    sides = [table.lane_points(np.full(s.size, lane), s, at=at) for at in (0.0, 1.0)]
    left, right = (np.stack([side.x, side.y], axis=1).round(3) for side in sides)
    return tuple(np.concatenate([left, right[::-1]]).ravel().tolist())


def _kind_of(item: model.RoadObject) -> ObjectKind:
    if is_stop_line(item):
        return "stop line"
    if is_crosswalk(item):
        return "crosswalk"
    return "island" if item.type == "trafficIsland" else "object"


def _leads_to(link: model.RoadLink | None, road: RoadId, contact: str) -> bool:
    return link is not None and link.element_id == road and link.contact_point == contact


def _values_of(profile: Sequence[model.Cubic], s: FloatArray) -> list[float]:
    """Values of a profile at stations; zero before its start."""
    values = []
    for at in s.tolist():
        before = [cubic for cubic in profile if cubic.s <= at]
        start, a, b, c, d = before[-1] if before else (at, 0.0, 0.0, 0.0, 0.0)
        h = at - start
        values.append(a + h * (b + h * (c + h * d)))
    return values


def _say_moved(s: float, t: float, to_s: float, to_t: float) -> str:
    if t == to_t:
        return f"moved from s {s:.1f} to {to_s:.1f} m"
    return f"moved from s {s:.1f} m, t {t:.1f} m to s {to_s:.1f} m, t {to_t:.1f} m"


def _shifted_along(
    item: model.RoadObject, by: float, beside: float = 0.0
) -> tuple[model.Outline, ...]:
    """Outlines of an object with those corners moved that are in road coordinates."""
    return tuple(
        outline._replace(
            corners=tuple(
                c if c.local else c._replace(a=c.a + by, b=c.b + beside) for c in outline.corners
            )
        )
        for outline in item.outlines
    )


def _distance_to(ring: FloatArray, xy: tuple[float, float]) -> float:
    """Metres from a point to an outline, 0 inside."""
    import shapely

    shape = shapely.Polygon(ring) if len(ring) > 2 else shapely.LineString(ring)
    return float(shape.distance(shapely.Point(xy)))
