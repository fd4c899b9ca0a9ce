"""Native mode as a plan: who CARLA's own traffic is to drive, which route and how fast.

Pure. The Traffic Manager asks for a route only where roads fork: of the branches of a junction it
takes the one that ends on the road of the next point of its path. So the path given to it holds one
point a little beyond each junction, on the lane that the junction leads to; changes of lane in
between are commanded one by one.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from odscen.base.categories import DEFAULT_BODY, Category
from odscen.base.frames import XodrPose
from odscen.lanegraph.graphs import Relation
from odscen.scenario.placing.region import Region
from odscen.sumo.realize.driving import HEADWAY, KINDS, STYLES, TWO_WHEELER_MIN_GAP, kind_of
from odscen.sumo.realize.road_users.departures import road_users
from odscen.sumo.realize.road_users.free_flow import UNKNOWN_LIMIT

if TYPE_CHECKING:
    from odscen.base.arrays import FloatArray, Int32Array
    from odscen.lanegraph.graphs import LaneGraph, MapGraph
    from odscen.records.run_plan import Plan, PlannedActor
    from odscen.scenario.document.scenario_document import Scenario
    from odscen.sumo.realize.driving import DriverKind
    from odscen.sumo.realize.road_user import RoadUser


BEYOND = 8.0
"""Metres beyond the end of a junction at which a point of the path lies."""
AHEAD = 60.0
"""Metres that the path goes on after the goal: the Traffic Manager plans ahead of a vehicle."""


@dataclass(frozen=True, slots=True, eq=False)
class NativeActor:
    """One road user as CARLA is to drive it; OpenDRIVE frame, metres, m/s.

    Attributes
    ----------
    row
        In the plan.
    at
        Ground below the body's centre at departure, lateral offset included.
    height
        Of the body.
    route
        Shape ``(N, 3)``: from spawn to goal.
    speed
        Shape ``(N,)``: wanted at each point of the route.
    path
        Shape ``(K, 3)``: points for the Traffic Manager; empty where it has no choice.
    changes
        Points of the route at which a change of lane begins, and whether it is to the right.
    offset
        Metres to the left of the lane's centre.
    gap
        Metres to keep behind another vehicle.
    """

    row: int
    id: str
    category: Category
    model: str | None
    ego: bool
    depart: float
    at: XodrPose
    height: float
    route: FloatArray
    speed: FloatArray
    path: FloatArray
    changes: tuple[tuple[int, bool], ...] = ()
    offset: float = 0.0
    gap: float = 2.0

    @property
    def person(self) -> bool:
        """Whether it walks."""
        return self.category is Category.PEDESTRIAN


def native_actors(scenario: Scenario, graph: MapGraph, plan: Plan) -> tuple[NativeActor, ...]:
    """Every road user in the plan that has a route, in the plan's order.

    Parameters
    ----------
    plan
        Of the same scenario: gives poses, speed factors and the time that flows go on for.
    """
    region = Region.of(graph, scenario.roi)
    if scenario.seed != plan.seed:
        scenario = scenario.model_copy(update={"seed": plan.seed})
    users = {user.id: user for user in road_users(scenario, graph, region, until=plan.until)}
    actors = []
    for row, planned in enumerate(plan.actors):
        user = users[planned.id]
        nodes = region.path_over((user.spawn, *user.places), walk=user.person)
        if len(nodes) > 1:
            make = _plan_walker if user.person else _plan_driver
            kind = kind_of(user, scenario.drivers, scenario.seed)
            planned_actor = make(row, user, planned, graph, nodes)
            actors.append(
                replace(planned_actor, gap=_compute_following_distance(kind, user.category))
            )
    return tuple(actors)


def _plan_walker(
    row: int, user: RoadUser, planned: PlannedActor, graph: MapGraph, nodes: Int32Array
) -> NativeActor:
    walks = graph.walks
    route = np.column_stack([walks.x[nodes], walks.y[nodes], walks.z[nodes]])
    usual = KINDS[Category.PEDESTRIAN].max_speed * planned.speed_factor
    speed = np.full(len(route), usual if user.speed is None else user.speed)
    pose = XodrPose(planned.x, planned.y, planned.z, planned.hdg)
    return _make_actor(row, user, pose, route, speed)


def _plan_driver(
    row: int, user: RoadUser, planned: PlannedActor, graph: MapGraph, nodes: Int32Array
) -> NativeActor:
    lanes = graph.lanes
    pose = XodrPose(planned.x, planned.y, planned.z, planned.hdg, float(lanes.pitch[user.spawn]))
    beyond = _extend_beyond_goal(lanes, int(nodes[-1]))
    longer = np.concatenate([nodes, beyond])
    return _make_actor(
        row,
        user,
        pose,
        _stack_node_points(lanes, nodes),
        _compute_wanted_speeds(user, planned, lanes.speed_limit[nodes]),
        path=_stack_node_points(lanes, longer[_find_junction_marks(lanes, longer)]),
        changes=_find_lane_changes(lanes, nodes),
    )


def _make_actor(
    row: int,
    user: RoadUser,
    at: XodrPose,
    route: FloatArray,
    speed: FloatArray,
    *,
    path: FloatArray | None = None,
    changes: tuple[tuple[int, bool], ...] = (),
) -> NativeActor:
    return NativeActor(
        row=row,
        id=user.id,
        category=user.category,
        model=user.design.model,
        ego=user.design.ego,
        depart=user.depart,
        at=at,
        height=DEFAULT_BODY[user.category].height,
        route=route,
        speed=speed,
        path=np.empty((0, 3)) if path is None else path,
        changes=changes,
        offset=user.design.lateral_offset,
    )


def _compute_wanted_speeds(user: RoadUser, planned: PlannedActor, limit: FloatArray) -> FloatArray:
    """Speed wanted under each limit; the rule of :func:`odscen.sumo.realize.driving.driver`."""
    known = np.where(np.isfinite(limit), limit, UNKNOWN_LIMIT)
    most = KINDS[user.category].max_speed if user.speed is None else user.speed
    wanted: FloatArray = np.minimum(known * planned.speed_factor, most)
    return wanted


def _compute_following_distance(kind: DriverKind, category: Category) -> float:
    """Metres for ``distance_to_leading_vehicle``: the driver's gap and some of its headway."""
    style = STYLES[kind.style]
    share = TWO_WHEELER_MIN_GAP if category in (Category.MOTORCYCLE, Category.BICYCLE) else 1.0
    gap = kind.drawn.get("minGap", style.min_gap * share)
    return round(gap * kind.drawn.get("tau", style.headway * HEADWAY), 2)


