"""The registry of actions: what each kind means, and what it makes of an actor's channel.

To add one: its part in :mod:`odscen.scenario.document.rules_document`, its entry and function
here, and a test.

What is not about an actor on the road is asked of the simulator, on whole steps.
"""

from __future__ import annotations

import itertools
import math
from bisect import bisect_left, bisect_right
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

from odscen.scenario.document.rules_document import USUAL_MOVE
from odscen.scenario.story.channels import ActingActor, CannotAct
from odscen.scenario.story.motion_laws import (
    STEEPEST,
    SideLaw,
    SpeedLaw,
    SpeedTable,
    beside,
    braking,
    heading_on,
    line_length,
    point_on,
    speed_change,
    steady,
    stopping,
)

if TYPE_CHECKING:
    from collections.abc import Callable

    from odscen.scenario.document.rules_document import (
        Appearing,
        Arriving,
        Braking,
        CuttingIn,
        Driving,
        GapKeeping,
        Going,
        Ignoring,
        LaneChange,
        LateralMove,
        NewGoal,
        PathFollowing,
        Releasing,
        Replaying,
        RulePlace,
        SignalSwitch,
        SpeedChange,
        Stopping,
        TrajectoryRow,
        Vanishing,
        VehicleLights,
        Walking,
    )
    from odscen.scenario.story.channels import Channel
    from odscen.scenario.story.motion_laws import AnyLaw
    from odscen.scenario.story.road_view import ActorView, Point, RoadView

    _Sideways = LaneChange | CuttingIn | LateralMove


_SHORT = 1e-9
"""Seconds in which no one moves."""


def walk(part: Walking, acting_actor: ActingActor) -> float:
    """Begin to walk straight to a place."""
    places = [acting_actor.view.place(place) for place in (*part.through, part.to)]
    line = (acting_actor.spot(), *places)
    if line_length(line) < 1e-6:
        return acting_actor.instant
    _drive_along_line(line, part.speed, acting_actor)
    return math.inf


def _drive_along_line(
    line: tuple[Point, ...], speed: float | None, acting_actor: ActingActor
) -> None:
    channel = acting_actor.channel
    usual = speed or acting_actor.view.walking_speed(acting_actor.actor.id)
    waits = channel.held and channel.speed_owner is None
    if speed is not None or channel.law is None or waits or channel.borrowed:
        # ... unless a rule has said how fast it goes
        channel.take_speed(steady(acting_actor.instant, usual), acting_actor.owner)
    channel.take_line(line, 0.0, None, acting_actor.owner, acting_actor.instant)


def on_the_line(_: object, acting_actor: ActingActor, __: float) -> float:
    """When the end of the line is reached, if it is in this step."""
    end = acting_actor.channel.reaches_end(
        acting_actor.instant, acting_actor.instant + acting_actor.step
    )
    return math.inf if end is None else end


def end_of_walk(part: Walking, acting_actor: ActingActor) -> None:
    """Stay there; on a sidewalk, walk on with the next step."""
    _leave_or_stay(part.to, acting_actor)


def stay(acting_actor: ActingActor) -> None:
    """Let a person stand where its line ends."""
    channel = acting_actor.channel
    channel.take_speed(steady(acting_actor.instant, 0.0), None)
    channel.held = True


def _leave_or_stay(place: RulePlace, acting_actor: ActingActor) -> None:
    stay(acting_actor)
    acting_actor.channel.leaves = isinstance(place, str) and place.startswith("ped.")


def follow_path(part: PathFollowing, acting_actor: ActingActor) -> float:
    """Begin to follow a drawn path; the centre of a person is on it, the front of a vehicle.

    Or the point of the vehicle that is ``behind`` it.

    Raises
    ------
    CannotAct
        If the actor stands, and no rule says how fast it goes; or who the points are relative to
        is not on the road.
    """
    points = _points_of_path(part, acting_actor)
    person = acting_actor.actor.person
    behind, backwards = (0.0, False) if person else (part.behind, part.backwards)
    line = (_own_point(acting_actor, behind), *points)
    if line_length(line) < 1e-6:
        return acting_actor.instant
    channel = acting_actor.channel
    if part.times or part.speeds:
        legs = [math.dist(a, b) for a, b in itertools.pairwise(line)]
        knots = (
            _time_of_legs(legs, part.times)
            if part.times
            else _times_at_points(legs, part.speeds, acting_actor.speed)
        )
        table = SpeedTable(acting_actor.instant, knots)
        channel.take_speed(table, acting_actor.owner)
        end = table.end
    elif person or part.speed is not None:
        _drive_along_line(line, part.speed, acting_actor)
        end = math.inf
    elif acting_actor.speed > 0.0 or channel.law is not None:
        end = math.inf
    else:
        raise CannotAct("it is stopped; the path has to say how fast it is followed")
    channel.take_line(
        line, 0.0, None, acting_actor.owner, acting_actor.instant,
        behind=behind, backwards=backwards,
    )  # fmt: skip
    return end


