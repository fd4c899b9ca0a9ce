"""OpenSCENARIO files read from disk, with their catalogs and their map."""

from __future__ import annotations

import json
from functools import partial
from typing import TYPE_CHECKING, Final, NamedTuple

from odscen.app.exchange.road_points import RoadPoints
from odscen.app.exchange.xosc_files import FolderFiles, given_map
from odscen.app.maps import load_map
from odscen.app.scenarios import check_scenario, write_scenario
from odscen.base.errors import InputError, NoMapError, NotFoundError
from odscen.base.text_files import write_text
from odscen.formats.openscenario.xosc_signals import movement_of
from odscen.formats.openscenario_import.import_report import ImportReport
from odscen.formats.openscenario_import.source.read_distributions import read_distribution
from odscen.formats.openscenario_import.source.resolved_tree import TreeResolver
from odscen.formats.openscenario_import.xosc_reader import (
    MaplessSource,
    XoscSource,
    read_openscenario,
    report_without_map,
)
from odscen.maps.folder_names import name_from_file

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from lxml.etree import _Element

    from odscen.app.exchange.xosc_files import XoscFiles
    from odscen.formats.openscenario_import.import_report import ReportRow
    from odscen.formats.openscenario_import.xosc_reader import EgoDriver
    from odscen.maps.store import Workspace
    from odscen.scenario.document.problems import Problem
    from odscen.scenario.document.scenario_document import Scenario
    from odscen.scenario.sweeps.sweep_plan import SweepPlan


_NO_MAP: Final = "its map is missing: no place can be found"
_NAMES_NONE: Final = "the file names no map (RoadNetwork/LogicFile)"


class ImportedScenario(NamedTuple):
    """A scenario, the lists of its report, and what :func:`check_scenario` finds in it.

    Attributes
    ----------
    plan
        What a parameter value distribution sweeps; ``None`` of other files, and if none of its
        parameters settles a number of the scenario.
    plan_file
        Where that has been written.
    """

    scenario: Scenario
    lists: dict[str, list[ReportRow]]
    problems: tuple[Problem, ...]
    plan: SweepPlan | None = None
    plan_file: Path | None = None


class ReadScenario(NamedTuple):
    """What files say, before it is written or checked; see :class:`ImportedScenario`."""

    scenario: Scenario
    lists: dict[str, list[ReportRow]]
    plan: SweepPlan | None


def import_scenario(
    workspace: Workspace,
    file: Path,
    *,
    out: Path | None = None,
    maps: Path | None = None,
    on_map: str | None = None,
    ego: EgoDriver = "story",
) -> ImportedScenario:
    """Read an OpenSCENARIO file as a scenario, and write that if ``out`` is given.

    Of a parameter value distribution it is the scenario that the file names, and the plan of the
    sweep is written beside it, with ``.sweep.json`` in the place of ``.scenario.json``.

    Its map is looked for beside the file, in the folder ``maps``, and by its name in the workspace;
    one that is found as a file is added to the workspace.

    Parameters
    ----------
    on_map
        The map on which it plays, whatever the file names: an OpenDRIVE file, or the name of a map
        of the workspace.
    ego
        What drives the ego: SUMO, or the story of the file.

    Raises
    ------
    InputError
        If the file cannot be read, or has no storyboard; names element and line.
    NotFoundError
        If the map ``on_map`` is not found.
    NoMapError
        If the map of the file is not found, or it names none; has the report of the rest.
    """
    entry = None if on_map is None else given_map(workspace, on_map)
    files = FolderFiles(file, maps, entry)
    scenario, lists, plan = read_files(workspace, files, name=name_from_file(file), ego=ego)
    plan_file = None
    if out is not None:
        write_scenario(scenario, out)
        plan_file = None if plan is None else _write_plan(plan, out)
    return ImportedScenario(scenario, lists, check_scenario(workspace, scenario), plan, plan_file)


