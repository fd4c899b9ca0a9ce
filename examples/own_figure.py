"""A figure of one's own: the share of time that vehicles crawl, below 5 km/h, by junction.

Run it with ``python examples/own_figure.py [WORKSPACE]``.
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

import polars as pl

import odscen

MAP, CRAWL = "town_5x5", 5 / 3.6
"""m/s."""


def crawling(run: odscen.Run) -> pl.DataFrame:
    """Of all time that vehicles spent on the way to a junction and in it, the share below CRAWL."""
    places = run.lane_places().ways.select("lane", "junction").unique()
    return (
        run.trajectories()
        .filter(pl.col("category") != "pedestrian")
        .join(places, on="lane")
        .group_by("junction")
        .agg(
            pl.col("id").n_unique().alias("vehicles"),
            (pl.col("speed") < CRAWL).mean().round(3).alias("crawling"),
        )
        .sort("crawling", "junction", descending=[True, False])
    )


if __name__ == "__main__":
    root = Path(sys.argv[1] if sys.argv[1:] else tempfile.mkdtemp())
    store = odscen.Workspace.open(root)
    store.add_map(next(path for path in odscen.shipped_maps() if path.stem == MAP))
    wanted = odscen.GenerationSettings(map_name=MAP, seed=3, fill=0.3, roi_segments=20)
    (path,) = odscen.generate(store, settings=wanted)
    print(crawling(odscen.run(store, path, settings=odscen.RunSettings(until=120.0))).head(10))
