"""Conditions of rules as triggers: groups of conditions, any of which fires if all in it hold."""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from itertools import product
from typing import TYPE_CHECKING, Any, Final

from odscen.formats.openscenario.dialect import xml
from odscen.formats.openscenario.xosc_signals import lamps_of, movement_of, signal_of
from odscen.scenario.document.rules_document import CENTRES
from odscen.scenario.document.scenario_document import LONGEST_AFTER_STORY

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from lxml.etree import _Element

    from odscen.formats.base import ExportNotes
    from odscen.formats.openscenario.dialect import Dialect
    from odscen.formats.openscenario.xosc_places import Places
    from odscen.scenario.document.rules_document import Condition
    from odscen.scenario.document.scenario_document import AfterStory

_SAME: Final = 1e-6
MOST_GROUPS: Final = 64
"""Groups of a trigger: conditions nested further are left out with a note."""


ONLY_AHEAD: Final = "(only ahead)"
"""In the name of a condition: the headway is that of OpenSCENARIO, and not to one behind."""
EQUAL: Final = 0.1
"""What counts as equal, in the unit of the value: a player compares numbers as they are."""


class CannotSayError(Exception):
    """OpenSCENARIO has no word for a condition or action; the text says which."""


@dataclass(frozen=True, slots=True)
class Leaf:
    """A condition that is not a combination, perhaps negated, with its delay and edge.

    ``equal`` is a value that it is within :data:`EQUAL` of, in place of its bound.
    """

    kind: str
    part: Any
    negated: bool
    delay: float
    rising: bool
    place: str
    state: str = ""
    name: str = ""
    equal: float | None = None


END: Final = "end of the run"
"""Name of the condition that ends a run; what follows says how long it goes on after its story."""
_WHATEVER: Final = f"{END}, whatever is left to happen"
_SETTLED: Final = re.compile(rf"{END}, or (\S+) s after its story")


def name_of_end(after_story: AfterStory) -> str:
    """Name of the condition that ends a run, which says what the standard has no element for."""
    if after_story == "auto":
        return END
    return _WHATEVER if after_story == "never" else f"{END}, or {after_story:g} s after its story"


def after_story_of(name: str) -> AfterStory:
    """How long a run goes on after its story, by the name of the condition that ends it.

    A file of others that names a time runs until then.
    """
    if name == END:
        return "auto"
    match = _SETTLED.fullmatch(name)
    try:
        seconds = -1.0 if match is None else float(match[1])
    except ValueError:
        seconds = -1.0
    return seconds if 0.0 <= seconds <= LONGEST_AFTER_STORY else "never"


