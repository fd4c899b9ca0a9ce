"""Gaps of oncoming traffic that those take who turn across it.

SUMO lets such a driver start when whoever comes has left all of the junction, and the next one
reaches its own stop line only after the turn is over, a second added: in a junction of 40 m some
9 s between two who come, where drivers accept 4.5 s (HCM chapter 31). Here a driver looks at the
place where the paths cross, as people do: it may go behind one whose body is past it when it gets
there, and before one who gets there after its own body has left, by :data:`MARGIN`. To SUMO these
are vehicles to ignore for the moment (``junctionModel.ignoreIDs``); whoever is not, it gives way to
as ever, and so it does to all on its own side, to those who turn into the same road, and to people.

A step costs little, for most vehicles are not looked at: how far the next such turn of a route is
says when a vehicle can be there at the earliest, and nobody asks for it before; who waits at red is
not asked, nor who waits for one that comes, until that one can be there; and the geometry of a turn
is found when the first vehicle comes that makes it.
"""

from __future__ import annotations

import math
from bisect import bisect_left
from collections import defaultdict
from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from odscen.sumo.worker.simulation.foreign_traffic import is_foreign

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterable, Iterator, Sequence

    from odscen.base.arrays import FloatArray
    from odscen.sumo.worker.simulation.road_lanes import RoadLanes

MARGIN = 0.1
"""Seconds from when a body has left the place where paths cross to when the next one is there."""
_BEHIND = 0.2
"""Seconds behind a body that is past that place."""
_CORNER, _SIDE = 1.3, 0.5
"""Seconds more where a truck or bus turns, whose corner is on the other path a metre earlier, and
where one comes."""
_LONGEST_STEP = 0.5
"""Seconds of a step up to which this is done; with steps of 1 s some touched."""
_NEAR = 20.0
"""Metres before a stop line from which on a driver looks for a gap."""
_AT_LINE = 5.0
"""Metres before the stop line from which on one is looked at who waits inside the junction only."""
_SIGHT = 90.0
"""Metres before their stop line from which on those who come are looked at."""
_OPPOSING = math.radians(120.0)
"""Angle between two approaches from which on one comes towards the other."""
_BEND = math.radians(30.0)
"""Angle from which on a path is a turn."""
_LONGEST = 8.0
"""Metres of a vehicle whose body stays on its path; the sides of longer ones leave it in a turn."""
_APART = 0.5
"""Metres before it would touch another at which one who turns stops."""
_FIRMLY, _HARDEST = 3.0, 7.0
"""m/s2 with which it brakes for that, and at most."""
_CREEPING = 0.3
"""m/s below which one who turns waits."""
_STILL = 0.01
"""m/s below which it stands."""
_STANDING = 2.0
"""m/s below which it is not sure that one who is in the junction leaves it."""
_WIDTH = 2.1
"""Metres of the widest body that is looked at, and what lies between two who pass."""
_SPACING = 0.25
"""Metres between places of a path at which bodies are held against another."""
_MOST_KEPT = 2_000
"""Vehicles, and routes, that are kept in mind; a route takes some kilobytes."""
_LOOK_AGAIN = 60.0
"""Seconds after which a vehicle is looked at again in any case, as it may have another route."""
_EDGES = 6
"""Edges within :data:`_SIGHT`, at most."""
_RED = "r"
_AS_IT_LIKES = -1.0
"""``setSpeed``: SUMO's driver chooses again."""
_OBEYING = ("s", "w", "=", "Z")
"""States of links by whose rule a vehicle stops in any case, or goes in turn."""
_IGNORED = "junctionModel.ignoreIDs"

_Point = tuple[float, float]
_Pair = tuple[str, str]
"""Edges that a route leads from and to."""


@dataclass(frozen=True, eq=False)
class _Crossing:
    """A path that comes towards a turn and crosses it.

    ``pair`` are the edges that it leads from and to, ``here`` and ``there`` the first and the last
    metre, from where one waits and from the stop line of the other, at which the front of a body
    touches what drives on the other path; ``inside`` is the speed of the path in the junction, m/s.
    """

    pair: _Pair
    here: tuple[float, float]
    there: tuple[float, float]
    inside: float


