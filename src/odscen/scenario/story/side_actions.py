"""Actions that move a vehicle sideways: to another lane, in front of another, beside its lane."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from odscen.scenario.story.acting_actor import CannotAct
from odscen.scenario.story.side_motion import SideLaw, beside, line_length, point_on
from odscen.scenario.story.speed_laws import SpeedLaw

if TYPE_CHECKING:
    from odscen.scenario.document.actions_document import CuttingIn, LaneChange, LateralMove
    from odscen.scenario.story.acting_actor import ActingActor
    from odscen.scenario.story.road_view import ActorView, Point

FASTEST = 70.0
"""m/s; a cut-in that needs more is not possible."""
_ON_LANE = 2.0
"""Metres from the centre of a lane at which the front of a vehicle is still on it."""


def change_lane(part: LaneChange, one: ActingActor) -> float:
    """Begin a lane change.

    Raises
    ------
    CannotAct
        If there is no such lane.
    """
    if part.to is not None:
        line = one.view.lane_line_to(one.actor.id, part.to)
        missing = "none of the lanes beside it leads to the place"
    else:
        by = part.by or 0
        line = _back_in_lane(by, one) or one.view.lane_line(one.actor.id, by)
        missing = f"there is no lane {abs(by)} to the {'left' if by > 0 else 'right'} for it"
    if line is None or not _leads_on(line, _front(one), one.actor.hdg):
        raise CannotAct(missing)
    _beside_lane(line, 0.0, part.over, one)
    return one.instant + part.over


def _back_in_lane(by: int, one: ActingActor) -> tuple[Point, ...] | None:
    """The lane beside which a vehicle is led, if that is the next one that way.

    Beside all lanes and in an opposite lane, SUMO does not know which lane it came from.
    """
    line, side = one.channel.line, one.channel.side
    if line is None or side is None or by != -math.copysign(1, side.e1) or abs(side.e1) < _ON_LANE:
        return None
    under = one.view.lane_line(one.actor.id, 0)
    own_way = under is not None and _leads_on(under, _front(one), one.actor.hdg)
    return None if own_way else line


def _leads_on(line: tuple[Point, ...], point: Point, hdg: float) -> bool:
    """Whether a line leads by a point in about a direction."""
    return math.cos(point_on(line, beside(line, point).along).hdg - hdg) > 0.0


def move_aside(part: LateralMove, one: ActingActor) -> float:
    """Begin to move to an offset.

    Raises
    ------
    CannotAct
        If the actor is on no lane.
    """
    # Far beside its lane SUMO has it on another one, or none: what follows is about the lane that
    # it was led along until now.
    led = one.channel.line if one.channel.side is not None else None
    line = led or one.view.lane_line(one.actor.id, 0)
    if line is None:
        raise CannotAct("it is on no lane")
    _beside_lane(line, part.to, part.over, one)
    return one.instant + part.over


def cut_in(part: CuttingIn, one: ActingActor) -> float:
    """Begin to change into the lane of another.

    Raises
    ------
    CannotAct
        If that is not on a lane of the road, or the gap cannot be reached in time.
    """
    other = _other(part, one)
    line = one.view.lane_line(part.to, 0)
    if line is None:
        raise CannotAct(f"{part.to!r} is on no lane")
    _beside_lane(line, 0.0, part.over, one)
    end = one.instant + part.over
    _reach_gap(part, one, other, end)
    return end


def cut_in_further(part: CuttingIn, one: ActingActor, end: float) -> float:
    """Choose the speed of this step by the gap that is left, until it is half over.

    Then the actor is in the other lane, and the other one may brake for it.

    Raises
    ------
    CannotAct
        If the lane ends, or the gap cannot be reached in time.
    """
    lane_lasts(part, one, end)
    if end - one.instant > part.over / 2.0:
        _reach_gap(part, one, _other(part, one), end)
    return end


def after_cut_in(part: CuttingIn, one: ActingActor) -> None:
    """Let SUMO drive on."""
    if part.gap is not None:
        one.channel.release_speed(one.instant)
    leave_line(part, one)


def lane_lasts(_: object, one: ActingActor, end: float) -> float:
    """Look whether the lane goes on.

    Raises
    ------
    CannotAct
        If it ends in this step.
    """
    channel = one.channel
    metres = channel.metres(one.instant, one.instant + one.step)
    if channel.along + metres > line_length(channel.line or ()):
        raise CannotAct("the lane ends before it is there")
    return end


def leave_aside(part: LateralMove, one: ActingActor) -> None:
    """Leave the line with this step if it ends on a lane that leads the same way.

    Elsewhere the line is followed on: beside all lanes, or in an opposite lane, where SUMO would
    turn the vehicle round.
    """
    line = one.channel.line
    if line is None or abs(part.to) < _ON_LANE:
        one.channel.leaves = True
        return
    x, y, hdg = point_on(line, one.channel.along, left=part.to)
    for by in (0, 1 if part.to > 0 else -1):
        lane = one.view.lane_line(one.actor.id, by)
        if lane is None or abs(beside(lane, (x, y)).left) >= _ON_LANE:
            continue
        if _leads_on(lane, (x, y), hdg):
            one.channel.leaves = True


def leave_line(_: object, one: ActingActor) -> None:
    """Leave the line with this step."""
    one.channel.leaves = True


def _other(part: CuttingIn, one: ActingActor) -> ActorView:
    other = one.view.actor(part.to)
    if other is None or other.person:
        raise CannotAct(f"{part.to!r} does not drive on the road")
    return other


def _beside_lane(line: tuple[Point, ...], left: float, over: float, one: ActingActor) -> None:
    """Move the front to ``left`` metres of a line."""
    place = beside(line, _front(one))
    side = SideLaw(one.instant, place.left, left, over)
    one.channel.take_line(line, place.along, side, one.owner, one.instant)
    one.channel.keeps_lane = True


def _front(one: ActingActor) -> Point:
    actor = one.actor
    ahead = actor.length / 2.0 + one.channel.metres(one.view.time, one.instant)
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
    mine = beside(line, _front(one)).along
    gap = mine - one.actor.length - theirs
    v, u = one.speed, other.speed
    v1 = 2.0 * ((part.gap - gap) / left + u) - v
    if not 0.0 <= v1 <= FASTEST:
        raise CannotAct(f"it would have to reach {v1:.1f} m/s for a gap of {part.gap:g} m in time")
    one.channel.take_speed(SpeedLaw(one.instant, v, v1, left), one.owner)
