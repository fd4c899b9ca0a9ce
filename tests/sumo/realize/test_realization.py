from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from lxml import etree

from odscen.base.categories import Body, Category
from odscen.base.errors import ScenarioError
from odscen.runs.recording import Recording
from odscen.runs.run_settings import RunSettings, SliceLength
from odscen.scenario.document.scenario_document import (
    Actor,
    Environment,
    Flow,
    MapReference,
    Scenario,
    Simulation,
)
from odscen.sumo.realize.realization import Realization, realize, slices_of
from tests.graphs import SHA256
from tests.sumo.toys import sumo_map


class ToyAssets:
    def dimensions(self, model: str) -> Body | None:
        return {"big": Body(8.0, 2.5, 3.0)}.get(model)

    def electric(self, model: str) -> bool:
        return model == "quiet"

    def weather(self, preset: str) -> dict[str, float] | None:
        return {"Storm": {"precipitation": 100.0, "wetness": 100.0}}.get(preset)


def scenario(**changes: Any) -> Scenario:
    actors = (
        Actor(id="b", category=Category.CAR, spawn="1.0.-2.20", goal="3.0.-2.49", ego=True),
        Actor(id="a", category=Category.BUS, spawn="1.0.-1.10", lateral_offset=0.3, speed=9.0),
        Actor(id="w", category=Category.PEDESTRIAN, spawn="ped.1.0.-3.5", lateral_offset=-0.2),
        Actor(id="late", category=Category.BICYCLE, spawn="1.0.-2.5", depart=12.5),
    )
    values: dict[str, Any] = {
        "name": "toy",
        "map": MapReference(name="toy", sha256=SHA256),
        "seed": 5,
        "roi": ("r1", "j9", "r3"),
        "actors": actors,
        "simulation": Simulation(duration=100.0, step_length=0.5),
    }
    return Scenario(**{**values, **changes})


def routes(realized: Realization) -> etree._Element:
    return etree.fromstring(realized.files["routes.rou.xml"].encode())


def types(realized: Realization) -> dict[str, dict[str, str]]:
    return {t.attrib["id"]: dict(t.attrib) for t in routes(realized).iterfind("vType")}


def test_everybody_is_written_once_by_departure_then_id() -> None:
    realized = realize(scenario(), sumo_map())
    people = [e.attrib["id"] for e in routes(realized) if e.tag in ("vehicle", "person")]
    assert people == ["a", "b", "w", "late"]
    assert [actor.id for actor in realized.plan.actors] == people
    assert realized.problems == ()


def test_the_same_scenario_gives_the_same_bytes_whatever_the_order_of_its_actors() -> None:
    one = realize(scenario(), sumo_map())
    assert realize(scenario(), sumo_map()).files == one.files
    turned = scenario(actors=scenario().actors[::-1])
    assert realize(turned, sumo_map()).files == one.files
    assert realize(scenario(), sumo_map(), settings=RunSettings(seed=6)).files != one.files


def test_the_plan_says_where_each_body_is_to_stand() -> None:
    plan = {actor.id: actor for actor in realize(scenario(), sumo_map()).plan.actors}
    bus = plan["a"]
    assert (bus.x, bus.y, bus.hdg) == (21.0, pytest.approx(-1.75 + 0.3), 0.0)
    assert (bus.length, bus.ego, plan["b"].ego) == (12.0, False, True)
    assert plan["w"].y == pytest.approx(-8.0 - 0.2)
    assert plan["b"].route_length == pytest.approx(219.0 - 41.0)


def test_a_vehicle_has_place_and_speed_factor_and_speed_in_the_files() -> None:
    realized = realize(scenario(), sumo_map())
    bus = next(v for v in routes(realized).iterfind("vehicle") if v.attrib["id"] == "a")
    assert bus.attrib["departPos"] == "27"
    assert bus.attrib["departLane"] == "2"
    assert bus.attrib["departPosLat"] == "0.3"
    assert bus.attrib["insertionChecks"] == "none"
    planned = next(actor for actor in realized.plan.actors if actor.id == "a")
    assert float(bus.attrib["speedFactor"]) == planned.speed_factor
    assert types(realized)[bus.attrib["type"]]["maxSpeed"] == "9"
    late = next(v for v in routes(realized).iterfind("vehicle") if v.attrib["id"] == "late")
    assert "insertionChecks" not in late.attrib


