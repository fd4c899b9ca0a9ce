"""Routes for scenarios: the document, edits of it, and questions about it."""

from __future__ import annotations

from dataclasses import asdict
from time import thread_time
from typing import TYPE_CHECKING, Annotated, Literal

import numpy as np
import orjson
from fastapi import APIRouter, File, Form, Query, UploadFile
from pydantic import BaseModel, ConfigDict, Field
from starlette.requests import Request
from starlette.responses import Response

from odscen.app.maps import load_map
from odscen.app.scenarios import SUFFIX
from odscen.app.template_scenarios import template_scenario, why_no_room
from odscen.app.variants import apply_edit
from odscen.base.categories import Category
from odscen.base.errors import InputError, LimitError, NotFoundError
from odscen.figures.judging.criteria import criteria_problems
from odscen.maps.folder_names import check_name, name_from_file
from odscen.scenario.checks.scenario_checks import check
from odscen.scenario.document.json_form import dumps
from odscen.scenario.document.problems import Problem
from odscen.scenario.document.scenario_document import Scenario
from odscen.scenario.edits import new_scenario
from odscen.scenario.edits.edit_messages import AnyEdit, edits_label
from odscen.scenario.edits.roi_edits import eligible_segments, removable_segments
from odscen.scenario.forms.graph_form import to_graphml
from odscen.scenario.placing.region import NodePlace as GraphPlace
from odscen.scenario.placing.region import name_of, place_of
from odscen.scenario.templates.template_registry import TEMPLATES
from odscen.sumo.realize.road_user import RoadUser
from odscen.sumo.realize.road_users.planned_positions import planned_positions
from odscen.sumo.realize.route_paths import each_path
from odscen.sumo.runner.network_fit import place_fit
from odscen.web.large.large_documents import LargeDocumentRoute
from odscen.web.messages import (
    CopyName,
    Goals,
    NewName,
    NewScenario,
    OfVersion,
    Path,
    ProblemInfo,
    RoiInfo,
    RoomAnswer,
    RoomQuestion,
    ScenarioRow,
    ScenarioState,
    TemplateInfo,
    TemplateNumber,
)
from odscen.web.packed import UNCHANGED, answer, pack
from odscen.web.services import Services, Shared, region_of
from odscen.web.wire.document_changes import (
    ScenarioPatch,
    ScenarioProblems,
    changes_between,
)
from odscen.web.wire.media_types import Responses
from odscen.web.wire.plan_messages import PlannedColumns

if TYPE_CHECKING:
    from odscen.scenario.placing.region import Region
    from odscen.sumo.realize.road_users.planned_positions import PlannedPositions
    from odscen.web.drafts import Draft

router = APIRouter(prefix="/api/scenarios", route_class=LargeDocumentRoute)
templates = APIRouter(prefix="/api/templates")

_FILE: Responses = {
    200: {
        "content": {
            "application/json": {"schema": {"$ref": "#/components/schemas/Scenario-File"}},
            "application/xml": {"schema": {"type": "string"}},
        }
    }
}
"""A scenario's file leaves out what has its default, which the answers of other routes do not."""
OnlyChanges = Annotated[
    bool, Query(description="Answer with what has changed, in place of all, and without problems.")
]

_MOST_EDITS = 5000
"""In one request."""
_EDIT_SECONDS = 4.0
"""Of computing for the edits of one request: each looks at the whole document."""


class EditRequest(BaseModel):
    """Edits of one version: all of them or none, and one step for undo.

    ``label`` says in words what they do together; needed only where there are several.
    """

    model_config = ConfigDict(extra="forbid", frozen=True)

    version: Annotated[int, Field(ge=0, lt=2**53)]
    edits: Annotated[list[AnyEdit], Field(min_length=1, max_length=_MOST_EDITS)]
    label: Annotated[str, Field(min_length=1, max_length=80)] | None = None

    @property
    def step_label(self) -> str:
        """What undo and redo call this."""
        return self.label or edits_label(self.edits)