def _points_of_path(part: PathFollowing, acting_actor: ActingActor) -> list[Point]:
    if part.relative_to is None:
        return [acting_actor.view.place(place) for place in part.points]
    base = acting_actor.view.actor(part.relative_to)
    if base is None:
        raise CannotAct(f"{part.relative_to!r} is not on the road")
    # The actor itself is where it is at the instant of the begin, within the step.
    x, y = acting_actor.spot() if part.relative_to == acting_actor.actor.id else (base.x, base.y)
    c, s = math.cos(base.hdg), math.sin(base.hdg)
    return [
        (x + ahead * c - left * s, y + ahead * s + left * c)
        for ahead, left in (acting_actor.view.place(place) for place in part.points)
    ]


def on_the_path(part: PathFollowing, acting_actor: ActingActor, end: float) -> float:
    """When the end of the path is reached."""
    return end if end < math.inf else on_the_line(part, acting_actor, end)


def end_of_path(part: PathFollowing, acting_actor: ActingActor) -> None:
    """Give a vehicle back to SUMO; a person stays unless it is on a sidewalk.

    Whom the story drives and who is in an opposite lane by then goes straight on.
    """
    if acting_actor.actor.person:
        _leave_or_stay(part.points[-1], acting_actor)
    else:
        acting_actor.channel.release_speed(acting_actor.instant)
        acting_actor.channel.leaves = not _is_against_lane(acting_actor)


def _is_against_lane(acting_actor: ActingActor) -> bool:
    """Whether whom the story drives is in an opposite lane, in which SUMO would turn it round."""
    if not acting_actor.channel.by_story:
        return False
    lane, front = (
        acting_actor.view.lane_line(acting_actor.actor.id, 0),
        _front_of_actor(acting_actor),
    )
    if lane is None or abs(beside(lane, front).left) >= _ON_LANE:
        return False
    return not _leads_on(lane, front, acting_actor.actor.hdg)


def replay(part: Replaying, acting_actor: ActingActor) -> float:
    """Begin to be where a recorded road user was."""
    end = acting_actor.instant + part.rows[-1][0]
    _replay_until(part, acting_actor, acting_actor.instant)
    return end


def replay_further(part: Replaying, acting_actor: ActingActor, end: float) -> float:
    """Hand over the rows of this step."""
    _replay_until(part, acting_actor, end - part.rows[-1][0])
    return end


def end_of_replay(_: Replaying, acting_actor: ActingActor) -> None:
    """Give a vehicle back to SUMO, with the last speed; a person stays."""
    if acting_actor.actor.person:
        stay(acting_actor)
    else:
        acting_actor.channel.release_speed(acting_actor.instant)
        acting_actor.channel.leaves = True


def _replay_until(part: Replaying, acting_actor: ActingActor, begin: float) -> None:
    """Lead the actor through the rows of this step, in a run that began at ``begin``.

    A step is handed over at a time, however long the recording is.
    """
    start = acting_actor.instant - begin
    stop = min(acting_actor.view.time + acting_actor.step - begin, part.rows[-1][0])
    times = _Times(part.rows)
    inside = part.rows[bisect_right(times, start) : bisect_left(times, stop)]
    rows = [_row_at(part.rows, times, start), *inside]
    if stop - start > _SHORT:
        rows.append(_row_at(part.rows, times, stop))
    half = 0.0 if acting_actor.actor.person else acting_actor.actor.length / 2.0
    line = tuple((x + half * math.cos(hdg), y + half * math.sin(hdg)) for _, x, y, hdg in rows)
    knots: list[tuple[float, float]] = []
    for (a, b), (p, q) in zip(itertools.pairwise(rows), itertools.pairwise(line), strict=True):
        speed = math.dist(p, q) / (b[0] - a[0])
        knots += [(a[0] - start, speed), (b[0] - start, speed)]
    if not knots:
        line, knots = (*line, *line), [(0.0, 0.0)]
        rows = [*rows, *rows]
    table = SpeedTable(acting_actor.instant, tuple(knots))
    acting_actor.channel.take_speed(table, acting_actor.owner)
    acting_actor.channel.take_line(
        line,
        0.0,
        None,
        acting_actor.owner,
        acting_actor.instant,
        headings=tuple(row[3] for row in rows),
    )


class _Times:
    """Times of rows as a sequence, for bisection, without a copy of them."""

    def __init__(self, rows: tuple[TrajectoryRow, ...]) -> None:
        self._rows = rows

    def __len__(self) -> int:
        return len(self._rows)

    def __getitem__(self, index: int) -> float:
        return self._rows[index][0]


def _row_at(rows: tuple[TrajectoryRow, ...], times: _Times, time: float) -> TrajectoryRow:
    after = min(max(bisect_right(times, time), 1), len(rows) - 1)
    (t0, x0, y0, h0), (t1, x1, y1, h1) = rows[after - 1], rows[after]
    share = min(1.0, max(0.0, (time - t0) / (t1 - t0)))
    turn = math.remainder(h1 - h0, math.tau)
    return time, x0 + (x1 - x0) * share, y0 + (y1 - y0) * share, h0 + turn * share


