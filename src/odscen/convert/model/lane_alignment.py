"""Lane alignments: what SUMO lanes are laid on, stretch by stretch of OpenDRIVE lanes.

An alignment becomes the shape of a SUMO lane, and the intervals of the lane table, in one pass for
all lanes of a map.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from collections.abc import Sequence

    from odscen.base.arrays import FloatArray
    from odscen.opendrive.lanes import RoadTable

IndexArray = NDArray[np.intp]

CHORD_ERROR = 0.01
"""Metres between a lane's centre line and its shape, at most."""

DENSE = 0.25
"""Metres between the places from which the vertices of a shape are chosen."""

MOST_PLACES = 2_000_000
"""Maps with more than 1,000 km of lanes are sampled less densely."""

_LEAST = 1e-3
"""Metres between vertices."""

_STEP_BACK = 0.05
"""Metres; converters round places by less."""

_LONGEST_CUSP = 10.0
"""Metres that a lane runs back between two turns, at most."""

_REVERSED = -0.5
"""Cosine of the angle at which a lane turns round, at most."""

_NEAR = 2.0
"""Metres between the end of a stretch and the start of the next, if they are meant to meet."""


class Stretch(NamedTuple):
    """Part of an OpenDRIVE lane (a row of the road table) in the direction that it is gone along.

    ``at`` says where across the lane: 0.5 is its centre, 1 its outer border; ``beside`` adds metres
    outwards from there.
    """

    row: int
    start: float
    end: float
    at: float = 0.5
    beside: float = 0.0

    @property
    def extent(self) -> float:
        """Metres of s."""
        return abs(self.end - self.start)


LaneAlignment = tuple[Stretch, ...]


@dataclass(frozen=True, slots=True, eq=False)
class Line:
    """A lane alignment evaluated.

    Attributes
    ----------
    shape
        Shape ``(K, 3)``: vertices within :data:`CHORD_ERROR` of the lanes' centres.
    length
        Metres along ``shape``.
    arc, s
        For each stretch of the alignment: metres along the line at its sampled places, and their
        road coordinates.
    widths
        Smallest, median and largest width of the lanes, metres.
    """

    shape: FloatArray
    length: float
    arc: tuple[FloatArray, ...]
    s: tuple[FloatArray, ...]
    widths: tuple[float, float, float]

    def headings(self) -> tuple[float, float]:
        """Direction at both ends, radians."""
        first, last = self.shape[1] - self.shape[0], self.shape[-1] - self.shape[-2]
        return float(np.arctan2(first[1], first[0])), float(np.arctan2(last[1], last[0]))


def divided(
    line: Line, alignment: LaneAlignment, at: float
) -> tuple[tuple[Line, LaneAlignment], tuple[Line, LaneAlignment]]:
    """Divide a line and its alignment ``at`` metres from the start."""
    first: list[tuple[Stretch, FloatArray, FloatArray]] = []
    second: list[tuple[Stretch, FloatArray, FloatArray]] = []
    for stretch, arc, s in zip(alignment, line.arc, line.s, strict=True):
        if arc[-1] <= at:
            first.append((stretch, arc, s))
        elif arc[0] >= at:
            second.append((stretch, arc - at, s))
        else:
            cut, place = float(np.interp(at, arc, s)), np.array([at])
            before, after = arc < at, arc > at
            first.append(
                (
                    stretch._replace(end=cut),
                    np.concatenate((arc[before], place)),
                    np.concatenate((s[before], [cut])),
                )
            )
            second.append(
                (
                    stretch._replace(start=cut),
                    np.concatenate((place, arc[after])) - at,
                    np.concatenate(([cut], s[after])),
                )
            )
    shapes = divided_shape(line.shape, at)
    parts = []
    for shape, own in zip(shapes, (first, second), strict=True):
        length = drawn_length(shape)
        arcs, places = tuple(arc for _, arc, _ in own), tuple(s for _, _, s in own)
        parts.append((Line(shape, length, arcs, places, line.widths), tuple(x for x, _, _ in own)))
    return parts[0], parts[1]


def divided_shape(shape: FloatArray, at: float) -> tuple[FloatArray, FloatArray]:
    """Divide a shape ``at`` metres from its start; both parts have the place between them."""
    steps = np.sqrt((np.diff(shape, axis=0) ** 2).sum(axis=1))
    along = np.concatenate(([0.0], np.cumsum(steps)))
    place = np.array([[np.interp(at, along, shape[:, k]) for k in range(3)]])
    before, after = along < at - _LEAST, along > at + _LEAST
    return np.concatenate((shape[before], place)), np.concatenate((place, shape[after]))


