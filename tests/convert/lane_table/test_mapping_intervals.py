from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from odscen.convert.lane_table.table import (
    SIMPLE_DEVIATION,
    SIMPLE_S,
    MappingInterval,
    answering,
    monotone,
    simplified,
)

steps = st.lists(st.floats(0.01, 3.0), min_size=1, max_size=60)


@st.composite
def intervals(draw: st.DrawFn) -> MappingInterval:
    along = draw(steps)
    pos = np.concatenate(([0.0], np.cumsum(along)))
    rates = draw(st.lists(st.floats(0.5, 1.5), min_size=len(along), max_size=len(along)))
    s = np.concatenate(([0.0], np.cumsum(np.multiply(along, rates))))
    shift = draw(st.floats(0.0, 20.0))
    s = draw(st.sampled_from([1.0, -1.0])) * s + shift
    deviation = np.abs(np.sin(pos)) * draw(st.floats(0.0, 1.0))
    return MappingInterval(draw(st.integers(0, 2)), draw(st.integers(0, 5)), pos, s, deviation)


def by_pos(interval: MappingInterval, values: np.ndarray, at: np.ndarray) -> np.ndarray:
    return np.interp(at, interval.pos, values)


@given(intervals())
def test_leaving_out_knots_changes_s_and_deviation_by_less_than_the_tolerance(
    interval: MappingInterval,
) -> None:
    kept = simplified(interval)
    assert len(kept.pos) <= len(interval.pos)
    assert np.abs(by_pos(kept, kept.s, interval.pos) - interval.s).max() <= SIMPLE_S + 1e-9
    there = by_pos(kept, kept.deviation, interval.pos)
    assert np.abs(there - interval.deviation).max() <= SIMPLE_DEVIATION + 1e-9
    assert kept.span == interval.span


def test_a_straight_relation_needs_two_knots() -> None:
    line = MappingInterval(0, 0, np.arange(50.0), 7.0 + 1.01 * np.arange(50.0), np.zeros(50))
    assert simplified(line).s.tolist() == [7.0, 7.0 + 1.01 * 49]


def test_knots_that_run_backwards_are_dropped() -> None:
    wavy = MappingInterval(0, 0, np.arange(5.0), np.array([0.0, 1.0, 0.9, 2.0, 3.0]), np.zeros(5))
    kept = monotone(wavy, growing=True)
    assert kept is not None
    assert kept.s.tolist() == [0.0, 1.0, 2.0, 3.0]
    assert kept.pos.tolist() == [0.0, 1.0, 3.0, 4.0]


def test_a_relation_without_extent_is_none() -> None:
    point = MappingInterval(0, 0, np.array([1.0, 1.0]), np.array([4.0, 4.0]), np.zeros(2))
    assert monotone(point, growing=True) is None


@pytest.mark.slow
@given(st.lists(intervals(), max_size=12))
def test_answering_spans_are_disjoint_and_lie_on_their_pieces(
    listed: list[MappingInterval],
) -> None:
    spans = answering(listed)
    assert spans == sorted(spans)
    for one, two in pairwise(spans):
        assert one.lane < two.lane or one.high <= two.low
    for span in spans:
        low, high = listed[span.interval].span
        assert low <= span.low < span.high <= high
        assert listed[span.interval].lane == span.lane


@pytest.mark.slow
@given(st.lists(intervals(), max_size=12))
def test_answering_spans_leave_out_nothing_but_slivers(listed: list[MappingInterval]) -> None:
    spans = answering(listed, least=1e-6)
    for interval in listed:
        low, high = interval.span
        places = np.linspace(low, high, 30)
        own = [span for span in spans if span.lane == interval.lane]
        for place in places:
            assert any(span.low - 1e-5 <= place <= span.high + 1e-5 for span in own)


def test_of_two_pieces_on_one_stretch_the_nearer_answers() -> None:
    far = MappingInterval(0, 1, np.array([0.0, 10.0]), np.array([0.0, 10.0]), np.full(2, 0.5))
    near = MappingInterval(0, 2, np.array([0.0, 4.0]), np.array([3.0, 7.0]), np.full(2, 0.1))
    spans = [(span.low, span.high, span.interval) for span in answering([far, near])]
    assert spans == [(0.0, 3.0, 0), (3.0, 7.0, 1), (7.0, 10.0, 0)]
