"""Tracks by time, for a player: who was where at each moment, as files that are read in parts."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np
import polars as pl

from odscen.base.categories import DEFAULT_BODY, Category

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from odscen.base.arrays import FloatArray, IntArray

_ROW: Final = np.dtype("<f4")
_COLUMNS: Final = 5
TIMES_FILE, FIRST_FILE, ROWS_FILE = "times.bin", "first.bin", "rows.bin"
"""Moments (float64, s), the first row of each and one past the last (int64), and rows of five
float32: road user, x, y (m from the origin), hdg (rad), speed (m/s); those of one moment in any
order."""
MOMENT_FILES: Final = (TIMES_FILE, FIRST_FILE, ROWS_FILE)


class Moments(NamedTuple):
    """Part of the moments of a recording.

    Attributes
    ----------
    times
        Shape ``(M,)``, s.
    first
        Shape ``(M + 1,)``: rows ``first[i]`` up to ``first[i + 1]`` belong to ``times[i]``.
    rows
        Shape ``(N, 5)``, float32, as :data:`ROWS_FILE` has them.
    """

    times: FloatArray
    first: IntArray
    rows: Any

    def packed(self) -> bytes:
        """Two uint32, moments and rows, then ``times``, ``first`` as uint32, and ``rows``."""
        head = np.array([len(self.times), len(self.rows)], dtype="<u4")
        parts = (head, self.times.astype("<f8"), self.first.astype("<u4"), self.rows)
        return b"".join(part.tobytes() for part in parts)


def write_moments(
    parts: Sequence[pl.LazyFrame], folder: Path
) -> tuple[list[dict[str, Any]], tuple[float, float]]:
    """Write tracks by time.

    Parameters
    ----------
    parts
        Tracks, each part with all of its road users; rows of no category are left out.
    folder
        Where the three files are written.

    Returns
    -------
    tuple
        Road users in the order of their numbers, each with ``id``, ``category``, ``kind``,
        ``begin``, ``end`` (s), ``length`` and ``width`` (m); and the origin of places.
    """
    known = [part.filter(pl.col("category").is_not_null()) for part in parts]
    users = pl.concat([_users_of(part) for part in known]).sort("begin", "id")
    # Frames of one moment may differ by rounding, as by 1e-9 s.
    moment = (pl.col("time") * 1000.0).round().cast(pl.Int64).alias("moment")
    counts = pl.concat(
        [part.group_by(moment).len().collect(engine="streaming") for part in known]
    ).group_by("moment").agg(pl.col("len").sum()).sort("moment")  # fmt: skip
    moments = counts["moment"].to_numpy()
    first = np.concatenate([[0], np.cumsum(counts["len"].to_numpy())]).astype("<i8")
    (moments / 1000.0).astype("<f8").tofile(folder / TIMES_FILE)
    first.tofile(folder / FIRST_FILE)
    places = (part.select("x", "y").head(1).collect() for part in known)
    beginning = next((place for place in places if place.height), None)
    origin = (0.0, 0.0)
    if beginning is not None:
        origin = (float(np.round(beginning["x"][0])), float(np.round(beginning["y"][0])))
    _write_rows(
        [part.with_columns(moment) for part in known], users, moments, first, origin, folder
    )
    return [_complete_size(user) for user in users.to_dicts()], origin


def _users_of(part: pl.LazyFrame) -> pl.DataFrame:
    return (
        part.group_by("id")
        .agg(
            pl.col("category").first().cast(pl.String),
            pl.col("kind").first().cast(pl.String),
            pl.col("time").min().alias("begin"),
            pl.col("time").max().alias("end"),
            pl.col("length").median(),
            pl.col("width").median(),
        )
        .collect()
    )


def _complete_size(user: dict[str, Any]) -> dict[str, Any]:
    usual = DEFAULT_BODY[Category(user["category"])]
    return user | {
        name: round(user[name] or getattr(usual, name), 2) for name in ("length", "width")
    }


def _write_rows(
    parts: Sequence[pl.LazyFrame],
    users: pl.DataFrame,
    moments: IntArray,
    first: IntArray,
    origin: tuple[float, float],
    folder: Path,
) -> None:
    """Write the rows of each part behind those of the parts before, moment by moment."""
    path = folder / ROWS_FILE
    if not first[-1]:
        path.touch()
        return
    rows = np.memmap(path, dtype=_ROW, mode="w+", shape=(int(first[-1]), _COLUMNS))
    number_of = dict(zip(users["id"], range(users.height), strict=True))
    free = first[:-1].copy()
    for part in parts:
        columns = part.select("id", "moment", "x", "y", "hdg", "speed").collect()
        numbers = columns["id"].rle().struct.unnest()
        ends = numbers["len"].cum_sum().to_list()
        at = np.searchsorted(moments, columns["moment"].to_numpy())
        values = np.empty((columns.height, _COLUMNS), dtype=_ROW)
        values[:, 1] = columns["x"].to_numpy() - origin[0]
        values[:, 2] = columns["y"].to_numpy() - origin[1]
        values[:, 3:] = columns.select("hdg", "speed").to_numpy()
        tracks = zip((number_of[user] for user in numbers["value"]), [0, *ends[:-1]], ends,
                     strict=True)  # fmt: skip
        for number, begin, end in sorted(tracks):
            values[begin:end, 0] = number
            own = at[begin:end]
            rows[free[own]] = values[begin:end]
            free[own] += 1
    rows.flush()


def read_moments(folder: Path, begin: float, end: float, *, most: int) -> Moments:
    """Moments of a time, and one more on each side, for what lies between.

    Parameters
    ----------
    begin, end
        Seconds.
    most
        Rows at most; fewer moments, evenly, if need be.
    """
    times = np.fromfile(folder / TIMES_FILE, dtype="<f8")
    first = np.fromfile(folder / FIRST_FILE, dtype="<i8")
    low = max(int(np.searchsorted(times, begin, "right")) - 1, 0)
    high = min(int(np.searchsorted(times, end, "left")) + 1, len(times))
    every = max(1, -(-int(first[high] - first[low]) // most))
    chosen = np.arange(low, high, every)
    if not len(chosen):
        return Moments(times[:0], np.zeros(1, dtype=np.int64), np.zeros((0, _COLUMNS), _ROW))
    counts = first[chosen + 1] - first[chosen]
    rows = np.memmap(folder / ROWS_FILE, dtype=_ROW, mode="r").reshape(-1, _COLUMNS)
    starts = np.concatenate([[0], np.cumsum(counts)])
    if every == 1:
        part = rows[first[low] : first[high]]
    else:
        at = np.arange(starts[-1]) - np.repeat(starts[:-1], counts)
        part = rows[np.repeat(first[chosen], counts) + at]
    return Moments(times[chosen], starts, np.asarray(part))
