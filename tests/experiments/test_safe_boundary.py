import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from odscen.experiments.sweep_page import safe_boundary


def grid(count: int) -> np.ndarray:
    axis = np.linspace(0.0, 1.0, count)
    return np.array([(x * 100.0, y) for x in axis for y in axis])


@pytest.mark.slow
@given(st.floats(0.2, 0.8), st.floats(-0.3, 0.3))
def test_the_boundary_is_within_half_a_cell_of_the_true_one(at: float, slope: float) -> None:
    points = grid(21)
    safe = points[:, 0] / 100.0 > at + slope * (points[:, 1] - 0.5)
    found = safe_boundary(points, safe)
    assert len(found) >= 20
    x, y = found[..., 0].ravel() / 100.0, found[..., 1].ravel()
    assert np.abs(x - (at + slope * (y - 0.5))).max() <= 0.05
    assert y.min() <= 0.05
    assert y.max() >= 0.95


def test_there_is_none_without_both_kinds_of_cases_or_a_plane() -> None:
    points = grid(4)
    assert safe_boundary(points, np.ones(16, dtype=bool)).shape == (0, 2, 2)
    assert safe_boundary(points, np.zeros(16, dtype=bool)).shape == (0, 2, 2)
    line = np.column_stack([np.arange(5.0), np.arange(5.0)])
    assert safe_boundary(line, np.arange(5) > 2).shape == (0, 2, 2)
    assert safe_boundary(np.empty((0, 2)), np.empty(0, dtype=bool)).shape == (0, 2, 2)
    same = np.column_stack([np.zeros(5), np.arange(5.0)])
    assert safe_boundary(same, np.arange(5) > 2).shape == (0, 2, 2)


def test_a_place_with_one_case_that_is_not_safe_is_not_safe() -> None:
    points = np.array([(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0), (0.0, 0.0)])
    safe = np.array([True, True, True, True, False])
    found = safe_boundary(points, safe)
    assert len(found) in (1, 2)
    assert found.max() == 0.5
