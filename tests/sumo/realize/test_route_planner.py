from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from odscen.lanegraph.query import node_index, walk_node_index
from odscen.lanegraph.shortest_paths import Router, WalkRouter
from odscen.sumo.realize.road_net import Link, RoadNet, RoadNetLane
from odscen.sumo.realize.route_planner import (
    NoRouteError,
    RepairKind,
    Route,
    RoutePlanner,
    connected,
)
from odscen.sumo.realize.walk_planner import Walk, WalkPlanner
from tests.sumo.toys import STARTS, lane_places, street, street_net, walk_places

GRAPH = street()
NET = street_net()
ROUTER = Router(GRAPH)
WALKS = WalkRouter(GRAPH)


def plan(spawn: str, goal: str, *, length: float = 4.5, vclass: str = "passenger") -> Route:
    path = ROUTER.path(node_index(GRAPH, spawn), node_index(GRAPH, goal))
    planner = RoutePlanner(GRAPH.lanes, NET, lane_places(GRAPH.lanes))
    return planner.plan(path, length=length, vclass=vclass)


def front_x(route: Route) -> float:
    first = route.edges[0]
    return STARTS[":9" if first.startswith(":") else first] + route.depart_pos


def test_the_front_is_half_a_body_ahead_of_the_spawn() -> None:
    route = plan("1.0.-2.10", "3.0.-2.49")
    assert route.edges == ("in", "out")
    assert (route.depart_lane, route.depart_pos) == (1, pytest.approx(21.0 + 2.25))
    assert (route.arrival_lane, route.arrival_pos) == (1, 98.0)
    assert route.repairs == ()


def test_a_body_is_at_its_goal_when_its_centre_is() -> None:
    route = plan("1.0.-2.10", "3.0.-2.9")
    assert route.arrival_pos == pytest.approx(139.0 - 122.0 + 2.25)


def test_a_front_beyond_the_lane_departs_on_the_internal_lane_of_its_route() -> None:
    route = plan("1.0.-1.48", "3.0.-1.20")
    assert route.edges == (":9_0", "out")
    assert route.depart_lane == 1
    assert front_x(route) == pytest.approx(97.0 + 2.25)


def test_a_spawn_on_the_trimmed_end_of_a_lane_keeps_its_place() -> None:
    route = plan("1.0.-1.49", "3.0.-1.20")
    assert route.edges == (":9_0", "out")
    assert front_x(route) == pytest.approx(99.0 + 2.25)


def test_a_long_body_can_reach_over_the_whole_junction() -> None:
    route = plan("1.0.-1.48", "3.0.-1.40", length=60.0)
    assert route.edges == ("out",)
    assert front_x(route) == pytest.approx(97.0 + 30.0)


@given(st.integers(0, 48), st.integers(10, 49), st.sampled_from([-1, -2]), st.floats(0.5, 18.0))
def test_the_front_is_always_where_the_body_says(
    spawn: int, goal: int, lane: int, length: float
) -> None:
    route = plan(f"1.0.{lane}.{spawn}", f"3.0.{lane}.{goal}", length=length)
    assert front_x(route) == pytest.approx(2 * spawn + 1 + length / 2)
    assert route.edges[-1] == "out"


def test_a_goal_inside_the_junction_is_reached_by_leaving_it() -> None:
    route = plan("1.0.-2.10", "2.0.-2.9")
    assert route.edges == ("in", "out")
    assert (route.arrival_lane, route.arrival_pos) == (None, 1.0)


def test_a_front_inside_the_junction_that_the_goal_is_in_is_no_further_back() -> None:
    route = plan("1.0.-2.48", "2.0.-2.9")
    assert route.edges == (":9_0", "out")
    assert front_x(route) == pytest.approx(97.0 + 2.25)


def test_a_spawn_inside_the_junction_departs_there() -> None:
    route = plan("2.0.-2.3", "3.0.-2.9")
    assert route.edges == (":9_0", "out")
    assert front_x(route) == pytest.approx(107.0 + 2.25)


def test_a_goal_just_ahead_lies_beyond_the_front() -> None:
    route = plan("1.0.-2.10", "1.0.-2.11", length=12.0)
    assert route.edges == ("in",)
    assert route.arrival_pos > route.depart_pos


def test_a_change_of_lanes_needs_no_other_edge() -> None:
    route = plan("1.0.-2.5", "3.0.-1.20")
    assert route.edges == ("in", "out")
    assert (route.depart_lane, route.arrival_lane) == (1, 2)


