"""What the conversion report says: what became of lanes, connections, crosswalks and signals."""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from odscen.base.ids import LaneKey
from odscen.base.shown import shown_id
from odscen.convert.lane_table.coverage import covered_metres, kept_lanes, lane_lengths
from odscen.convert.model.access import (
    TRACK_TYPES,
    allowed,
    has_class,
    is_used,
    vehicle_classes,
)
from odscen.convert.model.conversion_report import ElementOutcome, ReportEntry
from odscen.convert.model.edge_plan import LEAST_WIDTH, NO_WIDTH
from odscen.convert.model.net import CROSSING
from odscen.opendrive.objects import is_crosswalk, signal_kind
from odscen.opendrive.road_model import DRIVABLE_TYPES, WALKABLE_TYPES, lane_use
from odscen.opendrive.sign_catalogue import country_of, sign_meaning
from odscen.opendrive.topology import cut_off_lanes, dead_ends, one_sided_links

if TYPE_CHECKING:
    from collections.abc import Container, Iterator, Mapping, Sequence

    from odscen.base.arrays import FloatArray
    from odscen.convert.lane_table.table import LaneTable
    from odscen.convert.model.connections import PlannedConnections
    from odscen.convert.model.edge_plan import EdgePlan
    from odscen.convert.model.net import Net
    from odscen.convert.pedestrian.crosswalks import PlacedCrosswalk
    from odscen.convert.signals.map_signals import SignalControl
    from odscen.opendrive.lanes import RoadTable
    from odscen.opendrive.road_model import Lane, LaneAccess, OpenDrive, Signal


def one_way_ends(
    odr: OpenDrive, table: RoadTable, found: PlannedConnections
) -> Iterator[ReportEntry]:
    """Name the ends of two-way roads where a junction leads traffic in one direction only."""
    by_road: dict[tuple[int, bool], list[int]] = {}
    for number, edge in enumerate(found.edges):
        if any(lane.type in DRIVABLE_TYPES for lane in edge.lanes):
            by_road.setdefault((edge.road, edge.forward), []).append(number)
    left = {connection.source for connection in found.connections}
    entered = {connection.target for connection in found.connections}
    for road in odr.roads.values():
        row = table.road_index[road.id]
        along, against = by_road.get((row, True), []), by_road.get((row, False), [])
        for name, link in (("predecessor", road.predecessor), ("successor", road.successor)):
            if not along or not against or link is None or link.element_type != "junction":
                continue
            at_end = name == "successor"
            arriving = _find_outermost_edge(
                found.edges, along if at_end else against, at_end=at_end
            )
            leaving = _find_outermost_edge(found.edges, against if at_end else along, at_end=at_end)
            goes, comes = arriving in left, leaving in entered
            if goes != comes:
                reason = (
                    f"two-way road that is one-way at junction {link.element_id}: traffic can "
                    f"{'only leave it for' if goes else 'only enter it from'} the junction"
                )
                yield ReportEntry(ElementOutcome.LOST, f"road {shown_id(road.id)} > {name}", reason)


def _find_outermost_edge(edges: Sequence[EdgePlan], numbers: Sequence[int], *, at_end: bool) -> int:
    """Edge nearest to the end of the road, or to its start."""
    middles = {number: edges[number].start + edges[number].end for number in numbers}
    return max(numbers, key=lambda number: middles[number] if at_end else -middles[number])


BOTH_WAYS = "bidirectional"
"""Lane type (up to 1.7) of lanes for both directions, mostly for turning left from the middle."""

WORTH_TELLING = 0.5
"""Metres of a lane without SUMO lane that make an entry."""

SAME_WIDTH = 0.01
"""Metres by which a width must differ to be told as one that varies."""

WIDTH_PLACES = 9
"""Places along a lane at which its width is looked at."""

AREA = 1.5
"""Metres of a walk that walking areas, which are no lanes, may take without an entry."""

WALKING_AREA = "they are walking areas, on which persons turn and wait"
"""Why the ends of a walk have no SUMO lane where it is kept all the same."""

