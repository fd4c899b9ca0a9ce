"""What is at first: places, speeds and routes of entities, as actors and their first rules."""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Final

from odscen.base.categories import Category
from odscen.base.errors import ScenarioError
from odscen.formats.openscenario_import.import_report import RefusedError
from odscen.formats.openscenario_import.places.map_points import MapPoint
from odscen.formats.openscenario_import.places.read_trajectories import read_trajectory
from odscen.formats.openscenario_import.story.global_actions import tell_unread
from odscen.formats.openscenario_import.story.read_actions import FOLLOWING
from odscen.formats.openscenario_import.story.read_motions import put_there
from odscen.formats.openscenario_import.story.read_storyboard import refuse_beyond_bounds
from odscen.formats.openscenario_import.traced_numbers import TracedNumber
from odscen.lanegraph.query import node_id, node_index, walk_node_id
from odscen.lanegraph.shortest_paths import Router
from odscen.scenario.document.problems import validated
from odscen.scenario.document.scenario_document import Actor
from odscen.scenario.templates.scene_template import STEADY

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator

    from lxml.etree import _Element

    from odscen.base.categories import Body
    from odscen.formats.openscenario_import.import_report import ImportReport
    from odscen.formats.openscenario_import.places.read_positions import PositionReader
    from odscen.formats.openscenario_import.story.read_storyboard import StoryReader
    from odscen.formats.openscenario_import.world.read_entities import ReadEntity


# -------------------------------------------------------- entities that no teleport places at first
@dataclass(slots=True)
class AppearanceReader:
    """Finds places for entities that have none after the teleports of ``Init``.

    Attributes
    ----------
    late
        Names of entities that appear in the story only.
    departing
        Names of those of them that only depart later, in a file that odscen wrote.
    deleted
        Names of entities that are deleted before the story begins.
    """

    report: ImportReport
    positions: PositionReader
    late: set[str] = field(default_factory=set)
    departing: set[str] = field(default_factory=set)
    deleted: set[str] = field(default_factory=set)

    def read(self, board: _Element, names: Iterable[str]) -> None:
        """Fill in the starts of the entities of these names, as far as the file has some."""
        for about in board.iterfind("Init/Actions/GlobalAction/EntityAction"):
            self._take_first_position(about)
        for name in names:
            if name in self.positions.starts:
                continue
            for place in self._possible_places(board, name):
                self._put_entity(name, place)
                break

    def _take_first_position(self, about: _Element) -> None:
        name = about.get("entityRef", "")
        parent = about.getparent()
        for element in (about, *(() if parent is None else (parent,)), *about):
            self.report.mark(element, "taken")
        if about.find("DeleteEntityAction") is not None:
            self.deleted.add(name)
            return
        position = about.find("AddEntityAction/Position")
        if position is not None:
            self.report.mark(position, "taken")
            self._put_entity(name, lambda: self.positions.point(position))

    def _possible_places(self, board: _Element, name: str) -> Iterator[Callable[[], MapPoint]]:
        """Where an entity begins: on a trajectory at first, or where the story puts it first."""
        for private in board.iterfind("Init/Actions/Private"):
            for kind in private.iter("FollowTrajectoryAction"):
                if private.get("entityRef") == name:
                    yield lambda kind=kind: self._begin_of_trajectory(kind)  # type: ignore[misc]
        for kind in board.iterfind("Story//Position"):
            if self._entity_put_at(kind) == name:
                self.late.add(name)
                group = next(kind.iterancestors("ManeuverGroup"), None)
                if group is not None and group.get("name") == f"{name} departs":
                    self.departing.add(name)
                yield lambda kind=kind: self.positions.point(kind)  # type: ignore[misc]

    def _begin_of_trajectory(self, kind: _Element) -> MapPoint:
        self.report.mark(kind, "approximated", "the actor starts on it")
        first, second, *_ = (
            point.at for point in read_trajectory(self.report, self.positions, kind)
        )
        return first._replace(hdg=math.atan2(second.y - first.y, second.x - first.x))

    @staticmethod
    def _entity_put_at(position: _Element) -> str | None:
        """Name of the entity that an action of the story puts at a position."""
        action = position.getparent()
        if action is None:
            return None
        if action.tag == "AddEntityAction":
            about = action.getparent()
            return None if about is None else about.get("entityRef")
        group = next(position.iterancestors("ManeuverGroup"), None)
        if action.tag != "TeleportAction" or group is None:
            return None
        actors = [element.get("entityRef") for element in group.iterfind("Actors/EntityRef")]
        return actors[0] if len(actors) == 1 else None

    def _put_entity(self, name: str, place: Callable[[], MapPoint]) -> None:
        try:
            self.positions.starts[name] = place()
        except RefusedError as error:
            self.late.discard(name)
            self.report.mark(error.element, "refused", error.reason)


