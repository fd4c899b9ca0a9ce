"""One run of a sweep as a row: collisions of those who matter, and how close they came."""

from __future__ import annotations

import math
import operator
import re
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np

from odscen.base.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence

    import polars as pl

    from odscen.base.arrays import FloatArray, IntArray
    from odscen.records.run_events import Event


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
    tracks = _tracks(trajectories, bodies)
    clearances, distances = [], []
    for one, other in _pairs(tracks, watched):
        apart = _clearance(one, other)
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


def _tracks(
    table: pl.DataFrame, bodies: Mapping[str, tuple[float, float]]
) -> dict[str, _BodyTrack]:
    found = {}
    times = {time: step for step, time in enumerate(table["time"].unique().sort().to_list())}
    for (name,), rows in table.sort("time").group_by("id", maintain_order=True):
        steps = np.array([times[time] for time in rows["time"].to_list()], dtype=np.int64)
        x, y, hdg = (rows[column].to_numpy().astype(np.float64) for column in ("x", "y", "hdg"))
        length, width = bodies[str(name)]
        found[str(name)] = _BodyTrack(steps, x, y, hdg, length, width)
    return dict(sorted(found.items()))


def _pairs(
    tracks: Mapping[str, _BodyTrack], watched: Collection[str] | None
) -> Iterator[tuple[_BodyTrack, _BodyTrack]]:
    names = [*tracks]
    for first, one in enumerate(names):
        for other in names[first + 1 :]:
            if watched is None or one in watched or other in watched:
                yield tracks[one], tracks[other]


def _clearance(one: _BodyTrack, other: _BodyTrack) -> float | None:
    """Least distance of the discs that cover two bodies, 0 where they overlap."""
    _, rows, others = np.intersect1d(one.step, other.step, return_indices=True)
    if not len(rows):
        return None
    a, r = _discs(one, rows)
    b, s = _discs(other, others)
    away = np.hypot(*np.moveaxis(a[:, :, None, :] - b[:, None, :, :], -1, 0))
    return max(float(away.min()) - r - s, 0.0)


def _discs(track: _BodyTrack, rows: IntArray) -> tuple[FloatArray, float]:
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


OUTCOME: Final = ("collision", "impact_speed", "min_ttc", "min_pet", "max_drac")
"""Columns of a row about how it went: whether, m/s, s, s, m/s^2; of those who are watched."""
UNITS: Final = {"impact_speed": "m/s", "min_ttc": "s", "min_pet": "s", "max_drac": "m/s²"}
_NEAR: Final = 1e-6
_OPERATORS: Final[dict[str, Callable[[float, float], bool]]] = {
    ">=": operator.ge, "<=": operator.le, ">": operator.gt, "<": operator.lt,
}  # fmt: skip
_LIMIT = re.compile(r"\s*([A-Za-z_]\w*)\s*(>=|<=|>|<)\s*([+-]?\d+(?:\.\d+)?(?:[eE][+-]?\d+)?)\s*")


@dataclass(frozen=True, slots=True)
class Limit:
    """What a case needs to be safe besides no collision: ``min_ttc >= 1.5``.

    A measure that a case does not have, as two never came near each other, is no breach.
    """

    column: str
    op: str
    bound: float

    def holds(self, row: Mapping[str, Any]) -> bool:
        """Whether a row keeps it."""
        value = row[self.column]
        return value is None or _OPERATORS[self.op](float(value), self.bound)

    def __str__(self) -> str:
        return f"{self.column} {self.op} {self.bound:g}"


def limit_from_text(text: str, columns: Sequence[str]) -> Limit:
    """Read a limit.

    Raises
    ------
    InputError
        If it is none, or there is no such column.
    """
    match = _LIMIT.fullmatch(text)
    if match is None:
        raise InputError(f"{text!r} is no limit; write for example: min_ttc >= 1.5")
    if match[1] not in columns:
        raise InputError(
            f"{text!r}: a sweep has no column {match[1]!r}; it has {', '.join(columns)}"
        )
    return Limit(match[1], match[2], float(match[3]))


def outcome_of(
    events: Iterable[Event],
    conflicts: pl.DataFrame | None,
    trajectories: Callable[[], pl.DataFrame],
    watched: Collection[str] | None,
) -> dict[str, bool | float | None]:
    """Collisions and closest encounters of some road users; keys are :data:`OUTCOME`.

    Parameters
    ----------
    events
        Of the run.
    conflicts
        Of the run, as :func:`odscen.figures.measures.conflicts.conflict_table` gives them.
    trajectories
        Called where the speed of an impact is not in its event.
    watched
        Ids of whose; ``None`` is everybody's.
    """
    impacts: list[float] = []
    for event in events:
        if event.kind == "collision" and _of(watched, event.actor, event.partner):
            known = (event.values or {}).get("impact_speed")
            impacts.append(_closing(event, trajectories()) if known is None else float(known))
    found: dict[str, bool | float | None] = {
        "collision": bool(impacts),
        "impact_speed": max(impacts, default=None),
    }
    rows = [] if conflicts is None else conflicts.to_dicts()
    own = [row for row in rows if _of(watched, row["one"], row["other"])]
    for name, column, best in (
        ("min_ttc", "ttc", min), ("min_pet", "pet", min), ("max_drac", "drac", max),
    ):  # fmt: skip
        found[name] = best((row[column] for row in own if row[column] is not None), default=None)
    return found


def _of(watched: Collection[str] | None, *ids: str | None) -> bool:
    return watched is None or any(one in watched for one in ids)


def _closing(event: Event, trajectories: pl.DataFrame) -> float:
    """Relative speed of the two of a collision at its record, m/s; NaN if they have none."""
    import polars as pl

    pair = trajectories.filter(
        pl.col("id").is_in([event.actor, event.partner]),
        (pl.col("time") - event.time).abs() < _NEAR,
    )
    if pair.height != 2:
        return float("nan")
    heading, speed = pair["hdg"].to_numpy(), pair["speed"].to_numpy()
    return float(np.hypot(*np.diff(speed * np.vstack([np.cos(heading), np.sin(heading)])).ravel()))
