"""Names of the files in a run folder, relative to it."""

from __future__ import annotations

SCENARIO_FILE = "scenario.json"
SUMO_FOLDER = "sumo"
NET_FILE = "net.net.xml"
"""In the SUMO folder."""
ROUTES_FILE = "routes.rou.xml"
"""In the SUMO folder."""
CONFIG_FILE = "scenario.sumocfg"
"""In the SUMO folder."""
PLAN_FILE = "plan.json"
LOG_FILE = "sumo.log"
TRAJECTORIES_FILE = "trajectories.parquet"
EVENTS_FILE = "events.json"
ACTORS_FILE = "actors.json"
SUMMARY_FILE = "summary.json"
REPORT_FILE = "report.html"
