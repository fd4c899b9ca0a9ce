"""Traffic in a steady state is told from a jam that grows."""

from __future__ import annotations

import numpy as np
import polars as pl
import pytest

from odscen.app.learned.snapshot_data import stopped_growth


def growth(rows: pl.DataFrame) -> float:
    return stopped_growth(rows, start=120.0, middle=210.0)


def trajectories(vehicles: int, early: float, late: float) -> pl.DataFrame:
    """Every ten seconds of 120 to 300, with a share that stands before and after 210 s."""
    times = np.repeat(np.arange(0.0, 301.0, 10.0), vehicles)
    place = np.tile(np.arange(vehicles) / vehicles, 31)
    stands = place < np.where(times < 210.0, early, late)
    return pl.DataFrame({"time": times, "speed": np.where(stands, 0.0, 9.0)})


def test_a_jam_that_grows_is_told_from_one_that_stays() -> None:
    assert growth(trajectories(40, 0.2, 0.4)) == pytest.approx(0.2)
    assert growth(trajectories(40, 0.4, 0.4)) == 0.0
    assert growth(trajectories(40, 0.4, 0.1)) == pytest.approx(-0.3)
    assert growth(trajectories(10, 0.0, 1.0)) == 0.0  # too few to say