@router.get("")
def list_scenarios(shared: Shared) -> list[ScenarioRow]:
    """All scenarios, those changed last first."""
    return shared.drafts.rows()


@templates.get("")
def list_templates() -> list[TemplateInfo]:
    """All templates, in the order in which they are offered."""
    return [
        TemplateInfo(
            name=template.name,
            title=template.title,
            summary=template.summary,
            source=template.source,
            needs=template.needs,
            numbers=[
                TemplateNumber(
                    name=number.name,
                    title=number.title,
                    usual=number.default,
                    low=number.low,
                    high=number.high,
                    unit=number.unit,
                    meaning=number.meaning,
                )
                for number in template.parameters
            ],
        )
        for template in TEMPLATES.values()
    ]


@templates.post("/{template}/room")
def find_room(template: str, asked: RoomQuestion, shared: Shared) -> RoomAnswer:
    """Whether a map has room for a template, before a scenario is made of it."""
    with shared.search:
        reason = why_no_room(shared.workspace, template, asked.map, values=asked.values)
    return RoomAnswer(reason=reason)


@router.post("", status_code=201)
def create(wish: NewScenario, shared: Shared) -> ScenarioState:
    """Start a scenario on a map: an empty one, or a template where the map has room for it."""
    if wish.name is not None:
        check_name(wish.name, what="scenario")
    if wish.template is not None:
        stem = f"{wish.template}-{wish.map}"
        with shared.search:
            scenario = template_scenario(
                shared.workspace, wish.template, wish.map, values=wish.values, name=wish.name
            )
        draft = shared.drafts.create(scenario, wish.name, stem=stem, label="New from template")
        return state_of(shared, draft)
    entry = shared.workspace.map(wish.map)
    scenario = new_scenario(load_map(entry).sumo.graph, name=wish.name or wish.map)
    draft = shared.drafts.create(scenario, wish.name, stem=wish.map, label="New scenario")
    return state_of(shared, draft)


@router.post("/upload", status_code=201)
def upload(
    shared: Shared,
    file: Annotated[UploadFile, File(description="A scenario as JSON or GraphML.")],
    name: Annotated[str | None, Form()] = None,
) -> ScenarioState:
    """Add a scenario from a file."""
    given = (file.filename or "scenario").removesuffix(SUFFIX)
    scenario = shared.read_upload(file.file.read(), file=file.filename)
    from pathlib import Path as FilePath

    stem = name_from_file(FilePath(given))
    draft = shared.drafts.create(scenario, name, stem=stem, label="Upload")
    return state_of(shared, draft)


@router.get("/{name}")
def show(name: str, shared: Shared) -> ScenarioState:
    """One scenario as it is now."""
    return state_of(shared, shared.drafts.get(name))


@router.put("/{name}/name")
def rename(name: str, new: NewName, shared: Shared) -> ScenarioState:
    """Give a scenario's file another name."""
    return state_of(shared, shared.drafts.rename(name, new.name))


@router.get("/{name}/problems")
def problems(name: str, shared: Shared) -> ScenarioProblems:
    """What is wrong with a scenario as it is now."""
    draft = shared.drafts.get(name)
    infos = _problem_infos(shared, draft.scenario)
    return ScenarioProblems(version=draft.history.version, problems=infos)


@router.post("/{name}/edits")
def edit(
    name: str, request: EditRequest, shared: Shared, changes: OnlyChanges = False
) -> ScenarioState | ScenarioPatch:
    """Make edits, all or none; each kind is a function of ``odscen.scenario.edits``."""

    def change(scenario: Scenario) -> Scenario:
        loaded, begun = shared.map_of(scenario), thread_time()
        for number, edit in enumerate(request.edits):
            scenario = apply_edit(edit, scenario, loaded)
            if thread_time() - begun > _EDIT_SECONDS and number + 1 < len(request.edits):
                raise LimitError(
                    f"these {len(request.edits):,} edits take longer than {_EDIT_SECONDS:g} s, of "
                    f"which {number + 1:,} were possible in that time; send fewer at once"
                )
        return scenario

    changed = shared.drafts.change(
        name, request.version, request.step_label, change, edits=request.edits
    )
    return _answer_change(shared, changed, changes=changes)


