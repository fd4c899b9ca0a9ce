"""How a network is written down: what SUMO reads must be what was meant."""

from __future__ import annotations

from xml.etree import ElementTree as ET

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from odscen.base.ids import SumoEdgeId, SumoLaneId
from odscen.convert.model.net import (
    CROSSING,
    INTERNAL,
    NORMAL,
    WALKING_AREA,
    Net,
    NetEdge,
    NetJunction,
    NetLane,
    NetLink,
    Phase,
    Request,
    TrafficLight,
)
from odscen.convert.model.net_xml import net_xml

CARS = frozenset({"passenger", "bus"})


def lane(name: str, *points: tuple[float, float, float], **more: object) -> NetLane:
    return NetLane(SumoLaneId(name), 0, 10.0, 13.89, 3.5, CARS, np.array(points), **more)


STREET = lane("a_0", (0.0, 0.0, 0.0), (10.0, 0.0, 0.0), change_left=False, xodr=("7_-1", "8_-1"))
INNER = lane(":j_0_0", (10.0, 0.0, 0.0), (12.0, 0.0, 0.0))


def net(
    *,
    edges: tuple[NetEdge, ...] = (),
    junctions: tuple[NetJunction, ...] = (),
    lights: tuple[TrafficLight, ...] = (),
    flat: bool = True,
    lefthand: bool = False,
) -> Net:
    street = NetEdge(SumoEdgeId("a"), NORMAL, (STREET,), "i", "j", 'Rue "A" & <B>')
    inner = NetEdge(SumoEdgeId(":j_0"), INTERNAL, (INNER,))
    return Net(
        (100.0, -5.0),
        lefthand,
        (street, inner, *edges),
        (NetLink(SumoEdgeId("a"), SumoEdgeId("b"), 0, 1, INNER.id, "l", "m", "j", 3),),
        junctions,
        lights,
        flat=flat,
    )


def text(made: Net) -> ET.Element:
    return ET.fromstring(net_xml(made))


def test_shapes_are_moved_by_the_offset_that_the_file_states() -> None:
    xml = text(net())
    assert xml.find("location").get("netOffset") == "100.00,-5.00"
    assert xml.find("edge[@id='a']/lane").get("shape") == "100.0000,-5.0000 110.0000,-5.0000"
    assert xml.find("location").get("convBoundary") == "100.0,-5.0,112.0,-5.0"


def test_heights_are_written_unless_the_network_is_flat() -> None:
    high = text(net(flat=False))
    assert high.find("edge[@id='a']/lane").get("shape").split()[0] == "100.0000,-5.0000,0.0000"


def test_a_lane_says_who_may_use_it_where_it_comes_from_and_what_may_not_be_crossed() -> None:
    found = text(net()).find("edge[@id='a']/lane")
    assert found.get("allow") == "bus passenger"
    assert found.find("param").attrib == {"key": "origId", "value": "7_-1 8_-1"}
    assert found.get("changeLeft") == "emergency", "only emergency vehicles may cross"
    assert found.get("changeRight") is None


def test_names_are_quoted() -> None:
    assert text(net()).find("edge[@id='a']").get("name") == 'Rue "A" & <B>'


@given(st.text(max_size=20))
def test_any_name_of_a_street_leaves_the_file_well_formed(name: str) -> None:
    odd = NetEdge(SumoEdgeId("b"), NORMAL, (lane("b_0", (0.0, 0.0, 0.0), (1.0, 0.0, 0.0)),),
                  "j", "k", name)  # fmt: skip
    found = text(net(edges=(odd,))).find("edge[@id='b']")
    assert found.get("name", "") == "".join(c if c.isprintable() else " " for c in name)


def test_edges_inside_junctions_come_first_as_sumo_wants_them() -> None:
    assert [edge.get("id") for edge in text(net()).iter("edge")] == [":j_0", "a"]


def test_a_connection_names_its_lanes_its_internal_lane_and_its_light() -> None:
    assert text(net()).find("connection").attrib == {
        "from": "a", "to": "b", "fromLane": "0", "toLane": "1", "via": ":j_0_0", "tl": "j",
        "linkIndex": "3", "dir": "l", "state": "m", "speed": "13.89",
        "shape": "110.0000,-5.0000 112.0000,-5.0000",
    }  # fmt: skip


