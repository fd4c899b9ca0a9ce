"""More rewrites for netconvert: names that it refuses, and records of lanes that it cannot read."""

from __future__ import annotations

import re
from copy import deepcopy
from typing import TYPE_CHECKING

from odscen.convert.report import Entry, Fate

if TYPE_CHECKING:
    from collections.abc import Iterator

    from lxml import etree

_GOOD_ID = re.compile(r"[A-Za-z0-9_.\-]+")

_REFERENCES = {
    "road": ("id", "junction"),
    "junction": ("id", "mainRoad"),
    "predecessor": ("elementId",),
    "successor": ("elementId",),
    "connection": ("incomingRoad", "connectingRoad", "linkedRoad"),
}
"""Attributes that hold ids of roads and junctions; those of lanes have other names."""


def plain_ids(root: etree._Element) -> Iterator[Entry]:
    """Give roads and junctions plain ids; SUMO refuses blanks, commas and more in names.

    Nothing reads the ids back: the lane table is made by geometry.
    """
    named = [*root.iter("{*}road"), *root.iter("{*}junction")]
    taken = {element.get("id", "") for element in named}
    renamed: dict[str, str] = {}
    for old in sorted(taken):
        if old and not _GOOD_ID.fullmatch(old):
            new = f"odscen{len(renamed)}"
            while new in taken:
                new += "_"
            taken.add(new)
            renamed[old] = new
            yield Entry(Fate.REPAIRED, f"id {old!r}", f"given to netconvert as {new}")
    if not renamed:
        return
    for tag, attributes in _REFERENCES.items():
        for element in root.iter(f"{{*}}{tag}"):
            for name in attributes:
                if element.get(name) in renamed:
                    element.set(name, renamed[element.get(name, "")])


def flat_access(root: etree._Element) -> Iterator[Entry]:
    """Write ``<restriction>`` of OpenDRIVE 1.8 as the attribute that it was before.

    An ``<access>`` with neither says nothing about anybody; netconvert refuses it.
    """
    for access in list(root.iter("{*}access")):
        lane = access.getparent()
        if lane is None or access.get("restriction"):
            continue
        kinds = [child.get("type", "") for child in access.iterchildren("{*}restriction")]
        for kind in filter(None, kinds):
            own = deepcopy(access)
            for child in list(own):
                own.remove(child)
            own.set("restriction", kind)
            access.addprevious(own)
        lane.remove(access)
        road = next(lane.iterancestors("{*}road"), None)
        place = "?" if road is None else road.get("id", "?")
        said = ", ".join(filter(None, kinds)) or "nobody"
        element = f"road {place} > lane {lane.get('id', '?')} > access"
        yield Entry(Fate.REPAIRED, element, f"restriction of {said} given to netconvert flat")
