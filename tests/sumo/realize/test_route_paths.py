"""Ways of those who set off: no lane change before the front is where lanes may be changed."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from odscen.base.categories import Body, Category
from odscen.lanegraph.graphs import MapGraph, Relation
from odscen.lanegraph.query import node_id, node_index
from odscen.lanegraph.shortest_paths import Router
from odscen.scenario.demand.zones import TripEnds
from odscen.scenario.placing.region import Region, Usable
from odscen.scenario.placing.spawn_room import LANE_CHANGE, late_for_changes
from odscen.sumo.realize.road_user import RoadUser
from odscen.sumo.realize.route_paths import each_path
from tests.graphs import ToyLane, key, map_graph

CAR = Body(5.0, 1.8, 1.5)
RIGHT, LEFT = -2, -1


def approach(*, ring: bool) -> MapGraph:
    """Two lanes to a junction, with a solid line between them from x = 60 to the end at 80.

    The right lane leads to road R, the left one to road L, and with ``ring`` from there back to the
    beginning.
    """
    back = (key("1", LEFT),) if ring else ()
    lanes = [
        ToyLane(key("1", RIGHT), 0, -5, 0, 60, "r1", next=(key("2", RIGHT),), left=key("1", LEFT)),
        ToyLane(key("1", LEFT), 0, -2, 0, 60, "r1", next=(key("2", LEFT),), right=key("1", RIGHT)),
        ToyLane(key("2", RIGHT), 60, -5, 0, 20, "r1", next=(key("R", -1),)),
        ToyLane(key("2", LEFT), 60, -2, 0, 20, "r1", next=(key("L", -1),)),
        ToyLane(key("R", -1), 80, -5, 0, 40, "R"),
        ToyLane(key("L", -1), 80, -2, 0, 40, "L", next=back),
    ]
    return map_graph(lanes, adjacency=[("r1", "R"), ("r1", "L")])


def way(graph: MapGraph, spawn: str, goal: str, *, trip: bool, body: Body = CAR) -> list[str]:
    region = Region.of(graph, ["r1", "R", "L"])
    user = RoadUser(
        "one", Category.CAR, node_index(graph, spawn), node_index(graph, goal), 0.0, trip=trip
    )
    ((_, path),) = each_path([user], region, Router(graph, region.lanes), [body])
    return [node_id(graph, node) for node in path.tolist()]


def lanes_of(nodes: list[str]) -> list[str]:
    return list(dict.fromkeys(node.rpartition(".")[0] for node in nodes))


@pytest.mark.parametrize("trip", [False, True])
def test_lanes_are_changed_where_the_front_can_still_do_it(trip: bool) -> None:
    graph = approach(ring=True)
    nodes = way(graph, "1.0.-1.20", "R.0.-1.19", trip=trip)  # x = 41, the solid line is 19 m ahead
    assert lanes_of(nodes) == ["1.0.-1", "1.0.-2", "2.0.-2", "R.0.-1"]
    ahead = [node for node in nodes if node.startswith("1.0.-1")]
    assert (len(ahead) - 1) * 2.0 >= 2.5 + LANE_CHANGE


@pytest.mark.parametrize("trip", [False, True])
def test_the_way_goes_round_where_it_is_too_late_for_a_lane_change(trip: bool) -> None:
    graph = approach(ring=True)
    nodes = way(graph, "1.0.-1.27", "R.0.-1.19", trip=trip)  # x = 55, the front at 57.5
    assert lanes_of(nodes)[:3] == ["1.0.-1", "2.0.-1", "L.0.-1"]
    assert nodes[-1] == "R.0.-1.19"
    assert sum(node.startswith("1.0.-2") for node in nodes) > 0


@pytest.mark.parametrize("trip", [False, True])
def test_without_another_way_the_shortest_one_stays(trip: bool) -> None:
    graph = approach(ring=False)
    nodes = way(graph, "1.0.-1.27", "R.0.-1.19", trip=trip)
    assert lanes_of(nodes) == ["1.0.-1", "1.0.-2", "2.0.-2", "R.0.-1"]
    assert way(graph, "L.0.-1.5", "R.0.-1.19", trip=trip) == []


@pytest.mark.parametrize("trip", [False, True])
def test_a_goal_close_ahead_is_driven_to_and_not_round_to(trip: bool) -> None:
    graph = approach(ring=True)
    assert way(graph, "1.0.-1.2", "1.0.-1.4", trip=trip) == ["1.0.-1.2", "1.0.-1.3", "1.0.-1.4"]


def test_a_bus_has_to_change_lanes_earlier_than_a_car() -> None:
    graph = approach(ring=True)
    nodes = way(graph, "1.0.-1.22", "R.0.-1.19", trip=False)  # x = 45
    assert "L" not in {node[0] for node in nodes}
    nodes = way(graph, "1.0.-1.22", "R.0.-1.19", trip=False, body=Body(12.0, 2.5, 3.0))
    assert "L" in {node[0] for node in nodes}


def test_no_way_changes_lanes_within_its_first_metres() -> None:
    graph = approach(ring=True)
    pairs = zip(graph.lanes.source.tolist(), graph.lanes.target.tolist(), strict=True)
    kind = dict(zip(pairs, graph.lanes.relation.tolist(), strict=True))
    for spawn in range(len(graph.lanes.x)):
        path = way(graph, node_id(graph, spawn), "R.0.-1.19", trip=True)
        steps = pairwise(node_index(graph, node) for node in path[:6])
        assert {kind[step] for step in steps} <= {Relation.SUCCESSOR}


def test_places_where_it_is_too_late_for_a_lane_change() -> None:
    graph = approach(ring=True)
    late = np.flatnonzero(late_for_changes(graph.lanes, CAR))
    # 2.5 m to the front and 8 m more: 6 nodes before the solid line, on either lane
    assert [node_id(graph, node) for node in late.tolist()] == [
        *(f"1.0.-2.{k}" for k in range(24, 30)),
        *(f"1.0.-1.{k}" for k in range(24, 30)),
    ]


def test_trips_start_with_the_whole_vehicle_outside_junctions() -> None:
    """SUMO lets them appear inside across others, who drive beside their lane."""
    lanes = [
        ToyLane(key("1", -1), 0, 0, 0, 40, "r1", next=(key("5", -1),)),
        ToyLane(key("5", -1), 40, 0, 0, 20, "j5", junction="5", next=(key("2", -1),)),
        ToyLane(key("2", -1), 60, 0, 0, 40, "r2", next=(key("6", -1),)),
        ToyLane(key("6", -1), 100, 0, 0, 20, "j6", junction="6", next=(key("3", -1),)),
        ToyLane(key("3", -1), 120, 0, 0, 4, "r3", next=(key("7", -1),)),
        ToyLane(key("7", -1), 124, 0, 0, 20, "j7", junction="7"),
    ]
    graph = map_graph(lanes, adjacency=[("r1", "r2"), ("r2", "r3")])
    region = Region.of(graph, ["r1", "r2", "r3"])
    names = [node_id(graph, node) for node in range(len(graph.lanes.x))]

    def places(usable: Usable, *roads: str) -> list[float]:
        starts = TripEnds(region, usable).starts(Category.CAR, roads)
        return [float(graph.lanes.x[node]) for node in starts]

    half = Usable().bodies[Category.CAR].length / 2.0
    on_road = places(Usable(), "r2")
    assert min(on_road) - half >= 60.0
    assert max(on_road) + half <= 100.0
    # The simulator's junction begins earlier than the map's: at a crosswalk 10 m before.
    inside = (graph.lanes.x > 90.0) & np.array([name.startswith("2.") for name in names])
    assert max(places(Usable(in_junction=inside), "r2")) + half <= 91.0
    # Where a road is too short for that, they start all the same.
    assert places(Usable(), "r3")


def test_trips_do_not_start_there_if_their_segment_has_other_places() -> None:
    graph = approach(ring=True)
    ground = TripEnds(Region.of(graph, ["r1", "R", "L"]), Usable())
    starts = ground.starts(Category.CAR, ("r1",))
    late = late_for_changes(graph.lanes, Usable().bodies[Category.CAR])
    assert len(starts)
    assert not late[starts].any()
    short = map_graph(
        [
            ToyLane(key("1", RIGHT), 0, -5, 0, 16, "r1", left=key("1", LEFT)),
            ToyLane(key("1", LEFT), 0, -2, 0, 16, "r1", right=key("1", RIGHT)),
        ]
    )
    ground = TripEnds(Region.of(short, ["r1"]), Usable())
    assert len(ground.starts(Category.CAR)) > 0
