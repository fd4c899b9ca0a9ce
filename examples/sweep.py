"""An experiment: how delay grows with traffic. Three loads, three random seeds each, as one table.

Run it with ``python examples/sweep.py [WORKSPACE]``. Run it again after an interruption, and it
makes the runs that are missing.
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

import polars as pl

import odscen

MAP, FILLS, SEEDS = "signal_crossing", (0.1, 0.3, 0.5), 3


def sweep(workspace: odscen.Workspace) -> pl.DataFrame:
    sampled = [
        {"maps": [MAP], "count": SEEDS, "seed": round(100 * fill), "fill": fill} for fill in FILLS
    ]
    plan = odscen.ExperimentPlan.model_validate(
        {"name": "load", "sample": sampled, "run": {"trajectories": False}}
    )
    results = odscen.run_experiment(workspace, workspace.root / "load", plan=plan, processes=2)
    # Scenarios are named after the map and their seed: signal_crossing-0031 has a fill of 0.3.
    seed = pl.col("scenario").str.slice(-4).cast(pl.Int64)
    return (
        results.table.with_columns((seed // 10 / 10).alias("fill"))
        .group_by("fill", maintain_order=True)
        .agg(
            pl.col("inserted").mean().alias("road users"),
            pl.col("mean_delay").mean().round(1).alias("mean delay, s"),
            pl.col("mean_delay").std().round(1).alias("between seeds, s"),
        )
    )


if __name__ == "__main__":
    root = Path(sys.argv[1] if sys.argv[1:] else tempfile.mkdtemp())
    store = odscen.Workspace.open(root)
    store.add_map(next(path for path in odscen.shipped_maps() if path.stem == MAP))
    print(sweep(store))
