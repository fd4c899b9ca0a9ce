"""Routes for maps, jobs and assets."""

from __future__ import annotations

import json
import re
import shutil
import tempfile
from pathlib import Path
from typing import IO, TYPE_CHECKING, Annotated, Literal

from fastapi import APIRouter, File, Form, UploadFile
from starlette.requests import Request
from starlette.responses import Response

from odscen.app.maps import load_map, map_to_mend
from odscen.base.categories import DEFAULT_BODY
from odscen.base.checksums import digest
from odscen.base.errors import ConflictError, DamagedError, InputError, OdscenError
from odscen.convert.model.conversion_settings import ConversionSettings
from odscen.learning.offered_options import OptionValue, options_of
from odscen.maps.edited_map import EditRefusedError
from odscen.maps.folder_names import check_name, name_from_file
from odscen.maps.importers.base import ImportSettings
from odscen.maps.importers.registry import map_importers
from odscen.maps.map_edits import read_edits, try_edit
from odscen.maps.shipped import shipped_maps
from odscen.maps.store import is_outdated
from odscen.maps.traffic_losses import traffic_losses
from odscen.scenario.demand.day_profiles import BUILT_IN
from odscen.web.jobs import JobResult
from odscen.web.messages import (
    AssetsInfo,
    BlueprintInfo,
    CategoryInfo,
    JobInfo,
    JobStarted,
    OptionInfo,
    WeatherInfo,
)
from odscen.web.packed import (
    UNCHANGED,
    answer,
    packed_drawing,
    packed_graph,
    packed_heights,
    packed_names,
)
from odscen.web.services import Shared
from odscen.web.wire.map_messages import (
    BrokenMapInfo,
    ConversionEntry,
    ConversionInfo,
    DrawingColumns,
    EditTrial,
    EditTrialRequest,
    GraphColumns,
    GraphCounts,
    HeightColumns,
    ImporterInfo,
    LightInfo,
    MapDetails,
    MapEdits,
    MapEditsInfo,
    MapHeader,
    MapInfo,
    MapNames,
    NetCounts,
    NetworkOrigin,
    PlaceInfo,
    SemanticsInfo,
)
from odscen.web.wire.media_types import SVG

if TYPE_CHECKING:
    from collections.abc import Iterator

    from odscen.maps.map_entry import MapEntry
    from odscen.maps.store import ProgressCallback

router = APIRouter(prefix="/api")

_DRAWING = "default-src 'none'; style-src 'unsafe-inline'; sandbox"
"""Content security policy of a drawing that is opened by itself."""


@router.get("/maps")
def list_maps(shared: Shared) -> list[MapInfo]:
    """All maps of the catalogue that can be used, by name."""
    return [found for found in _list_catalogue(shared) if isinstance(found, MapInfo)]


@router.get("/broken-maps")
def list_broken_maps(shared: Shared) -> list[BrokenMapInfo]:
    """Maps whose folders are damaged, by name, and why; they can be removed or added again."""
    return [found for found in _list_catalogue(shared) if isinstance(found, BrokenMapInfo)]


@router.get("/maps/{name}")
def show_map(name: str, shared: Shared) -> MapDetails:
    """One map, with what it means and its traffic lights."""
    entry = shared.workspace.map(name)
    loaded = load_map(entry)
    known = [
        LightInfo(
            id=light.id,
            names=list(seen.names),
            green=list(seen.green),
            signals=[list(names) for names in light.signals],
            paths=[list(link.path) for link in light.links],
            walks=[movement.walk for movement in seen.movements],
        )
        for light, seen in zip(loaded.sumo.lights, loaded.lights, strict=True)
    ]
    semantics = SemanticsInfo.model_validate(entry.info["semantics"])
    return MapDetails(**dict(_map_info(entry)), semantics=semantics, lights=known)


@router.get("/maps/{name}/preview.svg", response_class=Response, responses=SVG)
def preview(name: str, shared: Shared) -> Response:
    """Drawing of the map as SVG."""
    content = shared.workspace.stored(name).read("preview")
    headers = {"Content-Security-Policy": _DRAWING, "Cache-Control": "no-cache"}
    return Response(content, media_type="image/svg+xml", headers=headers)


@router.get("/maps/{name}/drawing", response_model=DrawingColumns, responses=UNCHANGED)
def drawing(name: str, request: Request, shared: Shared) -> Response:
    """What is drawn of the map, see ``docs/drawings.md``."""
    return answer(request, packed_drawing(shared.workspace.map(name)))


@router.get("/maps/{name}/graph", response_model=GraphColumns, responses=UNCHANGED)
def graph(name: str, request: Request, shared: Shared) -> Response:
    """Lane graph, segments and pedestrian graph as columns, see ``docs/server.md``."""
    return answer(request, packed_graph(shared.workspace.map(name)))


@router.get("/maps/{name}/heights", response_model=HeightColumns, responses=UNCHANGED)
def heights(name: str, request: Request, shared: Shared) -> Response:
    """Heights of the nodes of a map's graphs; none where all have the same."""
    return answer(request, packed_heights(shared.workspace.map(name)))


