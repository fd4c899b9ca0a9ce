"""Routes for studies: begun, stopped and resumed; their figures, table and page."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from fastapi import APIRouter
from starlette.responses import FileResponse, Response

from odscen.experiments.study_page import (
    SHOWN_FIGURES,
    figures_had,
    scenario_differences,
    study_groups,
)
from odscen.figures.measures.registry import run_figure
from odscen.web.services import Shared
from odscen.web.studies.study_messages import (
    FigureGroup,
    ResumeStudy,
    StudyFigure,
    StudyInfo,
    StudyResults,
    StudyWish,
)
from odscen.web.wire.media_types import ANY_FILE

if TYPE_CHECKING:
    from collections.abc import Sequence

    from odscen.experiments.study_page import StudyGroup

router = APIRouter(prefix="/api/studies")

_PAGE = "default-src 'none'; style-src 'unsafe-inline'; script-src 'unsafe-inline'"
"""Content security policy of the page of a study: it holds everything that it needs."""


@router.get("")
def list_studies(shared: Shared) -> list[StudyInfo]:
    """All studies, the newest last."""
    return shared.studies.rows()


@router.post("", status_code=202)
def start(wish: StudyWish, shared: Shared) -> StudyInfo:
    """Begin a study of scenarios as they are now, and carry it out."""
    return shared.studies.info(shared.studies.start(wish))


@router.get("/{study}")
def show(study: str, shared: Shared) -> StudyInfo:
    """How far a study is."""
    return shared.studies.info(study)


@router.post("/{study}/stop", status_code=202)
def stop(study: str, shared: Shared) -> StudyInfo:
    """Stop a study; what has run is kept, and it can be resumed."""
    shared.studies.stop(study)
    return shared.studies.info(study)


@router.post("/{study}/resume", status_code=202)
def resume(study: str, wish: ResumeStudy, shared: Shared) -> StudyInfo:
    """Run what is missing of a study; it ends as if it had not been stopped."""
    shared.studies.resume(study, wish)
    return shared.studies.info(study)


@router.delete("/{study}", status_code=204)
def remove(study: str, shared: Shared) -> None:
    """Delete a study."""
    shared.studies.remove(study)


@router.get("/{study}/results")
def results(study: str, shared: Shared, figure: str | None = None) -> StudyResults:
    """One figure of a study: means with their intervals, differences, and the runs' own values."""
    folder = shared.studies.folder(study)
    names = figures_had(folder)
    shown = figure or next((figure for figure in SHOWN_FIGURES if figure in names), names[0])
    groups, differences = study_groups(folder, [shown])
    return StudyResults(
        figures=[_figure_info(name) for name in names],
        figure=shown,
        groups=_figure_groups(groups, shown),
        differences=_figure_groups(differences, shown),
        between=_figure_groups(scenario_differences(folder, [shown]), shown),
    )


@router.get("/{study}/files/{name}", response_class=Response, responses=ANY_FILE)
def file(study: str, name: str, shared: Shared) -> Response:
    """A file of a study: its table, or its page as of now."""
    path = shared.studies.file(study, name)
    if path.suffix == ".html":
        headers = {"Content-Security-Policy": _PAGE}
        return FileResponse(path, media_type="text/html", headers=headers)
    return FileResponse(path, filename=f"{study}-{path.name}")


def _figure_info(name: str) -> StudyFigure:
    entry = run_figure(name)
    if entry is None:
        return StudyFigure(name=name, label=name, unit="")
    return StudyFigure(name=name, label=entry.label, unit=entry.unit, better=entry.better)


def _figure_groups(groups: Sequence[StudyGroup], figure: str) -> list[FigureGroup]:
    return [
        FigureGroup(
            scenario=group.scenario,
            variant=group.variant,
            runs=group.runs,
            mean=_finite_number(group.figures[figure].mean),
            half_width=_finite_number(group.figures[figure].half_width),
            values=[value for value in group.values[figure] if math.isfinite(value)],
        )
        for group in groups
    ]


def _finite_number(value: float | None) -> float | None:
    return None if value is None or not math.isfinite(value) else value
