"""A sweep: how delay grows with traffic. Three loads, three random seeds each, as one table.

Run it with ``python examples/sweep.py [WORKSPACE]``.
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

import polars as pl

import odscen

MAP, FILLS, SEEDS = "signal_crossing", (0.1, 0.3, 0.5), 3


def sweep(workspace: odscen.Workspace) -> pl.DataFrame:
    settings = odscen.RunSettings(recording=odscen.Recording(trajectories=False))
    rows = []
    for fill in FILLS:
        wanted = odscen.GenerationSettings(map_name=MAP, count=SEEDS, seed=1, fill=fill)
        out = workspace.root / f"fill-{fill}"
        paths = odscen.generate(workspace, settings=wanted, out=out)
        for run in odscen.run_many(workspace, paths, settings=settings, out=out, processes=2):
            delay = run.figures["mean_delay"]
            rows.append({"fill": fill, "road users": run.counts["inserted"], "delay": delay})
    return (
        pl.DataFrame(rows)
        .group_by("fill", maintain_order=True)
        .agg(
            pl.col("road users").mean(),
            pl.col("delay").mean().round(1).alias("mean delay, s"),
            pl.col("delay").std().round(1).alias("between seeds, s"),
        )
    )


if __name__ == "__main__":
    root = Path(sys.argv[1] if sys.argv[1:] else tempfile.mkdtemp())
    store = odscen.Workspace.open(root)
    store.add_map(next(path for path in odscen.shipped_maps() if path.stem == MAP))
    print(sweep(store))