# ----------------------------------------------------------------------------- where actors start
_WALKS, _WALK_STEP = 500, 5
"""Metres for which a walker that has only a speed walks on, and of its line at most in a step."""
_BESIDE: Final = 10.0
"""Metres that an actor can be beside its lane."""
_FAR: Final = 100_000.0
"""Metres after which a way straight on counts as long enough."""
_MOST_VIA: Final = 49
"""Places that a route leads through at most."""


Made = dict[str, Any]
_ALONG: Final = math.cos(math.radians(5.0))
"""Of the angle to its lane at which a vehicle starts along it."""


class ActorPlaces:
    """Finds them, and marks entities that start elsewhere than the file says."""

    def __init__(self, report: ImportReport, positions: PositionReader) -> None:
        self._report = report
        self._positions = positions
        self._bodies: list[tuple[MapPoint, Body]] = []
        self.forks = False
        """Whether the way straight on of the last vehicle has forks."""

    def leave_room(self, entity: ReadEntity, made: dict[str, Any], taken: set[str]) -> None:
        """Let an actor start behind one whose node or ground it would have."""
        graph, steps = self._positions.graph, 0
        there = self._positions.of_node(made["spawn"])
        if entity.category is Category.PEDESTRIAN or there is None:
            return
        left, node = float(made.get("lateral_offset", 0.0)), there.node
        while node is not None and (
            str(node_id(graph, node)) in taken or self._overlaps_earlier(entity, node, left)
        ):
            steps += 1
            back = self._positions.along(node, -math.ceil(entity.length + 1.0))
            node = None if back == node else back
        if node is None:
            return
        self._bodies.append((self._centre_at(node, left), entity.body))
        if steps == 0:
            return
        made["spawn"] = str(node_id(graph, node))
        metres = steps * math.ceil(entity.length + 1.0)
        words = f"about {metres} m behind, as another one starts there"
        self._report.mark(entity.element, "approximated", words)

    def _centre_at(self, node: int, left: float) -> MapPoint:
        lanes = self._positions.graph.lanes
        at = MapPoint(float(lanes.x[node]), float(lanes.y[node]), float(lanes.hdg[node]))
        return at.moved(0.0, left)

    def _overlaps_earlier(self, entity: ReadEntity, node: int, left: float) -> bool:
        """Whether the body of an actor at a node would have ground of one that starts before."""
        own, size = self._centre_at(node, left), entity.body
        for other, body in self._bodies:
            dx, dy = own.x - other.x, own.y - other.y
            along = abs(dx * math.cos(other.hdg) + dy * math.sin(other.hdg))
            across = abs(dy * math.cos(other.hdg) - dx * math.sin(other.hdg))
            if along < (size.length + body.length) / 2 and across < (size.width + body.width) / 2:
                return True
        return False

    def reached(self, entity: ReadEntity, made: Made, goal: str) -> str:
        """The goal of the file, or that straight on if it cannot be reached from where it starts.

        A vehicle that stands across its lane starts along it.
        """
        spawn, there = (self._positions.of_node(node) for node in (made["spawn"], goal))
        if spawn is None or there is None or spawn.node is None or there.node is None:
            return goal
        if bool(Router(self._positions.graph).reachable(spawn.node)[there.node]):
            return goal
        words = "straight on: the goal of the file cannot be reached from its lane"
        self._report.mark(entity.element, "approximated", words)
        return str(made["goal"])

    def walker(self, centre: MapPoint) -> dict[str, Any]:
        """Node of the pedestrian graph nearest to a point."""
        walks = self._positions.graph.walks
        node = int(((walks.x - centre.x) ** 2 + (walks.y - centre.y) ** 2).argmin())
        return {"spawn": str(walk_node_id(self._positions.graph, node))}

    def walk_on(self, entity: ReadEntity, centre: MapPoint) -> Made:
        """Path of a walker that has only a speed: along the lane that it is on, or straight on."""
        positions, at = self._positions, MapPoint(float(centre.x), float(centre.y), centre.hdg)
        node = positions.node_near(at)
        left = float(positions.left_of(node, at))
        lanes = positions.graph.lanes
        along = math.cos(at.hdg - float(lanes.hdg[node])) > math.cos(math.pi / 4.0)
        if not along or abs(left) > float(lanes.width[node]) / 2.0:
            self._report.mark(entity.element, "approximated", "it walks straight on")
            points = [at.moved(_WALKS)]
        else:
            self._report.mark(entity.element, "approximated", "it walks on along its lane")
            begin = float(positions.ahead_of(node, at))
            steps = range(_WALK_STEP, _WALKS + 1, _WALK_STEP)
            points = [positions.point_along(node, begin + metres, left) for metres in steps]
            bends = [a.hdg != b.hdg for a, b in itertools.pairwise(points)]
            points = [*itertools.compress(points, bends), points[-1]]
        return {"path": {"points": [[round(point.x, 4), round(point.y, 4)] for point in points]}}

    def aside(self, entity: ReadEntity, centre: MapPoint, *, led: bool) -> float:
        """Metres to the left of the nearest lane that leads its way, 0 on a lane.

        ``led`` says whether it follows a trajectory from there, which needs no lane.

        Raises
        ------
        RefusedError
            If it is farther from all lanes than an actor can be beside its own.
        """
        positions, lanes = self._positions, self._positions.graph.lanes
        left = float(positions.beside_lane(centre))
        if abs(left) <= float(lanes.width[positions.node_near(centre)]) / 2:
            return 0.0
        if entity.obstacle or (abs(left) > _BESIDE and not led):
            raise RefusedError(entity.element, f"it starts {abs(left):.1f} m beside any lane")
        words = f"on the lane {abs(left):.1f} m beside at first, and there 0.1 s later"
        self._report.mark(entity.element, "approximated", words)
        return left

    def at_first(self, centre: MapPoint, left: float, then: list[Made], made: Made) -> list[Made]:
        """What a vehicle does from the start on, with what puts it where the file has it.

        SUMO turns vehicles along their lanes, and puts them on one; ``left`` is how far from that
        the vehicle is, metres.
        """
        lanes = self._positions.graph.lanes
        hdg, speed = float(lanes.hdg[self._positions.node_near(centre)]), made["initial_speed"]
        then = sorted(then, key=lambda action: "path" in action)  # as fast as the speed is by then
        far = abs(made["lateral_offset"]) > _BESIDE  # on a lane as wide as a test ground
        across = bool(left) or far or math.cos(centre.hdg - hdg) < _ALONG
        traced = isinstance(centre.x, TracedNumber) or isinstance(centre.y, TracedNumber)
        if "path" in then[-1] and across and (left or not traced):
            made["lateral_offset"] = 0.0
            back = then[-1]["path"].get("backwards", False)
            then = [put_there(centre, -speed if back else speed), *then]
        elif left:
            made["lateral_offset"] = 0.0
            then = [{"offset": {"to": round(left, 3), "over": 0.1}}, *then]
        if traced:
            # On its lane: its offset counts from there, and not from the lane that it is to be on.
            x, y = centre.x + left * math.sin(hdg), centre.y - left * math.cos(hdg)
            then = [{"appear": {"at": [x, y, hdg], "speed": speed}}, *then]
        return then

    def is_near_lane(self, centre: MapPoint) -> bool:
        """Whether a vehicle can start on the nearest lane, which leads on, and be beside it."""
        near = abs(float(self._positions.beside_lane(centre))) <= _BESIDE
        return near and self._leads_on(self._positions.node_near(centre))

    def _leads_on(self, node: int) -> bool:
        return self._positions.along(node, _FAR) != node

    def vehicle(self, entity: ReadEntity, centre: MapPoint, *, led: bool = False) -> dict[str, Any]:
        """Node nearest to the centre of the body, and the offsets from it."""
        graph, lanes = self._positions.graph, self._positions.graph.lanes
        node = self._node_with_way(centre)
        dx, dy = centre.x - float(lanes.x[node]), centre.y - float(lanes.y[node])
        hdg = float(lanes.hdg[node])
        along = dx * math.cos(hdg) + dy * math.sin(hdg)
        left = dy * math.cos(hdg) - dx * math.sin(hdg)
        ahead = 0.0 if isinstance(along, TracedNumber) else round(along, 4)
        if abs(ahead) > _BESIDE:  # behind the beginning of all lanes, or beyond their end
            words = f"{abs(along):.2f} m along its lane from there, where that begins or ends"
            self._report.mark(entity.element, "approximated", words)
            ahead = 0.0
        if abs(left) > _BESIDE:
            words = f"on the lane {abs(left):.1f} m beside at first, and there 0.1 s later"
            self._report.mark(entity.element, "approximated", words)
        if math.cos(centre.hdg - hdg) < 0.0 and not led:
            words = "it drives the way of its lane: it heads against it, and no other one is near"
            self._report.mark(entity.element, "approximated", words)
        return {
            "spawn": str(node_id(graph, node)),
            **self._way_straight_on(node),
            "lateral_offset": round(left, 3),
            **({"longitudinal_offset": ahead} if ahead else {}),
        }

    def _node_with_way(self, centre: MapPoint) -> int:
        """Lane node nearest to a point, or at the end of a lane the one before: a way leads on."""
        positions, length = self._positions, self._positions.graph.lanes.length
        node = positions.node_near(centre)
        if self._leads_on(node):
            return node
        return positions.along(node, -float(length.max(initial=1.0)))

    def _way_straight_on(self, node: int) -> Made:
        """Goal of who has none, straight on; through the lanes there if no shorter way does."""
        graph = self._positions.graph
        goal, forks = self._positions.straight_on(node, _FAR)
        self.forks = bool(forks)
        if len(forks) > _MOST_VIA:
            goal, forks = forks[_MOST_VIA], forks[:_MOST_VIA]
        found: Made = {"goal": str(node_id(graph, goal))}
        if forks:
            shortest = set(graph.lanes.lane[Router(graph).path(node, goal)].tolist())
            if not shortest.issuperset(graph.lanes.lane[forks].tolist()):
                found["via"] = [str(node_id(graph, fork)) for fork in forks]
        return found

    def through(self, made: Made, route: list[str]) -> Made:
        """Places that the route of a file leads through, as far as those ahead can be reached.

        A route may begin behind where the actor starts, on its road.
        """
        graph, lanes = self._positions.graph, self._positions.graph.lanes
        rows = [node_index(graph, name) for name in (made["spawn"], *route, made["goal"])]
        roads = [lanes.lanes.keys[int(lanes.lane[row])].road for row in rows]
        while len(rows) > 2 and roads[1] == roads[0]:
            del rows[1], roads[1]
        router = Router(graph)
        if len(rows) - 2 > _MOST_VIA or not all(
            bool(router.reachable(one)[other]) for one, other in itertools.pairwise(rows)
        ):
            return {}
        return {"via": [str(node_id(graph, row)) for row in rows[1:-1]]} if len(rows) > 2 else {}


