"""Archives hold the worst of cases that are alike; coverage counts pairs of values."""

from __future__ import annotations

import numpy as np

from odscen.experiments.searches import distinct, pair_coverage


def test_of_cases_that_are_alike_the_worst_is_kept() -> None:
    places = np.array([[0.1, 0.5], [0.15, 0.52], [0.9, 0.5], [0.15, 0.7]])
    assert distinct(places, [1.0, 1.5, 0.9, 1.2]) == [1, 2, 3]
    assert distinct(places, [1.0, 1.0, 1.0, 1.0]) == [0, 2, 3]
    assert distinct(np.empty((0, 2)), []) == []


def test_coverage_is_the_share_of_pairs_of_parts_that_a_case_lies_in() -> None:
    assert pair_coverage(np.empty((0, 3))) == 0.0
    assert pair_coverage(np.array([[0.1], [0.15], [1.0]])) == 2 / 5
    assert pair_coverage(np.array([[0.1, 0.1], [0.9, 0.1], [0.95, 0.15]])) == 2 / 25
    middle = (np.stack(np.meshgrid(*[np.arange(5)] * 2), -1).reshape(-1, 2) + 0.5) / 5
    assert pair_coverage(middle) == 1.0
