"""A file of OpenSCENARIO with what it names: its scenario, its catalogs and its map."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass, field
from functools import partial
from typing import TYPE_CHECKING, Any, Final, Literal, NamedTuple

import numpy as np

from odscen.base.categories import Category
from odscen.base.errors import InputError, NoMapError, NotFoundError
from odscen.base.ids import RoadId
from odscen.base.xml_reading import read_xml
from odscen.formats.base import FileContent
from odscen.formats.openscenario.xosc_signals import movement_of
from odscen.formats.openscenario_import.import_report import ImportReport
from odscen.formats.openscenario_import.places.read_positions import NoMapPositions, PositionReader
from odscen.formats.openscenario_import.places.read_trajectories import trajectory_place
from odscen.formats.openscenario_import.source.entity_selections import name_entities
from odscen.formats.openscenario_import.source.kept_parameters import with_parameters
from odscen.formats.openscenario_import.source.own_files import is_own
from odscen.formats.openscenario_import.source.read_distributions import read_distribution
from odscen.formats.openscenario_import.source.resolved_tree import TreeResolver
from odscen.formats.openscenario_import.start.read_init import InitReader
from odscen.formats.openscenario_import.story.read_actions import ActionReader
from odscen.formats.openscenario_import.story.read_conditions import ConditionReader
from odscen.formats.openscenario_import.story.read_signals import SignalReader
from odscen.formats.openscenario_import.story.read_stop import read_stop
from odscen.formats.openscenario_import.story.read_storyboard import StoryReader
from odscen.formats.openscenario_import.story.value_changes import first_values
from odscen.formats.openscenario_import.world.read_entities import read_entities
from odscen.formats.openscenario_import.world.read_environment import read_environment
from odscen.lanegraph.query import parts_with, segment_of_node
from odscen.opendrive.lanes import RoadTable
from odscen.scenario.document.problems import validated
from odscen.scenario.document.scenario_document import Scenario
from odscen.scenario.templates.scene_template import STEADY, STEADY_DRIVER

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping, Sequence

    from lxml.etree import _Element

    from odscen.formats.base import GivenFile, ImportSource
    from odscen.formats.openscenario_import.world.read_entities import ReadEntity
    from odscen.formats.openscenario_import.world.read_environment import ReadEnvironment
    from odscen.lanegraph.graphs import MapGraph
    from odscen.opendrive.road_model import OpenDrive


# --------------------------- A file of OpenSCENARIO as a scenario document, and what became of each
EgoDriver = Literal["sumo", "story"]


@dataclass(frozen=True, slots=True, kw_only=True)
class MaplessSource:
    """A file of which parameters and catalogs are put in, without its map.

    Attributes
    ----------
    root, values, report
        Its tree, its parameters, and the marks of its elements so far.
    movement
        Light and movement of a signal.
    weather
        Parameters of a preset of the weather.
    """

    root: _Element
    values: Mapping[str, str]
    report: ImportReport
    weather: Callable[[str], Mapping[str, float] | None]
    movement: Callable[[str], tuple[str, str] | None] = lambda _: None


@dataclass(frozen=True, slots=True, kw_only=True)
class XoscSource(MaplessSource):
    """A file of which parameters and catalogs are put in, and the map that it names.

    Attributes
    ----------
    graph, map_name, sha256
        The map.
    road_point, lane_t
        x, y and heading at s and t of a road; t of the middle of a lane at s.
    parameters
        Declarations of those parameters that are numbers, by name.
    varied
        Whether a sweep varies them: vehicles whose places come from them then appear there.
    """

    graph: MapGraph
    map_name: str
    sha256: str
    road_point: Callable[[str, float, float], tuple[float, float, float] | None]
    lane_t: Callable[[str, int, float], float | None]
    parameters: Mapping[str, _Element] = field(default_factory=dict)
    varied: bool = False


def read_openscenario(source: XoscSource, *, name: str, ego: EgoDriver = "story") -> Scenario:
    """Scenario of a file.

    Raises
    ------
    InputError
        If a value of the file is none; names element and line.
    ScenarioError
        If what the file says is out of the bounds of scenarios.
    """
    report, root = source.report, source.root
    entities = _read_all_entities(report, root)
    if len(source.graph.walks.x) == 0:
        _make_motorcycles(report, entities.values())
    positions = PositionReader(
        report, source.graph, source.road_point, source.lane_t, _side_of_y(root),
        varied=source.varied,
        on_trajectory=trajectory_place,
    )  # fmt: skip
    story, init, board, found = _begin_story(source, positions, entities, ego)
    actors = init.actors(story.driven)
    report.starts.update(
        (name, (round(float(at.x), 2), round(float(at.y), 2)))
        for name, at in positions.starts.items()
    )
    positions.moving.update(entities)
    positions.begin_story()
    story.read(board)
    simulation = read_stop(report, board, story)
    data = {
        "name": name,
        "description": "" if story.own and _read_title(root) == name else _read_title(root),
        "map": {"name": source.map_name, "sha256": source.sha256,
                "spacing": source.graph.lanes.spacing},
        "roi": _find_region(source.graph, actors),
        "drivers": {"sets": [STEADY_DRIVER] if _has_steady_actor(actors) else []},
        "actors": actors,
        "simulation": simulation,
        "environment": found.environment,
        "demand": {"clock": found.clock or 0.0},
        "rules": [rule for rule in story.rules if rule["actor"] in init.placed],
    }  # fmt: skip
    return validated(Scenario, with_parameters(report, source.parameters, data))


def report_without_map(source: MaplessSource, why: str, *, ego: EgoDriver = "story") -> None:
    """Mark what can be read of a file without its map; each place is refused, for this reason.

    Raises
    ------
    InputError
        If a value of the file is none; names element and line.
    """
    report, root = source.report, source.root
    entities = _read_all_entities(report, root)
    positions = NoMapPositions(report, side=_side_of_y(root), why=why)
    story, _, board, _ = _begin_story(source, positions, entities, ego)
    story.read(board)
    read_stop(report, board, story)
    for tag in ("RoadNetwork", "LogicFile"):
        for element in root.iter(tag):
            report.mark(element, "refused", why)


def _read_all_entities(report: ImportReport, root: _Element) -> dict[str, ReadEntity]:
    report.mark(root, "taken")
    name_entities(report, root)
    for tag in ("FileHeader", "RoadNetwork", "LogicFile"):
        for element in root.iter(tag):
            report.mark(element, "taken")
    return read_entities(report, root)


def _side_of_y(root: _Element) -> float:
    """How ScenarioRunner tells files in CARLA's frame, whose y and headings are those of Unreal."""
    return -1.0 if _read_title(root).startswith("CARLA:") else 1.0


