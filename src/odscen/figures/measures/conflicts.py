"""How close road users came to a crash: surrogate measures of safety (requirement R67).

Time to collision, deceleration rate to avoid a crash and post-encroachment time between vehicles
are SUMO's, from its SSM device; post-encroachment between people on foot and vehicles is found
here, from where both were. Definitions: Gettman and Head, "Surrogate Safety Measures from Traffic
Simulation Models", FHWA-RD-03-050, 2003, whose limits are the ones here.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    import polars as pl

    from odscen.records.run_plan import PlannedActor


SEEN_TTC, SEEN_DRAC, SEEN_PET = 3.0, 3.0, 3.0
"""What is recorded: seconds or less, m/s^2 or more, seconds or less."""
WATCHED_ON = 2.0
"""Seconds for which two are watched after they have parted."""
SERIOUS_TTC, SERIOUS_DRAC, SERIOUS_PET = 1.5, 3.35, 1.0
"""What makes a conflict serious: seconds or less, m/s^2 or more, seconds or less."""

BODY = 0.25
"""Metres around the centre of a pedestrian that belong to it."""

_SCHEMA_NAMES = ("begin", "end", "one", "other", "kind", "x", "y", "ttc", "drac", "pet")
_TEXTS = frozenset({"one", "other", "kind"})


def conflict_table(rows: Iterable[Mapping[str, object]]) -> pl.DataFrame:
    """One row per conflict of two road users, in order of time.

    Rows of the same two whose times overlap are one conflict: SUMO reports each from both sides.

    Parameters
    ----------
    rows
        With ``begin``, ``end`` (s), ``one``, ``other`` (ids), ``kind`` (following, merging,
        crossing or walking), ``x``, ``y`` (m, OpenDRIVE frame), ``ttc`` (s), ``drac`` (m/s^2),
        ``pet`` (s); ``None`` where there is no such measure.

    Returns
    -------
    The same columns.
    """
    import polars as pl

    schema = {name: pl.String if name in _TEXTS else pl.Float64 for name in _SCHEMA_NAMES}
    table = pl.DataFrame(list(rows), schema=schema)
    pair = [pl.min_horizontal("one", "other"), pl.max_horizontal("one", "other")]
    return _join_overlapping([table.with_columns(pair[0].alias("one"), pair[1].alias("other"))])


def conflicts_of_slices(tables: Sequence[pl.DataFrame]) -> pl.DataFrame:
    """Conflicts of the slices of a run, in order, as one table.

    The device starts anew with each slice. Two who were in conflict until the end of one slice and
    are again within the time for which it would have gone on to watch them have one conflict.
    """
    return tables[0] if len(tables) == 1 else _join_overlapping(tables)


def _join_overlapping(tables: Sequence[pl.DataFrame]) -> pl.DataFrame:
    """Rows of the same two as one where their times overlap, or nearly so from table to table."""
    import polars as pl

    pair = ("one", "other")
    ordered = pl.concat(
        [table.with_columns(slice=pl.lit(number)) for number, table in enumerate(tables)]
    ).sort(*pair, "begin", "end")
    until = pl.col("end").cum_max().shift().over(pair)
    same_slice = pl.col("slice") == pl.col("slice").shift().over(pair)
    new = pl.col("begin") > until + pl.when(same_slice).then(0.0).otherwise(WATCHED_ON)
    number = new.fill_null(value=True).cum_sum().over(pair).alias("number")
    worst = ("ttc", "pet", "drac")
    place = pl.col("ttc").fill_null(math.inf).arg_min()
    return (
        ordered.with_columns(number)
        .group_by(*pair, "number", maintain_order=True)
        .agg(
            pl.col("begin").min(),
            pl.col("end").max(),
            *(pl.col(name).get(place) for name in ("kind", "x", "y")),
            *(pl.col(name).max() if name == "drac" else pl.col(name).min() for name in worst),
        )
        .select(_SCHEMA_NAMES)
        .sort("begin", *pair)
    )


def is_serious() -> pl.Expr:
    """Whether a conflict is serious by any of its measures."""
    import polars as pl

    return (
        (pl.col("ttc") <= SERIOUS_TTC).fill_null(value=False)
        | (pl.col("drac") >= SERIOUS_DRAC).fill_null(value=False)
        | (pl.col("pet") <= SERIOUS_PET).fill_null(value=False)
    )


def walking_conflicts(
    traces: pl.DataFrame, actors: Iterable[PlannedActor]
) -> list[dict[str, object]]:
    """Post-encroachment between people on foot and vehicles, as rows for :func:`conflict_table`.

    A spot is shared if a pedestrian was there and the body of a vehicle was over it within
    :data:`SEEN_PET` seconds; the shortest time between both, over all spots that two of them share,
    is their post-encroachment time, to the precision of the records' step.

    Parameters
    ----------
    traces
        Columns ``time, id, x, y, angle`` (front centre; degrees clockwise from north), of every
        step, in one frame.
    """
    import numpy as np
    import polars as pl
    from scipy.spatial import cKDTree

    people, bodies = set(), {}
    for actor in actors:
        if actor.person:
            people.add(actor.id)
        else:
            bodies[actor.id] = (actor.length, actor.width)
    afoot = traces.filter(pl.col("id").is_in(list(people)))
    driven = traces.filter(pl.col("id").is_in(list(bodies)))
    if afoot.is_empty() or driven.is_empty():
        return []
    size = np.array([bodies[name] for name in driven["id"].to_list()])
    heading = np.radians(90.0 - driven["angle"].to_numpy())
    ahead = np.column_stack([np.cos(heading), np.sin(heading)])
    centre = driven.select("x", "y").to_numpy() - ahead * size[:, :1] / 2.0
    spots = afoot.select("x", "y").to_numpy()
    when, then = afoot["time"].to_numpy(), driven["time"].to_numpy()
    radius = float(np.hypot(size[:, 0], size[:, 1]).max()) / 2.0 + BODY
    per_second = radius / SEEN_PET
    tree = cKDTree(np.column_stack([spots, when * per_second]))
    near = tree.query_ball_point(
        np.column_stack([centre, then * per_second]), radius * np.sqrt(2.0), workers=1
    )
    counts = np.array([len(rows) for rows in near])
    if not counts.sum():
        return []
    vehicle = np.repeat(np.arange(len(near)), counts)
    person = np.concatenate([np.asarray(rows, dtype=np.int64) for rows in near])
    off = spots[person] - centre[vehicle]
    along = np.abs((off * ahead[vehicle]).sum(axis=1))
    across = np.abs(off[:, 0] * -ahead[vehicle, 1] + off[:, 1] * ahead[vehicle, 0])
    half = size[vehicle] / 2.0 + BODY
    apart = np.abs(when[person] - then[vehicle])
    shared = (along <= half[:, 0]) & (across <= half[:, 1]) & (apart <= SEEN_PET)
    found = pl.DataFrame(
        {
            "one": afoot["id"].gather(person[shared]),
            "other": driven["id"].gather(vehicle[shared]),
            "begin": np.minimum(when[person], then[vehicle])[shared],
            "end": np.maximum(when[person], then[vehicle])[shared],
            "x": spots[person[shared], 0],
            "y": spots[person[shared], 1],
            "pet": apart[shared],
        }
    )
    closest = found.sort("pet", "begin").group_by("one", "other", maintain_order=True).first()
    return [
        {**row, "kind": "walking", "ttc": None, "drac": None}
        for row in closest.iter_rows(named=True)
    ]
