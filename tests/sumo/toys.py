"""A straight street over one junction, as lane graph and as SUMO network.

OpenDRIVE: road 1 from x = 0 to 100, road 2 in junction 9 to x = 120, road 3 to x = 220, with a
second lane on roads 1 and 3. SUMO has trimmed its edges at the junction: ``in`` ends at x = 98, the
internal lane at x = 122. A sidewalk runs beside roads 1 and 3.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from odscen.sumo.realize.road_net import Link, RoadNet, RoadNetLane
from odscen.sumo.realize.route_planner import NodePositions
from odscen.sumo.realize.sumo_map import SumoMap
from tests.graphs import ToyLane, ToyWalk, key, map_graph

if TYPE_CHECKING:
    from odscen.lanegraph.graphs import LaneGraph, MapGraph, PedestrianGraph

OFFSET = (1000.0, -50.0)
CARS = frozenset({"passenger", "delivery", "truck", "bus", "motorcycle", "bicycle"})
WALKERS = frozenset({"pedestrian"})

STARTS = {"in": 0.0, ":9": 98.0, "out": 122.0}
"""x at which each SUMO edge starts."""


def street() -> MapGraph:
    lanes = [
        ToyLane(key("1", -2), 0, -5.25, 0, 100, "r1", next=(key("2", -2),), left=key("1", -1)),
        ToyLane(key("1", -1), 0, -1.75, 0, 100, "r1", next=(key("2", -1),), right=key("1", -2)),
        ToyLane(key("2", -2), 100, -5.25, 0, 20, "j9", junction="9", next=(key("3", -2),)),
        ToyLane(key("2", -1), 100, -1.75, 0, 20, "j9", junction="9", next=(key("3", -1),)),
        ToyLane(key("3", -2), 120, -5.25, 0, 100, "r3", left=key("3", -1)),
        ToyLane(key("3", -1), 120, -1.75, 0, 100, "r3", right=key("3", -2)),
    ]
    walks = [
        ToyWalk(key("1", -3), 0, -8, 0, 98, "r1", next=(key("3", -3),)),
        ToyWalk(key("3", -3), 122, -8, 0, 98, "r3"),
    ]
    return map_graph(lanes, walks=walks, adjacency=[("r1", "j9"), ("j9", "r3")])


def street_net() -> RoadNet:
    lanes = [
        RoadNetLane("in_0", "in", 0, 98.0, allowed=WALKERS),
        RoadNetLane("in_1", "in", 1, 98.0, allowed=CARS),
        RoadNetLane("in_2", "in", 2, 98.0, allowed=CARS),
        RoadNetLane(":9_0_0", ":9_0", 0, 24.0, internal=True, allowed=CARS),
        RoadNetLane(":9_0_1", ":9_0", 1, 24.0, internal=True, allowed=CARS),
        RoadNetLane("out_0", "out", 0, 98.0, allowed=WALKERS),
        RoadNetLane("out_1", "out", 1, 98.0, allowed=CARS),
        RoadNetLane("out_2", "out", 2, 98.0, allowed=CARS),
    ]
    links = (
        Link("in_1", "out_1", ":9_0_0"),
        Link("in_2", "out_2", ":9_0_1"),
        Link(":9_0_0", "out_1"),
        Link(":9_0_1", "out_2"),
    )
    return RoadNet(
        {lane.id: lane for lane in lanes},
        links,
        frozenset({("in", "out")}),
        ends={"in": ("a", "9"), "out": ("9", "b")},
    )


def lane_places(graph: LaneGraph) -> NodePositions:
    names = ("in_1", "in_2", ":9_0_0", ":9_0_1", "out_1", "out_2")
    edge = np.where(graph.x < 98.0, 0, np.where(graph.x < 122.0, 1, 2))
    starts = np.array([0.0, 98.0, 122.0])[edge]
    row = 2 * edge + (graph.y > -3.5)
    return NodePositions(
        names, row.astype(np.int32), graph.x - starts, np.zeros(len(row)), np.ones(6)
    )


def walk_places(graph: PedestrianGraph) -> NodePositions:
    beyond = graph.x > 100.0
    pos = graph.x - 122.0 * beyond
    return NodePositions(
        ("in_0", "out_0"), beyond.astype(np.int32), pos, np.zeros(len(pos)), np.ones(2)
    )


def sumo_map() -> SumoMap:
    graph = street()
    return SumoMap(graph, street_net(), lane_places(graph.lanes), walk_places(graph.walks), OFFSET)
