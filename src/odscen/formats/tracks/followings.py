"""Which vehicle is behind which one in its lane, and how far."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np
import polars as pl

from odscen.base.categories import Category
from odscen.formats.tracks.close_pairs import find_close_pairs
from odscen.formats.tracks.scenes import known_sizes

if TYPE_CHECKING:
    from odscen.base.arrays import FloatArray

_SIGHT: Final = 100.0
"""Metres within which a vehicle ahead is followed."""
_ALIGNED: Final = math.radians(20.0)
_STEP: Final = 0.1
"""Seconds between states that are looked at, about."""
_SHORTEST: Final = 5.0
"""Seconds behind the same leader that are one following."""


class Following(NamedTuple):
    """A vehicle behind another one in its lane.

    Attributes
    ----------
    id, leader, category
        Of whom.
    step
        Seconds between states.
    speed, gap, leader_speed
        Shapes ``(T,)``: m/s, m from bumper to bumper, m/s.
    travelled
        Metres since the first state, shape ``(T,)``.
    """

    id: str
    leader: str
    category: str
    step: float
    speed: FloatArray
    gap: FloatArray
    leader_speed: FloatArray
    travelled: FloatArray

    @property
    def seconds(self) -> float:
        """How long it lasts."""
        return (len(self.speed) - 1) * self.step


def find_followings(rows: pl.DataFrame) -> list[Following]:
    """Stretches of at least 5 s in which a vehicle has the same one ahead in its path."""
    vehicles = rows.filter(
        pl.col("category").is_not_null() & (pl.col("category") != str(Category.PEDESTRIAN))
    ).with_columns(known_sizes(), moment=(pl.col("time") * 1000.0).round().cast(pl.Int64))
    moments = vehicles["moment"].unique().sort().to_numpy()
    if len(moments) < 2:
        return []
    step = float(np.median(np.diff(moments))) / 1000.0
    every = max(1, round(_STEP / step))
    step *= every
    kept = vehicles.filter(pl.col("moment").is_in(moments[::every].tolist())).sort("moment", "id")
    columns = ("x", "y", "hdg", "length", "width")
    places = kept.select(columns).to_numpy()
    speeds, names = kept["speed"].to_numpy(), kept["id"].to_list()
    times = kept["moment"].to_numpy()
    starts = np.flatnonzero(np.diff(times, prepend=-1))
    rows_behind: dict[tuple[str, str], list[tuple[int, int, int, float]]] = {}
    for begin, end in pairwise([*starts.tolist(), len(places)]):
        leader, gap = find_leaders(places[begin:end])
        for k in np.flatnonzero(leader >= 0).tolist():
            pair = names[begin + k], names[begin + leader[k]]
            entry = (int(times[begin]), begin + k, begin + int(leader[k]), float(gap[k]))
            rows_behind.setdefault(pair, []).append(entry)
    category_of = dict(kept.select("id", pl.col("category").cast(pl.String)).unique().iter_rows())
    found = []
    for (driver, leader_id), entries in sorted(rows_behind.items()):
        cuts = [0]
        cuts += [k + 1 for k, (a, b) in enumerate(pairwise(entries)) if b[0] - a[0] > 1500.0 * step]
        for begin, end in pairwise([*cuts, len(entries)]):
            own = entries[begin:end]
            if (len(own) - 1) * step < _SHORTEST:
                continue
            at = np.array([row for _, row, _, _ in own])
            # Along the heading: errors of places would add up in the length of the path.
            hdg = places[at[:-1], 2]
            moved = np.diff(places[at, :2], axis=0)
            way = moved[:, 0] * np.cos(hdg) + moved[:, 1] * np.sin(hdg)
            found.append(
                Following(
                    driver,
                    leader_id,
                    category_of[driver],
                    step,
                    speeds[at],
                    np.array([gap for *_, gap in own]),
                    speeds[[row for _, _, row, _ in own]],
                    np.concatenate([[0.0], np.cumsum(way)]),
                )
            )
    return found


def find_leaders(places: FloatArray) -> tuple[Any, FloatArray]:
    """Row of the next one ahead in the path of each, or -1, and metres between the bodies."""
    x, y, hdg, length, width = places.T
    leader, least = np.full(len(x), -1), np.full(len(x), np.inf)
    for i, j in find_close_pairs(x, y, math.hypot(_SIGHT, width.max())):
        dx, dy = x[j] - x[i], y[j] - y[i]
        c, s = np.cos(hdg)[i], np.sin(hdg)[i]
        ahead, left = dx * c + dy * s, dy * c - dx * s
        turn = np.abs(np.remainder(hdg[j] - hdg[i] + np.pi, 2.0 * np.pi) - np.pi)
        meets = (ahead > 0.0) & (ahead < _SIGHT) & (turn < _ALIGNED)
        meets &= np.abs(left) < (width[i] + width[j]) / 2.0
        own, other = i[meets], j[meets]
        gap = ahead[meets] - (length[own] + length[other]) / 2.0
        order = np.lexsort((other, gap, own))  # of those ahead of one, the nearest comes first
        rows, first = np.unique(own[order], return_index=True)
        leader[rows], least[rows] = other[order][first], gap[order][first]
    return leader, np.maximum(least, 0.0)
