"""Frames of a running simulation: where everyone is, as bytes that a browser reads without parsing.

A frame is little-endian float32: a header of :data:`HEADER` numbers, then :data:`COLUMNS` numbers
for each road user.

====== =====================================================================================
header step, time, n, real-time factor, how many have arrived
row    index, x, y, hdg, speed, flags
====== =====================================================================================

``time`` is that at which the step began, as in the recorded trajectories. ``index`` is the actor's
row in the plan. x, y, hdg are the body centre in the OpenDRIVE frame, minus :func:`origin`, for
float32 has seven digits. ``flags`` is a sum of :class:`Flag`.
"""

from __future__ import annotations

from enum import IntFlag
from typing import TYPE_CHECKING

import numpy as np

from odscen.base.frames import SumoPose, sumo_to_xodr
from odscen.sumo.worker.simulation.observed import VehicleSignal

if TYPE_CHECKING:
    from odscen.records.run_plan import Plan
    from odscen.sumo.worker.simulation.observed import Poses
    from odscen.sumo.worker.simulation.session import Session

HEADER = 5
COLUMNS = 6

_NEAR = 10_000.0
"""Metres from zero at which float32 still tells millimetres apart."""


class Flag(IntFlag):
    """What can be seen on a road user."""

    LEFT = 1
    RIGHT = 2
    BRAKE = 4


def origin(plan: Plan) -> tuple[float, float]:
    """What is subtracted from x and y in frames: nothing near zero, else whole kilometres."""
    if not plan.actors:
        return 0.0, 0.0
    x, y = plan.actors[0].x, plan.actors[0].y
    if abs(x) < _NEAR and abs(y) < _NEAR:
        return 0.0, 0.0
    return round(x, -3), round(y, -3)


class Snapshots:
    """Makes frames of one run."""

    def __init__(self, plan: Plan) -> None:
        self._row = {actor.id: row for row, actor in enumerate(plan.actors)}
        self._length = np.array([actor.length for actor in plan.actors], dtype=np.float64)
        self._offset = plan.net_offset
        self._origin = origin(plan)

    def frame(
        self, session: Session, *, step: int, time: float, real_time_factor: float, arrived: int
    ) -> bytes:
        """Bytes of a frame; road users who are not in the plan are not in it."""
        rows = np.concatenate(
            [
                self._make_rows(session.vehicle_poses()),
                self._make_rows(session.person_poses()),
            ]
        )
        return frame_bytes(
            rows, step=step, time=time, real_time_factor=real_time_factor, arrived=arrived
        )

    def _make_rows(self, poses: Poses) -> np.ndarray:
        index = np.array([self._row.get(name, -1) for name in poses.ids], dtype=np.int64)
        known = (index >= 0) & (np.abs(poses.x) < 1e8)  # SUMO's INVALID_DOUBLE_VALUE, -2^30
        index = index[known]
        pose = sumo_to_xodr(
            SumoPose(poses.x[known], poses.y[known], 0.0, poses.angle_deg[known]),
            length=self._length[index],
            net_offset=self._offset,
        )
        centres = np.asarray(pose.x), np.asarray(pose.y), np.asarray(pose.hdg)
        return frame_rows(
            index, *centres, poses.speed[known], poses.signals[known], origin=self._origin
        )


def frame_rows(
    index: np.ndarray,
    x: np.ndarray,
    y: np.ndarray,
    hdg: np.ndarray,
    speed: np.ndarray,
    signals: np.ndarray,
    *,
    origin: tuple[float, float],
) -> np.ndarray:
    """Rows of a frame, shape ``(N, COLUMNS)``; ``signals`` are bits of :class:`VehicleSignal`."""
    rows = np.empty((len(index), COLUMNS), dtype="<f4")
    rows[:, 0] = index
    rows[:, 1] = x - origin[0]
    rows[:, 2] = y - origin[1]
    rows[:, 3] = hdg
    rows[:, 4] = speed
    rows[:, 5] = _compute_flags(signals)
    return rows


def frame_bytes(
    rows: np.ndarray, *, step: int, time: float, real_time_factor: float, arrived: int
) -> bytes:
    """Bytes of a frame: header and rows."""
    header = np.array([step, time, len(rows), real_time_factor, arrived], dtype="<f4")
    return header.tobytes() + rows.tobytes()


def _compute_flags(signals: np.ndarray) -> np.ndarray:
    left = (signals & (VehicleSignal.BLINKER_LEFT | VehicleSignal.BLINKER_EMERGENCY)) > 0
    right = (signals & (VehicleSignal.BLINKER_RIGHT | VehicleSignal.BLINKER_EMERGENCY)) > 0
    brake = (signals & VehicleSignal.BRAKE) > 0
    flags: np.ndarray = left * Flag.LEFT + right * Flag.RIGHT + brake * Flag.BRAKE
    return flags
