"""Capacity of lanes at an all-way stop: HCM chapter 21, 7th edition (2022).

A lane departs every ``h_d`` seconds, the mean of saturation headways over five degrees of conflict:
no vehicle on the other approaches (1), one on the opposing approach (2), on one of the conflicting
approaches (3), on two of the three (4), on all (5)::

    x_j = v_j h_d,j / 3600                        share of the time with a vehicle at the line
    h_d = sum over the cases of P'(C) (h_base(C, vehicles) + h_adj)

``P'`` is made of the ``x`` of the other lanes, with HCM's correction for serial correlation
(Equations 21-21 to 21-26). As ``x`` depends on ``h_d`` this is repeated until it no longer changes.
The capacity of a lane is the flow at which its own ``x`` is 1, with all other flows as they are
(step 12): ``c = 3600 / h_d``.

Simplified: the correction is that of each case, with the part of its 64 or 512 states that the
lanes of the junction leave; junctions of more than four approaches have several of them as one.
"""

from __future__ import annotations

from itertools import product
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

OPPOSING, FROM_LEFT, FROM_RIGHT = "opposing", "left", "right"

_FIRST = 3.2
"""Departure headway, s, with which the repetition begins: HCM chapter 21, step 5."""
_CHANGE = 0.001
"""Seconds of change below which it ends; HCM has 0.1."""
_MOST = 100
_CORRELATION = 0.01

_ADJUSTED = {False: (0.2, -0.6, 1.7), True: (0.5, -0.7, 1.7)}
"""Seconds for left turns, right turns and heavy vehicles, without and with several lanes: HCM
Exhibit 21-12."""
_BASE = {
    "1": (3.9, 4.7, 5.8, 7.0, 9.6),
    "2": (3.9, 4.7, 5.8, 7.0, 9.6),
    "3a": (4.0, 4.8, 5.9, 7.1, 9.7),
    "3b": (4.3, 5.1, 6.2, 7.4, 10.0),
    "4a": (4.0, 4.8, 5.9, 7.1, 9.7),
    "4b": (4.5, 5.3, 6.4, 7.6, 10.2),
}
"""Base saturation headway, s, by geometry group and case: HCM Exhibit 21-15."""
_BASE_LANES: dict[str, tuple[tuple[float, ...], ...]] = {
    "5": ((4.5,), (5.0, 6.2), (6.4, 7.2), (7.6, 7.8, 9.0), (9.7, 9.7, 10.0, 11.5)),
    "6": (
        (4.5,), (6.0, 6.8, 7.4), (6.6, 7.3, 7.8), (8.1, 8.7, 9.6, 12.3), (10.0, 11.1, 11.4, 13.3),
    ),
}  # fmt: skip
"""The same of groups where it depends on the vehicles, beginning with the fewest of the case."""
_FEWEST = (0, 1, 1, 2, 3)
_LANES = 3
"""Lanes of an approach that HCM has; further ones count as the third."""


class StopLane(NamedTuple):
    """A lane at the stop line.

    Attributes
    ----------
    lane, approach
        Names.
    flow
        Vehicles an hour.
    left, right, heavy
        Shares of them that turn, and of trucks and buses.
    """

    lane: str
    approach: str
    flow: float
    left: float = 0.0
    right: float = 0.0
    heavy: float = 0.0


Relations = dict[str, dict[str, str]]
"""Of each approach, where the others come from: opposing, from the left, from the right."""


def departure_headways(
    lanes: Sequence[StopLane], relations: Relations, *, full: str | None = None
) -> dict[str, float]:
    """Seconds between two departures of each lane: HCM chapter 21, steps 5 to 11.

    Parameters
    ----------
    relations
        Of each approach.
    full
        A lane that always has a vehicle at the line.
    """
    of_approach: dict[str, list[StopLane]] = {}
    for stop_lane in lanes:
        of_approach.setdefault(stop_lane.approach, []).append(stop_lane)
    headways = {lane.lane: _FIRST for lane in lanes}
    for _ in range(_MOST):
        shares = {
            lane.lane: 1.0
            if lane.lane == full
            else min(1.0, lane.flow * headways[lane.lane] / 3600.0)
            for lane in lanes
        }
        new = {
            lane.lane: _departure_headway(lane, of_approach, relations[lane.approach], shares)
            for lane in lanes
        }
        change = max(abs(new[lane] - headways[lane]) for lane in new)
        headways = new
        if change < _CHANGE:
            break
    return headways


def all_way_capacities(lanes: Sequence[StopLane], relations: Relations) -> dict[str, float]:
    """Vehicles an hour that each lane can carry, with the flows of all others as they are."""
    return {
        lane.lane: 3600.0 / departure_headways(lanes, relations, full=lane.lane)[lane.lane]
        for lane in lanes
    }


