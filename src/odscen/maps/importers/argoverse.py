"""The importer of vector maps of Argoverse 2, by that of Lanelet2.

argoverse.org, ``log_map_archive_*.json`` of av2-api: lane segments and pedestrian crossings.
"""

from __future__ import annotations

import json
import math
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from odscen.base.errors import InputError
from odscen.base.shown import shown
from odscen.maps.importers.base import ImportedMap, MapImporter

if TYPE_CHECKING:
    from collections.abc import Mapping

    from odscen.base.arrays import FloatArray
    from odscen.learning.offered_options import OptionValue
    from odscen.maps.importers.lanelet2.lanelet_file import LaneletMap, Relation

_SUBTYPES = {"VEHICLE": "road", "BIKE": "bicycle_lane", "BUS": "bus_lane"}
"""Lanelet2's subtypes of types of lane segments."""
_MILLIMETRES = 1000.0
_FARTHEST = 1e8
_SIDES = ("left", "right")


class ArgoverseImporter(MapImporter):
    """Argoverse 2: lane segments and crosswalks of a log; its tracks are recorded traffic."""

    name = "argoverse"
    label = "Argoverse 2 (log_map_archive_*.json)"
    suffixes = (".json",)
    version = "1"
    options: ClassVar[Any] = {
        "properties": {
            "traffic": {
                "type": "string",
                "enum": ["auto", "right", "left"],
                "default": "right",
                "title": "Side on which traffic keeps",
            },
        }
    }

    def detect(self, content: bytes, file: str) -> bool:
        """Whether it is JSON with lane segments."""
        is_object = content[:64].lstrip()[:1] == b"{"
        return is_object and file.lower().endswith(".json") and b'"lane_segments"' in content

    def to_opendrive(self, content: bytes, options: Mapping[str, OptionValue]) -> ImportedMap:
        """Make roads of lane segments; see :mod:`odscen.maps.importers.lanelet2`.

        Raises
        ------
        InputError
            If the file is damaged, or has no lane segment.
        """
        from odscen.maps.importers.lanelet2.conversion import convert_lanelets

        return convert_lanelets(read_argoverse_map(content), str(options["traffic"]))


def read_argoverse_map(content: bytes) -> LaneletMap:
    """Lane segments as lanelets of a Lanelet2 file; points at one place are one node.

    Raises
    ------
    InputError
        If it is no map of Argoverse 2, or a coordinate is no number.
    """
    from odscen.maps.importers.lanelet2.lanelet_file import LaneletMap, add_relations, share_line

    try:
        whole = json.loads(content)
    except (ValueError, RecursionError) as error:
        raise InputError(f"it is no JSON: {error}") from error
    segments = _objects_of(whole, "lane_segments")
    lanelet_map = LaneletMap({}, {})
    relations: list[Relation] = []
    for identity, segment in segments.items():
        lines = {side: segment.get(f"{side}_lane_boundary") for side in _SIDES}
        marks = {side: segment.get(f"{side}_lane_mark_type") for side in _SIDES}
        members = _add_ways(lanelet_map, identity, f"lane_segments > {identity}", lines, marks)
        subtype = _SUBTYPES.get(str(segment.get("lane_type")), "road")
        tags = {"type": "lanelet", "subtype": subtype, "location": "urban", "one_way": "yes"}
        relations.append((identity, tags, members))
    for identity, segment in segments.items():
        beside = str(segment.get("left_neighbor_id"))
        if beside not in segments:
            continue
        # The line to the left of one is to the right of the other, or to its left if that comes
        # towards it.
        own = _way_of(identity, "left")
        share_line(lanelet_map, own, _way_of(beside, "right"), turned=False)
        towards = _way_of(beside, "left")
        if own < towards:
            share_line(lanelet_map, own, towards, turned=True)
    for identity, crossing in _objects_of(whole, "pedestrian_crossings").items():
        lines = {"left": crossing.get("edge1"), "right": crossing.get("edge2")}
        where = f"pedestrian_crossings > {identity}"
        name = _way_of("crossing", identity)  # their numbers are counted apart
        members = _add_ways(lanelet_map, name, where, lines, {})
        tags = {"type": "lanelet", "subtype": "crosswalk", "location": "urban"}
        relations.append((name, tags, members))
    if not segments:
        raise InputError("there is no lane segment", element="lane_segments")
    add_relations(lanelet_map, relations)
    return lanelet_map


def _objects_of(whole: object, name: str) -> dict[str, dict[str, Any]]:
    objects = whole.get(name, {}) if isinstance(whole, dict) else None
    if not isinstance(objects, dict) or not all(isinstance(o, dict) for o in objects.values()):
        raise InputError("it is no object of objects", element=name)
    return objects


def _add_ways(
    found: LaneletMap,
    identity: str,
    where: str,
    lines: Mapping[str, object],
    marks: Mapping[str, object],
) -> dict[str, list[tuple[str, str]]]:
    """Add the lines to the left and right of a lanelet; its members."""
    members = {}
    for side, line in lines.items():
        way = _way_of(identity, side)
        found.ways[way] = _nodes_of(line, found.points, f"{where} > {side}")
        found.way_tags[way] = _mark_of(str(marks.get(side) or ""))
        members[side] = [("way", way)]
    return members


def _way_of(identity: str, side: str) -> str:
    return f"{identity} {side}"


def _mark_of(name: str) -> dict[str, str]:
    """Tags of a line with a mark such as ``DOUBLE_SOLID_YELLOW``; ``NONE`` has no paint."""
    kinds = [part.lower() for part in name.split("_") if part in ("SOLID", "DASHED", "DASH")]
    words = ["dashed" if kind == "dash" else kind for kind in kinds]
    if not words:
        return {"type": "virtual"}
    twice = words * 2 if name.startswith("DOUBLE") else words
    return {"type": "line_thin", "subtype": "_".join(twice)}


def _nodes_of(line: object, points: dict[str, FloatArray], where: str) -> tuple[str, ...]:
    nodes: list[str] = []
    for point in line if isinstance(line, list) else ():
        values = [point.get(axis) if isinstance(point, dict) else None for axis in ("x", "y", "z")]
        numbers = [_number_of(value) for value in values]
        numbers[2] = numbers[2] if math.isfinite(numbers[2]) else 0.0
        if not all(map(math.isfinite, numbers)):
            x, y = (shown(str(value)) for value in values[:2])
            raise InputError(f"({x}, {y}) is no place", element=where)
        name = ",".join(str(round(number * _MILLIMETRES)) for number in numbers)
        points.setdefault(name, np.array(numbers))
        if not nodes or nodes[-1] != name:
            nodes.append(name)
    return tuple(nodes)


def _number_of(value: object) -> float:
    """A coordinate; what is none, or as far away as nothing is, is no number."""
    is_place = isinstance(value, int | float) and abs(value) <= _FARTHEST
    return float(value) if is_place else math.nan  # type: ignore[arg-type]
