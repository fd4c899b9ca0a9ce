"""Bodies that meet where SUMO does not look: of those that rules move."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING, Any, NamedTuple

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


_HARDEST = 12.0
"""m/s²; a speed that changes more in a step has leapt, and not changed evenly."""
_EDGE = 1e-4
"""Metres added to bodies where the place of a contact is looked for: sides that are parallel but
for rounding meet in their middle, and not at a corner."""
_PIECE = 0.1
"""Seconds between looks within a step: in longer ones bodies pass through one another."""


class _Motion(NamedTuple):
    """Where a body was at the end of a step, and how fast: metres, radians, m/s."""

    x: float
    y: float
    hdg: float
    speed: float


class _Swept(NamedTuple):
    """A body in the last step: as it is now, and its motion a step before, if it was seen."""

    now: ActorView
    before: _Motion | None
    step: float

    def view(self, back: float) -> ActorView:
        """The body so many seconds ago.

        Speeds that are seen are means over steps, as SUMO's are: of an even change the speed was
        ``(b + n) / 2`` when the step began and is ``(3 n - b) / 2`` now, ``b`` and ``n`` the means.
        """
        now, before, step = self.now, self.before, self.step
        first = last = now.speed
        if before is not None and abs(now.speed - before.speed) <= _HARDEST * step:
            first = (before.speed + now.speed) / 2.0
            last = max(0.0, 2.0 * now.speed - first)
        share = back / step
        gone = back * (last - (last - first) * share / 2.0)
        hdg = now.hdg
        if before is not None:
            hdg -= share * math.remainder(now.hdg - before.hdg, math.tau)
        if before is None:
            x, y = now.x - gone * math.cos(hdg), now.y - gone * math.sin(hdg)
        else:  # on the way between the two places, which may lead aside
            covered = math.dist((before.x, before.y), (now.x, now.y))
            part = min(1.0, gone / covered) if covered > 0.0 else 0.0
            x, y = now.x + part * (before.x - now.x), now.y + part * (before.y - now.y)
        return replace(now, x=x, y=y, hdg=hdg, speed=last - (last - first) * share)

    def velocity(self, view: ActorView) -> tuple[float, float]:
        """X and y of its velocity in a view of it, m/s; against its heading if it reverses."""
        x, y = view.velocity
        if self.before is not None:
            moved = (self.now.x - self.before.x) * x + (self.now.y - self.before.y) * y
            if moved < 0.0:
                return -x, -y
        return x, y


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
        self._before: dict[str, _Motion] = {}

    def look_at_all(self) -> None:
        """Read everybody again: somebody is elsewhere than he drove."""
        self._seen.clear()

    def state(self) -> dict[str, Any]:
        """What has to be remembered, for JSON."""
        return {
            "touching": sorted(list(pair) for pair in self._touching),
            "before": {name: list(motion) for name, motion in self._before.items()},
        }

    def restore(self, state: Any) -> None:
        """Inverse of :meth:`state`."""
        self._touching = {(one, other) for one, other in state["touching"]}
        self._before = {name: _Motion(*motion) for name, motion in state["before"].items()}

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
            self._touching, self._before = set(), {}
            return []
        touching: set[tuple[str, str]] = set()
        begun: list[tuple[_Swept, _Swept, float]] = []
        seen: dict[str, _Motion] = {}
        for name in sorted(moved):
            body = view.actor(name)
            if body is None:
                continue
            seen[name] = _Motion(body.x, body.y, body.hdg, body.speed)
            for other in self._possible_contacts(body, road, view, moves, step):
                seen[other.id] = _Motion(other.x, other.y, other.hdg, other.speed)
                pair = min(body.id, other.id), max(body.id, other.id)
                if pair in touching:
                    continue
                if pair in self._touching:
                    if overlap(body.corners, other.corners):
                        touching.add(pair)
                    continue
                swept = self._sweep_body(body, step), self._sweep_body(other, step)
                back = _first_contact(*swept, step)
                if back is not None:
                    touching.add(pair)
                    begun.append((*swept, back))
        self._touching, self._before = touching, seen
        known = road.collisions() if begun else set()
        return [
            _contact_event(one, other, time, back)
            for one, other, back in begun
            if frozenset((one.now.id, other.now.id)) not in known
            or self._has_exact_instant(one.now, other.now)
        ]

    def _sweep_body(self, body: ActorView, step: float) -> _Swept:
        return _Swept(body, self._before.get(body.id), step)

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
        step: float,
    ) -> Iterator[ActorView]:
        """Those whose bodies may overlap with another's, or have done so within the step."""
        time = view.time
        for name in view.names:
            seen = None if name in moves else self._seen.get(name)
            if seen is not None and _is_still_far(actor_view, seen[1], time - seen[0]):
                continue
            other = view.actor(name)
            if other is None or other is actor_view:
                continue
            self._seen[name] = time, other
            if _bodies_near(actor_view, other, step):
                yield other
        lane = road.lane_of(actor_view.id, person=actor_view.person)
        if not lane:
            return
        for name, _ in road.bodies_near(lane):
            planned = self._planned.get(name)
            if planned is not None and name not in view.names:
                found = stranger(road, planned, self._offset)
                if found is not None and _bodies_near(actor_view, found, step):
                    yield found


