"""Routes for recorded traffic: kept, placed on a map, looked at by time, made a scenario of."""

from __future__ import annotations

import errno
import json
import logging
import os
import shutil
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Final, Literal

from fastapi import APIRouter, Query
from pydantic import Field
from starlette.requests import Request
from starlette.responses import Response

from odscen.app.exchange.kept_recordings import (
    SEARCHED_AT_ONCE,
    add_recording,
    fitting_maps_of,
    open_recording,
    place_recording,
    recording_names,
    remove_recording,
    scenario_of_recording,
    search_recording,
)
from odscen.base.atomic_folders import passing_folder
from odscen.base.categories import Category
from odscen.base.errors import DamagedError, InputError, ResourceError
from odscen.base.system_errors import disk_errors
from odscen.formats.tracks.scenario_of_tracks import SceneChoice
from odscen.web.exchange.exchange_routes import IMPORT_REPORT
from odscen.web.exchange.received_files import receive_files
from odscen.web.jobs import JobResult
from odscen.web.messages import Answer, JobStarted, Name, RequestBody
from odscen.web.services import Services, Shared
from odscen.web.wire.media_types import SVG, answers

if TYPE_CHECKING:
    from odscen.app.exchange.kept_recordings import KeptRecording
    from odscen.maps.store import ProgressCallback

_MOST_ROWS = 1_000_000
_ROOM: Final = 3
"""Bytes on the disk for each byte that is sent: the file itself, its copy in parts, its tracks."""
_GHOSTS = "ghosts.json"

SceneKind = Literal[
    "hard_braking", "short_ttc", "lane_change", "cut_in", "crossing_pedestrian", "unprotected_left"
]
Second = Annotated[float, Field(ge=-1e10, le=1e10, allow_inf_nan=False)]


class RecordingRow(Answer):
    """A recording, for a list; seconds as it counts them."""

    name: str
    file: str
    road_users: int
    begin: float
    end: float
    map: str | None


class RecordedUser(Answer):
    """A road user; seconds and metres. Its row is its number in moments."""

    id: str
    category: Category
    kind: str | None
    begin: float
    end: float
    length: float
    width: float


class RecordedScene(Answer):
    """A scene that meets a criterion; ``value`` is the worst, see ``docs/recordings.md``."""

    kind: SceneKind
    id: str
    other: str | None
    begin: float
    end: float
    x: float
    y: float
    value: float


class MapAgreement(Answer):
    """How well states lie on lanes: shares, and metres left of their middles."""

    states: int
    on_lane: float
    wrong_way: float
    offset_median: float | None = None
    offset_95: float | None = None


class SceneFrequency(Answer):
    """How often scenes of a kind are."""

    kind: SceneKind
    count: int
    per_hour: float | None
    per_100_km: float | None


class RecordingInfo(RecordingRow):
    """All that is known of a recording but the places of road users.

    ``published_schema`` is that of its file; ``offset`` metres and degrees to the frame of the map;
    ``added`` maps that came with it; ``unused`` files that were sent with it and not needed.
    ``origin`` is added to places of moments, ``bounds`` are those of the tracks, metres. Until it
    has been ``searched`` there are no scenes, and nothing is known of how it lies on its map.
    """

    published_schema: str
    searched: bool
    step: float
    notes: list[str]
    added: list[str]
    unused: list[str]
    offset: tuple[float, float, float]
    origin: tuple[float, float]
    bounds: tuple[float, float, float, float]
    vehicles: MapAgreement | None
    pedestrians: MapAgreement | None
    hours: float
    vehicle_km: float
    frequencies: list[SceneFrequency]
    users: list[RecordedUser]
    scenes: list[RecordedScene]


class FittingMapInfo(Answer):
    """A map, and the share of states of moving vehicles on its lanes, in their direction."""

    map: str
    on_lane: float


class RecordingPlace(RequestBody):
    """The map that a recording is of, and metres and degrees to its frame, ``X,Y[,DEGREES]``.

    With ``estimate`` it is moved onto the lanes from there.
    """

    map: Name
    offset: Annotated[str, Field(max_length=100)] = ""
    estimate: bool = False


class RecordingPart(RequestBody):
    """A part of a recording that a scenario is made of; ``ego`` may be empty."""

    begin: Second
    end: Second
    ego: Annotated[str, Field(max_length=200)] = ""
    follow: Literal["track", "react", "drive"] = "track"


