"""Scenarios: read, written, checked and generated."""

from __future__ import annotations

from typing import TYPE_CHECKING

from odscen.app.maps import map_of
from odscen.base.errors import InputError
from odscen.base.given_files import as_path, is_path, read_given, read_given_text
from odscen.base.text_files import write_text
from odscen.figures.judging.criteria import criteria_problems
from odscen.maps.folder_names import plain_name
from odscen.maps.wastebasket import SCENARIO_SUFFIX
from odscen.scenario.checks.scenario_checks import check
from odscen.scenario.document.json_form import dumps
from odscen.scenario.document.sampling_config import SamplingConfig, loads_config
from odscen.scenario.forms.any_form import read_any

if TYPE_CHECKING:
    from collections.abc import Iterable
    from pathlib import Path

    from odscen.base.given_files import GivenPath
    from odscen.maps.store import Workspace
    from odscen.scenario.document.problems import Problem
    from odscen.scenario.document.scenario_document import Scenario

SUFFIX = SCENARIO_SUFFIX
"""Ending of scenario files."""


def read_scenario(path: GivenPath) -> Scenario:
    """Read a scenario, as JSON document, in its graph form or as arrays.

    Parameters
    ----------
    path
        Its file.

    Returns
    -------
    Scenario
        The document.

    Raises
    ------
    InputError
        If the file cannot be read.
    ScenarioError
        If it is not a scenario; names every problem with its place.
    """
    return read_any(read_given(as_path(path)), file=str(path))


def write_scenario(scenario: Scenario, path: GivenPath) -> Path:
    """Write a scenario, as JSON document.

    Parameters
    ----------
    scenario
        The document.
    path
        File to write; its folder is made if need be.

    Returns
    -------
    Path
        ``path``.

    Raises
    ------
    InputError
        If the file is of the graph form or of arrays, which have their own way of writing.
    WorkspaceError
        If it cannot be written.
    """
    path = as_path(path)
    forms = {".graphml": ("the graph form is", "graphml"), ".npz": ("arrays are", "arrays")}
    if path.suffix in forms:
        what, to = forms[path.suffix]
        raise InputError(
            f"{what} written by: odscen export --to {to}; name a .json file", file=str(path)
        )
    return write_text(path, dumps(scenario))


def scenario_files(paths: Iterable[Path]) -> list[Path]:
    """Scenario files named, and all ``*.scenario.json`` in the folders named, sorted.

    Raises
    ------
    InputError
        If a folder has none.
    """
    files: list[Path] = []
    for path in paths:
        if not path.is_dir():
            files.append(path)
            continue
        inside = sorted(path.glob(f"*{SUFFIX}"))
        if not inside:
            raise InputError(f"no *{SUFFIX} in this folder", file=str(path))
        files += inside
    return files


def scenario_name(scenario: Scenario | GivenPath) -> str:
    """Name of a scenario's run folder: the file's name without its ending, or the scenario's."""
    if not is_path(scenario):
        return plain_name(scenario.name) or "scenario"
    name = as_path(scenario).name
    for ending in (SUFFIX, ".json", ".graphml", ".npz"):
        if name.endswith(ending):
            return name.removesuffix(ending)
    return name


def given_scenario(scenario: Scenario | GivenPath) -> Scenario:
    """Return a scenario, read if it is given as a file; errors of :func:`read_scenario`."""
    return read_scenario(scenario) if is_path(scenario) else scenario


def check_scenario(workspace: Workspace, scenario: Scenario | GivenPath) -> tuple[Problem, ...]:
    """Find every problem of a scenario on its map; :mod:`odscen.scenario.checks` has the rules.

    What the SUMO network of the map does not hold of it are warnings:
    :mod:`odscen.sumo.runner.network_fit`.

    Parameters
    ----------
    workspace
        Has the map.
    scenario
        The scenario, or its file.

    Returns
    -------
    tuple of Problem
        Errors, with which it cannot run, and warnings; empty if all is well.

    Raises
    ------
    NotFoundError
        If the workspace has no such map.
    InputError
        If the file cannot be read, or the map of that name has other content.
    """
    from odscen.sumo.runner.network_fit import place_fit, route_fit

    scenario = given_scenario(scenario)
    loaded = map_of(workspace, scenario)
    problems = check(
        scenario,
        loaded.sumo.graph,
        workspace.assets(),
        loaded.lights,
        parking=loaded.sumo.parking,
    )
    problems += (*criteria_problems(scenario), *place_fit(scenario, loaded.sumo))
    if not any(problem.severity == "error" for problem in problems):
        problems += tuple(route_fit(scenario, loaded.sumo))
    return problems


def read_config(path: Path | None) -> SamplingConfig:
    """Read a sampling configuration; the defaults without a file.

    Raises
    ------
    InputError
        If the file cannot be read.
    ScenarioError
        With every problem of the configuration.
    """
    if path is None:
        return SamplingConfig()
    return loads_config(read_given_text(path), file=str(path))
