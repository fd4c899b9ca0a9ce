"""Latent delay: what road users wait for outside of the network, and the delay of all with it.

The mean over those who have arrived is the shorter the worse traffic is: who is stopped in a jam
or never got onto the road is not in it. So the mean delay is of all who were due to depart, with
what they have waited for and lost until the run ended (FHWA, Traffic Analysis Toolbox Volume III,
FHWA-HOP-18-036: latent or vertical-queue delay is part of the delay of a network).
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from odscen.figures.measures.figure import CLOCK, Better, ReportSection, RunFigure, mean
from odscen.records.outcomes import ActorStatus

if TYPE_CHECKING:
    from collections.abc import Sequence

    from odscen.figures.measures.figure import RunData
    from odscen.figures.measures.summary import ActorOutcome


def due(outcomes: Sequence[ActorOutcome], end: float | None) -> list[ActorOutcome]:
    """Those who were to depart before the run ended at ``end`` s; all if that is not known."""
    return [outcome for outcome in outcomes if end is None or outcome.depart < end]


def served(outcomes: Sequence[ActorOutcome]) -> list[ActorOutcome]:
    """Those for whom the network has a route: who has none waits for no room, and is no delay."""
    return [outcome for outcome in outcomes if outcome.problem is None]


def latent_delay(actor_outcome: ActorOutcome, end: float | None) -> float | None:
    """Seconds from the planned departure to the insertion, or to the end of the run.

    ``None`` for one that was not inserted in a run whose end is not known.
    """
    if actor_outcome.status is not ActorStatus.WAITING:
        return max(actor_outcome.depart_delay or 0.0, 0.0)
    return None if end is None else max(end - actor_outcome.depart, 0.0)


def total_delay(actor_outcome: ActorOutcome, end: float | None) -> float | None:
    """Seconds of latent delay and time loss; ``None`` if either is not known."""
    latent = latent_delay(actor_outcome, end)
    if latent is None or actor_outcome.status is ActorStatus.WAITING:
        return latent
    return None if actor_outcome.time_loss is None else latent + actor_outcome.time_loss


def mean_delay(outcomes: Sequence[ActorOutcome], end: float | None) -> float | None:
    """Mean over all who were due; ``None`` where time loss was not measured of any who departed."""
    expected = served(due(outcomes, end))
    departed = [outcome for outcome in expected if outcome.status is not ActorStatus.WAITING]
    if departed and all(outcome.time_loss is None for outcome in departed):
        return None
    return mean([total_delay(outcome, end) for outcome in expected])


def _mean_latent(run: RunData) -> float | None:
    return mean([latent_delay(outcome, run.end) for outcome in served(due(run.vehicles, run.end))])


FIGURES = (
    RunFigure(
        name="mean_latent_delay",
        unit="s",
        label="mean latent delay",
        definition="Mean time from planned departure to insertion, or to the end of the run, per "
        "vehicle that was due to depart.",
        source="SUMO, departDelay; FHWA-HOP-18-036",
        better=Better.LOWER,
        tolerance="5 % or 0.5 s",
        display=CLOCK,
        section=ReportSection.KEY_FIGURES,
        note="waited to enter",
        on_page=True,
        compute=_mean_latent,
    ),
)
