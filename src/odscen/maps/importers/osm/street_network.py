"""Streets between junctions: ways for vehicles, split where others meet, strung together."""

from __future__ import annotations

import itertools
from collections import defaultdict
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import shapely
from pyproj import Transformer

from odscen.maps.importers.osm import street_tags
from odscen.maps.importers.osm.street_line import StreetLine, smooth_line

if TYPE_CHECKING:
    from collections.abc import Collection, Mapping

    from odscen.maps.importers.osm.osm_file import Extract, Relation, Way
    from odscen.maps.importers.osm.street_tags import Country, CrossSection, StreetReading

BESIDE = 14.0
"""Metres from the line of a street within which a footway runs beside it."""
BESIDE_SHARE = 0.5
"""Share of a way's length that footways beside it must accompany to be its sidewalk."""


class Stretch(NamedTuple):
    """A part of a way in a street.

    Attributes
    ----------
    ahead
        Whether the way runs as the street does.
    first, last
        Positions of its ends among the street's nodes.
    """

    way: int
    ahead: bool
    first: int
    last: int


@dataclass(eq=False, slots=True)
class Street:
    """Ways between two junctions, strung together.

    Attributes
    ----------
    nodes
        Ids, in order.
    stretches
        In order; the first begins at node 0.
    line
        Smooth, from the first node to the last.
    s
        Of each node along the line.
    """

    number: int
    nodes: list[int]
    stretches: list[Stretch]
    line: StreetLine
    s: list[float]


class Skipped(NamedTuple):
    """A way that becomes no road, and why."""

    way: int
    reason: str


class Turn(NamedTuple):
    """A restriction: from a way over nodes or ways to a way."""

    relation: int
    only: bool
    origin: tuple[int, ...]
    via_node: int | None
    via_ways: tuple[int, ...]
    target: tuple[int, ...]


@dataclass(slots=True)
class StreetNetwork:
    """What an extract has of streets.

    Attributes
    ----------
    places
        By node, metres.
    readings
        By way.
    ways
        Those that streets are made of, as they are driven.
    ends
        By node: numbers of the streets that begin or end there, with whether they end.
    """

    georeference: str
    places: dict[int, tuple[float, float]]
    country: Country
    mirrored: bool
    ways: dict[int, Way]
    readings: dict[int, StreetReading]
    streets: list[Street]
    ends: dict[int, list[tuple[int, bool]]]
    skipped: list[Skipped]
    turns: list[Turn] = field(default_factory=list)
    unread: list[tuple[int, str]] = field(default_factory=list)

    def section(self, stretch: Stretch) -> CrossSection:
        """The cross-section of a stretch, as its street runs."""
        section = self.readings[stretch.way].section
        return section if stretch.ahead else section.reversed()


class WaySelection(NamedTuple):
    """Which ways become roads.

    Attributes
    ----------
    services
        ``none``, ``through`` (no driveways, aisles of car parks or private ones), ``all``.
    tracks
        Whether tracks of fields and woods do.
    """

    services: str = "through"
    tracks: bool = False

    def refuse(self, way: Way) -> str:
        """Why a way with ``highway`` becomes no road; empty if it does."""
        tags = way.tags
        highway = tags.get("highway", "")
        if highway in street_tags.FOOT_CLASSES or highway == "cycleway":
            return f"{highway}: no road for vehicles"
        if highway not in street_tags.CLASSES:
            return f"highway={highway}: no road in use"
        if tags.get("area") == "yes":
            return "an area, not a line"
        if street_tags.keeps_cars_out(tags) and not street_tags.is_for_buses(tags):
            private = tags.get("access", tags.get("motor_vehicle")) == "private"
            if not (private and self.services == "all"):
                return "closed to motor vehicles"
        if highway == "service":
            if self.services == "none":
                return "a service road (option service_roads)"
            if self.services == "through" and tags.get("service") in street_tags.MINOR_SERVICES:
                return f"service={tags['service']} (option service_roads)"
        if highway == "track" and not self.tracks:
            return "a track (option tracks)"
        return ""


