"""An agent drives the ego of a cut-in in Gymnasium's interface: the same seed, the same episode.

Needs ``pip install 'odscen[rl]'``. Run it with ``python examples/drive_the_ego.py [WORKSPACE]``.
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

import numpy as np

import odscen
from odscen.rl import EgoEnvironment

MAP = "motorway_weave"


def drive(workspace: odscen.Workspace) -> None:
    environment = EgoEnvironment(workspace, odscen.place_template(workspace, "cut-in", MAP))
    for episode in range(2):
        environment.reset(seed=3)
        total, steps, over = 0.0, 0, False
        while not over and steps < 40:
            gentle = np.array([0.5], dtype=np.float32)  # m/s^2
            _, reward, terminated, truncated, _ = environment.step(gentle)
            total, steps, over = total + reward, steps + 1, terminated or truncated
        print(f"episode {episode}: {steps} steps, return {total:.6f}")
    environment.close()


if __name__ == "__main__":
    root = Path(sys.argv[1] if sys.argv[1:] else tempfile.mkdtemp())
    store = odscen.Workspace.open(root)
    store.add_map(next(path for path in odscen.shipped_maps() if path.stem == MAP))
    drive(store)
