"""An extract of OpenStreetMap as nodes, ways and relations: XML, packed XML, or PBF.

See https://wiki.openstreetmap.org/wiki/OSM_XML and https://wiki.openstreetmap.org/wiki/PBF_Format.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, NamedTuple

from odscen.base.errors import InputError, LimitError
from odscen.base.unpacking import unpack_parts
from odscen.base.xml_reading import read_xml
from odscen.maps.importers.file_kinds import root_element

if TYPE_CHECKING:
    from collections.abc import Iterator

    from lxml import etree

MOST_UNPACKED = 1 << 30
"""Bytes that a packed file may unpack to."""
_HEAD = 1 << 16
_LANELET2 = re.compile(rb"""v=["'](?:lanelet|regulatory_element)["']""")
_PBF_HEAD = b"OSMHeader"

Tags = dict[str, str]


class Node(NamedTuple):
    """A point in degrees, WGS84."""

    id: int
    lat: float
    lon: float
    tags: Tags


class Way(NamedTuple):
    """A line through nodes, by their ids."""

    id: int
    nodes: tuple[int, ...]
    tags: Tags


class Member(NamedTuple):
    """A member of a relation: ``node``, ``way`` or ``relation``, its id and its role."""

    kind: str
    ref: int
    role: str


class Relation(NamedTuple):
    """A relation and its members in order."""

    id: int
    members: tuple[Member, ...]
    tags: Tags


class Box(NamedTuple):
    """Degrees, WGS84."""

    west: float
    south: float
    east: float
    north: float

    def covers(self, node: Node) -> bool:
        """Whether a node lies inside."""
        return self.west <= node.lon <= self.east and self.south <= node.lat <= self.north


@dataclass(slots=True)
class Extract:
    """What is in a file, in its order.

    Attributes
    ----------
    box
        That the file says it covers, or that was cut out of it; ``None`` if neither.
    """

    nodes: dict[int, Node] = field(default_factory=dict)
    ways: dict[int, Way] = field(default_factory=dict)
    relations: dict[int, Relation] = field(default_factory=dict)
    box: Box | None = None


def is_osm(content: bytes, file: str) -> bool:
    """Whether a file is an extract of OpenStreetMap, and not Lanelet2, which has its form."""
    if _PBF_HEAD in content[:64]:
        return True
    if content.startswith((b"\x1f\x8b", b"BZh")):
        name = file.lower()
        if not name.endswith((".gz", ".bz2", ".osm")):
            return False
        head = b"".join(_take_head(unpack_parts(content)))
        return root_element(head) == "osm" and not _LANELET2.search(head)
    # Relations come last in a file, so all of it is searched.
    return root_element(content) == "osm" and not _LANELET2.search(content)


def _take_head(parts: Iterator[bytes]) -> Iterator[bytes]:
    size = 0
    for part in parts:
        yield part
        size += len(part)
        if size >= _HEAD:
            return


def read_extract(content: bytes) -> Extract:
    """Read a file.

    Raises
    ------
    InputError
        If it is damaged, or says what OpenStreetMap cannot say, with element and value; or if it is
        PBF, and the package that reads it is not installed.
    LimitError
        If it unpacks to more than :data:`MOST_UNPACKED`.
    """
    if _PBF_HEAD in content[:64]:
        return _read_pbf(content)
    if content.startswith((b"\x1f\x8b", b"BZh")):
        parts, size = [], 0
        for part in unpack_parts(content):
            parts.append(part)
            size += len(part)
            if size > MOST_UNPACKED:
                raise LimitError(
                    f"the file unpacks to more than {MOST_UNPACKED} bytes; cut a smaller extract"
                )
        content = b"".join(parts)
    return _read_tree(read_xml(content, huge=True))


def _read_tree(root: etree._Element) -> Extract:
    if root.tag != "osm":
        raise InputError(f"the root element is <{root.tag}>, not <osm>")
    extract = Extract()
    for element in root:
        # JOSM keeps what was deleted in its files.
        if element.get("action") == "delete" or element.get("visible") == "false":
            continue
        if element.tag == "node":
            number = _read_id(element)
            lat = _read_degrees(element, "lat", 90.0)
            lon = _read_degrees(element, "lon", 180.0)
            extract.nodes[number] = Node(number, lat, lon, _read_tags(element))
        elif element.tag == "way":
            number = _read_id(element)
            refs = tuple(_read_id(nd, "ref") for nd in element.iterchildren("nd"))
            extract.ways[number] = Way(number, refs, _read_tags(element))
        elif element.tag == "relation":
            number = _read_id(element)
            members = tuple(
                Member(m.get("type", ""), _read_id(m, "ref"), m.get("role", ""))
                for m in element.iterchildren("member")
            )
            extract.relations[number] = Relation(number, members, _read_tags(element))
        elif element.tag == "bounds" and extract.box is None:
            sides = ("minlon", "minlat", "maxlon", "maxlat")
            west, south, east, north = (_read_degrees(element, side, 180.0) for side in sides)
            extract.box = Box(west, south, east, north)
    return extract


def _read_id(element: etree._Element, name: str = "id") -> int:
    value = element.get(name, "")
    try:
        return int(value)
    except ValueError:
        place = f"<{element.tag}>, line {element.sourceline}"
        raise InputError(f"{place}: {name} is {value[:40]!r}, no whole number") from None


def _read_degrees(element: etree._Element, name: str, most: float) -> float:
    value = element.get(name, "")
    try:
        number = float(value)
    except ValueError:
        number = math.nan
    if not abs(number) <= most:
        place = f"{element.tag} {element.get('id', '')}"
        raise InputError(f"{place}: {name} is {value[:40]!r}, no number from -{most:g} to {most:g}")
    return number


def _read_tags(element: etree._Element) -> Tags:
    return {tag.get("k", ""): tag.get("v", "").strip() for tag in element.iterchildren("tag")}


def _read_pbf(content: bytes) -> Extract:
    try:
        import osmium
    except ImportError:
        raise InputError(
            "reading .osm.pbf needs the package osmium: pip install 'odscen[osm]'; or convert the "
            "file: osmium cat FILE -o MAP.osm.bz2"
        ) from None
    extract = Extract()
    try:
        buffer = osmium.io.FileBuffer(content, "pbf")
        header = osmium.io.Reader(buffer).header().box()
        for item in osmium.FileProcessor(buffer):
            tags = {tag.k: tag.v.strip() for tag in item.tags}
            if item.is_node():
                lat, lon = item.location.lat, item.location.lon
                extract.nodes[item.id] = Node(item.id, lat, lon, tags)
            elif item.is_way():
                extract.ways[item.id] = Way(item.id, tuple(nd.ref for nd in item.nodes), tags)
            elif item.is_relation():
                kinds = {"n": "node", "w": "way", "r": "relation"}
                members = tuple(Member(kinds[m.type], m.ref, m.role) for m in item.members)
                extract.relations[item.id] = Relation(item.id, members, tags)
    except (RuntimeError, ValueError) as error:
        raise InputError(f"the .osm.pbf file is damaged: {error}") from error
    if header.valid():
        low, high = header.bottom_left, header.top_right
        extract.box = Box(low.lon, low.lat, high.lon, high.lat)
    return extract


def parse_box(text: str) -> Box | None:
    """Read ``W,S,E,N`` in degrees; none if it is empty.

    Raises
    ------
    InputError
        If these are no four numbers, or the box is empty.
    """
    if not text.strip():
        return None
    try:
        west, south, east, north = (float(part) for part in text.split(","))
    except ValueError:
        raise InputError(f"box is {text!r}, not W,S,E,N in degrees") from None
    if not (-180 <= west < east <= 180 and -90 <= south < north <= 90):
        raise InputError(f"box is {text!r}: west must be less than east, south less than north")
    return Box(west, south, east, north)


def cut_out(extract: Extract, box: Box) -> Extract:
    """Keep what lies in a box; ways that leave it end on its border.

    A way that leaves the box and comes back becomes several ways, of which the first keeps its id
    and the others have ids below all that are in the file.
    """
    spare = min([0, *extract.nodes, *extract.ways]) - 1
    cut = Extract(relations=extract.relations, box=box)
    cut.nodes = {key: node for key, node in extract.nodes.items() if box.covers(node)}
    for way in extract.ways.values():
        runs: list[list[int]] = [[]]
        nodes = [extract.nodes[ref] for ref in way.nodes if ref in extract.nodes]
        for before, node in zip([None, *nodes[:-1]], nodes, strict=True):
            if before is not None and (box.covers(before) != box.covers(node)):
                lat, lon = _border_point(before, node, box)
                cut.nodes[spare] = Node(spare, lat, lon, {})
                runs[-1].append(spare)
                spare -= 1
                if not box.covers(node):
                    runs.append([])
            if box.covers(node):
                runs[-1].append(node.id)
        for place, run in enumerate(run for run in runs if len(run) > 1):
            number = way.id if place == 0 else spare
            spare -= place > 0
            cut.ways[number] = Way(number, tuple(run), way.tags)
    return cut


def _border_point(first: Node, second: Node, box: Box) -> tuple[float, float]:
    """Where a line from a node inside a box to one outside, or back, crosses the border."""
    inside, outside = (first, second) if box.covers(first) else (second, first)
    dlat, dlon = outside.lat - inside.lat, outside.lon - inside.lon
    shares = [1.0]
    if dlon:
        shares += [(side - inside.lon) / dlon for side in (box.west, box.east)]
    if dlat:
        shares += [(side - inside.lat) / dlat for side in (box.south, box.north)]
    share = min(share for share in shares if share >= 0.0)
    return inside.lat + share * dlat, inside.lon + share * dlon
