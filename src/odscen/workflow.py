"""The main job as functions: what the command line and scripts call.

>>> from odscen.workspace.store import Workspace
>>> from odscen import workflow
>>> workspace = Workspace.open()
>>> workspace.add_map(Path("Town01.xodr"))
>>> paths = workflow.generate(workspace, map_name="Town01", seed=7)
>>> results = workflow.run(workspace, paths)
"""

from __future__ import annotations

import os
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import TYPE_CHECKING, Any

from odscen.base.errors import InputError, NotFoundError, WorkspaceError, in_file
from odscen.results.measures.corridors import corridor_along, way_between
from odscen.results.measures.expectations import needs_criticality
from odscen.scenario.checks.scenario_checks import check
from odscen.scenario.document.json_form import dumps
from odscen.scenario.document.problems import refuse_errors
from odscen.scenario.document.sampling_config import SamplingConfig, loads_config, overridden
from odscen.scenario.forms.any_form import read_any
from odscen.scenario.forms.graph_form import to_graphml
from odscen.scenario.sampling.sampler import choose_map, sample_scenario
from odscen.sumo.folder.ended import read_summary
from odscen.sumo.folder.layout import NET_FILE
from odscen.sumo.realize.program_files import scenario_lights
from odscen.sumo.realize.recording import Recording
from odscen.sumo.realize.sumo_map import SumoMap
from odscen.sumo.realize.usable import usable_places
from odscen.sumo.runner import long_runs
from odscen.sumo.runner.prepare import prepare, write_report
from odscen.sumo.runner.run_jobs import RunJob, run_many, write_sumo_files

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping, Sequence
    from pathlib import Path

    from odscen.drawing.map_drawing import MapDrawing
    from odscen.results.measures.expectations import Expectation
    from odscen.scenario.checks.signal_timing import Light
    from odscen.scenario.document.problems import Problem
    from odscen.scenario.document.scenario_document import Scenario
    from odscen.scenario.placing.usable_nodes import Usable
    from odscen.sumo.realize.realization import SliceLength
    from odscen.sumo.runner.run_jobs import RunResult
    from odscen.sumo.runner.worker_process import Companion
    from odscen.sumo.worker.protocol import Progress
    from odscen.workspace.store import MapEntry, Workspace

SUFFIX = ".scenario.json"


@dataclass(frozen=True, slots=True, eq=False)
class LoadedMap:
    """A map of the catalogue with what scenarios are made and run on, loaded once."""

    entry: MapEntry
    sumo: SumoMap
    usable: Usable
    drawing: MapDrawing
    lights: tuple[Light, ...]


@lru_cache(maxsize=4)
def load_map(entry: MapEntry) -> LoadedMap:
    """Load a map; the last few stay in memory."""
    sumo = SumoMap.of(entry.graph(), entry.lane_table())
    lights = scenario_lights(sumo.lights)
    return LoadedMap(entry, sumo, usable_places(sumo), entry.drawing(), lights)


def read_scenario(path: Path) -> Scenario:
    """Read a scenario, as JSON document or in its graph form.

    Raises
    ------
    InputError
        If the file cannot be read.
    ScenarioError
        If it is not a scenario; names every problem with its place.
    """
    try:
        content = path.read_bytes()
    except OSError as error:
        raise InputError(error.strerror or str(error), file=str(path)) from error
    return read_any(content, file=str(path))


def write_scenario(scenario: Scenario, path: Path) -> Path:
    """Write a scenario, as JSON document.

    Raises
    ------
    InputError
        If the file is of the graph form, which has its own way of writing.
    WorkspaceError
        If it cannot be written.
    """
    if path.suffix == ".graphml":
        msg = "the graph form is written by: odscen export --to graphml; name a .json file"
        raise InputError(msg, file=str(path))
    return write_text(path, dumps(scenario))


def scenario_files(paths: Iterable[Path]) -> list[Path]:
    """Scenario files named, and all ``*.scenario.json`` in the folders named, sorted."""
    found: list[Path] = []
    for path in paths:
        if not path.is_dir():
            found.append(path)
            continue
        inside = sorted(path.glob(f"*{SUFFIX}"))
        if not inside:
            msg = f"no *{SUFFIX} in this folder"
            raise InputError(msg, file=str(path))
        found += inside
    return found


def check_scenario(workspace: Workspace, scenario: Scenario) -> tuple[Problem, ...]:
    """Every problem of a scenario on its map, see :mod:`odscen.scenario.checks.scenario_checks`."""
    loaded = load_map(workspace.map_for(scenario.map.name, scenario.map.sha256))
    return check(scenario, loaded.sumo.graph, workspace.assets(), loaded.lights)


