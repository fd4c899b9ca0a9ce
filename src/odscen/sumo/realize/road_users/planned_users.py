"""Each road user as SUMO gets it: body, driver, route, and its line in the plan of the run."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from odscen.lanegraph.query import node_id, walk_node_id
from odscen.records.run_plan import PlannedActor
from odscen.scenario.placing.region import turns_round
from odscen.sumo.realize.driving import KINDS
from odscen.sumo.realize.road_users.free_flow import FreeFlow
from odscen.sumo.realize.route_choice.chosen_paths import RoutesOfDemand
from odscen.sumo.realize.route_planner import NoRouteError, Route, RoutePlanner
from odscen.sumo.realize.traffic_measures.measure_actions import MeasureActions
from odscen.sumo.realize.transit.parking_places import parked_route
from odscen.sumo.realize.transit.stop_places import left_out
from odscen.sumo.realize.walk_planner import Walk, WalkPlanner

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from odscen.base.arrays import Int32Array
    from odscen.base.categories import Body
    from odscen.lanegraph.graphs import MapGraph
    from odscen.scenario.document.rules_document import StoryRule
    from odscen.scenario.document.scenario_document import Scenario
    from odscen.scenario.placing.region import Region
    from odscen.sumo.realize.driving import Driver
    from odscen.sumo.realize.road_user import RoadUser
    from odscen.sumo.realize.road_users.free_flow import ModelSizes
    from odscen.sumo.realize.routes_file import RoutesFile
    from odscen.sumo.realize.rules.walks_across import RoadsAcross
    from odscen.sumo.realize.sumo_map import SumoMap
    from odscen.sumo.realize.transit.parking_places import ParkingPosition
    from odscen.sumo.realize.transit.stop_places import StopPlace
    from odscen.sumo.realize.weather_effects import WeatherEffect

STOP_MARGIN = 3.0
"""Metres before the end of a lane within which SUMO lets no vehicle depart at speed."""


class _PlannedRoute(NamedTuple):
    """Route of a road user to its goal; metres and seconds. Without one, the problem says why."""

    route: Route | Walk | None
    problem: str | None
    length: float
    free_flow_time: float | None


class RoadUserWriter:
    """Adds road users to the demand; collects what could not be done."""

    def __init__(
        self,
        sumo_map: SumoMap,
        region: Region,
        assets: ModelSizes | None,
        scenario: Scenario,
        effect: WeatherEffect,
        demand: RoutesFile,
        step_length: float,
        stops: Mapping[str, StopPlace],
    ) -> None:
        graph = sumo_map.graph
        self.demand = demand
        self.problems: list[str] = []
        self.notes: list[str] = []
        self.actions = MeasureActions()
        self.areas: Mapping[str, ParkingPosition] = {}
        self.until = 0.0
        self.assigned: Mapping[str, Int32Array] = {}
        self._graph = graph
        self._region = region
        self._scenario = scenario
        self._step_length = step_length
        self._stops = stops
        self._bays = {name for name, stop in stops.items() if stop.bay}
        self._free = FreeFlow(graph, scenario, assets, effect, step_length)
        self._net, self._lane_places = sumo_map.net, sumo_map.lane_places
        sources = {link.source for light in sumo_map.lights for link in light.links}
        self._signalled = {
            lane.edge for name in sources if (lane := sumo_map.net.lanes.get(name)) is not None
        }
        self._drivable = region.router_over(sumo_map.drivable)
        self._routes = RoutePlanner(graph.lanes, sumo_map.net, sumo_map.lane_places)
        self._ways = RoutesOfDemand(scenario, region, self._drivable)
        self._period = scenario.demand.routes.period
        self._walk_places = sumo_map.walk_places
        self._walks = WalkPlanner(graph.walks, sumo_map.net, sumo_map.walk_places)
        self.roads: RoadsAcross | None = None
        self.crossings: list[StoryRule] = []
        self._rule_ids = {rule.id for rule in scenario.rules}

    def add(self, users: Sequence[RoadUser]) -> tuple[PlannedActor, ...]:
        """Write road users in their order and return the plan for them.

        Routes are found in another order, those from one spawn or to one goal together.
        """
        bodies = [self._free.body(user) for user in users]
        drivers = [self._free.driver(*pair) for pair in zip(users, bodies, strict=True)]
        routes: dict[int, _PlannedRoute] = {}
        for index, path in self._ways.each_path(users, bodies, self.assigned):
            routes[index] = self._plan_route(users[index], bodies[index], drivers[index], path)
        return tuple(
            self._write_user(user, body, behaviour, routes[index])
            for index, (user, body, behaviour) in enumerate(
                zip(users, bodies, drivers, strict=True)
            )
        )

    def _plan_route(
        self, user: RoadUser, body: Body, behaviour: Driver, path: Int32Array
    ) -> _PlannedRoute:
        problem, route = None, None
        try:
            route = self._plan_user_route(user, body, path)
        except NoRouteError as error:
            problem = str(error)
        if route is not None and user.design.crosses_anywhere and self.roads is not None:
            across = self.roads.cross(path, after=user.via[-1] if user.via else None)
            self.crossings += across.rules(self._graph, user.id, self._rule_ids)
            path = across.path
        motion = self._free.motion(user, behaviour, path)
        return _PlannedRoute(route, problem, float(np.sum(motion.steps)), motion.duration)

    def _plan_user_route(self, user: RoadUser, body: Body, path: Int32Array) -> Route | Walk:
        offset = user.design.lateral_offset
        if user.person:
            if (node := turns_round(path)) is not None:
                raise NoRouteError(
                    f"its walk would turn round at {walk_node_id(self._graph, node)!r}"
                )
            walk = self._walks.plan(path, length=body.length, lateral_offset=offset)
            self._refuse_missed(user, walk.edges)
            return walk
        vclass = KINDS[user.category].vclass
        route = self._routes.plan(
            path,
            length=body.length,
            vclass=vclass,
            lateral_offset=offset,
            longitudinal_offset=user.design.longitudinal_offset,
        )
        self._refuse_missed(user, route.edges)
        route = self.actions.fitted(
            route, self._net, length=body.length, depart=user.depart, vclass=vclass
        )
        missed = left_out((self._stops[visit.stop] for visit in user.visits), route.edges)
        if missed is not None:
            raise NoRouteError(f"its route on the SUMO network does not pass stop {missed.id!r}")
        route = parked_route(
            route,
            self._net,
            vclass,
            begins=self.areas[user.begins.area] if user.begins else None,
            ends=self.areas[user.ends.area] if user.ends else None,
        )
        # A trip ends in a segment, not on a lane of it: no vehicle has to stop for a lane change.
        return replace(route, arrival_lane=None) if user.trip else route

    def _refuse_missed(self, user: RoadUser, edges: Sequence[str]) -> None:
        """Raise if a route does not pass the places that it is to lead through, in their order."""
        places = self._walk_places if user.person else self._lane_places
        name = walk_node_id if user.person else node_id
        rest, here = iter(edges), None
        for node in user.via:
            place = places.of(node)
            lane = None if place is None else self._net.lanes[place[0]]
            if lane is None or lane.internal or lane.edge == here:
                continue  # inside a junction, the edges before and behind it say where it passes
            if lane.edge not in rest:
                raise NoRouteError(
                    f"its route on the SUMO network does not pass {name(self._graph, node)!r}"
                )
            here = lane.edge

    def _write_user(
        self, user: RoadUser, body: Body, behaviour: Driver, planned: _PlannedRoute
    ) -> PlannedActor:
        if planned.route is None:
            self.problems.append(f"{user.id}: {planned.problem}")
        else:
            if isinstance(planned.route, Walk):
                self.demand.add_walk(user, behaviour, planned.route)
            else:
                speed, most = self._initial_speeds(user, behaviour, planned.route)
                self.demand.add_vehicle(
                    user,
                    behaviour,
                    planned.route,
                    bays=self._bays,
                    speed=speed,
                    most=most,
                    stretch=self._net.edge_lanes[planned.route.edges[0]][
                        planned.route.depart_lane
                    ].length,
                    looks_every=self._period if self._ways.informed(user) else None,
                )
            self.notes += [f"{user.id}: {repair.words}" for repair in planned.route.repairs]
        return self._planned_actor_of(user, body, behaviour, planned)

    def _initial_speeds(
        self, user: RoadUser, behaviour: Driver, route: Route
    ) -> tuple[float, float]:
        """Speed at departure, m/s, and the highest at which SUMO lets it depart.

        SUMO ends a run in which one is above what the lane allows. Of one that departs later it
        gives up the departure if it could not stop before the next junction,
        ``v t + v**2 / (2 b) > room``; those at 0 it takes unconditionally.
        """
        wanted, place = user.initial_speed or 0.0, self._lane_places.of(user.spawn)
        appears = self.demand.holds_back(user)
        if place is None or not (wanted or appears):
            return 0.0, 0.0
        allowed = self._net.lanes[place[0]].speed * behaviour.speed_factor
        allowed = min(allowed, behaviour.max_speed)
        wanted = min(wanted, allowed)
        at_once = user.depart == 0.0 and not appears
        if at_once or self._net.edge_lanes[route.edges[0]][0].internal:
            return wanted, allowed
        lane = self._net.edge_lanes[route.edges[0]][route.depart_lane]
        room = self._net.room_to_stop(lane.id, route.depart_pos, route.edges, self._signalled)
        decel = float(dict(behaviour.attributes)["decel"])
        reacting = decel * max(self._step_length, self._scenario.simulation.action_step or 0.0)
        room = max(room - STOP_MARGIN, 0.0)
        stops = math.sqrt(reacting**2 + 2.0 * decel * room) - reacting
        return wanted, min(allowed, stops)

    def _planned_actor_of(
        self, user: RoadUser, body: Body, behaviour: Driver, planned: _PlannedRoute
    ) -> PlannedActor:
        return planned_actor(
            self._graph,
            user,
            body,
            behaviour,
            route_length=planned.length,
            free_flow_time=planned.free_flow_time,
            problem=planned.problem,
            informed=self._ways.informed(user),
            appears_at=self.until if user.id in self.demand.held else None,
        )


def planned_actor(
    graph: MapGraph,
    user: RoadUser,
    body: Body,
    behaviour: Driver,
    *,
    route_length: float,
    free_flow_time: float | None,
    problem: str | None,
    informed: bool = False,
    appears_at: float | None = None,
) -> PlannedActor:
    """Line of a road user in the plan of a run.

    ``appears_at`` is the end of the run, s, of one that a rule lets appear.
    """
    nodes = graph.walks if user.person else graph.lanes
    name = walk_node_id if user.person else node_id
    spawn = user.spawn
    hdg = float(nodes.hdg[spawn])
    left, ahead = user.design.lateral_offset, user.design.longitudinal_offset
    return PlannedActor(
        id=user.id,
        category=user.category.value,
        spawn=name(graph, spawn),
        goal=name(graph, user.goal),
        depart=user.depart if appears_at is None else appears_at,
        length=body.length,
        width=body.width,
        x=float(nodes.x[spawn]) - math.sin(hdg) * left + math.cos(hdg) * ahead,
        y=float(nodes.y[spawn]) + math.cos(hdg) * left + math.sin(hdg) * ahead,
        z=float(nodes.z[spawn]),
        hdg=hdg,
        speed=user.speed,
        speed_factor=behaviour.speed_factor,
        route_length=route_length,
        free_flow_time=free_flow_time,
        model=user.design.model,
        flow=user.flow,
        ego=user.design.ego,
        problem=problem,
        informed=informed,
        begins_in=user.begins.area if user.begins else None,
        ends_in=user.ends.area if user.ends else None,
        appears=appears_at is not None,
    )