CROSSING_REACH = 20.0
"""Metres from a crossing within which its pedestrian lights stand."""

VARYING = 0.25
"""Metres that a lane's width may differ from its SUMO lane's without an entry."""


class Findings(NamedTuple):
    """Entries and figures of the report."""

    entries: tuple[ReportEntry, ...]
    figures: Mapping[str, float]


def findings(
    odr: OpenDrive,
    table: RoadTable,
    net: Net,
    lanes: LaneTable,
    found: PlannedConnections,
    control: SignalControl,
    crosswalks: Sequence[PlacedCrosswalk],
) -> Findings:
    """Say what became of each element."""
    nowhere = list(_leading_nowhere(odr, table))
    entries = [
        *_find_lane_entries(odr, table, lanes),
        *_find_varying_widths(table, lanes),
        *_find_access_entries(odr),
        *(
            ReportEntry(ElementOutcome.LOST, _describe_place(*lost.lane), lost.reason)
            for lost in found.lost
        ),
        *nowhere,
        *one_way_ends(odr, table, found),
        *_find_one_sided_links(odr),
        *_find_crosswalk_entries(odr, crosswalks),
        *_find_signal_entries(odr, table, net, control),
    ]
    lengths = lane_lengths(odr, table, lanes)
    figures = {
        **lengths,
        "connections": float(len(found.connections)),
        "connections_lost": float(len(found.lost) + len(nowhere)),
        "crosswalks": float(len(crosswalks)),
        "crossings": float(net.counts()["crossings"]),
        "traffic_lights": float(len(net.lights)),
        "signals": float(sum(len(road.signals) for road in odr.roads.values())),
        "signals_unplaced": float(len(control.unplaced)),
        "signals_guessed": float(len(control.guessed)),
        "roundabouts": float(len(net.roundabouts)),
    }
    kept = list(kept_lanes(lengths))
    if found.connections:
        reason = f"{len(found.connections)} connections between lanes"
        kept.append(ReportEntry(ElementOutcome.KEPT, "map", reason))
    return Findings((*kept, *entries), figures)


def _describe_place(road: str, section: int, lane: int) -> str:
    return f"road {shown_id(road)} > laneSection {section} > lane {lane}"


def _leading_nowhere(odr: OpenDrive, table: RoadTable) -> Iterator[ReportEntry]:
    """Connecting lanes that no connection leads over: the table says nothing, nor does geometry."""
    for lane, end, leads in dead_ends(odr):
        s = np.array([0.0 if end == "start" else odr.roads[lane.road].length])
        if table.lane_width(np.array([table.lane_index[lane]]), s)[0] >= LEAST_WIDTH:
            what = "leads to no lane" if leads else "is reached from no lane"
            reason = f"connecting lane {what}, and not exactly one meets it there"
            yield ReportEntry(ElementOutcome.LOST, _describe_place(*lane), reason)


def _find_lane_entries(odr: OpenDrive, table: RoadTable, lanes: LaneTable) -> Iterator[ReportEntry]:
    covered, cut_off = covered_metres(lanes), cut_off_lanes(odr)
    for row, key in enumerate(table.lane_keys):
        kind = table.lane_type[row]
        if is_used(kind):
            length = float(table.lane_s1[row] - table.lane_s0[row])
            gap = length - covered.get(key, 0.0)
            if gap > (AREA if kind in WALKABLE_TYPES and gap < length else WORTH_TELLING):
                where = "" if odr.roads[key.road].junction is None else " of a connecting road"
                why = "it begins or ends at lanes that are closed to motor vehicles"
                if key not in cut_off:
                    why = _explain_uncovered(odr, table, row, whole=gap >= length)
                reason = f"{gap:.2f} of {length:.2f} m{where} have no SUMO lane: {why}"
                outcome = ElementOutcome.KEPT if why == WALKING_AREA else ElementOutcome.LOST
                yield ReportEntry(outcome, _describe_place(*key), reason)
            if odr.roads[key.road].sections[key.section].lanes[key.lane].direction == "both":
                reason = "open both ways; SUMO has it in one direction only, that of its side"
                yield ReportEntry(ElementOutcome.LOST, _describe_place(*key), reason)
        elif kind not in ("none", ""):
            reason = f"lanes of type {kind} are open to no road user and left out"
            if kind == BOTH_WAYS:
                reason = f"lanes of type {kind} are open both ways, as no lane of SUMO: left out"
            elif kind == "restricted":
                reason = "lanes of type restricted, on which no access allows vehicles: left out"
            yield ReportEntry(ElementOutcome.LOST, f"road {shown_id(key.road)}", reason)


