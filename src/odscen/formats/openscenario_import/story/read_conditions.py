"""Triggers as conditions of rules."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

from odscen.formats.openscenario.xosc_triggers import EQUAL, ONLY_AHEAD
from odscen.formats.openscenario_import.import_report import RefusedError
from odscen.formats.openscenario_import.source.own_files import without_repeats
from odscen.formats.openscenario_import.world.read_environment import clock_of

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from lxml.etree import _Element

    from odscen.formats.openscenario_import.import_report import ImportReport
    from odscen.formats.openscenario_import.places.read_positions import PositionReader
    from odscen.formats.openscenario_import.story.read_signals import SignalReader
    from odscen.formats.openscenario_import.world.read_entities import ReadEntity
    from odscen.formats.openscenario_import.world.read_environment import ReadEnvironment

Made = dict[str, Any]
ALWAYS: Final[Made] = {"time": {"after": 0.0}}
NEVER: Final[Made] = {"not": ALWAYS}
_TRUTH: Final = {"true": "1", "false": "0"}
_SAME_AXLE: Final = 0.01
_OF_ROADS: Final = ("road", "lane", "trajectory")
_ROAD_END: Final = 10.0
_FAR: Final = 100_000.0
"""Metres."""
_ALONG: Final = {
    "longitudinal": "longitudinal",
    "lateral": "lateral",
    "cartesianDistance": "straight",
    "euclidianDistance": "straight",
}


@dataclass(frozen=True, slots=True)
class ConditionReader:
    """Reads triggers.

    Attributes
    ----------
    values
        Parameters and variables of the file, as declared.
    state
        Condition that an element of the storyboard has reached a state.
    signals
        Reads what is about signals.
    changes
        What sets a parameter or variable in the story: its value then, and the condition that this
        has happened.
    environment
        Time of day at the start.
    own
        Whether odscen wrote the file.
    """

    report: ImportReport
    positions: PositionReader
    entities: Mapping[str, ReadEntity]
    values: Mapping[str, str]
    state: Callable[[_Element], Made]
    signals: SignalReader
    changes: Callable[[_Element, str], list[tuple[str, Made]]]
    environment: ReadEnvironment
    own: bool = False

    def trigger(self, trigger: _Element | None) -> Made:
        """Condition of a trigger; one without conditions holds at once.

        Raises
        ------
        RefusedError
            If a condition has no counterpart.
        """
        if trigger is None:
            return ALWAYS
        groups = [self.group(group) for group in self.report.children(trigger, "ConditionGroup")]
        if self.own:
            groups = without_repeats(groups)
        return joined("any", groups) if groups else ALWAYS

    def group(self, group: _Element) -> Made:
        """Condition that holds while all of a ``ConditionGroup`` do."""
        return joined("all", [self._read_condition(child) for child in self.report.children(group)])

    def _read_condition(self, element: _Element) -> Made:
        content = self.report.child(element, "ByValueCondition", "ByEntityCondition")
        if content is None:
            raise RefusedError(element, "a condition without content")
        if content.tag == "ByValueCondition":
            made = self._read_value_condition(self.report.only(content))
        else:
            made = self._read_entity_condition(content)
        return self._add_edge_and_delay(element, made)

    def _add_edge_and_delay(self, element: _Element, made: Made) -> Made:
        edge, delay = element.get("conditionEdge", "none"), self.report.number(element, "delay", 0)
        made = _read_edge(made, edge)
        return {**made, "delay": delay} if delay > 0 else made

    def _read_value_condition(self, kind: _Element) -> Made:
        if kind.tag == "SimulationTimeCondition":
            after: Made = {"time": {"after": max(0.0, self.report.number(kind, "value"))}}
            return {"not": after} if kind.get("rule", "").startswith("less") else after
        if kind.tag == "StoryboardElementStateCondition":
            return self.state(kind)
        if kind.tag in ("TrafficSignalCondition", "TrafficSignalControllerCondition"):
            return self.signals.condition(kind)
        if kind.tag in ("ParameterCondition", "VariableCondition"):
            return self._read_value(kind)
        if kind.tag == "TimeOfDayCondition":
            return self._time_of_day(kind)
        raise RefusedError(kind, f"odscen has no {kind.tag}")

    def _time_of_day(self, kind: _Element) -> Made:
        start = self.environment
        if start.clock is None:
            raise RefusedError(kind, "a time of day, of which the file has none at first")
        clock, day = clock_of(self.report, kind)
        seconds = (day - start.day) * 86_400.0 + clock - start.clock
        if not start.runs:
            seconds = 0.0 if seconds <= 0 else 1e6
        before = kind.get("rule", "").startswith("less")
        if seconds <= 0 or seconds > 1e5:
            return NEVER if before == (seconds <= 0) else ALWAYS
        after: Made = {"time": {"after": seconds}}
        return {"not": after} if before else after

    def _read_value(self, kind: _Element) -> Made:
        """Whether a value is as it should be: at first, and after what sets it in the story."""
        name = (kind.get("parameterRef") or kind.get("variableRef") or "").lstrip("$")
        have = self.values.get(name)
        if have is None:
            raise RefusedError(kind, f"{name!r} is not declared")
        first, changes = _value_holds(kind, have), self.changes(kind, name)
        if not changes:
            self.report.mark(kind, "approximated", "held against the declared value, once")
            return ALWAYS if first else NEVER
        words = f"from when an event sets {name!r}, as far as its trigger still holds"
        self.report.mark(kind, "approximated", words)
        sets = [when for value, when in changes if _value_holds(kind, value)]
        if not first:
            return joined("any", sets) if sets else NEVER
        unsets = [when for value, when in changes if not _value_holds(kind, value)]
        if not unsets:
            return ALWAYS
        return joined("any", [{"not": joined("any", unsets)}, *sets])

    def _read_entity_condition(self, element: _Element) -> Made:
        who = self.report.child(element, "TriggeringEntities")
        body = self.report.child(element, "EntityCondition")
        if who is None or body is None:
            raise RefusedError(element, "a condition without entities")
        names = [self.actor(child) for child in self.report.children(who, "EntityRef")]
        kind = self.report.only(body)
        read = _KINDS.get(str(kind.tag))
        if read is None or not names:
            raise RefusedError(kind, f"odscen has no {kind.tag}")
        rule = who.get("triggeringEntitiesRule", "any")
        return joined("any" if rule == "any" else "all", [read(self, kind, name) for name in names])

    def actor(self, element: _Element) -> str:
        """Id of the actor that an element refers to.

        Raises
        ------
        RefusedError
            If it is not among the actors.
        """
        name = self.report.word(element, "entityRef")
        if name not in self.entities:
            raise RefusedError(element, f"entity {name!r} is not among the actors")
        return self.entities[name].id

    def bounded(self, kind: _Element, name: str, part: Made) -> Made:
        """Hold a value against the bound of an element."""
        value, rule = self.report.number(kind, "value"), kind.get("rule", "")
        if rule.startswith("less"):
            return {name: {**part, "below": value}}
        if rule.startswith("greater"):
            return {name: {**part, "above": value}}
        self.report.mark(kind, "approximated", f"equal is within {EQUAL} of {value:g}")
        near = [
            {name: {**part, "above": value - EQUAL}},
            {name: {**part, "below": value + EQUAL}},
        ]
        return {"not": {"all": near}} if rule == "notEqualTo" else {"all": near}

    def place(self, kind: _Element, of: str = "") -> list[float] | str:
        """X and y of the position in an element, metres; of a file of odscen's perhaps a node.

        With ``of`` it is where the centre of that actor is when its reference point is there.

        Raises
        ------
        RefusedError
            If there is none.
        """
        position = self.report.child(kind, "Position")
        if position is None:
            raise RefusedError(kind, f"{kind.tag} without a position")
        ahead = next((entity.ahead for entity in self.entities.values() if entity.id == of), 0.0)
        return self.point_or_node(position, ahead=ahead)

    def point_or_node(self, position: _Element, *, ahead: float = 0.0) -> list[float] | str:
        """X and y of a position, metres; of a file of odscen's perhaps a node.

        ``ahead`` is from the reference point of who is to be there to its centre, metres; odscen
        writes places of centres.

        Raises
        ------
        RefusedError
            If it cannot be found on the map.
        """
        point = self.positions.point(position)
        if not self.own:
            point = point.moved(ahead)
        node = self.positions.name_at(point) if self.own and _says_heading(position) else None
        return node or [round(point.x, 4), round(point.y, 4)]


def _read_edge(made: Made, edge: str) -> Made:
    """Condition that holds at an edge of another one.

    What stays so once it has come true, times and ends of rules, has a rising edge when it comes
    true and no falling one: it holds from then on, so that what it is combined with can be later.
    """
    if edge == "none":
        return made
    if _stays_true(made):
        return NEVER if edge == "falling" else made
    if "not" in made and _stays_true(made["not"]) and edge != "rising":
        return dict(made["not"])
    if edge == "rising":
        return {**made, "edge": "rising"}
    falls = {"not": made, "edge": "rising"}
    return falls if edge == "falling" else {"any": [{**made, "edge": "rising"}, falls]}


def _stays_true(made: Made) -> bool:
    """Whether a condition holds for good once it does."""
    (kind,) = (key for key in made if key not in ("edge", "delay"))
    if kind in ("all", "any"):
        return "edge" not in made and all(_stays_true(inner) for inner in made[kind])
    return kind in ("time", "rule")


def _value_holds(kind: _Element, have: str) -> bool:
    """Whether a value is to the one of a condition as its rule says."""
    want, rule = kind.get("value", ""), kind.get("rule")
    try:
        one, other = float(_TRUTH.get(have, have)), float(_TRUTH.get(want, want))
    except ValueError:
        return (have == want) == (rule != "notEqualTo")
    return {
        "greaterThan": one > other,
        "greaterOrEqual": one >= other,
        "lessThan": one < other,
        "lessOrEqual": one <= other,
        "notEqualTo": one != other,
    }.get(str(rule), one == other)


def _says_heading(position: _Element) -> bool:
    """Whether a position says a heading: points of odscen's have none, nodes have."""
    return position.find("WorldPosition[@h]") is not None