def _own_point(acting_actor: ActingActor, behind: float) -> Point:
    """Where the centre of a person is, or the point so far behind the front of a vehicle."""
    (x, y), hdg = acting_actor.spot(), acting_actor.actor.hdg
    ahead = 0.0 if acting_actor.actor.person else acting_actor.actor.length / 2.0 - behind
    return x + ahead * math.cos(hdg), y + ahead * math.sin(hdg)


def _time_of_legs(legs: list[float], times: tuple[float, ...]) -> tuple[tuple[float, float], ...]:
    knots: list[tuple[float, float]] = []
    for length, (begin, end) in zip(legs, itertools.pairwise((0.0, *times)), strict=True):
        speed = length / (end - begin)
        knots += [(begin, speed), (end, speed)]
    return tuple(knots)


def _times_at_points(
    legs: list[float], speeds: tuple[float, ...], speed: float
) -> tuple[tuple[float, float], ...]:
    """Speeds that change evenly over time between points."""
    knots, t, before = [(0.0, speed)], 0.0, speed
    for length, after in zip(legs, speeds, strict=True):
        if length > 0.0:
            if before + after <= 0.0:
                raise CannotAct("it is stopped, and is to stop at the first point")
            t += 2.0 * length / (before + after)
        knots.append((t, after))
        before = after
    return tuple(knots)


class WantedActor(NamedTuple):
    """An actor that is to appear: centre and heading of its body, m/s; ``None`` is as planned."""

    actor: str
    at: tuple[float, float, float] | None
    speed: float | None


class WantedSignal(NamedTuple):
    """A traffic light that is to be switched, see :class:`SignalSwitch`."""

    light: str
    shows: str
    movement: str | None


class WantedEnd(NamedTuple):
    """The run is to end."""


Wanted = WantedActor | WantedSignal | WantedEnd


def ask_to_appear(part: Appearing, actor: str, view: RoadView) -> Wanted:
    """Ask for an actor.

    Raises
    ------
    CannotAct
        If it is on the road.
    """
    if view.actor(actor) is not None:
        raise CannotAct(f"{actor!r} is on the road already")
    return WantedActor(actor, part.at, part.speed)


def ask_to_switch(part: SignalSwitch, _: str, __: RoadView) -> Wanted:
    """Ask for a traffic light."""
    return WantedSignal(part.light, part.shows, part.movement)


def ask_to_end(_: object, __: str, ___: RoadView) -> Wanted:
    """Ask for the end of the run."""
    return WantedEnd()


def said_of_end(_: object) -> str:
    """What is reported."""
    return "ends the run"


def said_of_signal(part: SignalSwitch) -> str:
    """What a light then shows."""
    return f"light {part.light}: {part.movement or ''} {part.shows}".replace("  ", " ")


def has_appeared(_: Appearing, acting_actor: ActingActor, __: float) -> float:
    """Instant at which it is seen on the road."""
    return acting_actor.view.time


def set_goal(part: NewGoal, acting_actor: ActingActor) -> float:
    """Take another goal."""
    acting_actor.channel.goal = part.to
    return acting_actor.instant


def said_of_goal(part: NewGoal) -> str:
    """Where it goes to."""
    return f"goal {part.to}"


def set_lights(part: VehicleLights, acting_actor: ActingActor) -> float:
    """Switch lights of a vehicle."""
    acting_actor.channel.lights = _shown_lights(part) if part.model_fields_set else None
    return acting_actor.instant


def said_of_lights(part: VehicleLights) -> str:
    """Lights that are on."""
    if not part.model_fields_set:
        return "lights: the driver's"
    return f"lights: {', '.join(_shown_lights(part)) or 'off'}"


def _shown_lights(part: VehicleLights) -> tuple[str, ...]:
    shown = () if part.indicator in (None, "off") else (str(part.indicator),)
    names = ("brake", "front", "high_beam", "fog", "emergency")
    return shown + tuple(name for name in names if getattr(part, name))


def sound_horn(_: object, acting_actor: ActingActor) -> float:
    """Sound the horn: nothing moves."""
    return acting_actor.instant


def said_of_horn(_: object) -> str:
    """What is heard."""
    return "horn"


FASTEST = 70.0
"""m/s; a cut-in that needs more is not possible."""
_ON_LANE = 2.0
"""Metres from the centre of a lane at which the front of a vehicle is still on it."""


