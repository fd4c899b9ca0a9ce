"""How vehicles and pedestrians travelled; apart, as the two mix badly.

They are of those who have arrived, as the trips of the others are not over; but for the delay,
which is of all: see :mod:`odscen.figures.measures.latent_delay`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from odscen.figures.measures.figure import (
    CLOCK,
    KMH,
    Better,
    Display,
    ReportSection,
    RunFigure,
    mean,
)
from odscen.figures.measures.latent_delay import mean_delay
from odscen.records.outcomes import ActorStatus

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from odscen.figures.measures.figure import RunData
    from odscen.figures.measures.summary import ActorOutcome

    Outcomes = Sequence[ActorOutcome]

_TRIPINFO = "SUMO tripinfo"
_EVENTS = "SUMO, departed and arrived"


def _travel_times(outcomes: Outcomes) -> list[float]:
    return [outcome.travel_time for outcome in outcomes if outcome.travel_time is not None]


def _travel_time_percentile(outcomes: Outcomes, share: float) -> float | None:
    times = _travel_times(outcomes)
    return float(np.percentile(times, share)) if times else None


def _mean_speed(outcomes: Outcomes) -> float | None:
    """Space mean: metres of all over their seconds."""
    moved = [
        (outcome.route_length, outcome.travel_time)
        for outcome in outcomes
        if outcome.travel_time and outcome.route_length is not None
    ]
    seconds = sum(time for _, time in moved)
    return sum(length for length, _ in moved) / seconds if seconds else None


def _keep_arrived(outcomes: Outcomes) -> Outcomes:
    return [outcome for outcome in outcomes if outcome.status is ActorStatus.ARRIVED]


def _make_mode_figures(
    prefix: str, who: str, of: Callable[[RunData], Outcomes], *, section: ReportSection
) -> tuple[RunFigure, ...]:
    """Figures of vehicles or of pedestrians; ``who`` begins the label of the latter."""
    afoot = bool(prefix)
    walker = "pedestrian" if afoot else "vehicle"
    desired = "walking speed" if afoot else "desired speed"
    return (
        RunFigure(
            name=f"{prefix}mean_travel_time",
            unit="s",
            label=f"{who}mean travel time",
            definition=f"Mean time from insertion to arrival, per {walker} that arrived.",
            source=_EVENTS,
            better=Better.LOWER,
            display=CLOCK,
            section=section,
            note=f"of {walker}s that arrived",
            on_page=True,
            compute=lambda run: mean(sorted(_travel_times(of(run)))),
        ),
        RunFigure(
            name=f"{prefix}median_travel_time",
            unit="s",
            label=f"{who}median travel time",
            definition="Median of these times.",
            source=_EVENTS,
            better=Better.LOWER,
            display=CLOCK,
            compute=lambda run: _travel_time_percentile(of(run), 50.0),
        ),
        RunFigure(
            name=f"{prefix}p95_travel_time",
            unit="s",
            label=f"{who}95th percentile travel time",
            definition="95th percentile of these times.",
            source=f"{_EVENTS}; FHWA-HOP-06-070",
            better=Better.LOWER,
            display=CLOCK,
            compute=lambda run: _travel_time_percentile(of(run), 95.0),
        ),
        RunFigure(
            name=f"{prefix}mean_speed",
            unit="m/s",
            label=f"{who}mean speed",
            definition=f"Space mean speed: route metres of all {walker}s that arrived over their "
            "seconds.",
            source=f"{_EVENTS}; route length of the lane graph",
            better=Better.HIGHER,
            display=Display("m/s", digits=2) if afoot else KMH,
            section=section if afoot else None,
            note="stops included",
            on_page=not afoot,
            compute=lambda run: _mean_speed(of(run)),
        ),
        RunFigure(
            name=f"{prefix}mean_delay",
            unit="s",
            label=f"{who}mean delay",
            definition=f"Mean of latent delay and time loss, travelling below {desired}, per "
            f"{walker} that was due to depart, until it arrived or the run ended."
            + (" Who was inserted and had not arrived is not in it." if afoot else ""),
            source=f"{_TRIPINFO} timeLoss and departDelay; FHWA-HOP-18-036",
            better=Better.LOWER,
            tolerance="2 % or 0.5 s",
            display=CLOCK,
            section=section,
            note="latent delay included",
            on_page=not afoot,
            compute=lambda run: mean_delay(of(run), run.end),
        ),
        RunFigure(
            name=f"{prefix}mean_waiting_time",
            unit="s",
            label=f"{who}mean stopped delay",
            definition=f"Mean time stopped, below 0.1 m/s, per {walker} that arrived.",
            source=f"{_TRIPINFO} waitingTime",
            better=Better.LOWER,
            tolerance="2 % or 0.5 s",
            display=CLOCK,
            section=section,
            note="mostly at crossings" if afoot else "below 0.1 m/s",
            compute=lambda run: mean([outcome.waiting_time for outcome in _keep_arrived(of(run))]),
        ),
    )


FIGURES = (
    *_make_mode_figures("", "", lambda run: run.vehicles, section=ReportSection.KEY_FIGURES),
    *_make_mode_figures(
        "pedestrian_", "pedestrian ", lambda run: run.pedestrians, section=ReportSection.PEDESTRIANS
    ),
    RunFigure(
        name="mean_stops",
        unit="",
        label="stops per vehicle",
        definition="Mean number of halts per vehicle that arrived.",
        source=f"{_TRIPINFO} waitingCount",
        better=Better.LOWER,
        tolerance="5 % or 0.1",
        display=Display("", digits=1),
        section=ReportSection.KEY_FIGURES,
        note="on average",
        compute=lambda run: mean([outcome.stops for outcome in _keep_arrived(run.vehicles)]),
    ),
)
