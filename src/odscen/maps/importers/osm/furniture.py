"""What is at streets: crosswalks, signals, stop and give-way signs, by the street they act on."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import shapely

from odscen.maps.importers.osm.junctions import Leg

if TYPE_CHECKING:
    from collections.abc import Mapping

    from odscen.maps.importers.osm.junctions import Layout
    from odscen.maps.importers.osm.osm_file import Extract, Tags
    from odscen.maps.importers.osm.street_network import Street, StreetNetwork

AHEAD = 60.0
"""Metres before a junction within which signals and signs are the junction's."""
SAME_CROSSING = 7.0
"""Metres within which two places across a street are one crossing."""
AT_CROSSING = 15.0
"""Metres from a crossing within which a signal is the crossing's."""


class StreetCrossing(NamedTuple):
    """A place where pedestrians cross a street.

    Attributes
    ----------
    s
        Along the street.
    source
        ``node N`` or ``way N``.
    lights
        Whether it has traffic signals.
    """

    street: int
    s: float
    source: str
    lights: bool
    island: bool
    marked: bool
    confidence: float


class LegControl(NamedTuple):
    """A sign or light for who arrives at a junction by a leg; ``back`` metres from its node."""

    kind: str
    back: float
    source: str
    confidence: float


class MidwaySignal(NamedTuple):
    """A signal along a street; ``ahead`` for traffic along it, else against it."""

    street: int
    s: float
    ahead: bool
    source: str


class ControlRow(NamedTuple):
    """What became of an element that controls traffic: kept or lost, and why."""

    kept: bool
    source: str
    reason: str
    confidence: float


@dataclass(slots=True)
class Furniture:
    """What was found at streets.

    Attributes
    ----------
    controls
        By leg.
    """

    crossings: list[StreetCrossing]
    controls: dict[Leg, list[LegControl]]
    midway: list[MidwaySignal]
    rows: list[ControlRow]


def signal_nodes(extract: Extract, network: StreetNetwork) -> set[int]:
    """Nodes of junctions with lights, or with a light shortly before them."""
    lit = set()
    for street in network.streets:
        for place, node in enumerate(street.nodes):
            if extract.nodes[node].tags.get("highway") != "traffic_signals":
                continue
            if node in network.ends:
                lit.add(node)
                continue
            to_end, to_start = street.line.length - street.s[place], street.s[place]
            if to_end < 30.0:
                lit.add(street.nodes[-1])
            if to_start < 30.0:
                lit.add(street.nodes[0])
    return lit


def lone_signals(extract: Extract, network: StreetNetwork) -> set[int]:
    """Nodes of lights along streets that are neither for a crossing nor for a junction ahead."""
    crossings, _ = find_crossings(extract, network)
    lone = set()
    for street in network.streets:
        for place, node in enumerate(street.nodes[1:-1], 1):
            tags = extract.nodes[node].tags
            if tags.get("highway") != "traffic_signals":
                continue
            s, length = street.s[place], street.line.length
            if any(c.street == street.number and abs(c.s - s) < AT_CROSSING for c in crossings):
                continue
            ways_out = [
                (length - s if ahead else s, network.ends[street.nodes[-1 if ahead else 0]])
                for ahead in _directions_faced_by(network, street, place, tags)
            ]
            if not any(away <= AHEAD and len(ends) > 2 for away, ends in ways_out):
                lone.add(node)
    return lone


