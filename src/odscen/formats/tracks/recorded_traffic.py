"""One table of tracks, whatever the schema of the file was: who was where, how big and how fast.

Readers give columns as their files have them, in metres, seconds and radians; what is missing is
derived here, and what cannot be is refused with road user and time.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final

import polars as pl

from odscen.base.categories import Category
from odscen.base.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

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
_FOLLOWS, _LEADS = "row before is its", "row after is its"
"""Columns while a table is made: two of them say of a row whether its neighbours are of the same
road user, which is much faster than a window over each."""
_ON_FOOT_OR_BICYCLE: Final = "pedestrian/bicycle"
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
    repeated
        Rows that were there twice, and count once.
    """

    rows: pl.DataFrame
    schema: str
    step: float
    signals: pl.DataFrame | None = None
    notes: tuple[str, ...] = ()
    unused: tuple[str, ...] = ()
    repeated: int = 0

    def summary(self, parts: Sequence[pl.LazyFrame] = ()) -> dict[str, object]:
        """Road users by category, time, area and quality, as plain values.

        Parameters
        ----------
        parts
            The tracks, each part with all of its road users, if ``rows`` are not all of them.
        """
        parts = parts or [self.rows.lazy()]
        users = pl.concat([part.group_by("id").agg(*_OF_USER).collect() for part in parts])
        total = pl.concat([part.select(*_OF_PART).collect() for part in parts])
        counts = users["category"].fill_null("other").value_counts(sort=True, name="count")
        return {
            "schema": self.schema,
            "road_users": users.height,
            "categories": dict(sorted(counts.iter_rows())),
            "rows": total["rows"].sum(),
            "begin": total["begin"].min(),
            "end": total["end"].max(),
            "step": self.step,
            "x": [total["x0"].min(), total["x1"].max()],
            "y": [total["y0"].min(), total["y1"].max()],
            "rows_after_gaps": total["after_gap"].sum(),
            "without_size": int(users["without_size"].sum()),
            "signals": 0 if self.signals is None else self.signals["light"].n_unique(),
            "notes": list(self.notes),
        }


