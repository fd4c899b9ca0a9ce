"""A file of OpenSCENARIO with what it names: its scenario, its catalogs and its map."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np

from odscen.base.errors import InputError, NoMapError, NotFoundError
from odscen.base.ids import RoadId
from odscen.base.xml_reading import read_xml
from odscen.formats.base import FileContent
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
from odscen.opendrive.lanes import RoadTable

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from lxml.etree import _Element

    from odscen.formats.base import GivenFile, ImportSource
    from odscen.formats.openscenario_import.xosc_reader import EgoDriver
    from odscen.opendrive.road_model import OpenDrive

_MOST: Final = 20_000_000
"""Bytes of an OpenSCENARIO file or catalog."""
_NO_MAP: Final = "its map is missing: no place can be found"
_NAMES_NONE: Final = "the file names no map (RoadNetwork/LogicFile)"


def read_xosc_file(source: ImportSource) -> FileContent:
    """Scenario of a file, and the plan of a sweep if that is a parameter value distribution.

    Raises
    ------
    InputError
        If it cannot be read, or has no storyboard; names element and line.
    NoMapError
        If its map is not found, or it names none; has the report of the rest.
    """
    ego: EgoDriver = "sumo" if source.options.get("ego") == "sumo" else "story"
    xosc = _read_tree_and_catalogs(source.file)
    weather = source.assets.weather
    logic = xosc.root.find("RoadNetwork/LogicFile")
    named = "" if logic is None else logic.get("filepath", "").replace("\\", "/")
    try:
        place = source.find_map(named, xosc.file)
    except NotFoundError as error:
        bare = MaplessSource(
            root=xosc.root, values=xosc.values, report=xosc.report, weather=weather
        )
        report_without_map(bare, _NO_MAP, ego=ego)
        what = f"its map {error.name!r} is not found" if error.name else _NAMES_NONE
        raise NoMapError(
            f"{what}; give one with --map, a file (.xodr) or the name of a map",
            file=xosc.file.where,
            lists=xosc.report.lists(),
        ) from error
    roads = _RoadPoints(place.read_roads)
    scene = XoscSource(
        root=xosc.root, values=xosc.values, report=xosc.report, weather=weather,
        graph=place.sumo_map.graph, map_name=place.name, sha256=place.sha256,
        road_point=roads.point, lane_t=roads.lane_t,
        movement=partial(movement_of, place.sumo_map), parameters=xosc.parameters,
        varied=xosc.distribution is not None,
    )  # fmt: skip
    scenario = read_openscenario(scene, name=source.name, ego=ego)
    plan = None
    if xosc.distribution is not None:
        plan = read_distribution(xosc.report, xosc.distribution, scenario.parameters)
    return FileContent(scenario, lists=xosc.report.lists(), plan=plan)


def choose_main_file(files: Sequence[GivenFile]) -> int:
    """The one file that is a distribution, else the one with a storyboard.

    Raises
    ------
    InputError
        If there are several, or none.
    """
    roots = [_read_tree(file) for file in files]
    for tag in ("ParameterValueDistribution", "Storyboard"):
        rows = [row for row, root in enumerate(roots) if root.find(tag) is not None]
        if len(rows) == 1:
            return rows[0]
        if rows:
            names = ", ".join(files[row].name for row in rows)
            raise InputError(
                f"these are {len(rows)} scenarios ({names}): send one at a time, with its map"
            )
    raise InputError(
        "there is no scenario among the files: none has a Storyboard",
        file=", ".join(file.name for file in files),
    )


class _Xosc(NamedTuple):
    """The file with the storyboard: values put in for names, and what varies them."""

    file: GivenFile
    root: _Element
    values: dict[str, str]
    report: ImportReport
    parameters: dict[str, _Element]
    distribution: _Element | None


def _read_tree(file: GivenFile) -> _Element:
    try:
        root = read_xml(file.read(most=_MOST), bare=True)
    except InputError as error:
        raise InputError(error.problem, file=file.where) from error
    if root.tag != "OpenSCENARIO":
        raise InputError(f"the root element is {root.tag!r}, not 'OpenSCENARIO'", file=file.where)
    return root


def _read_tree_and_catalogs(file: GivenFile) -> _Xosc:
    root = _read_tree(file)
    report = ImportReport()
    report.add(root, file.name)
    distribution = root.find("ParameterValueDistribution")
    if distribution is not None:
        for element in (root, *root.iterchildren("FileHeader")):
            report.mark(element, "taken")
        named = report.child(distribution, "ScenarioFile")
        if named is None:
            raise report.wrong(distribution, "there is no ScenarioFile")
        file = file.other(report.word(named, "filepath"))
        root = _read_tree(file)
        report.add(root, file.name)
    if root.find("Storyboard") is None and root.find("Entities") is None:
        raise InputError(
            "this file has no storyboard: distributions and catalogs are not scenarios",
            file=file.where,
        )
    resolver = TreeResolver(report, _catalog_finder(file))
    values = resolver.resolve(root)
    return _Xosc(file, root, values, report, resolver.parameters, distribution)


def _catalog_finder(
    file: GivenFile,
) -> Callable[[tuple[str, ...], str], tuple[_Element, str] | None]:
    """Finds a catalog by its name among the files of some folders, each read once."""
    known: dict[str, tuple[_Element, str]] = {}

    def find(folders: tuple[str, ...], name: str) -> tuple[_Element, str] | None:
        for other in () if name in known else file.others(folders, ".xosc"):
            root = _read_tree(other)
            catalog = root.find("Catalog")
            if catalog is not None:
                known.setdefault(catalog.get("name", ""), (root, other.name))
        return known.get(name)

    return find


class _RoadPoints:
    """Points of the roads of a map that the lane graph does not have.

    The map is read when the first one is asked for.
    """

    def __init__(self, read_roads: Callable[[], OpenDrive]) -> None:
        self._read_roads = read_roads
        self._loaded: RoadTable | None = None

    def _road_table(self) -> RoadTable:
        if self._loaded is None:
            self._loaded = RoadTable.of(self._read_roads())
        return self._loaded

    def point(self, road: str, s: float, t: float) -> tuple[float, float, float] | None:
        """X, y and heading with growing s, at s and t of a road; ``None`` if there is none."""
        table = self._road_table()
        row = table.road_index.get(RoadId(road))
        if row is None:
            return None
        at = table.plan.at(np.array([row]), np.array([s]))
        x, y, hdg = float(at.x[0]), float(at.y[0]), float(at.hdg[0])
        return x - t * float(np.sin(hdg)), y + t * float(np.cos(hdg)), hdg

    def lane_t(self, road: str, lane: int, s: float) -> float | None:
        """T of the middle of a lane of any type at s; ``None`` if there is none."""
        table = self._road_table()
        row = table.road_index.get(RoadId(road))
        if row is None:
            return None
        if lane == 0:
            return float(table.lane_offset(np.array([row]), np.array([s]))[0])
        for number in table.lanes_at(row, s):
            if table.lane_id[number] == lane:
                inner, outer = table.lane_borders(np.array([number]), np.array([s]))
                return float(inner[0] + outer[0]) / 2.0
        return None
