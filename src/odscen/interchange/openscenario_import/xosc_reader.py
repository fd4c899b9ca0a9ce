"""A file of OpenSCENARIO as a scenario document, and what became of each element."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Final, Literal

from odscen.base.categories import DEFAULT_BODY, Category
from odscen.interchange.openscenario_import.actor_places import ActorPlaces
from odscen.interchange.openscenario_import.entity_selections import name_entities
from odscen.interchange.openscenario_import.global_actions import tell_unread
from odscen.interchange.openscenario_import.import_report import ImportReport, RefusedError
from odscen.interchange.openscenario_import.kept_parameters import with_parameters
from odscen.interchange.openscenario_import.own_files import is_own
from odscen.interchange.openscenario_import.read_actions import ActionReader
from odscen.interchange.openscenario_import.read_appearances import AppearanceReader
from odscen.interchange.openscenario_import.read_conditions import ConditionReader
from odscen.interchange.openscenario_import.read_entities import read_entities
from odscen.interchange.openscenario_import.read_environment import read_environment
from odscen.interchange.openscenario_import.read_positions import MapPoint, PositionReader
from odscen.interchange.openscenario_import.read_signals import SignalReader
from odscen.interchange.openscenario_import.read_storyboard import StoryReader
from odscen.interchange.openscenario_import.read_trajectories import trajectory_place
from odscen.interchange.openscenario_import.value_changes import first_values
from odscen.lanegraph.query import largest_part
from odscen.scenario.document.scenario_document import Scenario
from odscen.scenario.templates.scene_actors import STEADY, STEADY_DRIVER

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping

    from lxml.etree import _Element

    from odscen.interchange.openscenario_import.read_entities import ReadEntity
    from odscen.lanegraph.graphs import MapGraph

EgoDriver = Literal["sumo", "story"]
_USUAL_DURATION: Final = 60.0
"""Seconds of a file that does not end at a time."""
_SAME_PLACE: Final = 0.05
_SAME_SPEED: Final = 1e-4
"""Metres and m/s within which a file says what the properties of an actor do."""


@dataclass(frozen=True, slots=True)
class XoscSource:
    """A file of which parameters and catalogs are put in, and the map that it names.

    Attributes
    ----------
    root, values, report
        Its tree, its parameters, and the marks of its elements so far.
    graph, map_name, sha256
        The map.
    road_point, lane_t
        x, y and heading at s and t of a road; t of the middle of a lane at s.
    parameters
        Declarations of those parameters that are numbers, by name.
    varied
        Whether a sweep varies them: vehicles whose places come from them then appear there.
    movement
        Light and movement of a signal.
    weather
        Parameters of a preset of the weather.
    """

    root: _Element
    values: Mapping[str, str]
    report: ImportReport
    graph: MapGraph
    map_name: str
    sha256: str
    road_point: Callable[[str, float, float], tuple[float, float, float] | None]
    lane_t: Callable[[str, int, float], float | None]
    movement: Callable[[str], tuple[str, str] | None]
    weather: Callable[[str], Mapping[str, float] | None]
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
    report.mark(root, "taken")
    name_entities(report, root)
    for tag in ("FileHeader", "RoadNetwork", "LogicFile"):
        for element in root.iter(tag):
            report.mark(element, "taken")
    entities = read_entities(report, root)
    if len(source.graph.walks.x) == 0:
        _on_wheels(report, entities.values())
    # How ScenarioRunner tells files in CARLA's frame, whose y and headings are those of Unreal.
    side = -1.0 if _title(root).startswith("CARLA:") else 1.0
    positions = PositionReader(
        report, source.graph, source.road_point, source.lane_t, side, varied=source.varied,
        on_trajectory=trajectory_place,
    )  # fmt: skip
    driven = frozenset(one.id for one in entities.values() if one.ego and ego != "story")
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
    init = _Init(source, positions, story, entities)
    init.read(board)
    actors = init.actors(driven)
    report.starts.update(
        (name, (round(float(at.x), 2), round(float(at.y), 2)))
        for name, at in positions.starts.items()
    )
    positions.moving.update(entities)
    positions.begin_story()
    story.read(board)
    data = {
        "name": name,
        "description": "" if story.own and _title(root) == name else _title(root),
        "map": {"name": source.map_name, "sha256": source.sha256,
                "spacing": source.graph.lanes.spacing},
        "roi": list(largest_part(source.graph.segments)),
        "drivers": {"sets": [STEADY_DRIVER] if _steady(actors) else []},
        "actors": actors,
        "simulation": {"duration": _duration(report, board)},
        "environment": found.environment,
        "demand": {"clock": found.clock or 0.0},
        "rules": [rule for rule in story.rules if rule["actor"] in init.placed],
    }  # fmt: skip
    return Scenario.model_validate(with_parameters(report, source.parameters, data))


def _on_wheels(report: ImportReport, entities: Iterable[ReadEntity]) -> None:
    """Make motorcycles of pedestrians, for SUMO has none where a map has nothing to walk on."""
    body, size = DEFAULT_BODY[Category.PEDESTRIAN], DEFAULT_BODY[Category.MOTORCYCLE]
    for one in entities:
        if one.category is Category.PEDESTRIAN:
            one.category, one.length = Category.MOTORCYCLE, size.length
            words = (
                f"a motorcycle, {size.length:.1f} m long and {size.width:.1f} m wide in the place "
                f"of {body.length:.1f} m and {body.width:.1f} m: the map has nothing to walk on"
            )
            report.mark(one.element, "approximated", words)


class _Init:
    """What is at first: places, speeds and routes."""

    def __init__(
        self,
        source: XoscSource,
        positions: PositionReader,
        story: StoryReader,
        entities: dict[str, ReadEntity],
    ) -> None:
        self._source = source
        self._positions = positions
        self._story = story
        self._entities = entities
        self._then: dict[str, list[dict[str, Any]]] = {}
        self._appear = AppearanceReader(source.report, positions)
        self._places = ActorPlaces(source.report, positions)
        self.placed: set[str] = set()

    def read(self, board: _Element) -> None:
        """Read ``Init``."""
        report = self._source.report
        init = report.child(board, "Init")
        group = None if init is None else report.child(init, "Actions")
        if group is None:
            return
        for element in group.iterchildren("GlobalAction"):
            tell_unread(report, element, story=False)
        privates = list(report.children(group, "Private"))
        self._teleports(privates)
        without = [name for name in self._entities if name not in self._positions.starts]
        self._appear.read(board, without)
        for private in privates:
            self._actions(private)

    def _teleports(self, privates: list[_Element]) -> None:
        """Places first; one relative to an entity that has none yet waits for it."""
        report, starts = self._source.report, self._positions.starts
        waiting = [
            (private.get("entityRef", ""), action)
            for private in privates
            for action in private.iterfind("PrivateAction/TeleportAction")
        ]
        later: list[tuple[str, _Element, RefusedError]] = []
        for _ in range(len(waiting)):
            later = []
            for name, action in waiting:
                report.mark(action, "taken")
                try:
                    starts[name] = self._positions.point(report.only(action))
                except RefusedError as error:
                    later.append((name, action, error))
            if len(later) in (0, len(waiting)):
                break
            waiting = [(name, action) for name, action, _ in later]
        for name, action, why in later:
            report.mark(why.element, "refused", why.reason)
            report.mark(action, "refused", f"{name!r} has no place: {why.reason}")

    def _actions(self, private: _Element) -> None:
        report, story = self._source.report, self._story
        entity = self._entities.get(private.get("entityRef", ""))
        if entity is None or story.actions is None:
            report.mark(private, "refused", "the entity is not among the actors")
            return
        for element in report.children(private, "PrivateAction"):
            if element.find("TeleportAction") is not None:
                continue
            gap = element.find("LongitudinalAction/LongitudinalDistanceAction")
            try:
                if gap is not None and gap.get("continuous") != "true":
                    self._set_apart(private.get("entityRef", ""), entity, gap)
                    continue
                self._then.setdefault(entity.id, []).extend(story.actions.actions(element, entity))
            except RefusedError as error:
                report.mark(error.element, "refused", error.reason)

    def _set_apart(self, name: str, entity: ReadEntity, gap: _Element) -> None:
        """Move the start of an entity along its lane, to a gap from another one."""
        report, positions, actions = self._source.report, self._positions, self._story.actions
        other = self._entities.get(gap.get("entityRef", ""))
        if actions is None or other is None or name not in positions.starts:
            raise RefusedError(gap, f"a gap to {gap.get('entityRef')!r}, which has no place")
        for element in (gap, gap.getparent()):
            if element is not None:
                report.mark(element, "taken")
        leads = gap.get("displacement") == "leadingReferencedEntity"
        if gap.get("distance") is not None:
            metres = report.number(gap, "distance")
        else:
            behind = other if leads else entity
            metres = report.number(gap, "timeGap") * actions.speeds.get(behind.id, 0.0)
        if gap.get("freespace") == "true":
            metres += (entity.length + other.length) / 2
        mine = positions.starts[name].moved(entity.ahead)
        its = positions.of_entity(gap).moved(other.ahead)
        if gap.get("freespace") != "true":
            metres += entity.ahead - other.ahead if leads else other.ahead - entity.ahead
        ahead = (mine.x - its.x) * math.cos(its.hdg) + (mine.y - its.y) * math.sin(its.hdg)
        node = positions.node_near(mine)
        there = positions.along(node, (metres if leads else -metres) - ahead)
        lanes = self._source.graph.lanes
        x, y = float(lanes.x[there]), float(lanes.y[there])
        at = MapPoint(x, y, float(lanes.hdg[there])).moved(-entity.ahead)
        positions.starts[name] = at
        words = f"it starts on the node nearest to {metres:.2f} m {'ahead' if leads else 'behind'}"
        report.mark(gap, "approximated", f"{words}, from centre to centre")

    def actors(self, driven: frozenset[str]) -> list[dict[str, Any]]:
        """Actors of all entities that have a place; what they do at first becomes rules."""
        report = self._source.report
        found: list[dict[str, Any]] = []
        for name, entity in self._entities.items():
            start = self._positions.starts.get(name)
            if name in self._appear.deleted:
                report.ignore(entity.element, "it is deleted before the story begins")
                continue
            if start is None and entity.own is None:
                report.mark(entity.element, "refused", "it has no place at first")
                continue
            try:
                if entity.own is not None:
                    made = self._own(entity, entity.own, start)
                elif start is not None:
                    made = self._actor(
                        entity, start, free=entity.id in driven, late=name in self._appear.late
                    )
            except RefusedError as error:
                if entity.obstacle and error.element is entity.element:
                    report.ignore(entity.element, f"{error.reason}, so it blocks no lane")
                else:
                    report.mark(error.element, "refused", error.reason)
                continue
            self._places.leave_room(entity, made, {str(one["spawn"]) for one in found})
            found.append(made)
            self.placed.add(entity.id)
        for name in [n for n, one in self._entities.items() if one.id not in self.placed]:
            del self._entities[name]  # events and conditions that name it are refused
        return found

    def _own(
        self, entity: ReadEntity, fields: dict[str, Any], start: MapPoint | None
    ) -> dict[str, Any]:
        """Actor that odscen wrote; place, speed and goal of the file hold where they differ."""
        made = {"id": entity.id, "category": str(entity.category), **fields}
        nodes, then = self._positions, self._then.get(entity.id, [])
        there = nodes.of_node(made["spawn"])
        if start is not None and there is not None:
            centre = start.moved(entity.ahead)
            where = there.moved(0.0, float(made.get("lateral_offset", 0.0)))
            if centre.away(where) > _SAME_PLACE:
                walks = entity.category is Category.PEDESTRIAN
                found = (
                    self._places.walker(centre) if walks else self._places.vehicle(entity, centre)
                )
                made |= {key: found[key] for key in found if key != "goal"}
        speeds = [one["speed"]["to"] for one in then if "speed" in one]
        if speeds and abs(speeds[-1] - (made.get("initial_speed") or 0.0)) > _SAME_SPEED:
            made["initial_speed"] = speeds[-1]
        goals = [one["goal"]["to"] for one in then if "goal" in one]
        wanted = nodes.of_node(made.get("goal") or "")
        there = nodes.of_node(goals[-1]) if goals else None
        if wanted and wanted.node is not None and there and there.away(wanted) > _SAME_PLACE:
            made["goal"] = goals[-1]
        return made

    def _actor(
        self, entity: ReadEntity, start: MapPoint, *, free: bool, late: bool
    ) -> dict[str, Any]:
        centre = start.moved(entity.ahead)
        then = self._then.get(entity.id, [])
        speeds = [one["speed"]["to"] for one in then if "speed" in one]
        speed = speeds[-1] if speeds else 0.0
        made: dict[str, Any] = {"id": entity.id, "category": str(entity.category)}
        if entity.category is Category.PEDESTRIAN:
            made |= self._places.walker(centre)
            then = then or [{"stop": {}}]
            if not late:
                then = [{"appear": {"at": [centre.x, centre.y, centre.hdg]}}, *then]
        else:
            left = self._places.aside(entity, centre)
            made |= self._places.vehicle(entity, centre) | {"style": STEADY, "initial_speed": speed}
            goals = [one["goal"]["to"] for one in then if "goal" in one]
            made |= {"goal": goals[-1]} if goals else {}
            then = [one for one in then if "goal" not in one]
            if not speeds:
                then.append({"speed": {"to": 0.0, "shape": "step"}})
            then = self._places.at_first(centre, left, then, made)
        if entity.ego:
            made["ego"] = True
        if speed > 0:
            made["speed"] = speed
        if late:
            self._story.later[entity.id] = then
        elif not free:
            self._story.at_once(entity.id, then)
        return made


def _steady(actors: list[dict[str, Any]]) -> bool:
    return any(one.get("style") == STEADY for one in actors)


def _duration(report: ImportReport, board: _Element) -> float:
    """Seconds after which the storyboard ends, as far as it says so."""
    stop = report.child(board, "StopTrigger")
    found = []
    for condition in () if stop is None else stop.iter("SimulationTimeCondition"):
        above: _Element | None = condition
        while above is not None and above is not board:
            report.mark(above, "taken")
            above = above.getparent()
        found.append(report.number(condition, "value"))
    for trigger in () if stop is None else stop.iter("ConditionGroup"):
        others = len(trigger) - len(trigger.findall(".//SimulationTimeCondition"))
        if found and others:
            report.mark(trigger, "approximated", "the run ends by time alone")
    if not found and stop is not None:
        report.mark(stop, "approximated", f"the run ends after {_USUAL_DURATION:g} s")
    return min((one for one in found if one > 0), default=_USUAL_DURATION)


def _title(root: _Element) -> str:
    header = root.find("FileHeader")
    return "" if header is None else header.get("description", "")