def evaluate(alignments: Sequence[LaneAlignment], table: RoadTable) -> list[Line]:
    """Evaluate alignments; each must be longer than a millimetre."""
    if not alignments:
        return []
    flat = [stretch for alignment in alignments for stretch in alignment]
    rows = np.array([stretch.row for stretch in flat], dtype=np.int64)
    start = np.array([stretch.start for stretch in flat])
    end = np.array([stretch.end for stretch in flat])
    of_alignment = np.concatenate(([0], np.cumsum([len(alignment) for alignment in alignments])))
    inner = np.setdiff1d(np.arange(len(flat) - 1), of_alignment[1:] - 1)
    end = _without_steps_back(flat, inner, end, table)
    step = max(DENSE, float(np.abs(end - start).sum()) / MOST_PLACES)
    first, owner, share = spread(np.abs(end - start), step)
    s = start[owner] + share * (end - start)[owner]
    found = table.lane_points(rows[owner], s, at=np.array([x.at for x in flat])[owner])
    out = np.array([x.beside for x in flat])[owner] * np.sign(table.lane_id[rows[owner]])
    x, y = found.x - out * np.sin(found.hdg), found.y + out * np.cos(found.hdg)
    points = np.column_stack((x, y, found.z))
    _straighten_cusps(points, found.hdg, owner)
    bounds = first[of_alignment]
    shapes = thinned([_drop_repeated_vertices(points[a:b]) for a, b in pairwise(bounds)])
    lines: list[Line] = []
    for number, shape in enumerate(shapes):
        a, b = bounds[number], bounds[number + 1]
        steps = np.sqrt((np.diff(points[a:b], axis=0) ** 2).sum(axis=1))
        arc = np.concatenate(([0.0], np.cumsum(steps)))
        length = drawn_length(shape)
        arc *= length / max(arc[-1], 1e-9)
        cuts = first[of_alignment[number] + 1 : of_alignment[number + 1]] - a
        width = found.width[a:b]
        lines.append(
            Line(
                shape,
                length,
                tuple(np.split(arc, cuts)),
                tuple(np.split(s[a:b], cuts)),
                (float(width.min()), float(np.median(width)), float(width.max())),
            )
        )
    return lines


def _without_steps_back(
    flat: Sequence[Stretch], inner: IndexArray, end: FloatArray, table: RoadTable
) -> FloatArray:
    """Ends of stretches, those earlier behind whose end the next stretch begins.

    A connecting road that does not begin in the direction in which the road before it ends has its
    lanes a little behind the ends of that road's: vehicles would go back and turn round twice.

    Parameters
    ----------
    inner
        Rows of the stretches that another one follows.
    """
    ending = [flat[row] for row in inner]
    following = [flat[row + 1] for row in inner]
    if not ending:
        return end
    places = table.lane_points(
        np.array([stretch.row for stretch in (*ending, *following)], dtype=np.int64),
        np.array([*(stretch.end for stretch in ending), *(after.start for after in following)]),
        at=np.array([stretch.at for stretch in (*ending, *following)]),
    )
    count = len(ending)
    sense = np.array([np.sign(stretch.end - stretch.start) for stretch in ending])
    away = np.stack([places.x[count:] - places.x[:count], places.y[count:] - places.y[:count]])
    heading = places.hdg[:count]
    along = sense * (away[0] * np.cos(heading) + away[1] * np.sin(heading))
    extent = np.array([stretch.extent for stretch in ending])
    back = (-along > _STEP_BACK) & (np.hypot(*away) < _NEAR) & (-along < extent - DENSE)
    shortened = end.copy()
    shortened[inner[back]] += sense[back] * along[back]
    return shortened


