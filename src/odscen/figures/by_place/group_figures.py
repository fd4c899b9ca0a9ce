"""Lane groups as a table by interval: demand, capacity, v/c, and queues in metres."""

from __future__ import annotations

from typing import TYPE_CHECKING

from odscen.figures.by_place.capacity import (
    capacity_sums,
    demand_sums,
    saturation_flows,
    shown_greens,
)
from odscen.figures.by_place.lane_groups import LaneGroups, lane_groups
from odscen.figures.by_place.level_of_service import FEWEST
from odscen.figures.by_place.outside_queue import outside_sums, with_outside
from odscen.figures.by_place.queue_metres import SUMS, WORST, queue_backs, queue_sums, record_step
from odscen.figures.by_place.unsignalised import unsignalised_sums

if TYPE_CHECKING:
    from collections.abc import Sequence

    import polars as pl

    from odscen.figures.by_place.facilities import NetFacts
    from odscen.figures.by_place.lane_places import LanePlaces
    from odscen.records.light_programs import LightProgram

GROUP_SUMS = ("demand", "capacity", "outside_seconds", *SUMS)
"""Columns that sum up over time."""
GROUP_WORST = WORST
"""Columns of which the highest of all intervals counts."""
GROUP_FIXED = ("lanes", "storage", "saturation_flow", "headways")
"""Columns that are the same in all intervals."""
GROUP_RATES = ("vc", "outside", "queue_metres", "overflow", "spillback")
"""Columns that are quotients of the sums."""
LEAST_PERIOD = 300.0
"""Seconds from which an interval has v/c: in less there may be one green, or none."""

_WHOLE = ("lanes", "headways", "demand")
_TEXT = ("lane_group", "junction")


def no_groups() -> pl.DataFrame:
    """The table of lane groups without rows."""
    import polars as pl

    names = (*_TEXT, "begin", "end", *GROUP_SUMS, *WORST, *GROUP_FIXED)
    kinds = {**dict.fromkeys(_WHOLE, pl.Int64), **dict.fromkeys(_TEXT, pl.String)}
    return pl.DataFrame(schema={name: kinds.get(name, pl.Float64) for name in names})


def group_sums(
    trajectories: pl.LazyFrame,
    passed: pl.DataFrame,
    places: LanePlaces,
    facts: NetFacts,
    clock: pl.DataFrame,
    *,
    programs: Sequence[LightProgram] = (),
    states: pl.DataFrame | None = None,
    waits: pl.DataFrame | None = None,
    since: float = 0.0,
) -> tuple[pl.DataFrame, pl.DataFrame]:
    """Sums of lane groups by interval, and the lane group of each movement.

    Parameters
    ----------
    trajectories
        As recorded, see docs/runs.md.
    passed
        From :func:`odscen.figures.by_place.control_delay.vehicle_passages`.
    clock
        ``begin`` and ``end`` of each interval, s.
    programs, states
        Of the traffic lights, and what they showed; without them there is no capacity at lights.
    waits
        Who waited outside, from :func:`odscen.figures.by_place.outside_queue.outside_waits`;
        ``None`` if that is not known.
    since
        Seconds from which the run is analysed.

    Returns
    -------
    The first as :func:`no_groups`, sorted by lane group and begin, groups without demand and queue
    left out; the second has ``movement`` and ``lane_group``.
    """
    import polars as pl

    groups = lane_groups(places, facts)
    wanted = passed if waits is None else with_outside(passed, waits)
    demand = demand_sums(wanted, groups, clock)
    step = record_step(trajectories)
    backs = queue_backs(trajectories, groups, facts, period=step)
    parts = [demand]
    if backs is not None:
        parts.append(queue_sums(backs, groups, clock, step=step, since=since))
    capacity = unsignalised_sums(passed, groups, places, facts, clock)
    if states is not None:
        greens = shown_greens(programs, states, clock, facts)
        capacity = pl.concat(
            [_capacity_of_groups(passed, groups, facts, greens), capacity], how="diagonal_relaxed"
        )
    parts.append(capacity)
    if waits is not None:
        parts.append(outside_sums(waits, groups.ways, clock))
    seen = pl.concat([part.select("lane_group") for part in parts[:2]]).unique()
    table = groups.groups.join(seen, on="lane_group", how="semi").join(clock, how="cross")
    for part in parts:
        table = table.join(part, on=("lane_group", "begin"), how="left")
    table = pl.concat([no_groups(), table.drop("room")], how="diagonal_relaxed")
    zero = [
        "demand",
        *(() if waits is None else ("outside_seconds",)),
        *((*SUMS, *WORST) if backs is not None else ()),
    ]
    flow = pl.col("saturation_flow", "headways").max().over("lane_group")
    table = table.with_columns(pl.col(zero).fill_null(0), flow)
    return (
        table.sort("lane_group", "begin").select(no_groups().columns),
        groups.of,
    )


def _capacity_of_groups(
    passed: pl.DataFrame, groups: LaneGroups, facts: NetFacts, greens: pl.DataFrame
) -> pl.DataFrame:
    lit = groups.ways.join(greens, on="via", how="semi")
    flows = saturation_flows(passed.join(lit, left_on="lane", right_on="via", how="semi"), groups)
    flows = flows.join(lit, on="lane_group", how="semi")
    return capacity_sums(greens, flows, passed, groups, facts).join(flows, on="lane_group")


def group_rates() -> list[pl.Expr]:
    """What is a quotient of the sums, as in :data:`GROUP_RATES`."""
    import polars as pl

    col = pl.col
    seconds = col("end") - col("begin")
    enough = (col("capacity") > 0.0) & (seconds >= LEAST_PERIOD)
    return [
        pl.when(enough).then(col("demand") / col("capacity")).alias("vc"),
        (col("outside_seconds") / seconds).alias("outside"),
        (col("queue_metre_seconds") / seconds).alias("queue_metres"),
        (col("overflow_seconds") / seconds).alias("overflow"),
        (col("spillback_seconds") / seconds).alias("spillback"),
    ]


def over_capacity() -> pl.Expr:
    """Whether demand exceeds capacity: level F, whatever the delay.

    HCM Exhibits 19-8, 20-2, 21-8 and 22-8.
    """
    import polars as pl

    return ((pl.col("vc") > 1.0) & (pl.col("demand") >= FEWEST)).fill_null(value=False)


def with_groups(
    movements: pl.DataFrame, table: pl.DataFrame | None, of: pl.DataFrame | None
) -> pl.DataFrame:
    """Add the columns of its lane group to each movement; null if not known."""
    import polars as pl

    sums = (*GROUP_SUMS, *WORST)
    if table is None or of is None:
        empty = no_groups().schema
        return movements.with_columns(
            pl.lit(None, empty[name]).alias(name) for name in ("lane_group", *sums)
        )
    return movements.join(of, on="movement", how="left", maintain_order="left").join(
        table.select("lane_group", "begin", *sums),
        on=("lane_group", "begin"),
        how="left",
        maintain_order="left",
    )