@router.get("/maps/{name}/names", response_model=MapNames, responses=UNCHANGED)
def names(name: str, request: Request, shared: Shared) -> Response:
    """Names of the map's junctions and roads by streets and the compass, in parts."""
    return answer(request, packed_names(shared.workspace.map(name)))


@router.get("/maps/{name}/report")
def report(name: str, shared: Shared) -> ConversionInfo:
    """What became of each element of the map on the way to SUMO."""
    return ConversionInfo.model_validate(shared.workspace.map(name).info["report"])


@router.get("/maps/{name}/place")
def show_place(name: str, x: float, y: float, shared: Shared) -> PlaceInfo:
    """What is at a place, metres: the lane there, and what can be removed."""
    try:
        place = map_to_mend(shared.workspace.map(name)).describe_place(x, y)
    except EditRefusedError as error:
        raise InputError(str(error)) from error
    return PlaceInfo.model_validate(place._asdict())


@router.get("/maps/{name}/edits")
def show_edits(name: str, shared: Shared) -> MapEditsInfo:
    """Edits that mend a map, and what became of each."""
    entry = shared.workspace.map(name)
    rows = [ConversionEntry.model_validate(row) for row in entry.edit_rows()]
    return MapEditsInfo(edits=read_edits(entry.importing.edits or "[]"), rows=rows)


@router.post("/maps/{name}/edits/trial")
def try_map_edit(name: str, body: EditTrialRequest, shared: Shared) -> EditTrial:
    """What an edit would do to a map as it is, at once; nothing is changed."""
    row, outlines = try_edit(map_to_mend(shared.workspace.map(name)), body.edit)
    return EditTrial.model_validate({"row": row.to_dict(), "outlines": outlines})


@router.post("/maps/{name}/edits", status_code=202)
def mend_map(name: str, body: MapEdits, shared: Shared) -> JobStarted:
    """Mend a map by edits, in place of those that it has; it is built anew in the background."""
    shared.workspace.stored(name)
    out = name if body.out is None else check_name(body.out)
    edits = [edit.model_dump(exclude_none=True) for edit in body.edits]

    def work(progress: ProgressCallback) -> JobResult:
        progress("starting", 0.0)
        workspace = shared.workspace
        return JobResult(
            workspace.mend_map(name, edits, out=out, anew=True, progress=progress).name
        )

    return JobStarted(job=shared.jobs.start(work, subject=f"map {out!r}"))


@router.post("/maps", status_code=202)
def add_map(
    shared: Shared,
    file: Annotated[UploadFile, File(description="A map of any format of `/map-importers`.")],
    name: Annotated[str | None, Form()] = None,
    converter: Annotated[Literal["odscen", "netconvert"] | None, Form()] = None,
    importer: Annotated[str | None, Form(description="If several recognise the file.")] = None,
    options: Annotated[str | None, Form(description="Of the importer, a JSON object.")] = None,
) -> JobStarted:
    """Add a map; it is built in the background, with a network by the converter of that name."""
    given = Path(file.filename or "map.xodr")
    name = name_from_file(given) if name is None else check_name(name)
    importing = ImportSettings(importer, _parse_options(options))
    suffix = given.suffix if re.fullmatch(r"\.[A-Za-z0-9]{1,16}", given.suffix) else ""
    # Without a name on disk: nothing is left of it, however the server ends.
    kept = tempfile.TemporaryFile()  # noqa: SIM115 - closed by the work
    try:
        shutil.copyfileobj(file.file, kept)
        _refuse_other(shared, name, kept)

        def work(progress: ProgressCallback) -> JobResult:
            with kept:
                progress("starting", 0.0)
                kept.seek(0)
                settings = ConversionSettings(converter=converter)
                added = shared.workspace.add_map_content(
                    kept.read(),
                    file=f"{name_from_file(given)}{suffix}",
                    name=name,
                    settings=settings,
                    importing=importing,
                    progress=progress,
                )
                return JobResult(added.name)

        return JobStarted(job=shared.jobs.start(work, subject=f"map {name!r}"))
    except BaseException:
        kept.close()
        raise


@router.post("/maps/{name}/file", status_code=202)
def renew_map(
    name: str,
    shared: Shared,
    file: Annotated[UploadFile, File(description="A newer file of the same place.")],
    out: Annotated[str | None, Form(description="The map that is made, if not this one.")] = None,
) -> JobStarted:
    """Import a newer file of the same place with the edits of a map, in the background."""
    shared.workspace.stored(name)
    out = name if out is None else check_name(out)
    given = Path(file.filename or "map.xodr")
    suffix = given.suffix if re.fullmatch(r"\.[A-Za-z0-9]{1,16}", given.suffix) else ""
    content = file.file.read()

    def work(progress: ProgressCallback) -> JobResult:
        progress("starting", 0.0)
        renewed = shared.workspace.renew_map(
            name, content, file=f"{name_from_file(given)}{suffix}", out=out, progress=progress
        )
        return JobResult(renewed.name)

    return JobStarted(job=shared.jobs.start(work, subject=f"map {out!r}"))


