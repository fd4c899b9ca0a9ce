"""How much lines bend."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from odscen.base.bends import largest_curvature


@given(
    radius=st.floats(3.0, 500.0),
    quarter=st.floats(0.3, 3.0),
    spacing=st.floats(0.1, 1.0),
    left=st.booleans(),
    begin=st.floats(-4.0, 4.0),
)
def test_an_arc_has_the_curvature_of_its_radius(radius, quarter, spacing, left, begin):
    sign = 1.0 if left else -1.0
    length = max(quarter * radius, 6.0)
    along = np.linspace(0.0, length, math.ceil(length / spacing) + 1)
    hdg = begin + sign * along / radius
    steps = np.diff(along, prepend=0.0)
    line = np.column_stack([np.cumsum(steps * np.cos(hdg)), np.cumsum(steps * np.sin(hdg))])
    assert largest_curvature(line, 2.0) == pytest.approx(1.0 / radius, rel=0.05)


def test_a_corner_counts_over_the_window():
    corner = [(0.0, 0.0, 1.0), (10.0, 0.0, 2.0), (10.0, 10.0, 3.0)]
    assert largest_curvature(corner, 20.0) == pytest.approx(math.pi / 2.0 / 20.0)


@pytest.mark.parametrize(
    "line", [[(0, 0), (5, 5)], [(0, 0), (0, 0), (0, 0)], [(0, 0), (1, 0), (9, 0)]]
)
def test_what_is_straight_has_none(line):
    assert largest_curvature(line, 2.0) == 0.0
