from __future__ import annotations

import math

import networkx as nx
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from odscen.base.errors import InputError
from odscen.lanegraph import shortest_paths
from odscen.lanegraph.graph_files import to_networkx
from odscen.lanegraph.graphs import MapGraph
from odscen.lanegraph.query import induced, node_id, node_ids, node_index, walk_node_id
from odscen.lanegraph.shortest_paths import Router, WalkRouter
from tests.graphs import fork, line_of_segments, ring, two_lane_road
from tests.lanegraph.shipped_graphs import shipped

FORK = fork()
ROUTER = Router(FORK)
PLAIN, PLAIN_WALKS = to_networkx(FORK)


def names(graph, nodes) -> list[str]:
    return [node_id(graph, int(i)) for i in nodes]


def test_the_last_nodes_of_both_branches_are_the_goals() -> None:
    assert names(FORK, Router(FORK).goal_candidates(0)) == ["2.0.-1.29", "3.0.-1.29"]


def test_goals_stay_inside_the_region() -> None:
    mask = induced(FORK, ["r1", "j9", "r2"]).nodes
    goals = names(FORK, Router(FORK, mask).goal_candidates(0))
    assert goals == ["91.0.-1.8", "2.0.-1.29"]


def test_the_last_nodes_of_neighbouring_lanes_are_terminal() -> None:
    graph = two_lane_road()
    assert names(graph, Router(graph).goal_candidates(0)) == ["1.0.-2.49", "1.0.-1.49"]


def test_a_terminal_spawn_has_no_goal() -> None:
    last = node_index(FORK, "2.0.-1.29")
    assert Router(FORK).is_terminal(last)
    assert len(Router(FORK).goal_candidates(last)) == 0


def test_in_a_ring_the_goal_is_the_node_behind_the_spawn() -> None:
    graph = ring()
    assert names(graph, Router(graph).goal_candidates(10)) == ["1.0.-1.9"]


def test_a_spawn_outside_the_region_is_refused_by_name() -> None:
    mask = induced(FORK, ["r2"]).nodes
    with pytest.raises(InputError, match=r"node 1\.0\.-1\.0 is outside the region"):
        Router(FORK, mask).goal_candidates(0)


def test_a_path_outside_the_region_is_empty() -> None:
    mask = induced(FORK, ["r1", "j9"]).nodes
    assert len(Router(FORK, mask).path(0, node_index(FORK, "2.0.-1.0"))) == 0


def test_the_path_back_is_no_path() -> None:
    assert not Router(FORK).reachable(node_index(FORK, "2.0.-1.0"))[0]


def test_a_path_changes_lane_once() -> None:
    graph = two_lane_road()
    path = Router(graph).path(0, node_index(graph, "1.0.-1.49"))
    assert len(path) == 50
    lanes = graph.lanes.lane[path]
    assert np.count_nonzero(np.diff(lanes)) == 1


def test_dead_ends_of_the_walks_are_the_goals_of_walkers() -> None:
    goals = WalkRouter(FORK).goal_candidates(10)
    assert [walk_node_id(FORK, int(i)) for i in goals] == ["ped.1.0.-2.0", "ped.2.0.-2.29"]


def test_walkers_go_both_ways() -> None:
    forth = WalkRouter(FORK).path(3, 70)
    back = WalkRouter(FORK).path(70, 3)
    np.testing.assert_array_equal(forth, back[::-1])
    assert len(forth) == 68


def test_the_distance_of_two_nodes_is_that_among_all_and_none_leads_outside_the_region() -> None:
    mask = induced(FORK, ["r1", "j9"]).nodes
    inside, outside = Router(FORK, mask), node_index(FORK, "2.0.-1.0")
    for router in (inside, ROUTER):
        among = router.distances(0).tolist()
        assert [router.distance(0, node) for node in range(len(among))] == among
    assert inside.distance(0, outside) == math.inf
    assert ROUTER.distance(0, outside) < math.inf


@settings(max_examples=30, deadline=None)
@given(st.integers(0, len(FORK.lanes.x) - 1), st.integers(0, len(FORK.lanes.x) - 1))
def test_paths_are_as_short_as_networkx_finds_them(source: int, target: int) -> None:
    path = ROUTER.path(source, target)
    ids = node_ids(FORK)
    if not nx.has_path(PLAIN, ids[source], ids[target]):
        assert len(path) == 0
        return
    shortest = nx.shortest_path_length(PLAIN, ids[source], ids[target], weight="length")
    assert path[0] == source
    assert path[-1] == target
    assert ROUTER.distances(source)[target] == pytest.approx(shortest, abs=1e-4)


@pytest.mark.slow
@settings(max_examples=30, deadline=None)
@given(
    st.sets(st.integers(1, 6), min_size=1).map(sorted),
    st.data(),
)
def test_goals_are_reachable_and_terminal_in_any_region(
    numbers: list[int], data: st.DataObject
) -> None:
    graph = line_of_segments(6)
    mask = induced(graph, [f"r{i}" for i in numbers]).nodes
    spawn = data.draw(st.sampled_from(np.flatnonzero(mask).tolist()))
    router = Router(graph, mask)
    goals = router.goal_candidates(spawn)
    assert len(goals) == (0 if router.is_terminal(spawn) else 1)
    for goal in goals:
        assert router.is_terminal(goal)
        assert mask[router.path(spawn, goal)].all()


