from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from odscen.base.errors import InputError
from odscen.lanegraph.build_graphs import build_map_graph
from odscen.lanegraph.columns import check_map_graph
from odscen.lanegraph.graph_files import from_graphml, to_graphml, to_npz_bytes
from odscen.lanegraph.graphs import CHANGE_LEFT, CHANGE_RIGHT, MapGraph, Relation
from odscen.lanegraph.lane_nodes import place_nodes
from odscen.lanegraph.query import node_id, node_ids, node_index
from odscen.opendrive.lanes import RoadTable
from tests.lanegraph.roads import junction, lane, network, road, section

if TYPE_CHECKING:
    from odscen.opendrive.road_model import OpenDrive


def build(odr: OpenDrive, *, spacing: float = 2.0) -> MapGraph:
    return build_map_graph(odr, name="test", sha256="0" * 64, spacing=spacing)


def edges(graph: MapGraph, relation: Relation) -> set[tuple[str, str]]:
    ids = node_ids(graph)
    of = graph.lanes.relation == relation
    pairs = zip(graph.lanes.source[of].tolist(), graph.lanes.target[of].tolist(), strict=True)
    return {(ids[source], ids[target]) for source, target in pairs}


def two_way(**options: str) -> OpenDrive:
    lanes = section(lane(1), lane(-1), **options)
    return network(road("1", lanes, length=10.0))


def side_by_side(change: str, *, length: float = 10.0) -> MapGraph:
    """Lanes 2 and 1 to the west, -1 and -2 to the east, with one rule between each pair."""
    inner, outer = (1, -1), (2, -2)
    lanes = [*(lane(i, change=change) for i in inner), *(lane(i) for i in outer)]
    return build(network(road("1", section(*lanes, centre="both"), length=length)))


def test_nodes_lie_half_a_spacing_from_the_ends_in_driving_direction() -> None:
    graph = build(two_way())
    assert node_ids(graph)[0] == "1.0.-1.0"
    np.testing.assert_allclose(graph.lanes.x[:5], [1, 3, 5, 7, 9])
    np.testing.assert_allclose(graph.lanes.y[:5], -1.75)
    np.testing.assert_allclose(graph.lanes.hdg[:5], 0.0)
    np.testing.assert_allclose(graph.lanes.x[5:], [9, 7, 5, 3, 1])
    np.testing.assert_allclose(graph.lanes.y[5:], 1.75)
    np.testing.assert_allclose(np.abs(graph.lanes.hdg[5:]), np.pi)


def test_left_hand_traffic_drives_on_positive_lanes() -> None:
    graph = build(network(road("1", section(lane(1), lane(-1)), length=10.0, rule="LHT")))
    np.testing.assert_allclose(graph.lanes.x[5:], [1, 3, 5, 7, 9])
    np.testing.assert_allclose(graph.lanes.x[:5], [9, 7, 5, 3, 1])


@pytest.mark.slow
@settings(deadline=None, max_examples=50)
@given(
    st.floats(3.0, 200.0),
    st.floats(-0.05, 0.05).filter(lambda k: abs(k) > 1e-3),
    st.floats(0.5, 10.0),
)
def test_gaps_are_equal_along_the_centre_line_of_an_arc(
    length: float, curvature: float, spacing: float
) -> None:
    odr = network(road("1", section(lane(1), lane(-1)), length=length, curvature=curvature))
    graph = build(odr, spacing=spacing)
    for row in range(2):
        first, end = graph.lanes.lanes.first_node[row : row + 2]
        side = np.sign(graph.lanes.lanes.keys[row].lane)
        exact = length * (1 - curvature * side * 1.75)
        counts = {max(1, round(exact * part / spacing)) for part in (1 - 2e-4, 1.0)}
        assert graph.lanes.lanes.lengths[row] == pytest.approx(exact, rel=2e-4)
        assert end - first in counts
        s = np.sort(graph.lanes.s[first:end])
        np.testing.assert_allclose(s, (np.arange(end - first) + 0.5) * length / (end - first))
        turn = graph.lanes.curvature[first:end]
        np.testing.assert_allclose(turn, -side * curvature / (1 - curvature * side * 1.75))


def test_a_lane_shorter_than_the_spacing_has_one_node_in_its_middle() -> None:
    graph = build(network(road("1", section(lane(-1)), length=0.4)))
    np.testing.assert_allclose(graph.lanes.x, [0.2])


