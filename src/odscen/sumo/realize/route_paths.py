"""The routes of many road users on the graphs, those with a common end found together.

A search over the whole graph costs milliseconds; tens of thousands of trips have a few hundred
goals between them.

A vehicle does not change lanes before its front is where the lane change begins, and it needs room
for it: its route leads straight on for so long, even if the shortest one changes lanes at once.
SUMO would have it stand before the junction on the wrong lane.
"""

from __future__ import annotations

import math
from collections import defaultdict
from itertools import pairwise
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from odscen.base.categories import DEFAULT_BODY
from odscen.lanegraph.graphs import Relation
from odscen.scenario.placing.spawn_room import LANE_CHANGE

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from odscen.base.arrays import BoolArray, FloatArray, Int32Array
    from odscen.base.categories import Body
    from odscen.lanegraph.graphs import LaneGraph
    from odscen.lanegraph.searches.paths_to_goal import PathsTo
    from odscen.lanegraph.shortest_paths import Router, WalkRouter
    from odscen.scenario.placing.region import Region
    from odscen.sumo.realize.road_user import RoadUser

TOGETHER = 500
"""Ways to one goal that are in memory at a time."""

_NOWHERE = np.empty(0, dtype=np.int32)


def each_path(
    users: Sequence[RoadUser],
    region: Region,
    drivable: Router,
    bodies: Sequence[Body] | None = None,
    *,
    quickest: CostRouter | None = None,
) -> Iterator[tuple[int, Int32Array]]:
    """Yield the position of each user and the nodes of its route inside the region.

    It is the shortest one, of vehicles among those that do not change lanes at their very start, if
    there is one. Routes of vehicles lead over lanes that SUMO has, if there is such a route. The
    order is that of spawns (actors and flows) and of goals (trips of the demand).

    Parameters
    ----------
    bodies
        Of the users; those of their categories if not given.
    quickest
        What vehicles of the demand choose their routes by, instead of the length.
    """
    if bodies is None:
        bodies = [DEFAULT_BODY[user.category] for user in users]
    by_spawn: dict[tuple[bool, int], list[int]] = defaultdict(list)
    by_goal: dict[tuple[bool, int], list[int]] = defaultdict(list)
    for index, user in enumerate(users):
        if user.trip:
            by_goal[user.person, user.goal].append(index)
        else:
            by_spawn[user.person, user.spawn].append(index)
    leads = _LeadPaths(region.graph.lanes)
    for (person, spawn), group in by_spawn.items():
        goals = {index: users[index].places[0] for index in group}
        paths: dict[int, Int32Array] = {}
        if person:
            paths = {index: region.walk_router.path(spawn, goal) for index, goal in goals.items()}
        else:
            for router in (drivable, region.router):
                rest = {index: goal for index, goal in goals.items() if index not in paths}
                paths |= _find_paths_from_spawn(spawn, rest, bodies, router, leads)
        for index in group:
            path = paths.get(index, _NOWHERE)
            routers = (region.walk_router,) if person else (drivable, region.router)
            yield index, _path_through(path, users[index].places, routers) if len(path) else path
    ways = quickest or CostRouter(drivable, region.graph.lanes)
    yield from _paths_of_trips(users, by_goal, region, ways, bodies)


def _paths_of_trips(
    users: Sequence[RoadUser],
    by_goal: Mapping[tuple[bool, int], Sequence[int]],
    region: Region,
    ways: CostRouter,
    bodies: Sequence[Body],
) -> Iterator[tuple[int, Int32Array]]:
    for (person, goal), group in by_goal.items():
        if not person:
            yield from ways.paths_to(goal, {index: users[index].spawn for index in group}, bodies)
            continue
        there = region.walk_router.paths_to(goal)
        for first in range(0, len(group), TOGETHER):
            part = group[first : first + TOGETHER]
            begun = [[_LeadPath((users[index].spawn,), 0.0, 0.0)] for index in part]
            yield from zip(part, _find_paths_to_goal(goal, begun, there), strict=True)


class CostRouter:
    """Best paths of trips by length or another cost, of those that lead straight on at first.

    Parameters
    ----------
    router
        Of the lanes that SUMO has.
    lanes
        The lane graph.
    costs
        Those of the router, shape ``(E,)``; the lengths if not given.
    """

    def __init__(self, router: Router, lanes: LaneGraph, costs: FloatArray | None = None) -> None:
        self._router = router
        self._leads = _LeadPaths(lanes, costs)

    def paths_to(
        self, goal: int, spawns: Mapping[int, int], bodies: Sequence[Body]
    ) -> Iterator[tuple[int, Int32Array]]:
        """Yield the nodes of the path of each trip to a goal; ``spawns`` by the trip's index."""
        there = self._router.paths_to(goal)
        group = list(spawns)
        for first in range(0, len(group), TOGETHER):
            part = group[first : first + TOGETHER]
            begun = [
                self._leads.of(spawns[index], bodies[index], self._router.mask) for index in part
            ]
            yield from zip(part, _find_paths_to_goal(goal, begun, there), strict=True)

    def path_over(
        self, spawn: int, body: Body, places: Sequence[Int32Array], goal: int
    ) -> Int32Array:
        """Nodes of a path to the goal that passes a node of each of some places, in their order.

        Each is passed where the way to there and on to the goal is least. Empty if there is none.
        """
        if not self._router.mask[spawn] or not self._router.mask[goal]:
            return _NOWHERE
        onwards = self._router.paths_to(goal)
        for lead in self._leads.of(spawn, body, self._router.mask):
            path = np.array(lead.nodes, dtype=np.int32)
            for nodes in (*places, np.array([goal], dtype=np.int32)):
                inside = nodes[self._router.mask[nodes]]
                if not len(inside):
                    return _NOWHERE
                ahead = self._router.distances(int(path[-1]))[inside] + onwards.distance(inside)
                nearest = int(np.argmin(ahead))
                if not math.isfinite(ahead[nearest]):
                    break
                path = _join_paths(path, self._router.path(int(path[-1]), int(inside[nearest])))
            else:
                return path
        return _NOWHERE


