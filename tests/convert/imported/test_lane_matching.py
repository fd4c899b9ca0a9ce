from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from odscen.base.ids import LaneKey, RoadId
from odscen.convert.imported.lane_matching import (
    REACH,
    LaneSamples,
    intervals_of,
    match,
    sample_shapes,
)
from odscen.opendrive.lanes import RoadTable
from odscen.opendrive.parse import parse
from tests.opendrive.snippets import document, lane, road, section

CURVE = '<geometry s="0" x="0" y="0" hdg="0" length="80"><arc curvature="0.02"/></geometry>'
LANES = "".join(section(lane(1), lane(-1), lane(-2), s=s) for s in (0.0, 30.5))
TABLE = RoadTable.of(parse(document(road(plan=CURVE, length=80.0, lanes=LANES))))
SAMPLES = LaneSamples.of(TABLE, np.arange(len(TABLE.lane_keys)))
NOTHING = np.zeros(len(SAMPLES.rows))


def row(section_number: int, number: int) -> int:
    return TABLE.lane_index[LaneKey(RoadId("1"), section_number, number)]


def line(number: int, start: float, end: float, aside: float = 0.0) -> np.ndarray:
    """A shape along a lane's centre, ``aside`` metres to the left of growing s."""
    s = np.linspace(start, end, 200)
    rows = np.where(s < 30.5, row(0, number), row(1, number))
    at = TABLE.lane_points(rows, s)
    x, y = at.x - aside * np.sin(at.hdg), at.y + aside * np.cos(at.hdg)
    return np.column_stack((x, y, at.z))


@given(st.sampled_from([1, -1, -2]), st.floats(-1.2, 1.2), st.floats(5.0, 60.0))
def test_a_place_beside_a_lane_is_matched_with_its_s_and_its_distance(
    number: int, aside: float, at: float
) -> None:
    ends = (at + 15.0, at) if number > 0 else (at, at + 15.0)
    places = sample_shapes([line(number, *ends, aside)])
    found = match(places, SAMPLES, TABLE, penalty=NOTHING)
    numbers = {TABLE.lane_keys[SAMPLES.rows[i]].lane for i in found.lane}
    assert numbers == {number}
    np.testing.assert_allclose(found.deviation, abs(aside), atol=0.005)
    along = np.interp(places.arc, [0.0, places.length[0]], ends)
    np.testing.assert_allclose(found.s, along, atol=0.02)


def test_lanes_of_opposite_direction_match_only_either_way() -> None:
    places = sample_shapes([line(-2, 20.0, 10.0)])
    assert (match(places, SAMPLES, TABLE, penalty=NOTHING).lane == -1).all()
    found = match(places, SAMPLES, TABLE, penalty=NOTHING, either_way=True)
    assert {TABLE.lane_keys[SAMPLES.rows[i]].lane for i in found.lane} == {-2}


def test_what_is_too_far_beside_every_lane_is_not_matched() -> None:
    places = sample_shapes([line(-2, 10.0, 20.0, -REACH - 0.1)])
    assert (match(places, SAMPLES, TABLE, penalty=NOTHING).lane == -1).all()


def test_a_penalty_gives_the_place_to_another_lane() -> None:
    places = sample_shapes([line(-1, 10.0, 20.0, -1.6)])
    plain = match(places, SAMPLES, TABLE, penalty=NOTHING)
    assert {TABLE.lane_keys[SAMPLES.rows[i]].lane for i in plain.lane} == {-1}
    penalty = np.where(SAMPLES.rows == row(0, -1), 0.5, 0.0)
    shifted = match(places, SAMPLES, TABLE, penalty=penalty)
    assert {TABLE.lane_keys[SAMPLES.rows[i]].lane for i in shifted.lane} == {-2}


def test_pieces_meet_where_the_section_ends() -> None:
    places = sample_shapes([line(-1, 4.0, 71.0)])
    found = match(places, SAMPLES, TABLE, penalty=NOTHING)
    length = places.length * 1.02
    one, two = intervals_of(places, found, SAMPLES, TABLE, sumo_rows=np.array([5]), lengths=length)
    assert (one.lane, two.lane) == (row(0, -1), row(1, -1))
    assert (one.sumo, two.sumo) == (5, 5)
    assert (one.s[-1], two.s[0]) == (30.5, 30.5)
    assert one.pos[-1] == two.pos[0]
    assert one.pos[-1] == pytest.approx(length[0] * 26.5 / 67.0, abs=0.02)
    assert (one.pos[0], two.pos[-1]) == (0.0, pytest.approx(length[0]))
