"""Gaps of oncoming traffic that those take who turn across it.

SUMO lets such a driver start when whoever comes has left all of the junction, and the next one
reaches its own stop line only after the turn is over, a second added: in a junction of 40 m some
9 s between two who come, where drivers accept 4.5 s (HCM chapter 31). Here a driver looks at the
place where the paths cross, as people do: it may go behind one whose body is past it when it gets
there, and before one who gets there after its own body has left, by :data:`MARGIN`. To SUMO these
are vehicles to ignore for the moment (``junctionModel.ignoreIDs``); whoever is not, it gives way to
as ever, and so it does to all on its own side, to those who turn into the same road, and to people.
"""

from __future__ import annotations

import math
from collections import defaultdict
from contextlib import suppress
from functools import cached_property
from itertools import pairwise
from typing import TYPE_CHECKING, Any, NamedTuple

from odscen.sumo.worker.simulation.foreign_traffic import is_foreign

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Sequence

    from odscen.sumo.worker.simulation.road_lanes import RoadLanes

MARGIN = 0.5
"""Seconds from when a body has left the place where paths cross to when the next one is there."""
_BEHIND = 0.3
"""Seconds behind a body that is past that place."""
_LONGEST_STEP = 0.5
"""Seconds of a step up to which this is done; with steps of 1 s some touched."""
_NEAR = 20.0
"""Metres before a stop line from which on a driver looks for a gap."""
_SIGHT = 90.0
"""Metres before their stop line from which on those who come are looked at."""
_OPPOSING = math.radians(120.0)
"""Angle between two approaches from which on one comes towards the other."""
_LONGEST = 8.0
"""Metres of a vehicle whose body stays on its path; the sides of longer ones leave it in a turn."""
_STANDING = 2.0
"""m/s below which it is not sure that one who is in the junction leaves it."""
_WIDTH = 2.1
"""Metres of the widest body that is looked at, and what lies between two who pass."""
_FLATTEST = math.radians(15.0)
_MOST_KEPT = 10_000
"""Vehicles whose bodies are kept in mind."""
_OBEYING = ("s", "w", "=", "Z")
"""States of links by whose rule a vehicle stops in any case, or goes in turn."""
_IGNORED = "junctionModel.ignoreIDs"

_Point = tuple[float, float]


class _Crossing(NamedTuple):
    """A path that comes towards a turn and crosses it.

    ``here`` and ``there`` are metres from where one waits, and from the stop line of the other,
    to where the paths cross, ``half`` those before and behind it at which bodies may touch;
    ``lanes`` has the lanes that lead there, each with the metres from its begin to that stop line
    (negative inside the junction), ``inside`` the speed of the path in the junction, m/s.
    """

    source: str
    target: str
    lanes: tuple[tuple[str, float], ...]
    here: float
    there: float
    half: float
    inside: float


class _Turn(NamedTuple):
    """A turn: the lane up to where one waits and its length, and who crosses behind that place.

    That is a place inside the junction, or else the stop line. ``speed`` is that of the lane behind
    it, m/s; ``watched`` are the lanes of all who cross.
    """

    waiting: str
    length: float
    speed: float
    target: str
    crossings: tuple[_Crossing, ...]
    watched: tuple[str, ...]


class _Body(NamedTuple):
    """What never changes of a vehicle: length, m, acceleration, m/s2, and factor on limits."""

    length: float
    gains: float
    factor: float


