"""What is drawn of a map: shapes by kind as plain arrays, for SVG, the report and the interface.

All coordinates are metres in the OpenDRIVE frame (x east, y north), to the centimetre. Nothing here
knows colours or files; see :mod:`odscen.drawing.map_sheet`.
"""

from __future__ import annotations

import json
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from odscen.base.arrays import Bounds, FloatArray, IntArray, offsets, ranges
from odscen.base.stored_files import stored_document

if TYPE_CHECKING:
    from numpy.typing import NDArray

FORMAT = "odscen-drawing"
VERSION = 1


class Lines(NamedTuple):
    """Many polylines or rings in two arrays.

    Attributes
    ----------
    xy
        Shape ``(N, 2)``, metres.
    start
        Shape ``(K + 1,)``: line ``k`` is ``xy[start[k]:start[k + 1]]``; rings do not repeat their
        first point and run counter-clockwise.
    """

    xy: FloatArray
    start: IntArray

    @property
    def total(self) -> int:
        """How many lines there are."""
        return len(self.start) - 1

    @property
    def each(self) -> list[FloatArray]:
        """The lines one by one, shape ``(n, 2)`` each."""
        return np.split(self.xy, self.start[1:-1]) if self.total else []

    def take(self, keep: NDArray[Any]) -> Lines:
        """Keep the lines chosen by a mask or by their numbers."""
        rows = np.arange(self.total)[keep]
        sizes = np.diff(self.start)[rows]
        return Lines(self.xy[ranges(self.start[:-1][rows], sizes)], offsets(sizes))

    def touching(self, bounds: Bounds) -> Lines:
        """Keep the lines whose bounding box touches ``bounds``."""
        if self.total == 0:
            return self
        low = np.minimum.reduceat(self.xy, self.start[:-1])
        high = np.maximum.reduceat(self.xy, self.start[:-1])
        inside: NDArray[np.bool_] = np.all((high >= bounds[:2]) & (low <= bounds[2:]), axis=1)
        return self.take(inside)


NO_LINES = Lines(np.empty((0, 2)), np.zeros(1, dtype=np.int64))


class Area(NamedTuple):
    """Filled rings of one kind: ``road``, ``shoulder``, ``sidewalk``, ``bicycle``, ``parking``, ...

    ``level`` 0 is the ground; a road that passes over another lies one level above it.
    """

    level: int
    kind: str
    rings: Lines


BRIDGE = "bridge"
"""Colour of a :class:`Mark` that is no paint but the two sides of a bridge."""


class Mark(NamedTuple):
    """Road markings of one style; ``width`` and ``dash`` (painted, gap) in metres."""

    level: int
    color: str
    width: float
    dash: tuple[float, float] | None
    lines: Lines


class Symbol(NamedTuple):
    """A sign or light, at a place, facing ``hdg`` (radians); ``text`` is for speed limits."""

    kind: str
    x: float
    y: float
    hdg: float
    text: str = ""


@dataclass(frozen=True, slots=True, eq=False)
class MapDrawing:
    """Everything that is drawn of a map, in drawing order.

    Attributes
    ----------
    name
        Name of the map.
    bounds
        Of all areas.
    areas, marks
        Sorted by level, then by the order they are painted in.
    crosswalks, bars
        Outlines of crosswalks and the bars of their zebra stripes, rings.
    stop_lines
        Lines along the middle of the paint, two points each.
    parking_spaces, buildings
        Rings.
    symbols
        Signs and lights, sorted.
    """

    name: str
    bounds: Bounds
    areas: tuple[Area, ...] = ()
    marks: tuple[Mark, ...] = ()
    crosswalks: Lines = NO_LINES
    bars: Lines = NO_LINES
    stop_lines: Lines = NO_LINES
    parking_spaces: Lines = NO_LINES
    buildings: Lines = NO_LINES
    symbols: tuple[Symbol, ...] = ()

    def clipped(self, bounds: Bounds) -> MapDrawing:
        """Keep only what touches ``bounds``; shapes are kept whole."""
        low_x, low_y, high_x, high_y = bounds
        areas = (area._replace(rings=area.rings.touching(bounds)) for area in self.areas)
        marks = (mark._replace(lines=mark.lines.touching(bounds)) for mark in self.marks)
        return replace(
            self,
            bounds=bounds,
            areas=tuple(area for area in areas if area.rings.total),
            marks=tuple(mark for mark in marks if mark.lines.total),
            symbols=tuple(
                symbol
                for symbol in self.symbols
                if low_x <= symbol.x <= high_x and low_y <= symbol.y <= high_y
            ),
            **{name: getattr(self, name).touching(bounds) for name in _PLAIN},
        )

    def to_json(self) -> str:
        """One line of JSON; coordinates as centimetres, each point relative to the one before."""
        document = {
            "format": FORMAT,
            "version": VERSION,
            "name": self.name,
            "bounds": [round(value, 2) for value in self.bounds],
            "areas": [[area.level, area.kind, _pack_lines(area.rings)] for area in self.areas],
            "marks": [
                [mark.level, mark.color, mark.width, mark.dash, _pack_lines(mark.lines)]
                for mark in self.marks
            ],
            "symbols": [
                [s.kind, round(s.x, 2), round(s.y, 2), round(s.hdg, 4), s.text]
                for s in self.symbols
            ],
            **{name: _pack_lines(getattr(self, name)) for name in _PLAIN},
        }
        return json.dumps(document, separators=(",", ":"), ensure_ascii=False, allow_nan=False)

    @classmethod
    def from_json(cls, text: str | bytes) -> MapDrawing:
        """Read what :meth:`to_json` wrote.

        Raises
        ------
        InputError
            If it is not a drawing, or one of another version.
        """
        with stored_document(text, form=FORMAT, version=VERSION, what="a map drawing") as document:
            return cls._read_document(document)

    @classmethod
    def _read_document(cls, document: dict[str, Any]) -> MapDrawing:
        low_x, low_y, high_x, high_y = map(float, document["bounds"])
        return cls(
            name=str(document["name"]),
            bounds=(low_x, low_y, high_x, high_y),
            areas=tuple(
                Area(level, kind, _unpack_lines(p)) for level, kind, p in document["areas"]
            ),
            marks=tuple(
                Mark(level, color, width, tuple(dash) if dash else None, _unpack_lines(packed))
                for level, color, width, dash, packed in document["marks"]
            ),
            symbols=tuple(Symbol(*symbol) for symbol in document["symbols"]),
            **{name: _unpack_lines(document[name]) for name in _PLAIN},
        )


_PLAIN = ("crosswalks", "bars", "stop_lines", "parking_spaces", "buildings")


def _pack_lines(lines: Lines) -> dict[str, list[int]]:
    whole = np.rint(lines.xy * 100.0).astype(np.int64)
    steps = np.diff(whole, axis=0, prepend=np.zeros((1, 2), dtype=np.int64))
    return {"sizes": np.diff(lines.start).tolist(), "steps": steps.ravel().tolist()}


def _unpack_lines(packed: dict[str, list[int]]) -> Lines:
    steps = np.asarray(packed["steps"], dtype=np.int64).reshape(-1, 2)
    start = offsets(np.asarray(packed["sizes"], dtype=np.int64))
    if start[-1] != len(steps):
        raise ValueError(f"{len(steps)} points for lines of {start[-1]}")
    return Lines(np.cumsum(steps, axis=0) / 100.0, start)
