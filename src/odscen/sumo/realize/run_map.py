"""A map of the catalogue as runs are prepared on it, and routes where SUMO has no part in them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from odscen.lanegraph.query import node_id, walk_node_id
from odscen.records.run_plan import Plan
from odscen.scenario.document.json_form import dumps
from odscen.scenario.document.rules_document import appearing_actors
from odscen.scenario.placing.region import Region
from odscen.simulators.base import Route, RoutedRun
from odscen.sumo.realize.realization import all_road_users, as_run
from odscen.sumo.realize.road_users.free_flow import FreeFlow, environment_effect
from odscen.sumo.realize.road_users.planned_users import planned_actor
from odscen.sumo.realize.route_choice.chosen_paths import RoutesOfDemand
from odscen.sumo.realize.weather_effects import NO_EFFECT

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from odscen.base.arrays import FloatArray, Int32Array
    from odscen.lanegraph.graphs import MapGraph
    from odscen.runs.run_settings import RunSettings
    from odscen.scenario.document.scenario_document import Scenario
    from odscen.simulators.assets import Assets
    from odscen.sumo.realize.road_user import RoadUser
    from odscen.sumo.realize.road_users.free_flow import Motion
    from odscen.sumo.realize.sumo_map import SumoMap

NO_ROUTE = "the lane graph has no route to its goal"


@dataclass(frozen=True, slots=True, eq=False)
class RunMap:
    """The :class:`~odscen.simulators.base.SimulatedMap` of all runs, with what only SUMO needs.

    Attributes
    ----------
    sumo
        Its graphs and its SUMO network.
    assets
        Sizes of models, parameters of weather.
    checked
        Gives the path of one of its files, whose content is as it was written.
    """

    name: str
    sha256: str
    sumo: SumoMap
    assets: Assets
    checked: Callable[[str], Path]

    @property
    def graph(self) -> MapGraph:
        """Lane graph, segments and pedestrian graph."""
        return self.sumo.graph

    def file(self, key: str) -> Path:
        """Path of one of its files; see :class:`~odscen.simulators.base.SimulatedMap`."""
        return self.checked(key)

    def about(self, scenario: Scenario) -> dict[str, str]:
        """What the summary of a run says of the map."""
        return {"map": scenario.map.name, "map_sha256": scenario.map.sha256}

    def routed_run(self, scenario: Scenario, settings: RunSettings) -> RoutedRun:
        """Plan a run without SUMO's files; see :class:`~odscen.simulators.base.SimulatedMap`.

        Measures, lines, parking and stations of the scenario are not part of it.
        """
        text, scenario = dumps(scenario), as_run(scenario, settings)
        until, step_length = settings.times(scenario)
        region = Region.of(self.graph, scenario.roi)
        users, unmet = all_road_users(scenario, self.sumo, region, until=until)
        effect = NO_EFFECT
        if settings.weather:
            effect = environment_effect(scenario.environment, self.assets)
        free = FreeFlow(self.graph, scenario, self.assets, effect, step_length)
        paths = RoutesOfDemand(scenario, region, region.router_over(self.sumo.drivable))
        bodies = [free.body(user) for user in users]
        later = appearing_actors(scenario.rules)
        actors, routes = {}, {}
        for index, path in paths.each_path(users, bodies):
            user = users[index]
            driver = free.driver(user, bodies[index])
            motion = free.motion(user, driver, path)
            found = len(path) > 1 and user.id not in later
            actors[index] = planned_actor(
                self.graph,
                user,
                bodies[index],
                driver,
                route_length=float(np.sum(motion.steps)),
                free_flow_time=motion.duration,
                problem=None if found else NO_ROUTE,
                appears_at=until if user.id in later else None,
            )
            if found:
                routes[index] = _make_route(self.graph, user, path, motion)
        analysis = settings.analysis(scenario)
        plan = Plan(
            scenario=scenario.name,
            seed=scenario.seed,
            until=until,
            step_length=step_length,
            net_offset=self.sumo.net_offset,
            actors=tuple(actors[index] for index in range(len(users))),
            elevation=self.sumo.elevation,
            trajectories=settings.recorded.trajectories,
            warm_up=analysis.warm_up,
            interval=analysis.interval,
            clock=scenario.demand.clock,
            criteria=scenario.criteria,
        )
        lost = [actor for actor in plan.actors if actor.problem is not None]
        return RoutedRun(
            plan=plan,
            settings=settings,
            scenario_json=text,
            problems=tuple(f"{actor.id}: {actor.problem}" for actor in lost),
            notes=tuple(unmet),
            about=self.about(scenario),
            routes={users[index].id: routes[index] for index in sorted(routes)},
        )


def _make_route(graph: MapGraph, user: RoadUser, path: Int32Array, motion: Motion) -> Route:
    nodes = graph.walks if user.person else graph.lanes
    name = walk_node_id if user.person else node_id
    x, y = nodes.x[path], nodes.y[path]
    hdg: FloatArray = nodes.hdg[path]
    if user.person:  # people walk either way along their paths
        ahead = np.arctan2(np.diff(y), np.diff(x))
        hdg = np.append(ahead, ahead[-1])
    return Route(
        nodes=tuple(name(graph, node) for node in path.tolist()),
        points=np.column_stack([x, y, nodes.z[path]]),
        hdg=hdg,
        speed=motion.speeds,
    )
