"""The report of a run, written from the files in its folder."""

from __future__ import annotations

import logging
from contextlib import nullcontext
from importlib.resources import files
from typing import TYPE_CHECKING

import polars as pl

from odscen.app.map_names import map_names
from odscen.app.maps import load_map
from odscen.app.scenarios import read_scenario
from odscen.base.errors import InputError, NotFoundError, in_file
from odscen.base.given_files import as_path
from odscen.base.stored_files import tables
from odscen.base.text_files import write_text
from odscen.figures.by_place.analysis_times import AnalysisTimes
from odscen.figures.by_place.corridors import busiest_corridor, corridor_along, path_between
from odscen.figures.by_place.traffic import TABLES, over_run
from odscen.figures.measures.motion import read_motion
from odscen.figures.measures.registry import figure_values
from odscen.figures.measures.signal_use import SIGNALS_TABLE, read_signal_use_table
from odscen.figures.measures.summary import actors_from_json
from odscen.figures.measures.traffic_files import read_stations, read_tables
from odscen.records.assignment_steps import Assignment
from odscen.records.light_programs import programs_from_json
from odscen.records.outcomes import RunStatus
from odscen.records.row_text import rounded
from odscen.records.run_events import events_from_json
from odscen.records.run_plan import Plan
from odscen.reports.place_names import NO_NAMES
from odscen.reports.replay import Scenery, replay_values
from odscen.reports.report_maps import place_shapes
from odscen.reports.report_sections import FEW
from odscen.reports.report_signals import LightsOfRun
from odscen.reports.run_report import render_report
from odscen.runs import layout
from odscen.runs.deferred_figures import whole_summary
from odscen.runs.finished_run import Run
from odscen.runs.measured import read_parking, read_run_data
from odscen.runs.new_run import run_lock
from odscen.runs.recorded import (
    read_conflicts,
    read_light_states,
    read_trajectories,
    read_visits,
)
from odscen.runs.run_status import unfinished
from odscen.runs.run_sums import damaged_in, seal_again
from odscen.sumo.outputs.corridor_traces import corridor_traces

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from pathlib import Path
    from typing import Any

    from odscen.app.maps import LoadedMap
    from odscen.base.given_files import GivenPath
    from odscen.figures.by_place.corridors import Corridor
    from odscen.figures.by_place.parking_use import ParkingUse
    from odscen.figures.by_place.traffic import TrafficFigures
    from odscen.figures.measures.figure import RunData
    from odscen.formats.base import RecordedRun
    from odscen.maps.store import Workspace

SCENERY_SCRIPT = "web/static/replay/scenery.js"
"""Of the built page, below the package: draws a replay in three dimensions."""
REPORT_ROWS = 2_000_000
"""Rows of trajectories that a report is made from at most; a day of a town has far more."""


def write_report(
    folder: Path,
    summary: Mapping[str, Any],
    *,
    loaded: LoadedMap | None = None,
    corridor: Corridor | None = None,
    out: Path | None = None,
    data: RunData | None = None,
) -> Path:
    """Write the report of a run from the files in its folder.

    Parameters
    ----------
    summary
        As in ``summary.json``.
    loaded
        The run's map: drawn below the routes, and for figures by place and a corridor. Without it
        the report has none of these.
    corridor
        To follow vehicles along; the busiest if not given.
    out
        File to write; ``report.html`` in the run folder if not given.
    data
        Figures of other times than those of the run, which ``summary`` then names.

    Returns
    -------
    Path
        The file.

    Raises
    ------
    InputError
        If a file of the run is missing or torn.
    """
    page = _read_page(folder, summary, loaded, corridor, data)
    return write_text(out or folder / layout.REPORT_FILE, page)


def replay_page(workspace: Workspace, folder: Path, recorded: RecordedRun) -> str:
    """Page of a finished run with its report and a replay, which needs nothing else.

    Parameters
    ----------
    workspace
        Has the map.
    recorded
        Where everybody was.

    Raises
    ------
    InputError
        If the run has not completed, or its map is not in the workspace.
    DamagedError
        If a file of the run is not as it was written.
    """
    summary = _read_completed_summary(folder)
    loaded = load_map(workspace.map_for(summary["map"], summary["map_sha256"]))
    scenery = _read_scenery(workspace, folder, loaded)
    return _read_page(folder, summary, loaded, None, None, recorded, scenery)