def test_successors_lead_along_the_lane_and_across_roads() -> None:
    odr = network(
        road("1", section(lane(-1, after=-1)), length=4.0, after="road 2 start"),
        road("2", section(lane(-1, before=-1)), x=4.0, length=6.0, before="road 1 end"),
    )
    graph = build(odr)
    assert edges(graph, Relation.SUCCESSOR) == {
        ("1.0.-1.0", "1.0.-1.1"),
        ("1.0.-1.1", "2.0.-1.0"),
        ("2.0.-1.0", "2.0.-1.1"),
        ("2.0.-1.1", "2.0.-1.2"),
    }
    np.testing.assert_allclose(graph.lanes.length, 2.0)


def test_lanes_of_opposite_directions_are_not_neighbours() -> None:
    graph = build(two_way(centre="both"))
    assert set(graph.lanes.left_lane) == {-1}
    assert set(graph.lanes.right_lane) == {-1}


@pytest.mark.parametrize(
    ("change", "left_of", "right_of"),
    [
        ("both", {-2, 2}, {-1, 1}),
        ("none", set(), set()),
        # to higher ids: from -2 to -1 is to the left, from 1 to 2 is to the right
        ("increase", {-2}, {1}),
        ("decrease", {2}, {-1}),
    ],
)
def test_the_mark_between_two_lanes_rules_changes_by_lane_ids(
    change: str, left_of: set[int], right_of: set[int]
) -> None:
    graph = side_by_side(change)
    number = np.array([key.lane for key in graph.lanes.lanes.keys])[graph.lanes.lane]
    assert set(number[graph.lanes.lane_change & CHANGE_LEFT != 0]) == left_of
    assert set(number[graph.lanes.lane_change & CHANGE_RIGHT != 0]) == right_of
    assert set(number[graph.lanes.left_lane >= 0]) == {-2, 2}
    for relation, lanes in ((Relation.LEFT, left_of), (Relation.RIGHT, right_of)):
        sources = {int(source.split(".")[2]) for source, _ in edges(graph, relation)}
        assert sources == lanes


def test_a_change_leads_one_spacing_ahead() -> None:
    graph = side_by_side("both", length=6.0)
    assert edges(graph, Relation.LEFT) == {
        ("1.0.-2.0", "1.0.-1.1"),
        ("1.0.-2.1", "1.0.-1.2"),
        ("1.0.2.0", "1.0.1.1"),
        ("1.0.2.1", "1.0.1.2"),
    }
    side = graph.lanes.relation != Relation.SUCCESSOR
    np.testing.assert_allclose(graph.lanes.length[side], np.hypot(2.0, 3.5))


def test_a_change_at_the_end_of_a_section_leads_into_the_one_lane_that_follows() -> None:
    lanes = [lane(i, before=i, after=i) for i in (-1, -2)]
    odr = network(road("1", section(*lanes), section(*lanes, s=6.0), length=12.0))
    assert ("1.0.-2.2", "1.1.-1.0") in edges(build(odr), Relation.LEFT)


def test_no_change_leads_into_a_lane_that_is_too_narrow() -> None:
    taper = lane(-2, width=0.0, slope=0.1)  # 1 m wide at s = 10
    graph = build(network(road("1", section(lane(-1), taper), length=40.0)))
    narrow = graph.lanes.s < 10.0
    assert set(graph.lanes.right_lane[narrow]) == {-1}
    assert graph.lanes.width.min() >= 1.0
    for _, target in edges(graph, Relation.RIGHT):
        assert graph.lanes.s[node_index(graph, target)] >= 10.0
    assert node_id(graph, 0) == "1.0.-2.0"
    assert graph.lanes.s[0] == pytest.approx(11.0, abs=0.1)


def test_an_edge_passes_through_a_lane_that_has_no_nodes() -> None:
    thin = section(lane(-1, width=0.3, before=-1, after=-1), s=10.0)
    wide = lane(-1, before=-1, after=-1)
    odr = network(road("1", section(wide), thin, section(wide, s=14.0), length=24.0))
    graph = build(odr)
    assert ("1.0.-1.4", "1.2.-1.0") in edges(graph, Relation.SUCCESSOR)
    assert graph.lanes.length.max() == pytest.approx(6.0, abs=0.5)


