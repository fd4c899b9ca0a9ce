"""Who is led beside a line covers as many metres as its speed says, in bends as well."""

from __future__ import annotations

import itertools
import math

import pytest

from odscen.scenario.story.channels import Channel
from odscen.scenario.story.motion_laws import SideLaw, steady
from tests.scenario.story.straight_road import CAR

RADIUS = 50.0
SPEED = 20.0
STEP = 0.1
BEND = tuple(
    (RADIUS * math.sin(way / RADIUS), RADIUS * (1.0 - math.cos(way / RADIUS)))
    for way in range(0, 141, 2)
)
"""A bend to the left, its points 2 m apart."""


@pytest.mark.parametrize("left", [-3.0, 0.0, 3.0])
def test_the_speed_beside_a_bend_is_that_on_the_ground(left: float) -> None:
    channel = Channel()
    channel.begin_step(CAR, 0.0)
    channel.take_speed(steady(0.0, SPEED), "r/0")
    channel.take_line(BEND, 0.0, SideLaw(-2.0, 0.0, left, 1.0), "r/0", 0.0)
    places = []
    for number in range(50):
        pose = channel.end_step(number * STEP, STEP, person=False).pose
        assert pose is not None
        places.append((pose.x, pose.y))
        channel.begin_step(CAR, (number + 1) * STEP)
    covered = sum(math.dist(a, b) for a, b in itertools.pairwise(places[5:36]))
    assert covered == pytest.approx(30 * STEP * SPEED, rel=0.004)
