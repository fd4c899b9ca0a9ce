"""A straight road of 3 km with a vehicle that stands on it for a quarter of an hour."""

from __future__ import annotations

from functools import cache

from odscen.convert.building.network import build_network
from odscen.lanegraph.build_graphs import build_map_graph
from odscen.opendrive.lanes import RoadTable
from odscen.opendrive.parse import parse
from odscen.sumo.realize.sumo_map import SumoMap

LENGTH = 3000.0
_LANE = '<lane id="-{0}" type="driving"><width sOffset="0" a="3.5" b="0" c="0" d="0"/></lane>'


@cache
def straight_road(lanes: int = 1, limit: float = 80.0) -> tuple[SumoMap, bytes]:
    """Map and network of one road in one direction; the limit is in km/h."""
    own = "".join(_LANE.format(k + 1) for k in range(lanes))
    text = f"""<OpenDRIVE><header revMajor="1" revMinor="6"/>
<road id="1" length="{LENGTH}" junction="-1">
<type s="0" type="rural"><speed max="{limit}" unit="km/h"/></type>
<planView><geometry s="0" x="0" y="0" hdg="0" length="{LENGTH}"><line/></geometry></planView>
<lanes><laneSection s="0"><center><lane id="0" type="none"/></center><right>{own}</right>
</laneSection></lanes></road></OpenDRIVE>"""
    odr = parse(text.encode(), file="straight.xodr")
    table = RoadTable.of(odr)
    graph = build_map_graph(odr, name="straight", sha256="0" * 64, table=table)
    network = build_network(odr, table, graph.walks)
    return SumoMap.of(graph, network.table), network.net_xml