def _departure_headway(
    lane: StopLane,
    of_approach: Mapping[str, Sequence[StopLane]],
    related: Mapping[str, str],
    shares: Mapping[str, float],
) -> float:
    sides: dict[str, list[float]] = {OPPOSING: [], FROM_LEFT: [], FROM_RIGHT: []}
    for approach, side in related.items():
        sides[side] += [shares[lane.lane] for lane in of_approach.get(approach, ())][:_LANES]
    group = _geometry_group(
        len(of_approach[lane.approach]),
        *(min(len(side), _LANES) for side in sides.values()),
        legs=len(of_approach),
    )
    left, right, heavy = _ADJUSTED[group in _BASE_LANES]
    adjusted = left * lane.left + right * lane.right + heavy * lane.heavy
    likely, seconds = [0.0] * 5, [0.0] * 5
    numbers = [_vehicle_count_odds(side[:_LANES]) for side in sides.values()]
    for counts in product(*(range(len(number)) for number in numbers)):
        chance = 1.0
        for number, count in zip(numbers, counts, strict=True):
            chance *= number[count]
        case = _conflict_case(*counts)
        likely[case] += chance
        seconds[case] += chance * _base_headway(group, case, sum(counts))
    frame = _LANES if max(map(len, of_approach.values())) >= _LANES else 2
    corrected = _correlate_arrivals(likely, [len(side[:_LANES]) for side in sides.values()], frame)
    means = [
        seconds[case] / likely[case]
        if likely[case] > 0.0
        else _base_headway(group, case, _FEWEST[case])
        for case in range(5)
    ]
    return sum(p * (h + adjusted) for p, h in zip(corrected, means, strict=True))


def _vehicle_count_odds(shares: Sequence[float]) -> list[float]:
    """How likely there are 0, 1, 2, ... vehicles, each lane having one with its own share."""
    found = [1.0]
    for share in shares:
        with_it = [0.0, *(p * share for p in found)]
        found = [p * (1.0 - share) + more for p, more in zip([*found, 0.0], with_it, strict=True)]
    return found


def _conflict_case(opposing: int, from_left: int, from_right: int) -> int:
    """Degree of conflict, counted from 0."""
    there = (opposing > 0) + (from_left > 0) + (from_right > 0)
    if there == 1:
        return 1 if opposing else 2
    return (0, 1, 3, 4)[there]


def _correlate_arrivals(likely: Sequence[float], lanes: Sequence[int], frame: int) -> list[float]:
    """Corrected for vehicles that come one after the other: HCM Equations 21-21 to 21-26.

    The equations have one correction for each state of a case; states with a vehicle on a lane
    that there is not do not occur.
    """
    p = likely
    more = (
        p[1] + 2 * p[2] + 3 * p[3] + 4 * p[4],
        p[2] + 2 * p[3] + 3 * p[4] - p[1],
        p[3] + 2 * p[4] - 3 * p[2],
        p[4] - 6 * p[3],
        -10 * p[4],
    )
    all_of = _lane_state_counts([frame] * 3)
    parts = [
        counted / most for counted, most in zip(_lane_state_counts(lanes), all_of, strict=True)
    ]
    return [
        share + _CORRELATION * added * part
        for share, added, part in zip(p, more, parts, strict=True)
    ]


def _lane_state_counts(lanes: Sequence[int]) -> tuple[int, ...]:
    """In how many ways the lanes of the three sides can be occupied, for each case."""
    opposing, left, right = (2**number - 1 for number in lanes)
    crossing = opposing * left + opposing * right + left * right
    return 1, opposing, left + right, crossing, opposing * left * right


def _geometry_group(own: int, opposing: int, from_left: int, from_right: int, *, legs: int) -> str:
    """Column of Exhibits 21-12 and 21-15, by numbers of lanes: HCM Exhibit 21-11."""
    crossing = max(from_left, from_right, 1)
    most = max(opposing, crossing)
    if own == 1 and most < _LANES:
        if opposing < most == 2:
            return "2"
        at_t = legs < 4
        if opposing == 2:
            return ("3" if at_t else "4") + ("b" if crossing == most else "a")
        return "1"
    if own == 1 or (own < _LANES and most < _LANES):
        return "5"
    return "6"


def _base_headway(group: str, case: int, vehicles: int) -> float:
    if group in _BASE:
        return _BASE[group][case]
    column = _BASE_LANES[group][case]
    return column[min(max(vehicles - _FEWEST[case], 0), len(column) - 1)]
