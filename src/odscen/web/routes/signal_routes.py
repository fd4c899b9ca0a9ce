"""Routes for traffic lights: programs in a scenario or a run, their timing, what was shown."""

from __future__ import annotations

from contextlib import suppress
from typing import TYPE_CHECKING, Annotated

import orjson
from fastapi import APIRouter, File, Form, UploadFile
from starlette.requests import Request
from starlette.responses import Response

from odscen.app.scenarios import read_scenario
from odscen.app.signals.green_waves import coordinate_signals
from odscen.app.signals.program_editing import stretch_cycle, take_over_program
from odscen.app.signals.signal_optimisation import time_signals
from odscen.app.signals.signal_plans import export_signals, signal_programs, take_signals
from odscen.app.signals.signal_views import (
    chosen_lights,
    detector_lanes,
    group_pairs,
    program_origin,
)
from odscen.app.signals.turn_arrows import arrow_words, with_turn_arrows
from odscen.base.errors import InputError, NotFoundError
from odscen.records.light_programs import programs_from_json, stage_spans
from odscen.reports.signal_charts import plan_chart, plan_scale
from odscen.reports.signal_pictures import (
    JunctionPictures,
    detector_label,
    stage_words,
)
from odscen.reports.signal_sheet import legend_picture, legend_shapes
from odscen.runs import layout
from odscen.runs.recorded import read_calls, read_light_states
from odscen.scenario.document.scenario_document import Scenario
from odscen.scenario.document.signals_document import Control
from odscen.scenario.edits.turn_treatment import crossing_turns
from odscen.scenario.signals.light import find_light, shortest_names
from odscen.scenario.signals.program_design import seconds_of_day
from odscen.web.large.large_documents import LargeDocumentRoute
from odscen.web.messages import OfVersion, ScenarioState, Version
from odscen.web.packed import UNCHANGED, answer, pack
from odscen.web.routes.scenario_routes import state_of
from odscen.web.services import Services, Shared
from odscen.web.wire.media_types import Responses
from odscen.web.wire.signal_messages import (
    CorridorWish,
    CycleWish,
    DayPlanInfo,
    DetectorInfo,
    DetectorLaneInfo,
    GroupPairInfo,
    LightGroupInfo,
    LightProgramInfo,
    MovementInfo,
    PhaseInfo,
    PictureKey,
    RunSignals,
    StageInfo,
    TimedSignalsState,
    TurnInfo,
    WebsterWish,
)

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping
    from pathlib import Path
    from typing import Any

    import polars as pl

    from odscen.app.maps import LoadedMap
    from odscen.drawing.map_drawing import MapDrawing
    from odscen.records.light_programs import LightProgram, ShownPlan
    from odscen.scenario.edits.turn_treatment import TurnTreatment
    from odscen.scenario.signals.light import Light

router = APIRouter(prefix="/api", route_class=LargeDocumentRoute)

_CONTROLS: dict[str, Control] = {"extended": "extended", "actuated": "actuated"}
"""Controls that are not fixed-time, by what runs say."""
_WIDTH = 384.0
"""Pixels of a time bar."""

_XML: Responses = {200: {"content": {"application/xml": {"schema": {"type": "string"}}}}}

_Calls = dict[str, list[tuple[float, float]]]


@router.get("/scenarios/{name}/signals/{junction}")
def of_scenario(name: str, junction: str, shared: Shared) -> LightProgramInfo:
    """What a light is told to show in a scenario, with all plans of the day."""
    scenario = shared.drafts.get(name).scenario
    lights = signal_programs(shared.workspace, scenario, whole_day=True)
    light = chosen_lights(lights, [junction])[0]
    info = _program_info(light, scenario, shared, {})
    loaded = shared.map_of(scenario)
    view = find_light(loaded.lights, light.junctions[0])
    return (
        info
        if view is None
        else info.model_copy(update=_editable_fields(light, view, scenario, loaded))
    )


@router.post("/scenarios/{name}/signals/{junction}/cycle")
def set_cycle(name: str, junction: str, wish: CycleWish, shared: Shared) -> ScenarioState:
    """Give a light another cycle: greens in proportion to what they are."""

    def change(scenario: Scenario) -> Scenario:
        return stretch_cycle(shared.workspace, scenario, junction, cycle=wish.cycle, plan=wish.plan)

    label = f"Cycle of light {junction}"
    return state_of(shared, shared.drafts.change(name, wish.version, label, change))


@router.post("/scenarios/{name}/signals/{junction}/own")
def take_over(name: str, junction: str, wish: OfVersion, shared: Shared) -> ScenarioState:
    """Make the map's program of a light one of the scenario, which can be changed."""

    def change(scenario: Scenario) -> Scenario:
        return take_over_program(shared.workspace, scenario, junction)

    label = f"Take over the program of {junction}"
    return state_of(shared, shared.drafts.change(name, wish.version, label, change))


