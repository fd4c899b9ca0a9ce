"""One table of tracks, whatever the schema of the file was: who was where, how big and how fast.

Readers give columns as their files have them, in metres, seconds and radians; what is missing is
derived here, and what cannot be is refused with road user and time.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import polars as pl

from odscen.base.categories import Category
from odscen.base.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Mapping

    from odscen.scenario.document.rules_document import TrajectoryRow

TRACK_COLUMNS: Final = {
    "id": pl.String,
    "time": pl.Float64,
    "category": pl.Categorical,
    "kind": pl.Categorical,
    "x": pl.Float64,
    "y": pl.Float64,
    "hdg": pl.Float64,
    "speed": pl.Float64,
    "acceleration": pl.Float64,
    "length": pl.Float32,
    "width": pl.Float32,
    "quality": pl.Categorical,
}
"""Columns of a table of tracks: ``id`` of the road user, ``time`` (s, as the file counts it),
``category`` of :class:`~odscen.base.categories.Category` (null: none of them), ``kind`` (as the
file calls it), ``x``, ``y`` (m, centre of the body, x east and y north or as the file has it),
``hdg`` (rad, counter-clockwise from x), ``speed`` (m/s), ``acceleration`` (m/s², along the
heading), ``length``, ``width`` (m, null if the file has none) and ``quality``: ``recorded``,
``after_gap`` (frames before it are missing) or ``fragment`` (the file doubts it)."""

_WORDS: Final = frozenset({"id", "kind"})
"""Columns of a file that may have text."""
_NUMBERS: Final = frozenset(
    {"time", "x", "y", "hdg", "vx", "vy", "ax", "ay", "speed", "acceleration", "length", "width"}
)
_MOST_ROWS = 100_000
FARTHEST: Final = {"time": 1e11, "x": 1e8, "y": 1e8}
"""Seconds (of any clock that began in the last 3,000 years) and metres beyond which nothing is."""
_LARGEST_BODY = 1000.0
_MOST_ANGLE = 1e6
_FASTEST = 1e4
"""m/s, and m/s² of an acceleration; above it a value is an error of the file, and derived anew."""
_LISTED = 8
"""Names that a message lists at most."""
_MOVED = 0.05
"""Metres between the frames before and after from which on they show a direction of motion."""
_GAP = 1.5
"""Steps of the recording from which on frames are missing."""
_RIDES = 3.0
"""m/s from which on who may be a pedestrian or a bicycle is a bicycle, by the median."""

_CATEGORIES: Final[Mapping[str, Category]] = {
    **{str(category): category for category in Category},
    **dict.fromkeys(("vehicle", "auto", "taxi", "parkedvehicle", "passenger"), Category.CAR),
    **dict.fromkeys(("delivery_van",), Category.VAN),
    **dict.fromkeys(("trailer", "truck_bus", "heavy_truck", "semitrailer"), Category.TRUCK),
    **dict.fromkeys(("motorcyclist", "motorbike", "tricycle", "scooter"), Category.MOTORCYCLE),
    **dict.fromkeys(("cyclist", "bike"), Category.BICYCLE),
    **dict.fromkeys(("person", "ped"), Category.PEDESTRIAN),
}


@dataclass(frozen=True, slots=True, eq=False)
class RecordedTraffic:
    """Tracks of road users as somebody recorded them.

    Attributes
    ----------
    rows
        With the columns :data:`TRACK_COLUMNS`, by road user and time.
    schema
        Which published schema the file has.
    step
        Seconds between two frames.
    signals
        What lights showed: ``time`` (s), ``light``, ``color`` (``red``, ``yellow``, ``green``);
        ``None`` if the recording has none.
    notes
        What was derived or left out, for people.
    unused
        Columns of a table that tracks do not need.
    """

    rows: pl.DataFrame
    schema: str
    step: float
    signals: pl.DataFrame | None = None
    notes: tuple[str, ...] = ()
    unused: tuple[str, ...] = ()

    def summary(self) -> dict[str, object]:
        """Road users by category, time, area and quality, as plain values."""
        rows = self.rows
        kinds = rows.group_by("id").agg(pl.col("category").first().cast(pl.String))["category"]
        counts = kinds.fill_null("other").value_counts(sort=True, name="count")
        return {
            "schema": self.schema,
            "road_users": kinds.len(),
            "categories": dict(sorted(counts.iter_rows())),
            "rows": rows.height,
            "begin": rows["time"].min(),
            "end": rows["time"].max(),
            "step": self.step,
            "x": [rows["x"].min(), rows["x"].max()],
            "y": [rows["y"].min(), rows["y"].max()],
            "rows_after_gaps": rows.filter(pl.col("quality") == "after_gap").height,
            "without_size": rows.filter(pl.col("length").is_null())["id"].n_unique(),
            "signals": 0 if self.signals is None else self.signals["light"].n_unique(),
            "notes": list(self.notes),
        }


def complete_tracks(
    given: pl.DataFrame,
    schema: str,
    *,
    step: float | None = None,
    from_front: bool = False,
    signals: pl.DataFrame | None = None,
    notes: tuple[str, ...] = (),
) -> RecordedTraffic:
    """Derive what a file does not have.

    Parameters
    ----------
    given
        ``id``, ``time``, ``kind``, ``x``, ``y`` and any of ``hdg``, ``vx``, ``vy``, ``ax``,
        ``ay``, ``speed``, ``acceleration``, ``length``, ``width``, ``fragment``.
    step
        Seconds between two frames; the median of the file if not given.
    from_front
        Whether ``x`` and ``y`` are of the middle of the front.

    Raises
    ------
    InputError
        If there are no rows, a place or time is no finite number, or a road user has two places
        at one time.
    """
    if not given.height:
        raise InputError("no road user is in it at that time")
    rows = _with_known_types(given).sort("id", "time")
    del given
    _refuse_numbers_that_are_none(rows)
    rows, repeated = _drop_repeated_rows(rows)
    if repeated:
        notes = (*notes, f"{repeated} rows are there twice, and count once")
    gaps = pl.col("time").diff().over("id")
    if step is None:
        found = rows.select(gaps.median()).item()
        step = float(found) if found else 0.1
    rows = rows.with_columns(
        _heading_of(rows.columns).alias("hdg"),
        pl.when(gaps > _GAP * step)
        .then(pl.lit("after_gap"))
        .when(pl.col("fragment") if "fragment" in rows.columns else pl.lit(value=False))
        .then(pl.lit("fragment"))
        .otherwise(pl.lit("recorded"))
        .cast(pl.Categorical)
        .alias("quality"),
        *(
            (pl.col(name) if name in rows.columns else pl.lit(None)).cast(pl.Float32).alias(name)
            for name in ("length", "width")
        ),
    ).with_columns(
        # A length of 0 is how inD says that it has none, for pedestrians and cyclists.
        *(
            pl.when((pl.col(name) > 0) & (pl.col(name) <= _LARGEST_BODY))
            .then(pl.col(name))
            .alias(name)
            for name in ("length", "width")
        )
    )
    if from_front:
        half = pl.col("length").cast(pl.Float64).fill_null(0.0) / 2.0
        rows = rows.with_columns(
            x=pl.col("x") - half * pl.col("hdg").cos(), y=pl.col("y") - half * pl.col("hdg").sin()
        )
    rows = rows.with_columns(_speed_of(rows.columns).alias("speed"))
    rows = rows.with_columns(
        _acceleration_of(rows.columns).alias("acceleration"), _category_of_kind().alias("category")
    )
    rows = rows.select(pl.col(name).cast(kind) for name, kind in TRACK_COLUMNS.items())
    return RecordedTraffic(rows, schema, round(step, 6), signals, notes)


def _with_known_types(rows: pl.DataFrame) -> pl.DataFrame:
    """Columns as words or numbers, whatever type they have in a file that has types of its own."""
    made = []
    for name, kind in rows.schema.items():
        of_words = name in _WORDS
        known = kind.is_numeric() or kind in (pl.Boolean, pl.Null)
        if of_words and (known or kind in (pl.String, pl.Categorical, pl.Enum)):
            made.append(pl.col(name).cast(pl.String))
        elif name == "fragment" or not (of_words or name in _NUMBERS):
            continue
        elif known:
            made.append(pl.col(name).cast(pl.Float64))
        else:
            wanted = "text or a number" if of_words else "a number"
            raise InputError(f"it is of type {kind}, not {wanted}", element=f"{name} of road users")
    return rows.with_columns(made)


def _refuse_numbers_that_are_none(rows: pl.DataFrame) -> None:
    nobody = rows.filter(pl.col("id").is_null())
    if nobody.height:
        raise InputError("it has no id", element=f"road user at {nobody['time'][0]} s")
    for name, most in FARTHEST.items():
        # No comparison holds of what is no number.
        wrong = rows.filter(
            ~(pl.col(name).is_finite() & (pl.col(name).abs() <= most)).fill_null(value=False)
        )
        if wrong.height:
            row = wrong.row(0, named=True)
            problem = (
                f"not a number up to {most:g}"
                if row[name] is not None and math.isfinite(row[name])
                else "not a finite number"
            )
            raise InputError(
                f"{name} is {row[name]}, {problem}",
                element=f"road user {row['id']} at {row['time']} s",
            )


def _drop_repeated_rows(rows: pl.DataFrame) -> tuple[pl.DataFrame, int]:
    """Leave out rows of one road user and time that are alike; those that differ are refused."""
    same = pl.all_horizontal(pl.col(name) == pl.col(name).shift() for name in ("id", "time"))
    apart = (pl.col("x") - pl.col("x").shift()).abs() + (pl.col("y") - pl.col("y").shift()).abs()
    looked = rows.select(same.fill_null(value=False).alias("same"), apart.alias("apart"))
    wrong = looked.select((pl.col("same") & (pl.col("apart") > 0)).arg_true()).to_series()
    if len(wrong):
        row, before = rows.row(wrong[0], named=True), rows.row(wrong[0] - 1, named=True)
        raise InputError(
            f"it is at ({before['x']:g}, {before['y']:g}) and at ({row['x']:g}, {row['y']:g})",
            element=f"road user {row['id']} at {row['time']:g} s",
        )
    repeated = int(looked["same"].sum())
    return (rows.filter(~looked["same"]) if repeated else rows), repeated


def _between_neighbours(name: str) -> pl.Expr:
    """From the row before to the row after of the same road user."""
    value = pl.col(name)
    return value.shift(-1).over("id").fill_null(value) - value.shift().over("id").fill_null(value)


def _heading_of(columns: list[str]) -> pl.Expr:
    dx, dy = _between_neighbours("x"), _between_neighbours("y")
    moved = (dx**2 + dy**2).sqrt() >= _MOVED
    motion = pl.when(moved).then(pl.arctan2(dy, dx))
    seen = motion.forward_fill().over("id")
    derived = seen.fill_null(motion.backward_fill().over("id")).fill_null(0.0)
    if "hdg" not in columns:
        return derived
    turned = _without_whole_turns(pl.col("hdg"))
    # Of an angle with so many turns nothing is left but rounding.
    return pl.when(pl.col("hdg").abs() <= _MOST_ANGLE).then(turned).otherwise(derived)


def _without_whole_turns(angle: pl.Expr) -> pl.Expr:
    return angle - math.tau * (angle / math.tau).round()


def _speed_of(columns: list[str]) -> pl.Expr:
    way = (_between_neighbours("x") ** 2 + _between_neighbours("y") ** 2).sqrt()
    time = _between_neighbours("time")
    derived = pl.when(time > 0).then((way / time).clip(0.0, _FASTEST)).otherwise(0.0)
    if "speed" in columns:
        given = pl.col("speed").abs()
    elif "vx" in columns:
        given = (pl.col("vx") ** 2 + pl.col("vy") ** 2).sqrt()
    else:
        return derived
    return pl.when(given <= _FASTEST).then(given).otherwise(derived)


def _acceleration_of(columns: list[str]) -> pl.Expr:
    time = _between_neighbours("time")
    change = (_between_neighbours("speed") / time).clip(-_FASTEST, _FASTEST)
    derived = pl.when(time > 0).then(change).otherwise(0.0)
    if "acceleration" in columns:
        given = pl.col("acceleration")
    elif "ax" in columns:
        given = pl.col("ax") * pl.col("hdg").cos() + pl.col("ay") * pl.col("hdg").sin()
    else:
        return derived
    return pl.when(given.abs() <= _FASTEST).then(given).otherwise(derived)


def _category_of_kind() -> pl.Expr:
    name = pl.col("kind").cast(pl.String).str.to_lowercase()
    known = name.replace_strict(
        {kind: str(category) for kind, category in _CATEGORIES.items()}, default=None
    )
    ridden = pl.col("speed").median().over("id") > _RIDES
    either = pl.when(ridden).then(pl.lit("bicycle")).otherwise(pl.lit("pedestrian"))
    return pl.when(name == "pedestrian/bicycle").then(either).otherwise(known)


def shift_tracks(rows: pl.DataFrame, x: float, y: float, turn: float = 0.0) -> pl.DataFrame:
    """Tracks in the frame of a map: turned about the origin (rad, counter-clockwise), then moved.

    Raises
    ------
    InputError
        If a number is not finite.
    """
    if not all(map(math.isfinite, (x, y, turn))):
        raise InputError(f"an offset is of finite numbers, not ({x}, {y}, {turn})")
    c, s = math.cos(turn), math.sin(turn)
    return rows.with_columns(
        x=x + c * pl.col("x") - s * pl.col("y"),
        y=y + s * pl.col("x") + c * pl.col("y"),
        hdg=_without_whole_turns(pl.col("hdg") + turn),
    )


def trajectory_rows(
    tracks: pl.DataFrame, *, of: str | None = None
) -> tuple[float, tuple[TrajectoryRow, ...]]:
    """Trajectory of one road user: when it begins, and rows of seconds from then on.

    Parameters
    ----------
    tracks
        ``id``, ``time`` (s), ``x``, ``y`` (m) and ``hdg`` (rad) of body centres.
    of
        Its id in the table; not needed if there is one only.

    Raises
    ------
    InputError
        If there is no such road user, or it has fewer than two rows, or too many.
    """
    ids = tracks["id"].unique().sort().to_list()
    if of is None and len(ids) != 1:
        listed = ", ".join(map(str, ids[:_LISTED])) + (", ..." if len(ids) > _LISTED else "")
        raise InputError(f"there are {len(ids)} road users: {listed}; name one")
    if of is not None and of not in ids:
        raise InputError(f"there is no road user {of!r}")
    own = tracks.filter(pl.col("id") == (ids[0] if of is None else of)).sort("time")
    if not 2 <= own.height <= _MOST_ROWS:
        raise InputError(f"{own.height} rows; a trajectory has 2 to {_MOST_ROWS}")
    begin = float(own["time"][0])
    return begin, tuple(
        (round(time - begin, 6), x, y, math.remainder(hdg, math.tau))
        for time, x, y, hdg in own.select("time", "x", "y", "hdg").iter_rows()
    )
