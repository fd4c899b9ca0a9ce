from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from odscen.base.ids import LaneKey, RoadId
from odscen.convert.imported import lane_matching as lane_samples
from odscen.convert.imported.lane_matching import LaneSamples, SampledLines, sample_shapes
from odscen.opendrive.lanes import RoadTable
from odscen.opendrive.parse import parse
from tests.opendrive.snippets import document, road

ARC = '<geometry s="0" x="0" y="0" hdg="0" length="31.4"><arc curvature="0.05"/></geometry>'
TABLE = RoadTable.of(parse(document(road(plan=ARC, length=31.4))))
RIGHT, LEFT = (TABLE.lane_index[LaneKey(RoadId("1"), 0, number)] for number in (-1, 1))


def test_samples_run_with_the_traffic() -> None:
    lanes = LaneSamples.of(TABLE, np.array([RIGHT, LEFT]))
    assert lanes.s[lanes.part(0)][[0, -1]].tolist() == [0.0, 31.4]
    assert lanes.s[lanes.part(1)][[0, -1]].tolist() == [31.4, 0.0]
    for lane in (0, 1):
        part = lanes.part(lane)
        ahead = np.diff(lanes.xyz[part][:, :2], axis=0)
        hdg = lanes.hdg[part][:-1]
        assert (ahead[:, 0] * np.cos(hdg) + ahead[:, 1] * np.sin(hdg) > 0).all()


def test_arc_is_measured_on_the_lane_and_not_on_the_reference_line() -> None:
    lanes = LaneSamples.of(TABLE, np.array([RIGHT, LEFT]))
    # Radius 20 m: the right lane's centre runs 1.75 m outside it, the left lane's 1.5 m inside.
    assert lanes.length(0) == pytest.approx(31.4 * 21.75 / 20.0, abs=0.01)
    assert lanes.length(1) == pytest.approx(31.4 * 18.5 / 20.0, abs=0.01)


@given(st.sampled_from([0, 1]), st.floats(0.0, 31.4))
def test_s_and_arc_of_a_lane_are_inverse(lane: int, s: float) -> None:
    lanes = LaneSamples.of(TABLE, np.array([RIGHT, LEFT]))
    assert lanes.s_at(lane, np.array([lanes.arc_at(lane, s)]))[0] == pytest.approx(s, abs=1e-9)


def test_chosen_lanes_keep_their_samples() -> None:
    both = LaneSamples.of(TABLE, np.array([RIGHT, LEFT]))
    one = both.chosen(np.array([1]))
    assert one.rows.tolist() == [LEFT]
    np.testing.assert_array_equal(one.xyz, both.xyz[both.part(1)])
    np.testing.assert_array_equal(one.arc, both.arc[both.part(1)])


def test_a_map_of_absurd_length_is_sampled_less_densely(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(lane_samples, "MOST_SAMPLES", 10)
    assert len(sample_shapes([np.array([[0.0, 0, 0], [1e9, 0, 0]])]).arc) == 11


points = st.tuples(*[st.floats(-50, 50)] * 3)


@pytest.mark.slow
@given(st.lists(st.lists(points, min_size=1, max_size=6), min_size=1, max_size=5))
def test_samples_of_shapes_lie_on_them_and_hold_both_ends(
    shapes: list[list[tuple[float, ...]]],
) -> None:
    arrays = [np.array(shape, dtype=np.float64) for shape in shapes]
    samples = sample_shapes(arrays)
    for i, shape in enumerate(arrays):
        part = slice(samples.first[i], samples.first[i + 1])
        np.testing.assert_allclose(samples.xyz[part][0], shape[0], atol=1e-6)
        np.testing.assert_allclose(samples.xyz[part][-1], shape[-1], atol=1e-6)
        length = np.sqrt((np.diff(shape, axis=0) ** 2).sum(axis=1)).sum()
        assert samples.length[i] == pytest.approx(length, abs=1e-6)
        gaps = np.sqrt((np.diff(samples.xyz[part], axis=0) ** 2).sum(axis=1))
        assert (gaps <= lane_samples.STEP + 1e-6).all()


def test_a_polyline_is_evaluated_by_length() -> None:
    line = SampledLines.of([np.array([[0.0, 0, 0], [3, 0, 0], [3, 4, 0]]), np.array([[9.0, 9, 9]])])
    xyz, hdg = line.at(np.array([0, 0, 1]), np.array([1.0, 5.0, 0.0]))
    np.testing.assert_allclose(xyz, [[1, 0, 0], [3, 2, 0], [9, 9, 9]])
    assert hdg[1] == pytest.approx(np.pi / 2)
