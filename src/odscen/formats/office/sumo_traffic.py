"""SUMO's files of trips and counts: ``tazRelation``, ``edgeRelation``, ``edgeData``, detectors.

Sources: sumo.dlr.de/docs/Simulation/Output/Lane-_or_Edge-based_Traffic_Measures.html,
Demand/Importing_O/D_Matrices.html, Demand/Shortest_or_Optimal_Path_Routing.html,
Simulation/Output/Induction_Loops_Detectors_(E1).html.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from odscen.base.errors import InputError
from odscen.base.shown import shown
from odscen.formats.office.traffic_file import (
    LeftOut,
    StationPlace,
    TrafficFile,
    TripRow,
    TurnRow,
    VolumeRow,
)

if TYPE_CHECKING:
    from lxml import etree

_COUNTS = ("count", "qPKW", "entered", "sampledSeconds")
"""Attributes of an ``<edge>`` that may have its count; the last is for the message alone."""

DEFINED = ("inductionLoop", "e1Detector", "instantInductionLoop", "laneAreaDetector", "e2Detector")
"""Elements that say where a detector is."""


def read_sumo_traffic(root: etree._Element, *, attribute: str | None = None) -> TrafficFile:
    """Read one of these files, by the elements that it has.

    Parameters
    ----------
    attribute
        Of ``edgeData``: which attribute has the count.

    Raises
    ------
    InputError
        If it has none of these elements; says what it seems to be.
    """
    reader = _Reader(attribute)
    for element in root:
        if not isinstance(element.tag, str):
            continue
        if element.tag == "interval":
            reader.read_interval(element)
        elif element.tag in DEFINED:
            reader.read_definition(element)
        elif element.tag == "taz":
            reader.read_zone(element)
        elif element.tag == "tazs":
            for zone in element.iterfind("taz"):
                reader.read_zone(zone)
    return reader.file(root)


def _line_of(element: etree._Element) -> int:
    line = element.sourceline
    return line if isinstance(line, int) else 0


class _Reader:
    def __init__(self, attribute: str | None) -> None:
        self._attribute = attribute
        self._trips: list[TripRow] = []
        self._turns: list[TurnRow] = []
        self._edges: list[VolumeRow] = []
        self._outputs: list[VolumeRow] = []
        self._zones: dict[str, tuple[str, ...]] = {}
        self._stations: dict[str, StationPlace] = {}
        self._left: list[LeftOut] = []
        self._taken: set[str] = set()
        self._intervals: set[tuple[float, float]] = set()
        self._closed = True
        self._rows = 0

    def file(self, root: etree._Element) -> TrafficFile:
        """All that was read, as one file.

        Raises
        ------
        InputError
            If that is nothing.
        """
        kinds = []
        slices = f"{len(self._intervals)} interval{'s' if len(self._intervals) != 1 else ''}"
        if self._trips:
            zones = {row.origin for row in self._trips} | {row.destination for row in self._trips}
            kinds.append(f"a SUMO matrix (tazRelation) with {len(zones)} zones in {slices}")
        if self._turns:
            what = "turn ratios" if all(row.share for row in self._turns) else "turning counts"
            kinds.append(f"SUMO {what} (edgeRelation) of {len(self._turns)} turns in {slices}")
        if self._edges:
            edges = {row.station for row in self._edges}
            used = " + ".join(sorted(self._taken))
            kinds.append(f"SUMO edgeData of {len(edges)} edges in {slices}, counted by {used}")
        if self._outputs:
            loops = {row.station for row in self._outputs}
            kinds.append(f"SUMO output of {len(loops)} E1 detectors in {slices}")
        if self._stations and not self._edges:
            kinds.append(f"definitions of {len(self._stations)} SUMO detectors")
        if self._zones:
            kinds.append(f"SUMO districts (taz) with {len(self._zones)} zones")
        if not kinds and self._left:
            raise InputError(
                f"nothing of the file can be used: {self._left[0].source}: {self._left[0].reason}"
            )
        if not kinds:
            raise InputError(_say_what_it_is(root))
        return TrafficFile(
            what=" and ".join(kinds),
            rows=self._rows,
            trips=tuple(self._trips),
            volumes=(*self._edges, *self._outputs),
            turns=tuple(self._turns),
            zones=self._zones,
            stations=self._stations,
            left_out=tuple(self._left),
        )

    def read_interval(self, interval: etree._Element) -> None:
        """Read an ``<interval>``, with relations, edges, or as a row of an E1 output."""
        begin, end = self._read_number(interval, "begin"), self._read_number(interval, "end")
        if begin < 0 or end <= begin:
            self._leave_out(interval, f"the interval from {begin:g} to {end:g} is none")
            return
        self._intervals.add((begin, end))
        if interval.get("nVehContrib") is not None or interval.get("nVehEntered") is not None:
            self._rows += 1
            name = interval.get("id", "")
            # Those who passed it whole; a vehicle still on it when the slice ends is in the next.
            key = "nVehContrib" if interval.get("nVehContrib") is not None else "nVehEntered"
            number = self._read_number(interval, key)
            if number < 0 or not name:
                reason = f"{name}: {key} is {number:g}" if name else "the detector has no id"
                self._leave_out(interval, reason)
                return
            self._outputs.append(VolumeRow(name, begin, end, number, _line_of(interval)))
            return
        for element in interval:
            if element.tag in ("tazRelation", "edgeRelation"):
                self._read_relation(element, begin, end)
            elif element.tag == "fromEdge":
                self._read_ratios(element, begin, end)
            elif element.tag == "edge":
                self._read_edge(element, begin, end)

    def _read_relation(self, element: etree._Element, begin: float, end: float) -> None:
        self._rows += 1
        origin, destination = element.get("from"), element.get("to")
        if not origin or not destination:
            self._leave_out(element, "from or to is missing")
            return
        name = self._attribute or "count"
        share = element.get(name) is None and element.get("probability") is not None
        text = element.get("probability") if share else element.get(name)
        if text is None:
            others = sorted({str(key) for key in element.attrib} - {"from", "to"})
            listed = f"; it has {', '.join(others)}" if others else ""
            self._leave_out(element, f"{origin} to {destination}: no {name}{listed}")
            return
        value = self._read_number(element, "probability" if share else name)
        if value < 0 or (share and value > 1):
            self._leave_out(element, f"{origin} to {destination}: {value:g}")
        elif element.tag == "tazRelation":
            if value > 0:
                self._trips.append(
                    TripRow(origin, destination, value, begin, end, _line_of(element))
                )
        else:
            self._turns.append(
                TurnRow(origin, destination, value, begin, end, share, _line_of(element))
            )

    def _read_ratios(self, source: etree._Element, begin: float, end: float) -> None:
        for element in source.iterfind("toEdge"):
            self._rows += 1
            value = self._read_number(element, "probability")
            origin, destination = source.get("id"), element.get("id")
            if not origin or not destination:
                self._leave_out(element, f"<{source.tag}> or <{element.tag}> has no id")
            elif not 0 <= value <= 1:
                self._leave_out(element, f"{origin} to {destination}: {value:g}")
            else:
                self._turns.append(
                    TurnRow(origin, destination, value, begin, end, True, _line_of(element))
                )

    def _read_edge(self, element: etree._Element, begin: float, end: float) -> None:
        self._rows += 1
        edge = element.get("id", "")
        if not edge:
            self._leave_out(element, "the edge has no id")
            return
        if self._attribute is not None:
            names = [self._attribute] if element.get(self._attribute) is not None else []
        elif element.get("entered") is not None:
            names = [name for name in ("entered", "departed") if element.get(name) is not None]
        else:
            names = [name for name in _COUNTS[:2] if element.get(name) is not None][:1]
            if names == ["qPKW"] and element.get("qLKW") is not None:
                names.append("qLKW")
        if not names:
            others = ", ".join(sorted(str(key) for key in element.attrib if key != "id"))
            self._leave_out(element, f"edge {edge}: no count; it has {others or 'nothing'}")
            return
        number = sum(self._read_number(element, name) for name in names)
        if number < 0:
            self._leave_out(element, f"edge {edge}: {number:g} vehicles")
            return
        self._taken.update(names)
        self._stations[edge] = StationPlace(edge=edge)
        self._edges.append(VolumeRow(edge, begin, end, number, _line_of(element)))

    def read_definition(self, element: etree._Element) -> None:
        """Read where a detector is."""
        self._rows += 1
        name, lane = element.get("id"), element.get("lane")
        if not name or not lane:
            self._leave_out(element, "id or lane is missing")
            return
        text = element.get("pos", "0")
        try:
            pos = float(text)
        except ValueError:
            pos = math.nan
        if not math.isfinite(pos):
            self._leave_out(element, f"{name}: pos is {shown(text)}")
            return
        self._stations[name] = StationPlace(lane=lane, pos=pos)

    def read_zone(self, element: etree._Element) -> None:
        """Read the edges of a district."""
        self._rows += 1
        name = element.get("id")
        edges = (element.get("edges") or "").split()
        for part in element:
            if part.tag in ("tazSource", "tazSink"):
                edges.append(part.get("id", ""))
        edges = [edge for edge in edges if edge]
        if not name or not edges:
            reason = f"{shown(name)}: a district without edges" if name else "a district without id"
            self._leave_out(element, reason)
            return
        if name in self._zones:
            self._leave_out(element, f"district {shown(name)} is there twice")
            return
        self._zones[name] = tuple(dict.fromkeys(edges))

    def _read_number(self, element: etree._Element, name: str) -> float:
        text = element.get(name)
        try:
            value = float(text or "")
        except ValueError:
            value = _read_clock(text or "")
        if not math.isfinite(value):
            raise InputError(
                f"{name} of <{element.tag}> is no number: {shown(text)}",
                element=f"line {_line_of(element)}",
            )
        return value

    def _leave_out(self, element: etree._Element, reason: str) -> None:
        self._left.append(LeftOut(f"row {_line_of(element)} of the file", reason))


def _read_clock(text: str) -> float:
    """Seconds of a time written as ``h:m:s`` or ``d:h:m:s``; NaN of another text."""
    parts = text.split(":")
    if not 3 <= len(parts) <= 4 or not all(part.replace(".", "", 1).isdecimal() for part in parts):
        return math.nan
    scale = (86_400.0, 3600.0, 60.0, 1.0)[-len(parts) :]
    return sum(float(part) * factor for part, factor in zip(parts, scale, strict=True))


def _say_what_it_is(root: etree._Element) -> str:
    tags = {str(element.tag) for element in root}
    asked = "trips or counts are tazRelation, edgeRelation, edgeData, E1 outputs or taz"
    if tags & {"edgeData", "laneData"}:
        return (
            "this makes SUMO write edgeData, and has no values: run SUMO with it, and import "
            "the file that it names"
        )
    if root.tag == "sumoConfiguration" or tags & {"net-file", "input"}:
        return "this is a SUMO configuration; a project is opened with: odscen import FILE.sumocfg"
    if root.tag == "net":
        return "this is a SUMO network; maps are added with: odscen maps add FILE"
    if tags & {"vehicle", "trip", "flow", "route", "person", "vType", "vTypeDistribution"}:
        return (
            "this is a SUMO route file; it is opened with its configuration: "
            "odscen import FILE.sumocfg"
        )
    if "interval" in tags:
        return f"its intervals have nothing that counts; {asked}"
    return f"this is XML with the root element <{str(root.tag)[:40]}>; {asked}"
