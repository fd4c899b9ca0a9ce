"""Bodies that meet where SUMO does not look: of those that rules move."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from odscen.records.run_events import Event, EventKind
from odscen.scenario.story.condition_kinds import overlap
from odscen.sumo.worker.story.story_view import stranger

if TYPE_CHECKING:
    from collections.abc import Collection, Iterator, Mapping

    from odscen.records.run_plan import PlannedActor
    from odscen.scenario.story.channels import WantedMove
    from odscen.scenario.story.road_view import ActorView
    from odscen.sumo.worker.simulation.moved_actors import MovedActors
    from odscen.sumo.worker.story.story_view import StoryView

BODIES = "bodies"
"""Kind of collision, where odscen has found it."""
_HALVINGS = 20
_LONG = 3.0
"""Seconds after which a body is read again."""
_ASIDE = 20.0
"""Metres that changes of lanes put a vehicle aside at once, and more."""
_RUNS = 10.0
"""m/s; nobody on foot is faster."""


class BodyContacts:
    """Finds when bodies of moved road users begin to overlap others."""

    def __init__(
        self,
        planned: Mapping[str, PlannedActor],
        net_offset: tuple[float, float],
        by_story: Collection[str] = (),
    ) -> None:
        self._by_story = frozenset(by_story)
        self._planned = planned
        self._offset = net_offset
        self._touching: set[tuple[str, str]] = set()
        self._seen: dict[str, tuple[float, ActorView]] = {}

    def look_at_all(self) -> None:
        """Read everybody again: somebody is elsewhere than he drove."""
        self._seen.clear()

    def state(self) -> list[list[str]]:
        """What has to be remembered, for JSON."""
        return sorted(list(pair) for pair in self._touching)

    def restore(self, state: Any) -> None:
        """Inverse of :meth:`state`."""
        self._touching = {(one, other) for one, other in state}

    def look(
        self,
        road: MovedActors,
        view: StoryView,
        moves: Mapping[str, WantedMove],
        time: float,
        step: float,
    ) -> list[Event]:
        """Contacts that began in the step that led to ``time``; those that SUMO saw are left."""
        moved = [name for name, move in moves.items() if move.exact or move.pose is not None]
        if not moved:
            self._touching = set()
            return []
        touching: set[tuple[str, str]] = set()
        begun: list[tuple[ActorView, ActorView]] = []
        for name in sorted(moved):
            one = view.actor(name)
            if one is None:
                continue
            for other in self._possible_contacts(one, road, view, moves):
                pair = min(one.id, other.id), max(one.id, other.id)
                if pair not in touching and overlap(one.corners, other.corners):
                    touching.add(pair)
                    if pair not in self._touching:
                        begun.append((one, other))
        self._touching = touching
        known = road.collisions() if begun else set()
        return [
            _contact_event(one, other, time, step)
            for one, other in begun
            if frozenset((one.id, other.id)) not in known or self._has_exact_instant(one, other)
        ]

    def leave_out_known(self, events: list[Event], time: float, step: float) -> None:
        """Leave out of the events of a step what SUMO says of contacts that this has found.

        Of vehicles that the story alone drives: they hit each other on their lanes, where SUMO sees
        it, but on whole steps and without place and speed.
        """
        begin = len(events)
        while begin and events[begin - 1].time > time - step:
            begin -= 1
        events[begin:] = [event for event in events[begin:] if not self._is_known(event)]

    def _is_known(self, event: Event) -> bool:
        if event.kind != EventKind.COLLISION or event.detail == BODIES or event.partner is None:
            return False
        pair = min(event.actor, event.partner), max(event.actor, event.partner)
        return pair in self._touching and not self._by_story.isdisjoint(pair)

    def _has_exact_instant(self, one: ActorView, other: ActorView) -> bool:
        return one.id in self._by_story or other.id in self._by_story

    def _possible_contacts(
        self,
        actor_view: ActorView,
        road: MovedActors,
        view: StoryView,
        moves: Mapping[str, WantedMove],
    ) -> Iterator[ActorView]:
        """Those whose bodies may overlap with another's."""
        time = view.time
        for name in view.names:
            seen = None if name in moves else self._seen.get(name)
            if seen is not None and _still_far(actor_view, seen[1], time - seen[0]):
                continue
            other = view.actor(name)
            if other is None or other is actor_view:
                continue
            self._seen[name] = time, other
            if _bodies_near(actor_view, other):
                yield other
        lane = road.lane_of(actor_view.id, person=actor_view.person)
        if not lane:
            return
        for name, _ in road.bodies_near(lane):
            planned = self._planned.get(name)
            if planned is not None and name not in view.names:
                found = stranger(road, planned, self._offset)
                if found is not None and _bodies_near(actor_view, found):
                    yield found


def _still_far(one: ActorView, other: ActorView, seconds: float) -> bool:
    """Whether one that SUMO drives cannot be near yet, so long after it was seen."""
    if seconds > _LONG:
        return False
    speed = max(other.speed, _RUNS) if other.person else other.speed
    driven = speed * seconds + other.gain * seconds * seconds / 2.0
    reach = (one.length + one.width + other.length + other.width) / 2.0 + driven + _ASIDE
    return abs(one.x - other.x) > reach or abs(one.y - other.y) > reach


def _bodies_near(one: ActorView, other: ActorView) -> bool:
    reach = (one.length + one.width + other.length + other.width) / 2.0
    return abs(one.x - other.x) < reach and abs(one.y - other.y) < reach


def _contact_event(one: ActorView, other: ActorView, time: float, step: float) -> Event:
    """Event of a contact that began in the last step: bodies are taken back along their speed."""
    early, late = 0.0, step
    for _ in range(_HALVINGS):
        back = (early + late) / 2.0
        if overlap(_view_before(one, back).corners, _view_before(other, back).corners):
            early = back
        else:
            late = back
    first, second = _view_before(one, early), _view_before(other, early)
    (ax, ay), (bx, by) = one.velocity, other.velocity
    hitting = max((first, second), key=lambda body: (body.speed, body.id))
    hit = second if hitting is first else first
    x, y = _touching_point(hitting, hit)
    return Event(
        time - early,
        EventKind.COLLISION,
        hitting.id,
        x=x,
        y=y,
        partner=hit.id,
        detail=BODIES,
        values={
            "impact_speed": math.hypot(ax - bx, ay - by),
            "overlap": _overlap_of_width(hitting, hit),
        },
    )


def _overlap_of_width(hitting: ActorView, hit: ActorView) -> float:
    """Share of the width of a body that hits which the other one is in front of."""
    c, s = math.cos(hitting.hdg), math.sin(hitting.hdg)
    aside = [(y - hitting.y) * c - (x - hitting.x) * s for x, y in hit.corners]
    half = hitting.width / 2.0
    shared = min(max(aside), half) - max(min(aside), -half)
    return max(0.0, shared) / hitting.width


def _view_before(actor_view: ActorView, seconds: float) -> ActorView:
    vx, vy = actor_view.velocity
    return replace(actor_view, x=actor_view.x - vx * seconds, y=actor_view.y - vy * seconds)


def _touching_point(one: ActorView, other: ActorView) -> tuple[float, float]:
    """Middle of where two bodies overlap."""
    from shapely import Polygon

    shared = Polygon(one.corners).intersection(Polygon(other.corners))
    middle = shared.centroid
    if middle.is_empty:
        return (one.x + other.x) / 2.0, (one.y + other.y) / 2.0
    return float(middle.x), float(middle.y)