@router.post("/{name}/undo")
def undo(
    name: str, request: OfVersion, shared: Shared, changes: OnlyChanges = False
) -> ScenarioState | ScenarioPatch:
    """Take the last edit back."""
    return _answer_change(shared, shared.drafts.undo(name, request.version), changes=changes)


@router.post("/{name}/redo")
def redo(
    name: str, request: OfVersion, shared: Shared, changes: OnlyChanges = False
) -> ScenarioState | ScenarioPatch:
    """Make the edit again that was taken back last."""
    return _answer_change(shared, shared.drafts.redo(name, request.version), changes=changes)


@router.post("/{name}/copy", status_code=201)
def copy(name: str, wish: CopyName, shared: Shared) -> ScenarioState:
    """Save a scenario under another name too; a free one is made if none is given."""
    scenario = shared.drafts.get(name).scenario
    label = f"Copy of {name}"
    draft = shared.drafts.create(scenario, wish.name, stem=name, label=label, renamed=True)
    return state_of(shared, draft)


@router.get("/{name}/goals")
def goals(name: str, spawn: str, shared: Shared) -> Goals:
    """Nodes that an actor that starts at ``spawn`` can have as its goal."""
    scenario = shared.drafts.get(name).scenario
    graph = shared.map_of(scenario).sumo.graph
    with shared.search:
        region, start = (
            _region_of_scenario(shared, scenario),
            _required_place(shared, scenario, spawn),
        )
        found = region.candidates(start)
    names = [name_of(graph, GraphPlace(start.walk, node)) for node in found.tolist()]
    return Goals(spawn=spawn, goals=list(names))


@router.get("/{name}/path")
def path(name: str, spawn: str, goal: str, shared: Shared) -> Path:
    """Path from ``spawn`` to ``goal`` inside the region, as a pedestrian, or a car, takes it."""
    scenario = shared.drafts.get(name).scenario
    sumo = shared.map_of(scenario).sumo
    graph = sumo.graph
    start, end = _required_place(shared, scenario, spawn), _required_place(shared, scenario, goal)
    if start.walk != end.walk:
        raise InputError(
            f"no path leads from {spawn!r} to {goal!r}: one is for vehicles, one for pedestrians"
        )
    with shared.search:
        region = _region_of_scenario(shared, scenario)
        category = Category.PEDESTRIAN if start.walk else Category.CAR
        user = RoadUser("user", category, start.node, end.node, depart=0.0)
        drivable = region.router_over(sumo.drivable)
        ((_, path),) = each_path([user], region, drivable)
    found = path.tolist()
    nodes = region.nodes_of(start)
    return Path(
        nodes=[name_of(graph, GraphPlace(start.walk, node)) for node in found],
        points=[(round(float(nodes.x[i]), 3), round(float(nodes.y[i]), 3)) for i in found],
    )


@router.get("/{name}/plan", response_model=PlannedColumns, responses=UNCHANGED)
def plan(name: str, request: Request, shared: Shared) -> Response:
    """Where road users are planned to be, each alone on the road; see ``docs/server.md``."""
    scenario = shared.drafts.get(name).scenario
    sumo, assets = shared.map_of(scenario).sumo, shared.workspace.assets()
    with shared.search:
        positions = planned_positions(scenario, sumo, _region_of_scenario(shared, scenario), assets)
    return answer(
        request, pack(orjson.dumps(_rounded_columns(positions), option=orjson.OPT_SERIALIZE_NUMPY))
    )