@dataclass(frozen=True, eq=False)
class _NearPath:
    """A path that comes towards a turn, and so near that bodies touch, without crossing it.

    SUMO sees no conflict there. ``here`` is the stretch, metres from the stop line of the turn, on
    which a front touches what drives on the other path, and ``there`` that of the other one;
    ``lanes`` are the lanes inside the junction of the other one, each with the metres that lie
    before it; ``goes_first``: the other one has the lower number in the junction.
    """

    here: tuple[float, float]
    there: tuple[float, float]
    lanes: tuple[tuple[str, float], ...]
    goes_first: bool


@dataclass(frozen=True, eq=False)
class _Turn:
    """A turn: the lane up to where one waits and its length, and who crosses behind that place.

    That is a place inside the junction, or else the stop line. ``speed`` is that of the lane behind
    it, m/s; ``light`` names the traffic light, empty without one, and ``index`` the link there.
    ``approaches`` are the lanes from which others come, each with the paths that it leads over and
    the metres from its begin to the stop lines there, and ``crossed`` those of others inside the
    junction. ``inside`` are its own lanes there, with the metres before each, and ``near`` who
    passes beside it.
    """

    waiting: str
    length: float
    speed: float
    light: str
    index: int
    approaches: _Approaches
    crossed: _Approaches
    inside: dict[str, float]
    near: tuple[_NearPath, ...]


_Approaches = tuple[tuple[str, tuple[tuple[_Crossing, float], ...]], ...]
"""Lanes, each with the paths that it leads over and the metres from its begin to the stop lines."""


class _Route(NamedTuple):
    """A route by its name: the edge after each, turns by the place in it of the edge before.

    ``near`` are the metres before the end of that edge from which on one is looked at.
    ``metres`` and ``seconds`` are those from its begin to the end of each edge, at least, the
    latter at the limit. Of a route that comes by an edge twice, ``after`` is ``None``.
    """

    name: str
    after: dict[str, str] | None
    places: list[int]
    turns: list[dict[str, _Turn | None]]
    near: list[float]
    metres: list[float]
    seconds: list[float]


class _Body(NamedTuple):
    """What never changes of a vehicle: m, acceleration, m/s2, factor on limits, top speed, m/s."""

    length: float
    width: float
    gains: float
    factor: float
    fastest: float