def build_network(
    extract: Extract,
    country: Country,
    *,
    keeps_left: bool,
    selection: WaySelection,
    stops: Collection[int] = (),
) -> StreetNetwork:
    """String the ways of an extract together to streets.

    Parameters
    ----------
    keeps_left
        Whether traffic keeps left; everything is then mirrored at the y axis, so that it keeps
        right.
    stops
        Further nodes at which streets end, as lights between junctions need.
    """
    # Ways that vehicles use.
    ways: dict[int, Way] = {}
    skipped = []
    for given in sorted(extract.ways.values()):
        if "highway" not in given.tags:
            continue
        nodes = tuple(ref for ref in given.nodes if ref in extract.nodes)
        nodes = tuple(ref for i, ref in enumerate(nodes) if i == 0 or ref != nodes[i - 1])
        way = given._replace(nodes=nodes)
        if street_tags.is_oneway(way.tags) < 0:
            way = street_tags.turn_way_round(way)
        if keeps_left:
            way = way._replace(tags=street_tags.mirror_tags(way.tags))
        reason = selection.refuse(way) or ("" if len(nodes) > 1 else "it has no two nodes")
        if reason:
            skipped.append(Skipped(way.id, reason))
        else:
            ways[way.id] = way

    georeference, places = _project_nodes(extract, ways, keeps_left=keeps_left)
    readings = _read_ways(extract, ways, places, country)

    # Nodes at which streets end: where not exactly two stretches meet, or where these do not fit.
    meeting: dict[int, list[tuple[int, int, bool]]] = defaultdict(list)
    for way in ways.values():
        for i, ref in enumerate(way.nodes):
            if i > 0:
                meeting[ref].append((way.id, i - 1, True))
            if i + 1 < len(way.nodes):
                meeting[ref].append((way.id, i, False))
    breaks = {node for node, parts in meeting.items() if len(parts) != 2}
    for node, parts in meeting.items():
        if len(parts) == 2 and (node in stops or not _may_continue(ways, parts)):
            breaks.add(node)
    # Circles without a junction end where they begin.
    streets = _string_together(ways, meeting, breaks, places)
    ends: dict[int, list[tuple[int, bool]]] = defaultdict(list)
    for street in streets:
        ends[street.nodes[0]].append((street.number, False))
        ends[street.nodes[-1]].append((street.number, True))
    network = StreetNetwork(
        georeference, places, country, keeps_left, ways, readings, streets, dict(ends), skipped
    )
    for relation in sorted(extract.relations.values()):
        if relation.tags.get("type", "").split(":")[0] == "restriction":
            _read_restriction(network, relation)
    return network


def _project_nodes(
    extract: Extract, ways: Mapping[int, Way], *, keeps_left: bool
) -> tuple[str, dict[int, tuple[float, float]]]:
    """Places of all nodes by a transverse Mercator projection at the middle of the streets."""
    used = sorted({ref for way in ways.values() for ref in way.nodes})
    of = [extract.nodes[ref] for ref in used] or list(extract.nodes.values())
    if not of:
        return "", {}
    box = extract.box
    lats, lons = [node.lat for node in of], [node.lon for node in of]
    lat = (box.south + box.north) / 2 if box else (min(lats) + max(lats)) / 2
    lon = (box.west + box.east) / 2 if box else (min(lons) + max(lons)) / 2
    georeference = (
        f"+proj=tmerc +lat_0={lat:.6f} +lon_0={lon:.6f} +k=1 +x_0=0 +y_0=0 "
        "+datum=WGS84 +units=m +no_defs"
    )
    nodes = list(extract.nodes.values())
    x, y = Transformer.from_crs("EPSG:4326", georeference, always_xy=True).transform(
        np.array([node.lon for node in nodes]), np.array([node.lat for node in nodes])
    )
    sign = -1.0 if keeps_left else 1.0
    # A millimetre is less than any survey knows, and the same on every machine.
    xs, ys = np.round(sign * np.asarray(x), 3).tolist(), np.round(np.asarray(y), 3).tolist()
    return georeference, {
        node.id: (a, b) for node, a, b in zip(nodes, xs, ys, strict=True) if abs(a) < 1e7
    }


