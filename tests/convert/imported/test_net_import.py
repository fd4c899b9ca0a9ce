from __future__ import annotations

import numpy as np
import pytest

from odscen.base.errors import InputError
from odscen.base.ids import SumoEdgeId, SumoLaneId
from odscen.convert.imported.net_import import ImportedNet, read_network, stage_numbers
from odscen.convert.model.net import Phase
from tests.convert.imported.small_net import NET


def net() -> ImportedNet:
    return read_network(NET.encode())


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
    assert sorted(net().links) == [
        (":j_0_0", "b_0", "", "", ()),
        ("a_1", "b_0", ":j_0_0", "t", (0,)),
    ]


def test_edges_know_their_function_and_their_ends() -> None:
    edges = net().edges
    assert edges[SumoEdgeId("a")].lanes == ("a_0", "a_1", "a_2")
    assert (edges[SumoEdgeId("a")].start, edges[SumoEdgeId("a")].end) == ("i", "j")
    assert edges[SumoEdgeId(":j_c0")].function == "crossing"
    assert edges[SumoEdgeId(":j_0")].start == ""


def test_counts_are_those_outside_junctions() -> None:
    assert net().counts() == {
        "edges": 2,
        "lanes": 4,
        "junctions": 3,
        "tl_logics": 1,
        "crossings": 1,
        "walking_areas": 0,
    }
    assert net().lefthand


def test_a_light_has_its_stages_bounds_offset_and_signals() -> None:
    (light,) = net().lights
    assert light.phases == (
        Phase(30, "Gr", "stage 1"),
        Phase(3, "yr"),
        Phase(20, "rG", "stage 2", 5, 40),
        Phase(4, "rr"),
    )
    assert (light.id, light.offset) == ("t", 7.0)
    assert light.signals == ((), ("12", "13"))


def test_the_program_that_sumo_has_read_last_is_the_one_that_counts() -> None:
    second = (
        '<tlLogic id="t" type="static" programID="1" offset="0"><phase duration="9" state="GG"/>'
    )
    (light,) = read_network(
        NET.replace("<junction", f"{second}</tlLogic><junction", 1).encode()
    ).lights
    assert [phase.duration for phase in light.phases] == [9.0]


@pytest.mark.parametrize(
    ("states", "stages"),
    [
        (["GGrr", "yyrr", "rrrr", "rrGG", "rryy"], [1, 0, 0, 2, 0]),
        # Persons lose green first, which is the change to the next stage and no stage.
        (["GrG", "Grr", "yrr", "rGr", "rrr"], [1, 0, 0, 2, 0]),
        # A turn gets green on top of those who have it: another stage.
        (["Ggr", "GGr", "yyr", "rrG", "rry"], [1, 0, 0, 2, 0]),
        (["Grr", "GGr", "yyr", "rrG", "rry"], [1, 2, 0, 3, 0]),
        (["Gg"], [1]),
        (["rr"], [0]),
        ([], []),
    ],
)
def test_a_stage_lets_go_vehicles_that_had_to_wait(states: list[str], stages: list[int]) -> None:
    assert stage_numbers(states) == stages


def test_edges_for_walking_are_joined_over_crossings_or_where_they_meet() -> None:
    assert net().walk_links() == ()
    text = NET.replace('allow="bus taxi"', 'allow="pedestrian"')
    assert ("a", "b") in read_network(text.encode()).walk_links()


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("", "^not well-formed XML: "),
        ("<OpenDRIVE/>", "first element is <OpenDRIVE>"),
        ("<net/>", "<location> is missing"),
        (NET.replace('shape="100,0 110,0"', 'shape="100,0 nan,0"'), "lane a_0 has no usable shape"),
        (NET.replace('toLane="0"', 'toLane="7"'), "cannot be read"),
        (NET.replace('via=":j_0_0"', 'via=":j_9_0"'), "via :j_9_0, which is no lane"),
        (NET.replace('length="10"', 'length="nan"', 1), "no usable length, speed or width"),
        (NET[: len(NET) // 2], "^not well-formed XML: "),
        (NET[: NET.index("<edge")] + "</net>", "no edges"),
    ],
)
def test_a_broken_network_is_refused_with_the_reason(text: str, reason: str) -> None:
    with pytest.raises(InputError, match=reason):
        read_network(text.encode())


def test_entities_are_not_resolved(tmp_path) -> None:
    (tmp_path / "secret").write_text("13.9")
    doctype = f'<!DOCTYPE net [<!ENTITY x SYSTEM "file://{tmp_path}/secret">]>'
    with pytest.raises(InputError):
        read_network((doctype + NET.replace('speed="8"', 'speed="&x;"')).encode())
