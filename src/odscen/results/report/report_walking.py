"""People on foot: how fast they walk, and how long they wait."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from odscen.base.markup import Markup, number
from odscen.results.records.traces import bin_width, speed_over_time
from odscen.results.report.page_templates import report_section
from odscen.results.report.plots import Series, line_chart
from odscen.results.report.report_figures import Card, card_grid
from odscen.results.report.report_words import duration

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    import polars as pl

    from odscen.results.measures.summary import ActorOutcome

_PREFIX = "pedestrian_"


def walking_section(
    figures: Mapping[str, Any],
    actors: Sequence[ActorOutcome],
    traces: pl.DataFrame,
    *,
    end: float,
) -> Markup | None:
    """Figures and speed over time; ``None`` if nobody walked.

    Parameters
    ----------
    figures
        Of the run; those of people on foot begin with ``pedestrian_``.
    traces
        As :func:`~odscen.results.records.traces.tidy` gives them.
    """
    walkers = [actor for actor in actors if actor.category == "pedestrian"]
    if not walkers:
        return None
    arrived = sum(actor.status == "arrived" for actor in walkers)
    speed = figures.get(_PREFIX + "mean_speed")
    cards = [Card("people on foot", f"{len(walkers):,}", f"{arrived:,} reached their goal")]
    for name, words, note in (
        ("mean_travel_time", "mean time on the way", "of those who arrived"),
        ("mean_waiting_time", "stood on average", "mostly at crossings"),
        ("mean_delay", "lost on average", "against walking freely"),
    ):
        if (seconds := figures.get(_PREFIX + name)) is not None:
            cards.append(Card(words, duration(seconds), note))
    if (speed := figures.get(_PREFIX + "mean_speed")) is not None:
        cards.append(Card("mean walking speed", f"{number(speed, 2)} m/s", "waiting included"))
    parts: list[Markup | None] = [card_grid(cards)]
    on_foot = traces.filter(traces["category"] == "pedestrian")
    if not on_foot.is_empty():
        curve = speed_over_time(on_foot, end=end, width=bin_width(end, bins=60))
        if np.isfinite(curve.mean).sum() > 1:
            line = Series("mean of all people on foot", "c-pedestrian", curve.mean, curve.low,
                          curve.high)  # fmt: skip
            text = "Mean walking speed over time"
            chart = line_chart(
                curve.time, [line], y_label="speed, m/s", description=text, height=210.0, end=end
            )
            parts.append(chart)
    explained = (
        "those who walk freely make some 1.4 m/s. The lower edge of the band at zero means that at "
        "any time at least one in ten stands, mostly before a red light or a busy road; much "
        "waiting asks for a crossing, or for more green for those who walk."
    )
    return report_section("People on foot", *parts, explained=explained, ident="walking")
