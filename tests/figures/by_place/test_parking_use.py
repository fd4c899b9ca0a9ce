"""How full parking areas are."""

from __future__ import annotations

import numpy as np
import polars as pl
import pytest

from odscen.figures.by_place.parking_use import ParkingUse
from odscen.records.run_plan import Plan, PlannedActor, PlannedParking

ROWS = [
    ("out", "P1", True, 0.0, 100.0),
    ("in", "P1", False, 50.0, 150.0),
    ("other", "P2", False, 120.0, None),
    ("late", "P1", False, 180.0, None),
]
NAMES = ("actor", "area", "begins", "arrival", "departure")


def actor(name: str, ends_in: str | None) -> PlannedActor:
    return PlannedActor(name, "car", "a", "b", 0.0, 5.0, 1.8, 0, 0, 0, 0, ends_in=ends_in)


def use(begin: float = 0.0) -> ParkingUse:
    plan = Plan(
        "s", 0, 200.0, 1.0, (0.0, 0.0),
        (actor("out", None), actor("in", "P1"), actor("other", "P1"), actor("late", "P1")),
        parking=(PlannedParking("P1", "r1", 2, 0, 0), PlannedParking("P2", "r1", 4, 0, 0)),
    )  # fmt: skip
    return ParkingUse.of(
        pl.DataFrame(ROWS, schema=list(NAMES), orient="row"), plan, begin=begin, end=200.0
    )


def test_stays_are_counted_by_area() -> None:
    first, second = use().use("P1"), use().use("P2")
    assert (first.places, first.begun, first.ended, first.highest) == (2, 1, 2, 2)
    assert first.diverted == 1
    assert (second.begun, second.ended, second.diverted, second.highest) == (0, 1, 0, 1)


def test_occupancy_is_the_share_of_places_and_time_that_is_taken() -> None:
    # P1: 100 + 100 + 20 s of 2 x 200 s; full from 50 to 100 s. P2: 80 s of 4 x 200 s.
    assert use().use("P1").occupancy == pytest.approx(220 / 400)
    assert use().use("P1").full == pytest.approx(50 / 200)
    assert use().use("P2").occupancy == pytest.approx(80 / 800)
    assert use().use().occupancy == pytest.approx(300 / 1200)


def test_places_taken_change_with_each_car() -> None:
    taken = use().taken("P1")
    assert dict(zip(taken.time.tolist(), taken.places.tolist(), strict=True)) == {
        0.0: 1, 50.0: 2, 100.0: 1, 150.0: 0, 180.0: 1,
    }  # fmt: skip


def test_a_warm_up_is_left_out() -> None:
    late = use(begin=100.0)
    assert late.use("P1").ended == 1
    assert late.use("P1").occupancy == pytest.approx(70 / 200)
    assert np.all(late.taken().time >= 100.0)


def test_a_plan_keeps_its_parking_in_its_file() -> None:
    plan = Plan(
        "s", 0, 10.0, 1.0, (0.0, 0.0), (actor("in", "P1"),),
        parking=(PlannedParking("P1", "r1", 2, 1.5, 2.5),),
    )  # fmt: skip
    assert Plan.from_json(plan.to_json()) == plan