class _Passage(NamedTuple):
    """Metres to the place where paths cross, and seconds to when one is there and has left it."""

    metres: float
    first: float
    last: float


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
        self._route_of, self._route_name_of, self._index_of = (
            native("vehicle", f"getRoute{what}") for what in ("", "ID", "Index")
        )
        self._on_lane = native("lane", "getLastStepVehicleIDs")
        self._departed_number, self._departed = (
            native("simulation", f"getDeparted{what}") for what in ("Number", "IDList")
        )
        self._state_of = native("trafficlight", "getRedYellowGreenState")
        self._bodies: dict[str, _Body] = {}
        self._routes: dict[str, _Route] = {}
        self._turns: dict[_Pair, dict[str, _Turn | None]] = {}
        self._step, self._step_length = -1, 0.0
        self._due: dict[int, list[str]] = {}
        self._due_of: dict[str, int] = {}
        self._edges: dict[str, tuple[float, float]] = {}
        self._near: dict[str, tuple[str, dict[str, _Turn | None]]] = {}
        self._waiting: dict[str, tuple[_Turn | None, int]] = {}
        self._on_lanes: dict[str, tuple[str, ...]] = {}
        self._held: list[str] = []

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
        if self._step < 0:
            self._step_length = float(self._sumo.simulation.getDeltaT())
        if self._step_length > _LONGEST_STEP:
            return
        self._step += 1
        self._find_near(only)
        if not self._near:
            return
        lights: dict[str, str] = {}
        self._on_lanes.clear()
        for name, (route, lanes) in list(self._near.items()):
            if name in self._waiting and self._still_waits(name, lights):
                continue
            try:
                lane = self._lane_of(name)
            except self._errors:  # it has arrived
                self._forget_vehicle(name)
                continue
            turn = lanes.get(lane)
            if turn is not None and turn.near and lane in turn.inside and name not in moved:
                self._keep_off(name, turn, turn.inside[lane])
            if turn is None or name in moved:
                self._set_ignored(name, ())
                if lane not in lanes:
                    self._forget_vehicle(name)
                    self._plan_look(name, 1)
            elif self._body_of(name).length > _LONGEST:
                if lane == turn.waiting and self._may_go(turn, lane, lights):
                    self._find_ignored_waiting(
                        name, turn
                    )  # it takes SUMO's gaps, and waits for bodies
            elif lane in turn.inside and lane != turn.waiting:
                if any(self._list_on(crossed) for crossed, _ in turn.crossed):
                    self._set_ignored(name, self._find_ignored_turning(name, turn))
            elif not self._may_go(turn, lane, lights):
                self._set_ignored(name, ())
                self._waiting[name] = turn, self._step
            elif lane != turn.waiting:  # it waits inside the junction
                self._set_ignored(name, ())
            elif self._route_name_of(name) != route:
                self._forget_vehicle(name)
                self._plan_look(name, 1)
            else:
                self._set_ignored(name, self._find_ignored_waiting(name, turn))

    def after_step(self) -> None:
        """Let those go who were held for a step."""
        for name in self._held:
            with suppress(*self._errors):  # it may be gone
                self._sumo.vehicle.setSpeed(name, _AS_IT_LIKES)
        self._held.clear()

    def look_again(self, name: str) -> None:
        """Look at a vehicle that has another route."""
        if name in self._due_of:
            self._plan_look(name, 1)

    def forget(self) -> None:
        """Let all give way as SUMO has it, before the state is saved."""
        self._waiting.clear()
        for name in sorted(self._given):
            self._set_ignored(name, ())

    def _set_ignored(self, name: str, others: Collection[str]) -> None:
        """Have a vehicle ignore others, and nobody else."""
        if not others and name not in self._given:
            return
        wanted = frozenset(others)
        if wanted == self._given.get(name):
            return
        with suppress(*self._errors):  # it may be gone
            self._sumo.vehicle.setParameter(name, _IGNORED, " ".join(sorted(wanted)))
        if wanted:
            self._given[name] = wanted
        else:
            del self._given[name]

    # ------------------------------------------------------------------------ who is near a turn

    def _find_near(self, only: frozenset[str] | None) -> None:
        """Look at those who have departed, and at those who may have come near a turn."""
        if self._step == 0:
            names: Iterable[str] = self._sumo.vehicle.getIDList()
        elif self._departed_number():
            names = self._departed()
        else:
            names = ()
        for name in names:
            if not is_foreign(name) and (only is None or name in only):
                self._due_of[name] = self._step
                self._due.setdefault(self._step, []).append(name)
        for name in self._due.pop(self._step, ()):
            if self._due_of.get(name) == self._step:
                del self._due_of[name]
                try:
                    self._look_at(name)
                except self._errors:  # it is gone
                    continue

    def _plan_look(self, name: str, steps: int) -> None:
        due = self._step + steps
        self._due_of[name] = due
        self._due.setdefault(due, []).append(name)

    def _look_at(self, name: str) -> None:
        """Note a vehicle that is near a turn; else say when it may be, at the earliest."""
        _, _, gains, factor, _ = self._body_of(name)
        lane, index = self._lane_of(name), self._index_of(name)
        if not lane or index < 0:  # it is being teleported
            self._plan_look(name, self._count_steps(1.0))
            return
        route, inside = self._route_named(name), lane in self._lanes.internal
        number = bisect_left(route.places, index)
        if inside and number < len(route.places) and route.places[number] == index:
            if lane in route.turns[number]:
                self._near[name] = route.name, route.turns[number]
                return
            number += 1
        again = _LOOK_AGAIN
        if number < len(route.places):
            place, passed = route.places[number], index if inside else index - 1
            near = route.near[number]
            rest = route.metres[place] - (route.metres[passed] if passed >= 0 else 0.0) - near
            rest -= 0.0 if inside else self._position_of(name)
            if rest <= 0.0:
                self._near[name] = route.name, route.turns[number]
                return
            speed = self._speed_of(name)
            gaining = (math.sqrt(speed * speed + 2.0 * gains * rest) - speed) / gains
            driving = route.seconds[place] - route.seconds[index]
            if place > index:
                last = route.seconds[place] - route.seconds[place - 1]
                driving -= last * min(1.0, near / (route.metres[place] - route.metres[place - 1]))
            again = min(again, max(gaining, driving / factor))
        self._plan_look(name, self._count_steps(again))

    def _route_named(self, name: str) -> _Route:
        """The route of a vehicle, with the turns on it."""
        route_name = self._route_name_of(name)
        known = self._routes.get(route_name)
        if known is not None:
            return known
        if len(self._routes) >= _MOST_KEPT:
            self._routes.clear()
        edges = self._route_of(name)
        after = dict(pairwise(edges)) if len(set(edges)) == len(edges) else None
        known = _Route(route_name, after, [], [], [], [], [])
        metres = seconds = 0.0
        for edge in edges:
            length, speed = self._find_shortest(edge)
            metres, seconds = metres + length, seconds + length / speed
            known.metres.append(metres)
            known.seconds.append(seconds)
        for place, pair in enumerate(pairwise(edges)):
            turns = self._turns.get(pair)
            if turns is None:
                turns = self._turns[pair] = self._find_turns(pair)
            if turns:
                known.places.append(place)
                known.turns.append(turns)
                before = any(turn.waiting not in turn.inside for turn in turns.values() if turn)
                known.near.append(_NEAR if before else _AT_LINE)
        self._routes[route_name] = known
        return known

    def _forget_vehicle(self, name: str) -> None:
        self._set_ignored(name, ())
        del self._near[name]
        self._waiting.pop(name, None)

    def _still_waits(self, name: str, lights: dict[str, str]) -> bool:
        """Whether one who waited stands, and still does so in any case: at red, or for another.

        One who drives at red could not stop before it: it is in the junction soon.
        """
        at_red, until = self._waiting[name]
        if self._step < until if at_red is None else self._shows_red(at_red, lights):
            with suppress(*self._errors):  # it may be gone
                if self._speed_of(name) < _STILL:
                    return True
        del self._waiting[name]
        return False

    def _may_go(self, turn: _Turn, lane: str, lights: dict[str, str]) -> bool:
        """Whether one who has not begun to turn is to look for a gap.

        Parameters
        ----------
        lights
            States of lights that have been asked for.
        """
        return lane in self._lanes.internal or not self._shows_red(turn, lights)

    def _shows_red(self, turn: _Turn, lights: dict[str, str]) -> bool:
        if not turn.light:
            return False
        shown = lights.get(turn.light)
        if shown is None:
            shown = lights[turn.light] = self._state_of(turn.light)
        return shown[turn.index] == _RED

    def _body_of(self, name: str) -> _Body:
        body = self._bodies.get(name)
        if body is None:
            of = self._sumo.vehicle
            if len(self._bodies) >= _MOST_KEPT:
                self._bodies.clear()
            body = _Body(
                of.getLength(name),
                of.getWidth(name),
                of.getAccel(name),
                of.getSpeedFactor(name),
                of.getMaxSpeed(name),
            )
            self._bodies[name] = body
        return body

    # ------------------------------------------------------------------------ gaps

    def _find_ignored_waiting(self, name: str, turn: _Turn) -> list[str]:
        """Those whom one who has not begun to turn need not wait for.

        Who has to wait for one starts for none: it would be late for the others. SUMO would let it
        go when one who is in the junction has passed where paths cross; where they do so at a small
        angle, the two would touch beside that place, so it is held until they do not.
        """
        free = []
        given = self._given.get(name, ())
        for other, rest, crossing, own in self._find_oncoming(name, turn, waits=True):
            passes = self._time_passage(other, rest, crossing)
            margin = 0.0 if other in given else MARGIN
            if (
                passes[0] <= own.last + margin
                and passes[1] + self._room_behind(name, other) >= own.first
            ):
                if passes[1] < math.inf and self._speed_of(name) < _STANDING:
                    self._slow_to(name, 0.0)
                elif rest > 0.0:
                    self._plan_waiting(name, other, rest, crossing, own)
                return []
            free.append(other)
        return free

    def _room_behind(self, name: str, other: str) -> float:
        """Seconds that one who turns keeps behind one who is past the place where paths cross."""
        if self._body_of(name).width > _WIDTH:
            return _BEHIND + _CORNER
        return _BEHIND + _SIDE * (self._body_of(other).width > _WIDTH)

    def _plan_waiting(
        self, name: str, other: str, rest: float, crossing: _Crossing, own: _Passage
    ) -> None:
        """Do not look at one who stands until the one that it waits for is in the junction.

        That is so if the other stays in the way even if it stops before.
        """
        if self._speed_of(name) < _STILL:
            latest, _ = self._time_passage(other, rest, crossing, stops=True)
            if latest <= own.last + MARGIN:
                steps = int(self._time_to_line(other, rest) / self._step_length)
                self._waiting[name] = None, self._step + steps

    def _keep_off(self, name: str, turn: _Turn, before: float) -> None:
        """Have one who turns stop before it touches another who turns beside it.

        Parameters
        ----------
        before
            Metres of its path before its lane.
        """
        front, speed = before + self._position_of(name), self._speed_of(name)
        for near in turn.near:
            room = near.here[0] - front
            if room < speed * speed / (2.0 * _HARDEST):  # it is there, or cannot stop any more
                continue
            for lane, metres in near.lanes:
                for other in self._on_lane(lane):
                    theirs = metres + self._position_of(other)
                    if theirs - self._body_of(other).length > near.there[1]:
                        continue
                    waits = theirs < near.there[0] and self._speed_of(other) < _CREEPING
                    if theirs > near.there[0] or (near.goes_first and not waits):
                        self._stop_before(name, room, speed)
                        return

    def _stop_before(self, name: str, metres: float, speed: float) -> None:
        """Have one be as fast as it can still stop before a place after the step to come."""
        rest, step = max(0.0, metres - _APART), _FIRMLY * self._step_length
        self._slow_to(name, min(speed, math.sqrt(step * step + 2.0 * _FIRMLY * rest) - step))

    def _slow_to(self, name: str, speed: float) -> None:
        """Have one drive at a speed for a step."""
        self._sumo.vehicle.setSpeed(name, speed)
        self._held.append(name)

    def _find_ignored_turning(self, name: str, turn: _Turn) -> Collection[str]:
        """Those whom one who turns need not wait for.

        It changes its mind while it can stop before the place where paths cross: there, it would
        stop in the way.
        """
        free, speed = set(self._given.get(name, ())), self._speed_of(name)
        for other, rest, crossing, own in self._find_oncoming(name, turn, waits=False):
            passes = self._time_passage(other, rest, crossing)
            if passes[0] > own.last or passes[1] + self._room_behind(name, other) < own.first:
                free.add(other)
            elif own.metres > speed * speed / (2.0 * _FIRMLY):
                free.discard(other)
                if passes[1] < math.inf:
                    self._stop_before(name, own.metres, speed)
        return free

    def _find_oncoming(
        self, name: str, turn: _Turn, *, waits: bool
    ) -> Iterator[tuple[str, float, _Crossing, _Passage]]:
        """Who comes, with its metres to its stop line, its path, and that of who turns."""
        times: dict[_Crossing, _Passage] = {}
        for approaches, inside in ((turn.crossed, True), (turn.approaches, False)):
            for source, paths in approaches:
                for other in self._list_on(source):
                    for crossing, to_line in paths:
                        before, after = crossing.pair
                        if not inside and self._next_edge(other, before) != after:
                            continue
                        own = times.get(crossing)
                        if own is None:
                            own = times[crossing] = self._find_crossing(
                                name, turn, crossing, waits=waits
                            )
                        yield other, to_line - self._position_of(other), crossing, own
            if not waits:  # who is not in the junction yet is nobody to stop for on the way
                return

    def _list_on(self, lane: str) -> tuple[str, ...]:
        """Who is on a lane, asked for once in a step."""
        there = self._on_lanes.get(lane)
        if there is None:
            there = self._on_lanes[lane] = self._on_lane(lane)
        return there

    def _count_steps(self, seconds: float) -> int:
        """Whole steps, one at least."""
        return max(1, int(seconds / self._step_length + 1e-6))

    def _find_crossing(
        self, name: str, turn: _Turn, crossing: _Crossing, *, waits: bool
    ) -> _Passage:
        """When who turns is where paths cross, at least."""
        length, _, gains, factor, fastest = self._body_of(name)
        front = self._position_of(name) - (turn.length if waits else 0.0)
        speed, limit = self._speed_of(name), min(turn.speed * factor, fastest)
        metres = crossing.here[0] - front
        return _Passage(
            metres,
            _seconds_to_reach(metres, speed, gains, limit),
            _seconds_to_reach(crossing.here[1] + length - front, speed, gains, limit),
        )

    def _next_edge(self, name: str, edge: str) -> str | None:
        """The edge that a vehicle takes after one that is near."""
        route = self._route_named(name)
        if route.after is not None:
            return route.after.get(edge)
        edges, begin = self._route_of(name), max(0, self._index_of(name))
        pairs = pairwise(edges[begin : begin + _EDGES])
        return next((after for before, after in pairs if before == edge), None)

    def _time_passage(
        self, name: str, to_line: float, crossing: _Crossing, *, stops: bool = False
    ) -> tuple[float, float]:
        """Seconds to when a vehicle is where paths cross, at least, and to when it is past.

        Parameters
        ----------
        stops
            As if it stood where it is.
        """
        length, _, gains, factor, fastest = self._body_of(name)
        inside, first = min(crossing.inside * factor, fastest), crossing.there[0]
        if to_line > 0.0:
            waits = self._time_to_line(name, to_line, stops=stops)
            return waits + first / max(inside, 0.1), math.inf
        speed = self._speed_of(name)
        begins = _seconds_to_reach(first + to_line, speed, gains, max(inside, speed))
        behind = crossing.there[1] + length + to_line
        if speed < _STANDING and behind > 0.0:  # it is not sure that it goes on
            return begins, math.inf
        return begins, max(0.0, behind) / max(speed, 0.1)

    def _time_to_line(self, name: str, metres: float, *, stops: bool = False) -> float:
        """Seconds to when a vehicle is at its stop line, at least, or if it stood where it is."""
        speed = 0.0 if stops else self._speed_of(name)
        limit = max(self._allowed_of(name), speed)
        return _seconds_to_reach(metres, speed, self._body_of(name).gains, limit)

    # ------------------------------------------------------------------------ the network

    @cached_property
    def _find_before(self) -> dict[str, list[str]]:
        """Lanes that lead to a lane."""
        before: dict[str, list[str]] = defaultdict(list)
        for name, links in self._lanes.links_of.items():
            for link in links:
                before[link[4] or link[0]].append(name)
        return before

    @cached_property
    def _find_entries(self) -> dict[str, list[tuple[str, str, str]]]:
        """Connections into junctions, by junction: lanes before, behind, and the first inside."""
        entries: dict[str, list[tuple[str, str, str]]] = defaultdict(list)
        for name, links in self._lanes.links_of.items():
            if name not in self._lanes.internal:
                inside = [(name, link[0], link[4]) for link in links if link[4]]
                if inside:
                    entries[self._junction_behind(name)] += inside
        return entries

    def _junction_behind(self, lane: str) -> str:
        return str(self._sumo.edge.getToJunction(self._sumo.lane.getEdgeID(lane)))

    @cached_property
    def _find_lights(self) -> dict[str, tuple[str, int]]:
        """The traffic light and its link that lead to a lane inside a junction."""
        lights = self._sumo.trafficlight
        return {
            via: (light, index)
            for light in lights.getIDList()
            for index, links in enumerate(lights.getControlledLinks(light))
            for _, _, via in links
        }

    def _find_shortest(self, edge: str) -> tuple[float, float]:
        """Length of the shortest lane of an edge, m, and the highest limit on it, m/s."""
        known = self._edges.get(edge)
        if known is None:
            lane, own = self._sumo.lane, self._lanes.of_edge[edge]
            known = min(map(lane.getLength, own)), max(0.1, *map(lane.getMaxSpeed, own))
            self._edges[edge] = known
        return known

    def _find_turns(self, pair: _Pair) -> dict[str, _Turn | None]:
        """Turns from an edge to another that those cross who come towards them.

        By the lanes before and behind the place where one waits; the other lanes before the
        junction have none. Empty if there is no such turn. Where no vehicle waits for others of its
        own accord (it has priority, has to stop, or goes in turn) there is none.
        """
        lane, links_of = self._sumo.lane, self._lanes.links_of
        own = self._lanes.of_edge[pair[0]]
        turns: dict[str, _Turn] = {}
        for source in own:
            for link in links_of[source]:
                onto, via = link[0], link[4]
                if not via or link[5] in _OBEYING or lane.getEdgeID(onto) != pair[1]:
                    continue
                inner = next((link[4] for link in links_of[via] if link[4]), "")
                waiting, beyond = (via, inner) if inner else (source, via)
                approaches, crossed = self._find_approaches(source, onto, beyond)
                inside = {via: 0.0, inner: lane.getLength(via)} if inner else {via: 0.0}
                near = self._find_near_paths(source, onto, [*inside])
                if crossed or near:
                    turn = _Turn(
                        waiting,
                        lane.getLength(waiting),
                        lane.getMaxSpeed(beyond),
                        *self._find_lights.get(via, ("", 0)),
                        approaches,
                        crossed,
                        inside,
                        near,
                    )
                    turns |= {source: turn, waiting: turn, beyond: turn}
        return {**dict.fromkeys(own), **turns} if turns else {}

    def _find_approaches(
        self, source: str, onto: str, beyond: str
    ) -> tuple[_Approaches, _Approaches]:
        """Lanes on which those come who cross a turn, before and inside the junction."""
        lane = self._sumo.lane
        shape, edge_of, links_of = lane.getShape, lane.getEdgeID, self._lanes.links_of
        first, own = set(lane.getFoes(source, onto)), np.array(shape(beyond))
        approaches: dict[str, list[tuple[_Crossing, float]]] = defaultdict(list)
        crossed: dict[str, list[tuple[_Crossing, float]]] = defaultdict(list)
        for other, other_onto, via in self._find_entries[self._junction_behind(source)]:
            if other not in first or edge_of(other_onto) == edge_of(onto):
                continue
            if _measure_turn(shape(source)[-2:], shape(other)[-2:]) < _OPPOSING:
                continue
            parts = [via, *(link[4] for link in links_of[via] if link[4])]
            path = [*shape(parts[0]), *(point for part in parts[1:] for point in shape(part)[1:])]
            touching = _find_touching(own, np.array(path))
            if touching is None:
                continue
            pair = edge_of(other), edge_of(other_onto)
            crossing = _Crossing(pair, *touching, lane.getMaxSpeed(via))
            to_line = 0.0
            for part in parts:
                crossed[part].append((crossing, to_line))
                to_line -= lane.getLength(part)
            for name, rest in self._list_upstream(other):
                approaches[name].append((crossing, rest))
        before, inside = (
            tuple((name, tuple(paths)) for name, paths in lanes.items())
            for lanes in (approaches, crossed)
        )
        return before, inside

    def _find_near_paths(self, source: str, onto: str, own: Sequence[str]) -> tuple[_NearPath, ...]:
        """Paths of those who turn towards a turn and pass beside it, nearer than bodies are wide.

        Parameters
        ----------
        own
            Lanes of the turn inside the junction.
        """
        lane = self._sumo.lane
        entries = self._find_entries[self._junction_behind(source)]
        if (source, onto, own[0]) not in entries:  # a route that begins inside the junction
            return ()
        number = entries.index((source, onto, own[0]))
        path, found = self._join_shapes(own), []
        for place, (other, other_onto, via) in enumerate(entries):
            if len({source, onto, other, other_onto}) < 4 or lane.getEdgeID(other_onto) == (
                lane.getEdgeID(onto)
            ):
                continue
            ahead = lane.getShape(source)[-2:], lane.getShape(other)[-2:]
            if _measure_turn(*ahead) < _OPPOSING:
                continue
            parts = [via, *(link[4] for link in self._lanes.links_of[via] if link[4])]
            theirs = self._join_shapes(parts)
            if not _turns_alike(path, theirs):
                continue
            (along, places), (their_along, their_places) = _place_on(path), _place_on(theirs)
            apart = places[::2, None] - their_places[None, ::2]
            if (
                np.hypot(apart[..., 0], apart[..., 1]).min() > _WIDTH + _SPACING
                or _find_meeting(path, theirs) is not None
            ):
                continue
            touches = _find_touching_fronts(places, their_places)
            touched = _find_touching_fronts(their_places, places)
            if touches.any() and touched.any():
                begins = np.cumsum([0.0, *map(lane.getLength, parts[:-1])])
                here, there = along[touches], their_along[touched]
                found.append(
                    _NearPath(
                        (float(here[0]), float(here[-1])),
                        (float(there[0]), float(there[-1])),
                        tuple(zip(parts, begins.tolist(), strict=True)),
                        place < number,
                    )
                )
        return tuple(found)

    def _join_shapes(self, lanes: Sequence[str]) -> FloatArray:
        """Centre line over lanes that follow one another, shape (points, 2), m."""
        shape = self._sumo.lane.getShape
        first, *rest = lanes
        points = [*shape(first), *(point for name in rest for point in shape(name)[1:])]
        return np.array(points)[:, :2]

    def _list_upstream(self, last: str) -> list[tuple[str, float]]:
        """Lanes that lead to a stop line, with the metres from their begin to it."""
        upstream_lanes, ahead, known = [], [(last, 0.0)], {last}
        while ahead:
            name, rest = ahead.pop()
            to_line = rest + self._sumo.lane.getLength(name)
            upstream_lanes.append((name, to_line))
            if to_line < _SIGHT:
                more = [lane for lane in self._find_before[name] if lane not in known]
                known.update(more)
                ahead += [(lane, to_line) for lane in more]
        return upstream_lanes