def change_lane(part: LaneChange, acting_actor: ActingActor) -> float:
    """Begin a lane change.

    Raises
    ------
    CannotAct
        If there is no such lane.
    """
    if part.to is not None:
        line = acting_actor.view.lane_line_to(acting_actor.actor.id, part.to)
        missing = "none of the lanes beside it leads to the place"
    else:
        by = part.by or 0
        line = _back_in_lane(by, acting_actor) or acting_actor.view.lane_line(
            acting_actor.actor.id, by
        )
        missing = f"there is no lane {abs(by)} to the {'left' if by > 0 else 'right'} for it"
    if line is None or not _leads_on(line, _front_of_actor(acting_actor), acting_actor.actor.hdg):
        raise CannotAct(missing)
    return _move_beside_lane(line, part.offset, part, acting_actor)


def _back_in_lane(by: int, acting_actor: ActingActor) -> tuple[Point, ...] | None:
    """The lane beside which a vehicle is led, if that is the next one that way.

    Beside all lanes and in an opposite lane, SUMO does not know which lane it came from.
    """
    line, side = acting_actor.channel.line, acting_actor.channel.side
    if line is None or side is None or by != -math.copysign(1, side.e1) or abs(side.e1) < _ON_LANE:
        return None
    under = acting_actor.view.lane_line(acting_actor.actor.id, 0)
    own_way = under is not None and _leads_on(
        under, _front_of_actor(acting_actor), acting_actor.actor.hdg
    )
    return None if own_way else line


def _leads_on(line: tuple[Point, ...], point: Point, hdg: float) -> bool:
    """Whether a line leads by a point in about a direction."""
    return math.cos(point_on(line, beside(line, point).along).hdg - hdg) > 0.0


def move_aside(part: LateralMove, acting_actor: ActingActor) -> float:
    """Begin to move to an offset.

    Raises
    ------
    CannotAct
        If the actor is on no lane.
    """
    # Far beside its lane SUMO has it on another one, or none: what follows is about the lane that
    # it was led along until now.
    led = acting_actor.channel.line if acting_actor.channel.side is not None else None
    line = led or acting_actor.view.lane_line(acting_actor.actor.id, 0)
    if line is None:
        raise CannotAct("it is on no lane")
    return _move_beside_lane(line, part.to, part, acting_actor)


def cut_in(part: CuttingIn, acting_actor: ActingActor) -> float:
    """Begin to change into the lane of another.

    Raises
    ------
    CannotAct
        If that is not on a lane of the road, or the gap cannot be reached in time.
    """
    other = _other_actor(part, acting_actor)
    line = acting_actor.view.lane_line(part.to, 0)
    if line is None:
        raise CannotAct(f"{part.to!r} is on no lane")
    end = _move_beside_lane(line, 0.0, part, acting_actor)
    _reach_gap(part, acting_actor, other, end)
    return end


def cut_in_further(part: CuttingIn, acting_actor: ActingActor, end: float) -> float:
    """Choose the speed of this step by the gap that is left, until it is half over.

    Then the actor is in the other lane, and the other one may brake for it.

    Raises
    ------
    CannotAct
        If the lane ends, or the gap cannot be reached in time.
    """
    end = lane_lasts(part, acting_actor, end)
    side = acting_actor.channel.side
    if side is not None and end - acting_actor.instant > side.duration / 2.0:
        _reach_gap(part, acting_actor, _other_actor(part, acting_actor), end)
    return end


def after_cut_in(part: CuttingIn, acting_actor: ActingActor) -> None:
    """Let SUMO drive on."""
    if part.gap is not None:
        acting_actor.channel.release_speed(acting_actor.instant)
    leave_line(part, acting_actor)


def lane_lasts(_: object, acting_actor: ActingActor, end: float) -> float:
    """Look whether the lane goes on, and when a change within so many metres is done.

    Raises
    ------
    CannotAct
        If it ends in this step.
    """
    channel = acting_actor.channel
    metres = channel.metres(acting_actor.instant, acting_actor.instant + acting_actor.step)
    if channel.along + metres > line_length(channel.line or ()):
        raise CannotAct("the lane ends before it is there")
    side = channel.side
    if side is None or side.length is None or end < math.inf:
        return end
    begin = acting_actor.view.time
    done = channel.reaches(side.start + side.length, begin, begin + acting_actor.step)
    return end if done is None else max(done, acting_actor.instant)


def leave_aside(part: LateralMove, acting_actor: ActingActor) -> None:
    """Leave the line with this step if it ends on a lane that leads the same way.

    Elsewhere the line is followed on: beside all lanes, or in an opposite lane, where SUMO would
    turn the vehicle round.
    """
    line = acting_actor.channel.line
    if line is None or abs(part.to) < _ON_LANE:
        acting_actor.channel.leaves = True
        return
    x, y, hdg = point_on(line, acting_actor.channel.along, left=part.to)
    for by in (0, 1 if part.to > 0 else -1):
        lane = acting_actor.view.lane_line(acting_actor.actor.id, by)
        if lane is None or abs(beside(lane, (x, y)).left) >= _ON_LANE:
            continue
        if _leads_on(lane, (x, y), hdg):
            acting_actor.channel.leaves = True


