"""Whether the traffic of a run is in a steady state: what is learned from has to be."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from odscen.learning.traffic_snapshots import STOPPED

if TYPE_CHECKING:
    from collections.abc import Sequence

    import polars as pl

    from odscen.learning.traffic_snapshots import Snapshot

FEW = 30
"""Vehicles, of which one light may stop most."""


def stopped_growth(rows: pl.DataFrame, *, start: float, middle: float) -> float:
    """How much the share of stopped vehicles rises: after ``middle``, from ``start`` until then.

    Parameters
    ----------
    rows
        Trajectories of vehicles: ``time`` (s) and ``speed`` (m/s).
    start, middle
        Seconds of the run.

    Returns
    -------
    float
        Difference of two shares, -1 to 1; 0 for fewer vehicles than :data:`FEW` in the mean.
    """
    rows = rows.filter(rows["time"] >= start)
    late = rows["time"].to_numpy() >= middle
    stands = rows["speed"].to_numpy() < STOPPED
    if late.all() or not late.any() or len(rows) < FEW * rows["time"].n_unique():
        return 0.0
    return float(stands[late].mean() - stands[~late].mean())


def most_stopped(snapshots: Sequence[Snapshot]) -> float:
    """Largest share of stopped vehicles; snapshots of few count together."""
    few = [snapshot.speed for snapshot in snapshots if len(snapshot.speed) < FEW]
    many = [snapshot.speed for snapshot in snapshots if len(snapshot.speed) >= FEW]
    groups = [*many, np.concatenate([np.empty(0), *few])]
    return max((float(np.mean(group < STOPPED)) for group in groups if len(group)), default=0.0)
