"""Roads that are in a file more than once (:attr:`Rule.COINCIDENT_ROAD`)."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace
from typing import TYPE_CHECKING

from odscen.base.ids import RoadId
from odscen.base.shown import shown_id
from odscen.opendrive.parse_rules import Notes, Rule

if TYPE_CHECKING:
    from collections.abc import Iterable

    from odscen.opendrive.road_model import Junction, Road, RoadLink


def merge_coincident_roads(
    roads: dict[RoadId, Road], junctions: Iterable[Junction], notes: Notes
) -> dict[RoadId, Road]:
    """Keep one of roads that are alike, lead links to it, and note each that is left out.

    Roads that a junction names stay: its connections may tell them apart.
    """
    kept = _find_kept_roads(roads, junctions)
    if not kept:
        return roads
    for road, other in kept.items():
        detail = f"is as road {shown_id(other)} in all but id and name; it is merged with it"
        notes.add(Rule.COINCIDENT_ROAD, f"road {shown_id(road)}", detail)
    return {
        key: replace(
            road,
            predecessor=_redirect_link(road.predecessor, kept),
            successor=_redirect_link(road.successor, kept),
        )
        for key, road in roads.items()
        if key not in kept
    }


def _find_kept_roads(
    roads: dict[RoadId, Road], junctions: Iterable[Junction]
) -> dict[RoadId, RoadId]:
    """The first of the roads that are alike, for each of the others."""
    named = {
        road
        for junction in junctions
        for connection in junction.connections
        for road in (connection.incoming_road, connection.connecting_road)
    }
    free = [road for road in roads.values() if road.junction is None and road.id not in named]
    places = Counter(road.geometry for road in free)
    first: dict[str, RoadId] = {}
    kept: dict[RoadId, RoadId] = {}
    for road in free:
        if places[road.geometry] > 1:
            # A road has no hash, for its lanes are in dictionaries.
            content = repr(replace(road, id=RoadId(""), name=""))
            own = first.setdefault(content, road.id)
            if own != road.id:
                kept[road.id] = own
    return kept


def _redirect_link(link: RoadLink | None, kept: dict[RoadId, RoadId]) -> RoadLink | None:
    if link is None or link.element_type != "road":
        return link
    own = RoadId(link.element_id)
    return link._replace(element_id=kept.get(own, own))
