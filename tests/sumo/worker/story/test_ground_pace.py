"""Speeds that SUMO is given, so that those on the ground are what rules say."""

from __future__ import annotations

import math

import pytest

from odscen.scenario.story.road_view import ActorView
from odscen.sumo.worker.story.ground_pace import GroundPaces

STEP, SPEED, LENGTH = 0.1, 15.0, 4.0


def at(front: float, y: float = 0.0) -> ActorView:
    return ActorView("a", front - LENGTH / 2.0, y, 0.0, SPEED, 0.0, LENGTH, 2.0, 0.0, False)


@pytest.mark.parametrize("share", [0.96, 1.0, 1.013])
def test_what_a_lane_is_longer_or_shorter_for_sumo_is_made_up_for(share: float) -> None:
    paces = GroundPaces(STEP)
    front, sumo = 0.0, 0.0
    for _ in range(100):
        given = paces.speed(at(front), SPEED)
        front += share * given * STEP
        sumo += given * STEP
    assert front == pytest.approx(100 * SPEED * STEP, abs=0.25)
    assert given == pytest.approx(SPEED / share, rel=4e-3)  # and gives back what is missing
    assert paces.extra("a") == pytest.approx(sumo - 100 * SPEED * STEP)


def test_who_was_put_somewhere_else_owes_nothing_and_who_stands_stays() -> None:
    paces = GroundPaces(STEP)
    for front in (0.0, 1.4, 2.9):
        paces.speed(at(front), SPEED)
    paces.rest("a")
    assert paces.speed(at(300.0, 20.0), SPEED) == pytest.approx(SPEED)
    assert paces.speed(at(301.5, 20.0), 0.0) == 0.0


def test_paces_are_remembered_from_slice_to_slice() -> None:
    one, other = GroundPaces(STEP), GroundPaces(STEP)
    for front in (0.0, 1.48, 2.97):
        one.speed(at(front), SPEED)
    other.restore(one.state())
    assert other.given("a") == one.given("a")
    assert other.speed(at(4.46), SPEED) == one.speed(at(4.46), SPEED)
    assert not math.isclose(one.extra("a"), 0.0)
    assert other.extra("b") == 0.0
    assert other.given("b") is None