# ----------------------------------------------------------------------------- what is at first
_STANDS: Final = 1e6
"""Seconds for which who stands far beside all lanes is held there, unless the story moves it."""
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
                keeps = gap is not None and gap.get("continuous") == "true"
                if gap is not None and not (keeps and gap.find("DynamicConstraints") is not None):
                    self._set_apart(private.get("entityRef", ""), entity, gap)
                if gap is not None and not keeps:
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
        metres_on = positions.ahead_of(node, mine) + (metres if leads else -metres) - ahead
        at = positions.point_along(node, metres_on, positions.left_of(node, mine))
        positions.starts[name] = at.moved(-entity.ahead)
        words = f"it starts {metres:.2f} m {'ahead' if leads else 'behind'}"
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
            if entity.own is None and made.get("driver") != "story":
                # ... whom SUMO does not let start in another; ours may depart later from there
                self._places.leave_room(entity, made, {str(actor["spawn"]) for actor in found})
            found.append(made)
            self.placed.add(entity.id)
        for name in [n for n, entity in self._entities.items() if entity.id not in self.placed]:
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
            where = there.moved(
                float(made.get("longitudinal_offset", 0.0)),
                float(made.get("lateral_offset", 0.0)),
            )
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
        each = [follower for action in then for follower in action.get(FOLLOWING, [action])]
        changes = [action["speed"] for action in each if "speed" in action]
        speed = changes[-1]["to"] if changes else 0.0
        kept = [action["keep_gap"]["to"] for action in then if "keep_gap" in action]
        if kept and not changes and self._story.actions is not None:
            speed = self._story.actions.speeds.get(kept[-1], 0.0)  # ... of whom it keeps a gap to
        # What takes time begins from a standstill, which entities are at before the first action.
        steps = itertools.takewhile(lambda change: change.get("shape") == "step", changes)
        at_once = [change["to"] for change in steps]
        profile = len(each) > len(then)
        first = speed if len(at_once) == len(changes) else 0.0
        if profile and at_once:
            first = at_once[-1]
        led = [action["path"] for action in then if "path" in action]
        if self._story.actions is not None and entity.id in self._story.actions.reversing:
            for path in led:
                path["backwards"] = True
        made: dict[str, Any] = {"id": entity.id, "category": str(entity.category)}
        if entity.sized:
            made["size"] = entity.body._asdict()
        if entity.category is Category.PEDESTRIAN:
            made |= self._places.walker(centre)
            stands = any("stop" in action for action in then)
            if then and not changes and not stands:  # as entities do until they get a speed
                then = [{"speed": {"to": 0.0, "shape": "step"}}, *then]
            then = then or [{"stop": {}}]
            if speed > 0 and not any({"path", "arrive"} & action.keys() for action in then):
                then = [*then, self._places.walk_on(entity, centre)]
            if not late:
                then = [{"appear": {"at": [centre.x, centre.y, centre.hdg]}}, *then]
        else:
            stands = not (speed or led or entity.obstacle or self._places.is_near_lane(centre))
            left = self._places.aside(entity, centre, led=stands or bool(led))
            made |= self._places.vehicle(entity, centre, led=stands or bool(led))
            made |= {"style": STEADY, "initial_speed": first}
            goals = [action["goal"]["to"] for action in then if "goal" in action]
            if not goals and self._places.forks:
                words = "straight on at junctions and forks, as the file gives no route at first"
                self._report.mark(entity.element, "approximated", words)
            if goals and (goal := self._places.reached(entity, made, goals[-1])) != made["goal"]:
                made["goal"] = goal
                made.pop("via", None)
                actions = self._story.actions
                route = actions.routes.get(entity.id, []) if actions is not None else []
                made |= self._places.through(made, route)
            drivers = [action["drive"]["by"] for action in then if "drive" in action]
            driver = drivers[-1] if drivers else "story"
            made |= {"driver": driver} if driver == "story" and not free else {}
            then = [action for action in then if "goal" not in action and "drive" not in action]
            if not changes and not kept:
                then.append({"speed": {"to": 0.0, "shape": "step"}})
            if stands:
                made["lateral_offset"] = 0.0
                then = [put_there(centre, 0.0, seconds=_STANDS)]
            else:
                then = self._places.at_first(centre, left, then, made)
        if entity.ego:
            made["ego"] = True
        if speed > 0:
            made["speed"] = speed
        refuse_beyond_bounds(Actor, made, entity.element)
        if late:
            self._story.later[entity.id] = then
        elif not free:
            self._story.at_once(entity.id, then, entity.element)
        return made
