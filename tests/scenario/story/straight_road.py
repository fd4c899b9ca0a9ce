"""A road along x on which actors keep their speed: what rules see of it at any time."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

from odscen.scenario.document.rules_document import StoryRule
from odscen.scenario.story.road_view import ActorView, leapt
from odscen.scenario.story.story_engine import StoryEngine

if TYPE_CHECKING:
    from collections.abc import Callable

    from odscen.scenario.story.road_view import Point
    from odscen.scenario.story.story_engine import StoryEvent

CAR = ActorView(
    id="car", x=0.0, y=0.0, hdg=0.0, speed=10.0, acceleration=0.0, length=4.0, width=2.0,
    travelled=0.0, person=False,
)  # fmt: skip


@dataclass
class Road:
    """Actors at time 0; each goes on with its speed and acceleration."""

    actors: tuple[ActorView, ...]
    changes: Callable[[str, str], tuple[float, ...]]
    appears: dict[str, float] = field(default_factory=dict)
    letters: Callable[[float], str] = lambda _: "r"
    time: float = 0.0
    step: float = 0.1

    def leapt(self, name: str) -> bool:
        now, self.time = self.actor(name), self.time - self.step
        before, self.time = self.actor(name), self.time + self.step
        return before is not None and now is not None and leapt(before, now, self.step)

    def actor(self, name: str) -> ActorView | None:
        one = next((one for one in self.actors if one.id == name), None)
        if one is None or self.time < self.appears.get(name, 0.0):
            return None
        t = self.time
        moved = one.speed * t + one.acceleration * t * t / 2.0
        speed = one.speed + one.acceleration * t
        standing = one.standing
        if speed <= 0.0 and standing is None:
            stop = -one.speed / one.acceleration if one.acceleration else 0.0
            moved, speed, standing = one.speed * stop / 2.0, 0.0, stop
        x, y = one.x + moved * math.cos(one.hdg), one.y + moved * math.sin(one.hdg)
        return replace(
            one, x=x, y=y, speed=speed, travelled=one.travelled + moved, standing=standing,
            off_road=abs(y) >= 6.02,
        )  # fmt: skip

    def gone(self, _: str) -> bool:
        return False

    def named(self) -> tuple[ActorView, ...]:
        found = (self.actor(one.id) for one in self.actors)
        return tuple(one for one in found if one is not None)

    def place(self, place: str | Point) -> Point:
        assert not isinstance(place, str)
        return place

    def lane_distance(self, actor: str, to: str | Point) -> float | None:
        one = self.actor(actor)
        assert one is not None
        if isinstance(to, str):
            other = self.actor(to)
            return None if other is None else other.x - one.x
        return to[0] - one.x

    def lane_line(self, _: str, __: int) -> None:
        return None

    def walking_speed(self, _: str) -> float:
        return 1.4

    def signal(self, _: str, __: str) -> str:
        return self.letters(self.time)

    def rule_changes(self, rule: str, has: str) -> tuple[float, ...]:
        return self.changes(rule, has)


def rule(when: dict[str, Any], name: str = "r", actor: str = "car", **fields: Any) -> StoryRule:
    then = fields.pop("then", [{"release": {}}])
    return StoryRule.model_validate(
        {"id": name, "actor": actor, "when": when, "then": then} | fields
    )


def story(
    rules: list[StoryRule], *actors: ActorView, step: float = 0.1, until: float = 20.0, **road: Any
) -> list[StoryEvent]:
    """What rules do; what they do to actors moves none of them."""
    engine = StoryEngine(rules, step=step)
    seen = Road(actors, engine.rule_changes, step=step, **road)
    events: list[StoryEvent] = []
    for number in range(round(until / step)):
        seen.time = number * step
        events += engine.step(seen)[1]
    return events


def started(events: list[StoryEvent], name: str = "r") -> list[float]:
    return [one.time for one in events if one.what == "started" and one.rule == name]
