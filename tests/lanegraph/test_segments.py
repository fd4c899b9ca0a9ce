from __future__ import annotations

import itertools
from typing import TYPE_CHECKING

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from odscen.base.ids import RoadId
from odscen.lanegraph.graphs import SegmentPart
from odscen.lanegraph.query import is_connected
from odscen.lanegraph.segments import TARGET_LENGTH, build_segments, segment_name
from tests.lanegraph.roads import junction, lane, network, road, section

if TYPE_CHECKING:
    from odscen.opendrive.road_model import OpenDrive

ONE = section(lane(-1, before=-1, after=-1))


def row_of_roads(lengths: list[float], *, ring: bool = False) -> OpenDrive:
    """Roads 0, 1, 2, ... one behind the other along x."""
    last = len(lengths) - 1
    parts, x = [], 0.0
    for i, length in enumerate(lengths):
        before = f"road {i - 1 if i else last} end" if i or ring else ""
        after = f"road {i + 1 if i < last else 0} start" if i < last or ring else ""
        parts.append(road(str(i), ONE, x=x, length=length, before=before, after=after))
        x += length
    return network(*parts)


def crossing() -> OpenDrive:
    """Roads 1 and 2 into junction 9 over 90, and on to road 3; road 4 lies beyond road 3."""
    return network(
        road("1", ONE, length=250.0, after="junction 9"),
        road(
            "90", ONE, x=250.0, length=20.0, junction="9", before="road 1 end", after="road 3 start"
        ),
        road("3", ONE, x=270.0, length=30.0, before="junction 9", after="road 4 start"),
        road("4", ONE, x=300.0, length=80.0, before="road 3 end"),
        junction("9", ("1", "90", "start")),
    )


def test_each_junction_is_one_segment_and_roads_are_divided_by_length() -> None:
    segments = build_segments(crossing()).segments
    assert segments.ids == ("r1-0", "r1-1", "r3", "j9")
    assert segments.kinds == ("road", "road", "road", "junction")
    np.testing.assert_allclose(segments.lengths, [125.0, 125.0, 110.0, 20.0])
    assert [part.road for part in segments.parts[2]] == ["3", "4"]
    assert segments.adjacency.tolist() == [[0, 1], [1, 3], [2, 3]]


def test_short_roads_without_a_junction_between_them_are_joined() -> None:
    segments = build_segments(row_of_roads([5.0] * 20)).segments
    assert segments.ids == ("r0",)
    assert len(segments.parts[0]) == 20


def test_a_ring_closes() -> None:
    segments = build_segments(row_of_roads([80.0] * 5, ring=True)).segments
    assert segments.ids == ("r0-0", "r0-1", "r0-2", "r0-3")
    assert segments.adjacency.tolist() == [[0, 1], [0, 3], [1, 2], [2, 3]]


def test_roads_that_meet_end_to_end_are_walked_against_s() -> None:
    odr = network(
        road("1", ONE, length=100.0, after="road 2 end"),
        road("2", ONE, x=200.0, hdg=np.pi, length=100.0, after="road 1 end"),
    )
    found = build_segments(odr)
    assert found.segments.ids == ("r1-0", "r1-1")
    assert found.segments.parts[1] == (SegmentPart(RoadId("2"), 0.0, 100.0),)
    np.testing.assert_array_equal(
        found.at(np.array([0, 1, 1]), np.array([99.0, 99.0, 1.0])), [0, 1, 1]
    )


def test_chains_that_meet_at_a_direct_junction_are_neighbours() -> None:
    odr = network(
        road("1", ONE, length=100.0, after="junction 9"),
        road("2", ONE, x=100.0, length=100.0, before="junction 9"),
        junction("9", ("1", "2", "start"), kind="direct"),
    )
    segments = build_segments(odr).segments
    assert segments.ids == ("r1", "r2")
    assert segments.adjacency.tolist() == [[0, 1]]


def test_roads_that_only_one_side_links_are_one_chain() -> None:
    odr = network(
        road("1", ONE, length=100.0, after="road 2 start"), road("2", ONE, x=100.0, length=100.0)
    )
    segments = build_segments(odr).segments
    assert segments.ids == ("r1-0", "r1-1")
    assert segments.adjacency.tolist() == [[0, 1]]


def test_ids_stay_distinct_when_a_road_is_called_like_a_segment_of_a_chain() -> None:
    odr = network(road("1", ONE, length=200.0), road("1-0", ONE, y=50.0, length=50.0))
    assert build_segments(odr).segments.ids == ("r1-0", "r1-1", "r1-0_")


@pytest.mark.slow
@settings(deadline=None, max_examples=60)
@given(st.lists(st.floats(1.0, 400.0), min_size=1, max_size=6), st.booleans())
def test_segments_are_equal_and_cover_all_roads_once(lengths: list[float], ring: bool) -> None:
    odr = row_of_roads(lengths, ring=ring and len(lengths) > 2)
    found = build_segments(odr)
    segments = found.segments
    assert segments.lengths.min() == pytest.approx(segments.lengths.max())
    if sum(lengths) >= TARGET_LENGTH / 2:
        assert 0.5 * TARGET_LENGTH <= segments.lengths[0] <= 1.5 * TARGET_LENGTH
    assert is_connected(segments, segments.ids)
    for index, length in enumerate(lengths):
        parts = sorted(
            (part.s_from, part.s_to)
            for of in segments.parts
            for part in of
            if part.road == str(index)
        )
        assert parts[0][0] == pytest.approx(0.0, abs=2e-3)
        assert parts[-1][1] == pytest.approx(length, abs=2e-3)
        assert all(a[1] == pytest.approx(b[0]) for a, b in itertools.pairwise(parts))
    for row, of in enumerate(segments.parts):
        for part in of:
            middle = np.array([(part.s_from + part.s_to) / 2])
            assert found.at(np.array([int(part.road)]), middle).tolist() == [row]


def test_an_id_with_the_separator_of_movements_has_a_segment_whose_name_has_none() -> None:
    names = [segment_name("road", "a>b"), segment_name("junction", "9>"), segment_name("road", "7")]
    assert names == ["ra%3Eb", "j9%3E", "r7"]
    odr = network(road("a&gt;b", ONE, length=100.0))
    assert build_segments(odr).segments.ids == ("ra%3Eb",)
