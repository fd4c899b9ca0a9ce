"""Recorded traffic of the disk: files of others and runs of odscen, on their maps."""

from __future__ import annotations

from dataclasses import dataclass
from math import degrees
from typing import TYPE_CHECKING, Any

import polars as pl

from odscen.app.exchange.imports import DiskFile
from odscen.app.maps import load_map
from odscen.base.errors import InputError
from odscen.base.given_files import as_path
from odscen.formats.tracks.lane_places import estimate_offset, fit_on_map
from odscen.formats.tracks.read_recording import read_recording, time_window
from odscen.formats.tracks.recorded_traffic import RecordedTraffic, complete_tracks, shift_tracks
from odscen.formats.tracks.scenes import exposure, find_scenes
from odscen.maps.map_pictures import draw_lines_on_map
from odscen.records.run_plan import Plan
from odscen.runs import layout
from odscen.runs.finished_run import Run

if TYPE_CHECKING:
    from pathlib import Path

    from odscen.base.given_files import GivenPath
    from odscen.formats.tracks.driver_fit import FittedDrivers
    from odscen.maps.map_entry import MapEntry


@dataclass(frozen=True, slots=True, eq=False)
class ShownRecording:
    """What is said of a recording.

    Attributes
    ----------
    summary
        Road users, time and area; on a map also ``offset`` (``X,Y,DEGREES``, by which it was moved
        to lie on it) and ``agreement``.
    rows
        Its tracks; on a map with the lanes they are on, moved by the offset.
    scenes
        What :func:`~odscen.formats.tracks.scenes.find_scenes` finds.
    """

    summary: dict[str, Any]
    rows: pl.DataFrame
    scenes: pl.DataFrame


def show_recording(
    recorded: RecordedTraffic,
    entry: MapEntry | None = None,
    *,
    estimate: bool = False,
    picture: Path | None = None,
) -> ShownRecording:
    """Describe recorded traffic, and place it on a map.

    Parameters
    ----------
    entry
        The map whose frame its places are in.
    estimate
        Whether it is first moved and turned onto the lanes of the map.
    picture
        Where map and tracks are drawn, as SVG or PNG.

    Raises
    ------
    InputError
        If a picture or an offset is asked for without a map, or no offset can be estimated.
    """
    rows, summary = recorded.rows, recorded.summary()
    if entry is None:
        if estimate or picture is not None:
            raise InputError("an offset or a picture needs a map: give it with --map")
        scenes = find_scenes(rows)
        return ShownRecording({**summary, "exposure": exposure(rows, scenes)}, rows, scenes)
    graph = entry.graph()
    if estimate:
        x, y, turn = estimate_offset(rows, graph)
        summary["offset"] = f"{x:.3f},{y:.3f},{degrees(turn):.4f}"
        rows = shift_tracks(rows, x, y, turn)
    rows, summary["agreement"] = fit_on_map(rows, graph)
    scenes = find_scenes(rows, graph)
    summary["exposure"] = exposure(rows, scenes)
    if picture is not None:
        draw_tracks_on_map(entry, rows, picture)
    return ShownRecording(summary, rows, scenes)


def draw_tracks_on_map(entry: MapEntry, placed: pl.DataFrame, picture: Path) -> None:
    """Draw tracks on their map, with circles where vehicles are on no lane or against theirs."""
    tracks: dict[str, list[Any]] = {}
    for (kind, _), own in placed.group_by("category", "id", maintain_order=True):
        tracks.setdefault(str(kind), []).append(own.select("x", "y").to_numpy())
    driven = placed.filter(pl.col("category") != "pedestrian")
    places = {
        name: driven.filter(where).select("x", "y").to_numpy()
        for name, where in (
            ("On no lane", ~pl.col("on_lane")),
            ("Against its lane", pl.col("wrong_way")),
        )
    }
    draw_lines_on_map(entry, tracks, places, picture)


