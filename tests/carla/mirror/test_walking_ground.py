"""Pedestrians are put on the server's ground, which is asked for place by place."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any, cast

import numpy as np
import pytest

from odscen.carla.mirror.lane_surface import LaneSurface
from odscen.carla.mirror.walking_ground import AGAIN, MOST_CALLS, WalkingGround
from tests.carla.mirror.test_wheels import step_of

ROOT = Path(__file__).parents[3]
LANES = (ROOT / "maps" / "signal_crossing.xodr").read_bytes()
FAR = 10_000.0
"""Metres of x where the map has no lanes, so that each place is asked for by itself."""


class Kerbs:
    """A server whose ground is 0.1 m higher than the map's, once it is there."""

    def __init__(self) -> None:
        self.there = True
        self.asked = 0

    def ground_below(self, _x: float, _y: float, _z: float, _reach: float) -> float | None:
        self.asked += 1
        return 0.1 if self.there else None


def heights(ground: WalkingGround, time: float, *places: float) -> list[float]:
    step = replace(step_of([(FAR + x, 0.0, 0.0) for x in places]), time=time)
    return list(ground.under(step).z.tolist())


def made(server: Kerbs, count: int) -> WalkingGround:
    walks = np.ones(count, dtype=np.bool_)
    return WalkingGround(cast("Any", server), walks, lambda: LaneSurface.of(LANES))


def test_a_place_without_ground_is_asked_for_again_a_second_later() -> None:
    server = Kerbs()
    server.there = False
    ground = made(server, 1)
    assert heights(ground, 0.0, 5.0) == [0.0]
    server.there = True
    assert heights(ground, AGAIN / 2, 5.0) == [0.0]
    assert server.asked == 1
    assert heights(ground, AGAIN, 5.0) == pytest.approx([0.1])
    assert server.asked == 2


def test_no_more_places_are_asked_for_in_a_step_than_there_is_time_for() -> None:
    server = Kerbs()
    ground = made(server, 40)
    told = heights(ground, 0.0, *[3.0 * k for k in range(40)])
    assert server.asked == MOST_CALLS
    assert told == pytest.approx([0.1] * MOST_CALLS + [0.0] * (40 - MOST_CALLS))
    heights(ground, 0.5, 0.0)
    assert server.asked == MOST_CALLS, "known already"
    heights(ground, 1.0, 0.2)
    assert server.asked == MOST_CALLS + 1, "half a metre ahead, once"
    heights(ground, 1.5, 0.2)
    assert server.asked == MOST_CALLS + 1
