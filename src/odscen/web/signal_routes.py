"""Routes for traffic lights: their programs in a scenario or a run, and what they showed."""

from __future__ import annotations

from contextlib import suppress
from typing import TYPE_CHECKING

import orjson
from fastapi import APIRouter
from starlette.requests import Request
from starlette.responses import Response

from odscen.app.scenarios import read_scenario
from odscen.app.signals.signal_plans import lights_of
from odscen.app.signals.signal_views import chosen_lights, program_origin
from odscen.base.errors import InputError, NotFoundError
from odscen.results.records.light_programs import programs_from_json, stage_spans
from odscen.results.report.signals.signal_charts import plan_chart, plan_scale
from odscen.results.report.signals.signal_sheet import legend_picture, legend_shapes
from odscen.results.report.signals.stage_diagrams import (
    JunctionPictures,
    detector_label,
    stage_words,
)
from odscen.scenario.signals.program_design import seconds_of_day
from odscen.sumo.folder import layout
from odscen.sumo.folder.recorded import read_calls, read_light_states
from odscen.web.large.large_documents import LargeDocumentRoute
from odscen.web.packed import UNCHANGED, answer, pack
from odscen.web.services import Services, Shared
from odscen.web.wire.signal_messages import (
    DayPlanInfo,
    DetectorInfo,
    LightGroupInfo,
    LightProgramInfo,
    PhaseInfo,
    PictureKey,
    RunSignals,
    StageInfo,
)

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping
    from pathlib import Path
    from typing import Any

    import polars as pl

    from odscen.drawing.map_drawing import MapDrawing
    from odscen.results.records.light_programs import LightProgram, ShownPlan
    from odscen.scenario.document.scenario_document import Scenario

router = APIRouter(prefix="/api", route_class=LargeDocumentRoute)

_WIDTH = 384.0
"""Pixels of a time bar."""

_Calls = dict[str, list[tuple[float, float]]]


@router.get("/scenarios/{name}/signals/{junction}")
def of_scenario(name: str, junction: str, shared: Shared) -> LightProgramInfo:
    """What a light is told to show in a scenario, with all plans of the day."""
    scenario = shared.drafts.get(name).scenario
    lights = lights_of(shared.workspace, scenario, whole_day=True)
    return _program(chosen_lights(lights, [junction])[0], scenario, shared, {})


@router.get("/runs/{run}/signals", response_model=RunSignals, responses=UNCHANGED)
def of_run(run: str, request: Request, shared: Shared) -> Response:
    """What the lights of a finished run showed, and when."""
    states = read_light_states(shared.runs.kept.folder(run))
    lights = [] if states is None else list(_shown(states))
    return answer(request, pack(orjson.dumps({"lights": lights})))


@router.get("/runs/{run}/signals/{junction}")
def light_of_run(run: str, junction: str, shared: Shared) -> LightProgramInfo:
    """What a light is told to show in a run; of a finished one with the calls of its detectors."""
    folder = _finished(run, shared)
    if folder is None:
        scenario = shared.runs.active(run).scenario
        lights = lights_of(shared.workspace, scenario)
        return _program(chosen_lights(lights, [junction])[0], scenario, shared, {})
    scenario = read_scenario(folder / layout.SCENARIO_FILE)
    text = (folder / layout.LIGHTS_FILE).read_text(encoding="utf-8")
    light = chosen_lights(programs_from_json(text), [junction])[0]
    return _program(light, scenario, shared, _calls(light, folder))


def _finished(run: str, shared: Services) -> Path | None:
    """Folder of a run that has its lights in it; ``None`` if it is still under way here."""
    with suppress(NotFoundError):
        folder = shared.runs.kept.folder(run)
        if (folder / layout.LIGHTS_FILE).is_file():
            return folder
    shared.runs.active(run)
    return None


