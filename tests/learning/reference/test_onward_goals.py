"""Goals of vehicles that are driving: none needs a lane change right ahead."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from odscen.learning.reference.reference_generator import NO_GOAL, onward_goals
from tests.graphs import fork, ring, two_lane_road

if TYPE_CHECKING:
    from collections.abc import Sequence

    from odscen.base.arrays import BoolArray, IntArray
    from odscen.lanegraph.graphs import MapGraph


def drawn(
    graph: MapGraph, nodes: Sequence[int] | IntArray, seed: int = 1, inside: BoolArray | None = None
) -> IntArray:
    roads = np.ones(len(graph.lanes.x), dtype=np.bool_) if inside is None else inside
    speed = np.full(len(nodes), 10.0)
    rng = np.random.default_rng(seed)
    return onward_goals(graph, roads, node=np.array(nodes), speed=speed, rng=rng)


def test_each_goes_on_to_the_end_of_its_own_lane_where_it_is_near() -> None:
    graph = two_lane_road(300.0)
    lanes = graph.lanes
    nodes = np.flatnonzero((lanes.offset > 190.0) & (lanes.offset < 290.0))
    for seed in range(5):
        goals = drawn(graph, nodes, seed)
        np.testing.assert_array_equal(lanes.lane[goals], lanes.lane[nodes])
        np.testing.assert_array_equal(goals, lanes.lanes.first_node[1:][lanes.lane[nodes]] - 1)


def test_all_ends_ahead_are_drawn() -> None:
    graph = fork()
    roads = [graph.lanes.lanes.keys[one].road for one in graph.lanes.lane]
    start = next(k for k, key in enumerate(roads) if key == "1" and graph.lanes.hdg[k] == 0.0)
    goals = drawn(graph, [start] * 40)
    assert {roads[goal] for goal in goals} == {"2", "3"}


def test_where_no_road_ends_goals_are_elsewhere_on_the_ring() -> None:
    graph = ring()
    goals = drawn(graph, [3, 4, 5])
    assert (goals != NO_GOAL).all()
    assert not set(goals.tolist()) & {3, 4, 5}


def test_nothing_outside_the_region_is_a_goal_and_the_last_node_has_none() -> None:
    graph = two_lane_road(100.0)
    inside = graph.lanes.offset < 60.0
    goals = drawn(graph, np.flatnonzero(inside), inside=inside)
    assert inside[goals[goals != NO_GOAL]].all()
    assert drawn(graph, [int(graph.lanes.lanes.first_node[1]) - 1]).tolist() == [NO_GOAL]


def test_the_same_random_numbers_give_the_same_goals() -> None:
    graph = fork()
    nodes = np.arange(0, len(graph.lanes.x), 3)
    np.testing.assert_array_equal(drawn(graph, nodes, 4), drawn(graph, nodes, 4))


def test_who_is_too_fast_for_the_turn_goes_straight_on() -> None:
    graph = fork()
    roads = np.ones(len(graph.lanes.x), dtype=np.bool_)
    names = [graph.lanes.lanes.keys[one].road for one in graph.lanes.lane]
    end = max(k for k, name in enumerate(names) if name == "1" and graph.lanes.hdg[k] == 0.0)

    def goals(speed: float) -> set[str]:
        found = onward_goals(
            graph, roads, node=np.full(40, end), speed=np.full(40, speed),
            rng=np.random.default_rng(1),
        )  # fmt: skip
        return {str(names[goal]) for goal in found}

    assert goals(13.0) == {"2"}
    assert goals(5.0) == {"2", "3"}