def find_crossings(
    extract: Extract, network: StreetNetwork
) -> tuple[list[StreetCrossing], list[ControlRow]]:
    """Crossings from nodes, and from footways that run across streets."""
    crossings: list[StreetCrossing] = []
    rows = []
    on_streets: dict[int, list[tuple[Street, int]]] = {}
    for street in network.streets:
        for place, node in enumerate(street.nodes):
            on_streets.setdefault(node, []).append((street, place))
    walked = {
        ref
        for way in extract.ways.values()
        if way.tags.get("highway") in ("footway", "path", "pedestrian", "steps", "cycleway")
        for ref in way.nodes
    }
    for item in sorted(extract.nodes.values()):
        tags = item.tags
        if tags.get("highway") != "crossing":
            continue
        source = f"node {item.id}"
        places = on_streets.get(item.id, [])
        if tags.get("crossing") == "no":
            rows.append(
                ControlRow(False, source, "crossing=no: pedestrians may not cross here", 0.9)
            )
        elif not places:
            where = "footways only" if item.id in walked else "no road of this map"
            rows.append(ControlRow(False, source, f"the crossing is on {where}", 0.9))
        elif len(places) > 1 and item.id in network.ends and len(network.ends[item.id]) > 2:
            # In the middle of a junction: of the streets there the least one is not meant.
            street, place = max(places, key=lambda p: (p[0].line.length, -p[0].number))
            crossings.append(_plan_crossing(street, place, source, tags, 0.5))
        else:
            street, place = places[0]
            crossings.append(_plan_crossing(street, place, source, tags, 0.9))
    # Footways and paths across, where no node says so.
    lines = [street.line.trace for street in network.streets]
    tree = shapely.STRtree(lines)
    for way in sorted(extract.ways.values()):
        tags = way.tags
        if (
            tags.get("highway") not in ("footway", "path", "pedestrian")
            or tags.get("area") == "yes"
        ):
            continue
        if tags.get("tunnel", "no") != "no" or tags.get("bridge", "no") != "no":
            continue
        if tags.get("layer", "0") != "0" or tags.get("foot") in ("no", "private"):
            continue
        refs = [ref for ref in way.nodes if ref in network.places]
        if len(refs) < 2:
            continue
        line = shapely.LineString([network.places[ref] for ref in refs])
        for index in sorted(tree.query(line, predicate="intersects").tolist()):
            street = network.streets[index]
            if _is_elsewhere(network, street):
                continue
            for point in _points_of(line.intersection(lines[index])):
                along = line.project(point)
                shared = [street.s[i] for i, n in enumerate(street.nodes) if n in refs]
                ends_here = min(along, line.length - along) < 1.0
                if ends_here and not _goes_on(extract, way.id, refs, network, point):
                    continue
                s = street.line.project(point.x, point.y)
                if any(
                    c.street == street.number and abs(c.s - s) < SAME_CROSSING for c in crossings
                ):
                    continue
                if shared or tags.get("footway") == "crossing" or tags.get("path") == "crossing":
                    confidence = 0.7
                else:
                    confidence = 0.5
                light = tags.get("crossing") == "traffic_signals"
                crossings.append(
                    StreetCrossing(
                        street.number,
                        s,
                        f"way {way.id}",
                        light,
                        False,
                        tags.get("crossing") != "unmarked",
                        confidence,
                    )
                )
    return crossings, rows


def _is_elsewhere(network: StreetNetwork, street: Street) -> bool:
    """Whether a street is on a bridge or in a tunnel throughout."""
    return all(
        network.ways[stretch.way].tags.get("bridge", "no") != "no"
        or network.ways[stretch.way].tags.get("tunnel", "no") not in ("no", "building_passage")
        for stretch in street.stretches
    )


def _goes_on(
    extract: Extract, way_id: int, refs: list[int], network: StreetNetwork, point: shapely.Point
) -> bool:
    """Whether another footway begins where one ends on a street."""
    end = min(
        (refs[0], refs[-1]), key=lambda ref: shapely.Point(network.places[ref]).distance(point)
    )
    return any(
        other.id != way_id and end in other.nodes
        for other in extract.ways.values()
        if other.tags.get("highway") in ("footway", "path", "pedestrian")
    )


def _points_of(geometry: shapely.Geometry) -> list[shapely.Point]:
    parts = getattr(geometry, "geoms", [geometry])
    return [part for part in parts if part.geom_type == "Point"]


def _plan_crossing(
    street: Street, place: int, source: str, tags: Tags, confidence: float
) -> StreetCrossing:
    kinds = tags.get("crossing", "").split(";")
    island = tags.get("crossing:island") == "yes" or "island" in kinds
    lights = "traffic_signals" in kinds or tags.get("crossing:signals") == "yes"
    marked = not ({"unmarked", "informal"} & set(kinds)) and tags.get("crossing:markings") != "no"
    return StreetCrossing(
        street.number, street.s[place], source, lights, island, marked, confidence
    )