@router.post("/scenarios/{name}/signal-times/webster")
def webster(name: str, wish: WebsterWish, shared: Shared) -> TimedSignalsState:
    """Time lights after the demand: cycle and splits by Webster's method."""
    scenario = shared.drafts.get(name).scenario
    # Made before the drafts are locked; a change meanwhile is another version, and refused.
    notes: tuple[str, ...] = ()
    if wish.turn_arrows:
        scenario, arrows = with_turn_arrows(shared.workspace, scenario, junctions=wish.junctions)
        notes = arrow_words(arrows)
    timed = time_signals(shared.workspace, scenario, junctions=wish.junctions)
    label = "Time lights after the demand"
    draft = shared.drafts.change(name, wish.version, label, lambda _: timed.scenario)
    state = state_of(shared, draft)
    return TimedSignalsState(state=state, notes=[*notes, *timed.to_words()], picture="")


@router.post("/scenarios/{name}/signal-times/corridor")
def corridor(name: str, wish: CorridorWish, shared: Shared) -> TimedSignalsState:
    """Coordinate lights: one cycle, and the offsets with the widest bands."""
    scenario = shared.drafts.get(name).scenario
    coordination = coordinate_signals(
        shared.workspace, scenario, junctions=wish.junctions, along=wish.along,
        favoured=wish.favoured, speed=wish.speed, cycle=wish.cycle,
    )  # fmt: skip
    draft = shared.drafts.change(
        name, wish.version, "Coordinate lights", lambda _: coordination.scenario
    )
    return TimedSignalsState(
        state=state_of(shared, draft),
        notes=list(coordination.to_words()),
        picture=coordination.to_svg(),
    )


@router.post("/scenarios/{name}/signal-times/import")
def import_programs(
    name: str,
    shared: Shared,
    file: Annotated[UploadFile, File(description="SUMO's programs: .tll.xml, .add.xml, .net.xml.")],
    version: Annotated[Version, Form()],
    junction: Annotated[str | None, Form(description="Only this light.")] = None,
) -> TimedSignalsState:
    """Take programs over from SUMO's ``tlLogic``, with ``WAUT`` as plans of the day, and loops."""
    scenario = shared.drafts.get(name).scenario
    given = file.filename or "file"
    made, notes = take_signals(
        shared.workspace, scenario, file.file.read(), file=given,
        junctions=() if junction is None else (junction,),
    )  # fmt: skip
    draft = shared.drafts.change(name, version, "Import signal programs", lambda _: made)
    return TimedSignalsState(state=state_of(shared, draft), notes=list(notes), picture="")


@router.get("/scenarios/{name}/signals.add.xml", response_class=Response, responses=_XML)
def export_programs(name: str, shared: Shared) -> Response:
    """SUMO's additional file with the programs that the scenario gives to lights."""
    text = export_signals(shared.workspace, shared.drafts.get(name).scenario)
    headers = {"Content-Disposition": f'attachment; filename="{name}.signals.add.xml"'}
    return Response(text, media_type="application/xml", headers=headers)


@router.get("/runs/{run}/signals", response_model=RunSignals, responses=UNCHANGED)
def of_run(run: str, request: Request, shared: Shared) -> Response:
    """What the lights of a finished run showed, and when."""
    states = read_light_states(shared.runs.kept.whole(run))
    lights = [] if states is None else list(_shown_states(states))
    return answer(request, pack(orjson.dumps({"lights": lights})))


@router.get("/runs/{run}/signals/{junction}")
def light_of_run(run: str, junction: str, shared: Shared) -> LightProgramInfo:
    """What a light is told to show in a run; of a finished one with the calls of its detectors."""
    folder = _finished_run_folder(run, shared)
    if folder is None:
        scenario = shared.runs.active(run).scenario
        lights = signal_programs(shared.workspace, scenario)
        return _program_info(chosen_lights(lights, [junction])[0], scenario, shared, {})
    scenario = read_scenario(folder / layout.SCENARIO_FILE)
    text = (folder / layout.LIGHTS_FILE).read_text(encoding="utf-8")
    light = chosen_lights(programs_from_json(text), [junction])[0]
    return _program_info(light, scenario, shared, _detector_calls(light, folder))


def _finished_run_folder(run: str, shared: Services) -> Path | None:
    """Folder of a run that has its lights in it; ``None`` if it is still under way here."""
    with suppress(NotFoundError):
        folder = shared.runs.kept.folder(run)
        if (folder / layout.LIGHTS_FILE).is_file():
            return shared.runs.kept.whole(run)
    shared.runs.active(run)
    return None


