"""Damage to XML, and to OpenDRIVE in particular: structure, numbers, references, sizes, ids."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING
from xml.sax.saxutils import escape

from bench.fuzz.damage import DEEP, RAW, Change, Generator, pick
from tests.opendrive import mutate

if TYPE_CHECKING:
    from collections.abc import Iterator

_ID = re.compile(rb'\bid="([^"]+)"')
_GEOMETRY = re.compile(rb"<(?:line|arc|spiral|poly3|paramPoly3)\b[^>]*?/>", re.DOTALL)
_ELEMENT = re.compile(rb"<([A-Za-z0-9]+)\b([^<>]*?)/>")
_ROAD = re.compile(rb"<road\b.*?</road>", re.DOTALL)
_LANE = re.compile(rb"<lane\b.*?</lane>", re.DOTALL)
_SECTION = re.compile(rb"<laneSection\b.*?</laneSection>", re.DOTALL)
_OBJECT = re.compile(rb"<(?:object|signal)\b[^>]*?/>|<object\b.*?</object>", re.DOTALL)
_NAMED = re.compile(rb'\b([A-Za-z]+)="([-+]?[0-9.]+(?:[eE][-+]?[0-9]+)?)"')
_SHAPES = (
    b"<line/>",
    b'<arc curvature="%s"/>',
    b'<spiral curvStart="0" curvEnd="%s"/>',
    b'<poly3 a="0" b="0" c="%s" d="0"/>',
    b'<poly3 a="0" b="%s" c="0" d="1"/>',
    b'<paramPoly3 aU="0" bU="1" cU="0" dU="0" aV="0" bV="0" cV="%s" dV="0" pRange="arcLength"/>',
    b'<paramPoly3 aU="0" bU="%s" cU="0" dU="0" aV="0" bV="0" cV="0" dV="0" pRange="normalized"/>',
)
_SIZES = (b"1e-9", b"1e-3", b"0.5", b"7", b"1e3", b"1e5", b"1e7", b"1e9", b"-1e9", b"1e15")
_IDS = (
    "a>b",
    "a<b",
    'a"b',
    "a'b",
    "a&b",
    "a b",
    " a",
    "a,b",
    "a.b",
    "a:b",
    "a/b",
    "..",
    "a|b",
    "a#b",
    "a%b",
    "{0}",
    "ä\u0301",
    "\u202ea",
    "a\u200bb",
    "😀",
    "x" * 3000,
    "-1",
    "0",
    "1e3",
    "None",
    "a\\b",
    "a;b",
    "a=b",
    "(a)",
    "[a]",
    "$a",
    "`a`",
    "a\u2028b",
)


def _name(data: bytes, rng: Generator) -> bytes:
    """One id replaced wherever it is named, by one that is as good."""
    found = _ID.findall(data)
    if not found:
        return data
    old, new = pick(rng, found), escape(pick(rng, _IDS), {'"': "&quot;"}).encode()
    pattern = (
        rb'\b(id|elementId|incomingRoad|connectingRoad|linkedRoad|signalId|junction|name)="'
        + re.escape(old)
        + rb'"'
    )
    return re.sub(pattern, lambda hit: hit[1] + b'="' + new + b'"', data)


def _renumber(road: bytes, number: int) -> bytes:
    return _ID.sub(b'id="c%d"' % number, road, count=1)


def _many_roads(data: bytes, rng: Generator) -> bytes:
    """One road hundreds of times, in the same place or beside itself, with ids of their own."""
    found = _ROAD.search(data) if rng.random() < 0.5 else None
    found = found or (pick(rng, list(_ROAD.finditer(data))) if _ROAD.search(data) else None)
    if found is None or len(found[0]) > 20_000:
        return data
    copies = [_renumber(found[0], n) for n in range(int(pick(rng, (3, 30, 500))))]
    if rng.random() < 0.5:
        copies = [
            re.sub(rb'(<geometry\b[^>]*?\bx=")[^"]*', rb"\g<1>%d" % (n % 40), one)
            for n, one in enumerate(copies)
        ]
    return data[: found.end()] + b"".join(copies) + data[found.end() :]


def _many(pattern: re.Pattern[bytes], data: bytes, rng: Generator) -> bytes:
    found = list(pattern.finditer(data))
    if not found:
        return data
    one = pick(rng, found)
    times = min(int(pick(rng, (3, 60, 1000))), 400_000 // len(one[0]))
    copies = (
        re.sub(rb'\bid="(-?)[^"]*"', rb'id="\g<1>%d"' % (n + 2), one[0], count=1)
        for n in range(times)
    )
    return data[: one.end()] + b"".join(copies) + data[one.end() :]


def _many_sections(data: bytes, rng: Generator) -> bytes:
    """Lane sections hundreds of times, coincident or a little apart."""
    found = list(_SECTION.finditer(data))
    if not found:
        return data
    one, step = pick(rng, found), float(pick(rng, (0.0, 1e-9, 1e-3, 0.5)))
    times = min(int(pick(rng, (3, 60, 500))), 600_000 // len(one[0]))
    s = re.search(rb'\bs="([^"]*)"', one[0])
    start = float(s[1]) if s and re.fullmatch(rb"[0-9.eE+-]+", s[1]) else 0.0
    copies = (
        re.sub(rb'\bs="[^"]*"', b's="%.9f"' % (start + n * step), one[0], count=1)
        for n in range(1, times)
    )
    return data[: one.end()] + b"".join(copies) + data[one.end() :]


def _shape(data: bytes, rng: Generator) -> bytes:
    """Another curve in place of one, of any size."""
    found = list(_GEOMETRY.finditer(data))
    if not found:
        return data
    one = pick(rng, found)
    shape = pick(rng, _SHAPES)
    made = shape % pick(rng, _SIZES) if b"%s" in shape else shape
    return data[: one.start()] + made + data[one.end() :]


def _all_numbers(data: bytes, rng: Generator) -> bytes:
    """All numbers of one attribute a thousand times larger or smaller, or shifted."""
    names = sorted(set(_NAMED.findall(data)))
    if not names:
        return data
    name = pick(rng, names)[0]
    factor, more = float(pick(rng, (1e-3, 0.3, 3, 1e3, 1e6))), float(pick(rng, (0, 0, 1e-4, 1e3)))

    def moved(hit: re.Match[bytes]) -> bytes:
        return hit[1] + b'="' + repr(_float(hit[2]) * factor + more).encode() + b'"'

    return re.sub(rb"\b(" + name + rb')="([-+]?[0-9.]+(?:[eE][-+]?[0-9]+)?)"', moved, data)


def _float(text: bytes) -> float:
    try:
        return float(text)
    except ValueError:
        return 0.0


def _little(data: bytes, rng: Generator) -> bytes:
    """Numbers off by less than a millimetre, as writers in single precision have them."""

    def moved(hit: re.Match[bytes]) -> bytes:
        value = _float(hit[2]) + float(rng.normal(0.0, 3e-4)) * (rng.random() < 0.2)
        return hit[1] + b'="' + repr(value).encode() + b'"'

    return re.sub(rb"\b(s|sOffset|length)=\"([-+]?[0-9.]+(?:[eE][-+]?[0-9]+)?)\"", moved, data)


def _shuffled(data: bytes, rng: Generator) -> bytes:
    """Elements of one name in another order."""
    groups: dict[bytes, list[tuple[int, int]]] = {}
    for hit in _ELEMENT.finditer(data):
        groups.setdefault(hit[1], []).append(hit.span())
    several = [spans for spans in groups.values() if len(spans) > 1]
    if not several:
        return data
    spans = pick(rng, several)
    one, other = sorted(rng.choice(len(spans), 2, replace=False))
    (a, b), (c, d) = spans[one], spans[other]
    return data[:a] + data[c:d] + data[b:c] + data[a:b] + data[d:]


def _nested(data: bytes, rng: Generator) -> bytes:
    """Elements in elements, thousands deep, inside the document."""
    place = data.find(b">", int(rng.integers(len(data) + 1))) + 1
    depth = int(pick(rng, (300, 5000, DEEP)))
    return data[:place] + b"<userData>" * depth + b"</userData>" * depth + data[place:]


def _old_damage(kind: str) -> Change:
    return lambda data, rng: mutate._KINDS[kind](data, rng) if data else data


def _named_changes() -> Iterator[tuple[str, Change]]:
    for kind in sorted(mutate._KINDS):
        yield kind, _old_damage(kind)


XML: dict[str, Change] = {
    **RAW,
    **dict(_named_changes()),
    "nested": _nested,
    "shuffled": _shuffled,
    "all numbers": _all_numbers,
    "strange id": _name,
}
MAP: dict[str, Change] = {
    **XML,
    "many roads": _many_roads,
    "many lanes": lambda data, rng: _many(_LANE, data, rng),
    "many objects": lambda data, rng: _many(_OBJECT, data, rng),
    "many sections": _many_sections,
    "shape": _shape,
    "shape again": _shape,
    "a little off": _little,
    "strange id again": _name,
}
