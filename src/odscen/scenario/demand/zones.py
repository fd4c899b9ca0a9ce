"""Where the trips of demand start and end: zones, segments, and the nodes in them."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from odscen.base.categories import Category
from odscen.lanegraph.shortest_paths import Router, WalkRouter
from odscen.scenario.placing.spawn_room import late_for_changes, standing_room

if TYPE_CHECKING:
    from collections.abc import Iterable

    from numpy.typing import NDArray

    from odscen.base.arrays import BoolArray, FloatArray, Int32Array
    from odscen.scenario.document.scenario_document import Demand
    from odscen.scenario.placing.region import NodePlace, Region, Usable

PLACE_SEPARATOR = ">"
"""Between the segments of a place where vehicles are counted."""


def segments_of(demand: Demand, name: str) -> tuple[str, ...]:
    """Return the segments of a zone; any other name is that of a segment."""
    return next((zone.segments for zone in demand.zones if zone.id == name), (name,))


def zone_segments(demand: Demand) -> dict[str, tuple[str, ...]]:
    """Return the segments of all zones by their ids; of two with one id those of the first.

    For many names: :func:`segments_of` goes through all zones for each.
    """
    return {zone.id: zone.segments for zone in reversed(demand.zones)}


def place_segments(place: str) -> tuple[str, ...]:
    """Return the segments that a count station names, in the order in which they are passed."""
    return tuple(place.split(PLACE_SEPARATOR))


class ReachableEnds(NamedTuple):
    """Starts, and the ends that can be reached from each of them.

    Attributes
    ----------
    starts, ends
        Node indices, shapes ``(S,)`` and ``(E,)``.
    row
        Shape ``(S,)``: row of ``table`` of each start.
    table
        Shape ``(R, E)``: whether an end can be reached.
    from_segment, to_segment
        Rows of the segments that starts and ends lie in.
    """

    starts: Int32Array
    ends: Int32Array
    row: Int32Array
    table: BoolArray
    from_segment: Int32Array
    to_segment: Int32Array

    def goals(self, picked: NDArray[np.integer], uniform: FloatArray) -> Int32Array:
        """Choose an end for each of some starts; -1 where none but the start itself can be reached.

        Ends in the segment of the start are chosen only where there are no others.

        Parameters
        ----------
        picked
            Positions in ``starts``.
        uniform
            A random number from 0 to 1 for each.
        """
        goals = np.full(len(picked), -1, dtype=np.int32)
        alike = self.row[picked] * (int(self.from_segment.max(initial=0)) + 1)
        alike = alike + self.from_segment[picked]
        for key in np.unique(alike).tolist():
            mine = np.flatnonzero(alike == key)
            first = picked[mine[0]]
            possible = self.table[self.row[first]]
            elsewhere = possible & (self.to_segment != self.from_segment[first])
            ends = self.ends[elsewhere if elsewhere.any() else possible]
            if len(ends):
                goals[mine] = ends[(uniform[mine] * len(ends)).astype(np.intp)]
        goals[goals == self.starts[picked]] = -1
        return goals


class TripEnds:
    """Where road users of a region can start and end, on lanes and on walks.

    Vehicles start on lanes outside junctions with room for their body, where a segment has such
    places with all of the body outside junctions and not just before the end of where lanes may be
    changed, and end at the last place of a lane in its segment; pedestrians start and end anywhere
    on walks.

    Parameters
    ----------
    usable
        What the simulator can use of the map.
    taken
        Places of placed actors: no other road user starts there.
    """

    def __init__(self, region: Region, usable: Usable, *, taken: Iterable[NodePlace] = ()) -> None:
        self.region = region
        self._usable = usable
        self._taken = set(taken)
        self._known: dict[tuple[str, Category, tuple[str, ...] | None], Int32Array] = {}
        self._reach: dict[Category, tuple[Int32Array, BoolArray]] = {}

    @cached_property
    def router(self) -> Router:
        """Paths of vehicles that the simulator has."""
        drivable = self._usable.drivable
        mask = self.region.lanes
        return Router(self.region.graph, mask if drivable is None else mask & drivable)

    @property
    def walk_router(self) -> WalkRouter:
        """Paths of pedestrians."""
        return self.region.walk_router

    def router_of(self, category: Category) -> Router | WalkRouter:
        """Paths of a category."""
        return self.walk_router if category is Category.PEDESTRIAN else self.router

    def starts(self, category: Category, segments: tuple[str, ...] | None = None) -> Int32Array:
        """Nodes on which a road user can start, ascending; of the whole region without segments."""
        return self._nodes_in_segments("start", category, segments)

    def ends(self, category: Category, segments: tuple[str, ...] | None = None) -> Int32Array:
        """Nodes at which a path can end, ascending; of the whole region without segments."""
        return self._nodes_in_segments("end", category, segments)

    def reachable_ends(
        self,
        category: Category,
        origins: tuple[str, ...] | None = None,
        destinations: tuple[str, ...] | None = None,
    ) -> ReachableEnds:
        """Starts and ends between segments, or anywhere; starts without any end are left out."""
        starts, ends = self.starts(category, origins), self.ends(category, destinations)
        every_start, every_end = self.starts(category), self.ends(category)
        if category not in self._reach:
            self._reach[category] = self.router_of(category).reach(every_start, every_end)
        rows, table = self._reach[category]
        row = rows[np.searchsorted(every_start, starts)]
        table = table[:, np.searchsorted(every_end, ends)]
        some = np.asarray(table.any(axis=1))[row]
        starts, row = starts[some], row[some]
        segment = self._segment_of_nodes(category)
        return ReachableEnds(starts, ends, row, table, segment[starts], segment[ends])

    def _nodes_in_segments(
        self, what: str, category: Category, segments: tuple[str, ...] | None
    ) -> Int32Array:
        key = what, category, segments
        if key not in self._known:
            if segments is not None:
                every = self._nodes_in_segments(what, category, None)
                self._known[key] = every[
                    self._mask_of_segments(segments)[self._segment_of_nodes(category)[every]]
                ]
            else:
                mask = (
                    self._mask_with_room(category)
                    if what == "start"
                    else self._mask_of_ends(category)
                )
                self._known[key] = np.flatnonzero(mask).astype(np.int32)
        return self._known[key]

    def _mask_of_ends(self, category: Category) -> BoolArray:
        return self._mask_of_walkable if category is Category.PEDESTRIAN else self._stretch_ends

    def _segment_of_nodes(self, category: Category) -> Int32Array:
        graph = self.region.graph
        return (graph.walks if category is Category.PEDESTRIAN else graph.lanes).segment

    def _mask_of_segments(self, segments: tuple[str, ...]) -> BoolArray:
        wanted = set(segments)
        return np.array([name in wanted for name in self.region.graph.segments.ids], dtype=np.bool_)

    def _mask_with_room(self, category: Category) -> BoolArray:
        walk = category is Category.PEDESTRIAN
        room = self._mask_of_walkable.copy() if walk else self._vehicle_room(category)
        room[[place.node for place in self._taken if place.walk == walk]] = False
        return room

    def _vehicle_room(self, category: Category) -> BoolArray:
        lanes = self.region.graph.lanes
        body = self._usable.bodies[category]
        room = self._on_roads & standing_room(lanes, body, allowed=self._mask_of_spawnable)
        # Inside a junction SUMO lets vehicles appear across others that drive beside their lane.
        clear = room & standing_room(lanes, body, allowed=self._mask_outside_junctions)
        timely = ~late_for_changes(lanes, body)
        starts = np.zeros(len(room), dtype=np.bool_)
        settled = np.zeros(len(self.region.graph.segments.ids), dtype=np.bool_)
        for places in (clear & timely, clear, room & timely, room):
            starts |= places & ~settled[lanes.segment]
            settled[lanes.segment[places]] = True
        return starts

    @cached_property
    def _mask_outside_junctions(self) -> BoolArray:
        """Nodes outside junctions, of the map and of the simulator."""
        inside = self._usable.in_junction
        return self._on_roads if inside is None else self._on_roads & ~inside

    @cached_property
    def _mask_of_spawnable(self) -> BoolArray:
        usable = self._usable.spawnable
        lanes = self.region.graph.lanes
        return np.ones(len(lanes.x), dtype=np.bool_) if usable is None else usable

    @cached_property
    def _on_roads(self) -> BoolArray:
        lanes = self.region.graph.lanes
        roads = np.array([junction is None for junction in lanes.lanes.junctions], dtype=np.bool_)
        on_roads: BoolArray = self.router.mask & roads[lanes.lane]
        return on_roads

    @cached_property
    def _mask_of_walkable(self) -> BoolArray:
        usable = self._usable.walkable
        mask = self.region.walks if usable is None else self.region.walks & usable
        router = self.walk_router
        connected = np.zeros(len(mask), dtype=np.bool_)
        connected[router.nodes[router.out_degree > 0]] = True
        walkable: BoolArray = mask & connected
        return walkable

    @cached_property
    def _stretch_ends(self) -> BoolArray:
        """Last node of each lane in each segment on which a body fits."""
        lanes = self.region.graph.lanes
        good = np.flatnonzero(self._on_roads & self._mask_of_spawnable)
        last = np.ones(len(good), dtype=np.bool_)
        last[:-1] = (np.diff(lanes.lane[good]) != 0) | (np.diff(lanes.segment[good]) != 0)
        ends = np.zeros(len(lanes.x), dtype=np.bool_)
        ends[good[last]] = True
        return ends
