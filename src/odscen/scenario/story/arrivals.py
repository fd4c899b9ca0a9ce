"""Two that are to be at their places at one instant."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from odscen.scenario.story.acting_actor import CannotAct
from odscen.scenario.story.path_actions import stay
from odscen.scenario.story.side_motion import beside, line_length
from odscen.scenario.story.speed_laws import SpeedTable, steady

if TYPE_CHECKING:
    from odscen.scenario.document.actions_document import Arriving
    from odscen.scenario.document.conditions_document import RulePlace
    from odscen.scenario.story.acting_actor import ActingActor
    from odscen.scenario.story.channels import Channel
    from odscen.scenario.story.road_view import ActorView, RoadView
    from odscen.scenario.story.speed_laws import AnyLaw

FASTEST_VEHICLE, FASTEST_WALKER = 70.0, 10.0
"""m/s; who would have to be faster cannot arrive in time."""
_STEADY = 0.05
"""m/s^2 of acceleration below which a speed counts as steady."""
_BY = 1.5
"""Metres between a line and a place that it leads by."""
_SAME = 1e-6


def arrive(part: Arriving, one: ActingActor) -> float:
    """Begin: a pedestrian goes straight to the place, unless it is on a line that leads there."""
    if one.actor.person and _on_line(one.actor, part.at, one.view, one.channel) is None:
        line = (one.spot(), one.view.place(part.at))
        one.channel.take_speed(steady(one.instant, 0.0), one.owner)
        one.channel.take_line(line, 0.0, None, one.owner, one.instant)
    return math.inf


def end_of_arrival(part: Arriving, one: ActingActor) -> None:
    """Keep the speed; a pedestrian stays where its line ends if that is the place."""
    line = one.channel.line
    at = one.view.place(part.at)
    if one.actor.person and line is not None and math.dist(line[-1], at) < _SAME:
        stay(one)
    else:
        one.channel.keep_speed()


def synchronise(part: Arriving, one: ActingActor, end: float) -> float:
    """Choose the speed that brings both there at one instant; for good once the other is steady.

    Raises
    ------
    CannotAct
        If one of them does not come by its place, or would have to be too fast.
    """
    if end < math.inf:
        return end
    view, channel = one.view, one.channel
    other = view.actor(part.to)
    if other is None:
        raise CannotAct(f"{part.to!r} is not on the road")
    theirs = _rest(other, part.when_at, view, one.channels.get(part.to))
    if theirs is None:
        raise CannotAct(f"{part.to!r} does not come by the place where it is to be met")
    done = one.instant - view.time
    mine = _own_rest(part, one)
    if other.speed < 0.1:
        channel.take_speed(steady(one.instant, 0.0), one.owner)
        return math.inf
    left = theirs / other.speed - done
    law = arrival_law(part, one.instant, mine, left)
    needed = law.speed(one.instant) if left > 0.0 else math.inf
    fastest = FASTEST_WALKER if one.actor.person else FASTEST_VEHICLE
    if needed > fastest:
        raise CannotAct(f"it would have to go at {needed:.1f} m/s to be there in time")
    channel.take_speed(law, one.owner)
    settled = abs(other.acceleration) < _STEADY or left <= one.step
    return one.instant + left if settled else math.inf


def arrival_law(part: Arriving, instant: float, rest: float, left: float) -> AnyLaw:
    """Speed that covers ``rest`` metres in ``left`` seconds, even or to the speed on arrival.

        D = rest - steady, T = left - steady/u, u the speed on arrival: v = 2 D/T - u

    From v it changes evenly to u, within T. Where v would be negative the actor first stands; where
    there is no time left for a change its speed is even.
    """
    last = part.speed
    even = steady(instant, rest / left if left > 0.0 else math.inf)
    if last is None:
        return even
    metres, seconds = rest - part.steady, left - (part.steady / last if last else 0.0)
    if metres <= 0.0 or seconds <= _SAME:
        return even
    first = 2.0 * metres / seconds - last
    if first >= 0.0:
        return SpeedTable(instant, ((0.0, first), (seconds, last)))
    waits = seconds - 2.0 * metres / last
    return SpeedTable(instant, ((0.0, 0.0), (waits, 0.0), (seconds, last)))


def _own_rest(part: Arriving, one: ActingActor) -> float:
    """Metres from where the actor is at the instant to where it is to be."""
    rest = _rest(one.actor, part.at, one.view, one.channel)
    if rest is None:
        raise CannotAct("its route does not lead to the place")
    return rest - one.channel.metres(one.view.time, one.instant)


def _rest(
    actor: ActorView, place: RulePlace, view: RoadView, channel: Channel | None
) -> float | None:
    on_line = None if channel is None else _on_line(actor, place, view, channel)
    if on_line is not None:
        return on_line
    if actor.person:
        return math.dist((actor.x, actor.y), view.place(place))
    return view.lane_distance(actor.id, place)


def _on_line(actor: ActorView, place: RulePlace, view: RoadView, channel: Channel) -> float | None:
    """Metres from the centre to a place that the actor's line leads by; ``None`` without one."""
    if channel.line is None or channel.held:  # what is held stands, whatever line that is on
        return None
    there = beside(channel.line, view.place(place))
    centre = channel.along - (0.0 if actor.person else actor.length / 2.0)
    rest = there.along - centre
    near = abs(there.left) < _BY and there.along < line_length(channel.line) + _BY
    return rest if near and rest > -_BY else None