def joined(kind: str, parts: list[Made]) -> Made:
    """Combine conditions, each once; one alone stays as it is."""
    rest = [
        part
        for row, part in enumerate(parts)
        if (kind != "all" or part != ALWAYS) and part not in parts[:row]
    ]
    if not rest:
        return ALWAYS
    return rest[0] if len(rest) == 1 else {kind: rest}


def _read_speed(read: ConditionReader, kind: _Element, of: str) -> Made:
    return read.bounded(kind, "speed", {"of": of})


def _read_acceleration(read: ConditionReader, kind: _Element, of: str) -> Made:
    return read.bounded(kind, "acceleration", {"of": of})


def _relative_speed(read: ConditionReader, kind: _Element, of: str) -> Made:
    return read.bounded(kind, "relative_speed", {"of": of, "to": read.actor(kind)})


def _read_travelled(read: ConditionReader, kind: _Element, of: str) -> Made:
    return {"travelled": {"of": of, "above": read.report.number(kind, "value")}}


def _read_stopped(read: ConditionReader, kind: _Element, of: str) -> Made:
    return {"stopped": {"of": of, "seconds": read.report.number(kind, "duration", 0.0)}}


def _read_reaches(read: ConditionReader, kind: _Element, of: str) -> Made:
    within = min(max(read.report.number(kind, "tolerance"), 0.01), 1000.0)
    return {"reaches": {"of": of, "place": read.place(kind, of), "within": within}}


