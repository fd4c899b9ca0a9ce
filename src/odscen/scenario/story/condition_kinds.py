"""The registry of conditions: what each kind means, and the number that it is about.

To add one: its part in :mod:`odscen.scenario.document.rules_document`, its entry and function
here, and a test.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from odscen.scenario.document.rules_document import (
        AfterTime,
        Bounded,
        DistanceBounded,
        OneActor,
        OwnBounded,
        PairBounded,
        PointsBehind,
        Reaching,
        SecondsBetween,
        SignalShows,
        Standing,
        Touching,
    )
    from odscen.scenario.story.road_view import ActorView, Point, RoadView


def body_distance(one: ActorView, other: ActorView) -> float:
    """Metres between two bodies, 0 where they overlap.

    Of two that do not, a corner of one of them is nearest.
    """
    dx, dy = other.x - one.x, other.y - one.y
    reach = (one.length + one.width + other.length + other.width) / 2.0
    if abs(dx) <= reach and abs(dy) <= reach and overlap(one.corners, other.corners):
        return 0.0
    return min(_nearest_distance(one, other.corners), _nearest_distance(other, one.corners))


def _nearest_distance(body: ActorView, points: Sequence[Point]) -> float:
    """Metres from a body to the nearest of some points outside of it."""
    x, y, c, s = body.x, body.y, math.cos(body.hdg), math.sin(body.hdg)
    half, side = body.length / 2.0, body.width / 2.0
    least = math.inf
    for px, py in points:
        dx, dy = px - x, py - y
        ahead, aside = abs(dx * c + dy * s) - half, abs(dy * c - dx * s) - side
        away = math.hypot(ahead, aside) if ahead > 0.0 and aside > 0.0 else max(ahead, aside, 0.0)
        least = min(least, away)
    return least


def polygon_distance(one: Sequence[Point], other: Sequence[Point]) -> float:
    """Metres between two convex polygons, 0 where they overlap."""
    if overlap(one, other):
        return 0.0
    return min(
        _distance_to_edge(corner, *edge)
        for corners, edges in ((one, other), (other, one))
        for corner in corners
        for edge in _polygon_edges(edges)
    )


def overlap(one: Sequence[Point], other: Sequence[Point]) -> bool:
    """Whether two convex polygons overlap or touch: no side of either lies between them."""
    for (ax, ay), (bx, by) in (*_polygon_edges(one), *_polygon_edges(other)):
        nx, ny = by - ay, ax - bx
        first = [nx * x + ny * y for x, y in one]
        second = [nx * x + ny * y for x, y in other]
        if max(first) < min(second) or max(second) < min(first):
            return False
    return True


def point_distance(corners: Sequence[Point], point: Point) -> float:
    """Metres from a convex polygon to a point, 0 inside."""
    return polygon_distance(corners, (point, point))


def _polygon_edges(corners: Sequence[Point]) -> Iterator[tuple[Point, Point]]:
    return zip(corners, (*corners[1:], corners[0]), strict=True)


def _distance_to_edge(point: Point, start: Point, end: Point) -> float:
    dx, dy = end[0] - start[0], end[1] - start[1]
    square = dx * dx + dy * dy
    px, py = point[0] - start[0], point[1] - start[1]
    share = min(1.0, max(0.0, (px * dx + py * dy) / square)) if square > 0.0 else 0.0
    return math.hypot(px - share * dx, py - share * dy)


NEVER = -1.0
"""Margin of what is not so, for conditions that are true or not and nothing between."""
_STILL = 1e-6
"""m/s at which no gap closes."""
_TOUCHING = 1e-3
"""Metres between bodies that touch and stay so: as long as one likes."""
_FAR = 60.0
"""Metres beyond a bound that no one covers in a step."""
COLOURS = {"red": "ru", "yellow": "yY", "green": "gG"}
"""Letters of SUMO's states by colour."""


