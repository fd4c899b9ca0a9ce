"""What of a scenario the SUMO network of its map does not hold: places and routes."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from odscen.scenario.document.problems import warning
from odscen.scenario.document.scenario_document import Demand, Transit
from odscen.scenario.placing.region import place_of
from odscen.sumo.realize.realization import realize

if TYPE_CHECKING:
    from collections.abc import Iterator

    from odscen.scenario.document.problems import Problem
    from odscen.scenario.document.scenario_document import Scenario
    from odscen.scenario.placing.region import NodePlace
    from odscen.sumo.realize.sumo_map import SumoMap

ASIDE = 0.25
"""Metres between a spawn and the SUMO lane on which it is inserted that are worth a warning."""


def place_fit(scenario: Scenario, sumo_map: SumoMap) -> Iterator[Problem]:
    """Yield spawns of actors and flows where the network has no lane, or has it elsewhere."""
    for kind in ("actors", "flows"):
        for index, user in enumerate(getattr(scenario, kind)):
            place = place_of(sumo_map.graph, user.spawn)
            if place is None:
                continue
            where, aside = f"{kind}[{index}].spawn", _distance_aside(sumo_map, place)
            if np.isnan(aside):
                message = (
                    f"{user.id!r} starts on {user.spawn!r}, where the SUMO network of the map has "
                    "no lane, and will not be inserted; pick another node"
                )
                yield warning("no_sumo_lane", where, message, nodes=[user.spawn])
            elif aside > ASIDE:
                message = (
                    f"{user.id!r} starts on {user.spawn!r}, but SUMO's lane lies {aside:.2f} m "
                    "beside it, and that is where it is inserted"
                )
                yield warning("sumo_lane_aside", where, message, nodes=[user.spawn])


def _distance_aside(sumo_map: SumoMap, place: NodePlace) -> float:
    """Metres between a node and its SUMO lane; NaN without one."""
    places = sumo_map.walk_places if place.walk else sumo_map.lane_places
    return float(places.deviation[place.node])


def route_fit(scenario: Scenario, sumo_map: SumoMap) -> Iterator[Problem]:
    """Yield actors that have no route on the network; the scenario must be without errors.

    Members of flows, of the demand and of lines are left out: there are many, and a run names those
    that it cannot insert.
    """
    own = scenario.model_copy(update={"flows": (), "demand": Demand(), "transit": Transit()})
    planned = realize(own, sumo_map).plan.actors
    reasons = {actor.id: actor.problem for actor in planned if actor.problem}
    for index, actor in enumerate(scenario.actors):
        place = place_of(sumo_map.graph, actor.spawn)
        if (
            actor.id in reasons
            and place is not None
            and not np.isnan(_distance_aside(sumo_map, place))
        ):
            message = f"{actor.id!r} will not be inserted: {reasons[actor.id]}"
            yield warning("no_sumo_route", f"actors[{index}]", message, nodes=[actor.spawn])