def _read_headway(read: ConditionReader, kind: _Element, of: str) -> Made:
    part = _read_pair(read, kind, of, read.actor(kind))
    # Where the other one is behind, the standard has no headway; rules of odscen's have one.
    if not read.own or ONLY_AHEAD in _name_of_condition(kind):
        part["ahead"] = True
    return read.bounded(kind, "headway", part)


def _read_pair(read: ConditionReader, kind: _Element, of: str, to: str) -> Made:
    """Who is meant, and whether seconds are between bodies or, as here, their reference points."""
    if kind.get("alongRoute") == "true" or kind.get("coordinateSystem") in _OF_ROADS:
        words = "along the heading of the one behind, not along its road"
        read.report.mark(kind, "approximated", words)
    if kind.get("freespace") == "true":
        return {"of": of, "to": to}
    return {"of": of, "to": to, "free": False, **_reference_points(read, of, to)}


def _reference_points(read: ConditionReader, of: str, to: str = "") -> Made:
    """How far the reference points of entities lie behind their centres, where they do."""
    if read.own:  # which writes distances of centres
        return {}
    ahead = {entity.id: float(entity.ahead) for entity in read.entities.values()}
    behind = [round(ahead.get(name, 0.0), 4) for name in (of, to)]
    return {"behind": behind} if any(abs(metres) > _SAME_AXLE for metres in behind) else {}