class Reading(NamedTuple):
    """What a condition is about, at one instant.

    Attributes
    ----------
    value
        The number that is held against the bound.
    margin
        By how much the condition is met, in any unit; negative where it is not.
    rate
        Change of the margin per second; ``None`` if only two readings can tell.
    ratio
        Metres and m/s, of a value that is the one over the other: they change evenly from step to
        step, and their ratio does not.
    """

    value: float
    margin: float
    rate: float | None = None
    ratio: tuple[float, float] | None = None


@dataclass(frozen=True, slots=True)
class ConditionKind:
    """A kind of condition: an entry of the registry, or the object of an entry point.

    Attributes
    ----------
    name
        How documents name it.
    meaning, unit
        In words, for the table in the documents.
    sumo, openscenario, carla
        What it is there.
    read
        Gets the part of the document, the id of the rule's actor and what is seen, a
        :class:`~odscen.scenario.story.road_view.RoadView`; ``None`` is what it gives where an actor
        is not on the road.
    check
        Says what is wrong with the part of a document, in words, ``None`` if nothing is.
    """

    name: str
    meaning: str
    unit: str = ""
    sumo: str = "read each step"
    openscenario: str = "none"
    carla: str = "mirrored"
    read: Callable[[Any, str, RoadView], Reading | None] | None = None
    check: Callable[[Any], str | None] | None = None


def _read_bounded(part: Bounded, value: float, rate: float | None = None) -> Reading:
    below = part.below
    if below is not None:
        return Reading(value, below - value, None if rate is None else -rate)
    return Reading(value, value - (part.above or 0.0), rate)


def _read_truth(is_so: bool) -> Reading:
    return Reading(float(is_so), 1.0 if is_so else NEVER, 0.0)


def _actor_of_condition(part: Any, actor: str, view: RoadView) -> ActorView | None:
    return view.actor(part.of or actor)


def _pair_of_condition(part: Any, actor: str, view: RoadView) -> tuple[ActorView, ActorView] | None:
    one, other = _actor_of_condition(part, actor, view), view.actor(part.to)
    return None if one is None or other is None else (one, other)


class _LengthwiseGap(NamedTuple):
    """Along the heading of the first of two, or of the one that drives if the first walks.

    ``ahead`` metres of the other one's centre, ``aside`` to the left; ``closing`` m/s of the gap;
    ``gap`` between the bodies; ``behind`` is the one that is behind.
    """

    ahead: float
    aside: float
    closing: float
    gap: float
    behind: ActorView


def _measure_lengthwise(one: ActorView, other: ActorView, behind: PointsBehind) -> _LengthwiseGap:
    guide = other if one.person and not other.person else one
    c, s = math.cos(guide.hdg), math.sin(guide.hdg)
    (x, y), (ox, oy) = _measured_point(one, behind[0]), _measured_point(other, behind[1])
    dx, dy = ox - x, oy - y
    ahead, aside = dx * c + dy * s, dy * c - dx * s
    faster = one.speed * math.cos(one.hdg - guide.hdg) - other.speed * math.cos(
        other.hdg - guide.hdg
    )
    gap = abs(ahead) - _reach_in_direction(one, guide.hdg) - _reach_in_direction(other, guide.hdg)
    if ahead >= 0.0:
        return _LengthwiseGap(ahead, aside, faster, gap, one)
    return _LengthwiseGap(ahead, aside, -faster, gap, other)


def _reach_in_direction(body: ActorView, hdg: float) -> float:
    """Metres from the centre of a body to its farthest point in a direction."""
    turned = body.hdg - hdg
    if turned == 0.0:  # half of all that is asked
        return body.length / 2.0
    across = body.width * abs(math.sin(turned))
    return (body.length * abs(math.cos(turned)) + across) / 2.0


def _read_time(part: AfterTime, _: str, view: RoadView) -> Reading:
    return Reading(view.time, view.time - part.after, 1.0)


