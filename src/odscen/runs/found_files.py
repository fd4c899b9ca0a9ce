"""Files of a run by what they are."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING

from odscen.figures.by_place.traffic import TABLES
from odscen.figures.measures.signal_use import SIGNALS_TABLE
from odscen.figures.measures.traffic_files import STATIONS_TABLE
from odscen.runs import layout

if TYPE_CHECKING:
    from pathlib import Path


def found_files(folder: Path) -> dict[str, str]:
    """Files of a run by what they are, relative to its folder; only those that are there."""
    sumo = layout.SUMO_FOLDER
    names = {
        "scenario": layout.SCENARIO_FILE,
        "plan": layout.PLAN_FILE,
        "assignment": layout.ASSIGNMENT_FILE,
        "net": f"{sumo}/{layout.NET_FILE}",
        "routes": f"{sumo}/{layout.ROUTES_FILE}",
        "signals": f"{sumo}/{layout.SIGNALS_FILE}",
        "stops": f"{sumo}/{layout.STOPS_FILE}",
        "parking": f"{sumo}/{layout.PARKING_FILE}",
        "measures": f"{sumo}/{layout.MEASURES_FILE}",
        "config": f"{sumo}/{layout.CONFIG_FILE}",
        "trajectories": layout.TRAJECTORIES_FILE,
        "trajectory_parts": layout.TRAJECTORIES_FOLDER,
        "lanes": layout.LANES_FILE,
        "lane_parts": layout.LANES_FOLDER,
        "lane_segments": layout.LANE_SEGMENTS_FILE,
        "lane_segment_parts": layout.LANE_SEGMENTS_FOLDER,
        "trips": layout.TRIPS_FILE,
        "trip_parts": layout.TRIPS_FOLDER,
        "conflicts": layout.CONFLICTS_FILE,
        "conflict_parts": layout.CONFLICTS_FOLDER,
        "signal_states": layout.LIGHT_STATES_FILE,
        "signal_state_parts": layout.LIGHT_STATES_FOLDER,
        "detector_calls": layout.CALLS_FILE,
        "detector_call_parts": layout.CALLS_FOLDER,
        "stop_visits": layout.VISITS_FILE,
        "stop_visit_parts": layout.VISITS_FOLDER,
        "parking_stays": layout.STAYS_FILE,
        "parking_stay_parts": layout.STAYS_FOLDER,
        "lights": layout.LIGHTS_FILE,
        "signal_figures": f"{layout.FIGURES_FOLDER}/{SIGNALS_TABLE}",
        "station_figures": f"{layout.FIGURES_FOLDER}/{STATIONS_TABLE}",
        "lane_places": layout.LANE_PLACES_FILE,
        "figures": layout.FIGURES_FILE,
        **{f"{name}_figures": f"{layout.FIGURES_FOLDER}/{name}.csv" for name in TABLES},
        "events": layout.EVENTS_FILE,
        "actors": layout.ACTORS_FILE,
        "report": layout.REPORT_FILE,
        "parity": layout.PARITY_FILE,
        "picture_sheet": layout.PICTURE_SHEET_FILE,
        "parity_figures": layout.PARITY_FIGURES_FILE,
        "log": layout.LOG_FILE,
    }
    top = str(folder)
    there = {part: _list_files(f"{top}/{part}") for part in ("", sumo, layout.FIGURES_FOLDER)}
    found = {}
    for key, name in names.items():
        place, _, own = name.rpartition("/")
        if own in there[place]:
            found[key] = name
    return {**found, "summary": layout.SUMMARY_FILE}


def _list_files(folder: str) -> frozenset[str]:
    try:
        return frozenset(os.listdir(folder))  # noqa: PTH208 - names, and no paths
    except OSError:
        return frozenset()