def _seconds_to_reach(metres: float, speed: float, gains: float, limit: float) -> float:
    """Seconds that metres take at least, from a speed up to a limit."""
    if metres <= 0.0:
        return 0.0
    limit = max(limit, speed, 0.1)
    gaining = (limit * limit - speed * speed) / (2.0 * gains)
    if gaining >= metres:
        return (math.sqrt(speed * speed + 2.0 * gains * metres) - speed) / gains
    return (limit - speed) / gains + (metres - gaining) / limit


def _measure_turn(step: Sequence[_Point], other: Sequence[_Point]) -> float:
    """Angle between two steps, 0 to pi."""
    (ax, ay), (bx, by) = ((end[0] - start[0], end[1] - start[1]) for start, end in (step, other))
    return abs(math.atan2(ax * by - ay * bx, ax * bx + ay * by))


def _find_touching(
    path: FloatArray, other: FloatArray
) -> tuple[tuple[float, float], tuple[float, float]] | None:
    """First and last metre along each of two paths at which a front touches what is on the other.

    Around where they first cross; ``None`` if they do not. Paths have shape (points, 2), m. In a
    turn a front has a corner on the other path long before its middle is there.
    """
    meeting = _find_meeting(path, other)
    if meeting is None:
        return None
    (along, own), (theirs, others) = _place_on(path), _place_on(other)
    return (
        _find_run(along, _find_touching_fronts(own, others), meeting[0]),
        _find_run(theirs, _find_touching_fronts(others, own), meeting[1]),
    )


