"""What road users of a recording do beside following: in curves, lanes, gaps, and on foot.

Measured are distributions; of which parameters of odscen's drivers have them is said where it is
known. Each has how many road users it is of.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

import numpy as np
import polars as pl

from odscen.base.categories import Category
from odscen.convert.model.curve_speed import BINDING, HEAVY, TURNING, comfortable_speed
from odscen.formats.tracks.critical_gaps import (
    FEWEST,
    GapChoice,
    estimate_critical_gap,
    find_gap_choices,
    judge_gaps,
)
from odscen.formats.tracks.lane_places import LaneFinder
from odscen.formats.tracks.scenes import crossings_of_tracks, find_scenes, known_sizes

if TYPE_CHECKING:
    from collections.abc import Collection, Sequence

    from odscen.base.arrays import FloatArray
    from odscen.lanegraph.graphs import MapGraph

_FREE: Final = 3.0
"""Seconds to the body ahead from which on a curve is driven freely."""
_SETTLED: Final = 0.7
"""m/s² of acceleration below which a curve is driven steadily."""
_WALKS: Final = 0.3
"""m/s from which on a pedestrian walks."""
_LONGEST: Final = 30.0
_SAME_PLACE: Final = 2.0
"""Metres between places where tracks cross that are those of one lane."""
_HEAVY: Final = frozenset({str(Category.TRUCK), str(Category.BUS)})


def measure_habits(
    placed: pl.DataFrame, graph: MapGraph, *, lit: Collection[str] = ()
) -> dict[str, Any]:
    """Curves, gaps, lane changes and pedestrians of a recording.

    Parameters
    ----------
    placed
        Tracks on the map, of :func:`~odscen.formats.tracks.lane_places.fit_on_map`.
    graph
        The map.
    lit
        Junctions with lights, whose gaps are left out.

    Returns
    -------
    dict
        ``curves`` (by category: ``factor``, the speed over that at which odscen's median driver
        takes the curve, and ``lateral_acceleration``, m/s²), ``gaps`` (critical gaps of movements
        that give way, s), ``lane_changes`` (by category: on a kilometre, share to the left, gaps
        in seconds to those ahead and behind in the new lane) and ``pedestrians`` (walking speeds,
        m/s, and critical gaps, s).
    """
    sized = placed.with_columns(known_sizes())
    return {
        "curves": _measure_curves(sized, graph),
        "gaps": _measure_gaps(find_gap_choices(placed, graph, lit=lit)),
        "lane_changes": _measure_lane_changes(sized, graph),
        "pedestrians": _measure_pedestrians(sized),
    }


def _describe_values(values: Sequence[float] | FloatArray) -> dict[str, float]:
    sample = np.asarray(values, dtype=np.float64)
    shares = np.quantile(sample, (0.05, 0.5, 0.85, 0.95)).tolist()
    found = {"mean": float(sample.mean()), "std": float(sample.std())}
    found |= dict(zip(("p5", "p50", "p85", "p95"), shares, strict=True))
    return {"road_users": len(sample), **{name: round(value, 4) for name, value in found.items()}}


def _measure_curves(sized: pl.DataFrame, graph: MapGraph) -> dict[str, Any]:
    """Each driver once: the median over the curves that are driven freely and steadily."""
    from odscen.formats.tracks.realism import measure_between

    lanes = graph.lanes
    vehicles = sized.filter(pl.col("category") != str(Category.PEDESTRIAN))
    if not vehicles.height:
        return {}
    moment = (pl.col("time") * 1000.0).round().cast(pl.Int64)
    states = measure_between(vehicles.with_columns(moment=moment).sort("moment", "id"))
    places = LaneFinder(graph).locate(*(states[name].to_numpy() for name in ("x", "y", "hdg")))
    node = places.node
    in_junction = np.array([junction is not None for junction in lanes.lanes.junctions])
    heavy = states["category"].cast(pl.String).is_in(sorted(_HEAVY)).to_numpy()
    share = np.where(in_junction[places.lane], TURNING, 1.0) * np.where(heavy, HEAVY, 1.0)
    bend = np.abs(lanes.curvature[node])
    usual = comfortable_speed(bend / share)
    limit = np.nan_to_num(lanes.speed_limit[node], nan=np.inf)
    speed = states["speed"].to_numpy()
    bent = places.is_on_lane & (usual < BINDING * limit) & (speed > 0.5 * usual)
    steady = np.abs(states["acceleration"].to_numpy()) < _SETTLED
    free = states["headway"].fill_null(_LONGEST).to_numpy() >= _FREE
    driven = states.with_columns(
        factor=speed / np.where(bent, usual, 1.0), lateral=speed**2 * bend
    ).filter(pl.Series(bent & steady & free))
    each = driven.group_by("category", "id").agg(
        pl.col("factor").median(), pl.col("lateral").quantile(0.9)
    )
    return {
        str(category): {
            "factor": _describe_values(own["factor"].to_numpy()),
            "lateral_acceleration": _describe_values(own["lateral"].to_numpy()),
        }
        for (category,), own in sorted(each.group_by("category"), key=lambda item: str(item[0]))
    }


def _measure_gaps(choices: Sequence[GapChoice]) -> list[dict[str, Any]]:
    movements: dict[tuple[str, str], list[GapChoice]] = {}
    for choice in choices:
        movements.setdefault((choice.lane, choice.turn), []).append(choice)
    return [
        {
            "lane": lane,
            "turn": turn,
            "waited": len(own),
            "critical_gap": estimate_critical_gap(own),
            "accepted": _describe_values([choice.accepted for choice in own]),
        }
        for (lane, turn), own in sorted(movements.items())
        if len(own) >= FEWEST
    ]


def _measure_lane_changes(sized: pl.DataFrame, graph: MapGraph) -> dict[str, Any]:
    vehicles = sized.filter(pl.col("category") != str(Category.PEDESTRIAN)).sort("id", "time")
    dx, dy = (pl.col(name).diff().over("id") for name in ("x", "y"))
    driven = dict(
        vehicles.with_columns(way=(dx**2 + dy**2).sqrt())
        .group_by(pl.col("category").cast(pl.String))
        .agg(pl.col("way").sum() / 1000.0)
        .iter_rows()
    )
    category = dict(vehicles.select("id", pl.col("category").cast(pl.String)).unique().iter_rows())
    changes = find_scenes(sized, graph).filter(pl.col("kind") == "lane_change")
    found: dict[str, dict[str, list[float]]] = {}
    by_time = vehicles.sort("time")
    times = by_time["time"].to_numpy()
    for row in changes.iter_rows(named=True):
        own = found.setdefault(category[row["id"]], {"side": [], "lead": [], "lag": []})
        own["side"].append(row["value"])
        first, past = np.searchsorted(times, (row["end"] - 1e-6, row["end"] + 1e-6)).tolist()
        for name, gap in _gaps_beside(by_time.slice(first, past - first), row["id"]).items():
            own[name].append(gap)
    return {
        kind: {
            "changes": len(own["side"]),
            "per_km": round(len(own["side"]) / driven[kind], 4) if driven[kind] else None,
            "to_the_left": round(float(np.mean(np.array(own["side"]) > 0.0)), 4),
            **{name: _describe_values(own[name]) for name in ("lead", "lag") if own[name]},
        }
        for kind, own in sorted(found.items())
    }


def _gaps_beside(frame: pl.DataFrame, user: str) -> dict[str, float]:
    """Seconds to the next ones ahead (``lead``) and behind (``lag``) in the lane of a vehicle."""
    own = frame.row(frame["id"].to_list().index(user), named=True)
    others = frame.filter((pl.col("id") != user) & (pl.col("lane") == own["lane"]))
    found: dict[str, float] = {}
    for other in others.iter_rows(named=True):
        c, s = np.cos(other["hdg"]), np.sin(other["hdg"])
        ahead = (other["x"] - own["x"]) * c + (other["y"] - own["y"]) * s
        gap = max(abs(ahead) - (other["length"] + own["length"]) / 2.0, 0.0)
        name, speed = ("lead", own["speed"]) if ahead > 0.0 else ("lag", other["speed"])
        if speed > _WALKS:
            found[name] = min(found.get(name, _LONGEST), gap / speed)
    return found


def _measure_pedestrians(sized: pl.DataFrame) -> dict[str, Any]:
    walkers = sized.filter(pl.col("category") == str(Category.PEDESTRIAN)).sort("id", "time")
    if not walkers.height:
        return {}
    walking = walkers.filter(pl.col("speed") >= _WALKS)
    speeds = walking.group_by("id").agg(pl.col("speed").median())["speed"].to_numpy()
    choices = _choices_of_pedestrians(walkers, sized)
    return {
        "walking_speed": _describe_values(speeds) if len(speeds) else None,
        "crossed": len(choices),
        "waited": len([choice for choice in choices if choice.rejected > 0.0]),
        "accepted": _describe_values([choice.accepted for choice in choices]) if choices else None,
        "critical_gap": estimate_critical_gap(choices),
    }


def _choices_of_pedestrians(walkers: pl.DataFrame, sized: pl.DataFrame) -> list[GapChoice]:
    """Gaps between vehicles at the first place where each pedestrian crosses their tracks."""
    vehicles = sized.filter(pl.col("category") != str(Category.PEDESTRIAN)).sort("id", "time")
    crossings: dict[str, list[Any]] = {}
    for walker, _, crossing in crossings_of_tracks(walkers, vehicles, within=_LONGEST):
        crossings.setdefault(walker, []).append(crossing)
    found = []
    for (user,), own in walkers.group_by("id", maintain_order=True):
        met = crossings.get(str(user), [])
        if not met:
            continue
        first = min(met, key=lambda crossing: (crossing.a_time, crossing.b_time))
        near = [
            crossing
            for crossing in met
            if np.hypot(crossing.x - first.x, crossing.y - first.y) < _SAME_PLACE
        ]
        time, speed = own["time"].to_numpy(), own["speed"].to_numpy()
        until = int(np.searchsorted(time, first.a_time))
        rests = np.flatnonzero(speed[:until] < _WALKS)
        enters = float(time[rests[-1]]) if len(rests) else float(time[0])
        moves = np.flatnonzero(speed[: rests[-1]] >= _WALKS) if len(rests) else rests
        waits = float(time[moves[-1] + 1]) if len(moves) else float(time[0])
        if not len(rests):
            waits = enters
        times = [crossing.b_time - (crossing.a_time - enters) for crossing in near]
        accepted, rejected = judge_gaps(times, waits=waits, enters=enters)
        if accepted is not None:
            kind = str(Category.PEDESTRIAN)
            found.append(GapChoice(str(user), kind, "", "", accepted, rejected))
    return found