def _straighten_cusps(points: FloatArray, headings: FloatArray, owner: IndexArray) -> None:
    """Lead past cusps, in place: a lane on the inner side of a bend sharper than its distance.

    Such a lane turns round, runs back for a while and turns round again, across itself. It is
    straight from before the place where it crosses itself to behind it.

    Parameters
    ----------
    points
        Shape ``(N, 3)``: places along stretches.
    headings, owner
        Shape ``(N,)``: direction of the lane at each place, radians, and its stretch.
    """
    same = owner[1:] == owner[:-1]
    turns = np.flatnonzero(same & (np.cos(np.diff(headings)) < _REVERSED))
    if len(turns) < 2:
        return
    steps = np.diff(points[:, :2], axis=0)
    lengths = np.hypot(*steps.T)
    place = 0
    while place < len(turns) - 1:
        begin, end = int(turns[place]), int(turns[place + 1]) + 1
        place += 1
        if owner[begin] != owner[end] or lengths[begin:end].sum() > _LONGEST_CUSP:
            continue
        place += 1
        reach = 4 * (end - begin)
        own = np.flatnonzero(owner == owner[begin])
        low, high = max(int(own[0]), begin - reach), min(int(own[-1]), end + reach)
        # Both lie ahead of each other where the lane has crossed itself: no corner turns back.
        there, on = slice(low, begin), slice(end, high)
        apart = points[None, on, :2] - points[there, None, :2]
        ahead = (np.einsum("ijk,ik->ij", apart, steps[there]) > 0.0) & (
            np.einsum("ijk,jk->ij", apart, steps[on]) > 0.0
        )
        distance = np.where(ahead, np.hypot(apart[..., 0], apart[..., 1]), np.inf)
        if np.isfinite(distance.min(initial=np.inf)):
            row, column = np.unravel_index(int(np.argmin(distance)), distance.shape)
            first, last = low + int(row), end + int(column)
            points[first : last + 1] = np.linspace(points[first], points[last], last - first + 1)


def spread(extents: FloatArray, step: float) -> tuple[IndexArray, IndexArray, FloatArray]:
    """Places along stretches, both ends of each included.

    Parameters
    ----------
    extents
        Shape ``(L,)``: length of each stretch, metres.
    step
        Metres between places, at most.

    Returns
    -------
    Shape ``(L + 1,)``: first place of each stretch; shapes ``(N,)``: the stretch of each place and
    how far along it is, from 0 to 1.
    """
    counts = np.maximum(1, np.ceil(extents / step)).astype(np.intp) + 1
    first = np.concatenate(([0], np.cumsum(counts))).astype(np.intp)
    owner = np.repeat(np.arange(len(counts)), counts)
    return first, owner, (np.arange(first[-1]) - first[owner]) / (counts[owner] - 1)


def drawn_length(shape: FloatArray) -> float:
    """Length of a shape in space, as SUMO measures it."""
    return float(np.sqrt((np.diff(shape, axis=0) ** 2).sum(axis=1)).sum())


def _drop_repeated_vertices(shape: FloatArray) -> FloatArray:
    """Drop vertices on top of the one before; first and last stay."""
    steps = np.hypot(*np.diff(shape[:, :2], axis=0).T)
    keep = np.concatenate(([True], steps > _LEAST))
    if not keep[-1]:
        keep[np.flatnonzero(keep)[-1]] = False
        keep[0] = keep[-1] = True
    return shape[keep]


def thinned(shapes: Sequence[FloatArray]) -> list[FloatArray]:
    """Leave out vertices within :data:`CHORD_ERROR` of the chord (Douglas-Peucker, all at once)."""
    counts = np.array([len(shape) for shape in shapes])
    bounds = np.concatenate(([0], np.cumsum(counts)))
    points = np.concatenate(list(shapes))
    keep = np.zeros(len(points), dtype=np.bool_)
    keep[bounds[:-1]] = keep[bounds[1:] - 1] = True
    while True:
        kept = np.flatnonzero(keep)
        span = np.cumsum(keep) - 1
        start = points[kept[span]]
        chord = points[kept[np.minimum(span + 1, len(kept) - 1)]] - start
        error = _distance_from_chord(points - start, chord)
        error[keep] = 0.0
        worst = np.maximum.reduceat(error, kept)
        new = (error > CHORD_ERROR) & (error >= worst[span])
        if not new.any():
            break
        keep |= new
    return [points[a:b][keep[a:b]] for a, b in pairwise(bounds)]


def _distance_from_chord(delta: FloatArray, chord: FloatArray) -> FloatArray:
    """Distance of points ``delta`` from the stretch from the origin to ``chord``."""
    square = np.maximum(np.einsum("ij,ij->i", chord, chord), 1e-12)
    share = np.clip(np.einsum("ij,ij->i", delta, chord) / square, 0.0, 1.0)
    distance: FloatArray = np.linalg.norm(delta - share[:, None] * chord, axis=1)
    return distance