def leave_line(_: object, acting_actor: ActingActor) -> None:
    """Leave the line with this step."""
    acting_actor.channel.leaves = True


def _other_actor(part: CuttingIn, acting_actor: ActingActor) -> ActorView:
    other = acting_actor.view.actor(part.to)
    if other is None or other.person:
        raise CannotAct(f"{part.to!r} does not drive on the road")
    return other


def _move_beside_lane(
    line: tuple[Point, ...], left: float, part: _Sideways, acting_actor: ActingActor
) -> float:
    """Move the front to ``left`` metres of a line; returns when it is there, if that is known."""
    place, instant = beside(line, _front_of_actor(acting_actor)), acting_actor.instant
    seconds = USUAL_MOVE if part.over is None else part.over
    if part.rate is not None:
        seconds = max(STEEPEST[part.shape] * abs(left - place.left) / part.rate, 1e-9)
    side = SideLaw(instant, place.left, left, seconds, part.shape, place.along, part.within)
    acting_actor.channel.take_line(line, place.along, side, acting_actor.owner, instant)
    acting_actor.channel.keeps_lane = True
    return math.inf if part.within is not None else instant + seconds


def _front_of_actor(acting_actor: ActingActor) -> Point:
    actor = acting_actor.actor
    ahead = actor.length / 2.0 + acting_actor.channel.metres(
        acting_actor.view.time, acting_actor.instant
    )
    return actor.x + ahead * math.cos(actor.hdg), actor.y + ahead * math.sin(actor.hdg)


def _reach_gap(part: CuttingIn, one: ActingActor, other: ActorView, end: float) -> None:
    """Take the speed that ends with the gap, if the other one keeps its own.

    g + (v + v1)/2 T - u T = gap,   g the gap now, v and u the speeds, T the seconds left
    """
    if part.gap is None:
        return
    line = one.channel.line or ()
    half, left = other.length / 2.0, end - one.instant
    front = other.x + half * math.cos(other.hdg), other.y + half * math.sin(other.hdg)
    theirs = beside(line, front).along + other.speed * (one.instant - one.view.time)
    mine = beside(line, _front_of_actor(one)).along
    gap = mine - one.actor.length - theirs
    v, u = one.speed, other.speed
    v1 = 2.0 * ((part.gap - gap) / left + u) - v
    if not 0.0 <= v1 <= FASTEST:
        raise CannotAct(f"it would have to reach {v1:.1f} m/s for a gap of {part.gap:g} m in time")
    one.channel.take_speed(SpeedLaw(one.instant, v, v1, left), one.owner)


FASTEST_VEHICLE, FASTEST_WALKER = 70.0, 10.0
"""m/s; who would have to be faster cannot arrive in time."""
_STEADY = 0.05
"""m/s^2 of acceleration below which a speed counts as steady."""
_BY = 1.5
"""Metres between a line and a place that it leads by."""
_SAME = 1e-6


def arrive(part: Arriving, acting_actor: ActingActor) -> float:
    """Begin: a pedestrian goes straight to the place, unless it is on a line that leads there."""
    if (
        acting_actor.actor.person
        and _measure_to_place(acting_actor.actor, part.at, acting_actor.view, acting_actor.channel)
        is None
    ):
        line = (acting_actor.spot(), acting_actor.view.place(part.at))
        acting_actor.channel.take_speed(steady(acting_actor.instant, 0.0), acting_actor.owner)
        acting_actor.channel.take_line(line, 0.0, None, acting_actor.owner, acting_actor.instant)
    return math.inf


def end_of_arrival(part: Arriving, acting_actor: ActingActor) -> None:
    """Keep the speed; a pedestrian stays where its line ends if that is the place."""
    line = acting_actor.channel.line
    at = acting_actor.view.place(part.at)
    if acting_actor.actor.person and line is not None and math.dist(line[-1], at) < _SAME:
        stay(acting_actor)
    else:
        acting_actor.channel.keep_speed()


def synchronise(part: Arriving, acting_actor: ActingActor, end: float) -> float:
    """Choose the speed that brings both there at one instant; for good once the other is steady.

    Raises
    ------
    CannotAct
        If one of them does not come by its place, or would have to be too fast.
    """
    if end < math.inf:
        return end
    view, channel = acting_actor.view, acting_actor.channel
    other = view.actor(part.to)
    if other is None:
        raise CannotAct(f"{part.to!r} is not on the road")
    theirs = _metres_to_place(other, part.when_at, view, acting_actor.channels.get(part.to))
    if theirs is None:
        raise CannotAct(f"{part.to!r} does not come by the place where it is to be met")
    done = acting_actor.instant - view.time
    mine = _own_rest(part, acting_actor)
    if other.speed < 0.1:
        channel.take_speed(steady(acting_actor.instant, 0.0), acting_actor.owner)
        return math.inf
    left = theirs / other.speed - done
    law = arrival_law(part, acting_actor.instant, mine, left, acting_actor.speed)
    needed = law.speed(acting_actor.instant) if left > 0.0 else math.inf
    fastest = FASTEST_WALKER if acting_actor.actor.person else FASTEST_VEHICLE
    if needed > fastest:
        raise CannotAct(f"it would have to go at {needed:.1f} m/s to be there in time")
    channel.take_speed(law, acting_actor.owner)
    settled = abs(other.acceleration) < _STEADY or left <= acting_actor.step
    return acting_actor.instant + left if settled else math.inf


