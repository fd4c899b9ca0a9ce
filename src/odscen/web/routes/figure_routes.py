"""What figures a run has, for the page: their words, units and directions."""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal

from fastapi import APIRouter

from odscen.app.figure_functions import installed_figures
from odscen.figures.judging.actor_measures import ACTOR_MEASURES, PAIR_MEASURES, RULE_MEASURES
from odscen.figures.measures.figure import Better, SummaryPart
from odscen.figures.measures.registry import RUN_FIGURES
from odscen.web.messages import Answer

if TYPE_CHECKING:
    from collections.abc import Sequence

    from odscen.figures.judging.actor_measures import Measure

router = APIRouter(prefix="/api/figures")


class FigureDisplay(Answer):
    """How to write a value: times ``factor``, in ``unit``; ``clock``: as minutes and seconds."""

    unit: str
    factor: float
    digits: int
    clock: bool


class FigureInfo(Answer):
    """A figure of a run; ``part`` is where ``summary.json`` has it, "" for at its top."""

    name: str
    part: SummaryPart
    unit: str
    label: str
    definition: str
    source: str
    better: Better
    on_page: bool
    display: FigureDisplay


class ActorMeasureInfo(Answer):
    """What a criterion can ask of one actor, of one and another (``pair``), or of a rule."""

    name: str
    unit: str
    label: str
    definition: str
    about: Literal["actor", "pair", "rule"]


@router.get("/actors")
def actor_measures() -> list[ActorMeasureInfo]:
    """All measures of actors and rules, in the order in which they are offered."""
    groups: tuple[tuple[Literal["actor", "pair", "rule"], Sequence[Measure]], ...] = (
        ("actor", ACTOR_MEASURES),
        ("pair", PAIR_MEASURES),
        ("rule", RULE_MEASURES),
    )
    return [
        ActorMeasureInfo(
            name=measure.name,
            unit=measure.unit,
            label=measure.label,
            definition=measure.definition,
            about=about,
        )
        for about, measures in groups
        for measure in measures
    ]


class InstalledFigureInfo(Answer):
    """A figure of an installed package; ``error`` says why it cannot be used, or is empty."""

    name: str
    definition: str
    error: str


@router.get("/installed")
def installed() -> list[InstalledFigureInfo]:
    """Figures that installed packages offer, for columns of sweeps."""
    return [
        InstalledFigureInfo(**installed_figure._asdict())
        for installed_figure in installed_figures()
    ]


@router.get("")
def figures() -> list[FigureInfo]:
    """All figures of a run, in the order in which they are shown."""
    return [
        FigureInfo(
            name=figure.name,
            part=figure.part,
            unit=figure.unit,
            label=figure.label,
            definition=figure.definition,
            source=figure.source,
            better=figure.better,
            on_page=figure.on_page,
            display=FigureDisplay(
                unit=figure.shown.unit,
                factor=figure.shown.factor,
                digits=figure.shown.digits,
                clock=figure.shown.clock,
            ),
        )
        for figure in RUN_FIGURES
    ]