def test_edges_and_junctions_have_shapes_that_netconvert_keeps() -> None:
    xml = text(net())
    edge = xml.find("edge[@id='a']")
    lane_width = float(edge.find("lane").get("width"))
    border = f"100.0000,{lane_width / 2 - 5:.4f} 110.0000,{lane_width / 2 - 5:.4f}"
    assert edge.get("shape") == border
    assert edge.find("lane").get("customShape") == "1"
    assert xml.find("edge[@id=':j_0']/lane").get("customShape") is None


def test_the_last_letter_of_a_response_is_the_first_link() -> None:
    requests = (
        Request(frozenset(), frozenset({1, 2})),
        Request(frozenset({0}), frozenset({0})),
        Request(frozenset({0}), frozenset({0})),
    )
    junction = NetJunction(
        "j", "priority", (10.0, 0.0, 0.0), np.zeros((3, 3)), (STREET.id,), (INNER.id,), requests
    )
    rows = text(net(junctions=(junction,))).findall("junction/request")
    assert [row.get("response") for row in rows] == ["000", "001", "001"]
    assert [row.get("foes") for row in rows] == ["110", "001", "001"]
    assert [row.get("index") for row in rows] == ["0", "1", "2"]


def test_a_light_has_its_phases_and_names_the_signals_behind_its_links() -> None:
    phases = (Phase(31.0, "Gr", "stage 1"), Phase(3.0, "yr"))
    light = TrafficLight("j", phases, signals=(("s1", "s2"), ()))
    found = text(net(lights=(light,))).find("tlLogic")
    assert [p.attrib for p in found.iter("phase")] == [
        {"duration": "31", "state": "Gr", "name": "stage 1"},
        {"duration": "3", "state": "yr"},
    ]
    assert [(p.get("key"), p.get("value")) for p in found.iter("param")] == [
        ("linkSignalID:0", "s1 s2")
    ]


def test_greens_that_vehicles_may_prolong_share_what_is_left_of_two_minutes() -> None:
    greens = Phase(31.0, "Gr", "", 8.0, 62.0), Phase(20.0, "rG", "", 8.0, 40.0)
    logic = text(net(lights=(TrafficLight("j", (*greens, Phase(9.0, "rr"))),))).find("tlLogic")
    assert logic.get("type") == "actuated"
    bounds = [(p.get("duration"), p.get("minDur"), p.get("maxDur")) for p in logic.iter("phase")]
    assert bounds == [("31", "31", "61"), ("20", "20", "50"), ("9", None, None)]
    params = {p.get("key"): p.get("value") for p in logic.iter("param")}
    assert params["max-gap"] == "2"


def test_a_light_whose_cycle_is_two_minutes_already_is_not_prolonged() -> None:
    phases = (Phase(117.0, "G", "", 8.0, 234.0), Phase(3.0, "y"))
    logic = text(net(lights=(TrafficLight("j", phases),))).find("tlLogic")
    assert logic.get("type") == "static"
    assert [p.get("minDur") for p in logic.iter("phase")] == [None, None]


def test_counts_are_those_outside_junctions() -> None:
    walked = [
        NetEdge(SumoEdgeId(name), function, (lane(f"{name}_0", (0, 0, 0), (1, 0, 0)),))
        for name, function in (
            (":j_c0", CROSSING),
            (":j_w0", WALKING_AREA),
            (":j_w1", WALKING_AREA),
        )
    ]
    assert net(edges=tuple(walked)).counts() == {
        "edges": 1, "lanes": 1, "junctions": 0, "tl_logics": 0, "crossings": 1,
        "walking_areas": 2,
    }  # fmt: skip


@pytest.mark.parametrize("lefthand", [True, False])
def test_the_file_says_on_which_side_one_drives(lefthand: bool) -> None:
    assert (text(net(lefthand=lefthand)).get("lefthand") == "true") is lefthand


def test_a_network_of_nothing_can_be_written() -> None:
    xml = text(Net((0.0, 0.0), False, (), (), ()))
    assert [child.tag for child in xml] == ["location"]
