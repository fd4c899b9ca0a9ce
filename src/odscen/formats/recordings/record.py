"""A recording of a run."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from odscen.base.errors import InputError
from odscen.formats.recordings.map_elements import map_elements
from odscen.formats.recordings.run_recording import RunRecording
from odscen.formats.recordings.signal_grid import lane_signals
from odscen.formats.recordings.track_grid import ExportWindow, instants, tracks_of

if TYPE_CHECKING:
    from collections.abc import Mapping

    from odscen.formats.base import ExportSource

WINDOW = ("begin", "end")
"""Options of all formats that are written from a recording: seconds of the simulation."""


def recording_of(source: ExportSource) -> RunRecording:
    """Map elements, tracks and signal states of a run.

    Raises
    ------
    InputError
        If it is no run, an option is no number, or the window has no road users, or too many.
    """
    recorded = source.recorded
    if recorded is None or source.roads is None:
        raise InputError("this format says what happened in a run: name the folder of one")
    times = instants(
        recorded, ExportWindow(*(_seconds_option(source.options, name) for name in WINDOW))
    )
    elements = map_elements(source.roads, source.sumo_map.graph.lanes)
    return RunRecording(
        name=source.name,
        scenario=source.scenario.name,
        map_name=source.scenario.map.name,
        map_sha256=source.sumo_map.graph.map_sha256,
        seed=source.scenario.seed,
        times=times,
        recorded_step=round(recorded.step, 6),
        elements=elements,
        tracks=tracks_of(source, recorded, times),
        signals=lane_signals(source.sumo_map, elements.lanes, recorded.states, times),
    )


def _seconds_option(options: Mapping[str, str], name: str) -> float | None:
    given = options.get(name)
    if given is None:
        return None
    try:
        seconds = float(given)
    except ValueError:
        seconds = math.nan
    if not math.isfinite(seconds):
        raise InputError(f"--{name} is {given!r}, not a number of seconds")
    return seconds
