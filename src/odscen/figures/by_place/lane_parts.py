"""Traffic on parts of SUMO lanes, where a lane lies in several segments: from positions.

SUMO measures whole lanes, and a lane may be kilometres long. Which share of that belongs to which
segment is found from positions: between two records of a vehicle, ``period`` seconds apart, it went
from ``a`` to ``b`` metres along the lane at a constant speed, so that each part which it touches
has its share of the seconds and metres (Edie's definitions, exact for what was driven so)::

    on the lane before too     from there to here, period seconds
    just come onto the lane    from its start to here, at the speed recorded
    gone from the lane         from here to its end, at the speed recorded
    inserted here              nothing: SUMO puts vehicles there at the end of a step

The sums of all parts of a lane are then those of SUMO's lane data, so that places that consist of
whole lanes have exactly its figures. Records of every step need no correction for seconds and
metres but for rounding; fewer are an estimate of the shares.

Time lost is what vehicles spent there beyond the time that their metres take at the pace desired on
this lane, which SUMO says for the whole of it; time standing is the share that the records have.
Emissions are shared by the power that driving takes (:func:`_driving_effort`). Where no positions
were recorded, a part has its share of the lane by length, and :data:`SPREAD` says of how many
seconds that holds.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from odscen.figures.by_place.analysis_times import begins_at
from odscen.figures.by_place.queues import STOPPED
from odscen.figures.by_place.traffic_sums import EMISSIONS, INTERVAL, LOST, SPREAD
from odscen.records.row_text import among, by_vehicle_and_time, numbers_among

if TYPE_CHECKING:
    from collections.abc import Callable

    import polars as pl

    from odscen.base.arrays import BoolArray, FloatArray, IntArray
    from odscen.figures.by_place.lane_places import LanePlaces

MOST_ROWS = 2_000_000
"""Rows that are held in memory at a time; more are taken vehicles by vehicles."""
THIN = 20_000_000
"""Rows from which one record a second is taken."""
FEWEST = 0.9
"""Share of the seconds on a lane that positions must account for; else it was not recorded."""

_STEP = 1.0
"""Seconds: the longest step of a run; records further apart are not of every step."""
_NEEDED = ("timestep_time", "vehicle_id", "vehicle_lane", "vehicle_speed")
_MEASURED = ("seconds", "distance", "standing_seconds", "heavy_seconds", "effort")
_COUNTED = ("crossed", "departed_here")


def no_parts() -> pl.DataFrame:
    """What :func:`part_sums` returns, without rows."""
    import polars as pl

    kinds = {"lane": pl.String, "part": pl.Int64, "begin": pl.Float64}
    return pl.DataFrame(schema={**kinds, **dict.fromkeys((*_MEASURED, *_COUNTED), pl.Float64)})


@dataclass(frozen=True, eq=False)
class SplitLanes:
    """Lanes that lie in several segments, one behind the other on one axis of metres.

    Attributes
    ----------
    names
        Of the lanes, ``(K,)``.
    edge
        Number of the edge of each, ``(K,)``.
    start, end
        Of each on the axis, ``(K,)``; between two lanes is a metre.
    begins
        Of each part on the axis, ``(P,)``.
    first
        Number of the first part of each lane, ``(K + 1,)``.
    """

    names: pl.Series
    edge: IntArray
    start: FloatArray
    end: FloatArray
    begins: FloatArray
    first: IntArray

    @classmethod
    def of(cls, places: LanePlaces) -> SplitLanes:
        """Lanes of a map that lie in several segments."""
        import numpy as np
        import polars as pl

        lanes = (
            places.lanes.group_by("lane", maintain_order=True)
            .agg(pl.col("length").first(), "share", "segment")
            .filter(pl.col("share").list.len() > 1)
        )
        names, lengths = lanes["lane"], lanes["length"].to_numpy()
        # Lanes that lie in the same several segments are those of one edge.
        edges: dict[tuple[str, ...], int] = {}
        edge = [
            edges.setdefault(tuple(segments), len(edges)) for segments in lanes["segment"].to_list()
        ]
        start = np.concatenate(([0.0], np.cumsum(lengths + 1.0)))[: len(lengths)]
        begins, first = [], [0]
        for at, length, shares in zip(start, lengths, lanes["share"].to_list(), strict=True):
            metres = np.cumsum([0.0, *shares[:-1]]) * length
            begins.append(at + metres)
            first.append(first[-1] + len(shares))
        return cls(
            names,
            np.array(edge, dtype=np.int64),
            start,
            start + lengths,
            np.concatenate(begins) if begins else np.zeros(0),
            np.array(first),
        )


def part_sums(
    trajectories: pl.LazyFrame,
    places: LanePlaces,
    clock: pl.DataFrame,
    *,
    positions: Callable[[pl.DataFrame], pl.Series] | None = None,
    drivers: pl.DataFrame | None = None,
) -> pl.DataFrame | None:
    """What was driven on each part of the lanes that lie in several segments, by interval.

    Parameters
    ----------
    trajectories
        As recorded, see docs/runs.md.
    clock
        ``begin`` and ``end`` of each interval, s.
    positions
        Metres along the lane of rows with ``lane``, ``x`` and ``y``; needed where ``vehicle_pos``
        was not recorded.
    drivers
        ``id``, whether a vehicle is ``heavy``, and its ``arrival_pos`` (m along its last lane; null
        if not known); ``None`` if all are taken for cars.

    Returns
    -------
    ``lane``, ``part`` (from 0 in driving direction), ``begin``; ``seconds``, ``distance`` (m),
    ``standing_seconds``, ``heavy_seconds`` (of heavy vehicles), ``effort``
    (what emissions are shared by), ``crossed`` (vehicles that came from the part before) and
    ``departed_here``. ``None`` if lane, speed or position were not recorded.
    """
    import polars as pl

    columns = set(trajectories.collect_schema())
    placed = "vehicle_pos" in columns or (positions and {"vehicle_x", "vehicle_y"} <= columns)
    if not placed or not set(_NEEDED) <= columns:
        return None
    split = SplitLanes.of(places)
    if split.names.is_empty():
        return no_parts()
    time = pl.col("timestep_time").cast(pl.Float64)
    moments = trajectories.select(time.unique().sort()).collect().to_series()
    period = float(moments.diff().min() or 0.0)  # type: ignore[arg-type]
    if period <= 0.0:
        return no_parts()
    on_split = among("vehicle_lane", split.names, trajectories.collect_schema()["vehicle_lane"])
    number = int(trajectories.filter(on_split).select(pl.len()).collect().item())
    if number > THIN and period < 1.0:
        kept = moments.gather_every(round(1.0 / period))
        trajectories = trajectories.filter(time.is_in(kept.implode()))
        number, period = number * len(kept) // len(moments), period * round(1.0 / period)
    spans = (
        trajectories.group_by(id=pl.col("vehicle_id").cast(pl.String))
        .agg(came=time.min(), last=time.max())
        .collect(engine="streaming")
        .sort("id")
    )
    if drivers is not None:
        spans = spans.join(
            drivers.select("id", "heavy"), on="id", how="left", maintain_order="left"
        )
    batches = max(1, -(-number // MOST_ROWS))
    found = no_parts()
    for batch in range(batches):
        own = spans.gather_every(batches, batch)
        rows = trajectories.filter(on_split)
        if batches > 1:
            kind = trajectories.collect_schema()["vehicle_id"]
            rows = rows.filter(among("vehicle_id", own["id"], kind))
        sums = _sums_of(
            _read_records(rows, own, split, positions), split, period, float(moments[-1])
        )
        found = pl.concat([found, _split_by_interval(sums, split, clock)])
    keys = ("lane", "part", "begin")
    return found.group_by(keys).agg(pl.col(*_MEASURED, *_COUNTED).sum()).sort(keys)


def parts_on_clock(measured: pl.DataFrame, clock: pl.DataFrame) -> pl.DataFrame:
    """What :func:`part_sums` has found, over the longer intervals of ``clock``."""
    import polars as pl

    return (
        measured.with_columns(begins_at(measured["begin"], clock))
        .drop_nulls("begin")
        .group_by("lane", "part", "begin")
        .agg(pl.col(*_MEASURED, *_COUNTED).sum())
        .sort("lane", "part", "begin")
    )


@dataclass(frozen=True, slots=True)
class _Records:
    """Records on split lanes by vehicle and time, ``(N,)`` each.

    Attributes
    ----------
    vehicle, lane
        Numbers.
    time, pos, speed
        Seconds; metres on the axis of :class:`SplitLanes`; m/s.
    came, gone
        Whether it is the first, the last record of the vehicle anywhere.
    arrival
        Where the trip of the vehicle ends, metres along its last lane; NaN if not known.
    heavy
        Whether the vehicle is.
    """

    vehicle: IntArray
    lane: IntArray
    time: FloatArray
    pos: FloatArray
    speed: FloatArray
    came: BoolArray
    gone: BoolArray
    arrival: FloatArray
    heavy: FloatArray


def _read_records(
    trajectories: pl.LazyFrame,
    spans: pl.DataFrame,
    split: SplitLanes,
    positions: Callable[[pl.DataFrame], pl.Series] | None,
) -> _Records:
    import numpy as np
    import polars as pl

    known = "vehicle_pos" in trajectories.collect_schema()
    placed = ("vehicle_pos",) if known else ("vehicle_x", "vehicle_y")
    rows = trajectories.select(
        id="vehicle_id",
        lane="vehicle_lane",
        time=pl.col("timestep_time").cast(pl.Float64),
        speed=pl.col("vehicle_speed").cast(pl.Float64),
        **{name.removeprefix("vehicle_"): pl.col(name).cast(pl.Float64) for name in placed},
    ).collect(engine="streaming")
    vehicle = numbers_among(rows["id"], spans["id"])
    order = by_vehicle_and_time(vehicle, rows["time"])
    rows, vehicle = rows[order], vehicle[order]
    lane = numbers_among(rows["lane"], split.names)
    if known:
        along = rows["pos"].to_numpy()
    else:
        assert positions is not None
        # Most of those in a queue do not move from one record to the next.
        x, y = rows["x"].to_numpy(), rows["y"].to_numpy()
        still = (np.diff(x) == 0.0) & (np.diff(y) == 0.0) & (np.diff(lane) == 0)
        moved = np.concatenate(([True], ~still)) if len(x) else np.zeros(0, dtype=np.bool_)
        there = rows.filter(moved).select(pl.col("lane").cast(pl.String), "x", "y")
        along = positions(there).to_numpy()[np.cumsum(moved) - 1]
    time = rows["time"].to_numpy()
    arrival = spans["arrival_pos"].fill_null(np.nan) if "arrival_pos" in spans.columns else None
    heavy = spans["heavy"].fill_null(value=False) if "heavy" in spans.columns else None
    return _Records(
        vehicle=vehicle,
        lane=lane,
        time=time,
        pos=split.start[lane] + np.clip(along, 0.0, (split.end - split.start)[lane]),
        speed=rows["speed"].to_numpy(),
        came=time <= spans["came"].to_numpy()[vehicle],
        gone=time >= spans["last"].to_numpy()[vehicle],
        arrival=np.full(len(time), np.nan) if arrival is None else arrival.to_numpy()[vehicle],
        heavy=np.zeros(len(time)) if heavy is None else heavy.to_numpy().astype(float)[vehicle],
    )


@dataclass(frozen=True, slots=True)
class _Moves:
    """Stretches that were driven at a constant speed, ``(M,)`` each.

    From ``a`` to ``b`` (m, on the axis) in ``seconds``, at the end of ``time``; ``row`` is the
    record that they end with.
    """

    row: IntArray
    lane: IntArray
    a: FloatArray
    b: FloatArray
    seconds: FloatArray
    time: FloatArray


def _find_moves(rows: _Records, split: SplitLanes, period: float, end: float) -> _Moves:
    """What was driven between records."""
    import numpy as np

    number = len(rows.time)
    index = np.arange(number)
    before = np.zeros(number, dtype=np.bool_)
    near = np.diff(rows.time) < 1.5 * period
    before[1:] = near & (np.diff(rows.vehicle) == 0)

    previous = np.maximum(index - 1, 0)
    # A change to a lane beside it is made at the end of a step, which was driven on the old lane.
    beside = before & (split.edge[rows.lane] == split.edge[rows.lane[previous]])
    followed = np.append(beside[1:], [False])
    start, stop = split.start[rows.lane], split.end[rows.lane]
    reach = np.maximum(rows.speed * period, 1e-9)

    on = index[beside]
    was = previous[beside]
    old = rows.lane[was]
    to = split.start[old] + (rows.pos[on] - start[on])
    stayed = (on, old, rows.pos[was], np.minimum(to, split.end[old]), np.full(len(on), period))

    # Of records of every step the first is the insertion; of others it was half of them ago.
    sparse = period > _STEP
    new = index[~beside & (~rows.came | sparse)]
    most = np.where(rows.came[new], 0.5, 1.0) * reach[new]
    back = np.minimum(rows.pos[new] - start[new], most)
    entered = (new, rows.lane[new], rows.pos[new] - back, rows.pos[new], period * back / reach[new])

    left = index[~followed & ~(rows.gone & (rows.time > end - 1.5 * period))]
    way = stop[left] - rows.pos[left]
    arrival = start[left] + rows.arrival[left] - rows.pos[left]
    arrives = rows.gone[left] & (arrival >= 0.0) & (arrival <= reach[left] + 1.0)
    way = np.where(arrives, np.minimum(arrival, way), way)
    # Who is gone, and it is not known where, was so on average half way to the next record.
    most = np.where(rows.gone[left] & (way > reach[left]), 0.5, 1.0) * reach[left]
    on_way = np.minimum(way, most)
    # Who has stood at the line has no speed yet, and needs a step to be gone.
    spent = np.where(way < reach[left], way / reach[left], most / reach[left]) * period
    gone = (left, rows.lane[left], rows.pos[left], rows.pos[left] + on_way, spent)

    row, lane, a, b, seconds = (
        np.concatenate(columns) for columns in zip(stayed, entered, gone, strict=True)
    )
    time = rows.time[row]
    time[len(on) + len(new) :] += period
    if sparse:  # in the middle of what was driven, for much may lie between two records
        time -= period / 2.0
    return _Moves(row, lane, np.minimum(a, b), b, seconds, time)


@dataclass(frozen=True, slots=True)
class _PartRows:
    """Sums of parts at times, ``(R,)`` each; ``values`` in the order of ``_MEASURED, _COUNTED``."""

    part: IntArray
    time: FloatArray
    values: dict[str, FloatArray]


def _sums_of(rows: _Records, split: SplitLanes, period: float, end: float) -> _PartRows:
    import numpy as np

    moves = _find_moves(rows, split, period, end)
    last = split.first[1:] - 1

    def part_at(pos: FloatArray, lane: IntArray) -> IntArray:
        found = np.searchsorted(split.begins, pos, side="right") - 1
        part: IntArray = np.clip(found, split.first[lane], last[lane])
        return part

    from_part, to_part = part_at(moves.a, moves.lane), part_at(moves.b, moves.lane)
    spans = to_part - from_part + 1
    each = np.repeat(np.arange(len(spans)), spans)
    nth = np.arange(len(each)) - np.repeat(np.cumsum(spans) - spans, spans)
    part = from_part[each] + nth
    ends = np.append(split.begins[1:], np.inf)
    ends[last] = split.end + 1.0
    metres = np.minimum(moves.b[each], ends[part]) - np.maximum(moves.a[each], split.begins[part])
    way = (moves.b - moves.a)[each]
    share = np.where(way > 0.0, metres / np.maximum(way, 1e-12), 1.0 / spans[each])
    seconds = moves.seconds[each] * share
    row = moves.row[each]
    before = np.zeros(len(rows.time))
    before[1:] = np.where(np.diff(rows.vehicle) == 0, np.diff(rows.speed) / period, 0.0)
    effort = _driving_effort(rows.speed, before, rows.heavy)
    came = np.flatnonzero(rows.came)
    nothing = np.zeros(len(came))
    measured = {
        "seconds": seconds,
        "distance": np.maximum(metres, 0.0),
        "standing_seconds": np.where(rows.speed[row] < STOPPED, seconds, 0.0),
        "heavy_seconds": seconds * rows.heavy[row],
        "effort": seconds * effort[row],
        "crossed": (nth > 0).astype(float),
        "departed_here": np.zeros(len(each)),
    }
    departed = dict.fromkeys(measured, nothing) | {"departed_here": np.ones(len(came))}
    return _PartRows(
        part=np.concatenate([part, part_at(rows.pos[came], rows.lane[came])]),
        time=np.concatenate([moves.time[each], rows.time[came]]),
        values={
            name: np.concatenate([values, departed[name]]) for name, values in measured.items()
        },
    )


def _split_by_interval(sums: _PartRows, split: SplitLanes, clock: pl.DataFrame) -> pl.DataFrame:
    import numpy as np
    import polars as pl

    found = (
        pl.DataFrame({"number": sums.part, **sums.values})
        .with_columns(begins_at(pl.Series(sums.time), clock))
        .drop_nulls("begin")
        .group_by("number", "begin")
        .agg(pl.col(*_MEASURED, *_COUNTED).sum())
    )
    number = found["number"].to_numpy()
    row = np.searchsorted(split.first, number, side="right") - 1
    return found.with_columns(
        lane=split.names.gather(row), part=pl.Series(number - split.first[row], dtype=pl.Int64)
    ).select(no_parts().columns)


def _driving_effort(speed: FloatArray, acceleration: FloatArray, heavy: FloatArray) -> FloatArray:
    """Power that driving takes, kW for each tonne, with what an engine needs when idle.

    Vehicle specific power (J. L. Jiménez-Palacios, *Understanding and Quantifying Motor Vehicle
    Emissions*, MIT 1999) of a car on a level road; a heavy vehicle has :data:`_HEAVY` times as
    much. :data:`_IDLE` and that are fitted to SUMO's HBEFA 4.2: on a road with a queue the carbon
    dioxide of a hundred metres and five minutes differs by 6 % on average from that of each step.
    """
    import numpy as np

    power = speed * (1.1 * acceleration + 0.132) + 0.000302 * speed**3
    effort: FloatArray = (np.maximum(power, 0.0) + _IDLE) * np.where(heavy > 0.0, _HEAVY, 1.0)
    return effort


_IDLE = 5.0
_HEAVY = 3.0


def lane_parts(
    lanes: pl.DataFrame, places: LanePlaces, measured: pl.DataFrame | None
) -> pl.DataFrame:
    """What happened on each lane, or on each part of it where it lies in several segments.

    Parameters
    ----------
    lanes
        Per lane and interval, from :func:`odscen.figures.by_place.traffic_sums.summable`.
    measured
        From :func:`part_sums`, over the same intervals; ``None`` if there are no positions.

    Returns
    -------
    Rows as ``lanes``, with ``segment``, ``part``, ``motor``, ``metres`` of the part, ``vehicles``
    that came into the segment there or started there, :data:`SPREAD`, and ``heavy_seconds`` (null
    where only the whole lane is known).
    """
    import polars as pl

    col = pl.col
    own = places.lanes.with_columns(part=pl.int_range(pl.len()).over("lane"))
    keys = ("lane", "part", "begin")
    rows = lanes.join(own, on="lane").join(
        _shares_of_parts(lanes, own, no_parts() if measured is None else measured),
        on=keys,
        how="left",
    )
    known = col("of_seconds").is_not_null()
    by_length = col("share")
    of_seconds = pl.coalesce("of_seconds", by_length)
    of_metres = pl.coalesce("of_metres", by_length)
    # A lane without metres has lost all of its time.
    pace = pl.when(col("distance") > 0).then((col("seconds") - col("time_loss")) / col("distance"))
    seconds, metres = col("seconds") * of_seconds, col("distance") * of_metres
    lost = pl.when(known & (col("distance") > 0)).then(seconds - metres * pace).otherwise(seconds)
    rows = rows.with_columns(lost=lost.clip(0.0))
    of_lost = pl.when(known & (col("lost").sum().over("lane", "begin") > 0)).then(
        col("lost") / col("lost").sum().over("lane", "begin")
    )
    came = pl.when(col("part") > 0).then(
        pl.when(known).then("crossed").otherwise("entered")
    ).otherwise("entered")  # fmt: skip
    started = pl.when(known).then("started").otherwise("departed")
    recorded = [name for name in EMISSIONS if name in lanes.columns]
    return (
        rows.with_columns(
            pl.when("entry").then(came).otherwise(0).alias("entered"),
            started.alias("departed"),
            seconds=seconds,
            distance=metres,
            time_loss=col("time_loss") * pl.coalesce(of_lost, of_seconds),
            standing_seconds=pl.coalesce(
                seconds * col("standing"), col("standing_seconds") * by_length
            ),
            **{name: col(name) * pl.coalesce("of_effort", by_length) for name in recorded},
            **{SPREAD: pl.when(known | (col("share") >= 1.0)).then(0.0).otherwise(seconds)},
            heavy_seconds=seconds * col("of_heavy"),
            metres=col("length") * col("share"),
        )
        .with_columns(vehicles=(col("entered") + col("departed")).cast(pl.Int64))
        .select(
            *INTERVAL, "edge", "lane", "segment", "part", "motor", "metres", "vehicles",
            "seconds", "distance", *LOST, *recorded, SPREAD, "heavy_seconds",
        )
    )  # fmt: skip


def _shares_of_parts(
    lanes: pl.DataFrame, own: pl.DataFrame, measured: pl.DataFrame
) -> pl.DataFrame:
    """Shares of the parts in what happened on the lane; lanes not recorded as a whole left out."""
    import polars as pl

    col = pl.col

    def whole(name: str) -> pl.Expr:
        return col(name).sum().over("lane", "begin")

    def of_whole(name: str) -> pl.Expr:
        return pl.when(whole(name) > 0).then(col(name) / whole(name))

    seen = measured.group_by("lane").agg(seen=col("seconds").sum())
    covered = (
        lanes.group_by("lane")
        .agg(col("seconds").sum())
        .join(seen, on="lane")
        .filter(col("seen") >= FEWEST * col("seconds"))
    )
    there = (
        measured.join(covered, on="lane", how="semi")
        .group_by("lane", "begin")
        .agg(col("seconds").sum())
        .filter(col("seconds") > 0)
        .select("lane", "begin")
    )
    # Who is seen every few seconds only may have passed a short lane unseen.
    # Who only stood there, or was put there by a rule, has driven no metres.
    unseen = pl.when(whole("distance") > 0).then(col("driven") / whole("distance"))
    crossed = pl.when(unseen > 1.05).then((col("crossed") * unseen).round())
    first = pl.when(col("part") == 0).then("began").otherwise(0)
    return (
        # Parts that nobody was on have no row, and no share.
        own.select("lane", "part")
        .join(there, on="lane")
        .join(measured, on=("lane", "part", "begin"), how="left")
        .with_columns(col(*_MEASURED, *_COUNTED).fill_null(0.0))
        .join(
            lanes.select("lane", "begin", driven="distance", began="departed"),
            on=("lane", "begin"),
        )
        .select(
            "lane", "part", "begin",
            of_seconds=of_whole("seconds"),
            of_metres=pl.coalesce(of_whole("distance"), of_whole("seconds")),
            standing=pl.when(col("seconds") > 0)
            .then(col("standing_seconds") / col("seconds"))
            .otherwise(0.0),
            of_effort=of_whole("effort"),
            of_heavy=pl.when(col("seconds") > 0).then(col("heavy_seconds") / col("seconds")),
            crossed=crossed.otherwise("crossed"),
            started=pl.coalesce((of_whole("departed_here") * col("began")).round(), first),
        )
    )  # fmt: skip
