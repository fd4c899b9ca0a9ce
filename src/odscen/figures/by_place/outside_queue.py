"""Vehicles that waited outside of the network for room to depart: demand that lanes do not show.

A lane that is full lets nobody in, so that who was counted at the stop line is the fewer the worse
it is. Whoever waited outside is taken to stand at the end of the queue before the first junction of
its route: it wanted to come there as much earlier as it waited, and the wait is control delay of
that junction, as the delay of a vertical queue is in HCM chapter 19 and in FHWA-HOP-18-036.
"""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import polars as pl

    from odscen.figures.by_place.facilities import NetFacts
    from odscen.figures.by_place.lane_places import LanePlaces

LEAST = 1.0
"""Seconds from which a departure was late: SUMO inserts in whole steps, a second long at most."""


def outside_waits(
    drivers: pl.DataFrame,
    departed: pl.DataFrame,
    places: LanePlaces,
    facts: NetFacts,
    *,
    end: float,
) -> pl.DataFrame:
    """Who waited outside, and by which movement it goes through its first junction.

    Parameters
    ----------
    drivers
        ``id``, ``depart`` (planned, s) and ``edges`` of the route, as of
        :class:`~odscen.figures.by_place.facilities.NetFacts`.
    departed
        ``id`` and ``depart`` (s) of those who came onto the road.
    end
        When the run ended, s.

    Returns
    -------
    ``id``, ``planned`` (s), ``until`` (s: when it came in, or the end), ``inside`` (whether it
    did), and ``junction``, ``movement``, ``approach`` and ``lane`` (the first inside); sorted by
    ``planned``. Those whose route crosses no junction are left out.
    """
    import polars as pl

    col = pl.col
    late = (
        drivers.filter(~col("serves") & col("depart").is_not_null() & (col("depart") < end))
        .join(departed.select("id", came="depart"), on="id", how="left")
        .select(
            "id",
            "edges",
            planned="depart",
            until=col("came").fill_null(end).clip(None, end),
            inside=col("came").is_not_null(),
        )
        .filter(col("until") - col("planned") > LEAST)
        .sort("planned", "id")
    )
    ways = facts.once("ways_by_edges", places, lambda: _ways_by_edges(places, facts))
    rows = []
    for row in late.rows(named=True):
        edges = (row["edges"] or "").split()
        way = next(filter(None, map(ways.get, pairwise(edges))), None)
        if way is not None:
            rows.append((row["id"], row["planned"], row["until"], row["inside"], *way))
    text, number = pl.String, pl.Float64
    return pl.DataFrame(
        rows,
        schema={
            "id": text, "planned": number, "until": number, "inside": pl.Boolean,
            "junction": text, "movement": text, "approach": text, "lane": text,
        },
        orient="row",
    )  # fmt: skip


def _ways_by_edges(
    places: LanePlaces, facts: NetFacts
) -> dict[tuple[str, str], tuple[str, str, str, str]]:
    """Junction, movement, approach and first lane inside, by the edges before and behind it."""
    import polars as pl

    after = dict(facts.follows.rows())
    edge_of = dict(facts.limits.select("lane", "edge").rows())
    inside = set(facts.links["via"])
    found: dict[tuple[str, str], tuple[str, str, str, str]] = {}
    first = places.ways.filter(pl.col("lane") == pl.col("via")).sort("via")
    for junction, movement, approach, via in first.select(
        "junction", "movement", "approach", "via"
    ).rows():
        lane = after.get(via, "")
        while lane in inside:
            lane = after.get(lane, "")
        found.setdefault((approach, edge_of.get(lane, "")), (junction, movement, approach, via))
    return found


def with_outside(passed: pl.DataFrame, waits: pl.DataFrame) -> pl.DataFrame:
    """Passages of junctions with what was waited outside before the first of each vehicle.

    Parameters
    ----------
    passed
        From :func:`odscen.figures.by_place.control_delay.passages`.
    waits
        From :func:`outside_waits`.

    Returns
    -------
    As ``passed``; those who never came in have a row at the end of the run.
    """
    import polars as pl

    col = pl.col
    if waits.is_empty():
        return passed
    rows = passed.sort("time", "id")
    first = rows.with_row_index("row").group_by("id").agg(col("row").min())
    waited = waits.filter("inside").select("id", waited=col("until") - col("planned"))
    added = first.join(waited, on="id").select("row", "waited")
    rows = (
        rows.with_row_index("row")
        .join(added, on="row", how="left", maintain_order="left")
        .with_columns(col("before", "control_delay") + col("waited").fill_null(0.0))
        .select(passed.columns)
    )
    never = waits.filter(~col("inside")).select(
        "id", "junction", "movement", "approach", "lane",
        time="until",
        before=col("until") - col("planned"),
        control_delay=col("until") - col("planned"),
    )  # fmt: skip
    return pl.concat([rows, never.select(passed.columns)]).sort("time", "id")


def outside_sums(waits: pl.DataFrame, ways: pl.DataFrame, clock: pl.DataFrame) -> pl.DataFrame:
    """Seconds that vehicles waited outside: ``lane_group``, ``begin``, ``outside_seconds``.

    Parameters
    ----------
    waits
        From :func:`outside_waits`.
    ways
        ``via`` and its ``lane_group``.
    clock
        ``begin`` and ``end`` of each interval, s.
    """
    import polars as pl

    col = pl.col
    seconds = pl.min_horizontal("until", "end") - pl.max_horizontal("planned", "begin")
    return (
        waits.join(ways.select("lane_group", lane="via"), on="lane")
        # Not all waits with all intervals: a day has a thousand of them.
        .join_where(clock, col("begin") < col("until"), col("end") > col("planned"))
        .sort("planned", "id", "begin")
        .with_columns(outside_seconds=seconds)
        .group_by("lane_group", "begin")
        .agg(col("outside_seconds").sum())
        .sort("lane_group", "begin")
    )
