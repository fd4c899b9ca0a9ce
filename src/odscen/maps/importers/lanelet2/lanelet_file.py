"""Lanelet2 files read: nodes in metres, ways, lanelets with bounds that run their way, the rest.

The format is that of Lanelet2 1.2 (``lanelet2_core/doc/LaneletPrimitives.md``,
``RegulatoryElementTagging.md``), with what Autoware adds: ``local_x``, ``local_y`` and
``mgrs_code`` of nodes.
"""

from __future__ import annotations

import math
import re
from collections import Counter
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np

from odscen.base.errors import InputError
from odscen.base.shown import shown, shown_id
from odscen.base.xml_reading import read_xml
from odscen.convert.model.conversion_report import ElementOutcome, ReportEntry

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from odscen.base.arrays import FloatArray

Tags = dict[str, str]
Relation = tuple[str, Tags, dict[str, list[tuple[str, str]]]]
"""Id, tags, and members by role as (type, id)."""

DRIVEN: Final = frozenset(
    {"road", "highway", "play_street", "exit", "bus_lane", "emergency_lane"}
    | {"bicycle_lane", "road_shoulder"}
)
"""Subtypes of lanelets for vehicles."""
WALKED: Final = frozenset({"walkway", "shared_walkway", "stairs", "pedestrian_lane"})
"""Subtypes of lanelets for pedestrians, but for crosswalks."""

_MOST_NODES = 2_000_000
_MGRS = re.compile(r"(\d{1,2})[C-HJ-NP-X][A-HJ-NP-Z]{2}\d*")
_MOST_DISAGREEMENT = 1.0
"""Metres by which local and geographic coordinates of a file may disagree, less their offset."""
_SAME_END = 0.1
"""Metres between ends of bounds that are one line."""
_SAME_PLACE = 0.01
"""Metres between nodes of different ids that are one place."""


class RegulatoryElement(NamedTuple):
    """A relation of the type ``regulatory_element``: its members by role, as (type, id)."""

    id: str
    subtype: str
    tags: Tags
    members: dict[str, list[tuple[str, str]]]


class Area(NamedTuple):
    """A multipolygon, by the nodes of its outer ring; or a way that is an area."""

    id: str
    subtype: str
    ring: tuple[str, ...]


class Bound(NamedTuple):
    """A bound of a lanelet.

    Attributes
    ----------
    nodes
        In the direction of the lanelet.
    ways
        For each way of the bound the index of its first node, and its id.
    """

    nodes: tuple[str, ...]
    ways: tuple[tuple[int, str], ...]


@dataclass(frozen=True, slots=True, eq=False)
class Lanelet:
    """A lanelet; ``left`` lies left of ``right`` seen along both.

    Attributes
    ----------
    id
        Of its own: parts of a lanelet that was cut differ.
    source
        Id of the relation in the file.
    regulations
        Ids of its regulatory elements.
    is_copy
        Whether it is the second direction of a lanelet that is driven both ways.
    part
        Number of the part, if it was cut; 0 for a whole one.
    """

    id: str
    source: str
    subtype: str
    left: Bound
    right: Bound
    tags: Tags
    regulations: tuple[str, ...] = ()
    is_copy: bool = False
    part: int = 0


@dataclass(slots=True)
class LaneletMap:
    """What a file of lanelets holds.

    Attributes
    ----------
    points
        By node: x east, y north, z up, metres, shape ``(3,)``.
    lanelets
        By id, in the order of the file.
    ways, way_tags
        By way: node ids, tags.
    geo_reference
        PROJ string of the coordinates; empty if they have no place on the Earth.
    entries
        Report of what could not be read.
    """

    points: dict[str, FloatArray]
    lanelets: dict[str, Lanelet]
    ways: dict[str, tuple[str, ...]] = field(default_factory=dict)
    way_tags: dict[str, Tags] = field(default_factory=dict)
    regulatory: dict[str, RegulatoryElement] = field(default_factory=dict)
    areas: list[Area] = field(default_factory=list)
    geo_reference: str = ""
    entries: list[ReportEntry] = field(default_factory=list)

    def line(self, nodes: Iterable[str]) -> FloatArray:
        """Points of nodes, shape ``(N, 3)``."""
        return np.array([self.points[node] for node in nodes], dtype=np.float64).reshape(-1, 3)

    def lose(self, kind: str, source: str, reason: str) -> None:
        """Add a row of what is not there any more."""
        path = f"{kind} {shown_id(source)}"
        self.entries.append(ReportEntry(ElementOutcome.LOST, path, reason, source_id=source))


