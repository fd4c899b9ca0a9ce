"""How long a run was, and how many actors had each outcome.

``planned`` = ``inserted`` + ``waiting``, ``inserted`` = ``arrived`` + ``running`` +
``stranded``. They count actors, not events.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from odscen.figures.measures.figure import (
    CLOCK,
    COUNT,
    Better,
    ReportSection,
    RunFigure,
    SummaryPart,
)
from odscen.records.outcomes import ActorStatus

if TYPE_CHECKING:
    from odscen.figures.measures.figure import RunData


def _with_status(run: RunData, *statuses: ActorStatus) -> int:
    return sum(outcome.status in statuses for outcome in run.outcomes)


FIGURES = (
    RunFigure(
        name="sim_seconds",
        unit="s",
        label="simulated time",
        definition="Simulated seconds until the run ended.",
        source="SUMO",
        display=CLOCK,
        part=SummaryPart.RUN,
        on_page=True,
        compute=lambda run: run.end,
    ),
    RunFigure(
        name="planned",
        unit="",
        label="road users planned",
        definition="Vehicles and pedestrians that the run was to insert.",
        source="the scenario",
        tolerance="0",
        display=COUNT,
        part=SummaryPart.ACTORS,
        section=ReportSection.KEY_FIGURES,
        on_page=True,
        compute=lambda run: len(run.outcomes),
    ),
    RunFigure(
        name="inserted",
        unit="",
        label="inserted",
        definition="Actors that SUMO could place on the road: arrived, running or stranded.",
        source="SUMO, departed",
        better=Better.HIGHER,
        tolerance="0",
        display=COUNT,
        part=SummaryPart.ACTORS,
        section=ReportSection.KEY_FIGURES,
        compute=lambda run: _with_status(
            run, ActorStatus.ARRIVED, ActorStatus.RUNNING, ActorStatus.STRANDED
        ),
    ),
    RunFigure(
        name="arrived",
        unit="",
        label="arrived",
        definition="Actors that have reached their goal.",
        source="SUMO, arrived",
        better=Better.HIGHER,
        tolerance="0",
        display=COUNT,
        part=SummaryPart.ACTORS,
        section=ReportSection.KEY_FIGURES,
        on_page=True,
        compute=lambda run: _with_status(run, ActorStatus.ARRIVED),
    ),
    RunFigure(
        name="running",
        unit="",
        label="still under way at the end",
        definition="Actors that were inserted and had not arrived when the run ended.",
        source="SUMO",
        tolerance="0",
        display=COUNT,
        part=SummaryPart.ACTORS,
        on_page=True,
        compute=lambda run: _with_status(run, ActorStatus.RUNNING),
    ),
    RunFigure(
        name="waiting",
        unit="",
        label="not inserted",
        definition="Actors that were planned, but not inserted when the run ended.",
        source="SUMO, insertion backlog",
        better=Better.LOWER,
        tolerance="0",
        display=COUNT,
        part=SummaryPart.ACTORS,
        on_page=True,
        compute=lambda run: _with_status(run, ActorStatus.WAITING),
    ),
    RunFigure(
        name="stranded",
        unit="",
        label="blocked by closure",
        definition="Actors taken out because a measure had closed every route to their goal.",
        source="odscen, measures",
        better=Better.LOWER,
        tolerance="0",
        display=COUNT,
        part=SummaryPart.ACTORS,
        on_page=True,
        compute=lambda run: _with_status(run, ActorStatus.STRANDED),
    ),
    RunFigure(
        name="teleported",
        unit="",
        label="teleported",
        definition="Actors that SUMO removed after they had waited too long, and put back further "
        "on; at least once.",
        source="SUMO, teleports",
        better=Better.LOWER,
        tolerance="0",
        display=COUNT,
        part=SummaryPart.ACTORS,
        section=ReportSection.KEY_FIGURES,
        alarming=True,
        on_page=True,
        compute=lambda run: sum(outcome.teleports > 0 for outcome in run.outcomes),
    ),
    RunFigure(
        name="collided",
        unit="",
        label="in collisions",
        definition="Actors whose body has overlapped with another one, at least once.",
        source="SUMO, collisions",
        better=Better.LOWER,
        tolerance="0",
        display=COUNT,
        part=SummaryPart.ACTORS,
        section=ReportSection.KEY_FIGURES,
        alarming=True,
        on_page=True,
        compute=lambda run: sum(outcome.collisions > 0 for outcome in run.outcomes),
    ),
    RunFigure(
        name="emergency_stopped",
        unit="",
        label="emergency stops",
        definition="Vehicles that SUMO has stopped harder than their brakes can, at least once.",
        source="SUMO, emergency stops",
        better=Better.LOWER,
        tolerance="0",
        display=COUNT,
        part=SummaryPart.ACTORS,
        on_page=True,
        compute=lambda run: sum(outcome.emergency_stops > 0 for outcome in run.outcomes),
    ),
)
