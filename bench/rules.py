"""What rules cost: 20 actors with rules amid 300 vehicles, against the same run without them.

``python -m bench rules``. Both runs are stepped with steps of 0.1 s, each in a process of its own;
the processes take turns of a twentieth of a second, so that both meet the same machine. Seconds are
those of the processor, and of the steps alone: starting is not in them. Vehicles are those that are
on the road at once, on average.

``ratio`` is all that a run with rules costs more; it has two parts, whose product it is. ``rules``
is what odscen does between the steps: the whole run over what is left of it without that. ``SUMO``
is what is left over the run without rules: the processor's caches hold less of SUMO, and who is
slower or stops lets others queue.
"""

from __future__ import annotations

import statistics
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING, Any

from bench.in_turns import shares_of
from odscen.app.maps import load_map
from odscen.app.running.runs import check_run, prepare_run
from odscen.lanegraph.query import node_id
from odscen.maps.store import Workspace
from odscen.runs.run_settings import RunSettings
from odscen.scenario.document.rules_document import StoryRule
from odscen.scenario.document.scenario_document import (
    Actor,
    Background,
    Demand,
    MapReference,
    Scenario,
    Simulation,
)
from odscen.sumo.runner.run_jobs import run_prepared

if TYPE_CHECKING:
    from odscen.app.maps import LoadedMap
    from odscen.runs.finished_run import Run

MAP = Path(__file__).parents[1] / "maps" / "town_5x5.xodr"
ACTORS, ROUNDS = 20, 5
UNTIL = 80.0
PER_KM = 36.0
"""Vehicles per kilometre of lane, which are about 300 on the map."""


def main() -> None:
    """Print the ratios of each round, and median and spread of all."""
    with tempfile.TemporaryDirectory(prefix="odscen-bench-") as folder:
        root = Path(folder)
        workspace = Workspace.open(root / "workspace")
        loaded = load_map(workspace.add_map(MAP))
        plain, ruled = (_made(workspace, traffic(loaded, rules=r), root / str(r)) for r in (0, 1))
        print("vehicles:", ", ".join(f"{_on_the_road(run):.0f}" for run in (plain, ruled)))
        names = ("ratio", "rules", "SUMO")
        rounds: list[tuple[float, float, float]] = []
        print(f"{'round':>5} {'without, s':>10} {'with, s':>8}", *(f"{one:>6}" for one in names))
        for number in range(ROUNDS + 1):
            (without, _), (whole, own) = shares_of([(plain.folder, "run"), (ruled.folder, "run")])
            if number:  # the first round warms up
                rounds.append((whole / without, whole / (whole - own), (whole - own) / without))
                line = f"{number:>5} {without:>10.2f} {whole:>8.2f}"
                print(line, *(f"{one:>6.3f}" for one in rounds[-1]), flush=True)
        for name, ratios in zip(names, zip(*rounds, strict=True), strict=True):
            middle, least, most = statistics.median(ratios), min(ratios), max(ratios)
            print(f"median {name} {middle:.3f} ({least:.3f} to {most:.3f})")


def traffic(loaded: LoadedMap, *, rules: int) -> Scenario:
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
        simulation=Simulation(duration=UNTIL, step_length=0.1),
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


def _made(workspace: Workspace, scenario: Scenario, folder: Path) -> Run:
    checked = check_run(workspace, scenario, name=folder.name, settings=RunSettings())
    run = run_prepared(prepare_run(checked), folder)
    if run.status != "completed":
        raise SystemExit(str(run.summary.get("error")))
    return run


def _on_the_road(run: Run) -> float:
    """Vehicles that are there at once, on average."""
    changes = {"departed": 1, "arrived": -1}
    rows = run.events().iter_rows(named=True)
    return sum(changes.get(one["kind"], 0) * (UNTIL - one["time"]) for one in rows) / UNTIL
