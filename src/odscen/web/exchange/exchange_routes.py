"""Routes for scenarios that come from other formats, or go to them."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Annotated, Literal

from fastapi import APIRouter, File, Form, UploadFile
from starlette.responses import Response

from odscen.app.exchange.sent_scenarios import SentFile, read_sent_scenario
from odscen.app.exchange.zipped_exports import exported, exported_run
from odscen.base.errors import NotFoundError
from odscen.web.exchange.exchange_messages import ExportInfo, ImportInfo
from odscen.web.jobs import JobResult
from odscen.web.large.large_documents import LargeDocumentRoute
from odscen.web.messages import JobStarted
from odscen.web.services import Services, Shared
from odscen.web.wire.media_types import answers

if TYPE_CHECKING:
    from odscen.app.exchange.zipped_exports import ExportedFiles
    from odscen.maps.store import ProgressCallback

router = APIRouter(prefix="/api")
exports = APIRouter(prefix="/api/scenarios", route_class=LargeDocumentRoute)

_REPORT, _PLAN = "import.json", "import.sweep.json"
"""Files beside the history of a scenario."""


@router.post("/imports/openscenario", status_code=202)
def import_openscenario(
    shared: Shared,
    files: Annotated[
        list[UploadFile],
        File(description="A scenario (.xosc), and if need be its map (.xodr) and catalogs."),
    ],
    ego: Annotated[Literal["story", "sumo"], Form()] = "story",
) -> JobStarted:
    """Make a scenario of an OpenSCENARIO file, in the background; the result is its name."""
    sent = [SentFile(one.filename or "file", one.file.read()) for one in files]

    def work(progress: ProgressCallback) -> JobResult:
        progress("starting", 0.0)
        read = read_sent_scenario(shared.workspace, sent, ego=ego, progress=progress)
        draft = shared.drafts.create(read.scenario, None, stem=read.stem, label="Import")
        about = {"file": read.file, "added": read.added, "lists": json.loads(read.report)}
        shared.drafts.keep(draft.name, _REPORT, json.dumps(about))
        if read.plan is not None:
            shared.drafts.keep(draft.name, _PLAN, read.plan)
        return JobResult(draft.name)

    subject = f"the import of {', '.join(sorted(one.name for one in sent))}"
    return JobStarted(job=shared.jobs.start(work, subject=subject))


@router.get("/scenarios/{name}/import")
def import_report(name: str, shared: Shared) -> ImportInfo:
    """What became of each element of the file that a scenario was imported from."""
    row = shared.drafts.row(name)
    about = json.loads(_kept(shared, name, _REPORT))
    return ImportInfo(
        scenario=name,
        file=about["file"],
        map=row.map or "",
        added=about["added"],
        sweep=shared.drafts.kept(name, _PLAN) is not None,
        **about["lists"],
    )


@router.get(
    "/scenarios/{name}/import/plan", response_class=Response, responses=answers("application/json")
)
def import_plan(name: str, shared: Shared) -> Response:
    """Plan of the sweep that the imported file describes, for ``odscen sweep --plan``."""
    headers = {"Content-Disposition": f'attachment; filename="{name}.sweep.json"'}
    content = _kept(shared, name, _PLAN)
    return Response(content, media_type="application/json", headers=headers)


@router.get("/runs/{run}/export", response_class=Response, responses=answers("application/zip"))
def export_run(run: str, shared: Shared, to: str, version: str | None = None) -> Response:
    """Download what happened in a finished run in another format, with the map."""
    options = {} if version is None else {"version": version}
    made = exported_run(shared.workspace, shared.runs.kept.whole(run), to=to, options=options)
    file = f"{run}-as-run.{to}{'' if version is None else f'-{version}'}.zip"
    headers = {"Content-Disposition": f'attachment; filename="{file}"'}
    return Response(made.zipped(), media_type="application/zip", headers=headers)


@exports.get("/{name}/export/notes")
def export_notes(name: str, shared: Shared, to: str, version: str | None = None) -> ExportInfo:
    """What an export would hold, and what its format cannot say; refused if it cannot be made."""
    made = _exported(shared, name, to, version)
    said = made.notes() or {"approximated": [], "left_out": []}
    return ExportInfo(files=list(made.names), **said)


@exports.get("/{name}/export", response_class=Response, responses=answers("application/zip"))
def export_scenario(name: str, shared: Shared, to: str, version: str | None = None) -> Response:
    """Download a scenario in another format, as a ZIP with all that it needs."""
    content = _exported(shared, name, to, version).zipped()
    file = f"{name}.{to}{'' if version is None else f'-{version}'}.zip"
    headers = {"Content-Disposition": f'attachment; filename="{file}"'}
    return Response(content, media_type="application/zip", headers=headers)


def _exported(shared: Services, name: str, to: str, version: str | None) -> ExportedFiles:
    scenario = shared.drafts.get(name).scenario
    options = {} if version is None else {"version": version}
    return exported(shared.workspace, scenario, name=name, to=to, options=options)


def _kept(shared: Services, name: str, file: str) -> str:
    found = shared.drafts.kept(name, file)
    if found is None:
        what = "import report of scenario" if file == _REPORT else "plan of a sweep of scenario"
        raise NotFoundError(what, name, [])
    return found