class Ghost(Answer):
    """The track of a road user under a scenario; seconds of the run, metres, radians."""

    id: str
    actor: str | None
    category: Category | None
    length: float
    width: float
    time: list[float]
    x: list[float]
    y: list[float]
    hdg: list[float]


router = APIRouter(prefix="/api/recordings")
ghosts = APIRouter(prefix="/api/scenarios")


@router.get("")
def list_recordings(shared: Shared) -> list[RecordingRow]:
    """All recordings that are not damaged, those that came last first."""
    rows = []
    for name in recording_names(shared.workspace):
        try:
            rows.append(_row_of(open_recording(shared.workspace, name)))
        except DamagedError as error:  # one does not hide the others
            logging.getLogger("odscen").warning("%s; see odscen doctor", error)
    return rows


_FORM = {
    "requestBody": {
        "required": True,
        "content": {
            "multipart/form-data": {
                "schema": {
                    "type": "object",
                    "required": ["files"],
                    "properties": {
                        "files": {
                            "type": "array",
                            "items": {
                                "type": "string",
                                "contentMediaType": "application/octet-stream",
                            },
                        },
                        "map": {"type": "string"},
                    },
                }
            }
        },
    }
}


@router.post("", status_code=202, openapi_extra=_FORM)
async def add_sent_recording(request: Request, shared: Shared) -> JobStarted:
    """Keep a recording, in the background; the result is its name.

    The scenes of a large one are looked for when it is there.
    """
    with ExitStack() as opened:
        with disk_errors("recordings"):
            shared.workspace.recordings.mkdir(parents=True, exist_ok=True)
            folder = opened.enter_context(passing_folder(shared.workspace.recordings))
            _check_room(request, folder)
            sent, fields = await receive_files(request, folder)
        if not sent:
            raise InputError("no files were sent")
        kept = opened.pop_all()

    def work(progress: ProgressCallback) -> JobResult:
        with kept:
            progress("starting", 0.0)
            size = sum(sent_file.path.stat().st_size for sent_file in sent)
            added = add_recording(
                shared.workspace,
                sent,
                on_map=fields.get("map"),
                search=size <= SEARCHED_AT_ONCE,
                progress=progress,
            )
        if not added.is_searched:
            _search_later(shared, added.name)
        return JobResult(added.name)

    try:
        subject = f"the recording {', '.join(sorted(sent_file.name for sent_file in sent))}"
        return JobStarted(job=shared.jobs.start(work, subject=subject))
    except BaseException:
        kept.close()
        raise


def _check_room(request: Request, folder: Path) -> None:
    """Refuse what the disk has no room for before it comes: the files, and tracks made of them."""
    length = request.headers.get("content-length", "")
    needed = _ROOM * int(length) if length.isdigit() else 0
    free = shutil.disk_usage(folder).free
    if needed > free:
        raise ResourceError(
            f"recordings: {needed >> 20:,} MiB are needed for it, and the disk has {free >> 20:,} "
            "MiB; free some room"
        ) from OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))


@router.post("/{name}/search", status_code=202)
def search_scenes(name: str, shared: Shared) -> JobStarted:
    """Look for the scenes of a recording, in the background; the job that does so, if one does."""
    open_recording(shared.workspace, name)
    return JobStarted(job=_search_later(shared, name))


def _search_later(shared: Services, name: str) -> str:
    def work(progress: ProgressCallback) -> JobResult:
        return JobResult(search_recording(shared.workspace, name, progress=progress).name)

    return shared.jobs.start(work, subject=_subject_of(name), join=True)


def _subject_of(name: str) -> str:
    return f"recording {name!r}"


@router.get("/{name}")
def show_recording(name: str, shared: Shared) -> RecordingInfo:
    """What a recording has: road users, scenes, and how well it lies on its map."""
    kept = open_recording(shared.workspace, name)
    about = kept.about
    agreement = about["agreement"] or {}
    often = about["exposure"] or {"hours": 0.0, "vehicle_km": 0.0, "scenes": {}}
    return RecordingInfo(
        **_row_of(kept).model_dump(),
        published_schema=about["schema"],
        searched=kept.is_searched,
        step=about["summary"]["step"],
        notes=about["summary"]["notes"],
        added=about["added"],
        unused=about["unused"],
        offset=about["offset"],
        origin=about["origin"],
        bounds=about["bounds"],
        vehicles=agreement.get("vehicles"),
        pedestrians=agreement.get("pedestrians"),
        hours=often["hours"],
        vehicle_km=often["vehicle_km"],
        frequencies=[SceneFrequency(kind=kind, **found) for kind, found in often["scenes"].items()],
        users=about["users"],
        scenes=about["scenes"],
    )


