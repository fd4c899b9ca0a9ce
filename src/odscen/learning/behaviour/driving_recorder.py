"""Records what SUMO's drivers see and how they then accelerate; a model that controls nobody."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from odscen.learning.behaviour.behaviour_model import DrivingAction
from odscen.learning.behaviour.imitation_driver import sight

if TYPE_CHECKING:
    from odscen.base.arrays import BoolArray, FloatArray, Int32Array
    from odscen.learning.behaviour.behaviour_model import BehaviourScene, RoadObservation
    from odscen.learning.fill import Array


@dataclass
class DrivingRecorder:
    """The model; writes ``x`` (what was seen), ``acceleration`` and ``speed`` when the run is over.

    Attributes
    ----------
    file
        ``.npz`` file to write.
    every
        Of so many steps one is recorded.
    """

    file: str
    every: float = 4.0
    _steps: int = 0
    _before: tuple[Int32Array, FloatArray, Array] | None = None
    _rows: list[tuple[Array, FloatArray, FloatArray]] = field(default_factory=list)

    def init(self, rng: np.random.Generator, scene: BehaviourScene) -> BehaviourScene:
        """Begin."""
        del rng
        return scene

    def act(
        self, observation: RoadObservation, state: BehaviourScene
    ) -> tuple[DrivingAction, BoolArray]:
        """Remember what is seen, and in the next step what came of it."""
        seen = observation
        if self._before is not None:
            index, speed, x = self._before
            _, old, new = np.intersect1d(index, seen.index, return_indices=True)
            faster = (seen.speed[new] - speed[old]) / state.step_length
            self._rows.append((x[old], faster, speed[old]))
        due = self._steps % max(int(self.every), 1) == 0
        self._before = (seen.index, seen.speed, sight(seen, state)) if due else None
        self._steps += 1
        return DrivingAction(speed=seen.speed), np.zeros(len(seen), dtype=np.bool_)

    def close(self) -> None:
        """Write it, if there is any."""
        if not self._rows:
            return
        names = ("x", "acceleration", "speed")
        columns = [np.concatenate([row[k] for row in self._rows]) for k in range(3)]
        with Path(self.file).open("wb") as stream:
            arrays: dict[str, Any] = dict(zip(names, columns, strict=True))
            np.savez(stream, **arrays)
