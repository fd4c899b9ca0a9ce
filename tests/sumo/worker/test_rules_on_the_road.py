"""Signs, right of way and crosswalks of the map, kept by SUMO's drivers."""

from __future__ import annotations

import re

import pytest

from odscen.opendrive.parse import parse
from tests.convert.maps import Converted, converted, named, of_model
from tests.lanegraph.roads import lane, network, road, section
from tests.sumo.traffic import Car, Person, drive

STANDING = 0.1
"""m/s."""

WEST, EAST, SIDE = "2.0.f 2.1.f 1.2.b 1.1.b", "1.1.f 1.2.f 2.1.b 2.0.b", "3.0.f 3.1.f"
"""Ways into the junction with the stop sign of t_junction_signs: main road, and side street."""


@pytest.fixture(scope="module")
def signs() -> Converted:
    """Where nothing but signs tells who goes first."""
    text = named("t_junction_signs").read_text(encoding="utf-8")
    return of_model(parse(re.sub("<priority [^>]*>", "", text)))


@pytest.mark.parametrize("onwards", ["2.1.b 2.0.b", "1.2.b 1.1.b"], ids=["left", "right"])
def test_a_car_halts_at_a_stop_sign_though_nobody_comes(signs: Converted, onwards: str) -> None:
    run = drive(signs, Car("a", f"{SIDE} {onwards}"))
    assert run.slowest("a", "3.1.f") < STANDING
    assert run.arrived == {"a"}
    assert run.said == ""


def test_a_car_on_the_main_road_does_not_halt(signs: Converted) -> None:
    run = drive(signs, Car("a", WEST))
    assert run.slowest("a") > 5.0, "drivers slow down before the empty crosswalks"


def test_a_car_at_a_yield_sign_does_not_halt_if_nobody_comes(signs: Converted) -> None:
    run = drive(signs, Car("a", "5.0.f 5.1.f 4.1.b 4.0.b"))
    assert run.slowest("a") > 1.0
    assert run.arrived == {"a"}


@pytest.mark.parametrize(
    ("own", "junction"),
    [("5.0.f 5.1.f 4.1.b 4.0.b", ":J10002"), ("3.0.f 3.1.f 2.1.b 2.0.b", ":J10001")],
    ids=["yield", "stop"],
)
def test_a_car_from_a_side_street_lets_a_column_pass(
    signs: Converted, own: str, junction: str
) -> None:
    main = {
        ":J10002": "4.0.f 4.1.f 1.0.f 1.1.f",
        ":J10001": "2.0.f 2.1.f 1.2.b 1.1.b",
    }[junction]
    column = [Car(f"m{k}", main, depart=2.0 * k) for k in range(20)]
    run = drive(signs, *column, Car("side", own))
    alone = drive(signs, *column)
    assert run.first_on("side", junction) > run.first_on("m19", junction)
    assert run.arrived == {"side", *(car.id for car in column)}
    assert run.said == ""
    for car in column:
        assert run.first_on(car.id, junction) == pytest.approx(
            alone.first_on(car.id, junction), abs=0.5
        )


ARMS = {
    "west": ("1.2.f", "10.0.f"),
    "south": ("9.2.f", "11.0.f"),
    "east": ("10.0.b", "1.2.b"),
    "north": ("11.0.b", "9.2.b"),
}
"""Of a crossroads without signs in the town: the way in, and the way straight out."""


@pytest.mark.parametrize(
    ("right", "left"),
    [("south", "west"), ("east", "south"), ("north", "east"), ("west", "north")],
)
def test_at_a_crossroads_without_signs_right_goes_before_left(right: str, left: str) -> None:
    town = converted(named("town_5x5"))
    cars = []
    for name in (right, left):
        length = town.network.table.lanes[f"{ARMS[name][0]}_0"].length
        cars.append(Car(name, " ".join(ARMS[name]), pos=length - 12.0, speed="5"))
    run = drive(town, *cars)
    assert run.first_on(right, ":J10006") < run.first_on(left, ":J10006")
    assert run.slowest(left, ARMS[left][0]) < run.slowest(right, ARMS[right][0]) - 0.8
    assert run.arrived == {right, left}
    assert run.said == ""