def test_a_vehicle_changes_lanes_to_pass_a_place() -> None:
    straight = Actor(id="a", category=Category.CAR, spawn="1.0.-1.5", goal="3.0.-1.49")
    round_ = straight.model_copy(update={"id": "b", "via": ("3.0.-2.20",)})
    plan = realize(scenario(actors=(straight, round_)), sumo_map()).plan
    lengths = {actor.id: actor.route_length for actor in plan.actors}
    # Out of its lane and back into it: two changes of 3.5 m, each over a node's distance of 2 m.
    assert lengths["a"] < lengths["b"] < lengths["a"] + 2 * (3.5**2 + 2**2) ** 0.5


def test_a_person_walks_through_its_places_in_one_walk() -> None:
    walker = Actor(
        id="w", category=Category.PEDESTRIAN, spawn="ped.1.0.-3.5", goal="ped.3.0.-3.40",
        via=("ped.1.0.-3.30", "ped.3.0.-3.10"),
    )  # fmt: skip
    realized = realize(scenario(actors=(walker,)), sumo_map())
    assert realized.problems == ()
    [person] = routes(realized).iterfind("person")
    assert [stage.attrib["edges"] for stage in person.iterfind("walk")] == ["in out"]


def test_an_open_goal_is_drawn_by_the_seed() -> None:
    goals = {
        realize(scenario(), sumo_map(), settings=RunSettings(seed=s)).plan.actors[0].goal
        for s in range(12)
    }
    assert goals == {"3.0.-1.49", "3.0.-2.49"}


def test_a_models_size_counts_where_the_catalogue_knows_it() -> None:
    actors = (
        Actor(id="a", category=Category.TRUCK, model="big", spawn="1.0.-2.10"),
        Actor(id="b", category=Category.TRUCK, model="gone", spawn="1.0.-2.30"),
    )
    plan = realize(scenario(actors=actors), sumo_map(), ToyAssets()).plan
    assert [actor.length for actor in plan.actors] == [8.0, 7.1]


def test_a_model_without_exhaust_emits_as_one() -> None:
    actors = (
        Actor(id="a", category=Category.CAR, model="quiet", spawn="1.0.-2.10"),
        Actor(id="b", category=Category.CAR, model="gone", spawn="1.0.-2.30"),
    )
    realized = realize(scenario(actors=actors), sumo_map(), ToyAssets())
    kinds = routes(realized).iterfind("vType")
    assert [kind.attrib["emissionClass"] for kind in kinds] == [
        "HBEFA4/PC_BEV",
        "HBEFA4/PC_petrol_Euro-4",
    ]


def test_vehicles_and_nobody_else_watch_how_close_they_come() -> None:
    actors = (
        Actor(id="a", category=Category.CAR, spawn="1.0.-2.10"),
        Actor(id="p", category=Category.PEDESTRIAN, spawn="ped.1.0.-3.10"),
    )
    realized = realize(
        scenario(actors=actors),
        sumo_map(),
        settings=RunSettings(recording=Recording(criticality=True)),
    )
    watching = {kind.get("id"): len(kind) for kind in routes(realized).iterfind("vType")}
    assert watching == {"car.0": 1, "pedestrian.0": 0}
    assert "device.ssm.file" in realized.files["scenario.sumocfg"]


def test_equal_types_are_written_once() -> None:
    actors = tuple(
        Actor(id=f"c{i}", category=Category.CAR, spawn=f"1.0.-2.{5 * i}") for i in range(5)
    )
    realized = realize(scenario(actors=actors), sumo_map())
    assert list(types(realized)) == ["car.0"]
    factors = {v.attrib["speedFactor"] for v in routes(realized).iterfind("vehicle")}
    assert len(factors) == 5


def test_weather_can_be_switched_off_twice() -> None:
    storm = scenario(environment=Environment(preset="Storm"))
    wet = realize(storm, sumo_map(), ToyAssets())
    dry = realize(scenario(), sumo_map(), ToyAssets())
    assert wet.files != dry.files
    assert (
        realize(storm, sumo_map(), ToyAssets(), settings=RunSettings(weather=False)).files
        == dry.files
    )
    off = scenario(environment=Environment(preset="Storm", affects_driving=False))
    assert realize(off, sumo_map(), ToyAssets()).files == dry.files
    by_hand = Environment(parameters={"precipitation": 100.0, "wetness": 100.0})
    assert realize(scenario(environment=by_hand), sumo_map()).files == wet.files