@router.delete("/{name}", status_code=204)
def delete_recording(name: str, shared: Shared) -> None:
    """Delete a recording, damaged or not; scenarios that were made of it stay."""
    remove_recording(shared.workspace, name)


@router.get("/{name}/maps")
def list_fitting_maps(name: str, shared: Shared) -> list[FittingMapInfo]:
    """Maps on whose lanes the vehicles of a recording are, the best first."""
    found = fitting_maps_of(shared.workspace, name)
    return [FittingMapInfo(map=fit.map, on_lane=fit.on_lane) for fit in found]


@router.post("/{name}/map", status_code=202)
def set_recording_map(name: str, place: RecordingPlace, shared: Shared) -> JobStarted:
    """Place a recording on a map, in the background."""
    open_recording(shared.workspace, name)

    def work(progress: ProgressCallback) -> JobResult:
        kept = place_recording(
            shared.workspace,
            name,
            on_map=place.map,
            offset=place.offset,
            estimate=place.estimate,
            progress=progress,
        )
        return JobResult(kept.name)

    return JobStarted(job=shared.jobs.start(work, subject=_subject_of(name)))


@router.get("/{name}/picture", response_class=Response, responses=SVG)
def recording_picture(name: str, shared: Shared) -> Response:
    """Map and tracks, with places that are on no lane circled."""
    content = open_recording(shared.workspace, name).picture()
    return Response(content, media_type="image/svg+xml", headers={"Cache-Control": "no-cache"})


@router.get(
    "/{name}/moments", response_class=Response, responses=answers("application/octet-stream")
)
def recording_moments(
    name: str,
    shared: Shared,
    begin: Annotated[float, Query(ge=-1e10, le=1e10, allow_inf_nan=False)] = -1e10,
    end: Annotated[float, Query(ge=-1e10, le=1e10, allow_inf_nan=False)] = 1e10,
    most: Annotated[int, Query(ge=1, le=_MOST_ROWS, description="Rows at most.")] = 300_000,
) -> Response:
    """Who was where, in binary; see ``docs/server.md``. Fewer moments if there are too many."""
    moments = open_recording(shared.workspace, name).moments(begin, end, most=most)
    return Response(moments.packed(), media_type="application/octet-stream")


@router.post("/{name}/scenarios", status_code=202)
def make_scenario(name: str, part: RecordingPart, shared: Shared) -> JobStarted:
    """Make a scenario of a part of a recording, in the background; the result is its name."""
    file = open_recording(shared.workspace, name).about["file"]

    def work(progress: ProgressCallback) -> JobResult:
        progress("making the scenario", 0.0)
        made = scenario_of_recording(
            shared.workspace,
            name,
            SceneChoice(part.ego, part.follow),
            begin=part.begin,
            end=part.end,
        )
        draft = shared.drafts.create(made.scenario, None, stem=name, label="Import")
        about = {"file": file, "added": False, "lists": made.report}
        shared.drafts.keep(draft.name, IMPORT_REPORT, json.dumps(about))
        shared.drafts.keep(draft.name, _GHOSTS, json.dumps(made.ghosts))
        return JobResult(draft.name)

    subject = f"a scenario of recording {name!r} from {part.begin:g} to {part.end:g} s"
    return JobStarted(job=shared.jobs.start(work, subject=subject))


@ghosts.get("/{name}/ghosts")
def scenario_ghosts(name: str, shared: Shared) -> list[Ghost]:
    """Tracks of the recording that a scenario was made of; none of others."""
    shared.drafts.row(name)
    kept = shared.drafts.kept(name, _GHOSTS)
    return [Ghost(**ghost) for ghost in json.loads(kept)] if kept is not None else []


def _row_of(kept: KeptRecording) -> RecordingRow:
    about = kept.about
    return RecordingRow(
        name=kept.name,
        file=about["file"],
        road_users=len(about["users"]),
        begin=about["summary"]["begin"],
        end=about["summary"]["end"],
        map=about["map"],
    )
