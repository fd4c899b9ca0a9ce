from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.sparse import csgraph, csr_matrix

from odscen.lanegraph import shortest_paths
from odscen.lanegraph.searches.blocks import Blocks
from odscen.lanegraph.searches.corridor_paths import CorridorPaths
from odscen.lanegraph.searches.edge_matrix import shortest_edges
from odscen.lanegraph.shortest_paths import Router, WalkRouter
from tests.lanegraph.shipped_graphs import shipped


def searched(matrix: csr_matrix, source: int, target: int) -> tuple[float, list[int]]:
    """Length and nodes of the path that scipy finds in the whole graph."""
    metres, before = csgraph.dijkstra(matrix, indices=source, return_predecessors=True)
    steps = [target]
    while (step := int(before[steps[-1]])) >= 0:
        steps.append(step)
    return float(metres[target]), steps[::-1] if np.isfinite(metres[target]) else []


def in_lines(count: int, length: int, rng: np.random.Generator, *, metres: bool) -> csr_matrix:
    """Lines of nodes, each of which ends in two others; all metres are 1 if not random."""
    rows, columns = [], []
    for line in range(count):
        nodes = list(range(line * length, (line + 1) * length))
        rows += [*nodes[:-1], nodes[-1], nodes[-1]]
        columns += [*nodes[1:], *(rng.integers(0, count, 2) * length).tolist()]
    weights = rng.uniform(0.1, 3.0, len(rows)) if metres else np.ones(len(rows))
    return shortest_edges(count * length, np.array(rows), np.array(columns), weights)


def between_lines(matrix: csr_matrix, length: int) -> np.ndarray:
    edges = matrix.tocoo()
    return edges.row // length != edges.col // length


@pytest.mark.slow
@settings(deadline=None, max_examples=30)
@given(st.integers(0, 10**6), st.booleans())
def test_a_path_is_the_one_that_a_search_of_all_nodes_finds(seed: int, metres: bool) -> None:
    rng = np.random.default_rng(seed)
    matrix = in_lines(20, 7, rng, metres=metres)
    blocks = Blocks(matrix, between_lines(matrix, 7))
    assert blocks.are_of_use
    corridors = CorridorPaths(blocks)
    undecided = 0
    for source, target in rng.integers(0, matrix.shape[0], (40, 2)).tolist():
        found = corridors.find(source, target)
        if found is None:
            undecided += 1
            continue
        assert (found.metres, found.nodes.tolist()) == searched(matrix, source, target)
    assert undecided == 0 or not metres  # only lengths that are alike leave it to the heap
    assert undecided < 40


def test_two_paths_that_are_equally_long_to_the_last_digit_are_not_decided_here() -> None:
    # 0 -> 1 -> 3 and 0 -> 2 -> 3; what follows is one path.
    rows, columns = np.array([0, 0, 1, 2, *range(3, 19)]), np.array([1, 2, 3, 3, *range(4, 20)])
    matrix = shortest_edges(20, rows, columns, np.full(len(rows), 2.0))
    corridors = CorridorPaths(Blocks(matrix, np.ones(matrix.nnz, dtype=np.bool_)))
    assert corridors.find(0, 19) is None
    assert corridors.find(3, 19).nodes.tolist() == [*range(3, 20)]
    longer = matrix.copy()
    longer.data[0] += 1e-9  # as little as that decides
    nodes = CorridorPaths(Blocks(longer, np.ones(matrix.nnz, dtype=np.bool_))).find(0, 19).nodes
    assert nodes.tolist() == [0, 2, *range(3, 20)]


def test_where_no_path_leads_the_length_is_infinite() -> None:
    matrix = shortest_edges(20, np.arange(19), np.arange(1, 20), np.ones(19))
    way = CorridorPaths(Blocks(matrix, np.ones(19, dtype=np.bool_))).find(5, 3)
    assert np.isinf(way.metres)
    assert len(way.nodes) == 0


def test_a_graph_that_is_not_cut_has_no_corridors() -> None:
    matrix = shortest_edges(20, np.arange(19), np.arange(1, 20), np.ones(19))
    assert not Blocks(matrix, np.zeros(19, dtype=np.bool_)).are_of_use


@pytest.mark.parametrize(
    ("name", "kind"),
    [("town_5x5", Router), ("town_5x5", WalkRouter), ("motorway_weave", Router)],
)
def test_on_a_map_paths_and_distances_are_those_in_the_tree_of_the_source(
    name: str, kind: type[Router | WalkRouter], monkeypatch: pytest.MonkeyPatch
) -> None:
    graph = shipped(name)
    trees, router = kind(graph), kind(graph)
    pairs = np.random.default_rng(1).integers(0, len(trees.nodes), (60, 2)).tolist()
    expected = [(trees.distance(*pair), trees.path(*pair).tolist()) for pair in pairs]
    monkeypatch.setattr(shortest_paths, "_LARGE", 0)
    monkeypatch.setattr(shortest_paths, "_TREES", 0)
    found = [(router.distance(*pair), router.path(*pair).tolist()) for pair in pairs]
    assert found == expected
    assert router._corridor_paths is not None
    # Nearly all of it came from corridors.
    assert router._searched <= len(pairs) // 10


def test_of_many_goals_of_one_source_a_tree_has_all(monkeypatch: pytest.MonkeyPatch) -> None:
    graph = shipped("roundabout")
    expected = [Router(graph).distance(0, node) for node in range(0, 400, 10)]
    monkeypatch.setattr(shortest_paths, "_LARGE", 0)
    monkeypatch.setattr(shortest_paths, "_TREES", 0)
    router = Router(graph)
    assert [router.distance(0, node) for node in range(0, 400, 10)] == expected
    assert router._searched == 1
