from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

from odscen.lanegraph.searches import kept_trees
from odscen.lanegraph.searches.kept_trees import KEPT_TREES
from odscen.lanegraph.shortest_paths import Router
from tests.graphs import ring, two_lane_road

ROAD = two_lane_road()
NODES = len(ROAD.lanes.x)


def test_routers_of_many_regions_keep_no_more_than_one_bound(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(kept_trees, "_MOST_NODES", 10 * NODES)
    routers = [Router(ROAD) for _ in range(8)]
    for router in routers:
        for source in range(8):
            router.distances(source)
    assert KEPT_TREES.nodes == 10 * NODES
    # The last router has all of its trees, the one before it two: 10 together.
    for back, kept in ((1, 8), (2, 2), (3, 0)):
        number = routers[-back]._number
        assert sum(KEPT_TREES.get(number, source) is not None for source in range(8)) == kept


def test_what_was_let_go_is_found_again_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(kept_trees, "_MOST_NODES", 1)
    router = Router(ring())
    first = router.distances(0).copy()
    for source in range(1, 9):
        router.distances(source)
    assert KEPT_TREES.get(router._number, 0) is None
    np.testing.assert_array_equal(router.distances(0), first)


def test_threads_that_ask_at_once_get_the_same_and_are_counted_once() -> None:
    router, alone = Router(ROAD), Router(ROAD)
    sources = list(range(NODES)) * 4
    before = KEPT_TREES.nodes
    with ThreadPoolExecutor(8) as pool:
        found = list(pool.map(router.distances, sources))
    assert KEPT_TREES.nodes == before + NODES * NODES
    for source, distances in zip(sources, found, strict=True):
        np.testing.assert_array_equal(distances, alone.distances(source))
