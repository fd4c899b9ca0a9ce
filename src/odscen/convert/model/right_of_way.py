"""Right of way in a junction: which movements meet, and who lets whom go first.

Conflicts are found on the ground, between the true centre lines of the movements. Of two that
meet, the first of these rules that distinguishes them decides:

1. vehicles give way to persons on crossings;
2. in a roundabout, what comes from outside gives way to what is inside;
3. stop gives way to yield and yield to all others;
4. ``<priority>`` of the OpenDRIVE junction;
5. where lanes only merge, the faster road goes first; of equally fast ones a ramp gives way to a
   main line with lanes beside, unless that is a carriageway of its own, which makes room for the
   ramp; where both or none have lanes beside, vehicles go in turn;
6. one who turns across gives way to oncoming traffic that does not;
7. the major road, where there is one: junctions with lights, large ones and some others have
   (:mod:`odscen.convert.building.junction_ruling`);
8. right before left (left before right where traffic keeps left).

At lights, and among those from one road, the sixth rule comes before the fourth.

Where all approaches have to stop, everybody waits for everybody else instead.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import IntEnum
from typing import TYPE_CHECKING, NamedTuple

import shapely

from odscen.convert.model.net import Request

if TYPE_CHECKING:
    from collections.abc import Sequence

    from odscen.base.arrays import FloatArray


MOST_WIDTH = 2.0
"""Metres between two centre lines on which vehicles are taken to touch; less for narrow lanes."""

WIDTH_SHARE = 0.45
"""Share of the sum of two lanes' widths that takes the place of :data:`MOST_WIDTH` if smaller."""

LEVEL = 3.0
"""Metres of height between movements that do not meet."""

WALKER_REACH = 1.0
"""Metres beside a movement's centre line that a vehicle needs free of persons."""

OPPOSING = math.radians(125.0)
"""Difference of headings from which approaches are opposite each other."""

_FASTER = 2.0
"""m/s by which a road must be faster to go first where lanes merge."""

_MEDIAN = 6.0
"""Metres between the lanes of both directions from which on each is a carriageway of its own.

More than a lane for turns between them takes.
"""

_BESIDE = math.radians(75.0)
"""Difference of headings up to which two roads run into each other rather than meet."""


class Sign(IntEnum):
    """What makes an approach wait; more has less right."""

    NONE = 0
    YIELD = 1
    STOP = 2


@dataclass(frozen=True, slots=True, eq=False)
class Movement:
    """A movement through a junction.

    Attributes
    ----------
    source, target
        Lanes as (edge, index): equal ones are the same lane.
    shape
        Shape ``(K, 3)``.
    width
        Metres, of the narrower of the lanes before and after.
    heading_in, heading_out
        Radians.
    speed
        m/s, of the edge before.
    sign
        The sign at the approach.
    in_roundabout
        Whether it comes from within a roundabout.
    roads
        OpenDRIVE road that it comes from, and connecting roads that it runs over: files name either
        in ``<priority>``.
    """

    source: tuple[str, int]
    target: tuple[str, int]
    shape: FloatArray
    width: float
    heading_in: float
    heading_out: float
    speed: float
    sign: Sign
    in_roundabout: bool
    roads: frozenset[str]

    @property
    def turn(self) -> float:
        """Change of heading in (-pi, pi], left is positive."""
        return wrapped(self.heading_out - self.heading_in)


class Walkway(NamedTuple):
    """A crossing: its middle line ``(2, 3)`` and width, metres."""

    axis: FloatArray
    width: float


class Conflicts(NamedTuple):
    """Pairs of movements that meet (smaller first), and for each crossing the movements over it."""

    pairs: tuple[tuple[int, int], ...]
    merging: frozenset[tuple[int, int]]
    crossed: tuple[tuple[int, ...], ...]


def wrapped(angle: float) -> float:
    """Angle in (-pi, pi]."""
    return math.pi - (math.pi - angle) % (2.0 * math.pi)


def find_conflicts(movements: Sequence[Movement], walkways: Sequence[Walkway]) -> Conflicts:
    """Find what meets in one junction.

    Movements that come from one edge, or lead to one edge, run side by side there: they meet only
    if they cross. All others meet if they come closer than a vehicle is wide.
    """
    lines = [shapely.LineString(movement.shape[:, :2]) for movement in movements]
    pairs: list[tuple[int, int]] = []
    merging: set[tuple[int, int]] = set()
    if len(movements) > 1:
        tree = shapely.STRtree(lines)
        near = tree.query(lines, predicate="dwithin", distance=MOST_WIDTH)
        for i, j in sorted(zip(*near.tolist(), strict=True)):
            if i >= j:
                continue
            kind = _meeting_kind(movements[i], movements[j], lines[i], lines[j])
            if kind:
                pairs.append((i, j))
                if kind == "merge":
                    merging.add((i, j))
    crossed = tuple(_crossed_movements(walkway, movements, lines) for walkway in walkways)
    return Conflicts(tuple(pairs), frozenset(merging), crossed)