def _read_ttc(part: SecondsBetween, actor: str, view: RoadView) -> Reading | None:
    if (both := _pair_of_condition(part, actor, view)) is None:
        return None
    found = _measure_lengthwise(*both, part.behind)
    if part.ahead and found.behind is not both[0]:
        return Reading(math.inf, NEVER)
    return _read_seconds(part, _gap_of(part, found), found.closing)


def _read_headway(part: SecondsBetween, actor: str, view: RoadView) -> Reading | None:
    if (both := _pair_of_condition(part, actor, view)) is None:
        return None
    found = _measure_lengthwise(*both, part.behind)
    if part.ahead and found.behind is not both[0]:
        return Reading(math.inf, NEVER)
    if part.above is not None and found.behind.speed <= _STILL:
        # A stopped vehicle has no headway, so it is not above a bound either.
        return Reading(math.inf, NEVER)
    return _read_seconds(part, _gap_of(part, found), found.behind.speed)


def _gap_of(part: SecondsBetween, found: _LengthwiseGap) -> float:
    return max(found.gap, 0.0) if part.free else abs(found.ahead)


def _read_seconds(part: PairBounded, gap: float, speed: float) -> Reading:
    """Seconds that a gap is long at a speed.

    They leap where the speed is about 0, and no line through two readings says when they meet a
    bound; the margin is in metres: speed * bound - gap.
    """
    bound = part.below if part.below is not None else (part.above or 0.0)
    moves = speed > _STILL
    margin = speed * bound - (gap if moves else max(gap, _TOUCHING))
    margin = margin if part.below is not None else -margin
    return Reading(seconds_of(gap, speed), margin, ratio=(gap, speed))


def seconds_of(metres: float, speed: float) -> float:
    """Seconds that metres take at a speed; without end for who does not come nearer."""
    return max(metres, 0.0) / speed if speed > _STILL else math.inf


def _read_distance(part: DistanceBounded, actor: str, view: RoadView) -> Reading | None:
    if (body := _actor_of_condition(part, actor, view)) is None:
        return None
    if part.to is None:
        value = _distance_to_place(part, body, view)
    else:
        other = view.actor(part.to)
        value = None if other is None else _distance_to_actor(part, body, other, view)
    return None if value is None else _read_bounded(part, value)


def _distance_to_actor(
    part: DistanceBounded, one: ActorView, other: ActorView, view: RoadView
) -> float | None:
    if part.along == "straight":
        if not part.free:
            points = _measured_point(one, part.behind[0]), _measured_point(other, part.behind[1])
            return math.dist(*points)
        return _straight_distance(one, other, (part.below or 0.0) + (part.above or 0.0))
    found = _measure_lengthwise(one, other, part.behind)
    if part.along == "longitudinal":
        return max(found.gap, 0.0) if part.free else abs(found.ahead)
    if part.along == "lateral":
        half = _reach_in_direction(one, one.hdg + math.pi / 2) + _reach_in_direction(
            other, one.hdg + math.pi / 2
        )
        return max(abs(found.aside) - half, 0.0) if part.free else abs(found.aside)
    if part.along == "lane":
        metres = view.lane_distance(one.id, other.id)
        if metres is None:
            return None
        half = (one.length + other.length) / 2.0
        shorter = half if part.free else part.behind[1] - part.behind[0]
        return metres - shorter if not shorter else max(metres - shorter, 0.0)
    raise ValueError(f"unknown direction {part.along!r}")


def _straight_distance(one: ActorView, other: ActorView, bound: float) -> float:
    """Metres between two bodies; at least so many where they are much farther than the bound."""
    least = math.dist(_centre_of(one), _centre_of(other))
    least -= (one.length + one.width + other.length + other.width) / 2.0
    return least if least > bound + _FAR else body_distance(one, other)


