"""SUMO's logs of lights and their detectors as tables.

``signal_states.parquet`` has a row for each change: ``time`` (s), ``light``, ``program``,
``phase`` (its place in the program), ``name`` (``stage 1``, ``yellow``, ...) and ``state``, the
letters of the light's links; the first rows are what was shown at the start.
``detector_calls.parquet`` has a row for each time that a detector saw a road user: ``detector``,
``begin`` and ``end``, s.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from odscen.base.errors import SimulationError
from odscen.runs.layout import CALLS_FILE, LIGHT_STATES_FILE, STATES_FILE
from odscen.runs.xml_rows import elements
from odscen.sumo.realize.measure_files import calls_file

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

_TEXTS = {"light": "id", "program": "programID", "name": "name", "state": "state"}


def signal_logs(folder: Path) -> list[Path]:
    """SUMO's own logs in a folder, states first."""
    return [file for file in (folder / STATES_FILE, *_call_logs(folder)) if file.is_file()]


def tidy_signals(folder: Path) -> None:
    """Replace SUMO's logs of lights and detectors, if there are any, by tables.

    Raises
    ------
    SimulationError
        If SUMO has not written them to their end.
    """
    import polars as pl
    from lxml import etree

    log = folder / STATES_FILE
    calls = _call_logs(folder)
    try:
        if log.is_file():
            rows = [
                (
                    float(row.get("time", "")),
                    int(row.get("phase", "")),
                    *(row.get(key, "") for key in _TEXTS.values()),
                )
                for row in elements(log, "tlsState")
            ]
            names = ("time", "phase", *_TEXTS)
            numbers: dict[str, type[pl.DataType]] = {"time": pl.Float64, "phase": pl.Int64}
            types = {name: numbers.get(name, pl.String) for name in names}
            table = pl.DataFrame(rows, schema=types, orient="row")
            order = ("time", "light", "program", "phase", "name", "state")
            table.select(order).write_parquet(folder / LIGHT_STATES_FILE)
            log.unlink()
        if calls:
            found = [row for file in calls for row in _read_calls(file)]
            table = pl.DataFrame(
                sorted(found),
                schema={"detector": pl.String, "begin": pl.Float64, "end": pl.Float64},
                orient="row",
            )
            table.write_parquet(folder / CALLS_FILE)
            for file in calls:
                file.unlink()
    except etree.XMLSyntaxError as error:
        raise SimulationError(
            f"SUMO has not written its log of lights to the end; the disk may be full: {error}"
        ) from error


def _call_logs(folder: Path) -> list[Path]:
    files: list[Path] = []
    while (file := folder / calls_file(len(files))).is_file():
        files.append(file)
    return files


def _read_calls(file: Path) -> Iterator[tuple[str, float, float]]:
    """Times in which each detector saw somebody."""
    names: list[str] = []
    begins: dict[str, float] = {}
    last = 0.0
    for row in elements(file, "tlsState"):
        if not names:
            head = row.getparent()
            names = head.get("detectors", "").split() if head is not None else []
        last = float(row.get("time", ""))
        seen = row.get("detectors", "").split()
        for name, on in zip(names, seen, strict=False):
            if on != "0":
                begins.setdefault(name, last)
            elif name in begins:
                yield name, begins.pop(name), last
    for name, begin in begins.items():
        yield name, begin, last
