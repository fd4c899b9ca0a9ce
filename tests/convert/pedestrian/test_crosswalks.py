from __future__ import annotations

import pytest

from odscen.convert.building.network import build_network
from odscen.convert.pedestrian.crosswalks import place_crosswalks
from odscen.lanegraph.build_graphs import build_map_graph
from odscen.opendrive.lanes import RoadTable
from odscen.opendrive.parse import parse
from tests.opendrive.snippets import document, lane, road, section

CROSSWALK = (
    '<objects><object id="c" type="crosswalk" s="50" t="0" length="3" width="10"/></objects>'
)
NO_SIDES = '<laneSection s="0"><center><lane id="0" type="none"/></center></laneSection>'


@pytest.mark.parametrize("lanes", [NO_SIDES, section(lane(-1, kind="border"))])
def test_a_crosswalk_on_a_road_without_traffic_takes_nothing_from_it(lanes: str) -> None:
    odr = parse(document(road(lanes=lanes, inside=CROSSWALK)))
    table = RoadTable.of(odr)
    (placed,), taken = place_crosswalks(odr, table)
    assert (placed.crosswalk.object_id, placed.roads, placed.connecting) == ("c", (), ())
    assert taken == {}
    graph = build_map_graph(odr, name="m", sha256="0", table=table)
    assert len(graph.lanes.x) == 0
    assert b"<net" in build_network(odr, table, graph.walks).net_xml
