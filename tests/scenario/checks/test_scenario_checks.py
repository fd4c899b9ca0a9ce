from collections.abc import Mapping
from dataclasses import replace
from typing import Any, ClassVar

import numpy as np
import pytest

from odscen.base.arrays import BoolArray
from odscen.base.categories import Body, Category
from odscen.base.errors import ScenarioError
from odscen.lanegraph.graphs import MapGraph
from odscen.lanegraph.shortest_paths import Router
from odscen.scenario.checks.scenario_checks import check, every_problem
from odscen.scenario.document.problems import Problem, refuse_errors
from odscen.scenario.document.scenario_document import (
    Actor,
    Environment,
    Flow,
    MapReference,
    Scenario,
)
from odscen.scenario.signals.light import Light
from tests.graphs import SHA256, fork, line_of_segments, two_lane_road

GRAPH = fork()
MAP = MapReference(name="toy", sha256=SHA256)
WHOLE = ("r1", "j9", "r2", "r3")


class Catalogue:
    """Three models, one preset."""

    models: ClassVar = {
        "car.small": (Category.CAR, Body(3.0, 1.5, 1.4)),
        "car.huge": (Category.CAR, Body(20.0, 3.4, 3.0)),
        "bus.one": (Category.BUS, Body(12.0, 2.5, 3.0)),
    }

    def category_of(self, model: str) -> Category | None:
        return self.models[model][0] if model in self.models else None

    def dimensions(self, model: str) -> Body | None:
        return self.models[model][1] if model in self.models else None

    def weather(self, preset: str) -> Mapping[str, float] | None:
        return {"wetness": 0.0} if preset == "ClearNoon" else None


def actor(spawn: str = "1.0.-1.10", **fields: Any) -> Actor:
    return Actor.model_validate({"id": "a", "category": "car", "spawn": spawn} | fields)


def scenario(*actors: Actor, **fields: Any) -> Scenario:
    return Scenario.model_validate(
        {"name": "test", "map": MAP, "roi": WHOLE, "actors": actors} | fields
    )


def problems(*actors: Actor, graph: MapGraph = GRAPH, **fields: Any) -> tuple[Problem, ...]:
    return check(scenario(*actors, **fields), graph, Catalogue())


def codes(*actors: Actor, graph: MapGraph = GRAPH, **fields: Any) -> list[str]:
    return [problem.code for problem in problems(*actors, graph=graph, **fields)]


def test_a_good_scenario_has_no_problems() -> None:
    assert codes(actor(), actor("1.0.-1.20", id="b", goal="3.0.-1.29", ego=True)) == []


@pytest.mark.parametrize(
    ("one", "code", "where"),
    [
        (actor("9.9.9.9"), "unknown_spawn", "actors[0].spawn"),
        (actor("1.0.-1.50"), "unknown_spawn", "actors[0].spawn"),
        (actor("ped.1.0.-2.0"), "wrong_graph", "actors[0].spawn"),
        (actor(category="pedestrian"), "wrong_graph", "actors[0].spawn"),
        (actor("1.0.1.49"), "no_goal", "actors[0].spawn"),
        (actor(goal="8.8.8.8"), "unknown_goal", "actors[0].goal"),
        (actor(goal="1.0.1.49"), "goal_unreachable", "actors[0].goal"),
        (actor(goal="1.0.-1.10"), "goal_unreachable", "actors[0].goal"),
        (actor(goal="ped.1.0.-2.9"), "goal_unreachable", "actors[0].goal"),
        (actor(goal="1.0.-1.30"), "goal_not_candidate", "actors[0].goal"),
        (actor(via=["8.8.8.8"]), "unknown_via", "actors[0].via[0]"),
        (actor(via=["1.0.1.49"]), "via_unreachable", "actors[0].via[0]"),
        (actor(via=["1.0.-1.30", "1.0.-1.20"]), "via_unreachable", "actors[0].via[1]"),
        (actor(via=["ped.1.0.-2.9"]), "via_unreachable", "actors[0].via[0]"),
        (actor(via=["2.0.-1.3"], goal="3.0.-1.29"), "goal_unreachable", "actors[0].goal"),
        (actor(via=["2.0.-1.29"]), "no_goal", "actors[0].spawn"),
        (
            actor(
                "ped.1.0.-2.9", category="pedestrian", via=["ped.1.0.-2.20"], goal="ped.1.0.-2.0"
            ),
            "via_turns_round",
            "actors[0].via",
        ),
        (actor(lateral_offset=1.8), "off_lane", "actors[0].lateral_offset"),
        (actor(lateral_offset=-1.0), "body_over_border", "actors[0].lateral_offset"),
        (actor(speed=90), "speed_implausible", "actors[0].speed"),
        (actor(speed=0.5), "speed_implausible", "actors[0].speed"),
        (actor(model="car.none"), "unknown_model", "actors[0].model"),
        (actor(model="bus.one"), "model_of_other_category", "actors[0].model"),
        (actor(depart=600), "departs_too_late", "actors[0].depart"),
        (actor("91.0.-1.4"), "tight_curve", "actors[0].spawn"),
    ],
)
def test_each_rule_for_one_actor_names_its_place(one: Actor, code: str, where: str) -> None:
    assert [(p.code, p.where) for p in problems(one)] == [(code, where)]


