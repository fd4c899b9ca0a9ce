"""How a junction is ruled: who meets whom, who goes first, and what SUMO calls it."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import combinations
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from odscen.convert.model.right_of_way import (
    OPPOSING,
    Rules,
    Sign,
    find_conflicts,
    in_turn,
    making_room,
    requests,
    wrapped,
)

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from odscen.convert.model.net import Request
    from odscen.convert.model.right_of_way import Conflicts, Movement, Walkway


SIGHT_BOTH_WAYS, SIGHT_ONE_WAY = 0.3, 1.25
"""Metres before a yield line from which one sees whom to let go: on two roads, and on one.

Calibrated: those who find nobody follow each other in 3.0 s, and in 2.5 s where they only merge,
as into a roundabout. The Highway Capacity Manual (7th edition, chapters 20 and 22) has 3.5 s at a
sign and 2.6 s at a roundabout; from SUMO's 4.5 m one passes the sign at 8 m/s, in 2.1 s.
"""

_SIGHT_SPEEDS = (20.0, 30.0, 40.0, 50.0, 60.0, 70.0, 80.0, 90.0, 100.0, 110.0, 120.0, 130.0)
_SIGHT_LEGS = (20.0, 25.0, 35.0, 45.0, 55.0, 65.0, 75.0, 90.0, 105.0, 120.0, 135.0, 150.0)
"""Speed, km/h, and leg of the sight triangle, metres, of junctions without control (case A).

AASHTO, A Policy on Geometric Design of Highways and Streets, 7th edition, section 9.5.3.
"""

SIGHT_MAKING_ROOM = 100.0
"""Metres before a merge from which drivers who make room see the others, as SUMO's zipper has it.

