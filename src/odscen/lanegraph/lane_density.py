"""How many lanes lie on each other: what searches around a place cost grows with their square."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from odscen.base.errors import OpenDriveError
from odscen.base.shown import shown_id

if TYPE_CHECKING:
    from odscen.base.arrays import FloatArray, IntArray
    from odscen.opendrive.lanes import RoadTable

MOST_TOGETHER = 64
"""Drivable lanes, or walks, through one cube of :data:`CUBE`; junctions of towns have 15."""

CUBE = 1.0
"""Metres."""


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
    place = f"road {shown_id(one.road)} > laneSection {one.section} > lane {one.lane}"
    raise OpenDriveError(problem, element=place)