def _find_one_sided_links(odr: OpenDrive) -> Iterator[ReportEntry]:
    """Say which connections of lanes only the lane behind states."""
    for here, there in one_sided_links(odr):
        road = shown_id(there.road)
        reason = f"leads to lane {there.lane} of road {road}, which alone states the link"
        yield ReportEntry(ElementOutcome.REPAIRED, _describe_place(*here), reason)


def _explain_uncovered(odr: OpenDrive, table: RoadTable, row: int, *, whole: bool) -> str:
    """Why a lane, or a part of it, has no SUMO lane."""
    key = table.lane_keys[row]
    lane = odr.roads[key.road].sections[key.section].lanes[key.lane]
    middle = 0.5 * float(table.lane_s0[row] + table.lane_s1[row])
    if lane.access and not vehicle_classes(lane, middle) and lane.type not in WALKABLE_TYPES:
        return "by its access no vehicle may use it"
    s = np.linspace(table.lane_s0[row], table.lane_s1[row], WIDTH_PLACES)
    widths = table.lane_width(np.full(WIDTH_PLACES, row), s)
    if float(widths.max()) < LEAST_WIDTH:
        return f"it is {float(widths.max()):.2f} m wide at most"
    if float(widths.min()) < NO_WIDTH:
        return "its width falls to zero"
    if not whole and lane_use(lane) in WALKABLE_TYPES:
        return WALKING_AREA
    if odr.roads[key.road].junction is not None:
        return "no shortest connection between two lanes runs over it"
    return "nothing leads there" if whole else "a junction and its crossings reach over it"


def _find_access_entries(odr: OpenDrive) -> Iterator[ReportEntry]:
    """What became of ``<access>`` of lanes."""
    for road in odr.roads.values():
        for number, section in enumerate(road.sections):
            for lane in section.lanes.values():
                for record in lane.access:
                    element = _describe_place(road.id, number, lane.id)
                    if record.s > section.s_end:
                        who = f"access: {record.rule} {record.restriction}".replace("  ", " ")
                        reason = f"{who} from s={record.s:g}, behind the end of the lane; left out"
                        yield ReportEntry(ElementOutcome.LOST, element, reason)
                    else:
                        yield _access_entry(element, lane, record)


def _access_entry(element: str, lane: Lane, record: LaneAccess) -> ReportEntry:
    rule, name = record.rule, record.restriction
    if not rule:
        reason = f"access of {name or 'nobody'} without a rule: it may allow or deny; left out"
        return ReportEntry(ElementOutcome.LOST, element, reason)
    if not has_class(record):
        reason = f"access: {rule} {name} has no vehicle class in SUMO; left out"
        return ReportEntry(ElementOutcome.LOST, element, reason)
    if not allowed(lane_use(lane)):
        reason = f"access: {rule} {name} on a lane that no vehicle of SUMO uses; left out"
        outcome = ElementOutcome.LOST
        if lane_use(lane) in WALKABLE_TYPES and (rule, name) == ("allow", "pedestrian"):
            outcome, reason = ElementOutcome.KEPT, "access: open to pedestrians"
        elif rule == "deny":
            outcome, reason = ElementOutcome.KEPT, f"access: deny {name}; no vehicle uses the lane"
        return ReportEntry(outcome, element, reason)
    if lane_use(lane) in TRACK_TYPES:
        reason = f"access: {rule} {name} on a lane for rail vehicles alone; left out"
        return ReportEntry(ElementOutcome.LOST, element, reason)
    classes = ", ".join(sorted(vehicle_classes(lane, record.s))) or "no vehicle"
    return ReportEntry(ElementOutcome.KEPT, element, f"access from s={record.s:g}: {classes}")


