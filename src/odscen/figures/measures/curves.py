"""A run over time as plain numbers, to be drawn."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from odscen.records.traces import (
    ActorCounts,
    SpeedCurve,
    bin_width,
    counts_over_time,
    speed_over_time,
    tidy,
)

if TYPE_CHECKING:
    from collections.abc import Sequence

    import polars as pl

    from odscen.base.arrays import FloatArray
    from odscen.figures.measures.summary import ActorOutcome
    from odscen.records.run_plan import Plan

SPEED_BIN = 5 / 3.6
"""Width of the bins of :class:`SpeedShares`: 5 km/h in m/s."""


class SpeedShares(NamedTuple):
    """Share of vehicle time in each bin of speed; edges ``(B + 1,)`` in m/s, shares ``(B,)``."""

    edges: FloatArray
    share: FloatArray


class CurveTable(NamedTuple):
    """What a run looked like over time; speeds are of vehicles only."""

    counts: ActorCounts
    speeds: SpeedCurve
    shares: SpeedShares


def presence(actors: Sequence[ActorOutcome], *, end: float) -> ActorCounts:
    """How many were on the road, had arrived, and were not inserted yet, up to ``end`` seconds."""
    depart, inserted, arrived = (
        np.array([_number_or_nan(getattr(actor, key)) for actor in actors])
        for key in ("depart", "inserted", "arrived")
    )
    return counts_over_time(depart, inserted, arrived, end=end, width=bin_width(end))


def speed_shares(speeds: FloatArray) -> SpeedShares:
    """Share of all recorded moments in each bin; no bins if there are none."""
    if not len(speeds):
        return SpeedShares(np.zeros(1), np.zeros(0))
    bins = int(speeds.max() // SPEED_BIN) + 1
    edges = np.arange(bins + 1, dtype=np.float64) * SPEED_BIN
    counts, _ = np.histogram(speeds, edges)
    return SpeedShares(edges, counts.astype(np.float64) / len(speeds))


def run_curves(
    plan: Plan, actors: Sequence[ActorOutcome], trajectories: pl.DataFrame, *, end: float
) -> CurveTable:
    """Curves of one run that lasted ``end`` simulated seconds.

    Parameters
    ----------
    trajectories
        As read from ``trajectories.parquet``.
    """
    end = max(end, 1.0)
    traces = tidy(trajectories, {actor.id: actor.category for actor in plan.actors})
    vehicles = traces.filter(traces["category"] != "pedestrian")
    return CurveTable(
        presence(actors, end=end),
        speed_over_time(vehicles, end=end, width=bin_width(end)),
        speed_shares(vehicles["speed"].to_numpy()),
    )


def _number_or_nan(value: object) -> float:
    return float(value) if isinstance(value, int | float) else float("nan")