@dataclass(frozen=True, slots=True)
class Triggers:
    """Makes triggers of a scenario.

    Attributes
    ----------
    events
        Names of the first and the last event of each rule.
    """

    places: Places
    dialect: Dialect
    notes: ExportNotes
    events: Mapping[str, tuple[str, str]]

    def trigger(self, condition: Condition, actor: str, where: str) -> _Element:
        """``StartTrigger`` of a rule's condition.

        Raises
        ------
        CannotSayError
            If a part of it cannot be said.
        """
        groups = _condition_groups(condition, f"{where}.when", negated=False, delay=0.0)
        for place in dict.fromkeys(
            leaf.place for row in groups for leaf in row if leaf.equal is not None
        ):
            self.notes.approximated.append((place, f"equal, which here is within {EQUAL:g}"))
        if len(groups) > MOST_GROUPS:
            raise CannotSayError(f"the condition needs {len(groups)} groups of conditions")
        return xml(
            "StartTrigger",
            *(
                xml(
                    "ConditionGroup",
                    *(self._write_condition(_number_condition(leaf, n), actor) for leaf in group),
                )
                for n, group in enumerate(groups, start=1)
            ),
        )

    def after(self, event: str, lasting: float | None = None) -> _Element:
        """``StartTrigger`` at the end of an event, or so many seconds after its begin."""
        state = "completeState" if lasting is None else "startTransition"
        return xml("StartTrigger", xml("ConditionGroup", self._value_condition(
            f"after {event}", _event_state_condition(event, state), lasting or 0.0, rising=False
        )))  # fmt: skip

    def at_time(self, seconds: float, name: str) -> _Element:
        """``ConditionGroup`` that holds from a time on."""
        return xml(
            "ConditionGroup",
            self._value_condition(
                name, self._time_condition(seconds, above=True), 0.0, rising=False
            ),
        )

    def _write_condition(self, leaf: Leaf, actor: str) -> _Element:
        make = _MAKERS.get(leaf.kind)
        if make is None:
            raise CannotSayError(f"OpenSCENARIO has no condition {leaf.kind!r}")
        value = make(self, leaf)
        if value.tag not in _BY_VALUE:
            of = getattr(leaf.part, "of", None) or actor
            value = xml(
                "ByEntityCondition",
                xml(
                    "TriggeringEntities",
                    xml("EntityRef", entityRef=of),
                    triggeringEntitiesRule="any",
                ),
                xml("EntityCondition", value),
            )
        else:
            value = xml("ByValueCondition", value)
        name = leaf.name or leaf.place
        if leaf.kind == "headway" and leaf.part.ahead:
            name = f"{name} {ONLY_AHEAD}"
        return self._named_condition(name, value, leaf.delay, rising=leaf.rising)

    def _value_condition(
        self, name: str, value: _Element, delay: float, *, rising: bool
    ) -> _Element:
        return self._named_condition(name, xml("ByValueCondition", value), delay, rising=rising)

    def _named_condition(
        self, name: str, value: _Element, delay: float, *, rising: bool
    ) -> _Element:
        edge = "rising" if rising else "none"
        return xml("Condition", value, name=name, delay=delay, conditionEdge=edge)

    def _time_condition(self, seconds: float, *, above: bool) -> _Element:
        return xml("SimulationTimeCondition", value=seconds, rule=self.dialect.rule(above=above))

    def bound(self, leaf: Leaf) -> dict[str, object]:
        """Attributes ``value`` and ``rule`` of a bounded value."""
        if leaf.equal is not None:
            return {"value": leaf.equal, "rule": "equalTo"}
        above = leaf.part.above is not None
        value = leaf.part.above if above else leaf.part.below
        return {"value": float(value), "rule": self.dialect.rule(above=above != leaf.negated)}


def _condition_groups(
    condition: Condition, place: str, *, negated: bool, delay: float
) -> list[tuple[Leaf, ...]]:
    """Disjunction of conjunctions; a delay of a combination is one of each of its parts."""
    delay += condition.delay
    kind = condition.kind
    rising = condition.edge == "rising"
    if kind in ("all", "any", "not_"):
        if (
            rising
            and not negated
            and (equal := _equal_condition(condition, place, delay)) is not None
        ):
            return [(equal,)]
        if rising:
            raise CannotSayError("the rising edge of a combination of conditions")
        if kind == "not_" and condition.not_ is not None:
            return _condition_groups(
                condition.not_, f"{place}.not", negated=not negated, delay=delay
            )
        parts = [
            _condition_groups(part, f"{place}.{kind}[{index}]", negated=negated, delay=delay)
            for index, part in enumerate(getattr(condition, kind))
        ]
        if (kind == "any") != negated:
            return [group for part in parts for group in part]
        return [tuple(leaf for group in groups for leaf in group) for groups in product(*parts)]
    leaf = Leaf(kind, getattr(condition, kind), negated, delay, rising, place)
    if kind == "rule" and not negated:  # started stays so, a transition is over after a step
        states = (
            ("completeState",) if leaf.part.has == "ended" else ("runningState", "completeState")
        )
        return [(replace(leaf, state=state),) for state in states]
    return [(leaf,)]