def fit_recorded_drivers(
    recorded: RecordedTraffic, entry: MapEntry | None = None, *, model: str | None = None
) -> FittedDrivers:
    """Driver sets that drive as those of recorded traffic do.

    Parameters
    ----------
    entry
        The map in whose frame its places are, whose limits desired speeds are shares of; without
        one these are not fitted, and curves, gaps, changes of lanes and pedestrians not measured.
    model
        ``IDM`` or ``Krauss``; that which is nearer to the tracks if not given.

    Returns
    -------
    FittedDrivers
        With a map its report has ``habits``
        (:func:`~odscen.formats.tracks.road_user_habits.measure_habits`).

    Raises
    ------
    InputError
        If nobody follows another vehicle for 10 s, or there is no such model.
    """
    from odscen.formats.tracks.driver_fit import fit_drivers
    from odscen.formats.tracks.road_user_habits import measure_habits

    if entry is None:
        return fit_drivers(recorded.rows, model=model)
    graph = entry.graph()
    placed = fit_on_map(recorded.rows, graph)[0]
    fitted = fit_drivers(placed, graph=graph, model=model)
    lit = {name for light in load_map(entry).lights for name in light.names}
    return fitted._replace(
        report={**fitted.report, "habits": measure_habits(placed, graph, lit=lit)}
    )


def compare_with_recording(
    run: RecordedTraffic, recorded: RecordedTraffic, entry: MapEntry | None = None
) -> dict[str, Any]:
    """How far the distributions of a run are from those of recorded traffic.

    Parameters
    ----------
    run
        Tracks of a run; :func:`read_recorded_traffic` reads its folder.
    entry
        The map on which both lie; without one figures of the map are left out, and all of the run
        is compared.

    Returns
    -------
    dict
        As of :func:`~odscen.formats.tracks.realism.compare_traffic`.

    Raises
    ------
    InputError
        If one of them has no road user, or the run has none where it was recorded.
    """
    from odscen.formats.tracks.realism import compare_traffic

    return compare_traffic(run.rows, recorded.rows, None if entry is None else entry.graph())


def read_recorded_traffic(
    path: GivenPath, *, window: str = "", columns: str = "", part: str = "", offset: str = ""
) -> RecordedTraffic:
    """Tracks of recorded traffic, whatever the schema of its file is.

    Read are INTERACTION, SinD, levelX (highD, inD, rounD, exiD), NGSIM and Argoverse 2, OSI traces
    (``.osi``, MCAP) and omega-prime, CommonRoad, scenarios of ScenarioNet (nuScenes, Waymo), other
    tables, and runs of odscen.

    Parameters
    ----------
    path
        A file, or the folder of a run. Files that belong to it lie beside it.
    window
        ``FROM..TO``, seconds or H:MM:SS as the file counts them; rows outside are not read.
    columns
        Of a table of no published schema, what its columns are:
        ``time=ms*0.001,id=vehicle,x=east,y=north``.
    part
        Which of several recordings that a file has: ``case_id`` of INTERACTION, ``Location`` of
        NGSIM.
    offset
        ``X,Y`` or ``X,Y,DEGREES``: metres east and north, after a turn counter-clockwise about the
        origin, by which its places become those of a map.

    Returns
    -------
    RecordedTraffic
        ``rows``: the table of tracks, in metres, seconds and radians.

    Raises
    ------
    InputError
        If it is nothing of these, or damaged; names the file, the element and the value.
    """
    file = as_path(path)
    if file.is_dir():
        return _tracks_of_run(Run.open(file), window)
    options = {"window": window, "columns": columns, "case": part, "location": part}
    options["offset"] = offset
    return read_recording(DiskFile(file), options)


def _tracks_of_run(run: Run, window: str) -> RecordedTraffic:
    rows = run.trajectories().filter(pl.col("time").is_between(*time_window(window)))
    plan = Plan.from_json((run.folder / layout.PLAN_FILE).read_text(encoding="utf-8"))
    bodies = pl.DataFrame(
        [(actor.id, actor.length, actor.width) for actor in plan.actors],
        schema={"id": pl.String, "length": pl.Float64, "width": pl.Float64},
        orient="row",
    )
    return complete_tracks(
        rows.rename({"category": "kind"}).join(bodies, on="id", how="left"), "odscen"
    )
