"""Traffic of a finished run on the lanes of its map, for colours."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from odscen.app.maps import map_of
from odscen.app.scenarios import read_scenario
from odscen.base.errors import InputError
from odscen.figures.by_place.lane_places import LanePlaces
from odscen.figures.by_place.lane_traffic import LaneTraffic, lane_traffic
from odscen.runs.ended import read_summary
from odscen.runs.layout import LANE_PLACES_FILE, SCENARIO_FILE
from odscen.runs.measured import read_parts
from odscen.runs.recorded import read_lanes

if TYPE_CHECKING:
    from pathlib import Path

    from odscen.base.arrays import Int32Array
    from odscen.maps.store import Workspace
    from odscen.sumo.realize.sumo_map import SumoMap


class NodeStretches(NamedTuple):
    """Nodes ``first`` up to ``end`` of the lane graph lie on ``lane``, a row of the lanes asked."""

    first: Int32Array
    end: Int32Array
    lane: Int32Array


class TrafficOnMap(NamedTuple):
    """What was measured on lanes, and where these are on the map."""

    traffic: LaneTraffic
    stretches: NodeStretches


def traffic_on_map(workspace: Workspace, run: Path) -> TrafficOnMap:
    """Read what the vehicles of a finished run did on each lane.

    Raises
    ------
    InputError
        If nothing was measured on lanes, or the map is not that of the run any more.
    """
    lanes, file = read_lanes(run), run / LANE_PLACES_FILE
    if lanes is None or not file.is_file():
        raise InputError(
            "the run has no lane data: nothing was measured, or no vehicle departed", file=str(run)
        )
    places = LanePlaces.from_json(file.read_text(encoding="utf-8", errors="replace"))
    summary = read_summary(run)
    end = float(summary["sim_seconds"])
    measured = read_parts(run, end=end, meso=bool(summary.get("meso")))
    found = lane_traffic(lanes, places, end=end, measured=measured)
    scenario = read_scenario(run / SCENARIO_FILE)
    return TrafficOnMap(found, _find_node_stretches(map_of(workspace, scenario).sumo, found.names))


def _find_node_stretches(sumo: SumoMap, names: list[tuple[str, str]]) -> NodeStretches:
    """Stretches of lanes of the map whose nodes lie on one of these SUMO lanes and segments."""
    rows: dict[str, list[int]] = {}
    for row, (lane, _) in enumerate(names):
        rows.setdefault(lane, []).append(row)
    places, own = sumo.lane_places, sumo.graph.lanes.lane
    # The last entry is of nodes that lie on no SUMO lane, whose row is -1.
    only = (some[0] if len(some := rows.get(name, [-1])) == 1 else -1 for name in places.lanes)
    wanted = np.array([*only, -1], dtype=np.int32)[places.lane]
    ids = np.asarray(sumo.graph.segments.ids)
    for number, lane in enumerate(places.lanes):
        if len(rows.get(lane, ())) > 1:
            nodes = np.flatnonzero(places.lane == number)
            of_segment = {names[row][1]: row for row in rows[lane]}
            segments = ids[sumo.graph.lanes.segment[nodes]]
            wanted[nodes] = [of_segment.get(str(segment), -1) for segment in segments]
    changes = (np.diff(wanted) != 0) | (np.diff(own) != 0)
    first = np.concatenate([[0], np.flatnonzero(changes) + 1]).astype(np.int32)
    end = np.append(first[1:], len(wanted)).astype(np.int32)
    there = wanted[first] >= 0
    return NodeStretches(first[there], end[there], wanted[first][there])
