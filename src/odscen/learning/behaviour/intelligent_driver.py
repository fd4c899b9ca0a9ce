r"""Intelligent driver model with lane changes, for all vehicles at once.

Car following (Treiber, Hennecke and Helbing, 2000), with speed v, gap s to a leader that is slower
by dv, and desired speed v0:

    a = a_max (1 - (v / v0)^4 - (s* / s)^2),  s* = s0 + max(0, v T + v dv / (2 sqrt(a_max b)))

A red light is a leader that stands at the stop line, a yellow one where it can be stopped for.

Lane changes (MOBIL; Kesting, Treiber and Helbing, 2007): if the new follower need not brake harder
than ``b_safe`` and

    a_new - a + politeness (a_follower_new - a_follower) > threshold

Both use SUMO's checked speeds: right of way and what else is unsafe stays SUMO's.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from odscen.learning.behaviour.behaviour_model import DrivingAction, LightAhead
from odscen.learning.behaviour.lane_order import LaneOrder
from odscen.learning.offered_options import offered

if TYPE_CHECKING:
    from odscen.base.arrays import BoolArray, FloatArray, Int32Array, IntArray
    from odscen.learning.behaviour.behaviour_model import BehaviourScene, RoadObservation

_STOP_GAP = 1.0
"""Metres before a stop line at which a driver wants to stand."""
_EVERY = 1.0
"""Seconds after which each vehicle thinks of changing lanes again."""


class DriverState(NamedTuple):
    """What the model keeps: of each vehicle of the scene its desire to be faster than the limit."""

    scene: BehaviourScene
    desire: FloatArray


@dataclass(frozen=True, slots=True)
class IntelligentDriver:
    """Intelligent driver model (IDM), with lane changes by MOBIL.

    Attributes
    ----------
    acceleration, deceleration
        ``a_max`` and ``b``, m/s^2.
    headway
        ``T``, seconds.
    gap
        ``s0``, metres.
    politeness, threshold, safe_braking
        Of lane changes; threshold and braking in m/s^2.
    spread
        Deviation of desired speeds, drawn for each vehicle, as a share; 0 for SUMO's alone.
    changes_lanes
        False leaves lane changes to SUMO.
    """

    acceleration: float = offered(1.8, "Acceleration, m/s²", low=0.1, high=10.0)
    deceleration: float = offered(2.5, "Comfortable deceleration, m/s²", low=0.1, high=10.0)
    headway: float = offered(1.2, "Time headway, s", low=0.0, high=10.0)
    gap: float = offered(2.0, "Gap at standstill, m", low=0.0, high=50.0)
    politeness: float = offered(0.2, "Politeness of lane changes", low=0.0, high=1.0)
    threshold: float = offered(0.2, "Least gain of a lane change, m/s²", low=0.0, high=10.0)
    safe_braking: float = offered(
        3.0, "Maximum deceleration of a new follower, m/s²", low=0.0, high=10.0
    )
    spread: float = offered(
        0.0, "Deviation of desired speeds", low=0.0, high=0.5,
        meaning="share of the limit; 0 for SUMO's alone",
    )  # fmt: skip
    changes_lanes: bool = offered(True, "Lane changes by the model")

    def init(self, rng: np.random.Generator, scene: BehaviourScene) -> DriverState:
        """Draw how fast each wants to be."""
        drawn = 1.0 + self.spread * np.clip(rng.standard_normal(len(scene.vehicle_id)), -2.0, 2.0)
        return DriverState(scene, scene.speed_factor * drawn)

    def act(
        self, observation: RoadObservation, state: DriverState
    ) -> tuple[DrivingAction, BoolArray]:
        """Speeds after the next step, and wishes to change lanes."""
        scene, seen = state.scene, observation
        controlled = seen.lane >= 0
        wanted = desired_speeds(seen, scene, state.desire)
        leading = np.append(seen.speed, 0.0)[seen.leader]
        own = self.follow(seen.speed, wanted, seen.gap, leading)
        free = np.minimum(own, self._at_light(seen, scene, wanted))
        speed = np.maximum(seen.speed + free * scene.step_length, 0.0)
        change = self._wanted_changes(seen, scene, wanted, own) if self.changes_lanes else None
        return DrivingAction(speed=speed, change=change), controlled

    def follow(
        self, speed: FloatArray, wanted: FloatArray, gap: FloatArray, leading: FloatArray
    ) -> FloatArray:
        """Acceleration behind a leader; an infinite gap is none. All of one shape."""
        over = speed * (speed - leading) / (2.0 * math.sqrt(self.acceleration * self.deceleration))
        near = self.gap + np.maximum(speed * self.headway + over, 0.0)
        share = near / np.maximum(gap, 0.1)
        found: FloatArray = self.acceleration * (
            1.0 - (speed / np.maximum(wanted, 0.1)) ** 4 - share**2
        )
        return found

    def _at_light(
        self, seen: RoadObservation, scene: BehaviourScene, wanted: FloatArray
    ) -> FloatArray:
        """Acceleration before a light."""
        rest = scene.lane_length[seen.lane] - seen.pos
        stops = seen.speed**2 / (2.0 * self.deceleration) < rest
        red = (seen.light == LightAhead.RED) | ((seen.light == LightAhead.YELLOW) & stops)
        # The line is no bumper: without the gap that a driver keeps to one.
        gap = np.where(red & (seen.lane >= 0), rest - _STOP_GAP + self.gap, np.inf)
        return self.follow(seen.speed, wanted, gap, np.zeros(len(seen)))

    def _wanted_changes(
        self, seen: RoadObservation, scene: BehaviourScene, wanted: FloatArray, own: FloatArray
    ) -> Int32Array:
        change = np.zeros(len(seen), dtype=np.int32)
        every = max(round(_EVERY / scene.step_length), 1)
        turn = (seen.index + round(seen.time / scene.step_length)) % every == 0
        rows = np.flatnonzero(turn & (seen.can_left | seen.can_right) & (seen.speed > 1.0))
        if not len(rows):
            return change
        length = scene.vehicle_length[seen.index]
        order = LaneOrder(seen.lane, seen.pos, length)
        best = np.full(len(rows), self.threshold)
        for side, can, beside in (
            (1, seen.can_left, scene.lane_left), (-1, seen.can_right, scene.lane_right),
        ):  # fmt: skip
            gain = self._gain_of_change(
                seen, order, rows, beside[seen.lane[rows]], wanted, own, length
            )
            better = can[rows] & (gain > best)
            change[rows[better]] = side
            best[better] = gain[better]
        return change

    def _gain_of_change(
        self,
        seen: RoadObservation,
        order: LaneOrder,
        rows: IntArray,
        lane: Int32Array,
        wanted: FloatArray,
        own: FloatArray,
        length: FloatArray,
    ) -> FloatArray:
        """What a change to a lane gives, m/s^2; minus infinity where it is not safe."""
        speeds, wishes = np.append(seen.speed, 0.0), np.append(wanted, 1.0)
        pos = seen.pos[rows]
        leader, gap = order.ahead(lane, pos)
        follower, behind = order.behind(lane, pos, length[rows])
        mine = self.follow(seen.speed[rows], wanted[rows], gap, speeds[leader])
        theirs = self.follow(speeds[follower], wishes[follower], behind, seen.speed[rows])
        before = self.follow(
            speeds[follower], wishes[follower], behind + gap + length[rows], speeds[leader]
        )
        there = follower >= 0
        others = np.where(there, theirs - before, 0.0)
        unsafe = (there & ((theirs < -self.safe_braking) | (behind < 0.0))) | (gap < 0.0)
        gain: FloatArray = mine - own[rows] + self.politeness * others
        return np.where(unsafe, -np.inf, gain)


def desired_speeds(seen: RoadObservation, scene: BehaviourScene, factor: FloatArray) -> FloatArray:
    """Speed of each one in free flow: the limit times a factor ``(V,)``, or its own if lower."""
    limit = np.where(seen.lane >= 0, scene.lane_limit[seen.lane], 13.9) * factor[seen.index]
    own = scene.desired_speed[seen.index]
    return np.fmin(limit, own)
