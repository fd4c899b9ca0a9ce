from __future__ import annotations

import math
import statistics
import subprocess
from pathlib import Path
from typing import Any
from xml.etree import ElementTree as ET

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bench.saturation import HCM_SATURATION, saturation_flow, straight_road
from odscen.base.categories import DEFAULT_BODY, Category
from odscen.base.errors import ScenarioError
from odscen.scenario.document.driver_parameters import DRIVER_PARAMETERS
from odscen.scenario.document.drivers_document import Drivers, DriverSet
from odscen.scenario.document.scenario_document import Actor
from odscen.sumo.realize.driving import (
    KINDS,
    NORMAL_DRIVERS,
    STYLES,
    Driver,
    draw_factor,
    draw_temper,
    driver,
    kind_of,
    number,
    spread_headway,
)
from odscen.sumo.realize.road_user import RoadUser
from odscen.sumo.realize.weather_effects import (
    BRAKING,
    NO_EFFECT,
    REACTION,
    stopping_speed,
    weather_effect,
)
from tests.sumo.conftest import BIN


def made(category: Category = Category.CAR, **changes: Any) -> Driver:
    fields = {name: changes.pop(name) for name in Actor.model_fields if name in changes}
    design = Actor(id="one", category=category, spawn="1.0.-1.0", **fields)
    user = RoadUser("one", category, 0, 1, depart=0.0, speed=design.speed, design=design)
    kind = kind_of(user, changes.get("drivers", Drivers()), 3)
    values: dict[str, Any] = {"factor": 1.0, "limit": 13.89, "weather": NO_EFFECT, "kind": kind}
    return driver(user, DEFAULT_BODY[category], **{**values, **changes})


def test_a_normal_car_in_good_weather_has_the_documented_parameters() -> None:
    attributes = dict(made().attributes)
    assert attributes == {
        "vClass": "passenger", "guiShape": "passenger", "length": "5", "width": "1.8",
        "height": "1.5", "maxSpeed": "55.56", "speedDev": "0", "accel": "2.6", "decel": "4",
        "emergencyDecel": "9", "tau": "1.1", "sigma": "0", "minGap": "2", "impatience": "0.4",
        "lcMaxSpeedLatStanding": "0.5", "lcMaxSpeedLatFactor": "0.3", "lcOvertakeRight": "1",
        "emissionClass": "HBEFA4/PC_petrol_Euro-4",
    }  # fmt: skip


def test_what_a_scenario_says_of_its_drivers_is_set_for_all_styles() -> None:
    drivers = Drivers(headway=2.0, gap_acceptance=0.25, lane_change_eagerness=0.5)
    normal = dict(made(drivers=drivers).attributes)
    assert (normal["tau"], normal["impatience"], normal["lcSpeedGain"]) == ("2", "0.25", "0.5")
    sporty = dict(made(drivers=drivers, style="sporty").attributes)
    assert (sporty["tau"], sporty["impatience"]) == ("1.8", "0.45")
    cautious = dict(made(drivers=drivers, style="cautious").attributes)
    assert cautious["tau"] == "3"
    assert "impatience" not in cautious
    assert dict(made(style="cautious").attributes)["impatience"] == "0.1"


LEARNERS = DriverSet(
    id="learners",
    style="cautious",
    parameters={
        "tau": 2.2,
        "minGap": 3,
        "lcStrategic": 2.5,
        "startupDelay": {"kind": "normal", "mean": 1.0, "std": 0.4, "low": 0.5, "high": 2.0},
    },
)


def test_a_driver_set_is_its_style_but_for_its_own_parameters() -> None:
    drivers = Drivers(sets=(LEARNERS,))
    one = dict(made(drivers=drivers, style="learners").attributes)
    assert (one["tau"], one["minGap"], one["lcStrategic"]) == ("2.2", "3", "2.5")
    assert one["accel"] == dict(made(style="cautious").attributes)["accel"] == "2.08"
    assert 0.5 <= float(one["startupDelay"]) <= 2.0
    assert "carFollowModel" not in one
    other = LEARNERS.model_copy(update={"car_following": "IDM"})
    idm = dict(made(drivers=Drivers(sets=(other,)), style="learners").attributes)
    assert idm["carFollowModel"] == "IDM"


