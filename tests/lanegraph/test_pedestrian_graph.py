from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest

from odscen.lanegraph.build_graphs import build_map_graph
from odscen.lanegraph.graphs import MapGraph, WalkKind
from odscen.lanegraph.query import walk_node_ids
from odscen.lanegraph.shortest_paths import WalkRouter
from odscen.opendrive.parse import parse
from tests.lanegraph.roads import junction, lane, network, road, section

if TYPE_CHECKING:
    from pathlib import Path

    from odscen.opendrive.road_model import OpenDrive

CROSSWALK = (
    '<object type="crosswalk" id="77" name="" s="20" t="0" zOffset="0" hdg="0" length="{length}" '
    'width="4" orientation="none"><outline>'
    '<cornerLocal u="-2" v="-{half}" z="0"/><cornerLocal u="2" v="-{half}" z="0"/>'
    '<cornerLocal u="2" v="{half}" z="0"/><cornerLocal u="-2" v="{half}" z="0"/>'
    "</outline></object>"
)
WALKS = (lane(2, kind="sidewalk", width=2.0), lane(-2, kind="sidewalk", width=2.0))


def build(odr: OpenDrive) -> MapGraph:
    return build_map_graph(odr, name="test", sha256="0" * 64)


def street(*, objects: str = "", kind: str = "town", walks: tuple[str, ...] = WALKS) -> MapGraph:
    lanes = section(lane(1), lane(-1), *walks)
    return build(network(road("1", lanes, length=40.0, objects=objects, kind=kind)))


def edges(graph: MapGraph, kind: WalkKind) -> set[tuple[str, str]]:
    ids = walk_node_ids(graph)
    of = graph.walks.kind == kind
    pairs = zip(graph.walks.source[of].tolist(), graph.walks.target[of].tolist(), strict=True)
    return {(ids[source], ids[target]) for source, target in pairs}


def test_walks_run_along_the_middle_of_sidewalks() -> None:
    graph = street()
    assert len(graph.walks.x) == 40
    np.testing.assert_allclose(graph.walks.y[:20], -4.5)
    np.testing.assert_allclose(graph.walks.y[20:], 4.5)
    np.testing.assert_allclose(graph.walks.x[:20], np.arange(1, 40, 2))
    assert not graph.walks.roadside.any()
    assert len(edges(graph, WalkKind.SIDEWALK)) == 38


def test_without_crosswalk_the_two_sides_are_not_connected() -> None:
    assert WalkRouter(street()).reachable(0).sum() == 20


def test_a_crosswalk_connects_the_two_sides() -> None:
    graph = street(objects=CROSSWALK.format(length=4, half=4))
    (crossing,) = np.flatnonzero(graph.walks.kind == WalkKind.CROSSWALK)
    assert graph.walks.crosswalk[crossing] == "1:77"
    assert graph.walks.length[crossing] == pytest.approx(9.0, abs=0.3)  # nodes lie 1 m off s = 20
    ends = graph.walks.x[[graph.walks.source[crossing], graph.walks.target[crossing]]]
    np.testing.assert_allclose(ends, 20.0, atol=1.01)
    assert WalkRouter(graph).reachable(0).all()


def test_a_crosswalk_without_a_walk_on_one_side_connects_nothing() -> None:
    graph = street(objects=CROSSWALK.format(length=4, half=4), walks=WALKS[:1], kind="motorway")
    assert edges(graph, WalkKind.CROSSWALK) == set()


def test_a_side_without_sidewalk_gets_a_roadside_walk_beside_its_outermost_lane() -> None:
    shoulder = lane(-2, kind="shoulder", width=1.5)
    graph = street(walks=(WALKS[0], shoulder))
    assert graph.walks.roadside.tolist() == [True, False]
    assert graph.walks.lane_keys[0].lane == -2
    np.testing.assert_allclose(graph.walks.y[:20], -5.5)
    assert len(edges(graph, WalkKind.ROADSIDE)) == 19


def test_motorways_have_no_roadside_walks() -> None:
    assert len(street(kind="motorway", walks=()).walks.x) == 0


def test_roads_without_traffic_have_no_roadside_walks() -> None:
    odr = network(road("1", section(lane(1, kind="shoulder")), length=40.0))
    assert len(build(odr).walks.x) == 0


def test_successive_roads_are_joined_on_each_side() -> None:
    def lanes(before: int | None, after: int | None) -> str:
        return section(
            *(lane(i, before=before and i, after=after and i) for i in (1, -1)),
            lane(-2, kind="sidewalk", before=before and -2, after=after and -2),
        )

    odr = network(
        road("1", lanes(None, 1), length=10.0, after="road 2 start"),
        road("2", lanes(1, None), x=10.0, length=10.0, before="road 1 end"),
    )
    assert edges(build(odr), WalkKind.JOINT) == {
        ("ped.1.0.-2.4", "ped.2.0.-2.0"),
        ("ped.1.0.1.4", "ped.2.0.1.0"),
    }


def test_ends_that_a_lane_separates_are_not_joined() -> None:
    narrow = section(lane(-1, width=1.5))
    left = section(lane(-1, kind="sidewalk", width=1.0))
    odr = network(
        road("1", narrow, length=40.0, junction="9"),
        road("2", left, x=20.0, y=1.2, length=10.0),
        road("3", left, x=10.0, y=-1.2, length=10.0),
        junction("9"),
    )
    graph = build(odr)
    ends = np.hypot(graph.walks.x[4] - graph.walks.x[5], graph.walks.y[4] - graph.walks.y[5])
    assert ends > 0
    assert edges(graph, WalkKind.JOINT) == set()


def test_ends_on_different_levels_are_not_joined() -> None:
    bridge = '<elevationProfile><elevation s="0" a="6" b="0" c="0" d="0"/></elevationProfile>'
    walk = section(lane(-1, kind="sidewalk", width=1.0))
    low = road("1", walk, length=10.0)
    high = road("2", walk, x=10.0, length=10.0).replace("</planView>", f"</planView>{bridge}")
    assert edges(build(network(low, high)), WalkKind.JOINT) == set()


@pytest.mark.parametrize("name", ["carla-2020/Town04", "carla-2020/Town07"])
def test_every_crosswalk_of_a_town_is_an_edge_of_plausible_length(
    name: str, shared_maps: Path
) -> None:
    graph = build(parse((shared_maps / f"{name}.xodr").read_bytes()))
    crossings = graph.walks.kind == WalkKind.CROSSWALK
    names = [name for name in graph.walks.crosswalk if name]
    assert len(set(names)) == np.count_nonzero(crossings) == {"Town04": 27, "Town07": 7}[name[-6:]]
    assert graph.walks.length[crossings].min() > 3.0
    assert graph.walks.length[crossings].max() < 30.0
