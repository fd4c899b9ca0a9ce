"""SUMO's files of signal programs: ``tlLogic``, ``WAUT`` and loops, as values."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

from odscen.base.errors import InputError
from odscen.base.xml_reading import read_xml
from odscen.sumo.realize.lights.program_files import DETECTOR_PARAM

if TYPE_CHECKING:
    from collections.abc import Mapping

    from lxml import etree

_LETTERS = frozenset("GgyrYRu")


@dataclass(frozen=True, slots=True)
class FilePhase:
    """One ``<phase>``; ``least`` and ``most`` are equal where nothing prolongs it.

    ``held`` says whether it lasts until a place in the cycle, as the first stage of a coordination.
    """

    seconds: float
    state: str
    name: str
    least: float
    most: float
    following: tuple[int, ...]
    early: str
    final: str
    held: bool = False


@dataclass(frozen=True, slots=True)
class FileProgram:
    """One ``<tlLogic>``; ``place`` says where the file has it."""

    light: str
    id: str
    kind: str
    offset: float
    phases: tuple[FilePhase, ...]
    params: Mapping[str, str]
    conditions: Mapping[str, str]

    @property
    def place(self) -> str:
        """For messages."""
        return f"tlLogic {self.light!r}, program {self.id!r}"


class FileLoop(NamedTuple):
    """One ``<inductionLoop>``; metres. ``name`` is that of a detector of a scenario."""

    id: str
    lane: str
    pos: float
    length: float
    persons: bool
    name: str


class FileSwitches(NamedTuple):
    """One ``<WAUT>``: the program at the start, and seconds with the programs that follow."""

    start: str
    switches: tuple[tuple[float, str], ...]


@dataclass(frozen=True, slots=True)
class SignalFile:
    """All that a file says of lights; programs in the order of the file, switches by light."""

    programs: tuple[FileProgram, ...]
    loops: Mapping[str, FileLoop]
    switches: Mapping[str, FileSwitches]


def parse_signal_file(text: str | bytes) -> SignalFile:
    """Read programs of lights from SUMO's ``.tll.xml``, ``.add.xml`` or ``.net.xml``.

    Raises
    ------
    InputError
        If it is not XML, has no ``<tlLogic>``, or a value in it cannot be read.
    """
    root = read_xml(text)
    programs = tuple(_read_program(element) for element in root.iter("tlLogic"))
    if not programs:
        raise InputError("there is no <tlLogic> in the file")
    wauts = {
        element.get("id", ""): FileSwitches(
            element.get("startProg", ""),
            tuple(
                (
                    _read_number(element, "refTime", 0.0) + _read_number(switch, "time"),
                    switch.get("to", ""),
                )
                for switch in element.iterfind("wautSwitch")
            ),
        )
        for element in root.iter("WAUT")
    }
    switches = {
        element.get("junctionID", ""): wauts[element.get("wautID", "")]
        for element in root.iter("wautJunction")
        if element.get("wautID", "") in wauts
    }
    loops = [
        _read_loop(element) for tag in ("inductionLoop", "e1Detector") for element in root.iter(tag)
    ]
    return SignalFile(programs, {loop.id: loop for loop in loops}, switches)


def _read_program(element: etree._Element) -> FileProgram:
    light, name = element.get("id", ""), element.get("programID", "0")
    kind = element.get("type", "static")
    place = f"tlLogic {light!r}, program {name!r}"
    if kind not in ("static", "actuated"):
        raise InputError(f"{place}: type {kind!r} is not static or actuated")
    phases = tuple(
        _read_phase(phase, f"{place}, phase {number}", actuated=kind == "actuated")
        for number, phase in enumerate(element.iterfind("phase"))
    )
    if not phases or len({len(phase.state) for phase in phases}) != 1:
        raise InputError(f"{place}: there are no phases, or their states have different lengths")
    values = {
        element.get("key", ""): element.get("value", "") for element in element.iterfind("param")
    }
    conditions = {
        element.get("id", ""): element.get("value", "") for element in element.iterfind("condition")
    }
    offset = _read_number(element, "offset", 0.0)
    return FileProgram(light, name, kind, offset, phases, values, conditions)


def _read_phase(element: etree._Element, place: str, *, actuated: bool) -> FilePhase:
    state = element.get("state", "")
    if wrong := sorted(set(state) - _LETTERS):
        raise InputError(
            f"{place}: letter {wrong[0]!r} of state {state!r} is not one of G, g, y, r, u"
        )
    seconds = _read_number(element, "duration", None, place)
    if seconds <= 0.0:
        raise InputError(f"{place}: duration is {element.get('duration')!r}, not above 0")
    least = _read_number(element, "minDur", seconds, place) if actuated else seconds
    most = _read_number(element, "maxDur", max(seconds, least), place) if actuated else seconds
    state = state.replace("Y", "y").replace("R", "r").replace("u", "r")
    following = tuple(int(part) for part in element.get("next", "").split() if part.isdigit())
    return FilePhase(
        seconds,
        state,
        element.get("name", ""),
        least,
        most,
        following,
        element.get("earlyTarget", ""),
        element.get("finalTarget", ""),
        element.get("earliestEnd") is not None,
    )


def _read_loop(element: etree._Element) -> FileLoop:
    names = [
        element.get("value", "")
        for element in element.iterfind("param")
        if element.get("key") == DETECTOR_PARAM
    ]
    return FileLoop(
        element.get("id", ""),
        element.get("lane", ""),
        _read_number(element, "pos", 0.0),
        _read_number(element, "length", 0.0),
        bool(element.get("detectPersons")),
        names[0] if names else "",
    )


def _read_number(
    element: etree._Element, key: str, default: float | None = None, place: str = ""
) -> float:
    text = element.get(key)
    if text is None and default is not None:
        return default
    try:
        value = float(text or "")
    except ValueError:
        value = float("nan")
    if not abs(value) < 1e9:
        where = place or f"<{element.tag}> {element.get('id', '')!r}"
        raise InputError(f"{where}: {key} is {text!r}, not a number")
    return value