def _meeting_kind(
    one: Movement, other: Movement, line: shapely.LineString, line2: shapely.LineString
) -> str:
    if one.source == other.source:
        return ""
    if one.target == other.target:
        return "merge"
    if one.source[0] == other.source[0] or one.target[0] == other.target[0]:
        return "cross" if _truly_cross(line, line2) else ""
    reach = min(MOST_WIDTH, WIDTH_SHARE * (one.width + other.width))
    if line.distance(line2) >= reach or not _are_on_one_level(one.shape, other.shape):
        return ""
    return "cross"


def _truly_cross(one: shapely.LineString, other: shapely.LineString) -> bool:
    """Whether lines cross elsewhere than where they begin or end."""
    if not one.intersects(other):
        return False
    shared = one.intersection(other)
    ends = shapely.MultiPoint([one.coords[0], one.coords[-1], other.coords[0], other.coords[-1]])
    rest = shared.difference(ends.buffer(0.5))
    return not rest.is_empty


def _are_on_one_level(one: FloatArray, other: FloatArray) -> bool:
    low = max(float(one[:, 2].min()), float(other[:, 2].min()))
    high = min(float(one[:, 2].max()), float(other[:, 2].max()))
    return low - high < LEVEL


def _crossed_movements(
    walkway: Walkway, movements: Sequence[Movement], lines: Sequence[shapely.LineString]
) -> tuple[int, ...]:
    area = shapely.LineString(walkway.axis[:, :2]).buffer(walkway.width / 2.0, cap_style="flat")
    return tuple(
        index
        for index, (movement, line) in enumerate(zip(movements, lines, strict=True))
        if area.distance(line) < WALKER_REACH and _are_on_one_level(walkway.axis, movement.shape)
    )


class Rules(NamedTuple):
    """What a junction says on right of way, beyond its movements.

    ``major`` are the edges of the major road that lead there.
    """

    high_low: frozenset[tuple[str, str]] = frozenset()
    lefthand: bool = False
    all_stop: bool = False
    signalled: bool = False
    major: frozenset[str] = frozenset()


def requests(
    movements: Sequence[Movement], conflicts: Conflicts, rules: Rules
) -> tuple[Request, ...]:
    """Requests of all links of a junction: first the movements, then the crossings."""
    count = len(movements)
    foes: list[set[int]] = [set() for _ in range(count + len(conflicts.crossed))]
    yields: list[set[int]] = [set() for _ in foes]
    only_merges = len(conflicts.merging) == len(conflicts.pairs)
    turns = in_turn(movements, conflicts, rules)
    room = making_room(movements, conflicts, rules)
    for i, j in conflicts.pairs:
        foes[i].add(j)
        foes[j].add(i)
        if rules.all_stop or (i, j) in turns:
            yields[i].add(j)
            yields[j].add(i)
        elif (i, j) in room or (
            (j, i) not in room
            and _gives_way(
                movements[i], movements[j], rules, (i, j) in conflicts.merging, only_merges
            )
        ):
            yields[i].add(j)
        else:
            yields[j].add(i)
    for number, crossed in enumerate(conflicts.crossed):
        for link in crossed:
            foes[link].add(count + number)
            foes[count + number].add(link)
            yields[link].add(count + number)
    return tuple(
        Request(frozenset(before), frozenset(met)) for before, met in zip(yields, foes, strict=True)
    )


def in_turn(
    movements: Sequence[Movement], conflicts: Conflicts, rules: Rules
) -> frozenset[tuple[int, int]]:
    """Pairs of movements into one lane that go in turn, like the teeth of a zipper.

    So they do where a junction has no other conflicts and nothing says who goes first: otherwise
    one of two roads that are full would never get in.
    """
    return frozenset(
        (i, j)
        for i, j in _find_equal_pairs(movements, conflicts, rules)
        if _has_lane_beside(movements, i) == _has_lane_beside(movements, j)
    )


def making_room(
    movements: Sequence[Movement], conflicts: Conflicts, rules: Rules
) -> frozenset[tuple[int, int]]:
    """Pairs of movements into one lane of which the first makes room for the second.

    A ramp has this lane only, the main line others beside it that lead on. The ramp waits, but on
    a carriageway of its own, a motorway: going in turn, both slow down to some 2 m/s and 800
    vehicles an hour; where the ramp waits, the loops of a cloverleaf, each of which leads to the
    next merge, lock for good. There drivers of the motorway make room, as they do in reality.
    """
    pairs = []
    for i, j in _find_equal_pairs(movements, conflicts, rules):
        if _has_lane_beside(movements, i) != _has_lane_beside(movements, j):
            main, ramp = (i, j) if _has_lane_beside(movements, i) else (j, i)
            pairs.append((ramp, main) if _is_two_way(movements, main) else (main, ramp))
    return frozenset(pairs)


