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
    end = float(read_summary(run)["sim_seconds"])
    found = lane_traffic(lanes, places, end=end)
    scenario = read_scenario(run / SCENARIO_FILE)
    return TrafficOnMap(found, _stretches(map_of(workspace, scenario).sumo, found.names))


def _stretches(sumo: SumoMap, names: list[str]) -> NodeStretches:
    """Stretches of lanes of the map whose nodes lie on one of these SUMO lanes."""
    rows = {name: row for row, name in enumerate(names)}
    places = sumo.lane_places
    # The last entry is of nodes that lie on no SUMO lane, whose row is -1.
    of_lane = np.array([*(rows.get(name, -1) for name in places.lanes), -1], dtype=np.int32)
    wanted, own = of_lane[places.lane], sumo.graph.lanes.lane
    changes = (np.diff(wanted) != 0) | (np.diff(own) != 0)
    first = np.concatenate([[0], np.flatnonzero(changes) + 1]).astype(np.int32)
    end = np.append(first[1:], len(wanted)).astype(np.int32)
    there = wanted[first] >= 0
    return NodeStretches(first[there], end[there], wanted[first][there])
