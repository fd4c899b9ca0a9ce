"""The scenarios, and the study, that the pictures show: the same each time."""

from __future__ import annotations

from odscen.app.generation import generate
from odscen.app.maps import load_map
from odscen.app.scenarios import SUFFIX, write_scenario
from odscen.app.template_scenarios import template_scenario
from odscen.experiments.plan import StudyPlan, StudyRuns, StudyVariant
from odscen.experiments.studies import begin_study_of, carry_out_study
from odscen.experiments.work import LocalExecutor
from odscen.maps.shipped import shipped_maps
from odscen.maps.store import Workspace
from odscen.scenario import edits
from odscen.scenario.demand.count_stations import transitions
from odscen.scenario.document.measures_document import SpeedLimit
from odscen.scenario.document.rules_document import StoryRule
from odscen.scenario.document.scenario_document import MapReference, Scenario
from odscen.scenario.placing.region import Region
from odscen.scenario.sampling.generation_settings import GenerationSettings
from odscen.sumo.realize.road_users.planned_positions import planned_positions
from tests.signal_case import program
from tests.signal_case import scenario as lit_scenario

MAP = "town_5x5"
SMALL = "signal_crossing"
WEAVE = "motorway_weave"
SAMPLED = f"{MAP}-0005"
COUNTED, LONG, LIT, RULED, TIMED = "morning", "night", "signals", "mid-block", "timed"
SWEPT, STUDY, INFLOW, TOWN, ROADWORKS = "cut-in", "rain", "study-area", "evening", "roadworks"
PEAK = "peak"


def prepare(workspace: Workspace) -> None:
    """Add all maps that ship, and save every scenario."""
    for path in shipped_maps():
        workspace.add_map(path)
    sampled = GenerationSettings(map_name=MAP, seed=5, fill=0.15, roi_segments=7)
    generate(workspace, settings=sampled)
    for save in (counted, long, lit, ruled, timed, swept, inflow, town, peak, study):
        save(workspace)


def inflow(workspace: Workspace) -> None:
    """Save a scenario with vehicles that drive in from outside, and trips between zones."""
    graph = load_map(workspace.map(SMALL)).sumo.graph
    scenario = edits.new_scenario(graph, name=INFLOW, roi=graph.segments.ids)
    scenario = edits.set_clock(scenario, clock=7.0 * 3600)
    scenario = edits.set_input(
        scenario, graph, inflow="west", segment="r1", per_hour=950, mix={"car": 9, "truck": 1}
    )
    scenario = edits.set_matrix(
        scenario,
        graph,
        matrix="commuters",
        profile="weekday",
        trips=[("r2", "r4", 320), ("r4", "r2", 290), ("r3", "r1", 150)],
    )
    _save(workspace, INFLOW, edits.set_simulation(scenario, duration=3600.0))


def town(workspace: Workspace) -> None:
    """Save a scenario with traffic on all roads of the town, once to run and once to change."""
    graph = load_map(workspace.map(MAP)).sumo.graph
    mix = {"car": 16, "van": 2, "truck": 1, "bicycle": 1}
    for name in (TOWN, ROADWORKS):
        scenario = edits.new_scenario(graph, name=name, roi=graph.segments.ids)
        scenario = edits.set_background(scenario, graph, background="others", per_km=10, mix=mix)
        _save(workspace, name, edits.set_simulation(scenario, duration=600.0))


def peak(workspace: Workspace) -> None:
    """Save a scenario of a quarter of an hour with traffic at a light."""
    graph = load_map(workspace.map(SMALL)).sumo.graph
    scenario = edits.new_scenario(graph, name=PEAK, roi=graph.segments.ids)
    scenario = edits.set_background(scenario, graph, background="others", trips=400)
    _save(workspace, PEAK, edits.set_simulation(scenario, duration=900.0))


def counted(workspace: Workspace) -> None:
    """Save a scenario with background traffic and counts, some of which contradict each other."""
    graph = load_map(workspace.map(MAP)).sumo.graph
    scenario = edits.new_scenario(graph, name=COUNTED, roi=graph.segments.ids)
    scenario = edits.set_clock(scenario, clock=7.5 * 3600)
    mix = {"car": 8, "van": 1, "bicycle": 1}
    scenario = edits.set_background(
        scenario, graph, background="others", per_km=2, profile="weekday", mix=mix
    )
    streams = sorted(
        (one, other)
        for one, others in transitions(graph).items()
        for other in others
        if one.startswith("r")
    )[::3]
    rows = [(f"{one}>{other}", 0, 600, 5 + 7 * n % 30) for n, (one, other) in enumerate(streams)]
    scenario = edits.set_counts(scenario, graph, counts="survey", rows=rows)
    _save(workspace, COUNTED, scenario)


def long(workspace: Workspace) -> None:
    """Save a scenario of hours."""
    graph = load_map(workspace.map(SMALL)).sumo.graph
    scenario = edits.new_scenario(graph, name=LONG, roi=graph.segments.ids)
    scenario = edits.set_simulation(scenario, duration=24 * 3600, step_length=1.0)
    scenario = edits.set_background(scenario, graph, background="others", trips=1200)
    _save(workspace, LONG, scenario)


