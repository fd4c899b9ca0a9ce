"""A study: what does hard rain cost? Paired by seed, with a report.

Run it with ``python examples/rain_study.py [WORKSPACE]``.
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

import polars as pl

import odscen
from odscen.experiments import ExperimentPlan, run_experiment

MAP = "t_junction_signs"


def study(workspace: odscen.Workspace) -> None:
    settings = odscen.GenerationSettings(map_name=MAP, seed=4, fill=0.3)
    (file,) = odscen.generate(workspace, settings=settings)
    plan = ExperimentPlan.model_validate(
        {
            "name": "rain",
            "scenarios": [str(file)],
            "seeds": 3,
            "variant": [
                {
                    "name": "hard-rain",
                    "edits": [{"kind": "set_environment", "preset": "HardRainNoon"}],
                }
            ],
            "run": {"until": 60},
        }
    )
    results = run_experiment(workspace, workspace.root / "rain", plan=plan, processes=2)
    means = results.table.group_by("variant").agg(pl.col("mean_speed").mean()).sort("variant")
    for variant, speed in means.iter_rows():
        print(f"{variant}: {speed:.2f} m/s")


if __name__ == "__main__":
    root = Path(sys.argv[1] if sys.argv[1:] else tempfile.mkdtemp())
    store = odscen.Workspace.open(root)
    store.add_map(next(path for path in odscen.shipped_maps() if path.stem == MAP))
    study(store)
