"""The ways of many road users on the graphs, those with a common end found together.

A search over the whole graph costs milliseconds; tens of thousands of trips have a few hundred
goals between them.
"""

from __future__ import annotations

from collections import defaultdict
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from odscen.lanegraph.model import IntArray
    from odscen.lanegraph.paths import Router, WalkRouter
    from odscen.scenario.region import Region
    from odscen.sumo.people import RoadUser

TOGETHER = 500
"""Ways to one goal that are in memory at a time."""


def each_path(
    users: Sequence[RoadUser], region: Region, drivable: Router
) -> Iterator[tuple[int, IntArray]]:
    """Yield the position of each user and the nodes of its shortest way inside the region.

    Ways of vehicles lead over lanes that SUMO has, if there is such a way. The order is that of
    spawns (actors and flows) and of goals (trips of the demand).
    """
    by_spawn: dict[tuple[bool, int], list[int]] = defaultdict(list)
    by_goal: dict[tuple[bool, int], list[int]] = defaultdict(list)
    for index, user in enumerate(users):
        if user.trip:
            by_goal[user.person, user.goal].append(index)
        else:
            by_spawn[user.person, user.spawn].append(index)
    for (person, spawn), group in by_spawn.items():
        routers = _routers(region, drivable, person=person, node=spawn)
        for index in group:
            paths = (router.path(spawn, users[index].goal) for router in routers)
            yield index, next((path for path in paths if len(path)), np.empty(0, dtype=np.int32))
    for (person, goal), group in by_goal.items():
        router = region.walk_router if person else drivable
        ways = router.ways_to(goal)
        for first in range(0, len(group), TOGETHER):
            part = group[first : first + TOGETHER]
            spawns = np.array([users[index].spawn for index in part], dtype=np.int32)
            yield from zip(part, ways.paths(spawns), strict=True)


def _routers(
    region: Region, drivable: Router, *, person: bool, node: int
) -> tuple[Router | WalkRouter, ...]:
    """Routers to ask one after another."""
    if person:
        return (region.walk_router,)
    return (drivable, region.router) if drivable.mask[node] else (region.router,)