def find_controls(
    extract: Extract,
    network: StreetNetwork,
    layout: Layout,
    ranks: Mapping[Leg, int],
    crossings: list[StreetCrossing],
) -> tuple[dict[Leg, list[LegControl]], list[MidwaySignal], list[ControlRow]]:
    """Signals and signs, at the legs of junctions or along streets.

    Parameters
    ----------
    ranks
        Of the highway of each leg.
    """
    junction_of = {node: junction for junction in layout.junctions for node in junction.nodes}
    inside = {
        node: junction
        for junction in layout.junctions
        for number in junction.inner
        for node in network.streets[number].nodes
    } | junction_of
    along: dict[int, tuple[Street, int]] = {}
    inner = {number for junction in layout.junctions for number in junction.inner}
    for street in network.streets:
        if street.number not in inner:
            for place, node in enumerate(street.nodes[1:-1], 1):
                along[node] = (street, place)
    controls: dict[Leg, list[LegControl]] = {}
    midway: list[MidwaySignal] = []
    rows = []
    names = {"traffic_signals": "light", "stop": "stop", "give_way": "yield"}
    for item in sorted(extract.nodes.values()):
        kind = names.get(item.tags.get("highway", ""))
        if kind is None:
            continue
        source = f"node {item.id}"
        if item.id in inside:
            junction = inside[item.id]
            arriving = [leg for leg in junction.legs if arrives(network, leg)]
            if len(junction.legs) < 3 and kind != "light":
                rows.append(ControlRow(False, source, f"{kind}: no streets cross here", 0.8))
                continue
            if kind == "light" and len(junction.legs) == 2:
                chosen = _legs_faced_by(network, arriving, item.tags)
            elif kind == "light" or (kind == "stop" and item.tags.get("stop") == "all"):
                chosen = arriving
            else:
                top = max((ranks[leg] for leg in junction.legs), default=0)
                chosen = [leg for leg in arriving if ranks[leg] < top]
            for leg in chosen:
                controls.setdefault(leg, []).append(LegControl(kind, 0.0, source, 0.8))
            if chosen:
                rows.append(ControlRow(True, source, f"{kind}: {len(chosen)} approaches", 0.8))
            else:
                rows.append(
                    ControlRow(False, source, f"{kind}: no approach that it can be for", 0.8)
                )
            continue
        if item.id not in along:
            rows.append(ControlRow(False, source, f"{kind}: on no road of this map", 0.9))
            continue
        street, place = along[item.id]
        s, length = street.s[place], street.line.length
        directions = _directions_faced_by(network, street, place, item.tags)
        confidence = 0.9 if len(directions) == 1 else 0.6
        # One that says no direction, where there are two, is for the nearer junction.
        if len(directions) == 2 and kind != "light":
            directions = [length - s < s]
        near = [c for c in crossings if c.street == street.number and abs(c.s - s) < AT_CROSSING]
        used = []
        for ahead in directions:
            leg = Leg(street.number, ahead)
            back = length - s if ahead else s
            node_ahead = street.nodes[-1 if ahead else 0]
            junction = junction_of[node_ahead]
            far = len(junction.legs) < 3 or back > AHEAD
            if len(directions) == 2 and back > min(s, length - s) and not near:
                continue
            own_crossing = near and (far or back > 30.0)
            if kind == "light" and own_crossing:
                midway.append(MidwaySignal(street.number, s, ahead, source))
                used.append("the crossing there")
            elif far:
                if kind == "light":
                    midway.append(MidwaySignal(street.number, s, ahead, source))
                    used.append("its place")
                continue
            else:
                controls.setdefault(leg, []).append(LegControl(kind, back, source, confidence))
                used.append(f"the junction {back:.0f} m ahead")
        if used:
            rows.append(ControlRow(True, source, f"{kind}: for {', '.join(used)}", confidence))
        else:
            rows.append(
                ControlRow(False, source, f"{kind}: no junction within {AHEAD:g} m ahead", 0.8)
            )
    return controls, midway, rows


def _legs_faced_by(network: StreetNetwork, legs: list[Leg], tags: Tags) -> list[Leg]:
    """The legs that a light between two streets is for."""
    direction = tags.get("traffic_signals:direction", "")
    chosen = []
    for leg in legs:
        stretch = network.streets[leg.street].stretches[-1 if leg.at_end else 0]
        along_way = stretch.ahead == leg.at_end
        if direction not in ("forward", "backward") or along_way == (direction == "forward"):
            chosen.append(leg)
    return chosen or legs


def arrives(network: StreetNetwork, leg: Leg) -> bool:
    """Whether traffic arrives by a leg."""
    street = network.streets[leg.street]
    section = network.section(street.stretches[-1 if leg.at_end else 0])
    lanes = section.right if leg.at_end else section.left
    return any(lane.carries_cars for lane in lanes)


def _directions_faced_by(
    network: StreetNetwork, street: Street, place: int, tags: Tags
) -> list[bool]:
    """For traffic along the street, against it, or both."""
    stretch = next(
        stretch for stretch in street.stretches if stretch.first <= place <= stretch.last
    )
    section = network.section(stretch)
    direction = tags.get("traffic_signals:direction") or tags.get("direction", "")
    possible = [
        ahead
        for ahead, lanes in ((True, section.right), (False, section.left))
        if any(lane.carries_cars for lane in lanes)
    ]
    if direction in ("forward", "backward"):
        ahead = (direction == "forward") == stretch.ahead
        return [ahead] if ahead in possible else possible
    return possible


def is_open_end(
    extract: Extract, network: StreetNetwork, node: int, *, margin: float = 35.0
) -> bool:
    """Whether a street ends because the extract does, rather than as a dead end."""
    tags = extract.nodes[node].tags
    if tags.get("highway") in ("turning_circle", "turning_loop") or tags.get("noexit") == "yes":
        return False
    box = extract.box
    here = extract.nodes[node]
    if box is None:
        xs = [network.places[n][0] for n in network.ends]
        ys = [network.places[n][1] for n in network.ends]
        x, y = network.places[node]
        sides = (x - min(xs), max(xs) - x, y - min(ys), max(ys) - y)
        return min(sides) < margin
    if not box.covers(here):
        return True
    per_degree = 111_320.0
    narrow = per_degree * math.cos(math.radians(here.lat))
    sides = (
        (here.lon - box.west) * narrow,
        (box.east - here.lon) * narrow,
        (here.lat - box.south) * per_degree,
        (box.north - here.lat) * per_degree,
    )
    return min(sides) < margin
