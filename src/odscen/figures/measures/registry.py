"""The registry of figures: all that reports, suites, comparisons, the page and the docs read.

To add a figure, write its entry and its function in one of the family files beside this one; a
family of its own is listed here.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from odscen.figures.measures import (
    emissions,
    insertion,
    latent_delay,
    motion,
    outcome_counts,
    place_figures,
    reliability,
    safety,
    signal_use,
    table_columns,
    throughput,
    timetable,
    travel,
)
from odscen.figures.measures.figure import (
    ActorFigure,
    Basis,
    Figure,
    RunFigure,
    SegmentFigure,
    SummaryPart,
)

if TYPE_CHECKING:
    from collections.abc import Iterable

    from odscen.figures.measures.figure import FigureKind, RunData, Values

RUN_FIGURES: tuple[RunFigure, ...] = (
    *outcome_counts.FIGURES,
    *insertion.FIGURES,
    *latent_delay.FIGURES,
    *travel.FIGURES,
    *emissions.FIGURES,
    *reliability.FIGURES,
    *throughput.FIGURES,
    *safety.FIGURES,
    *motion.FIGURES,
    *signal_use.FIGURES,
    *timetable.FIGURES,
)
"""Figures of a whole run, in the order in which ``summary.json`` has them."""

ALL_FIGURES: tuple[Figure, ...] = (*RUN_FIGURES, *place_figures.FIGURES)

COLUMN_UNITS = {column.name: column.unit for column in table_columns.COLUMNS}
"""Units of the columns of :class:`odscen.figures.by_place.traffic.TrafficFigures`."""

COUNTS = tuple(figure.name for figure in RUN_FIGURES if figure.count)

_ON_DEMAND = (Basis.CONFLICTS, Basis.STOPS, Basis.PARKING, Basis.MOTION)

_BY_NAME: dict[tuple[FigureKind, str], Figure] = {
    (figure.kind, figure.name): figure for figure in ALL_FIGURES
}
SEGMENT_FIGURES = tuple(
    figure for figure in place_figures.FIGURES if isinstance(figure, SegmentFigure)
)
"""Figures of segments and junctions."""
ACTOR_FIGURES = tuple(figure for figure in place_figures.FIGURES if isinstance(figure, ActorFigure))


def names_of(kind: FigureKind) -> tuple[str, ...]:
    """Names of all figures of runs, of segments, ..."""
    return tuple(name for own, name in _BY_NAME if own == kind)


def run_figure(name: str) -> RunFigure | None:
    """Look up a figure of the run; ``None`` if there is none of this name."""
    found = _BY_NAME.get(("run", name))
    return found if isinstance(found, RunFigure) else None


def figure_of(kind: FigureKind, name: str) -> Figure:
    """Look up a figure; one that only old files have has its name, and no unit."""
    known = _BY_NAME.get((kind, name))
    if known is not None:
        return known
    return Figure(
        name=name,
        unit="",
        label=name.replace("_", " "),
        definition="Not known to this version.",
        source="",
    )


def figure_values(
    data: RunData,
    figures: Iterable[RunFigure] = RUN_FIGURES,
    *,
    part: SummaryPart = SummaryPart.FIGURES,
) -> Values:
    """Values of the figures of one part of the summary.

    Those for which the run has not recorded the basis are ``None``; those of conflicts, which are
    measured on demand, and of public transport, which few scenarios have, are left out.
    """
    return {
        figure.name: _read_kept_value(data, figure) if data.has(figure.basis) else None
        for figure in figures
        if figure.part is part and (figure.basis not in _ON_DEMAND or data.has(figure.basis))
    }


def _read_kept_value(data: RunData, figure: RunFigure) -> float | int | None:
    if figure.name not in data.kept:
        data.kept[figure.name] = figure.compute(data)
    value: float | int | None = data.kept[figure.name]
    return value
