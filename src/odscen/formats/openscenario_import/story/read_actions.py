"""Private actions as actions of rules."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from odscen.base.categories import Category
from odscen.formats.openscenario_import.import_report import RefusedError
from odscen.formats.openscenario_import.story.read_arrivals import arriving
from odscen.formats.openscenario_import.story.read_motions import (
    JUMP,
    followed,
    lines_up,
    stays,
    teleported,
)
from odscen.lanegraph.query import node_id
from odscen.scenario.document.rules_document import USUAL_MOVE
from odscen.scenario.story.motion_laws import SHARPEST, STEEPEST

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from lxml.etree import _Element

    from odscen.formats.openscenario_import.import_report import ImportReport
    from odscen.formats.openscenario_import.places.map_points import MapPoint
    from odscen.formats.openscenario_import.story.read_conditions import ConditionReader
    from odscen.formats.openscenario_import.world.read_entities import ReadEntity


# ------------------------ lanes in which actors start, as lane changes of the story count from them
def start_of(conditions: ConditionReader, actor: str) -> MapPoint | None:
    """Where an actor starts, as the file has it."""
    entities, starts = conditions.entities, conditions.positions.starts
    return next((starts.get(name) for name, entity in entities.items() if entity.id == actor), None)


def start_lane(conditions: ConditionReader, element: _Element, actor: str) -> tuple[str, int, int]:
    """Road and lane id where an actor starts, and 1 if ids grow to its left, -1 otherwise.

    Who starts in an opposite lane looks along its own ones.

    Raises
    ------
    RefusedError
        If it has no place.
    """
    positions, start = conditions.positions, start_of(conditions, actor)
    if start is None:
        raise RefusedError(element, f"a lane that counts from {actor!r}, which has no place")
    lanes = positions.graph.lanes
    near = positions.node_near(start)
    row, own = (int(lanes.lane[near if node is None else node]) for node in (start.node, near))
    key = lanes.lanes.keys[row]
    return key.road, key.lane, 1 if bool(lanes.lanes.forward[own]) else -1


def lane_on_the_way(
    conditions: ConditionReader, actor: str, lane: int
) -> tuple[str, int, int] | None:
    """Road and lane id on the way straight on from where an actor starts, and the side as above.

    Of the first road on which a lane of that id leads the same way; ``None`` if none has one, or
    the one on which it starts.
    """
    positions, lanes = conditions.positions, conditions.positions.graph.lanes
    start = start_of(conditions, actor)
    if start is None:
        return None
    ways = {
        (key.road, key.lane): bool(lanes.lanes.forward[row])
        for row, key in enumerate(lanes.lanes.keys)
    }
    begin = positions.node_near(start)
    for node in positions.nodes_on(begin, _AHEAD):
        row = int(lanes.lane[node])
        key, forward = lanes.lanes.keys[row], bool(lanes.lanes.forward[row])
        if ways.get((key.road, lane)) == forward:
            if key.road == lanes.lanes.keys[int(lanes.lane[begin])].road:
                return None
            return key.road, key.lane, 1 if forward else -1
    return None


def to_opposite(
    conditions: ConditionReader, actor: str, road: str, own: int, aim: int
) -> float | None:
    """Metres between the middles of an actor's lane and of a lane beside it that is opposite.

    ``None`` if that is no lane, or leads the actor's own way.
    """
    positions, lanes = conditions.positions, conditions.positions.graph.lanes
    start = start_of(conditions, actor)
    if start is None:
        return None
    near = positions.node_near(start)
    ahead = bool(lanes.lanes.forward[int(lanes.lane[near])])
    widths: list[float] = []
    for lane, forward in ((own, ahead), (aim, not ahead)):
        rows = [
            row
            for row, key in enumerate(lanes.lanes.keys)
            if (key.road, key.lane) == (road, lane) and bool(lanes.lanes.forward[row]) == forward
        ]
        nodes = np.flatnonzero(np.isin(lanes.lane, rows))
        if not nodes.size:
            return None
        away = np.hypot(lanes.x[nodes] - lanes.x[near], lanes.y[nodes] - lanes.y[near])
        widths.append(float(lanes.width[nodes[int(np.argmin(away))]]))
    return round(sum(widths) / 2.0, 3)


# -------------------------------------------------------------- private actions as actions of rules
_AHEAD: Final = 2000.0
"""Metres straight on for which a lane of an id is looked for."""
Made = dict[str, Any]
_SHAPES: Final = {"linear": "linear", "sinusoidal": "cosine", "cubic": "cubic"}
_MEASURES: Final = {"time": "over", "rate": "rate", "distance": "within"}
FOLLOWING: Final = "following"
"""Key of actions that follow one another, of one action of the file."""
_RIGID: Final = 100.0
"""m/s², of a gap that is to be held without limits: the most that a rule can say."""
IGNORED: Final = frozenset(
    {"ControllerAction", "ActivateControllerAction", "VisibilityAction", "AppearanceAction"}
)


@dataclass(slots=True)
class ActionReader:
    """Reads actions of one entity after another.

    ``speeds`` (m/s), ``lanes`` (ids) and ``offsets`` (m) are the last ones that each actor was
    asked for; ``reversing`` are those that follow a trajectory at first at a negative one, and
    ``routes`` the nodes that routes at first lead through before their last one. ``own`` says
    whether odscen wrote the file: its controllers are what drives without rules.
    """

    conditions: ConditionReader
    speeds: dict[str, float] = field(default_factory=dict)
    lanes: dict[str, int] = field(default_factory=dict)
    offsets: dict[str, float] = field(default_factory=dict)
    own: bool = False
    reversing: set[str] = field(default_factory=set)
    routes: dict[str, list[str]] = field(default_factory=dict)

    def actions(self, element: _Element, entity: ReadEntity) -> list[Made]:
        """Actions of a rule that a ``PrivateAction`` is; none if it is ignored.

        Raises
        ------
        RefusedError
            If it has no counterpart.
        """
        report = self.conditions.report
        kind = report.only(element)
        if self.own and (made := _read_release(element, entity)):
            report.take(element)
            return [made]
        if not self.own and (made := _switch_of_driver(report, kind, entity)):
            return [made]
        if kind.tag in IGNORED:
            report.ignore(kind, "odscen has no controllers and looks of OpenSCENARIO; see --ego")
            return []
        if kind.tag not in _MAKERS:
            kind = report.only(kind)
        make = _MAKERS.get(str(kind.tag))
        if make is None:
            raise RefusedError(kind, f"odscen has no {kind.tag}")
        names = [
            name
            for name, known_entity in self.conditions.entities.items()
            if known_entity is entity
        ]
        if kind.tag == "TeleportAction" and stays(report, kind, names):
            return []
        if kind.tag == "TeleportAction" and lines_up(report, kind, names):
            self.offsets[entity.id] = 0.0
            return [{"offset": {"to": 0.0, "over": JUMP}}]
        return [make(self, kind, entity)]

    def absolute_speed(self, target: _Element, actor: str) -> float:
        """Speed that a target asks of an actor, m/s; a relative one counts from the last known."""
        report = self.conditions.report
        kind = report.only(target)
        value = report.number(kind, "value")
        if kind.tag == "RelativeTargetSpeed":
            base = self.speeds.get(self.conditions.actor(kind), 0.0)
            words = f"relative to {base:g} m/s, the last speed that the file gives"
            report.mark(kind, "approximated", words)
            value = base * value if kind.get("speedTargetValueType") == "factor" else base + value
        private = next(target.iterancestors("Private"), None)
        led = private is not None and private.find(".//FollowTrajectoryAction") is not None
        if value < 0 and led:
            report.mark(kind, "approximated", "backwards along its trajectory, at a positive speed")
            self.reversing.add(actor)
            value = -value
        if value < 0:
            words = f"{value:g} m/s is 0: actors reverse only along a trajectory at first"
            report.mark(kind, "approximated", words)
        return min(max(value, 0.0), 100.0)


def _read_release(element: _Element, entity: ReadEntity) -> Made | None:
    """What gives speed, or all, back to SUMO, or to the story alone."""
    kind = next(element.iter("ActivateControllerAction"), None)
    if kind is None or kind.get("longitudinal") is None:
        return None
    axes = [kind.get(name) == "true" for name in ("longitudinal", "lateral")]
    if axes == [True, False]:
        return {"go": {}}
    by = "sumo" if all(axes) else "story"
    return (
        {"release": {}} if (entity.own or {}).get("driver", "sumo") == by else {"drive": {"by": by}}
    )


def _switch_of_driver(report: ImportReport, kind: _Element, entity: ReadEntity) -> Made | None:
    """What gives a vehicle to its controller, for which SUMO drives, or back to the story.

    ``None`` if it does neither: the default controller drives on, or the speed is left to it.
    """
    if entity.category is Category.PEDESTRIAN or not entity.controlled:
        return None
    switch = next(kind.iter("ActivateControllerAction"), None)
    says = None if switch is None else switch.get("longitudinal")
    if says is None:
        assigned = next(kind.iter("AssignControllerAction"), None)
        says = None if assigned is None else assigned.get("activateLongitudinal")
    if says not in ("true", "false"):
        return None
    report.take(kind)
    by = "sumo" if says == "true" else "story"
    if by == "sumo":
        words = "SUMO drives in the place of its controller, a program beside the file; see --ego"
        report.mark(kind, "approximated", words)
    return {"drive": {"by": by}}


def _read_speed(read: ActionReader, kind: _Element, entity: ReadEntity) -> Made:
    report = read.conditions.report
    dynamics = report.child(kind, "SpeedActionDynamics")
    target = report.child(kind, "SpeedActionTarget")
    if dynamics is None or target is None:
        raise RefusedError(kind, "a speed without dynamics or target")
    to = read.absolute_speed(target, entity.id)
    shape, value = dynamics.get("dynamicsShape", "step"), report.number(dynamics, "value", 0.0)
    before = read.speeds.get(entity.id, 0.0)
    read.speeds[entity.id] = to
    if entity.category is Category.PEDESTRIAN and to == 0.0:
        return {"stop": {}}
    if shape == "step" or value == 0:
        return {"speed": {"to": to, "shape": "step"}}
    measure = _MEASURES.get(dynamics.get("dynamicsDimension", "time"), "over")
    value = min(abs(value), 100.0) if measure == "rate" else abs(value)
    most = _performance_limit(read, entity, faster=to > before)
    shape = _SHAPES.get(shape, "linear")
    peak = STEEPEST[shape] * abs(to - before)
    if measure == "rate" and value > most:
        report.mark(dynamics, "approximated", f"{most:g} m/s², the most of its Performance")
        value = most
    elif measure == "over" and value * most < peak:
        value = round(float(peak / most), 4)
        words = f"{value:g} s from {before:g} m/s, as its Performance allows {most:g} m/s²"
        report.mark(dynamics, "approximated", words)
    return {"speed": {"to": to, "shape": shape, measure: value}}


def _performance_limit(read: ActionReader, entity: ReadEntity, *, faster: bool) -> float:
    """Most that a vehicle of a file of others accelerates or brakes, m/s²."""
    report = read.conditions.report
    limits = None if read.own else report.child(entity.element, "Performance")
    if limits is None:
        return math.inf
    words = "of the speed only what changes over time or by a rate heeds it"
    report.mark(limits, "approximated", words)
    most = report.number(limits, "maxAcceleration" if faster else "maxDeceleration", 0.0)
    return float(most) if most > 0 else math.inf


def _read_dynamics(read: ActionReader, dynamics: _Element | None) -> Made:
    """Duration, length or rate of a change of lane, and its shape."""
    report = read.conditions.report
    if dynamics is None:
        return {"over": USUAL_MOVE}
    value = abs(report.number(dynamics, "value", 0.0))
    shape = dynamics.get("dynamicsShape", "sinusoidal")
    if shape == "step" or value == 0:
        report.mark(dynamics, "approximated", "at once is within 0.1 s")
        return {"over": 0.1}
    measure = _MEASURES.get(dynamics.get("dynamicsDimension", "time"), "over")
    value = min(value, 100.0) if measure == "rate" else value
    how: Made = {measure: value}
    return how if shape == "sinusoidal" else how | {"shape": _SHAPES.get(shape, "linear")}


def _read_lane(read: ActionReader, kind: _Element, entity: ReadEntity) -> Made:
    report = read.conditions.report
    how = _read_dynamics(read, report.child(kind, "LaneChangeActionDynamics"))
    target = report.child(kind, "LaneChangeTarget")
    lane = None if target is None else report.only(target)
    if lane is None:
        raise RefusedError(kind, "a change of lane without a target")
    value = int(report.number(lane, "value"))
    beyond = report.number(kind, "targetLaneOffset", 0.0)
    if lane.tag == "RelativeTargetLane":
        other = read.conditions.actor(lane)
        if other == entity.id and value:
            return _change_from_own_lane(read, lane, entity, value, how | _named_offset(beyond))
        if other != entity.id and value == 0:
            if beyond:
                report.mark(kind, "approximated", "to the middle of another lane, not beside it")
            return {"cut_in": {"to": other, **how}}
        if other == entity.id:
            return _within_lane(read, kind, entity, how)
        road, own, side = start_lane(read.conditions, lane, entity.id)
        beside, its, _ = start_lane(read.conditions, lane, other)
        if road != beside:
            raise RefusedError(lane, f"the lane {value:+d} beside {other!r}, of another road")
        by = value + side * (its - own)
        words = f"{by:+d} lanes from that in which it starts; {other!r} is taken to stay in its own"
        aim = own + side * by
        aim += 0 if aim * own > 0 else side * by  # there is no lane 0
    else:
        road, own, side = start_lane(read.conditions, lane, entity.id)
        ahead = None
        if entity.id not in read.lanes and not read.own:
            ahead = lane_on_the_way(read.conditions, entity.id, value)
        road, own, side = ahead or (road, own, side)
        own, aim = read.lanes.get(entity.id, own), value
        read.lanes[entity.id] = value
        by = side * (value - own - ((value > 0) - (own > 0)))  # there is no lane 0
        words = f"{by:+d} lanes from the last one that the file names for it"
        if ahead is not None:
            words = f"{by:+d} lanes, as on road {road!r}: that on which it starts has no such lane"
    if by == 0:
        report.mark(lane, "approximated", "by none, in the lane in which it is")
        return _within_lane(read, kind, entity, how)
    if (
        abs(by) == 1
        and (metres := to_opposite(read.conditions, entity.id, road, own, aim)) is not None
    ):
        words = f"{metres:.2f} m beside its own lane, in the opposite one"
        report.mark(lane, "approximated", words)
        read.offsets[entity.id] = by * metres + beyond
        return {"offset": {"to": by * metres + beyond, **how}}
    report.mark(lane, "approximated", words)
    return {"lane": {"by": by, **how, **_named_offset(beyond)}}


def _named_offset(metres: float) -> Made:
    """The offset from the centre of the lane that a change ends at, if there is one."""
    return {"offset": metres} if metres else {}


def _change_from_own_lane(
    read: ActionReader, lane: _Element, entity: ReadEntity, by: int, how: Made
) -> Made:
    """Change of so many lanes from its own one; beside it if that is the opposite one."""
    change: Made = {"lane": {"by": by, **how}}
    if read.own or start_of(read.conditions, entity.id) is None:
        return change
    road, own, side = start_lane(read.conditions, lane, entity.id)
    own = read.lanes.get(entity.id, own)
    aim = own + side * by
    aim += 0 if aim * own > 0 else side * (1 if by > 0 else -1)  # there is no lane 0
    read.lanes[entity.id] = aim
    metres = to_opposite(read.conditions, entity.id, road, own, aim) if abs(by) == 1 else None
    if metres is None:
        return change
    words = f"{metres:.2f} m beside its own lane, in the opposite one"
    read.conditions.report.mark(lane, "approximated", words)
    beyond = how.pop("offset", 0.0)
    read.offsets[entity.id] = by * metres + beyond
    return {"offset": {"to": by * metres + beyond, **how}}


def _within_lane(read: ActionReader, kind: _Element, entity: ReadEntity, how: Made) -> Made:
    """Change of no lanes: to the middle of its own, or beside it."""
    metres = read.conditions.report.number(kind, "targetLaneOffset", 0.0)
    metres += _measure_first_offset(read, entity)[0]
    read.offsets[entity.id] = metres
    return {"offset": {"to": metres, **how}}


def _read_offset(read: ActionReader, kind: _Element, entity: ReadEntity) -> Made:
    report = read.conditions.report
    dynamics = report.child(kind, "LaneOffsetActionDynamics")
    target = report.child(kind, "LaneOffsetTarget")
    to = None if target is None else report.child(target)
    if to is None:
        raise RefusedError(kind, "an offset without a target")
    metres = report.number(to, "value")
    if to.tag == "RelativeTargetLaneOffset":
        base = _start_offset(read, to)
        metres += base
        words = f"counted from {base:.2f} m, the offset at which {to.get('entityRef')!r} starts"
        report.mark(to, "approximated", words)
    named, start = _measure_first_offset(read, entity)
    metres += named
    moves = metres - read.offsets.get(entity.id, start)
    read.offsets[entity.id] = metres
    most = 0.0 if dynamics is None else report.number(dynamics, "maxLateralAcc", 0.0)
    shape = "sinusoidal" if dynamics is None else dynamics.get("dynamicsShape", "sinusoidal")
    if shape == "step":
        report.mark(kind, "approximated", "at once is within 0.1 s")
        return {"offset": {"to": metres, "over": 0.1}}
    over = USUAL_MOVE
    if most > 0 and moves:
        greatest = SHARPEST[_SHAPES.get(shape, "cosine")]
        over = max(math.sqrt(greatest * abs(moves) / most), 0.1)
    if most <= 0 or shape == "linear":
        report.mark(kind, "approximated", f"over {over:.2f} s")
    named_shape = {} if shape == "sinusoidal" else {"shape": _SHAPES.get(shape, "cosine")}
    return {"offset": {"to": metres, "over": over, **named_shape}}


def _read_abreast(read: ActionReader, kind: _Element, entity: ReadEntity) -> Made:
    """Keep beside another: an offset from the own lane, where both start."""
    report, positions = read.conditions.report, read.conditions.positions
    other = positions.of_entity(kind)
    own = start_of(read.conditions, entity.id)
    if own is None:
        raise RefusedError(kind, "it has no place yet")
    left = (own.y - other.y) * math.cos(own.hdg) - (own.x - other.x) * math.sin(own.hdg)
    sides = {"leftToReferencedEntity": 1.0, "rightToReferencedEntity": -1.0}
    side = sides.get(kind.get("displacement", "any"), math.copysign(1.0, left))
    wanted = report.number(kind, "distance", abs(left))
    if kind.get("freespace") == "true":
        wanted += (
            entity.body.width + read.conditions.entities[kind.get("entityRef", "")].body.width
        ) / 2
    now = positions.beside_lane(own)
    to = min(max(now - left + side * wanted, -10.0), 10.0)
    words = f"{to:.2f} m from its own lane, if the other one stays in the lane in which it starts"
    report.mark(kind, "approximated", words)
    moves = abs(to - read.offsets.get(entity.id, now))
    read.offsets[entity.id] = to
    return {"offset": {"to": round(to, 3), "over": _read_limited_time(read, kind, moves)}}


def _read_limited_time(read: ActionReader, kind: _Element, moves: float) -> float:
    """Seconds of a half-cosine over ``moves`` metres that keeps to the constraints of an action."""
    report = read.conditions.report
    limits = report.child(kind, "DynamicConstraints")
    fastest = 0.0 if limits is None else report.number(limits, "maxSpeed", 0.0)
    hardest = 0.0 if limits is None else report.number(limits, "maxAcceleration", 0.0)
    seconds = [STEEPEST["cosine"] * moves / fastest] if fastest > 0 else []
    seconds += [math.sqrt(SHARPEST["cosine"] * moves / hardest)] if hardest > 0 else []
    if limits is not None:
        words = "on a half-cosine that keeps to its speed and acceleration to the side"
        report.mark(limits, "approximated", words)
    return float(max(round(max(seconds), 3), 0.1)) if seconds else USUAL_MOVE


def _measure_first_offset(read: ActionReader, entity: ReadEntity) -> tuple[float, float]:
    """Metres to the left of its lane at which the lane is that the file names, and itself."""
    positions = read.conditions.positions
    if entity.own is not None:  # of which the lane is that of its node, wherever it appears
        return 0.0, float(entity.own.get("lateral_offset", 0.0))
    start = start_of(read.conditions, entity.id)
    if start is None:
        return 0.0, 0.0
    own, lanes = start.moved(entity.ahead), positions.graph.lanes
    placed, named = positions.node_near(own), start.node
    left = float(positions.left_of(placed, own))
    if named is None or int(lanes.lane[placed]) == int(lanes.lane[named]):
        return 0.0, left
    return round(left - float(positions.left_of(named, own)), 3), left


def _start_offset(read: ActionReader, element: _Element) -> float:
    """Metres to the left of the centre of its lane at which another entity starts."""
    positions = read.conditions.positions
    name = read.conditions.report.word(element, "entityRef")
    if name not in positions.starts:
        raise RefusedError(element, f"an offset from {name!r}, which has no place")
    return positions.beside_lane(positions.starts[name])


def _read_gap(read: ActionReader, kind: _Element, _entity: ReadEntity) -> Made:
    report = read.conditions.report
    part: Made = {"to": read.conditions.actor(kind)}
    if kind.get("displacement") == "leadingReferencedEntity":
        part["ahead"] = True
    if kind.get("distance") is not None:
        part["metres"] = max(report.number(kind, "distance"), 0.01)
    else:
        part["seconds"] = max(report.number(kind, "timeGap"), 0.01)
    limits = report.child(kind, "DynamicConstraints")
    if limits is not None:
        for name, attribute in (("rate", "maxAcceleration"), ("braking", "maxDeceleration")):
            most = report.number(limits, attribute, 100.0)
            part[name] = min(max(most, 0.1), 100.0)
        if part["braking"] == part["rate"]:
            del part["braking"]
        words = "acceleration and deceleration keep to their limits, not how fast they change"
        for attribute in ("maxAccelerationRate", "maxDecelerationRate"):
            if limits.get(attribute) is not None:
                report.mark(limits, "approximated", words)
        if not read.own:
            words = "how it comes to the gap within its limits is not in the standard"
            report.mark(kind, "approximated", words)
    if kind.get("continuous") == "false":
        part["once"] = True
        if limits is None:
            words = "reached by driving with 3 m/s², not at once"
            report.mark(kind, "approximated", words)
    elif limits is None and not read.own:
        part["rate"] = _RIGID
        words = (
            f"held with up to {_RIGID:g} m/s², a step after the other one's speed; a gap that is "
            "not there yet is closed within seconds, not at once"
        )
        report.mark(kind, "approximated", words)
    if kind.get("freespace") == "false":
        report.mark(kind, "approximated", "between bodies, not reference points")
    return {"keep_gap": part}


def _read_trajectory_action(read: ActionReader, kind: _Element, entity: ReadEntity) -> Made:
    return followed(read.conditions, kind, entity)


def _read_teleport(read: ActionReader, kind: _Element, entity: ReadEntity) -> Made:
    return teleported(read.conditions, kind, entity, read.speeds.get(entity.id, 0.0))


def _read_profile(read: ActionReader, kind: _Element, entity: ReadEntity) -> Made:
    """Speeds one after the other, each reached evenly; the first one at once if it takes none."""
    report = read.conditions.report
    steps: list[Made] = []
    for entry in report.children(kind, "SpeedProfileEntry"):
        to = min(max(report.number(entry, "speed"), 0.0), 100.0)
        over = report.number(entry, "time", 0.0)
        shape = {"over": over} if over > 0 else {"shape": "step"}
        steps.append({"speed": {"to": to, **shape}})
        read.speeds[entity.id] = to
    if not steps:
        raise RefusedError(kind, "a speed profile without entries")
    words = "the speed changes evenly between entries, whatever the limits are"
    report.mark(kind, "approximated", words)
    for limits in kind.iterchildren("DynamicConstraints"):
        report.ignore(limits, words)
    return steps[0] if len(steps) == 1 else {FOLLOWING: steps}


def _read_goal(read: ActionReader, kind: _Element, entity: ReadEntity) -> Made:
    positions, report = read.conditions.positions, read.conditions.report
    places = list(kind.iterfind(".//Waypoint/Position")) or list(kind.iterchildren("Position"))
    if not places:
        raise RefusedError(kind, "a route without places")
    first = any(True for _ in kind.iterancestors("Init"))
    words = (
        "through its places in their order, by the shortest paths, if those lead there"
        if first
        else "only the last place of a route is a goal"
    )
    for element in kind.iter("Route", "Waypoint"):
        report.mark(element, "approximated", words)
    used = places if first else places[-1:]
    nodes = []
    for place in used:
        report.mark(place, "taken")
        point = positions.point(place)
        node = positions.node_near(point) if point.node is None else point.node
        nodes.append(str(node_id(positions.graph, node)))
    read.routes[entity.id] = nodes[:-1]
    return {"goal": {"to": nodes[-1]}}


def _read_arrive(read: ActionReader, kind: _Element, entity: ReadEntity) -> Made:
    return arriving(read.conditions, kind, entity, read.speeds, read.reversing)


_MAKERS: Final[Mapping[str, Callable[[ActionReader, _Element, ReadEntity], Made]]] = {
    "SpeedAction": _read_speed,
    "LaneChangeAction": _read_lane,
    "LaneOffsetAction": _read_offset,
    "LongitudinalDistanceAction": _read_gap,
    "FollowTrajectoryAction": _read_trajectory_action,
    "AssignRouteAction": _read_goal,
    "AcquirePositionAction": _read_goal,
    "SpeedProfileAction": _read_profile,
    "TeleportAction": _read_teleport,
    "SynchronizeAction": _read_arrive,
    "LateralDistanceAction": _read_abreast,
}