def _find_varying_widths(table: RoadTable, lanes: LaneTable) -> Iterator[ReportEntry]:
    """SUMO lanes have one width; report lanes that differ from it."""
    sumo = lanes.lane_list
    for interval in lanes.intervals:
        key = lanes.lane_keys[interval.lane]
        width = sumo[interval.sumo].width
        if (
            not isinstance(key, LaneKey)
            or lanes.edges[sumo[interval.sumo].edge].function != "normal"
        ):
            continue
        row = table.lane_index[key]
        if table.lane_type[row] not in DRIVABLE_TYPES:
            continue
        s = np.linspace(interval.s[0], interval.s[-1], 9)
        true = table.lane_width(np.full(9, row), s)
        low, high = float(true.min()), float(true.max())
        if high - width > VARYING or width - low > VARYING:
            reason = f"its width varies from {low:.2f} to {high:.2f} m, SUMO's is {width:.2f} m"
            if high - low < SAME_WIDTH:
                reason = f"it is {low:.2f} m wide here, and the SUMO lane {width:.2f} m all along"
            yield ReportEntry(ElementOutcome.GUESSED, _describe_place(*key), reason)


def _find_crosswalk_entries(
    odr: OpenDrive, placed: Sequence[PlacedCrosswalk]
) -> Iterator[ReportEntry]:
    kept = {(crosswalk.crosswalk.road, crosswalk.crosswalk.object_id) for crosswalk in placed}
    for road in odr.roads.values():
        for item in road.objects:
            if not is_crosswalk(item):
                continue
            element = f"road {shown_id(road.id)} > object {shown_id(item.id)}"
            if (road.id, item.id) in kept:
                yield ReportEntry(
                    ElementOutcome.KEPT, element, "crosswalk, as a crossing of its place and width"
                )
            else:
                yield ReportEntry(ElementOutcome.LOST, element, "crosswalk without any size")


def _find_signal_entries(
    odr: OpenDrive, table: RoadTable, net: Net, control: SignalControl
) -> Iterator[ReportEntry]:
    unplaced, guessed = dict(control.unplaced), dict(control.guessed)
    favoured = dict(control.favoured)
    crossed = _lit_crossings(net)
    walked = {name for light in net.lights for names in light.signals for name in names}
    for road in odr.roads.values():
        for signal in road.signals:
            element = f"road {shown_id(road.id)} > signal {shown_id(signal.id)}"
            kind = signal_kind(signal)
            if element in unplaced:
                yield ReportEntry(ElementOutcome.LOST, element, unplaced[element])
            elif element in guessed:
                yield ReportEntry(ElementOutcome.GUESSED, element, guessed[element])
            elif element in favoured:
                reason = "priority sign, as right of way in SUMO: the other approaches give way"
                yield ReportEntry(ElementOutcome.KEPT, element, reason)
            elif element in control.stops:
                reason = "traffic light on a plain road: vehicles stop there, as before a junction"
                yield ReportEntry(ElementOutcome.KEPT, element, reason)
            elif kind in ("traffic_light", "stop", "yield"):
                word = kind.replace("_", " ")
                yield ReportEntry(ElementOutcome.KEPT, element, f"{word}, as right of way in SUMO")
            elif kind == "pedestrian_light" and signal.id in walked:
                reason = "pedestrian light at a crosswalk: vehicles have one there in SUMO, too"
                yield ReportEntry(ElementOutcome.GUESSED, element, reason)
            elif kind == "pedestrian_light":
                yield _walk_light(element, table.road_index[road.id], signal, table, crossed)
            elif signal.dynamic:
                reason = (
                    f"dynamic signal of type {signal.type or 'none'!r}, which is no known light"
                )
                yield ReportEntry(ElementOutcome.LOST, element, reason)
    yield from _count_idle_signs(odr, favoured)
    yield from _bare_controllers(odr, net)
    if net.lights:
        reason = (
            f"{len(net.lights)} traffic lights have programs of odscen's own: OpenDRIVE has no "
            "timing; no two movements that meet have green together"
        )
        yield ReportEntry(ElementOutcome.GUESSED, "map", reason)


