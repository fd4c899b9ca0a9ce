"""Rules that cannot fire yet are not looked at: until when, follows from how fast bodies can be.

Most conditions of most rules are far from met: the other one is two streets away, or the light is a
minute off. Who drives as SUMO lets him drive gains at most :data:`MOST_GAIN`, so that such a
condition stays unmet for a while that can be told. A rule is looked at again :data:`BEFORE` steps
before, as the instant at which it comes true follows from its last two readings.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, NamedTuple

from odscen.scenario.document.rules_document import actors_of, rule_parts

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Mapping

    from odscen.scenario.document.conditions_document import (
        AfterTime,
        Condition,
        DistanceBounded,
        OwnBounded,
        Reaching,
    )
    from odscen.scenario.document.rules_document import StoryRule
    from odscen.scenario.story.road_view import Point, RoadView

MOST_GAIN = 10.0
"""m/s²; what SUMO drives accelerates less."""
BEFORE = 3
"""Steps."""
LONGEST = 2.0
"""Seconds; for longer the bound says little."""


class QuietSpells:
    """Until when each rule need not be looked at.

    Parameters
    ----------
    step
        Seconds between two looks.
    """

    def __init__(self, step: float) -> None:
        self._step = step
        self._until: dict[str, float] = {}
        self._actors: dict[str, frozenset[str]] = {}
        self._tellers: dict[str, _Teller | None] = {}

    def lasts(self, rule: StoryRule, time: float, moved: Collection[str]) -> bool:
        """Whether a rule is not to be looked at; it is when one of its actors is being moved."""
        until = self._until.get(rule.id)
        if until is None:
            return False
        if time < until and self._actors[rule.id].isdisjoint(moved):
            return True
        del self._until[rule.id]
        return False

    def begins(self, rule: StoryRule, view: RoadView, moved: Collection[str]) -> bool:
        """Whether a rule whose condition is not met, and will not be in this step, is left now."""
        name = rule.id
        if name not in self._tellers:
            self._tellers[name] = _teller(rule.when) if _can_be_told(rule) else None
            self._actors[name] = _about(rule)
        teller = self._tellers[name]
        if teller is None:
            return False
        seconds = min(quiet_seconds(teller, rule.actor, view), LONGEST)
        until = view.time + seconds - BEFORE * self._step
        if until <= view.time + self._step or not self._actors[name].isdisjoint(moved):
            return False
        self._until[name] = until
        return True

    def end(self) -> None:
        """Look at all rules again: somebody is elsewhere than he drove."""
        self._until.clear()

    def state(self) -> dict[str, float]:
        """What has to be remembered, for JSON."""
        return dict(self._until)

    def restore(self, state: Mapping[str, float], rules: Mapping[str, StoryRule]) -> None:
        """Inverse of :meth:`state`."""
        for name, until in state.items():
            self._actors[name] = _about(rules[name])
            self._until[name] = until


def quiet_seconds(teller: _Teller, actor: str, view: RoadView) -> float:
    """Seconds for which a condition that is not met surely stays so; 0 if that cannot be told."""
    tell, part, below, every = teller
    if tell is not None:
        seconds = tell(part, actor, view)
        return max(0.0, seconds)
    if not below:
        return 0.0
    parts = [quiet_seconds(one, actor, view) for one in below]
    return max(parts) if every else min(parts)


class _Teller(NamedTuple):
    """A condition, taken apart once: a leaf that can be told, or what it is combined of."""

    tell: Callable[[Any, str, RoadView], float] | None
    part: Any
    below: tuple[_Teller, ...] = ()
    every: bool = False


def _teller(condition: Condition) -> _Teller:
    kind = condition.kind
    part = getattr(condition, kind)
    if kind in ("all", "any"):
        return _Teller(None, None, tuple(map(_teller, part)), kind == "all")
    return _Teller(_TELL.get(kind), part)


def _can_be_told(rule: StoryRule) -> bool:
    """Whether a rule can be left alone at all: not if something remembers each step of it."""
    return not _remembers(rule.when) and _tells(rule.when)


def _tells(condition: Condition) -> bool:
    kind = condition.kind
    if kind in ("all", "any"):
        parts = map(_tells, getattr(condition, kind))
        return any(parts) if kind == "all" else all(parts)
    return kind in _TELL


def _remembers(condition: Condition) -> bool:
    if condition.delay or condition.edge == "rising" or condition.kind == "own":
        return True
    if condition.kind == "not_":
        return condition.not_ is not None and _remembers(condition.not_)
    parts = getattr(condition, condition.kind) if condition.kind in ("all", "any") else ()
    return any(map(_remembers, parts))


def _about(rule: StoryRule) -> frozenset[str]:
    parts = rule_parts(rule, "")
    return frozenset((rule.actor, *(name for _, _, part in parts for _, name in actors_of(part))))


def _covers(metres: float, speed: float, gain: float = MOST_GAIN) -> float:
    """Seconds in which so many metres are covered at the earliest."""
    if metres <= 0.0:
        return 0.0
    return (math.sqrt(speed * speed + 2.0 * gain * metres) - speed) / gain


def _time(part: AfterTime, _: str, view: RoadView) -> float:
    return part.after - view.time


def _speed(part: OwnBounded, actor: str, view: RoadView) -> float:
    if part.above is None:  # whoever collides stands at once
        return 0.0
    one = view.actor(part.of or actor)
    return 0.0 if one is None else (part.above - one.speed) / MOST_GAIN


def _travelled(part: OwnBounded, actor: str, view: RoadView) -> float:
    if part.above is None:
        return 0.0
    one = view.actor(part.of or actor)
    return 0.0 if one is None else _covers(part.above - one.travelled, one.speed)


def _reaches(part: Reaching, actor: str, view: RoadView) -> float:
    return _to_point(part.of or actor, view.place(part.place), part.within, view)


def _distance(part: DistanceBounded, actor: str, view: RoadView) -> float:
    if part.below is None or part.along != "straight":
        return 0.0  # along a heading it is another as soon as somebody turns
    name = part.of or actor
    if part.to is None:
        return _to_point(name, view.place(part.place or ""), part.below, view)
    one, other = view.actor(name), view.actor(part.to)
    if one is None or other is None:
        return 0.0
    # The bodies' farthest points, so that it is right with and without them.
    reach = (one.length + one.width + other.length + other.width) / 2.0
    away = math.dist((one.x, one.y), (other.x, other.y)) - reach - part.below
    return _covers(away, one.speed + other.speed, 2.0 * MOST_GAIN)


def _to_point(actor: str, point: Point, bound: float, view: RoadView) -> float:
    one = view.actor(actor)
    if one is None:
        return 0.0
    away = math.dist((one.x, one.y), point) - (one.length + one.width) / 2.0 - bound
    return _covers(away, one.speed)


_TELL: dict[str, Callable[[Any, str, RoadView], float]] = {
    "distance": _distance,
    "reaches": _reaches,
    "speed": _speed,
    "time": _time,
    "travelled": _travelled,
}
