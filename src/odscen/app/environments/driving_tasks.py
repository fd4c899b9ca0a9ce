"""What environments have in common: what an agent sees, does and gets."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from odscen.learning.behaviour.behaviour_model import DrivingAction
from odscen.learning.behaviour.imitation_driver import FEATURES, sight
from odscen.learning.behaviour.intelligent_driver import desired_speeds

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from odscen.base.arrays import BoolArray, FloatArray
    from odscen.learning.behaviour.behaviour_model import BehaviourScene, RoadObservation
    from odscen.learning.fill import Array

    Reward = Callable[[RoadObservation, BehaviourScene], FloatArray]
    """Reward of each vehicle for the step that led to an observation, ``(N,)``."""

SEES = len(FEATURES)
HIGHEST = 10.0
"""Of any number that is seen."""
HARDEST, STRONGEST = -6.0, 4.0
"""Accelerations, m/s^2."""


def progress_reward(seen: RoadObservation, scene: BehaviourScene) -> FloatArray:
    """Share of the desired speed, at most 1; -10 where the gap to the vehicle ahead is used up."""
    wanted = desired_speeds(seen, scene, scene.speed_factor)
    share = np.minimum(seen.speed / np.maximum(wanted, 0.1), 1.0)
    found: FloatArray = np.where(seen.gap <= 0.0, -10.0, share)
    return found


def features(seen: RoadObservation, scene: BehaviourScene) -> Array:
    """What each vehicle sees, ``(N, SEES)`` float32 from 0 to :data:`HIGHEST`."""
    return np.clip(sight(seen, scene), 0.0, HIGHEST)


def accelerated(
    seen: RoadObservation, scene: BehaviourScene, wanted: Mapping[int, float]
) -> tuple[DrivingAction, BoolArray]:
    """Speeds of rows that accelerate by so much, m/s^2; the others stay SUMO's."""
    controlled = np.zeros(len(seen), dtype=np.bool_)
    speed = seen.speed.copy()
    for row, faster in wanted.items():
        controlled[row] = True
        limited = float(np.clip(faster, HARDEST, STRONGEST))
        speed[row] = max(seen.speed[row] + limited * scene.step_length, 0.0)
    return DrivingAction(speed=speed), controlled
