"""A small lane table: road 1 in two SUMO edges, a junction lane, a sidewalk run backwards."""

from __future__ import annotations

import numpy as np

from odscen.base.ids import JunctionId, LaneKey, RoadId, SumoEdgeId, SumoLaneId
from odscen.convert.lane_table.table import (
    LaneTable,
    MappingInterval,
    SumoEdge,
    SumoLane,
    SumoLight,
    SumoLink,
)
from odscen.convert.model.net import Phase

DRIVE = LaneKey(RoadId("1"), 0, -1)
AGAINST = LaneKey(RoadId("1"), 0, 1)
INSIDE = LaneKey(RoadId("2"), 0, -1)
WALK = LaneKey(RoadId("1"), 0, -2)

CARS = frozenset({"passenger", "bus"})
WALKERS = frozenset({"pedestrian"})


def edge(name: str, function: str, start: str, end: str, *lanes: str) -> SumoEdge:
    own = tuple(SumoLaneId(lane) for lane in lanes)
    return SumoEdge(SumoEdgeId(name), function, start, end, 50.0, own)


def lane(name: str, of: str, allowed: frozenset[str] | None = CARS) -> SumoLane:
    return SumoLane(SumoLaneId(name), SumoEdgeId(of), 0, 50.0, 13.9, 3.5, allowed)


def interval(
    key: int, sumo: int, pos: list[float], s: list[float], off: float = 0.0
) -> MappingInterval:
    return MappingInterval(key, sumo, np.array(pos), np.array(s), np.full(len(pos), off))


def table() -> LaneTable:
    edges = (
        edge("a", "normal", "i", "j", "a_0"),
        edge("b", "normal", "j", "k", "b_0"),
        edge("c", "normal", "k", "i", "c_0"),
        edge(":k", "internal", "", "", ":k_0"),
        edge("w", "normal", "i", "k", "w_0"),
        edge(":k_w", "walkingarea", "", "", ":k_w_0"),
        edge("v", "normal", "k", "l", "v_0"),
        edge("u", "normal", "m", "n", "u_0"),
    )
    lanes = (
        lane("a_0", "a"),
        lane("b_0", "b", None),
        lane("c_0", "c"),
        lane(":k_0", ":k"),
        lane("w_0", "w", WALKERS),
        lane(":k_w_0", ":k_w", WALKERS),
        lane("v_0", "v", WALKERS),
        lane("u_0", "u", WALKERS),
    )
    return LaneTable(
        lane_keys=(DRIVE, AGAINST, INSIDE, WALK),
        lanes={found.id: found for found in lanes},
        edges={found.id: found for found in edges},
        links=(SumoLink(SumoLaneId("a_0"), SumoLaneId("b_0"), SumoLaneId(":k_0"), "t"),),
        walk_links=(
            (SumoEdgeId(":k_w"), SumoEdgeId("v")),
            (SumoEdgeId(":k_w"), SumoEdgeId("w")),
        ),
        intervals=(
            interval(0, 0, [0.0, 50.0], [1.0, 52.0], 0.01),
            interval(0, 1, [0.0, 20.0, 50.0], [52.0, 75.0, 99.0], 0.02),
            interval(1, 2, [0.0, 50.0], [100.0, 2.5], 0.0),
            interval(2, 3, [0.0, 12.0], [0.0, 12.5], 0.4),
            interval(3, 4, [2.0, 49.0], [90.0, 10.0], 0.05),
        ),
        net_offset=(10.0, -3.25),
        boundary=(0.0, 0.0, 100.0, 50.0),
        lefthand=False,
        counts={"edges": 5, "lanes": 5},
        elevation=True,
        lights=(
            SumoLight(
                "t",
                (JunctionId("9"), JunctionId("10")),
                (Phase(20.0, "G", "stage 1", 8.0, 40.0), Phase(3.0, "y", "yellow")),
                0.0,
                (("17", "18"),),
            ),
        ),
    )