def read_lanelet_file(content: bytes, *, origin: str = "") -> LaneletMap:
    """Read a Lanelet2 file.

    Parameters
    ----------
    origin
        ``"latitude,longitude"`` of the point that is x = y = 0, as Lanelet2's ``UtmProjector`` has
        it; empty: the file's ``local_x`` and ``local_y``, or the middle of its nodes.

    Raises
    ------
    InputError
        If it is no XML, a number is none, or no lanelet can be read.
    """
    root = read_xml(content, huge=True, bare=True)
    nodes: dict[str, Any] = {}
    ways: dict[str, tuple[str, ...]] = {}
    way_tags: dict[str, Tags] = {}
    relations: list[Relation] = []
    for element in root:
        identity = element.get("id")
        if identity is None or element.get("action") == "delete":
            continue
        tags = {str(tag.get("k")): str(tag.get("v")).strip() for tag in element.iter("tag")}
        if element.tag == "node":
            nodes[identity] = (element.get("lat"), element.get("lon"), tags)
            if len(nodes) > _MOST_NODES:
                raise InputError(f"more than {_MOST_NODES:,} nodes")
        elif element.tag == "way":
            ways[identity] = tuple(str(nd.get("ref")) for nd in element.iter("nd"))
            way_tags[identity] = tags
        elif element.tag == "relation":
            members: dict[str, list[tuple[str, str]]] = {}
            for member in element.iter("member"):
                role = str(member.get("role", ""))
                members.setdefault(role, []).append(
                    (str(member.get("type")), str(member.get("ref")))
                )
            relations.append((identity, tags, members))
    points, geo_reference, entries = _place_nodes(nodes, origin)
    lanelet_map = LaneletMap(points, {}, {}, way_tags, geo_reference=geo_reference, entries=entries)
    for way, refs in ways.items():
        known = tuple(ref for ref in refs if ref in points)
        if len(known) < len(refs):
            lanelet_map.lose(
                "line", way, "it names nodes that are not in the file; they are left out"
            )
        # A node that follows itself adds nothing.
        lanelet_map.ways[way] = tuple(
            node for k, node in enumerate(known) if k == 0 or node != known[k - 1]
        )
    add_relations(lanelet_map, relations)
    return lanelet_map


def share_line(lanelet_map: LaneletMap, own: str, other: str, *, turned: bool) -> None:
    """Give a way the nodes of another one, the other way round if need be, where both end alike.

    Files have other points along the line that two lanelets share.
    """
    line, theirs = lanelet_map.ways[own], lanelet_map.ways.get(other, ())
    if turned:
        theirs = theirs[::-1]
    if len(line) < 2 or len(theirs) < 2:
        return
    ends = zip(
        lanelet_map.line((line[0], line[-1])),
        lanelet_map.line((theirs[0], theirs[-1])),
        strict=True,
    )
    if all(math.dist(a, b) <= _SAME_END for a, b in ends):
        lanelet_map.ways[own] = theirs


def add_relations(lanelet_map: LaneletMap, relations: Sequence[Relation]) -> None:
    """Add what relations are to a map that has their points and ways.

    Raises
    ------
    InputError
        If none of them is a lanelet that can be read.
    """
    _weld_nodes(lanelet_map, relations)
    for identity, tags, members in relations:
        kind = tags.get("type", "")
        if kind == "lanelet":
            _add_lanelet(lanelet_map, identity, tags, members)
        elif kind == "regulatory_element":
            lanelet_map.regulatory[identity] = RegulatoryElement(
                identity, tags.get("subtype", ""), tags, members
            )
        elif kind == "multipolygon":
            _add_area(lanelet_map, identity, tags, members)
        else:
            lanelet_map.lose("relation", identity, f"its type {shown(kind)} is none of Lanelet2")
    if not lanelet_map.lanelets:
        raise InputError("no lanelet of the file can be read")


