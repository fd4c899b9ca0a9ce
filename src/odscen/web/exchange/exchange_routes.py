"""Routes for scenarios that come from other formats, or go to them."""

from __future__ import annotations

import json
import re
from collections.abc import Sequence
from typing import TYPE_CHECKING, Annotated, Literal

from fastapi import APIRouter, File, Form, Query, UploadFile
from starlette.responses import Response

from odscen.app.exchange.exports import export_to_memory
from odscen.app.exchange.sent_files import SentFile, read_sent_scenario
from odscen.base.errors import InputError, NotFoundError
from odscen.formats import list_formats
from odscen.formats.base import Subject
from odscen.web.jobs import JobResult
from odscen.web.large.large_documents import LargeDocumentRoute
from odscen.web.messages import Answer, JobStarted
from odscen.web.services import Services, Shared
from odscen.web.wire.media_types import answers

if TYPE_CHECKING:
    from collections.abc import Mapping

    from odscen.app.exchange.exports import ExportedFiles
    from odscen.maps.store import ProgressCallback


class ImportRow(Answer):
    """An element of a file, and why it is in its list.

    ``x`` and ``y`` are metres in the OpenDRIVE frame: the place on the map that it is about, if
    that is known.
    """

    file: str
    xpath: str
    line: int
    reason: str
    x: float | None
    y: float | None


class ImportInfo(Answer):
    """What became of each element of the file that a scenario was imported from.

    ``added`` says whether its map came with it; ``sweep`` whether there is a plan of a sweep.
    """

    scenario: str
    file: str
    map: str
    added: bool
    sweep: bool
    refused: list[ImportRow]
    approximated: list[ImportRow]
    ignored: list[ImportRow]
    taken: list[ImportRow]


class ExportNote(Answer):
    """A part of a scenario, and what becomes of it."""

    place: str
    reason: str


class ExportInfo(Answer):
    """Files of an export, and what its format says in part only, or not at all."""

    files: list[str]
    approximated: list[ExportNote]
    left_out: list[ExportNote]


class FormatOptionInfo(Answer):
    """Something that a format lets one choose; ``values`` are all there are, if they are listed."""

    name: str
    label: str
    values: list[str]
    default: str


class FormatInfo(Answer):
    """A foreign format: what its files are of, whether it is read and written, and how."""

    id: str
    title: str
    description: str
    of: list[Subject]
    suffixes: list[str]
    reads: bool
    writes: bool
    options: list[FormatOptionInfo]


router = APIRouter(prefix="/api")
exports = APIRouter(prefix="/api/scenarios", route_class=LargeDocumentRoute)

IMPORT_REPORT, _PLAN = "import.json", "import.sweep.json"
"""Files beside the history of a scenario."""


@router.get("/formats")
def formats() -> list[FormatInfo]:
    """All foreign formats, those of installed packages included."""
    return [
        FormatInfo(
            id=form.id,
            title=form.title,
            description=form.description or form.label,
            of=list(form.of),
            suffixes=list(form.suffixes),
            reads=form.read is not None,
            writes=form.write is not None,
            options=[
                FormatOptionInfo(
                    name=option.name,
                    label=option.label,
                    values=list(option.values),
                    default=option.default,
                )
                for option in form.options
            ],
        )
        for form in list_formats().values()
    ]


@router.post("/imports/{of}", status_code=202)
def import_files(
    of: str,
    shared: Shared,
    files: Annotated[
        list[UploadFile],
        File(description="A scenario, and if need be its map (.xodr) and catalogs."),
    ],
    ego: Annotated[Literal["story", "sumo"] | None, Form()] = None,
    option: Annotated[Sequence[str], Form(description="NAME=VALUE")] = (),
) -> JobStarted:
    """Make a scenario of a file of a foreign format, in the background; the result is its name."""
    options = _parse_options(option, ego=ego)
    sent = [SentFile(file.filename or "file", file.file.read()) for file in files]

    def work(progress: ProgressCallback) -> JobResult:
        progress("starting", 0.0)
        read = read_sent_scenario(shared.workspace, sent, of=of, options=options, progress=progress)
        draft = shared.drafts.create(read.scenario, None, stem=read.stem, label="Import")
        about = {"file": read.file, "added": read.added, "lists": json.loads(read.report)}
        shared.drafts.keep(draft.name, IMPORT_REPORT, json.dumps(about))
        if read.plan is not None:
            shared.drafts.keep(draft.name, _PLAN, read.plan)
        return JobResult(draft.name)

    subject = f"the import of {', '.join(sorted(sent_file.name for sent_file in sent))}"
    return JobStarted(job=shared.jobs.start(work, subject=subject))


