"""Puts roads and junctions of one map together."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple

from scenariogeneration import xodr

from tools.make_maps.geometry import Geometry, Pose, curve, plan, smooth
from tools.make_maps.parts import (
    BROKEN,
    End,
    LaneSpec,
    Profile,
    RoadRecord,
    inner_border,
    lane_section,
    section_links,
)

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence


class Link(NamedTuple):
    """A connecting road: where it comes from, by which lanes, and the road itself."""

    start: End
    lanes: tuple[int, ...]
    record: RoadRecord


class Builder:
    """Collects roads, junctions and controllers; ids count up, the same each time."""

    def __init__(self, name: str) -> None:
        self.name = name
        self.roads: list[RoadRecord] = []
        self.junctions: list[xodr.Junction] = []
        self.controllers: list[tuple[int, str, list[str]]] = []
        self.junction_controllers: dict[int, list[int]] = {}
        self.priorities: dict[int, list[tuple[int, int]]] = {}
        # CARLA confuses a junction with a road of the same id.
        self._next = {"road": 0, "junction": 10000, "object": 0, "signal": 0, "controller": 0}

    def new_id(self, kind: str) -> int:
        """Return the next id for a road, junction, object, signal or controller."""
        self._next[kind] += 1
        return self._next[kind]

    def road(
        self,
        start: Pose,
        geometries: Sequence[Geometry],
        profile: Profile,
        *,
        name: str = "",
        speed: float = 50.0,
        kind: str = "town",
        sections: Sequence[tuple[float, Profile]] = (),
        heights: tuple[float, float] = (0.0, 0.0),
        junction: int = -1,
        links: dict[int, dict[str, int]] | None = None,
    ) -> RoadRecord:
        """Add a road.

        Parameters
        ----------
        start
            Pose of the reference line's start.
        geometries
            Pieces of the reference line.
        profile
            Cross-section of the first lane section.
        speed
            Limit in km/h.
        kind
            Road type of the standard: ``town``, ``rural``, ``motorway``.
        sections
            Further lane sections: s and cross-section.
        heights
            At start and end; one smooth climb between them.
        junction
            Id of the junction that a connecting road belongs to.
        links
            Lane links to other roads, by lane id.
        """
        view, end, length = plan(start, geometries)
        profiles = ((0.0, profile), *sections)
        lanes = xodr.Lanes()
        for index, (s, part) in enumerate(profiles):
            stop = profiles[index + 1][0] if index + 1 < len(profiles) else length
            found = links or section_links([p for _, p in profiles], index)
            lanes.add_lanesection(lane_section(s, stop - s, part, found))
            self._offset(lanes, s, stop - s, part)
        road = xodr.Road(self.new_id("road"), view, lanes, road_type=junction, name=name)
        road.add_type(getattr(xodr.RoadType, kind), 0, speed=speed, speed_unit="km/h")
        if any(heights):
            road.add_elevation(0.0, *smooth(*heights, length))
        record = RoadRecord(road.id, road, profiles, start, end, length, heights)
        self.roads.append(record)
        return record

    @staticmethod
    def _offset(lanes: xodr.Lanes, s: float, length: float, profile: Profile) -> None:
        end = profile.offset if profile.offset_end is None else profile.offset_end
        if profile.offset or end or lanes.laneoffsets:
            if not lanes.laneoffsets and s > 0:
                lanes.add_laneoffset(xodr.LaneOffset())
            lanes.add_laneoffset(xodr.LaneOffset(s, *smooth(profile.offset, end, length)))

    def new_junction(self, ends: Iterable[End], name: str = "") -> xodr.Junction:
        """Add a junction that all ``ends`` lead to."""
        junction = xodr.Junction(name, self.new_id("junction"))
        self.junctions.append(junction)
        for end in ends:
            road = end.record.road
            add = road.add_successor if end.at_end else road.add_predecessor
            add(xodr.ElementType.junction, junction.id)
        return junction

    def connect(
        self,
        junction: xodr.Junction,
        start: End,
        end: End,
        pairs: Sequence[tuple[int, int]],
        *,
        speed: float = 30.0,
        kind: str = "town",
    ) -> Link:
        """Add a connecting road for lanes side by side: pairs of lane positions, inner first."""
        coming, going = start.lanes(arriving=True), end.lanes(arriving=False)
        begin = start.approach.left(-inner_border(coming, pairs[0][0]))
        finish = end.departure.left(-inner_border(going, pairs[0][1]))
        lanes = _connecting_lanes([coming[i] for i, _ in pairs], [going[j] for _, j in pairs])
        from_side, to_side = start.side(arriving=True), end.side(arriving=False)
        links = {
            -(place + 1): {"predecessor": from_side * (i + 1), "successor": to_side * (j + 1)}
            for place, (i, j) in enumerate(pairs)
        }
        record = self.road(
            begin,
            [curve(begin, finish)],
            Profile(lanes),
            speed=speed,
            kind=kind,
            heights=(start.height, end.height),
            junction=junction.id,
            links=links,
        )
        road = record.road
        road.add_predecessor(xodr.ElementType.road, start.record.id, start.contact_point)
        road.add_successor(xodr.ElementType.road, end.record.id, end.contact_point)
        connection = xodr.Connection(
            start.record.id, road.id, xodr.ContactPoint.start, len(junction.connections)
        )
        for place, (i, _) in enumerate(pairs):
            connection.add_lanelink(from_side * (i + 1), -(place + 1))
        junction.add_connection(connection)
        return Link(start, tuple(i for i, _ in pairs), record)


def _connecting_lanes(
    coming: Sequence[LaneSpec], going: Sequence[LaneSpec]
) -> tuple[LaneSpec, ...]:
    """Lanes of a connecting road; a broken line only between two lanes for cars."""
    cars = [lane.kind not in ("biking", "sidewalk", "shoulder") for lane in coming]
    return tuple(
        replace(
            lane,
            marks=BROKEN if all(cars[place : place + 2]) and place + 1 < len(cars) else (),
            width_end=None if there.width == lane.width else there.width,
        )
        for place, (lane, there) in enumerate(zip(coming, going, strict=True))
    )
