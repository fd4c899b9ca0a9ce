"""Scenarios with rules on shipped maps: run, and what became of whom, from the trajectories."""

from __future__ import annotations

import atexit
import json
import math
import shutil
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from tempfile import mkdtemp
from typing import TYPE_CHECKING, Any

import numpy as np
import polars as pl

from odscen.app.maps import load_map
from odscen.lanegraph.query import node_id, walk_node_id
from odscen.maps.store import Workspace
from odscen.records.run_events import events_from_json
from odscen.records.run_plan import Plan
from odscen.runs.recorded import read_trajectories
from odscen.runs.run_settings import RunSettings
from odscen.scenario import edits
from odscen.scenario.checks.scenario_checks import check
from odscen.scenario.document.json_form import dumps, loads
from odscen.sumo.runner.prepare import prepare
from odscen.sumo.runner.run_jobs import run_prepared

if TYPE_CHECKING:
    from odscen.app.maps import LoadedMap
    from odscen.records.run_events import Event
    from odscen.scenario.document.scenario_document import Scenario
    from odscen.sumo.runner.run_folder import SumoPreparedRun

MAPS = Path(__file__).parents[2] / "maps"
LEFT, MIDDLE, RIGHT = -4.875, -8.625, -12.375
"""y of the lanes of the motorway's straight carriageway, on which traffic drives with x."""


@cache
def workspace() -> Workspace:
    folder = Path(mkdtemp(prefix="odscen-story-"))
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    return Workspace.open(folder)


@cache
def entry(name: str) -> Any:
    return workspace().add_map(MAPS / f"{name}.xodr")


@cache
def loaded(name: str) -> LoadedMap:
    return load_map(entry(name))


def node_at(name: str, x: float, y: float, *, hdg: float = 0.0) -> str:
    """Nearest node of a lane that leads about that way."""
    graph = loaded(name).sumo.graph
    lanes = graph.lanes
    away = np.hypot(lanes.x - x, lanes.y - y)
    away[np.cos(lanes.hdg - hdg) < 0.5] = np.inf
    return node_id(graph, int(np.argmin(away)))


def walk_node_at(name: str, x: float, y: float) -> str:
    graph = loaded(name).sumo.graph
    walks = graph.walks
    return walk_node_id(graph, int(np.argmin(np.hypot(walks.x - x, walks.y - y))))


def document(
    name: str,
    actors: list[dict[str, Any]],
    rules: list[dict[str, Any]],
    *,
    step: float | None = 0.1,
    until: float = 20.0,
    **parts: Any,
) -> Scenario:
    """Make a scenario that runs until ``until``, whatever its story does."""
    graph = loaded(name).sumo.graph
    empty = edits.new_scenario(graph, name="story", roi=graph.segments.ids)
    data = json.loads(dumps(empty))
    data["actors"], data["rules"] = actors, rules
    data["simulation"] = {"duration": until, "after_story": "never"} | (
        {} if step is None else {"step_length": step}
    )
    return loads(json.dumps(data | parts))


@dataclass(frozen=True)
class Track:
    """Centre of the front, OpenDRIVE frame, at each recorded time."""

    time: np.ndarray
    x: np.ndarray
    y: np.ndarray
    hdg: np.ndarray
    speed: np.ndarray
    length: float

    def at(self, time: float) -> tuple[float, float]:
        return float(np.interp(time, self.time, self.x)), float(np.interp(time, self.time, self.y))

    def centre(self, time: float) -> tuple[float, float]:
        x, y = self.at(time)
        hdg = float(np.interp(time, self.time, np.unwrap(self.hdg)))
        half = self.length / 2.0
        return x - half * math.cos(hdg), y - half * math.sin(hdg)

    @property
    def travelled(self) -> np.ndarray:
        steps = np.hypot(np.diff(self.x), np.diff(self.y))
        return np.concatenate([[0.0], np.cumsum(steps)])


@dataclass(frozen=True)
class Told:
    folder: Path
    events: tuple[Event, ...]
    tracks: dict[str, Track]

    def of_rule(self, rule: str, what: str = "started") -> list[Event]:
        return [one for one in self.events if one.rule == rule and one.kind == f"rule_{what}"]

    def instant(self, rule: str, what: str = "started") -> float:
        [event] = self.of_rule(rule, what)
        return event.time


def prepared(scenario: Scenario, *, slice_length: float | None = None) -> SumoPreparedRun:
    made_on = loaded(scenario.map.name)
    errors = [
        one
        for one in check(scenario, made_on.sumo.graph, None, made_on.lights)
        if one.severity == "error"
    ]
    assert errors == []
    net = entry(scenario.map.name).checked("net")
    settings = RunSettings(slice_length=slice_length)
    return prepare(scenario, made_on.sumo, net, settings=settings)


def told(run: SumoPreparedRun, folder: Path) -> Told:
    result = run_prepared(run, folder)
    log = (folder / "sumo.log").read_text() if (folder / "sumo.log").is_file() else ""
    assert result.status == "completed", (result.summary.get("error"), log)
    return read(folder)


def read(folder: Path) -> Told:
    events = events_from_json((folder / "events.json").read_text())
    plan = Plan.from_json((folder / "plan.json").read_text())
    lengths = {actor.id: actor.length for actor in plan.actors}
    table = read_trajectories(folder)
    assert table is not None
    rows = table.rows
    prefix = next(p for p in ("vehicle_", "person_", "") if f"{p}x" in rows.columns)
    tracks = {}
    for [name], one in rows.sort("timestep_time").group_by(f"{prefix}id", maintain_order=True):
        columns = [one[key].cast(pl.Float64).to_numpy() for key in (
            "timestep_time", f"{prefix}x", f"{prefix}y", f"{prefix}angle", f"{prefix}speed"
        )]  # fmt: skip
        time, x, y, angle, speed = columns
        tracks[name] = Track(
            time, x - plan.net_offset[0], y - plan.net_offset[1], np.radians(90.0 - angle), speed,
            lengths[name],
        )  # fmt: skip
    return Told(folder, events, tracks)


def run(scenario: Scenario, folder: Path) -> Told:
    return told(prepared(scenario), folder)