def read_files(
    workspace: Workspace, files: XoscFiles, *, name: str, ego: EgoDriver = "story"
) -> ReadScenario:
    """Read an OpenSCENARIO file, from wherever it and what it names lie.

    Parameters
    ----------
    name
        Of the scenario.

    Raises
    ------
    InputError, NoMapError
        As of :func:`import_scenario`.
    """
    told = _told(files)
    weather = workspace.assets().weather
    try:
        entry = told.files.map(workspace, told.map_named())
    except NotFoundError as error:
        bare = MaplessSource(
            root=told.root, values=told.values, report=told.report, weather=weather
        )
        report_without_map(bare, _NO_MAP, ego=ego)
        what = f"its map {error.name!r} is not found" if error.name else _NAMES_NONE
        raise NoMapError(
            f"{what}; give one with --map, a file (.xodr) or the name of a map",
            file=files.where,
            lists=told.report.lists(),
        ) from error
    loaded = load_map(entry).sumo
    roads = RoadPoints(entry)
    source = XoscSource(
        root=told.root, values=told.values, report=told.report, weather=weather,
        graph=loaded.graph, map_name=entry.name, sha256=entry.sha256, road_point=roads.point,
        lane_t=roads.lane_t, movement=partial(movement_of, loaded), parameters=told.parameters,
        varied=told.varied is not None,
    )  # fmt: skip
    scenario = read_openscenario(source, name=name, ego=ego)
    plan = None
    if told.varied is not None:
        plan = read_distribution(told.report, told.varied, scenario.parameters)
    return ReadScenario(scenario, told.report.lists(), plan)


def wanted_map(files: XoscFiles) -> str:
    """The map that a file names, as it names it; empty if it names none.

    Raises
    ------
    InputError
        If the file cannot be read, or has no storyboard; names element and line.
    """
    return _told(files).map_named()


class _Told(NamedTuple):
    """The file that tells the story: values put in for names, and what varies them."""

    files: XoscFiles
    root: _Element
    values: dict[str, str]
    report: ImportReport
    parameters: dict[str, _Element]
    varied: _Element | None

    def map_named(self) -> str:
        """Map of the file as it names it, empty without one."""
        logic = self.root.find("RoadNetwork/LogicFile")
        return "" if logic is None else logic.get("filepath", "").replace("\\", "/")


def _told(files: XoscFiles) -> _Told:
    root = files.tree()
    report = ImportReport()
    report.add(root, files.name)
    varied = root.find("ParameterValueDistribution")
    if varied is not None:
        files = files.other(_scenario_file(report, root, varied))
        root = files.tree()
        report.add(root, files.name)
    if root.find("Storyboard") is None and root.find("Entities") is None:
        raise InputError(
            "this file has no storyboard: distributions and catalogs are not scenarios",
            file=files.where,
        )
    resolver = TreeResolver(report, _catalogs(files))
    values = resolver.resolve(root)
    return _Told(files, root, values, report, resolver.parameters, varied)


def _scenario_file(report: ImportReport, root: _Element, varied: _Element) -> str:
    """Scenario that a parameter value distribution is about, as it names it."""
    for element in (root, *root.iterchildren("FileHeader")):
        report.mark(element, "taken")
    named = report.child(varied, "ScenarioFile")
    if named is None:
        raise report.wrong(varied, "there is no ScenarioFile")
    return report.word(named, "filepath")


def _write_plan(plan: SweepPlan, out: Path) -> Path:
    stem = out.name.removesuffix(".json").removesuffix(".scenario")
    return write_text(out.with_name(f"{stem}.sweep.json"), plan_text(plan))


def plan_text(plan: SweepPlan) -> str:
    """The file of a plan."""
    return json.dumps(plan.to_dict(), indent=2, ensure_ascii=False) + "\n"


def _catalogs(files: XoscFiles) -> Callable[[tuple[str, ...], str], tuple[_Element, str] | None]:
    known: dict[str, tuple[_Element, str]] = {}

    def find(folders: tuple[str, ...], name: str) -> tuple[_Element, str] | None:
        for root, file in () if name in known else files.catalogs(folders):
            catalog = root.find("Catalog")
            if catalog is not None:
                known.setdefault(catalog.get("name", ""), (root, file))
        return known.get(name)

    return find
