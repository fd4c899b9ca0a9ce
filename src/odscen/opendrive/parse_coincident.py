"""Roads that are in a file more than once (:attr:`Rule.COINCIDENT_ROAD`)."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace
from typing import TYPE_CHECKING

from odscen.base.ids import RoadId
from odscen.base.shown import shown_id
from odscen.opendrive.parse_rules import Notes, Rule

if TYPE_CHECKING:
    from odscen.base.ids import JunctionId
    from odscen.opendrive.road_model import Junction, Road, RoadLink

    Roads = dict[RoadId, Road]
    Junctions = dict[JunctionId, Junction]


def merge_coincident_roads(
    roads: Roads, junctions: Junctions, notes: Notes
) -> tuple[Roads, Junctions]:
    """Keep one of roads that are alike, lead references to it, and note each that is left out."""
    kept = _kept(roads)
    if not kept:
        return roads, junctions
    for road, other in kept.items():
        detail = f"is as road {shown_id(other)} in all but id and name; it is merged with it"
        notes.add(Rule.COINCIDENT_ROAD, f"road {shown_id(road)}", detail)
    merged = {
        key: replace(
            road,
            predecessor=_link(road.predecessor, kept),
            successor=_link(road.successor, kept),
        )
        for key, road in roads.items()
        if key not in kept
    }
    return merged, {key: _junction(one, kept) for key, one in junctions.items()}


def _kept(roads: Roads) -> dict[RoadId, RoadId]:
    """The first of the roads that are alike, for each of the others."""
    outside = [road for road in roads.values() if road.junction is None]
    places = Counter(road.geometry for road in outside)
    first: dict[str, RoadId] = {}
    kept: dict[RoadId, RoadId] = {}
    for road in outside:
        if places[road.geometry] > 1:
            # A road has no hash, for its lanes are in dictionaries.
            content = repr(replace(road, id=RoadId(""), name=""))
            own = first.setdefault(content, road.id)
            if own != road.id:
                kept[road.id] = own
    return kept


def _link(link: RoadLink | None, kept: dict[RoadId, RoadId]) -> RoadLink | None:
    if link is None or link.element_type != "road":
        return link
    own = RoadId(link.element_id)
    return link._replace(element_id=kept.get(own, own))


def _junction(junction: Junction, kept: dict[RoadId, RoadId]) -> Junction:
    connections = [
        one._replace(
            incoming_road=kept.get(one.incoming_road, one.incoming_road),
            connecting_road=kept.get(one.connecting_road, one.connecting_road),
        )
        for one in junction.connections
    ]
    priorities = [
        one._replace(high=kept.get(one.high, one.high), low=kept.get(one.low, one.low))
        for one in junction.priorities
    ]
    main_road = junction.main_road
    return replace(
        junction,
        connections=tuple(connections),
        priorities=tuple(dict.fromkeys(priorities)),
        main_road=None if main_road is None else kept.get(main_road, main_road),
    )