def _read_scenery(workspace: Workspace, folder: Path, loaded: LoadedMap) -> Scenery | None:
    """What shows the run in three dimensions; ``None`` where the page is not built."""
    script = files("odscen") / SCENERY_SCRIPT
    if not script.is_file():
        return None
    environment = read_scenario(folder / layout.SCENARIO_FILE).environment
    preset = workspace.assets().presets.get(environment.preset)
    weather = {**(preset.parameters if preset else {}), **environment.parameters}
    return Scenery(script.read_text(encoding="utf-8"), loaded.sumo.graph, weather)


def _read_page(
    folder: Path,
    summary: Mapping[str, Any],
    loaded: LoadedMap | None,
    corridor: Corridor | None,
    data: RunData | None,
    recorded: RecordedRun | None = None,
    scenery: Scenery | None = None,
) -> str:
    with in_file(str(folder)), tables(str(folder)):
        own = folder / layout.FIGURES_FOLDER
        figures = read_tables(own) if data is None else data.traffic
        motion = read_motion(own) if data is None else data.motion
        stations = read_stations(own) if data is None else data.stations
        return _render_page(
            folder, summary, loaded, corridor, figures, stations, motion, recorded, scenery
        )


def _render_page(
    folder: Path,
    summary: Mapping[str, Any],
    loaded: LoadedMap | None,
    corridor: Corridor | None,
    figures: TrafficFigures | None,
    stations: pl.DataFrame | None,
    motion: pl.DataFrame | None,
    watched: RecordedRun | None = None,
    scenery: Scenery | None = None,
) -> str:
    def text(name: str) -> str:
        return (folder / name).read_text(encoding="utf-8", errors="replace")

    recorded = read_trajectories(folder, most=REPORT_ROWS)
    sumo_map = None if loaded is None else loaded.sumo
    chosen = corridor is not None
    if corridor is None and figures is not None and sumo_map is not None:
        corridor = busiest_corridor(over_run(figures.movements), sumo_map.graph)
    followed = None
    if corridor is not None and sumo_map is not None:
        followed = corridor_traces(folder, sumo_map, corridor)
        if not chosen and not isinstance(followed, str) and followed.vehicles < FEW:
            followed = None
    plan = Plan.from_json(text(layout.PLAN_FILE))
    replay = None
    if watched is not None and loaded is not None:
        replay = replay_values(
            watched.users,
            watched.rows,
            loaded.drawing,
            step=watched.step,
            clock=plan.clock,
            lights=loaded.sumo.lights,
            states=watched.states,
            scenery=scenery,
        )
    return render_report(
        summary,
        plan,
        actors_from_json(text(layout.ACTORS_FILE)),
        events_from_json(text(layout.EVENTS_FILE)),
        recorded.rows if recorded is not None else pl.DataFrame(),
        drawing=None if loaded is None else loaded.drawing,
        every=recorded.every if recorded is not None else 1,
        figures=figures,
        shapes=None if sumo_map is None else place_shapes(sumo_map.graph),
        names=NO_NAMES if loaded is None else map_names(loaded),
        corridor=followed,
        conflicts=read_conflicts(folder),
        lights=_read_lights(folder),
        visits=read_visits(folder),
        stations=stations,
        parking=_read_parking_use(folder, summary),
        assignment=_read_assignment(folder),
        motion=motion,
        replay=replay,
    )


def _read_parking_use(folder: Path, summary: Mapping[str, Any]) -> ParkingUse | None:
    begin, end = AnalysisTimes.of_summary(summary).warm_up, float(summary.get("sim_seconds") or 0)
    return read_parking(folder, begin=begin, end=end)


def _read_assignment(folder: Path) -> Assignment | None:
    file = folder / layout.ASSIGNMENT_FILE
    return Assignment.from_json(file.read_text(encoding="utf-8")) if file.is_file() else None


def _read_lights(folder: Path) -> LightsOfRun | None:
    """What lights were told to show, what they showed, and what came of it."""
    file, table = folder / layout.LIGHTS_FILE, folder / layout.FIGURES_FOLDER / SIGNALS_TABLE
    states = read_light_states(folder)
    if states is None or not file.is_file() or not table.is_file():
        return None
    programs = programs_from_json(file.read_text(encoding="utf-8", errors="replace"))
    return LightsOfRun(programs, states, read_signal_use_table(table))


