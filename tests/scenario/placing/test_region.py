"""Regions of a map, and what they remember of it."""

from __future__ import annotations

import numpy as np

from odscen.lanegraph.query import node_ids
from odscen.scenario.placing import region as region_module
from odscen.scenario.placing.region import Region
from tests.graphs import ToyLane, key, map_graph


def road() -> Region:
    lanes = [
        ToyLane(key("1", -1), 0, -2, 0, 60, "r1", next=(key("2", -1),)),
        ToyLane(key("2", -1), 60, -2, 0, 40, "r2"),
    ]
    return Region.of(map_graph(lanes, adjacency=[("r1", "r2")]), ["r1", "r2", "unknown"])


def test_scenarios_with_the_same_region_share_it_and_its_paths() -> None:
    region = road()
    assert region.segments == ("r1", "r2")
    assert Region.of(region.graph, ["r1", "r2", "unknown"]) is region
    assert Region.of(region.graph, ["r1"]) is not region


def test_the_order_of_segments_makes_another_region_with_the_same_paths() -> None:
    region = road()
    other = Region.of(region.graph, ["r2", "r1"])
    assert other.segments == ("r2", "r1")
    assert other.router is region.router
    assert Region.of(region.graph, ["r1"]).router is not region.router
    mask = np.zeros(len(region.lanes), dtype=np.bool_)
    mask[0] = True
    assert region.router_over(mask) is other.router_over(mask)
    assert region.router_over(mask).nodes.tolist() == [0]
    assert region.router_over(~mask).nodes.tolist() == np.flatnonzero(~mask).tolist()


def test_a_region_that_remembers_too_much_begins_anew_and_says_the_same(monkeypatch) -> None:
    region = road()
    first, *_, last = node_ids(region.graph)
    places = region.place(first), region.place(last)
    assert all(places)
    monkeypatch.setattr(region_module, "_MOST", 0)
    for _ in range(3):
        region.look_up([(first, last), (last, first)])
        assert region.leads(*places)
        assert not region.leads(*places[::-1])
    assert len(region._ways.leads) == 2
