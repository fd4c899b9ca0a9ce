"""Signals and signs of the map: which movements they control, and in which junctions.

A signal acts where it is and wherever a ``<signalReference>`` repeats it, on the lanes of its
validity, in the direction of its orientation (sections 14.1 to 14.5). On a connecting road it
controls the connections that run over it; on any other road it controls the next junction ahead.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from odscen.convert.model.right_of_way import Sign
from odscen.opendrive.objects import signal_kind

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from odscen.base.ids import RoadId
    from odscen.convert.model.connections import PlannedConnection
    from odscen.convert.model.edge_plan import EdgePlan
    from odscen.convert.model.lane_alignment import LaneAlignment
    from odscen.opendrive.lanes import RoadTable
    from odscen.opendrive.road_model import OpenDrive, Signal, SignalReference, Validity

REACH = 80.0
"""Metres ahead of a signal on a road within which the junction that it controls must come."""

BEHIND = 5.0
"""Metres past the end of an edge where its signals may be, as beyond a stop line."""

SIGN_KINDS = {"stop": Sign.STOP, "yield": Sign.YIELD}


class Acting(NamedTuple):
    """One place where a signal acts."""

    signal: str
    kind: str
    road: RoadId
    s: float
    orientation: str
    validities: tuple[Validity, ...]

    def applies_to(self, lane_id: int) -> bool:
        """Whether it is valid for a lane; without validity it is for all."""
        if not self.validities:
            return True
        return any(
            min(v.from_lane, v.to_lane) <= lane_id <= max(v.from_lane, v.to_lane)
            for v in self.validities
        )

    def faces(self, *, growing: bool) -> bool:
        """Whether it faces traffic that runs with growing s, or else against it.

        Where a validity names lanes, these decide: tools write the orientation of the pole.
        """
        if self.validities:
            return True
        return {"+": growing, "-": not growing}.get(self.orientation, True)


class SignalControl(NamedTuple):
    """What controls each connection: ids of traffic lights, and the strongest sign.

    ``unplaced`` are signals that control nothing, with the reason.
    """

    lights: tuple[tuple[str, ...], ...]
    signs: tuple[Sign, ...]
    unplaced: tuple[tuple[str, str], ...]


def acting(odr: OpenDrive) -> Iterator[Acting]:
    """All places where traffic lights, stop and yield signs act, in the order of the file."""
    kinds = {
        signal.id: signal_kind(signal) for road in odr.roads.values() for signal in road.signals
    }
    for road in odr.roads.values():
        signals: tuple[Signal | SignalReference, ...] = (*road.signals, *road.signal_references)
        for one in signals:
            kind = kinds.get(one.id, "other")
            if kind == "traffic_light" or kind in SIGN_KINDS:
                yield Acting(one.id, kind, road.id, one.s, one.orientation, one.validities)


def signal_control(
    odr: OpenDrive,
    table: RoadTable,
    edges: Sequence[EdgePlan],
    connections: Sequence[PlannedConnection],
    is_junction: Callable[[int], bool],
) -> SignalControl:
    """Relate signals and signs to connections.

    Parameters
    ----------
    edges, connections
        The network to be.
    is_junction
        Whether an edge (its position) ends at a place where traffic meets, and not only where the
        lanes of one road change.
    """
    lights: list[dict[str, None]] = [{} for _ in connections]
    signs = [Sign.NONE for _ in connections]
    over: dict[RoadId, list[int]] = {}
    leaving: dict[int, list[int]] = {}
    for number, connection in enumerate(connections):
        leaving.setdefault(connection.source, []).append(number)
        for road in _roads(connection.alignment, table):
            over.setdefault(road, []).append(number)
    by_road: dict[tuple[int, bool], list[int]] = {}
    for index, edge in enumerate(edges):
        by_road.setdefault((edge.road, edge.forward), []).append(index)
    placed: set[str] = set()
    seen: dict[str, str] = {}
    for place in acting(odr):
        seen[place.signal] = f"road {place.road} > signal {place.signal}"
        inside = odr.roads[place.road].junction is not None
        if inside:
            numbers = _on_connecting(place, table, connections, over)
        else:
            numbers = _ahead(place, table, edges, connections, by_road, leaving, is_junction)
        for number in numbers:
            placed.add(place.signal)
            if place.kind == "traffic_light":
                lights[number][place.signal] = None
            else:
                signs[number] = max(signs[number], SIGN_KINDS[place.kind])
    unplaced = [
        (where, "it controls no movement: no lane within its validity leads to a junction near it")
        for signal, where in seen.items()
        if signal not in placed
    ]
    return SignalControl(tuple(tuple(own) for own in lights), tuple(signs), tuple(unplaced))


def _roads(alignment: LaneAlignment, table: RoadTable) -> Iterator[RoadId]:
    for stretch in alignment:
        yield table.road_ids[table.lane_road[stretch.row]]


def _on_connecting(
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


def _ahead(
    place: Acting,
    table: RoadTable,
    edges: Sequence[EdgePlan],
    connections: Sequence[PlannedConnection],
    by_road: dict[tuple[int, bool], list[int]],
    leaving: dict[int, list[int]],
    is_junction: Callable[[int], bool],
) -> list[int]:
    road = table.road_index[place.road]
    found: list[int] = []
    for growing in (True, False):
        if not place.faces(growing=growing):
            continue
        sign = 1.0 if growing else -1.0
        own = sorted(by_road.get((road, growing), ()), key=lambda n: sign * edges[n].end)
        ahead = [n for n in own if sign * (edges[n].end - place.s) > -BEHIND and is_junction(n)]
        if not ahead or sign * (edges[ahead[0]].end - place.s) > REACH:
            continue
        edge = ahead[0]
        for number in leaving.get(edge, ()):
            last = edges[edge].lanes[connections[number].source_lane].alignment[-1]
            if place.applies_to(int(table.lane_id[last.row])):
                found.append(number)
    return found
