"""Metrics on numbers made by hand."""

from __future__ import annotations

import numpy as np
import pytest

from odscen.learning.reference.binned_statistics import BINS, BinnedStatistics, place_binned
from odscen.learning.reference.site_features import site_of
from odscen.learning.traffic_metrics import (
    FEATURES,
    TrafficScene,
    divergence,
    frechet_distance,
    interval,
    mean_discrepancy,
    novelty,
    scene_features,
)
from odscen.learning.traffic_snapshots import no_lights
from tests.graphs import two_lane_road

ROWS = np.random.default_rng(1).normal(size=(400, 3))


def scene(nodes: list[int], speeds: list[float], name: str = "") -> TrafficScene:
    return TrafficScene(
        np.array(nodes), np.zeros(len(nodes), dtype=np.int64), np.array(speeds), no_lights(2), name
    )


def test_the_frechet_distance_of_a_shift_is_its_square_in_deviations() -> None:
    shifted = ROWS + np.array([2.0, 0.0, 0.0]) * ROWS.std(axis=0)
    assert frechet_distance(ROWS, ROWS) == pytest.approx(0.0, abs=1e-3)
    assert frechet_distance(ROWS, shifted) == pytest.approx(4.0, abs=1e-3)


def test_the_frechet_distance_of_a_stretch_is_that_of_the_deviations() -> None:
    stretched = (ROWS - ROWS.mean(axis=0)) * np.array([3.0, 1.0, 1.0]) + ROWS.mean(axis=0)
    assert frechet_distance(ROWS, stretched) == pytest.approx(4.0, rel=0.02)


def test_one_vehicle_has_no_frechet_distance() -> None:
    """Draws for the interval of a map with hardly any vehicle have such: they do not count."""
    assert np.isnan(frechet_distance(ROWS, ROWS[:1]))
    assert np.isnan(frechet_distance(ROWS, ROWS[:0]))


def test_the_discrepancy_is_none_for_the_same_and_grows_with_a_shift() -> None:
    near, far = (mean_discrepancy(ROWS, ROWS + shift) for shift in (0.5, 2.0))
    assert mean_discrepancy(ROWS, ROWS) == pytest.approx(0.0, abs=1e-9)
    assert 0.0 < near < far < 2.0


def test_the_divergence_is_none_for_the_same_and_a_bit_for_what_never_meets() -> None:
    bounds = np.array([0.0, 1.0, 2.0, 3.0])
    low, high = np.array([0.5, 0.5]), np.array([2.5, np.nan])
    assert divergence(low, low, bounds) == 0.0
    assert divergence(low, high, bounds) == pytest.approx(1.0)
    half = divergence(np.array([0.5]), np.array([0.5, 2.5]), bounds)
    assert half == pytest.approx(0.5 * np.log2(4 / 3) + 0.5 * (0.5 * np.log2(2 / 3) + 0.5))
    assert np.isnan(divergence(low, np.array([np.nan]), bounds))


def test_kinds_that_the_statistics_have_never_seen_are_placed_nowhere() -> None:
    site = site_of(two_lane_road(100.0).lanes)
    cars_only = BinnedStatistics(
        np.ones(BINS), np.ones((BINS, 29)), np.tile([1.0, 0, 0, 0, 0, 0], (BINS, 1))
    )
    allowed = np.zeros((6, len(site.limit)), dtype=bool)
    allowed[:, site.lane == 0] = True
    allowed[5] = True  # lane 1 is open to these alone
    placed = place_binned(
        cars_only, site, no_lights(2), allowed,
        wanted=50, lengths=np.full(6, 4.5), rng=np.random.default_rng(1),
    )  # fmt: skip
    assert len(placed.node) > 5
    assert set(site.lane[placed.node]) == {0}
    allowed[:5] = False
    nothing = place_binned(
        cars_only, site, no_lights(2), allowed,
        wanted=5, lengths=np.full(6, 4.5), rng=np.random.default_rng(1),
    )  # fmt: skip
    assert len(nothing.node) == 0


def test_a_vehicle_sees_its_gap_its_leader_and_the_end_of_the_road() -> None:
    lanes = two_lane_road(100.0).lanes
    own = np.flatnonzero(lanes.lane == 0)
    rows = scene_features(lanes, site_of(lanes), scene([int(own[30]), int(own[20])], [0.0, 10.0]))
    by_name = {name: rows.features[:, k].tolist() for k, name in enumerate(FEATURES)}
    assert rows.gap[1] == pytest.approx(20.0 - 5.0)
    assert np.isnan(rows.gap[0])
    assert rows.to_junction.tolist() == pytest.approx([38.0, 58.0])
    assert by_name["stopped"] == [1.0, 0.0]
    assert by_name["queue ahead"] == [0.0, 1.0]
    assert by_name["vehicles within 25 m"] == [1.0, 1.0]


def test_a_copy_is_not_new_and_other_places_are() -> None:
    known = [scene([4, 40], [0.0, 0.0])]
    assert novelty([scene([4, 40], [3.0, 3.0])], known, near=1) == 0.0
    assert novelty([scene([5, 20], [0.0, 0.0])], known, near=1) == 0.5
    assert np.isnan(novelty([], known, near=1))


def test_an_interval_draws_runs_whole() -> None:
    scenes = [scene([1], [0.0], name) for name in ("a", "a", "b", "b")]
    seen: list[list[int]] = []

    def measure(some: list[int]) -> float:
        seen.append(sorted(some))
        return float(np.mean(some))

    low, high = interval(scenes, measure, draws=30)  # type: ignore[arg-type]
    assert (low, high) == (0.5, 2.5)
    assert {tuple(one) for one in seen} == {(0, 0, 1, 1), (0, 1, 2, 3), (2, 2, 3, 3)}


def test_draws_without_a_value_do_not_count_for_an_interval() -> None:
    scenes = [scene([1], [0.0], name) for name in "ab"]

    def measure(some: list[int]) -> float:
        return 3.0 if 0 in some else float("nan")

    assert interval(scenes, measure, draws=30) == (3.0, 3.0)  # type: ignore[arg-type]
    never = interval(scenes, lambda _: float("nan"), draws=3)
    assert np.isnan(never).all()