def test_each_driver_of_a_set_draws_its_own_values_whatever_else_there_is() -> None:
    drivers = Drivers(sets=(LEARNERS,))

    def delay(name: str, seed: int) -> float:
        design = Actor(id=name, category="car", spawn="1.0.-1.0", style="learners")
        user = RoadUser(name, Category.CAR, 0, 1, depart=0.0, design=design)
        return kind_of(user, drivers, seed).drawn["startupDelay"]

    assert delay("a", 3) == delay("a", 3)
    assert len({delay(name, 3) for name in "abcdefgh"}) == 8
    assert delay("a", 3) != delay("a", 4)
    assert statistics.mean(delay(f"car-{k}", 1) for k in range(400)) == pytest.approx(
        1.04, abs=0.06
    )


def test_members_of_flows_draw_their_style_by_share_and_actors_keep_theirs() -> None:
    drivers = Drivers(sets=(LEARNERS,), shares={"normal": 3, "learners": 1})
    users = [RoadUser(f"f.{k}", Category.CAR, 0, 1, depart=0.0, flow="f") for k in range(1000)]
    learners = sum("tau" in kind_of(user, drivers, 7).drawn for user in users)
    assert 210 <= learners <= 290
    placed = RoadUser("one", Category.CAR, 0, 1, depart=0.0)
    assert kind_of(placed, drivers, 7).drawn == {}


def test_a_style_that_there_is_not_is_refused_with_its_name() -> None:
    with pytest.raises(ScenarioError, match="'one' drives as 'learners', which is neither"):
        made(style="learners")


def test_sumo_knows_every_parameter_of_drivers(tmp_path: Path) -> None:
    values = {name: (one.low + one.high) / 2 for name, one in DRIVER_PARAMETERS.items()}
    values["impatience"] = 0.25
    written = " ".join(f'{name}="{value}"' for name, value in values.items())
    (tmp_path / "types.xml").write_text(f'<routes><vType id="t" {written}/></routes>')
    straight_road(tmp_path / "net.xml")
    (tmp_path / "trips.xml").write_text(
        '<routes><trip id="v" type="t" depart="0" from="in" to="out"/></routes>'
    )
    subprocess.run(
        [BIN / "duarouter", "-n", tmp_path / "net.xml", "-r", tmp_path / "trips.xml", "-a",
         tmp_path / "types.xml", "-o", tmp_path / "out.xml", "--vtype-output", tmp_path / "t.xml"],
        check=True, capture_output=True,
    )  # fmt: skip
    (known,) = ET.parse(tmp_path / "t.xml").getroot().iter("vType")
    assert set(values) <= set(known.keys())


def test_nobody_keeps_a_shorter_headway_than_a_step() -> None:
    assert dict(made(drivers=Drivers(headway=0.5)).attributes)["tau"] == "0.5"
    assert dict(made(drivers=Drivers(headway=0.5), step_length=1.0).attributes)["tau"] == "1"
    assert dict(made(style="sporty", step_length=1.0).attributes)["tau"] == "1"


@pytest.mark.slow
def test_the_step_length_does_not_change_the_saturation_flow(tmp_path: Path) -> None:
    """Vehicles per hour and lane that leave a queue on a straight approach with 50 km/h."""
    net = tmp_path / "straight.net.xml"
    straight_road(net)

    def measured(step: str, drivers: Drivers) -> float:
        return saturation_flow(tmp_path, net, "in out", "in_0", step, 1, drivers)

    short, long = (measured(step, Drivers()) for step in ("0.2", "1"))
    assert short == pytest.approx(long, rel=0.02)
    assert short == pytest.approx(HCM_SATURATION, rel=0.15)
    assert measured("0.5", Drivers(saturation_flow=1600)) == pytest.approx(1600, rel=0.03)