def read_config(path: Path | None) -> SamplingConfig:
    """Read a sampling configuration; the defaults without a file."""
    if path is None:
        return SamplingConfig()
    try:
        return loads_config(path.read_text(encoding="utf-8"), file=str(path))
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(str(error), file=str(path)) from error


def generate(
    workspace: Workspace,
    *,
    map_name: str | None = None,
    count: int = 1,
    seed: int = 0,
    fill: float | None = None,
    roi_segments: int | None = None,
    config: SamplingConfig | None = None,
    out: Path | None = None,
    progress: Callable[[str, float], None] | None = None,
) -> list[Path]:
    """Sample scenarios and write one file each.

    Scenario ``k`` has seed ``seed + k``, so that each can be made again alone.

    Parameters
    ----------
    map_name
        Map to use; drawn by the configuration's filters and weights if not given.
    out
        Folder; the workspace's ``scenarios`` if not given.

    Raises
    ------
    NotFoundError
        If there is no such map.
    ScenarioError
        If the configuration cannot be met.
    """
    config = overridden(config or SamplingConfig(), fill=fill, roi_segments=roi_segments)
    folder = out or workspace.scenarios
    if map_name is not None:
        workspace.map(map_name)
    statistics = {entry.name: entry.info["statistics"] for entry in workspace.maps()}
    if not statistics:
        msg = f"there is no map in {workspace.root}; add one with: odscen maps add FILE.xodr"
        raise InputError(msg)
    paths = []
    for number in range(count):
        own = seed + number
        name = map_name or choose_map(config.maps, statistics, seed=own)
        loaded = load_map(workspace.map(name))
        title = f"{name}-{own:04d}"
        if progress is not None:
            progress(title, number / count)
        scenario = sample_scenario(
            loaded.sumo.graph, config, seed=own, name=title, usable=loaded.usable
        )
        paths.append(write_text(folder / f"{title}{SUFFIX}", dumps(scenario)))
    return paths


def run(
    workspace: Workspace,
    paths: Sequence[Path],
    *,
    out: Path | None = None,
    seed: int | None = None,
    until: float | None = None,
    step_length: float | None = None,
    weather: bool = True,
    expectations: Sequence[Expectation] = (),
    processes: int = 1,
    time_limit: float | None = None,
    progress: Callable[[RunJob, Progress], None] | None = None,
    done: Callable[[RunJob, RunResult], None] | None = None,
    recording: Recording | None = None,
    meso: bool = False,
    slice_length: SliceLength = "auto",
    tell: Callable[[str], None] | None = None,
) -> tuple[RunResult, ...]:
    """Check scenarios, run them in SUMO, and write their reports.

    Parameters
    ----------
    paths
        Scenario files, see :func:`scenario_files`.
    out
        Folder that gets one folder per scenario; the workspace's ``runs`` if not given.
    seed, until, step_length
        Instead of the scenarios' own.
    processes
        How many run at a time.
    recording, meso, slice_length
        See :func:`odscen.sumo.runner.prepare.prepare`. Criticality is recorded where an
        expectation asks for it.
    tell
        Called with what the user should know before a long run.

    Raises
    ------
    ScenarioError
        If a scenario has errors; none is run then.
    """
    recording = recording or Recording()
    if needs_criticality(expectations):
        recording = replace(recording, criticality=True)
    jobs = []
    names: set[str] = set()
    for path in paths:
        scenario = read_scenario(path)
        entry = workspace.map_for(scenario.map.name, scenario.map.sha256)
        with in_file(str(path)):
            refuse_errors(check_scenario(workspace, scenario))
        name = _own_name(folder_name(path), names)
        jobs.append((name, scenario, entry))

    def job(name: str, scenario: Scenario, entry: MapEntry) -> RunJob:
        return RunJob(
            name,
            lambda: prepare(
                scenario,
                load_map(entry).sumo,
                entry.path("net"),
                workspace.assets(),
                seed=seed,
                until=until,
                step_length=step_length,
                weather=weather,
                recording=recording,
                meso=meso,
                slice_length=slice_length,
            ),
            (out or workspace.runs) / name,
        )

    drawings = {entry.sha256: entry for _, _, entry in jobs}

    def finish(folder: Path, summary: Mapping[str, Any]) -> None:
        loaded = load_map(drawings[summary["map_sha256"]])
        write_report(folder, summary, drawing=loaded.drawing, sumo_map=loaded.sumo)

    return run_many(
        [job(*parts) for parts in jobs],
        processes=processes,
        expectations=expectations,
        progress=progress,
        done=done,
        time_limit=time_limit,
        finish=finish,
        tell=tell,
    )


