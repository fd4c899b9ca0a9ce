"""Rules that cannot fire yet are not looked at: until when, follows from how fast bodies can be.

Most conditions of most rules are far from met: the other one is two streets away, or the light is a
minute off. Who drives as SUMO lets him drive gains no more than his vehicle can, so that such a
condition stays unmet for a while that can be told. A rule is looked at again :data:`BEFORE` steps
before, as the instant at which it comes true follows from its last two readings.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, NamedTuple

from odscen.scenario.document.rules_document import actors_of, rule_parts
from odscen.scenario.story.condition_tree import CLOSE

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Mapping

    from odscen.scenario.document.rules_document import (
        AfterTime,
        Condition,
        DistanceBounded,
        OwnBounded,
        Reaching,
        StoryRule,
    )
    from odscen.scenario.story.road_view import ActorView, Point, RoadView

BEFORE = 3
"""Steps."""
LONGEST = 10.0
"""Seconds; for longer the bound says little."""
_ASIDE = 8.0
"""Metres that changes of lanes put a vehicle aside at once: two of them."""
_RUNS = 10.0
"""m/s; nobody on foot is faster, and SUMO lets a person have any speed at once."""
_AGAIN = 5
"""Steps after which it is asked again for how long a rule is far from met."""


class QuietSpells:
    """Until when each rule need not be looked at.

    Parameters
    ----------
    step
        Seconds between two looks.

    Attributes
    ----------
    until
        Instant before which a rule is not looked at, of those of which there is one.
    """

    def __init__(self, step: float) -> None:
        self.until: dict[str, float] = {}
        self._step = step
        self._ask: dict[str, float] = {}
        self._actors: dict[str, frozenset[str]] = {}
        self._tellers: dict[str, _QuietTeller | None] = {}

    def begins(self, rule: StoryRule, view: RoadView, moved: Collection[str]) -> bool:
        """Whether a rule whose condition is not met, and will not be in this step, is left now."""
        name = rule.id
        if name not in self._tellers:
            self._tellers[name] = _make_teller(rule.when) if _can_be_told(rule) else None
            self._actors[name] = _actors_of_rule(rule)
        teller, time = self._tellers[name], view.time
        if teller is None or time < self._ask.get(name, time):
            return False
        if not self._actors[name].isdisjoint(moved):
            return False
        seconds = min(quiet_seconds(teller, rule.actor, view), LONGEST)
        until = time + seconds - BEFORE * self._step
        if until <= time + self._step:
            self._ask[name] = time + _AGAIN * self._step
            return False
        self.until[name] = until
        return True

    def end(self, actor: str | None = None) -> None:
        """Look again at the rules about an actor, who is moved, or at all."""
        if actor is None:
            self.until.clear()
        else:
            for name in [name for name in self.until if actor in self._actors[name]]:
                del self.until[name]

    def state(self) -> dict[str, float]:
        """What has to be remembered, for JSON."""
        return dict(self.until)

    def restore(self, state: Mapping[str, float], rules: Mapping[str, StoryRule]) -> None:
        """Inverse of :meth:`state`."""
        for name, until in state.items():
            self._actors[name] = _actors_of_rule(rules[name])
            self.until[name] = until


def quiet_seconds(teller: _QuietTeller, actor: str, view: RoadView) -> float:
    """Seconds for which a condition that is not met surely stays so; 0 if that cannot be told."""
    tell, part, below, every = teller
    if tell is not None:
        seconds = tell(part, actor, view)
        return max(0.0, seconds)
    if not below:
        return 0.0
    parts = [quiet_seconds(inner, actor, view) for inner in below]
    return max(parts) if every else min(parts)


class _QuietTeller(NamedTuple):
    """A condition, taken apart once: a leaf that can be told, or what it is combined of."""

    tell: Callable[[Any, str, RoadView], float] | None
    part: Any
    below: tuple[_QuietTeller, ...] = ()
    every: bool = False


def _make_teller(condition: Condition) -> _QuietTeller:
    kind = condition.kind
    part = getattr(condition, kind)
    if kind in ("all", "any"):
        return _QuietTeller(None, None, tuple(map(_make_teller, part)), kind == "all")
    return _QuietTeller(_TELL.get(kind), part)


def _can_be_told(rule: StoryRule) -> bool:
    """Whether a rule can be left alone at all: not if something remembers each step of it."""
    return not _has_memory(rule.when) and _can_tell(rule.when)


def _can_tell(condition: Condition) -> bool:
    kind = condition.kind
    if kind in ("all", "any"):
        parts = map(_can_tell, getattr(condition, kind))
        return any(parts) if kind == "all" else all(parts)
    return kind in _TELL


def _has_memory(condition: Condition) -> bool:
    if condition.delay or condition.edge == "rising" or condition.kind == "own":
        return True
    if condition.kind == "not_":
        return condition.not_ is not None and _has_memory(condition.not_)
    parts = getattr(condition, condition.kind) if condition.kind in ("all", "any") else ()
    return any(map(_has_memory, parts))


def _actors_of_rule(rule: StoryRule) -> frozenset[str]:
    parts = rule_parts(rule, "")
    return frozenset((rule.actor, *(name for _, _, part in parts for _, name in actors_of(part))))


def _seconds_to_cover(metres: float, speed: float, gain: float) -> float:
    """Seconds in which so many metres are covered at the earliest."""
    if metres <= CLOSE:
        return 0.0
    if gain <= 0.0:
        return metres / speed if speed > 0.0 else math.inf
    return (math.sqrt(speed * speed + 2.0 * gain * metres) - speed) / gain


def _quiet_until_time(part: AfterTime, _: str, view: RoadView) -> float:
    return part.after - view.time


def _quiet_until_speed(part: OwnBounded, actor: str, view: RoadView) -> float:
    if part.above is None:  # whoever collides stands at once
        return 0.0
    actor_view = view.actor(part.of or actor)
    if actor_view is None:
        return _quiet_while_absent(view, part.of or actor)
    if actor_view.person:
        return 0.0
    if part.above - actor_view.speed <= CLOSE:
        return 0.0
    return (part.above - actor_view.speed) / actor_view.gain if actor_view.gain > 0.0 else LONGEST


def _quiet_until_travelled(part: OwnBounded, actor: str, view: RoadView) -> float:
    if part.above is None:
        return 0.0
    actor_view = view.actor(part.of or actor)
    if actor_view is None:
        return _quiet_while_absent(view, part.of or actor)
    return _seconds_to_cover(part.above - actor_view.travelled, *_speed_and_gain(actor_view))


def _quiet_while_absent(view: RoadView, *actors: str) -> float:
    """Seconds for which a condition on actors, one of whom is not there, is not met."""
    return LONGEST if any(map(view.gone, actors)) else 0.0


def _speed_and_gain(actor_view: ActorView) -> tuple[float, float]:
    """Speed, and how much of it can be gained in a second."""
    return (
        (max(actor_view.speed, _RUNS), 0.0)
        if actor_view.person
        else (actor_view.speed, actor_view.gain)
    )


def _farthest_reach(actor_view: ActorView) -> float:
    """Metres from the centre of a body, with and without it, and of lanes beside."""
    return (actor_view.length + actor_view.width) / 2.0 + (0.0 if actor_view.person else _ASIDE)


def _quiet_until_reached(part: Reaching, actor: str, view: RoadView) -> float:
    return _to_point(part.of or actor, view.place(part.place), part.within, view)


def _quiet_until_distance(part: DistanceBounded, actor: str, view: RoadView) -> float:
    if part.below is None or part.along != "straight":
        return 0.0  # along a heading it is another as soon as somebody turns
    name = part.of or actor
    if part.to is None:
        return _to_point(name, view.place(part.place or ""), part.below, view)
    one, other = view.actor(name), view.actor(part.to)
    if one is None or other is None:
        return _quiet_while_absent(view, name, part.to)
    away = math.dist((one.x, one.y), (other.x, other.y)) - part.below
    (speed, gain), (speeds, gains) = _speed_and_gain(one), _speed_and_gain(other)
    return _seconds_to_cover(
        away - _farthest_reach(one) - _farthest_reach(other), speed + speeds, gain + gains
    )


def _to_point(actor: str, point: Point, bound: float, view: RoadView) -> float:
    actor_view = view.actor(actor)
    if actor_view is None:
        return _quiet_while_absent(view, actor)
    away = math.dist((actor_view.x, actor_view.y), point) - _farthest_reach(actor_view) - bound
    return _seconds_to_cover(away, *_speed_and_gain(actor_view))


_TELL: dict[str, Callable[[Any, str, RoadView], float]] = {
    "distance": _quiet_until_distance,
    "reaches": _quiet_until_reached,
    "speed": _quiet_until_speed,
    "time": _quiet_until_time,
    "travelled": _quiet_until_travelled,
}