_IDLE_SIGNS = {
    "priority": "priority signs: right of way follows the signs to give way, or the larger road",
    "end_of_priority": "signs for the end of priority: right of way follows the signs to give way",
    "speed_limit": "speed limit signs: the limits of the roads and lanes hold",
    "end_of_speed_limit": "signs for the end of a speed limit: those of the roads and lanes hold",
    "no_entry": "no entry signs: the directions of the lanes hold",
    "bus_lane": "bus lane signs: types and access of the lanes hold",
    "crosswalk": "pedestrian crossing signs: the crosswalk objects hold",
}
"""What holds instead of signs that are understood, and have no effect of their own."""


def _count_idle_signs(odr: OpenDrive, acting: Container[str]) -> Iterator[ReportEntry]:
    """Count the signs that have no effect in SUMO, by country and type; ``acting`` are others."""
    counts: Counter[tuple[str, str]] = Counter()
    for road in odr.roads.values():
        for signal in road.signals:
            kind = signal_kind(signal)
            if f"road {shown_id(road.id)} > signal {shown_id(signal.id)}" in acting:
                continue
            if kind not in ("other", "speed_limit") or (signal.dynamic and kind == "other"):
                continue
            meaning = "speed_limit" if kind == "speed_limit" else sign_meaning(signal) or ""
            country = country_of(signal)
            code = " ".join(part for part in (country, signal.type, signal.subtype) if part)
            counts[code.removesuffix(" -1") or "none", meaning] += 1
    for (code, what), count in sorted(counts.items()):
        element = f"signals of type {code}"
        if what:
            yield ReportEntry(ElementOutcome.GUESSED, element, f"{count} {_IDLE_SIGNS[what]}")
        else:
            reason = f"{count} signs that are not understood have no effect"
            yield ReportEntry(ElementOutcome.LOST, element, reason)


def _bare_controllers(odr: OpenDrive, net: Net) -> Iterator[ReportEntry]:
    """Junctions that stay without lights because their controllers name no signal of the file."""
    lit = {
        name
        for junction in net.junctions
        if junction.type == "traffic_light"
        for name in junction.xodr.split()
    }
    for junction in odr.junctions.values():
        bare = [key for key in junction.controllers if not odr.controllers[key].controls]
        if bare and junction.id not in lit:
            reason = f"no lights: controller {shown_id(bare[0])} names no signal of the file"
            yield ReportEntry(ElementOutcome.LOST, f"junction {junction.id}", reason)


def _lit_crossings(net: Net) -> FloatArray:
    """Points of the crossings that a light controls, shape ``(N, 2)``."""
    lit = {link.target for link in net.links if link.light}
    points = [
        lane.shape[:, :2]
        for edge in net.edges
        if edge.id in lit and edge.function == CROSSING
        for lane in edge.lanes
    ]
    return np.concatenate(points) if points else np.empty((0, 2))


def _walk_light(
    element: str, road: int, signal: Signal, table: RoadTable, crossed: FloatArray
) -> ReportEntry:
    x, y, _ = table.points(np.array([road]), np.array([signal.s]), np.array([signal.t]))
    gaps = np.hypot(crossed[:, 0] - x, crossed[:, 1] - y)
    if gaps.min(initial=np.inf) <= CROSSING_REACH:
        reason = "every crossing of a junction with lights has a light, wherever poles are"
        return ReportEntry(ElementOutcome.GUESSED, element, reason)
    reason = f"pedestrian light: no crossing with a light within {CROSSING_REACH:.0f} m"
    return ReportEntry(ElementOutcome.LOST, element, reason)
