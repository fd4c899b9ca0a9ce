"""How many lanes lie on each other: what searches around a place cost grows with their square."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from scipy.spatial import cKDTree

from odscen.base.errors import OpenDriveError
from odscen.base.shown import shown_id

if TYPE_CHECKING:
    from odscen.base.arrays import FloatArray, IntArray
    from odscen.opendrive.lanes import RoadTable

MOST_TOGETHER = 64
"""Drivable lanes, or walks, through one cube of :data:`CUBE`; junctions of towns have 15."""

CUBE = 1.0
"""Metres."""

MOST_ENDS = 64
"""Ends of walks that one could be joined with; junctions of towns have 13."""


def check_density(table: RoadTable, lane: IntArray, places: FloatArray) -> None:
    """Refuse a map on which more lanes than :data:`MOST_TOGETHER` lie in one place.

    Parameters
    ----------
    table
        The roads.
    lane
        Shape ``(N,)``: row of the table of each node.
    places
        Shape ``(3, N)``: x, y, z of the nodes in metres.

    Raises
    ------
    OpenDriveError
        Naming the place and two of the roads.
    """
    if len(lane) <= MOST_TOGETHER:
        return
    rows = np.stack([*np.floor(places / CUBE), lane])
    rows = rows[:, np.lexsort(rows[::-1])]
    rows = rows[:, np.append(True, np.any(np.diff(rows, axis=1), axis=0))]  # lanes once a cube
    begins = np.flatnonzero(np.append(True, np.any(np.diff(rows[:3], axis=1), axis=0)))
    counts = np.diff(np.append(begins, rows.shape[1]))
    worst = int(np.argmax(counts))
    if counts[worst] <= MOST_TOGETHER:
        return
    first, last = begins[worst], begins[worst] + counts[worst] - 1
    one, other = (table.lane_keys[int(rows[3, column])] for column in (first, last))
    x, y = (float(value) * CUBE for value in rows[:2, first])
    problem = (
        f"{counts[worst]} lanes lie on each other at ({x:g}, {y:g}), the last of them lane "
        f"{other.lane} of road {shown_id(other.road)}, laneSection {other.section}; "
        f"the limit is {MOST_TOGETHER}"
    )
    raise OpenDriveError(
        problem, element=f"road {shown_id(one.road)} > laneSection {one.section} > lane {one.lane}"
    )


def check_ends(table: RoadTable, rows: IntArray, ends: FloatArray, *, reach: float) -> None:
    """Refuse a map on which more ends of walks than :data:`MOST_ENDS` are in reach of one.

    Parameters
    ----------
    table
        The roads.
    rows
        Shape ``(N,)``: row of the table of each end.
    ends
        Shape ``(N, 3)``: x, y, z in metres.
    reach
        Metres.

    Raises
    ------
    OpenDriveError
        Naming the lane with the most, and the place.
    """
    if len(ends) <= MOST_ENDS:
        return
    found = cKDTree(ends).query_ball_point(ends, reach, return_length=True)
    counts = np.asarray(found, dtype=np.int64)
    worst = int(np.argmax(counts))
    if counts[worst] <= MOST_ENDS:
        return
    x, y = (float(value) for value in ends[worst, :2])
    lane = table.lane_keys[int(rows[worst])]
    problem = (
        f"{counts[worst]} ends of lanes or lane sections with a walk beside or on them lie within "
        f"{reach:g} m of ({x:.6g}, {y:.6g}); the limit is {MOST_ENDS}"
    )
    raise OpenDriveError(
        problem,
        element=f"road {shown_id(lane.road)} > laneSection {lane.section} > lane {lane.lane}",
    )
