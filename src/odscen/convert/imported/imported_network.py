"""A network that odscen has not written, made usable: lane table and import report."""

from __future__ import annotations

from typing import TYPE_CHECKING

from odscen.base.errors import InputError
from odscen.convert.imported.geometric_table import geometric_table
from odscen.convert.imported.net_import import read_network
from odscen.convert.lane_table.coverage import covered_metres, kept_lanes, lane_lengths
from odscen.convert.lane_table.sumo_network import SumoNetwork
from odscen.convert.model.access import PEDESTRIAN, allowed, is_used
from odscen.convert.model.conversion_report import (
    ConversionReport,
    ElementOutcome,
    ReportEntry,
    parser_entries,
)
from odscen.convert.model.net import NORMAL
from odscen.convert.verify.fidelity import verify
from odscen.convert.verify.fidelity_result import NEAR
from odscen.opendrive.objects import signal_kind
from odscen.opendrive.road_model import WALKABLE_TYPES

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from odscen.convert.lane_table.table import LaneTable
    from odscen.convert.verify.fidelity_result import Fidelity
    from odscen.lanegraph.graphs import PedestrianGraph
    from odscen.opendrive.lanes import RoadTable
    from odscen.opendrive.road_model import OpenDrive


WORTH_TELLING = 1.0
"""Metres of a lane without SUMO lane that make an entry."""

AREA = 1.5
"""Metres of a walk that walking areas, which are no lanes, may take without an entry."""


def import_findings(
    odr: OpenDrive, table: RoadTable, lanes: LaneTable, fidelity: Fidelity
) -> tuple[tuple[ReportEntry, ...], dict[str, float]]:
    """Entries and figures of the report."""
    lengths = lane_lengths(odr, table, lanes)
    entries = (
        *kept_lanes(lengths),
        *_find_lane_entries(odr, table, lanes),
        *_find_connection_entries(fidelity),
        *_find_crossing_entries(lanes, fidelity),
        *_find_light_entries(lanes, fidelity),
    )
    figures = {
        **lengths,
        "connections": float(fidelity.relations - len(fidelity.missing)),
        "connections_lost": float(len(fidelity.missing)),
        "connections_invented": float(len(fidelity.invented)),
        "crosswalks": float(fidelity.crosswalks),
        "crosswalks_lost": float(len(fidelity.lost_crosswalks)),
        "crossings": float(lanes.counts["crossings"]),
        "traffic_lights": float(lanes.counts["tl_logics"]),
        "signals": float(sum(len(road.signals) for road in odr.roads.values())),
    }
    return entries, figures


def unread_signs(odr: OpenDrive) -> Iterator[ReportEntry]:
    """Yield the signs of right of way of a map, none of which netconvert reads."""
    for road in odr.roads.values():
        for signal in road.signals:
            kind = signal_kind(signal)
            if kind in ("stop", "yield"):
                reason = f"{kind} sign: netconvert does not read it, and ranks roads itself"
                element = f"road {road.id} > signal {signal.id}"
                yield ReportEntry(ElementOutcome.LOST, element, reason)


def _describe_place(road: str, section: int, lane: int) -> str:
    return f"road {road} > laneSection {section} > lane {lane}"


def _find_lane_entries(odr: OpenDrive, table: RoadTable, lanes: LaneTable) -> Iterator[ReportEntry]:
    """Lanes without a SUMO lane, and lanes that it lies beside."""
    covered = covered_metres(lanes)
    worst: dict[object, float] = {}
    for span in lanes.spans:
        key = lanes.lane_keys[span.lane]
        deviation = float(lanes.intervals[span.interval].deviation.max())
        worst[key] = max(worst.get(key, 0.0), deviation)
    for row, key in enumerate(table.lane_keys):
        if not is_used(table.lane_type[row]):
            continue
        walk = table.lane_type[row] in WALKABLE_TYPES
        if walk and odr.roads[key.road].junction is not None:
            continue  # persons cross junctions on walking areas, which have no lanes
        length = float(table.lane_s1[row] - table.lane_s0[row])
        gap = length - covered.get(key, 0.0)
        if gap > (AREA if walk and gap < length else WORTH_TELLING):
            reason = f"{gap:.2f} of {length:.2f} m have no SUMO lane"
            yield ReportEntry(ElementOutcome.LOST, _describe_place(*key), reason)
        elif worst.get(key, 0.0) > NEAR:
            reason = f"SUMO's lane lies up to {worst[key]:.2f} m beside the lane's centre"
            yield ReportEntry(ElementOutcome.GUESSED, _describe_place(*key), reason)


def _find_connection_entries(fidelity: Fidelity) -> Iterator[ReportEntry]:
    kept = fidelity.relations - len(fidelity.missing)
    if kept:
        reason = f"{kept} of {fidelity.relations} relations between lanes of roads"
        yield ReportEntry(ElementOutcome.KEPT, "map", reason)
    for relation in fidelity.missing:
        reason = f"no connection to lane {relation.target} in SUMO"
        yield ReportEntry(ElementOutcome.LOST, f"lane {relation.source}", reason)
    for relation in fidelity.invented:
        reason = f"SUMO connects it to lane {relation.target} ({relation.sumo}), the map does not"
        yield ReportEntry(ElementOutcome.GUESSED, f"lane {relation.source}", reason)


