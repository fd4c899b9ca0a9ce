"""Lanes in which actors start, as lane changes of the story count from them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from odscen.formats.openscenario_import.import_report import RefusedError

if TYPE_CHECKING:
    from lxml.etree import _Element

    from odscen.formats.openscenario_import.places.map_points import MapPoint
    from odscen.formats.openscenario_import.story.read_conditions import ConditionReader


def start_of(conditions: ConditionReader, actor: str) -> MapPoint | None:
    """Where an actor starts, as the file has it."""
    entities, starts = conditions.entities, conditions.positions.starts
    return next((starts.get(name) for name, one in entities.items() if one.id == actor), None)


def start_lane(conditions: ConditionReader, element: _Element, actor: str) -> tuple[str, int, int]:
    """Road and lane id where an actor starts, and 1 if ids grow to its left, -1 otherwise.

    Who starts in an opposite lane looks along its own ones.

    Raises
    ------
    RefusedError
        If it has no place.
    """
    positions, start = conditions.positions, start_of(conditions, actor)
    if start is None:
        raise RefusedError(element, f"a lane that counts from {actor!r}, which has no place")
    lanes = positions.graph.lanes
    near = positions.node_near(start)
    row, own = (int(lanes.lane[near if node is None else node]) for node in (start.node, near))
    key = lanes.lanes.keys[row]
    return key.road, key.lane, 1 if bool(lanes.lanes.forward[own]) else -1


def to_opposite(
    conditions: ConditionReader, actor: str, road: str, own: int, aim: int
) -> float | None:
    """Metres between the middles of an actor's lane and of a lane beside it that is opposite.

    ``None`` if that is no lane, or leads the actor's own way.
    """
    positions, lanes = conditions.positions, conditions.positions.graph.lanes
    start = start_of(conditions, actor)
    if start is None:
        return None
    near = positions.node_near(start)
    ahead = bool(lanes.lanes.forward[int(lanes.lane[near])])
    widths: list[float] = []
    for lane, forward in ((own, ahead), (aim, not ahead)):
        rows = [
            row
            for row, key in enumerate(lanes.lanes.keys)
            if (key.road, key.lane) == (road, lane) and bool(lanes.lanes.forward[row]) == forward
        ]
        nodes = np.flatnonzero(np.isin(lanes.lane, rows))
        if not nodes.size:
            return None
        away = np.hypot(lanes.x[nodes] - lanes.x[near], lanes.y[nodes] - lanes.y[near])
        widths.append(float(lanes.width[nodes[int(np.argmin(away))]]))
    return round(sum(widths) / 2.0, 3)
