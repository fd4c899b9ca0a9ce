"""Scenes in recorded traffic that meet a criterion, and how often they are."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import TYPE_CHECKING, Any, Final, NamedTuple, TypeAlias

import numpy as np
import polars as pl

from odscen.base.categories import DEFAULT_BODY, Category
from odscen.formats.tracks.close_pairs import find_close_pairs, find_crossings

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Sequence

    from odscen.base.arrays import FloatArray, IntArray
    from odscen.formats.tracks.close_pairs import Crossing
    from odscen.lanegraph.graphs import MapGraph

HARD_BRAKING: Final = 4.5
"""m/s² of deceleration; as the figure of runs has it."""
SHORT_TTC: Final = 2.0
"""Seconds to a collision, if both keep their speeds and headings."""
CUT_IN_HEADWAY: Final = 2.0
"""Seconds that who is behind needs to the rear of who comes into its lane."""
SHORT_PET: Final = 5.0
"""Seconds between a pedestrian and a vehicle at the place where their tracks cross."""
_TURNS: Final = math.radians(45.0)
"""From which on a vehicle in a junction turns."""
_FACES: Final = math.radians(135.0)
"""Between the headings of a vehicle and of who comes towards it, at least."""
_APART: Final = 1.0
"""Seconds between frames from which on they are two scenes; a change undone earlier is none."""
_SIGHT: Final = 150.0
_CELL: Final = 0.5
"""Metres between points of tracks that are looked for crossings."""

_ROWS_AT_ONCE: Final = 2_000_000
_TTC_COLUMNS: Final = ("x", "y", "hdg", "speed", "length", "width", "time")

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


Tracks: TypeAlias = "pl.DataFrame | Sequence[pl.LazyFrame]"
"""A table of tracks, or parts of one that have all tracks of their road users."""


def find_scenes(
    placed: Tracks,
    graph: MapGraph | None = None,
    *,
    progress: Callable[[float], None] = lambda _share: None,
) -> pl.DataFrame:
    """Scenes of recorded traffic.

    Parameters
    ----------
    placed
        Tracks; with a map those of :class:`~odscen.formats.tracks.lane_places.LaneFit`.
    graph
        The map; without one there are no changes of lanes, no cut-ins and no turns.
    progress
        Called with the share that is done.

    Returns
    -------
    polars.DataFrame
        By time: ``kind``, ``id``, ``other``, ``begin``, ``end`` (s), ``x``, ``y`` (m, of ``id`` at
        its worst) and the worst ``value``: of ``hard_braking`` m/s², of ``short_ttc`` s, of
        ``lane_change`` 1 to the left and -1 to the right, of ``cut_in`` the headway of ``other``,
        s, of ``crossing_pedestrian`` the time between it and the vehicle ``other``, s, and of
        ``unprotected_left`` that between who turns and ``other``, who comes from ahead, where
        their tracks cross in the junction.
    """
    known = [part.filter(pl.col("category").is_not_null()) for part in _parts_of(placed)]
    on_foot = pl.col("category") == str(Category.PEDESTRIAN)
    vehicles = [part.filter(~on_foot) for part in known]
    walkers = [line for part in known for line in _lines_of(part.filter(on_foot))]
    found: list[tuple[Any, ...]] = []
    driven: list[tuple[str, FloatArray]] = []
    changes: list[_Change] = []
    passages: list[_Passage] = []
    for number, part in enumerate(vehicles):
        braking = part.filter(pl.col("acceleration") <= -HARD_BRAKING).sort("id", "time")
        states = braking.select("id", "time", "x", "y", "acceleration").collect()
        frames = (_Frame(user, None, *values) for user, *values in states.iter_rows())
        found += _join_frames("hard_braking", frames)
        if walkers:
            driven += _lines_of(part)
        if graph is not None and "lane" in part.collect_schema():
            changes += _lane_changes(part, graph)
            passages += _junction_passages(part, graph)
        progress(0.3 * (number + 1) / len(vehicles))
    windows = _windows_of(vehicles)
    found += _join_frames(
        "short_ttc", _frames_of_short_ttc(windows, lambda share: progress(0.3 + 0.6 * share))
    )
    found += _crossing_pedestrians(walkers, driven)
    found += [("lane_change", *change) for change in changes]
    found += _cut_ins(vehicles, changes)
    found += _turns_across(passages)
    return pl.DataFrame(found, schema=_COLUMNS, orient="row").sort("begin", "kind", "id", "other")


def exposure(rows: Tracks, scenes: pl.DataFrame) -> dict[str, Any]:
    """How often scenes are: by hour of the recording, and by 100 km that vehicles drove.

    Parameters
    ----------
    rows
        Tracks, by road user and time.
    """
    rows = _parts_of(rows)
    is_vehicle = pl.col("category").is_not_null() & (pl.col("category") != str(Category.PEDESTRIAN))
    dx, dy = (pl.col(name).diff() for name in ("x", "y"))
    same = pl.col("id") == pl.col("id").shift()
    meters = pl.when(same).then((dx**2 + dy**2).sqrt()).sum()
    driven = sum(part.filter(is_vehicle).select(meters).collect().item() for part in rows) / 1000.0
    times = pl.concat(
        [
            part.select(begin=pl.col("time").min(), end=pl.col("time").max()).collect()
            for part in rows
        ]
    )
    seconds = times.select(pl.col("end").max() - pl.col("begin").min()).item()
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


def _parts_of(tracks: Tracks) -> Sequence[pl.LazyFrame]:
    return [tracks.lazy()] if isinstance(tracks, pl.DataFrame) else tracks


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
    """Frames of the same road users that follow one another as one scene, of their least value.

    Those of each have to come by time; what is kept is one scene of each, however many there are.
    """
    begun: dict[tuple[str, str | None], tuple[_Frame, _Frame, _Frame]] = {}
    for frame in frames:
        key = frame.id, frame.other
        first, last, worst = begun.get(key, (frame, frame, frame))
        if frame.time - last.time > _APART:
            yield _scene_of(kind, first, last, worst)
            first = worst = frame
        begun[key] = first, frame, frame if frame.value < worst.value else worst
    for scene in begun.values():
        yield _scene_of(kind, *scene)


def _scene_of(kind: str, first: _Frame, last: _Frame, worst: _Frame) -> tuple[Any, ...]:
    return (kind, *first[:2], first.time, last.time, worst.x, worst.y, worst.value)


def _windows_of(parts: Sequence[pl.LazyFrame]) -> Iterator[tuple[pl.DataFrame, float]]:
    """All rows by time, some at once, with the share of the recording that has then been given."""
    frame = (pl.col("time") * 1000.0).round()
    counts = pl.concat(
        [part.group_by(frame.alias("frame")).len().collect(engine="streaming") for part in parts]
    )
    counts = counts.group_by("frame").agg(pl.col("len").sum()).sort("frame")
    before = pl.col("len").cum_sum() - pl.col("len")
    for cut in counts.with_columns(part=before // _ROWS_AT_ONCE).partition_by(
        "part", maintain_order=True
    ):
        begin, end = cut["frame"][0], cut["frame"][-1]
        within = pl.col("time").is_between((begin - 1.0) / 1000.0, (end + 1.0) / 1000.0)
        rows = pl.concat([part.filter(within).collect(engine="streaming") for part in parts])
        rows = rows.with_columns(known_sizes()).select(*_TTC_COLUMNS, "id", frame=frame)
        rows = rows.filter(pl.col("frame").is_between(begin, end))
        whole = counts["frame"][-1] - counts["frame"][0]
        share = (end - counts["frame"][0]) / whole if whole else 1.0
        yield rows.sort("frame", "id"), share


def _frames_of_short_ttc(
    windows: Iterable[tuple[pl.DataFrame, float]], progress: Callable[[float], None]
) -> Iterator[_Frame]:
    """Vehicles with one ahead that they would meet soon, at each frame."""
    for ordered, share in windows:
        names = ordered["id"]
        values = ordered.select(_TTC_COLUMNS).to_numpy()
        starts = np.flatnonzero(np.diff(ordered["frame"].to_numpy(), prepend=np.nan) != 0.0)
        for begin, end in pairwise([*starts.tolist(), len(values)]):
            if end - begin < 2:
                continue
            part = values[begin:end]
            longest, widest = part[:, 4].max(), part[:, 5].max()
            # Two that close at twice the highest speed meet soon only from less far away.
            soon = SHORT_TTC * 2.0 * part[:, 3].max() + longest + widest / 2.0
            reach = math.hypot(min(_SIGHT, soon), longest / 2.0 + 1.5 * widest)
            for i, j in find_close_pairs(part[:, 0], part[:, 1], reach):
                seconds = times_to_collision(part, i, j)
                for k in np.flatnonzero(seconds < SHORT_TTC).tolist():
                    own, other = begin + int(i[k]), begin + int(j[k])
                    x, y, time = values[own, 0], values[own, 1], values[own, 6]
                    yield _Frame(names[own], names[other], time, x, y, float(seconds[k]))
        progress(share)


def times_to_collision(states: FloatArray, i: IntArray, j: IntArray) -> FloatArray:
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


_Change: TypeAlias = tuple[str, None, float, float, float, float, float]


def _lane_changes(vehicles: pl.LazyFrame, graph: MapGraph) -> Iterator[_Change]:
    """Who comes from one lane onto the one beside it, and stays there."""
    lanes = graph.lanes
    row_of = {str(key): row for row, key in enumerate(lanes.lanes.keys)}
    beside: dict[tuple[int, int], float] = {}
    for side, neighbours in ((1.0, lanes.left_lane), (-1.0, lanes.right_lane)):
        pairs = np.unique(np.column_stack([lanes.lane, neighbours]), axis=0)
        beside.update({(a, b): side for a, b in pairs.tolist() if b >= 0})
    on_lane = vehicles.filter(pl.col("on_lane")).sort("id", "time").select(
        "id", "time", "x", "y",
        pl.col("lane").cast(pl.String).replace_strict(row_of, return_dtype=pl.Int64),
    ).collect()  # fmt: skip
    for (user,), own in on_lane.group_by("id", maintain_order=True):
        rows, time, x, y = (own[name].to_numpy() for name in ("lane", "time", "x", "y"))
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
    vehicles: Sequence[pl.LazyFrame], changes: Sequence[_Change]
) -> Iterator[tuple[Any, ...]]:
    """Changes of lanes close before another vehicle of the new lane."""
    if not changes:
        return
    ends = pl.Series([change[3] for change in changes])
    near_end = (pl.col("time") * 1000.0).round().is_in((ends * 1000.0).round().unique().implode())
    columns = ("id", "time", "x", "y", "hdg", "speed", "length", "lane", "on_lane")
    rows = [
        part.filter(near_end).with_columns(known_sizes()).select(columns).collect()
        for part in vehicles
    ]
    by_time = pl.concat(rows).sort("time", maintain_order=True)
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


class _Passage(NamedTuple):
    """A vehicle in a junction: its heading when it comes, how far it turns (rad), its line."""

    id: str
    hdg: float
    turn: float
    line: FloatArray


def _junction_passages(vehicles: pl.LazyFrame, graph: MapGraph) -> Iterator[_Passage]:
    """Each time that a vehicle is in a junction."""
    lanes = graph.lanes.lanes
    inside = [
        str(key)
        for key, junction in zip(lanes.keys, lanes.junctions, strict=True)
        if junction is not None
    ]
    there = pl.col("on_lane") & pl.col("lane").cast(pl.String).is_in(inside)
    same = (pl.col("id") == pl.col("id").shift()).fill_null(value=False)
    goes_on = pl.col("there") & pl.col("there").shift().fill_null(value=False) & same
    rows = vehicles.sort("id", "time").select("id", "time", "x", "y", "hdg", there=there)
    rows = rows.with_columns(passage=(~goes_on).cum_sum()).filter("there")
    for (_, user), own in rows.collect().group_by("passage", "id", maintain_order=True):
        if own.height > 1:
            hdg = np.unwrap(own["hdg"].to_numpy())
            turn = float(hdg[-1] - hdg[0])
            yield _Passage(str(user), float(hdg[0]), turn, _thin_line(own))


def _turns_across(passages: Sequence[_Passage]) -> Iterator[tuple[Any, ...]]:
    """Turns in junctions across the path of who comes from ahead: left where one keeps right."""
    turning = [passage for passage in passages if abs(passage.turn) > _TURNS]
    straight = [passage for passage in passages if abs(passage.turn) <= _TURNS]
    lines = [[passage.line for passage in each] for each in (turning, straight)]
    for found in find_crossings(*lines, within=SHORT_PET):
        one, other = turning[found.a], straight[found.b]
        if one.id != other.id and abs(math.remainder(other.hdg - one.hdg, math.tau)) > _FACES:
            early, late = sorted((found.a_time, found.b_time))
            yield (
                "unprotected_left", one.id, other.id, early, late, found.x, found.y, late - early,
            )  # fmt: skip


def _crossing_pedestrians(
    walkers: Sequence[tuple[str, FloatArray]], vehicles: Sequence[tuple[str, FloatArray]]
) -> Iterator[tuple[Any, ...]]:
    """Pedestrians whose track crosses that of a vehicle soon before or after it."""
    for walker, vehicle, found in _crossings_of_lines(walkers, vehicles, SHORT_PET):
        early, late = sorted((found.a_time, found.b_time))
        yield "crossing_pedestrian", walker, vehicle, early, late, found.x, found.y, late - early


def crossings_of_tracks(
    one: pl.DataFrame, other: pl.DataFrame, *, within: float
) -> Iterator[tuple[str, str, Crossing]]:
    """Where tracks of two tables first cross, with the ids of both.

    Parameters
    ----------
    one, other
        By road user and time.
    within
        Seconds between the two.
    """
    yield from _crossings_of_lines(
        list(_lines_of(one.lazy())), list(_lines_of(other.lazy())), within
    )


def _crossings_of_lines(
    one: Sequence[tuple[str, FloatArray]],
    other: Sequence[tuple[str, FloatArray]],
    within: float,
) -> Iterator[tuple[str, str, Crossing]]:
    lines = [[line for _, line in tracks] for tracks in (one, other)]
    for found in find_crossings(*lines, within=within):
        yield one[found.a][0], other[found.b][0], found


def _lines_of(part: pl.LazyFrame) -> Iterator[tuple[str, FloatArray]]:
    """Tracks as lines: times, and places some distance apart, shape ``(N, 3)``."""
    tracks = part.select("id", "time", "x", "y").sort("id", "time").collect()
    for (user,), own in tracks.group_by("id", maintain_order=True):
        yield str(user), _thin_line(own)


def _thin_line(own: pl.DataFrame) -> FloatArray:
    """Times, and places some distance apart, of a track: shape ``(N, 3)``."""
    points = own.select("time", "x", "y").to_numpy()
    way = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(points[:, 1:], axis=0).T))])
    cells = np.unique(way // _CELL, return_index=True)[1]
    kept: FloatArray = points[np.unique([*cells.tolist(), len(points) - 1])]
    return kept
