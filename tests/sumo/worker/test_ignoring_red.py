"""Pedestrians who cross at red, by the scenario's setting (R45)."""

from __future__ import annotations

import json
from itertools import pairwise
from pathlib import Path

import numpy as np

from odscen.lanegraph.graphs import WalkKind
from odscen.lanegraph.query import walk_node_id
from odscen.runs.run_settings import RunSettings
from odscen.scenario import edits
from odscen.scenario.placing.region import Region
from odscen.sumo.runner.prepare import prepare
from odscen.sumo.runner.run_jobs import run_prepared
from tests.sumo.realize.lights.test_program_files import crossing, net_file


def travel_times(folder: Path, *, ignores_red: bool) -> np.ndarray:
    """Seconds that each of twenty takes to get over a crosswalk, one after the other."""
    graph = crossing().sumo.graph
    walks = graph.walks
    scenario = edits.new_scenario(graph, name="red", roi=graph.segments.ids)
    router = Region.of(graph, scenario.roi).walk_router
    over = {
        frozenset((int(walks.source[i]), int(walks.target[i])))
        for i in np.flatnonzero(walks.kind == WalkKind.CROSSWALK)
    }
    random = np.random.default_rng(4)
    while len(scenario.actors) < 20:
        spawn = int(random.integers(len(walks.x)))
        goal = int(random.choice(router.goal_candidates(spawn)))
        path = router.path(spawn, goal).tolist()
        if not any(frozenset(step) in over for step in pairwise(path)):
            continue
        scenario = edits.add_actor(
            scenario,
            graph,
            category="pedestrian",
            spawn=walk_node_id(graph, spawn),
            goal=walk_node_id(graph, goal),
            depart=7.0 * len(scenario.actors),
            ignores_red=ignores_red,
        )
    folder.mkdir()
    prepared = prepare(
        scenario,
        crossing().sumo,
        net_file(folder),
        settings=RunSettings(until=900.0, step_length=0.5),
    )
    run_prepared(prepared, folder / "run")
    events = json.loads((folder / "run" / "events.json").read_text())["events"]
    taken = {one["actor"]: one["travel_time"] for one in events if "travel_time" in one}
    return np.array([taken[actor.id] for actor in scenario.actors])


def test_who_ignores_red_waits_at_no_light(tmp_path: Path) -> None:
    heeding = travel_times(tmp_path / "heeding", ignores_red=False)
    ignoring = travel_times(tmp_path / "ignoring", ignores_red=True)
    saved = heeding - ignoring
    assert (saved > 5.0).sum() >= 5, "nobody waits at a light that is heeded"
    assert saved.min() > -3.0, "but for a moment behind another"
