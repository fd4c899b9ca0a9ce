"""Lines of a self-check: what is expected of a server, what was seen, and whether that will do."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import StrEnum
from typing import TYPE_CHECKING

from odscen.base.errors import CarlaError

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence


class CheckState(StrEnum):
    """What came of a check."""

    OK = "ok"
    DIFFERS = "differs"
    NOT_CHECKED = "not checked"


@dataclass(frozen=True, slots=True)
class CheckLimits:
    """By how much a server may differ.

    Attributes
    ----------
    place, heading, feet, speed
        Metres, degrees, metres above or below the ground, m/s.
    ground
        Metres that the server's ground may be off the map's surface.
    pace
        Ticks per second of wall time, at least: 20 of 0.05 s are real time.
    ground_ms
        Milliseconds that the server may take to say what is below a place.
    """

    place: float = 0.05
    heading: float = 0.5
    feet: float = 0.03
    speed: float = 0.1
    ground: float = 0.5
    pace: float = 20.0
    ground_ms: float = 5.0


@dataclass(frozen=True, slots=True)
class CheckLine:
    """One check.

    Attributes
    ----------
    name
        Short and always the same, so that pages can be compared.
    expected, seen
        In words, with units.
    note
        What the mirror makes of it, or why it was not checked.
    """

    name: str
    expected: str
    seen: str
    state: CheckState
    note: str = ""


@dataclass(slots=True)
class SelfcheckReport:
    """What came of a self-check.

    Attributes
    ----------
    server
        Its address.
    versions
        Of the server, the package ``carla``, odscen, Python and the operating system.
    map
        Name of the map that the server shows.
    lines
        In the order in which they were made.
    interrupted
        Whether it was ended by Ctrl-C or SIGTERM.
    """

    server: str
    versions: dict[str, str] = field(default_factory=dict)
    map: str = ""
    lines: list[CheckLine] = field(default_factory=list)
    interrupted: bool = False

    @property
    def differing(self) -> list[CheckLine]:
        """Lines in which the server does something else."""
        return [line for line in self.lines if line.state is CheckState.DIFFERS]

    @property
    def unchecked(self) -> list[CheckLine]:
        """Lines that could not be checked."""
        return [line for line in self.lines if line.state is CheckState.NOT_CHECKED]


def judged(name: str, expected: str, seen: str, *, ok: bool, note: str = "") -> CheckLine:
    """A line that was checked."""
    return CheckLine(name, expected, seen, CheckState.OK if ok else CheckState.DIFFERS, note)


def unchecked(name: str, expected: str, why: str) -> CheckLine:
    """A line that could not be checked."""
    return CheckLine(name, expected, "-", CheckState.NOT_CHECKED, why)


def attempt(names: Sequence[str], check: Callable[[], list[CheckLine]]) -> list[CheckLine]:
    """Lines of a check; one that the server ended with an error has its words in each line."""
    try:
        return check()
    except CarlaError as error:
        return [
            CheckLine(name, "an answer", str(error), CheckState.DIFFERS, "the check was ended")
            for name in names
        ]
