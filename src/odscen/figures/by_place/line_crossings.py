"""When vehicles cross lines, from trajectories.

For a line at ``p`` on a lane, ``x`` is how far the front of a vehicle is behind it, on that lane
and on those that lead to it and on from it. It crosses between the two records where ``x`` changes
its sign, at the time that is linear between them; its rear does where ``x`` comes to the length of
the vehicle.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from odscen.figures.by_place.lane_positions import NEEDED, positions
from odscen.figures.by_place.queue_metres import record_step

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    import polars as pl

    from odscen.figures.by_place.facilities import NetFacts

REACH = 60.0
"""Metres before and behind a line in which vehicles are followed: more than a step and a length."""


def line_crossings(
    trajectories: pl.LazyFrame, lines: Mapping[str, Sequence[tuple[str, float]]], facts: NetFacts
) -> pl.DataFrame | None:
    """Each crossing of each line.

    Parameters
    ----------
    lines
        Lanes and metres along them, by name.

    Returns
    -------
    ``line``, ``id``, ``time`` (s), ``covered`` (s, from front to rear) and ``speed`` (m/s, its
    length over that time, as loops measure it), sorted by line and time; ``None`` if lane, place or
    speed were not recorded.
    """
    import polars as pl

    if not set(NEEDED) <= set(trajectories.collect_schema()):
        return None
    col = pl.col
    reach = _reach(lines, facts)
    rows = (
        trajectories.select(
            id=col("vehicle_id").cast(str),
            time=col("timestep_time").cast(pl.Float64),
            lane=col("vehicle_lane").cast(str),
            x=col("vehicle_x").cast(pl.Float64),
            y=col("vehicle_y").cast(pl.Float64),
            speed=col("vehicle_speed").cast(pl.Float64),
        )
        .join(reach.select("lane").unique().lazy(), on="lane", how="semi")
        .collect(engine="streaming")
    )
    seen = (
        rows.with_columns(positions(rows, facts))
        .join(reach, on="lane")
        .join(facts.drivers.select("id", body="length"), on="id", how="left")
        .with_columns(behind=col("pos") + col("offset"), body=col("body").fill_null(5.0))
    )
    period = record_step(trajectories)
    fronts = _passed(seen, period)
    rears = _passed(seen.with_columns(behind=col("behind") - col("body")), period)
    return (
        fronts.sort("time")
        .join_asof(
            rears.select("line", "place", "id", "time", rear="time").sort("time"),
            on="time", by=("line", "place", "id"), strategy="forward",
        )
        .join(seen.group_by("line", "place", "id").agg(last=col("time").max()),
              on=("line", "place", "id"))
        # Who stands on it at the end, or arrives there, covers it as long as it is seen.
        .with_columns(covered=(pl.coalesce("rear", "last") - col("time")).clip(0.0))
        .with_columns(
            speed=pl.when(col("rear").is_null()).then("speed")
            .otherwise(col("body") / col("covered"))
        )
        .unique(["line", "id", "time"], keep="first", maintain_order=True)
        .select("line", "id", "time", "speed", "covered")
        .sort("line", "time", "id")
    )  # fmt: skip


def _passed(seen: pl.DataFrame, period: float) -> pl.DataFrame:
    import polars as pl

    col = pl.col
    key = ("line", "place", "id")
    share = -col("from") / (col("behind") - col("from"))
    return (
        seen.sort(*key, "time")
        .with_columns(
            **{"from": col("behind").shift(1).over(*key)},
            then=col("time").shift(1).over(*key),
            slower=col("speed").shift(1).over(*key),
        )
        .filter(
            (col("from") < 0.0)
            & (col("behind") >= 0.0)
            & (col("time") - col("then") < 1.5 * period)
        )
        .select(
            *key,
            "body",
            time=col("then") + share * (col("time") - col("then")),
            speed=col("slower") + share * (col("speed") - col("slower")),
        )
    )


def _reach(lines: Mapping[str, Sequence[tuple[str, float]]], facts: NetFacts) -> pl.DataFrame:
    """Lanes around each place of each line, and what is added to positions there."""
    import polars as pl

    length = dict(facts.limits.select("lane", "length").rows())
    after: dict[str, list[str]] = {}
    before: dict[str, list[str]] = {}
    for lane, following in facts.follows.rows():
        after.setdefault(lane, []).append(following)
        before.setdefault(following, []).append(lane)
    found = []
    for line, places in lines.items():
        for number, (lane, pos) in enumerate(places):
            offsets = {lane: -pos}
            ahead = [(one, length[lane] - pos) for one in after.get(lane, ())]
            while ahead:
                one, start = ahead.pop()
                if one in length and one not in offsets and start < REACH:
                    offsets[one] = start
                    ahead += [(other, start + length[one]) for other in after.get(one, ())]
            behind = [(one, -pos) for one in before.get(lane, ())]
            while behind:
                one, end = behind.pop()
                if one in length and one not in offsets and end > -REACH:
                    offsets[one] = end - length[one]
                    behind += [(other, offsets[one]) for other in before.get(one, ())]
            found += [(line, number, one, metres) for one, metres in sorted(offsets.items())]
    names = {"line": pl.String, "place": pl.Int64, "lane": pl.String, "offset": pl.Float64}
    return pl.DataFrame(found, schema=names, orient="row")
