from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial import cKDTree

from odscen.base import nearest_points
from odscen.base.nearest_points import nearest


@pytest.mark.parametrize("at_once", [1, 100, 1_000_000])
def test_nearest_points_are_those_of_a_tree(monkeypatch, at_once: int) -> None:
    monkeypatch.setattr(nearest_points, "_AT_ONCE", at_once)
    rng = np.random.default_rng(3)
    points, among = rng.normal(size=(500, 2)), rng.normal(size=(40, 2))
    away, row = nearest(points, among)
    expected_away, expected_row = cKDTree(among).query(points)
    assert row.tolist() == expected_row.tolist()
    np.testing.assert_allclose(away, expected_away, rtol=1e-12)


def test_of_points_as_near_the_first_is_taken() -> None:
    away, row = nearest(np.array([[0.0, 0.0]]), np.array([[0.0, 2.0], [2.0, 0.0]]))
    assert (away.tolist(), row.tolist()) == ([2.0], [0])


def test_no_points_have_no_nearest() -> None:
    away, row = nearest(np.empty((0, 2)), np.array([[0.0, 2.0]]))
    assert len(away) == len(row) == 0