def _begin_story(
    source: MaplessSource,
    positions: PositionReader,
    entities: dict[str, ReadEntity],
    ego: EgoDriver,
) -> tuple[StoryReader, InitReader, _Element, ReadEnvironment]:
    """Readers of the story, which is still to be read, and of ``Init``, which has been."""
    report, root = source.report, source.root
    driven = frozenset(entity.id for entity in entities.values() if entity.ego and ego != "story")
    story = StoryReader(report, entities, driven, own=is_own(root))
    found = read_environment(report, root, source.weather, driven=bool(driven), own=story.own)
    signals = SignalReader(report, root, source.movement)
    signals.programs()
    values = dict(source.values)
    first_values(report, root, values)
    conditions = ConditionReader(
        report, positions, entities, values, story.state, signals, story.changes, found,
        own=story.own,
    )  # fmt: skip
    story.actions = ActionReader(conditions, own=story.own)
    board = report.child(root, "Storyboard")
    if board is None:
        raise report.wrong(root, "there is no Storyboard")
    init = InitReader(report, positions, story, entities)
    init.read(board)
    return story, init, board, found


def _make_motorcycles(report: ImportReport, entities: Iterable[ReadEntity]) -> None:
    """Make motorcycles of pedestrians, for SUMO has none where a map has nothing to walk on."""
    for entity in entities:
        if entity.category is Category.PEDESTRIAN:
            entity.category, entity.sized = Category.MOTORCYCLE, True
            words = "a motorcycle of its size: the map has nothing to walk on"
            report.mark(entity.element, "approximated", words)


def _find_region(graph: MapGraph, actors: list[dict[str, Any]]) -> list[str]:
    """Segments of those parts of the map, which may have no way between them, in which some start.

    A file that odscen wrote may name nodes of another map.
    """
    found = set()
    for actor in actors:
        with suppress(NotFoundError):
            found.add(segment_of_node(graph, str(actor["spawn"])))
    return [str(name) for name in parts_with(graph.segments, found)]


def _has_steady_actor(actors: list[dict[str, Any]]) -> bool:
    return any(actor.get("style") == STEADY for actor in actors)


def _read_title(root: _Element) -> str:
    header = root.find("FileHeader")
    return "" if header is None else header.get("description", "")


# -------------------------------------------------------- A file of OpenSCENARIO with what it names
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
    chosen = source.options.get("ego", "story")
    if chosen not in ("sumo", "story"):
        raise InputError(f"the ego is driven by sumo or story, not by {chosen!r}")
    ego: EgoDriver = "sumo" if chosen == "sumo" else "story"
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
