"""What a bus takes up beside its path in a junction, against circles."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from odscen.convert.building.junctions import MOST_SWEPT, bent_aside, swept_width
from odscen.convert.model.right_of_way import Movement
from tests.convert.turns import turn_left


def s_bend(radius: float, angle: float) -> Movement:
    """Straight on with two arcs of a circle, first to the left and then to the right."""
    turned = np.linspace(0.0, angle, 40)
    first = np.column_stack([radius * np.sin(turned), radius * (1.0 - np.cos(turned))])
    back = first[-1] + (first[-1] - first[:-1])[::-1]
    return along([*map(tuple, first), *map(tuple, back)])


def along(xy: list[tuple[float, float]]) -> Movement:
    return turn_left("w", "e", xy)


def length(movement: Movement) -> float:
    return float(np.hypot(*np.diff(movement.shape[:, :2], axis=0).T).sum())


def test_a_bus_on_a_straight_path_or_a_slight_bend_stays_on_its_lane() -> None:
    straight = along([(0.0, 0.0), (10.0, 0.0), (30.0, 0.0)])
    assert swept_width(straight, 30.0) < 0.1
    assert bent_aside(straight) == 0.0
    assert bent_aside(s_bend(100.0, 0.15)) == 0.0, "12² / (8 · 100) = 0.18 m"


def test_a_turn_is_wider_by_twice_the_sagitta_of_its_circle_up_to_four_metres() -> None:
    turn = along([(0.0, 0.0), (10.0, 0.0), (20.0, 10.0), (20.0, 20.0)])
    assert swept_width(turn, 20.0 * math.pi / 2.0) == pytest.approx(2 * 12.0**2 / (8 * 20.0))
    assert swept_width(turn, 8.0) == MOST_SWEPT
    assert bent_aside(turn) == 0.0


def test_a_bus_leaves_an_s_bend_by_the_sagitta_of_its_arcs_though_it_turns_nowhere() -> None:
    # Arcs of 14 m with a radius of 20 m: the chord of 12 m lies 20 - sqrt(20² - 6²) = 0.92 m off.
    movement = s_bend(20.0, 0.7)
    assert abs(movement.turn) < 0.05
    assert bent_aside(movement) == pytest.approx(0.92, abs=0.03)
    assert swept_width(movement, length(movement)) == pytest.approx(1.84, abs=0.06)
    mirrored = replace(movement, shape=movement.shape * (1.0, -1.0, 1.0))
    assert bent_aside(mirrored) == pytest.approx(bent_aside(movement))
