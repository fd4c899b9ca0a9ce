"""A generator of one's own: cars where there is room, at half the limit.

Run it with ``python examples/own_generator.py [WORKSPACE]``.
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

import numpy as np

import odscen
from odscen.learn import Fill, FillRequest, GeneratorDoor

MAP = "town_5x5"


class Spread:
    """Cars at least ten nodes apart."""

    def fill(self, graph: object, request: FillRequest, rng: np.random.Generator) -> Fill:
        del graph
        (allowed, *_) = (mask for name, mask in request.allowed.items() if name == "car")
        nodes = rng.permutation(np.flatnonzero(allowed))
        apart = [node for k, node in enumerate(nodes) if not np.any(abs(nodes[:k] - node) < 10)]
        chosen = np.array(apart[: request.vehicles])
        speed = 0.5 * request.graph.lanes.speed_limit[chosen]
        return Fill(chosen, np.full(len(chosen), "car"), initial_speed=speed)


def fill(workspace: odscen.Workspace) -> None:
    settings = odscen.GenerationSettings(map_name=MAP, seed=5, fill=0.2, roi_segments=12)
    door = GeneratorDoor(name=f"{Path(__file__).resolve()}:Spread")
    (file,) = odscen.generate(workspace, settings=settings, generator=door)
    scenario = odscen.read_scenario(file)
    speeds = [actor.initial_speed for actor in scenario.actors]
    print(f"{len(scenario.actors)} cars, of them {sum(bool(speed) for speed in speeds)} moving")
    print("problems:", *(odscen.check(workspace, scenario) or ["none"]))


if __name__ == "__main__":
    root = Path(sys.argv[1] if sys.argv[1:] else tempfile.mkdtemp())
    store = odscen.Workspace.open(root)
    store.add_map(next(path for path in odscen.shipped_maps() if path.stem == MAP))
    fill(store)
