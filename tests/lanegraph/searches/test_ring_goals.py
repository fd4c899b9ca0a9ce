from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.sparse import csgraph, csr_matrix

from odscen.lanegraph import shortest_paths
from odscen.lanegraph.searches.blocks import Blocks
from odscen.lanegraph.searches.connected_parts import ConnectedParts
from odscen.lanegraph.searches.edge_matrix import shortest_edges
from odscen.lanegraph.searches.farthest_nodes import FarthestNodes
from odscen.lanegraph.searches.ring_goals import RingGoals
from odscen.lanegraph.shortest_paths import Router, WalkRouter
from tests.lanegraph.shipped_graphs import shipped

LINES, LENGTH = 16, 6


def closed(rng: np.random.Generator, *, metres: bool) -> csr_matrix:
    """Pairs of lines beside each other with changes between them; each ends in two other lines."""
    rows, columns = [], []
    for line in range(LINES):
        nodes = list(range(line * LENGTH, (line + 1) * LENGTH))
        beside = [node + (LENGTH if line % 2 == 0 else -LENGTH) for node in nodes]
        change = rng.random(LENGTH - 1) < 0.5
        rows += [*nodes[:-1], *(n for n, c in zip(nodes[:-1], change, strict=True) if c)]
        columns += [*nodes[1:], *(n for n, c in zip(beside[1:], change, strict=True) if c)]
        rows += [nodes[-1]] * 2
        columns += (rng.integers(0, LINES, 2) * LENGTH).tolist()
    weights = rng.uniform(0.1, 3.0, len(rows)) if metres else np.ones(len(rows))
    return shortest_edges(LINES * LENGTH, np.array(rows), np.array(columns), weights)


def farthest(matrix: csr_matrix, start: int, is_road: np.ndarray) -> list[int]:
    """First of the farthest nodes of each lane, by a search of all nodes."""
    away = csgraph.dijkstra(matrix, indices=start)
    away[~np.isfinite(away)] = -1.0
    away[start] = -1.0
    by_lane = away.reshape(LINES, LENGTH)
    reached = by_lane.max(axis=1) >= 0
    kept = reached & is_road if (reached & is_road).any() else reached
    return [int(lane * LENGTH + by_lane[lane].argmax()) for lane in np.flatnonzero(kept)]


@pytest.mark.slow
@settings(deadline=None, max_examples=25)
@given(st.integers(0, 10**6), st.booleans(), st.sampled_from([0.0, 0.1, 0.5]))
def test_goals_are_those_of_a_search_of_all_nodes_that_are_allowed(
    seed: int, metres: bool, barred: float
) -> None:
    rng = np.random.default_rng(seed)
    matrix = closed(rng, metres=metres)
    line = np.arange(matrix.shape[0]) // LENGTH
    edges = matrix.tocoo()
    blocks = Blocks(matrix, line[edges.row] // 2 != line[edges.col] // 2)
    assert blocks.are_of_use
    starts = np.arange(LINES, dtype=np.int32) * LENGTH
    is_road = np.arange(LINES) % 4 != 3
    searched: list[int] = []

    def by_search(start: int) -> np.ndarray:
        searched.append(start)
        return np.array(farthest(matrix, start, is_road))

    goals = RingGoals(
        matrix,
        ConnectedParts(matrix, directed=True).of,
        FarthestNodes(blocks, starts),
        nodes=np.arange(matrix.shape[0]),
        is_road=is_road,
        searched=by_search,
    )
    allowed = None if barred == 0.0 else rng.random(matrix.shape[0]) >= barred
    count = 0
    for start in rng.permutation(matrix.shape[0])[:12].tolist():
        found, every = goals.of(start, allowed), farthest(matrix, start, is_road)
        expected = [node for node in every if allowed is None or allowed[node]]
        assert len(found) == len(expected)
        assert [int(found[place]) for place in range(len(found))] == expected
        reached = np.isfinite(csgraph.dijkstra(matrix, indices=start))
        for goal in (node for one in every for node in (one, one - 1)):
            if goal != start and reached[goal]:
                assert goals.is_goal(start, goal) in (None, goal in every)
        count += len(expected)
    assert count > 0
    assert not searched or not metres  # only lengths that are alike leave it to a search


@pytest.mark.parametrize("kind", [Router, WalkRouter])
def test_on_a_closed_town_goals_are_those_of_each_start(
    kind: type[Router | WalkRouter], monkeypatch: pytest.MonkeyPatch
) -> None:
    graph = shipped("town_5x5")
    alone, router = kind(graph), kind(graph)
    rng = np.random.default_rng(3)
    spawns = rng.integers(0, len(alone.mask), 60).tolist()
    # Of some lanes only the first nodes may be goals, of others none.
    allowed = rng.random(len(alone.mask)) < 0.97
    expected = [(found := alone.goal_candidates(spawn))[allowed[found]] for spawn in spawns]
    assert min(map(len, expected)) > 0
    monkeypatch.setattr(shortest_paths, "_MANY", 0)
    found = list(router.each_candidates(spawns, lambda _: allowed))
    assert [len(goals) for goals in found] == [len(goals) for goals in expected]
    for goals, known in zip(found, expected, strict=True):
        place = int(rng.integers(len(known)))
        assert int(goals[place]) == known[place]
    # Most of it was found without a search of all nodes.
    assert router._searched <= len(spawns) // 4
