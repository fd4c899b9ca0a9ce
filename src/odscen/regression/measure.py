"""From a run folder to its figures, each with its place: what baselines and comparisons hold."""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal, NamedTuple

from odscen.base.errors import InputError, in_file
from odscen.results.measures.expectations import COUNTS
from odscen.results.measures.summary import actors_from_json
from odscen.results.measures.traffic import over_run
from odscen.sumo.folder import layout
from odscen.sumo.outputs.measured import read_figures

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping
    from pathlib import Path
    from typing import Any

    from odscen.results.measures.traffic import TrafficFigures

PlaceKind = Literal["run", "segment", "junction", "actor"]

DIGITS = 4
"""Decimals kept: far below what matters, and readable in a diff."""


class FigureKey(NamedTuple):
    """A figure and its place; ``place`` is empty for figures of the whole run."""

    kind: PlaceKind
    place: str
    figure: str

    @property
    def name(self) -> str:
        """``"mean_delay"``, ``"segment r1-0: mean_speed"``."""
        return f"{self.kind} {self.place}: {self.figure}" if self.place else self.figure


Measured = dict[FigureKey, float | None]


def run_figures(summary: Mapping[str, Any]) -> Measured:
    """Figures of the whole run, as they stand in its summary."""
    values: dict[str, Any] = {"sim_seconds": summary.get("sim_seconds")}
    values |= {name: (summary.get("actors") or {}).get(name) for name in COUNTS}
    values |= summary.get("figures") or {}
    return {
        FigureKey("run", "", name): None if value is None else round(float(value), DIGITS)
        for name, value in values.items()
        if value is None or isinstance(value, int | float)
    }


_PLACES: dict[str, tuple[PlaceKind, dict[str, str]]] = {
    "segments": ("segment", {"vehicles": "vehicles", "mean_speed": "speed", "free_speed": "free"}),
    "junctions": ("junction", {"vehicles": "vehicles", "waiting_time": "waiting"}),
}
"""Tables with the kind of their places, and their figures by the names that baselines have."""


def place_figures(figures: TrafficFigures) -> Iterator[tuple[FigureKey, float | None]]:
    """Figures of each segment and junction over the whole run."""
    import polars as pl

    for table, (kind, names) in _PLACES.items():
        rows = over_run(getattr(figures, table))
        if kind == "segment":
            rows = rows.with_columns(free=1000.0 * pl.col("length") / pl.col("free_flow_time"))
        for row in rows.iter_rows(named=True):
            for name, column in names.items():
                yield FigureKey(kind, row[kind], name), row[column]


def measure(folder: Path, summary: Mapping[str, Any]) -> Measured:
    """Figures of a run and of its places.

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
                found[FigureKey("actor", actor.id, "travel_time")] = actor.travel_time
        figures = read_figures(folder, end=summary["sim_seconds"])
    except (OSError, pl.exceptions.PolarsError) as error:
        msg = f"files of the run cannot be read: {error}"
        raise InputError(msg, file=str(folder)) from error
    if figures is not None:
        for key, value in place_figures(figures):
            if value is not None:
                found[key] = round(float(value), DIGITS)
    return found
