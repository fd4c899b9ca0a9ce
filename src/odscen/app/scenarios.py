"""Scenarios: read, written, checked and generated."""

from __future__ import annotations

from typing import TYPE_CHECKING

from odscen.app.maps import load_map, map_of
from odscen.app.text_files import write_text
from odscen.errors import InputError
from odscen.scenario.checks import check
from odscen.scenario.config import SamplingConfig, loads_config
from odscen.scenario.files import dumps, read_any
from odscen.scenario.generation_settings import ONE_SCENARIO, GenerationSettings
from odscen.scenario.sampling import choose_map, sample_scenario

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable
    from pathlib import Path

    from odscen.catalog.store import Workspace
    from odscen.scenario.document import Scenario
    from odscen.scenario.problems import Problem

SUFFIX = ".scenario.json"
"""Ending of scenario files."""


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

    Returns
    -------
    Path
        ``path``.

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
    """Scenario files named, and all ``*.scenario.json`` in the folders named, sorted.

    Raises
    ------
    InputError
        If a folder has none.
    """
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


def scenario_name(path: Path) -> str:
    """Name of a scenario and of its run folder: the file's name without its ending."""
    name = path.name
    for ending in (SUFFIX, ".json", ".graphml"):
        if name.endswith(ending):
            return name.removesuffix(ending)
    return name


def check_scenario(workspace: Workspace, scenario: Scenario) -> tuple[Problem, ...]:
    """Find every problem of a scenario on its map, see :mod:`odscen.scenario.checks`.

    Raises
    ------
    NotFoundError
        If the workspace has no such map.
    """
    loaded = map_of(workspace, scenario)
    return check(scenario, loaded.sumo.graph, workspace.assets(), loaded.lights)


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
    try:
        return loads_config(path.read_text(encoding="utf-8"), file=str(path))
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(str(error), file=str(path)) from error


def generate(
    workspace: Workspace,
    *,
    settings: GenerationSettings = ONE_SCENARIO,
    out: Path | None = None,
    progress: Callable[[str, float], None] | None = None,
) -> list[Path]:
    """Sample scenarios and write one file each.

    Parameters
    ----------
    settings
        Which scenarios.
    out
        Folder; the workspace's ``scenarios`` if not given.
    progress
        Called with the name of each scenario and the share (0 to 1) that is done.

    Returns
    -------
    list of Path
        The files, in the order of their seeds.

    Raises
    ------
    NotFoundError
        If there is no such map.
    InputError
        If there is no map at all.
    ScenarioError
        If the configuration cannot be met.
    """
    config, map_name = settings.sampling, settings.map_name
    if map_name is not None:
        workspace.map(map_name)
    statistics = {entry.name: entry.info["statistics"] for entry in workspace.maps()}
    if not statistics:
        msg = f"there is no map in {workspace.root}; add one with: odscen maps add FILE.xodr"
        raise InputError(msg)
    paths = []
    for number in range(settings.count):
        seed = settings.seed + number
        name = map_name or choose_map(config.maps, statistics, seed=seed)
        loaded = load_map(workspace.map(name))
        title = f"{name}-{seed:04d}"
        if progress is not None:
            progress(title, number / settings.count)
        scenario = sample_scenario(
            loaded.sumo.graph, config, seed=seed, name=title, usable=loaded.usable
        )
        file = (out or workspace.scenarios) / f"{title}{SUFFIX}"
        paths.append(write_scenario(scenario, file))
    return paths
