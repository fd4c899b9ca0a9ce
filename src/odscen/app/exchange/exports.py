"""Scenarios and runs in foreign formats: as files in a folder, or in one archive."""

from __future__ import annotations

import io
import json
import shutil
import zipfile
from contextlib import nullcontext
from dataclasses import replace
from functools import lru_cache
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, NamedTuple

from odscen.base.atomic_folders import scratch_folder
from odscen.base.errors import InputError, in_file
from odscen.base.given_files import as_path, is_path
from odscen.base.system_errors import disk_errors
from odscen.formats import find_format, list_formats
from odscen.formats.base import NOTES_SUFFIX

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from odscen.base.given_files import GivenPath
    from odscen.formats.base import ExportFiles, ExportSource, Format, Kept, RecordedRun
    from odscen.maps.map_entry import MapEntry
    from odscen.maps.store import Workspace
    from odscen.opendrive.road_model import OpenDrive
    from odscen.runs.finished_run import Run
    from odscen.scenario.document.scenario_document import Scenario

_DATE: Final = (2026, 1, 1, 0, 0, 0)
"""Of every file in an archive: the same scenario gives the same bytes on any day."""


def export(
    workspace: Workspace,
    scenario: Scenario | GivenPath,
    out: GivenPath,
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
        Name of a format that scenarios are written in: ``sumo``, ``graphml``, ``openscenario``,
        ``arrays``, ``pyg``, or one of an installed package.
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

    chosen = _choose_format(to, options)
    if "scenario" not in chosen.of or chosen.write is None:
        raise InputError(
            f"the format {to} says what happened in a run: name the folder of one",
            file=str(scenario) if is_path(scenario) else None,
        )
    document = given_scenario(scenario)
    if chosen.checked:
        with in_file(str(scenario)) if is_path(scenario) else nullcontext():
            refuse_errors(check_scenario(workspace, document))
    source = _make_source(workspace, document, name or scenario_name(scenario), options)
    return _write_files(chosen.write(source), as_path(out))


def export_run(
    workspace: Workspace,
    run: GivenPath,
    out: GivenPath,
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
    DamagedError
        If a file of the run is not as it was written.
    WorkspaceError
        If the folder cannot be written.
    """
    wanted = {to: options or {}}
    _refuse_unable(wanted)
    return _write_files(run_contents(run_source(workspace, run), wanted)[to], as_path(out))


def run_contents(
    source: ExportSource, wanted: Mapping[str, Mapping[str, str]]
) -> dict[str, ExportFiles]:
    """Make the files of a run in several formats; errors as of :func:`export_run`.

    Parameters
    ----------
    source
        As of :func:`run_source`.
    wanted
        Options by format.

    Returns
    -------
    dict
        By format and name, see :data:`~odscen.formats.base.ExportFiles`.
    """
    writers = _refuse_unable(wanted)
    found = {}
    for to, (chosen, write) in writers.items():
        roads = read_roads(source.of_map, source.map_file) if chosen.needs_roads else None
        found[to] = write(replace(source, options=dict(wanted[to]), roads=roads))
    return found


def _refuse_unable(
    wanted: Mapping[str, Mapping[str, str]],
) -> dict[str, tuple[Format, Callable[[ExportSource], ExportFiles]]]:
    """Formats with what writes runs in them; one that cannot, or has no such option, is refused."""
    return {to: _run_writer(to, options) for to, options in wanted.items()}


def _run_writer(
    to: str, options: Mapping[str, str]
) -> tuple[Format, Callable[[ExportSource], ExportFiles]]:
    """A format that runs are written in, and what writes it."""
    chosen = _choose_format(to, options)
    if "run" not in chosen.of or chosen.write is None:
        able = ", ".join(
            name
            for name, one in list_formats().items()
            if "run" in one.of and one.write is not None
        )
        raise InputError(f"the format {to} cannot say what happened in a run; {able} can")
    return chosen, chosen.write


def run_source(workspace: Workspace, run: GivenPath) -> ExportSource:
    """A run to be written, read once for all formats; errors as of :func:`export_run`."""
    from odscen.app.running.reports import replay_page
    from odscen.app.scenarios import read_scenario
    from odscen.runs.finished_run import Run
    from odscen.runs.layout import SCENARIO_FILE

    opened = Run.open(run)
    folder = opened.folder
    recorded = _read_recorded(opened)
    seed = opened.known["seed"]  # perhaps another one than the scenario's own
    document = read_scenario(folder / SCENARIO_FILE).model_copy(update={"seed": seed})
    source = _make_source(workspace, document, folder.resolve().name, None, recorded)
    return replace(source, report=lambda: replay_page(workspace, folder, recorded))


def read_roads(of_map: Kept, file: Path) -> OpenDrive:
    """Road model of a map, read once."""
    from odscen.opendrive.parse import parse

    return of_map.made("roads", lambda: parse(file.read_bytes(), file=file.name))


@lru_cache(maxsize=2)
def kept_of(entry: MapEntry) -> Kept:
    """What formats have made of a map; that of the last two stays in memory."""
    from odscen.formats.base import Kept

    del entry
    return Kept()


def export_runs(
    workspace: Workspace,
    folder: GivenPath,
    out: GivenPath,
    *,
    to: str,
    options: Mapping[str, str] | None = None,
) -> list[Path]:
    """Write what happened in a run, or in all runs that have ended in a folder, each in its own.

    Parameters and errors are those of :func:`export_run`; ``folder`` may be one of runs, such as
    ``runs`` of a workspace, with other things among them.
    """
    from odscen.runs.layout import SUMMARY_FILE

    folder, out = as_path(folder), as_path(out)
    inside = sorted(path.parent for path in folder.glob(f"*/{SUMMARY_FILE}"))
    if (folder / SUMMARY_FILE).is_file() or not inside:
        return export_run(workspace, folder, out, to=to, options=options)
    written = (export_run(workspace, run, out / run.name, to=to, options=options) for run in inside)
    return [file for files in written for file in files]


class ExportedFiles(NamedTuple):
    """Files of an export.

    Attributes
    ----------
    contents
        Bytes of each, by their names and in the order of these.
    """

    contents: dict[str, bytes]

    def notes(self) -> dict[str, Any] | None:
        """What is only approximated, and what is left out; ``None`` if the format has no such."""
        for name, content in self.contents.items():
            if name.endswith(NOTES_SUFFIX):
                notes: dict[str, Any] = json.loads(content)
                return notes
        return None

    def zipped(self) -> bytes:
        """All of them as a ZIP archive; the same bytes each time."""
        buffer = io.BytesIO()
        with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as archive:
            for name, content in self.contents.items():
                entry = zipfile.ZipInfo(name, _DATE)
                entry.compress_type = zipfile.ZIP_DEFLATED
                entry.external_attr = 0o644 << 16
                archive.writestr(entry, content)
        return buffer.getvalue()


def export_to_memory(
    workspace: Workspace,
    source: Scenario | GivenPath,
    *,
    to: str,
    name: str | None = None,
    options: Mapping[str, str] | None = None,
) -> ExportedFiles:
    """Write a scenario as :func:`export` does, or the run of a folder as :func:`export_run`.

    Raises
    ------
    NotFoundError, InputError, ScenarioError
        As of these functions.
    """
    with scratch_folder() as out:
        if isinstance(source, Path):
            files = export_run(workspace, source, out, to=to, options=options)
        else:
            files = export(workspace, source, out, to=to, options=options, name=name)
        return ExportedFiles(
            {file.relative_to(out).as_posix(): file.read_bytes() for file in files}
        )


def _choose_format(to: str, options: Mapping[str, str] | None) -> Format:
    chosen = find_format(to)
    chosen.refuse_unknown_options(options or {})
    return chosen


def _read_recorded(run: Run) -> RecordedRun:
    from odscen.formats.base import RecordedRun
    from odscen.records.run_plan import Plan
    from odscen.runs.layout import PLAN_FILE
    from odscen.runs.recorded import read_light_states

    rows = run.trajectories()
    file = run.folder / PLAN_FILE
    with in_file(str(file)):
        plan = Plan.from_json(file.read_text(encoding="utf-8"))
    times = rows["time"].unique().sort().to_list()
    step = min((b - a for a, b in pairwise(times)), default=plan.step_length)
    ended = run.known["sim_seconds"]
    until = float(times[-1] if ended is None else ended)
    if not plan.elevation and "z" in rows.columns:  # SUMO's network is flat, the map is not
        rows = rows.drop("z")
    return RecordedRun(plan.actors, rows, read_light_states(run.folder), until, step)


def contents_of(files: ExportFiles) -> dict[str, bytes]:
    """Bytes of the files of an export."""
    return {
        name: content.read_bytes()
        if isinstance(content, Path)
        else content.encode()
        if isinstance(content, str)
        else content
        for name, content in files.items()
    }


def _make_source(
    workspace: Workspace,
    document: Scenario,
    name: str,
    options: Mapping[str, str] | None,
    recorded: RecordedRun | None = None,
) -> ExportSource:
    from odscen.app.maps import map_of
    from odscen.formats.base import ExportSource

    loaded = map_of(workspace, document)
    return ExportSource(
        name=name,
        scenario=document,
        sumo_map=loaded.sumo,
        map_file=loaded.entry.checked("xodr"),
        net=loaded.entry.checked("net"),
        assets=workspace.assets(),
        options=dict(options or {}),
        recorded=recorded,
        of_map=kept_of(loaded.entry),
    )


def _write_files(files: ExportFiles, out: Path) -> list[Path]:
    written = []
    with disk_errors(str(out)):
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
    return written