@pytest.mark.parametrize("category", Category)
@pytest.mark.parametrize("electric", [False, True])
def test_sumo_knows_every_emission_class_and_only_engines_burn_fuel(
    category: Category, electric: bool, tmp_path: Path
) -> None:
    """Away from a stop for 8 s, by SUMO's own tool."""
    name = dict(made(category, electric=electric).attributes)["emissionClass"]
    cycle = tmp_path / "cycle.csv"
    cycle.write_text("".join(f"{second};{1.5 * second}\n" for second in range(9)))
    command = [
        BIN / "emissionsDrivingCycle", "--timeline-file", cycle, "--compute-a",
        "--emission-class", name, "--output", tmp_path / "out.csv",
    ]  # fmt: skip
    done = subprocess.run(command, check=True, capture_output=True, text=True)
    lines = (line.partition(":") for line in done.stdout.splitlines())
    emitted = {key: float(value) for key, _, value in lines if value}
    engine = category not in (Category.BICYCLE, Category.PEDESTRIAN)
    assert (emitted["fuel"] > 0.0) == (emitted["CO2"] > 0.0) == (engine and not electric)
    assert (emitted["electricity"] > 0.0) == (engine and electric)


@pytest.mark.parametrize(
    ("speed", "factor", "expected"), [(10.0, 1.0, 1.0), (20.0, 1.0, 20.0 / 10.0), (None, 0.9, 0.9)]
)
def test_a_desired_speed_above_the_limit_is_reached_where_the_actor_starts(
    speed: float | None, factor: float, expected: float
) -> None:
    one = made(speed=speed, factor=factor, limit=10.0)
    assert one.speed_factor == pytest.approx(expected)
    assert one.max_speed == (speed or 55.56)


def test_nobody_goes_faster_than_desired_even_without_a_limit() -> None:
    assert made(speed=7.5, limit=None).max_speed == 7.5


def test_a_walker_walks_at_its_own_speed_whatever_the_street_allows() -> None:
    attributes = dict(made(Category.PEDESTRIAN, speed=1.7, factor=0.8).attributes)
    assert attributes["maxSpeed"] == attributes["desiredMaxSpeed"] == "1.7"
    assert dict(made(Category.PEDESTRIAN, factor=0.8).attributes)["maxSpeed"] == "1.112"


def test_every_category_has_its_sumo_class() -> None:
    assert set(KINDS) == set(Category)
    assert len({kind.vclass for kind in KINDS.values()}) == 7


def test_drawn_factors_follow_the_style_and_depend_on_nothing_else() -> None:
    for style, expected in STYLES.items():
        drawn = [draw_factor(3, f"a{i}", style, Category.CAR) for i in range(600)]
        assert statistics.mean(drawn) == pytest.approx(expected.factor_mean, abs=0.015)
        reach = 3 * expected.factor_deviation
        assert max(abs(x - expected.factor_mean) for x in drawn) <= reach + 1e-9
    assert draw_factor(3, "a", "normal", Category.CAR) == draw_factor(
        3, "a", "normal", Category.BUS
    )
    assert draw_factor(3, "a", "normal", Category.CAR) != draw_factor(
        4, "a", "normal", Category.CAR
    )


def test_clear_weather_does_nothing_to_driving() -> None:
    clear = {"cloudiness": 20.0, "sun_altitude_angle": -30.0, "fog_density": 0.0, "wetness": 0.0}
    assert weather_effect(clear) == NO_EFFECT
    assert weather_effect({}) == NO_EFFECT


def test_heavy_rain_has_the_numbers_of_its_sources() -> None:
    effect = weather_effect({"precipitation": 100.0, "wetness": 100.0})
    assert effect.speed == pytest.approx(1 - 0.084)
    assert effect.grip == pytest.approx(0.7)
    assert 1 / effect.headway == pytest.approx(1 - 0.1413)
    assert weather_effect({"precipitation": 0.01}).speed == pytest.approx(0.97, abs=1e-4)


def test_one_can_stop_within_what_one_sees_in_fog() -> None:
    dense = weather_effect({"fog_density": 100.0})
    v = dense.sight_speed
    assert v * REACTION + v**2 / (2 * BRAKING) == pytest.approx(50.0)
    assert weather_effect({"dust_storm": 100.0}).sight_speed == v
    wet = weather_effect({"fog_density": 100.0, "wetness": 100.0})
    assert wet.sight_speed < v


