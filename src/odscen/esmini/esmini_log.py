"""The table that esmini logs with ``--csv_logger``: who is where after each step.

After the header each step has the number of the step, its time, and a block of as many columns for
each entity that is there. Whose step is empty has no end of line: the next step follows.
"""

from __future__ import annotations

import math
import re
from typing import TYPE_CHECKING, NamedTuple

from odscen.base.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Iterator

_FIRST = "#1 "
_ENTITY = re.compile(r"#1 ([A-Za-z_]+)")
_NEEDED = (
    "Entity_Name", "Entity_ID", "Current_Speed", "bb_x", "bb_y", "World_Position_X",
    "World_Position_Y", "World_Position_Z", "World_Heading_Angle",
)  # fmt: skip
_BEFORE = 2
"""Columns of a step before its first entity."""


class LoggedEntity(NamedTuple):
    """An entity after a step.

    Attributes
    ----------
    x, y, z
        Middle of its box on the ground, metres, in the frame of the map.
    hdg
        Radians, counter-clockwise from x.
    speed
        m/s, negative backwards.
    touched
        Numbers of the entities that its box overlaps.
    """

    name: str
    number: int
    x: float
    y: float
    z: float
    hdg: float
    speed: float
    touched: tuple[int, ...]


class EsminiLog:
    """Reads the table as it grows."""

    def __init__(self) -> None:
        self._rest = ""
        self._columns: dict[str, int] = {}
        self._width = 0

    def take(self, text: str) -> Iterator[tuple[float, list[LoggedEntity]]]:
        """Yield the steps that are whole with some more of it: time, s, and who is there.

        Raises
        ------
        InputError
            If a column is missing, or a row is not as the header says.
        """
        *lines, self._rest = (self._rest + text).split("\n")
        for line in lines:
            if self._columns:
                yield from self._read_line(line)
            elif _FIRST in line:
                self._read_header(line)

    def _read_header(self, line: str) -> None:
        names = [name for field in line.split(",") if (name := _ENTITY.match(field.strip()))]
        self._columns = {name[1]: number for number, name in enumerate(names)}
        self._width = len(names)
        missing = [name for name in _NEEDED if name not in self._columns]
        if missing:
            raise InputError(f"esmini logs no {', '.join(missing)}; 3.6 does")

    def _read_line(self, line: str) -> Iterator[tuple[float, list[LoggedEntity]]]:
        fields = [field.strip() for field in line.split(",")]
        if fields and not fields[-1]:  # each field is followed by a comma
            fields.pop()
        begin = 0
        while begin < len(fields):
            try:
                time = float(fields[begin + 1])
                there = begin + _BEFORE
                count = 0 if self._begins_step(fields, there) else len(fields) - there
                if count % self._width:
                    raise ValueError(f"{count} columns are no entities of {self._width}")
                ends = range(there, there + count, self._width)
                yield time, [self._read_entity(fields[at : at + self._width]) for at in ends]
            except (ValueError, IndexError) as error:
                raise InputError(f"esmini's log is not as its header says: {error}") from error
            begin = there + count

    @staticmethod
    def _begins_step(fields: list[str], at: int) -> bool:
        """Whether a step begins there; the second column of an entity is a whole number."""
        return at + 1 < len(fields) and fields[at].isdigit() and "." in fields[at + 1]

    def _read_entity(self, fields: list[str]) -> LoggedEntity:
        def number(name: str) -> float:
            return float(fields[self._columns[name]])

        hdg, ahead, left = number("World_Heading_Angle"), number("bb_x"), number("bb_y")
        c, s = math.cos(hdg), math.sin(hdg)
        touched = self._columns.get("collision_ids")
        return LoggedEntity(
            fields[self._columns["Entity_Name"]],
            int(fields[self._columns["Entity_ID"]]),
            number("World_Position_X") + ahead * c - left * s,
            number("World_Position_Y") + ahead * s + left * c,
            number("World_Position_Z"),
            hdg,
            number("Current_Speed"),
            () if touched is None else tuple(int(text) for text in fields[touched].split()),
        )
