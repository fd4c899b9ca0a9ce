"""From a scenario and its map to a prepared run, and from a finished run to its report."""

from __future__ import annotations

from typing import TYPE_CHECKING

from odscen.results.measures.summary import actors_from_json
from odscen.results.measures.traffic import over_run
from odscen.results.measures.traffic_files import read_tables
from odscen.results.records.run_records import Plan, events_from_json
from odscen.scenario.document.json_form import dumps
from odscen.sumo.folder import layout
from odscen.sumo.folder.recorded import read_conflicts, read_trajectories
from odscen.sumo.realize.forecast import forecast
from odscen.sumo.realize.realization import realize
from odscen.sumo.realize.sumo_lane_places import lane_places
from odscen.sumo.runner.run_jobs import PreparedRun

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path
    from typing import Any

    from odscen.drawing.map_drawing import MapDrawing
    from odscen.results.measures.corridors import Corridor
    from odscen.scenario.document.scenario_document import Scenario
    from odscen.sumo.realize.realization import ModelSizes, SliceLength
    from odscen.sumo.realize.recording import Recording
    from odscen.sumo.realize.sumo_map import SumoMap

MESO_NOTE = (
    "meso: queues on sections of road instead of vehicles that follow each other. No lanes, lane "
    "changes, places across the lane, exact starts, collisions or hard braking; people on foot "
    "meet neither each other nor vehicles; places are interpolated"
)
REPORT_ROWS = 2_000_000
"""Rows of trajectories that a report is made from at most; a day of a town has far more."""


def prepare(
    scenario: Scenario,
    sumo_map: SumoMap,
    net: Path,
    assets: ModelSizes | None = None,
    *,
    seed: int | None = None,
    until: float | None = None,
    step_length: float | None = None,
    weather: bool = True,
    recording: Recording | None = None,
    meso: bool = False,
    slice_length: SliceLength = "auto",
) -> PreparedRun:
    """Realize a scenario and put together what its run folder will hold.

    Parameters
    ----------
    sumo_map
        Of the scenario's map; made once by :meth:`odscen.sumo.realize.sumo_map.SumoMap.of` for many
        runs.
    net
        The map's ``net.net.xml``.
    assets, seed, until, step_length, weather, recording, meso, slice_length
        See :func:`odscen.sumo.realize.realization.realize`. A run in slices can be resumed.

    Raises
    ------
    ScenarioError
        With every actor and flow whose spawn or goal is not usable.
    """
    realization = realize(
        scenario,
        sumo_map,
        assets,
        seed=seed,
        until=until,
        step_length=step_length,
        weather=weather,
        recording=recording,
        meso=meso,
        slice_length=slice_length,
    )
    plan = realization.plan
    return PreparedRun(
        plan=plan,
        sumo_files=realization.files,
        net=net,
        scenario_json=dumps(scenario),
        problems=realization.problems,
        notes=((MESO_NOTE,) if meso else ()) + realization.notes,
        places=lane_places(sumo_map),
        about={"map": scenario.map.name, "map_sha256": scenario.map.sha256, "meso": meso},
        expected=forecast(
            plan,
            realization.files,
            every=None if recording is None else recording.every,
            lanes=len(sumo_map.net.lanes),
        ),
    )


def write_report(
    folder: Path,
    summary: Mapping[str, Any],
    *,
    drawing: MapDrawing | None = None,
    sumo_map: SumoMap | None = None,
    corridor: Corridor | None = None,
    out: Path | None = None,
) -> Path:
    """Write ``report.html`` into a run folder from its files; made for ``finish`` of a run.

    Parameters
    ----------
    drawing
        Of the map, to be shown below the ways.
    sumo_map
        Of the map, to show figures by place and a corridor.
    corridor
        To follow vehicles along; the busiest if not given.
    out
        File to write; ``report.html`` in the run folder if not given.
    """
    import polars as pl

    from odscen.results.measures.corridors import busiest_corridor
    from odscen.results.report.place_shapes import place_shapes
    from odscen.results.report.run_report import render_report
    from odscen.sumo.outputs.corridor_traces import corridor_traces

    def text(name: str) -> str:
        return (folder / name).read_text(encoding="utf-8")

    recorded = read_trajectories(folder, most=REPORT_ROWS)
    figures = read_tables(folder / layout.FIGURES_FOLDER)
    if corridor is None and figures is not None and sumo_map is not None:
        corridor = busiest_corridor(over_run(figures.movements), sumo_map.graph)
    followed = None
    if corridor is not None and sumo_map is not None:
        followed = corridor_traces(folder, sumo_map, corridor)
    page = render_report(
        summary,
        Plan.from_json(text(layout.PLAN_FILE)),
        actors_from_json(text(layout.ACTORS_FILE)),
        events_from_json(text(layout.EVENTS_FILE)),
        recorded.rows if recorded is not None else pl.DataFrame(),
        drawing=drawing,
        every=recorded.every if recorded is not None else 1,
        figures=figures,
        shapes=None if sumo_map is None else place_shapes(sumo_map.graph),
        corridor=followed,
        conflicts=read_conflicts(folder),
    )
    report = out or folder / layout.REPORT_FILE
    report.write_text(page, encoding="utf-8")
    return report
