"""Routes for demand that is more than one edit: tables, and a whole day."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Literal

from fastapi import APIRouter, File, Form, UploadFile

from odscen.app.demand import demands
from odscen.app.demand.traffic_files import put_traffic
from odscen.base.errors import InputError, ScenarioError, in_file
from odscen.formats.office.read_traffic import read_traffic
from odscen.scenario.document.document_parts import Identifier
from odscen.scenario.document.scenario_document import Scenario
from odscen.web.jobs import JobResult
from odscen.web.large.large_documents import LargeDocumentRoute
from odscen.web.large.whole_days import make_day
from odscen.web.messages import EntryPlace, JobStarted, ScenarioState, Version, WholeDay
from odscen.web.routes.scenario_routes import state_of
from odscen.web.services import Shared

if TYPE_CHECKING:
    from odscen.maps.store import ProgressCallback

router = APIRouter(prefix="/api/scenarios/{name}/demand", route_class=LargeDocumentRoute)
days = APIRouter(prefix="/api/scenarios/{name}/demand")

_WORDS = {
    "od": "trips",
    "inputs": "vehicle inputs",
    "counts": "counts",
    "profile": "a day profile",
    "zones": "zones",
}


@router.post("/table")
def table(
    name: str,
    shared: Shared,
    file: Annotated[UploadFile, File(description="Comma, semicolon or tab separated.")],
    version: Annotated[Version, Form()],
    kind: Annotated[Literal["od", "inputs", "counts", "profile", "zones", "office"], Form()],
    part: Annotated[Identifier | None, Form(description="Name of what is read in.")] = None,
    day: Annotated[Identifier | None, Form(description="Day profile of trips.")] = None,
) -> ScenarioState:
    """Read a table into a scenario, all of it or nothing; see ``docs/demand.md``.

    Of the kind ``office`` is whatever :func:`odscen.formats.office.read_traffic.read_traffic`
    reads; see ``docs/office-files.md``.
    """
    content = file.file.read()
    if kind == "office":
        with in_file(file.filename or ""):
            read = read_traffic(content)

        def take(scenario: Scenario) -> Scenario:
            with in_file(file.filename or ""):
                return put_traffic(shared.map_of(scenario), scenario, read, name=part)[0]

        label = f"Import of {read.what}"
        return state_of(shared, shared.drafts.change(name, version, label, take))
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise InputError(
            "this is not a text file in UTF-8; save the table as CSV (UTF-8)", file=file.filename
        ) from error

    def change(scenario: Scenario) -> Scenario:
        loaded = shared.map_of(scenario)
        try:
            return demands.import_text(loaded, scenario, text, kind=kind, name=part, day=day)
        except InputError as error:
            rows_named = isinstance(error, ScenarioError)  # with our columns, values are wrong
            what = None if rows_named else _name_foreign_file(content)
            if what is None:
                raise
            raise InputError(
                f"{error.problem}; this seems to be {what}: choose the contents "
                "'File of another program'",
                file=file.filename,
            ) from error

    label = f"Table of {_WORDS[kind]}"
    return state_of(shared, shared.drafts.change(name, version, label, change))


def _name_foreign_file(content: bytes) -> str | None:
    """What a file is that does not have our own columns; ``None`` if nobody knows."""
    try:
        return read_traffic(content).what
    except InputError:
        return None


@router.get("/entries")
def entries(name: str, shared: Shared) -> list[EntryPlace]:
    """Where vehicles can drive into the region of a scenario."""
    scenario = shared.drafts.get(name).scenario
    graph = shared.map_of(scenario).sumo.graph
    return [
        EntryPlace(
            segment=entry.segment,
            direction=entry.direction,
            lanes=[lane.lane for lane in entry.lanes],
        )
        for entry in demands.find_entries(scenario, graph)
    ]


@days.post("/day", status_code=202)
def day(name: str, wish: WholeDay, shared: Shared) -> JobStarted:
    """Give a scenario 24 hours of traffic on its whole map, in the background.

    It takes seconds, with a trial minutes; the job tells what was found.
    """
    row = shared.drafts.row(name)  # of one that is not there nothing is started

    def work(progress: ProgressCallback) -> JobResult:
        progress("starting", 0.0)
        return make_day(shared, row.name, wish, progress=progress)

    return JobStarted(job=shared.jobs.start(work, subject=f"the demand of scenario {name!r}"))
