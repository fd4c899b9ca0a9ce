from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from odscen.base.errors import NotFoundError
from odscen.lanegraph.query import (
    induced,
    is_connected,
    is_walk_node_id,
    largest_part,
    neighbours,
    node_id,
    node_ids,
    node_index,
    parts_with,
    removable,
    walk_node_id,
    walk_node_ids,
    walk_node_index,
)
from tests.graphs import fork, line_of_segments, two_lane_road

FORK = fork()
LINE = line_of_segments(8)


def test_node_ids_name_road_section_lane_and_place_in_driving_direction() -> None:
    graph = two_lane_road(10.0)
    assert node_ids(graph)[:6] == [
        "1.0.-2.0",
        "1.0.-2.1",
        "1.0.-2.2",
        "1.0.-2.3",
        "1.0.-2.4",
        "1.0.-1.0",
    ]
    assert walk_node_ids(graph)[0] == "ped.1.0.-3.0"


@given(st.integers(0, len(FORK.lanes.x) - 1))
def test_a_node_is_found_by_its_id(i: int) -> None:
    assert node_index(FORK, node_id(FORK, i)) == i
    assert node_id(FORK, i) == node_ids(FORK)[i]


@given(st.integers(0, len(FORK.walks.x) - 1))
def test_a_pedestrian_node_is_found_by_its_id(i: int) -> None:
    name = walk_node_id(FORK, i)
    assert is_walk_node_id(name)
    assert walk_node_index(FORK, name) == i


@pytest.mark.parametrize("name", ["", "1", "1.0.-1.x", "1.0.-1.+1", "9.0.-1.0", "ped.1.0.-1.0"])
def test_an_unknown_node_is_refused_by_name(name: str) -> None:
    with pytest.raises(NotFoundError, match=r"no (pedestrian )?node named"):
        node_index(FORK, name)


def test_an_unknown_node_of_a_known_lane_names_the_last_one() -> None:
    with pytest.raises(NotFoundError, match=r"did you mean 1\.0\.-1\.49"):
        node_index(FORK, "1.0.-1.50")


def test_a_region_takes_its_nodes_and_the_edges_among_them() -> None:
    roi = induced(FORK, ["j9", "r1"])
    assert roi.segments == ("r1", "j9")
    roads = {
        name.split(".")[0] for name, inside in zip(node_ids(FORK), roi.nodes, strict=True) if inside
    }
    assert roads == {"1", "90", "91"}
    assert not roi.nodes[FORK.lanes.target[~roi.edges & roi.nodes[FORK.lanes.source]]].any()
    assert roi.walk_nodes.sum() == 50
    assert roi.walk_edges.sum() == 49


@given(st.sets(st.sampled_from(LINE.segments.ids)))
def test_the_induced_graph_has_exactly_the_edges_with_both_ends_inside(ids: set[str]) -> None:
    roi = induced(LINE, ids)
    inside = np.isin(LINE.lanes.segment, [LINE.segments.ids.index(name) for name in ids])
    np.testing.assert_array_equal(roi.nodes, inside)
    both = [
        inside[s] and inside[t] for s, t in zip(LINE.lanes.source, LINE.lanes.target, strict=True)
    ]
    np.testing.assert_array_equal(roi.edges, both)


@given(st.sets(st.integers(1, 8), min_size=1))
def test_segments_in_a_row_are_connected_without_gaps_only(numbers: set[int]) -> None:
    gapless = max(numbers) - min(numbers) + 1 == len(numbers)
    assert is_connected(LINE.segments, [f"r{i}" for i in numbers]) == gapless


@given(st.sets(st.integers(1, 8), min_size=1))
def test_adding_a_neighbour_keeps_a_region_connected(numbers: set[int]) -> None:
    ids = [f"r{i}" for i in numbers]
    for name in neighbours(LINE.segments, ids):
        assert name not in ids
        if is_connected(LINE.segments, ids):
            assert is_connected(LINE.segments, [*ids, name])


@given(st.sets(st.integers(1, 8), min_size=1))
def test_a_member_is_removable_if_the_others_stay_connected(numbers: set[int]) -> None:
    for graph in (LINE, FORK):
        ids = [name for k, name in enumerate(graph.segments.ids, 1) if k in numbers]
        wanted = set()
        for name in ids:
            rest = [other for other in ids if other != name]
            if not rest or is_connected(graph.segments, rest):
                wanted.add(name)
        assert set(removable(graph.segments, ids)) == wanted


def test_all_neighbours_of_all_members_are_eligible() -> None:
    assert neighbours(FORK.segments, ["r1"]) == ("j9",)
    assert neighbours(FORK.segments, ["r1", "j9"]) == ("r2", "r3")


def test_an_unknown_segment_is_refused_by_name() -> None:
    with pytest.raises(NotFoundError, match="no segment named 'r7'"):
        induced(FORK, ["r7"])


def test_no_segments_are_no_region() -> None:
    assert not is_connected(FORK.segments, [])


def test_the_largest_part_is_the_one_with_most_segments_and_of_equals_the_first() -> None:
    line = LINE.segments
    assert largest_part(line) == line.ids
    beside = [pair for pair in line.adjacency.tolist() if 3 not in pair]
    parted = replace(line, adjacency=np.array(beside, dtype=line.adjacency.dtype))
    assert largest_part(parted) == line.ids[4:]
    beside = [pair for pair in line.adjacency.tolist() if 4 not in pair and 7 not in pair]
    parted = replace(line, adjacency=np.array(beside, dtype=line.adjacency.dtype))
    assert largest_part(parted) == line.ids[:4]


def test_parts_of_a_map_are_those_that_have_segments() -> None:
    line = LINE.segments
    beside = [pair for pair in line.adjacency.tolist() if 3 not in pair]
    parted = replace(line, adjacency=np.array(beside, dtype=line.adjacency.dtype))
    assert parts_with(parted, line.ids[1:2]) == line.ids[:3]
    assert parts_with(parted, [line.ids[5], line.ids[0]]) == line.ids[:3] + line.ids[4:]
    assert parts_with(parted, []) == line.ids[4:]
