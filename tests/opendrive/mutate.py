"""Deterministic damage to OpenDRIVE files, for tests and `bench/fuzz/map_damage.py`.

Each mutation draws one kind of damage; the same text, seed and count give the same bytes anywhere.
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

_NUMBER = re.compile(rb'="([-+]?[0-9.]+(?:[eE][-+]?[0-9]+)?)"')
_REFERENCE = re.compile(
    rb'(?:elementId|incomingRoad|connectingRoad|linkedRoad|signalId|junction| id|from|to)="([^"]*)"'
)
_ATTRIBUTE = re.compile(rb'\s[A-Za-z]+="[^"]*"')
_WORD = re.compile(rb'="([A-Za-z][A-Za-z0-9/ ]*)"')
_ELEMENT = re.compile(rb"<([A-Za-z]+)\b[^<>]*?(/>|>)")
_VALUES = (
    b"NaN", b"inf", b"-inf", b"1e300", b"-1e300", b"1e9", b"-1", b"0", b"", b"1e-300", b"12,5",
    b"abc", b"0x10", b"1_000", b"999999999999", b"-0.0", b"1e6", b"-1e6", b"1000000", b" 3 ",
)  # fmt: skip
_BOMB = b"""<!DOCTYPE OpenDRIVE [<!ENTITY a0 "aaaaaaaaaa">%s]>""" % b"".join(
    b'<!ENTITY a%d "%s">' % (i, b"&a%d;" % (i - 1) * 10) for i in range(1, 10)
)


class Mutation(NamedTuple):
    """Damaged file: ``kind`` says what was done, ``data`` is the result."""

    kind: str
    data: bytes


def mutations(text: str | bytes, seed: int, count: int) -> Iterator[Mutation]:
    """``count`` damaged copies of a file."""
    data = text.encode() if isinstance(text, str) else text
    rng = np.random.default_rng(seed)
    kinds = sorted(_KINDS)
    for _ in range(count):
        kind = kinds[int(rng.integers(len(kinds)))]
        yield Mutation(kind, _KINDS[kind](data, rng))


def _pick(
    pattern: re.Pattern[bytes], data: bytes, rng: np.random.Generator
) -> re.Match[bytes] | None:
    found = list(pattern.finditer(data))
    return found[int(rng.integers(len(found)))] if found else None


def _replace(data: bytes, start: int, end: int, new: bytes) -> bytes:
    return data[:start] + new + data[end:]


def _value(data: bytes, rng: np.random.Generator) -> bytes:
    for _ in range(int(rng.integers(1, 4))):
        found = _pick(_NUMBER, data, rng)
        if found:
            value = _VALUES[int(rng.integers(len(_VALUES)))]
            data = _replace(data, *found.span(1), value)
    return data


def _scaled(data: bytes, rng: np.random.Generator) -> bytes:
    found = _pick(_NUMBER, data, rng)
    if not found:
        return data
    value = float(found[1]) * float(10.0 ** rng.integers(-6, 7)) * float(rng.choice([-1, 1]))
    return _replace(data, *found.span(1), repr(value).encode())


def _reference(data: bytes, rng: np.random.Generator) -> bytes:
    found = _pick(_REFERENCE, data, rng)
    return _replace(data, *found.span(1), b"4711") if found else data


def _swapped(data: bytes, rng: np.random.Generator) -> bytes:
    one, two = _pick(_REFERENCE, data, rng), _pick(_REFERENCE, data, rng)
    return _replace(data, *one.span(1), two[1]) if one and two else data


def _word(data: bytes, rng: np.random.Generator) -> bytes:
    one, two = _pick(_WORD, data, rng), _pick(_WORD, data, rng)
    return _replace(data, *one.span(1), two[1]) if one and two else data


def _no_attribute(data: bytes, rng: np.random.Generator) -> bytes:
    found = _pick(_ATTRIBUTE, data, rng)
    return _replace(data, *found.span(), b"") if found else data


def _span(data: bytes, rng: np.random.Generator) -> tuple[int, int] | None:
    """Span of one whole element but the first two, which are the root and the header."""
    found = list(_ELEMENT.finditer(data))[2:]
    if not found:
        return None
    start = found[int(rng.integers(len(found)))]
    if start[2] == b"/>":
        return start.span()
    end = data.find(b"</" + start[1] + b">", start.end())
    return (start.start(), end + len(start[1]) + 3) if end >= 0 else None


def _dropped(data: bytes, rng: np.random.Generator) -> bytes:
    span = _span(data, rng)
    return _replace(data, *span, b"") if span else data


def _doubled(data: bytes, rng: np.random.Generator) -> bytes:
    span = _span(data, rng)
    return _replace(data, span[1], span[1], data[slice(*span)]) if span else data


def _moved(data: bytes, rng: np.random.Generator) -> bytes:
    one, two = _span(data, rng), _span(data, rng)
    return _replace(data, two[1], two[1], data[slice(*one)]) if one and two else data


def _renamed(data: bytes, rng: np.random.Generator) -> bytes:
    one, two = _pick(_ELEMENT, data, rng), _pick(_ELEMENT, data, rng)
    if not one or not two:
        return data
    return data.replace(b"<" + one[1] + b" ", b"<" + two[1] + b" ", 1)


def _bytes(data: bytes, rng: np.random.Generator) -> bytes:
    damaged = bytearray(data)
    for _ in range(int(rng.integers(1, 20))):
        damaged[int(rng.integers(len(damaged)))] = int(rng.integers(256))
    return bytes(damaged)


def _cut(data: bytes, rng: np.random.Generator) -> bytes:
    return data[: int(rng.integers(len(data)))]


def _body(data: bytes) -> bytes:
    return re.sub(rb"^\s*(<\?xml[^>]*\?>)?\s*", b"", data)


def _bomb(data: bytes, rng: np.random.Generator) -> bytes:
    found = _pick(_WORD, data, rng)
    used = _replace(data, *found.span(1), b"&a9;") if found else data
    return b'<?xml version="1.0"?>' + _BOMB + _body(used)


def _external(data: bytes, rng: np.random.Generator) -> bytes:
    found = _pick(_WORD, data, rng)
    used = _replace(data, *found.span(1), b"&x;") if found else data
    dtd = b'<!DOCTYPE OpenDRIVE [<!ENTITY x SYSTEM "file:///etc/hostname">]>'
    return b'<?xml version="1.0"?>' + dtd + _body(used)


def _encoding(data: bytes, rng: np.random.Generator) -> bytes:
    name = (b"utf-16", b"nonsense", b"ascii", b"utf-7")[int(rng.integers(4))]
    return b'<?xml version="1.0" encoding="' + name + b'"?>' + _body(data) + "ä".encode("latin-1")


_KINDS: dict[str, Callable[[bytes, np.random.Generator], bytes]] = {
    "bytes": _bytes,
    "cut": _cut,
    "element doubled": _doubled,
    "element dropped": _dropped,
    "element moved": _moved,
    "element renamed": _renamed,
    "encoding": _encoding,
    "entity bomb": _bomb,
    "external entity": _external,
    "no attribute": _no_attribute,
    "reference": _reference,
    "reference swapped": _swapped,
    "scaled": _scaled,
    "value": _value,
    "word": _word,
}
