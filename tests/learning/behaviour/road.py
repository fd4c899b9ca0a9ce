"""A road of two lanes as a scene, and vehicles on it as an observation."""

from __future__ import annotations

from typing import Any

import numpy as np

from odscen.learning.behaviour.behaviour_model import AHEAD, BehaviourScene, RoadObservation
from odscen.learning.behaviour.lane_order import LaneOrder


def scene(count: int, *, step_length: float = 0.5, **fields: Any) -> BehaviourScene:
    """Two lanes, 1 left of 0, of 2 km and 20 m/s, and so many cars."""
    given = {
        "step_length": step_length,
        "time": 0.0,
        "vehicle_id": np.array([f"v{k}" for k in range(count)], dtype=np.str_),
        "vehicle_category": np.full(count, "car"),
        "vehicle_length": np.full(count, 5.0),
        "vehicle_width": np.full(count, 1.8),
        "desired_speed": np.full(count, np.nan),
        "speed_factor": np.ones(count),
        "ego": np.zeros(count, dtype=bool),
        "lane_id": np.array(["a_0", "a_1"]),
        "lane_length": np.full(2, 2000.0),
        "lane_limit": np.full(2, 20.0),
        "lane_width": np.full(2, 3.5),
        "lane_left": np.array([1, -1], dtype=np.int32),
        "lane_right": np.array([-1, 0], dtype=np.int32),
        "lane_shape_start": np.array([0, 2, 4], dtype=np.int32),
        "lane_shape_x": np.array([0.0, 2000.0, 0.0, 2000.0]),
        "lane_shape_y": np.array([0.0, 0.0, 3.5, 3.5]),
    }
    return BehaviourScene(**{**given, **fields})


def seen(
    road: BehaviourScene, lane: list[int], pos: list[float], speed: list[float], **fields: Any
) -> RoadObservation:
    """All vehicles of the scene."""
    count = len(lane)
    lanes, places = np.array(lane, dtype=np.int32), np.array(pos)
    ahead = np.full((count, AHEAD), -1, dtype=np.int32)
    leader, gap = LaneOrder(lanes, places, road.vehicle_length).leaders(ahead, road.lane_length)
    given = {
        "time": 0.0,
        "index": np.arange(count, dtype=np.int32),
        "x": places - 2.5,
        "y": 3.5 * lanes,
        "hdg": np.zeros(count),
        "speed": np.array(speed),
        "acceleration": np.zeros(count),
        "lane": lanes,
        "pos": places,
        "left": np.zeros(count),
        "leader": leader,
        "gap": gap,
        "ahead": ahead,
        "can_left": road.lane_left[lanes] >= 0,
        "can_right": road.lane_right[lanes] >= 0,
        "light": np.zeros(count, dtype=np.int32),
    }
    return RoadObservation(**{**given, **fields})
