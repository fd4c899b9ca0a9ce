"""Figures of traffic by place and time, from what SUMO sums up per lane and interval.

Definitions, each used everywhere:

flow, density, speed
    Edie's generalized definitions (L. C. Edie, *Discussion of traffic stream measurements and
    definitions*, Proc. 2nd Int. Symp. on the Theory of Traffic Flow, 1963). In an interval of ``T``
    hours on a place of ``L`` km: ``flow = distance / (L T)``, ``density = seconds / (L T)``,
    ``speed = distance / seconds``, with what all vehicles drove and the time that they spent there.
    ``speed`` is the space mean, and ``flow = density * speed``.
place
    Segments have what happened in them, also where a SUMO lane reaches over several:
    :mod:`odscen.figures.by_place.lane_parts`.
L
    Segment: its length along the road, so that flow is that of all lanes and directions together.
    Junction, movement: mean length of the connections. Network: sum over the lanes, so that flow
    and density are per lane, as in macroscopic fundamental diagrams (N. Geroliminis and C. F.
    Daganzo, Transportation Research B 42, 2008).
delay
    SUMO's time loss, the sum of ``(1 - speed / desired speed) dt``, in seconds per vehicle. So
    ``seconds - time_loss`` is the time that the same distance takes at desired speed: free-flow
    time.
standing, waiting
    Of vehicles below 0.1 m/s: their mean number, and seconds per vehicle.
delay and waiting of a junction
    Those on the approaches to it (from the junction before, over all segments between) and in it,
    per vehicle that enters it: from lane data, without trajectories, and with what is lost behind
    other vehicles on the approach.
control_delay
    The control delay of the Highway Capacity Manual (HCM, 7th edition), from trajectories:
    :mod:`odscen.figures.by_place.control_delay`.
delay and waiting of a movement
    Vehicles that use one lane share its delay alike, as in a lane group of the HCM: that of the
    last edge by lane, that of the edges before it all together.

A junction or movement that no vehicle entered, though one was stopped all the time, has no delay
per vehicle and level F. Places are defined in :mod:`odscen.figures.by_place.lane_places`, levels of
service in :mod:`odscen.figures.by_place.level_of_service`.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property, lru_cache
from typing import TYPE_CHECKING, Literal, get_args

from odscen.figures.by_place.analysis_times import WHOLE_RUN, AnalysisTimes, on_clock
from odscen.figures.by_place.facility_levels import (
    CONTROL,
    place_level,
    place_measure,
    segment_level,
    segment_measure,
    with_control,
    with_density,
)
from odscen.figures.by_place.group_figures import (
    GROUP_FIXED,
    GROUP_RATES,
    GROUP_SUMS,
    GROUP_WORST,
    group_rates,
    no_groups,
    with_groups,
)
from odscen.figures.by_place.lane_parts import lane_parts
from odscen.figures.by_place.traffic_sums import (
    INTERVAL,
    SPREAD,
    SUMS,
    junction_sums,
    movement_sums,
    network_sums,
    segment_sums,
    summable,
)

if TYPE_CHECKING:
    import polars as pl

    from odscen.figures.by_place.facilities import FacilityData
    from odscen.figures.by_place.lane_places import LanePlaces

TableName = Literal["network", "segments", "junctions", "movements", "lane_groups"]
TABLES: tuple[TableName, ...] = get_args(TableName)

_KEYS = ("segment", "movement", "lane_group", "junction", "control", "facility")
_QUEUES = ("queue_max", "queue_p95", "queue_p95_run")
_OF_RUN = {"queue_p95": "queue_p95_run", "queue_metres_p95": "queue_metres_p95_run"}
"""Columns that have another over all of what is analysed, and not the highest of the intervals."""


@dataclass(frozen=True, eq=False)
class TrafficFigures:
    """Five tables: one row for each place and interval of time, sorted by place and begin.

    A place that no vehicle came to is in no table; a place has a row for every interval, also
    without vehicles. Columns of all tables:

    - ``begin``, ``end``: s.

    Of all but lane groups:

    - ``vehicles``: that came into the place or started there; of the network: that were under way.
    - ``flow`` (veh/h), ``density`` (veh/km), ``speed`` (m/s; null without vehicles).
    - ``delay``, ``waiting``: s per vehicle; null if no vehicle passed.
    - ``standing``: mean number of stopped vehicles, the mean queue.
    - ``co2``, ``co``, ``hc``, ``nox``, ``pmx``, ``fuel``: g, at the place itself; null if not
      recorded.
    - ``length``: km, ``L`` of the definitions above.
    - ``seconds``, ``time_loss``, ``standing_seconds`` (vehicle-seconds), ``distance`` (m): what
      the others are made of.

    Of segments, junctions and movements, ``level`` and ``graded_by``: the figure that its bounds
    are of (null where HCM grades none).

    Attributes
    ----------
    network
        Also ``running`` (mean number under way), ``departed``, ``arrived``.
    segments
        Also ``segment``, ``travel_time`` and ``free_flow_time`` (s, along the whole segment; null
        without vehicles), ``facility``, ``lane_density`` (of highways: passenger cars per km and
        lane of the densest direction), ``level``; ``spread``: of ``seconds``, the share that is
        known of whole SUMO lanes only, which reach further, and is shared out by length.
    junctions
        Also ``junction``, ``control``, ``facility``, ``control_delay`` (s per vehicle; at a two-way
        stop of the minor movements), ``passages`` that it is the mean of, ``level``, ``queue_max``
        and ``queue_p95`` (vehicles that
        are stopped at one time on the approaches to it and in it; null without trajectories),
        ``throughput`` (the same as ``vehicles``).
    movements
        Also ``movement`` (``r1>j10>r2``), ``junction``, ``control``, ``facility``,
        ``control_delay``, ``passages``, ``level``; and ``lane_group`` with its ``demand``,
        ``capacity``, ``vc`` and queues.
    lane_groups
        ``lane_group``, ``junction``; ``demand`` and ``capacity`` (vehicles), ``vc``;
        ``queue_metres`` (mean), ``queue_metres_p95``, ``queue_metres_max`` (m, from the stop line
        to the back of the queue), ``overflow`` and ``spillback`` (shares of time); ``lanes``,
        ``storage`` (m), ``saturation_flow`` (veh/h and lane) and ``headways`` it was measured
        from. Without trajectories it has no rows.
    """

    network: pl.DataFrame
    segments: pl.DataFrame
    junctions: pl.DataFrame
    movements: pl.DataFrame
    lane_groups: pl.DataFrame = field(default_factory=no_groups)

    @cached_property
    def whole(self) -> dict[TableName, pl.DataFrame]:
        """Each table over all intervals, from :func:`over_run`."""
        return {name: over_run(getattr(self, name)) for name in TABLES}


def traffic_figures(
    lanes: pl.DataFrame,
    places: LanePlaces,
    *,
    end: float,
    queues: pl.DataFrame | None = None,
    facilities: FacilityData | None = None,
    times: AnalysisTimes = WHOLE_RUN,
    clock: pl.DataFrame | None = None,
    parts: pl.DataFrame | None = None,
) -> TrafficFigures:
    """Figures of one run.

    Parameters
    ----------
    lanes
        Per lane and interval, from :func:`odscen.runs.recorded.read_lanes`.
    end
        When the run ended, s.
    queues
        From :func:`odscen.figures.by_place.queues.queue_lengths`; if there are trajectories.
    facilities
        Kinds of facilities, control delay and density; without them levels of service are by
        the delay of the lane data, and no road is a highway.
    times
        What is analysed; queues and facilities are of the same intervals.
    clock
        Intervals that ``lanes`` have been summed up over; made of ``times`` if not given.
    parts
        From :func:`odscen.figures.by_place.lane_parts.lane_parts`; without them a lane that lies
        in several segments is shared out by length.

    Raises
    ------
    InputError
        If an interval of the lane data lies in two of those.
    """
    if clock is None:
        clock = times.clock(lanes, end=end)
        lanes = on_clock(lanes, clock)
    lanes = summable(lanes)
    if parts is None:
        parts = lane_parts(lanes, places, None)
    segments = segment_sums(parts, clock, places)
    junctions = _with_queues(junction_sums(lanes, clock, places), queues)
    movements = movement_sums(lanes, clock, places)
    found = facilities
    groups = None if found is None else found.groups
    of = None if found is None else found.group_of
    tables = {
        "network": network_sums(lanes, clock, places),
        "segments": with_density(segments, found),
        "junctions": with_control(junctions, found, "junction"),
        "movements": with_groups(with_control(movements, found, "movement"), groups, of),
        "lane_groups": no_groups() if groups is None else groups,
    }
    return TrafficFigures(
        **{name: _with_rates(times.analysed(table)) for name, table in tables.items()}
    )


def over_run(table: pl.DataFrame) -> pl.DataFrame:
    """One of the tables with one row for each place, over all intervals."""
    keys, whole = _sum_over_run(tuple(table.columns))
    if keys:
        return _with_rates(table.group_by(keys, maintain_order=True).agg(whole))
    return _with_rates(table.select(whole).with_columns(vehicles="departed"))


@lru_cache(maxsize=32)
def _sum_over_run(columns: tuple[str, ...]) -> tuple[list[str], list[pl.Expr]]:
    """Columns that name a place, and what the others come to over all intervals."""
    import polars as pl

    keys = [key for key in _KEYS if key in columns]
    summed = (*SUMS, SPREAD, "departed", "arrived", *CONTROL, "car_seconds", *GROUP_SUMS)
    sums = [name for name in summed if name in columns]
    added = [
        pl.when(pl.col(name).count() > 0).then(pl.col(name).sum()).alias(name) for name in sums
    ]
    greatest = ("length", *_QUEUES, *GROUP_WORST, *GROUP_FIXED, "lane_metres")
    highest = [
        pl.col(_OF_RUN[name] if _OF_RUN.get(name) in columns else name).max().alias(name)
        for name in greatest
        if name in columns
    ]
    return keys, [pl.col("begin").min(), pl.col("end").max(), *added, *highest]


def _with_rates(sums: pl.DataFrame) -> pl.DataFrame:
    """Everything that is a quotient of sums, and the columns in their order."""
    import polars as pl

    rates, more, order = _rate_columns(tuple(sums.columns))
    found = sums.with_columns(rates)
    found = found.with_columns(more) if more else found
    return pl.DataFrame([found[name] for name in order])


@lru_cache(maxsize=32)
def _rate_columns(columns: tuple[str, ...]) -> tuple[list[pl.Expr], list[pl.Expr], list[str]]:
    """Quotients, what follows from them, and all columns in their order.

    Making the expressions takes longer than computing them for the places of a small map.
    """
    import polars as pl

    col = pl.col
    rates: dict[str, pl.Expr] = {}
    more: dict[str, pl.Expr] = {}
    of_groups = dict(zip(GROUP_RATES, group_rates(), strict=True))
    if "saturation_flow" not in columns:
        seconds = col("end") - col("begin")
        per_vehicle = pl.when(col("vehicles") > 0)
        hours_km = seconds / 3600.0 * col("length")
        driving = pl.when(col("distance") > 0)
        rates = {
            "flow": col("distance") / 1000.0 / hours_km,
            "density": col("seconds") / 3600.0 / hours_km,
            "speed": pl.when(col("seconds") > 0).then(col("distance") / col("seconds")),
            "delay": per_vehicle.then(col("time_loss") / col("vehicles")),
            "waiting": per_vehicle.then(col("standing_seconds") / col("vehicles")),
            "standing": col("standing_seconds") / seconds,
        }
    if "saturation_flow" in columns:
        rates |= of_groups
    elif "junction" in columns:
        share = col("control_seconds") / col("passages")
        rates["control_delay"] = pl.when(col("passages") > 0).then(share)
        if "movement" in columns:
            rates |= of_groups
            more["level"] = place_level(capacity=True)
        else:
            more = {"level": place_level(), "throughput": col("vehicles")}
        more["graded_by"] = place_measure()
    elif "segment" in columns:
        metres = col("length") * 1000.0
        free_seconds = col("seconds") - col("time_loss")
        rates["travel_time"] = driving.then(metres * col("seconds") / col("distance"))
        rates["free_flow_time"] = driving.then(metres * free_seconds / col("distance"))
        hours = seconds / 3600.0
        rates["lane_density"] = col("car_seconds") / 3.6 / hours / col("lane_metres")
        rates["spread"] = pl.when(col("seconds") > 0).then(col(SPREAD) / col("seconds"))
        more["level"] = segment_level(free_seconds)
        more["graded_by"] = segment_measure()
    else:
        rates["running"] = col("seconds") / seconds
    first = (*(key for key in _KEYS if key in columns), *INTERVAL)
    order = dict.fromkeys((*first, *columns, *rates, *more))
    return (
        [value.alias(name) for name, value in rates.items()],
        [value.alias(name) for name, value in more.items()],
        list(order),
    )


def _with_queues(junctions: pl.DataFrame, queues: pl.DataFrame | None) -> pl.DataFrame:
    import polars as pl

    if queues is None:
        return junctions.with_columns(pl.lit(None, pl.Float64).alias(name) for name in _QUEUES)
    return junctions.join(
        queues, on=("junction", *INTERVAL), how="left", maintain_order="left"
    ).with_columns(pl.col(name).fill_null(0.0) for name in _QUEUES)
