"""What stands beside the streets, and how high they are where one crosses another on a bridge.

OpenStreetMap has no heights of the ground, so it is flat but for what bridges and tunnels need.
"""

from __future__ import annotations

import heapq
import math
import re
from collections import defaultdict
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import shapely

from odscen.opendrive import road_model as model

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence

    from odscen.base.arrays import FloatArray
    from odscen.maps.importers.osm.osm_file import Extract, Tags
    from odscen.maps.importers.osm.road_plan import RoadPlan
    from odscen.maps.importers.osm.street_network import Street, StreetNetwork

SIGHT = 120.0
"""Metres from a road within which buildings and trees are drawn."""
STOREY = 3.2
"""Metres of a storey, where a building says how many it has but not how high it is."""
LOW_BUILDING = 6.4
TREE_HEIGHT = 8.0
KERB = 0.15
"""Metres of height of a traffic island."""
POLE = 0.1
POLE_HEIGHT = 3.0
"""Metres of the sign of a bus stop."""
CROWN = 2.5
"""Metres of the radius of a tree's crown, where nothing says it."""
CLEARANCE = 6.0
"""Metres between a road and one above it: 4.5 m for vehicles (RAA 2008), and what carries it."""
FLAT = 15.0
"""Metres of road, each way, that are at full height where it crosses another."""
RAMP = 20.0
"""Metres of a ramp for each metre that it rises; its steepest place then has 7.5 %, about the most
that RASt 06 has for main roads (8 %)."""
_STEP = 10.0
_SAME = 1e-6
"""Between coefficients of cubics that are one."""
LEVEL = 0.005
"""Metres of height below which a road is flat."""


class SceneryRow(NamedTuple):
    """What became of buildings, trees and crossings at different heights, and how sure that is."""

    kept: bool
    element: str
    reason: str
    confidence: float
    source: str | None


# ------------------------------------------------------------------ buildings and trees


def draw_scenery(
    extract: Extract,
    network: StreetNetwork,
    plans: Mapping[int, RoadPlan],
    new_object: Callable[[], str],
) -> list[SceneryRow]:
    """Add buildings, trees, islands and bus stops to the nearest roads, as objects.

    A building that reaches over a street, as above a passage, is left out: it would stand on it.
    """
    roads = list(plans.values())
    if not roads:
        return []
    tree = shapely.STRtree([plan.line.trace for plan in roads])
    ways = shapely.unary_union([plan.line.trace.buffer(1.0) for plan in roads])
    shapely.prepare(ways)
    rows = []
    counts: dict[str, int] = defaultdict(int)
    for source, ring, tags in _find_buildings(extract, network):
        if ways.intersects(ring):
            reason = "building: a street runs through it"
            rows.append(SceneryRow(False, source, reason, 0.8, source))
            counts["through"] += 1
            continue
        height, height_source = _building_height(tags)
        outline = np.asarray(ring.exterior.coords)[:-1]
        if _add_object(roads, tree, outline, "building", tags, height, new_object):
            counts["building"] += 1
            counts["guessed"] += not height_source
    for node in sorted(extract.nodes.values()):
        if node.tags.get("natural") != "tree" or node.id not in network.places:
            continue
        crown = _read_metres(node.tags.get("diameter_crown", "")) or 2 * CROWN
        angles = np.arange(8) * math.pi / 4
        place = np.array(network.places[node.id])
        outline = place + crown / 2 * np.column_stack([np.cos(angles), np.sin(angles)])
        height = _read_metres(node.tags.get("height", "")) or TREE_HEIGHT
        if _add_object(roads, tree, outline, "tree", node.tags, height, new_object):
            counts["tree"] += 1
    rows += _draw_islands(extract, network, roads, tree, new_object)
    rows += _draw_bus_stops(extract, network, roads, tree, new_object)
    if counts["building"]:
        reason = (
            f"{counts['building']} buildings within {SIGHT:g} m of a road, the height of "
            f"{counts['guessed']} of them guessed"
        )
        rows.append(SceneryRow(True, "buildings", reason, 0.6, None))
    if counts["tree"]:
        reason = f"{counts['tree']} trees within {SIGHT:g} m of a road"
        rows.append(SceneryRow(True, "trees", reason, 0.8, None))
    return rows