def resume(
    workspace: Workspace,
    run: Path,
    *,
    time_limit: float | None = None,
    progress: Callable[[Progress], None] | None = None,
    tell: Callable[[str], None] | None = None,
    live: Companion | None = None,
) -> RunResult:
    """Go on with an interrupted run and write its report.

    Parameters
    ----------
    run
        Its folder, or its name in the workspace.
    tell
        Called with where it goes on, and what is damaged.
    live
        Makes it a run that can be watched and steered.

    Raises
    ------
    NotFoundError
        If there is no such run.
    ConflictError
        If it has ended, or is going on.
    """

    def finish(folder: Path, summary: Mapping[str, Any]) -> None:
        loaded = None
        with suppress(InputError):  # the map has been removed meanwhile
            loaded = load_map(workspace.map_for(summary["map"], summary["map_sha256"]))
        if loaded is None:
            write_report(folder, summary)
        else:
            write_report(folder, summary, drawing=loaded.drawing, sumo_map=loaded.sumo)

    folder = run if run.is_dir() else workspace.runs / run
    return long_runs.resume(
        folder, progress=progress, tell=tell, time_limit=time_limit, finish=finish, live=live
    )


def report(
    workspace: Workspace,
    run: Path,
    *,
    corridor: Sequence[str] = (),
    ends: tuple[str, str] | None = None,
    out: Path | None = None,
) -> Path:
    """Write the report of a finished run anew.

    Parameters
    ----------
    run
        Its folder, or its name in the workspace.
    corridor
        Segments along which vehicles are followed; junctions between them may be left out.
    ends
        First and last segment instead: the shortest way between them. The busiest corridor if
        neither is given.
    out
        File to write; the run's ``report.html`` if not given.

    Raises
    ------
    NotFoundError
        If there is no such run.
    InputError
        If it has not ended, its map is not in the workspace, or one cannot drive so.
    """
    folder = run if run.is_dir() else workspace.runs / run
    if not folder.is_dir():
        names = [path.name for path in workspace.runs.glob("*")]
        msg = "run"
        raise NotFoundError(msg, str(run), names)
    summary = read_summary(folder)
    loaded = load_map(workspace.map_for(summary["map"], summary["map_sha256"]))
    segments = way_between(loaded.sumo.graph, *ends) if ends is not None else corridor
    return write_report(
        folder,
        summary,
        drawing=loaded.drawing,
        sumo_map=loaded.sumo,
        corridor=corridor_along(loaded.sumo.graph, segments) if segments else None,
        out=out,
    )


def export_sumo(workspace: Workspace, scenario: Scenario, out: Path, *, file: Path) -> list[Path]:
    """Write the SUMO files of a scenario into the folder ``out``; they run with plain ``sumo -c``.

    Raises
    ------
    ScenarioError
        If the scenario has errors.
    WorkspaceError
        If the folder cannot be written.
    """
    with in_file(str(file)):
        refuse_errors(check_scenario(workspace, scenario))
    entry = workspace.map_for(scenario.map.name, scenario.map.sha256)
    prepared = prepare(scenario, load_map(entry).sumo, entry.path("net"), workspace.assets())
    try:
        out.mkdir(parents=True, exist_ok=True)
        write_sumo_files(prepared.sumo_files, prepared.net, out, link=False)
    except OSError as error:
        msg = f"{out}: {error.strerror or error}"
        raise WorkspaceError(msg) from error
    return sorted(out / name for name in (*prepared.sumo_files, NET_FILE))


def export_graphml(workspace: Workspace, scenario: Scenario, out: Path, *, file: Path) -> Path:
    """Write the graph form of a scenario into the folder ``out``."""
    entry = workspace.map_for(scenario.map.name, scenario.map.sha256)
    text = to_graphml(scenario, load_map(entry).sumo.graph)
    return write_text(out / f"{folder_name(file)}.graphml", text)


def folder_name(path: Path) -> str:
    """Name of a scenario's run folder: the file's name without its ending."""
    name = path.name
    for ending in (SUFFIX, ".json", ".graphml"):
        if name.endswith(ending):
            return name.removesuffix(ending)
    return name


def _own_name(name: str, taken: set[str]) -> str:
    """Return a name that no other scenario of the same call has."""
    own, number = name, 1
    while own in taken:
        number += 1
        own = f"{name}-{number}"
    taken.add(own)
    return own


def write_text(path: Path, text: str) -> Path:
    """Write a file whole or not at all.

    Raises
    ------
    WorkspaceError
        If it cannot be written.
    """
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        part = path.with_name(f".{path.name}.{os.getpid()}.part")
        part.write_text(text, encoding="utf-8")
        part.replace(path)
    except OSError as error:
        msg = f"{path}: {error.strerror or error}"
        raise WorkspaceError(msg) from error
    return path
