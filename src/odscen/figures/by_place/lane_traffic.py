"""What was driven, spent and lost on each lane in each interval, as columns for a map in colours.

Speed, density, flow and delay per km are quotients of these sums, of one interval or of several:
Edie's definitions of :mod:`odscen.figures.by_place.traffic`, with the lane as the place, or each of
its parts where it lies in several segments.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from odscen.figures.by_place.analysis_times import WHOLE_RUN, begins_at
from odscen.figures.by_place.lane_parts import lane_parts
from odscen.figures.by_place.traffic_sums import summable

if TYPE_CHECKING:
    import polars as pl

    from odscen.figures.by_place.lane_places import LanePlaces

MOST_SUMS = 30_000
"""Rows at most: with more, intervals are summed up by twos, fours and so on, down to one."""


class LaneTraffic(NamedTuple):
    """Sums of the lanes, and parts of lanes, that vehicles were on.

    Attributes
    ----------
    times
        Seconds at which intervals begin, and the end of the last.
    names
        SUMO lanes, each with the segment that it, or the part of it, lies in.
    lengths
        Of each of them, metres.
    sums
        A row for each lane and interval with traffic, by interval: ``interval`` and ``lane`` (rows
        of ``times`` and ``names``), ``distance`` (m), ``seconds`` and ``time_loss``
        (vehicle-seconds).
    """

    times: list[float]
    names: list[tuple[str, str]]
    lengths: list[float]
    sums: pl.DataFrame


def lane_traffic(
    lanes: pl.DataFrame,
    places: LanePlaces,
    *,
    end: float,
    most: int = MOST_SUMS,
    measured: pl.DataFrame | None = None,
) -> LaneTraffic:
    """Sum up what was measured on lanes over the intervals of a run.

    Parameters
    ----------
    lanes
        From :func:`odscen.runs.recorded.read_lanes`.
    end
        When the run ended, s.
    most
        Rows from which on longer intervals are used.
    measured
        From :func:`odscen.figures.by_place.lane_parts.part_sums`, if there are positions.
    """
    import polars as pl

    keys = ("lane", "segment")
    clock = WHOLE_RUN.clock(lanes, end=end)
    used = (
        lane_parts(summable(lanes), places, measured)
        .filter(pl.col("seconds") > 0)
        .group_by("begin", *keys)
        .agg(pl.col("distance", "seconds", "time_loss").sum())
    )
    known = (
        places.lanes.group_by(keys)
        .agg(length=(pl.col("length") * pl.col("share")).sum())
        .sort(keys)
    )
    found = used
    while found.height > most and clock.height > 1:
        clock = _pair_intervals(clock)
        found = (
            used.with_columns(begins_at(used["begin"], clock))
            .group_by("begin", *keys)
            .agg(pl.col("distance", "seconds", "time_loss").sum())
        )
    named = known.join(found, on=keys, how="semi", maintain_order="left").with_row_index("row")
    sums = (
        found.join(clock.select("begin").with_row_index("interval"), on="begin")
        .join(named.select(*keys, "row"), on=keys)
        .sort("interval", "row")
        .select("interval", pl.col("row").alias("lane"), "distance", "seconds", "time_loss")
    )
    times = [*clock["begin"].to_list(), float(clock["end"][-1])]
    return LaneTraffic(times, named.select(keys).rows(), named["length"].to_list(), sums)


def _pair_intervals(clock: pl.DataFrame) -> pl.DataFrame:
    import polars as pl

    pairs = clock.with_row_index("pair").with_columns(pl.col("pair") // 2)
    return (
        pairs.group_by("pair", maintain_order=True)
        .agg(pl.col("begin").min(), pl.col("end").max())
        .drop("pair")
    )
