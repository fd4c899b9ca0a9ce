"""How often the interval of a few seeds covers the mean of many.

The shipped crossing with lights, ten minutes, vehicles from outside on all legs that arrive at
random: 200 runs with a seed each. Of these, sets of 5 and of 10 are drawn 1,000 times, and the 95 %
interval that `odscen run --until-confident` and comparisons state of each set is held against the
mean of all runs. Aim: it covers that mean in 93 to 97 % of the sets.

``--runs 50`` takes fewer, ``--per-hour 450`` more vehicles on each leg (near saturation),
``--arrivals even`` the arrivals of before.
"""

from __future__ import annotations

import argparse
import statistics
import sys
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from odscen.app.maps import load_map
from odscen.app.running.batches import run_many
from odscen.app.running.confident_runs import confidence_of
from odscen.maps.store import Workspace
from odscen.runs.recording import Recording
from odscen.runs.run_settings import RunSettings
from odscen.scenario import edits
from odscen.scenario.demand.inflow import entries
from odscen.scenario.placing.region import Region

if TYPE_CHECKING:
    from collections.abc import Sequence

    from odscen.scenario.document.scenario_document import Scenario

MAP = Path(__file__).parents[1] / "maps" / "signal_crossing.xodr"
FIGURES = ("mean_delay", "mean_travel_time", "vehicle_km")
SIZES = (5, 10)
SETS = 1000
AIM = (0.93, 0.97)
SECONDS = 600.0


def main() -> None:
    parser = argparse.ArgumentParser(prog="bench intervals", description=__doc__)
    parser.add_argument("--runs", type=int, default=200)
    parser.add_argument("--per-hour", type=float, default=300.0, help="Vehicles on each leg.")
    parser.add_argument("--arrivals", choices=("random", "even"), default="random")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        workspace = Workspace.open(Path(folder))
        workspace.add_map(MAP)
        scenario = crossing(workspace, options.arrivals, options.per_hour)
        values = values_of_runs(workspace, scenario, options.runs)
    missed = False
    for figure, known in values.items():
        mean, scatter = statistics.fmean(known), statistics.stdev(known)
        print(f"{figure}: mean {mean:.2f}, standard deviation {scatter:.2f} of {len(known)} runs")
        for size in SIZES:
            share = coverage(known, size)
            missed |= not AIM[0] <= share <= AIM[1]
            print(
                f"  the interval of {size} seeds covers it in {100.0 * share:.1f} % of {SETS} sets"
            )
    if missed:
        sys.exit(1)


def crossing(workspace: Workspace, arrivals: str, per_hour: float) -> Scenario:
    graph = load_map(workspace.map("signal_crossing")).sumo.graph
    scenario = edits.new_scenario(graph, name="intervals", roi=graph.segments.ids)
    scenario = edits.set_simulation(scenario, duration=SECONDS)
    for number, entry in enumerate(entries(Region.of(graph, scenario.roi))):
        scenario = edits.set_input(
            scenario, graph, inflow=f"leg-{number}", segment=entry.segment,
            direction=entry.direction, per_hour=per_hour, arrivals=arrivals,
        )  # fmt: skip
    return scenario


def values_of_runs(workspace: Workspace, scenario: Scenario, runs: int) -> dict[str, list[float]]:
    """Figures of runs with a seed each."""
    settings = RunSettings(recording=Recording(trajectories=False, emissions=False))
    with tempfile.TemporaryDirectory() as folder:
        done = run_many(
            workspace, [scenario], settings=settings, seeds=range(1, runs + 1), out=Path(folder),
            reports=False,
        )  # fmt: skip
        figures = [run.summary["figures"] for run in done]
    return {
        name: [float(row[name]) for row in figures]
        for name in FIGURES
        if all(row.get(name) is not None for row in figures)
    }


def coverage(values: Sequence[float], size: int, *, sets: int = SETS, seed: int = 0) -> float:
    """Share of sets of some values whose 95 % interval covers the mean of all.

    Parameters
    ----------
    size
        Values in a set, drawn with replacement: of many more runs than there are.
    """
    rng = np.random.default_rng(seed)
    every, mean = np.array(values), statistics.fmean(values)
    covered = 0
    for _ in range(sets):
        found = confidence_of(rng.choice(every, size).tolist(), share=0.05)
        assert found.mean is not None
        assert found.half_width is not None
        covered += abs(found.mean - mean) <= found.half_width
    return covered / sets
