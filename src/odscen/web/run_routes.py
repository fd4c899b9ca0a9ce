"""Routes for runs, and the live view."""

from __future__ import annotations

import json
from typing import Annotated, Any

import orjson
from fastapi import APIRouter, Query
from starlette.requests import Request
from starlette.responses import FileResponse, Response
from starlette.websockets import WebSocket

from odscen.errors import InputError, NotFoundError
from odscen.results.records import Plan
from odscen.results.replay import replay_columns
from odscen.sumo import layout
from odscen.sumo.recorded import read_trajectories
from odscen.web.live import LiveView
from odscen.web.messages import Control, NewRun, RunInfo, RunStarted
from odscen.web.packed import answer, pack
from odscen.web.services import Shared

REPLAY_ROWS = 4_000_000
"""Rows that a page gets at most; of a longer run it gets every second, third, ... record."""

router = APIRouter(prefix="/api/runs")

_REPORT = "default-src 'none'; style-src 'unsafe-inline'; script-src 'unsafe-inline'; img-src data:"
"""Content security policy of a report: it holds everything that it needs."""


@router.get("")
def list_runs(shared: Shared) -> list[RunInfo]:
    """All runs, the newest last."""
    return shared.runs.rows()


@router.post("", status_code=202)
def start(wish: NewRun, shared: Shared) -> RunStarted:
    """Run a scenario as it is now."""
    draft = shared.drafts.get(wish.scenario)
    return RunStarted(run=shared.runs.start(draft.name, draft.scenario, wish))


@router.get("/{run}")
def show(run: str, shared: Shared) -> RunInfo:
    """One run, with its summary once it has ended."""
    return shared.runs.info(run)


@router.delete("/{run}", status_code=204)
def remove(run: str, shared: Shared) -> None:
    """Remove a finished run."""
    shared.runs.remove(run)


@router.post("/{run}/control")
def control(run: str, wish: Control, shared: Shared) -> RunInfo:
    """Pause, resume, step, change the speed of, or stop a run."""
    return shared.runs.control(run, wish)


@router.get("/{run}/report.html", response_class=Response)
def report(run: str, shared: Shared) -> Response:
    """Report of a completed run."""
    path = shared.runs.folder(run) / layout.REPORT_FILE
    if not path.is_file():
        what = "report of run"
        raise NotFoundError(what, run, [])
    headers = {"Content-Security-Policy": _REPORT}
    return FileResponse(path, media_type="text/html", headers=headers)


@router.get("/{run}/summary")
def summary(run: str, shared: Shared) -> dict[str, Any]:
    """Key figures of a finished run: its ``summary.json``."""
    path = shared.runs.folder(run) / layout.SUMMARY_FILE
    if not path.is_file():
        what = "summary of run"
        raise NotFoundError(what, run, [])
    found: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
    return found


@router.get("/{run}/trajectories")
def trajectories(
    run: str,
    request: Request,
    shared: Shared,
    every: Annotated[int, Query(ge=1, le=10_000)] = 1,
) -> Any:
    """Where everybody was, as columns; see ``docs/server.md``."""
    folder = shared.runs.folder(run)
    recorded = read_trajectories(folder, most=REPLAY_ROWS)
    if recorded is None:
        what = "trajectories of run"
        raise NotFoundError(what, run, [])
    plan = Plan.from_json((folder / layout.PLAN_FILE).read_text(encoding="utf-8"))
    columns = replay_columns(recorded.rows, plan, every=max(1, every // recorded.every))
    columns["actors"] = [
        {"id": a.id, "category": a.category, "length": a.length, "width": a.width, "ego": a.ego}
        for a in plan.actors
    ]
    return answer(request, pack(orjson.dumps(columns, option=orjson.OPT_SERIALIZE_NUMPY)))


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