@router.get("/map-importers")
def list_map_importers() -> list[ImporterInfo]:
    """Formats that maps can have: OpenDRIVE, and those of installed packages that can be used."""
    return [
        ImporterInfo(
            name=importer.name,
            label=importer.label,
            suffixes=list(importer.suffixes),
            options=[
                OptionInfo(**{**option._asdict(), "choices": [*option.choices]})
                for option in options_of(type(importer))
            ],
        )
        for importer in map_importers().usable.values()
    ]


@router.post("/maps/shipped", status_code=202)
def add_shipped_maps(shared: Shared) -> JobStarted:
    """Add the maps that ship with odscen."""

    def work(progress: ProgressCallback) -> JobResult:
        progress("starting", 0.0)
        paths = shipped_maps()
        for number, path in enumerate(paths):

            def step(what: str, share: float, path: Path = path, number: int = number) -> None:
                progress(f"{path.stem}: {what}", (number + share) / len(paths))

            shared.workspace.add_map(path, progress=step)
        return JobResult(", ".join(path.stem for path in paths))

    return JobStarted(job=shared.jobs.start(work, subject="the set of example maps"))


@router.get("/jobs/{job}")
def show_job(job: str, shared: Shared) -> JobInfo:
    """How far a job is."""
    return shared.jobs.info(job)


@router.delete("/jobs/{job}", status_code=202)
def cancel_job(job: str, shared: Shared) -> JobInfo:
    """Cancel a job: within a second its state is ``cancelled``, and nothing unfinished is left."""
    return shared.jobs.cancel(job)


@router.get("/assets")
def assets(shared: Shared) -> AssetsInfo:
    """Categories, models and weather presets that a scenario can use."""
    known = shared.workspace.assets()
    return AssetsInfo(
        categories=[
            CategoryInfo(category=category, **body._asdict())
            for category, body in DEFAULT_BODY.items()
        ],
        blueprints=[
            BlueprintInfo(
                id=blueprint.id,
                category=blueprint.category,
                special_type=blueprint.special_type,
                age=blueprint.age,
                **blueprint.body._asdict(),
            )
            for blueprint in known.blueprints.values()
        ],
        weather=[
            WeatherInfo(
                name=preset.name,
                kind=preset.kind,
                time_of_day=preset.time_of_day,
                parameters=dict(preset.parameters),
            )
            for preset in known.presets.values()
        ],
        day_profiles={name: list(shares) for name, shares in BUILT_IN.items()},
    )


def _parse_options(text: str | None) -> dict[str, OptionValue]:
    """Options of an importer, as a form has them."""
    if not text:
        return {}
    try:
        values = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise InputError(f"options are no JSON: {error}") from error
    if not isinstance(values, dict):
        raise InputError("options are no JSON object")
    return values


def _refuse_other(shared: Shared, name: str, content: IO[bytes]) -> None:
    """Refuse to put another map in the place of one that scenarios may be made on."""
    if name not in shared.workspace.map_names():
        return
    try:
        there = shared.workspace.stored(name)
    except DamagedError:
        return  # adding it builds it anew
    content.seek(0)
    if there.source_sha256 != digest(content.read()):
        raise ConflictError(
            f"there is another map named {name!r}; give this one another name, or remove that one"
        )


def _list_catalogue(shared: Shared) -> Iterator[MapInfo | BrokenMapInfo]:
    """All maps; one that is damaged does not hide the others."""
    entries, broken = shared.workspace.catalogue()
    for entry in entries:
        try:
            yield _map_info(entry)
        except (AttributeError, KeyError, TypeError, ValueError):
            yield _rebuild_or_report(shared, entry)
    yield from (
        BrokenMapInfo(name=broken_map.name, problem=broken_map.problem) for broken_map in broken
    )


def _rebuild_or_report(shared: Shared, entry: MapEntry) -> MapInfo | BrokenMapInfo:
    """A map that does not say what is listed: rebuilt if it is too old for that, else damaged."""
    if is_outdated(entry):
        try:
            return _map_info(shared.workspace.map(entry.name))
        except OdscenError as error:
            return BrokenMapInfo(name=entry.name, problem=str(error))
    problem = "its map.json is damaged; add the map again"
    return BrokenMapInfo(name=entry.name, problem=problem)


def _map_info(entry: MapEntry) -> MapInfo:
    info = entry.info
    losses = traffic_losses(info["report"])
    return MapInfo(
        name=entry.name,
        sha256=entry.sha256,
        source=info["source"],
        importer=entry.importer,
        opendrive=MapHeader.model_validate(info["opendrive"]),
        statistics=info["statistics"],
        graph=GraphCounts.model_validate(info["graph"]),
        sumo=NetCounts.model_validate(info["sumo"]),
        network=NetworkOrigin(converter=entry.converter, source=info["network"]["source"]),
        report_counts=info["report"]["counts"],
        lost=dict(losses.lost),
        guessed=dict(losses.guessed),
        preview=f"/api/maps/{entry.name}/preview.svg",
        outdated=is_outdated(entry),
    )
