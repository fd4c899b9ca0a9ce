"""The registry of actions: what each kind means, and what it makes of an actor's channel.

To add one: its part in :mod:`odscen.scenario.document.actions_document`, its entry and function
here, and a test.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from odscen.scenario.story.acting_actor import ActingActor, CannotAct
from odscen.scenario.story.arrivals import arrive, synchronise
from odscen.scenario.story.side_motion import SideLaw, beside, line_length
from odscen.scenario.story.speed_laws import (
    SpeedLaw,
    braking,
    speed_change,
    steady,
    stopping,
)

if TYPE_CHECKING:
    from collections.abc import Callable

    from odscen.scenario.document.actions_document import (
        Braking,
        GapKeeping,
        Going,
        Ignoring,
        LaneChange,
        LateralMove,
        Releasing,
        SpeedChange,
        Stopping,
        Vanishing,
        Walking,
    )
    from odscen.scenario.story.road_view import Point

_HELD = 1e-3
"""Metres of a line on which a person stands."""
_GAP_GAIN = 1.0
"""Of a gap that is too long: metres per second faster than the one ahead, for each metre."""


@dataclass(frozen=True, slots=True)
class ActionKind:
    """An entry of the registry: for the table in the documents, and for the run.

    ``begin`` takes over what the action needs and gives the instant at which it is over, infinity
    if that is not known yet. ``update`` is asked at the beginning of each further step, and gets
    and gives that instant. ``finish`` says what comes after it.
    """

    name: str
    meaning: str
    unit: str
    sumo: str
    openscenario: str
    carla: str
    begin: Callable[[Any, ActingActor], float]
    update: Callable[[Any, ActingActor, float], float] | None = None
    finish: Callable[[Any, ActingActor], None] | None = None
    vehicles_only: bool = False
    persons_only: bool = False


def _speed(part: SpeedChange, one: ActingActor) -> float:
    law = speed_change(part, one.instant, one.speed)
    one.channel.take_speed(law, one.owner)
    return law.end


def _keep(_: Any, one: ActingActor) -> None:
    one.channel.keep_speed()


def _brake(part: Braking, one: ActingActor) -> float:
    law = braking(part.by, one.instant, one.speed)
    one.channel.take_speed(law, one.owner)
    return law.end + (part.hold or 0.0)


def _after_braking(part: Braking, one: ActingActor) -> None:
    if part.hold is None:
        one.channel.keep_speed()
    else:
        one.channel.release_speed(one.instant)


def _stop(part: Stopping, one: ActingActor) -> float:
    law = stopping(part.within, one.instant, one.speed)
    one.channel.take_speed(law, one.owner)
    if one.actor.person and one.channel.line is None:
        (x, y), hdg = one.spot(), one.actor.hdg
        ahead = part.within or _HELD
        line = ((x, y), (x + ahead * math.cos(hdg), y + ahead * math.sin(hdg)))
        one.channel.take_line(line, 0.0, None, one.owner, one.instant)
    return law.end


def _stand(_: Any, one: ActingActor) -> None:
    if one.actor.person:
        _stay(one)
    else:
        one.channel.keep_speed()


def _go(_: Going, one: ActingActor) -> float:
    channel = one.channel
    if one.actor.person and channel.held:
        channel.release_line()
        channel.rejoins = True
    channel.release_speed(one.instant)
    return one.instant


def _lane(part: LaneChange, one: ActingActor) -> float:
    line = one.view.lane_line(one.actor.id, part.by)
    if line is None:
        lanes = f"{abs(part.by)} to the {'left' if part.by > 0 else 'right'}"
        msg = f"there is no lane {lanes} for it"
        raise CannotAct(msg)
    _beside_lane(line, 0.0, part.over, one)
    one.channel.keeps_lane = True
    return one.instant + part.over


def _offset(part: LateralMove, one: ActingActor) -> float:
    # Far beside its lane SUMO has it on another one: what follows is about the lane it came from.
    line = one.channel.line or one.view.lane_line(one.actor.id, 0)
    if line is None:
        msg = "it is on no lane"
        raise CannotAct(msg)
    _beside_lane(line, part.to, part.over, one)
    one.channel.keeps_lane = True
    return one.instant + part.over


def _beside_lane(line: tuple[Point, ...], left: float, over: float, one: ActingActor) -> None:
    """Move the front to ``left`` metres of a line."""
    actor, channel = one.actor, one.channel
    ahead = actor.length / 2.0 + channel.metres(one.view.time, one.instant)
    front = actor.x + ahead * math.cos(actor.hdg), actor.y + ahead * math.sin(actor.hdg)
    place = beside(line, front)
    side = SideLaw(one.instant, place.left, left, over)
    channel.take_line(line, place.along, side, one.owner, one.instant)


def _lane_lasts(_: Any, one: ActingActor, end: float) -> float:
    channel = one.channel
    metres = channel.metres(one.instant, one.instant + one.step)
    if channel.along + metres > line_length(channel.line or ()):
        msg = "the lane ends before it is there"
        raise CannotAct(msg)
    return end


def _leave_line(_: Any, one: ActingActor) -> None:
    one.channel.leaves = True


def _keep_gap(part: GapKeeping, one: ActingActor) -> float:
    _follow(part, one)
    return math.inf if part.lasting is None else one.instant + part.lasting


def _follow_on(part: GapKeeping, one: ActingActor, end: float) -> float:
    _follow(part, one)
    return end


def _follow(part: GapKeeping, one: ActingActor) -> None:
    """Choose the speed of this step by the gap: faster where it is too long, slower if short."""
    other = one.view.actor(part.to)
    if other is None:
        msg = f"{part.to!r} is not on the road"
        raise CannotAct(msg)
    me = one.actor
    c, s = math.cos(me.hdg), math.sin(me.hdg)
    ahead = (other.x - me.x) * c + (other.y - me.y) * s
    gap = ahead - (me.length + other.length) / 2.0
    speed = one.speed
    wanted = part.metres if part.metres is not None else (part.seconds or 0.0) * speed
    error = gap - wanted
    # Far away no faster than half the rate can take back in time.
    faster = min(_GAP_GAIN * abs(error), math.sqrt(part.rate * abs(error)))
    target = max(0.0, other.speed + math.copysign(faster, error))
    most = part.rate * one.step
    reached = min(max(target, speed - most), speed + most)
    left = one.view.time + one.step - one.instant
    law = SpeedLaw(one.instant, speed, reached, max(left, 1e-9))
    one.channel.take_speed(law, one.owner)


def _walk(part: Walking, one: ActingActor) -> float:
    places = [one.view.place(place) for place in (*part.through, part.to)]
    line = (one.spot(), *places)
    if line_length(line) < 1e-6:
        return one.instant
    _along_line(line, part.speed, one)
    return math.inf


def _along_line(line: tuple[Point, ...], speed: float | None, one: ActingActor) -> None:
    channel = one.channel
    usual = speed or one.view.walking_speed(one.actor.id)
    if speed is not None or channel.law is None or channel.held or channel.borrowed:
        # ... unless a rule has said how fast it goes
        channel.take_speed(steady(one.instant, usual), one.owner)
    channel.take_line(line, 0.0, None, one.owner, one.instant)


def _on_the_walk(_: Any, one: ActingActor, __: float) -> float:
    end = one.channel.reaches_end(one.instant, one.instant + one.step)
    return math.inf if end is None else end


def _end_of_walk(part: Walking, one: ActingActor) -> None:
    _stay(one)
    one.channel.leaves = isinstance(part.to, str) and part.to.startswith("ped.")


def _stay(one: ActingActor) -> None:
    channel = one.channel
    channel.take_speed(steady(one.instant, 0.0), None)
    channel.held = True


def _vanish(_: Vanishing, one: ActingActor) -> float:
    one.channel.vanishes = True
    return one.instant


def _ignore(part: Ignoring, one: ActingActor) -> float:
    one.channel.ignore_red, one.channel.ignore_right_of_way = part.red, part.right_of_way
    return one.instant


def _release(_: Releasing, one: ActingActor) -> float:
    channel = one.channel
    channel.rejoins = one.actor.person and channel.line is not None
    channel.release_line()
    channel.release_speed(one.instant)
    channel.ignore_red = channel.ignore_right_of_way = channel.keeps_lane = False
    return one.instant


_MIRRORED = "mirrored"
"""What CARLA does: it shows what SUMO does."""

ACTIONS = {
    one.name: one
    for one in (
        ActionKind(
            "speed", "reach `to` at a `rate`, `over` seconds or `within` metres; then keep it, as "
            "far as traffic allows. Shapes: `step`, `linear`, `cosine`", "m/s, m/s², s, m",
            "`setSpeed` each step", "SpeedAction", _MIRRORED, _speed, finish=_keep,
        ),
        ActionKind(
            "brake", "brake with `by` to a standstill, whatever the vehicle type allows; SUMO "
            "drives on after `hold` seconds, without it not before `go` or `release`", "m/s², s",
            "`setSpeed` each step", "SpeedAction to 0", _MIRRORED, _brake, finish=_after_braking,
        ),
        ActionKind(
            "stop", "stand after exactly `within` metres, at once without it; until `go`", "m",
            "`setSpeed`; persons are held in place", "SpeedAction to 0", _MIRRORED, _stop,
            finish=_stand,
        ),
        ActionKind(
            "go", "SUMO chooses the speed again", "", "`setSpeed(-1)`", "ActivateControllerAction",
            _MIRRORED, _go,
        ),
        ActionKind(
            "lane", "change `by` lanes to the left (negative: right) `over` so many seconds on a "
            "half-cosine; the speed stays unless another action changes it", "s",
            "`moveToXY`", "LaneChangeAction (sinusoidal)", _MIRRORED, _lane, _lane_lasts,
            _leave_line, vehicles_only=True,
        ),
        ActionKind(
            "offset", "move the front to `to` metres left of the lane's centre, `over` so many "
            "seconds on a half-cosine", "m, s", "`moveToXY`", "LaneOffsetAction", _MIRRORED,
            _offset, _lane_lasts, _leave_line, vehicles_only=True,
        ),
        ActionKind(
            "keep_gap", "follow `to` at a free gap of `metres`, or of `seconds` at the own speed, "
            "with `rate` at most; for `lasting` seconds", "m, s, m/s²", "`setSpeed` each step",
            "LongitudinalDistanceAction", _MIRRORED, _keep_gap, _follow_on, _keep,
            vehicles_only=True,
        ),
        ActionKind(
            "walk", "walk straight to a place, `through` others, across a road as well; on a "
            "pedestrian node SUMO leads on to the goal, elsewhere the walker stays", "m/s",
            "`person.moveToXY`; drivers brake for the walker", "FollowTrajectoryAction",
            _MIRRORED, _walk, _on_the_walk, _end_of_walk, persons_only=True,
        ),
        ActionKind(
            "arrive", "be `at` a place at the instant at which `to` is `when_at` another; the "
            "speed is settled once that of `to` is steady", "",
            "`setSpeed` or `person.moveToXY`", "SynchronizeAction", _MIRRORED, arrive,
            synchronise, _stand,
        ),
        ActionKind(
            "vanish", "leave the simulation", "", "`remove`", "DeleteEntityAction", _MIRRORED,
            _vanish,
        ),
        ActionKind(
            "ignore", "heed no `red`, or no `right_of_way`", "", "`setSpeedMode`",
            "none", _MIRRORED, _ignore, vehicles_only=True,
        ),
        ActionKind(
            "release", "SUMO drives as if there had been no rule", "", "all of the above undone",
            "ActivateControllerAction", _MIRRORED, _release,
        ),
    )
}  # fmt: skip
"""All kinds by name."""
