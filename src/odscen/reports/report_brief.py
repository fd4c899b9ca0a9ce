"""The first page of the report: what came out in six figures, a map, and at most three findings."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from odscen.base.markup import Markup, element, number
from odscen.figures.by_place.traffic import over_run
from odscen.reports.page_templates import report_section
from odscen.reports.report_figures import card_grid, named_cards
from odscen.reports.report_service import service_map, worst_places

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from odscen.figures.by_place.traffic import TrafficFigures
    from odscen.figures.measures.usability import Usability
    from odscen.reports.report_maps import PlaceShapes

SIX = (
    "arrived",
    "mean_delay",
    "mean_latent_delay",
    "mean_speed",
    "throughput",
    "worst_junction_delay",
)
"""Figures of the run that the first page has; those that it does not have are left out."""

FINDINGS = 3


def brief_section(
    values: Mapping[str, Any],
    usability: Usability,
    figures: TrafficFigures | None,
    shapes: PlaceShapes | None,
) -> Markup:
    """Figures, findings and the map of levels of service.

    Parameters
    ----------
    values
        Figures and counts of the run by name.
    shapes
        Of the map's places; there is no map without them, nor without figures by place.
    """
    findings = [*[one.words for one in usability.reasons], *_places(figures)][:FINDINGS]
    listed = element("ol", *[element("li", _sentence(words)) for words in findings])
    drawn = None if figures is None or shapes is None else service_map(figures, shapes)
    explained = (
        "whether the run is usable says if enough of the demand got onto the road and through: "
        "of a run that is not, no other figure on this page should be quoted. The mean delay is of "
        "all vehicles that were due, those included that waited for room to depart, or were still "
        "under way. Everything in detail, and how it is defined, is below."
    )
    return report_section(
        "In brief",
        card_grid(named_cards(SIX, values)),
        element("h3", "Findings") if findings else None,
        listed if findings else None,
        drawn,
        explained=explained,
        ident="brief",
    )


def _places(figures: TrafficFigures | None) -> Iterator[str]:
    """The worst movement and the slowest segment, if they are at capacity or beyond."""
    if figures is None:
        return
    for row in worst_places(over_run(figures.movements))[:1]:
        if row["level"] in ("E", "F"):
            name = str(row["movement"]).replace(">", " > ")
            yield (
                f"the turning movement {name} has level of service {row['level']}: "
                f"{number(row['shown'], 0)} s control delay for {row['vehicles']:,} vehicles"
            )
    segments = over_run(figures.segments)
    slow = segments.filter(segments["level"].is_in(["E", "F"])).sort("time_loss", descending=True)
    for row in slow.head(1).iter_rows(named=True):
        yield (
            f"segment {row['segment']}, the one with most time lost, has level of service "
            f"{row['level']}: "
            f"{number(row['speed'] * 3.6, 0)} km/h for {row['vehicles']:,} vehicles"
        )


def _sentence(words: str) -> str:
    return f"{words[:1].upper()}{words[1:]}."