def arrival_law(part: Arriving, instant: float, rest: float, left: float, speed: float) -> AnyLaw:
    """Speed that covers ``rest`` metres in ``left`` seconds, even or to the speed on arrival.

        D = rest - steady, T = left - steady/u, v the ``speed`` at first, u that on arrival, m/s
        w = D/T ± sqrt((D/T)² - (v + u) D/T + (v² + u²)/2), + where D/T > (v + u)/2

    From v it changes evenly to w and from there to u, both as fast: at (2 w - v - u)/T m/s². Where
    w would be negative the actor stands in between, and brakes and leaves at (v² + u²)/(2 D).
    Where there is no time left for a change its speed is even.
    """
    last = part.speed
    even = steady(instant, rest / left if left > 0.0 else math.inf)
    if last is None:
        return even
    metres, seconds = rest - part.steady, left - (part.steady / last if last else 0.0)
    if metres <= 0.0 or seconds <= _SAME:
        return even
    mean, middle = metres / seconds, (speed + last) / 2.0
    root = math.sqrt(max((mean - middle) ** 2 + (speed - last) ** 2 / 4.0, 0.0))
    between = mean + math.copysign(root, mean - middle)
    if between >= 0.0:
        gains = abs(between - speed) + abs(between - last)
        turn = seconds * (abs(between - speed) / gains if gains > _SAME else 0.5)
        return SpeedTable(instant, ((0.0, speed), (turn, between), (seconds, last)))
    pace = 2.0 * metres / (speed**2 + last**2)  # seconds for each m/s
    stops, leaves = pace * speed, seconds - pace * last
    return SpeedTable(instant, ((0.0, speed), (stops, 0.0), (leaves, 0.0), (seconds, last)))


def _own_rest(part: Arriving, acting_actor: ActingActor) -> float:
    """Metres from where the actor is at the instant to where it is to be."""
    rest = _metres_to_place(acting_actor.actor, part.at, acting_actor.view, acting_actor.channel)
    if rest is None:
        raise CannotAct("its route does not lead to the place")
    return rest - acting_actor.channel.metres(acting_actor.view.time, acting_actor.instant)


def _metres_to_place(
    actor: ActorView, place: RulePlace, view: RoadView, channel: Channel | None
) -> float | None:
    on_line = None if channel is None else _measure_to_place(actor, place, view, channel)
    if on_line is not None:
        return on_line
    if actor.person:
        return math.dist((actor.x, actor.y), view.place(place))
    return view.lane_distance(actor.id, place)


def _measure_to_place(
    actor: ActorView, place: RulePlace, view: RoadView, channel: Channel
) -> float | None:
    """Metres from the centre to a place that the actor's line leads by; ``None`` without one."""
    if channel.line is None or channel.held:  # what is held stands, whatever line that is on
        return None
    there = beside(channel.line, view.place(place))
    rest = there.along - channel.centre_along(actor)
    near = abs(there.left) < _BY and there.along < line_length(channel.line) + _BY
    return rest if near and rest > -_BY else None


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
        :class:`~odscen.scenario.story.channels.ActingActor`, takes over what the action needs,
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


def _begin_speed(part: SpeedChange, acting_actor: ActingActor) -> float:
    law = speed_change(part, acting_actor.instant, acting_actor.speed)
    acting_actor.channel.take_speed(law, acting_actor.owner)
    return law.end


def _begin_keep_speed(_: Any, acting_actor: ActingActor) -> None:
    acting_actor.channel.keep_speed()


def _begin_brake(part: Braking, acting_actor: ActingActor) -> float:
    law = braking(part.by, acting_actor.instant, acting_actor.speed)
    acting_actor.channel.take_speed(law, acting_actor.owner)
    return law.end + (part.hold or 0.0)


def _end_braking(part: Braking, acting_actor: ActingActor) -> None:
    if part.hold is None:
        acting_actor.channel.keep_speed()
    else:
        acting_actor.channel.release_speed(acting_actor.instant)


def _begin_stop(part: Stopping, acting_actor: ActingActor) -> float:
    law = stopping(part.within, acting_actor.instant, acting_actor.speed)
    acting_actor.channel.take_speed(law, acting_actor.owner)
    if acting_actor.actor.person and acting_actor.channel.line is None:
        (x, y), hdg = acting_actor.spot(), acting_actor.actor.hdg
        ahead = part.within or _HELD
        line = ((x, y), (x + ahead * math.cos(hdg), y + ahead * math.sin(hdg)))
        acting_actor.channel.take_line(line, 0.0, None, acting_actor.owner, acting_actor.instant)
    return law.end