def _name_of_condition(kind: _Element) -> str:
    condition = next(kind.iterancestors("Condition"), None)
    return "" if condition is None else condition.get("name", "")


def _read_ttc(read: ConditionReader, kind: _Element, of: str) -> Made:
    target = read.report.only(kind)
    other = read.report.child(target, "EntityRef")
    if other is None:
        raise RefusedError(target, "time to collision with a place")
    return read.bounded(kind, "ttc", _read_pair(read, kind, of, read.actor(other)))


def _read_measure(read: ConditionReader, kind: _Element, usual: str, of: str, to: str) -> Made:
    along = _ALONG.get(kind.get("relativeDistanceType", usual), "straight")
    if along == "longitudinal" and kind.get("coordinateSystem") in ("lane", "road"):
        along = "lane"
    if kind.get("freespace") == "true":
        return {"along": along, "free": True}
    return {"along": along, "free": False, **_reference_points(read, of, to)}


def _relative_distance(read: ConditionReader, kind: _Element, of: str) -> Made:
    to = read.actor(kind)
    part = {"of": of, "to": to, **_read_measure(read, kind, "longitudinal", of, to)}
    return read.bounded(kind, "distance", part)


def _read_distance(read: ConditionReader, kind: _Element, of: str) -> Made:
    measure = _read_measure(read, kind, "euclidianDistance", of, "")
    part = {"of": of, "place": read.place(kind, ""), **measure}
    if kind.get("alongRoute") == "true":
        part["along"] = "lane"
    return read.bounded(kind, "distance", part)


def _read_touched(read: ConditionReader, kind: _Element, of: str) -> Made:
    other = read.report.only(kind)
    if other.tag == "EntityRef":
        return {"touched": {"of": of, "to": read.actor(other)}}
    read.report.mark(other, "approximated", "any road user that a rule names")
    return {"touched": {"of": of}}


def _read_off_road(read: ConditionReader, kind: _Element, of: str) -> Made:
    delay = read.report.number(kind, "duration", 0.0)
    return {"off_road": {"of": of}, **({"delay": delay} if delay > 0 else {})}


def _road_end(read: ConditionReader, kind: _Element, of: str) -> Made:
    """Near to where the lanes end that lead straight on from where the actor starts."""
    positions, delay = read.positions, read.report.number(kind, "duration", 0.0)
    entity = next(name for name, entity in read.entities.items() if entity.id == of)
    if entity not in positions.starts:
        raise RefusedError(kind, f"the end of the road of {entity!r}, which has no place")
    start = positions.starts[entity]
    node = positions.along(positions.node_near(start), _FAR)
    lanes = positions.graph.lanes
    words = f"within {_ROAD_END:g} m of the end of the lanes straight on from where it starts"
    read.report.mark(kind, "approximated", f"{words}; SUMO takes it off the road there")
    place = [round(float(lanes.x[node]), 4), round(float(lanes.y[node]), 4)]
    made: Made = {"reaches": {"of": of, "place": place, "within": _ROAD_END}}
    return made | ({"delay": delay} if delay > 0 else {})


_KINDS: Final[Mapping[str, Callable[[ConditionReader, _Element, str], Made]]] = {
    "SpeedCondition": _read_speed,
    "AccelerationCondition": _read_acceleration,
    "RelativeSpeedCondition": _relative_speed,
    "TraveledDistanceCondition": _read_travelled,
    "StandStillCondition": _read_stopped,
    "ReachPositionCondition": _read_reaches,
    "TimeHeadwayCondition": _read_headway,
    "TimeToCollisionCondition": _read_ttc,
    "RelativeDistanceCondition": _relative_distance,
    "DistanceCondition": _read_distance,
    "CollisionCondition": _read_touched,
    "OffroadCondition": _read_off_road,
    "EndOfRoadCondition": _road_end,
}
