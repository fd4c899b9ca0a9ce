"""Routes for runs, and the live view."""

from __future__ import annotations

import math
from contextlib import contextmanager
from typing import TYPE_CHECKING, Annotated

import orjson
from fastapi import APIRouter, Query
from starlette.requests import Request
from starlette.responses import FileResponse, Response
from starlette.websockets import WebSocket

from odscen.base.errors import InputError, NotFoundError, in_file
from odscen.base.stored_files import tables
from odscen.figures.measures.curves import SpeedShares, run_curves
from odscen.figures.measures.summary import actors_from_json
from odscen.records.replay import replay_columns
from odscen.records.run_events import EventKind, event_row, events_from_json
from odscen.records.run_plan import Plan
from odscen.records.traces import ActorCounts, SpeedCurve
from odscen.runs import layout
from odscen.runs.recorded import read_trajectories
from odscen.web.large.large_documents import LargeForecastRoute
from odscen.web.live_view import LiveView
from odscen.web.packed import UNCHANGED, answer, pack
from odscen.web.services import Shared
from odscen.web.wire.media_types import HTML
from odscen.web.wire.run_messages import (
    EgoOutcome,
    GoOn,
    IncidentInfo,
    NewRun,
    ReplayActor,
    ReplayColumns,
    RunContent,
    RunControl,
    RunCurve,
    RunCurves,
    RunEgos,
    RunEvents,
    RunForecast,
    RunInfo,
    RunShares,
    RunSpeeds,
    RunStarted,
)
from odscen.web.wire.summary_messages import RunSummary

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from odscen.runs.recorded import Recorded

REPLAY_ROWS = 4_000_000
"""Rows that are read at most; of a longer run every second, third, ... record is left out."""

router = APIRouter(prefix="/api/runs")
forecasts = APIRouter(route_class=LargeForecastRoute)

MOST_EVENTS = 5_000
"""Incidents that are reported of a finished run; no one reads more."""

_REPORT = "default-src 'none'; style-src 'unsafe-inline'; script-src 'unsafe-inline'; img-src data:"
"""Content security policy of a report: it holds everything that it needs."""


@router.get("")
def list_runs(shared: Shared, scenario: str | None = None) -> list[RunInfo]:
    """All runs, or those of one scenario, the newest last."""
    return shared.runs.rows(scenario=scenario)


@router.post("", status_code=202)
def start(wish: NewRun, shared: Shared) -> RunStarted:
    """Run a scenario as it is now."""
    alone = not wish.carla and wish.simulator is None
    if alone and shared.large is not None and shared.large.is_large(wish.scenario):
        return RunStarted(run=shared.runs.start_large(wish.scenario, wish))
    draft = shared.drafts.get(wish.scenario)
    return RunStarted(run=shared.runs.start(draft.name, draft.scenario, wish))


@forecasts.post("/forecast")
def forecast(wish: NewRun, shared: Shared) -> RunForecast:
    """What a run would need; takes as long as getting it ready."""
    return shared.runs.forecast(shared.drafts.get(wish.scenario).scenario, wish)


router.include_router(forecasts)


@router.post("/{run}/resume", status_code=202)
def resume(run: str, wish: GoOn, shared: Shared) -> RunStarted:
    """Go on with an interrupted run from its last complete slice."""
    shared.runs.resume(run, wish)
    return RunStarted(run=run)


@router.get("/{run}")
def show(run: str, shared: Shared) -> RunInfo:
    """One run, with its summary once it has ended."""
    shared.runs.kept.complete(run)
    return shared.runs.info(run)


@router.post("/{run}/control")
def control(run: str, wish: RunControl, shared: Shared) -> RunInfo:
    """Pause, resume, step, change the speed of, or stop a run."""
    return shared.runs.control(run, wish)


@router.get("/{run}/report.html", response_class=Response, responses=HTML)
def report(run: str, shared: Shared) -> Response:
    """Report of a completed run, which is written if it is not there."""
    kept = shared.runs.kept
    info = kept.info(run)
    if (
        info.state in ("completed", "stopped")
        and not (kept.whole(run) / layout.REPORT_FILE).exists()
    ):
        from odscen.app.running.reports import renew_report

        renew_report(shared.workspace, kept.folder(run))
    return page_of_run(shared, run, layout.REPORT_FILE)


def page_of_run(shared: Shared, run: str, name: str) -> Response:
    """Answer with a page of a finished run that holds everything that it needs."""
    headers = {"Content-Security-Policy": _REPORT}
    return FileResponse(_finished_file(shared, run, name), media_type="text/html", headers=headers)


@router.get("/{run}/summary")
def summary(run: str, shared: Shared) -> RunSummary:
    """Key figures of a finished run: its ``summary.json``."""
    _finished_file(shared, run, layout.SUMMARY_FILE)
    summary = shared.runs.kept.summary(run)
    if summary is None:
        raise NotFoundError("summary of run", run, [])
    return summary


