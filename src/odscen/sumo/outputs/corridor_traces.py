"""Vehicles along a corridor, from the trajectories in a run folder."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from odscen.base.nearest_points import nearest
from odscen.figures.by_place.corridors import junctions_of
from odscen.reports.report_sections import NONE_RECORDED, CorridorTraces
from odscen.runs.recorded import trajectory_files

if TYPE_CHECKING:
    from pathlib import Path

    import polars as pl

    from odscen.base.arrays import FloatArray, Int32Array
    from odscen.figures.by_place.corridors import Corridor
    from odscen.sumo.realize.sumo_map import SumoMap

WINDOWS = (3600.0, 1800.0, 900.0, 600.0, 300.0)
"""Seconds that a diagram may show, the longest first."""

MOST = 900
"""Vehicles in a diagram; with more of them a shorter window is chosen."""

_GRAIN = 300.0
"""Seconds; a window begins at a whole multiple."""

_NEAR = 5.0
"""Metres from the nearest node beyond which a record on the same lane is not on the corridor."""

_AWAY = 10.0
"""Seconds; a vehicle that is away for longer, or comes back further behind, passes anew."""


def corridor_traces(run: Path, sumo_map: SumoMap, corridor: Corridor) -> CorridorTraces | str:
    """Follow the vehicles of the busiest time, at most an hour; or words why that cannot be."""
    import polars as pl

    files = trajectory_files(run)
    if not files:
        return NONE_RECORDED
    places = sumo_map.lane_places
    known = places.lane[corridor.nodes] >= 0
    nodes, along = corridor.nodes[known], corridor.along[known]
    row_of = {places.lanes[row]: row for row in np.unique(places.lane[nodes]).tolist()}
    table = pl.scan_parquet(files)
    if "vehicle_lane" not in table.collect_schema().names():
        return "The trajectories do not say on which lanes vehicles were, so there is no diagram."
    on_corridor = table.filter(pl.col("vehicle_lane").is_in(list(row_of)))
    window = _busiest_stretch(on_corridor)
    if window is None:
        return "No vehicle drove along this corridor."
    begin, end = window
    rows = (
        on_corridor.filter(pl.col("timestep_time").is_between(begin, end))
        .select(
            pl.col("timestep_time").alias("time"),
            pl.col("vehicle_id").alias("id"),
            pl.col("vehicle_x", "vehicle_y", "vehicle_speed").cast(pl.Float64),
            pl.col("vehicle_lane").replace_strict(row_of, return_dtype=pl.Int64).alias("lane"),
        )
        .sort("id", "time")
        .collect(engine="streaming")
    )
    rows = _place_records(rows, sumo_map, nodes, along)
    back = (pl.col("along").diff() < -_NEAR) | (pl.col("time").diff() > _AWAY)
    new = back | (pl.col("id") != pl.col("id").shift())
    rows = rows.with_columns(new.fill_null(value=False).cum_sum().alias("piece"))
    return CorridorTraces(
        segments=corridor.segments,
        junctions=junctions_of(corridor, _segment_kinds(sumo_map, corridor)),
        length=corridor.length,
        begin=begin,
        end=end,
        time=rows["time"].to_numpy(),
        along=np.clip(rows["along"].to_numpy(), 0.0, corridor.length),
        speed=rows["vehicle_speed"].to_numpy(),
        piece=rows["piece"].cast(pl.Int64).to_numpy(),
        vehicles=rows["id"].n_unique(),
    )


def _segment_kinds(sumo_map: SumoMap, corridor: Corridor) -> list[str]:
    segments = sumo_map.graph.segments
    kind_of = dict(zip(map(str, segments.ids), segments.kinds, strict=True))
    return [kind_of[name] for name in corridor.segments]


def _busiest_stretch(on_corridor: pl.LazyFrame) -> tuple[float, float] | None:
    """Begin and end of the busiest stretch that is not too full to be drawn."""
    import polars as pl

    seen = (
        on_corridor.select(
            (pl.col("timestep_time") / _GRAIN).floor().cast(pl.Int64).alias("grain"),
            pl.col("vehicle_id").alias("id"),
        )
        .group_by("grain", "id")
        .agg(pl.len().alias("records"))
        .collect(engine="streaming")
    )
    if seen.is_empty():
        return None
    counts = seen.group_by("grain").agg(pl.col("records").sum())
    last = int(seen["grain"].max() or 0)  # type: ignore[arg-type]
    records = np.zeros(last + 1)
    records[counts["grain"].to_numpy()] = counts["records"].to_numpy()
    begin, size = 0, 1
    for window in WINDOWS:
        size = int(window / _GRAIN)
        sums = np.convolve(records, np.ones(size))[size - 1 :] if size <= len(records) else records
        begin = int(sums.argmax()) if size <= len(records) else 0
        inside = seen.filter(pl.col("grain").is_between(begin, begin + size - 1))
        if inside["id"].n_unique() <= MOST:
            break
    last_time = float(on_corridor.select(pl.col("timestep_time").max()).collect().item())
    return begin * _GRAIN, min((begin + size) * _GRAIN, max(last_time, begin * _GRAIN + 1.0))


def _place_records(
    rows: pl.DataFrame, sumo_map: SumoMap, nodes: Int32Array, along: FloatArray
) -> pl.DataFrame:
    """Add ``along``; records on the same lanes beside the corridor are left out."""
    import polars as pl

    lanes, places = sumo_map.graph.lanes, sumo_map.lane_places
    xy = np.column_stack([lanes.x, lanes.y])[nodes] + np.array(sumo_map.net_offset)
    at, lane = rows.select("vehicle_x", "vehicle_y").to_numpy(), rows["lane"].to_numpy()
    away, near = np.empty(len(at)), np.empty(len(at), dtype=np.int64)
    for number in np.unique(lane).tolist():
        here, own = np.flatnonzero(lane == number), np.flatnonzero(places.lane[nodes] == number)
        away[here], found = nearest(at[here], xy[own])
        near[here] = own[found]
    ahead = at - xy[near]
    hdg = lanes.hdg[nodes][near]
    metres = along[near] + ahead[:, 0] * np.cos(hdg) + ahead[:, 1] * np.sin(hdg)
    return rows.with_columns(pl.Series("along", metres)).filter(pl.Series(away < _NEAR))
