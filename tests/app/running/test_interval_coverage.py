"""Intervals of a few seeds hold the mean of many as often as they say."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest

from bench.intervals import AIM, coverage, crossing, values_of_runs
from odscen.maps.store import Workspace
from tests.signal_case import MAP

if TYPE_CHECKING:
    from pathlib import Path


def test_intervals_of_symmetric_values_cover_their_mean_and_of_skewed_ones_less_often() -> None:
    rng = np.random.default_rng(1)
    normal = (30.0 + 4.0 * rng.standard_normal(400)).tolist()
    for size in (5, 10):
        assert AIM[0] <= coverage(normal, size, sets=4000) <= AIM[1]
    # One run in twenty breaks down: five seeds may have none of them.
    skewed = (30.0 + 4.0 * rng.standard_normal(400) + 60.0 * (rng.random(400) < 0.05)).tolist()
    assert coverage(skewed, 5) < AIM[0]


@pytest.mark.slow
def test_runs_of_the_bench_scatter_with_the_seed(tmp_path: Path) -> None:
    """A sample of the bench: ten runs, each with other vehicles and another delay."""
    workspace = Workspace.open(tmp_path)
    workspace.add_map(MAP)
    values = values_of_runs(workspace, crossing(workspace, "random", 300.0), 10)
    assert {len(set(known)) for known in values.values()} == {10}
    kilometres = np.array(values["vehicle_km"])
    # 200 vehicles in ten minutes scatter by 7 %, and kilometres with them.
    assert 0.02 < kilometres.std(ddof=1) / kilometres.mean() < 0.15
