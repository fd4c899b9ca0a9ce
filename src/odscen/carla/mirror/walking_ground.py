"""Where pedestrians' feet belong on the server: its sidewalks are higher than the map says.

Sidewalks of CARLA's worlds, generated ones too, stand above the surface of the OpenDRIVE file (pull
request 2491 of carla-simulator/carla), so the server is asked, once for each half metre that a
pedestrian comes to, where it will be after the next step: now the answer would be its own body.

What is learned is how much higher than the file's lane the ground is, by the kind of the lane. In
every tick feet are put on the lane that is below them then, as much higher: a pedestrian steps over
a kerb in the tick in which its centre passes the border of the lane, as the ground does.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Self

import numpy as np

from odscen.carla.mirror.lane_surface import NOWHERE

if TYPE_CHECKING:
    from collections.abc import Callable

    from odscen.base.arrays import BoolArray, FloatArray, IntArray
    from odscen.carla.mirror.lane_surface import LaneSurface, Surface
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

_Cell = tuple[int, int, int, int]


@dataclass(frozen=True, slots=True, eq=False)
class _WalkerGround:
    """Where those on foot are after a step, by row of the plan; NaN where one is not there.

    ``z`` is the map's height, ``rise`` what the server's ground is higher there.
    """

    x: FloatArray
    y: FloatArray
    z: FloatArray
    rise: FloatArray
    kind: IntArray

    @classmethod
    def nobody(cls, count: int) -> Self:
        """Return a stand of no one in a plan of so many."""
        nan = np.full(count, np.nan)
        return cls(nan, nan, nan, np.zeros(count), np.full(count, NOWHERE, dtype=np.int64))

    def then(self, rows: IntArray, at: FloatArray, kind: IntArray) -> Self:
        """Return a stand of some only: x, y, z and rise, shape ``(4, N)``, and kinds of lanes."""
        nan = np.full((3, len(self.x)), np.nan)
        places = np.vstack([nan, self.rise])
        kinds = self.kind.copy()
        places[:, rows], kinds[rows] = at, kind
        x, y, z, rise = places
        return type(self)(x, y, z, rise, kinds)


class WalkingGround:
    """What the server's ground is higher than the map's, place by place.

    Parameters
    ----------
    walks
        Whether each row of the plan is on foot, shape ``(N,)``.
    surface
        Makes the surface of the map's lanes; called once somebody is on foot.
    """

    def __init__(
        self, server: Server, walks: BoolArray, surface: Callable[[], LaneSurface]
    ) -> None:
        self._server = server
        self._walks = walks
        self._make_surface = surface
        self._surface: LaneSurface | None = None
        self._raised = np.zeros(0)
        self._cells: dict[_Cell, float] = {}
        self._blind: dict[_Cell, float] = {}
        self._asked = np.full(len(walks), -np.inf)
        self._time = 0.0
        self._last = self._now = _WalkerGround.nobody(len(walks))

    def under(self, step: Step) -> Step:
        """The same step, pedestrians on the server's ground; it is the next one of :meth:`between`.

        Raises
        ------
        CarlaError
            If the server does not answer.
        """
        passed, self._time = max(0.0, step.time - self._time), step.time
        on_foot = np.flatnonzero(self._walks[step.index])
        rows = step.index[on_foot]
        if not len(on_foot):
            self._last, self._now = self._now, _WalkerGround.nobody(len(self._walks))
            return step
        x, y, near = step.x[on_foot], step.y[on_foot], step.z[on_foot]
        self._ask_ahead(step, on_foot, passed)
        here = self._surface_below(x, y, near)
        known = [self._cells.get(cell) for cell in self._cells_of_places(x, y, near, here.kind)]
        rise = np.where(here.kind == self._now.kind[rows], self._now.rise[rows], np.nan)
        rise = np.where(np.isnan(rise), self._usual_heights(here.kind), rise)
        rise = np.where(
            [height is None for height in known], rise, np.array(known, dtype=np.float64)
        )
        stand = self._now.then(rows, np.stack([x, y, here.z, rise]), here.kind)
        self._last, self._now = self._now, stand
        z = step.z.copy()
        z[on_foot] = here.z + rise
        return replace(step, z=z)

    def between(self, shown: Step) -> Step:
        """What is shown on the way to the last step, pedestrians on the ground below them then."""
        on_foot = np.flatnonzero(self._walks[shown.index])
        if not len(on_foot):
            return shown
        rows = shown.index[on_foot]
        x, y = shown.x[on_foot], shown.y[on_foot]
        last, now = self._last, self._now
        share = self._share_of_way(x, y, rows)
        here = self._surface_below(x, y, last.z[rows] + share * (now.z[rows] - last.z[rows]))
        left, right = here.kind == last.kind[rows], here.kind == now.kind[rows]
        # On the far side of a kerb the ground is as it is there, all the way up to the kerb.
        share = np.where(left & right, share, np.where(right, 1.0, 0.0))
        rise = last.rise[rows] + share * (now.rise[rows] - last.rise[rows])
        rise = np.where(left | right, rise, self._usual_heights(here.kind))
        z = shown.z.copy()
        z[on_foot] = here.z + rise
        return replace(shown, z=z)

    def _share_of_way(self, x: FloatArray, y: FloatArray, rows: IntArray) -> FloatArray:
        """How far places are on the way from the last step to this one; 1 for who stands."""
        ax, ay = self._last.x[rows], self._last.y[rows]
        bx, by = self._now.x[rows] - ax, self._now.y[rows] - ay
        whole = bx**2 + by**2
        moves = whole > 1e-12
        along = (x - ax) * bx + (y - ay) * by
        return np.where(moves, np.clip(along / np.where(moves, whole, 1.0), 0.0, 1.0), 1.0)

    def _surface_below(self, x: FloatArray, y: FloatArray, near: FloatArray) -> Surface:
        """Give the map's surface; where it has none, ``near``."""
        if self._surface is None:
            self._surface = self._make_surface()
            self._raised = np.zeros(len(self._surface.kinds))
        surface = self._surface.at(x, y, near, self._raised)
        return surface._replace(z=np.where(surface.kind == NOWHERE, near, surface.z))

    def _usual_heights(self, kind: IntArray) -> FloatArray:
        """What the server has last said of lanes of each kind."""
        return np.append(self._raised, 0.0)[kind]

    def _ask_ahead(self, step: Step, on_foot: IntArray, passed: float) -> None:
        """Ask for where pedestrians will be; those first for whom that was longest ago."""
        rows = step.index[on_foot]
        fresh = np.isnan(self._now.x[rows])
        ahead = np.where(fresh, 0.0, np.maximum(step.speed[on_foot] * passed, LEAST_AHEAD))
        x = step.x[on_foot] + ahead * np.cos(step.hdg[on_foot])
        y = step.y[on_foot] + ahead * np.sin(step.hdg[on_foot])
        near = step.z[on_foot] + ahead * np.tan(step.pitch[on_foot])
        there = self._surface_below(x, y, near)
        cells = self._cells_of_places(x, y, near, there.kind)
        left = MOST_CALLS
        for k in np.argsort(self._asked[rows], kind="stable").tolist():
            if not left:
                return
            if self._may_ask(cells[k]):
                left -= 1
                self._asked[rows[k]] = self._time
                at = float(x[k]), float(y[k]), float(there.z[k])
                self._ask_server(cells[k], *at, int(there.kind[k]))

    def _ask_server(self, cell: _Cell, x: float, y: float, z: float, kind: int) -> None:
        ground = self._server.ground_below(x, -y, z + HIGHEST, 2.0 * HIGHEST)
        if ground is None:
            self._blind[cell] = self._time
            return
        self._cells[cell] = ground - z
        if kind != NOWHERE:
            self._raised[kind] = ground - z

    def _may_ask(self, cell: _Cell) -> bool:
        return cell not in self._cells and self._time >= self._blind.get(cell, -AGAIN) + AGAIN

    @staticmethod
    def _cells_of_places(
        x: FloatArray, y: FloatArray, z: FloatArray, kind: IntArray
    ) -> list[_Cell]:
        """Cells of places: half a metre of one kind of lane of one storey."""
        parts = np.floor(x / _CELL), np.floor(y / _CELL), np.round(z / 4.0), kind
        cells = np.column_stack(parts).astype(np.int64).tolist()
        return [(a, b, c, d) for a, b, c, d in cells]