def test_a_class_that_may_not_drive_there_has_no_route() -> None:
    with pytest.raises(NoRouteError):
        plan("1.0.-2.10", "3.0.-2.9", vclass="tram")


def test_nodes_without_a_place_are_passed_over() -> None:
    places = lane_places(GRAPH.lanes)
    holes = np.where(np.arange(len(places.lane)) % 3 == 1, -1, places.lane).astype(np.int32)
    spawn = int(np.flatnonzero(holes[:50] >= 0)[5])
    path = ROUTER.path(spawn, node_index(GRAPH, "3.0.-2.9"))
    planner = RoutePlanner(GRAPH.lanes, NET, replace(places, lane=holes))
    assert planner.plan(path, length=4.5, vclass="passenger").edges == ("in", "out")
    nothing = replace(places, lane=np.full_like(holes, -1))
    with pytest.raises(NoRouteError, match="no lane anywhere"):
        RoutePlanner(GRAPH.lanes, NET, nothing).plan(path, length=4.5, vclass="passenger")


def chain(*lengths: float, gaps: tuple[int, ...] = ()) -> RoadNet:
    lanes = {f"e{i}_0": RoadNetLane(f"e{i}_0", f"e{i}", 0, x) for i, x in enumerate(lengths)}
    links = tuple(Link(f"e{i}_0", f"e{i + 1}_0") for i in range(len(lengths) - 1) if i not in gaps)
    return RoadNet(lanes, links)


def test_a_missing_edge_is_put_in_and_told() -> None:
    edges, repairs = connected(chain(10, 10, 10, 10), ["e0", "e2", "e3"], "passenger")
    assert edges == ("e0", "e1", "e2", "e3")
    assert repairs == ((RepairKind.PUT_IN, "e1 put in between e0 and e2"),)


def test_a_stray_edge_is_left_out_and_told() -> None:
    net = chain(10, 10, 10)
    stray = RoadNetLane("x_0", "x", 0, 5.0)
    edges, repairs = connected(
        RoadNet({**net.lanes, "x_0": stray}, net.links), ["e0", "x", "e1", "e2"], "passenger"
    )
    assert edges == ("e0", "e1", "e2")
    assert repairs == ((RepairKind.LEFT_OUT, "edge x left out: no link from e0"),)


def test_a_goal_that_cannot_be_reached_is_no_route() -> None:
    with pytest.raises(NoRouteError, match="from edge e0 to e2"):
        connected(chain(10, 10, 10, gaps=(1,)), ["e0", "e2"], "passenger")


def test_a_path_into_a_dead_end_is_left_as_late_as_possible() -> None:
    lanes = {
        f"{name}_0": RoadNetLane(f"{name}_0", name, 0, 10.0) for name in ("a", "b", "dead", "z")
    }
    links = (Link("a_0", "b_0"), Link("b_0", "dead_0"), Link("b_0", "z_0"))
    edges, repairs = connected(RoadNet(lanes, links), ["a", "b", "dead", "z"], "passenger")
    assert edges == ("a", "b", "z")
    assert repairs == ((RepairKind.LED_AROUND, "dead left out; z put in between b and z"),)


def test_a_front_beyond_its_lane_leaves_by_a_link_of_that_lane() -> None:
    net = street_net()
    other = RoadNetLane("side_0", "side", 0, 40.0)
    links = (
        Link("in_1", "side_0"), Link("side_0", "out_1"),
        *(link for link in net.links if link.source != "in_1"),
    )  # fmt: skip
    detour = RoadNet({**net.lanes, "side_0": other}, links)
    places = lane_places(GRAPH.lanes)
    places = replace(places, lanes=(*places.lanes, "side_0"), scale=np.ones(7))
    planner = RoutePlanner(GRAPH.lanes, detour, places)
    path = ROUTER.path(node_index(GRAPH, "1.0.-2.48"), node_index(GRAPH, "3.0.-2.20"))
    route = planner.plan(path, length=4.5, vclass="passenger")
    assert route.edges == ("side", "out")
    assert route.depart_pos == pytest.approx(97.0 + 2.25 - 98.0)
    assert route.repairs == ((RepairKind.OTHER_LINK, "leaves lane in_1 by side, not out"),)


