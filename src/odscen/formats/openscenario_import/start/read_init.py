"""What is at first: places, speeds and routes of entities, as actors and their first rules."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, Final

from odscen.base.categories import Category
from odscen.base.errors import ScenarioError
from odscen.formats.openscenario_import.import_report import RefusedError
from odscen.formats.openscenario_import.places.map_points import MapPoint
from odscen.formats.openscenario_import.start.actor_places import ActorPlaces
from odscen.formats.openscenario_import.start.read_appearances import AppearanceReader
from odscen.formats.openscenario_import.story.global_actions import tell_unread
from odscen.scenario.document.problems import validated
from odscen.scenario.document.scenario_document import Actor
from odscen.scenario.templates.scene_template import STEADY

if TYPE_CHECKING:
    from lxml.etree import _Element

    from odscen.formats.openscenario_import.import_report import ImportReport
    from odscen.formats.openscenario_import.places.read_positions import PositionReader
    from odscen.formats.openscenario_import.story.read_storyboard import StoryReader
    from odscen.formats.openscenario_import.world.read_entities import ReadEntity

_SAME_PLACE: Final = 0.05
_SAME_SPEED: Final = 1e-4
"""Metres and m/s within which a file says what the properties of an actor do."""


def _is_formula(value: object) -> bool:
    return isinstance(value, str) and "$" in value


class InitReader:
    """What is at first: places, speeds and routes."""

    def __init__(
        self,
        report: ImportReport,
        positions: PositionReader,
        story: StoryReader,
        entities: dict[str, ReadEntity],
    ) -> None:
        self._report = report
        self._positions = positions
        self._story = story
        self._entities = entities
        self._then: dict[str, list[dict[str, Any]]] = {}
        self._appear = AppearanceReader(report, positions)
        self._places = ActorPlaces(report, positions)
        self.placed: set[str] = set()

    def read(self, board: _Element) -> None:
        """Read ``Init``."""
        report = self._report
        init = report.child(board, "Init")
        group = None if init is None else report.child(init, "Actions")
        if group is None:
            return
        for element in group.iterchildren("GlobalAction"):
            tell_unread(report, element, story=False)
        privates = list(report.children(group, "Private"))
        self._read_teleports(privates)
        without = [name for name in self._entities if name not in self._positions.starts]
        self._appear.read(board, without)
        for private in privates:
            self._read_actions(private)

    def _read_teleports(self, privates: list[_Element]) -> None:
        """Places first; one relative to an entity that has none yet waits for it."""
        report, starts = self._report, self._positions.starts
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

    def _read_actions(self, private: _Element) -> None:
        report, story = self._report, self._story
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
        report, positions, actions = self._report, self._positions, self._story.actions
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
        lanes = self._positions.graph.lanes
        x, y = float(lanes.x[there]), float(lanes.y[there])
        at = MapPoint(x, y, float(lanes.hdg[there])).moved(-entity.ahead)
        positions.starts[name] = at
        words = f"it starts on the node nearest to {metres:.2f} m {'ahead' if leads else 'behind'}"
        report.mark(gap, "approximated", f"{words}, from centre to centre")

    def actors(self, driven: frozenset[str]) -> list[dict[str, Any]]:
        """Actors of all entities that have a place; what they do at first becomes rules."""
        report = self._report
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
                    made = self._read_own_actor(entity, entity.own, start)
                elif start is not None:
                    made = self._make_actor(
                        entity, start, free=entity.id in driven, late=name in self._appear.late
                    )
            except RefusedError as error:
                if entity.obstacle and error.element is entity.element:
                    report.ignore(entity.element, f"{error.reason}, so it blocks no lane")
                else:
                    report.mark(error.element, "refused", error.reason)
                continue
            if entity.own is None:  # others of ours may depart later from one place
                self._places.leave_room(entity, made, {str(actor["spawn"]) for actor in found})
            found.append(made)
            self.placed.add(entity.id)
        for name in [n for n, one in self._entities.items() if one.id not in self.placed]:
            del self._entities[name]  # events and conditions that name it are refused
        return found

    def _read_own_actor(
        self, entity: ReadEntity, fields: dict[str, Any], start: MapPoint | None
    ) -> dict[str, Any]:
        """Actor that odscen wrote; place, speed and goal of the file hold where they differ."""
        made = {"id": entity.id, "category": str(entity.category), **fields}
        # Formulas become numbers when the whole document is read.
        plain = {name: value for name, value in made.items() if not _is_formula(value)}
        try:
            validated(Actor, plain)
        except ScenarioError as error:
            raise RefusedError(entity.element, f"its properties: {error.problem}") from error
        nodes, then = self._positions, self._then.get(entity.id, [])
        there = nodes.of_node(made["spawn"])
        by_rule = entity.id in self._appear.late - self._appear.departing
        if start is not None and there is not None and not by_rule:
            centre = start.moved(entity.ahead)
            where = there.moved(0.0, float(made.get("lateral_offset", 0.0)))
            if centre.away(where) > _SAME_PLACE:
                walks = entity.category is Category.PEDESTRIAN
                found = (
                    self._places.walker(centre) if walks else self._places.vehicle(entity, centre)
                )
                made |= {key: found[key] for key in found if key != "goal"}
        speeds = [action["speed"]["to"] for action in then if "speed" in action]
        if speeds and abs(speeds[-1] - (made.get("initial_speed") or 0.0)) > _SAME_SPEED:
            made["initial_speed"] = speeds[-1]
        goals = [action["goal"]["to"] for action in then if "goal" in action]
        wanted = nodes.of_node(made.get("goal") or "")
        there = nodes.of_node(goals[-1]) if goals else None
        if wanted and wanted.node is not None and there and there.away(wanted) > _SAME_PLACE:
            made["goal"] = goals[-1]
        return made

    def _make_actor(
        self, entity: ReadEntity, start: MapPoint, *, free: bool, late: bool
    ) -> dict[str, Any]:
        centre = start.moved(entity.ahead)
        then = self._then.get(entity.id, [])
        changes = [action["speed"] for action in then if "speed" in action]
        speed = changes[-1]["to"] if changes else 0.0
        # What takes time begins from a standstill, which entities are at before the first action.
        first = speed if all(change.get("shape") == "step" for change in changes) else 0.0
        made: dict[str, Any] = {"id": entity.id, "category": str(entity.category)}
        if entity.category is Category.PEDESTRIAN:
            made |= self._places.walker(centre)
            then = then or [{"stop": {}}]
            if not late:
                then = [{"appear": {"at": [centre.x, centre.y, centre.hdg]}}, *then]
        else:
            left = self._places.aside(entity, centre)
            made |= self._places.vehicle(entity, centre) | {"style": STEADY, "initial_speed": first}
            goals = [action["goal"]["to"] for action in then if "goal" in action]
            made |= {"goal": self._places.reached(entity, made, goals[-1])} if goals else {}
            then = [action for action in then if "goal" not in action]
            if not changes:
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