# ----------------------------------------------------------------------------- coordinates
def _place_nodes(
    nodes: Mapping[str, tuple[str | None, str | None, Tags]], origin: str
) -> tuple[dict[str, FloatArray], str, list[ReportEntry]]:
    """Positions of nodes in metres, what the coordinates mean on the Earth, and rows about it."""
    if not nodes:
        raise InputError("there is no node", element="osm")
    ids = list(nodes)
    heights = [_read_number(nodes[node][2].get("ele"), node, "ele", 0.0) for node in ids]
    is_local = not origin and all(
        "local_x" in nodes[n][2] and "local_y" in nodes[n][2] for n in ids
    )
    degrees = np.array(
        [
            (
                _read_number(nodes[node][0], node, "lat", None if not is_local else math.nan),
                _read_number(nodes[node][1], node, "lon", None if not is_local else math.nan),
            )
            for node in ids
        ]
    )
    if is_local:
        local = np.array(
            [
                [_read_number(nodes[n][2][axis], n, axis) for axis in ("local_x", "local_y")]
                for n in ids
            ]
        )
        codes = Counter(
            match[1]
            for node in ids
            if (match := _MGRS.fullmatch(nodes[node][2].get("mgrs_code", "")))
        )
        reference = _find_local_reference(local, degrees, codes)
        row = ReportEntry(
            ElementOutcome.KEPT if reference else ElementOutcome.LOST,
            "header > geoReference",
            "x and y are local_x and local_y of the nodes; "
            + (
                f"from their latitudes these are {reference}"
                if reference
                else "latitudes and longitudes disagree with them, so the map has no place on the "
                "Earth"
            ),
        )
        xy, rows = local, [row]
    else:
        xy, reference, rows = _project_to_origin(degrees, origin)
    points = {
        node: np.array((x, y, z)) for node, (x, y), z in zip(ids, xy.tolist(), heights, strict=True)
    }
    return points, reference, rows


def _read_number(text: str | None, node: str, name: str, default: float | None = None) -> float:
    if text is None and default is not None:
        return default
    try:
        value = float(text or "")
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        if default is not None and math.isnan(default):
            return default
        raise InputError(f"{name}={shown(text)} is no number", element=f"node {shown_id(node)}")
    return value


