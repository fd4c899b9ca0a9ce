"""Control delay of each vehicle at each junction, from trajectories.

Control delay is what a signal, a sign or a roundabout costs: by slowing down on the approach, in
the queue, and by getting up to speed again behind the junction (HCM, 7th edition, chapters 4 and
19). Chapter 36 has its measurement on trajectories: time steps are added up by the share that speed
falls short of free flow. Here, for a vehicle at speed ``v`` with desired speed ``v0`` (the limit
of its lane times its speed factor, at most its own maximum)::

    r    = min(v / v0, 1)
    loss = (1 - r) dt
    top  = largest r on the road between two junctions

    behind a junction   loss until r has reached 0.95 top: of the junction behind
    on the way          loss until r falls below 0.9 top: of none, unless top < 0.8
    before a junction   all loss after that: of the junction ahead
    in a junction       loss of that junction, against the speed of its own curve

So what a slow leader costs on the road between is in no control delay, nor is getting up to speed
after the departure. A vehicle that never got near its speed on the road (``top < 0.8``) is in the
queue of the junction ahead from its top on.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from odscen.records.row_text import (
    among,
    by_vehicle_and_time,
    changes,
    numbers_among,
)

if TYPE_CHECKING:
    import polars as pl

    from odscen.base.arrays import BoolArray, FloatArray, IntArray
    from odscen.figures.by_place.facilities import NetFacts
    from odscen.figures.by_place.lane_places import LanePlaces

REACHED, SLOWED, FREE = 0.95, 0.90, 0.80
"""Shares of the top speed that end the acceleration and begin the deceleration; share of the
desired speed from which a vehicle counts as driving freely on the way."""

_NEEDED = ("timestep_time", "vehicle_id", "vehicle_lane", "vehicle_speed")


MOST_ROWS = 2_000_000
"""Rows of trajectories that are held in memory at a time; more are taken vehicles by vehicles."""
_THIN = 20_000_000
"""Rows from which one record a second is taken: loss is the mean of its share over the steps."""


def vehicle_passages(
    trajectories: pl.LazyFrame, places: LanePlaces, facts: NetFacts
) -> pl.DataFrame | None:
    """Control delay of each vehicle at each junction of a run, however long it is.

    Vehicles that serve stops are left out: their time at stops is no control delay.

    Returns
    -------
    As :func:`passages`; ``None`` if lane or speed were not recorded.
    """
    import polars as pl

    if not set(_NEEDED) <= set(trajectories.collect_schema()):
        return None
    time = pl.col("timestep_time").cast(pl.Float64)
    number = int(trajectories.select(pl.len()).collect().item())
    moments = trajectories.select(time.unique().sort()).collect().to_series()
    period = float(moments.diff().min() or 0.0)  # type: ignore[arg-type]
    if not number or period <= 0.0:
        return None
    end = float(moments[-1])
    if number > _THIN and period < 1.0:
        kept = moments.gather_every(round(1.0 / period))
        trajectories = trajectories.filter(time.is_in(kept.implode()))
        number, period = number * len(kept) // len(moments), period * round(1.0 / period)
    chosen = facts.drivers.filter(~pl.col("serves"))
    batches = -(-number // MOST_ROWS)
    lanes = facts.once("known_lanes", places, lambda: _number_lanes(places, facts.limits))
    found = []
    for batch in range(batches):
        own = pl.Series(range(len(chosen))) % batches == batch
        drivers = chosen if batches == 1 else chosen.filter(own)
        lost = _lost_on(trajectories, lanes, drivers, period=period)
        if lost is not None:
            found.append(passages(lost, end=end, period=period))
    return found[0] if len(found) == 1 else pl.concat(found).sort("time", "id")


def lost_time(
    trajectories: pl.LazyFrame,
    places: LanePlaces,
    limits: pl.DataFrame,
    drivers: pl.DataFrame,
    *,
    period: float,
) -> pl.DataFrame | None:
    """Time that each vehicle lost on each stretch: a road between junctions, or a junction.

    Parameters
    ----------
    trajectories
        As recorded, see docs/runs.md; whole vehicles.
    limits
        ``lane`` and its speed ``limit``, m/s.
    drivers
        ``id``, ``factor`` on limits, and ``max_speed``, m/s; others are left out.
    period
        Seconds between two records.

    Returns
    -------
    One row per vehicle and stretch in order of time: ``id``, ``number`` of the stretch,
    ``junction`` and ``movement`` (null on roads), ``ahead`` (junction ahead, on roads),
    ``approach``, ``lane`` (of junctions the first inside, of roads the last), ``begin`` and
    ``last`` (s), and seconds lost: ``behind``, ``on_the_way``, ``before``, and ``inside``.
    ``None`` if lane or speed were not recorded.
    """
    return _lost_on(trajectories, _number_lanes(places, limits), drivers, period=period)


def _lost_on(
    trajectories: pl.LazyFrame, lanes: pl.DataFrame, drivers: pl.DataFrame, *, period: float
) -> pl.DataFrame | None:
    """The same, with lanes as :func:`_number_lanes` has them."""
    import polars as pl

    if not set(_NEEDED) <= set(trajectories.collect_schema()):
        return None
    known = drivers.select("id", "factor", "max_speed").with_row_index("vehicle")
    found = _stretch_sums(_speed_ratios(trajectories, known, lanes), period)
    return (
        found.join(known.select("vehicle", "id"), on="vehicle")
        .join(lanes.select("junction", "movement", first="place", via="lane"), on="first")
        .join(lanes.select("ahead", "approach", final="place", exit="lane"), on="final")
        .with_columns(lane=pl.when(pl.col("junction").is_null()).then("exit").otherwise("via"))
        .sort("number")
        .select("id", "number", "junction", "movement", "ahead", "approach", "lane", *_MEASURED)
    )


_MEASURED = ("begin", "last", "behind", "on_the_way", "before", "inside")


def _number_lanes(places: LanePlaces, limits: pl.DataFrame) -> pl.DataFrame:
    """Each lane with its limit and its junction, numbered; ``inner`` is 0 on roads."""
    import polars as pl

    within = pl.col("via").is_not_null()
    ways = places.ways.select(
        "lane",
        "movement",
        "approach",
        ahead=pl.when(~within).then("junction"),
        junction=pl.when(within).then("junction"),
    )
    rows = limits.select("lane", "limit").join(ways, on="lane", how="left", maintain_order="left")
    inner = pl.col("junction").rank("dense").fill_null(0).cast(pl.UInt32)
    return rows.with_columns(inner=inner).with_row_index("place")


@dataclass(frozen=True, slots=True)
class _Ratios:
    """Speed as a share of what is desired, by vehicle and time, ``(N,)`` each.

    Attributes
    ----------
    vehicle, place, inner
        Numbers of the vehicle, its lane, and the junction that it is in; 0 on roads.
    time, ratio
        Seconds; 0 to 1.
    """

    vehicle: IntArray
    place: IntArray
    inner: IntArray
    time: FloatArray
    ratio: FloatArray


def _speed_ratios(trajectories: pl.LazyFrame, known: pl.DataFrame, lanes: pl.DataFrame) -> _Ratios:
    """Of known vehicles on known lanes, whose numbers are their rows."""
    import numpy as np
    import polars as pl

    kinds = trajectories.collect_schema()
    rows = (
        trajectories.filter(
            among("vehicle_id", known["id"], kinds["vehicle_id"])
            & among("vehicle_lane", lanes["lane"], kinds["vehicle_lane"])
        )
        .select(
            id="vehicle_id",
            time=pl.col("timestep_time").cast(pl.Float64),
            lane="vehicle_lane",
            speed=pl.col("vehicle_speed").cast(pl.Float64),
        )
        .collect()
    )
    vehicle = numbers_among(rows["id"], known["id"])
    order = by_vehicle_and_time(vehicle, rows["time"])
    vehicle, place = vehicle[order], numbers_among(rows["lane"], lanes["lane"])[order]
    factor, most = (known[name].to_numpy()[vehicle] for name in ("factor", "max_speed"))
    desired = np.minimum(lanes["limit"].to_numpy()[place] * factor, most)
    return _Ratios(
        vehicle=vehicle,
        place=place,
        inner=lanes["inner"].to_numpy()[place],
        time=rows["time"].to_numpy()[order],
        ratio=np.clip(rows["speed"].to_numpy()[order] / desired, 0.0, 1.0),
    )


def _stretch_sums(rows: _Ratios, period: float) -> pl.DataFrame:
    """What is lost on each stretch."""
    import numpy as np
    import polars as pl

    other = changes(rows.vehicle)
    first = np.flatnonzero(other | changes(rows.inner))
    last = np.append(first[1:], len(other))[: len(first)] - 1
    # The first record is the insertion, before the first step is driven.
    lost = np.where(other, 0.0, (1.0 - rows.ratio) * period)
    length = last - first + 1
    place = np.arange(len(other))

    def since(begun: BoolArray) -> BoolArray:
        """Whether it has begun, then or before on the same stretch."""
        begin = np.minimum.reduceat(np.where(begun, place, len(place)), first)
        return place >= np.repeat(begin, length)

    def summed(some: BoolArray) -> FloatArray:
        return np.add.reduceat(np.where(some, lost, 0.0), first)

    road = rows.inner == 0
    top = np.repeat(np.maximum.reduceat(rows.ratio, first), length)
    reached = since(rows.ratio >= REACHED * top)
    slowed = since(reached & ((rows.ratio < SLOWED * top) | (top < FREE)))
    return pl.DataFrame(
        {
            "number": np.arange(1, len(first) + 1),
            "vehicle": rows.vehicle[first],
            "first": rows.place[first],
            "final": rows.place[last],
            "begin": rows.time[first],
            "last": rows.time[last],
            "behind": summed(road & ~reached),
            "on_the_way": summed(road & reached & ~slowed),
            "before": summed(road & slowed),
            "inside": summed(~road),
        },
        schema_overrides=dict.fromkeys(("vehicle", "first", "final"), pl.UInt32),
    )


def passages(stretches: pl.DataFrame, *, end: float, period: float) -> pl.DataFrame:
    """Control delay of each vehicle at each junction that it came to.

    Parameters
    ----------
    stretches
        From :func:`lost_time`.
    end
        When the run ended, s: who is slowed down before a junction then is counted with what it has
        lost so far, without a movement.

    Returns
    -------
    ``id``, ``junction``, ``movement`` (null for those that had not entered), ``approach``,
    ``lane`` (the first inside; of those the last before), ``time`` (s, when it entered, or the
    end), ``before`` (s lost until then) and ``control_delay`` (s).
    """
    import polars as pl

    col = pl.col
    around = stretches.with_columns(
        previous=col("before").shift(1).over("id").fill_null(0.0),
        following=col("behind").shift(-1).over("id").fill_null(0.0),
    )
    entered = around.filter(col("junction").is_not_null()).select(
        "id", "junction", "movement", "approach", "lane",
        time="begin",
        before="previous",
        control_delay=col("previous") + col("inside") + col("following"),
    )  # fmt: skip
    final = (col("number") == col("number").max().over("id")) & (col("last") > end - 2 * period)
    queued = around.filter(
        final
        & col("ahead").is_not_null()
        & (col("before") > 0.0)
        & (col("last") > end - 2 * period)
    ).select(
        "id",
        pl.lit(None, pl.String).alias("movement"),
        "approach",
        "lane",
        "before",
        junction="ahead",
        time="last",
        control_delay="before",
    )
    return pl.concat([entered, queued.select(entered.columns)]).sort("time", "id")