def _distance_to_place(
    part: DistanceBounded, actor_view: ActorView, view: RoadView
) -> float | None:
    place = view.place(part.place or "")
    x, y = _measured_point(actor_view, part.behind[0])
    dx, dy = place[0] - x, place[1] - y
    c, s = math.cos(actor_view.hdg), math.sin(actor_view.hdg)
    if part.along == "longitudinal":
        ahead = abs(dx * c + dy * s)
        return max(ahead - actor_view.length / 2.0, 0.0) if part.free else ahead
    if part.along == "lateral":
        aside = abs(dy * c - dx * s)
        return max(aside - actor_view.width / 2.0, 0.0) if part.free else aside
    if part.along == "lane":
        metres = view.lane_distance(actor_view.id, part.place or "")
        if metres is None:
            return None
        shorter = actor_view.length / 2.0 if part.free else -part.behind[0]
        return metres - shorter if not shorter else max(metres - shorter, 0.0)
    return point_distance(actor_view.corners, place) if part.free else math.hypot(dx, dy)


def _measured_point(actor_view: ActorView, behind: float) -> Point:
    """Point of a body so many metres behind its centre."""
    if not behind:  # nearly always
        return actor_view.x, actor_view.y
    return (
        actor_view.x - behind * math.cos(actor_view.hdg),
        actor_view.y - behind * math.sin(actor_view.hdg),
    )


def _centre_of(actor_view: ActorView) -> Point:
    return actor_view.x, actor_view.y


def _relative_speed(part: PairBounded, actor: str, view: RoadView) -> Reading | None:
    if (both := _pair_of_condition(part, actor, view)) is None:
        return None
    one, other = both
    bx, by = other.velocity
    return _read_bounded(part, one.speed - bx * math.cos(one.hdg) - by * math.sin(one.hdg))


def _read_speed(part: OwnBounded, actor: str, view: RoadView) -> Reading | None:
    actor_view = _actor_of_condition(part, actor, view)
    return None if actor_view is None else _read_bounded(part, actor_view.speed)


def _read_acceleration(part: OwnBounded, actor: str, view: RoadView) -> Reading | None:
    actor_view = _actor_of_condition(part, actor, view)
    return None if actor_view is None else _read_bounded(part, actor_view.acceleration, 0.0)


def _read_stands(part: Standing, actor: str, view: RoadView) -> Reading | None:
    actor_view = _actor_of_condition(part, actor, view)
    if actor_view is None:
        return None
    if actor_view.standing is None:
        return Reading(0.0, NEVER, 0.0)
    stood = view.time - actor_view.standing
    return Reading(stood, stood - part.seconds, 1.0)


def _read_reaches(part: Reaching, actor: str, view: RoadView) -> Reading | None:
    actor_view = _actor_of_condition(part, actor, view)
    if actor_view is None:
        return None
    away = math.dist(_centre_of(actor_view), view.place(part.place))
    return Reading(away, part.within - away)


def _read_travelled(part: OwnBounded, actor: str, view: RoadView) -> Reading | None:
    actor_view = _actor_of_condition(part, actor, view)
    return (
        None if actor_view is None else _read_bounded(part, actor_view.travelled, actor_view.speed)
    )


def _read_signal(part: SignalShows, _: str, view: RoadView) -> Reading | None:
    shown = view.signal(part.light, part.movement)
    return None if shown is None else _read_truth(shown in COLOURS[part.shows])


def _read_appeared(part: OneActor, actor: str, view: RoadView) -> Reading:
    return _read_truth(_actor_of_condition(part, actor, view) is not None)


def _read_touched(part: Touching, actor: str, view: RoadView) -> Reading | None:
    body = _actor_of_condition(part, actor, view)
    if body is None:
        return None
    others = [view.actor(part.to)] if part.to is not None else view.named()
    near = [other for other in others if other is not None and other.id != body.id]
    return _read_truth(any(body_distance(body, other) == 0.0 for other in near))


