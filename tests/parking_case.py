"""The shipped town with parking places beside some of its streets."""

from __future__ import annotations

import hashlib
from functools import lru_cache
from typing import NamedTuple

from odscen.convert.building.network import build_network
from odscen.convert.lane_table.table import LaneTable
from odscen.drawing.map_shapes import map_drawing
from odscen.lanegraph.build_graphs import build_map_graph
from odscen.lanegraph.parking_areas import MapParking, map_parking
from odscen.opendrive.lanes import RoadTable
from odscen.opendrive.parse import parse
from odscen.scenario.document.scenario_document import Scenario
from odscen.sumo.realize.sumo_map import SumoMap
from tools.parking_example import PLACES, ROADS, TOWN, with_rows

__all__ = ["PLACES", "ParkingTown", "parking_scenario", "parking_town"]


class ParkingTown(NamedTuple):
    """The map as scenarios are run on it, its network, and what leads from one to the other."""

    sumo: SumoMap
    net_xml: bytes
    table: LaneTable

    @property
    def parking(self) -> MapParking:
        return self.sumo.parking


@lru_cache(maxsize=2)
def parking_town(roads: tuple[int, ...] = ROADS) -> ParkingTown:
    """Build the town with places beside these roads."""
    content = with_rows(TOWN.read_text(encoding="utf-8"), roads).encode()
    odr = parse(content, file="parking_town.xodr")
    table = RoadTable.of(odr)
    sha256 = hashlib.sha256(content).hexdigest()
    graph = build_map_graph(odr, name="parking_town", sha256=sha256, table=table)
    network = build_network(odr, table, graph.walks)
    spaces = map_drawing(odr, table).parking_spaces.each
    parking = map_parking(graph.lanes, spaces=spaces, strips=[])
    return ParkingTown(
        SumoMap.of(graph, network.table, parking=parking), network.net_xml, network.table
    )


def parking_scenario(
    parking: dict[str, object], *, trips: float = 150, duration: float = 900.0, seed: int = 1
) -> Scenario:
    """Background traffic in the whole town, of which some trips park."""
    graph = parking_town().sumo.graph
    return Scenario.model_validate(
        {
            "name": "parking",
            "map": {"name": graph.map_name, "sha256": graph.map_sha256},
            "seed": seed,
            "roi": [str(name) for name in graph.segments.ids],
            "demand": {
                "background": [{"id": "b", "trips": trips, "end": 600.0}],
                "parking": parking,
            },
            "simulation": {"duration": duration},
        }
    )
