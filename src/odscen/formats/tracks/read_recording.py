"""Recorded traffic read, whatever its file is: tables, OSI traces, CommonRoad, ScenarioNet."""

from __future__ import annotations

import math
import re
from dataclasses import replace
from typing import TYPE_CHECKING

import polars as pl

from odscen.base.errors import InputError, in_file
from odscen.formats.tracks.recorded_traffic import FARTHEST, join_parts, shift_tracks
from odscen.formats.tracks.table_schemas import TimeWindow, has_track_columns, read_track_table

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from odscen.formats.base import GivenFile
    from odscen.formats.tracks.recorded_traffic import RecordedTraffic

_INDEXES = ("dataset_summary.pkl", "dataset_mapping.pkl")
"""Files of a folder of ScenarioNet that have no tracks."""
_CLOCK = re.compile(r"(?:(?:(\d+):)?(\d{1,2}):)?(\d+(?:\.\d*)?)")


def read_recording(file: GivenFile, options: Mapping[str, str] | None = None) -> RecordedTraffic:
    """Tracks of a file of recorded traffic.

    Parameters
    ----------
    options
        ``window`` (see :func:`time_window`), ``columns`` (of a table of no published schema:
        ``time=ms*0.001,id=vehicle,x=east,y=north``), ``case`` and ``location`` (which of several
        recordings that a file of INTERACTION or NGSIM has), ``offset`` (see :func:`map_offset`).

    Raises
    ------
    InputError
        If it is nothing of these, or damaged; names the file, the element and the value.
    MissingDependencyError
        If it needs a package that is not installed.
    """
    parts = list(read_recording_parts(file, options))
    if len(parts) == 1:
        return parts[0]
    return join_parts(parts, pl.concat([part.rows for part in parts], rechunk=False))


def read_recording_parts(
    file: GivenFile, options: Mapping[str, str] | None = None
) -> Iterator[RecordedTraffic]:
    """The same, of a large table in parts, each with all tracks of its road users.

    Signals are those of the first part.
    """
    options = options or {}
    window, offset = time_window(options.get("window", "")), map_offset(options.get("offset", ""))
    with in_file(file.name):
        for recorded in _read_by_ending(file, options, window):
            moved = offset != (0.0, 0.0, 0.0)
            rows = shift_tracks(recorded.rows, *offset) if moved else recorded.rows
            yield replace(recorded, rows=rows)


def choose_recording(files: Sequence[GivenFile]) -> int:
    """Which of several files has the tracks; those that belong to it are found beside it.

    Raises
    ------
    InputError
        If none has, or several recordings are among them.
    """
    endings = (".csv", ".parquet", ".osi", ".mcap", ".xml", ".pkl")
    given = [row for row, file in enumerate(files) if file.name.lower().endswith(endings)]
    if len(given) == 1:
        return given[0]
    found = [row for row in given if is_track_file(files[row])]
    # Pedestrians of INTERACTION and SinD have a file of their own.
    main = [row for row in found if not files[row].name.lower().startswith("ped")] or found
    if len(main) != 1:
        named = ", ".join(files[row].name for row in main or given)
        what = f"several recordings were sent ({named})" if main else "none of the files has tracks"
        raise InputError(f"{what}; send one recording, with the files that belong to it")
    return main[0]


def is_track_file(file: GivenFile) -> bool:
    """Whether a file has tracks, by its ending or its columns."""
    if file.name.lower() in _INDEXES:
        return False
    if not file.name.lower().endswith((".csv", ".parquet")):
        return True
    return has_track_columns(file)


def _read_by_ending(
    file: GivenFile, options: Mapping[str, str], window: TimeWindow
) -> Iterator[RecordedTraffic]:
    from odscen.formats.tracks.commonroad_obstacles import read_commonroad_obstacles
    from odscen.formats.tracks.osi_trace import read_osi_trace
    from odscen.formats.tracks.scenario_descriptions import read_scenario_description

    name = file.name.lower()
    if name.endswith((".osi", ".mcap")):
        yield read_osi_trace(file.on_disk, *window)
    elif name.endswith(".pkl"):
        yield read_scenario_description(file.read(), *window)
    elif name.endswith(".xml"):
        yield read_commonroad_obstacles(file.read(), *window)
    else:
        yield from read_track_table(file, options, window)


def time_window(text: str) -> TimeWindow:
    """Window of ``FROM..TO``: seconds of the file, or minutes and hours, as in ``1:02:03.5``.

    >>> time_window("12:30..13:00")
    TimeWindow(begin=750.0, end=780.0)

    Raises
    ------
    InputError
        If it is none, or ends before it begins.
    """
    if not text:
        return TimeWindow()
    begin, dots, end = (part.strip() for part in text.partition(".."))
    if not dots:
        raise InputError(f"a window is FROM..TO, not {text!r}")
    window = TimeWindow(_seconds(begin, -math.inf), _seconds(end, math.inf))
    if window.end <= window.begin:
        raise InputError(f"the window {text!r} ends before it begins")
    return window


def map_offset(text: str) -> tuple[float, float, float]:
    """Metres east, metres north and radians of ``X,Y`` or ``X,Y,DEGREES``, counter-clockwise.

    >>> map_offset("10,-2.5,180")
    (10.0, -2.5, 3.141592653589793)

    Raises
    ------
    InputError
        If it is none.
    """
    try:
        numbers = [float(part) for part in text.split(",")] if text else [0.0, 0.0]
    except ValueError:
        numbers = []
    if len(numbers) not in (2, 3) or not all(map(math.isfinite, numbers)):
        raise InputError(f"an offset is X,Y or X,Y,DEGREES, not {text!r}")
    x, y, turn = (*numbers, 0.0)[:3]
    if max(abs(x), abs(y)) > FARTHEST["x"]:
        raise InputError(f"an offset is at most {FARTHEST['x']:g} m, not {text!r}")
    return x, y, math.radians(turn)


def _seconds(text: str, usual: float) -> float:
    if not text:
        return usual
    found = _CLOCK.fullmatch(text)
    if found is None:
        raise InputError(f"{text!r} is neither seconds nor H:MM:SS")
    hours, minutes, seconds = (float(part or 0) for part in found.groups())
    return 3600.0 * hours + 60.0 * minutes + seconds