def _is_two_way(movements: Sequence[Movement], number: int) -> bool:
    """Whether traffic comes the opposite way on the same carriageway: no median is between."""
    main = movements[number]
    s, c = math.sin(main.heading_in), math.cos(main.heading_in)
    own = [movement for movement in movements if movement.source[0] == main.source[0]]
    return any(
        abs(wrapped(other.heading_in - main.heading_in)) > OPPOSING
        # Where one drives in, the other one comes out.
        and abs((y - movement.shape[0, 1]) * c - (x - movement.shape[0, 0]) * s) - movement.width
        < _MEDIAN
        for other in movements
        for x, y in (other.shape[-1, :2].tolist(),)
        for movement in own
    )


def _has_lane_beside(movements: Sequence[Movement], number: int) -> bool:
    """Whether another lane of the same road leads to the same road."""
    own = movements[number]
    return any(
        other.source[0] == own.source[0]
        and other.source != own.source
        and other.target[0] == own.target[0]
        and other.target != own.target
        for other in movements
    )


def _find_equal_pairs(
    movements: Sequence[Movement], conflicts: Conflicts, rules: Rules
) -> frozenset[tuple[int, int]]:
    """Pairs of movements that merge where nothing else meets and nothing says who goes first."""
    if rules.all_stop or rules.signalled or len(conflicts.merging) < len(conflicts.pairs):
        return frozenset()
    return frozenset(
        (i, j)
        for i, j in conflicts.merging
        if not conflicts.crossed and _are_equal(movements[i], movements[j], rules)
    )


def _are_equal(one: Movement, other: Movement, rules: Rules) -> bool:
    return (
        one.in_roundabout == other.in_roundabout
        and one.sign == other.sign
        and one.source[0] != other.source[0]
        and _stated_priority(one, other, rules) is None
        and abs(one.speed - other.speed) <= _FASTER
        and abs(wrapped(one.heading_in - other.heading_in)) < _BESIDE
    )


def _gives_way(
    one: Movement, other: Movement, rules: Rules, merge: bool, only_merges: bool
) -> bool:
    """Whether ``one`` gives way to ``other``; exactly one of the two does."""
    if one.in_roundabout != other.in_roundabout:
        return other.in_roundabout
    if one.sign != other.sign:
        return one.sign > other.sign
    side = -1.0 if rules.lefthand else 1.0
    if rules.signalled or one.source[0] == other.source[0]:
        # Those who may have green together: what drivers expect comes before what the map says.
        turning = _turns_across(one, other, side)
        if turning is not None:
            return turning
    stated = _stated_priority(one, other, rules)
    if stated is not None:
        return stated
    if merge and (only_merges or abs(wrapped(one.heading_in - other.heading_in)) < math.pi / 4):
        if abs(one.speed - other.speed) > _FASTER:
            return one.speed < other.speed
        if abs(abs(one.turn) - abs(other.turn)) > 0.05:
            return abs(one.turn) > abs(other.turn)
    return _waits_by_place(one, other, rules, side)


def _stated_priority(one: Movement, other: Movement, rules: Rules) -> bool | None:
    """What ``<priority>`` says on who gives way, if anything that does not contradict itself."""
    pairs = [(mine, theirs) for mine in one.roads for theirs in other.roads]
    waits = any((theirs, mine) in rules.high_low for mine, theirs in pairs)
    goes = any(pair in rules.high_low for pair in pairs)
    return waits if waits != goes else None


def _turns_across(one: Movement, other: Movement, side: float) -> bool | None:
    """Whether ``one`` turns across ``other``, or the reverse; nothing for crossing roads.

    Oncoming traffic goes before those who turn across it, and what goes straight on before those
    who turn over its path from beside it.
    """
    if one.source[0] == other.source[0]:
        own_turn, their_turn = abs(one.turn), abs(other.turn)
    elif abs(wrapped(other.heading_in - one.heading_in)) > OPPOSING:
        own_turn, their_turn = side * one.turn, side * other.turn
    else:
        return None
    return own_turn > their_turn if abs(own_turn - their_turn) > 0.1 else None


def _waits_by_place(one: Movement, other: Movement, rules: Rules, side: float) -> bool:
    """Oncoming traffic before turns across it, the major road, then right before left."""
    turning = _turns_across(one, other, side)
    if turning is not None:
        return turning
    if (one.source[0] in rules.major) != (other.source[0] in rules.major):
        return other.source[0] in rules.major
    angle = side * wrapped(other.heading_in - one.heading_in)
    if 0.05 < abs(angle) <= OPPOSING:
        return angle > 0.0
    return (one.source, one.target) > (other.source, other.target)
