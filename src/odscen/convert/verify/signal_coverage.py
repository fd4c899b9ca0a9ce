"""Traffic lights of a map against those of its SUMO network: which are lost, which invented."""

from __future__ import annotations

from collections import Counter, defaultdict
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from odscen.base.ids import RoadId
from odscen.base.shown import shown_id
from odscen.convert.verify.fidelity_result import NEAR, SignalCoverage
from odscen.convert.verify.polyline_finder import Polylines
from odscen.opendrive.objects import signal_kind
from odscen.opendrive.road_model import DRIVABLE_TYPES, lane_use

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from odscen.base.ids import LaneKey
    from odscen.convert.verify.net_reader import NetFile, NetFileLink
    from odscen.convert.verify.polyline_finder import Finder
    from odscen.opendrive.road_model import OpenDrive, Road

_PLACE_STEP = 1.0


def compare_lights(
    net: NetFile, odr: OpenDrive, drivable: Finder, keys: Sequence[LaneKey]
) -> SignalCoverage:
    """Compare which junctions have traffic lights, and which lights control anything.

    Parameters
    ----------
    drivable, keys
        Pieces of the map's drivable lanes, and the lane of each owner of a piece.
    """
    stated = _StatedLights.of(odr)
    ruled = _ruled_places(net, odr, drivable, keys)
    roads = set[str]().union(*(place.roads for place in ruled.values()))
    junctions = set[str]().union(*(place.junctions for place in ruled.values()))
    places = set[str]().union(*stated.roads.values()) | {
        road.id
        for road in odr.roads.values()
        if any(signal_kind(signal) == "pedestrian_light" for signal in road.signals)
    }
    return SignalCoverage(
        opendrive=len(stated.junctions),
        sumo=len(ruled),
        lost=tuple(junction for junction in stated.junctions if junction not in junctions),
        invented=tuple(
            name
            for name, place in ruled.items()
            if place.junctions.isdisjoint(stated.junctions) and place.roads.isdisjoint(places)
        ),
        lights=len(stated.roads),
        lost_lights=tuple(
            light
            for light, own in stated.roads.items()
            if own.isdisjoint(roads) and stated.homes[light].isdisjoint(junctions)
        ),
    )


@dataclass(frozen=True, slots=True)
class _StatedLights:
    """What the map says: junctions with lights; of each light its roads and junctions.

    ``homes`` are the junctions that list a controller of the light.
    """

    junctions: tuple[str, ...]
    roads: dict[str, set[str]]
    homes: dict[str, set[str]]

    @classmethod
    def of(cls, odr: OpenDrive) -> _StatedLights:
        """Collect them; signals that share an id are one light at several places."""
        names: dict[str, str] = {}
        roads: dict[str, set[str]] = defaultdict(set)
        for road in odr.roads.values():
            place = f"road {shown_id(road.id)}"
            for signal in road.signals:
                if signal_kind(signal) == "traffic_light":
                    name = names.setdefault(signal.id, f"{place} > signal {shown_id(signal.id)}")
                    roads[name].add(road.id)
        for road in odr.roads.values():
            for reference in road.signal_references:
                if reference.id in names:
                    roads[names[reference.id]].add(road.id)
        homes: dict[str, set[str]] = {name: set() for name in roads}
        for signal_id, junction in _named_by_controllers(odr):
            if signal_id in names:
                homes[names[signal_id]].add(junction)
        # Where no vehicle drives SUMO has nothing that a light could control.
        driven = {road.id for road in odr.roads.values() if _has_vehicles(road)}
        stated = {
            name: own for name, own in roads.items() if homes[name] or not own.isdisjoint(driven)
        }
        return cls(_lit_junctions(odr, roads), stated, homes)


def _has_vehicles(road: Road) -> bool:
    return any(
        lane_use(lane) in DRIVABLE_TYPES
        for section in road.sections
        for lane in section.lanes.values()
        if lane.id
    )


def _named_by_controllers(odr: OpenDrive) -> Iterator[tuple[str, str]]:
    """Signals with the junctions that list a controller of them."""
    for junction in odr.junctions.values():
        for controller in junction.controllers:
            for signal, _ in odr.controllers[controller].controls:
                yield signal, junction.id


def _lit_junctions(odr: OpenDrive, roads: dict[str, set[str]]) -> tuple[str, ...]:
    """Junctions with a controller of lights, or with a traffic light on a connecting road.

    CARLA gives controllers to signs that say "give way", too: a controller counts unless the file
    has all the signals it rules and none of them is a light.
    """
    signals = [signal for road in odr.roads.values() for signal in road.signals]
    others = {s.id for s in signals if signal_kind(s) not in ("traffic_light", "pedestrian_light")}
    of_signs = {
        controller.id
        for controller in odr.controllers.values()
        if controller.controls and all(signal in others for signal, _ in controller.controls)
    }
    with_light = set[str]().union(*roads.values())
    lit = {road.junction for road in odr.roads.values() if road.id in with_light}
    return tuple(
        junction.id
        for junction in odr.junctions.values()
        if junction.id in lit or not of_signs.issuperset(junction.controllers)
    )


@dataclass(frozen=True, slots=True)
class _RuledPlace:
    """Roads and junctions of the map that the lights of one SUMO junction control."""

    roads: set[str] = field(default_factory=set)
    junctions: set[str] = field(default_factory=set)


def _ruled_places(
    net: NetFile, odr: OpenDrive, drivable: Finder, keys: Sequence[LaneKey]
) -> dict[str, _RuledPlace]:
    """What lies under the links that lights control, by SUMO junction."""
    programs = {program.tl for program in net.programs}
    places: dict[str, _RuledPlace] = {}
    for name, links in net.request_rows().items():
        ruled = [link for link in links if link.tl in programs]
        if not ruled:
            continue
        place = places[name] = _RuledPlace()
        over = _roads_under(net, [link.via for link in ruled if link.via], drivable, keys)
        for counts in over:
            place.roads.update(counts)
            inside = (odr.roads[RoadId(road)].junction for road in counts)
            place.junctions.update(junction for junction in inside if junction is not None)
        for counts in _roads_under(net, _lanes_around(ruled), drivable, keys):
            place.roads.update(road for road, _ in counts.most_common(1))
    return places


def _lanes_around(links: Sequence[NetFileLink]) -> list[str]:
    """Lanes of vehicles before and behind links."""
    return list(dict.fromkeys(lane for ln in links if ln.via for lane in (ln.source, ln.target)))


def _roads_under(
    net: NetFile, lanes: Sequence[str], drivable: Finder, keys: Sequence[LaneKey]
) -> list[Counter[str]]:
    """Roads of the map along each SUMO lane, with how many metres of it lie there."""
    places = Polylines.of([net.lanes[lane].shape for lane in lanes]).cut(_PLACE_STEP)
    _, row = drivable.nearest(places, 4.0 * NEAR)
    found: list[Counter[str]] = [Counter() for _ in lanes]
    for owner, piece in zip(places.owner[row >= 0].tolist(), row[row >= 0].tolist(), strict=True):
        found[owner][keys[int(drivable.pieces.owner[piece])].road] += 1
    return found
