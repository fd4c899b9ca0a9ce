"""Which routes trips choose: fixed shares, and quickest ones in free flow."""

from __future__ import annotations

from typing import Any

import numpy as np

from odscen.base.categories import Category
from odscen.lanegraph.graphs import MapGraph
from odscen.lanegraph.query import node_index
from odscen.lanegraph.shortest_paths import Router
from odscen.scenario.checks.demand_checks import route_problems
from odscen.scenario.document.scenario_document import MapReference, Scenario
from odscen.scenario.placing.region import Region
from odscen.sumo.realize.road_user import RoadUser
from odscen.sumo.realize.route_choice.chosen_paths import RoutesOfDemand
from odscen.sumo.realize.route_choice.travel_times import EdgeSteps, TravelTimes, path_costs
from tests.graphs import ToyLane, key, map_graph

BELOW, ABOVE = "below", "above"


def two_ways() -> MapGraph:
    """From ``start`` to ``end`` over ``below`` (100 m) or ``above`` (140 m)."""
    lanes = [
        ToyLane(key("1", -1), 0, 0, 0, 40, "start", next=(key("2", -1), key("3", -1))),
        ToyLane(key("2", -1), 40, 0, 0, 100, BELOW, next=(key("4", -1),)),
        ToyLane(key("3", -1), 40, 0, 0, 140, ABOVE, next=(key("4", -1),)),
        ToyLane(key("4", -1), 140, 0, 0, 40, "end"),
    ]
    pairs = [("start", BELOW), ("start", ABOVE), (BELOW, "end"), (ABOVE, "end")]
    return map_graph(lanes, adjacency=pairs)


def scenario(graph: MapGraph, routes: dict[str, Any]) -> Scenario:
    place = MapReference(name=graph.map_name, sha256=graph.map_sha256)
    roi = [str(name) for name in graph.segments.ids]
    return Scenario.model_validate(
        {"name": "t", "map": place, "roi": roi, "demand": {"routes": routes}}
    )


def trips(graph: MapGraph, number: int) -> list[RoadUser]:
    start, end = node_index(graph, "1.0.-1.3"), node_index(graph, "4.0.-1.10")
    return [
        RoadUser(f"m.start-end.{k}", Category.CAR, start, end, 0.0, flow="m", trip=True)
        for k in range(number)
    ]


def chosen(graph: MapGraph, routes: dict[str, Any], number: int = 400) -> list[str]:
    region = Region.of(graph, [str(name) for name in graph.segments.ids])
    ways = RoutesOfDemand(scenario(graph, routes), region, Router(graph, region.lanes))
    found = dict(ways.each_path(trips(graph, number)))
    ids = [str(name) for name in graph.segments.ids]
    return [
        next(name for name in (BELOW, ABOVE) if ids.index(name) in graph.lanes.segment[path])
        for _, path in sorted(found.items())
    ]


def test_trips_are_dealt_out_to_routes_by_their_shares() -> None:
    shares = {"origin": "start", "destination": "end", "routes": [[[BELOW], 3], [[ABOVE], 1]]}
    found = chosen(two_ways(), {"shares": [shares]})
    assert 0.2 < found.count(ABOVE) / len(found) < 0.3
    assert found[:40] == chosen(two_ways(), {"shares": [shares]}, 40)


def test_without_shares_all_take_the_shortest_route() -> None:
    assert set(chosen(two_ways(), {}, 5)) == {BELOW}
    elsewhere = {"origin": "end", "destination": "start", "routes": [[[ABOVE], 1]]}
    assert set(chosen(two_ways(), {"shares": [elsewhere]}, 5)) == {BELOW}


def test_a_route_over_an_unknown_segment_is_named() -> None:
    graph = two_ways()
    shares = {"origin": "nowhere", "destination": "end", "routes": [[["lost"], 1]]}
    region = Region.of(graph, [str(name) for name in graph.segments.ids])
    found = {one.code: one for one in route_problems(scenario(graph, {"shares": [shares]}), region)}
    assert set(found) == {"unknown_zone", "unknown_segment"}
    assert "'lost'" in found["unknown_segment"].message


def test_the_time_of_a_path_is_that_of_its_edges_in_the_interval_of_departure() -> None:
    graph = two_ways()
    region = Region.of(graph, [str(name) for name in graph.segments.ids])
    path = Router(graph, region.lanes).path(
        node_index(graph, "1.0.-1.3"), node_index(graph, "4.0.-1.10")
    )
    steps = EdgeSteps(graph.lanes).of(path)
    metres = float(graph.lanes.length[steps].sum())
    times = TravelTimes(300.0, np.stack([graph.lanes.length / 10.0, graph.lanes.length / 5.0]))
    rows = times.row(np.array([299.0, 300.0, 9000.0]))
    assert rows.tolist() == [0, 1, 1]
    assert np.allclose(path_costs(times, [steps] * 3, rows), [metres / 10, metres / 5, metres / 5])
