"""What both worlds show after each step, taken down side by side.

CARLA's side is read from the newest state that the server has streamed, not from what it was sent:
so a lost command, a vehicle that physics has moved, or a light that another program switches shows.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from odscen.base.frames import CarlaPose, XodrPose, carla_to_xodr
from odscen.carla.server.blueprints import Shape
from odscen.simulators.parity_files import PARITY_LIGHTS, PARITY_STATES, write_parity

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from pathlib import Path

    import polars as pl

    from odscen.drawing.map_drawing import MapDrawing
    from odscen.records.run_plan import Plan
    from odscen.sumo.runner.in_step import Step

_NO_SHAPE = Shape((0.0, 0.0, 0.0))
_NOWHERE = (math.nan, math.nan, math.nan, math.nan)


class StateRecorder:
    """Takes both worlds down, step by step.

    Parameters
    ----------
    blueprints, shapes
        What represents each road user of the plan, and the boxes of these: places are compared at
        the centre of the body, which is not an actor's origin.
    """

    def __init__(self, plan: Plan, blueprints: Sequence[str], shapes: Mapping[str, Shape]) -> None:
        self._plan = plan
        self._shapes = [shapes.get(name, _NO_SHAPE) for name in blueprints]
        self._walks = [actor.person for actor in plan.actors]
        self._states: list[np.ndarray] = []
        self._lights: list[tuple[float, str, str, str]] = []

    def take(
        self,
        step: Step,
        snapshot: Any,
        actors: Mapping[int, int],
        lights: Mapping[str, tuple[str, str]],
    ) -> None:
        """Take one step down.

        Parameters
        ----------
        snapshot
            ``carla.WorldSnapshot`` of the tick that shows the step.
        actors
            Actor on the server for each row of the plan that is shown.
        lights
            State in SUMO and state in CARLA of each signal that both have.
        """
        rows = step.index.tolist()
        shown = np.array([self._ground_pose(snapshot, row, actors.get(row)) for row in rows])
        mine = np.column_stack(
            [np.full(len(rows), step.time), step.index, step.x, step.y, step.z, step.hdg]
        )
        self._states.append(np.column_stack([mine, shown.reshape(-1, 4)]))
        self._lights += [(step.time, name, *pair) for name, pair in lights.items()]

    def tables(self) -> tuple[pl.DataFrame, pl.DataFrame]:
        """States and lights, as :mod:`odscen.figures.measures.parity` wants them."""
        import polars as pl

        table = np.concatenate([np.empty((0, len(PARITY_STATES))), *self._states])
        states = pl.DataFrame(table, schema=PARITY_STATES, orient="row").with_columns(
            pl.col("row").cast(pl.Int64)
        )
        types = (pl.Float64, pl.String, pl.String, pl.String)
        lights = pl.DataFrame(
            self._lights, schema=dict(zip(PARITY_LIGHTS, types, strict=True)), orient="row"
        )
        return states, lights

    def write(self, folder: Path, drawing: MapDrawing | None) -> None:
        """Write the parity report, its figures and its tables into a run folder."""
        states, lights = self.tables()
        write_parity(folder, states, lights, self._plan, drawing)

    def _ground_pose(
        self, snapshot: Any, row: int, actor: int | None
    ) -> tuple[float, float, float, float]:
        """Ground below the body's centre, OpenDRIVE frame, and heading; NaN for none."""
        state = None if actor is None else snapshot.find(actor)
        if state is None:
            return _NOWHERE
        at = state.get_transform()
        where, turn, shape = at.location, at.rotation, self._shapes[row]
        pose: XodrPose = carla_to_xodr(CarlaPose(where.x, where.y, where.z, turn.yaw, turn.pitch))
        ahead, pitch, hdg = shape.centre[0], float(pose.pitch), float(pose.hdg)
        aside = shape.centre[1]
        level = ahead * math.cos(pitch)
        z = float(pose.z) + ahead * math.sin(pitch)
        if self._walks[row]:
            z -= shape.extent[2] - shape.centre[2]
        return (
            float(pose.x) + level * math.cos(hdg) + aside * math.sin(hdg),
            float(pose.y) + level * math.sin(hdg) - aside * math.cos(hdg),
            z,
            hdg,
        )
