"""What the conversion report says after the network is there."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from odscen.convert.report import Entry, Fate
from odscen.convert.table_build import BICYCLE_TYPES
from odscen.opendrive.model import DRIVABLE_TYPES, WALKABLE_TYPES

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from odscen.convert.lane_table import LaneTable
    from odscen.convert.table_build import BuiltTable
    from odscen.opendrive.lanes import RoadTable
    from odscen.opendrive.model import OpenDrive

WORTH_TELLING = 0.5
"""Metres of a lane without SUMO lane that make an entry."""
FAR = 0.25
"""Metres between the lane centres that make an entry."""

_USED = DRIVABLE_TYPES | WALKABLE_TYPES | BICYCLE_TYPES


class Findings(NamedTuple):
    """Entries and figures of the report."""

    entries: tuple[Entry, ...]
    figures: Mapping[str, float]


def findings(odr: OpenDrive, table: RoadTable, built: BuiltTable) -> Findings:
    """Compare the network with the map: lanes, connections, crosswalks, signals."""
    lanes = list(_lanes(odr, table, built.table))
    connections = list(_connections(built))
    furniture, counts = _furniture(odr, built.table)
    figures = {
        **_lengths(odr, table, built.table),
        "connections": float(built.wanted),
        "connections_missing": float(len(built.missing)),
        "connections_invented": float(len(built.invented)),
        **counts,
    }
    return Findings(tuple(lanes + connections + furniture), figures)


def _place(road: str, section: int, lane: int) -> str:
    return f"road {road} > laneSection {section} > lane {lane}"


def _covered(lanes: LaneTable) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
    """Metres of s of each lane of the table that have a SUMO lane."""
    covered = np.zeros(len(lanes.lane_keys))
    for span in lanes.spans:
        covered[span.lane] += span.high - span.low
    return covered


def _lanes(odr: OpenDrive, table: RoadTable, lanes: LaneTable) -> Iterator[Entry]:
    covered = _covered(lanes)
    worst = np.zeros(len(lanes.lane_keys))
    for span in lanes.spans:
        piece = lanes.pieces[span.piece]
        worst[span.lane] = max(worst[span.lane], float(piece.deviation.max()))
    for row, key in enumerate(lanes.lane_keys):
        at = table.lane_index[key]
        if table.lane_type[at] in WALKABLE_TYPES and odr.roads[key.road].junction is not None:
            continue  # persons cross junctions on walking areas, which have no lanes
        length = float(table.lane_s1[at] - table.lane_s0[at])
        gap = length - float(covered[row])
        if gap > WORTH_TELLING:
            reason = f"{gap:.2f} of {length:.2f} m have no SUMO lane"
            yield Entry(Fate.LOST, _place(*key), reason)
        elif worst[row] > FAR:
            reason = f"SUMO's lane lies up to {worst[row]:.2f} m beside the lane's centre"
            yield Entry(Fate.GUESSED, _place(*key), reason)
    for at, key in enumerate(table.lane_keys):
        if table.lane_type[at] not in _USED and table.lane_type[at] not in ("none", ""):
            reason = f"lanes of type {table.lane_type[at]} are closed to everybody in SUMO"
            yield Entry(Fate.LOST, f"road {key.road}", reason)


def _connections(built: BuiltTable) -> Iterator[Entry]:
    for one, other in built.missing:
        reason = f"no connection to {_place(*other)} in SUMO"
        yield Entry(Fate.LOST, _place(*one), reason)
    for one, other in built.invented:
        reason = f"SUMO connects it to {_place(*other)}, the map does not"
        yield Entry(Fate.GUESSED, _place(*one), reason)


def _lengths(odr: OpenDrive, table: RoadTable, lanes: LaneTable) -> dict[str, float]:
    covered = _covered(lanes)
    figures: dict[str, float] = {}
    for row, key in enumerate(lanes.lane_keys):
        at = table.lane_index[key]
        if table.lane_type[at] in DRIVABLE_TYPES:
            kind = "driving"
        else:
            kind = "walking" if table.lane_type[at] in WALKABLE_TYPES else "biking"
        where = "road" if odr.roads[key.road].junction is None else "junction"
        name = f"{kind}_{where}"
        length = float(table.lane_s1[at] - table.lane_s0[at])
        figures[f"{name}_length"] = figures.get(f"{name}_length", 0.0) + length
        figures[f"{name}_covered"] = figures.get(f"{name}_covered", 0.0) + float(covered[row])
    return {name: round(value, 2) for name, value in sorted(figures.items())}


def _furniture(odr: OpenDrive, lanes: LaneTable) -> tuple[list[Entry], dict[str, float]]:
    entries: list[Entry] = []
    crosswalks = sum(
        thing.type == "crosswalk" for road in odr.roads.values() for thing in road.objects
    )
    crossings = lanes.counts["crossings"]
    if crosswalks or crossings:
        reason = (
            f"{crossings} crossings were guessed from where sidewalks meet; the map has "
            f"{crosswalks} crosswalks, whose places are not yet carried over"
        )
        entries.append(Entry(Fate.GUESSED, "map", reason))
    signals = [(road.id, signal) for road in odr.roads.values() for signal in road.signals]
    dynamic = [signal for _, signal in signals if signal.dynamic]
    if dynamic:
        reason = (
            f"{len(dynamic)} dynamic signals became {lanes.counts['tl_logics']} traffic lights "
            "with programs of netconvert's own: OpenDRIVE has no timing"
        )
        entries.append(Entry(Fate.GUESSED, "map", reason))
    static = len(signals) - len(dynamic)
    if static:
        reason = f"{static} static signals (stop, yield, speed) are not in the network"
        entries.append(Entry(Fate.LOST, "map", reason))
    return entries, {
        "crosswalks": float(crosswalks),
        "crossings": float(crossings),
        "dynamic_signals": float(len(dynamic)),
        "static_signals": float(static),
    }
