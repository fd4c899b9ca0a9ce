"""Vehicles that pass count stations, and when: planned, from routes, or seen, from a run."""

from __future__ import annotations

import bisect
import math
from collections import Counter, defaultdict
from typing import TYPE_CHECKING

import numpy as np

from odscen.scenario.demand.count_stations import StationFinder, transitions
from odscen.sumo.realize.route_paths import each_path

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    import polars as pl

    from odscen.base.arrays import Int32Array
    from odscen.lanegraph.graphs import LaneGraph, MapGraph
    from odscen.lanegraph.shortest_paths import Router
    from odscen.scenario.demand.count_stations import Observation
    from odscen.scenario.placing.region import Region
    from odscen.sumo.realize.road_user import RoadUser
    from odscen.sumo.realize.route_choice.chosen_paths import RoutesOfDemand
    from odscen.sumo.realize.sumo_map import SumoMap

Passages = Counter[tuple[str, float, float]]
"""Vehicles by place, begin and end of the slice."""

UNKNOWN_LIMIT = 13.89
"""m/s assumed where the map gives no limit: 50 km/h."""
_MOST_BETWEEN = 8
"""Segments without a record, between two with one, that are filled in at most."""


def planned_passages(
    users: Sequence[RoadUser],
    region: Region,
    drivable: Router,
    seen: Sequence[Observation],
    *,
    routes: RoutesOfDemand | None = None,
) -> Passages:
    """Count vehicles at the places of observations, as they would pass without congestion.

    Parameters
    ----------
    routes
        Those that trips choose; the shortest if not given.
    """
    passing = StationFinder(region.graph, [observation.place for observation in seen])
    clock = _Slices(seen)
    found: Passages = Counter()
    for _, passed in each_passing(users, region, drivable, passing, routes=routes):
        for place, time in passed:
            clock.count(found, passing.places[place], time)
    return found


def each_passing(
    users: Sequence[RoadUser],
    region: Region,
    drivable: Router,
    passing: StationFinder,
    *,
    routes: RoutesOfDemand | None = None,
    assigned: Mapping[str, Int32Array] | None = None,
) -> Iterator[tuple[RoadUser, list[tuple[int, float]]]]:
    """Yield vehicles with the places that they pass, by number, and when, with a free road.

    The order is not that of ``users``; pedestrians and those without a route are left out.
    """
    lanes = region.graph.lanes
    vehicles = [user for user in users if not user.person]
    if routes is None:
        found = each_path(vehicles, region, drivable)
    else:
        found = routes.each_path(vehicles, assigned=assigned)
    for index, path in found:
        if len(path):
            segment = lanes.segment[path]
            first = np.flatnonzero(np.diff(segment, prepend=-1))
            times = _times_along(lanes, path)[first] + vehicles[index].depart
            passed = passing.of(segment[first].tolist())
            yield vehicles[index], [(place, float(times[step])) for place, step in passed]


def seen_passages(
    trajectories: pl.LazyFrame, sumo_map: SumoMap, seen: Sequence[Observation]
) -> tuple[Passages, int]:
    """Count vehicles at the places of observations, as a run's trajectories have them.

    Who goes to the end of a segment ends with its front in the junction behind it, and has not
    passed from the one to the other.

    Parameters
    ----------
    trajectories
        As the run wrote them, see docs/runs.md.

    Returns
    -------
    The vehicles by observation, and how many vehicles there are in all.
    """
    import polars as pl

    passing = StationFinder(sumo_map.graph, [observation.place for observation in seen])
    clock = _Slices(seen)
    found: Passages = Counter()
    segments = _segment_of_lane(sumo_map)
    known = pl.DataFrame(
        {"lane": list(segments), "segment": list(segments.values())},
        schema={"lane": pl.String, "segment": pl.Int64},
    )
    changes = (
        trajectories.select(
            time=pl.col("timestep_time"),
            id=pl.col("vehicle_id").cast(pl.String),
            lane=pl.col("vehicle_lane").cast(pl.String),
        )
        .join(known.lazy(), on="lane", how="inner")
        .with_columns(arrived=pl.col("time").max().over("id") < pl.col("time").max())
        .sort("id", "time")
        .filter((pl.col("segment") != pl.col("segment").shift(1).over("id")).fill_null(value=True))
        .group_by("id", maintain_order=True)
        .agg("time", "segment", pl.col("arrived").first())
        .collect()
    )
    between = _SegmentFiller(sumo_map.graph)
    junctions = np.array(sumo_map.graph.segments.kinds) == "junction"
    for times, route, arrived in changes.select("time", "segment", "arrived").iter_rows():
        whole, moments = between.filled(route, times)
        if arrived and junctions[whole[-1]]:
            whole, moments = whole[:-1], moments[:-1]
        for place, step in passing.of(whole):
            clock.count(found, passing.places[place], moments[step])
    return found, len(changes)