@router.get("/scenarios/{name}/import")
def import_report(name: str, shared: Shared) -> ImportInfo:
    """What became of each element of the file that a scenario was imported from."""
    row = shared.drafts.row(name)
    about = json.loads(_read_kept(shared, name, IMPORT_REPORT))
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
    content = _read_kept(shared, name, _PLAN)
    return Response(content, media_type="application/json", headers=headers)


_PAGE = ".html"
Options = Annotated[Sequence[str], Query(alias="option", description="NAME=VALUE")]


@router.get(
    "/runs/{run}/export",
    response_class=Response,
    responses=answers("application/zip", "text/html"),
)
def export_run(
    run: str, shared: Shared, to: str, version: str | None = None, option: Options = ()
) -> Response:
    """Download what happened in a finished run: a ZIP with the map, or one page of HTML."""
    options = _parse_options(option, version=version)
    folder = shared.runs.kept.whole(run)
    files = export_to_memory(shared.workspace, folder, to=to, options=options)
    return _make_download(
        files, f"{run}.{to}" if to == _PAGE[1:] else f"{run}-as-run.{to}", options
    )


@exports.get("/{name}/export/notes")
def export_notes(
    name: str, shared: Shared, to: str, version: str | None = None, option: Options = ()
) -> ExportInfo:
    """What an export would hold, and what its format cannot say; refused if it cannot be made."""
    files = _export_scenario(shared, name, to, _parse_options(option, version=version))
    notes = files.notes() or {"approximated": [], "left_out": []}
    return ExportInfo(files=list(files.contents), **notes)


@exports.get("/{name}/export", response_class=Response, responses=answers("application/zip"))
def export_scenario(
    name: str, shared: Shared, to: str, version: str | None = None, option: Options = ()
) -> Response:
    """Download a scenario in another format, as a ZIP with all that it needs."""
    options = _parse_options(option, version=version)
    return _make_download(_export_scenario(shared, name, to, options), f"{name}.{to}", options)


def _parse_options(settings: Sequence[str], **others: str | None) -> dict[str, str]:
    """Options by name, of ``NAME=VALUE`` and of those that have a parameter of their own."""
    options = {name: value for name, value in others.items() if value is not None}
    for setting in settings:
        name, equals, value = setting.partition("=")
        if not equals:
            raise InputError(f"{setting!r} is not NAME=VALUE")
        options[name] = value
    return options


def _export_scenario(
    shared: Services, name: str, to: str, options: Mapping[str, str]
) -> ExportedFiles:
    scenario = shared.drafts.get(name).scenario
    return export_to_memory(shared.workspace, scenario, name=name, to=to, options=options)


def _make_download(files: ExportedFiles, name: str, options: Mapping[str, str]) -> Response:
    file = "-".join([name, *options.values()])
    plain = re.sub(r"[^A-Za-z0-9_.-]+", "-", file)
    content, kind, suffix = files.zipped(), "application/zip", ".zip"
    if len(files.contents) == 1 and plain.endswith(_PAGE):  # a page is opened as it is
        ((_, content),) = files.contents.items()
        kind, suffix = "text/html", ""
    headers = {"Content-Disposition": f'attachment; filename="{plain}{suffix}"'}
    return Response(content, media_type=kind, headers=headers)


def _read_kept(shared: Services, name: str, file: str) -> str:
    found = shared.drafts.kept(name, file)
    if found is None:
        what = (
            "import report of scenario" if file == IMPORT_REPORT else "plan of a sweep of scenario"
        )
        raise NotFoundError(what, name, [])
    return found
