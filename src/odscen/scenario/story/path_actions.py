"""Actions that lead an actor along a line over the ground: walks, drawn paths, recorded motion."""

from __future__ import annotations

import itertools
import math
from bisect import bisect_left, bisect_right
from typing import TYPE_CHECKING

from odscen.scenario.story.acting_actor import CannotAct
from odscen.scenario.story.side_motion import line_length
from odscen.scenario.story.speed_laws import SpeedTable, steady

if TYPE_CHECKING:
    from odscen.scenario.document.actions_document import (
        PathFollowing,
        Replaying,
        TrajectoryRow,
        Walking,
    )
    from odscen.scenario.document.conditions_document import RulePlace
    from odscen.scenario.story.acting_actor import ActingActor
    from odscen.scenario.story.road_view import Point

_SHORT = 1e-9
"""Seconds in which no one moves."""


def walk(part: Walking, one: ActingActor) -> float:
    """Begin to walk straight to a place."""
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


def on_the_line(_: object, one: ActingActor, __: float) -> float:
    """When the end of the line is reached, if it is in this step."""
    end = one.channel.reaches_end(one.instant, one.instant + one.step)
    return math.inf if end is None else end


def end_of_walk(part: Walking, one: ActingActor) -> None:
    """Stay there; on a sidewalk, walk on with the next step."""
    _leave_or_stay(part.to, one)


def stay(one: ActingActor) -> None:
    """Let a person stand where its line ends."""
    channel = one.channel
    channel.take_speed(steady(one.instant, 0.0), None)
    channel.held = True


def _leave_or_stay(place: RulePlace, one: ActingActor) -> None:
    stay(one)
    one.channel.leaves = isinstance(place, str) and place.startswith("ped.")


def follow_path(part: PathFollowing, one: ActingActor) -> float:
    """Begin to follow a drawn path; the front of a vehicle is on it, the centre of a person.

    Raises
    ------
    CannotAct
        If the actor stands, and no rule says how fast it goes; or who the points are relative to
        is not on the road.
    """
    points = _points(part, one)
    line = (_own_point(one), *points)
    if line_length(line) < 1e-6:
        return one.instant
    channel = one.channel
    if part.times or part.speeds:
        legs = [math.dist(a, b) for a, b in itertools.pairwise(line)]
        knots = _timed(legs, part.times) if part.times else _at_points(legs, part.speeds, one.speed)
        table = SpeedTable(one.instant, knots)
        channel.take_speed(table, one.owner)
        channel.take_line(line, 0.0, None, one.owner, one.instant)
        return table.end
    if one.actor.person or part.speed is not None:
        _along_line(line, part.speed, one)
    elif one.speed > 0.0 or channel.law is not None:
        channel.take_line(line, 0.0, None, one.owner, one.instant)
    else:
        raise CannotAct("it is stopped; the path has to say how fast it is followed")
    return math.inf


def _points(part: PathFollowing, one: ActingActor) -> list[Point]:
    if part.relative_to is None:
        return [one.view.place(place) for place in part.points]
    base = one.view.actor(part.relative_to)
    if base is None:
        raise CannotAct(f"{part.relative_to!r} is not on the road")
    # The actor itself is where it is at the instant of the begin, within the step.
    x, y = one.spot() if part.relative_to == one.actor.id else (base.x, base.y)
    c, s = math.cos(base.hdg), math.sin(base.hdg)
    return [
        (x + ahead * c - left * s, y + ahead * s + left * c)
        for ahead, left in (one.view.place(place) for place in part.points)
    ]


def on_the_path(part: PathFollowing, one: ActingActor, end: float) -> float:
    """When the end of the path is reached."""
    return end if end < math.inf else on_the_line(part, one, end)


def end_of_path(part: PathFollowing, one: ActingActor) -> None:
    """Give a vehicle back to SUMO; a person stays unless it is on a sidewalk."""
    if one.actor.person:
        _leave_or_stay(part.points[-1], one)
    else:
        one.channel.release_speed(one.instant)
        one.channel.leaves = True


def replay(part: Replaying, one: ActingActor) -> float:
    """Begin to be where a recorded road user was."""
    end = one.instant + part.rows[-1][0]
    _replay_until(part, one, one.instant)
    return end


def replay_further(part: Replaying, one: ActingActor, end: float) -> float:
    """Hand over the rows of this step."""
    _replay_until(part, one, end - part.rows[-1][0])
    return end


def end_of_replay(_: Replaying, one: ActingActor) -> None:
    """Give a vehicle back to SUMO, with the last speed; a person stays."""
    if one.actor.person:
        stay(one)
    else:
        one.channel.release_speed(one.instant)
        one.channel.leaves = True


def _replay_until(part: Replaying, one: ActingActor, begin: float) -> None:
    """Lead the actor through the rows of this step, in a run that began at ``begin``.

    A step is handed over at a time, however long the recording is.
    """
    start = one.instant - begin
    stop = min(one.view.time + one.step - begin, part.rows[-1][0])
    times = _Times(part.rows)
    inside = part.rows[bisect_right(times, start) : bisect_left(times, stop)]
    rows = [_row_at(part.rows, times, start), *inside]
    if stop - start > _SHORT:
        rows.append(_row_at(part.rows, times, stop))
    half = 0.0 if one.actor.person else one.actor.length / 2.0
    line = tuple((x + half * math.cos(hdg), y + half * math.sin(hdg)) for _, x, y, hdg in rows)
    knots: list[tuple[float, float]] = []
    for (a, b), (p, q) in zip(itertools.pairwise(rows), itertools.pairwise(line), strict=True):
        speed = math.dist(p, q) / (b[0] - a[0])
        knots += [(a[0] - start, speed), (b[0] - start, speed)]
    if not knots:
        line, knots = (*line, *line), [(0.0, 0.0)]
        rows = [*rows, *rows]
    table = SpeedTable(one.instant, tuple(knots))
    one.channel.take_speed(table, one.owner)
    one.channel.take_line(
        line, 0.0, None, one.owner, one.instant, headings=tuple(row[3] for row in rows)
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


def _own_point(one: ActingActor) -> Point:
    x, y = one.spot()
    half = 0.0 if one.actor.person else one.actor.length / 2.0
    return x + half * math.cos(one.actor.hdg), y + half * math.sin(one.actor.hdg)


def _timed(legs: list[float], times: tuple[float, ...]) -> tuple[tuple[float, float], ...]:
    knots: list[tuple[float, float]] = []
    for length, (begin, end) in zip(legs, itertools.pairwise((0.0, *times)), strict=True):
        speed = length / (end - begin)
        knots += [(begin, speed), (end, speed)]
    return tuple(knots)


def _at_points(
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
