"""A behaviour model of one's own: every third driver keeps at most 5 m/s.

Run it with ``python examples/own_driver.py [WORKSPACE]``.
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import odscen
from odscen.learn import BehaviourDoor, BehaviourScene, DrivingAction, RoadObservation

MAP = "roundabout"


class Dawdlers:
    """Drives a share of the vehicles; SUMO drives the others."""

    def __init__(self, share: float = 0.33, speed: float = 5.0) -> None:
        self.share, self.speed = share, speed

    def init(self, rng: np.random.Generator, scene: BehaviourScene) -> NDArray[np.bool_]:
        return rng.random(len(scene.vehicle_id)) < self.share

    def act(self, seen: RoadObservation, state: Any) -> tuple[DrivingAction, NDArray[np.bool_]]:
        faster = np.minimum(seen.speed + 0.5, self.speed)
        return DrivingAction(speed=faster), state[seen.index]


def compare(workspace: odscen.Workspace) -> None:
    settings = odscen.GenerationSettings(map_name=MAP, seed=2, fill=0.3)
    (file,) = odscen.generate(workspace, settings=settings)
    door = BehaviourDoor(name=f"{Path(__file__).resolve()}:Dawdlers", options={"share": 0.5})
    for name, behaviour in (("sumo", None), ("dawdlers", door)):
        run = odscen.run(
            workspace, file, settings=odscen.RunSettings(until=60, behaviour=behaviour), name=name
        )
        print(f"{name}: mean speed {run.figure('mean_speed'):.2f} m/s")


if __name__ == "__main__":
    root = Path(sys.argv[1] if sys.argv[1:] else tempfile.mkdtemp())
    store = odscen.Workspace.open(root)
    store.add_map(next(path for path in odscen.shipped_maps() if path.stem == MAP))
    compare(store)