def _draw_islands(
    extract: Extract,
    network: StreetNetwork,
    roads: Sequence[RoadPlan],
    tree: shapely.STRtree,
    new_object: Callable[[], str],
) -> Iterator[SceneryRow]:
    """Add areas that are traffic islands, each with what became of it."""
    for way in sorted(extract.ways.values()):
        if way.tags.get("area:highway") != "traffic_island":
            continue
        source = f"way {way.id}"
        for _, ring, tags in _close_ring(source, way.nodes, way.tags, network):
            outline = np.asarray(ring.exterior.coords)[:-1]
            kept = _add_object(roads, tree, outline, "trafficIsland", tags, KERB, new_object)
            reason = "traffic island" if kept else f"traffic island: no road within {SIGHT:g} m"
            yield SceneryRow(kept, source, reason, 0.8, source)


def _draw_bus_stops(
    extract: Extract,
    network: StreetNetwork,
    roads: Sequence[RoadPlan],
    tree: shapely.STRtree,
    new_object: Callable[[], str],
) -> Iterator[SceneryRow]:
    """Add the poles of bus stops, with their names; OpenDRIVE has stops of railways only."""
    for node in sorted(extract.nodes.values()):
        if node.tags.get("highway") != "bus_stop" or node.id not in network.places:
            continue
        source = f"node {node.id}"
        angles = np.arange(8) * math.pi / 4
        place = np.array(network.places[node.id])
        outline = place + POLE / 2 * np.column_stack([np.cos(angles), np.sin(angles)])
        name = " ".join(["Bus stop", node.tags.get("name", "")]).strip()
        tags = {**node.tags, "name": name}
        kept = _add_object(roads, tree, outline, "pole", tags, POLE_HEIGHT, new_object)
        reason = (
            "bus stop: its pole; lines and their stops are of a scenario"
            if kept
            else f"bus stop: no road within {SIGHT:g} m"
        )
        yield SceneryRow(kept, source, reason, 0.8, source)


def _find_buildings(
    extract: Extract, network: StreetNetwork
) -> Iterator[tuple[str, shapely.Polygon, Tags]]:
    """Outlines of buildings: closed ways, and outer rings of relations that are one way each."""
    for way in sorted(extract.ways.values()):
        if way.tags.get("building", "no") != "no":
            yield from _close_ring(f"way {way.id}", way.nodes, way.tags, network)
    for relation in sorted(extract.relations.values()):
        if relation.tags.get("building", "no") == "no":
            continue
        for member in relation.members:
            outer = extract.ways.get(member.ref) if member.kind == "way" else None
            if outer is not None and member.role == "outer" and "building" not in outer.tags:
                source = f"relation {relation.id}"
                yield from _close_ring(source, outer.nodes, relation.tags, network)


def _close_ring(
    source: str, nodes: Sequence[int], tags: Tags, network: StreetNetwork
) -> Iterator[tuple[str, shapely.Polygon, Tags]]:
    """The polygon of a closed way; ways that the border of the extract cuts open have none."""
    if len(nodes) < 4 or nodes[0] != nodes[-1] or any(n not in network.places for n in nodes):
        return
    ring = shapely.Polygon([network.places[n] for n in nodes])
    if ring.is_valid and ring.area > 4.0:
        yield source, shapely.orient_polygons(ring), tags


def _building_height(tags: Tags) -> tuple[float, bool]:
    """Metres, and whether the tags say it."""
    height = _read_metres(tags.get("height", ""))
    if height:
        return height, True
    storeys = _read_metres(tags.get("building:levels", ""))
    return (storeys * STOREY, True) if storeys else (LOW_BUILDING, False)


def _read_metres(text: str) -> float:
    """A positive number with or without ``m``; 0 if it is none."""
    match = re.fullmatch(r"(\d+(?:[.,]\d+)?)\s*m?", text.strip())
    return min(float(match[1].replace(",", ".")), 900.0) if match else 0.0