def _project_to_utm(lat: float, lon: float) -> tuple[int, float, float]:
    """Zone of a place, its easting and northing (negative south of the equator), metres."""
    zone = min(60, max(1, int((lon + 180.0) // 6.0) + 1))
    x, y = _transform_degrees(_format_zone_reference(zone, 500000.0, 0.0), np.array([[lat, lon]]))[
        0
    ].tolist()
    return zone, x, y


def _format_zone_reference(zone: int, x_0: float, y_0: float) -> str:
    lon_0 = zone * 6 - 183
    return (
        f"+proj=tmerc +lat_0=0 +lon_0={lon_0} +k=0.9996 +x_0={x_0:.12g} +y_0={y_0:.12g} "
        "+datum=WGS84 +units=m +no_defs"
    )


def _transform_degrees(reference: str, degrees: FloatArray) -> FloatArray:
    from pyproj import Transformer

    transformer = Transformer.from_crs("EPSG:4326", reference, always_xy=True)
    x, y = transformer.transform(degrees[:, 1], degrees[:, 0])
    return np.stack([np.asarray(x), np.asarray(y)], axis=1)


def _project_to_origin(
    degrees: FloatArray, origin: str
) -> tuple[FloatArray, str, list[ReportEntry]]:
    """UTM less the origin, as Lanelet2's ``UtmProjector`` has it."""
    if np.abs(degrees[:, 0]).max() > 84.5 or np.abs(degrees[:, 1]).max() > 180.0:
        worst = degrees[np.argmax(np.abs(degrees[:, 0]))]
        raise InputError(
            f"latitude {worst[0]:g}, longitude {worst[1]:g} is outside UTM", element="node"
        )
    low, high = degrees.min(axis=0), degrees.max(axis=0)
    middle = ((low + high) / 2.0).round(4).tolist()
    reference, reason = projection_at(origin or f"{middle[0]},{middle[1]}")
    if origin:
        row = ReportEntry(ElementOutcome.KEPT, "header > geoReference", f"{reason}, as chosen")
    else:
        row = ReportEntry(
            ElementOutcome.GUESSED,
            "header > geoReference",
            f"{reason}, the middle of the nodes: the file does not name its origin; the option "
            "origin does",
            0.9,
        )
    return _transform_degrees(reference, degrees), reference, [row]


def projection_at(origin: str) -> tuple[str, str]:
    """UTM with its zero at ``"latitude,longitude"``: the PROJ string, and what it is in words.

    Raises
    ------
    InputError
        If the origin is none.
    """
    try:
        lat, lon = (float(value) for value in origin.split(","))
    except ValueError:
        raise InputError(f"origin {shown(origin)} is not LATITUDE,LONGITUDE") from None
    if not (abs(lat) <= 84.5 and abs(lon) <= 180.0):
        raise InputError(f"origin {shown(origin)} is no place that UTM has")
    zone, x, y = _project_to_utm(lat, lon)
    reference = _format_zone_reference(zone, round(500000.0 - x, 6), round(-y, 6))
    return reference, f"UTM zone {zone} with x = y = 0 at latitude {lat:g}, longitude {lon:g}"


def _find_local_reference(local: FloatArray, degrees: FloatArray, zones: Counter[str]) -> str:
    """Projection in which the nodes have their local coordinates; empty if there is none."""
    if not np.isfinite(degrees).all() or np.abs(degrees).max() > 180.0:
        return ""
    if np.abs(degrees[:, 0]).max() > 84.5:
        return ""
    zone = (
        int(zones.most_common(1)[0][0])
        if zones
        else _project_to_utm(*degrees.mean(axis=0).tolist())[0]
    )
    if not 1 <= zone <= 60:
        return ""
    grid = _transform_degrees(_format_zone_reference(zone, 500000.0, 0.0), degrees)
    shift = np.median(grid - local, axis=0)
    # Squares of MGRS begin at whole kilometres: what is that near to one is one.
    whole = np.round(shift / 1000.0) * 1000.0
    shift = np.where(np.abs(shift - whole) < _MOST_DISAGREEMENT, whole, shift)
    if np.abs(grid - local - shift).max() > _MOST_DISAGREEMENT:
        return ""
    return _format_zone_reference(zone, round(500000.0 - shift[0], 3), round(-shift[1], 3))


def _weld_nodes(lanelet_map: LaneletMap, relations: Sequence[Relation]) -> None:
    """Make one of end nodes of bounds that lie within a centimetre of each other."""
    from scipy.spatial import cKDTree

    ends = sorted(
        {
            node
            for _, tags, members in relations
            if tags.get("type") == "lanelet"
            for role in ("left", "right")
            for _, way in members.get(role, ())
            for node in lanelet_map.ways.get(way, ())[
                :: max(1, len(lanelet_map.ways.get(way, ())) - 1)
            ]
        }
    )
    if len(ends) < 2:
        return
    pairs = cKDTree(lanelet_map.line(ends)).query_pairs(_SAME_PLACE, output_type="ndarray")
    same: dict[str, str] = {}
    for first, second in sorted(map(tuple, np.sort(pairs, axis=1).tolist())):
        same.setdefault(ends[second], same.get(ends[first], ends[first]))
    if not same:
        return
    for way, refs in lanelet_map.ways.items():
        if not same.keys().isdisjoint(refs):
            lanelet_map.ways[way] = tuple(same.get(node, node) for node in refs)
    for node, kept in same.items():
        lanelet_map.entries.append(
            ReportEntry(
                ElementOutcome.REPAIRED,
                f"node {shown_id(node)}",
                f"it lies within 1 cm of node {kept}: both are read as one",
                source_id=node,
            )
        )


# ----------------------------------------------------------------------------- lanelets
def _add_lanelet(
    lanelet_map: LaneletMap,
    identity: str,
    tags: Tags,
    members: Mapping[str, list[tuple[str, str]]],
) -> None:
    """Read a lanelet with its bounds, or say why it cannot be read."""
    if identity in lanelet_map.lanelets:
        lanelet_map.lose("lanelet", identity, "its id is that of another one before it")
        return
    bounds = []
    for role in ("left", "right"):
        ways = [way for kind, way in members.get(role, ()) if kind == "way"]
        missing = [way for way in ways if way not in lanelet_map.ways]
        if missing or not ways:
            reason = f"line {missing[0]} is not in the file" if missing else "it has none"
            lanelet_map.lose("lanelet", identity, f"its {role} bound cannot be read: {reason}")
            return
        bound = join_ways([(way, lanelet_map.ways[way]) for way in ways])
        if bound is None or len(set(bound.nodes)) < 2:
            lanelet_map.lose(
                "lanelet", identity, f"the ways of its {role} bound do not make one line"
            )
            return
        bounds.append(bound)
    left, right = _align_bounds(lanelet_map, *bounds)
    subtype = tags.get("subtype", "")
    if subtype not in DRIVEN | WALKED | {"crosswalk"}:
        tagged = subtype
        subtype = _guess_subtype(tags)
        if not subtype:
            lanelet_map.lose(
                "lanelet", identity, f"its subtype {shown(tagged)} is none of Lanelet2"
            )
            return
        if tagged or not any(key.startswith("participant") for key in tags):
            reason = f"a lanelet of {'subtype ' + shown(tagged) if tagged else 'no subtype'}"
            lanelet_map.entries.append(
                ReportEntry(
                    ElementOutcome.GUESSED,
                    f"lanelet {shown_id(identity)}",
                    f"{reason} is read as {subtype}",
                    0.8 if not tagged else 0.5,
                    identity,
                )
            )
    regulations = tuple(
        ref for kind, ref in members.get("regulatory_element", ()) if kind == "relation"
    )
    lanelet_map.lanelets[identity] = Lanelet(
        identity, identity, subtype, left, right, tags, regulations
    )


def _guess_subtype(tags: Tags) -> str:
    """Subtype of a lanelet that has none, by who may use it; empty if nobody is known to."""
    allowed = {
        key.partition(":")[2].split(":")[-1]
        for key, value in tags.items()
        if key.startswith("participant:") and value in ("yes", "true", "1")
    }
    if not allowed:
        return "road" if not tags.get("subtype") else ""
    if allowed & {"vehicle", "car", "truck", "motorcycle"}:
        return "road"
    for name, subtype in (
        ("bus", "bus_lane"),
        ("emergency", "emergency_lane"),
        ("bicycle", "bicycle_lane"),
        ("pedestrian", "walkway"),
    ):
        if name in allowed:
            return subtype
    return ""


def join_ways(ways: Sequence[tuple[str, tuple[str, ...]]]) -> Bound | None:
    """One line of ways in any order and direction; ``None`` if they do not make one."""
    rest = [(way, nodes) for way, nodes in ways if len(nodes) > 1]
    if not rest:
        return None
    chain = [rest.pop(0)]
    while rest:
        first, last = chain[0][1][0], chain[-1][1][-1]
        for k, (way, nodes) in enumerate(rest):
            for turned in (nodes, nodes[::-1]):
                if turned[0] == last:
                    chain.append((way, turned))
                    break
                if turned[-1] == first:
                    chain.insert(0, (way, turned))
                    break
            else:
                continue
            del rest[k]
            break
        else:
            return None
    nodes = chain[0][1][:1]
    starts = []
    for way, part in chain:
        starts.append((len(nodes) - 1, way))
        nodes += part[1:]
    return Bound(nodes, tuple(starts))


def reversed_bound(bound: Bound) -> Bound:
    """The same line in the other direction."""
    count = len(bound.nodes)
    ends = [start for start, _ in bound.ways[1:]] + [count - 1]
    ways = [(count - 1 - end, way) for (_, way), end in zip(bound.ways, ends, strict=True)]
    return Bound(bound.nodes[::-1], tuple(reversed(ways)))


def _align_bounds(lanelet_map: LaneletMap, left: Bound, right: Bound) -> tuple[Bound, Bound]:
    """Turn both bounds so that right is right of left, as ``lanelet::geometry::align`` does."""
    middles = [
        line[len(line) // 2] if len(line) > 2 else line.mean(axis=0)
        for line in (lanelet_map.line(left.nodes), lanelet_map.line(right.nodes))
    ]
    if _measure_side(lanelet_map.line(left.nodes), middles[1]) > 0.0:
        left = reversed_bound(left)
    if _measure_side(lanelet_map.line(right.nodes), middles[0]) < 0.0:
        right = reversed_bound(right)
    return left, right


def _measure_side(line: FloatArray, point: FloatArray) -> float:
    """Signed distance of a point from a line in the plane, metres, positive to its left."""
    a, b = line[:-1, :2], line[1:, :2]
    along = b - a
    size = np.maximum((along * along).sum(axis=1), 1e-12)
    share = np.clip(((point[:2] - a) * along).sum(axis=1) / size, 0.0, 1.0)
    apart = point[:2] - (a + share[:, None] * along)
    distance = np.hypot(*apart.T)
    nearest = int(np.argmin(distance))
    # At a corner the segments on both sides are equally near: the sum of their normals decides.
    rows = np.flatnonzero(distance <= distance[nearest] + 1e-9)
    unit = (along / np.sqrt(size)[:, None])[rows].sum(axis=0)
    cross = unit[0] * apart[nearest][1] - unit[1] * apart[nearest][0]
    return math.copysign(float(distance[nearest]), float(cross))


def _add_area(
    lanelet_map: LaneletMap,
    identity: str,
    tags: Tags,
    members: Mapping[str, list[tuple[str, str]]],
) -> None:
    ways = [
        (way, lanelet_map.ways[way])
        for _, way in members.get("outer", ())
        if way in lanelet_map.ways
    ]
    ring = join_ways(ways)
    if ring is None or len(set(ring.nodes)) < 3:
        lanelet_map.lose("area", identity, "the ways of its outer ring do not make one line")
        return
    nodes = ring.nodes[:-1] if ring.nodes[0] == ring.nodes[-1] else ring.nodes
    lanelet_map.areas.append(Area(identity, tags.get("subtype", ""), nodes))
