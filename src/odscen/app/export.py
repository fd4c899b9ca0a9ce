"""Scenarios in foreign formats.

A new format is a module in ``odscen/formats`` with an ``EXPORTER``, and its line in
:data:`EXPORTERS`; the command line and its help read that. Nothing heavy is imported to read it.
"""

from __future__ import annotations

import shutil
from contextlib import nullcontext
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING

from odscen.base.errors import InputError, NotFoundError, WorkspaceError, in_file
from odscen.formats import (
    arrays_export,
    commonroad_export,
    graphml_export,
    openscenario_export,
    pyg_export,
    scenarionet_export,
    sumo_export,
    waymo_export,
)

if TYPE_CHECKING:
    from collections.abc import Mapping

    from odscen.formats.exporter import Exporter, ExportFiles, ExportSource, WhatHappened
    from odscen.maps.store import Workspace
    from odscen.opendrive.road_model import OpenDrive
    from odscen.scenario.document.scenario_document import Scenario

EXPORTERS = {
    one.name: one
    for one in (
        sumo_export.EXPORTER,
        graphml_export.EXPORTER,
        openscenario_export.EXPORTER,
        arrays_export.EXPORTER,
        pyg_export.EXPORTER,
        scenarionet_export.EXPORTER,
        waymo_export.EXPORTER,
        commonroad_export.EXPORTER,
    )
}
"""Every format by its name."""


def export(
    workspace: Workspace,
    scenario: Scenario | Path,
    out: Path,
    *,
    to: str,
    options: Mapping[str, str] | None = None,
    name: str | None = None,
) -> list[Path]:
    """Write a scenario in another format.

    Parameters
    ----------
    workspace
        Has the map.
    scenario
        The scenario, or its file.
    out
        Folder for the files; made if need be.
    to
        Name of the format, one of :data:`EXPORTERS` that is not of runs only: ``sumo``,
        ``graphml``, ``openscenario``, ``arrays`` and ``pyg``.
    options
        What the format lets one choose: of ``openscenario`` the ``version``.
    name
        Of the files; that of the scenario if not given.

    Returns
    -------
    list of Path
        The files, sorted.

    Raises
    ------
    NotFoundError
        If there is no such format.
    InputError
        If the format is of runs only, or has no such option, or not with that value.
    ScenarioError
        If the scenario has errors that the format cannot do with.
    WorkspaceError
        If the folder cannot be written.
    """
    from odscen.app.scenarios import check_scenario, given_scenario, scenario_name
    from odscen.scenario.document.problems import refuse_errors

    exporter = _exporter(to, options)
    if exporter.files is None:
        raise InputError(
            f"the format {to} says what happened in a run: name the folder of one",
            file=str(scenario) if isinstance(scenario, Path) else None,
        )
    document = given_scenario(scenario)
    if exporter.checked:
        with in_file(str(scenario)) if isinstance(scenario, Path) else nullcontext():
            refuse_errors(check_scenario(workspace, document))
    source = _source(workspace, document, name or scenario_name(scenario), options)
    return _write(exporter.files(source), out)


def export_run(
    workspace: Workspace,
    run: Path,
    out: Path,
    *,
    to: str,
    options: Mapping[str, str] | None = None,
) -> list[Path]:
    """Write what happened in a run: where each road user was at each time, and what lights showed.

    Parameters
    ----------
    workspace
        Has the map.
    run
        Folder of a run that has ended and whose trajectories were recorded.
    out
        As of :func:`export`.
    to
        ``openscenario``, ``pyg``, ``scenarionet``, ``waymo`` or ``commonroad``.
    options
        As of :func:`export`; of all but ``openscenario`` the part of the run, ``begin`` and
        ``end``, s.

    Returns
    -------
    list of Path
        The files, sorted.

    Raises
    ------
    NotFoundError
        If there is no such format.
    InputError
        If the format cannot say what happened or has no such option, no run has ended there, or it
        has no trajectories or too many.
    WorkspaceError
        If the folder cannot be written.
    """
    from odscen.app.scenarios import read_scenario
    from odscen.runs.finished_run import Run
    from odscen.runs.layout import SCENARIO_FILE

    exporter = _exporter(to, options)
    if exporter.runs is None:
        able = ", ".join(name for name, one in EXPORTERS.items() if one.runs is not None)
        raise InputError(f"the format {to} cannot say what happened in a run; {able} can")
    happened = _happened(run)
    seed = Run.open(run).summary["seed"]  # perhaps another one than the scenario's own
    document = read_scenario(run / SCENARIO_FILE).model_copy(update={"seed": seed})
    source = _source(workspace, document, run.resolve().name, options, happened)
    if exporter.needs_roads:
        source = replace(source, roads=_roads(source.map_file))
    return _write(exporter.runs(source), out)