def _find_crossing_entries(lanes: LaneTable, fidelity: Fidelity) -> Iterator[ReportEntry]:
    for lost in fidelity.lost_crosswalks:
        element = f"road {lost.road} > object {lost.object_id}"
        reason = f"crosswalk: crossings of the network lie on {100 * lost.share:.0f} % of it"
        yield ReportEntry(ElementOutcome.LOST, element, reason)
    kept = fidelity.crosswalks - len(fidelity.lost_crosswalks)
    if kept:
        reason = f"{kept} of {fidelity.crosswalks} crosswalks are crossings"
        yield ReportEntry(ElementOutcome.KEPT, "map", reason)
    others = lanes.counts["crossings"] - kept
    if others > 0:
        reason = f"{others} crossings of the network lie where the map has no crosswalk"
        yield ReportEntry(ElementOutcome.GUESSED, "map", reason)


def _find_light_entries(lanes: LaneTable, fidelity: Fidelity) -> Iterator[ReportEntry]:
    signals = fidelity.signals
    for junction in signals.lost:
        reason = "its traffic lights are not in the network"
        yield ReportEntry(ElementOutcome.LOST, f"junction {junction}", reason)
    for light in signals.lost_lights:
        yield ReportEntry(ElementOutcome.LOST, light, "traffic light that controls nothing in SUMO")
    for junction in signals.invented:
        reason = "SUMO has traffic lights where the map has none"
        yield ReportEntry(ElementOutcome.GUESSED, f"SUMO junction {junction}", reason)
    if lanes.lights:
        reason = (
            f"{len(lanes.lights)} traffic lights have the network's programs: OpenDRIVE has none"
        )
        yield ReportEntry(ElementOutcome.GUESSED, "map", reason)
    if fidelity.unsafe_pairs:
        places = len({pair.tl for pair in fidelity.unsafe_pairs})
        reason = (
            f"{len(fidelity.unsafe_pairs)} pairs of movements that meet have green together at "
            f"{places} traffic lights, and neither gives way"
        )
        yield ReportEntry(ElementOutcome.GUESSED, "map", reason)


LEAST_COVERED = 0.05
"""Share of the driving lanes of a map that a network must have to be one of this map."""

LEAST_PLACED = 0.5
"""Share of the network's lanes outside junctions that must lie on lanes of the map."""

ROAD_USERS = allowed("driving") | PEDESTRIAN
"""Classes whose lanes a map can have; tracks are none (:data:`LEAST_PLACED`)."""


def imported_network(
    net_xml: bytes,
    odr: OpenDrive,
    table: RoadTable,
    walks: PedestrianGraph,
    *,
    entries: Sequence[ReportEntry] = (),
) -> SumoNetwork:
    """Relate a network to its map.

    Parameters
    ----------
    net_xml
        Text of a ``.net.xml``; taken as it is.
    odr, table, walks
        The road model, its evaluation, and the pedestrian graph of the map.
    entries
        What is known already of how the network came about.

    Raises
    ------
    InputError
        If it is no network, or none of this map.
    """
    net = read_network(net_xml)
    lanes = geometric_table(net, odr, table, walks)
    for offset in _other_offsets(net.offset, odr):
        # A map that was made of a network may have that network's coordinates, whatever its
        # netOffset; of a grid some lanes lie on others wherever it is put, so that the most counts.
        other = geometric_table(read_network(net_xml, offset=offset), odr, table, walks)
        if _sum_placed_lengths(other) > _sum_placed_lengths(lanes):
            lanes = other
    fidelity = verify(net_xml, odr, table, offset=lanes.net_offset)
    found, figures = import_findings(odr, table, lanes, fidelity)
    _refuse_stranger(figures, lanes)
    report = ConversionReport.of([*parser_entries(odr.notes), *entries, *found], figures)
    return SumoNetwork(net_xml, lanes, report)


def _other_offsets(offset: tuple[float, float], odr: OpenDrive) -> tuple[tuple[float, float], ...]:
    """Where SUMO's origin may be besides its netOffset, metres in the frame of the map."""
    x, y, _, _ = odr.header.offset
    moved = round(offset[0] + x, 6), round(offset[1] + y, 6)
    return tuple(other for other in dict.fromkeys((moved, (0.0, 0.0))) if other != offset)


def _list_placeable_lengths(lanes: LaneTable) -> dict[int, float]:
    """Lengths in metres of SUMO's lanes outside junctions that a map can have, by their rows."""
    return {
        row: lane.length
        for row, lane in enumerate(lanes.lane_list)
        if lanes.edges[lane.edge].function == NORMAL
        and (lane.allowed is None or lane.allowed & ROAD_USERS)
    }


def _sum_placed_lengths(lanes: LaneTable) -> float:
    """Metres of these lanes that lie on lanes of the map."""
    own = _list_placeable_lengths(lanes)
    return sum(
        float(interval.pos[-1] - interval.pos[0])
        for interval in lanes.intervals
        if interval.sumo in own
    )


def _refuse_stranger(figures: Mapping[str, float], lanes: LaneTable) -> None:
    length = sum(figures.get(f"driving_{where}_length", 0.0) for where in ("road", "junction"))
    covered = sum(figures.get(f"driving_{where}_covered", 0.0) for where in ("road", "junction"))
    own = _list_placeable_lengths(lanes)
    placed = _sum_placed_lengths(lanes)
    if covered < LEAST_COVERED * length or placed < LEAST_PLACED * sum(own.values()):
        x, y = lanes.net_offset
        raise InputError(
            f"the SUMO network is not one of this map: {placed:.0f} of {sum(own.values()):.0f} m "
            f"of its lanes lie on lanes of the map, on {covered:.0f} of {length:.0f} m of driving "
            f"lanes (netOffset {x:g},{y:g})"
        )