def _equal_condition(condition: Condition, place: str, delay: float) -> Leaf | None:
    """A value that becomes equal to another, as far as two bounds say that."""
    if len(condition.all or ()) != 2:
        return None
    least, most = condition.all or ()
    kind = least.kind
    one, other = getattr(least, kind), getattr(most, kind, None)
    above, below = getattr(one, "above", None), getattr(other, "below", None)
    if above is None or below is None or least.delay or most.delay:
        return None
    if "rising" in (least.edge, most.edge):
        return None
    if one.model_copy(update={"above": None, "below": below}) != other:
        return None
    if abs(below - above - 2.0 * EQUAL) > _SAME:
        return None
    return Leaf(kind, one, False, delay, True, place, equal=round((above + below) / 2.0, 9))


def _number_condition(leaf: Leaf, group: int) -> Leaf:
    """Name a condition unlike that of the same place in another group.

    ScenarioRunner takes two conditions of one name for one.
    """
    return leaf if group == 1 else replace(leaf, name=f"{leaf.place} ({group})")


def _refuse_negated(leaf: Leaf) -> None:
    if leaf.negated:
        raise CannotSayError(f"that {leaf.kind!r} does not hold")


def _event_state_condition(event: str, state: str) -> _Element:
    return xml(
        "StoryboardElementStateCondition",
        storyboardElementType="event",
        storyboardElementRef=event,
        state=state,
    )


def _write_time(made: Triggers, leaf: Leaf) -> _Element:
    return xml(
        "SimulationTimeCondition",
        value=leaf.part.after,
        rule=made.dialect.rule(above=not leaf.negated),
    )


def _note_points(made: Triggers, leaf: Leaf) -> None:
    """Say that a condition is measured between centres, where it is between other points here."""
    if not leaf.part.free and leaf.part.behind != CENTRES:
        words = "between centres, not points behind them"
        made.notes.approximated.append((leaf.place, words))


def _write_ttc(made: Triggers, leaf: Leaf) -> _Element:
    _note_points(made, leaf)
    target = xml("TimeToCollisionConditionTarget", xml("EntityRef", entityRef=leaf.part.to))
    distance = made.dialect.distance("longitudinal")
    return xml(
        "TimeToCollisionCondition", target, freespace=leaf.part.free, **distance, **made.bound(leaf)
    )


def _write_headway(made: Triggers, leaf: Leaf) -> _Element:
    _note_points(made, leaf)
    distance = made.dialect.distance("longitudinal")
    return xml(
        "TimeHeadwayCondition",
        entityRef=leaf.part.to,
        freespace=leaf.part.free,
        **distance,
        **made.bound(leaf),
    )


def _write_distance(made: Triggers, leaf: Leaf) -> _Element:
    _note_points(made, leaf)
    part, bound = leaf.part, made.bound(leaf)
    along_route = part.along == "lane"
    kind = {"straight": "cartesianDistance", "lane": "longitudinal"}.get(part.along, part.along)
    if made.dialect.minor >= 1:
        kind = "euclidianDistance" if kind == "cartesianDistance" else kind
    if part.to is None:
        about = made.dialect.distance(kind, along_route=along_route)
        position = made.places.spot(part.place).element()
        free = part.free
        if free and made.dialect.for_scenario_runner:
            made.notes.approximated.append((leaf.place, "from the reference point, not the body"))
            free = False
        return xml("DistanceCondition", position, freespace=free, **about, **bound)
    about = {"relativeDistanceType": kind}
    if made.dialect.minor >= 1:
        about |= made.dialect.distance(kind, along_route=along_route)
    elif along_route:
        made.notes.approximated.append((leaf.place, "distance along the heading, not the lane"))
    return xml(
        "RelativeDistanceCondition", entityRef=part.to, freespace=part.free, **about, **bound
    )


def _relative_speed(made: Triggers, leaf: Leaf) -> _Element:
    about = {"direction": "longitudinal"} if made.dialect.minor >= 2 else {}
    return xml("RelativeSpeedCondition", entityRef=leaf.part.to, **about, **made.bound(leaf))


