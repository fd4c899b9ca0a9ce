"""How one SUMO network of a map differs from another: lanes, connections, traffic lights."""

from __future__ import annotations

from collections import defaultdict
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from odscen.convert.lane_table.coverage import covered_metres
from odscen.convert.model.net import NORMAL
from odscen.convert.verify.fidelity_result import NEAR

if TYPE_CHECKING:
    from collections.abc import Iterator

    from odscen.base.ids import SumoLaneId
    from odscen.convert.lane_table.table import LaneTable, SumoLight
    from odscen.convert.verify.fidelity_result import Fidelity, LaneRelation

WORTH_TELLING = 1.0
"""Metres of a lane that make a change, at least."""

WORTH_SHARE = 0.25
"""Share of what a lane had that makes a change, too: netconvert trims sidewalks at their ends."""

_WALKERS = frozenset({"pedestrian"})


class NetworkState(NamedTuple):
    """A network of a map: its lane table, and how faithfully it follows the map."""

    table: LaneTable
    fidelity: Fidelity


class NetworkChange(NamedTuple):
    """One difference: what happened, to which element, in which way."""

    what: str
    element: str
    detail: str


def network_changes(before: NetworkState, after: NetworkState) -> tuple[NetworkChange, ...]:
    """List what one network has and the other has not; lanes and junctions are those of the map."""
    return (
        *_compare_lanes(before.table, after.table),
        *_find_strangers(before.table, after.table),
        *_compare_connections(before.fidelity, after.fidelity),
        *_compare_lights(before.table, after.table),
    )


def _compare_lanes(before: LaneTable, after: LaneTable) -> Iterator[NetworkChange]:
    was, now = covered_metres(before), covered_metres(after)
    aside_before, aside = _mean_distances(before), _mean_distances(after)
    for key in sorted(was.keys() | now.keys(), key=lambda key: (len(key), key)):
        element = f"road {key.road} > laneSection {key.section} > lane {key.lane}"
        element += " > walk beside it" if len(key) > len(("road", "section", "lane")) else ""
        gap = was.get(key, 0.0) - now.get(key, 0.0)
        least = max(WORTH_TELLING, WORTH_SHARE * max(was.get(key, 0.0), now.get(key, 0.0)))
        if gap > least:
            yield NetworkChange("lane gone", element, f"{gap:.1f} m have no SUMO lane any more")
        elif gap < -least:
            yield NetworkChange("lane new", element, f"{-gap:.1f} m more have a SUMO lane")
        if aside.get(key, 0.0) > NEAR >= aside_before.get(key, 0.0):
            detail = f"SUMO's lane lies {aside[key]:.2f} m beside it on average"
            yield NetworkChange("lane aside", element, detail)


def _mean_distances(lanes: LaneTable) -> dict[object, float]:
    """Mean distance of the SUMO lanes from each lane, metres."""
    areas: dict[object, float] = defaultdict(float)
    lengths: dict[object, float] = defaultdict(float)
    for span in lanes.spans:
        key, interval = lanes.lane_keys[span.lane], lanes.intervals[span.interval]
        areas[key] += float(np.trapezoid(interval.deviation, interval.pos))
        lengths[key] += float(interval.pos[-1] - interval.pos[0])
    return {key: area / lengths[key] for key, area in areas.items()}


def _find_strangers(before: LaneTable, after: LaneTable) -> Iterator[NetworkChange]:
    """SUMO lanes for vehicles that lie on no lane of the map of their own, and did not before."""
    known = _find_unplaced_lanes(before)
    for lane in _find_unplaced_lanes(after):
        if lane not in known:
            length = after.lanes[lane].length
            detail = f"{length:.1f} m that lie on no lane of the map, or on another SUMO lane"
            yield NetworkChange("SUMO lane new", f"SUMO lane {lane}", detail)


def _find_unplaced_lanes(lanes: LaneTable) -> dict[SumoLaneId, None]:
    answering = (lanes.intervals[span.interval] for span in lanes.spans)
    placed = {lanes.lane_list[interval.sumo].id for interval in answering}
    return {
        lane.id: None
        for lane in lanes.lane_list
        if lanes.edges[lane.edge].function == NORMAL
        and lane.id not in placed
        and lane.allowed != _WALKERS
    }


def _compare_connections(before: Fidelity, after: Fidelity) -> Iterator[NetworkChange]:
    for what, was, now in (
        ("connection gone", before.missing, after.missing),
        ("connection back", after.missing, before.missing),
        ("connection new", before.invented, after.invented),
    ):
        known = {_connection_ends(connection) for connection in was}
        for connection in now:
            if _connection_ends(connection) not in known:
                element = f"lane {connection.source} to lane {connection.target}"
                yield NetworkChange(what, element, f"at {connection.x:.1f}, {connection.y:.1f}")


def _connection_ends(lane_relation: LaneRelation) -> tuple[str, str]:
    return lane_relation.source, lane_relation.target


def _compare_lights(before: LaneTable, after: LaneTable) -> Iterator[NetworkChange]:
    was = {_name_light(light): light for light in before.lights}
    now = {_name_light(light): light for light in after.lights}
    for name in sorted(was.keys() | now.keys()):
        element = f"traffic light of {name}"
        if name not in now:
            yield NetworkChange("light gone", element, "its connections have no light any more")
        elif name not in was:
            yield NetworkChange("light new", element, f"stages {_describe_stages(now[name])}")
        elif _program_of(was[name]) != _program_of(now[name]):
            detail = (
                f"stages {_describe_stages(was[name])} before, {_describe_stages(now[name])} now"
            )
            if _describe_stages(was[name]) == _describe_stages(now[name]):
                detail = (
                    f"stages {_describe_stages(now[name])} as before, "
                    "with green for other connections"
                )
            yield NetworkChange("program changed", element, detail)


def _program_of(light: SumoLight) -> tuple[object, ...]:
    return light.offset, *((phase.duration, phase.state) for phase in light.phases)


def _name_light(light: SumoLight) -> str:
    return "junction " + ", ".join(light.junctions) if light.junctions else light.id


def _describe_stages(light: SumoLight) -> str:
    green = ", ".join(f"{phase.duration:g}" for phase in light.phases if phase.is_stage)
    cycle = sum(phase.duration for phase in light.phases)
    return f"{green or 'none'} s of {cycle:g} s (offset {light.offset:g} s)"
