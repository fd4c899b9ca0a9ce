"""Critical gaps: the shortest gap that a road user takes, by what it took and what it let pass.

That of one driver is longer than the longest gap that it let pass and no longer than that which it
took. Those of all are taken to be log-normal, with the mean and deviation that make what was seen
most likely (Troutbeck, "Estimating the critical acceptance gap from traffic movements", 1992;
Brilon, Koenig and Troutbeck, "Useful estimation procedures for critical gaps", Transportation
Research Part A 33, 1999).
"""

from __future__ import annotations

import math
from itertools import pairwise
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np
import polars as pl

from odscen.base.categories import Category
from odscen.formats.tracks.scenes import known_sizes

if TYPE_CHECKING:
    from collections.abc import Collection, Sequence

    from odscen.base.arrays import FloatArray
    from odscen.lanegraph.graphs import MapGraph

LONGEST_GAP: Final = 15.0
"""Seconds; longer gaps are taken by all, and say nothing."""
FEWEST: Final = 10
"""Road users that let a gap pass and took another one, from which on there is a critical gap."""
_GIVES_WAY: Final = 0.25
"""Share of a movement that waits, from which on it is one that gives way."""
_WAITS: Final = 2.0
"""m/s below which a vehicle before a junction waits."""
_BEFORE: Final = 15.0
"""Metres before the junction within which it does."""
_DRIVES: Final = 2.0
_NEAR: Final = 1.5
"""Metres between the paths of two vehicles where they meet."""
_STRAIGHT: Final = math.radians(30.0)


class GapChoice(NamedTuple):
    """What one road user did.

    Attributes
    ----------
    id, category, turn
        ``turn`` is ``left``, ``through`` or ``right``; ``crossing`` of pedestrians.
    accepted, rejected
        Seconds of the gap that it took, and of the longest one that it let pass; 0 if it let none.
    """

    id: str
    category: str
    lane: str
    turn: str
    accepted: float
    rejected: float


def estimate_critical_gap(choices: Sequence[GapChoice]) -> dict[str, Any] | None:
    """Mean and deviation of critical gaps, s.

    Returns
    -------
    dict
        ``mean``, ``std``, ``road_users`` and how many of these ``let_pass`` a gap; ``None`` if
        fewer than ten let one pass that is shorter than the one that they took.
    """
    from scipy.optimize import minimize
    from scipy.stats import norm

    # Those who took the first gap count, too: without them the eager ones would be missing.
    used = [
        (choice.rejected, min(choice.accepted, LONGEST_GAP))
        for choice in choices
        if choice.rejected < min(choice.accepted, LONGEST_GAP)
    ]
    let_pass = len([1 for rejected, _ in used if rejected > 0.0])
    if let_pass < FEWEST:
        return None
    low, high = np.log(np.maximum(np.array(used), 1e-6)).T

    def unlikelihood(point: FloatArray) -> float:
        mean, spread = point[0], math.exp(point[1])
        share = norm.cdf((high - mean) / spread) - norm.cdf((low - mean) / spread)
        return -float(np.log(np.maximum(share, 1e-12)).sum())

    start = np.array([float(high.mean()) - 0.3, math.log(0.3)])
    best = minimize(unlikelihood, start, method="Nelder-Mead", options={"xatol": 1e-5})
    mean, variance = float(best.x[0]), math.exp(2.0 * float(best.x[1]))
    value = math.exp(mean + variance / 2.0)
    return {
        "mean": round(value, 3),
        "std": round(value * math.sqrt(math.expm1(variance)), 3),
        "road_users": len(used),
        "let_pass": let_pass,
    }


def find_gap_choices(
    placed: pl.DataFrame, graph: MapGraph, *, lit: Collection[str] = ()
) -> list[GapChoice]:
    """What vehicles that give way at a junction did with the gaps between others.

    A vehicle waits where it is slower than 2 m/s within 15 m of the junction, first in its lane,
    and enters when its middle is on a lane of it. Movements of which a quarter waits give way. Gaps
    are between those who come to its path through the junction, from other lanes and not slower
    than 2 m/s; of each counts when the vehicle would enter to meet it there.

    Parameters
    ----------
    placed
        Tracks on the map, of :func:`~odscen.formats.tracks.lane_places.fit_on_map`.
    graph
        The map.
    lit
        Junctions with lights, which are left out.
    """
    lanes = graph.lanes.lanes
    of_lane = {
        str(key): str(junction)
        for key, junction in zip(lanes.keys, lanes.junctions, strict=True)
        if junction is not None and str(junction) not in lit
    }
    vehicles = (
        placed.filter((pl.col("category") != str(Category.PEDESTRIAN)) & pl.col("on_lane"))
        .with_columns(
            known_sizes(),
            junction=pl.col("lane").replace_strict(of_lane, default=None, return_dtype=pl.String),
        )
        .sort("id", "time")
    )
    passages = _find_passages(vehicles)
    by_junction: dict[str, list[_Passage]] = {}
    for passage in passages:
        by_junction.setdefault(passage.junction, []).append(passage)
    found = []
    for own in by_junction.values():
        movements: dict[tuple[str, str], list[_Passage]] = {}
        for passage in own:
            movements.setdefault((passage.lane, passage.turn), []).append(passage)
        for members in movements.values():
            waiting = sum(passage.waits < passage.enters for passage in members)
            if waiting >= _GIVES_WAY * len(members):
                found += [choice for one in members if (choice := _choice_of(one, own)) is not None]
    return sorted(found)


