"""Sampled behaviour: desired speed, lateral offset, style and departure of one actor (R40)."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from odscen.base.categories import Category
from odscen.lanegraph.graphs import LaneGraph
from odscen.scenario.checks.actor_checks import SPEED_MAX, SPEED_MIN
from odscen.scenario.document.distributions import draw_key
from odscen.scenario.placing.spawn_room import LANE_MARGIN

if TYPE_CHECKING:
    import numpy as np

    from odscen.base.categories import Body
    from odscen.lanegraph.graphs import PedestrianGraph
    from odscen.scenario.document.sampling_config import Behaviour
    from odscen.scenario.placing.random_places import Spot


def draw_behaviour(
    behaviour: Behaviour,
    graph: LaneGraph | PedestrianGraph,
    spot: Spot,
    body: Body,
    rng: np.random.Generator,
) -> dict[str, Any]:
    """Draw the fields of an actor that say how it moves; speeds and offsets to the centimetre."""
    room = (float(graph.width[spot.node]) - body.width) / 2 - LANE_MARGIN
    fields: dict[str, Any] = {
        "speed": _speed(behaviour, graph, spot, rng),
        "lateral_offset": _within(behaviour.lateral_offset.draw(rng), max(room, 0.0)),
        "depart": round(max(behaviour.depart.draw(rng), 0.0), 1),
    }
    if spot.category is Category.PEDESTRIAN:
        fields["crosses_anywhere"] = bool(rng.random() < behaviour.crosses_anywhere)
        fields["ignores_red"] = bool(rng.random() < behaviour.ignores_red)
    else:
        fields["style"] = draw_key(behaviour.styles, rng)
    return fields


def _speed(
    behaviour: Behaviour,
    graph: LaneGraph | PedestrianGraph,
    spot: Spot,
    rng: np.random.Generator,
) -> float:
    limit = behaviour.unlimited_speed
    if isinstance(graph, LaneGraph) and 0 < graph.speed_limit[spot.node] < math.inf:
        limit = float(graph.speed_limit[spot.node])
    if spot.category is Category.PEDESTRIAN:
        speed = behaviour.walking_speed.draw(rng)
    elif spot.category is Category.BICYCLE:
        speed = min(behaviour.bicycle_speed.draw(rng), limit)
    else:
        speed = behaviour.speed_factor.draw(rng) * limit
    low, high = SPEED_MIN[spot.category], SPEED_MAX[spot.category]
    return min(max(round(speed, 2), low), high)


def _within(offset: float, room: float) -> float:
    """``offset`` cut to ``room`` either side, towards zero to whole centimetres."""
    return math.trunc(max(-room, min(room, offset)) * 100) / 100
