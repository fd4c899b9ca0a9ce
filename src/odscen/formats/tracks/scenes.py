"""Scenes in recorded traffic that meet a criterion, and how often they are."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np
import polars as pl

from odscen.base.categories import DEFAULT_BODY, Category
from odscen.formats.tracks.close_pairs import find_close_pairs, find_crossings

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from odscen.base.arrays import FloatArray, IntArray
    from odscen.lanegraph.graphs import MapGraph

HARD_BRAKING: Final = 4.5
"""m/s² of deceleration; as the figure of runs has it."""
SHORT_TTC: Final = 2.0
"""Seconds to a collision, if both keep their speeds and headings."""
CUT_IN_HEADWAY: Final = 2.0
"""Seconds that who is behind needs to the rear of who comes into its lane."""
SHORT_PET: Final = 5.0
"""Seconds between a pedestrian and a vehicle at the place where their tracks cross."""
_APART: Final = 1.0
"""Seconds between frames from which on they are two scenes; a change undone earlier is none."""
_SIGHT: Final = 150.0
_CELL: Final = 0.5
"""Metres between points of tracks that are looked for crossings."""

_COLUMNS: Final = {
    "kind": pl.String,
    "id": pl.String,
    "other": pl.String,
    "begin": pl.Float64,
    "end": pl.Float64,
    "x": pl.Float64,
    "y": pl.Float64,
    "value": pl.Float64,
}


class _Frame(NamedTuple):
    """A state of a road user that meets a criterion, perhaps because of another one."""

    id: str
    other: str | None
    time: float
    x: float
    y: float
    value: float


def find_scenes(placed: pl.DataFrame, graph: MapGraph | None = None) -> pl.DataFrame:
    """Scenes of recorded traffic.

    Parameters
    ----------
    placed
        Tracks, with a map those of :func:`~odscen.formats.tracks.lane_places.fit_on_map`.
    graph
        The map; without one there are no changes of lanes and no cut-ins.

    Returns
    -------
    polars.DataFrame
        By time: ``kind``, ``id``, ``other``, ``begin``, ``end`` (s), ``x``, ``y`` (m, of ``id`` at
        its worst) and the worst ``value``: of ``hard_braking`` m/s², of ``short_ttc`` s, of
        ``lane_change`` 1 to the left and -1 to the right, of ``cut_in`` the headway of ``other``,
        s, of ``crossing_pedestrian`` the time between it and the vehicle ``other``, s.
    """
    rows = placed.filter(pl.col("category").is_not_null()).with_columns(known_sizes())
    vehicles = rows.filter(pl.col("category") != str(Category.PEDESTRIAN)).sort("id", "time")
    braking = vehicles.filter(pl.col("acceleration") <= -HARD_BRAKING)
    found = [
        *_join_frames(
            "hard_braking",
            (
                _Frame(user, None, *values)
                for user, *values in braking.select(
                    "id", "time", "x", "y", "acceleration"
                ).iter_rows()
            ),
        ),
        *_join_frames("short_ttc", _frames_of_short_ttc(vehicles)),
        *_crossing_pedestrians(
            rows.filter(pl.col("category") == str(Category.PEDESTRIAN)).sort("id", "time"), vehicles
        ),
    ]
    if graph is not None and "lane" in placed.columns:
        changes = list(_lane_changes(vehicles, graph))
        found += [("lane_change", *change) for change in changes]
        found += _cut_ins(vehicles, changes)
    return pl.DataFrame(found, schema=_COLUMNS, orient="row").sort("begin", "kind", "id", "other")


def exposure(rows: pl.DataFrame, scenes: pl.DataFrame) -> dict[str, Any]:
    """How often scenes are: by hour of the recording, and by 100 km that vehicles drove."""
    vehicles = rows.filter(
        pl.col("category").is_not_null() & (pl.col("category") != str(Category.PEDESTRIAN))
    )
    dx, dy = (pl.col(name).diff().over("id") for name in ("x", "y"))
    driven = vehicles.select((dx**2 + dy**2).sqrt().sum()).item() / 1000.0
    seconds = rows.select(pl.col("time").max() - pl.col("time").min()).item()
    hours = (seconds or 0.0) / 3600.0  # no row is left of a recording of other things
    return {
        "hours": round(hours, 6),
        "vehicle_km": round(driven, 3),
        "scenes": {
            str(kind): {
                "count": own.height,
                "per_hour": round(own.height / hours, 3) if hours else None,
                "per_100_km": round(100.0 * own.height / driven, 3) if driven else None,
            }
            for (kind,), own in sorted(scenes.group_by("kind"), key=lambda item: str(item[0]))
        },
    }


def known_sizes() -> list[pl.Expr]:
    """Length and width, those usual for its category where the file has none."""
    category = pl.col("category").cast(pl.String)
    return [
        pl.col(name)
        .cast(pl.Float64)
        .fill_null(
            category.replace_strict(
                {str(kind): getattr(body, name) for kind, body in DEFAULT_BODY.items()},
                return_dtype=pl.Float64,
            )
        )
        for name in ("length", "width")
    ]


def _join_frames(kind: str, frames: Iterable[_Frame]) -> Iterator[tuple[Any, ...]]:
    """Frames of the same road users that follow one another as one scene, of their least value."""
    own: list[_Frame] = []
    for frame in sorted(frames, key=lambda frame: (frame.id, frame.other or "", frame.time)):
        if own and (frame[:2] != own[-1][:2] or frame.time - own[-1].time > _APART):
            yield _scene_of(kind, own)
            own = []
        own.append(frame)
    if own:
        yield _scene_of(kind, own)


def _scene_of(kind: str, frames: list[_Frame]) -> tuple[Any, ...]:
    worst = min(frames, key=lambda frame: frame.value)
    first, last = frames[0], frames[-1]
    return (kind, *first[:2], first.time, last.time, worst.x, worst.y, worst.value)


def _frames_of_short_ttc(vehicles: pl.DataFrame) -> Iterator[_Frame]:
    """Vehicles with one ahead that they would meet soon, at each frame."""
    ordered = vehicles.with_columns(frame=(pl.col("time") * 1000.0).round()).sort("frame", "id")
    names = ordered["id"].to_list()
    columns = ("x", "y", "hdg", "speed", "length", "width", "time")
    values = ordered.select(columns).to_numpy()
    starts = np.flatnonzero(np.diff(ordered["frame"].to_numpy(), prepend=np.nan) != 0.0)
    for begin, end in pairwise([*starts.tolist(), len(values)]):
        if end - begin < 2:
            continue
        part = values[begin:end]
        longest, widest = part[:, 4].max(), part[:, 5].max()
        reach = math.hypot(_SIGHT, longest / 2.0 + 1.5 * widest)
        for i, j in find_close_pairs(part[:, 0], part[:, 1], reach):
            seconds = _times_to_collision(part, i, j)
            for k in np.flatnonzero(seconds < SHORT_TTC).tolist():
                own, other = begin + int(i[k]), begin + int(j[k])
                x, y, time = values[own, 0], values[own, 1], values[own, 6]
                yield _Frame(names[own], names[other], time, x, y, float(seconds[k]))


def _times_to_collision(states: FloatArray, i: IntArray, j: IntArray) -> FloatArray:
    """Seconds, shape ``(P,)``, of rows ``i`` to rows ``j`` ahead in their paths; inf if none is.

    Parameters
    ----------
    states
        ``x``, ``y``, ``hdg``, ``speed``, ``length``, ``width``, shape ``(N, 6)`` or more.
    """
    x, y, hdg, speed, length, width = states[:, :6].T
    dx, dy = x[j] - x[i], y[j] - y[i]
    c, s = np.cos(hdg)[i], np.sin(hdg)[i]
    ahead, left = dx * c + dy * s, dy * c - dx * s
    turn = hdg[j] - hdg[i]
    along = np.abs(np.cos(turn)) * length[j] / 2.0 + np.abs(np.sin(turn)) * width[j] / 2.0
    across = np.abs(np.sin(turn)) * length[j] / 2.0 + np.abs(np.cos(turn)) * width[j] / 2.0
    gap = np.maximum(ahead - length[i] / 2.0 - along, 0.0)
    closing = speed[i] - speed[j] * np.cos(turn)
    meets = (ahead > 0.0) & (ahead < _SIGHT) & (np.abs(left) < width[i] / 2.0 + across)
    meets &= closing > 1e-3
    return np.where(meets, gap / np.where(meets, closing, 1.0), np.inf)


def _lane_changes(
    vehicles: pl.DataFrame, graph: MapGraph
) -> Iterator[tuple[str, None, float, float, float, float, float]]:
    """Who comes from one lane onto the one beside it, and stays there."""
    lanes = graph.lanes
    row_of = {str(key): row for row, key in enumerate(lanes.lanes.keys)}
    beside: dict[tuple[int, int], float] = {}
    for side, neighbours in ((1.0, lanes.left_lane), (-1.0, lanes.right_lane)):
        pairs = np.unique(np.column_stack([lanes.lane, neighbours]), axis=0)
        beside.update({(a, b): side for a, b in pairs.tolist() if b >= 0})
    on_lane = vehicles.filter(pl.col("on_lane"))
    for (user,), own in on_lane.group_by("id", maintain_order=True):
        rows = np.array([row_of[lane] for lane in own["lane"]])
        time, x, y = (own[name].to_numpy() for name in ("time", "x", "y"))
        for k in np.flatnonzero(np.diff(rows)).tolist():
            pair = int(rows[k]), int(rows[k + 1])
            if pair not in beside:
                continue
            soon = int(np.searchsorted(time, time[k + 1] + _APART, "right"))
            if rows[k] in rows[k + 1 : soon]:
                continue
            before = int(np.searchsorted(time, time[k] - _APART))
            if rows[k + 1] in rows[before : k + 1]:
                continue
            yield str(user), None, time[k], time[k + 1], x[k + 1], y[k + 1], beside[pair]


def _cut_ins(
    vehicles: pl.DataFrame, changes: Iterable[tuple[str, None, float, float, float, float, float]]
) -> Iterator[tuple[Any, ...]]:
    """Changes of lanes close before another vehicle of the new lane."""
    by_time = vehicles.sort("time")
    times = by_time["time"].to_numpy()
    for user, _, begin, end, x, y, _ in changes:
        first, past = np.searchsorted(times, (end - 1e-6, end + 1e-6)).tolist()
        there = by_time.slice(first, past - first)
        own = there.row(there["id"].to_list().index(user), named=True)
        others = there.filter(
            (pl.col("id") != user) & (pl.col("lane") == own["lane"]) & pl.col("on_lane")
        )
        near: list[tuple[float, str]] = []
        for other in others.iter_rows(named=True):
            # Along the one behind, as who changes lanes is not along them.
            c, s = np.cos(other["hdg"]), np.sin(other["hdg"])
            behind = (x - other["x"]) * c + (y - other["y"]) * s
            gap = behind - (other["length"] + own["length"]) / 2.0
            if behind > 0.0 and gap < CUT_IN_HEADWAY * other["speed"]:
                near.append((max(gap, 0.0) / other["speed"], other["id"]))
        if near:
            headway, follower = min(near)
            yield "cut_in", user, follower, begin, end, x, y, headway


def _crossing_pedestrians(
    walkers: pl.DataFrame, vehicles: pl.DataFrame
) -> Iterator[tuple[Any, ...]]:
    """Pedestrians whose track crosses that of a vehicle soon before or after it."""
    each = [
        [(str(user), _line_of(own)) for (user,), own in tracks.group_by("id", maintain_order=True)]
        for tracks in (walkers, vehicles)
    ]
    lines = [[line for _, line in tracks] for tracks in each]
    for found in find_crossings(*lines, within=SHORT_PET):
        early, late = sorted((found.a_time, found.b_time))
        pair = each[0][found.a][0], each[1][found.b][0]
        yield ("crossing_pedestrian", *pair, early, late, found.x, found.y, late - early)


def _line_of(own: pl.DataFrame) -> FloatArray:
    """Times, and places some distance apart, of a track: shape ``(N, 3)``."""
    points = own.select("time", "x", "y").to_numpy()
    way = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(points[:, 1:], axis=0).T))])
    cells = np.unique(way // _CELL, return_index=True)[1]
    kept: FloatArray = points[np.unique([*cells.tolist(), len(points) - 1])]
    return kept