def _add_object(
    roads: Sequence[RoadPlan],
    tree: shapely.STRtree,
    outline: FloatArray,
    kind: str,
    tags: Tags,
    height: float,
    new_object: Callable[[], str],
) -> bool:
    """Add an outline in places of the map to the nearest road, if one is in sight."""
    centre = outline.mean(axis=0)
    nearest = tree.query_nearest(shapely.Point(centre), max_distance=SIGHT, all_matches=False)
    if not len(nearest):
        return False
    plan = roads[int(nearest[0])]
    s = min(max(plan.line.project(*centre.tolist()), 0.0), plan.line.length)
    pose = plan.line.pose(s)
    cos, sin = math.cos(pose.hdg), math.sin(pose.hdg)

    def turn(xy: FloatArray) -> FloatArray:
        turned: FloatArray = np.column_stack(
            [xy[:, 0] * cos + xy[:, 1] * sin, xy[:, 1] * cos - xy[:, 0] * sin]
        )
        return turned

    # An object may lie ahead of its s, at a road's end: the corners carry what t cannot.
    u, t = turn((centre - np.array([pose.x, pose.y]))[None])[0].tolist()
    corners = turn(outline - centre) + np.array([u, 0.0])
    corners = np.concatenate([corners, corners[:1]])
    low, high = corners.min(axis=0), corners.max(axis=0)
    plan.objects.append(
        model.RoadObject(
            id=new_object(),
            type=kind,
            subtype="",
            name=tags.get("name", ""),
            s=s,
            t=t,
            z_offset=0.0,
            hdg=0.0,
            pitch=0.0,
            roll=0.0,
            orientation="none",
            length=float(high[0] - low[0]),
            width=float(high[1] - low[1]),
            height=height,
            radius=None,
            valid_length=None,
            outlines=(
                model.Outline(
                    tuple(model.Corner(True, a, b, 0.0, height) for a, b in corners.tolist()),
                    True,
                    True,
                ),
            ),
        )
    )
    return True


# ------------------------------------------------------------------ heights


@dataclass(slots=True)
class StreetHeights:
    """Heights of the streets, metres above the flat ground.

    Attributes
    ----------
    by_street
        Places along each street that has any, and the heights there.
    """

    by_street: dict[int, tuple[FloatArray, FloatArray]]
    rows: list[SceneryRow]

    def elevation(self, plan: RoadPlan) -> tuple[model.Cubic, ...]:
        """The profile of a road: cubics whose grade does not jump."""
        profile = self.by_street.get(plan.street)
        if profile is None:
            return ()
        s = np.linspace(0.0, plan.line.length, max(2, math.ceil(plan.line.length / _STEP) + 1))
        z = np.interp(s + plan.before, *profile)
        if np.abs(z).max() < LEVEL:
            return ()
        grade = self._grades_at(plan, s)
        return _without_repeated(
            hermite(float(s[i]), float(s[i + 1] - s[i]), z[i : i + 2], grade[i : i + 2])
            for i in range(len(s) - 1)
        )

    def at_end(self, plan: RoadPlan, *, at_end: bool) -> tuple[float, float]:
        """Height and grade at an end of a road, as its reference line runs."""
        profile = self.by_street.get(plan.street)
        if profile is None:
            return 0.0, 0.0
        s = np.array([plan.line.length if at_end else 0.0])
        return float(np.interp(s + plan.before, *profile)[0]), float(self._grades_at(plan, s)[0])

    def _grades_at(self, plan: RoadPlan, s: FloatArray) -> FloatArray:
        along, z = self.by_street[plan.street]
        graded: FloatArray = np.interp(s + plan.before, along, np.gradient(z, along))
        return graded


def _without_repeated(cubics: Iterable[model.Cubic]) -> tuple[model.Cubic, ...]:
    """Leave out cubics that only continue the one before them."""
    kept: list[model.Cubic] = []
    for cubic in cubics:
        if kept:
            _, a, b, c, d = kept[-1]
            t = cubic.s - kept[-1].s
            goes_on = (a + t * (b + t * (c + t * d)), b + t * (2 * c + 3 * t * d), c + 3 * t * d, d)
            if np.abs(np.array(goes_on) - cubic[1:]).max() < _SAME:
                continue
        kept.append(cubic)
    return tuple(kept)


def hermite(s: float, length: float, z: FloatArray, grade: FloatArray) -> model.Cubic:
    """The cubic between two heights with these grades, m per m."""
    (z0, z1), (g0, g1) = z.tolist(), grade.tolist()
    rise = (z1 - z0) / length
    return model.Cubic(
        s, z0, g0, (3 * rise - 2 * g0 - g1) / length, (g0 + g1 - 2 * rise) / length**2
    )


def find_heights(network: StreetNetwork) -> StreetHeights:
    """Raise bridges that cross other streets, and lower tunnels below streets on the ground.

    From each such place the height falls along all streets to 0, see :data:`RAMP`. Bridges over
    anything else stay on the ground, which nothing says to be lower there.
    """
    sources, rows = _find_overpasses(network)
    by_street: dict[int, tuple[FloatArray, FloatArray]] = {}
    for sign in (1.0, -1.0):
        chosen = [(number, s, abs(z)) for number, s, z in sources if z * sign > 0.0]
        for number, (along, z) in _spread_heights(network, chosen).items():
            before = by_street.get(number)
            total = sign * z if before is None else before[1] + sign * z
            by_street[number] = (along, total)
    return StreetHeights(by_street, rows)