def _stack_node_points(lanes: LaneGraph, nodes: Int32Array) -> FloatArray:
    return np.column_stack([lanes.x[nodes], lanes.y[nodes], lanes.z[nodes]])


def _find_lane_changes(lanes: LaneGraph, nodes: Int32Array) -> tuple[tuple[int, bool], ...]:
    here, there = nodes[:-1], nodes[1:]
    left = lanes.left_lane[here] == lanes.lane[there]
    right = lanes.right_lane[here] == lanes.lane[there]
    return tuple((int(k), bool(right[k])) for k in np.flatnonzero(left | right))


def _find_junction_marks(lanes: LaneGraph, nodes: Int32Array) -> list[int]:
    """Indices of the nodes a little beyond each junction that the route leaves."""
    inside = np.array([lanes.lanes.junctions[row] is not None for row in lanes.lane[nodes]])
    turns = {k for k, _ in _find_lane_changes(lanes, nodes)}
    marks = []
    for k in np.flatnonzero(inside[:-1] & ~inside[1:]).tolist():
        mark = k + 1
        gone = 0.0
        # Not past the next change of lane or junction, where the path has a choice of its own.
        while (
            gone < BEYOND and mark + 1 < len(nodes) and not inside[mark + 1] and mark not in turns
        ):
            a, b = nodes[mark], nodes[mark + 1]
            gone += math.hypot(lanes.x[b] - lanes.x[a], lanes.y[b] - lanes.y[a])
            mark += 1
        marks.append(mark)
    return marks


def _extend_beyond_goal(lanes: LaneGraph, goal: int) -> Int32Array:
    """Nodes after the goal, straight on as far as there are any, for :data:`AHEAD` metres."""
    nodes: list[int] = []
    gone, node = 0.0, goal
    while gone < AHEAD:
        first, last = np.searchsorted(lanes.source, [node, node + 1])
        edges = np.arange(first, last)
        edges = edges[lanes.relation[edges] == Relation.SUCCESSOR]
        if not len(edges):
            break
        # At least something, so that a circle of edges without length has an end.
        gone += max(float(lanes.length[edges[0]]), 0.1)
        node = int(lanes.target[edges[0]])
        nodes.append(node)
    return np.array(nodes, dtype=np.int32)
