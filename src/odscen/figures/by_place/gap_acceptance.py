"""Capacity of those who wait for gaps: two-way stop (HCM chapter 20) and roundabout (chapter 22).

HCM, 7th edition (2022), with its corrections of December 2022. A movement ``x`` of a two-way stop
that gives way to a conflicting flow ``v`` (veh/h) has the potential capacity (Equation 20-18)::

    c_p = v exp(-v t_c / 3600) / (1 - exp(-v t_f / 3600))

with critical headway ``t_c`` and follow-up headway ``t_f`` (Equations 20-16 and 20-17). Queues of
movements that go before it take a part of that: ``c_m = c_p f``, where ``f`` is made of the
probabilities ``p_0 = 1 - v / c_m`` that they have none (Equations 20-35 and 20-41). An entry of a
roundabout has ``c = A exp(-B v)`` passenger cars an hour, with the circulating flow ``v``
(Equations 22-1 to 22-5).

Who gives way to whom, and so the rank of a movement, is what the network says, not the numbers of
Exhibit 20-1, so that junctions of any shape have a capacity. Simplified against HCM: one stage of
gap acceptance, no flared approaches, no pedestrians, no platoons of signals upstream, level roads,
no delay to through vehicles from left turns in their lane.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

from odscen.figures.by_place.facilities import HEAVY_AS_CARS

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

LEFT, THROUGH, RIGHT = "left", "through", "right"
"""Turns as where one drives on the right; mirrored where one drives on the left."""

MAJOR_THROUGH, MAJOR_RIGHT = 1800.0, 1500.0
"""Saturation flow of lanes that give way to none, veh/h: HCM chapter 20, step 7d."""

_LEFT_OF_MAJOR = "left of major"
_CRITICAL = {
    _LEFT_OF_MAJOR: (4.1, 4.1, 5.3),
    RIGHT: (6.2, 6.9, 7.1),
    THROUGH: (6.5, 6.5, 6.5),
    LEFT: (7.1, 7.5, 6.4),
}
"""Seconds, by lanes of the major street in a direction, one to three: HCM Exhibit 20-17."""
_FOLLOW_UP = {
    _LEFT_OF_MAJOR: (2.2, 2.2, 3.1),
    RIGHT: (3.3, 3.3, 3.9),
    THROUGH: (4.0, 4.0, 4.0),
    LEFT: (3.5, 3.5, 3.8),
}
"""Seconds: HCM Exhibit 20-18."""
_HEAVY_CRITICAL, _HEAVY_FOLLOW_UP = (1.0, 2.0, 2.0), (0.9, 1.0, 1.0)
"""Seconds more if all were heavy vehicles: HCM Equations 20-16 and 20-17."""
_AT_T = 0.7
"""Seconds that a left turn of the stem of a T-junction needs less: HCM Equation 20-16."""

_LEAST = 1e-9


class Stream(NamedTuple):
    """Vehicles of one connection through a junction.

    Attributes
    ----------
    via, lane, approach
        First lane inside, lane before it, and its edge.
    road, onto
        Roads by which one comes and leaves.
    turn
        ``left``, ``through`` or ``right``, as where one drives on the right.
    yields_to
        The ``via`` of those that it gives way to.
    flow, heavy
        Vehicles an hour, and share of trucks and buses.
    """

    via: str
    lane: str
    approach: str
    road: str
    onto: str
    turn: str
    yields_to: frozenset[str]
    flow: float
    heavy: float = 0.0


def potential_capacity(conflicting: float, *, critical: float, follow_up: float) -> float:
    """Vehicles an hour that gaps in a flow let through: HCM Equation 20-18.

    Parameters
    ----------
    conflicting
        Vehicles an hour.
    critical, follow_up
        Headways, s.
    """
    if conflicting < _LEAST:
        return 3600.0 / follow_up
    waiting = math.exp(-conflicting * critical / 3600.0)
    return conflicting * waiting / (1.0 - math.exp(-conflicting * follow_up / 3600.0))


def two_way_capacities(streams: Sequence[Stream]) -> dict[str, float]:
    """Vehicles an hour of each connection at a two-way stop, as if it had its lane for itself.

    Those that give way to none have :data:`MAJOR_THROUGH` and :data:`MAJOR_RIGHT`.

    Returns
    -------
    By ``via``.
    """
    junction = _TwoWayStop(streams)
    found: dict[str, float] = {}
    for stream in sorted(streams, key=junction.order):
        if stream.yields_to:
            found[stream.via] = junction.potential(stream) * junction.impedance(stream, found)
        else:
            found[stream.via] = MAJOR_RIGHT if stream.turn == RIGHT else MAJOR_THROUGH
    return found


class _TwoWayStop:
    """One junction: which of its approaches are the major street, and what conflicts."""

    def __init__(self, streams: Sequence[Stream]) -> None:
        self._streams = streams
        self._of = {stream.via: stream for stream in streams}
        self._major = {stream.approach for stream in streams if not stream.yields_to}
        lanes = {
            approach: {
                stream.lane
                for stream in streams
                if stream.approach == approach and not stream.yields_to
            }
            for approach in self._major
        }
        self._lanes = min(max((len(lane) for lane in lanes.values()), default=1), 3)
        roads = {road for stream in streams for road in (stream.road, stream.onto)}
        self._at_t = len(roads) == 3
        used = [stream.lane for stream in streams]
        self._shared = {lane for lane in used if used.count(lane) > 1}

    def order(self, stream: Stream) -> int:
        """Place in the order in which capacities are known: the ranks of HCM Exhibit 20-1."""
        if stream.approach in self._major:
            return 0
        return {RIGHT: 1, THROUGH: 2}.get(stream.turn, 3)

    def potential(self, stream: Stream) -> float:
        kind = _LEFT_OF_MAJOR if stream.approach in self._major else stream.turn
        column = self._lanes - 1
        critical = _CRITICAL[kind][column] + _HEAVY_CRITICAL[column] * stream.heavy
        if self._at_t and kind == LEFT:
            critical -= _AT_T
        follow_up = _FOLLOW_UP[kind][column] + _HEAVY_FOLLOW_UP[column] * stream.heavy
        flow = sum(self._conflict_weight(stream, other) * other.flow for other in self._streams)
        return potential_capacity(flow, critical=critical, follow_up=follow_up)

    def _conflict_weight(self, one: Stream, other: Stream) -> float:
        """How often a vehicle of ``other`` counts as conflicting: HCM Equations 20-2 to 20-15."""
        minor = one.approach not in self._major
        if other.via in one.yields_to:
            if not minor:
                return 1.0
            if other.approach in self._major:
                return 2.0 if other.yields_to else 1.0
            return 0.5
        # Half of those who turn off into one's own road are taken to drive straight on.
        turns_off = not other.yields_to and other.onto == one.road
        return 0.5 if minor and turns_off and other.lane in self._shared else 0.0

    def impedance(self, stream: Stream, known: Mapping[str, float]) -> float:
        """Share of the time in which no queue of those that go before is in the way."""
        if self.order(stream) < 2:
            return 1.0
        majors, crossing, others = 1.0, 1.0, 1.0
        for via in sorted(stream.yields_to & known.keys()):
            other = self._of[via]
            if not other.yields_to:
                continue
            free = max(0.0, 1.0 - other.flow / max(known[via], _LEAST))
            if other.approach in self._major:
                majors *= free
            elif other.turn == THROUGH:
                crossing *= free
            else:
                others *= free
        if majors < _LEAST or crossing < _LEAST:
            return 0.0
        # Queues of major and minor street depend on each other: HCM Equation 20-41.
        return others / (1.0 / majors + 1.0 / crossing - 1.0)


def entry_capacity(circulating: float, *, lanes: int, around: int, outer: bool = True) -> float:
    """Passenger cars an hour of a lane that enters a roundabout: HCM Equations 22-1 to 22-5.

    Parameters
    ----------
    circulating
        Passenger cars an hour that it gives way to.
    lanes, around
        Lanes of the entry, and circulating lanes; those beyond two count as two.
    outer
        Whether it is the outer lane of the entry.
    """
    if around > 1:
        first, second = (1420.0, 0.85e-3) if outer or lanes == 1 else (1350.0, 0.92e-3)
    else:
        first, second = (1380.0, 1.02e-3) if lanes == 1 else (1420.0, 0.91e-3)
    return first * math.exp(-second * circulating)


def as_cars(vehicles: float, heavy: float) -> float:
    """Passenger cars that vehicles with a share of heavy ones stand for: Equation 22-10."""
    return vehicles * (1.0 + heavy * (HEAVY_AS_CARS - 1.0))
