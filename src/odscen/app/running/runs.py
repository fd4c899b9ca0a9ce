"""A scenario is run: checked, prepared, simulated, reported. The only place that does it.

The command line, the page and suites of tests all go this way, with whichever simulator:
:func:`check_run`, then :func:`prepare_run`, then :func:`carry_out`; or :func:`run`, which does all
of it, and :mod:`~odscen.app.running.batches` for several. What a run is to be like is one
:class:`~odscen.runs.run_settings.RunSettings` from here down to SUMO's process.
"""

from __future__ import annotations

import logging
import time
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

from odscen.app.maps import load_map
from odscen.app.scenarios import read_scenario, scenario_name
from odscen.base.errors import InputError, OdscenError, in_file
from odscen.base.given_files import as_path, is_path
from odscen.figures.judging.criteria import criteria_problems
from odscen.runs.new_run import (
    SimulationOutcome,
    claimed_folder,
    refuse_finished_run,
    run_in_new_folder,
)
from odscen.runs.reporter import SILENT, Reporter
from odscen.runs.run_settings import AS_DESIGNED
from odscen.scenario.checks.scenario_checks import check
from odscen.scenario.document.problems import refuse_errors
from odscen.simulators.base import Simulator
from odscen.simulators.installed import open_simulator
from odscen.sumo.realize.run_map import RunMap
from odscen.sumo.runner.run_folder import SumoPreparedRun
from odscen.sumo.runner.run_jobs import run_prepared
from odscen.sumo.runner.sumo_simulator import SumoSimulator

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping
    from pathlib import Path

    from odscen.app.maps import LoadedMap
    from odscen.base.given_files import GivenPath
    from odscen.maps.map_entry import MapEntry
    from odscen.maps.store import Workspace
    from odscen.runs.finished_run import Run
    from odscen.runs.new_run import Finish, PreparedRun
    from odscen.runs.run_settings import RunSettings
    from odscen.scenario.document.problems import Problem
    from odscen.scenario.document.scenario_document import Scenario
    from odscen.simulators.assets import Assets
    from odscen.simulators.base import AnySimulator
    from odscen.sumo.runner.worker_process import Companion


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
    simulator
        What plays it.
    unsupported
        What the simulator does not do of it; no error is among them.
    warnings
        What the checks of the scenario warn of.
    """

    name: str
    scenario: Scenario
    entry: MapEntry
    assets: Assets
    folder: Path
    settings: RunSettings
    simulator: AnySimulator
    unsupported: tuple[Problem, ...] = ()
    warnings: tuple[Problem, ...] = ()

    @property
    def map(self) -> LoadedMap:
        """The map, loaded when it is needed."""
        return load_map(self.entry)

    @property
    def run_map(self) -> RunMap:
        """The map as the simulator is given it."""
        return run_map(self.entry, self.assets)


def check_run(
    workspace: Workspace,
    scenario: Scenario,
    *,
    name: str,
    out: GivenPath | None = None,
    settings: RunSettings = AS_DESIGNED,
    entry: MapEntry | None = None,
    simulator: AnySimulator | None = None,
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
    simulator
        What plays it, instead of the one that the settings name.

    Raises
    ------
    ScenarioError
        With every error of the scenario.
    NotFoundError
        If the workspace does not have its map.
    InputError
        If there is no such simulator, or it cannot follow the settings.
    """
    if simulator is None:
        simulator = open_simulator(settings.simulator, settings.simulator_options)
    simulator.check_settings(settings)
    if entry is None:
        entry = workspace.map_for(scenario.map.name, scenario.map.sha256)
    loaded, assets = load_map(entry), workspace.assets()
    parking = loaded.sumo.parking
    found = check(scenario, loaded.sumo.graph, assets, loaded.lights, parking=parking)
    warnings = refuse_errors((*found, *criteria_problems(scenario)))
    unsupported = unsupported_parts(simulator, scenario, run_map(entry, assets))
    refuse_errors(unsupported)
    folder = (workspace.runs if out is None else as_path(out)) / name
    return CheckedRun(
        name, scenario, entry, assets, folder, settings, simulator, unsupported, warnings
    )


def run_map(entry: MapEntry, assets: Assets) -> RunMap:
    """A map of the catalogue as simulators are given it."""
    return RunMap(entry.name, entry.sha256, load_map(entry).sumo, assets, entry.checked)


def unsupported_parts(
    simulator: AnySimulator, scenario: Scenario, on: RunMap
) -> tuple[Problem, ...]:
    """What a simulator does not do of a scenario.

    Raises
    ------
    InputError
        If it breaks while it says so.
    """
    with _name_simulator_in_errors(simulator):
        return tuple(simulator.unsupported(scenario, on))


@contextmanager
def _name_simulator_in_errors(simulator: AnySimulator) -> Iterator[None]:
    """Name the simulator in what its code raises."""
    try:
        yield
    except OdscenError:
        raise
    except Exception as error:  # whatever code from outside may raise
        raise InputError(f"it failed: {error!r}", element=simulator.label) from error


