"""What figures a run has, for the page: their words, units and directions."""

from __future__ import annotations

from fastapi import APIRouter

from odscen.results.measures.figure import Better, SummaryPart
from odscen.results.measures.registry import RUN_FIGURES
from odscen.web.messages import Answer

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