class _Passage(NamedTuple):
    """A vehicle through a junction.

    Attributes
    ----------
    lane
        By which it comes.
    states
        ``time``, ``x``, ``y``, ``hdg``, ``speed``, shape ``(N, 5)``, in the junction.
    waits
        When it began to wait before it as the first of its lane; when it enters if it did not.
    """

    id: str
    category: str
    junction: str
    lane: str
    states: FloatArray
    waits: float

    @property
    def enters(self) -> float:
        """When it is in the junction, s."""
        return float(self.states[0, 0])

    @property
    def turn(self) -> str:
        """Where it turns."""
        turned = math.remainder(float(self.states[-1, 3] - self.states[0, 3]), math.tau)
        return "through" if abs(turned) < _STRAIGHT else "left" if turned > 0.0 else "right"


def _find_passages(vehicles: pl.DataFrame) -> list[_Passage]:
    found = []
    columns = ("time", "x", "y", "hdg", "speed")
    for (user,), own in vehicles.group_by("id", maintain_order=True):
        junction = own["junction"].to_list()
        states = own.select(columns).to_numpy()
        cuts = [0, *(k for k in range(1, len(junction)) if junction[k] != junction[k - 1])]
        for begin, end in pairwise([*cuts, len(junction)]):
            if junction[begin] is None or begin == 0 or end - begin < 2:
                continue
            way = np.hypot(*(states[:begin, 1:3] - states[begin, 1:3]).T)
            slow = np.flatnonzero((way <= _BEFORE) & (states[:begin, 4] < _WAITS))
            waits = float(states[slow[0] if len(slow) else begin, 0])
            lane = own["lane"][begin - 1]
            category = str(own["category"][begin])
            found.append(
                _Passage(str(user), category, junction[begin], lane, states[begin:end], waits)
            )
    found.sort(key=lambda passage: (passage.enters, passage.id))
    last: dict[str, float] = {}
    first_in_lane = []
    for passage in found:
        waits = max(passage.waits, last.get(passage.lane, -math.inf))
        last[passage.lane] = passage.enters
        first_in_lane.append(passage._replace(waits=min(waits, passage.enters)))
    return first_in_lane


def _choice_of(one: _Passage, others: Sequence[_Passage]) -> GapChoice | None:
    times = [
        time
        for other in others
        if other.id != one.id and other.lane != one.lane
        if one.waits - LONGEST_GAP <= other.states[-1, 0]
        if other.states[0, 0] <= one.enters + LONGEST_GAP
        if (time := _time_at_path(other, one)) is not None
    ]
    accepted, rejected = judge_gaps(times, waits=one.waits, enters=one.enters)
    if accepted is None:
        return None
    return GapChoice(one.id, one.category, one.lane, one.turn, accepted, rejected)


def _time_at_path(other: _Passage, one: _Passage) -> float | None:
    """When one would enter to meet another vehicle where paths first meet; none if they do not."""
    away = np.hypot(
        other.states[:, None, 1] - one.states[None, :, 1],
        other.states[:, None, 2] - one.states[None, :, 2],
    )
    near = np.flatnonzero(away.min(axis=1) <= _NEAR)
    if not len(near) or other.states[near[0], 4] < _DRIVES:
        return None
    there = int(np.argmin(away[near[0]]))
    return float(other.states[near[0], 0] - (one.states[there, 0] - one.enters))


def judge_gaps(
    times: Sequence[float], *, waits: float, enters: float
) -> tuple[float | None, float]:
    """Gap that was taken, and longest one that was let pass, s.

    Parameters
    ----------
    times
        When one would enter to meet each of the others, s.
    waits, enters
        When a road user begins to wait, and when it takes a gap.

    Returns
    -------
    tuple
        The first is ``None`` if there was no other. What is let pass first may be the rest of a
        gap, a lag: that it was too short is known, and no less what was taken was long enough.
    """
    ordered = sorted(times)
    before = [time for time in ordered if time <= enters]
    behind = [time for time in ordered if time > enters]
    seen = [time for time in before if time > waits]
    rejected = max((b - a for a, b in pairwise([waits, *seen])), default=0.0)
    if not before and not behind:
        return None, rejected
    accepted = behind[0] - before[-1] if before and behind else LONGEST_GAP
    return min(accepted, LONGEST_GAP), rejected