_OF_USER: Final = (
    pl.col("category").first().cast(pl.String),
    pl.col("length").is_null().any().alias("without_size"),
)
_OF_PART: Final = (
    pl.len().alias("rows"),
    pl.col("time").min().alias("begin"),
    pl.col("time").max().alias("end"),
    *(
        getattr(pl.col(axis), end)().alias(f"{axis}{k}")
        for axis in ("x", "y")
        for k, end in enumerate(("min", "max"))
    ),
    (pl.col("quality") == "after_gap").sum().alias("after_gap"),
)


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
    rows = _with_known_types(given)
    del given
    _refuse_numbers_that_are_none(rows)
    rows, repeated = _drop_repeated_rows(_sort_tracks(rows))
    if repeated:
        notes = (*notes, _tell_repeated(repeated))
    same = (pl.col("id") == pl.col("id").shift()).fill_null(value=False)
    rows = rows.with_columns(same.alias(_FOLLOWS)).with_columns(
        pl.col(_FOLLOWS).shift(-1, fill_value=False).alias(_LEADS)
    )
    gaps = pl.when(_FOLLOWS).then(pl.col("time").diff())
    if step is None:
        found = rows.select(gaps.median()).item()
        step = float(found) if found else 0.1
    rows = rows.with_columns(
        _heading_of(rows).alias("hdg"),
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
    rows = rows.with_columns(_speed_of(rows).alias("speed"))
    rows = rows.with_columns(
        _acceleration_of(rows).alias("acceleration"), _category_of_kind(rows).alias("category")
    )
    rows = rows.select(pl.col(name).cast(kind) for name, kind in TRACK_COLUMNS.items())
    return RecordedTraffic(rows, schema, round(step, 6), signals, notes, repeated=repeated)


def join_parts(parts: Sequence[RecordedTraffic], rows: pl.DataFrame) -> RecordedTraffic:
    """One recording of parts that have road users of their own.

    Parameters
    ----------
    rows
        Those of all parts.
    """
    first, repeated = parts[0], sum(part.repeated for part in parts)
    notes = dict.fromkeys(
        note for part in parts for note in part.notes if note != _tell_repeated(part.repeated)
    )
    told = (*notes, _tell_repeated(repeated)) if repeated else tuple(notes)
    return replace(first, rows=rows, notes=told, repeated=repeated)


def _tell_repeated(repeated: int) -> str:
    return f"{repeated} rows are there twice, and count once"


def _sort_tracks(rows: pl.DataFrame) -> pl.DataFrame:
    """By road user and time; in most files each has its rows together, and in the order of time.

    Those only need to be put in the order of their road users, which is much less than to sort.
    """
    same = (pl.col("id") == pl.col("id").shift()).fill_null(value=False)
    back = same & (pl.col("time") < pl.col("time").shift())
    starts = rows.select((~same).arg_true())["id"].to_list()
    ids = rows["id"].gather(starts).to_list()
    if len(set(ids)) < len(ids) or rows.select(back.any()).item():
        return rows.sort("id", "time")
    tracks = sorted(zip(ids, starts, [*starts[1:], rows.height], strict=True))
    if tracks == sorted(tracks, key=lambda track: track[1]):
        return rows
    return pl.concat([rows.slice(begin, end - begin) for _, begin, end in tracks], rechunk=True)


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
    after = pl.when(_LEADS).then(value.shift(-1)).otherwise(value)
    return after.fill_null(value) - pl.when(_FOLLOWS).then(value.shift()).otherwise(
        value
    ).fill_null(value)


def _usable_or_derived(
    rows: pl.DataFrame, given: pl.Expr, most: float, value: pl.Expr, derived: pl.Expr
) -> pl.Expr:
    """The value where what is given is at most so much; it is derived only if some is not."""
    usable = (given.abs() <= most).fill_null(value=False)
    if rows.select(usable.all()).item():
        return value
    return pl.when(usable).then(value).otherwise(derived)


def _heading_of(rows: pl.DataFrame) -> pl.Expr:
    dx, dy = _between_neighbours("x"), _between_neighbours("y")
    moved = (dx**2 + dy**2).sqrt() >= _MOVED
    motion = pl.when(moved).then(pl.arctan2(dy, dx))
    seen = motion.forward_fill().over("id")
    derived = seen.fill_null(motion.backward_fill().over("id")).fill_null(0.0)
    if "hdg" not in rows.columns:
        return derived
    # Of an angle with so many turns nothing is left but rounding.
    hdg = pl.col("hdg")
    return _usable_or_derived(rows, hdg, _MOST_ANGLE, _without_whole_turns(hdg), derived)


def _without_whole_turns(angle: pl.Expr) -> pl.Expr:
    return angle - math.tau * (angle / math.tau).round()


def _speed_of(rows: pl.DataFrame) -> pl.Expr:
    way = (_between_neighbours("x") ** 2 + _between_neighbours("y") ** 2).sqrt()
    time = _between_neighbours("time")
    derived = pl.when(time > 0).then((way / time).clip(0.0, _FASTEST)).otherwise(0.0)
    if "speed" in rows.columns:
        given = pl.col("speed").abs()
    elif "vx" in rows.columns:
        given = (pl.col("vx") ** 2 + pl.col("vy") ** 2).sqrt()
    else:
        return derived
    return _usable_or_derived(rows, given, _FASTEST, given, derived)


def _acceleration_of(rows: pl.DataFrame) -> pl.Expr:
    time = _between_neighbours("time")
    change = (_between_neighbours("speed") / time).clip(-_FASTEST, _FASTEST)
    derived = pl.when(time > 0).then(change).otherwise(0.0)
    if "acceleration" in rows.columns:
        given = pl.col("acceleration")
    elif "ax" in rows.columns:
        given = pl.col("ax") * pl.col("hdg").cos() + pl.col("ay") * pl.col("hdg").sin()
    else:
        return derived
    return _usable_or_derived(rows, given, _FASTEST, given, derived)


def _category_of_kind(rows: pl.DataFrame) -> pl.Expr:
    kinds = [str(kind) for kind in rows["kind"].drop_nulls().unique()]
    categories = {kind: _CATEGORIES.get(kind.lower()) for kind in kinds}
    known = pl.col("kind").replace_strict(
        {kind: category and str(category) for kind, category in categories.items()},
        default=None,
        return_dtype=pl.String,
    )
    either_kinds = [kind for kind in kinds if kind.lower() == _ON_FOOT_OR_BICYCLE]
    if not either_kinds:
        return known
    ridden = pl.col("speed").median().over("id") > _RIDES
    either = pl.when(ridden).then(pl.lit("bicycle")).otherwise(pl.lit("pedestrian"))
    return pl.when(pl.col("kind").is_in(either_kinds)).then(either).otherwise(known)


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
