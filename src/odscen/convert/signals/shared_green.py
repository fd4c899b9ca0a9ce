"""Which links of a traffic light may have green together, and how long one clears for another.

Two that meet may share green only where one of them gives way by the junction's right of way, and
only as drivers expect it (RiLSA 2015, section 2.3; HCM 7th edition, chapter 19):

- a turn across oncoming traffic, unless two lanes or more make the turn: then it is protected;
- opposing turns; if they only pass beside
  each other, nearer than a vehicle is wide, so that their paths do not cross, only where the one
  that gives way waits inside: there alone SUMO sees who is on such a path;
- a turn over a crossing at its far end, with those who walk in parallel;
- a turn over the path of others from the same approach, as of bicycles beside it.

Clearing times (RiLSA 2015, section 2.5): all-red lasts until the last vehicle has passed the place
where the paths meet, less what the first one from the other stop line needs to get there. Who waits
inside for oncoming traffic moves off as the last of it has passed; crossing traffic starts later.

Practice also protects turns across three lanes or more, or across more than 70 km/h. In a program
for a demand that no one knows this costs more than it brings: a stage more in each cycle, on towns
of wide roads 1.5 to 3 times the delay (``docs/signals.md``). Arrows come with the demand
(:mod:`odscen.app.signals.turn_arrows`).
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import shapely

from odscen.convert.model.net import LinkConflict
from odscen.convert.model.right_of_way import MOST_WIDTH, OPPOSING, wrapped
from odscen.convert.signals.signal_programs import GroupConflicts, SignalGroup, plan_stages

if TYPE_CHECKING:
    from collections.abc import Sequence
    from collections.abc import Set as AbstractSet

    from odscen.convert.model.net import Request
    from odscen.convert.model.right_of_way import Conflicts, Movement, Walkway
    from odscen.convert.signals.signal_programs import Stages

TURN = math.radians(30.0)
"""Less is straight on."""

TURNING_LANES = 2
"""Lanes for one turn across from which it is protected."""

WALKER = 1.2
"""m/s."""

STRAIGHT_SPEED, TURNING_SPEED, BICYCLE_SPEED = 10.0, 7.0, 5.0
"""m/s at which vehicles are taken to clear a junction, at most."""

ENTERING_SPEED = 11.1
"""m/s at which the first of the next stage passes its stop line."""

ENTERING_WALKER = 1.5
"""m/s of the first persons of the next stage."""

VEHICLE = 6.0
"""Metres of a vehicle that must have left."""

LAST_IN = 0.5
"""Seconds before the end of yellow after which none of those who go straight on enters."""

TURNING_HEAD_START, BICYCLE_HEAD_START = 1.0, 2.0
"""Seconds of yellow in which no more of those who turn, or of bicycles, cross the stop line."""

MOST_STAGES = 4
"""Stages from which on turns across are not protected: waiting is no safer than gaps."""

MOST_RED = 6.0
"""Seconds of all-red, at most."""


class LightLinks(NamedTuple):
    """Links of a junction with a light: its movements, then its crossings.

    Attributes
    ----------
    signals
        OpenDRIVE signals that control each movement; those without are not controlled.
    controllers
        The OpenDRIVE controller of each movement, or empty.
    bicycles
        Whether a movement is only for bicycles.
    rights
        Right of way of all links.
    side
        1 where traffic keeps right, -1 where it keeps left.
    waiting
        Movements that wait inside the junction for those whom they give way to.
    """

    movements: Sequence[Movement]
    walkways: Sequence[Walkway]
    signals: Sequence[tuple[str, ...]]
    controllers: Sequence[str]
    bicycles: Sequence[bool]
    conflicts: Conflicts
    rights: Sequence[Request]
    side: float
    waiting: AbstractSet[int] = frozenset()


def light_stages(links: LightLinks, rows: dict[int, int]) -> Stages:
    """Find signal groups, what keeps them apart and who gives way, and divide them into stages.

    Parameters
    ----------
    rows
        Position at the light of each controlled link.
    """
    stages = plan_stages(*_GreenSharing(links, protect=True).grouped(rows))
    if len(stages.green) > MOST_STAGES:
        stages = plan_stages(*_GreenSharing(links, protect=False).grouped(rows))
    return stages


def link_conflicts(links: LightLinks, rows: dict[int, int]) -> tuple[LinkConflict, ...]:
    """All controlled links that meet, with who gives way and the clearing times of both.

    Parameters
    ----------
    rows
        Position at the light of each controlled link.
    """
    return _GreenSharing(links, protect=False).met(rows)


class _GreenSharing:
    """What may share green at one light."""

    def __init__(self, links: LightLinks, *, protect: bool) -> None:
        self._links = links
        self._count = len(links.movements)
        self._lines = [shapely.LineString(m.shape[:, :2]) for m in links.movements]
        self._areas = [
            shapely.LineString(w.axis[:, :2]).buffer(w.width / 2.0, cap_style="flat")
            for w in links.walkways
        ]
        pairs = links.conflicts.pairs
        crossed = enumerate(links.conflicts.crossed)
        walked = [(n, self._count + c) for c, over in crossed for n in over]
        self._pairs = [*pairs, *walked]
        self._protected = self._protected_turns() if protect else set()
        self._never = {pair for pair in self._pairs if not self._may_share(*pair)}

    def grouped(self, rows: dict[int, int]) -> tuple[tuple[SignalGroup, ...], GroupConflicts]:
        """Groups: the links of one approach and signal, with protected turns apart."""
        links = self._links
        heads: dict[tuple[str, tuple[str, ...], bool], list[int]] = {}
        for n in rows:
            if n < self._count:
                lane = links.movements[n].source
                key = (lane[0], links.signals[n], lane in self._protected)
                heads.setdefault(key, []).append(n)
        groups: list[SignalGroup] = []
        members: list[tuple[int, ...]] = []
        for _, own in self._order_heads(heads):
            speed = max(links.movements[n].speed for n in own)
            place = tuple(rows[n] for n in own)
            controller = links.controllers[own[0]]
            groups.append(SignalGroup(place, controller, walkers=False, speed=speed))
            members.append(tuple(own))
        for index in range(len(links.walkways)):
            link = self._count + index
            groups.append(SignalGroup((rows[link],), "", walkers=True, speed=0.0))
            members.append((link,))
        return tuple(groups), self._conflicts_of_members(members, rows)

    def met(self, rows: dict[int, int]) -> tuple[LinkConflict, ...]:
        """Pairs of links that meet, by their positions at the light."""
        conflicts = []
        for i, j in self._pairs:
            if i in rows and j in rows:
                gives_way = j in self._links.rights[i].yields_to
                back = i in self._links.rights[j].yields_to
                conflicts.append(
                    LinkConflict(
                        rows[i],
                        rows[j],
                        rows[i] if gives_way else rows[j] if back else -1,
                        (i, j) not in self._never,
                        self._clearing_seconds(i, j),
                        self._clearing_seconds(j, i),
                    )
                )
        return tuple(sorted(conflicts))

    def _order_heads(
        self, heads: dict[tuple[str, tuple[str, ...], bool], list[int]]
    ) -> list[tuple[tuple[str, tuple[str, ...], bool], list[int]]]:
        """Each approach followed by what is opposite it: who comes first chooses company first."""
        left = list(heads.items())
        result = []
        while left:
            result.append(left.pop(0))
            heading = self._links.movements[result[-1][1][0]].heading_in
            left.sort(key=lambda item: item[0][2])
            opposite = [
                item
                for item in left
                if item[0][2] == result[-1][0][2]
                and self._angle_between(heading, self._links.movements[item[1][0]].heading_in)
                > OPPOSING
            ]
            for item in opposite:
                left.remove(item)
                result.append(item)
        return result

    def _conflicts_of_members(
        self, members: Sequence[Sequence[int]], rows: dict[int, int]
    ) -> GroupConflicts:
        group_of = {link: g for g, own in enumerate(members) for link in own}
        apart: set[tuple[int, int]] = set()
        clearing: dict[tuple[int, int], float] = {}
        for i, j in self._pairs:
            if i not in group_of or j not in group_of:
                continue
            a, b = group_of[i], group_of[j]
            if (i, j) in self._never and a != b:
                apart.add((min(a, b), max(a, b)))
            for (one, link), (other, link2) in (((a, i), (b, j)), ((b, j), (a, i))):
                seconds = max(
                    self._clearing_seconds(link, link2), self._release_seconds(link, link2)
                )
                clearing[one, other] = max(clearing.get((one, other), 0.0), seconds)
        yielding = frozenset(
            (rows[i], rows[j])
            for one, other in self._pairs
            for i, j in ((one, other), (other, one))
            if i in rows and j in rows and j in self._links.rights[i].yields_to
        )
        return GroupConflicts(frozenset(apart), yielding, clearing)

    # Rules

    @staticmethod
    def _angle_between(heading: float, other: float) -> float:
        return abs(wrapped(other - heading))

    def _turns_across(self, link: int) -> bool:
        return self._links.side * self._links.movements[link].turn > TURN

    def _may_share(self, i: int, j: int) -> bool:
        """Whether two that meet may both have green, given that one gives way."""
        movements = self._links.movements
        one = movements[i]
        if j >= self._count:
            return abs(one.turn) > TURN and self._crosses_at_far_end(i, j)
        other = movements[j]
        if one.source[0] == other.source[0]:
            return True
        if self._angle_between(one.heading_in, other.heading_in) < OPPOSING:
            return False
        turning = [n for n in (i, j) if abs(movements[n].turn) > TURN]
        if {movements[n].source for n in (i, j) if self._turns_across(n)} & self._protected:
            return False
        if (
            not self._lines[i].intersects(self._lines[j])
            and self._turns_across(i)
            and self._turns_across(j)
        ):
            return self._sees_until_out(i, j) or self._sees_until_out(j, i)
        return bool(turning)

    def _sees_until_out(self, i: int, j: int) -> bool:
        """Whether who makes the first movement waits inside until the other has left."""
        return i in self._links.waiting and j in self._links.rights[i].yields_to

    def _crosses_at_far_end(self, link: int, crossing: int) -> bool:
        line, area = self._lines[link], self._areas[crossing - self._count]
        return bool(line.project(area.centroid) > line.length / 2.0)

    def _protected_turns(self) -> set[tuple[str, int]]:
        """Lanes from which all traffic turns across, and which need protection."""
        movements = self._links.movements
        cars = [n for n in range(self._count) if not self._links.bicycles[n]]
        lanes: dict[tuple[str, int], list[int]] = {}
        for n in cars:
            lanes.setdefault(movements[n].source, []).append(n)
        turning = {lane for lane, own in lanes.items() if all(self._turns_across(n) for n in own)}
        return {
            lane
            for lane in turning
            if sum(other[0] == lane[0] for other in turning) >= TURNING_LANES
            and self._meets_oncoming(lanes[lane], cars)
        }

    def _meets_oncoming(self, turns: Sequence[int], cars: Sequence[int]) -> bool:
        """Whether turns meet oncoming traffic."""
        movements = self._links.movements
        pairs = {frozenset(pair) for pair in self._pairs}
        return any(
            frozenset((turn, n)) in pairs
            and self._angle_between(movements[turn].heading_in, movements[n].heading_in) > OPPOSING
            for turn in turns
            for n in cars
        )

    # Clearing

    def _clearing_seconds(self, ending: int, beginning: int) -> float:
        """Whole seconds from yellow's end, or a crossing's red, until ``beginning`` may go."""
        if ending >= self._count:
            length = shapely.LineString(
                self._links.walkways[ending - self._count].axis[:, :2]
            ).length
            return float(math.ceil(length / WALKER))
        line = self._lines[ending]
        if beginning < self._count:
            other = self._lines[beginning]
            seconds = max(
                self._leaving_seconds(ending, line.project(place))
                - other.project(place) / ENTERING_SPEED
                for place in _meeting_places(line, other)
            )
        else:
            walk = self._links.walkways[beginning - self._count].axis[:, :2]
            path = line.buffer(MOST_WIDTH)
            ways = [
                _measure_passage(shapely.LineString(axis), path)[0] for axis in (walk, walk[::-1])
            ]
            last = _measure_passage(line, self._areas[beginning - self._count])[1]
            seconds = self._leaving_seconds(ending, last) - min(ways) / ENTERING_WALKER
        return min(max(float(math.ceil(seconds)), 1.0), MOST_RED)

    def _release_seconds(self, ending: int, beginning: int) -> float:
        """Whole seconds from yellow's end until who waits inside has oncoming traffic behind it.

        In SUMO neither of two vehicles that enter their paths at one instant brakes for the other.
        """
        if ending not in self._links.waiting or beginning >= self._count:
            return 0.0
        seconds = [
            self._leaving_seconds(other, self._lines[other].project(place)) - LAST_IN
            for other in self._links.rights[ending].yields_to
            if other < self._count and self._goes_on(other) and self._may_share(ending, other)
            for place in _meeting_places(self._lines[other], self._lines[ending])
        ]
        return min(float(math.ceil(max(seconds, default=0.0))), MOST_RED)

    def _goes_on(self, link: int) -> bool:
        return abs(self._links.movements[link].turn) < TURN

    def _leaving_seconds(self, ending: int, way: float) -> float:
        """Seconds from the end of yellow until the last vehicle has left a place on its path."""
        if self._links.bicycles[ending]:
            return way / BICYCLE_SPEED - BICYCLE_HEAD_START
        movement = self._links.movements[ending]
        straight = self._goes_on(ending)
        pace = STRAIGHT_SPEED if straight else TURNING_SPEED
        start = 0.0 if straight else TURNING_HEAD_START
        return (way + VEHICLE) / min(max(movement.speed, 3.0), pace) - start


def _meeting_places(one: shapely.LineString, other: shapely.LineString) -> list[shapely.Point]:
    """Where two paths meet, or are nearest to each other."""
    shared = one.intersection(other)
    if shared.is_empty:
        return [shapely.Point(shapely.shortest_line(one, other).coords[0])]
    return [shapely.Point(xy) for xy in shapely.get_coordinates(shared)]


def _measure_passage(line: shapely.LineString, place: shapely.Geometry) -> tuple[float, float]:
    """Metres along a line to the first and the last of it in a place."""
    shared = line.intersection(place)
    if shared.is_empty:
        way = float(line.project(place.centroid))
        return way, way
    places = shapely.points(shapely.get_coordinates(shared))
    metres = shapely.line_locate_point(line, places)
    return float(metres.min()), float(metres.max())
