"""The importer of the lanelets of CommonRoad scenarios, by that of Lanelet2.

commonroad.in.tum.de, ``XML_commonRoad_XSD.xsd`` of commonroad-io: versions 2018b and 2020a.
"""

from __future__ import annotations

import contextlib
import math
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from odscen.base.errors import InputError
from odscen.base.shown import shown
from odscen.base.xml_reading import read_xml
from odscen.maps.importers.base import ImportedMap, MapImporter
from odscen.maps.importers.file_kinds import root_element

if TYPE_CHECKING:
    from collections.abc import Mapping

    from lxml import etree

    from odscen.base.arrays import FloatArray
    from odscen.learning.offered_options import OptionValue
    from odscen.maps.importers.lanelet2.lanelet_file import LaneletMap, Relation, Tags

_SUBTYPES = {
    "highway": "highway",
    "interstate": "highway",
    "mainCarriageWay": "highway",
    "country": "road",
    "accessRamp": "road",
    "exitRamp": "exit",
    "driveWay": "road",
    "sidewalk": "walkway",
    "crosswalk": "crosswalk",
    "busLane": "bus_lane",
    "bicycleLane": "bicycle_lane",
    "shoulder": "road_shoulder",
}
"""Lanelet2's subtypes of CommonRoad's types of lanelets; others are roads."""
_MARKS = {
    "solid": ("line_thin", "solid"),
    "dashed": ("line_thin", "dashed"),
    "broad_solid": ("line_thick", "solid"),
    "broad_dashed": ("line_thick", "dashed"),
    "curb": ("curbstone", "high"),
    "lowered_curb": ("curbstone", "low"),
}
_LIMIT_SIGNS = ("274", "R2-1", "274.1")
_MILLIMETRES = 1000.0


class CommonRoadImporter(MapImporter):
    """CommonRoad: the lanelets of a scenario; its obstacles are read as recorded traffic."""

    name = "commonroad"
    label = "CommonRoad (.xml with lanelets)"
    suffixes = (".xml",)
    version = "1"
    options: ClassVar[Any] = {
        "properties": {
            "traffic": {
                "type": "string",
                "enum": ["auto", "right", "left"],
                "default": "auto",
                "title": "Side on which traffic keeps",
            },
        }
    }

    def detect(self, content: bytes, file: str) -> bool:  # noqa: ARG002 - content decides
        """Whether its root element is that of CommonRoad."""
        return root_element(content) == "commonRoad"

    def to_opendrive(self, content: bytes, options: Mapping[str, OptionValue]) -> ImportedMap:
        """Make roads of lanelets; see :mod:`odscen.maps.importers.lanelet2`.

        Raises
        ------
        InputError
            If the file is damaged, or has no lanelet.
        """
        from odscen.maps.importers.lanelet2.conversion import convert_lanelets

        return convert_lanelets(read_commonroad_lanelets(content), str(options["traffic"]))


def read_commonroad_lanelets(content: bytes) -> LaneletMap:
    """Lanelets of a scenario as those of a Lanelet2 file; points at one place are one node.

    Raises
    ------
    InputError
        If it is no CommonRoad scenario, or a coordinate is no number.
    """
    from odscen.maps.importers.lanelet2.lanelet_file import (
        LaneletMap,
        add_relations,
    )

    root = read_xml(content, huge=True, bare=True)
    if root.tag != "commonRoad":
        raise InputError(f"its root element is <{root.tag}>, not <commonRoad>")
    lanelet_map = LaneletMap({}, {})
    relations: list[Relation] = []
    limits = _limits_of_signs(root)
    for lanelet in root.iterfind("lanelet"):
        identity = str(lanelet.get("id"))
        members = {}
        for side in ("left", "right"):
            way = f"{identity} {side}"
            bound = lanelet.find(f"{side}Bound")
            lanelet_map.ways[way] = _nodes_of(
                bound, lanelet_map.points, f"lanelet {identity} > {side}Bound"
            )
            mark = "" if bound is None else (bound.findtext("lineMarking") or "").strip()
            kind, subtype = _MARKS.get(mark, ("virtual", ""))
            lanelet_map.way_tags[way] = (
                {"type": kind, "subtype": subtype} if subtype else {"type": kind}
            )
            members[side] = [("way", way)]
        relations.append((identity, _tags_of(lanelet, limits), members))
    for lanelet in root.iterfind("lanelet"):
        _share_bound(lanelet, lanelet_map)
    add_relations(lanelet_map, relations)
    return lanelet_map


def _share_bound(lanelet: etree._Element, found: LaneletMap) -> None:
    """Give a lanelet the line of its left neighbour as its own bound, where both end alike."""
    from odscen.maps.importers.lanelet2.lanelet_file import share_line

    beside = lanelet.find("adjacentLeft")
    if beside is None:
        return
    is_same = beside.get("drivingDir") == "same"
    own, other = (
        f"{lanelet.get('id')} left",
        f"{beside.get('ref')} {'right' if is_same else 'left'}",
    )
    if not is_same and own < other:
        return  # the other one takes this one's
    share_line(found, own, other, turned=not is_same)


def _nodes_of(
    bound: etree._Element | None, points: dict[str, FloatArray], where: str
) -> tuple[str, ...]:
    nodes: list[str] = []
    for point in () if bound is None else bound.iterfind("point"):
        texts = [point.findtext(axis) for axis in ("x", "y")]
        try:
            x, y = (float(text or "") for text in texts)
            z = float(point.findtext("z") or 0.0)
        except ValueError:
            x = math.nan
        if not math.isfinite(x) or not math.isfinite(y):
            raise InputError(f"({shown(texts[0])}, {shown(texts[1])}) is no place", element=where)
        name = f"{round(x * _MILLIMETRES)},{round(y * _MILLIMETRES)},{round(z * _MILLIMETRES)}"
        points.setdefault(name, np.array([x, y, z]))
        if not nodes or nodes[-1] != name:
            nodes.append(name)
    return tuple(nodes)


def _limits_of_signs(root: etree._Element) -> dict[str, float]:
    """Speed limits of traffic signs, m/s, by the id of the sign."""
    limits = {}
    for sign in root.iterfind("trafficSign"):
        for element in sign.iterfind("trafficSignElement"):
            text = element.findtext("additionalValue") or ""
            if (element.findtext("trafficSignID") or "").strip() in _LIMIT_SIGNS:
                try:
                    limits[str(sign.get("id"))] = float(text)
                except ValueError:
                    continue
    return limits


def _tags_of(lanelet: etree._Element, limits: Mapping[str, float]) -> Tags:
    types = [(kind.text or "").strip() for kind in lanelet.iterfind("laneletType")]
    subtype = next((_SUBTYPES[kind] for kind in types if kind in _SUBTYPES), "road")
    tags = {"type": "lanelet", "subtype": subtype, "location": "urban", "one_way": "yes"}
    if subtype == "highway":
        tags["location"] = "nonurban"
    own = [limits[str(sign.get("ref"))] for sign in lanelet.iterfind("trafficSignRef")
           if sign.get("ref") in limits]  # fmt: skip
    text = lanelet.findtext("speedLimit")
    with contextlib.suppress(ValueError):
        own += [float(text)] if text else []
    if own and 0.0 < min(own) < 100.0:
        tags["speed_limit"] = f"{min(own):g} m/s"
    return tags
