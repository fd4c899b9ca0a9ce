"""A scenario is run: checked, prepared, simulated, reported. The only place that does it.

The command line, the page, suites of tests, and CARLA beside or instead of SUMO all go this way:
:func:`check_run`, then :func:`prepare_run`, then :func:`carry_out`; or :func:`run`, which does all
of it, and :mod:`~odscen.app.running.batches` for several. What a run is to be like is one
:class:`~odscen.runs.run_settings.RunSettings` from here down to SUMO's process.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from odscen.app.maps import load_map
from odscen.app.scenarios import read_scenario, scenario_name
from odscen.base.errors import in_file
from odscen.figures.judging.criteria import criteria_problems
from odscen.runs.run_settings import AS_DESIGNED
from odscen.scenario.checks.scenario_checks import check
from odscen.scenario.document.problems import refuse_errors
from odscen.sumo.runner.assignment import prepare_assigned
from odscen.sumo.runner.run_jobs import run_prepared
from odscen.sumo.worker.behaviour.behaviour_doors import open_behaviour

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from odscen.app.maps import LoadedMap
    from odscen.maps.asset_catalogue import Assets
    from odscen.maps.map_entry import MapEntry
    from odscen.maps.store import Workspace
    from odscen.records.assignment_steps import AssignmentStep
    from odscen.runs.finished_run import Run
    from odscen.runs.run_settings import RunSettings
    from odscen.scenario.document.scenario_document import Scenario
    from odscen.sumo.runner.run_jobs import PreparedRun
    from odscen.sumo.runner.worker_process import Companion, Ended
    from odscen.sumo.worker.protocol import OnProgress


@dataclass(frozen=True, slots=True, eq=False)
class CheckedRun:
    """A run of a scenario that has been checked, see :func:`check_run`.

    The same scenario can be run several times, with ``dataclasses.replace``.

    Attributes
    ----------
    name
        What progress calls it.
    scenario
        Without errors on its map.
    entry
        The map.
    assets
        Size of models and parameters of weather.
    folder
        The run's folder, made by :func:`carry_out`.
    settings
        How it is run.
    """

    name: str
    scenario: Scenario
    entry: MapEntry
    assets: Assets
    folder: Path
    settings: RunSettings

    @property
    def map(self) -> LoadedMap:
        """The map, loaded when it is needed."""
        return load_map(self.entry)


def check_run(
    workspace: Workspace,
    scenario: Scenario,
    *,
    name: str,
    out: Path | None = None,
    settings: RunSettings = AS_DESIGNED,
    entry: MapEntry | None = None,
) -> CheckedRun:
    """Check a scenario that is to be run.

    Parameters
    ----------
    name
        Of the run's folder.
    out
        Folder that gets the run's folder; the workspace's ``runs`` if not given.
    settings
        How it is run.
    entry
        The map; the one of the workspace that the scenario names if not given.

    Raises
    ------
    ScenarioError
        With every error of the scenario.
    NotFoundError
        If the workspace does not have its map.
    InputError
        If the behaviour model of the settings cannot be made.
    """
    if settings.behaviour is not None:
        open_behaviour(settings.behaviour, 0)  # what cannot be made is refused before the run
    if entry is None:
        entry = workspace.map_for(scenario.map.name, scenario.map.sha256)
    loaded, assets = load_map(entry), workspace.assets()
    parking = loaded.sumo.parking
    found = check(scenario, loaded.sumo.graph, assets, loaded.lights, parking=parking)
    refuse_errors((*found, *criteria_problems(scenario)))
    return CheckedRun(name, scenario, entry, assets, (out or workspace.runs) / name, settings)


def check_file(
    workspace: Workspace,
    path: Path,
    *,
    name: str | None = None,
    out: Path | None = None,
    settings: RunSettings = AS_DESIGNED,
) -> CheckedRun:
    """Read and check a scenario that is to be run; parameters as of :func:`check_run`.

    Parameters
    ----------
    path
        Scenario file. Its name is the run's if none is given.

    Raises
    ------
    InputError
        If the file cannot be read.
    ScenarioError
        With every error of the scenario; names the file.
    """
    scenario, name = read_scenario(path), name or scenario_name(path)
    entry = workspace.map_for(scenario.map.name, scenario.map.sha256)
    with in_file(str(path)):
        return check_run(workspace, scenario, name=name, out=out, settings=settings, entry=entry)


def prepare_run(
    run: CheckedRun, *, iterated: Callable[[AssignmentStep], None] | None = None
) -> PreparedRun:
    """Make everything that a run is made of; nothing is written yet.

    Where the scenario wants routes by travel time, they are found by runs of their own first.

    Parameters
    ----------
    iterated
        Called after each of these runs.

    Raises
    ------
    ScenarioError
        With every actor and flow whose spawn or goal is not usable.
    SimulationError
        If a run that routes are found by fails.
    """
    net, sumo_map = run.entry.checked("net"), run.map.sumo
    return prepare_assigned(
        run.scenario, sumo_map, net, run.assets, settings=run.settings, on_step=iterated
    )


def carry_out(
    run: CheckedRun,
    prepared: PreparedRun,
    *,
    progress: OnProgress | None = None,
    ended: Callable[[Path], None] | None = None,
    live: Companion | None = None,
    simulate: Callable[[Path], Ended] | None = None,
) -> Run:
    """Simulate what has been prepared, and write its results and its report.

    Parameters
    ----------
    prepared
        From :func:`prepare_run`.
    progress
        Called in this thread, a few times a second.
    ended
        Called with the folder when the simulation has completed, before the report is written: the
        place for further files.
    live
        Makes it a run that can be watched and steered, or that goes in step with another simulator.
    simulate
        Runs what is in a folder and writes the results there, instead of SUMO's worker.

    Returns
    -------
    Run
        Of a run that has completed or failed: what goes wrong inside SUMO does not raise.

    Raises
    ------
    WorkspaceError
        If the folder cannot be written, or the disk cannot hold the run.
    ConflictError
        If a run that has not ended is in the folder.
    """
    loaded = run.map  # the map may be removed while the run goes on

    def finish(folder: Path, summary: Mapping[str, Any]) -> None:
        if ended is not None:
            ended(folder)
        report_run(folder, summary, loaded)

    return run_prepared(
        prepared, run.folder, progress=progress, finish=finish, live=live, simulate=simulate
    )


def check_given(
    workspace: Workspace,
    scenario: Scenario | Path,
    *,
    name: str | None = None,
    out: Path | None = None,
    settings: RunSettings = AS_DESIGNED,
) -> CheckedRun:
    """Check a scenario, or its file; parameters and errors of :func:`check_run`, `check_file`."""
    if isinstance(scenario, Path):
        return check_file(workspace, scenario, name=name, out=out, settings=settings)
    name = name or scenario_name(scenario)
    return check_run(workspace, scenario, name=name, out=out, settings=settings)


def run(
    workspace: Workspace,
    scenario: Scenario | Path,
    *,
    settings: RunSettings = AS_DESIGNED,
    name: str | None = None,
    out: Path | None = None,
    progress: OnProgress | None = None,
) -> Run:
    """Check a scenario, run it in SUMO in a process of its own, and write its report.

    Parameters
    ----------
    workspace
        Has the map.
    scenario
        The scenario, or its file.
    settings
        How it is run.
    name
        Of the run's folder; the scenario's if not given. A finished run of that name is replaced.
    out
        Folder that gets the run's folder; the workspace's ``runs`` if not given.
    progress
        Called in this thread, a few times a second.

    Returns
    -------
    Run
        Completed or failed: what goes wrong inside SUMO does not raise, see ``status``.

    Raises
    ------
    ScenarioError
        If the scenario has errors.
    InputError
        If the file cannot be read.
    NotFoundError
        If the workspace does not have its map.
    ConflictError
        If a run that has not ended is in the folder.
    WorkspaceError
        If the folder cannot be written, or the disk cannot hold the run.
    """
    checked = check_given(workspace, scenario, name=name, out=out, settings=settings)
    return carry_out(checked, prepare_run(checked), progress=progress)


def report_run(folder: Path, summary: Mapping[str, Any], loaded: LoadedMap) -> None:
    """Write the report; a run without one does not wait for its imports."""
    from odscen.app.running.reports import write_report

    write_report(folder, summary, loaded=loaded)
