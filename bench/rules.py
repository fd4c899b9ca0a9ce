"""What rules cost: 20 actors with rules amid 300 vehicles, against the same run without them.

``python -m bench rules``. Both runs are made in turn with steps of 0.1 s; their seconds are
those of the processor, as others may use the machine, and without what starting costs.
"""

from __future__ import annotations

import resource
import statistics
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING, Any

from odscen.app.maps import load_map
from odscen.app.runs import check_run, prepare_run
from odscen.lanegraph.query import node_id
from odscen.scenario.document.rules_document import StoryRule
from odscen.scenario.document.scenario_document import (
    Actor,
    Background,
    Demand,
    MapReference,
    Scenario,
    Simulation,
)
from odscen.sumo.realize.run_settings import RunSettings
from odscen.sumo.runner.run_jobs import run_prepared
from odscen.workspace.store import Workspace

if TYPE_CHECKING:
    from odscen.app.maps import LoadedMap
    from odscen.sumo.folder.finished_run import Run

MAP = Path(__file__).parents[1] / "maps" / "town_5x5.xodr"
ACTORS, ROUNDS = 20, 3
SHORT, LONG = 20.0, 80.0
"""Seconds of the two runs of which the difference is taken: what starting costs is in both."""
PER_KM = 24.0
"""Vehicles per kilometre of lane, which are about 300 on the map."""


def main() -> None:
    """Print the ratio of each round and the medians."""
    with tempfile.TemporaryDirectory(prefix="odscen-bench-") as folder:
        root = Path(folder)
        workspace = Workspace.open(root / "workspace")
        entry = workspace.add_map(MAP)
        loaded = load_map(entry)
        ratios = []
        print(f"{'round':>5} {'without, s':>10} {'with, s':>8} {'ratio':>6} {'vehicles':>8}")
        for number in range(ROUNDS + 1):
            plain, most = _per_minute(workspace, traffic(loaded, rules=False), root / f"a{number}")
            ruled, _ = _per_minute(workspace, traffic(loaded, rules=True), root / f"b{number}")
            if number:  # the first round warms up
                ratios.append(ruled / plain)
                print(f"{number:>5} {plain:>10.2f} {ruled:>8.2f} {ratios[-1]:>6.3f} {most:>8}")
        print(f"median ratio {statistics.median(ratios):.3f}")


def traffic(loaded: LoadedMap, *, rules: bool) -> Scenario:
    """Twenty actors on as many lanes, and background traffic; with or without rules."""
    graph = loaded.sumo.graph
    lanes = graph.lanes.lanes
    wide = [
        row
        for row, kind in enumerate(lanes.types)
        if kind == "driving" and lanes.first_node[row + 1] - lanes.first_node[row] > 30
    ]
    spawns = [int(lanes.first_node[row]) + 15 for row in wide[:: max(1, len(wide) // ACTORS)]]
    actors = tuple(
        Actor.model_validate(
            {"id": f"a{n}", "category": "car", "spawn": node_id(graph, node), "initial_speed": 5.0}
        )
        for n, node in enumerate(spawns[:ACTORS])
    )
    entry = loaded.entry
    return Scenario(
        name="rules",
        map=MapReference(name=entry.name, sha256=entry.sha256),
        roi=tuple(graph.segments.ids),
        actors=actors,
        demand=Demand(background=(Background(id="traffic", per_km=PER_KM),)),
        simulation=Simulation(duration=LONG, step_length=0.1),
        rules=tuple(_rules(len(actors))) if rules else (),
    )


def _rules(count: int) -> list[StoryRule]:
    """One for each actor: what it watches is read in every step, and some act."""
    found: list[dict[str, Any]] = []
    for n in range(count):
        other = f"a{(n + 1) % count}"
        when = (
            {"ttc": {"to": other, "below": 1.5}},
            {"distance": {"to": other, "below": 6.0}},
            {"all": [{"speed": {"above": 12.0}}, {"headway": {"to": other, "below": 2.0}}]},
            {"travelled": {"above": 150.0}},
        )[n % 4]
        then = [{"speed": {"to": 6.0, "rate": 1.0}}, {"offset": {"to": 0.3}}, {"release": {}}]
        found.append({"id": f"r{n}", "actor": f"a{n}", "when": when, "then": then})
    return [StoryRule.model_validate(one) for one in found]


def _per_minute(workspace: Workspace, scenario: Scenario, folder: Path) -> tuple[float, int]:
    """Processor seconds of the minute by which the longer run is longer, and vehicles in it."""
    times, most = [], 0
    for until in (SHORT, LONG):
        longer = Simulation(duration=until, step_length=0.1)
        one = scenario.model_copy(update={"simulation": longer})
        seconds, most = _seconds(workspace, one, folder.with_name(f"{folder.name}-{until:g}"))
        times.append(seconds)
    return times[1] - times[0], most


def _seconds(workspace: Workspace, scenario: Scenario, folder: Path) -> tuple[float, int]:
    """Processor seconds of the simulation's process, and how many vehicles there were at most."""
    checked = check_run(workspace, scenario, name=folder.name, settings=RunSettings())
    ready, before = prepare_run(checked), resource.getrusage(resource.RUSAGE_CHILDREN)
    run = run_prepared(ready, folder)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    if run.status != "completed":
        raise SystemExit(str(run.summary.get("error")))
    seconds = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return seconds, _most(run)


def _most(run: Run) -> int:
    changes = {"departed": 1, "arrived": -1}
    here, most = 0, 0
    for one in run.events().sort("time").iter_rows(named=True):
        here += changes.get(one["kind"], 0)
        most = max(most, here)
    return most


if __name__ == "__main__":
    main()