def test_a_walk_router_knows_distances() -> None:
    distances = WalkRouter(FORK).distances(0)
    assert distances[49] == pytest.approx(98.0)


@pytest.mark.parametrize("kind", [Router, WalkRouter])
@pytest.mark.parametrize("graph", [FORK, ring(), two_lane_road(), line_of_segments(4)])
def test_many_paths_at_once_are_those_found_one_by_one(kind: type, graph: MapGraph) -> None:
    router = kind(graph)
    count = len(router.mask)
    sources, targets = np.divmod(np.arange(0, count * count, 7), count)
    one_by_one = [router.reachable(int(s))[t] for s, t in zip(sources, targets, strict=True)]
    assert router.leads(sources, targets).tolist() == one_by_one


@pytest.mark.parametrize("kind", [Router, WalkRouter])
@pytest.mark.parametrize("graph", [FORK, ring(), two_lane_road(), line_of_segments(4)])
def test_a_candidate_is_what_the_list_of_candidates_holds(kind: type, graph: MapGraph) -> None:
    router = kind(graph)
    for spawn in range(0, len(router.mask), 13):
        candidates = set(router.goal_candidates(spawn).tolist())
        assert router.has_goals(spawn) == bool(candidates)
        reached = set(np.flatnonzero(router.reachable(spawn)).tolist()) - {spawn}
        assert {goal for goal in reached if router.is_candidate(spawn, goal)} == candidates


@pytest.mark.slow
@pytest.mark.parametrize("kind", [Router, WalkRouter])
@pytest.mark.parametrize("graph", [FORK, ring(), two_lane_road(), line_of_segments(4)])
def test_candidates_of_many_are_those_of_each(
    kind: type, graph: MapGraph, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(shortest_paths, "_MANY", 0)
    router = kind(graph)
    spawns = range(0, len(router.mask), 7)
    found = [[*map(int, goals)] for goals in router.each_candidates([*spawns])]
    assert found == [router.goal_candidates(spawn).tolist() for spawn in spawns]
    assert any(found) or not spawns  # not every toy map has walks
    pairs = [
        (spawn, goal)
        for spawn in spawns
        for goal in np.flatnonzero(router.reachable(spawn)).tolist()
        if goal != spawn
    ]
    are = router.are_candidates([spawn for spawn, _ in pairs], [goal for _, goal in pairs])
    assert are == [goal in found[spawn // 7] for spawn, goal in pairs]


def test_of_many_one_outside_the_region_is_refused_by_name(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(shortest_paths, "_MANY", 0)
    router = Router(FORK, induced(FORK, ["r2"]).nodes)
    with pytest.raises(InputError, match=r"node 1\.0\.-1\.0 is outside the region"):
        list(router.each_candidates([0]))


def test_on_a_closed_town_goals_of_many_are_those_of_each(monkeypatch: pytest.MonkeyPatch) -> None:
    router = Router(shipped("town_5x5"))
    pairs = []
    for spawn in np.random.default_rng(1).integers(0, len(router.nodes), 20).tolist():
        goals = router.goal_candidates(spawn)[::50].tolist()
        pairs += [(spawn, node) for goal in goals for node in (goal, goal - 1)]
    expected = [router.is_candidate(*pair) for pair in pairs]
    assert 0 < sum(expected) < len(expected)
    monkeypatch.setattr(shortest_paths, "_MANY", 0)
    assert router.are_candidates(*zip(*pairs, strict=True)) == expected


def test_paths_to_a_node_are_as_long_as_those_from_each_source() -> None:
    graph = fork()
    router = Router(graph)
    nodes = np.arange(len(graph.lanes.x))
    goal = int(nodes[-1])
    there = router.paths_to(goal)
    for source, path, metres in zip(
        nodes.tolist(), there.paths(nodes), there.distance(nodes).tolist(), strict=True
    ):
        assert metres == pytest.approx(float(router.distances(source)[goal]))
        assert len(path) == len(router.path(source, goal))
        marks, first = there.stretches(np.array([source]), graph.lanes.segment)
        if len(path):
            segments = graph.lanes.segment[path]
            changes = np.flatnonzero(np.diff(segments, prepend=-1))
            assert marks[0].tolist() == segments[changes].tolist()
            assert first[0].tolist() == path[changes].tolist()


def test_what_can_be_reached_from_many_is_what_each_reaches() -> None:
    graph = fork()
    router = Router(graph)
    nodes = np.arange(0, len(graph.lanes.x), 3)
    row, table = router.reach(nodes, nodes)
    each = np.array([router.reachable(node)[nodes] for node in nodes.tolist()])
    assert (table[row] == each).all()
