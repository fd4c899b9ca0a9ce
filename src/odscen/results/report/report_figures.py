"""Key figures of the report, as cards."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

from odscen.base.markup import Markup, element, number
from odscen.results.measures.summary import actor_counts
from odscen.results.report.page_templates import report_section
from odscen.results.report.report_words import duration

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    import polars as pl

    from odscen.results.measures.summary import ActorOutcome


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


def key_figure_section(
    figures: Mapping[str, Any], actors: Sequence[ActorOutcome], traces: pl.DataFrame
) -> Markup:
    """Section of the cards.

    Parameters
    ----------
    figures
        Of the run, by name, SI units; those missing or ``None`` have no card.
    traces
        As :func:`~odscen.results.records.traces.tidy` gives them.
    """
    explained = (
        "an actor is one vehicle or pedestrian. It has entered the road when the simulation could "
        "place it, and teleported when it was stuck so long that the simulator moved it on. Time "
        "is lost by whoever drives more slowly than the driver would like to on a free road."
    )
    cards = [
        *_counts(actors),
        *_travel(figures, traces),
        *_reliability(figures),
        *_consumption(figures),
        *_start(figures),
    ]
    return report_section("Key figures", card_grid(cards), explained=explained, ident="figures")


def _counts(actors: Sequence[ActorOutcome]) -> list[Card]:
    counts = actor_counts(actors)
    planned, inserted, arrived = (counts[key] for key in ("planned", "inserted", "arrived"))
    cards = [
        Card("actors planned", f"{planned:,}"),
        Card("entered the road", f"{inserted:,}", _share(inserted, planned)),
        Card("reached their goal", f"{arrived:,}", _share(arrived, planned)),
    ]
    for key in ("teleported", "collided"):
        count = counts[key]
        cards.append(Card(key, f"{count:,}", "" if count else "none: good", bad=count > 0))
    return cards


def _travel(figures: Mapping[str, Any], traces: pl.DataFrame) -> list[Card]:
    driven = traces.filter(traces["category"] != "pedestrian")["speed"].mean()
    cards = [
        Card("mean travel time", duration(figures.get("mean_travel_time")) or "-",
             "of vehicles that arrived"),
        Card("mean speed of vehicles", _kmh(driven), "stops included"),
    ]  # fmt: skip
    for name, words, note in (
        ("mean_delay", "lost per vehicle", "against driving freely"),
        ("mean_waiting_time", "stood per vehicle", "on average"),
        ("worst_junction_delay", "lost at the worst junction", "by each vehicle there"),
    ):
        if (value := figures.get(name)) is not None:
            cards.append(Card(words, duration(value), note))
    if (stops := figures.get("mean_stops")) is not None:
        cards.append(Card("stops per vehicle", number(stops, 1), "on average"))
    return cards


def _reliability(figures: Mapping[str, Any]) -> list[Card]:
    cards = []
    if (index := figures.get("travel_time_index")) is not None:
        note = "so many times as long as on a free road"
        cards.append(Card("a trip takes", f"{number(index, 2)} times", note))
    if (index := figures.get("planning_time_index")) is not None:
        note = "the time on a free road, to be in time 19 times in 20"
        cards.append(Card("to allow for a trip", f"{number(index, 2)} times", note))
    return cards


def _consumption(figures: Mapping[str, Any]) -> list[Card]:
    cards = []
    arrived, driven = figures.get("throughput"), figures.get("vehicle_km")
    if driven is not None:
        note = "" if arrived is None else f"{number(arrived, 0)} arrived an hour"
        cards.append(Card("driven by all vehicles", f"{driven:,.0f} km", note))
    if (each := figures.get("co2_per_km")) is not None:
        cards.append(Card("CO2 per vehicle and km", f"{number(each, 0)} g", _total(figures, "co2")))
    fuel = figures.get("fuel_total")
    if fuel is not None and driven:
        value = f"{number(fuel * 1000.0 / driven, 0)} g"
        cards.append(Card("fuel per vehicle and km", value, _total(figures, "fuel")))
    return cards


def _total(figures: Mapping[str, Any], name: str) -> str:
    total = figures.get(f"{name}_total")
    return "" if total is None else f"{total:,.0f} kg in all"


def _start(figures: Mapping[str, Any]) -> list[Card]:
    error = figures.get("insertion_error_max")
    if not isinstance(error, int | float):
        return []
    return [Card("largest start error", f"{error * 100:.1f} cm", "from the planned place")]


def _share(part: int, whole: int) -> str:
    return f"{number(100.0 * part / whole, 1)} % of the planned" if whole else ""


def _kmh(speed: object) -> str:
    return f"{number(speed * 3.6, 1)} km/h" if isinstance(speed, int | float) else "-"