def _join_paths(one: Int32Array, other: Int32Array) -> Int32Array:
    return np.concatenate([one, other[1:]])


def _path_through(
    path: Int32Array, places: Sequence[int], routers: Sequence[Router | WalkRouter]
) -> Int32Array:
    """A path to the first of some places, and on to the others; empty if there is none.

    Each leg is that of the first router that has one.
    """
    for here, there in pairwise(places):
        found = (router.path(here, there) for router in routers)
        further = next((array for array in found if len(array)), _NOWHERE)
        if not len(further):
            return _NOWHERE
        path = _join_paths(path, further)
    return path


class _LeadPath(NamedTuple):
    """A path straight on from a spawn: its nodes, from the spawn on, its metres and its cost."""

    nodes: tuple[int, ...]
    metres: float
    cost: float


class _LeadPaths:
    """Ways straight on from spawns, on which no vehicle changes lanes yet."""

    def __init__(self, lanes: LaneGraph, costs: FloatArray | None = None) -> None:
        follows = lanes.relation == Relation.SUCCESSOR  # edges are in the order of their sources
        self._cost = (lanes.length if costs is None else costs)[follows]
        self._target, self._length = lanes.target[follows], lanes.length[follows]
        self._first = np.searchsorted(lanes.source[follows], np.arange(len(lanes.x) + 1))

    def of(self, spawn: int, body: Body, mask: BoolArray) -> list[_LeadPath]:
        """Straight paths of a vehicle that departs, inside the mask, and last the spawn alone."""
        least = body.length / 2.0 + LANE_CHANGE
        paths: list[_LeadPath] = []
        open_ = [_LeadPath((spawn,), 0.0, 0.0)]
        while open_:
            lead = open_.pop()
            if lead.metres >= least:
                paths.append(lead)
                continue
            first, end = self._first[lead.nodes[-1] : lead.nodes[-1] + 2].tolist()
            open_ += [
                _LeadPath(
                    (*lead.nodes, int(self._target[k])),
                    lead.metres + float(self._length[k]),
                    lead.cost + float(self._cost[k]),
                )
                for k in range(first, end)
                if mask[self._target[k]]
            ]
        return [*paths, _LeadPath((spawn,), 0.0, 0.0)]


def _find_paths_from_spawn(
    spawn: int,
    goals: Mapping[int, int],
    bodies: Sequence[Body],
    router: Router,
    leads: _LeadPaths,
) -> dict[int, Int32Array]:
    """Ways of the members of a flow, or of one actor, as far as there are any."""
    if not goals or not router.mask[spawn]:
        return {}
    begun = {index: leads.of(spawn, bodies[index], router.mask) for index in goals}
    chosen = {
        index: _choose_best_lead(
            goals[index],
            mine,
            [router.distance(lead.nodes[-1], goals[index]) for lead in mine[:-1]],
        )
        for index, mine in begun.items()
    }
    paths = {
        index: _join_lead(lead, router.path(lead.nodes[-1], goals[index]))
        for index, lead in sorted(chosen.items(), key=lambda pair: pair[1].nodes[-1])
    }
    return {index: path for index, path in paths.items() if len(path)}


def _find_paths_to_goal(
    goal: int, begun: Sequence[Sequence[_LeadPath]], there: PathsTo
) -> list[Int32Array]:
    """Ways of trips to one goal; empty where there is none."""
    ends = [lead.nodes[-1] for leads in begun for lead in leads[:-1]]
    costs = iter(there.distance(np.array(ends, dtype=np.int32)).tolist())
    chosen = [_choose_best_lead(goal, leads, [next(costs) for _ in leads[:-1]]) for leads in begun]
    paths = there.paths(np.array([lead.nodes[-1] for lead in chosen], dtype=np.int32))
    return [_join_lead(lead, path) for lead, path in zip(chosen, paths, strict=True)]


def _choose_best_lead(goal: int, leads: Sequence[_LeadPath], onwards: Sequence[float]) -> _LeadPath:
    """Lead with the best path in all; the last, which is no lead, where no other leads there.

    ``onwards`` is the cost from the end of each but the last, for which nobody needs to search.
    """
    *ahead, none = leads
    fit = [
        (lead.cost + cost, number)
        for number, (lead, cost) in enumerate(zip(ahead, onwards, strict=True))
        if math.isfinite(cost) and goal not in lead.nodes
    ]
    return ahead[min(fit)[1]] if fit else none


def _join_lead(lead: _LeadPath, path: Int32Array) -> Int32Array:
    before = np.array(lead.nodes[:-1], dtype=np.int32)
    return np.concatenate([before, path]) if len(path) else path
