"""The registry of actions: what each kind means, and what it makes of an actor's channel.

To add one: its part in :mod:`odscen.scenario.document.actions_document`, its entry and function
here, and a test.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from odscen.scenario.story.acting_actor import ActingActor, CannotAct
from odscen.scenario.story.arrivals import arrive, end_of_arrival, synchronise
from odscen.scenario.story.asked_actions import (
    Wanted,
    ask_to_appear,
    ask_to_end,
    ask_to_switch,
    has_appeared,
    said_of_end,
    said_of_goal,
    said_of_horn,
    said_of_lights,
    said_of_signal,
    set_goal,
    set_lights,
    sound_horn,
)
from odscen.scenario.story.path_actions import (
    end_of_path,
    end_of_replay,
    end_of_walk,
    follow_path,
    on_the_line,
    on_the_path,
    replay,
    replay_further,
    stay,
    walk,
)
from odscen.scenario.story.side_actions import (
    after_cut_in,
    change_lane,
    cut_in,
    cut_in_further,
    lane_lasts,
    leave_aside,
    leave_line,
    move_aside,
)
from odscen.scenario.story.speed_laws import (
    SpeedLaw,
    braking,
    speed_change,
    stopping,
)

if TYPE_CHECKING:
    from collections.abc import Callable

    from odscen.scenario.document.actions_document import (
        Braking,
        GapKeeping,
        Going,
        Ignoring,
        Releasing,
        SpeedChange,
        Stopping,
        Vanishing,
    )
    from odscen.scenario.story.road_view import RoadView

_HELD = 1e-3
"""Metres of a line on which a person stands."""
_GAP_GAIN = 1.0
"""Of a gap that is too long: metres per second faster than the one ahead, for each metre."""
_GAP_REACHED = 0.1
"""Metres and m/s within which a gap is reached."""


@dataclass(frozen=True, slots=True)
class ActionKind:
    """A kind of action: an entry of the registry, or the object of an entry point.

    Attributes
    ----------
    name
        How documents name it.
    meaning, unit
        In words, for the table in the documents.
    sumo, openscenario, carla
        What it is there.
    begin
        Gets the part of the document and an
        :class:`~odscen.scenario.story.acting_actor.ActingActor`, takes over what the action needs,
        and gives the instant at which it is over, infinity if that is not known yet.
    update
        Is asked at the beginning of each further step, and gets and gives that instant.
    finish
        Says what comes after it.
    vehicles_only, persons_only
        Whose action it is.
    ask
        In place of ``begin``: it is done by the simulator, and its actor need not be on the road.
    says
        What is reported when it has begun, of those that no motion follows from.
    check
        Says what is wrong with the part of a document, in words, ``None`` if nothing is.
    """

    name: str
    meaning: str
    unit: str = ""
    sumo: str = "`setSpeed` or `moveToXY`"
    openscenario: str = "none"
    carla: str = "mirrored"
    begin: Callable[[Any, ActingActor], float] | None = None
    update: Callable[[Any, ActingActor, float], float] | None = None
    finish: Callable[[Any, ActingActor], None] | None = None
    vehicles_only: bool = False
    persons_only: bool = False
    ask: Callable[[Any, str, RoadView], Wanted] | None = None
    says: Callable[[Any], str] | None = None
    check: Callable[[Any], str | None] | None = None


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
        stay(one)
    else:
        one.channel.keep_speed()


def _go(_: Going, one: ActingActor) -> float:
    channel = one.channel
    if one.actor.person and channel.held:
        channel.release_line()
        channel.rejoins = True
    channel.release_speed(one.instant)
    return one.instant


def _keep_gap(part: GapKeeping, one: ActingActor) -> float:
    there = _follow(part, one)
    if part.once and there:
        return one.instant
    return math.inf if part.lasting is None else one.instant + part.lasting


def _follow_on(part: GapKeeping, one: ActingActor, end: float) -> float:
    there = _follow(part, one)
    return min(end, one.instant) if part.once and there else end


def _follow(part: GapKeeping, one: ActingActor) -> bool:
    """Choose the speed of this step by the gap: faster where it is too long, slower if short.

    Returns whether the gap is what it should be, at the speed of the other one.
    """
    other = one.view.actor(part.to)
    if other is None:
        raise CannotAct(f"{part.to!r} is not on the road")
    me = one.actor
    c, s = math.cos(me.hdg), math.sin(me.hdg)
    ahead = (other.x - me.x) * c + (other.y - me.y) * s
    gap = (-ahead if part.ahead else ahead) - (me.length + other.length) / 2.0
    speed = one.speed
    behind = other.speed if part.ahead else speed
    wanted = part.metres if part.metres is not None else (part.seconds or 0.0) * behind
    error = wanted - gap if part.ahead else gap - wanted
    # Far away no faster than half the rate can take back in time.
    faster = min(_GAP_GAIN * abs(error), math.sqrt(part.rate * abs(error)))
    target = max(0.0, other.speed + math.copysign(faster, error))
    most = part.rate * one.step
    reached = min(max(target, speed - most), speed + most)
    left = one.view.time + one.step - one.instant
    law = SpeedLaw(one.instant, speed, reached, max(left, 1e-9))
    one.channel.take_speed(law, one.owner)
    return abs(error) < _GAP_REACHED and abs(other.speed - speed) < _GAP_REACHED


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
    channel.lights = None
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
            "lane", "change `by` lanes to the left (negative: right), or to the lane that leads "
            "`to` a place, `over` so many seconds on a half-cosine; the speed stays unless another "
            "action changes it", "s",
            "`moveToXY`", "LaneChangeAction (sinusoidal)", _MIRRORED, change_lane, lane_lasts,
            leave_line, vehicles_only=True,
        ),
        ActionKind(
            "cut_in", "change into the lane of `to`, `over` so many seconds on a half-cosine; with "
            "`gap` the speed changes evenly so that the gap behind it is that in the end, if `to` "
            "keeps its speed", "m, s", "`moveToXY`, `setSpeed`",
            "LaneChangeAction (RelativeTargetLane), SpeedAction", _MIRRORED, cut_in,
            cut_in_further, after_cut_in, vehicles_only=True,
        ),
        ActionKind(
            "offset", "move the front to `to` metres left of the lane's centre, `over` so many "
            "seconds on a half-cosine", "m, s", "`moveToXY`", "LaneOffsetAction", _MIRRORED,
            move_aside, lane_lasts, leave_aside, vehicles_only=True,
        ),
        ActionKind(
            "keep_gap", "follow `to`, or drive `ahead` of it, at a free gap of `metres`, or of "
            "`seconds` at the speed of the one behind, "
            "with `rate` at most; for `lasting` seconds, or `once`: until it is that", "m, s, m/s²",
            "`setSpeed` each step",
            "LongitudinalDistanceAction", _MIRRORED, _keep_gap, _follow_on, _keep,
            vehicles_only=True,
        ),
        ActionKind(
            "walk", "walk straight to a place, `through` others, across a road as well; on a "
            "pedestrian node SUMO leads on to the goal, elsewhere the walker stays", "m/s",
            "`person.moveToXY`; drivers brake for the walker", "FollowTrajectoryAction",
            _MIRRORED, walk, on_the_line, end_of_walk, persons_only=True,
        ),
        ActionKind(
            "path", "follow a line over the ground through `points`, with one `speed`, `speeds` at "
            "the points or `times` at which it is there; SUMO leads a vehicle on from its end. "
            "Points are metres ahead and left of the actor `relative_to`, if it is given, "
            "by where that is at the begin",
            "m/s, s", "`moveToXY`", "FollowTrajectoryAction (Polyline)", _MIRRORED, follow_path,
            on_the_path, end_of_path,
        ),
        ActionKind(
            "replay", "be where a recorded road user was: `rows` of seconds, x, y and heading of "
            "the body's centre, evenly between them", "s, m, rad", "`moveToXY`",
            "FollowTrajectoryAction (Polyline, timing)", _MIRRORED, replay, replay_further,
            end_of_replay,
        ),
        ActionKind(
            "goal", "go to another node from here on", "", "`changeTarget`; persons: a new walk",
            "AcquirePositionAction", _MIRRORED, set_goal, says=said_of_goal,
        ),
        ActionKind(
            "arrive", "be `at` a place at the instant at which `to` is `when_at` another; the "
            "speed is settled once that of `to` is steady; with `speed` it changes evenly to that, "
            "which is reached `steady` metres before the place", "m/s, m",
            "`setSpeed` or `person.moveToXY`", "SynchronizeAction", _MIRRORED, arrive,
            synchronise, end_of_arrival,
        ),
        ActionKind(
            "appear", "be on the road from now on, where it is placed or `at` x, y and heading of "
            "its centre, with its initial or a given `speed`; before that it is not there", "m/s",
            "`add` on a whole step", "AddEntityAction", _MIRRORED, update=has_appeared,
            ask=ask_to_appear, says=lambda _: "appears",
        ),
        ActionKind(
            "vanish", "leave the simulation", "", "`remove`", "DeleteEntityAction", _MIRRORED,
            _vanish,
        ),
        ActionKind(
            "end", "end the run, which is then complete; nothing moves after that step", "",
            "no further step", "StopTrigger of the storyboard", _MIRRORED, ask=ask_to_end,
            says=said_of_end,
        ),
        ActionKind(
            "ignore", "heed no `red`, or no `right_of_way`", "", "`setSpeedMode`",
            "none", _MIRRORED, _ignore, vehicles_only=True,
        ),
        ActionKind(
            "signal", "switch a `light`: its program jumps to where `movement` has green, or it "
            "`shows` `off` or its `program` again", "", "`setPhase`, `setProgram` on a whole step",
            "TrafficSignalControllerAction", _MIRRORED, ask=ask_to_switch, says=said_of_signal,
        ),
        ActionKind(
            "lights", "set `indicator`, `brake`, `front`, `high_beam`, `fog` and `emergency` "
            "lights; the others are off. Without any the driver's own again", "", "`setSignals`",
            "LightStateAction (1.2)", "lights of the vehicle", set_lights, says=said_of_lights,
            vehicles_only=True,
        ),
        ActionKind(
            "horn", "sound the horn", "", "an event", "none", "an event; CARLA has no horns",
            sound_horn, says=said_of_horn, vehicles_only=True,
        ),
        ActionKind(
            "release", "SUMO drives as if there had been no rule", "", "all of the above undone",
            "ActivateControllerAction", _MIRRORED, _release,
        ),
        ActionKind(
            "own", "a `kind` that an installed package gives, with its `values`", "its own",
            "its own", "none", _MIRRORED,
        ),
    )
}  # fmt: skip
"""All kinds by name."""
