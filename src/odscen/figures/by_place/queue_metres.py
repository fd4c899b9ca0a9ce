"""Queues of lane groups in metres, from trajectories.

A vehicle is queued while it is slower than 5 mi/h and no more than :data:`GAP` behind the stop
line, or behind the rear of a queued vehicle of its lane group; whoever has joined stays queued
until it is faster, though those in front have left already. Length of the queue of a moment::

    length = max over the queued vehicles of (stop line to front + length of the vehicle)

So it is the distance from the stop line to the back of the queue, as HCM chapter 31 has it.
Vehicles are counted for the lane group by which they enter the junction, those that never do for
the one that their lane leads to.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from odscen.records.row_text import among, by_vehicle_and_time, changes, numbers

if TYPE_CHECKING:
    import polars as pl

    from odscen.base.arrays import BoolArray, FloatArray, IntArray
    from odscen.figures.by_place.facilities import NetFacts
    from odscen.figures.by_place.lane_groups import LaneGroups


NEEDED = ("timestep_time", "vehicle_id", "vehicle_lane", "vehicle_x", "vehicle_y", "vehicle_speed")
"""Columns of trajectories that positions are found from."""


def positions(rows: pl.DataFrame, facts: NetFacts) -> pl.Series:
    """Metres from the start of the lane to the front of the vehicle, for each row.

    The nearest place on the centre line of the lane, as SUMO itself has it where lines are longer
    or shorter than lanes.

    Parameters
    ----------
    rows
        ``lane``, ``x`` and ``y`` (m, SUMO's frame).
    """
    import numpy as np
    import polars as pl

    lengths = dict(facts.limits.select("lane", "length").rows())
    found = np.zeros(rows.height)
    points = np.column_stack([rows["x"].to_numpy(), rows["y"].to_numpy()])
    by_lane = rows.select("lane").with_row_index("row").group_by("lane").agg("row")
    for lane, lane_rows in zip(by_lane["lane"], by_lane["row"], strict=True):
        own = lane_rows.to_numpy()
        found[own] = _share_along(facts.shapes[lane], points[own]) * lengths[lane]
    return pl.Series("pos", found)


def _share_along(shape: FloatArray, points: FloatArray) -> FloatArray:
    """Share of a line ``(K, 2)`` up to the place on it that is nearest to each point."""
    import numpy as np

    starts, steps = shape[:-1], np.diff(shape, axis=0)
    metres = np.hypot(*steps.T)
    squares = np.maximum(metres**2, 1e-12)
    ends = np.concatenate(([0.0], np.cumsum(metres)))
    best, along = np.full(len(points), np.inf), np.zeros(len(points))
    for start, step, square, length, before in zip(
        starts, steps, squares, metres, ends[:-1], strict=True
    ):
        share = np.clip(((points - start) * step).sum(axis=1) / square, 0.0, 1.0)
        distance = np.hypot(*(points - start - share[:, None] * step).T)
        closer = distance < best
        best = np.where(closer, distance, best)
        along = np.where(closer, before + share * length, along)
    whole: FloatArray = along / max(float(ends[-1]), 1e-9)
    return whole


QUEUED = 5.0 * 0.44704
"""m/s: slower vehicles can be queued; 5 mi/h."""
GAP = 10.0
"""Metres between the rear of one vehicle and the front of the next in a queue, at most."""
SPACE = 7.5
"""Metres that a vehicle needs: with less room behind it, a queue reaches the junction behind."""
_SHARE = 0.05
_PASSES = 3
"""Times that those who were reached by the queue pass it on to vehicles behind them."""

SUMS = ("queue_metre_seconds", "overflow_seconds", "spillback_seconds")
"""Columns that sum up over time."""
WORST = ("queue_metres_p95", "queue_metres_max", "queue_metres_p95_run")
"""Columns of which the highest counts over time; the last is the same in all intervals."""


def queue_backs(
    trajectories: pl.LazyFrame,
    groups: LaneGroups,
    facts: NetFacts,
    *,
    period: float | None = None,
) -> pl.DataFrame | None:
    """Distance from the stop line to the back of the queue, for each lane group and moment.

    Parameters
    ----------
    period
        From :func:`record_step`, which is asked if it is not given.

    Returns
    -------
    ``lane_group``, ``time`` (s), ``metres``; without moments without a queue. ``None`` if lane,
    place or speed were not recorded.
    """
    if not set(NEEDED) <= set(trajectories.collect_schema()):
        return None
    step = record_step(trajectories) if period is None else period
    slow = _slow_records(trajectories, groups)
    if slow.is_empty():
        return _queue_backs([], [], [])
    rows = _place_slow_vehicles(
        slow, _junction_entries(trajectories, groups), groups, facts, period=step
    )
    joined = _join_queue(rows)
    if not len(joined):
        return _queue_backs([], [], [])
    at, rear = rows.at[joined], rows.rear[joined]
    first = np.flatnonzero(changes(at))
    group, moment = np.divmod(at[first], len(rows.moments))
    return _queue_backs(rows.names[group], rows.moments[moment], np.maximum.reduceat(rear, first))


def _queue_backs(groups: Any, times: Any, metres: Any) -> pl.DataFrame:
    import polars as pl

    schema = {"lane_group": pl.String, "time": pl.Float64, "metres": pl.Float64}
    return pl.DataFrame({"lane_group": groups, "time": times, "metres": metres}, schema=schema)


def record_step(trajectories: pl.LazyFrame) -> float:
    """Seconds between two records."""
    import polars as pl

    times = pl.col("timestep_time").cast(pl.Float64).unique().sort()
    step = trajectories.select(times.diff().min()).collect().item()
    return float(step or 1.0)


def _junction_entries(trajectories: pl.LazyFrame, groups: LaneGroups) -> pl.DataFrame:
    """Who entered which junction when, by which lane group; sorted by time."""
    import polars as pl

    kind = trajectories.collect_schema()["vehicle_lane"]
    return (
        trajectories.filter(among("vehicle_lane", groups.ways["via"], kind))
        .select(
            id=pl.col("vehicle_id").cast(pl.String),
            then=pl.col("timestep_time").cast(pl.Float64),
            via=pl.col("vehicle_lane").cast(pl.String),
        )
        .join(groups.ways.lazy().select("via", "junction", "lane_group"), on="via")
        .group_by("id", "junction", "lane_group")
        .agg(pl.col("then").max())
        .sort("then")
        .collect(engine="streaming")
    )


def _slow_records(trajectories: pl.LazyFrame, groups: LaneGroups) -> pl.DataFrame:
    """Records of those who can be queued, by vehicle and time; ``number`` is the vehicle's."""
    import polars as pl

    col = pl.col
    kind = trajectories.collect_schema()["vehicle_lane"]
    slow = (
        trajectories.filter(
            (col("vehicle_speed") < QUEUED) & among("vehicle_lane", groups.first["lane"], kind)
        )
        .select(
            id="vehicle_id",
            time=col("timestep_time").cast(pl.Float64),
            lane="vehicle_lane",
            x=col("vehicle_x").cast(pl.Float64),
            y=col("vehicle_y").cast(pl.Float64),
        )
        .collect(engine="streaming")
    )
    number, _ = numbers(slow["id"])
    return slow.with_columns(number=pl.Series(number))[by_vehicle_and_time(number, slow["time"])]


@dataclass(frozen=True, slots=True)
class _SlowRows:
    """Slow vehicles by vehicle and time, ``(N,)`` each, with numbers in place of names.

    Attributes
    ----------
    names, moments
        Lane groups and times (s) that have the numbers ``group`` and ``moment``.
    spell
        Number of the stretch of time in which it is slow before one stop line.
    front, rear
        Metres from the stop line.
    """

    names: pl.Series
    moments: FloatArray
    group: IntArray
    moment: IntArray
    spell: IntArray
    front: FloatArray
    rear: FloatArray

    @property
    def at(self) -> IntArray:
        """Number of lane group and moment together."""
        return self.group * np.int64(len(self.moments)) + self.moment


def _place_slow_vehicles(
    slow: pl.DataFrame,
    entered: pl.DataFrame,
    groups: LaneGroups,
    facts: NetFacts,
    *,
    period: float,
) -> _SlowRows:
    """Where slow vehicles are before the lines that they come to."""
    import polars as pl

    lane, _ = numbers(slow["lane"])
    time, x, y = (slow[name].to_numpy() for name in ("time", "x", "y"))
    another = changes(slow["number"].to_numpy()) | (np.diff(time, prepend=np.inf) > 1.5 * period)
    # Within a stretch nobody enters a junction, and most do not move.
    starts = another | changes(lane)
    moved = starts | changes(x) | changes(y)
    pos = positions(slow.filter(moved), facts).to_numpy()[np.cumsum(moved) - 1]
    stretches = (
        _group_slow_vehicles(slow.filter(starts).with_row_index("stretch"), entered, groups)
        .join(facts.drivers.select("id", body="length"), on="id", how="left")
        .join(facts.limits.select("lane", metres="length"), on="lane", how="left")
        .select(
            "stretch",
            "lane_group",
            pl.col("body").fill_null(5.0),
            line=pl.col("ahead") + pl.col("metres"),
        )
        .sort("stretch")
    )
    of_stretch, names = numbers(stretches["lane_group"])
    stretch = np.cumsum(starts) - 1
    group = of_stretch[stretch]
    front = stretches["line"].to_numpy()[stretch] - pos
    moments = np.unique(time)
    return _SlowRows(
        names=pl.Series(names),
        moments=moments,
        group=group,
        moment=np.searchsorted(moments, time).astype(np.min_scalar_type(len(moments))),
        spell=np.cumsum(another | changes(group)),
        front=front,
        rear=front + stretches["body"].to_numpy()[stretch],
    )


def _group_slow_vehicles(
    slow: pl.DataFrame, entered: pl.DataFrame, groups: LaneGroups
) -> pl.DataFrame:
    """The lane group of each slow vehicle, and ``ahead``: metres from its lane to the line."""
    import polars as pl

    found = (
        slow.with_columns(pl.col("id", "lane").cast(pl.String))
        .join(groups.first, on="lane", how="left")
        .sort("time")
        .join_asof(
            entered.rename({"lane_group": "by"}),
            left_on="time",
            right_on="then",
            by=("id", "junction"),
            strategy="forward",
            check_sortedness=False,
        )
    )
    reach = groups.reach.select("lane", "lane_group", "ahead")
    leads = pl.col("ahead").is_not_null()
    # On a lane that does not lead there, one has yet to change, and stands in the other's way.
    return found.join(
        reach, left_on=("lane", "by"), right_on=("lane", "lane_group"), how="left"
    ).with_columns(
        lane_group=pl.when(leads).then("by").otherwise("other"),
        ahead=pl.coalesce("ahead", "ahead_of_other"),
    )


def _join_queue(rows: _SlowRows) -> IntArray:
    """Those that are in the queue, by lane group and moment, and from the line backwards."""
    # In which order they are who are beside each other does not matter.
    order = np.lexsort((rows.front, rows.moment, rows.group))
    front = rows.front[order]
    cluster: IntArray = np.cumsum(_begin_clusters(rows.at[order], front, rows.rear[order]))
    return order[_find_queued(order, rows.spell, cluster, front)]


def _begin_clusters(at: IntArray, front: FloatArray, rear: FloatArray) -> BoolArray:
    """Who begins another cluster: who is more than the gap behind all that are before it.

    Parameters
    ----------
    at
        Number of lane group and moment, ascending.
    front, rear
        Metres from the stop line, from there backwards.
    """
    first = changes(at)
    most = int(np.diff(np.flatnonzero(first), append=len(at)).max())
    furthest, reach = rear.copy(), 1
    while reach < most:  # over twice as many each time
        both = np.maximum(furthest[reach:], furthest[:-reach])
        furthest[reach:] = np.where(at[reach:] == at[:-reach], both, furthest[reach:])
        reach *= 2
    behind = front[1:] - furthest[:-1] > GAP
    return first | np.concatenate(([False], behind))


def _find_queued(
    order: IntArray, spell: IntArray, cluster: IntArray, front: FloatArray
) -> BoolArray:
    """Who is in a queue; the vehicles of a moment are reached by it again and again.

    Parameters
    ----------
    order
        Place of each in the order of vehicles and times.
    spell
        In the order of vehicles and times: number of the stretch of time in which it is slow.
    cluster
        Number of the cluster that it is in, ascending.
    front
        Metres from the stop line.
    """
    first = np.flatnonzero(changes(cluster))
    queued = np.repeat(np.minimum.reduceat(front, first) <= GAP, np.diff(first, append=len(front)))
    by_time = np.empty_like(order)
    place = by_time[order] = np.arange(len(order))
    begin = np.maximum.accumulate(np.where(changes(spell), place, 0))
    for _ in range(_PASSES):
        # Whoever has joined stays: the last that was queued lies in the same spell.
        last = np.maximum.accumulate(np.where(queued[by_time], place, -1))
        queued[by_time] = last >= begin
        reached = np.zeros(int(cluster[-1]) + 1, dtype=np.bool_)
        reached[cluster[queued]] = True
        queued = reached[cluster]
    return queued


def queue_sums(
    backs: pl.DataFrame,
    groups: LaneGroups,
    clock: pl.DataFrame,
    *,
    step: float,
    since: float = 0.0,
) -> pl.DataFrame:
    """Queues of lane groups by interval.

    Parameters
    ----------
    backs
        From :func:`queue_backs`.
    clock
        ``begin`` and ``end`` of each interval.
    step
        Seconds between two records.
    since
        Seconds from which the run is analysed.

    Returns
    -------
    ``lane_group``, ``begin``, ``queue_metre_seconds``, ``overflow_seconds`` (the queue was longer
    than the lanes of the group), ``spillback_seconds`` (it reached the junction behind),
    ``queue_metres_p95`` and ``queue_metres_max``, and ``queue_metres_p95_run``, that of all that is
    analysed; without intervals without a queue.
    """
    import polars as pl

    col = pl.col
    rank = ((col("end") - col("begin")).first() / step * _SHARE).floor().cast(pl.Int64)
    ordered = col("metres").sort(descending=True)
    moments = max(float(clock["end"][-1]) - since, 0.0) / step
    run = (
        backs.filter(col("time") >= since)
        .group_by("lane_group")
        .agg(
            queue_metres_p95_run=ordered.get(
                math.floor(moments * _SHARE), null_on_oob=True
            ).fill_null(0.0)
        )
    )
    return (
        backs.sort("time")
        .join_asof(clock.sort("begin"), left_on="time", right_on="begin", coalesce=False)
        .drop_nulls("begin")
        .filter(col("time") < col("end"))
        .join(groups.groups.select("lane_group", "storage", "room"), on="lane_group")
        .group_by("lane_group", "begin")
        .agg(
            queue_metre_seconds=col("metres").sum() * step,
            overflow_seconds=(col("metres") > col("storage")).sum() * step,
            spillback_seconds=(col("metres") > col("room") - SPACE).sum() * step,
            queue_metres_p95=ordered.get(rank, null_on_oob=True).fill_null(0.0),
            queue_metres_max=col("metres").max(),
        )
        .join(run, on="lane_group", how="left")
        .with_columns(col("queue_metres_p95_run").fill_null(0.0))
        .sort("lane_group", "begin")
    )  # fmt: skip
