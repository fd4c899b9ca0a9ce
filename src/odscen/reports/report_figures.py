"""Figures of the report, as cards."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

from odscen.base.markup import Markup, element, number
from odscen.figures.measures.figure import Better, ReportSection
from odscen.figures.measures.registry import RUN_FIGURES, run_figure
from odscen.reports.page_templates import report_section
from odscen.reports.report_words import duration

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    import polars as pl

    from odscen.figures.measures.figure import RunFigure


class Card(NamedTuple):
    """One figure: what it is, its value with the unit, a note or nothing; ``bad`` ones are red."""

    name: str
    value: str
    note: str = ""
    bad: bool = False


def card_grid(cards: Iterable[Card]) -> Markup:
    """Cards beside each other."""
    shown = [
        element(
            "div",
            element("strong", card.value),
            element("span", card.name),
            element("small", card.note) if card.note else None,
            class_="card bad" if card.bad else "card",
        )
        for card in cards
    ]
    return element("div", *shown, class_="cards")


def figure_cards(section: ReportSection, values: Mapping[str, Any]) -> list[Card]:
    """Cards of all figures of a section that the run has.

    Parameters
    ----------
    values
        Figures and counts of the run by name, in the units of the registry.
    """
    return [
        _card(figure, float(value), values)
        for figure in RUN_FIGURES
        if figure.section is section and (value := values.get(figure.name)) is not None
    ]


def named_cards(names: Iterable[str], values: Mapping[str, Any]) -> list[Card]:
    """Cards of the figures of these names that the run has; ``values`` as for figure_cards."""
    figures = [figure for name in names if (figure := run_figure(name)) is not None]
    return [
        _card(figure, float(value), values)
        for figure in figures
        if (value := values.get(figure.name)) is not None
    ]


def key_figure_section(values: Mapping[str, Any], traces: pl.DataFrame) -> Markup:
    """ReportSection of the cards.

    Parameters
    ----------
    values
        As for :func:`figure_cards`.
    traces
        As :func:`~odscen.records.traces.tidy` gives them.
    """
    explained = (
        "a road user is one vehicle or pedestrian. It is inserted when the simulation could place "
        "it on the road, and teleported when it was gridlocked: removed after it had waited too "
        "long, and put back further on. Delay is the time lost below the speed that the driver "
        "desires on a free road, stopped delay the part of it below 0.1 m/s."
    )
    cards = [*figure_cards(ReportSection.KEY_FIGURES, values), *_speed_on_the_road(traces)]
    return report_section("Key figures", card_grid(cards), explained=explained, ident="figures")


def shown_value(figure: RunFigure, value: float) -> str:
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


def _card(figure: RunFigure, value: float, values: Mapping[str, Any]) -> Card:
    note = figure.note if isinstance(figure.note, str) else figure.note(values)
    planned = values.get("planned")
    if figure.count and figure.better is Better.HIGHER and planned:
        note = f"{number(100.0 * value / planned, 1)} % of the planned"
    elif figure.alarming and not value:
        note = "none: good"
    return Card(figure.label, shown_value(figure, value), note, bad=figure.alarming and value > 0)


def _speed_on_the_road(traces: pl.DataFrame) -> list[Card]:
    """Mean of all vehicles at all times, those included that have not arrived."""
    speed = traces["speed"].filter(traces["category"] != "pedestrian").mean()
    text = f"{number(speed * 3.6, 1)} km/h" if isinstance(speed, int | float) else "-"
    return [Card("mean speed on the road", text, "of all vehicles, stops included")]
