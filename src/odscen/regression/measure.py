"""From a run folder to its figures, each with its place: what baselines and comparisons hold."""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal, NamedTuple

import numpy as np

from odscen.errors import InputError, in_file
from odscen.results.expectations import COUNTS
from odscen.results.places import PlaceIndex, figures_by_place
from odscen.results.summary import actors_from_json
from odscen.sumo import layout

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path
    from typing import Any

    from odscen.sumo.sumo_map import SumoMap

Kind = Literal["run", "segment", "junction", "actor"]

DIGITS = 4
"""Decimals kept: far below what matters, and readable in a diff."""


class Key(NamedTuple):
    """A figure and its place; ``place`` is empty for figures of the whole run."""

    kind: Kind
    place: str
    figure: str

    @property
    def name(self) -> str:
        """``"mean_delay"``, ``"segment r1-0: v85"``."""
        return f"{self.kind} {self.place}: {self.figure}" if self.place else self.figure


Measured = dict[Key, float | None]


def run_figures(summary: Mapping[str, Any]) -> Measured:
    """Figures of the whole run, as they stand in its summary."""
    values: dict[str, Any] = {"sim_seconds": summary.get("sim_seconds")}
    values |= {name: (summary.get("actors") or {}).get(name) for name in COUNTS}
    values |= summary.get("figures") or {}
    return {
        Key("run", "", name): None if value is None else round(float(value), DIGITS)
        for name, value in values.items()
        if value is None or isinstance(value, int | float)
    }


def place_index(sumo_map: SumoMap) -> PlaceIndex:
    """Lane-graph nodes of a map with their SUMO lanes and segments."""
    lanes, segments = sumo_map.graph.lanes, sumo_map.graph.segments
    places = sumo_map.lane_places
    return PlaceIndex(
        xy=np.column_stack([lanes.x, lanes.y]) + np.array(sumo_map.net_offset),
        lane=places.lane,
        lanes=places.lanes,
        segment=lanes.segment,
        segments=segments.ids,
        junction=[kind == "junction" for kind in segments.kinds],
    )


def measure(folder: Path, summary: Mapping[str, Any], index: PlaceIndex | None) -> Measured:
    """Figures of a run and of its places; of the places only with the map's ``index``.

    Actors of flows have no figures of their own: another seed has others of the same name.

    Raises
    ------
    InputError
        If a file of the run cannot be read.
    """
    import polars as pl

    found = run_figures(summary)
    if summary["status"] != "completed":
        return found
    actors_file = folder / layout.ACTORS_FILE
    try:
        with in_file(str(actors_file)):
            actors = actors_from_json(actors_file.read_text(encoding="utf-8"))
        for actor in actors:
            if actor.flow is None:
                found[Key("actor", actor.id, "travel_time")] = actor.travel_time
        if index is not None:
            vehicles = {a.id: a.category for a in actors if a.category != "pedestrian"}
            trajectories = pl.read_parquet(folder / layout.TRAJECTORIES_FILE)
            for (kind, place), figures in figures_by_place(trajectories, vehicles, index).items():
                for name, value in figures.items():
                    key = Key("junction" if kind == "junction" else "segment", place, name)
                    found[key] = round(value, DIGITS)
    except (OSError, pl.exceptions.PolarsError) as error:
        msg = f"files of the run cannot be read: {error}"
        raise InputError(msg, file=str(folder)) from error
    return found