def _read_ways(
    extract: Extract,
    ways: Mapping[int, Way],
    places: Mapping[int, tuple[float, float]],
    country: Country,
) -> dict[int, StreetReading]:
    """Read the tags of each way, with the footways that run beside it."""
    lines = {
        way.id: shapely.LineString([places[ref] for ref in way.nodes]) for way in ways.values()
    }
    footways = []
    for way in sorted(extract.ways.values()):
        tags = way.tags
        if (
            tags.get("highway") not in ("footway", "path", "pedestrian")
            or tags.get("area") == "yes"
        ):
            continue
        if tags.get("foot") in ("no", "private") or tags.get("footway") in ("crossing", "link"):
            continue
        refs = [ref for ref in way.nodes if ref in places]
        for a, b in itertools.pairwise(refs):
            if places[a] != places[b]:
                footways.append(shapely.LineString([places[a], places[b]]))
    tree = shapely.STRtree(footways)
    readings = {}
    for way in ways.values():
        line = lines[way.id]
        walks = {"left": 0.0, "right": 0.0}
        for index in sorted(tree.query(line.buffer(BESIDE)).tolist()):
            side, length = _measure_accompaniment(line, footways[index])
            if side:
                walks[side] += length
        beside = {side: length > BESIDE_SHARE * line.length for side, length in walks.items()}
        readings[way.id] = street_tags.read_street(way.tags, country, walks=beside)
    return readings


def _measure_accompaniment(
    line: shapely.LineString, segment: shapely.LineString
) -> tuple[str, float]:
    """On which side of a line a segment runs along it, and how far."""
    (ax, ay), (bx, by) = segment.coords
    s0, s1 = line.project(shapely.Point(ax, ay)), line.project(shapely.Point(bx, by))
    along = abs(s1 - s0)
    if along < 0.8 * segment.length or along < 0.5:
        return "", 0.0
    middle = segment.interpolate(0.5, normalized=True)
    s = line.project(middle)
    foot = line.interpolate(s)
    if not 2.0 < foot.distance(middle) < BESIDE:
        return "", 0.0
    before, after = line.interpolate(max(s - 0.5, 0)), line.interpolate(min(s + 0.5, line.length))
    dx, dy = after.x - before.x, after.y - before.y
    cross = dx * (middle.y - foot.y) - dy * (middle.x - foot.x)
    return ("left" if cross > 0 else "right"), along


def _may_continue(ways: Mapping[int, Way], parts: list[tuple[int, int, bool]]) -> bool:
    """Whether two stretches that meet at a node are of one street."""
    (first, _, first_ends), (second, _, second_ends) = parts
    a, b = ways[first].tags, ways[second].tags
    oneway = street_tags.is_oneway(a)
    if oneway != street_tags.is_oneway(b):
        return False
    if oneway and first_ends == second_ends:
        return False
    rings = [tags.get("junction") in ("roundabout", "circular") for tags in (a, b)]
    return rings[0] == rings[1]


