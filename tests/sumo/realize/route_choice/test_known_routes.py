"""Trips shared among routes by the logit model."""

from __future__ import annotations

import math
from collections import Counter

import numpy as np
import pytest

from odscen.sumo.realize.route_choice.known_routes import chosen_route, taste

TRIPS = [taste(f"m.north-south.{number}") for number in range(1000)]


def shares(*seconds: float, spread: float) -> list[float]:
    found = Counter(chosen_route(np.array(seconds), one, spread=spread) for one in TRIPS)
    return [found[route] / len(TRIPS) for route in range(len(seconds))]


def test_routes_that_take_as_long_share_their_trips() -> None:
    assert shares(100.0, 100.0, spread=0.03) == pytest.approx([0.5, 0.5], abs=0.005)


def test_by_its_spread_longer_a_route_is_taken_e_times_as_rarely() -> None:
    first, second = shares(100.0, 103.0, spread=0.03)
    assert first / second == pytest.approx(math.e, rel=0.02)
    assert shares(500.0, 515.0, spread=0.03) == [first, second]


def test_without_a_spread_all_take_the_quickest() -> None:
    assert shares(100.0, 99.9, 120.0, spread=0.0) == [0.0, 1.0, 0.0]


def test_a_trip_decides_alike_whatever_the_others_do_and_few_change_for_little() -> None:
    assert taste("m.north-south.7") == TRIPS[7] != taste("m.south-north.7")
    before = [chosen_route(np.array([100.0, 101.0]), one, spread=0.03) for one in TRIPS]
    after = [chosen_route(np.array([100.0, 101.2]), one, spread=0.03) for one in TRIPS]
    changed = sum(one != other for one, other in zip(before, after, strict=True))
    assert 0 < changed < 25
