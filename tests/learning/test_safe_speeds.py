"""Speeds from which everyone can stop behind the one ahead."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from odscen.learning.safe_speeds import DECELERATION, REACTION, STANDING_GAP, safe_speeds
from tests.graphs import two_lane_road

LANES = two_lane_road(300.0).lanes
LANE = int(LANES.lane[0])
NODES = np.flatnonzero(LANES.lane == LANE)


def test_who_has_a_clear_road_keeps_the_speed() -> None:
    assert safe_speeds(LANES, nodes=[int(NODES[3])], lengths=[5.0], speeds=[30.0]) == [30.0]


def test_behind_a_standing_vehicle_the_way_to_stop_is_the_gap() -> None:
    nodes = [int(NODES[5]), int(NODES[25])]
    gap = float(LANES.offset[nodes[1]] - LANES.offset[nodes[0]]) - 5.0 - STANDING_GAP
    behind, ahead = safe_speeds(LANES, nodes=nodes, lengths=[5.0, 5.0], speeds=[30.0, 0.0])
    assert ahead == 0.0
    assert behind * REACTION + behind**2 / (2 * DECELERATION) == pytest.approx(gap)


def test_bumper_to_bumper_the_one_behind_stands() -> None:
    nodes = [int(NODES[5]), int(NODES[8])]
    assert safe_speeds(LANES, nodes=nodes, lengths=[5.0, 5.0], speeds=[9.0, 0.0])[0] == 0.0


@settings(max_examples=60, deadline=None)
@given(
    st.lists(st.integers(0, len(NODES) - 1), min_size=1, max_size=12, unique=True),
    st.data(),
)
def test_a_whole_queue_can_stop(rows: list[int], data: st.DataObject) -> None:
    rows.sort()
    nodes = [int(NODES[row]) for row in rows]
    speeds = [data.draw(st.floats(0, 40)) for _ in nodes]
    found = safe_speeds(LANES, nodes=nodes, lengths=[1.0] * len(nodes), speeds=speeds)
    assert all(got <= wanted for got, wanted in zip(found, speeds, strict=True))
    for k in range(len(nodes) - 1):
        gap = float(LANES.offset[nodes[k + 1]] - LANES.offset[nodes[k]]) - 1.0
        if gap > 110.0:
            continue
        stops = found[k] * REACTION + found[k] ** 2 / (2 * DECELERATION)
        assert stops <= max(gap - STANDING_GAP, 0.0) + found[k + 1] ** 2 / (2 * DECELERATION) + 1e-6
    assert all(math.isfinite(one) for one in found)
