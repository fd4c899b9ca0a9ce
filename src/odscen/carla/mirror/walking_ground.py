"""Where pedestrians' feet belong on the server: its sidewalks are higher than the map says.

Sidewalks of CARLA's worlds, generated ones too, stand above the surface of the OpenDRIVE file (pull
request 2491 of carla-simulator/carla), so the server is asked, once for each half metre that a
pedestrian comes to, where it will be after the next step: now the answer would be its own body.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from odscen.carla.server.carla_server import Server
    from odscen.sumo.runner.in_step import Step

MOST_CALLS = 12
"""Places that the server is asked for in a step; the others keep the height that they had."""
HIGHEST = 0.5
"""Metres that a surface may be off the map's; further off it is something else."""
LEAST_AHEAD = 0.4
"""Metres ahead of a pedestrian, at least, at which the ground is looked at."""
_CELL = 0.5
"""Metres from one place to the next that the server is asked for."""
AGAIN = 1.0
"""Seconds after which a place where no ground was found is asked for again: a large map's tile may
be there by then, or a body gone."""


class WalkingGround:
    """What the server's ground is higher than the map's, place by place.

    Parameters
    ----------
    walks
        Whether each row of the plan is on foot, shape ``(N,)``.
    """

    def __init__(self, server: Server, walks: np.ndarray) -> None:
        self._server = server
        self._walks = walks
        self._cells: dict[tuple[int, int, int], float] = {}
        self._blind: dict[tuple[int, int, int], float] = {}
        self._held: dict[int, float] = {}
        self._time = 0.0

    def under(self, step: Step) -> Step:
        """The same step, pedestrians on the server's ground.

        Raises
        ------
        CarlaError
            If the server does not answer.
        """
        on_foot = np.flatnonzero(self._walks[step.index])
        if not len(on_foot):
            return step
        z, left = step.z.copy(), MOST_CALLS
        passed = max(0.0, step.time - self._time)
        self._time = step.time
        for k in on_foot.tolist():
            row = int(step.index[k])
            x, y, hdg = float(step.x[k]), float(step.y[k]), float(step.hdg[k])
            ahead = max(float(step.speed[k]) * passed, LEAST_AHEAD) if row in self._held else 0.0
            there = (
                x + ahead * float(np.cos(hdg)),
                y + ahead * float(np.sin(hdg)),
                float(z[k] + ahead * np.tan(step.pitch[k])),
            )
            if left and self._may_ask(self._cell(*there)):
                left -= 1
                self._ask(*there)
            known = self._cells.get(self._cell(x, y, z[k]))
            if known is not None:
                self._held[row] = known
            z[k] += self._held.setdefault(row, 0.0)
        return replace(step, z=z)

    def _ask(self, x: float, y: float, z: float) -> None:
        ground = self._server.ground_below(x, -y, z + HIGHEST, 2.0 * HIGHEST)
        if ground is None:
            self._blind[self._cell(x, y, z)] = self._time
        else:
            self._cells[self._cell(x, y, z)] = ground - z

    def _may_ask(self, cell: tuple[int, int, int]) -> bool:
        return cell not in self._cells and self._time >= self._blind.get(cell, -AGAIN) + AGAIN

    @staticmethod
    def _cell(x: float, y: float, z: float) -> tuple[int, int, int]:
        return int(np.floor(x / _CELL)), int(np.floor(y / _CELL)), round(z / 4.0)
