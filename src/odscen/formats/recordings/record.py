"""A recording of a run.

What lights show to lanes, on a clock of equal steps.

SUMO's letters belong to movements from lane to lane. A movement is looked up on the lane graph: the
lane that leads to the light, and the first lane through the junction on the shortest way on.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from odscen.base.errors import InputError
from odscen.convert.lane_table.light_heads import letter_state
from odscen.formats.recordings.map_elements import map_elements
from odscen.formats.recordings.run_recording import LaneSignals, LightColor, RunRecording
from odscen.formats.recordings.track_grid import ExportWindow, instants, tracks_of

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    import polars as pl
    from numpy.typing import NDArray

    from odscen.base.arrays import FloatArray
    from odscen.formats.base import ExportSource, Kept, RecordedRun
    from odscen.formats.recordings.run_recording import LaneElement, MapElements
    from odscen.opendrive.road_model import OpenDrive
    from odscen.sumo.realize.sumo_map import SumoMap


# --------------------------------------------- what lights show to lanes, on a clock of equal steps
_FARTHEST = 6
"""Lanes in a row that a movement may have at most."""
_COLORS = {
    "Green": LightColor.GREEN,
    "Yellow": LightColor.YELLOW,
    "Red": LightColor.RED,
    "Off": LightColor.OFF,
}
_SAME = 1e-6


class Movement(NamedTuple):
    """From lane to lane over the stop line of a light; ``turn`` is SUMO's letter."""

    light: str
    link: int
    turn: str
    approach: int
    lane: int


def lane_signals(
    movements: Sequence[Movement],
    lanes: Sequence[LaneElement],
    states: pl.DataFrame | None,
    times: FloatArray,
) -> LaneSignals:
    """States of all lanes with a light.

    Parameters
    ----------
    movements
        Of the map, see :func:`movements_of`.
    states
        As of :func:`~odscen.runs.recorded.read_light_states`.
    times
        Shape ``(T,)``, s.
    """
    shown = {} if states is None else dict(_letters_by_light(states, times))
    found: dict[tuple[int, int], tuple[str, NDArray[np.uint8]]] = {}
    for light, link, turn, approach, lane in movements:
        letters = shown.get(light)
        if letters is None:
            continue
        color = _colors_of_link(letters, link)
        known = found.get((approach, lane))
        # Two links over one lane: who may go on either of them has green.
        found[approach, lane] = (turn, color if known is None else np.maximum(known[1], color))
    keys = sorted(found)
    return LaneSignals(
        lane=np.array([lane for _, lane in keys], dtype=np.int64),
        approach=np.array([approach for approach, _ in keys], dtype=np.int64),
        turn=tuple(found[key][0] for key in keys),
        stop=np.array([lanes[approach].centre[-1] for approach, _ in keys]).reshape(-1, 3),
        color=np.array([found[key][1] for key in keys], dtype=np.uint8).reshape(-1, len(times)),
    )


def _letters_by_light(states: pl.DataFrame, times: FloatArray) -> Iterator[tuple[str, list[str]]]:
    """For each light the letters that it shows at each instant."""
    for (light,), rows in states.sort("light", "time").group_by("light", maintain_order=True):
        changes = rows["time"].to_numpy()
        letters = rows["state"].to_list()
        at = np.searchsorted(changes, times + _SAME, side="right") - 1
        yield str(light), [letters[max(k, 0)] for k in at.tolist()]


def _colors_of_link(letters: Sequence[str], link: int) -> NDArray[np.uint8]:
    return np.array(
        [_COLORS[letter_state(letter[link])] if link < len(letter) else 0 for letter in letters],
        dtype=np.uint8,
    )


def _light_movements(sumo_map: SumoMap, lanes: Sequence[LaneElement]) -> list[Movement]:
    """Movements over stop lines that are found on the lane graph."""
    movements = []
    row_of = {lane.key: row for row, lane in enumerate(lanes)}
    for light in sumo_map.lights:
        for link, signal in enumerate(light.links):
            source = row_of.get(sumo_map.lane_names.get(signal.source, ""), -1)
            target = row_of.get(sumo_map.lane_names.get(signal.target, ""), -1)
            if source < 0 or target < 0:
                continue
            path = _shortest_lane_path(lanes, source, target)
            inside = next((k for k, row in enumerate(path) if lanes[row].junction), None)
            if inside:
                movements.append(
                    Movement(light.id, link, signal.turn, path[inside - 1], path[inside])
                )
    return movements


def _shortest_lane_path(lanes: Sequence[LaneElement], source: int, target: int) -> list[int]:
    """Fewest lanes from one to another, both included; empty if there is no way, or a long one."""
    paths = [[source]]
    for _ in range(_FARTHEST):
        paths = [[*path, row] for path in paths for row in lanes[path[-1]].exits]
        there = next((path for path in paths if path[-1] == target), None)
        if there is not None:
            return there
    return []


# ----------------------------------------------------------------------------- A recording of a run
WINDOW = ("begin", "end")
"""Options of all formats that are written from a recording: seconds of the simulation."""


def recording_of(source: ExportSource) -> RunRecording:
    """Map elements, tracks and signal states of a run.

    Raises
    ------
    InputError
        If it is no run, an option is no number, or the window has no road users, or too many.
    """
    recorded, roads = source.recorded, source.roads
    if recorded is None or roads is None:
        raise InputError("this format says what happened in a run: name the folder of one")
    window = ExportWindow(*(seconds_option(source.options, name) for name in WINDOW))
    return source.of_run.made(window, lambda: _make_recording(source, recorded, roads, window))


def elements_of(of_map: Kept, sumo_map: SumoMap, roads: OpenDrive) -> MapElements:
    """Elements of the map, made once for all exports on it."""
    return of_map.made("elements", lambda: map_elements(roads, sumo_map.graph.lanes))


def movements_of(source: ExportSource, lanes: Sequence[LaneElement]) -> list[Movement]:
    """Movements over stop lines of the map, made once for all exports on it."""
    return source.of_map.made("movements", lambda: _light_movements(source.sumo_map, lanes))


def _make_recording(
    source: ExportSource, recorded: RecordedRun, roads: OpenDrive, window: ExportWindow
) -> RunRecording:
    times = instants(recorded, window)
    elements = elements_of(source.of_map, source.sumo_map, roads)
    movements = movements_of(source, elements.lanes)
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
        signals=lane_signals(movements, elements.lanes, recorded.states, times),
    )


def seconds_option(options: Mapping[str, str], name: str) -> float | None:
    """Seconds that an option says, ``None`` if it was not chosen.

    Raises
    ------
    InputError
        If it is no number.
    """
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
