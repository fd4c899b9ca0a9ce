from __future__ import annotations

import numpy as np
import pytest
from scipy.sparse import csgraph

from odscen.lanegraph.searches.blocks import Blocks
from odscen.lanegraph.searches.edge_matrix import shortest_edges

LINES, LENGTH = 20, 6


@pytest.mark.parametrize("together", [True, False])
@pytest.mark.parametrize("seed", range(4))
def test_gates_are_as_far_as_a_search_of_all_nodes_finds_them(seed: int, together: bool) -> None:
    """Whether starts come block by block, or each from another block than the one before."""
    rng = np.random.default_rng(seed)
    line = np.arange(LINES * LENGTH) // LENGTH
    along = np.flatnonzero(line[:-1] == line[1:])
    leaves = np.arange(LINES).repeat(2)
    entered = (leaves + rng.integers(1, LINES, len(leaves))) % LINES  # no line leads to itself
    rows, columns = np.r_[along, leaves * LENGTH + LENGTH - 1], np.r_[along + 1, entered * LENGTH]
    matrix = shortest_edges(len(line), rows, columns, rng.uniform(0.1, 3.0, len(rows)))
    edges = matrix.tocoo()
    blocks = Blocks(matrix, line[edges.row] != line[edges.col])
    assert blocks.are_of_use
    nodes = np.arange(len(line)) if together else np.arange(len(line)).reshape(LINES, LENGTH).T
    for node in nodes.ravel().tolist():
        metres = csgraph.dijkstra(matrix, indices=node)
        outset = blocks.outset(int(blocks.row[node]))
        for gate, found in zip(blocks.node[blocks.gates].tolist(), outset.gates, strict=True):
            if line[gate] != line[node]:  # what lies in its own block is nearby
                assert found == pytest.approx(metres[gate], rel=blocks.rounding)
        home = blocks.node[outset.first : outset.first + len(outset.nearby)]
        ahead = (home >= node).tolist()
        assert np.isfinite(outset.nearby).tolist() == ahead
        assert outset.nearby[ahead] == pytest.approx(metres[home][ahead], rel=blocks.rounding)
