"""What a file seems to be that no importer takes, and what to do with it."""

from __future__ import annotations

import re
from pathlib import PurePath
from typing import NamedTuple

_HEAD = 1 << 16
"""Bytes in which the first element of an XML file must begin."""
_PROLOGUE = re.compile(
    r"(?:\s+|<\?.*?\?>|<!--.*?-->|<!DOCTYPE[^\[>]*(?:\[.*?\]\s*)?>)*<([\w:.-]+)", re.DOTALL
)
_PACKED = ((b"\x1f\x8b", "gzip"), (b"PK\x03\x04", "zip"), (b"BZh", "bzip2"), (b"\xfd7zXZ", "xz"))
_TEXT = re.compile(r"[\t\n\r\f\x20-\x7e\x80-\U0010ffff]*")

_BY_NETCONVERT = "netconvert makes OpenDRIVE of it: netconvert {} FILE --opendrive-output MAP.xodr"
_AS_OSM = "give it the ending {} and add it again; it is converted to OpenDRIVE then"
_NEEDS_IMPORTER = (
    "convert it to OpenDRIVE (.xodr), or install a package with an importer for it; "
    "`odscen maps importers` lists those that are installed"
)


class FileKind(NamedTuple):
    """What a file seems to be, and what its owner can do to have it as a map."""

    what: str
    advice: str


def is_packed(content: bytes) -> bool:
    """Whether a file has to be unpacked before it can be read."""
    return any(content.startswith(magic) for magic, _ in _PACKED)


def root_element(content: bytes) -> str | None:
    """Name of the first element of an XML file, without its namespace; ``None`` if it is none."""
    head = content[:_HEAD]
    encoding = "utf-16" if head.startswith((b"\xff\xfe", b"\xfe\xff")) else "utf-8-sig"
    match = _PROLOGUE.match(head.decode(encoding, "replace"))
    return match[1].rpartition(":")[2] if match else None


def file_kind(content: bytes, file: str) -> FileKind:
    """Say what a file seems to be, from its first bytes, its root element and its name."""
    if not content:
        return FileKind("empty", "export it again")
    for magic, program in _PACKED:
        if content.startswith(magic):
            return FileKind(f"a {program} archive", "unpack it and add the file inside")
    suffix = PurePath(file.lower()).suffix
    if suffix in (".rrhd", ".rrscene"):
        return FileKind("a RoadRunner file", "export OpenDRIVE from RoadRunner (File > Export)")
    if b"OSMHeader" in content[:64]:
        return FileKind("OpenStreetMap (PBF)", _AS_OSM.format(".osm.pbf"))
    root = root_element(content)
    if root is not None:
        return _xml_kind(root, content)
    start = content[:_HEAD].decode("utf-8", "ignore").lstrip()
    if start.startswith(("{", "[")):
        what = "GeoJSON" if '"FeatureCollection"' in start else "JSON"
        return FileKind(what, _NEEDS_IMPORTER)
    if _TEXT.fullmatch(start):
        return FileKind("text", _NEEDS_IMPORTER)
    return FileKind("binary data", _NEEDS_IMPORTER)


def _xml_kind(root: str, content: bytes) -> FileKind:
    if root == "osm":
        # Relations come last in a file, so all of it is searched.
        if re.search(rb"""v=["'](?:lanelet|regulatory_element)["']""", content):
            advice = "add it under a name that ends with .osm (`odscen maps importers`: lanelet2)"
            return FileKind("a Lanelet2 map", advice)
        return FileKind("OpenStreetMap", _AS_OSM.format(".osm"))
    if root == "net":
        return FileKind(
            "a SUMO network",
            "odscen import FILE.net.xml --out S.scenario.json makes a map of it, with the network "
            "as it is; or " + _BY_NETCONVERT.format("--sumo-net-file"),
        )
    if root == "commonRoad":
        return FileKind(
            "a CommonRoad scenario",
            "give it the ending .xml and add it again; its lanelets become OpenDRIVE then",
        )
    if root == "OpenSCENARIO":
        return FileKind("an OpenSCENARIO file", "a scenario is read with: odscen import FILE")
    return FileKind(f"XML with the root element <{root[:40]}>", _NEEDS_IMPORTER)
