"""What the model knows of the junction ahead: who goes first, where one stops, what is behind."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from odscen.lanegraph.graphs import LaneGraph, MapGraph, WalkKind
from odscen.learning.reference.gap_states import beyond_columns, gap_states
from odscen.learning.reference.road_strips import road_strips
from odscen.learning.reference.site_features import approaches, setbacks, site_of
from tests.graphs import ToyLane, fork, key, map_graph, two_lane_road

CAR = 0


def crossing(side_limit: float = 8.0) -> MapGraph:
    """Road 1 leads east into junction 9 and on to road 2, road 5 west to 6; 3 leads north to 4."""
    lanes = [
        ToyLane(key("1", -1), -100.0, -2.0, 0.0, 80.0, "r1", next=(key("91", -1),)),
        ToyLane(key("91", -1), -20.0, -2.0, 0.0, 40.0, "j9", junction="9", next=(key("2", -1),)),
        ToyLane(key("2", -1), 20.0, -2.0, 0.0, 80.0, "r2"),
        ToyLane(key("5", -1), 100.0, 2.0, np.pi, 80.0, "r5", next=(key("95", -1),)),
        ToyLane(key("95", -1), 20.0, 2.0, np.pi, 40.0, "j9", junction="9", next=(key("6", -1),)),
        ToyLane(key("6", -1), -20.0, 2.0, np.pi, 80.0, "r6"),
        ToyLane(
            key("3", -1), 2.0, -100.0, np.pi / 2, 80.0, "r3", next=(key("93", -1),),
            speed_limit=side_limit,
        ),
        ToyLane(key("93", -1), 2.0, -20.0, np.pi / 2, 40.0, "j9", junction="9",
                next=(key("4", -1),)),
        ToyLane(key("4", -1), 2.0, 20.0, np.pi / 2, 80.0, "r4"),
    ]  # fmt: skip
    return map_graph(lanes)


def last_node(lanes: LaneGraph, road: str) -> int:
    row = next(k for k, one in enumerate(lanes.lanes.keys) if one.road == road)
    return int(lanes.lanes.first_node[row + 1]) - 1


def test_the_road_straight_on_goes_first_and_the_side_road_waits_for_all_of_its_traffic() -> None:
    lanes = crossing().lanes
    strips = road_strips(lanes)
    flow = np.ones(len(lanes.x))
    flow[last_node(lanes, "1")] = 3.0
    ways, columns = approaches(lanes, strips.on_road, limit=lanes.speed_limit, flow=flow)
    first, share, mean, most, met, metres, faster = columns
    main, side = last_node(lanes, "1"), last_node(lanes, "3")
    assert (first[main], first[side]) == (1.0, 0.0)
    assert (share[main], share[side]) == (0.0, 1.0)
    assert mean[side] == most[side] == pytest.approx(np.log(0.1 + 4.0) / 2.0)
    assert mean[main] == pytest.approx(np.log(0.1) / 2.0)
    assert met[main] == pytest.approx(np.log(0.1 + 1.0) / 2.0)
    assert metres[main] == pytest.approx(42.0 / 30.0)
    assert faster[side] == pytest.approx((8.0 - 13.89) / 15.0)
    assert len(ways.root) == 3
    assert set(strips.on_road[ways.entry]) == {True}


def test_what_stands_behind_the_junction_is_seen_before_it() -> None:
    graph = fork()
    site = site_of(graph.lanes)
    root = last_node(graph.lanes, "1")
    behind = int(site.ways.entry[site.ways.root == root][0])
    nobody = gap_states(
        site.strips, node=np.empty(0, dtype=np.int64), category=np.empty(0, dtype=np.int64),
        speed=np.empty(0),
    )  # fmt: skip
    assert not beyond_columns(site.ways, nobody)[root][:4].any()
    standing = gap_states(
        site.strips, node=np.array([behind]), category=np.array([CAR]), speed=np.array([0.0])
    )
    columns = beyond_columns(site.ways, standing)
    assert columns[root][3] == 1.0  # the slowest stands
    assert (columns[root] > 0).sum() > 4
    assert not columns[np.delete(np.arange(len(columns)), root)][:, 3].any()


def test_a_crosswalk_before_the_end_is_where_vehicles_stop() -> None:
    graph = two_lane_road(100.0)
    lanes, walks = graph.lanes, graph.walks
    strips = road_strips(lanes)
    assert not setbacks(lanes, strips, walks).any()
    across = replace(
        walks,
        x=np.array([95.0, 95.0]), y=np.array([-8.0, 0.0]),
        source=np.array([0], dtype=np.int32), target=np.array([1], dtype=np.int32),
        kind=np.array([WalkKind.CROSSWALK], dtype=np.uint8),
    )  # fmt: skip
    found = setbacks(lanes, strips, across)
    assert np.unique(found).tolist() == pytest.approx([5.0])
    site = site_of(lanes, across)
    assert site.to_line.max() == pytest.approx(98.0 - 5.0)


def test_of_lanes_beside_only_what_is_placed_before_is_seen() -> None:
    lanes = two_lane_road(100.0).lanes
    site = site_of(lanes)
    hops = np.zeros(len(lanes.x), dtype=np.int64)
    for place, row in enumerate(site.strips.rows):
        hops[row] = place
    seen = site.beside_ahead >= 0
    assert seen.any()
    assert (hops[site.beside_ahead] < hops[:, None])[seen].all()
