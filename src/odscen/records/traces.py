"""Trajectories as SUMO recorded them, made ready for figures and drawings.

SUMO's Parquet output names its columns after whatever came first: ``vehicle_x`` or ``person_x``,
with vehicles and persons alike in them. Positions are front bumpers in SUMO's frame, which is the
OpenDRIVE frame shifted by ``net_offset``.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from odscen.records.row_text import by_vehicle_and_time, numbers

if TYPE_CHECKING:
    from collections.abc import Mapping

    import polars as pl

    from odscen.base.arrays import BoolArray, FloatArray, IntArray


OTHER = "other"
"""Category of road users that are in the trajectories but not among the actors."""

_NAMES = {"id": "id", "x": "x", "y": "y", "speed": "speed"}
_TIMES = ("timestep_time", "time")


def tidy(
    trajectories: pl.DataFrame,
    categories: Mapping[str, str],
    *,
    net_offset: tuple[float, float] = (0.0, 0.0),
) -> pl.DataFrame:
    """Trajectories with columns ``time, id, x, y, speed, category, piece``.

    Parameters
    ----------
    trajectories
        As read from ``trajectories.parquet``; columns prefixed ``vehicle_`` or ``person_``, or not.
    categories
        Category per actor id.
    net_offset
        What SUMO's network adds to OpenDRIVE coordinates, metres.

    Returns
    -------
    polars.DataFrame
        Sorted by id, then time; OpenDRIVE frame; rows without a place left out. ``piece`` numbers
        the stretches without interruption: a teleported one is away for a while.
    """
    import polars as pl

    columns = _column_names(trajectories.columns)
    schema = {"time": pl.Float64, "id": pl.String, "x": pl.Float64, "y": pl.Float64}
    schema |= {"speed": pl.Float64, "category": pl.String, "piece": pl.UInt32}
    if columns is None:
        return pl.DataFrame(schema=schema)
    rows = (
        trajectories.select(pl.col(old).alias(new) for new, old in columns.items())
        .with_columns(pl.col("time", "x", "y", "speed").cast(pl.Float64))
        .filter(pl.col("id").is_not_null() & pl.all_horizontal(pl.col("x", "y").is_finite()))
        .with_columns(pl.col("x") - net_offset[0], pl.col("y") - net_offset[1])
    )
    number, names = numbers(rows["id"])
    order = by_vehicle_and_time(number, rows["time"])
    rows, number = rows[order], number[order]
    kinds = pl.Series([categories.get(name, OTHER) for name in names], dtype=pl.String)
    piece = np.cumsum(_begins_a_piece(rows, number), dtype=np.uint32)
    return rows.with_columns(category=kinds[number], piece=pl.Series(piece)).select(*schema)


def _begins_a_piece(rows: pl.DataFrame, number: IntArray) -> BoolArray:
    """Whether a record is the first of another road user, or after an interruption; not row 0."""
    time, x, y, speed = (rows[name].to_numpy() for name in ("time", "x", "y", "speed"))
    pause = np.diff(time)
    step = float(pause[pause > 0].min(initial=np.inf))
    away = pause > 1.5 * (step if np.isfinite(step) else 1.0)
    # Some teleports end in the step they begin: none covers ten metres more than driving takes.
    moved = np.sqrt(np.diff(x) ** 2 + np.diff(y) ** 2)
    away |= moved > 2.0 * pause * np.fmax(speed[1:], speed[:-1]) + 10.0
    is_begin = np.zeros(len(time), dtype=np.bool_)
    is_begin[1:] = away | (number[1:] != number[:-1])
    return is_begin


def _column_names(columns: list[str]) -> dict[str, str] | None:
    for prefix in ("vehicle_", "person_", ""):
        names = {new: prefix + old for new, old in _NAMES.items()}
        time = next((name for name in _TIMES if name in columns), None)
        if time is not None and all(name in columns for name in names.values()):
            return {"time": time, **names}
    return None


class SpeedCurve(NamedTuple):
    """Speeds per bin of time, m/s; NaN where no vehicle was there. All of shape ``(B,)``."""

    time: FloatArray
    mean: FloatArray
    low: FloatArray
    high: FloatArray


def bin_width(end: float, *, bins: int = 150) -> float:
    """Return a round number of seconds that divides ``end`` into about ``bins`` bins at most."""
    for width in (1.0, 2.0, 5.0, 10.0, 20.0, 30.0, 60.0, 120.0, 300.0, 600.0, 1200.0, 1800.0):
        if end / width <= bins:
            return width
    return float(np.ceil(end / bins / 3600.0) * 3600.0)


def speed_over_time(traces: pl.DataFrame, *, end: float, width: float) -> SpeedCurve:
    """Mean and 10th and 90th percentile of all speeds recorded in each bin of ``width`` seconds."""
    import polars as pl

    n = max(1, int(np.ceil(end / width)))
    time = (np.arange(n, dtype=np.float64) + 0.5) * width
    rows = (
        traces.select("speed", bin=(pl.col("time") / width).floor().cast(pl.Int64))
        .filter(pl.col("bin").is_between(0, n - 1))
        .group_by("bin")
        .agg(
            pl.col("speed").mean().alias("mean"),
            pl.col("speed").quantile(0.1, "linear").alias("low"),
            pl.col("speed").quantile(0.9, "linear").alias("high"),
        )
    )
    index = rows["bin"].to_numpy()
    curves = []
    for name in ("mean", "low", "high"):
        values = np.full(n, np.nan)
        values[index] = rows[name].to_numpy()
        curves.append(values)
    return SpeedCurve(time, *curves)


class ActorCounts(NamedTuple):
    """How many actors are where, at each time; all of shape ``(B,)``."""

    time: FloatArray
    running: FloatArray
    arrived: FloatArray
    waiting: FloatArray


def counts_over_time(
    depart: FloatArray, inserted: FloatArray, arrived: FloatArray, *, end: float, width: float
) -> ActorCounts:
    """Actors on the road, arrived, and waiting to enter, every ``width`` seconds.

    Parameters
    ----------
    depart, inserted, arrived
        Shape ``(A,)``: planned start, start and end per actor in seconds, NaN for "never".
    """
    time = np.arange(int(np.ceil(end / width)) + 1, dtype=np.float64) * width

    def until(times: FloatArray) -> FloatArray:
        known = np.sort(times[np.isfinite(times)])
        return np.searchsorted(known, time, side="right").astype(np.float64)

    entered, left = until(inserted), until(arrived)
    waiting = np.maximum(until(depart) - entered, 0.0)
    return ActorCounts(time, np.maximum(entered - left, 0.0), left, waiting)


class Paths(NamedTuple):
    """Thinned trajectories of all actors, one for every stretch without interruption.

    Attributes
    ----------
    ids
        Actor per trajectory, sorted.
    categories
        Category per trajectory.
    last
        Whether it is the actor's last trajectory.
    xy
        Shape ``(N, 2)``, metres, OpenDRIVE frame.
    start
        Shape ``(K + 1,)``: trajectory ``k`` is ``xy[start[k]:start[k + 1]]``.
    """

    ids: tuple[str, ...]
    categories: tuple[str, ...]
    last: tuple[bool, ...]
    xy: FloatArray
    start: IntArray


def thinned_paths(traces: pl.DataFrame, *, tolerance: float = 0.25) -> Paths:
    """Trajectory of every actor with only the points that matter to ``tolerance`` metres."""
    import polars as pl
    import shapely

    stopped = (pl.col("x") == pl.col("x").shift()) & (pl.col("y") == pl.col("y").shift())
    begins = (pl.col("piece") != pl.col("piece").shift()).fill_null(value=True)
    moved = traces.filter(begins | ~stopped).filter(pl.len().over("piece") > 1)
    if moved.is_empty():
        return Paths((), (), (), np.empty((0, 2)), np.zeros(1, dtype=np.int64))
    several = moved.group_by("piece", maintain_order=True).agg(
        pl.len().alias("n"), pl.col("id").first(), pl.col("category").first()
    )
    last = several["id"] != several["id"].shift(-1, fill_value="")
    lines = shapely.linestrings(
        moved.select("x", "y").to_numpy(), indices=np.repeat(np.arange(len(several)), several["n"])
    )
    lines = shapely.simplify(lines, tolerance, preserve_topology=False)
    xy, index = shapely.get_coordinates(lines, return_index=True)
    start = np.searchsorted(index, np.arange(len(several) + 1)).astype(np.int64)
    return Paths(tuple(several["id"]), tuple(several["category"]), tuple(last), xy, start)


class SpeedCells(NamedTuple):
    """Mean speed by place: lower left corners ``(C, 2)`` in metres, speeds ``(C,)`` in m/s."""

    corner: FloatArray
    speed: FloatArray
    size: float


def speed_by_place(traces: pl.DataFrame, *, size: float = 3.0) -> SpeedCells:
    """Mean speed of everyone who passed, in square cells of ``size`` metres."""
    import polars as pl

    cells = (
        traces.select(
            "speed",
            (pl.col("x") / size).floor().alias("i"),
            (pl.col("y") / size).floor().alias("j"),
        )
        .group_by("i", "j")
        .agg(pl.col("speed").mean())
        .sort("i", "j")
    )
    return SpeedCells(cells.select("i", "j").to_numpy() * size, cells["speed"].to_numpy(), size)


class ActorTravel(NamedTuple):
    """Per actor: metres travelled (straight between recorded points) and mean speed in m/s.

    What a teleport skips is not travelled.
    """

    distance: dict[str, float]
    speed: dict[str, float]


def travel(traces: pl.DataFrame) -> ActorTravel:
    """Distance and mean speed of every actor, from what was recorded."""
    import polars as pl

    step = (pl.col("x").diff() ** 2 + pl.col("y").diff() ** 2).sqrt()
    same = pl.col("piece") == pl.col("piece").shift()
    rows = traces.group_by("id", maintain_order=True).agg(
        step.filter(same).sum().alias("distance"), pl.col("speed").mean().alias("speed")
    )
    ids = rows["id"].to_list()
    return ActorTravel(
        dict(zip(ids, rows["distance"].to_list(), strict=True)),
        dict(zip(ids, rows["speed"].to_list(), strict=True)),
    )
