"""Routes for sweeps: planned, started, stopped and resumed; their cases, and one as a scenario."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from fastapi import APIRouter
from starlette.responses import FileResponse, Response

from odscen.base.errors import ConflictError, InputError
from odscen.experiments.table import column_units
from odscen.scenario.document.json_form import dumps
from odscen.web.messages import ScenarioState
from odscen.web.routes.scenario_routes import state_of
from odscen.web.services import Services, Shared
from odscen.web.sweeps.sweep_messages import (
    CaseName,
    PlannedSweep,
    ResumeSweep,
    SweepCase,
    SweepCases,
    SweepColumn,
    SweepInfo,
    SweepParameter,
    SweepWish,
)
from odscen.web.wire.media_types import ANY_FILE

if TYPE_CHECKING:
    from odscen.scenario.document.scenario_document import Scenario
    from odscen.web.drafts import Draft

router = APIRouter(prefix="/api/sweeps")

_PAGE = "default-src 'none'; style-src 'unsafe-inline'; script-src 'unsafe-inline'; img-src data:"
"""Content security policy of the page of a sweep: it holds everything that it needs."""
_ABOUT = ("case", "status", "safe", "detail")


@router.get("")
def list_sweeps(shared: Shared, scenario: str | None = None) -> list[SweepInfo]:
    """All sweeps, or those of one scenario, the newest last."""
    return shared.sweeps.rows(scenario)


@router.post("/plan")
def plan(wish: SweepWish, shared: Shared) -> PlannedSweep:
    """What a sweep would take; runs one of its cases, and takes as long as that does."""
    return shared.sweeps.plan(_document_of(shared, wish.scenario), wish)


@router.post("", status_code=202)
def start(wish: SweepWish, shared: Shared) -> SweepInfo:
    """Sweep a scenario as it is now."""
    name = shared.sweeps.start(wish.scenario, _document_of(shared, wish.scenario), wish)
    return shared.sweeps.info(name)


@router.get("/{sweep}")
def show(sweep: str, shared: Shared) -> SweepInfo:
    """How far a sweep is."""
    return shared.sweeps.info(sweep)


@router.post("/{sweep}/stop", status_code=202)
def stop(sweep: str, shared: Shared) -> SweepInfo:
    """Stop a sweep; what has run is kept, and it can be resumed."""
    shared.sweeps.stop(sweep)
    return shared.sweeps.info(sweep)


@router.post("/{sweep}/resume", status_code=202)
def resume(sweep: str, wish: ResumeSweep, shared: Shared) -> SweepInfo:
    """Run what is missing of a sweep; it ends as if it had not been stopped."""
    shared.sweeps.resume(sweep, wish.processes)
    return shared.sweeps.info(sweep)


@router.delete("/{sweep}", status_code=204)
def remove(sweep: str, shared: Shared) -> None:
    """Delete a sweep with all of its runs."""
    shared.sweeps.remove(sweep)


@router.get("/{sweep}/cases")
def cases(sweep: str, shared: Shared) -> SweepCases:
    """The table of a sweep, of those cases that have ended if it has not, and the boundary."""
    found, scenario, settings = shared.sweeps.table(sweep)
    names = [name for name in found.table.columns if name in scenario.parameters]
    columns = [name for name in found.table.columns if name not in {*_ABOUT, *names}]
    units = column_units()
    return SweepCases(
        sweep=sweep,
        limits=["no collision", *settings["safe"]],
        parameters=[
            SweepParameter(name=name, unit=scenario.parameters[name].unit) for name in names
        ],
        columns=[SweepColumn(name=name, unit=units.get(name, "")) for name in columns],
        cases=[_case_info(row, names, columns) for row in found.table.iter_rows(named=True)],
        boundary=list(found.boundary),
    )


@router.post("/{sweep}/cases/{case}/scenario", status_code=201)
def open_case(sweep: str, case: str, wish: CaseName, shared: Shared) -> ScenarioState:
    """Save a case as a scenario; the one that it was saved as before, if that is unchanged."""
    scenario = shared.sweeps.case(sweep, case)
    name = f"{sweep[:48]}-{case}" if wish.name is None else wish.name
    return state_of(shared, _save_scenario(shared, scenario, name, given=wish.name is not None))


@router.get("/{sweep}/files/{name:path}", response_class=Response, responses=ANY_FILE)
def file(sweep: str, name: str, shared: Shared) -> Response:
    """A file of a sweep: its page, the table, a case, the report of a run."""
    path = shared.sweeps.file(sweep, name)
    if path.suffix == ".html":
        headers = {"Content-Security-Policy": _PAGE}
        return FileResponse(path, media_type="text/html", headers=headers)
    return FileResponse(path, filename=f"{sweep}-{path.name}")


def _document_of(shared: Services, name: str) -> Scenario:
    if shared.large is not None and shared.large.is_large(name):
        raise InputError(
            f"scenario {name!r} is too large to be swept here; use the command odscen sweep"
        )
    return shared.drafts.get(name).scenario


def _save_scenario(shared: Services, scenario: Scenario, name: str, *, given: bool) -> Draft:
    label = "Case of a sweep"
    try:
        return shared.drafts.create(scenario, name, stem=name, label=label)
    except ConflictError:
        if given:
            raise
    there = shared.drafts.get(name)
    if dumps(there.scenario) == dumps(scenario):
        return there
    return shared.drafts.create(scenario, None, stem=name, label=label)


def _case_info(row: dict[str, Any], names: list[str], columns: list[str]) -> SweepCase:
    return SweepCase(
        case=row["case"],
        status=row["status"],
        safe=row["safe"],
        detail=row["detail"],
        values=[row[name] for name in names],
        measures=[_finite_number(row[name]) for name in columns],
    )


def _finite_number(value: Any) -> float | None:
    """A number as JSON has it; what is not finite is not known."""
    return None if value is None or not math.isfinite(value) else float(value)