Enough to stop from 30 m/s, so that nobody slows down on a motorway for a ramp that is empty.
"""


def sight_before(
    movement: Movement, right: Request, movements: Sequence[Movement], *, room: bool
) -> float | None:
    """Metres before the line from which one sees whom to let go; ``None``: as SUMO has it.

    ``room``: it makes room for those who merge
    (:func:`odscen.convert.model.right_of_way.making_room`).
    """
    roads = {movements[n].source[0] for n in right.yields_to if n < len(movements)}
    if movement.sign is Sign.STOP or not roads:
        return None
    if movement.sign is Sign.NONE:
        return SIGHT_MAKING_ROOM if room else sight_without_sign(movement.speed)
    return SIGHT_BOTH_WAYS if len(roads) > 1 else SIGHT_ONE_WAY


def sight_without_sign(speed: float) -> float:
    """Metres before a line without a sign, or a waiting place, from which one sees whom to let go.

    Far enough to stop for them in comfort: from SUMO's 4.5 m all who have a clear road slow down
    to 6.4 m/s.

    Parameters
    ----------
    speed
        m/s, of the edge before.
    """
    return round(float(np.interp(speed * 3.6, _SIGHT_SPEEDS, _SIGHT_LEGS)), 1)


BESIDE = 0.5
"""Radians between the headings of approaches that belong to one road."""

LARGE_LANES = 2
"""Lanes for cars on one approach that make a junction large."""

FASTER = 2.0
"""m/s by which a road must be faster than others to go first in a small junction."""

FAST = 50.0 / 3.6 + 0.5
"""m/s above which no approach goes right before left; with two lanes for cars none does either."""

_STRAIGHT_ON = math.radians(45.0)
"""A road whose traffic turns by less leads on beyond the junction."""


@dataclass(frozen=True, slots=True)
class _Approach:
    edge: str
    heading: float
    speed: float
    lanes: int
    bend: float
    """Radians by which its straightest movement turns."""


def major_edges(
    movements: Sequence[Movement], cars: Sequence[bool], *, decide: bool = False
) -> frozenset[str]:
    """Edges by which the major road comes to a junction; none where no road is more than others.

    A road has two opposite approaches, or one that leads on, as a carriageway of its own does.

    Parameters
    ----------
    cars
        Whether each movement is open to cars.
    decide
        Whether one of roads that are alike in all is taken.
    """
    approaches = _group_approaches(movements, cars)
    if all(_same_road(one, other) for one, other in combinations(approaches, 2)):
        return frozenset()
    pairs = [
        (one, other)
        for one, other in combinations(approaches, 2)
        if abs(wrapped(other.heading - one.heading)) > OPPOSING
    ]
    paired = {approach.edge for pair in pairs for approach in pair}
    alone = [approach for approach in approaches if approach.edge not in paired]
    roads = pairs + [
        (approach, approach)
        for approach in alone
        if approach.bend < _STRAIGHT_ON or (decide and not pairs)
    ]
    if not roads:
        return frozenset()
    best = max(roads, key=_rank_of_pair)
    if not pairs and not decide:
        ranks = [_rank_of_pair(road)[:2] for road in roads]
        if len(roads) < len(approaches) or ranks.count(max(ranks)) > 1:
            return frozenset()
    return frozenset(
        {
            approach.edge
            for approach in approaches
            for main in best
            if _heads_alongside(approach, main)
        }
        | {
            movement.source[0]
            for movement in movements
            for main in best
            if abs(wrapped(movement.heading_in - main.heading)) < BESIDE
        }
    )


def stands_out(movements: Sequence[Movement], cars: Sequence[bool]) -> bool:
    """Whether a road goes first though no sign says so.

    It does in junctions so large that equal right for all would lock them, or so fast that no
    driver expects others from the right, and where one road is faster than the others.
    """
    approaches = _group_approaches(movements, cars)
    major = major_edges(movements, cars)
    slowest = min(
        (approach.speed for approach in approaches if approach.edge in major), default=0.0
    )
    others = [approach.speed for approach in approaches if approach.edge not in major]
    return any(
        approach.lanes >= LARGE_LANES or approach.speed > FAST for approach in approaches
    ) or (bool(others) and slowest - max(others) > FASTER)


def _group_approaches(movements: Sequence[Movement], cars: Sequence[bool]) -> list[_Approach]:
    lanes: dict[str, set[int]] = {}
    bends: dict[str, float] = {}
    first: dict[str, Movement] = {}
    for movement, car in zip(movements, cars, strict=True):
        if car:
            edge, index = movement.source
            first.setdefault(edge, movement)
            lanes.setdefault(edge, set()).add(index)
            bends[edge] = min(abs(movement.turn), bends.get(edge, math.inf))
    return [
        _Approach(edge, movement.heading_in, movement.speed, len(lanes[edge]), bends[edge])
        for edge, movement in first.items()
    ]


def _rank_of_pair(pair: tuple[_Approach, _Approach]) -> tuple[float, int, float]:
    one, other = pair
    turned = abs(wrapped(other.heading - one.heading)) if one != other else math.pi - one.bend
    straightness = round(turned, 2)
    return one.speed + other.speed, one.lanes + other.lanes, straightness


def _same_road(one: _Approach, other: _Approach) -> bool:
    return _heads_alongside(one, other) or abs(wrapped(other.heading - one.heading)) > OPPOSING


def _heads_alongside(one: _Approach, other: _Approach) -> bool:
    return abs(wrapped(other.heading - one.heading)) < BESIDE


class Ruling(NamedTuple):
    """Who meets whom, and who goes first.

    ``zipped`` are the movements that go in turn with others, ``yielding`` those that make room for
    others; where all have equal right, ``equal``.
    """

    movements: Sequence[Movement]
    conflicts: Conflicts
    rules: Rules
    rights: Sequence[Request]
    zipped: frozenset[int]
    yielding: frozenset[int]
    equal: bool


def ruled(
    movements: Sequence[Movement],
    walkways: Sequence[Walkway],
    cars: Sequence[bool],
    *,
    high_low: frozenset[tuple[str, str]],
    lefthand: bool,
    signalled: bool,
) -> Ruling:
    """Say who meets whom in a junction and who goes first.

    Parameters
    ----------
    cars
        Whether each movement is open to cars.
    high_low
        Pairs of OpenDRIVE roads, incoming or connecting, of which the first has priority.
    """
    conflicts = find_conflicts(movements, walkways)
    signs = {movement.source[0]: movement.sign for movement in movements}
    all_stop = len(signs) > 1 and not signalled and set(signs.values()) == {Sign.STOP}
    unruled = len(set(signs.values())) <= 1 and not high_low
    major: frozenset[str] = frozenset()
    large = stands_out(movements, cars)
    # Signs to give way on all approaches distinguish none, but say that there is a major road.
    if signalled or (unruled and (any(signs.values()) or large)):
        major = major_edges(movements, cars, decide=large and not signalled)
    rules = Rules(high_low, lefthand, all_stop, signalled, major)
    zipped = frozenset(n for pair in in_turn(movements, conflicts, rules) for n in pair)
    yielding = frozenset(waits for waits, _ in making_room(movements, conflicts, rules))
    equal = unruled and not large and not (major or all_stop or zipped or yielding)
    rights = requests(movements, conflicts, rules)
    return Ruling(movements, conflicts, rules, rights, zipped, yielding, equal)


def signposts(ruling: Ruling, rows: Mapping[int, int]) -> list[tuple[str, float | None]]:
    """For each movement SUMO's letter, and from where its drivers see whom to let go."""
    posts: list[tuple[str, float | None]] = []
    for n, (movement, right) in enumerate(zip(ruling.movements, ruling.rights, strict=False)):
        if n in ruling.zipped:
            posts.append(("Z", None))
            continue
        sight = sight_before(movement, right, ruling.movements, room=n in ruling.yielding)
        posts.append((_right_of_way_letter(ruling, movement, right, lit=n in rows), sight))
    return posts


def junction_kind(ruling: Ruling) -> str:
    """SUMO's type of a junction."""
    if ruling.rules.signalled:
        return "traffic_light"
    if ruling.rules.all_stop:
        return "allway_stop"
    if not ruling.conflicts.pairs:
        return "priority"
    if ruling.zipped:
        return "zipper"
    if any(movement.sign is Sign.STOP for movement in ruling.movements):
        return "priority_stop"
    return "right_before_left" if ruling.equal else "priority"


def _right_of_way_letter(ruling: Ruling, movement: Movement, right: Request, *, lit: bool) -> str:
    """SUMO's letter for the right of way of a movement."""
    if lit:
        # Persons are waited for whatever the letter; it says whether vehicles are.
        count = len(ruling.movements)
        return "o" if any(other < count for other in right.yields_to) else "O"
    if ruling.rules.all_stop:
        return "w"
    if movement.sign is Sign.STOP:
        return "s"
    if not right.yields_to:
        return "M"
    return "=" if ruling.equal else "m"
