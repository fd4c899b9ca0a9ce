"""Where road users are planned to be at each time, before anything has been simulated.

Each is alone on the road: no other traffic, no light, no measure and no rule holds it up. It
departs when the scenario says so and follows the route that a run would give it, at the speed that
:class:`~odscen.sumo.realize.road_users.free_flow.Motion` has for it. Its last time is thus its
departure and the free-flow time against which a run counts its delay.
"""

from __future__ import annotations

import math
import re
from collections import Counter
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from odscen.base.errors import ScenarioError
from odscen.scenario.checks.scenario_checks import every_problem
from odscen.scenario.document.rules_document import appearing_actors
from odscen.sumo.realize.road_users.departures import road_users
from odscen.sumo.realize.road_users.free_flow import FreeFlow, environment_effect
from odscen.sumo.realize.route_paths import each_path

if TYPE_CHECKING:
    from collections.abc import Sequence

    from odscen.base.arrays import FloatArray, Int32Array
    from odscen.base.categories import Body
    from odscen.lanegraph.shortest_paths import Router
    from odscen.scenario.document.scenario_document import Scenario
    from odscen.scenario.placing.region import Region
    from odscen.sumo.realize.road_user import RoadUser
    from odscen.sumo.realize.road_users.free_flow import ModelSizes, Motion
    from odscen.sumo.realize.sumo_map import SumoMap

MOST_PLANNED = 5_000
"""Road users that are planned at most, those who depart first."""
GROUPED_FROM = 200
"""Road users from which on routes to a common goal are searched together, which is quicker; of
several shortest routes another may then be shown than is driven."""
TURN, STRETCH = 0.1, 30.0
"""Radians and metres between two points that are kept. What a straight line between them misses of
an arc is at most ``TURN * STRETCH / 8`` = 0.4 m."""

_PLACED = re.compile(r"(actors|flows)\[(\d+)\]")


@dataclass(frozen=True, slots=True, eq=False)
class PlannedPositions:
    """Points of the planned motion of road users; of user ``i`` rows ``first[i]:first[i + 1]``.

    Between two points it moves straight on, evenly in time.

    Attributes
    ----------
    users, bodies
        Who, by departure, then id. Whoever has no route is not there.
    first
        Shape ``(U + 1,)``.
    time
        Shape ``(R,)``, seconds after the start of the run; rising for each user.
    x, y, hdg
        Shape ``(R,)``: centres of the bodies in the OpenDRIVE frame, metres and radians.
    left_out
        Ids of actors and flows that cannot be planned as they are, and of actors that appear by a
        rule.
    not_planned
        How many more there are than :data:`MOST_PLANNED`.
    """

    users: tuple[RoadUser, ...]
    bodies: tuple[Body, ...]
    first: Int32Array
    time: FloatArray
    x: FloatArray
    y: FloatArray
    hdg: FloatArray
    left_out: tuple[str, ...]
    not_planned: int


def planned_positions(
    scenario: Scenario,
    sumo_map: SumoMap,
    region: Region,
    assets: ModelSizes | None = None,
) -> PlannedPositions:
    """Plan the placed actors and the members of flows who depart within the duration.

    Traffic of the demand and vehicles of lines are not among them.

    Parameters
    ----------
    region
        The scenario's, on the graph of the map.
    assets
        Knows the size of models and what weather does.
    """
    graph, until = sumo_map.graph, scenario.simulation.duration
    later = appearing_actors(scenario.rules)
    left_out: tuple[str, ...] = ()
    try:
        users = road_users(scenario, graph, region, until=until)
    except ScenarioError:  # to check all of them costs more than to plan them
        sound, left_out = _keep_plannable(scenario, sumo_map, region)
        users = road_users(sound, graph, region, until=until)
    users = tuple(user for user in users if user.id not in later)
    planned = users[:MOST_PLANNED]
    effect = environment_effect(scenario.environment, assets)
    step = scenario.simulation.step_length
    free = FreeFlow(graph, scenario, assets, effect, step)
    bodies = [free.body(user) for user in planned]
    paths = _plan_paths(planned, bodies, sumo_map, region)
    rows = [
        _path_points(free, user, free.motion(user, free.driver(user, body), path), path)
        for user, body, path in zip(planned, bodies, paths, strict=True)
        if len(path)
    ]
    there = [n for n, path in enumerate(paths) if len(path)]
    counts = [len(row) for row in rows]
    table = np.concatenate(rows) if rows else np.empty((0, 4))
    lost = [
        user.flow or user.id for user, path in zip(planned, paths, strict=True) if not len(path)
    ]
    return PlannedPositions(
        users=tuple(planned[n] for n in there),
        bodies=tuple(bodies[n] for n in there),
        first=np.concatenate([[0], np.cumsum(counts, dtype=np.int32)]).astype(np.int32),
        time=table[:, 0],
        x=table[:, 1],
        y=table[:, 2],
        hdg=table[:, 3],
        left_out=tuple(dict.fromkeys((*left_out, *sorted(later), *lost))),
        not_planned=len(users) - len(planned),
    )