class TurningGaps:
    """Lets drivers who turn across oncoming traffic take gaps.

    Parameters
    ----------
    sumo, errors
        libsumo, and what it raises.
    lanes
        Those of the network.
    native
        Gives the function of libsumo behind one of Python, by domain and name.
    """

    def __init__(
        self,
        sumo: Any,
        errors: tuple[type[Exception], ...],
        lanes: RoadLanes,
        native: Callable[[str, str], Any],
    ) -> None:
        self._sumo = sumo
        self._errors = errors
        self._lanes = lanes
        self._given: dict[str, frozenset[str]] = {}
        self._lane_of, self._position_of, self._speed_of, self._allowed_of = (
            native("vehicle", f"get{what}")
            for what in ("LaneID", "LanePosition", "Speed", "AllowedSpeed")
        )
        self._route_of, self._index_of = (
            native("vehicle", f"getRoute{what}") for what in ("", "Index")
        )
        self._number_on, self._on_lane = (
            native("lane", f"getLastStepVehicle{what}") for what in ("Number", "IDs")
        )
        self._bodies: dict[str, _Body] = {}

    def before_step(
        self, *, only: frozenset[str] | None = None, moved: Collection[str] = ()
    ) -> None:
        """Say to SUMO whom each who turns need not wait for in the step to come.

        Parameters
        ----------
        only
            Who takes gaps like this; ``None``: everyone.
        moved
            Who is driven by something else.
        """
        seen: set[str] = set()
        for name, lane in self._find_turning():
            if name in moved or is_foreign(name) or (only is not None and name not in only):
                continue
            turn = self._turn_of(name, lane)
            if turn is not None:
                self._set_ignored(name, self._passed_by(name, turn, lane))
                seen.add(name)
        for name in sorted(self._given.keys() - seen):
            self._set_ignored(name, [])

    def _turn_of(self, name: str, lane: str) -> _Turn | None:
        """The turn that a vehicle is about to make, or makes."""
        turns = self._turns[lane]
        if lane in self._lanes.internal:
            turn = turns[0]
        else:
            if turns[0].length - self._position_of(name) > _NEAR:
                return None
            after = self._route_of(name)[self._index_of(name) + 1 :][:1]
            chosen = next((turn for turn in turns if after and turn.target == after[0]), None)
            if chosen is None:
                return None
            turn = chosen
        met = any(self._number_on(there) for there in turn.watched)
        return turn if met and self._body_of(name).length <= _LONGEST else None

    def _find_turning(self) -> list[tuple[str, str]]:
        """Vehicles on lanes that turns begin on or lead over, with these lanes."""
        if not self._turns or self._sumo.simulation.getDeltaT() > _LONGEST_STEP:
            return []
        names, lane_of = self._sumo.vehicle.getIDList(), self._lane_of
        if len(names) < 2:
            return []
        if len(names) < len(self._turns):  # asking for vehicles is cheaper than for lanes
            places = [(name, lane_of(name)) for name in names]
            return [(name, lane) for name, lane in places if lane in self._turns]
        number, on_lane = self._number_on, self._on_lane
        return [(name, lane) for lane in self._turns if number(lane) for name in on_lane(lane)]

    def _body_of(self, name: str) -> _Body:
        body = self._bodies.get(name)
        if body is None:
            of = self._sumo.vehicle
            if len(self._bodies) >= _MOST_KEPT:
                self._bodies.clear()
            body = _Body(of.getLength(name), of.getAccel(name), of.getSpeedFactor(name))
            self._bodies[name] = body
        return body

    def forget(self) -> None:
        """Let all give way as SUMO has it, before the state is saved."""
        for name in sorted(self._given):
            self._set_ignored(name, [])

    def _set_ignored(self, name: str, others: Sequence[str]) -> None:
        wanted = frozenset(others)
        if wanted == self._given.get(name, frozenset()):
            return
        with suppress(*self._errors):  # it may be gone
            self._sumo.vehicle.setParameter(name, _IGNORED, " ".join(others))
        if others:
            self._given[name] = wanted
        else:
            self._given.pop(name, None)

    def _passed_by(self, name: str, turn: _Turn, lane: str) -> list[str]:
        """Those whom a vehicle need not wait for."""
        length, gains, factor = self._body_of(name)
        front = self._position_of(name) - (turn.length if lane == turn.waiting else 0.0)
        speed, limit = self._speed_of(name), turn.speed * factor
        free, kept = set[str](), set[str]()
        for crossing in turn.crossings:
            enters = _seconds(crossing.here - crossing.half - front, speed, gains, limit)
            leaves = _seconds(crossing.here + crossing.half + length - front, speed, gains, limit)
            margin = MARGIN if lane == turn.waiting else 0.0
            for other, to_line in self._find_oncoming(crossing, turn.target):
                passes = self._passes(other, to_line, crossing)
                if passes is None:
                    continue
                clear = passes[0] > leaves + margin or passes[1] + _BEHIND < enters
                (free if clear else kept).add(other)
        if lane != turn.waiting:  # on its way: to change its mind would be to stop in the way
            return sorted(free | self._given.get(name, frozenset()))
        # Who has to wait for one starts for none: it would be late for the others.
        return [] if kept else sorted(free)

    def _find_oncoming(self, crossing: _Crossing, target: str) -> list[tuple[str, float]]:
        """Who is on a path, with the metres to its stop line, negative behind it."""
        found = []
        for lane, to_line in crossing.lanes:
            for name in self._on_lane(lane):
                inside = lane in self._lanes.internal and to_line <= 0.0
                if inside or self._drives_over(name, crossing, target):
                    found.append((name, to_line - self._position_of(name)))
        return found

    def _drives_over(self, name: str, crossing: _Crossing, target: str) -> bool:
        """Whether a vehicle before the junction is to take a path."""
        vehicle = self._sumo.vehicle
        begin = max(0, vehicle.getRouteIndex(name))
        route = vehicle.getRoute(name)[begin : begin + 6]
        if crossing.source not in route[:-1]:
            return False
        after = route[route.index(crossing.source) + 1]
        return bool(after == crossing.target and after != target)

    def _passes(self, name: str, to_line: float, crossing: _Crossing) -> tuple[float, float] | None:
        """Seconds to when a vehicle is where paths cross, at the earliest, and to when it is past.

        ``None`` if nothing is sure.
        """
        length, gains, factor = self._body_of(name)
        speed, inside = self._speed_of(name), crossing.inside * factor
        first = crossing.there - crossing.half
        if to_line > 0.0:
            limit = max(self._allowed_of(name), speed)
            begins = _seconds(to_line, speed, gains, limit)
            begins += first / max(inside, 0.1)
        else:
            begins = _seconds(first + to_line, speed, gains, max(inside, speed))
        behind = crossing.there + crossing.half + length + to_line
        if to_line > 0.0 or (speed < _STANDING and behind > 0.0):
            return begins, math.inf
        return begins, max(0.0, behind) / max(speed, 0.1)

    # ------------------------------------------------------------------------ the network

    @cached_property
    def _turns(self) -> dict[str, list[_Turn]]:
        """Turns that others cross who come towards them, by the lanes before and behind the place.

        Where no vehicle waits for others of its own accord (it has priority, has to stop, or goes
        in turn) there is none.
        """
        lane = self._sumo.lane
        links = {name: lane.getLinks(name) for name in lane.getIDList()}
        before: dict[str, list[str]] = defaultdict(list)
        entries: list[tuple[str, str, str]] = []
        obeying = set[str]()
        for name, own in links.items():
            for link in own:
                onto, via = link[0], link[4]
                before[via or onto].append(name)
                if via and name not in self._lanes.internal:
                    entries.append((name, onto, via))
                    if link[5] in _OBEYING:
                        obeying.add(via)
        by_junction: dict[str, list[tuple[str, str, str]]] = defaultdict(list)

        def ends_at(source: str) -> str:
            return str(self._sumo.edge.getToJunction(lane.getEdgeID(source)))

        for entry in entries:
            by_junction[ends_at(entry[0])].append(entry)
        found: dict[str, list[_Turn]] = defaultdict(list)
        for source, onto, via in entries:
            inner = next((link[4] for link in links[via] if link[4]), "")
            waiting, beyond = (via, inner) if inner else (source, via)
            if via in obeying:
                continue
            first = set(lane.getFoes(source, onto))
            crossings = []
            for other, other_onto, other_via in by_junction[ends_at(source)]:
                if other not in first or lane.getEdgeID(other_onto) == lane.getEdgeID(onto):
                    continue
                crossing = self._find_crossing(
                    source, beyond, (other, other_onto, other_via), links, before
                )
                if crossing is not None:
                    crossings.append(crossing)
            if crossings:
                turn = _Turn(
                    waiting,
                    lane.getLength(waiting),
                    lane.getMaxSpeed(beyond),
                    lane.getEdgeID(onto),
                    tuple(crossings),
                    tuple(dict.fromkeys(name for one in crossings for name, _ in one.lanes)),
                )
                found[waiting].append(turn)
                found[beyond].append(turn)
        return dict(found)

    def _find_crossing(
        self,
        source: str,
        beyond: str,
        other: tuple[str, str, str],
        links: dict[str, Any],
        before: dict[str, list[str]],
    ) -> _Crossing | None:
        """Where another path crosses the lane behind a waiting place; ``None`` if nowhere."""
        lane = self._sumo.lane
        shape = lane.getShape
        their, onto, via = other
        if _turned(shape(source)[-2:], shape(their)[-2:]) < _OPPOSING:
            return None
        parts = [via, *(link[4] for link in links[via] if link[4])]
        path = [*shape(parts[0]), *(point for part in parts[1:] for point in shape(part)[1:])]
        meets = _find_meeting(shape(beyond), path)
        if meets is None:
            return None
        here, there, angle = meets
        angle = max(min(angle, math.pi - angle), _FLATTEST)
        half = 0.5 * _WIDTH * (1.0 / math.sin(angle) + 1.0 / math.tan(angle))
        lanes, to_line = [], 0.0
        for part in parts:
            lanes.append((part, to_line))
            to_line -= lane.getLength(part)
        lanes += self._upstream(their, before)
        return _Crossing(
            lane.getEdgeID(their), lane.getEdgeID(onto), tuple(lanes), here, there, half,
            lane.getMaxSpeed(via),
        )  # fmt: skip

    def _upstream(self, last: str, before: dict[str, list[str]]) -> list[tuple[str, float]]:
        """Lanes that lead to a stop line, with the metres from their begin to it."""
        found, ahead, known = [], [(last, 0.0)], {last}
        while ahead:
            name, rest = ahead.pop()
            to_line = rest + self._sumo.lane.getLength(name)
            found.append((name, to_line))
            if to_line < _SIGHT:
                more = [one for one in before[name] if one not in known]
                known.update(more)
                ahead += [(one, to_line) for one in more]
        return found


