"""More rewrites for netconvert: names that it refuses, and records of lanes that it cannot read."""

from __future__ import annotations

import re
from copy import deepcopy
from typing import TYPE_CHECKING

from odscen.convert.report import Entry, Fate

if TYPE_CHECKING:
    from collections.abc import Iterator

    from lxml import etree

_Poly = tuple[float, float, float, float]
_Pieces = list[tuple[float, _Poly]]
"""Cubics by the sOffset that they start at."""

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


def no_includes(root: etree._Element) -> Iterator[Entry]:
    """Drop ``<include>``: netconvert would read another file in its place."""
    for include in list(root.iter("{*}include")):
        parent = include.getparent()
        if parent is not None:
            parent.remove(include)
            element = f"include {include.get('file', '?')}"
            yield Entry(Fate.LOST, element, "other files are not read")


def widths_from_borders(root: etree._Element) -> Iterator[Entry]:
    """Give lanes with ``<border>`` the ``<width>`` that this makes; netconvert reads no borders.

    A border is the t of the outer edge from the centre line, and ``width`` counts if both are there
    (section 11.5 of ASAM OpenDRIVE 1.8.0).
    """
    for section in root.iter("{*}laneSection"):
        for side, sign in (("left", 1.0), ("right", -1.0)):
            lanes = list(section.iterfind(f"{{*}}{side}/{{*}}lane"))
            lanes.sort(key=lambda lane: abs(_number(lane.get("id"))))
            inner: _Pieces = [(0.0, (0.0, 0.0, 0.0, 0.0))]
            for lane in lanes:
                widths = _pieces(lane, "width")
                borders = [] if widths else _pieces(lane, "border")
                if borders:
                    outer = [(s, _scaled(poly, sign)) for s, poly in borders]
                    _write_widths(lane, _sum(outer, inner, -1.0))
                    road = next(lane.iterancestors("{*}road"), None)
                    place = "?" if road is None else road.get("id", "?")
                    element = f"road {place} > lane {lane.get('id', '?')} > border"
                    yield Entry(Fate.REPAIRED, element, "given to netconvert as width")
                    inner = outer
                elif widths:
                    inner = _sum(inner, widths, 1.0)


def _number(text: str | None) -> float:
    """Number of an attribute, 0 where there is none: the reader has refused what is not one."""
    try:
        return float(text or 0.0)
    except ValueError:
        return 0.0


def _pieces(lane: etree._Element, tag: str) -> _Pieces:
    found = [
        (
            _number(child.get("sOffset")),
            (
                _number(child.get("a")),
                _number(child.get("b")),
                _number(child.get("c")),
                _number(child.get("d")),
            ),
        )
        for child in lane.iterchildren(f"{{*}}{tag}")
    ]
    return sorted(found, key=lambda piece: piece[0])


def _scaled(poly: _Poly, factor: float) -> _Poly:
    a, b, c, d = poly
    return factor * a, factor * b, factor * c, factor * d


def _at(pieces: _Pieces, s: float) -> _Poly:
    """Cubic in force at ``s``, in terms of the distance from ``s``."""
    start, (a, b, c, d) = next((p for p in reversed(pieces) if p[0] <= s), pieces[0])
    h = s - start
    return a + h * (b + h * (c + h * d)), b + h * (2 * c + 3 * h * d), c + 3 * h * d, d


def _sum(one: _Pieces, other: _Pieces, factor: float) -> _Pieces:
    """``one + factor * other``, piece by piece."""
    starts = sorted({s for s, _ in (*one, *other)})
    pieces: _Pieces = []
    for s in starts:
        p, q = _at(one, s), _scaled(_at(other, s), factor)
        pieces.append((s, (p[0] + q[0], p[1] + q[1], p[2] + q[2], p[3] + q[3])))
    return pieces


def _write_widths(lane: etree._Element, pieces: _Pieces) -> None:
    place = next(lane.iterchildren("{*}border"))
    for s, poly in pieces:
        values = dict(zip("abcd", (repr(value) for value in poly), strict=True))
        tag = str(place.tag).replace("border", "width")
        width = lane.makeelement(tag, {"sOffset": repr(s), **values})
        place.addprevious(width)
    for border in list(lane.iterchildren("{*}border")):
        lane.remove(border)