def test_a_spawn_or_goal_outside_the_region_names_the_segment_to_add() -> None:
    outside = problems(actor("2.0.-1.3"), roi=("r1", "j9"))
    assert [(p.code, p.segments) for p in outside] == [("spawn_outside_roi", ("r2",))]
    far = problems(actor(goal="2.0.-1.29"), roi=("r1", "j9"))
    assert [(p.code, p.segments) for p in far] == [("goal_outside_roi", ("r2",))]
    assert "add the segment" in far[0].message
    passed = problems(actor(via=["2.0.-1.3"]), roi=("r1", "j9"))
    assert [(p.code, p.segments) for p in passed] == [("via_outside_roi", ("r2",))]


def test_a_route_may_lead_through_places_in_their_order() -> None:
    assert codes(actor(via=["1.0.-1.30", "90.0.-1.4", "2.0.-1.3"], goal="2.0.-1.29")) == []
    walker = actor("ped.1.0.-2.0", category="pedestrian", via=["ped.1.0.-2.20", "ped.2.0.-2.3"])
    assert codes(walker) == []


def test_the_end_of_the_region_is_a_goal_inside_a_junction_too() -> None:
    assert codes(actor(goal="90.0.-1.9"), roi=("r1", "j9")) == []


def test_bodies_that_overlap_are_found_with_their_offsets_and_models() -> None:
    road = two_lane_road()
    beside = actor("1.0.-1.10"), actor("1.0.-2.10", id="b")
    assert codes(*beside, graph=road, roi=("r1",)) == []
    near = [
        actor("1.0.-1.10", lateral_offset=-0.9),
        actor("1.0.-2.10", id="b", lateral_offset=0.9),
    ]
    assert "bodies_overlap" in codes(*near, graph=road, roi=("r1",))
    # 4 m apart on a lane: 5 m long cars overlap, 3 m long ones do not.
    behind = actor("1.0.-1.10"), actor("1.0.-1.12", id="b")
    assert codes(*behind, graph=road, roi=("r1",)) == ["bodies_overlap"]
    small = [one.model_copy(update={"model": "car.small"}) for one in behind]
    assert codes(*small, graph=road, roi=("r1",)) == []
    later = behind[0], behind[1].model_copy(update={"depart": 5.0})
    assert codes(*later, graph=road, roi=("r1",)) == []


def test_a_node_carries_one_actor_or_one_flow() -> None:
    flow = Flow(id="f", spawn="1.0.-1.10", per_hour=100)
    assert codes(actor(), actor(id="b", depart=9)) == ["node_taken"]
    assert codes(actor(), flows=(flow,)) == ["node_taken"]
    led = actor(id="b", driver="story", longitudinal_offset=6.0)
    assert codes(actor(), led) == []
    on_it = led.model_copy(update={"longitudinal_offset": 0.0})
    assert codes(actor(driver="story"), on_it) == codes(actor(), on_it) == ["bodies_overlap"]


def test_flows_follow_one_another_on_a_node() -> None:
    steps = [
        Flow(id=f"f{n}", spawn="1.0.-1.10", per_hour=100 * n, begin=60.0 * n, end=60.0 * (n + 1))
        for n in (1, 2, 3)
    ]
    assert codes(flows=tuple(steps)) == []
    longer = steps[0].model_copy(update={"end": 121.0})
    assert codes(flows=(steps[1], longer)) == ["node_taken"]
    assert codes(actor(depart=9), flows=tuple(steps)) == ["node_taken"]