def _turns_alike(path: FloatArray, other: FloatArray) -> bool:
    """Whether both paths turn to the same side, by more than a bend."""
    sides = []
    for line in (path, other):
        (ax, ay), (bx, by) = line[1] - line[0], line[-1] - line[-2]
        sides.append(math.atan2(ax * by - ay * bx, ax * bx + ay * by))
    return min(map(abs, sides)) > _BEND and sides[0] * sides[1] > 0.0


def _place_on(path: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Metres along a path of places on it, shape (n,), and the places, (n, 2)."""
    lengths = np.concatenate(([0.0], np.cumsum(np.hypot(*np.diff(path, axis=0).T))))
    along = np.linspace(0.0, lengths[-1], max(3, math.ceil(lengths[-1] / _SPACING) + 1))
    return along, np.column_stack([np.interp(along, lengths, axis) for axis in path.T])


def _find_touching_fronts(places: FloatArray, others: FloatArray) -> Any:
    """Whether the front of a body at each place touches one on the other path, (n,)."""
    ahead = np.gradient(places, axis=0)
    across = np.column_stack([-ahead[:, 1], ahead[:, 0]])
    across *= 0.5 * _WIDTH / np.maximum(np.hypot(*ahead.T), 1e-9)[:, None]
    front = np.stack([places - across, places, places + across], axis=1)
    (x, y), (other_x, other_y) = np.moveaxis(front, -1, 0), others.T
    squared = np.subtract.outer(x, other_x) ** 2 + np.subtract.outer(y, other_y) ** 2
    return squared.min(axis=(1, 2)) <= (0.5 * _WIDTH) ** 2


def _find_run(along: FloatArray, touches: Any, at: float) -> tuple[float, float]:
    """First and last place of those around one that touch."""
    first = last = int(np.argmin(np.abs(along - at)))
    while first > 0 and touches[first - 1]:
        first -= 1
    while last < len(along) - 1 and touches[last + 1]:
        last += 1
    return float(along[first]), float(along[last])


def _find_meeting(path: FloatArray, other: FloatArray) -> tuple[float, float] | None:
    """Metres along two paths, shape (points, 2), to where they first cross; ``None``: nowhere."""
    steps, others = np.diff(path, axis=0)[:, None], np.diff(other, axis=0)[None]
    apart = other[None, :-1] - path[:-1, None]
    across = _cross_product(steps, others)
    with np.errstate(divide="ignore", invalid="ignore"):
        share = _cross_product(apart, others) / across
        their_share = _cross_product(apart, steps) / across
    meet = (share >= 0.0) & (share <= 1.0) & (their_share >= 0.0) & (their_share <= 1.0)
    if not meet.any():
        return None
    row, column = np.unravel_index(np.argmax(meet), meet.shape)
    lengths, their_lengths = np.hypot(*steps[:, 0].T), np.hypot(*others[0].T)
    along = lengths[:row].sum() + share[row, column] * lengths[row]
    theirs = their_lengths[:column].sum() + their_share[row, column] * their_lengths[column]
    return float(along), float(theirs)


def _cross_product(vectors: FloatArray, others: FloatArray) -> FloatArray:
    result: FloatArray = vectors[..., 0] * others[..., 1] - vectors[..., 1] * others[..., 0]
    return result