def _is_still_far(one: ActorView, other: ActorView, seconds: float) -> bool:
    """Whether one that SUMO drives cannot be near yet, so long after it was seen."""
    if seconds > _LONG:
        return False
    speed = max(other.speed, _RUNS) if other.person else other.speed
    driven = speed * seconds + other.gain * seconds * seconds / 2.0
    reach = (one.length + one.width + other.length + other.width) / 2.0 + driven + _ASIDE
    return abs(one.x - other.x) > reach or abs(one.y - other.y) > reach


def _bodies_near(one: ActorView, other: ActorView, step: float) -> bool:
    reach = (one.length + one.width + other.length + other.width) / 2.0
    reach += (one.speed + other.speed) * step
    return abs(one.x - other.x) < reach and abs(one.y - other.y) < reach


def _first_contact(one: _Swept, other: _Swept, step: float) -> float | None:
    """Seconds before the end of a step at which two bodies first overlap in it."""
    pieces = max(1, math.ceil(step / _PIECE))
    free: float | None = None
    for piece in range(pieces, -1, -1):
        back = step * piece / pieces
        if not _overlap_before(one, other, back):
            free = back
            continue
        if free is None:
            return back
        for _ in range(_HALVINGS):
            middle = (back + free) / 2.0
            if _overlap_before(one, other, middle):
                back = middle
            else:
                free = middle
        return back
    return None


def _overlap_before(one: _Swept, other: _Swept, back: float) -> bool:
    return overlap(one.view(back).corners, other.view(back).corners)


def _contact_event(one: _Swept, other: _Swept, time: float, back: float) -> Event:
    """Event of a contact that began so many seconds before ``time``."""
    faster = max((one, other), key=lambda body: (body.view(back).speed, body.now.id))
    slower = other if faster is one else one
    hitting, hit = faster.view(back), slower.view(back)
    (ax, ay), (bx, by) = faster.velocity(hitting), slower.velocity(hit)
    x, y = _touching_point(hitting, hit)
    return Event(
        time - back,
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


def _touching_point(one: ActorView, other: ActorView) -> tuple[float, float]:
    """Middle of where two bodies overlap."""
    from shapely import Polygon

    bodies = [Polygon(body.corners).buffer(_EDGE, join_style="mitre") for body in (one, other)]
    shared = bodies[0].intersection(bodies[1])
    middle = shared.centroid
    if middle.is_empty:
        return (one.x + other.x) / 2.0, (one.y + other.y) / 2.0
    return float(middle.x), float(middle.y)