def renew_report(
    workspace: Workspace,
    run: Run | GivenPath,
    *,
    corridor: Sequence[str] = (),
    ends: tuple[str, str] | None = None,
    out: GivenPath | None = None,
    warm_up: float | None = None,
    interval: float | None = None,
) -> Path:
    """Write the report of a finished run anew.

    Parameters
    ----------
    workspace
        Has the map.
    run
        The run, its folder, or its name in the workspace.
    corridor
        Segments along which vehicles are followed; junctions between them may be left out.
    ends
        First and last segment instead: the shortest path between them. The busiest corridor if
        neither is given.
    out
        File to write; the run's ``report.html`` if not given.
    warm_up, interval
        What of the run is analysed, and over which intervals, s; as it was run if not given.

    Returns
    -------
    Path
        The file.

    Raises
    ------
    NotFoundError
        If there is no such run.
    InputError
        If it has not completed, its map is not in the workspace, one cannot drive so, or times do
        not fit what was measured.
    DamagedError
        If a file of the run is not as it was written; that of the report is reported only.
    """
    folder = folder_of(workspace, run)
    file = None if out is None else as_path(out)
    _read_completed_summary(
        folder
    )  # which may have figures computed, and takes the run's lock for that
    own = file is None and not unfinished(folder)
    with run_lock(folder) if own else nullcontext():
        summary = _read_completed_summary(folder)
        loaded = load_map(workspace.map_for(summary["map"], summary["map_sha256"]))
        graph = loaded.sumo.graph
        segments = path_between(graph, *ends) if ends is not None else corridor
        along = corridor_along(graph, segments) if segments else None
        data = None
        if (warm_up, interval) != (None, None):
            summary, data = _analyse_run(folder, summary, warm_up=warm_up, interval=interval)
        report = write_report(folder, summary, loaded=loaded, corridor=along, out=file, data=data)
        if file is None:
            seal_again(folder, layout.REPORT_FILE)
    return report


def folder_of(workspace: Workspace, run: Run | GivenPath) -> Path:
    """Folder of a run that is given by itself, its folder, or its name.

    Raises
    ------
    NotFoundError
        If there is none.
    """
    if isinstance(run, Run):
        return run.folder
    own = as_path(run)
    folder = own if own.is_dir() else workspace.runs / own
    if not folder.is_dir():
        names = [path.name for path in workspace.runs.glob("*")]
        raise NotFoundError("run", str(run), names)
    return folder


def _analyse_run(
    folder: Path, summary: Mapping[str, Any], *, warm_up: float | None, interval: float | None
) -> tuple[dict[str, Any], RunData]:
    """Summary with the figures of other times, and what they were computed from."""
    own = AnalysisTimes.of_summary(summary)
    times = AnalysisTimes(
        own.warm_up if warm_up is None else warm_up, own.interval if interval is None else interval
    )
    text = (folder / layout.ACTORS_FILE).read_text(encoding="utf-8", errors="replace")
    end, meso = float(summary["sim_seconds"]), bool(summary.get("meso"))
    with in_file(str(folder)), tables(str(folder)):
        data = read_run_data(folder, actors_from_json(text), end=end, meso=meso, times=times)
    kept = {name: value for name, value in summary.items() if name not in ("warm_up", "interval")}
    return {**kept, **times.to_dict(), "figures": rounded(figure_values(data))}, data


def interval_rows(
    workspace: Workspace,
    run: Run | Path,
    *,
    warm_up: float | None = None,
    interval: float | None = None,
) -> dict[str, Any]:
    """Figures of a finished run, and of each place and interval, as values that JSON can hold.

    Parameters
    ----------
    warm_up, interval
        As of :func:`renew_report`.

    Raises
    ------
    NotFoundError
        If there is no such run.
    InputError
        If it has not completed, or times do not fit what was measured.
    """
    folder = folder_of(workspace, run)
    summary, data = _analyse_run(
        folder, _read_completed_summary(folder), warm_up=warm_up, interval=interval
    )
    found = {name: summary.get(name) for name in ("warm_up", "interval", "figures")}
    if data.stations is not None:
        found["stations"] = [rounded(row) for row in data.stations.to_dicts()]
    if data.traffic is None:
        return found
    rows = {name: getattr(data.traffic, name).to_dicts() for name in TABLES}
    return {**found, **{name: [rounded(row) for row in table] for name, table in rows.items()}}


def _read_completed_summary(folder: Path) -> dict[str, Any]:
    """Summary of a run that has completed, with all of its files as they were written."""
    summary = whole_summary(folder, leave=(layout.REPORT_FILE,))
    for damaged_file in damaged_in(folder, only=layout.REPORT_FILE):
        logging.getLogger("odscen").warning("%s: %s; it is written anew", folder, damaged_file)
    if summary["status"] != RunStatus.COMPLETED:
        raise InputError(f"run {folder.name!r} has not completed, it is {summary['status']!r}")
    return summary
