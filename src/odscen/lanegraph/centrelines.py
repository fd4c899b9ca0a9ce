"""Distances along lanes: from s to metres along the lane's centre line and back.

s runs along the reference line; on the inside of a curve a lane is shorter than that, on the
outside longer. All lanes of a map are sampled in one pass, at equal steps of s, so that an s is
found among the samples without a search.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from odscen.base.errors import OpenDriveError
from odscen.base.shown import shown_id

if TYPE_CHECKING:
    from odscen.base.arrays import BoolArray, FloatArray, IntArray
    from odscen.opendrive.lanes import RoadTable

SAMPLE_STEP = 1.0
"""Metres of s between samples of a centre line; a chord of 1 m at radius 5 m is 0.2 % short."""

MOST_LANES = 1e6
"""Metres of all lanes, or of all walks, of a map, if nothing else is allowed; a sample takes about
0.3 kB of memory."""
NODES_PER_METRE = 2.0
"""Nodes for each metre that is allowed, at most; they take about 0.5 kB of memory each."""
MORE_LANES = "a build that may use more memory (--build-memory) may have more"


@dataclass(frozen=True, slots=True, eq=False)
class CentreLines:
    """Lengths along the centre lines of some lanes. Lanes are numbered from 0 to ``L - 1``.

    Attributes
    ----------
    rows
        Shape ``(L,)``: the lane's row of the road table.
    s0, s1
        Shape ``(L,)``: where the lane starts and ends, metres of s.
    forward
        Shape ``(L,)``: whether offsets are counted with growing s.
    first
        Shape ``(L + 1,)``: samples of lane ``i`` are ``first[i]`` to ``first[i + 1]``.
    distance
        Shape ``(S,)``: metres along the centre line from s0 to the sample.
    lengths
        Shape ``(L,)``: metres.
    """

    rows: IntArray
    s0: FloatArray
    s1: FloatArray
    forward: BoolArray
    first: IntArray
    distance: FloatArray
    lengths: FloatArray

    @classmethod
    def of(
        cls,
        table: RoadTable,
        rows: IntArray,
        *,
        forward: BoolArray,
        at: FloatArray,
        most: float = MOST_LANES,
    ) -> CentreLines:
        """Sample lanes.

        Parameters
        ----------
        table
            The roads.
        rows
            Shape ``(L,)``: lanes, as rows of the table.
        forward
            Shape ``(L,)``: see the class.
        at
            Shape ``(L,)``: where across the lane; 0.5 is the centre, 1 the outer border.
        most
            Metres that the lanes may have together.

        Raises
        ------
        OpenDriveError
            If the lanes are longer.
        """
        s0, s1 = table.lane_s0[rows], table.lane_s1[rows]
        extent = np.maximum(s1 - s0, 0.0)
        total = float(np.sum(extent)) / SAMPLE_STEP + 2 * len(rows)
        if not total < most / SAMPLE_STEP:
            longest = table.lane_keys[int(rows[np.argmax(extent)])]
            raise OpenDriveError(
                f"the lanes of the map are {np.sum(extent):.3g} m long together, "
                f"more than {most:.3g} m; {MORE_LANES}; this road has the longest",
                element=f"road {shown_id(longest.road)}",
            )
        count = np.ceil(extent / SAMPLE_STEP).astype(np.int64) + 1
        count = np.maximum(count, 2)
        first = np.concatenate([[0], np.cumsum(count)]).astype(np.int64)
        lane = np.repeat(np.arange(len(rows)), count)
        step = (np.arange(first[-1]) - first[lane]) / (count - 1)[lane]
        s = s0[lane] + extent[lane] * step
        points = table.lane_points(rows[lane], s, at=at[lane])
        chords = np.sqrt(np.diff(points.x) ** 2 + np.diff(points.y) ** 2 + np.diff(points.z) ** 2)
        gone = np.concatenate([[0.0], np.cumsum(np.where(np.diff(lane) == 0, chords, 0.0))])
        distance = gone - gone[first[:-1]][lane]
        lengths = distance[first[1:] - 1]
        _check_lengths(table, rows, extent, lengths, most)
        return cls(rows, s0, s1, forward, first, distance, lengths)

    def s_at(self, lane: IntArray, offset: FloatArray) -> FloatArray:
        """Road coordinate s at ``offset`` metres along each lane, in its direction."""
        length = self.lengths[lane]
        along = np.where(self.forward[lane], offset, length - offset)
        starts = np.concatenate([[0.0], np.cumsum(self.lengths)])
        of_sample = np.repeat(np.arange(len(self.rows)), np.diff(self.first))
        k = np.searchsorted(starts[of_sample] + self.distance, starts[lane] + along) - 1
        k = np.clip(k, self.first[lane], self.first[lane + 1] - 2)
        chord = self.distance[k + 1] - self.distance[k]
        part = np.where(chord > 0, (along - self.distance[k]) / np.where(chord > 0, chord, 1), 0.5)
        steps = (self.first[lane + 1] - self.first[lane] - 1).astype(np.float64)
        share = (k - self.first[lane] + part) / steps
        s: FloatArray = self.s0[lane] + (self.s1[lane] - self.s0[lane]) * np.clip(share, 0.0, 1.0)
        return s

    def offset_at(self, lane: IntArray, s: FloatArray) -> FloatArray:
        """Metres along each lane, in its direction, at road coordinate s; inverse of `s_at`."""
        extent = self.s1[lane] - self.s0[lane]
        steps = self.first[lane + 1] - self.first[lane] - 1
        share = np.where(extent > 0, (s - self.s0[lane]) / np.where(extent > 0, extent, 1), 0.5)
        place = np.clip(share, 0.0, 1.0) * steps
        k = np.minimum(place.astype(np.int64), steps - 1)
        start = self.first[lane] + k
        before, after = self.distance[start], self.distance[start + 1]
        along = before + (after - before) * (place - k)
        offset: FloatArray = np.where(self.forward[lane], along, self.lengths[lane] - along)
        return offset


def _check_lengths(
    table: RoadTable, rows: IntArray, extent: FloatArray, lengths: FloatArray, most: float
) -> None:
    """Refuse lanes that wind so much that they are longer than the roads they lie on permit."""
    total = float(np.sum(lengths))
    if total <= most:  # not so for NaN, too
        return
    longest = int(np.argmax(np.where(np.isnan(lengths), np.inf, lengths)))
    road, section, lane = table.lane_keys[int(rows[longest])]
    problem = (
        f"is {lengths[longest]:.3g} m long on {extent[longest]:.3g} m of its road; all lanes "
        f"together are {total:.3g} m, the limit is {most:.3g} m; {MORE_LANES}"
    )
    raise OpenDriveError(
        problem, element=f"road {shown_id(road)} > laneSection {section} > lane {lane}"
    )


def node_offsets(
    lengths: FloatArray, spacing: float, *, most: float = MOST_LANES
) -> tuple[IntArray, IntArray, FloatArray]:
    """Place nodes along lanes at equal gaps as near to ``spacing`` as a whole number allows.

    Parameters
    ----------
    lengths
        Shape ``(L,)``, metres.
    spacing
        Metres.
    most
        Metres that the map may have of such lanes; it may have so many nodes too.

    Returns
    -------
    Shape ``(L + 1,)``: first node of each lane; shapes ``(N,)``: lane and offset of each node. A
    lane has ``n = max(1, round(length / spacing))`` nodes, node k at ``(k + 0.5) length / n``, so
    that the gap across the joint of two lanes is about one spacing too.

    Raises
    ------
    OpenDriveError
        If there are more nodes than :data:`NODES_PER_METRE` allows.
    """
    wanted = float(np.sum(lengths)) / spacing
    if not wanted <= (limit := NODES_PER_METRE * most):
        raise OpenDriveError(
            f"{np.sum(lengths):.3g} m of lanes have {wanted:.3g} nodes at a spacing of {spacing:g} "
            f"m; the limit is {limit:g}: choose a larger spacing"
        )
    count = np.maximum(np.rint(lengths / spacing), 1).astype(np.int64)
    first = np.concatenate([[0], np.cumsum(count)]).astype(np.int64)
    lane = np.repeat(np.arange(len(lengths), dtype=np.int64), count)
    k = np.arange(first[-1], dtype=np.int64) - first[lane]
    return first, lane, (k + 0.5) * (lengths / count)[lane]