def _program_info(
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
        control=_CONTROLS.get(light.control, "fixed"),
        origin=program_origin(light, scenario.signals, converter),
        groups=[
            LightGroupInfo(
                id=group.id,
                movements=list(group.movements),
                links=list(group.links),
                walk=group.walk,
            )
            for group in light.groups
        ],
        plans=[_plan_info(light, plan, pictures, times.get(plan.id, [])) for plan in light.plans],
        detectors=[
            DetectorInfo(
                id=detector.id,
                label=detector_label(light, detector),
                stages=list(detector.stages),
                call=detector.call,
                bus=detector.bus,
                ahead=detector.ahead,
                length=detector.length,
                gap=detector.gap,
                calls=calls.get(detector.id, []),
                place=list(detector.place),
            )
            for detector in light.detectors
        ],
        turns=[],
        movements=[],
        pairs=[],
        lanes=[],
        site=str(pictures.site() or ""),
        ground=str(pictures.ground() or ""),
        legend=[
            PictureKey(picture=str(legend_picture(shape)), words=words)
            for shape, words in legend_shapes([light])
        ],
    )


def _editable_fields(
    light: LightProgram, view: Light, scenario: Scenario, loaded: LoadedMap
) -> dict[str, Any]:
    """What is needed to change a program: fields of a message that are empty in a run."""
    timings = scenario.signals.junctions
    own = next(
        (timing for timing in timings if timing.stages and timing.junction in view.names), None
    )
    group_of = {n: group.id for group in light.groups for n in group.links}
    names: dict[str, MovementInfo] = {}
    for n, movement in enumerate(view.movements):
        if not movement.turn:
            continue
        # Turns of an approach are told apart; where one leads to several roads, these are.
        for name in shortest_names(_movements_alike(n, view), view.movements):
            known = MovementInfo(name=name, walk=movement.walk, group=group_of.get(n, ""))
            names.setdefault(name, known)
    return {
        "turns": _turn_infos(light, view),
        "movements": list(names.values()),
        "pairs": [
            GroupPairInfo(**group_pair._asdict())
            for group_pair in (group_pairs(own, view) if own else ())
        ],
        "lanes": [
            DetectorLaneInfo(
                at=detector_lane.at, approach=detector_lane.approach, line=list(detector_lane.line)
            )
            for detector_lane in detector_lanes(loaded, view.names[0])
        ],
    }


def _movements_alike(movement: int, view: Light) -> set[int]:
    """Movements that turn as one does, from the same approach into the same road."""
    movement_view = view.movements[movement]
    return {
        n
        for n, other in enumerate(view.movements)
        if (other.approach, other.exit, other.turn)
        == (movement_view.approach, movement_view.exit, movement_view.turn)
    }


def _turn_infos(light: LightProgram, view: Light) -> list[TurnInfo]:
    """Turns across oncoming traffic, and how the stages of the first plan treat them."""
    states = [stage.state for stage in stage_spans(light.plans[0])]
    return [
        TurnInfo(
            approach=crossing_turn.approach,
            turn="left" if crossing_turn.turn == "left" else "right",
            treatment=_treatment_of_letters(
                {state[n] for state in states for n in crossing_turn.movements}
            ),
            alone=crossing_turn.alone,
        )
        for crossing_turn in crossing_turns(view)
    ]


def _treatment_of_letters(letters: set[str]) -> TurnTreatment:
    """How movements are treated that show these letters in the stages of a cycle."""
    if {"g", "G"} <= letters:
        return "both"
    return "protected" if "G" in letters else "permissive"


def _plan_info(
    light: LightProgram, plan: ShownPlan, pictures: JunctionPictures, times: list[float]
) -> DayPlanInfo:
    drawn = {stage.stage.begin: stage for stage in pictures.stages(plan)}
    stages = []
    for stage in stage_spans(plan):
        drawn_stage = drawn.get(stage.begin)
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
                picture="" if drawn_stage is None else str(drawn_stage.picture),
            )
        )
    return DayPlanInfo(
        id=plan.id,
        cycle=plan.cycle,
        offset=plan.offset,
        times=times,
        begins=list(plan.begins),
        stages=stages,
        phases=[
            PhaseInfo(seconds=phase.seconds, state=phase.state, name=phase.name, stage=phase.stage)
            for phase in plan.phases
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


def _shown_states(states: pl.DataFrame) -> Iterator[Mapping[str, Any]]:
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


def _detector_calls(light: LightProgram, folder: Path) -> _Calls:
    """Times in which the detectors of a light saw somebody."""
    import polars as pl

    table = read_calls(folder)
    if table is None:
        return {}
    calls: _Calls = {}
    own = table.filter(pl.col("detector").is_in([detector.id for detector in light.detectors]))
    for detector, begin, end in own.select("detector", "begin", "end").iter_rows():
        calls.setdefault(detector, []).append((begin, end))
    return calls
