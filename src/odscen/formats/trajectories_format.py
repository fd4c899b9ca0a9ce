"""Recorded trajectories as tables, CSV or Parquet: time, x, y and perhaps id and heading.

Columns are named as those of a run: ``time`` (s), ``id``, ``x``, ``y`` (m) and ``hdg`` (rad,
counter-clockwise from +x) of the body's centre in the OpenDRIVE frame. Others are left alone.
"""

from __future__ import annotations

import itertools
import math
from io import BytesIO
from typing import TYPE_CHECKING

from odscen.base.errors import InputError
from odscen.formats.base import ElementReport, FileContent, Format

if TYPE_CHECKING:
    from collections.abc import Sequence

    import polars as pl

    from odscen.formats.base import ImportSource
    from odscen.scenario.document.rules_document import TrajectoryRow

MOST_ROWS = 100_000
_NEEDED = ("time", "x", "y")
_KNOWN = ("time", "id", "x", "y", "hdg")
_LISTED = 8
"""Names that a message lists at most."""
_MOVED = 0.01
"""Metres from which on a direction of motion is taken from two places."""


def read_tracks(source: ImportSource) -> FileContent:
    """Tracks of all road users of a table, in order of time; other columns are left out.

    Raises
    ------
    InputError
        If it is no table, or lacks a column.
    """
    import polars as pl

    parquet = source.file.name.lower().endswith(".parquet")
    table = read_trajectories_table(source.file.read(), parquet=parquet)
    _refuse_missing_columns(table)
    report = ElementReport(source.file.name)
    for column in table.columns:
        known = column in _KNOWN
        why = "" if known else "tracks have no such column"
        report.add("taken" if known else "ignored", f"column {column}", why)
    numbers = [name for name in _KNOWN if name in table.columns and name != "id"]
    ids = [pl.col("id").cast(pl.String)] if "id" in table.columns else [pl.lit("1").alias("id")]
    try:
        tracks = table.select(*ids, pl.col(numbers).cast(pl.Float64)).sort("time", "id")
    except pl.exceptions.PolarsError as error:
        raise InputError(f"{', '.join(numbers)} have to be numbers: {error}") from error
    columns = [name for name in _KNOWN if name in tracks.columns]
    return FileContent(tracks=tracks.select(columns), lists=report.lists)


def read_trajectories_table(content: bytes, *, parquet: bool) -> pl.DataFrame:
    """Table from a file's content.

    Raises
    ------
    InputError
        If it is no such table.
    """
    import polars as pl

    try:
        return (pl.read_parquet if parquet else pl.read_csv)(BytesIO(content))
    except (pl.exceptions.PolarsError, ValueError, OSError) as error:
        raise InputError(f"not a table of {'Parquet' if parquet else 'CSV'}: {error}") from error


def trajectory_rows(
    table: pl.DataFrame, *, of: str | None = None
) -> tuple[float, tuple[TrajectoryRow, ...]]:
    """Trajectory of one road user: when it begins, and rows of seconds from then on.

    Parameters
    ----------
    of
        Its id in the table; not needed if there is one only.

    Raises
    ------
    InputError
        If a column is missing or has something else than numbers, there is no such road user, or
        there are fewer than two rows, rows at one time, or too many.
    """
    import polars as pl

    _refuse_missing_columns(table)
    own = _rows_of(table, of)
    names = [*_NEEDED, *(["hdg"] if "hdg" in own.columns else [])]
    try:
        numbers = own.select(pl.col(names).cast(pl.Float64)).sort("time")
    except pl.exceptions.PolarsError as error:
        raise InputError(f"{', '.join(names)} have to be numbers: {error}") from error
    rows = [tuple(row) for row in numbers.iter_rows()]
    if not 2 <= len(rows) <= MOST_ROWS:
        raise InputError(f"{len(rows)} rows; a trajectory has 2 to {MOST_ROWS}")
    for one in rows:
        if any(value is None or not math.isfinite(value) for value in one):
            raise InputError(
                f"the row at {one[0]} s has a value that is missing or no number: {one}"
            )
    for one, other in itertools.pairwise(rows):
        if one[0] == other[0]:
            raise InputError(f"two rows at {one[0]:g} s")
    begin = rows[0][0]
    headings = [row[3] for row in rows] if len(names) > len(_NEEDED) else _headings_of_motion(rows)
    return begin, tuple(
        (round(row[0] - begin, 6), row[1], row[2], math.remainder(hdg, math.tau))
        for row, hdg in zip(rows, headings, strict=True)
    )


def _refuse_missing_columns(table: pl.DataFrame) -> None:
    missing = [name for name in _NEEDED if name not in table.columns]
    if missing:
        raise InputError(f"no column {' and '.join(missing)}; there are {', '.join(table.columns)}")


def _rows_of(table: pl.DataFrame, of: str | None) -> pl.DataFrame:
    import polars as pl

    if "id" not in table.columns:
        if of is not None:
            raise InputError(f"no column id, in which {of!r} could be")
        return table
    ids = table["id"].cast(pl.String).unique().sort().to_list()
    if of is None and len(ids) != 1:
        listed = ", ".join(map(str, ids[:_LISTED])) + (", ..." if len(ids) > _LISTED else "")
        raise InputError(f"there are {len(ids)} road users: {listed}; name one")
    if of is not None and of not in ids:
        raise InputError(f"there is no road user {of!r}")
    return table.filter(pl.col("id").cast(pl.String) == (ids[0] if of is None else of))


def _headings_of_motion(rows: Sequence[tuple[float, ...]]) -> list[float]:
    """Direction of motion at each row, that of before or after while there is none."""
    found: list[float | None] = [None] * len(rows)
    before = 0
    for index, row in enumerate(rows):
        dx, dy = row[1] - rows[before][1], row[2] - rows[before][2]
        if math.hypot(dx, dy) >= _MOVED:
            found[before] = math.atan2(dy, dx)
            before = index
    first = next((heading for heading in found if heading is not None), 0.0)
    last, headings = first, []
    for heading in found:
        last = last if heading is None else heading
        headings.append(last)
    return headings


FORMAT = Format(
    id="trajectories",
    title="Trajectories (CSV, Parquet)",
    label="a table of trajectories: time, x, y and perhaps id and hdg",
    of=("run",),
    suffixes=(".csv", ".parquet"),
    read=read_tracks,
)
