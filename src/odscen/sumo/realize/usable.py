"""What SUMO can use of a map, so that sampled actors can be run as they are placed."""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from odscen.lanegraph.graphs import Relation
from odscen.scenario.placing.region import Usable
from odscen.sumo.realize.driving import KINDS
from odscen.sumo.realize.road_net import PEDESTRIAN

if TYPE_CHECKING:
    from collections.abc import Iterable

    from odscen.base.arrays import BoolArray
    from odscen.lanegraph.graphs import LaneGraph
    from odscen.sumo.realize.road_net import RoadNetLane
    from odscen.sumo.realize.route_planner import NodePositions
    from odscen.sumo.realize.sumo_map import SumoMap

DEVIATION = 0.05
"""Metres between OpenDRIVE and SUMO lane centre, at most, where a body is placed."""

REACH = 6.0
"""Metres before and behind a spawn where that holds too: half a bus."""


@lru_cache(maxsize=4)
def usable_places(sumo_map: SumoMap) -> Usable:
    """Nodes that sampling may use for a run in SUMO.

    - *spawnable*: the SUMO lane exists, motor vehicles may use it, and its centre is within
      :data:`DEVIATION` of the OpenDRIVE lane's, there and :data:`REACH` ahead and behind along
      every way on or off (SUMO lays the rear of a body on a lane of its own choice);
    - *drivable*: the lane exists in SUMO, somewhere along it at least;
    - *walkable*: the place is on the lane of its edge that pedestrians use, outside junctions,
      within :data:`DEVIATION`;
    - *in_junction*: the SUMO lane is one inside a junction;
    - *barred*: the SUMO lane does not admit the category.
    """
    graph = sumo_map.graph
    lanes, walks = graph.lanes, graph.walks
    admitted = _mask_of_admitted(sumo_map, sumo_map.lane_places, "passenger")
    exact = (
        admitted
        & _mask_of_near(sumo_map.lane_places)
        & ~_mask_of_dead_ends(sumo_map, sumo_map.lane_places)
    )
    reach = int(np.ceil(REACH / lanes.spacing))
    walked = _array_by_lane(
        not lane.internal and sumo_map.net.walked_lane(lane.edge) is lane
        for lane in _lanes_of_places(sumo_map, sumo_map.walk_places)
    )
    inside = _array_by_lane(
        lane.internal for lane in _lanes_of_places(sumo_map, sumo_map.lane_places)
    )
    on_foot = _mask_of_admitted(sumo_map, sumo_map.walk_places, PEDESTRIAN)
    on_foot &= walked[sumo_map.walk_places.lane] & _mask_of_near(sumo_map.walk_places)
    spawnable = _erode_along_lanes(exact, lanes, reach)
    barred = {
        category: ~_mask_of_admitted(sumo_map, sumo_map.lane_places, traits.vclass)
        for category, traits in KINDS.items()
        if traits.vclass != PEDESTRIAN
    }
    return Usable(
        spawnable=spawnable,
        drivable=sumo_map.drivable,
        walkable=on_foot & ~walks.roadside[walks.lane],
        in_junction=(sumo_map.lane_places.lane >= 0) & inside[sumo_map.lane_places.lane],
        barred={name: nodes for name, nodes in barred.items() if (nodes & spawnable).any()},
    )


def _lanes_of_places(sumo_map: SumoMap, places: NodePositions) -> list[RoadNetLane]:
    return [sumo_map.net.lanes[name] for name in places.lanes]


def _array_by_lane(values: Iterable[bool]) -> BoolArray:
    """One value for each lane; the last one, at -1, is of nodes that are on no lane."""
    return np.array([*values, False], dtype=np.bool_)


def _mask_of_admitted(sumo_map: SumoMap, places: NodePositions, vclass: str) -> BoolArray:
    """Nodes on a SUMO lane that a vehicle class may use, shape ``(N,)``."""
    allowed = _array_by_lane(lane.allows(vclass) for lane in _lanes_of_places(sumo_map, places))
    return (places.lane >= 0) & allowed[places.lane]


def _mask_of_dead_ends(sumo_map: SumoMap, places: NodePositions) -> BoolArray:
    """Nodes close to the end of a SUMO lane without links: a front could not reach over it."""
    lanes = _lanes_of_places(sumo_map, places)
    dead = _array_by_lane(not sumo_map.net.links_from.get(lane.id) for lane in lanes)
    length = np.array([*(lane.length for lane in lanes), np.inf])
    return dead[places.lane] & (places.pos > length[places.lane] - REACH)


def _mask_of_near(places: NodePositions) -> BoolArray:
    return np.less_equal(places.deviation, DEVIATION)  # false for NaN


def _erode_along_lanes(good: BoolArray, lanes: LaneGraph, steps: int) -> BoolArray:
    """Nodes that are good, with everything up to ``steps`` successors or predecessors away."""
    follows = lanes.relation == Relation.SUCCESSOR
    source, target = lanes.source[follows], lanes.target[follows]
    ahead, behind = good.copy(), good.copy()
    for _ in range(steps):
        ahead[source[~ahead[target]]] = False
        behind[target[~behind[source]]] = False
    return ahead & behind
