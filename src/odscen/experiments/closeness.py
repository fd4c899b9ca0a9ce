"""How close road users came, also where nothing was recorded as an encounter; and one number of it.

Times to collision are recorded up to 3 s only, so that most cases of a search would look alike.
These measures always have a value that says which of two cases is nearer to being critical:

- clearance: least distance between two bodies at one time;
- conflict distance: where two paths cross, how far (along its path) the other one is from the
  crossing point while the first is on it.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Collection, Iterator, Mapping

    import polars as pl

    from odscen.base.arrays import FloatArray, IntArray

_TIME_SCALE = 1.5
"""Seconds of time to collision or post-encroachment time that count ``1 / e``."""
_LENGTH_SCALE = 10.0
"""Metres of distance that count ``1 / e`` of the most that a distance can count."""
_FASTEST = 30.0
"""m/s; an impact of that speed is the worst."""
_WEIGHTS = (
    (("min_ttc", "min_pet"), 1.0, _TIME_SCALE),
    (("clearance", "conflict_distance"), 0.5, _LENGTH_SCALE),
)
"""Columns, the most that they count, and where that has fallen to ``1 / e`` of it."""


class Closeness(NamedTuple):
    """Metres; ``None`` where no two bodies, or no two paths that cross, were there."""

    clearance: float | None
    conflict_distance: float | None


class _BodyTrack(NamedTuple):
    step: IntArray
    x: FloatArray
    y: FloatArray
    hdg: FloatArray
    length: float
    width: float


def closeness_of(
    trajectories: pl.DataFrame,
    bodies: Mapping[str, tuple[float, float]],
    watched: Collection[str] | None,
) -> Closeness:
    """How close some road users came to others.

    Parameters
    ----------
    trajectories
        ``time``, ``id``, ``x``, ``y``, ``hdg`` of body centres, see
        :meth:`odscen.runs.finished_run.Run.trajectories`.
    bodies
        Length and width of each road user, metres.
    watched
        Ids of whose; ``None`` is everybody's.
    """
    tracks = _body_tracks(trajectories, bodies)
    clearances, distances = [], []
    for one, other in _watched_pairs(tracks, watched):
        apart = _clearance_between(one, other)
        if apart is not None:
            clearances.append(apart)
        away = _conflict_distance(one, other)
        if away is not None:
            distances.append(away)
    return Closeness(min(clearances, default=None), min(distances, default=None))


def criticality(row: Mapping[str, Any]) -> float:
    r"""Return one number of a case: 0 nothing near, below 1 no collision, up to 2 the worst impact.

    With impact speed v, time to collision T, post-encroachment time P, clearance or conflict
    distance d, each counted only where it is there:

    - collision: ``1 + min(v / 30, 1)``
    - else the greatest of ``exp(-T / 1.5)``, ``exp(-P / 1.5)`` and ``0.5 exp(-d / 10)``

    Parameters
    ----------
    row
        Of a sweep's table, with ``clearance`` and ``conflict_distance``.
    """
    if row["collision"]:
        speed = row["impact_speed"]
        known = speed is not None and math.isfinite(speed)
        return 1.0 + (min(speed / _FASTEST, 1.0) if known else 0.0)
    near = [
        weight * math.exp(-max(row[name], 0.0) / scale)
        for names, weight, scale in _WEIGHTS
        for name in names
        if row[name] is not None
    ]
    return max(near, default=0.0)


def _body_tracks(
    table: pl.DataFrame, bodies: Mapping[str, tuple[float, float]]
) -> dict[str, _BodyTrack]:
    tracks = {}
    times = {time: step for step, time in enumerate(table["time"].unique().sort().to_list())}
    for (name,), rows in table.sort("time").group_by("id", maintain_order=True):
        steps = np.array([times[time] for time in rows["time"].to_list()], dtype=np.int64)
        x, y, hdg = (rows[column].to_numpy().astype(np.float64) for column in ("x", "y", "hdg"))
        length, width = bodies[str(name)]
        tracks[str(name)] = _BodyTrack(steps, x, y, hdg, length, width)
    return dict(sorted(tracks.items()))


def _watched_pairs(
    tracks: Mapping[str, _BodyTrack], watched: Collection[str] | None
) -> Iterator[tuple[_BodyTrack, _BodyTrack]]:
    names = [*tracks]
    for first, name in enumerate(names):
        for other in names[first + 1 :]:
            if watched is None or name in watched or other in watched:
                yield tracks[name], tracks[other]


def _clearance_between(one: _BodyTrack, other: _BodyTrack) -> float | None:
    """Least distance of the discs that cover two bodies, 0 where they overlap."""
    _, rows, others = np.intersect1d(one.step, other.step, return_indices=True)
    if not len(rows):
        return None
    a, r = _covering_discs(one, rows)
    b, s = _covering_discs(other, others)
    away = np.hypot(*np.moveaxis(a[:, :, None, :] - b[:, None, :, :], -1, 0))
    return max(float(away.min()) - r - s, 0.0)


def _covering_discs(track: _BodyTrack, rows: IntArray) -> tuple[FloatArray, float]:
    """Centres ``(rows, discs, 2)`` of discs along a body, and their radius."""
    count = max(math.ceil(track.length / max(track.width, 0.1)), 1)
    along = (np.arange(count) + 0.5) / count * track.length - track.length / 2.0
    hdg = track.hdg[rows, None]
    x = track.x[rows, None] + along * np.cos(hdg)
    y = track.y[rows, None] + along * np.sin(hdg)
    return np.stack([x, y], axis=-1), track.width / 2.0


def _conflict_distance(one: _BodyTrack, other: _BodyTrack) -> float | None:
    from shapely import LineString

    lines = []
    for track in (one, other):
        moved = np.concatenate([[0.0], np.hypot(np.diff(track.x), np.diff(track.y)).cumsum()])
        if len(moved) < 2 or moved[-1] < 1.0:
            return None
        kept = np.concatenate([[True], np.diff(moved) > 0.0])
        lines.append((LineString(np.stack([track.x, track.y], axis=1)[kept]), moved, track.step))
    (first, s, steps), (second, t, times) = lines
    crossing = first.intersection(second)
    points = [part for part in getattr(crossing, "geoms", [crossing]) if part.geom_type == "Point"]
    found = []
    for point in points:
        at, there = first.project(point), second.project(point)
        when, then = np.interp(at, s, steps), np.interp(there, t, times)
        late_s, late_steps, place = (t, times, there) if when <= then else (s, steps, at)
        now = float(np.interp(min(when, then), late_steps, late_s))
        found.append(abs(place - now))
    return min(found, default=None)
