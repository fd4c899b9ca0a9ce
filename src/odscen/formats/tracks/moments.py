"""Tracks by time, for a player: who was where at each moment, as files that are read in parts."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np
import polars as pl

from odscen.base.categories import DEFAULT_BODY, Category

if TYPE_CHECKING:
    from pathlib import Path

    from odscen.base.arrays import FloatArray, IntArray

_ROW: Final = np.dtype("<f4")
_COLUMNS: Final = 5
TIMES_FILE, FIRST_FILE, ROWS_FILE = "times.bin", "first.bin", "rows.bin"
"""Moments (float64, s), the first row of each and one past the last (int64), and rows of five
float32: road user, x, y (m from the origin), hdg (rad), speed (m/s)."""
MOMENT_FILES: Final = (TIMES_FILE, FIRST_FILE, ROWS_FILE)
_AT_ONCE: Final = 2_000_000


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
    rows: pl.DataFrame, folder: Path
) -> tuple[list[dict[str, Any]], tuple[float, float]]:
    """Write tracks by time.

    Parameters
    ----------
    rows
        Tracks; rows of no category are left out.
    folder
        Where the three files are written.

    Returns
    -------
    tuple
        Road users in the order of their numbers, each with ``id``, ``category``, ``kind``,
        ``begin``, ``end`` (s), ``length`` and ``width`` (m); and the origin of places.
    """
    known = rows.filter(pl.col("category").is_not_null())
    users = (
        known.group_by("id")
        .agg(
            pl.col("category").first().cast(pl.String),
            pl.col("kind").first().cast(pl.String),
            pl.col("time").min().alias("begin"),
            pl.col("time").max().alias("end"),
            pl.col("length").median(),
            pl.col("width").median(),
        )
        .sort("begin", "id")
    )
    listed = []
    for user in users.to_dicts():
        usual = DEFAULT_BODY[Category(user["category"])]
        sizes = {name: round(user[name] or getattr(usual, name), 2) for name in ("length", "width")}
        listed.append(user | sizes)
    origin = (0.0, 0.0)
    if known.height:
        origin = (float(np.round(known["x"][0])), float(np.round(known["y"][0])))
    numbers = users.select("id", user=pl.int_range(pl.len()).cast(pl.Float32))
    # Frames of one moment may differ by rounding, as by 1e-9 s.
    columns = known.lazy().join(numbers.lazy(), on="id", how="left").select(
        (pl.col("time") * 1000.0).round().cast(pl.Int64).alias("moment"),
        "user",
        (pl.col("x") - origin[0]).cast(pl.Float32),
        (pl.col("y") - origin[1]).cast(pl.Float32),
        pl.col("hdg").cast(pl.Float32),
        pl.col("speed").cast(pl.Float32),
    ).sort("moment", "user").collect()  # fmt: skip
    moments, first = np.unique(columns["moment"].to_numpy(), return_index=True)
    (moments / 1000.0).astype("<f8").tofile(folder / TIMES_FILE)
    np.append(first, columns.height).astype("<i8").tofile(folder / FIRST_FILE)
    with (folder / ROWS_FILE).open("wb") as file:
        for begin in range(0, columns.height, _AT_ONCE):
            part = columns.slice(begin, _AT_ONCE).drop("moment").to_numpy()
            file.write(np.ascontiguousarray(part, dtype=_ROW).tobytes())
    return listed, origin


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
