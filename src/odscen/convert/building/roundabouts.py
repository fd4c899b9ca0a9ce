"""Roundabouts: circles of one-way edges that turn as traffic goes round."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import TYPE_CHECKING

from odscen.convert.model.right_of_way import wrapped

if TYPE_CHECKING:
    from collections.abc import Sequence

    from odscen.convert.model.connections import PlannedConnection
    from odscen.convert.model.edge_plan import EdgePlan
    from odscen.convert.model.lane_alignment import Line

LONGEST = 600.0
"""Metres around a roundabout, at most."""

MOST_EDGES = 60


def find_roundabouts(
    edges: Sequence[EdgePlan],
    connections: Sequence[PlannedConnection],
    lane_lines: Sequence[Sequence[Line]],
    connection_lines: Sequence[Line],
    *,
    lefthand: bool,
) -> tuple[tuple[int, ...], ...]:
    """Positions of the edges of each roundabout, in driving direction.

    Parameters
    ----------
    lane_lines, connection_lines
        The lanes of each edge, and each connection, evaluated.
    """
    sides: dict[int, set[bool]] = {}
    for edge in edges:
        sides.setdefault(edge.road, set()).add(edge.forward)
    one_way = [len(sides[edge.road]) == 1 for edge in edges]
    following: dict[int, dict[int, float]] = {}
    for connection, line in zip(connections, connection_lines, strict=True):
        if one_way[connection.source] and one_way[connection.target]:
            turn = _turned(line)
            known = following.setdefault(connection.source, {})
            target = connection.target
            if target not in known or abs(turn) < abs(known[target]):
                known[target] = turn
    wanted = -2.0 * math.pi if lefthand else 2.0 * math.pi
    roundabouts: list[tuple[int, ...]] = []
    taken: set[int] = set()
    for start in sorted(following):
        if start in taken:
            continue
        roundabout = _around(start, following, lane_lines, wanted)
        if roundabout and not taken & set(roundabout):
            roundabouts.append(roundabout)
            taken |= set(roundabout)
    return tuple(roundabouts)


def _around(
    start: int,
    following: dict[int, dict[int, float]],
    lines: Sequence[Sequence[Line]],
    wanted: float,
) -> tuple[int, ...]:
    """The edges round from an edge back to it, inwards at every choice, or nothing."""
    side = math.copysign(1.0, wanted)
    roundabout = [start]
    turned, length = _turned(lines[start][0]), lines[start][0].length
    while len(roundabout) <= MOST_EDGES and length <= LONGEST:
        choices = following.get(roundabout[-1], {})
        if not choices:
            return ()
        # The roundabout continues where the connection turns most to the inside.
        edge = max(choices, key=lambda n: (side * choices[n], -n))
        turned += choices[edge]
        if edge == start:
            return tuple(roundabout) if abs(turned - wanted) < 0.6 else ()
        if edge in roundabout:
            return ()
        roundabout.append(edge)
        turned += _turned(lines[edge][0])
        length += lines[edge][0].length
    return ()


def _turned(line: Line) -> float:
    """Change of heading along a line, summed over its vertices, radians."""
    steps = line.shape[1:, :2] - line.shape[:-1, :2]
    headings = [math.atan2(y, x) for x, y in steps.tolist()]
    return sum(wrapped(b - a) for a, b in pairwise(headings))
