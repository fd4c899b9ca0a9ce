"""Road users that are close to each other: in one frame, or with tracks that cross.

What is pairwise is looked for among neighbours only, so that it grows as traffic does; more of them
than bodies have room for are refused.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np

from odscen.base.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from odscen.base.arrays import FloatArray, IntArray

MOST_NEIGHBOURS: Final = 1000
"""Road users within sight of one, on average; a jam on ten lanes has 430 within 150 m."""
MOST_MEETINGS: Final = 3_000_000
"""Pairs of pieces of tracks that lie upon each other at a time."""
_FEW: Final = 48
"""Road users of which all pairs are looked at faster than neighbours are found."""
_AT_ONCE: Final = 500
_SEGMENTS: Final = 8
"""Segments of a piece of a track."""
_BATCH: Final = 20_000


def find_close_pairs(x: FloatArray, y: FloatArray, reach: float) -> Iterator[tuple[IntArray, ...]]:
    """Rows of each and of another within reach of it, part by part; some are farther away.

    Parameters
    ----------
    x, y
        Metres, shape ``(N,)``.
    reach
        Metres.

    Raises
    ------
    InputError
        If there are more than a thousand others within reach, on average.
    """
    count = len(x)
    if count <= _FEW:
        own, other = np.nonzero(~np.eye(count, dtype=np.bool_))
        yield own, other
        return
    from scipy.spatial import cKDTree

    places = np.column_stack([x, y])
    tree = cKDTree(places)
    pairs = int(tree.count_neighbors(tree, reach)) - count
    if pairs > MOST_NEIGHBOURS * count:
        raise InputError(
            f"of {count:,} road users at one time each has {pairs // count:,} others within "
            f"{reach:.0f} m, and {MOST_NEIGHBOURS:,} are the most"
        )
    for begin in range(0, count, _AT_ONCE):
        part = cKDTree(places[begin : begin + _AT_ONCE])
        found = part.sparse_distance_matrix(tree, reach, output_type="ndarray")
        own, other = found["i"] + begin, found["j"]
        apart = own != other
        yield own[apart], other[apart]


class Crossing(NamedTuple):
    """Where two tracks cross: rows of the tracks, metres, and when each is there, s."""

    a: int
    b: int
    x: float
    y: float
    a_time: float
    b_time: float


class _Pieces(NamedTuple):
    """Tracks cut into pieces of equal length, by the time at which they begin.

    Attributes
    ----------
    track
        Row of the track, shape ``(P,)``.
    points
        Shape ``(P, 9, 3)``: time, x, y; the last point again where a piece has fewer.
    begin, end
        Shape ``(P,)``, s.
    """

    track: IntArray
    points: FloatArray
    begin: FloatArray
    end: FloatArray

    def part(self, low: int, high: int) -> _Pieces:
        """Some of them."""
        rows = slice(low, high)
        return _Pieces(self.track[rows], self.points[rows], self.begin[rows], self.end[rows])


def find_crossings(
    a: Sequence[FloatArray], b: Sequence[FloatArray], *, within: float
) -> list[Crossing]:
    """Where tracks of one kind first cross those of another, if both are there at nearly a time.

    Parameters
    ----------
    a, b
        Tracks: ``time``, ``x``, ``y``, shape ``(N, 3)``, by time.
    within
        Seconds between the two.

    Returns
    -------
    list of Crossing
        One at most of two tracks: the first in the time of ``a``.

    Raises
    ------
    InputError
        If so many lie upon each other that bodies have no room.
    """
    ours, theirs = _cut_tracks(a), _cut_tracks(b)
    if not len(ours.track) or not len(theirs.track):
        return []
    latest = np.maximum.accumulate(theirs.end)
    first: dict[tuple[int, int], Crossing] = {}
    seen = 0
    for at in range(0, len(ours.track), _AT_ONCE):
        some = ours.part(at, at + _AT_ONCE)
        low = int(np.searchsorted(latest, some.begin.min() - within))
        high = int(np.searchsorted(theirs.begin, some.end.max() + within, "right"))
        others = theirs.part(low, high)
        for own, other in _meeting_pieces(some, others, within):
            seen += len(own)
            if seen > MOST_MEETINGS:
                raise InputError(
                    f"more than {MOST_MEETINGS:,} pieces of tracks lie upon each other at a time; "
                    "choose a part of the recording with --window"
                )
            for crossing in _cross_pieces(some, others, own, other, within):
                pair = crossing.a, crossing.b
                if pair not in first or crossing.a_time < first[pair].a_time:
                    first[pair] = crossing
    return list(first.values())


def _cut_tracks(tracks: Sequence[FloatArray]) -> _Pieces:
    cut: list[FloatArray] = []
    of_track: list[int] = []
    for row, points in enumerate(tracks):
        for begin in range(0, len(points) - 1, _SEGMENTS):
            piece = points[begin : begin + _SEGMENTS + 1]
            missing = _SEGMENTS + 1 - len(piece)
            cut.append(np.concatenate([piece, np.repeat(piece[-1:], missing, axis=0)]))
            of_track.append(row)
    points = np.array(cut).reshape(-1, _SEGMENTS + 1, 3)
    order = np.argsort(points[:, 0, 0], kind="stable")
    points = points[order]
    track = np.array(of_track, dtype=np.int64)[order]
    return _Pieces(track, points, points[:, 0, 0], points[:, -1, 0])


def _meeting_pieces(
    ours: _Pieces, theirs: _Pieces, within: float
) -> Iterator[tuple[IntArray, IntArray]]:
    """Pairs of pieces whose boxes lie upon each other, and whose times do nearly."""
    import shapely

    if not len(theirs.track):
        return
    boxes = [shapely.box(*_bounds_of(pieces)) for pieces in (ours, theirs)]
    tree = shapely.STRtree(boxes[1])
    for at in range(0, len(boxes[0]), _SEGMENTS):
        own, other = tree.query(boxes[0][at : at + _SEGMENTS])
        own = own + at
        near = theirs.begin[other] <= ours.end[own] + within
        near &= theirs.end[other] >= ours.begin[own] - within
        own, other = own[near], other[near]
        for begin in range(0, len(own), _BATCH):
            yield own[begin : begin + _BATCH], other[begin : begin + _BATCH]


def _bounds_of(pieces: _Pieces) -> tuple[FloatArray, ...]:
    low, high = pieces.points[..., 1:].min(axis=1), pieces.points[..., 1:].max(axis=1)
    return low[:, 0], low[:, 1], high[:, 0], high[:, 1]


def _cross_pieces(
    ours: _Pieces, theirs: _Pieces, own: IntArray, other: IntArray, within: float
) -> Iterator[Crossing]:
    a, b = ours.points[own], theirs.points[other]
    p, r = a[:, :-1, None, 1:], np.diff(a[..., 1:], axis=1)[:, :, None, :]
    q, s = b[:, None, :-1, 1:], np.diff(b[..., 1:], axis=1)[:, None, :, :]
    cross = r[..., 0] * s[..., 1] - r[..., 1] * s[..., 0]
    away = q - p
    with np.errstate(divide="ignore", invalid="ignore"):
        t = (away[..., 0] * s[..., 1] - away[..., 1] * s[..., 0]) / cross
        u = (away[..., 0] * r[..., 1] - away[..., 1] * r[..., 0]) / cross
    hit = (cross != 0.0) & (t >= 0.0) & (t < 1.0) & (u >= 0.0) & (u < 1.0)
    k, i, j = np.nonzero(hit)
    places = a[k, i] + t[hit][:, None] * (a[k, i + 1] - a[k, i])
    b_times: Any = b[k, j, 0] + u[hit] * (b[k, j + 1, 0] - b[k, j, 0])
    for row in np.flatnonzero(np.abs(places[:, 0] - b_times) < within).tolist():
        a_time, x, y = places[row].tolist()
        pair = int(ours.track[own[k[row]]]), int(theirs.track[other[k[row]]])
        yield Crossing(*pair, x, y, a_time, float(b_times[row]))
