"""Lights on plain roads: mid-block crossings, ramp meters, lights before a road that leads on.

A light that controls nothing of a junction is read once more, in this order: without a validity
that names no lane for vehicles; reversed, where no lane for vehicles leads past it the way it
faces; for the junction ahead, over the roads that lead on to it; for the junction that it is just
behind; and else for a place of its own, where the road is cut and vehicles stop.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

from odscen.convert.model.access import allowed
from odscen.convert.model.edge_plan import RoadGap

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping, Sequence
    from collections.abc import Set as AbstractSet

    from odscen.base.ids import RoadId
    from odscen.convert.model.connections import PlannedConnection
    from odscen.convert.model.edge_plan import EdgePlan
    from odscen.convert.signals.acting_signals import Acting, SettledSignal, SignalReach
    from odscen.opendrive.lanes import RoadTable
    from odscen.opendrive.road_model import OpenDrive, Road


REACH = 80.0
"""Metres ahead of a signal on a road within which the junction that it controls must come."""

APART = 15.0
"""Metres between two lights of one road, or of a light and a stop line, that are one place."""

STANDS_BEHIND = 20.0
"""Metres past a junction within which a light is one on the far side of it."""

LONGEST_GAP = 2.0 * APART
"""Metres between the first and the last light of one place."""

HALF_GAP = 0.5
"""Metres of road before and behind a light that its junction has."""

LEAST_GAP = 0.1
"""Metres of such a junction, at least."""

LEAST_STUB = 1.0
"""Metres of road that stay between such a gap and a junction, or the end of the road."""

TO_LINK = 2.0
"""Metres to a road that leads on, within which the gap reaches to where the two roads meet."""

NO_LANE_VALID = "its validity names no lane for vehicles: taken for those that it faces"
NO_LANE_FACED = "no lane for vehicles comes from where it faces: taken reversed"
BEHIND_JUNCTION = "it is placed just beyond a junction: taken for the approach straight before it"


class StandingLight(NamedTuple):
    """A light that needs a place of its own: as the file has it, and as it acts."""

    place: Acting
    read: Acting
    guess: str


class RoadStop(NamedTuple):
    """The part of a road that is the junction of a light, and how the light acts."""

    read: Acting
    guess: str
    gap: RoadGap


class RoadLights:
    """What lights control that control nothing as they are written."""

    def __init__(
        self,
        odr: OpenDrive,
        table: RoadTable,
        edges: Sequence[EdgePlan],
        connections: Sequence[PlannedConnection],
        is_junction: Callable[[int], bool],
        reach: SignalReach,
    ) -> None:
        self._odr = odr
        self._table = table
        self._edges = edges
        self._connections = connections
        self._is_junction = is_junction
        self._reach = reach
        self._leaving: dict[int, list[int]] = {}
        for number, connection in enumerate(connections):
            self._leaving.setdefault(connection.source, []).append(number)
        self._by_road: dict[tuple[int, bool], list[int]] = {}
        for index, edge in enumerate(edges):
            self._by_road.setdefault((edge.road, edge.forward), []).append(index)

    def settle(
        self, settled: Sequence[SettledSignal], stops: Mapping[Acting, RoadStop]
    ) -> tuple[list[SettledSignal], list[StandingLight]]:
        """Settle the lights that control nothing; those that need a place of their own are named.

        Parameters
        ----------
        stops
            The places that the roads have been cut for.
        """
        placed = {signal.place.element for signal in settled if signal.numbers}
        lit = {
            number
            for signal in settled
            if signal.place.kind == "traffic_light"
            for number in signal.numbers
        }
        result: list[SettledSignal] = []
        standing: list[StandingLight] = []
        for signal in settled:
            place = signal.place
            if place.kind != "traffic_light" or place.element in placed:
                result.append(signal)
                continue
            stop = stops.get(place)
            if stop is not None:
                numbers = self._controls_at_stop(stop)
                result.append(signal._replace(numbers=tuple(numbers), guess=stop.guess))
                continue
            read, guess = self._read_anew(place)
            numbers, reason = self._controls_elsewhere(read, lit)
            if numbers:
                result.append(signal._replace(numbers=tuple(numbers), guess=reason or guess))
                continue
            result.append(signal)
            if self._odr.roads[place.road].junction is None and self._edges_faced(read):
                standing.append(StandingLight(place, read, guess))
        return result, standing

    def _read_anew(self, place: Acting) -> tuple[Acting, str]:
        """A light as it must be meant, and why, where it is for no lane for vehicles."""
        road = self._odr.roads[place.road]
        s = min(max(place.s, 0.0), road.length)
        table = self._table
        lanes = [
            (int(table.lane_id[row]), bool(table.lane_forward[row]))
            for row in table.lanes_at(table.road_index[road.id], s)
            if allowed(table.lane_type[row])
        ]
        guess = ""
        if place.validities and not any(place.applies_to(lane) for lane, _ in lanes):
            place, guess = place._replace(validities=()), NO_LANE_VALID
        if lanes and not any(place.faces(growing=growing) for _, growing in lanes):
            other = "-" if place.orientation == "+" else "+"
            place, guess = place._replace(orientation=other), NO_LANE_FACED
        return place, guess

    def _controls_elsewhere(self, place: Acting, lit: AbstractSet[int]) -> tuple[list[int], str]:
        """Connections of a junction that a light is for, and why where that is a guess."""
        numbers = self._reach.controls(place)
        if numbers or self._odr.roads[place.road].junction is not None:
            return numbers, ""
        for edge in self._edges_faced(place):
            ahead, gap = self._leads_to_junction(place, edge)
            if ahead and (gap < APART or lit.isdisjoint(ahead)):
                numbers += ahead
        if numbers:
            return numbers, ""
        road = self._table.road_index[place.road]
        home = {
            number
            for number, connection in enumerate(self._connections)
            if self._edges[connection.target].road == road
            and place.faces(growing=self._edges[connection.target].forward)
            and 0.0 <= self._metres_past(connection.target, place.s) <= STANDS_BEHIND
            and self._is_junction(connection.source)
        }
        return self._reach.before(place, home), BEHIND_JUNCTION

    def _metres_past(self, edge: int, s: float) -> float:
        """Metres from the start of an edge to a place on its road, in driving direction."""
        return (s - self._edges[edge].start) * (1.0 if self._edges[edge].forward else -1.0)

    def _edges_faced(self, place: Acting) -> list[int]:
        """Edges on which vehicles come towards a light."""
        edges = []
        for growing in (True, False):
            numbers = self._by_road.get((self._table.road_index[place.road], growing), ())
            if not numbers or not place.faces(growing=growing):
                continue
            # The edge that it is beside, or the next one ahead of it.
            gaps = [(self._metres_past(n, place.s), n) for n in numbers]
            edge = min(((gap, n) for gap, n in gaps if gap >= 0.0), default=max(gaps))[1]
            if self._valid_lanes(place, edge):
                edges.append(edge)
        return edges

    def _valid_lanes(self, place: Acting, edge: int) -> set[int]:
        """Lanes of an edge, by index, that a light is valid for."""
        ids = self._table.lane_id
        return {
            index
            for index, lane in enumerate(self._edges[edge].lanes)
            if any(place.applies_to(int(ids[stretch.row])) for stretch in lane.alignment)
        }

    def _leads_to_junction(self, place: Acting, edge: int) -> tuple[list[int], float]:
        """Connections of the junction to which the lanes past a light lead, and metres to there."""
        gap = abs(self._edges[edge].end - place.s)
        reached = {(edge, lane) for lane in self._valid_lanes(place, edge)}
        seen = set(reached)
        while reached and gap <= REACH:
            sources = sorted({number for number, _ in reached})
            leaving = [
                n
                for source in sources
                for n in self._leaving.get(source, ())
                if (source, self._connections[n].source_lane) in reached
            ]
            if any(self._is_junction(source) for source in sources):
                return [n for n in leaving if self._is_junction(self._connections[n].source)], gap
            following = {
                (self._connections[n].target, self._connections[n].target_lane) for n in leaving
            } - seen
            seen |= following
            gap += min(
                (abs(self._edges[n].end - self._edges[n].start) for n, _ in following),
                default=math.inf,
            )
            reached = following
        return [], math.inf

    def _controls_at_stop(self, stop: RoadStop) -> list[int]:
        """Connections over the part of a road that is the junction of a light."""
        numbers: list[int] = []
        for growing in (True, False):
            if not stop.read.faces(growing=growing):
                continue
            before, behind = stop.gap.start, stop.gap.end
            if not growing:
                before, behind = behind, before
            own = self._by_road.get((self._table.road_index[stop.read.road], growing), ())
            arriving = {n for n in own if _same_s(self._edges[n].end, before)}
            leaving = {n for n in own if _same_s(self._edges[n].start, behind)}
            for number, connection in enumerate(self._connections):
                if connection.source in arriving:
                    lane = self._edges[connection.source].lanes[connection.source_lane]
                    rows = [lane.alignment[-1].row]
                elif not arriving and connection.target in leaving:
                    lane = self._edges[connection.target].lanes[connection.target_lane]
                    rows = [lane.alignment[0].row]
                elif not own:
                    rows = self._rows_over(connection, stop.read.road, growing=growing)
                else:
                    continue
                if any(stop.read.applies_to(int(self._table.lane_id[row])) for row in rows):
                    numbers.append(number)
        return numbers

    def _rows_over(
        self, connection: PlannedConnection, road: RoadId, *, growing: bool
    ) -> list[int]:
        """Lanes of a road that is a junction as a whole, under a connection of one direction."""
        lane_road, row = self._table.lane_road, self._table.road_index[road]
        return [
            stretch.row
            for stretch in connection.alignment
            if lane_road[stretch.row] == row and (stretch.end > stretch.start) == growing
        ]


def _same_s(one: float, other: float) -> bool:
    return abs(one - other) < 1e-6


def cut_for_lights(
    odr: OpenDrive,
    standing: Sequence[StandingLight],
    gaps: Mapping[RoadId, Sequence[RoadGap]],
) -> tuple[dict[Acting, RoadStop], dict[RoadId, tuple[RoadGap, ...]]]:
    """Part of the road for each light that needs a place of its own.

    Lights of one road that are near each other share one: those of both directions at a crossing.

    Parameters
    ----------
    gaps
        Parts of roads that are left to junctions already.

    Returns
    -------
    tuple
        The place of each light, and all gaps with those that came.
    """
    by_road: dict[RoadId, list[StandingLight]] = {}
    for light in standing:
        by_road.setdefault(light.place.road, []).append(light)
    stops: dict[Acting, RoadStop] = {}
    wider = {road: tuple(own) for road, own in gaps.items()}
    for road_id, lights in by_road.items():
        road = odr.roads[road_id]
        lights.sort(key=lambda light: light.place.s)
        for group in _group_near_lights(lights):
            gap = _gap_of_lights(road, group, wider.get(road_id, ()))
            if gap is None:
                continue
            own = wider.get(road_id, ())
            if gap not in own:
                wider[road_id] = tuple(sorted((*own, gap)))
            for light in group:
                stops[light.place] = RoadStop(light.read, light.guess, gap)
    return stops, wider


def _group_near_lights(lights: Sequence[StandingLight]) -> Iterator[list[StandingLight]]:
    """Lights in the order of s in groups."""
    group: list[StandingLight] = []
    for light in lights:
        apart = group and light.place.s - group[-1].place.s > APART
        if apart or (group and light.place.s - group[0].place.s > LONGEST_GAP):
            yield group
            group = []
        group.append(light)
    if group:
        yield group


def _gap_of_lights(
    road: Road, lights: Sequence[StandingLight], taken: Sequence[RoadGap]
) -> RoadGap | None:
    """Part of a road around lights; that of a junction that is there already; or no room."""
    low, high = lights[0].place.s - HALF_GAP, lights[-1].place.s + HALF_GAP
    # Where a road leads on the junction is where the two roads meet; else a piece of road stays.
    first = 0.0 if _leads_on(road, "start") else LEAST_STUB
    last = road.length - (0.0 if _leads_on(road, "end") else LEAST_STUB)
    if low < (TO_LINK if _leads_on(road, "start") else LEAST_STUB):
        low, high = first, max(high, first + 2.0 * HALF_GAP)
    if road.length - high < (TO_LINK if _leads_on(road, "end") else LEAST_STUB):
        low, high = min(low, last - 2.0 * HALF_GAP), last
    for gap in taken:
        if low - LEAST_STUB < gap.end and gap.start < high + LEAST_STUB:
            return gap
    low, high = max(low, first), min(high, last)
    if low >= high:
        return None
    if high - low < road.length - LEAST_STUB:
        return RoadGap(low, high)
    if not (_leads_on(road, "start") and _leads_on(road, "end")) or road.length > LONGEST_GAP:
        return None
    # A road of some metres between two others keeps one; a shorter one is the junction as a whole.
    rest = LEAST_STUB if road.length > LEAST_STUB + LEAST_GAP else 0.0
    return RoadGap(0.0, road.length - rest)


def _leads_on(road: Road, end: str) -> bool:
    link = road.predecessor if end == "start" else road.successor
    return link is not None and link.element_type == "road"