@pytest.mark.slow
def test_who_enters_a_roundabout_waits_for_those_in_it() -> None:
    made = converted(named("roundabout"))
    ring = [Car(f"r{k}", "3.0.f 3.1.f 7.0.f 8.0.f 5.0.f 2.1.b 2.0.b", depart=3.0 * k)
            for k in range(12)]  # fmt: skip
    run = drive(made, *ring, Car("in", "4.0.f 4.1.f 8.0.f 1.1.b 1.0.b", depart=8.0))
    alone = drive(made, *ring)
    assert run.arrived == {"in", *(car.id for car in ring)}
    assert run.said == ""
    for car in ring:
        if run.first_on(car.id, ":J10004") < run.first_on("in", ":J10004"):
            assert run.first_on(car.id, ":J10001") == alone.first_on(car.id, ":J10001")
    free = drive(made, Car("in", "4.0.f 4.1.f 8.0.f 1.1.b 1.0.b", depart=8.0))
    assert run.first_on("in", ":J10004") > free.first_on("in", ":J10004") + 2.0


CROSSWALK = (
    '<object id="7" type="crosswalk" s="100" t="0" zOffset="0" hdg="0" orientation="none"><outline>'
    + "".join(
        f'<cornerLocal u="{u}" v="{v}" z="0" height="0"/>'
        for u, v in ((-2, -4.5), (2, -4.5), (2, 4.5), (-2, 4.5))
    )
    + "</outline></object>"
)
STREET = (
    lane(-2, kind="sidewalk", width=2.0), lane(-1), lane(1), lane(2, kind="sidewalk", width=2.0)
)  # fmt: skip


@pytest.fixture(scope="module")
def street() -> Converted:
    return of_model(network(road("1", section(*STREET), length=200.0, objects=CROSSWALK)))


@pytest.mark.parametrize("start", [1.0, 2.0, 3.0, 4.0, 5.0])
@pytest.mark.parametrize("count", [1, 8])
def test_a_car_lets_persons_over_a_crosswalk_of_the_open_road(
    street: Converted, start: float, count: int
) -> None:
    persons = [
        Person(f"p{k}", "w0 w3", depart=start + k, pos=97.0, arrival=5.0) for k in range(count)
    ]
    run = drive(street, *persons, Car("a", "1.0.f 1.1.f"))
    car = {one.time: one.x for one in run.seen["a"]}
    for person in persons:
        in_the_way = [one for one in run.seen[person.id] if -3.5 < one.y < 0.0]
        assert len(in_the_way) > 20
        for one in in_the_way:
            assert one.edge == ":N1.97.0_c0"
            nose = car.get(one.time, 0.0)
            assert nose < 98.0 or nose - 4.5 > 102.0
    assert run.arrived == {"a", *(person.id for person in persons)}
    assert run.said == ""


def test_a_car_halts_for_a_column_of_persons_until_the_last_is_over(street: Converted) -> None:
    persons = [Person(f"p{k}", "w0 w3", depart=2.0 + k, pos=97.0, arrival=5.0) for k in range(8)]
    run = drive(street, *persons, Car("a", "1.0.f 1.1.f"))
    assert run.slowest("a", "1.0.f") < STANDING
    last = next(one.time for one in run.seen["p7"] if one.y > -1.75)
    assert run.first_on("a", ":N1.97.0") > last


def test_a_car_does_not_wait_at_a_crosswalk_without_anybody(street: Converted) -> None:
    run = drive(street, Car("a", "1.0.f 1.1.f"))
    assert run.slowest("a") > 5.0


@pytest.mark.slow
def test_cars_wait_for_red_and_go_with_green() -> None:
    made = converted(named("signal_crossing"))
    [light] = made.xml.iter("tlLogic")
    phases = [(float(p.get("duration")), p.get("state")) for p in light.iter("phase")]
    cycle = sum(duration for duration, _ in phases)

    def shown(time: float, link: int) -> str:
        time %= cycle
        for duration, state in phases:
            if time < duration:
                return state[link]
            time -= duration
        raise AssertionError

    rows = {
        link.get("via").rsplit("_", 1)[0]: int(link.get("linkIndex"))
        for link in made.xml.iter("connection")
        if link.get("tl") and link.get("via")
    }
    ways = {
        (link.get("from"), link.get("to"))
        for link in made.xml.iter("connection")
        if link.get("tl") and link.get("via")
    }
    cars = [
        Car(f"{k}.{n}", " ".join(way), depart=40.0 * k)
        for k in range(4)
        for n, way in enumerate(sorted(ways))
    ]
    run = drive(made, *cars, until=1200.0)
    assert run.arrived == {car.id for car in cars}
    # Of 48 cars two that turn into one exit, left and right, come there at once and brake late.
    warnings = run.said.splitlines()
    assert all("performs emergency braking" in line for line in warnings)
    assert len(warnings) <= 2
    for car in cars:
        entered = next(one for one in run.seen[car.id] if one.edge.startswith(":"))
        assert shown(entered.time - 0.2, rows[entered.edge]) != "r", car.id
    assert sum(run.slowest(car.id) < STANDING for car in cars) > len(cars) / 4