def _read_off_road(part: OneActor, actor: str, view: RoadView) -> Reading | None:
    actor_view = _actor_of_condition(part, actor, view)
    return None if actor_view is None else _read_truth(actor_view.off_road)


_MIRRORED = "mirrored"
"""What CARLA does: it shows what SUMO does."""
_EXTRAPOLATED = "read each step, extrapolated to the instant"

CONDITIONS = {
    condition_kind.name: condition_kind
    for condition_kind in (
        ConditionKind(
            "time", "simulated time is `after` or more", "s", "exact", "SimulationTimeCondition",
            _MIRRORED, _read_time,
        ),
        ConditionKind(
            "ttc", "time to collision of two actors: gap between the bodies (without `free` the "
            "centres, or points `behind` them) along the heading, over the speed at which it "
            "closes; with `ahead` only while `to` is ahead", "s", _EXTRAPOLATED,
            "TimeToCollisionCondition", _MIRRORED, _read_ttc,
        ),
        ConditionKind(
            "headway", "time headway: gap between the bodies (without `free` the centres, or "
            "points `behind` them) along the heading, over the speed of the one behind; none while "
            "it is stopped, with `ahead` only while `to` is ahead", "s", _EXTRAPOLATED,
            "TimeHeadwayCondition", _MIRRORED, _read_headway,
        ),
        ConditionKind(
            "distance", "metres to an actor (`to`) or a place (`place`): `straight`, "
            "`longitudinal`, `lateral` or along the `lane`; `free` is between the bodies, "
            "otherwise between centres, or points `behind` them",
            "m", _EXTRAPOLATED, "RelativeDistanceCondition, DistanceCondition", _MIRRORED,
            _read_distance,
        ),
        ConditionKind(
            "relative_speed", "own speed less that of `to` along the own heading", "m/s",
            _EXTRAPOLATED, "RelativeSpeedCondition", _MIRRORED, _relative_speed,
        ),
        ConditionKind(
            "speed", "speed", "m/s", _EXTRAPOLATED, "SpeedCondition", _MIRRORED, _read_speed,
        ),
        ConditionKind(
            "acceleration", "acceleration along the heading, negative when braking", "m/s²",
            "on whole steps", "AccelerationCondition", _MIRRORED, _read_acceleration,
        ),
        ConditionKind(
            "stopped", "slower than 0.1 m/s for `seconds`", "s", "from the step of stopping on",
            "StandStillCondition", _MIRRORED, _read_stands,
        ),
        ConditionKind(
            "reaches", "the centre of the body is `within` metres of a place", "m", _EXTRAPOLATED,
            "ReachPositionCondition", _MIRRORED, _read_reaches,
        ),
        ConditionKind(
            "travelled", "metres since departure", "m", _EXTRAPOLATED,
            "TraveledDistanceCondition", _MIRRORED, _read_travelled,
        ),
        ConditionKind(
            "signal", "a movement of a traffic light shows a colour", "", "on whole steps",
            "TrafficSignalCondition", _MIRRORED, _read_signal,
        ),
        ConditionKind(
            "rule", "another rule has started, or ended", "", "exact",
            "StoryboardElementStateCondition", _MIRRORED, None,
        ),
        ConditionKind(
            "appeared", "an actor is on the road", "", "on whole steps", "none", _MIRRORED,
            _read_appeared,
        ),
        ConditionKind(
            "touched", "the bodies of two actors overlap", "", "on whole steps; by odscen",
            "CollisionCondition", _MIRRORED, _read_touched,
        ),
        ConditionKind(
            "off_road", "the centre of the body is on no lane", "", "on whole steps",
            "OffroadCondition", _MIRRORED, _read_off_road,
        ),
        ConditionKind(
            "own", "a `kind` that an installed package gives, with its `values`", "its own",
            "read each step", "none", _MIRRORED,
        ),
    )
}  # fmt: skip
"""All kinds by name; what a rule is about is not on the road, and an own kind has its function."""