def test_lateral_offsets_are_mirrored_for_vehicles_in_left_hand_traffic() -> None:
    right, left = street_net(), street_net()
    object.__setattr__(left, "lefthand", True)
    path = ROUTER.path(node_index(GRAPH, "1.0.-2.10"), node_index(GRAPH, "3.0.-2.20"))
    for net, expected in ((right, 0.3), (left, -0.3)):
        planner = RoutePlanner(GRAPH.lanes, net, lane_places(GRAPH.lanes))
        route = planner.plan(path, length=4.5, vclass="passenger", lateral_offset=0.3)
        assert route.depart_pos_lat == expected


def test_a_walk_from_an_inner_sidewalk_counts_from_the_one_that_is_walked() -> None:
    lanes = [
        RoadNetLane("in_0", "in", 0, 98.0, width=2.0, allowed=frozenset({"pedestrian"})),
        RoadNetLane("in_1", "in", 1, 98.0, width=1.0, allowed=frozenset()),
        RoadNetLane("in_2", "in", 2, 98.0, width=3.0, allowed=frozenset({"pedestrian"})),
    ]
    net = RoadNet({lane.id: lane for lane in lanes}, ())
    assert net.walked_lane("in") is lanes[0]
    assert net.left_of(lanes[2], lanes[0]) == pytest.approx(1.0 + 1.0 + 1.5)
    assert net.left_of(lanes[0], lanes[2]) == pytest.approx(-3.5)


def test_the_shortest_way_is_by_length_not_by_number_of_edges() -> None:
    lanes = {name: RoadNetLane(f"{name}_0", name, 0, x) for name, x in
             {"a": 1.0, "long": 100.0, "b": 10.0, "c": 10.0, "z": 1.0}.items()}  # fmt: skip
    links = tuple(
        Link(f"{a}_0", f"{b}_0")
        for a, b in [("a", "long"), ("long", "z"), ("a", "b"), ("b", "c"), ("c", "z")]
    )
    net = RoadNet({lane.id: lane for lane in lanes.values()}, links)
    assert net.path("a", "z", "passenger") == ("a", "b", "c", "z")
    assert net.path("z", "a", "passenger") is None


def walk(spawn: str, goal: str, *, lateral: float = 0.0) -> Walk:
    path = WALKS.path(walk_node_index(GRAPH, spawn), walk_node_index(GRAPH, goal))
    planner = WalkPlanner(GRAPH.walks, NET, walk_places(GRAPH.walks))
    return planner.plan(path, length=0.4, lateral_offset=lateral)


def test_a_walk_starts_in_the_direction_it_goes() -> None:
    there = walk("ped.1.0.-3.10", "ped.3.0.-3.10", lateral=0.3)
    assert there.edges == ("in", "out")
    assert there.depart_pos == pytest.approx(21.0 + 0.2)
    assert there.depart_pos_lat == 0.3
    back = walk("ped.3.0.-3.10", "ped.1.0.-3.10")
    assert back.edges == ("out", "in")
    assert back.depart_pos == pytest.approx(21.0 - 0.2)
    assert back.arrival_pos == pytest.approx(21.0)


def test_a_walk_along_one_edge_knows_its_direction_too() -> None:
    assert walk("ped.1.0.-3.10", "ped.1.0.-3.5").depart_pos == pytest.approx(20.8)
    assert walk("ped.1.0.-3.10", "ped.1.0.-3.15").depart_pos == pytest.approx(21.2)


def test_a_walk_where_nothing_is_to_walk_on_is_refused() -> None:
    places = walk_places(GRAPH.walks)
    nothing = replace(places, lane=np.full_like(places.lane, -1))
    path = WALKS.path(0, 5)
    with pytest.raises(NoRouteError, match="nothing to walk on at the spawn"):
        WalkPlanner(GRAPH.walks, NET, nothing).plan(path, length=0.4, lateral_offset=0.0)


def test_a_way_through_a_junction_may_have_two_internal_lanes() -> None:
    lanes = {
        "a_0": RoadNetLane("a_0", "a", 0, 10.0),
        ":j_1_0": RoadNetLane(":j_1_0", ":j_1", 0, 4.0, internal=True),
        ":j_2_0": RoadNetLane(":j_2_0", ":j_2", 0, 6.0, internal=True),
        "b_0": RoadNetLane("b_0", "b", 0, 10.0),
    }
    links = (
        Link("a_0", "b_0", ":j_1_0"),
        Link(":j_1_0", "b_0", ":j_2_0"),
        Link(":j_2_0", "b_0"),
    )
    passage = RoadNet(lanes, links).passage("a_0", "b")
    assert passage is not None
    assert [lane.id for lane in passage] == [":j_1_0", ":j_2_0", "b_0"]