@router.get("/{run}/content")
def content(run: str, shared: Shared) -> RunContent:
    """Whether two runs are of the same scenario can be told from this."""
    return shared.runs.kept.content(run)


@router.get("/{run}/events")
def events(run: str, shared: Shared) -> RunEvents:
    """What went wrong on the road in a finished run: the first thousands of incidents."""
    path = _finished_file(shared, run, layout.EVENTS_FILE)
    with _name_run_in_errors(path.parent):
        found = [
            event_row(event)
            for event in events_from_json(_read_text(path))
            if event.kind not in (EventKind.DEPARTED, EventKind.ARRIVED)
        ]
        rows = [IncidentInfo(**row) for row in found[:MOST_EVENTS]]
    return RunEvents(events=rows, left_off=max(0, len(found) - MOST_EVENTS))


@router.get("/{run}/egos")
def egos(run: str, shared: Shared) -> RunEgos:
    """What became of the vehicles under test of a finished run."""
    path = _finished_file(shared, run, layout.ACTORS_FILE)
    with _name_run_in_errors(path.parent):
        egos = [ego for ego in actors_from_json(_read_text(path)) if ego.ego]
    names = EgoOutcome.model_fields
    return RunEgos(egos=[EgoOutcome(**{n: getattr(ego, n) for n in names}) for ego in egos])


@router.get("/{run}/curves")
def curves(run: str, shared: Shared) -> RunCurves:
    """How many were where, and how fast, over time."""
    plan, recorded = _read_recorded(shared, run)
    path, end = (
        _finished_file(shared, run, layout.ACTORS_FILE),
        summary(run, shared).sim_seconds or 0.0,
    )
    with _name_run_in_errors(path.parent):
        actors = actors_from_json(_read_text(path))
        table = run_curves(plan, actors, recorded.rows, end=end)
    return RunCurves(
        counts=RunCurve(**_column_lists(table.counts)),
        speeds=RunSpeeds(**_column_lists(table.speeds)),
        shares=RunShares(**_column_lists(table.shares)),
    )


@router.get("/{run}/trajectories", response_model=ReplayColumns, responses=UNCHANGED)
def trajectories(
    run: str,
    request: Request,
    shared: Shared,
    every: Annotated[int, Query(ge=1, le=10_000)] = 1,
    most: Annotated[
        int | None, Query(ge=1, description="Rows at most; fewer steps if need be.")
    ] = None,
) -> Response:
    """Where road users were, as columns; see ``docs/server.md``."""
    plan, recorded = _read_recorded(shared, run)
    table, read = recorded.rows, recorded.every
    if most is not None:
        every = max(every, math.ceil(table.height * read / most))
    with _name_run_in_errors(shared.runs.kept.folder(run)):
        columns = replay_columns(
            table, plan, every=max(1, every // read), by_centres=recorded.by_centres
        )
    names = tuple(ReplayActor.model_fields)
    columns["actors"] = [{name: getattr(actor, name) for name in names} for actor in plan.actors]
    return answer(request, pack(orjson.dumps(columns, option=orjson.OPT_SERIALIZE_NUMPY)))


def _finished_file(shared: Shared, run: str, name: str) -> Path:
    return shared.runs.kept.finished_file(run, name)


def _read_text(path: Path) -> str:
    return path.read_text(encoding="utf-8", errors="replace")


@contextmanager
def _name_run_in_errors(run: Path) -> Iterator[None]:
    """Say of which run a file is that cannot be read, or does not fit the others."""
    with in_file(str(run)), tables(str(run)):
        yield


def _read_recorded(shared: Shared, run: str) -> tuple[Plan, Recorded]:
    """The plan of a run, and its trajectories."""
    path = _finished_file(shared, run, layout.PLAN_FILE)
    with _name_run_in_errors(path.parent):
        plan = Plan.from_json(_read_text(path))
    recorded = read_trajectories(path.parent, most=REPLAY_ROWS)
    if recorded is None:
        raise NotFoundError("trajectories of run", run, [])
    return plan, recorded


def _column_lists(columns: ActorCounts | SpeedCurve | SpeedShares) -> dict[str, list[float | None]]:
    """Columns to four digits, as JSON has them: no number is null."""
    return {
        name: [None if math.isnan(v) else round(v, 4) for v in column.tolist()]
        for name, column in columns._asdict().items()
    }


@router.websocket("/{run}/live")
async def live(run: str, socket: WebSocket, shared: Shared) -> None:
    """Live view of a run that goes on; see ``docs/server.md``."""
    try:
        active = shared.runs.active(run)
    except InputError as error:
        await socket.close(1008, str(error)[:120])
        return
    await socket.accept()
    await LiveView(socket, active).show()
