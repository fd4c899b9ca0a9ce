"""Many polylines cut into short pieces, and the nearest piece to each of many places."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from odscen.base.arrays import FloatArray, IntArray, offsets

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray


STEP = 0.25
"""Length in metres of the pieces that places are compared with, at most."""

_SLACK = 0.55 * STEP
"""Half a piece and a little: pieces of a bent line do not quite touch on its outer side."""

_COS = np.cos(np.radians(45.0))
_CLOSE = 0.05
"""Metres within which nearly all places have a piece: what is looked at first."""
_CHUNK = 4000
_ROUNDING = 1e-3

PIECE_MIN = 1e-6
"""Lines shorter than this, in metres, have no direction and no pieces."""


class Pieces(NamedTuple):
    """Short straight pieces of polylines.

    Attributes
    ----------
    xy, ahead
        Shape ``(N, 2)``: middle in metres; unit vector along the polyline.
    length
        Metres, shape ``(N,)``.
    owner
        Shape ``(N,)``: the polyline.
    width
        Shape ``(N,)``: that of the lane in metres, NaN if the polyline has none.
    """

    xy: FloatArray
    ahead: FloatArray
    length: FloatArray
    owner: IntArray
    width: FloatArray

    def take(self, keep: NDArray[Any]) -> Pieces:
        """Keep the pieces chosen by a mask or by their numbers."""
        xy, ahead, length, owner, width = self
        return Pieces(xy[keep], ahead[keep], length[keep], owner[keep], width[keep])


@dataclass(frozen=True, eq=False)
class Polylines:
    """Polylines in two arrays: line k is ``points[first[k]:first[k + 1]]``.

    ``points`` has shape ``(N, 3)``: x, y in metres, and the width of the lane or NaN.
    """

    points: FloatArray
    first: IntArray

    @classmethod
    def of(cls, shapes: Sequence[FloatArray]) -> Polylines:
        """Put shapes of shape ``(K, 2)`` together."""
        points = np.full((sum(map(len, shapes)), 3), np.nan)
        if shapes:
            points[:, :2] = np.concatenate(shapes)
        return cls(points, offsets(map(len, shapes)))

    @cached_property
    def _step_lengths(self) -> FloatArray:
        """Length from each point to the next of the same line, 0 from the last; ``(N,)``."""
        steps = np.zeros(len(self.points))
        steps[:-1] = np.hypot(*np.diff(self.points[:, :2], axis=0).T)
        steps[self.first[1:] - 1] = 0.0
        return steps

    @cached_property
    def _arc_lengths(self) -> FloatArray:
        return np.concatenate([[0.0], np.cumsum(self._step_lengths)])

    @cached_property
    def lengths(self) -> FloatArray:
        """Length of each line in metres."""
        lengths: FloatArray = self._arc_lengths[self.first[1:]] - self._arc_lengths[self.first[:-1]]
        return lengths

    def at(self, line: IntArray, along: FloatArray, length: FloatArray) -> Pieces:
        """Pieces of ``length`` whose middles lie ``along`` metres into lines; inside them only."""
        where = self._arc_lengths[self.first[line]] + along
        row = np.searchsorted(self._arc_lengths, where, side="right") - 1
        share = ((where - self._arc_lengths[row]) / self._step_lengths[row])[:, None]
        step = self.points[row + 1] - self.points[row]
        points = self.points[row] + share * step
        ahead = step[:, :2] / self._step_lengths[row, None]
        return Pieces(points[:, :2], ahead, length, line, points[:, 2])

    def cut(self, step: float) -> Pieces:
        """Cut every line into equal pieces of ``step`` metres at most, but for rounding."""
        count = np.maximum(1, np.ceil(self.lengths / step - _ROUNDING).astype(np.int64))
        count[self.lengths < PIECE_MIN] = 0
        line = np.repeat(np.arange(len(count)), count)
        number = np.arange(len(line)) - offsets(count)[line]
        length = self.lengths[line] / count[line]
        return self.at(line, (number + 0.5) * length, length)


@dataclass(frozen=True, eq=False)
class Finder:
    """Finds, for places, the pieces (of :data:`STEP` at most) around them."""

    pieces: Pieces

    @cached_property
    def _piece_tree(self) -> cKDTree:
        return cKDTree(self.pieces.xy)

    def around(
        self, places: Pieces, radius: float, *, directed: bool
    ) -> tuple[IntArray, IntArray, FloatArray]:
        """All pairs of a place and a piece near it.

        Parameters
        ----------
        radius
            Metres between their middles.
        directed
            Whether both must point the same way, within 45 degrees.

        Returns
        -------
        tuple
            Row of the place, row of the piece, and the distance across the piece in metres (plus
            how far beyond its end the place lies); shape ``(M,)`` each.
        """
        pieces = self.pieces
        if not len(pieces.xy):
            return np.zeros(0, np.int64), np.zeros(0, np.int64), np.zeros(0)
        # Pairs as an array, which is twice as fast as a list of pieces for each place.
        pairs: Any = cKDTree(places.xy).sparse_distance_matrix(
            self._piece_tree, radius, output_type="ndarray"
        )
        place, near = pairs["i"], pairs["j"]
        if directed:
            same = np.sum(places.ahead[place] * pieces.ahead[near], axis=1) > _COS
            place, near = place[same], near[same]
        apart, ahead = places.xy[place] - pieces.xy[near], pieces.ahead[near]
        along = np.abs(np.sum(apart * ahead, axis=1))
        across = np.abs(apart[:, 0] * ahead[:, 1] - apart[:, 1] * ahead[:, 0])
        return place, near, np.hypot(across, np.maximum(0.0, along - _SLACK))

    def nearest(
        self, places: Pieces, reach: float, *, directed: bool = True
    ) -> tuple[FloatArray, IntArray]:
        """Distance to, and row of, the nearest piece of each place.

        Returns
        -------
        tuple
            Shape ``(N,)`` each; ``reach`` and -1 where there is none within ``reach`` metres.
        """
        distance = np.full(len(places.xy), reach)
        row = np.full(len(places.xy), -1, dtype=np.int64)
        todo = np.arange(len(places.xy))
        # Nearly all places have a piece beside them; only the others are worth a wide search.
        for radius in (_CLOSE, 2.0 * STEP, 3.0, reach):
            limit = min(radius, reach)
            for start in range(0, len(todo), _CHUNK):
                rows = todo[start : start + _CHUNK]
                place, near, apart = self.around(
                    places.take(rows), limit + _SLACK, directed=directed
                )
                order = np.lexsort((near, apart, place))
                first, at = np.unique(place[order], return_index=True)
                best = order[at]
                better = apart[best] < distance[rows[first]]
                distance[rows[first[better]]] = apart[best[better]]
                row[rows[first[better]]] = near[best[better]]
            # A piece outside the search is at least `limit` away: what is nearer is nearest.
            todo = todo[distance[todo] > limit]
            if limit == reach:
                break
        return distance, row