def check_file(
    workspace: Workspace,
    path: GivenPath,
    *,
    name: str | None = None,
    out: GivenPath | None = None,
    settings: RunSettings = AS_DESIGNED,
    simulator: AnySimulator | None = None,
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
        return check_run(
            workspace, scenario, name=name, out=out, settings=settings, entry=entry,
            simulator=simulator,
        )  # fmt: skip


def prepare_run(run: CheckedRun, *, reporter: Reporter = SILENT) -> PreparedRun:
    """Make everything that a run is made of; nothing is written yet.

    Where the scenario wants routes by travel time, they are found by runs of their own first.

    Parameters
    ----------
    reporter
        Hears of each of these runs.

    Raises
    ------
    ScenarioError
        With every actor and flow whose spawn or goal is not usable.
    SimulationError
        If a run that routes are found by fails.
    InputError
        If a simulator from outside breaks.
    """
    with _name_simulator_in_errors(run.simulator):
        prepared: PreparedRun = run.simulator.prepare(
            run.scenario, run.run_map, run.settings, reporter
        )
    if isinstance(prepared, SumoPreparedRun):
        return prepared
    lines = tuple(problem.message for problem in run.unsupported)
    return replace(
        prepared,
        problems=(*prepared.problems, *lines),
        about={"driven_by": run.simulator.label, **prepared.about},
    )


def carry_out(
    run: CheckedRun,
    prepared: PreparedRun,
    *,
    reporter: Reporter = SILENT,
    live: Companion | None = None,
    reports: bool = True,
    figures: bool = True,
) -> Run:
    """Simulate what has been prepared, and write its results and its report.

    Parameters
    ----------
    prepared
        From :func:`prepare_run`.
    live
        Makes it a run that can be watched and steered; of SUMO only.
    reports
        Whether it gets its report.
    figures
        Whether figures of a run without a report are computed at once, see
        :func:`odscen.app.running.batches.run_many`.

    Returns
    -------
    Run
        Of a run that has completed or failed: what goes wrong inside a simulator does not raise.

    Raises
    ------
    WorkspaceError
        If the folder cannot be written, or the disk cannot hold the run.
    ConflictError
        If a run that has not ended is in the folder.
    """
    loaded = run.map  # the map may be removed while the run goes on
    finish: Finish | None = None
    if reports:

        def finish(folder: Path, summary: Mapping[str, Any]) -> None:
            # A run without a report does not wait for its imports.
            from odscen.app.running.reports import write_report

            write_report(folder, summary, loaded=loaded)

    if type(run.simulator) is SumoSimulator and isinstance(prepared, SumoPreparedRun):
        # SUMO's runs can go in slices, be watched and be resumed.
        result = run_prepared(
            prepared, run.folder, reporter=reporter, finish=finish, live=live, figures=figures
        )
    else:
        with claimed_folder(run.folder):
            result = run_in_new_folder(
                prepared,
                run.folder,
                lambda folder: _run_simulator(run.simulator, prepared, folder, reporter),
                finish=finish,
                figures=figures,
            )
    reporter.finished(result)
    words = "run %s: %s, %g s simulated in %.1f s, in %s"
    spent = result.known["sim_seconds"] or 0.0, result.known["wall_seconds"]
    logging.getLogger("odscen").info(words, run.name, result.status, *spent, result.folder)
    return result


def _run_simulator(
    simulator: AnySimulator, prepared: PreparedRun, folder: Path, reporter: Reporter
) -> SimulationOutcome:
    """Let a simulator run; code from outside that breaks is a failed run."""
    begin = time.perf_counter()
    reporter.started()
    try:
        outcome: SimulationOutcome = simulator.run(prepared, folder, reporter)
    except OdscenError:
        raise
    except Exception as error:
        seconds = time.perf_counter() - begin
        return SimulationOutcome(None, None, seconds, error=f"{simulator.label}: {error!r}")
    return outcome


def check_given(
    workspace: Workspace,
    scenario: Scenario | GivenPath,
    *,
    name: str | None = None,
    out: GivenPath | None = None,
    settings: RunSettings = AS_DESIGNED,
    simulator: AnySimulator | None = None,
) -> CheckedRun:
    """Check a scenario, or its file; parameters and errors of :func:`check_run`, `check_file`."""
    name = name or scenario_name(scenario)
    if is_path(scenario):
        return check_file(
            workspace, scenario, name=name, out=out, settings=settings, simulator=simulator
        )
    return check_run(
        workspace, scenario, name=name, out=out, settings=settings, simulator=simulator
    )


def run(
    workspace: Workspace,
    scenario: Scenario | GivenPath,
    *,
    settings: RunSettings = AS_DESIGNED,
    simulator: str | AnySimulator | None = None,
    name: str | None = None,
    out: GivenPath | None = None,
    overwrite: bool = False,
    reporter: Reporter = SILENT,
) -> Run:
    """Check a scenario, run it, and write its report; SUMO has a process of its own.

    Parameters
    ----------
    workspace
        Has the map.
    scenario
        The scenario, or its file.
    settings
        How it is run.
    simulator
        What plays it: a name of those there are, or a
        :class:`~odscen.simulators.base.Simulator`. The one of the settings if not given: SUMO,
        unless they say otherwise.
    name
        Of the run's folder; the scenario's if not given.
    out
        Folder that gets the run's folder; the workspace's ``runs`` if not given.
    overwrite
        Whether a run that has ended is replaced in ``out``; in the workspace's ``runs`` it is.
    reporter
        Hears how far it is, in this thread.

    Returns
    -------
    Run
        Completed or failed: what goes wrong inside SUMO does not raise, see ``status``.

    Raises
    ------
    ScenarioError
        If the scenario has errors.
    InputError
        If the file cannot be read, or there is no such simulator.
    NotFoundError
        If the workspace does not have its map.
    ConflictError
        If a run that has not ended is in the folder, or one that has and is not to be replaced.
    WorkspaceError
        If the folder cannot be written, or the disk cannot hold the run.
    """
    made = simulator if isinstance(simulator, Simulator) else None
    if isinstance(simulator, str):
        settings = replace(settings, simulator=simulator)
    checked = check_given(
        workspace, scenario, name=name, out=out, settings=settings, simulator=made
    )
    if out is not None and not overwrite:
        refuse_finished_run(checked.folder)
    for problem in checked.unsupported:
        reporter.said(problem.message)
    return carry_out(checked, prepare_run(checked, reporter=reporter), reporter=reporter)
