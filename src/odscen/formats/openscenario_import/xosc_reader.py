"""A file of OpenSCENARIO as a scenario document, and what became of each element."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Literal

from odscen.base.categories import DEFAULT_BODY, Category
from odscen.formats.openscenario_import.places.read_positions import NoMapPositions, PositionReader
from odscen.formats.openscenario_import.places.read_trajectories import trajectory_place
from odscen.formats.openscenario_import.source.entity_selections import name_entities
from odscen.formats.openscenario_import.source.kept_parameters import with_parameters
from odscen.formats.openscenario_import.source.own_files import is_own
from odscen.formats.openscenario_import.start.read_init import InitReader
from odscen.formats.openscenario_import.story.read_actions import ActionReader
from odscen.formats.openscenario_import.story.read_conditions import ConditionReader
from odscen.formats.openscenario_import.story.read_signals import SignalReader
from odscen.formats.openscenario_import.story.read_stop import read_stop
from odscen.formats.openscenario_import.story.read_storyboard import StoryReader
from odscen.formats.openscenario_import.story.value_changes import first_values
from odscen.formats.openscenario_import.world.read_entities import read_entities
from odscen.formats.openscenario_import.world.read_environment import read_environment
from odscen.lanegraph.query import largest_part
from odscen.scenario.document.problems import validated
from odscen.scenario.document.scenario_document import Scenario
from odscen.scenario.templates.scene_template import STEADY, STEADY_DRIVER

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping

    from lxml.etree import _Element

    from odscen.formats.openscenario_import.import_report import ImportReport
    from odscen.formats.openscenario_import.world.read_entities import ReadEntity
    from odscen.formats.openscenario_import.world.read_environment import ReadEnvironment
    from odscen.lanegraph.graphs import MapGraph

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
        _on_wheels(report, entities.values())
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
    duration = read_stop(report, board, story)
    data = {
        "name": name,
        "description": "" if story.own and _read_title(root) == name else _read_title(root),
        "map": {"name": source.map_name, "sha256": source.sha256,
                "spacing": source.graph.lanes.spacing},
        "roi": list(largest_part(source.graph.segments)),
        "drivers": {"sets": [STEADY_DRIVER] if _any_steady(actors) else []},
        "actors": actors,
        "simulation": {"duration": duration},
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


def _on_wheels(report: ImportReport, entities: Iterable[ReadEntity]) -> None:
    """Make motorcycles of pedestrians, for SUMO has none where a map has nothing to walk on."""
    body, size = DEFAULT_BODY[Category.PEDESTRIAN], DEFAULT_BODY[Category.MOTORCYCLE]
    for entity in entities:
        if entity.category is Category.PEDESTRIAN:
            entity.category, entity.length = Category.MOTORCYCLE, size.length
            words = (
                f"a motorcycle, {size.length:.1f} m long and {size.width:.1f} m wide in the place "
                f"of {body.length:.1f} m and {body.width:.1f} m: the map has nothing to walk on"
            )
            report.mark(entity.element, "approximated", words)


def _any_steady(actors: list[dict[str, Any]]) -> bool:
    return any(actor.get("style") == STEADY for actor in actors)


def _read_title(root: _Element) -> str:
    header = root.find("FileHeader")
    return "" if header is None else header.get("description", "")