def _string_together(
    ways: Mapping[int, Way],
    meeting: Mapping[int, list[tuple[int, int, bool]]],
    breaks: set[int],
    places: Mapping[int, tuple[float, float]],
) -> list[Street]:
    """Follow segments from each node at which streets end; then the circles that are left."""
    done: set[tuple[int, int]] = set()
    streets: list[Street] = []

    def follow(way_id: int, index: int, ahead: bool) -> None:
        """Collect segments from one on, up to the next node where streets end."""
        nodes: list[int] = []
        segments: list[tuple[int, bool]] = []
        while (way_id, index) not in done:
            done.add((way_id, index))
            way = ways[way_id]
            start, end = (index, index + 1) if ahead else (index + 1, index)
            nodes = nodes or [way.nodes[start]]
            node = way.nodes[end]
            nodes.append(node)
            segments.append((way_id, ahead))
            if node in breaks:
                break
            others = [part for part in meeting[node] if (part[0], part[1]) not in done]
            if not others:
                break
            way_id, index, ends = others[0]
            ahead = not ends
        # A street runs as its one-way ways do.
        if street_tags.is_oneway(ways[segments[0][0]].tags) and not segments[0][1]:
            nodes.reverse()
            segments = [(way_id, not ahead) for way_id, ahead in segments[::-1]]
        for run in _split_circle(nodes, segments):
            streets.append(_make_street(len(streets), *run, places))

    for way in ways.values():
        for index in range(len(way.nodes) - 1):
            if (way.id, index) in done:
                continue
            if way.nodes[index] in breaks:
                follow(way.id, index, True)
            elif way.nodes[index + 1] in breaks:
                follow(way.id, index, False)
    for way in ways.values():
        for index in range(len(way.nodes) - 1):
            if (way.id, index) not in done:
                breaks.add(way.nodes[index])
                follow(way.id, index, True)
    return streets


def _split_circle(
    nodes: list[int], segments: list[tuple[int, bool]]
) -> list[tuple[list[int], list[tuple[int, bool]]]]:
    """Divide a street that ends where it begins in two, so that each has two ends."""
    if nodes[0] != nodes[-1] or len(nodes) < 4:
        return [(nodes, segments)]
    half = len(segments) // 2
    return [(nodes[: half + 1], segments[:half]), (nodes[half:], segments[half:])]


def _make_street(
    number: int,
    nodes: list[int],
    segments: list[tuple[int, bool]],
    places: Mapping[int, tuple[float, float]],
) -> Street:
    stretches: list[Stretch] = []
    for i, (way, ahead) in enumerate(segments):
        if stretches and stretches[-1].way == way and stretches[-1].ahead == ahead:
            stretches[-1] = stretches[-1]._replace(last=i + 1)
        else:
            stretches.append(Stretch(way, ahead, i, i + 1))
    line = smooth_line([places[node] for node in nodes])
    s = line.project_all(np.array([places[node] for node in nodes])).tolist()
    s[0], s[-1] = 0.0, line.length
    s = np.maximum.accumulate(s).tolist()
    return Street(number, nodes, stretches, line, s)


def _read_restriction(network: StreetNetwork, relation: Relation) -> None:
    """Note a restriction of turns, or why it is none of these streets."""
    tags = relation.tags
    kind = next(
        (
            tags[k]
            for k in ("restriction", "restriction:motorcar", "restriction:motor_vehicle")
            if k in tags
        ),
        "",
    )
    if not kind.startswith(("no_", "only_")):
        about = (
            "it is for certain vehicles or times only" if not kind else f"{kind!r}: no such kind"
        )
        network.unread.append((relation.id, about))
        return
    roles: dict[str, list[tuple[str, int]]] = defaultdict(list)
    for member in relation.members:
        roles[member.role].append((member.kind, member.ref))
    origin = tuple(ref for kind, ref in roles["from"] if kind == "way")
    target = tuple(ref for kind, ref in roles["to"] if kind == "way")
    via_nodes = [ref for kind, ref in roles["via"] if kind == "node"]
    via_ways = tuple(ref for kind, ref in roles["via"] if kind == "way")
    # What leads to ways that are not there only can still be held against the others.
    only = kind.startswith("only_")
    needed = (*origin, *via_ways) if only else (*origin, *target, *via_ways)
    missing = [ref for ref in needed if ref not in network.ways]
    if not origin or not target or not (via_nodes or via_ways):
        network.unread.append((relation.id, "it lacks from, via or to"))
    elif missing:
        network.unread.append((relation.id, f"way {missing[0]} is no road of this map"))
    else:
        network.turns.append(
            Turn(
                relation.id,
                only,
                origin,
                via_nodes[0] if via_nodes and not via_ways else None,
                via_ways,
                target,
            )
        )