def _seconds(metres: float, speed: float, gains: float, limit: float) -> float:
    """Seconds that metres take at least, from a speed up to a limit."""
    if metres <= 0.0:
        return 0.0
    limit = max(limit, speed, 0.1)
    gaining = (limit * limit - speed * speed) / (2.0 * gains)
    if gaining >= metres:
        return (math.sqrt(speed * speed + 2.0 * gains * metres) - speed) / gains
    return (limit - speed) / gains + (metres - gaining) / limit


def _turned(one: Sequence[_Point], other: Sequence[_Point]) -> float:
    """Angle between two steps, 0 to pi."""
    (ax, ay), (bx, by) = ((end[0] - start[0], end[1] - start[1]) for start, end in (one, other))
    return abs(math.atan2(ax * by - ay * bx, ax * bx + ay * by))


def _find_meeting(
    one: Sequence[_Point], other: Sequence[_Point]
) -> tuple[float, float, float] | None:
    """Metres along two paths to where they first cross, and the angle there; ``None``: nowhere."""
    along = 0.0
    for start, end in pairwise(one):
        dx, dy = end[0] - start[0], end[1] - start[1]
        length, beside = math.hypot(dx, dy), 0.0
        for their_start, their_end in pairwise(other):
            ex, ey = their_end[0] - their_start[0], their_end[1] - their_start[1]
            theirs = math.hypot(ex, ey)
            across = dx * ey - dy * ex
            if across:
                px, py = their_start[0] - start[0], their_start[1] - start[1]
                share, their_share = (px * ey - py * ex) / across, (px * dy - py * dx) / across
                if 0.0 <= share <= 1.0 and 0.0 <= their_share <= 1.0:
                    angle = _turned((start, end), (their_start, their_end))
                    return along + share * length, beside + their_share * theirs, angle
            beside += theirs
        along += length
    return None
