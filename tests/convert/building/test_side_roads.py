"""Virtual junctions: side roads that turn off a road which continues (section 12.6)."""

import hashlib
import math

import numpy as np
import pytest

from odscen.base.ids import LaneKey
from odscen.convert.building.network import build_network
from odscen.convert.verify.fidelity import verify
from odscen.lanegraph.build_graphs import build_map_graph
from odscen.opendrive.lanes import RoadTable
from odscen.opendrive.parse import parse
from odscen.opendrive.topology import SideLink, side_links

QUARTER = 15.0 * math.pi / 2.0
LANE = '<width sOffset="0" a="3.5" b="0" c="0" d="0"/>'


def _two_way(name: str, x: float, y: float, hdg: float, length: float, link: str) -> str:
    return (
        f'<road id="{name}" length="{length}" junction="-1"><link>{link}</link><planView>'
        f'<geometry s="0" x="{x}" y="{y}" hdg="{hdg}" length="{length}"><line/></geometry>'
        f'</planView><lanes><laneSection s="0"><left><lane id="1" type="driving">{LANE}</lane>'
        f'</left><center><lane id="0" type="none"/></center><right><lane id="-1" type="driving">'
        f"{LANE}</lane></right></laneSection></lanes></road>"
    )


def _turn(name: str, x: float, y: float, hdg: float, links: str, lane: tuple[int, int]) -> str:
    return (
        f'<road id="{name}" length="{QUARTER}" junction="9"><link>{links}</link><planView>'
        f'<geometry s="0" x="{x}" y="{y}" hdg="{hdg}" length="{QUARTER}">'
        f'<arc curvature="{-1 / 15}"/></geometry></planView><lanes><laneSection s="0"><center>'
        f'<lane id="0" type="none"/></center><right><lane id="-1" type="driving"><link>'
        f'<predecessor id="{lane[0]}"/><successor id="{lane[1]}"/></link>{LANE}</lane></right>'
        f"</laneSection></lanes></road>"
    )


def _map() -> bytes:
    beside = 'elementType="road" elementId="1" elementDir="+"'
    side = 'elementType="road" elementId="2" contactPoint="start"'
    roads = [
        _two_way("1", 0, 0, 0, 200, ""),
        _two_way("2", 115, -15, -math.pi / 2, 50,
                 '<predecessor elementType="junction" elementId="9"/>'),
        _turn("3", 100, 0, 0,
              f'<predecessor {beside} elementS="100"/><successor {side}/>', (-1, -1)),
        _turn("4", 115, -15, math.pi / 2,
              f'<predecessor {side}/><successor {beside} elementS="130"/>', (1, -1)),
    ]  # fmt: skip
    junction = (
        '<junction id="9" name="" type="virtual" mainRoad="1" sStart="95" sEnd="135">'
        '<connection id="0" incomingRoad="1" connectingRoad="3" contactPoint="start">'
        '<laneLink from="-1" to="-1"/></connection>'
        '<connection id="1" incomingRoad="2" connectingRoad="4" contactPoint="start">'
        '<laneLink from="1" to="-1"/></connection></junction>'
    )
    return (
        '<OpenDRIVE><header revMajor="1" revMinor="7"/>' + "".join(roads) + junction
        + "</OpenDRIVE>"
    ).encode()  # fmt: skip


@pytest.fixture(scope="module")
def made():
    content = _map()
    odr = parse(content, file="side.xodr")
    table = RoadTable.of(odr)
    sha256 = hashlib.sha256(content).hexdigest()
    graph = build_map_graph(odr, name="side", sha256=sha256, table=table)
    return odr, table, graph, build_network(odr, table, graph.walks)


def test_the_links_name_both_lanes_and_the_place(made):
    odr, *_ = made
    assert side_links(odr) == (
        SideLink(LaneKey("1", 0, -1), 100.0, LaneKey("3", 0, -1), leaves=True),
        SideLink(LaneKey("1", 0, -1), 130.0, LaneKey("4", 0, -1), leaves=False),
    )


def test_the_lane_graph_turns_off_and_in_at_the_place(made):
    _, _, graph, _ = made
    lanes = graph.lanes
    row = {key: n for n, key in enumerate(lanes.lanes.keys)}
    source, target = lanes.lane[lanes.source], lanes.lane[lanes.target]
    for before, after, place in (("1", "3", 100.0), ("4", "1", 130.0)):
        edge = np.flatnonzero(
            (source == row[LaneKey(before, 0, -1)]) & (target == row[LaneKey(after, 0, -1)])
        )
        assert len(edge) == 1
        on_main = lanes.source[edge[0]] if before == "1" else lanes.target[edge[0]]
        assert abs(lanes.s[on_main] - place) <= lanes.spacing
        assert 0.0 < lanes.length[edge[0]] < 2.0 * lanes.spacing


def test_the_network_has_the_turns_and_the_road_straight_on(made):
    odr, table, _, network = made
    pairs = {
        (link.from_lane, link.to_lane)
        for link in network.table.links
        if link.via and network.table.edges[network.table.lanes[link.from_lane].edge]
    }
    assert pairs == {
        ("1.0.f_0", "1.1.f_0"),
        ("1.0.f_0", "2.0.f_0"),
        ("1.1.b_0", "1.0.b_0"),
        ("2.0.b_0", "1.1.f_0"),
    }
    fidelity = verify(network.net_xml, odr, table)
    assert fidelity.passed, fidelity.verdicts
