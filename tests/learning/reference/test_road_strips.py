"""Strips of road: who is ahead of whom, and how far it is to the stop line."""

from __future__ import annotations

import numpy as np
import pytest

from odscen.lanegraph.graphs import LaneGraph
from odscen.learning.reference.gap_states import FREE, gap_states
from odscen.learning.reference.road_strips import road_strips
from odscen.learning.reference.site_features import expected_flows, site_of
from tests.graphs import ToyLane, fork, key, map_graph, ring, two_lane_road

CAR, STANDING = 0, 0.0


def test_the_nodes_of_a_lane_follow_each_other_to_its_end() -> None:
    lanes = two_lane_road(100.0).lanes
    strips = road_strips(lanes)
    first = np.flatnonzero(lanes.lane == 0)
    assert strips.ahead[first].tolist() == [*first[1:].tolist(), -1]
    assert strips.to_end[first[0]] == pytest.approx(98.0)
    assert strips.from_start[first[-1]] == pytest.approx(98.0)
    assert set(strips.root[first].tolist()) == {int(first[-1])}
    assert len(strips.rows) == len(first)
    assert sorted(np.concatenate(strips.rows).tolist()) == list(range(len(lanes.x)))


def test_junctions_are_in_no_strip() -> None:
    lanes = fork().lanes
    strips = road_strips(lanes)
    inside = np.array([name is not None for name in lanes.lanes.junctions])[lanes.lane]
    assert inside.any()
    assert not strips.on_road[inside].any()
    assert not inside[np.concatenate(strips.rows)].any()


def test_a_ring_is_cut_once() -> None:
    lanes = ring().lanes
    strips = road_strips(lanes)
    assert int((strips.ahead < 0).sum()) == 1
    assert len(np.concatenate(strips.rows)) == len(lanes.x)


def test_gap_leader_and_queue_are_those_of_the_vehicles_ahead() -> None:
    lanes = two_lane_road(100.0).lanes
    strips = road_strips(lanes)
    own = np.flatnonzero(lanes.lane == 0)
    states = gap_states(
        strips,
        node=own[[49, 45, 30]],  # 0, 8 and 38 m before the end
        category=np.array([CAR, CAR, CAR]),
        speed=np.array([STANDING, STANDING, 7.0]),
    )
    assert states.gap[own[45]] == pytest.approx(8.0 - 2.5)
    assert states.queue[own[45]] == 1
    assert states.gap[own[40]] == pytest.approx(10.0 - 2.5)
    assert states.queue[own[40]] == 2
    assert states.leader[own[10]] == 7.0
    assert states.queue[own[10]] == 0
    other = np.flatnonzero(lanes.lane == 1)
    assert states.gap[other].tolist() == [FREE] * len(other)
    assert states.leader[other].tolist() == [-1.0] * len(other)


@pytest.mark.parametrize("graph", [fork(), ring(), two_lane_road(60.0)])
def test_features_are_finite_and_about_one(graph) -> None:  # type: ignore[no-untyped-def]
    columns = site_of(graph.lanes).columns
    assert np.isfinite(columns).all()
    assert np.abs(columns).max() <= 3.0


def test_traffic_is_expected_where_trips_come_together() -> None:
    lanes = fork().lanes
    flow = expected_flows(lanes).lane
    roads = [row for row, name in enumerate(lanes.lanes.junctions) if name is None]
    assert np.mean(flow[roads]) == pytest.approx(1.0)
    assert (flow >= 0).all()


def leaving(inner: float, outer: float) -> LaneGraph:
    """Road 1 of two lanes, of which the inner leads to road 2 and the outer to road 3, metres."""
    in1, out1 = key("1", -1), key("1", -2)
    return map_graph(
        [
            ToyLane(in1, 0.0, 0.0, 0.0, 200.0, "r1", next=(key("8", -1),), right=out1),
            ToyLane(out1, 0.0, -3.5, 0.0, 200.0, "r1", next=(key("9", -1),), left=in1),
            ToyLane(key("8", -1), 200.0, 0.0, 0.0, 20.0, "j7", junction="7",
                    next=(key("2", -1),)),
            ToyLane(key("9", -1), 200.0, -3.5, 0.0, 20.0, "j7", junction="7",
                    next=(key("3", -1),)),
            ToyLane(key("2", -1), 220.0, 0.0, 0.0, inner, "r2"),
            ToyLane(key("3", -1), 220.0, -3.5, 0.0, outer, "r3"),
        ]
    ).lanes  # fmt: skip


@pytest.mark.parametrize(("inner", "outer", "fuller"), [(900.0, 90.0, -1), (90.0, 900.0, -2)])
def test_the_lane_by_which_most_leave_a_road_is_expected_to_be_the_fuller(
    inner: float, outer: float, fuller: int
) -> None:
    lanes = leaving(inner, outer)
    road, lane = expected_flows(lanes)
    row = {one: place for place, one in enumerate(lanes.lanes.keys)}
    busy, empty = row[key("1", fuller)], row[key("1", -3 - fuller)]
    assert lane[busy] > 2.0 * lane[empty]
    assert road[busy] == road[empty] == pytest.approx((lane[busy] + lane[empty]) / 2.0)