def test_flows_are_drawn_member_by_member() -> None:
    mix = {Category.CAR: 3.0, Category.TRUCK: 1.0}
    flow = Flow(id="f", spawn="1.0.-2.3", per_hour=3600, begin=10.0, end=410.0, mix=mix)
    crowd = scenario(
        actors=(), flows=(flow,), simulation=Simulation(duration=1000.0, step_length=0.5)
    )
    plan = realize(crowd, sumo_map()).plan
    assert {actor.flow for actor in plan.actors} == {"f"}
    assert 340 < len(plan.actors) < 460
    departs = np.array([actor.depart for actor in plan.actors])
    assert departs.min() >= 10.0
    assert departs.max() < 410.0
    gaps = np.diff(departs)
    assert gaps.std() == pytest.approx(gaps.mean(), rel=0.2)  # exponential headways
    cars = sum(actor.category == "car" for actor in plan.actors)
    assert cars / len(plan.actors) == pytest.approx(0.75, abs=0.08)
    assert len({actor.goal for actor in plan.actors}) == 2


def test_members_of_a_flow_depart_with_its_initial_speed() -> None:
    flow = Flow(id="f", spawn="1.0.-2.3", per_hour=3600, end=50.0, initial_speed=7.0)
    at_rest = flow.model_copy(update={"id": "g", "initial_speed": None})
    vehicles = routes(realize(scenario(actors=(), flows=(flow, at_rest)), sumo_map()))
    speeds = {v.attrib["id"][0]: set[str]() for v in vehicles.iterfind("vehicle")}
    for vehicle in vehicles.iterfind("vehicle"):
        speeds[vehicle.attrib["id"][0]].add(vehicle.attrib["departSpeed"])
    assert speeds == {"f": {"7"}, "g": {"0"}}


def test_a_shorter_run_has_the_first_members_of_the_same_flow() -> None:
    flow = Flow(id="f", spawn="1.0.-2.3", per_hour=1800, end=3600.0)
    crowd = scenario(actors=(), flows=(flow,), simulation=Simulation(duration=600.0))
    long = realize(crowd, sumo_map()).plan.actors
    short = realize(crowd, sumo_map(), settings=RunSettings(until=100.0)).plan.actors
    assert short == long[: len(short)]
    assert short
    assert max(actor.depart for actor in short) < 100.0


def test_an_actor_without_a_way_in_sumo_is_in_the_plan_and_not_in_the_files() -> None:
    where = sumo_map()
    cut = type(where)(
        where.graph, type(where.net)(where.net.lanes, ()), where.lane_places, where.walk_places,
        where.net_offset,
    )  # fmt: skip
    realized = realize(scenario(), cut)
    assert len(realized.plan.actors) == 4
    assert len(realized.problems) == 3
    assert "no way for passenger from edge in to out" in "\n".join(realized.problems)
    assert [actor.id for actor in realized.plan.actors if actor.problem] == ["a", "b", "late"]
    assert not list(routes(realized).iterfind("vehicle"))


def test_a_flow_member_and_an_actor_cannot_share_a_name() -> None:
    flow = Flow(id="x", spawn="1.0.-2.3", per_hour=3600)
    actor = Actor(id="x.0", category=Category.CAR, spawn="1.0.-1.3")
    with pytest.raises(ScenarioError, match="same name"):
        realize(scenario(actors=(actor,), flows=(flow,)), sumo_map())


def test_settings_of_the_run_are_in_the_configuration() -> None:
    text = realize(scenario(), sumo_map(), settings=RunSettings(until=42.0, step_length=0.1)).files[
        "scenario.sumocfg"
    ]
    config = etree.fromstring(text.encode())
    values = {e.tag: e.attrib["value"] for section in config for e in section}
    assert (values["end"], values["step-length"], values["seed"]) == ("42", "0.1", "5")
    assert values["route-files"] == "routes.rou.xml"
    assert "/" not in values["net-file"]


HOUR = 3600.0


@pytest.mark.parametrize(
    ("until", "wish", "seconds"),
    [
        (HOUR, "auto", None),
        (2 * HOUR, "auto", HOUR),
        (6 * HOUR, "auto", HOUR),
        (7 * HOUR, "auto", 2 * HOUR),
        (12 * HOUR, "auto", 2 * HOUR),
        (24 * HOUR, "auto", 4 * HOUR),
        (100 * HOUR, "auto", 4 * HOUR),
        (24 * HOUR, None, None),
        (24 * HOUR, 600.0, 600.0),
        (24 * HOUR, 0.7, 0.5),
    ],
)
def test_long_runs_go_in_slices_of_whole_steps_that_suit_them(
    until: float, wish: SliceLength, seconds: float | None
) -> None:
    assert slices_of(until, wish, 0.5) == seconds
