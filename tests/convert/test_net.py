from __future__ import annotations

import numpy as np
import pytest

from odscen.convert.net import Net
from odscen.errors import NetconvertError
from odscen.ids import SumoEdgeId, SumoLaneId

NET = """<net version="1.20" lefthand="true">
  <location netOffset="100.00,-5.00" convBoundary="0.00,0.00,50.00,9.00"
            origBoundary="0,0,0,0" projParameter="!"/>
  <edge id=":j_0" function="internal">
    <lane id=":j_0_0" index="0" speed="8" length="3.0" shape="110,0 113,0" disallow="pedestrian"/>
  </edge>
  <edge id=":j_c0" function="crossing" crossingEdges="a b">
    <lane id=":j_c0_0" index="0" allow="pedestrian" speed="1" length="6" shape="110,0 110,6"/>
  </edge>
  <edge id="a" from="i" to="j">
    <lane id="a_0" index="0" allow="pedestrian" speed="2" length="10" shape="100,0 110,0"/>
    <lane id="a_1" index="1" speed="13.9" length="11" shape="100,3 105,3,0.5 110,3" width="3.5"/>
    <lane id="a_2" index="2" disallow="all" speed="1" length="11" shape="100,6,1 110,6,2"/>
  </edge>
  <edge id="b" from="j" to="k">
    <lane id="b_0" index="0" allow="bus taxi" speed="13.9" length="10" shape="113,3 123,3"/>
  </edge>
  <tlLogic id="t" type="static" programID="0" offset="0"/>
  <junction id="j" type="traffic_light" x="111" y="1"/>
  <junction id=":j_0_0" type="internal" x="111" y="1"/>
  <connection from="a" to="b" fromLane="1" toLane="0" via=":j_0_0" tl="t" linkIndex="2" dir="s"/>
  <connection from=":j_0" to="b" fromLane="0" toLane="0" dir="s"/>
</net>"""


def net() -> Net:
    return Net.parse(NET.encode())


def test_shapes_are_moved_into_the_opendrive_frame() -> None:
    shape = net().lanes[SumoLaneId("a_0")].shape
    np.testing.assert_allclose(shape, [[0.0, 5.0, 0.0], [10.0, 5.0, 0.0]])


def test_a_shape_may_leave_out_heights_of_zero_point_by_point() -> None:
    lanes = net().lanes
    np.testing.assert_allclose(lanes[SumoLaneId("a_1")].shape[:, 2], [0.0, 0.5, 0.0])
    np.testing.assert_allclose(lanes[SumoLaneId("a_2")].shape[:, 2], [1.0, 2.0])


@pytest.mark.parametrize(
    ("lane", "vclass", "allowed"),
    [
        ("a_0", "pedestrian", True),
        ("a_0", "passenger", False),
        ("a_1", "passenger", True),
        ("a_1", "pedestrian", True),
        ("a_2", "passenger", False),
        ("b_0", "bus", True),
        ("b_0", "passenger", False),
        (":j_0_0", "pedestrian", False),
        (":j_0_0", "truck", True),
    ],
)
def test_permissions_follow_allow_and_disallow(lane: str, vclass: str, allowed: bool) -> None:
    assert net().lanes[SumoLaneId(lane)].allows(vclass) is allowed


def test_connections_name_lanes_by_their_own_ids() -> None:
    first, second = net().connections
    assert first == ("a_1", "b_0", ":j_0_0", "t", 2, "s")
    assert (second.from_lane, second.to_lane, second.via) == (":j_0_0", "b_0", "")


def test_edges_know_their_function_ends_and_what_they_cross() -> None:
    edges = net().edges
    assert edges[SumoEdgeId("a")].lanes == ("a_0", "a_1", "a_2")
    assert (edges[SumoEdgeId("a")].from_junction, edges[SumoEdgeId("a")].to_junction) == ("i", "j")
    assert edges[SumoEdgeId(":j_c0")].crosses == ("a", "b")


def test_counts_are_those_outside_junctions() -> None:
    assert net().counts() == {
        "edges": 2,
        "lanes": 4,
        "junctions": 1,
        "tl_logics": 1,
        "crossings": 1,
        "walking_areas": 0,
    }
    assert net().lefthand


@pytest.mark.parametrize(
    "text",
    [
        "",
        "<net/>",
        NET.replace('netOffset="100.00,-5.00"', ""),
        NET.replace('shape="100,0 110,0"', 'shape="100,0 nan,0"'),
        NET.replace('toLane="0"', 'toLane="7"'),
        NET[: len(NET) // 2],
    ],
)
def test_a_broken_network_is_refused(text: str) -> None:
    with pytest.raises(NetconvertError):
        Net.parse(text.encode())
