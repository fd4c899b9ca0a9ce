"""Whether actors were inserted where and when they were planned."""

from __future__ import annotations

from odscen.figures.measures.figure import (
    CLOCK,
    CM,
    Better,
    ReportSection,
    RunFigure,
    largest,
    mean,
)

FIGURES = (
    RunFigure(
        name="insertion_error_max",
        unit="m",
        label="largest insertion error",
        definition="Largest distance, when an actor appears, between the centre of its body and "
        "its planned place.",
        source="odscen",
        better=Better.LOWER,
        tolerance="5 cm",
        display=CM,
        section=ReportSection.KEY_FIGURES,
        note="from the planned place",
        compute=lambda run: largest([outcome.insertion_error for outcome in run.outcomes]),
    ),
    RunFigure(
        name="insertion_error_mean",
        unit="m",
        label="mean insertion error",
        definition="Mean of these distances.",
        source="odscen",
        better=Better.LOWER,
        tolerance="5 cm",
        display=CM,
        compute=lambda run: mean([outcome.insertion_error for outcome in run.outcomes]),
    ),
    RunFigure(
        name="depart_delay_max",
        unit="s",
        label="longest depart delay",
        definition="Longest time that an actor waited beyond its planned departure until there was "
        "room to insert it.",
        source="SUMO, departDelay",
        better=Better.LOWER,
        tolerance="5 % or 1 s",
        display=CLOCK,
        compute=lambda run: largest([outcome.depart_delay for outcome in run.outcomes]),
    ),
)