def test_lanes_of_other_types_have_no_nodes() -> None:
    lanes = [lane(-1), lane(-2, kind="shoulder"), lane(-3, kind="sidewalk"), lane(1, kind="bus")]
    graph = build(network(road("1", section(*lanes), length=10.0)))
    assert [key.lane for key in graph.lanes.lanes.keys] == [-1, 1]
    assert graph.lanes.lanes.types == ("driving", "bus")


def test_speed_limits_are_those_of_the_lane_else_of_the_road_else_unknown() -> None:
    known = road("1", section(lane(-1)), length=10.0, speed='<speed max="50" unit="km/h"/>')
    graph = build(network(known, road("2", section(lane(-1)), y=20.0, length=10.0)))
    np.testing.assert_allclose(graph.lanes.speed_limit[:5], 50 / 3.6)
    assert np.isnan(graph.lanes.speed_limit[5:]).all()


def test_nodes_know_their_segment_and_junction() -> None:
    odr = network(
        road("1", section(lane(-1, after=-1)), length=150.0, after="junction 9"),
        road(
            "90",
            section(lane(-1, before=-1)),
            x=150.0,
            length=20.0,
            junction="9",
            before="road 1 end",
        ),
        junction("9", ("1", "90", "start")),
    )
    graph = build(odr)
    of_node = [graph.segments.ids[row] for row in graph.lanes.segment]
    assert Counter(of_node) == {"r1-0": 38, "r1-1": 37, "j9": 10}
    assert graph.lanes.lanes.junctions == (None, "9")


@pytest.mark.parametrize("spacing", [0.0, -1.0, float("nan"), float("inf"), 1e-9])
def test_a_spacing_out_of_range_is_refused(spacing: float) -> None:
    with pytest.raises(InputError, match="spacing"):
        build(two_way(), spacing=spacing)


def test_lanes_that_would_not_fit_into_memory_are_refused() -> None:
    with pytest.raises(InputError, match=r"road 1: .*4e\+06 m long together"):
        build(network(road("1", section(*(lane(-i) for i in range(1, 5))), length=999_999.0)))


@pytest.mark.slow
def test_more_lanes_are_built_where_more_are_allowed() -> None:
    odr = network(road("1", section(*(lane(-i) for i in range(1, 3))), length=600_000.0))
    table = RoadTable.of(odr)
    words = r"more than 1e\+06 m; a build that may use more memory \(--build-memory\) may have more"
    with pytest.raises(InputError, match=words):
        place_nodes(table, 100.0)
    nodes = place_nodes(table, 100.0, most=1.3e6)
    assert len(nodes.lane) == 12_000


def test_two_builds_of_a_map_give_equal_bytes() -> None:
    one, other = side_by_side("both", length=55.0), side_by_side("both", length=55.0)
    assert to_npz_bytes(one) == to_npz_bytes(other)
    assert to_graphml(one) == to_graphml(other)


@pytest.mark.slow
@settings(deadline=None, max_examples=25)
@given(
    st.floats(1.0, 60.0),
    st.lists(st.sampled_from(["driving", "bus", "sidewalk", "shoulder"]), max_size=3),
    st.lists(st.sampled_from(["driving", "exit", "sidewalk", "parking"]), max_size=3),
    st.sampled_from(["both", "none", "increase", "decrease"]),
    st.sampled_from(["RHT", "LHT"]),
    st.floats(0.5, 8.0),
)
def test_any_road_gives_a_consistent_graph(
    length: float, left: list[str], right: list[str], change: str, rule: str, spacing: float
) -> None:
    lanes = [lane(i + 1, kind=kind, change=change) for i, kind in enumerate(left)]
    lanes += [lane(-i - 1, kind=kind, change=change) for i, kind in enumerate(right)]
    odr = network(road("1", section(*lanes), length=length, rule=rule))
    graph = check_map_graph(build(odr, spacing=spacing))
    assert to_npz_bytes(from_graphml(to_graphml(graph))) == to_npz_bytes(graph)
    order = np.lexsort((graph.lanes.target, graph.lanes.relation, graph.lanes.source))
    np.testing.assert_array_equal(order, np.arange(len(order)))
    gone = graph.lanes.x[graph.lanes.target] - graph.lanes.x[graph.lanes.source]
    assert np.all(gone * np.cos(graph.lanes.hdg[graph.lanes.source]) > 0)