def _rounded_columns(found: PlannedPositions) -> dict[str, object]:
    """Times to 1/100 s, places to the centimetre, headings to 1e-3 rad, which no screen shows."""
    return {
        "users": [
            {
                "id": user.id,
                "category": user.category,
                "length": body.length,
                "width": body.width,
                "ego": user.design.ego,
                "flow": user.flow,
            }
            for user, body in zip(found.users, found.bodies, strict=True)
        ],
        "first": found.first,
        "time": np.round(found.time, 2),
        "x": np.round(found.x, 2),
        "y": np.round(found.y, 2),
        "hdg": np.round(found.hdg, 3),
        "left_out": found.left_out,
        "not_planned": found.not_planned,
    }


@router.get("/{name}/roi")
def roi(name: str, shared: Shared) -> RoiInfo:
    """Segments of the region of interest, and those that may be added or taken out now."""
    scenario = shared.drafts.get(name).scenario
    graph = shared.map_of(scenario).sumo.graph
    return RoiInfo(
        inside=list(scenario.roi),
        candidates=list(eligible_segments(scenario, graph)),
        removable=list(removable_segments(scenario, graph)),
    )


@router.get("/{name}/download", response_class=Response, responses=_FILE)
def download(name: str, shared: Shared, form: Literal["json", "graphml"] = "json") -> Response:
    """Download the scenario as its document or in its graph form."""
    scenario = shared.drafts.get(name).scenario
    if form == "json":
        content, media_type, file = dumps(scenario), "application/json", f"{name}{SUFFIX}"
    else:
        content = to_graphml(scenario, shared.map_of(scenario).sumo.graph)
        media_type, file = "application/xml", f"{name}.graphml"
    headers = {"Content-Disposition": f'attachment; filename="{file}"'}
    return Response(content, media_type=media_type, headers=headers)


def state_of(shared: Services, draft: Draft) -> ScenarioState:
    """Answer with a scenario as it is now."""
    history = draft.history
    return ScenarioState(
        name=draft.name,
        version=history.version,
        document=draft.scenario,
        problems=_problem_infos(shared, draft.scenario),
        label=history.label,
        undo=history.undo,
        redo=history.redo,
    )


def _answer_change(
    shared: Services, draft: Draft, *, changes: bool
) -> ScenarioState | ScenarioPatch:
    """Answer with a scenario that was just changed, or with what has changed."""
    if not changes or draft.before is None:
        return state_of(shared, draft)
    history = draft.history
    return ScenarioPatch(
        name=draft.name,
        before=history.version - 1,
        version=history.version,
        changes=changes_between(draft.before, draft.scenario),
        label=history.label,
        undo=history.undo,
        redo=history.redo,
    )


def _problem_infos(shared: Services, scenario: Scenario) -> list[ProblemInfo]:
    return [
        ProblemInfo(**asdict(all_problem)) for all_problem in _find_all_problems(shared, scenario)
    ]


def _find_all_problems(shared: Services, scenario: Scenario) -> tuple[Problem, ...]:
    try:
        loaded = shared.map_of(scenario)
    except InputError as error:  # a scenario whose map was removed can still be looked at
        return (Problem("error", "map_missing", "map", str(error)),)
    with shared.search:
        region = region_of(loaded, scenario.roi)
        found = check(
            scenario,
            loaded.sumo.graph,
            shared.workspace.assets(),
            loaded.lights,
            parking=loaded.sumo.parking,
            region=region,
        )
    return (*found, *criteria_problems(scenario), *place_fit(scenario, loaded.sumo))


def _region_of_scenario(shared: Services, scenario: Scenario) -> Region:
    return region_of(shared.map_of(scenario), scenario.roi)


def _required_place(shared: Services, scenario: Scenario, node: str) -> GraphPlace:
    place = place_of(shared.map_of(scenario).sumo.graph, node)
    if place is None:
        raise NotFoundError("node", node, [])
    return place
