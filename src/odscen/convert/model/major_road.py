"""The major road of a junction: who goes first where no sign says so and no light does.

Where all roads have equal right a queue on each of them waits for the next, round and round. Roads
are built and marked so that one goes first: here the two approaches, opposite each other, that are
fastest, then have the most lanes, then are straightest.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations
from typing import TYPE_CHECKING

from odscen.convert.model.right_of_way import OPPOSING, wrapped

if TYPE_CHECKING:
    from collections.abc import Sequence

    from odscen.convert.model.right_of_way import Movement

BESIDE = 0.5
"""Radians between the headings of approaches that belong to one road."""

LARGE_LANES = 2
"""Lanes for cars on one approach that make a junction large."""

FASTER = 2.0
"""m/s by which a road must be faster than others to go first in a small junction."""


@dataclass(frozen=True, slots=True)
class _Approach:
    edge: str
    heading: float
    speed: float
    lanes: int


def major_edges(movements: Sequence[Movement], cars: Sequence[bool]) -> frozenset[str]:
    """Edges by which the major road comes to a junction; none where no two are opposite.

    Parameters
    ----------
    cars
        Whether each movement is open to cars.
    """
    approaches = _approaches(movements, cars)
    pairs = [
        (one, other)
        for one, other in combinations(approaches, 2)
        if abs(wrapped(other.heading - one.heading)) > OPPOSING
    ]
    if not pairs or all(_same_road(one, other) for one, other in combinations(approaches, 2)):
        return frozenset()
    best = max(pairs, key=_standing)
    return frozenset(
        {one.edge for one in approaches for main in best if _beside(one, main)}
        | {
            movement.source[0]
            for movement in movements
            for main in best
            if abs(wrapped(movement.heading_in - main.heading)) < BESIDE
        }
    )


def stands_out(movements: Sequence[Movement], cars: Sequence[bool]) -> bool:
    """Whether a road goes first though no sign says so.

    It does in junctions so large that equal right for all would lock them, and where one road is
    faster than the others.
    """
    approaches = _approaches(movements, cars)
    major = major_edges(movements, cars)
    slowest = min((one.speed for one in approaches if one.edge in major), default=0.0)
    others = [one.speed for one in approaches if one.edge not in major]
    return any(one.lanes >= LARGE_LANES for one in approaches) or (
        bool(others) and slowest - max(others) > FASTER
    )


def _approaches(movements: Sequence[Movement], cars: Sequence[bool]) -> list[_Approach]:
    lanes: dict[str, set[int]] = {}
    first: dict[str, Movement] = {}
    for movement, car in zip(movements, cars, strict=True):
        if car:
            edge, index = movement.source
            first.setdefault(edge, movement)
            lanes.setdefault(edge, set()).add(index)
    return [
        _Approach(edge, movement.heading_in, movement.speed, len(lanes[edge]))
        for edge, movement in first.items()
    ]


def _standing(pair: tuple[_Approach, _Approach]) -> tuple[float, int, float]:
    one, other = pair
    straightness = round(abs(wrapped(other.heading - one.heading)), 2)
    return one.speed + other.speed, one.lanes + other.lanes, straightness


def _same_road(one: _Approach, other: _Approach) -> bool:
    return _beside(one, other) or abs(wrapped(other.heading - one.heading)) > OPPOSING


def _beside(one: _Approach, other: _Approach) -> bool:
    return abs(wrapped(other.heading - one.heading)) < BESIDE
