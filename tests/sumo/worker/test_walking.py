"""Who can walk somewhere on the pedestrian graph can walk there in SUMO, and off the road."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
import pytest

from odscen.lanegraph.shortest_paths import WalkRouter
from odscen.sumo.realize.sumo_map import SumoMap
from odscen.sumo.realize.walk_planner import Walk, WalkPlanner
from tests.convert.maps import Converted, converted, named
from tests.sumo.traffic import Person, Traffic, drive

MAPS = ("town_5x5", "signal_crossing", "roundabout", "carla-2020/Town04", "carla-2020/Town07")
each_map = pytest.mark.parametrize("name", MAPS)

PAIRS = 200
WALKED = 30
FAR = 600.0
"""Metres of a walk that is really walked, at most."""


@dataclass(frozen=True, eq=False)
class Town:
    made: Converted
    sumo: SumoMap
    router: WalkRouter
    planner: WalkPlanner
    pairs: tuple[tuple[int, int], ...]
    """Connected on the graph; ``apart`` are not."""
    apart: tuple[tuple[int, int], ...]

    def edge(self, node: int) -> str:
        place = self.sumo.walk_places.of(node)
        assert place is not None
        return self.sumo.net.lanes[place[0]].edge

    def plan(self, pair: tuple[int, int]) -> Walk:
        return self.planner.plan(self.router.path(*pair), length=0.4, lateral_offset=0.0)


@cache
def town(name: str) -> Town:
    made = converted(named(name))
    where = SumoMap.of(made.graph, made.network.table)
    walks = made.graph.walks
    random = np.random.default_rng(20)
    usable = np.flatnonzero(where.walk_places.lane >= 0)
    assert len(usable) >= 0.98 * len(walks.x)
    router = WalkRouter(made.graph)
    pairs, apart = [], []
    for start in random.choice(usable, size=PAIRS).tolist():
        reached = router.reachable(start)[usable]
        pairs.append((start, int(random.choice(usable[reached]))))
        if not reached.all():
            apart.append((start, int(random.choice(usable[~reached]))))
    planner = WalkPlanner(walks, where.net, where.walk_places)
    return Town(made, where, router, planner, tuple(pairs), tuple(apart))


@each_map
def test_what_the_graph_connects_sumo_connects(name: str) -> None:
    here = town(name)
    table = here.made.network.table
    assert [p for p in here.pairs if not table.walk_connected(*map(here.edge, p))] == []


@pytest.mark.parametrize("name", ["carla-2020/Town04", "carla-2020/Town07"])
def test_what_the_graph_does_not_connect_sumo_does_not(name: str) -> None:
    here = town(name)
    table = here.made.network.table
    assert len(here.apart) > 100
    assert not [p for p in here.apart if table.walk_connected(*map(here.edge, p))]


@each_map
def test_walks_are_planned_from_the_spawn_to_the_goal(name: str) -> None:
    here = town(name)
    for pair in here.pairs:
        walk = here.plan(pair)
        assert (walk.edges[0], walk.edges[-1]) == (here.edge(pair[0]), here.edge(pair[1]))
        length = here.made.network.table.edges[walk.edges[-1]].length
        assert 0.0 <= walk.arrival_pos <= length


@cache
def walked(name: str) -> tuple[list[tuple[int, int]], Traffic]:
    """Some of the pairs that are not too far from each other, and what SUMO made of them."""
    here = town(name)
    near = [(a, b) for a, b in here.pairs if here.router.distances(a)[b] < FAR][:WALKED]
    persons = [
        Person(f"p{k}", " ".join(w.edges), depart=2.0 * k, pos=w.depart_pos, arrival=w.arrival_pos)
        for k, w in enumerate(map(here.plan, near))
    ]
    return near, drive(here.made, *persons, until=3600.0, step=0.5)


@pytest.mark.slow
@each_map
def test_persons_arrive_where_they_want_to(name: str) -> None:
    graph = town(name).made.graph.walks
    pairs, run = walked(name)
    assert len(pairs) >= 25
    assert run.arrived == {f"p{number}" for number in range(len(pairs))}
    # Two who meet on a walk a metre wide stand for a second, and SUMO says so.
    assert [line for line in run.said.splitlines() if "is jammed on edge" not in line] == []
    for number, (_, goal) in enumerate(pairs):
        last = run.seen[f"p{number}"][-1]
        aside = graph.width[goal]  # they keep to their side of the walk
        assert np.hypot(last.x - graph.x[goal], last.y - graph.y[goal]) < 1.5 + aside


@pytest.mark.slow
@each_map
def test_persons_never_walk_on_a_carriageway(name: str) -> None:
    table = town(name).made.network.table
    edges = {one.edge for seen in walked(name)[1].seen.values() for one in seen}
    functions = {table.edges[edge].function for edge in edges}
    assert functions == {"normal", "walkingarea", "crossing"}
    for edge in edges:
        allowed = {table.lanes[lane].allowed for lane in table.edges[edge].lanes}
        assert allowed == {frozenset({"pedestrian"})}, edge


@pytest.mark.slow
@each_map
def test_persons_do_not_go_a_longer_way_than_that_of_the_graph(name: str) -> None:
    pairs, run = walked(name)
    for number, (start, goal) in enumerate(pairs):
        places = np.array([(one.x, one.y) for one in run.seen[f"p{number}"]])
        length = float(np.linalg.norm(np.diff(places, axis=0), axis=1).sum())
        assert length < 1.2 * town(name).router.distances(start)[goal] + 20.0