def _program(
    light: LightProgram, scenario: Scenario, shared: Services, calls: _Calls
) -> LightProgramInfo:
    drawing: MapDrawing | None = None
    try:
        loaded = shared.map_of(scenario)
        drawing, converter = loaded.drawing, loaded.entry.converter
    except InputError:  # the map of an old run may be gone
        converter = "odscen"
    pictures = JunctionPictures(light, drawing, ident="signal-ground")
    times = _times_of_day(light, scenario)
    return LightProgramInfo(
        id=light.id,
        junctions=list(light.junctions),
        control="actuated" if light.control == "actuated" else "fixed",
        origin=program_origin(light, scenario.signals, converter),
        groups=[
            LightGroupInfo(
                id=one.id, movements=list(one.movements), links=list(one.links), walk=one.walk
            )
            for one in light.groups
        ],
        plans=[_plan(light, plan, pictures, times.get(plan.id, [])) for plan in light.plans],
        detectors=[
            DetectorInfo(
                id=one.id,
                label=detector_label(light, one),
                stages=list(one.stages),
                call=one.call,
                bus=one.bus,
                ahead=one.ahead,
                length=one.length,
                gap=one.gap,
                calls=calls.get(one.id, []),
            )
            for one in light.detectors
        ],
        site=str(pictures.site() or ""),
        ground=str(pictures.ground() or ""),
        legend=[
            PictureKey(picture=str(legend_picture(shape)), words=words)
            for shape, words in legend_shapes([light])
        ],
    )


def _plan(
    light: LightProgram, plan: ShownPlan, pictures: JunctionPictures, times: list[float]
) -> DayPlanInfo:
    drawn = {one.stage.begin: one for one in pictures.stages(plan)}
    stages = []
    for stage in stage_spans(plan):
        one = drawn.get(stage.begin)
        stages.append(
            StageInfo(
                id=stage.id,
                begin=stage.begin,
                end=stage.end,
                split=stage.split,
                least=stage.least,
                most=stage.most,
                on_call=stage.on_call,
                groups=list(stage.groups(light)),
                permissive=list(stage.groups(light, "g")),
                words=stage_words(stage),
                picture="" if one is None else str(one.picture),
            )
        )
    return DayPlanInfo(
        id=plan.id,
        cycle=plan.cycle,
        offset=plan.offset,
        times=times,
        stages=stages,
        phases=[
            PhaseInfo(seconds=one.seconds, state=one.state, name=one.name, stage=one.stage)
            for one in plan.phases
        ],
        bars=str(plan_chart(light, plan, width=_WIDTH)),
        plot=plan_scale(light, plan, width=_WIDTH).shares,
    )


def _times_of_day(light: LightProgram, scenario: Scenario) -> dict[str, list[float]]:
    """Seconds of the day at which each plan of a light begins; empty without plans of the day."""
    return {
        plan.id: [seconds_of_day(time) for time in plan.times]
        for timing in scenario.signals.junctions
        if timing.junction in light.junctions
        for plan in timing.plans
    }


def _shown(states: pl.DataFrame) -> Iterator[Mapping[str, Any]]:
    """Rows of :class:`~odscen.web.wire.signal_messages.ShownStates`, which is not made of them.

    A day of a town has hundreds of thousands of changes.
    """
    for (light,), own in states.group_by("light", maintain_order=True):
        known: dict[str, int] = {}
        shown = [known.setdefault(state, len(known)) for state in own["state"].to_list()]
        yield {
            "light": light,
            "times": own["time"].round(3).to_list(),
            "shown": shown,
            "plans": own["program"].to_list(),
            "states": list(known),
        }


def _calls(light: LightProgram, folder: Path) -> _Calls:
    """Times in which the detectors of a light saw somebody."""
    import polars as pl

    table = read_calls(folder)
    if table is None:
        return {}
    found: _Calls = {}
    own = table.filter(pl.col("detector").is_in([one.id for one in light.detectors]))
    for detector, begin, end in own.select("detector", "begin", "end").iter_rows():
        found.setdefault(detector, []).append((begin, end))
    return found
