"""From a run folder to its figures, each with its place: what baselines and comparisons hold."""

from __future__ import annotations

from itertools import groupby
from typing import TYPE_CHECKING, NamedTuple

from odscen.base.errors import in_file
from odscen.base.stored_files import tables
from odscen.figures.by_place.analysis_times import AnalysisTimes
from odscen.figures.by_place.traffic import over_run
from odscen.figures.measures.registry import ACTOR_FIGURES, COUNTS, SEGMENT_FIGURES, figure_of
from odscen.figures.measures.summary import actors_from_json
from odscen.records.outcomes import RunStatus
from odscen.runs import layout
from odscen.runs.measured import read_lane_figures

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping
    from pathlib import Path
    from typing import Any

    from odscen.figures.by_place.traffic import TrafficFigures
    from odscen.figures.measures.figure import Figure, FigureKind

DIGITS = 4
"""Decimals kept: far below what matters, and readable in a diff."""


class FigureKey(NamedTuple):
    """A figure and its place; ``place`` is empty for figures of the whole run."""

    kind: FigureKind
    place: str
    figure: str

    @property
    def name(self) -> str:
        """``"mean_delay"``, ``"segment r1-0: mean_speed"``."""
        return f"{self.kind} {self.place}: {self.figure}" if self.place else self.figure

    @property
    def entry(self) -> Figure:
        """What the registry says of the figure."""
        return figure_of(self.kind, self.figure)

    @property
    def label(self) -> str:
        """``"mean delay"``, ``"segment r1-0: mean speed"``."""
        label = self.entry.label
        return f"{self.kind} {self.place}: {label}" if self.place else label


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


def place_figures(figures: TrafficFigures) -> Iterator[tuple[FigureKey, float | None]]:
    """Figures of each segment and junction over the whole run."""
    for kind, entries in groupby(SEGMENT_FIGURES, key=lambda figure: figure.kind):
        chosen = list(entries)
        rows = over_run(getattr(figures, chosen[0].table)).select(
            kind, *(figure.column().alias(figure.name) for figure in chosen)
        )
        for place, *values in rows.iter_rows():
            for figure, value in zip(chosen, values, strict=True):
                yield FigureKey(kind, place, figure.name), value


def measure(folder: Path, summary: Mapping[str, Any]) -> Measured:
    """Figures of a run and of its places.

    Actors of flows have no figures of their own: another seed has others of the same name.

    Raises
    ------
    InputError
        If a file of the run cannot be read.
    """
    found = run_figures(summary)
    if summary["status"] != RunStatus.COMPLETED:
        return found
    actors_file = folder / layout.ACTORS_FILE
    with tables(str(folder)):
        with in_file(str(actors_file)):
            actors = actors_from_json(actors_file.read_text(encoding="utf-8", errors="replace"))
        for actor in actors:
            if actor.flow is None:
                found |= {
                    FigureKey("actor", actor.id, figure.name): figure.compute(actor)
                    for figure in ACTOR_FIGURES
                }
        times = AnalysisTimes.of_summary(summary)
        # Those of baselines need no queues, control delay or lane groups, which take most of the
        # time that all figures of a run take.
        figures = read_lane_figures(
            folder, end=summary["sim_seconds"], meso=bool(summary.get("meso")), times=times
        )
        for key, value in place_figures(figures) if figures is not None else ():
            if value is not None:
                found[key] = round(float(value), DIGITS)
    return found