def _finish_stop(_: Any, acting_actor: ActingActor) -> None:
    if acting_actor.actor.person:
        _end_line_here(acting_actor)
        stay(acting_actor)
    else:
        acting_actor.channel.keep_speed()


def _end_line_here(acting_actor: ActingActor) -> None:
    """Cut off what is left of the line of a person, who is held at the end of it."""
    channel, instant = acting_actor.channel, acting_actor.instant
    line = channel.line or ()
    along = channel.along + channel.metres(acting_actor.view.time, instant)
    if channel.held or not 0.0 < along < line_length(line) - _SAME:
        return
    place, before, passed = point_on(line, along), 0.0, [line[0]]
    for a, b in itertools.pairwise(line):
        before += math.dist(a, b)
        if before >= along:
            break
        passed.append(b)
    cut = (*passed, (place.x, place.y))
    headings = channel.headings
    if headings is not None:
        headings = (*headings[: len(passed)], heading_on(line, headings, along))
    channel.take_line(cut, along, None, acting_actor.owner, instant, headings=headings)


def _begin_go(_: Going, acting_actor: ActingActor) -> float:
    channel = acting_actor.channel
    if acting_actor.actor.person and channel.held:
        channel.release_line()
        channel.rejoins = True
    channel.release_speed(acting_actor.instant)
    return acting_actor.instant


def _keep_gap(part: GapKeeping, acting_actor: ActingActor) -> float:
    there = _follow_gap(part, acting_actor)
    if part.once and there:
        return acting_actor.instant
    return math.inf if part.lasting is None else acting_actor.instant + part.lasting


def _follow_on(part: GapKeeping, acting_actor: ActingActor, end: float) -> float:
    there = _follow_gap(part, acting_actor)
    return min(end, acting_actor.instant) if part.once and there else end


def _follow_gap(part: GapKeeping, acting_actor: ActingActor) -> bool:
    """Choose the speed of this step by the gap: faster where it is too long, slower if short.

    Returns whether the gap is what it should be, at the speed of the other one.
    """
    other = acting_actor.view.actor(part.to)
    if other is None:
        raise CannotAct(f"{part.to!r} is not on the road")
    me = acting_actor.actor
    c, s = math.cos(me.hdg), math.sin(me.hdg)
    ahead = (other.x - me.x) * c + (other.y - me.y) * s
    gap = (-ahead if part.ahead else ahead) - (me.length + other.length) / 2.0
    speed = acting_actor.speed
    behind = other.speed if part.ahead else speed
    wanted = part.metres if part.metres is not None else (part.seconds or 0.0) * behind
    error = wanted - gap if part.ahead else gap - wanted
    slowing = part.rate if part.braking is None else part.braking
    # Far away no faster than half the rate can take back in time.
    faster = min(_GAP_GAIN * abs(error), math.sqrt(min(part.rate, slowing) * abs(error)))
    target = max(0.0, other.speed + math.copysign(faster, error))
    step = acting_actor.step
    reached = min(max(target, speed - slowing * step), speed + part.rate * step)
    left = acting_actor.view.time + acting_actor.step - acting_actor.instant
    law = SpeedLaw(acting_actor.instant, speed, reached, max(left, 1e-9))
    acting_actor.channel.take_speed(law, acting_actor.owner)
    return abs(error) < _GAP_REACHED and abs(other.speed - speed) < _GAP_REACHED


def _begin_vanish(_: Vanishing, acting_actor: ActingActor) -> float:
    acting_actor.channel.vanishes = True
    return acting_actor.instant


def _begin_ignore(part: Ignoring, acting_actor: ActingActor) -> float:
    acting_actor.channel.ignore_red, acting_actor.channel.ignore_right_of_way = (
        part.red,
        part.right_of_way,
    )
    return acting_actor.instant


def _begin_release(_: Releasing, acting_actor: ActingActor) -> float:
    channel = acting_actor.channel
    channel.rejoins = acting_actor.actor.person and channel.line is not None
    channel.by_story = channel.usually_by_story
    channel.release_line()
    channel.release_speed(acting_actor.instant)
    channel.ignore_red = channel.ignore_right_of_way = channel.keeps_lane = False
    channel.lights = None
    return acting_actor.instant


def _begin_drive(part: Driving, acting_actor: ActingActor) -> float:
    if part.by == "story":
        acting_actor.channel.drive_by_story(acting_actor.instant)
    else:
        acting_actor.channel.drive_by_sumo(acting_actor.instant)
    return acting_actor.instant


_MIRRORED = "mirrored"
"""What CARLA does: it shows what SUMO does."""