class _Slices:
    """The slices of time of each place, to count passages in."""

    def __init__(self, seen: Sequence[Observation]) -> None:
        self._of_place: dict[str, list[tuple[float, float]]] = defaultdict(list)
        for observation in seen:
            self._of_place[observation.place].append((observation.begin, observation.end))
        for slices in self._of_place.values():
            slices[:] = sorted(set(slices))

    def count(self, passages: Passages, place: str, time: float) -> None:
        slices = self._of_place[place]
        row = bisect.bisect_right(slices, (time, math.inf)) - 1
        if row >= 0 and time < slices[row][1]:
            passages[place, *slices[row]] += 1


class _SegmentFiller:
    """Fills segments in that a vehicle crossed from one record to the next.

    Such as a junction, or several short sections of a road that are one SUMO lane together.
    """

    def __init__(self, graph: MapGraph) -> None:
        row = {str(name): index for index, name in enumerate(graph.segments.ids)}
        self._onwards = {
            row[segment]: {row[other] for other in others}
            for segment, others in transitions(graph).items()
        }
        self._known: dict[tuple[int, int], tuple[int, ...]] = {}

    def filled(self, route: Sequence[int], times: Sequence[float]) -> tuple[list[int], list[float]]:
        """Segments and times of a route with what lies between two that do not touch."""
        whole, moments = [route[0]], [times[0]]
        for segment, time in zip(route[1:], times[1:], strict=True):
            gap = whole[-1], segment
            if gap not in self._known:
                self._known[gap] = self._shortest_between(*gap)
            steps = (*self._known[gap], segment)
            whole += steps
            moments += [time] * len(steps)
        return whole, moments

    def _shortest_between(self, one: int, other: int) -> tuple[int, ...]:
        """Segments between two on the shortest sequence; none if there are several of a length."""
        fronts: list[dict[int, list[int]]] = [{one: []}]
        reached = {one}
        while fronts[-1] and len(fronts) <= _MOST_BETWEEN + 1:
            front: dict[int, list[int]] = defaultdict(list)
            for near in fronts[-1]:
                for far in self._onwards.get(near, set()) - reached:
                    front[far].append(near)
            fronts.append(front)
            reached |= front.keys()
            if other in front:
                break
        steps = [other]
        for front in fronts[:0:-1]:
            before = front.get(steps[-1], [])
            if len(before) != 1:
                return ()
            steps.append(before[0])
        return tuple(steps[-2:0:-1])


def _times_along(lanes: LaneGraph, path: np.ndarray) -> np.ndarray:
    """Seconds after departure at each node of a path, at the limit."""
    limit = lanes.speed_limit[path[:-1]]
    limit = np.where(np.isfinite(limit), limit, UNKNOWN_LIMIT)
    steps = np.hypot(np.diff(lanes.x[path]), np.diff(lanes.y[path]))
    return np.concatenate([[0.0], np.cumsum(steps / limit)])


def _segment_of_lane(sumo_map: SumoMap) -> dict[str, int]:
    """Row of the segment in which each SUMO lane lies, by the lane's id.

    The one with most of its nodes; the lanes inside SUMO's junctions begin a little before those
    of OpenDRIVE and count as the junction.
    """
    places = sumo_map.lane_places
    on_lane = places.lane >= 0
    pairs = np.stack([places.lane[on_lane], sumo_map.graph.lanes.segment[on_lane]], axis=1)
    unique, number = np.unique(pairs, axis=0, return_counts=True)
    kinds = np.array(sumo_map.graph.segments.kinds)
    internal = np.array([sumo_map.net.lanes[name].internal for name in places.lanes])
    inside = internal[unique[:, 0]] & (kinds[unique[:, 1]] == "junction")
    segment_by_lane: dict[str, int] = {}
    for row in np.lexsort((number, inside)).tolist():
        segment_by_lane[places.lanes[unique[row, 0]]] = int(unique[row, 1])
    return segment_by_lane