def test_ids_are_given_once_and_the_ego_is_one_vehicle() -> None:
    twice = codes(actor(), actor("1.0.-1.20"))
    assert twice == ["duplicate_id"]
    assert codes(actor(ego=True), actor("1.0.-1.20", id="b", ego=True)) == ["several_egos"]
    walker = actor("ped.1.0.-2.0", category="pedestrian", ego=True)
    assert codes(walker) == ["ego_not_vehicle"]


def test_the_region_is_checked() -> None:
    line = line_of_segments()
    assert codes(graph=line, roi=()) == ["roi_empty", "no_actors"]
    assert codes(graph=line, roi=("r1", "r3")) == ["roi_not_connected", "no_actors"]
    beside = [pair for pair in line.segments.adjacency.tolist() if 3 not in pair]
    pairs = np.array(beside, dtype=line.segments.adjacency.dtype)
    parted = replace(line, segments=replace(line.segments, adjacency=pairs))
    ids = parted.segments.ids
    assert codes(graph=parted, roi=ids[:3] + ids[4:]) == ["no_actors"]
    assert codes(graph=parted, roi=ids[:2] + ids[4:]) == ["roi_not_connected", "no_actors"]
    assert codes(graph=line, roi=("r1", "r9", "r1")) == [
        "unknown_segment",
        "segment_twice",
        "no_actors",
    ]


def test_another_map_is_the_first_problem_and_silences_the_rest() -> None:
    other = MapReference(name="toy", sha256="1" * 64)
    assert codes(actor("9.9.9.9"), map=other) == ["map_mismatch"]
    coarse = MapReference(name="toy", sha256=SHA256, spacing=5)
    assert codes(actor("9.9.9.9"), map=coarse) == ["spacing_mismatch"]


def test_flows_are_checked() -> None:
    flow = Flow(id="f", spawn="1.0.-1.0", per_hour=100, begin=100, end=100)
    assert codes(flows=(flow,)) == ["flow_window_empty"]
    mixed = Flow(
        id="f", spawn="1.0.-1.0", per_hour=9, mix={Category.CAR: 1, Category.PEDESTRIAN: 1}
    )
    assert codes(flows=(mixed,)) == ["wrong_graph"]
    late = Flow(id="f", spawn="1.0.-1.0", per_hour=9, begin=700)
    assert codes(flows=(late,)) == ["departs_too_late"]
    fast = Flow(id="f", spawn="1.0.-1.0", per_hour=9, speed=8.0, initial_speed=9.0)
    assert codes(flows=(fast,)) == ["initial_speed_too_high"]
    on_foot = Flow(
        id="f", spawn="ped.1.0.-2.0", per_hour=9, mix={Category.PEDESTRIAN: 1}, initial_speed=9.0
    )
    assert codes(flows=(on_foot,)) == []


def test_weather_is_looked_up_in_the_catalogue() -> None:
    assert codes(actor(), environment=Environment(preset="Hail")) == ["unknown_preset"]
    odd = Environment(parameters={"frogs": 1.0, "wetness": 3.0})
    assert codes(actor(), environment=odd) == ["unknown_parameter"]


def test_a_headway_shorter_than_a_step_is_an_error_with_both_numbers() -> None:
    short = {"drivers": {"headway": 0.6}, "simulation": {"step_length": 1.0}}
    (problem,) = problems(actor(), **short)
    assert (problem.code, problem.where) == ("headway_below_step", "drivers.headway")
    assert "0.6 s" in problem.message
    assert "1 s" in problem.message
    assert "headway_below_step" not in codes(actor(), drivers={"headway": 0.6})


def test_a_style_is_one_of_the_three_or_a_driver_set_of_the_scenario() -> None:
    (problem,) = problems(actor(style="learners"))
    assert (problem.code, problem.where) == ("unknown_style", "actors[0].style")
    assert "there are cautious, normal, sporty" in problem.message
    sets = {"sets": [{"id": "learners"}]}
    assert "unknown_style" not in codes(actor(style="learners"), drivers=sets)


def test_all_problems_come_at_once() -> None:
    found = problems(
        actor("9.9.9.9", speed=90, ego=True), actor("1.0.1.49", id="b", ego=True), roi=(*WHOLE, "x")
    )
    assert [p.code for p in found] == [
        "unknown_segment",
        "several_egos",
        "speed_implausible",
        "unknown_spawn",
        "no_goal",
    ]
    assert [p.severity for p in found] == ["error", "error", "warning", "error", "error"]