def export_runs(
    workspace: Workspace,
    folder: Path,
    out: Path,
    *,
    to: str,
    options: Mapping[str, str] | None = None,
) -> list[Path]:
    """Write what happened in a run, or in all runs that have ended in a folder, each in its own.

    Parameters and errors are those of :func:`export_run`; ``folder`` may be one of runs, such as
    ``runs`` of a workspace, with other things among them.
    """
    from odscen.runs.layout import SUMMARY_FILE

    inside = sorted(one.parent for one in folder.glob(f"*/{SUMMARY_FILE}"))
    if (folder / SUMMARY_FILE).is_file() or not inside:
        return export_run(workspace, folder, out, to=to, options=options)
    written = (export_run(workspace, run, out / run.name, to=to, options=options) for run in inside)
    return [file for files in written for file in files]


def _roads(map_file: Path) -> OpenDrive:
    from odscen.opendrive.parse import parse

    return parse(map_file.read_bytes(), file=map_file.name)


def _exporter(to: str, options: Mapping[str, str] | None) -> Exporter:
    if to not in EXPORTERS:
        raise NotFoundError("format", to, list(EXPORTERS))
    for option in options or {}:
        if option not in EXPORTERS[to].options:
            raise InputError(f"the format {to} has no {option}")
    return EXPORTERS[to]


def _happened(folder: Path) -> WhatHappened:
    from odscen.formats.exporter import WhatHappened
    from odscen.records.run_plan import Plan
    from odscen.runs.finished_run import Run
    from odscen.runs.layout import PLAN_FILE
    from odscen.runs.recorded import read_light_states

    run = Run.open(folder)
    rows = run.trajectories()
    file = folder / PLAN_FILE
    with in_file(str(file)):
        plan = Plan.from_json(file.read_text(encoding="utf-8"))
    times = rows["time"].unique().sort().to_list()
    step = min((b - a for a, b in pairwise(times)), default=plan.step_length)
    ended = run.known["sim_seconds"]
    until = float(times[-1] if ended is None else ended)
    if not plan.elevation and "z" in rows.columns:  # SUMO's network is flat, the map is not
        rows = rows.drop("z")
    return WhatHappened(plan.actors, rows, read_light_states(folder), until, step)


def _source(
    workspace: Workspace,
    document: Scenario,
    name: str,
    options: Mapping[str, str] | None,
    happened: WhatHappened | None = None,
) -> ExportSource:
    from odscen.app.maps import map_of
    from odscen.formats.exporter import ExportSource

    loaded = map_of(workspace, document)
    return ExportSource(
        name=name,
        scenario=document,
        sumo_map=loaded.sumo,
        map_file=loaded.entry.checked("xodr"),
        net=loaded.entry.checked("net"),
        assets=workspace.assets(),
        options=dict(options or {}),
        happened=happened,
    )


def _write(files: ExportFiles, out: Path) -> list[Path]:
    written = []
    try:
        for name, content in sorted(files.items()):
            path = out / name
            path.parent.mkdir(parents=True, exist_ok=True)
            if isinstance(content, str):
                path.write_text(content, encoding="utf-8")
            elif isinstance(content, bytes):
                path.write_bytes(content)
            else:
                shutil.copyfile(content, path)
            written.append(path)
    except OSError as error:
        raise WorkspaceError(f"{out}: {error.strerror or error}") from error
    return written