def _write_speed(made: Triggers, leaf: Leaf) -> _Element:
    return xml("SpeedCondition", **made.bound(leaf))


def _write_acceleration(made: Triggers, leaf: Leaf) -> _Element:
    about = {"direction": "longitudinal"} if made.dialect.minor >= 2 else {}
    return xml("AccelerationCondition", **about, **made.bound(leaf))


def _write_stopped(_made: Triggers, leaf: Leaf) -> _Element:
    _refuse_negated(leaf)
    return xml("StandStillCondition", duration=float(leaf.part.seconds))


def _write_reaches(made: Triggers, leaf: Leaf) -> _Element:
    if leaf.negated:
        raise CannotSayError("that a place is not reached")
    position = made.places.spot(leaf.part.place).element()
    return xml("ReachPositionCondition", position, tolerance=float(leaf.part.within))


def _write_travelled(_made: Triggers, leaf: Leaf) -> _Element:
    above = leaf.part.above is not None
    if above == leaf.negated:
        raise CannotSayError("that less than so many metres are travelled")
    value = leaf.part.above if above else leaf.part.below
    return xml("TraveledDistanceCondition", value=float(value))


def _write_signal(made: Triggers, leaf: Leaf) -> _Element:
    _refuse_negated(leaf)
    if made.dialect.for_scenario_runner:
        raise CannotSayError(
            "what a traffic light shows, which ScenarioRunner refuses by the id of a signal"
        )
    found = signal_of(made.places.source, leaf.part.light, leaf.part.movement)
    if found is None:
        raise CannotSayError(f"what {leaf.part.movement!r} shows, for which the map has no signal")
    signal, shared = found
    if shared:
        words = "the signal is over other movements too and shows the freest of their colours"
        made.notes.approximated.append((leaf.place, words))
    again = movement_of(made.places.source.sumo_map, signal)
    if again is not None and again != (leaf.part.light, leaf.part.movement):
        words = f"the signal, which odscen reads as movement {again[1]!r}"
        made.notes.approximated.append((leaf.place, words))
    return xml("TrafficSignalCondition", name=signal, state=lamps_of(leaf.part.shows))


def _write_rule(made: Triggers, leaf: Leaf) -> _Element:
    _refuse_negated(leaf)
    if leaf.part.id not in made.events:
        raise CannotSayError(f"rule {leaf.part.id!r}, which is left out")
    first, last = made.events[leaf.part.id]
    state = leaf.state
    if state == "runningState" and made.dialect.for_scenario_runner:
        state = "startTransition"  # ScenarioRunner refuses running, and remembers the start
    return _event_state_condition(first if leaf.part.has == "started" else last, state)


def _write_touched(_made: Triggers, leaf: Leaf) -> _Element:
    _refuse_negated(leaf)
    if leaf.part.to is None:
        return xml("CollisionCondition", xml("ByType", type="vehicle"))
    return xml("CollisionCondition", xml("EntityRef", entityRef=leaf.part.to))


def _write_off_road(_made: Triggers, leaf: Leaf) -> _Element:
    _refuse_negated(leaf)
    return xml("OffroadCondition", duration=0.0)


_BY_VALUE: Final = frozenset(
    {"SimulationTimeCondition", "StoryboardElementStateCondition", "TrafficSignalCondition"}
)
_MAKERS: Final[Mapping[str, Callable[[Triggers, Leaf], _Element]]] = {
    "time": _write_time,
    "ttc": _write_ttc,
    "headway": _write_headway,
    "distance": _write_distance,
    "relative_speed": _relative_speed,
    "speed": _write_speed,
    "acceleration": _write_acceleration,
    "stopped": _write_stopped,
    "reaches": _write_reaches,
    "travelled": _write_travelled,
    "signal": _write_signal,
    "rule": _write_rule,
    "touched": _write_touched,
    "off_road": _write_off_road,
}