def _keep_plannable(
    scenario: Scenario, sumo_map: SumoMap, region: Region
) -> tuple[Scenario, tuple[str, ...]]:
    """Scenario without the actors and flows that cannot be planned, and their ids."""
    wrong = {
        (match[1], int(match[2]))
        for problem in every_problem(scenario, sumo_map.graph, region=region)
        if problem.severity == "error" and (match := _PLACED.match(problem.where))
    }
    kept: dict[str, tuple[object, ...]] = {}
    gone: list[str] = []
    for kind in ("actors", "flows"):
        ones = list(enumerate(getattr(scenario, kind)))
        bad = {n for n, one in ones if (kind, n) in wrong}
        kept[kind] = tuple(user for n, user in ones if n not in bad)
        gone += [user.id for n, user in ones if n in bad]
    return scenario.model_copy(update=kept), tuple(gone)


def _plan_paths(
    users: Sequence[RoadUser], bodies: Sequence[Body], sumo_map: SumoMap, region: Region
) -> list[Int32Array]:
    """Nodes of the route of each; empty where there is none."""
    drivable = region.router_over(sumo_map.drivable)
    paths: list[Int32Array] = [np.empty(0, dtype=np.int32)] * len(users)
    asked = list(range(len(users)))
    if len(users) >= GROUPED_FROM:
        goals = Counter((user.person, user.goal) for user in users if not user.via)
        starts = Counter((user.person, user.spawn) for user in users)
        # One search for each goal instead of some for each start.
        together = [
            n
            for n, user in enumerate(users)
            if not user.via
            and goals[user.person, user.goal] > starts[user.person, user.spawn]
            and _is_searched(user, drivable)
        ]
        trips = [replace(users[n], trip=True) for n in together]
        for n, path in each_path(trips, region, drivable, [bodies[k] for k in together]):
            paths[together[n]] = path
        asked = [n for n in asked if not len(paths[n])]
    alone = [users[n] for n in asked]
    for n, path in each_path(alone, region, drivable, [bodies[k] for k in asked]):
        paths[asked[n]] = path
    return paths


def _is_searched(user: RoadUser, drivable: Router) -> bool:
    """Whether the search for routes to a goal, which begins on SUMO's lanes, takes a user."""
    return user.person or bool(drivable.mask[user.spawn] and drivable.mask[user.goal])


def _path_points(free: FreeFlow, user: RoadUser, motion: Motion, path: Int32Array) -> FloatArray:
    """Rows of time, x, y and hdg at the points of a path that are kept."""
    graph = free.graph.walks if user.person else free.graph.lanes
    x, y = graph.x[path], graph.y[path]
    # People walk either way along their paths.
    hdg = _point_directions(x, y) if user.person else graph.hdg[path]
    kept = _rows_to_keep(motion, hdg)
    offset = user.design.lateral_offset
    return np.column_stack(
        [
            user.depart + motion.times()[kept],
            (x - offset * np.sin(hdg))[kept],
            (y + offset * np.cos(hdg))[kept],
            hdg[kept],
        ]
    )


def _point_directions(x: FloatArray, y: FloatArray) -> FloatArray:
    if len(x) < 2:
        return np.zeros(len(x))
    ahead = np.arctan2(np.diff(y), np.diff(x))
    return np.append(ahead, ahead[-1])


def _rows_to_keep(motion: Motion, hdg: FloatArray) -> Int32Array:
    """Rows of a path where it has turned, gone on or changed its speed enough; the ends always."""
    gone = np.concatenate([[0.0], np.cumsum(motion.steps)])
    turns = np.abs(np.angle(np.exp(1j * np.diff(hdg))))
    turned = np.concatenate([[0.0], np.cumsum(turns)])
    new = np.zeros(len(hdg), dtype=np.bool_)
    new[[0, -1]] = True
    for along, most in ((turned, TURN), (gone, STRETCH)):
        marks = np.diff(np.floor(along / most)) > 0
        new[1:] |= marks
        if along is turned:  # straight on until the turn begins
            new[:-1] |= marks
    if len(motion.speeds) > 1:
        new[1:-1] |= np.diff(motion.speeds) != 0
    if math.isfinite(motion.accel) and len(motion.speeds):
        new |= gone < motion.speeds[0] ** 2 / (2.0 * motion.accel)
    return np.flatnonzero(new).astype(np.int32)