ACTIONS = {
    action_kind.name: action_kind
    for action_kind in (
        ActionKind(
            "speed", "reach `to` at a `rate`, `over` seconds or `within` metres; then keep it, as "
            "far as traffic allows. Shapes: `step`, `linear`, `cosine`, `cubic`", "m/s, m/s², s, m",
            "`setSpeed` each step", "SpeedAction", _MIRRORED, _begin_speed,
            finish=_begin_keep_speed,
        ),
        ActionKind(
            "brake", "brake with `by` to a standstill, whatever the vehicle type allows; SUMO "
            "drives on after `hold` seconds, without it not before `go` or `release`", "m/s², s",
            "`setSpeed` each step", "SpeedAction to 0", _MIRRORED, _begin_brake,
            finish=_end_braking,
        ),
        ActionKind(
            "stop", "stand after exactly `within` metres, at once without it; until `go`", "m",
            "`setSpeed`; persons are held in place", "SpeedAction to 0", _MIRRORED, _begin_stop,
            finish=_finish_stop,
        ),
        ActionKind(
            "go", "SUMO chooses the speed again", "", "`setSpeed(-1)`", "ActivateControllerAction",
            _MIRRORED, _begin_go,
        ),
        ActionKind(
            "lane", "change `by` lanes to the left (negative: right), or to the lane that leads "
            "`to` a place, and there `offset` metres to the left of its centre: `over` so many "
            "seconds, `within` so many metres or with `rate` to the side at most; the speed stays "
            "unless another action changes it. Shapes: `cosine`, `cubic`, `linear`", "s, m, m/s",
            "`moveToXY`", "LaneChangeAction", _MIRRORED, change_lane, lane_lasts,
            leave_line, vehicles_only=True,
        ),
        ActionKind(
            "cut_in", "change into the lane of `to`, with the measures and shapes of `lane`; with "
            "`gap` the speed changes evenly so that the gap behind it is that in the end, if `to` "
            "keeps its speed", "m, s", "`moveToXY`, `setSpeed`",
            "LaneChangeAction (RelativeTargetLane), SpeedAction", _MIRRORED, cut_in,
            cut_in_further, after_cut_in, vehicles_only=True,
        ),
        ActionKind(
            "offset", "move the front to `to` metres left of the lane's centre, with the measures "
            "and shapes of `lane`", "m, s, m/s", "`moveToXY`", "LaneOffsetAction", _MIRRORED,
            move_aside, lane_lasts, leave_aside, vehicles_only=True,
        ),
        ActionKind(
            "keep_gap", "follow `to`, or drive `ahead` of it, at a free gap of `metres`, or of "
            "`seconds` at the speed of the one behind, "
            "with `rate` at most, and `braking` where it brakes otherwise; for `lasting` seconds, "
            "or `once`: until it is that", "m, s, m/s²",
            "`setSpeed` each step",
            "LongitudinalDistanceAction", _MIRRORED, _keep_gap, _follow_on, _begin_keep_speed,
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
            "The point so many metres `behind` the front of a vehicle is on the line; `backwards` "
            "the vehicle heads against it. "
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
            "speed is settled once that of `to` is steady; with `speed` it changes from its own to "
            "one in between and from there to that, equally hard, and waits in between where it "
            "would be too early; `speed` is reached `steady` metres before the place", "m/s, m",
            "`setSpeed` or `person.moveToXY`", "SynchronizeAction", _MIRRORED, arrive,
            synchronise, end_of_arrival,
        ),
        ActionKind(
            "appear", "be on the road from now on, where it is placed or `at` x, y and heading of "
            "its centre, with its initial or a given `speed`; before that it is not there; whom "
            "the story drives is first seen a step later, where it has driven by then", "m/s",
            "`add` on a whole step", "AddEntityAction", _MIRRORED, update=has_appeared,
            ask=ask_to_appear, says=lambda _: "appears",
        ),
        ActionKind(
            "vanish", "leave the simulation", "", "`remove`", "DeleteEntityAction", _MIRRORED,
            _begin_vanish,
        ),
        ActionKind(
            "end", "end the run, which is then complete; nothing moves after that step", "",
            "no further step", "StopTrigger of the storyboard", _MIRRORED, ask=ask_to_end,
            says=said_of_end,
        ),
        ActionKind(
            "ignore", "heed no `red`, or no `right_of_way`", "", "`setSpeedMode`",
            "none", _MIRRORED, _begin_ignore, vehicles_only=True,
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
            "release", "it is driven as if there had been no rule: by its `driver`", "",
            "all of the above undone",
            "ActivateControllerAction", _MIRRORED, _begin_release,
        ),
        ActionKind(
            "drive", "from now on the vehicle is driven `by` the `story` alone (it keeps speed and "
            "lane until a rule changes them, and hits what is in the way) or by SUMO", "",
            "`setSpeed` each step, without SUMO's checks", "ActivateControllerAction", _MIRRORED,
            _begin_drive, vehicles_only=True,
        ),
        ActionKind(
            "own", "a `kind` that an installed package gives, with its `values`", "its own",
            "its own", "none", _MIRRORED,
        ),
    )
}  # fmt: skip
"""All kinds by name."""
