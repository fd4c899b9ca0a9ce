"""Signals and signs of the map: which movements they control, and in which junctions.

A signal acts where it is and wherever a ``<signalReference>`` repeats it, on the lanes of its
validity, in the direction of its orientation (sections 14.1 to 14.5). On a connecting road it
controls the connections that run over it; on any other road it controls the next junction ahead.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from odscen.base.shown import shown_id
from odscen.convert.model.right_of_way import Sign, wrapped
from odscen.convert.signals.acting_signals import Acting, SettledSignal
from odscen.convert.signals.road_lights import REACH, RoadLights
from odscen.opendrive.objects import signal_kind
from odscen.opendrive.sign_catalogue import sign_meaning

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
    from collections.abc import Set as AbstractSet

    from odscen.base.ids import RoadId
    from odscen.convert.model.connections import PlannedConnection
    from odscen.convert.model.edge_plan import EdgePlan
    from odscen.convert.model.lane_alignment import LaneAlignment
    from odscen.convert.signals.acting_signals import SignalReach
    from odscen.convert.signals.road_lights import RoadStop, StandingLight
    from odscen.opendrive.lanes import RoadTable
    from odscen.opendrive.road_model import OpenDrive, Signal, SignalReference


STANDS_NEAR = 20.0
"""Metres from a junction within which signals on a road stand that are for this junction."""

REVERSED_SHARE = 0.8
"""Share of the signals near junctions that must face away for all to be taken reversed."""

AWAY_FROM_HOME = "it faces away from the junction whose controller names it: taken reversed"
AWAY_THROUGHOUT = (
    "signals of this file face away from the junctions at which they stand: taken reversed"
)
FAR_SIDE = (
    "it is placed beyond the junction whose controller names it: taken for the approach before"
)
WHOLE_JUNCTION = (
    "no lane leads from it to the junction whose controller names it: taken for all movements there"
)

_FLIPPED = {"+": "-", "-": "+"}


def signal_homes(
    odr: OpenDrive, junctions: Sequence[AbstractSet[str]]
) -> dict[str, frozenset[int]]:
    """Movements of the junctions that list a controller of each signal.

    Parameters
    ----------
    junctions
        By movement: ids of the junctions through which it leads.
    """
    through: dict[str, set[int]] = {}
    for number, passed in enumerate(junctions):
        for junction_id in passed:
            through.setdefault(junction_id, set()).add(number)
    homes: dict[str, set[int]] = {}
    for junction in odr.junctions.values():
        for controller in junction.controllers:
            for signal, _ in odr.controllers[controller].controls:
                homes.setdefault(signal, set()).update(through.get(junction.id, ()))
    return {signal: frozenset(home) for signal, home in homes.items() if home}


def settle_signals(
    places: Sequence[Acting], reach: SignalReach, homes: Mapping[str, frozenset[int]]
) -> list[SettledSignal]:
    """Say what each signal controls at each of its places, in their order.

    Parameters
    ----------
    homes
        As :func:`signal_homes` gives them.
    """
    settled = [SettledSignal(place, tuple(reach.controls(place))) for place in places]
    backwards = _facing_away(places, reach, homes)
    astray = _find_astray_signals(settled, homes)
    settled = [
        _reverse_if_away(signal, reach, homes.get(signal.place.signal))
        if signal.place.signal in astray or signal.place in backwards
        else signal
        for signal in settled
    ]
    astray = _find_astray_signals(settled, homes)
    settled = [
        _replace_movements(signal, reach.before(signal.place, homes[signal.place.signal]), FAR_SIDE)
        if signal.place.signal in astray and signal.place.kind == "traffic_light"
        else signal
        for signal in settled
    ]
    lit = {n for signal in settled if signal.place.kind == "traffic_light" for n in signal.numbers}
    dark = {signal for signal in _find_astray_signals(settled, homes) if not homes[signal] & lit}
    return [
        _replace_movements(signal, sorted(homes[signal.place.signal]), WHOLE_JUNCTION)
        if signal.place.signal in dark and signal.place.kind == "traffic_light"
        else signal
        for signal in settled
    ]


def _find_astray_signals(
    settled: Iterable[SettledSignal], homes: Mapping[str, frozenset[int]]
) -> frozenset[str]:
    """Signals that control nothing of the junctions whose controllers name them."""
    found: dict[str, bool] = {}
    for settled_signal in settled:
        home = homes.get(settled_signal.place.signal)
        if home:
            at_home = not home.isdisjoint(settled_signal.numbers)
            found[settled_signal.place.signal] = (
                found.get(settled_signal.place.signal, False) or at_home
            )
    return frozenset(signal for signal, at_home in found.items() if not at_home)


def _flip_acting(place: Acting) -> Acting | None:
    """A place facing the other way; none where a validity decides, or it faces both ways."""
    if place.validities or place.orientation not in _FLIPPED:
        return None
    return place._replace(orientation=_FLIPPED[place.orientation])


def _reverse_if_away(
    settled_signal: SettledSignal, reach: SignalReach, home: frozenset[int] | None
) -> SettledSignal:
    flipped = _flip_acting(settled_signal.place)
    if flipped is None:
        return settled_signal
    numbers = reach.controls(flipped)
    if home is None:
        return _replace_movements(settled_signal, numbers, AWAY_THROUGHOUT)
    return (
        settled_signal
        if home.isdisjoint(numbers)
        else _replace_movements(settled_signal, numbers, AWAY_FROM_HOME)
    )


def _replace_movements(
    settled_signal: SettledSignal, numbers: Sequence[int], guess: str
) -> SettledSignal:
    return SettledSignal(settled_signal.place, tuple(numbers), guess) if numbers else settled_signal


def _facing_of(place: Acting, reach: SignalReach) -> int:
    """1 if a signal faces the junction at which it stands, -1 if it faces away, 0 if unclear."""
    if _flip_acting(place) is None:
        return 0
    growing = place.orientation == "+"
    ahead = reach.distance(place, growing=growing)
    behind = reach.distance(place, growing=not growing)
    nearer = min(ahead, behind)
    if not math.isfinite(nearer) or nearer > STANDS_NEAR or abs(ahead - behind) <= STANDS_NEAR:
        return 0
    return 1 if ahead < behind else -1


def _facing_away(
    places: Sequence[Acting], reach: SignalReach, homes: Mapping[str, frozenset[int]]
) -> frozenset[Acting]:
    """Places without a controller's junction to be taken reversed: none, or all of the file.

    All but those that do face the junction at which they stand.
    """
    looks = {place: _facing_of(place, reach) for place in places if place.signal not in homes}
    away = sum(look < 0 for look in looks.values())
    towards = sum(look > 0 for look in looks.values())
    if not away or away < REVERSED_SHARE * (away + towards):
        return frozenset()
    return frozenset(place for place, look in looks.items() if look <= 0)


BEHIND = 5.0
"""Metres past the end of an edge where its signals may be, as beyond a stop line."""

STRAIGHT = math.radians(45.0)
"""A movement that turns by less comes straight towards what stands behind the junction."""

SIGN_KINDS = {"stop": Sign.STOP, "yield": Sign.YIELD}


class SignalControl(NamedTuple):
    """What controls each connection: ids of traffic lights, and the strongest sign.

    ``unplaced`` are signals that control nothing, with the reason; ``guessed`` are those that do
    not control what the file says, but what it must mean. ``standing`` are the lights that need
    a place of their own, ``stops`` the elements of those that have one. ``favoured`` are
    the connections of priority signs, by the elements of these.
    """

    lights: tuple[tuple[str, ...], ...]
    signs: tuple[Sign, ...]
    unplaced: tuple[tuple[str, str], ...]
    guessed: tuple[tuple[str, str], ...]
    standing: tuple[StandingLight, ...] = ()
    stops: frozenset[str] = frozenset()
    favoured: tuple[tuple[str, tuple[int, ...]], ...] = ()


def acting(odr: OpenDrive) -> Iterator[Acting]:
    """All places where traffic lights, stop and yield signs act, in the order of the file."""
    known: dict[str, tuple[str, str]] = {}
    for road in odr.roads.values():
        for signal in road.signals:
            element = f"road {shown_id(road.id)} > signal {shown_id(signal.id)}"
            known.setdefault(signal.id, (signal_kind(signal), element))
    for road in odr.roads.values():
        signals: tuple[Signal | SignalReference, ...] = (*road.signals, *road.signal_references)
        for number, road_signal in enumerate(signals):
            kind, element = known.get(road_signal.id, ("other", ""))
            if number < len(road.signals):
                kind, element = (
                    signal_kind(road.signals[number]),
                    f"road {shown_id(road.id)} > signal {shown_id(road_signal.id)}",
                )
            if kind == "traffic_light" or kind in SIGN_KINDS:
                yield Acting(
                    road_signal.id,
                    element,
                    kind,
                    road.id,
                    road_signal.s,
                    road_signal.orientation,
                    road_signal.validities,
                )


def _priority_places(odr: OpenDrive) -> Iterator[Acting]:
    """Places of the signs that give priority at the next junction."""
    for road in odr.roads.values():
        for signal in road.signals:
            if sign_meaning(signal) == "priority":
                element = f"road {shown_id(road.id)} > signal {shown_id(signal.id)}"
                facing = signal.orientation, signal.validities
                yield Acting(signal.id, element, "priority", road.id, signal.s, *facing)


def signal_control(
    odr: OpenDrive,
    table: RoadTable,
    edges: Sequence[EdgePlan],
    connections: Sequence[PlannedConnection],
    is_junction: Callable[[int], bool],
    stops: Mapping[Acting, RoadStop] | None = None,
) -> SignalControl:
    """Relate signals and signs to connections.

    Parameters
    ----------
    edges, connections
        The network to be.
    is_junction
        Whether an edge (its position) ends at a place where traffic meets, and not only where the
        lanes of one road change.
    stops
        Places that roads have been cut for, by the lights that need them.
    """
    reach = _SignalReach(odr, table, edges, connections, is_junction)
    homes = signal_homes(odr, [reach.junctions(number) for number in range(len(connections))])
    settled = settle_signals(list(acting(odr)), reach, homes)
    on_roads = RoadLights(odr, table, edges, connections, is_junction, reach)
    settled, standing = on_roads.settle(settled, stops or {})
    lights: list[dict[str, None]] = [{} for _ in connections]
    signs = [Sign.NONE for _ in connections]
    for place, numbers, _ in settled:
        for number in numbers:
            if place.kind == "traffic_light":
                lights[number][place.signal] = None
            else:
                signs[number] = max(signs[number], SIGN_KINDS[place.kind])
    placed = {signal.place.element for signal in settled if signal.numbers}
    unplaced = [
        (where, "it controls no movement: no lane within its validity leads to a junction near it")
        for where in dict.fromkeys(signal.place.element for signal in settled)
        if where not in placed
    ]
    guessed = {signal.place.element: signal.guess for signal in settled if signal.guess}
    return SignalControl(
        tuple(tuple(own) for own in lights),
        tuple(signs),
        tuple(unplaced),
        tuple(guessed.items()),
        tuple(standing),
        frozenset(place.element for place in stops or {}) & placed,
        tuple((place.element, tuple(reach.controls(place))) for place in _priority_places(odr)),
    )


class _SignalReach:
    """Which connections lie before, behind and under signals."""

    def __init__(
        self,
        odr: OpenDrive,
        table: RoadTable,
        edges: Sequence[EdgePlan],
        connections: Sequence[PlannedConnection],
        is_junction: Callable[[int], bool],
    ) -> None:
        self._odr = odr
        self._table = table
        self._edges = edges
        self._connections = connections
        self._is_junction = is_junction
        self._over: dict[RoadId, list[int]] = {}
        self._leaving: dict[int, list[int]] = {}
        for number, connection in enumerate(connections):
            self._leaving.setdefault(connection.source, []).append(number)
            for road in _roads_of(connection.alignment, table):
                self._over.setdefault(road, []).append(number)
        self._by_road: dict[tuple[int, bool], list[int]] = {}
        for index, edge in enumerate(edges):
            self._by_road.setdefault((edge.road, edge.forward), []).append(index)

    def junctions(self, number: int) -> frozenset[str]:
        """Junctions that a connection leads through."""
        passed = _roads_of(self._connections[number].alignment, self._table)
        return frozenset(str(self._odr.roads[road].junction) for road in passed) - {"None"}

    def controls(self, place: Acting) -> list[int]:
        """Connections under a place of a signal or, on roads outside junctions, ahead of it."""
        if self._is_in_junction(place.road):
            return _find_controlled_connections(place, self._table, self._connections, self._over)
        numbers: list[int] = []
        for growing in (True, False):
            edge, _ = self._edge_ahead(place, growing=growing)
            if edge is None or not place.faces(growing=growing):
                continue
            for number in self._leaving.get(edge, ()):
                last = self._edges[edge].lanes[self._connections[number].source_lane].alignment[-1]
                if place.applies_to(int(self._table.lane_id[last.row])):
                    numbers.append(number)
        return numbers

    def _is_in_junction(self, road: RoadId) -> bool:
        """Whether a road is a connecting one, or so short that its junctions have taken it up."""
        if self._odr.roads[road].junction is not None:
            return True
        row = self._table.road_index[road]
        return not any((row, growing) in self._by_road for growing in (True, False))

    def distance(self, place: Acting, *, growing: bool) -> float:
        """Metres to the next junction, whichever way the signal faces."""
        if self._odr.roads[place.road].junction is not None:
            return math.inf
        return abs(self._edge_ahead(place, growing=growing)[1])

    def _edge_ahead(self, place: Acting, *, growing: bool) -> tuple[int | None, float]:
        """Edge at the end of which the next junction comes, and metres to there."""
        sign = 1.0 if growing else -1.0
        gaps = [
            (sign * (self._edges[n].end - place.s), n)
            for n in self._by_road.get((self._table.road_index[place.road], growing), ())
            if self._is_junction(n)
        ]
        gap, edge = min(((gap, n) for gap, n in gaps if gap > -BEHIND), default=(math.inf, None))
        return (edge, gap) if gap <= REACH else (None, math.inf)

    def before(self, place: Acting, home: AbstractSet[int]) -> list[int]:
        """Connections of a junction whose edges come straight towards a road that leaves it."""
        road = self._table.road_index[place.road]
        straight = {
            self._connections[number].source
            for number in home
            if self._edges[target := self._connections[number].target].road == road
            and abs(self._edges[target].start - place.s) <= REACH
            and abs(self._turn_angle(self._connections[number])) < STRAIGHT
        }
        return sorted(n for n in home if self._connections[n].source in straight)

    def _turn_angle(self, connection: PlannedConnection) -> float:
        """Change of heading, radians."""
        last = self._edges[connection.source].lanes[connection.source_lane].alignment[-1]
        first = self._edges[connection.target].lanes[connection.target_lane].alignment[0]
        at = np.array([last.end, first.start])
        rows = np.array([last.row, first.row])
        back = ~self._table.lane_forward[rows]
        headings = self._table.lane_points(rows, at).hdg + np.where(back, math.pi, 0.0)
        return wrapped(float(headings[1] - headings[0]))


def _roads_of(alignment: LaneAlignment, table: RoadTable) -> Iterator[RoadId]:
    for stretch in alignment:
        yield table.road_ids[table.lane_road[stretch.row]]


def _find_controlled_connections(
    place: Acting,
    table: RoadTable,
    connections: Sequence[PlannedConnection],
    over: dict[RoadId, list[int]],
) -> list[int]:
    return [
        number
        for number in dict.fromkeys(over.get(place.road, ()))
        if any(
            table.road_ids[table.lane_road[stretch.row]] == place.road
            and place.applies_to(int(table.lane_id[stretch.row]))
            and place.faces(growing=stretch.end > stretch.start)
            for stretch in connections[number].alignment
        )
    ]