@given(st.floats(1, 1e5), st.floats(0.3, 1.0))
def test_stopping_speed_is_the_root_of_its_formula(sight: float, grip: float) -> None:
    v = stopping_speed(sight, grip=grip)
    assert v * REACTION + v**2 / (2 * BRAKING * grip) == pytest.approx(sight)


@given(st.dictionaries(st.sampled_from(["precipitation", "wetness", "fog_density"]),
                       st.floats(-50, 150)))  # fmt: skip
def test_weather_never_makes_anybody_faster(parameters: dict[str, float]) -> None:
    effect = weather_effect(parameters)
    assert 0.9 <= effect.speed <= 1
    assert 0.7 <= effect.grip <= 1
    assert 1 <= effect.headway < 1.2
    assert effect.sight_speed > 5


def test_weather_acts_on_vehicles_and_not_on_walkers() -> None:
    rain = weather_effect({"precipitation": 100.0, "wetness": 100.0, "fog_density": 100.0})
    wet, dry = made(weather=rain), made()
    assert wet.speed_factor == pytest.approx(dry.speed_factor * rain.speed, abs=1e-4)
    assert wet.max_speed == pytest.approx(rain.sight_speed)
    assert float(dict(wet.attributes)["decel"]) == pytest.approx(4.0 * rain.grip)
    assert made(Category.PEDESTRIAN, weather=rain) == made(Category.PEDESTRIAN)


@given(st.floats(-1e9, 1e9), st.integers(0, 6))
def test_numbers_are_written_in_fixed_notation_that_reads_back(value: float, digits: int) -> None:
    text = number(value, digits=digits)
    assert "e" not in text
    assert text != "-0"
    assert math.isclose(float(text), value, abs_tol=0.5000001 * 10**-digits)


def test_drivers_of_flows_follow_each_other_at_headways_of_their_own_and_others_as_designed() -> (
    None
):
    design = Actor(id="one", category=Category.CAR, spawn="1.0.-1.0")

    def member(k: int) -> RoadUser:
        return RoadUser(
            f"f.{k}", Category.CAR, 0, 1, depart=0.0, speed=None, design=design, flow="f"
        )

    def headway(user: RoadUser, drivers: Drivers = NORMAL_DRIVERS) -> tuple[float, float]:
        kind = kind_of(user, drivers, 7)
        made = driver(
            user, DEFAULT_BODY[Category.CAR], factor=1.0, limit=13.89, weather=NO_EFFECT,
            kind=kind, drivers=drivers,
        )  # fmt: skip
        values = dict(made.attributes)
        return float(values["tau"]), float(values["accel"])

    found = [headway(member(k)) for k in range(800)]
    taus = [tau for tau, _ in found]
    assert len(set(taus)) == 8  # so many vTypes, not one for each vehicle
    assert statistics.mean(taus) == pytest.approx(1.1, abs=0.02)
    # A headway below 1 s at 30 m/s.
    assert 0.15 < sum(tau < 0.77 for tau in taus) / 800 < 0.3
    # Who follows closely accelerates more and drives faster.
    assert [a for _, a in sorted(found)] == sorted((a for _, a in found), reverse=True)
    fast = [draw_factor(7, f"f.{k}", "normal", Category.CAR) for k in range(800)]
    assert -0.55 < statistics.correlation(taus, fast) < -0.25
    assert found == [headway(member(k)) for k in range(800)]
    # Where steps are as long as the shortest headways, the mean still holds.
    coarse = [spread_headway(draw_temper(7, f"f.{k}"), 1.1, 1.0) for k in range(800)]
    assert min(coarse) == 1.0
    assert statistics.mean(coarse) == pytest.approx(1.1, abs=0.01)
    assert spread_headway(1.5, 0.9, 1.0) == 0.9
    # A single actor is the mean driver; a saturation flow that is wished holds on average.
    user = RoadUser("one", Category.CAR, 0, 1, depart=0.0, speed=None, design=design)
    assert headway(user) == (1.1, 2.6)
    wished = [headway(member(k), Drivers(saturation_flow=1800))[0] for k in range(800)]
    assert 3600 / (statistics.mean(wished) + 0.57) == pytest.approx(1800, rel=0.02)
