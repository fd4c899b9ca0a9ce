"""How many critical cases a search finds in a hundred runs, by method, over seeds.

The scene: the ego goes straight on at a crossing, and yields; from the left and from the right
comes a car that keeps its speed whatever happens. Six parameters: when each of the three departs,
and how fast it goes. Critical is a collision, a time to collision below 1.5 s or a
post-encroachment time below 1 s. Intervals are 95 %, from a bootstrap over seeds.

``python -m bench critical_search --seeds 10 --runs 100 --jobs 2 --keep DIR``; searches that are in
the folder already are not run again.
"""

from __future__ import annotations

import argparse
import json
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from odscen.app.template_scenarios import template_scenario
from odscen.experiments.searches import SearchSettings, search
from odscen.experiments.sweeps import SweepSettings
from odscen.maps.store import Workspace
from odscen.scenario.document.json_form import dumps, loads
from odscen.scenario.sweeps.sweep_plan import Range

if TYPE_CHECKING:
    from odscen.scenario.document.scenario_document import Scenario

MAP = Path(__file__).parents[1] / "maps" / "signal_crossing.xodr"
SAFE = ("min_ttc >= 1.5", "min_pet >= 1.0")
DRAWS = 10_000

METHODS = ("random", "latin", "tpe")


def main() -> None:
    options = argparse.ArgumentParser(prog="bench critical_search")
    options.add_argument("--seeds", type=int, default=10)
    options.add_argument("--runs", type=int, default=100)
    options.add_argument("--batch", type=int, default=4)
    options.add_argument("--jobs", type=int, default=2)
    options.add_argument("--keep", type=Path, help="folder of the searches")
    asked = options.parse_args()
    with tempfile.TemporaryDirectory(prefix="odscen-bench-") as name:
        compare(asked.keep or Path(name), asked)


def compare(folder: Path, asked: argparse.Namespace) -> None:
    workspace = Workspace.open(folder / "workspace")
    workspace.add_map(MAP)
    scenario = two_runners(workspace)
    axes = [Range(name, one.min, one.max) for name, one in scenario.parameters.items()]
    found: dict[str, list[tuple[float, float, float, float]]] = {m: [] for m in METHODS}
    for seed in range(asked.seeds):
        for method in METHODS:
            how = SearchSettings(method, asked.runs, asked.batch, seed)
            one = search(
                workspace,
                scenario,
                axes,
                folder / f"{method}-{seed}",
                search_settings=how,
                settings=SweepSettings(SAFE),
                processes=asked.jobs,
            )
            found[method].append(
                (
                    100.0 * len(one.critical) / asked.runs,
                    100.0 * len(one.archive) / asked.runs,
                    100.0 * one.table["collision"].sum() / asked.runs,
                    100.0 * one.coverage,
                )
            )
            print(method, seed, *(f"{value:.1f}" for value in found[method][-1]), flush=True)
    _table({name: np.array(rows) for name, rows in found.items()}, asked)


def two_runners(workspace: Workspace) -> Scenario:
    """The scene: the map and drivers of the template, with two runners and six parameters."""
    data = json.loads(dumps(template_scenario(workspace, "red-light", MAP.stem)))
    data["name"], data["description"] = "two-runners", ""
    data["parameters"] = {
        name: {"value": low, "unit": unit, "min": low, "max": high}
        for name, unit, low, high in (
            ("ego_speed", "m/s", 6, 14), ("ego_depart", "s", 0, 15),
            ("left_speed", "m/s", 6, 16), ("left_depart", "s", 0, 20),
            ("right_speed", "m/s", 6, 16), ("right_depart", "s", 0, 20),
        )
    }  # fmt: skip
    data["actors"] = [
        _car("ego", "1.0.-2.30", "3.0.1.64", ego=True),
        _car("left", "4.0.-2.20", "2.0.1.64", style="steady", initial_speed="$left_speed"),
        _car("right", "2.0.-2.20", "4.0.1.64", style="steady", initial_speed="$right_speed"),
    ]
    data["rules"] = [
        _rule("ego", [{"ignore": {"red": True}}]),
        *(
            _rule(name, [{"speed": {"to": f"${name}_speed", "shape": "step"}}])
            for name in ("left", "right")
        ),
    ]
    data["simulation"] = {"duration": 40.0, "step_length": 0.1}
    return loads(json.dumps(data))


def _car(name: str, spawn: str, goal: str, **fields: object) -> dict[str, object]:
    own = {"speed": f"${name}_speed", "depart": f"${name}_depart"}
    return {"id": name, "category": "car", "spawn": spawn, "goal": goal, **own, **fields}


def _rule(name: str, then: list[dict[str, object]]) -> dict[str, object]:
    when = {"time": {"after": f"${name}_depart + 0.3"}}
    return {"id": f"as-{name}", "actor": name, "when": when, "then": then}


def _table(found: dict[str, np.ndarray], asked: argparse.Namespace) -> None:
    rng = np.random.default_rng(0)
    picks = rng.integers(asked.seeds, size=(DRAWS, asked.seeds))
    print(f"\n{asked.seeds} seeds of {asked.runs} runs; per 100 runs, mean and 95 % interval")
    print("| method | critical | of random's | distinct | collisions | pairs covered, % |")
    print("|---|---|---|---|---|---|")
    for name, rows in found.items():
        cells = [_cell(rows[:, column], picks) for column in range(4)]
        ratio = rows[picks, 0].mean(axis=1) / np.maximum(
            found["random"][picks, 0].mean(axis=1), 1e-9
        )
        low, high = np.quantile(ratio, [0.025, 0.975])
        own = rows[:, 0].mean() / found["random"][:, 0].mean()
        cells.insert(1, "" if name == "random" else f"{own:.2f} ({low:.2f} to {high:.2f})")
        print(f"| {name} | {' | '.join(cells)} |")


def _cell(values: np.ndarray, picks: np.ndarray) -> str:
    low, high = np.quantile(values[picks].mean(axis=1), [0.025, 0.975])
    return f"{values.mean():.1f} ({low:.1f} to {high:.1f})"
