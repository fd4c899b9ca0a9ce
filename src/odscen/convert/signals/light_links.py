"""What the links of a traffic light are: movements by lanes and turn, crossings by their edges."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from odscen.base.ids import SumoEdgeId
from odscen.convert.model.net import CROSSED, LightLink
from odscen.convert.model.net_ids import lane_id

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from odscen.base.arrays import FloatArray
    from odscen.base.ids import SumoLaneId
    from odscen.convert.model.right_of_way import Movement, Walkway
    from odscen.convert.pedestrian.pedestrian_network import PlacedCrossing

POINTS = 9
"""Points of a link's path, at most."""

_STRAIGHT = math.radians(30.0)
_AROUND = math.radians(150.0)


def light_links(
    rows: Iterable[int],
    movements: Sequence[Movement],
    crossings: Sequence[PlacedCrossing],
    crossed: Sequence[Sequence[int]],
) -> tuple[LightLink, ...]:
    """Links of a light in their order.

    Parameters
    ----------
    rows
        Links of the junction that the light controls: movements first, then crossings.
    crossed
        Movements that each crossing leads over.
    """
    count = len(movements)
    return tuple(
        moving_link(movements[n])
        if n < count
        else _walking_light_link(crossings[n - count], [movements[k] for k in crossed[n - count]])
        for n in rows
    )


def direction(turn: float) -> str:
    """SUMO's letter for a change of heading, radians, left positive."""
    if abs(turn) < _STRAIGHT:
        return "s"
    if abs(turn) > _AROUND:
        return "t"
    return "l" if turn > 0.0 else "r"


def nearer_edge(movement: Movement, crossing: PlacedCrossing) -> SumoEdgeId:
    """Edge whose end or start a crossing is nearer to: what SUMO calls the crossed edge."""
    middle = crossing.walkway.axis[:, :2].mean(axis=0)
    ends = movement.shape[[0, -1], :2]
    gaps = np.hypot(*(ends - middle).T)
    return SumoEdgeId(movement.source[0] if gaps[0] <= gaps[1] else movement.target[0])


def moving_link(movement: Movement) -> LightLink:
    """Link of a movement."""
    return LightLink(
        lane_id(*movement.source),
        lane_id(*movement.target),
        direction(movement.turn),
        movement.speed,
        path=_sample_points(movement.shape),
    )


def walking_link(
    ends: tuple[SumoLaneId, SumoLaneId], walkway: Walkway, crossed: Sequence[SumoEdgeId]
) -> LightLink:
    """Link of a crossing.

    Parameters
    ----------
    ends
        Lanes of the walking areas at its ends.
    crossed
        Edges that it leads over.
    """
    return LightLink(*ends, CROSSED, crossed=tuple(crossed), path=_sample_points(walkway.axis))


def _sample_points(shape: FloatArray) -> tuple[tuple[float, float], ...]:
    """At most :data:`POINTS` points of a line, in centimetres."""
    rows = np.unique(np.linspace(0, len(shape) - 1, POINTS).round().astype(int))
    return tuple((round(float(x), 2), round(float(y), 2)) for x, y in shape[rows, :2])


def _walking_light_link(crossing: PlacedCrossing, movements: Sequence[Movement]) -> LightLink:
    edges = dict.fromkeys(nearer_edge(movement, crossing) for movement in movements)
    ends = lane_id(crossing.start), lane_id(crossing.link.target)
    return walking_link(ends, crossing.walkway, tuple(edges))
