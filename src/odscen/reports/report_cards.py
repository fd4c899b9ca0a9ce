"""Figures of the report, as cards."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

from odscen.base.markup import number
from odscen.figures.measures.figure import Better, ReportSection
from odscen.figures.measures.registry import RUN_FIGURES, run_figure
from odscen.reports.report_words import duration

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from odscen.figures.measures.figure import RunFigure


class Card(NamedTuple):
    """One figure: what it is, its value with the unit, a note or nothing; ``bad`` ones are red."""

    name: str
    value: str
    note: str = ""
    bad: bool = False


def figure_cards(section: ReportSection, values: Mapping[str, Any]) -> list[Card]:
    """Cards of all figures of a section that the run has.

    Parameters
    ----------
    values
        Figures and counts of the run by name, in the units of the registry.
    """
    return [
        _make_card(figure, float(value), values)
        for figure in RUN_FIGURES
        if figure.section is section and (value := values.get(figure.name)) is not None
    ]


def named_cards(names: Iterable[str], values: Mapping[str, Any]) -> list[Card]:
    """Cards of the figures of these names that the run has; ``values`` as for figure_cards."""
    figures = [figure for name in names if (figure := run_figure(name)) is not None]
    return [
        _make_card(figure, float(value), values)
        for figure in figures
        if (value := values.get(figure.name)) is not None
    ]


def _format_value(figure: RunFigure, value: float) -> str:
    """``"36 km/h"``: a value as people read it; at the limit of what is recorded, just that."""
    display = figure.shown
    if figure.limit is not None and value == figure.limit:
        beyond = "over" if figure.better is Better.HIGHER else "under"
        return f"{beyond} {value * display.factor:g} {display.unit}"
    if display.clock:
        return duration(value)
    scaled = value * display.factor
    digits = display.digits if abs(scaled) < 1000.0 else 0
    text = f"{scaled:,.0f}" if digits == 0 else number(scaled, digits)
    return f"{text} {display.unit}".rstrip()


def _make_card(figure: RunFigure, value: float, values: Mapping[str, Any]) -> Card:
    note = figure.note if isinstance(figure.note, str) else figure.note(values)
    planned = values.get("planned")
    if figure.count and figure.better is Better.HIGHER and planned:
        note = f"{number(100.0 * value / planned, 1)} % of the planned"
    elif figure.alarming and not value:
        note = "none: good"
    return Card(figure.label, _format_value(figure, value), note, bad=figure.alarming and value > 0)
