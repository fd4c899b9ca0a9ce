from __future__ import annotations

import json

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from odscen.base.errors import GraphFormatError
from odscen.base.ids import LaneKey, RoadId, SumoEdgeId, SumoLaneId
from odscen.convert.lane_table.table import SNAP
from odscen.convert.lane_table.table_json import table_from_json, table_to_json
from tests.convert.tables import AGAINST, DRIVE, INSIDE, WALK, table

TABLE = table()
STRETCHES = {DRIVE: (1.0, 99.0), AGAINST: (2.5, 100.0), INSIDE: (0.0, 12.5), WALK: (10.0, 90.0)}


@given(st.sampled_from(list(STRETCHES)), st.floats(0.0, 1.0))
def test_to_sumo_and_back_gives_the_same_place(key: LaneKey, share: float) -> None:
    low, high = STRETCHES[key]
    s = low + share * (high - low)
    place = TABLE.to_sumo(key, s)
    assert place is not None
    back = TABLE.to_xodr(place.lane, place.pos)
    assert back is not None
    assert back.lane == key
    assert abs(back.s - s) < 1e-6
    assert back.deviation == pytest.approx(place.deviation, abs=1e-9)


def test_a_place_names_edge_lane_index_and_what_kind_of_lane_it_is() -> None:
    place = TABLE.to_sumo(DRIVE, 75.0)
    assert place is not None
    assert place[:5] == ("b", "b_0", 0, 20.0, 0.02)
    assert not place.internal
    inside = TABLE.to_sumo(INSIDE, 1.0)
    assert inside is not None
    assert inside.internal


def test_traffic_against_s_has_falling_s_on_growing_positions() -> None:
    near, far = (TABLE.to_sumo(AGAINST, s) for s in (99.0, 3.0))
    assert near is not None
    assert far is not None
    assert near.pos < far.pos


def test_a_place_just_beside_an_interval_is_taken_to_its_end_and_says_how_far_that_is() -> None:
    place = TABLE.to_sumo(DRIVE, 99.2)
    assert place is not None
    assert (place.lane, place.pos) == ("b_0", 50.0)
    assert place.deviation == pytest.approx(np.hypot(0.02, 0.2))


@pytest.mark.parametrize(
    ("key", "s"),
    [
        (DRIVE, 99.0 + SNAP + 0.01),
        (WALK, 5.0),
        (INSIDE, -1.0),
        (LaneKey(RoadId("7"), 0, -1), 1.0),
        (LaneKey(RoadId("1"), 1, -1), 1.0),
    ],
)
def test_where_there_is_no_sumo_lane_there_is_no_place(key: LaneKey, s: float) -> None:
    assert TABLE.to_sumo(key, s) is None


def test_where_there_is_no_opendrive_lane_there_is_no_place() -> None:
    assert TABLE.to_xodr(SumoLaneId(":k_w_0"), 1.0) is None
    assert TABLE.to_xodr(SumoLaneId("w_0"), 1.0) is None
    assert TABLE.to_xodr(SumoLaneId("nowhere"), 1.0) is None


def test_many_places_are_what_single_ones_are() -> None:
    keys = (INSIDE, LaneKey(RoadId("9"), 0, 1), DRIVE)
    lane = np.array([2, 0, 1, 2, 2])
    s = np.array([30.0, 6.0, 1.0, 80.0, 500.0])
    places = TABLE.sumo_places(keys, lane, s)
    for i, (row, at) in enumerate(zip(lane, s, strict=True)):
        single = TABLE.to_sumo(keys[row], at)
        if single is None:
            assert places.lane[i] == -1
            assert np.isnan(places.pos[i])
        else:
            assert TABLE.lane_list[places.lane[i]].id == single.lane
            assert places.pos[i] == single.pos


def test_no_places_asked_for_are_no_places() -> None:
    none = TABLE.sumo_places((), np.zeros(0, dtype=np.int32), np.zeros(0))
    assert none.lane.shape == none.pos.shape == (0,)


def test_the_json_form_gives_the_table_back() -> None:
    text = table_to_json(TABLE)
    back = table_from_json(text)
    assert table_to_json(back) == text
    assert back.lanes == TABLE.lanes
    assert back.edges == TABLE.edges
    assert back.links == TABLE.links
    assert back.walk_links == TABLE.walk_links
    assert back.lights == TABLE.lights
    assert (back.net_offset, back.boundary) == (TABLE.net_offset, TABLE.boundary)
    assert (back.lefthand, back.elevation, back.counts) == (False, True, TABLE.counts)
    for one, other in zip(back.intervals, TABLE.intervals, strict=True):
        np.testing.assert_array_equal(one.s, other.s)
        np.testing.assert_array_equal(one.pos, other.pos)


@pytest.mark.parametrize("text", ["", "{}", "[]", '{"version": 99}'])
def test_another_text_is_refused(text: str) -> None:
    with pytest.raises(GraphFormatError, match="not a lane table"):
        table_from_json(text)


def test_a_table_with_a_dangling_row_is_refused() -> None:
    data = json.loads(table_to_json(TABLE))
    data["lanes"]["edge"][0] = 99
    with pytest.raises(GraphFormatError):
        table_from_json(json.dumps(data))


def test_walkers_get_from_edge_to_edge_over_walking_areas() -> None:
    assert TABLE.walk_connected(SumoEdgeId("w"), SumoEdgeId("v"))
    assert TABLE.walk_neighbours[SumoEdgeId(":k_w")] == ("v", "w")
    assert not TABLE.walk_connected(SumoEdgeId("w"), SumoEdgeId("u"))
    assert TABLE.walk_connected(SumoEdgeId("u"), SumoEdgeId("u"))


def test_permissions_and_links_are_kept() -> None:
    assert TABLE.allowed(SumoLaneId("b_0"), "tram")
    assert not TABLE.allowed(SumoLaneId("a_0"), "pedestrian")
    assert [link.to_lane for link in TABLE.links_from[SumoLaneId("a_0")]] == ["b_0"]