def lit(workspace: Workspace) -> None:
    """Save a scenario with the signal program of the guide."""
    info = workspace.map(SMALL).info
    one = lit_scenario(program(), control="actuated", clock=12 * 3600.0, until=300.0)
    reference = MapReference(name=SMALL, sha256=info["sha256"])
    _save(workspace, LIT, one.model_copy(update={"map": reference}))


def ruled(workspace: Workspace) -> None:
    """Save a scenario in which a pedestrian crosses the road in front of the ego."""
    graph = load_map(workspace.map(SMALL)).sumo.graph
    scenario = edits.new_scenario(graph, name=RULED, roi=graph.segments.ids)
    scenario = edits.set_simulation(scenario, duration=40.0)
    for category, spawn in (("car", "1.0.-2.6"), ("pedestrian", "ped.1.0.-4.28")):
        scenario = edits.add_actor(scenario, graph, category=category, spawn=spawn)
    scenario = edits.set_ego(scenario, actor="car-1")
    rule = StoryRule.model_validate(
        {
            "id": "crosses",
            "actor": "pedestrian-1",
            "when": {"reaches": {"of": "car-1", "place": "1.0.-2.16", "within": 5}},
            "then": [{"walk": {"to": (90.0, -8.0), "speed": 1.5}}],
        }
    )
    _save(workspace, RULED, edits.set_rule(scenario, graph, rule=rule))


def timed(workspace: Workspace) -> None:
    """Save a scenario in which everything has its time."""
    loaded = load_map(workspace.map(SMALL))
    graph = loaded.sumo.graph
    scenario = edits.new_scenario(graph, name=TIMED, roi=graph.segments.ids)
    scenario = edits.fill_roi(scenario, graph, loaded.usable, share=0.08, seed=4)
    for number, actor in enumerate(scenario.actors):
        scenario = edits.change_actor(scenario, actor.id, depart=3.0 * number)
    assets = workspace.assets()
    region = Region.of(graph, scenario.roi)
    plan = planned_positions(scenario, loaded.sumo, region, assets)
    cars = [n for n, user in enumerate(plan.users) if user.category == "car"]
    spent = {n: plan.time[plan.first[n + 1] - 1] - plan.users[n].depart for n in cars}
    # The car that is longest on its way, early enough.
    ego = plan.users[max(cars[:5], key=lambda n: spent[n])].id
    scenario = edits.set_ego(scenario, actor=ego)
    scenario = edits.add_flow(
        scenario, graph, spawn="1.0.-2.6", per_hour=500, id="from-the-west", begin=10, end=50
    )
    rule = StoryRule.model_validate(
        {
            "id": "brakes",
            "actor": ego,
            "when": {"time": {"after": 18}},
            "then": [{"brake": {"by": 4, "hold": 2}}],
        }
    )
    scenario = edits.set_rule(scenario, graph, loaded.lights, rule=rule)
    slower = SpeedLimit(
        kind="speed_limit", id="slower", places=("r1",), speed=8.3, begin=20, end=60
    )
    scenario = edits.set_measure(scenario, graph, loaded.lights, measure=slower)
    _save(workspace, TIMED, edits.set_simulation(scenario, duration=90.0))


def swept(workspace: Workspace) -> None:
    """Save the cut-in of the guide, of 20 s."""
    _save(workspace, SWEPT, edits.set_simulation(cut_in(workspace), duration=20.0))


def cut_in(workspace: Workspace) -> Scenario:
    """The cut-in of the template with two parameters."""
    scenario = template_scenario(workspace, SWEPT, WEAVE, values={}, name=SWEPT)
    for name, value, unit, low, high, places in (
        ("ttc", 2.0, "s", 0.4, 4.0, ("rules/cut-in/when/ttc/below",)),
        ("challenger_speed", 11.0, "m/s", 5.0, 15.0, (
            "actors/challenger/speed", "actors/challenger/initial_speed",
            "rules/cruise/then/0/speed/to",
        )),
    ):  # fmt: skip
        scenario = edits.set_parameter(
            scenario, parameter=name, value=value, unit=unit, min=low, max=high
        )
        for place in places:
            scenario = edits.set_formula(scenario, place=place, formula=f"${name}")
    return scenario


def _save(workspace: Workspace, name: str, scenario: Scenario) -> None:
    write_scenario(scenario, workspace.scenarios / f"{name}{SUFFIX}")


def study(workspace: Workspace) -> None:
    """Carry out a study of one scenario in three kinds of weather."""
    settings = GenerationSettings(map_name=SMALL, seed=5, fill=0.3)
    scenario = generate(workspace, settings=settings)[0].name
    weather = ("WetNoon", "HardRainNoon")
    edited = [({"kind": "set_environment", "preset": one},) for one in weather]
    plan = StudyPlan(
        name=STUDY,
        scenarios=(scenario,),
        seeds=tuple(range(1, 11)),
        variant=tuple(StudyVariant(name=n, edits=e) for n, e in zip(weather, edited, strict=True)),
        run=StudyRuns(until=60.0),
    )
    out = workspace.studies / STUDY
    begin_study_of(workspace, plan, out, beside=workspace.scenarios)
    carry_out_study(out, LocalExecutor(workspace, 2))
