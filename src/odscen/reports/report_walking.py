"""Pedestrians: how fast they walk, and how long they wait."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from odscen.figures.measures.figure import ReportSection
from odscen.records.outcomes import ActorStatus
from odscen.records.traces import bin_width, speed_over_time
from odscen.reports.charts import Series, line_chart
from odscen.reports.page_templates import report_section
from odscen.reports.report_figures import Card, card_grid, figure_cards

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    import polars as pl

    from odscen.base.markup import Markup
    from odscen.figures.measures.summary import ActorOutcome


def walking_section(
    figures: Mapping[str, Any],
    actors: Sequence[ActorOutcome],
    traces: pl.DataFrame,
    *,
    end: float,
) -> Markup | None:
    """Figures and speed over time; ``None`` without pedestrians.

    Parameters
    ----------
    figures
        Of the run by name.
    traces
        As :func:`~odscen.records.traces.tidy` gives them.
    """
    walkers = [actor for actor in actors if actor.category == "pedestrian"]
    if not walkers:
        return None
    arrived = sum(actor.status is ActorStatus.ARRIVED for actor in walkers)
    cards = [
        Card("pedestrians", f"{len(walkers):,}", f"{arrived:,} arrived"),
        *figure_cards(ReportSection.PEDESTRIANS, figures),
    ]
    parts: list[Markup | None] = [card_grid(cards)]
    on_foot = traces.filter(traces["category"] == "pedestrian")
    if not on_foot.is_empty():
        curve = speed_over_time(on_foot, end=end, width=bin_width(end, bins=60))
        if np.isfinite(curve.mean).sum() > 1:
            line = Series("mean of all pedestrians", "c-pedestrian", curve.mean, curve.low,
                          curve.high)  # fmt: skip
            text = "Mean walking speed over time"
            chart = line_chart(
                curve.time, [line], y_label="speed, m/s", description=text, height=210.0, end=end
            )
            parts.append(chart)
    explained = (
        "the free walking speed is some 1.4 m/s. The lower edge of the band at zero means that at "
        "any time at least one in ten is stopped, mostly before a red light or a busy road; long "
        "waits ask for a crossing, or for more green for pedestrians."
    )
    return report_section("Pedestrians", *parts, explained=explained, ident="walking")
