"""Who is ahead and behind: vehicles in the order of their lanes, with numpy."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from odscen.base.arrays import FloatArray, Int32Array, IntArray
    from odscen.learning.fill import Array

_FAR = 1e6
"""Metres; no lane is so long. A place on a lane is ``lane * _FAR + pos``."""


class LaneOrder:
    """Vehicles sorted by lane and place.

    Parameters
    ----------
    lane
        ``(N,)``: row of each one's lane, -1 for none.
    pos
        ``(N,)``: metres of the front along it.
    length
        ``(N,)``: of the body.
    """

    def __init__(self, lane: Int32Array, pos: FloatArray, length: FloatArray) -> None:
        self._lane, self._pos, self._length = lane, pos, length
        key = lane * _FAR + pos
        self._rows = np.argsort(key, kind="stable")
        self._key = key[self._rows]

    def ahead(self, lane: Array, pos: FloatArray) -> tuple[IntArray, FloatArray]:
        """Nearest front on a lane at or after a place: its row (-1: none), metres to its back."""
        place = np.searchsorted(self._key, lane * _FAR + pos, side="left")
        return self._leader_and_gap(place, lane, pos)

    def behind(
        self, lane: Array, pos: FloatArray, length: FloatArray
    ) -> tuple[IntArray, FloatArray]:
        """Nearest front on a lane before a place: its row (-1: none), metres to a body there."""
        place = np.searchsorted(self._key, lane * _FAR + pos, side="left") - 1
        row = self._rows[np.maximum(place, 0)] if len(self._rows) else np.zeros_like(place)
        found = (place >= 0) & (lane >= 0)
        found[found] &= self._lane[row[found]] == lane[found]
        gap = np.full(len(place), np.inf)
        gap[found] = pos[found] - length[found] - self._pos[row[found]]
        return np.where(found, row, -1), gap

    def leaders(self, ahead: Int32Array, lane_length: FloatArray) -> tuple[Int32Array, FloatArray]:
        """Leader of each vehicle and the gap to it, on its lane or on lanes ahead ``(N, K)``."""
        lane, rows = self._lane, self._rows
        ordered = lane[rows]
        follows = ordered[:-1] == ordered[1:]
        nearest = np.full(len(rows), -1, dtype=np.int64)
        nearest[rows[:-1][follows]] = rows[1:][follows]
        hindmost = np.full(len(lane_length) + 1, -1, dtype=np.int64)
        heads = np.append(True, ~follows)[: len(rows)]
        hindmost[ordered[heads]] = rows[heads]
        hindmost[-1] = -1  # of no lane
        nearest[lane < 0] = -1
        # Columns: the lane that it is on, and those ahead.
        found = np.column_stack([nearest, hindmost[ahead]])
        lengths = np.append(lane_length, 0.0)
        rest = np.where(lane >= 0, lengths[lane] - self._pos, 0.0)
        metres = np.cumsum(np.column_stack([rest, lengths[ahead[:, :-1]]]), axis=1)
        each = np.arange(len(lane))
        column = (found >= 0).argmax(axis=1)
        leader = found[each, column]
        gap = self._pos[leader] - self._length[leader]
        gap += np.where(column > 0, metres[each, column - 1], -self._pos)
        return leader.astype(np.int32), np.where(leader >= 0, gap, np.inf)

    def _leader_and_gap(
        self, place: IntArray, lane: Array, pos: FloatArray
    ) -> tuple[IntArray, FloatArray]:
        inside = (place < len(self._rows)) & (lane >= 0)
        row = np.full(len(place), -1, dtype=np.int64)
        row[inside] = self._rows[place[inside]]
        inside[inside] &= self._lane[row[inside]] == lane[inside]
        row[~inside] = -1
        gap = np.full(len(place), np.inf)
        leader = row[inside]
        gap[inside] = self._pos[leader] - self._length[leader] - pos[inside]
        return row, gap