def _find_overpasses(
    network: StreetNetwork,
) -> tuple[list[tuple[int, float, float]], list[SceneryRow]]:
    """Street, s and height of each place where streets cross at different heights."""
    traces = [street.line.trace for street in network.streets]
    tree = shapely.STRtree(traces)
    sources: list[tuple[int, float, float]] = []
    rows = []
    first, second = tree.query(traces, predicate="intersects")
    for i, j in sorted(zip(first.tolist(), second.tolist(), strict=True)):
        if i >= j:
            continue
        streets = network.streets[i], network.streets[j]
        crossing = traces[i].intersection(traces[j])
        for point in getattr(crossing, "geoms", [crossing]):
            if point.geom_type != "Point":
                continue
            places = [street.line.project(point.x, point.y) for street in streets]
            ways = [_way_at(street, s) for street, s in zip(streets, places, strict=True)]
            levels = [_level_of(network.ways[way].tags) for way in ways]
            if levels[0] == levels[1]:
                continue
            high = 0 if levels[0] > levels[1] else 1
            # Of two bridges, or two tunnels, the outer one is a storey further from the ground.
            storeys = 2 if levels[0] * levels[1] > 0 else 1
            if levels[high] > 0:
                moved, z, kind = high, CLEARANCE * storeys, "bridge"
            else:
                moved, z, kind = 1 - high, -CLEARANCE * storeys, "tunnel"
            sources.append((streets[moved].number, places[moved], z))
            source = f"way {ways[moved]}"
            reason = (
                f"{kind}: {abs(z):g} m {'above' if z > 0 else 'below'} the ground, as it crosses "
                f"OSM way {ways[1 - moved]}"
            )
            rows.append(SceneryRow(True, source, reason, 0.4, source))
    return sources, rows


def _way_at(street: Street, s: float) -> int:
    for stretch in street.stretches:
        if s <= street.s[stretch.last]:
            return stretch.way
    return street.stretches[-1].way


def _level_of(tags: Tags) -> int:
    """Levels above the ground by ``layer``; a bridge has at least 1, a tunnel at most -1."""
    try:
        layer = int(tags.get("layer", "0"))
    except ValueError:
        layer = 0
    layer = min(max(layer, -3), 3)
    if tags.get("bridge", "no") != "no":
        return max(layer, 1)
    if tags.get("tunnel", "no") not in ("no", "building_passage"):
        return min(layer, -1)
    return 0


def _spread_heights(
    network: StreetNetwork, sources: Sequence[tuple[int, float, float]]
) -> dict[int, tuple[FloatArray, FloatArray]]:
    """Heights, all positive, along the streets within reach of places that have one."""
    if not sources:
        return {}
    heights: dict[int, tuple[FloatArray, FloatArray]] = {}
    for number, s, top in sources:
        ramp = RAMP * top
        # Metres along the streets from there to each node.
        away: dict[int, float] = {}
        street = network.streets[number]
        queue = [(s, street.nodes[0]), (street.line.length - s, street.nodes[-1])]
        heapq.heapify(queue)
        while queue:
            distance, node = heapq.heappop(queue)
            if distance > FLAT + ramp or away.get(node, math.inf) <= distance:
                continue
            away[node] = distance
            for other, ends in network.ends[node]:
                reached = network.streets[other]
                end = reached.nodes[0 if ends else -1]
                heapq.heappush(queue, (distance + reached.line.length, end))
        touched = {number} | {other for node in away for other, _ in network.ends[node]}
        for other in sorted(touched):
            reached = network.streets[other]
            length = reached.line.length
            if other in heights:
                along, z = heights[other]
            else:
                along = np.linspace(0.0, length, max(2, math.ceil(length / (_STEP / 2)) + 1))
                z = np.zeros(len(along))
            distance_along = np.minimum(
                away.get(reached.nodes[0], math.inf) + along,
                away.get(reached.nodes[-1], math.inf) + length - along,
            )
            if other == number:
                distance_along = np.minimum(distance_along, np.abs(along - s))
            share = np.clip((distance_along - FLAT) / ramp, 0.0, 1.0)
            here = top * (1.0 - share**2 * (3.0 - 2.0 * share))
            heights[other] = (along, np.maximum(z, here))
    return heights
