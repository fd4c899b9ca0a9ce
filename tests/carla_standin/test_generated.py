"""Worlds that the stand-in makes of an OpenDRIVE text have the ground that LibCarla makes."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from odscen.opendrive.lanes import RoadTable
from odscen.opendrive.parse import parse
from tests.carla_standin.bumps import HALF, HIGH, LANE, LOW, WALK, bumps
from tests.carla_standin.generated import (
    SIDEWALK_LIFT,
    Floats,
    Generation,
    flattened,
    smoothen,
    strips_of,
)
from tests.carla_standin.road_map import RoadMap

PLAIN = Generation(wall_height=0.0, additional_width=0.0, smooth_junctions=False)
MIDDLE = (LANE / 2, LANE / 2)
"""Where both lanes are, one above the other, in CARLA's frame."""


@cache
def world(made: Generation) -> RoadMap:
    return RoadMap.of(bumps(), "bumps", made)


def ground(made: Generation, x: float, y: float) -> float | None:
    found = world(made).surface(x, y, 10.0, 0.0)
    return None if found is None else found[0]


def high(x: float) -> float:
    """Height of the road to the east."""
    return HIGH * (1.0 - (x / HALF) ** 2)


def smoothed_one_by_one(strips: list[Floats]) -> list[float]:
    """Heights as ``MergeAndSmooth`` reads: loops over vertices and their neighbours."""
    places = [place for strip in strips for place in strip]
    at = [(lane, k, len(strip)) for lane, strip in enumerate(strips) for k in range(len(strip))]
    weights: list[list[tuple[int, float]]] = []
    for place, (lane, k, size) in zip(places, at, strict=True):
        moves = 2 < k < size - 2
        away = [float(np.linalg.norm(other - place)) for other in places]
        weights.append([])
        for other in sorted(range(len(places)), key=away.__getitem__)[:20] if moves else ():
            if 0.0 < away[other] <= 5.0:
                its_lane, number, length = at[other]
                end = number < 2 or number >= length - 2
                same = 1.0 if its_lane != lane else 4.0 if end else 2.0
                weights[-1].append((other, same / away[other]))
    z = [float(place[2]) for place in places]
    for _ in range(100):
        for one, near in enumerate(weights):
            if near:
                mean = sum(weight * (z[other] - z[one]) for other, weight in near)
                z[one] += 0.5 * mean / sum(weight for _, weight in near)
    return z


def test_heights_are_evened_out_vertex_by_vertex_as_the_source_says() -> None:
    generator = np.random.default_rng(3)
    along = np.repeat(np.arange(0.0, 14.0, 2.0), 2)
    aside = np.tile([0.0, 3.5], 7)
    strips = [
        np.column_stack([along, aside + shift, generator.uniform(0.0, 0.5, 14)])
        for shift in (0.0, 1.1, 2.3)
    ]
    expected = smoothed_one_by_one(strips)
    before = np.concatenate(strips)
    smoothen(strips)
    after = np.concatenate(strips)
    assert after[:, 2] == pytest.approx(expected, abs=1e-12)
    assert (after[:, :2] == before[:, :2]).all()
    moved = (after[:, 2] != before[:, 2]).reshape(3, 14)
    # The corners of both ends stay, and the first corner after the start.
    assert (np.flatnonzero(moved.any(axis=0)) == np.arange(3, 12)).all()


def test_where_lanes_cross_smoothing_lowers_both_bumps_and_keeps_the_ends_of_lanes() -> None:
    smooth = replace(PLAIN, smooth_junctions=True)
    plain, even = ground(PLAIN, *MIDDLE), ground(smooth, *MIDDLE)
    assert plain is not None
    assert even is not None
    assert plain == pytest.approx(high(MIDDLE[0]), abs=0.002), "the upper of both, as in the file"
    # The ends hold both at 0, and each the other: what is left of 0.4 and 0.1 is less than either.
    assert even == pytest.approx(0.0905, abs=0.001)
    assert even < LOW
    for x in (-HALF, -HALF - 5.0, HALF):
        assert ground(smooth, x, LANE / 2) == ground(PLAIN, x, LANE / 2) == pytest.approx(0.0)
    # Sidewalks are not smoothed.
    walk = (10.0, LANE + WALK / 2)
    assert ground(smooth, *walk) == ground(PLAIN, *walk)


def test_sidewalks_are_six_inches_up_whatever_the_file_says() -> None:
    assert ground(PLAIN, -40.0, LANE + 1.0) == pytest.approx(SIDEWALK_LIFT)
    assert ground(PLAIN, -40.0, LANE + WALK + 0.1) is None


def test_driving_lanes_are_wider_on_both_sides_and_walls_stand_outside_junctions() -> None:
    wide = replace(PLAIN, additional_width=0.6)
    assert ground(PLAIN, -40.0, -0.1) is None
    assert ground(wide, -40.0, -0.55) == pytest.approx(0.0)
    assert ground(wide, -40.0, -0.65) is None
    walled = replace(wide, wall_height=1.0)
    assert ground(walled, -40.0, -0.7) == pytest.approx(1.0)
    assert ground(walled, -40.0, LANE + WALK + 0.1) == pytest.approx(1.0 + SIDEWALK_LIFT)
    assert ground(walled, -40.0, -1.0) is None
    assert ground(walled, -10.0, -0.7) is None, "none in junctions"


def test_straight_lanes_have_vertices_at_their_ends_and_others_every_two_metres() -> None:
    odr = parse(bumps().encode(), file="bumps")
    strips, walks = strips_of(odr, flattened(RoadTable.of(odr)), PLAIN)
    assert [len(strip) for strip in strips] == [4] * 8 + [2 * 21] * 4
    assert walks == [True, False] * 6
    longer = replace(PLAIN, max_road_length=15.0)
    strips, _ = strips_of(odr, flattened(RoadTable.of(odr)), longer)
    assert [len(strip) for strip in strips] == [4] * 24 + [2 * 21] * 4
    # A chord of two metres is below a bump by no more than this.
    xs = np.linspace(-HALF, 0.0, 81).tolist()
    sunk = [high(x) - (ground(PLAIN, x, LANE / 2 + 1.0) or 0.0) for x in xs if abs(x) > LANE]
    assert 0.0 <= min(sunk) + 1e-9 <= max(sunk) <= HIGH / HALF**2 + 1e-9