LIGHTS = (Light(("5", "6"), (20.0, 20.0, 7.0)), Light(("X0",), (30.0, 7.0)))


def signal_codes(
    *timings: dict[str, Any], lights: tuple[Light, ...] = LIGHTS
) -> list[tuple[str, str]]:
    timed = scenario(actor(), signals={"junctions": timings})
    return [(p.code, p.where) for p in check(timed, GRAPH, lights=lights)]


def test_lights_are_timed_by_any_of_their_junctions_or_by_their_own_id() -> None:
    good = {"junction": "6", "green": [5, 60, 7]}, {"junction": "X0", "control": "actuated"}
    assert signal_codes(*good) == []


@pytest.mark.parametrize(
    ("timings", "code", "where"),
    [
        ([{"junction": "7"}], "unknown_light", "junctions[0].junction"),
        ([{"junction": "J5"}], "unknown_light", "junctions[0].junction"),
        ([{"junction": "5"}, {"junction": "6"}], "light_twice", "junctions[1].junction"),
        ([{"junction": "5", "green": [9, 9]}], "wrong_number_of_greens", "junctions[0].green"),
        ([{"junction": "X0", "green": [9, 4.9]}], "green_too_short", "junctions[0].green[1]"),
    ],
)
def test_timing_that_a_light_cannot_have_is_reported(
    timings: list[dict[str, Any]], code: str, where: str
) -> None:
    assert signal_codes(*timings) == [(code, f"signals.{where}")]


def test_a_program_of_its_own_cannot_be_extended() -> None:
    own = {
        "groups": [{"id": "V1", "movements": ["r1 straight"]}],
        "stages": [{"id": "1", "protected": ["V1"], "green": 20}],
    }
    code = ("extended_needs_map_stages", "signals.junctions[0].control")
    assert code in signal_codes({"junction": "X0", "control": "extended", **own})
    assert code not in signal_codes({"junction": "X0", **own})
    assert signal_codes({"junction": "X0", "control": "extended"}) == []


def test_an_unknown_light_is_named_with_those_that_there_are() -> None:
    timed = scenario(actor(), signals={"junctions": [{"junction": "7"}]})
    (problem,) = check(timed, GRAPH, lights=LIGHTS)
    assert "'7'; there are lights in '5', '6', 'X0'" in problem.message
    (problem,) = check(timed, GRAPH, lights=())
    assert "the map has no traffic lights" in problem.message
    assert check(timed, GRAPH) == ()


def test_a_wrong_number_of_greens_is_answered_with_those_of_the_program() -> None:
    timed = scenario(actor(), signals={"junctions": [{"junction": "X0", "green": [9]}]})
    (problem,) = check(timed, GRAPH, lights=LIGHTS)
    assert problem.severity == "warning", "scenarios of before the network changed still run"
    assert "2 stages, but green has 1 times; they are not used" in problem.message
    assert "give one for each (the map's are 30, 7)" in problem.message


def test_of_very_many_problems_of_one_kind_the_first_thousand_are_listed_and_all_counted() -> None:
    lost = [actor("9.9.9.9", id=f"a{n}") for n in range(1500)]
    found = [one for one in problems(*lost) if one.code == "unknown_spawn"]
    assert len(found) == 1001
    assert (found[-1].severity, found[-1].where) == ("error", "actors")
    assert found[-1].message == "and 500 more of this kind"
    with pytest.raises(ScenarioError) as refused:
        refuse_errors(every_problem(scenario(*lost), GRAPH))
    # All of them, and one that they start on the same node.
    assert refused.value.problem == "the scenario has 1501 errors"
    assert refused.value.problems[-1] == "actors: and 500 more of this kind"


def test_inputs_to_zones_look_for_entries_and_zones_once(monkeypatch: pytest.MonkeyPatch) -> None:
    searches: list[int] = []
    search = Router.reachable

    def counted(router: Router, node: int) -> BoolArray:
        searches.append(node)
        return search(router, node)

    monkeypatch.setattr(Router, "reachable", counted)
    number = 300
    demand = {
        "zones": [{"id": f"z{n}", "segments": ["r2"]} for n in range(number)],
        "inputs": [
            {"id": f"i{n}", "segment": "r1", "direction": "forward", "per_hour": 1.0}
            | {"to": ((f"z{n}", 1.0),)}
            for n in range(number)
        ],
    }
    assert codes(demand=demand) == []
    assert len(searches) == 1
