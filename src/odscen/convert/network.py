"""From a road model to a SUMO network, the lane table and the conversion report."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from odscen.convert.findings import findings
from odscen.convert.net import Net
from odscen.convert.netconvert import read_map, run_netconvert, stage
from odscen.convert.prepare import prepare_for_netconvert
from odscen.convert.recipe import TYPEMAP_FILE, ladder, typemap
from odscen.convert.report import ConversionReport, Entry, Fate
from odscen.convert.shapes import exact_net, rewrite_shapes
from odscen.convert.table_build import build_lane_table
from odscen.errors import NetconvertError, in_file
from odscen.opendrive.topology import lane_successors

if TYPE_CHECKING:
    from pathlib import Path

    from odscen.convert.lane_table import LaneTable
    from odscen.convert.netconvert import NetconvertResult
    from odscen.opendrive.lanes import RoadTable
    from odscen.opendrive.model import OpenDrive

INPUT_FILE = "input.xodr"

LEAST_SECONDS = 2.0
SECONDS_PER_MEGABYTE = 8.0
MOST_SECONDS = 60.0
"""Computing time of one netconvert run. Towns of 3 MB take 0.4 s; a small file that takes longer
than two seconds is one that netconvert will not finish. Later rungs get half."""

MEMORY = 768 << 20
MEMORY_PER_MEGABYTE = 64 << 20
"""Bytes of data; towns of 3 MB take less than 0.2 GB of it."""


@dataclass(frozen=True, slots=True)
class SumoNetwork:
    """A network: its file, how to cross over to it, and how it came about."""

    net_xml: bytes
    table: LaneTable
    report: ConversionReport


def build_network(odr: OpenDrive, table: RoadTable, xodr: Path, workdir: Path) -> SumoNetwork:
    """Convert a map with netconvert and relate the two.

    Parameters
    ----------
    odr, table
        The road model of the file ``xodr``, and its evaluation.
    workdir
        An existing folder to work in; what is left in it is of no use afterwards.

    Raises
    ------
    NetconvertError
        If netconvert fails on every rung of the ladder; ends with its words on the last.
    MissingDependencyError
        If netconvert is not installed.
    """
    content = read_map(xodr)
    with in_file(xodr.name):
        prepared, repairs = prepare_for_netconvert(content)
    converted, steps = _climb(prepared, workdir, lefthand=odr.rule == "LHT")
    net = Net.parse(converted.net_xml)
    successors = lane_successors(odr)
    drawn = build_lane_table(net, odr, table, successors)
    net = exact_net(net, drawn.table, table)
    built = build_lane_table(net, odr, table, successors)
    net_xml = rewrite_shapes(converted.net_xml, net)
    found = findings(odr, table, built)
    notes = [Entry(Fate.REPAIRED, *_split(note)) for note in odr.notes]
    report = ConversionReport.of([*notes, *repairs, *steps, *found.entries], found.figures)
    return SumoNetwork(net_xml, built.table, report)


def _climb(
    prepared: bytes, workdir: Path, *, lefthand: bool
) -> tuple[NetconvertResult, list[Entry]]:
    """Try the rungs from best to plainest; say which were needed."""
    path = stage(workdir, {TYPEMAP_FILE: typemap().encode(), INPUT_FILE: prepared}) / INPUT_FILE
    megabytes = len(prepared) / 1e6
    full_time = min(MOST_SECONDS, LEAST_SECONDS + SECONDS_PER_MEGABYTE * megabytes)
    time_limit = full_time
    memory = MEMORY + int(MEMORY_PER_MEGABYTE * megabytes)
    steps: list[Entry] = []
    failure: NetconvertError | None = None
    for rung in ladder(lefthand=lefthand):
        if failure is not None:
            time_limit = max(0.5 * full_time, 1.0)
            reason = f"{rung.gives_up}, because {_first_line(failure)}"
            steps.append(Entry(Fate.LOST, "netconvert", reason))
        try:
            result = run_netconvert(path, rung.options, time_limit=time_limit, memory_limit=memory)
        except NetconvertError as error:
            failure = error
            continue
        said = [Entry(Fate.GUESSED, "netconvert", text) for text in result.messages]
        return result, steps + said
    assert failure is not None
    raise failure


def _first_line(error: NetconvertError) -> str:
    lines = [line for line in str(error).splitlines() if line.strip()]
    return "; ".join(lines[:2])


def _split(note: str) -> tuple[str, str]:
    """Divide a note of the parser into element and reason."""
    element, mark, reason = note.partition(": ")
    return (element, reason) if mark else ("map", note)
