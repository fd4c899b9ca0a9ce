"""How the wheels of vehicles near the ego stand: rolled on by their way, and steered into it.

Pure planning. A server shows such wheels only while a vehicle has no physics, and each wheel is a
call of its own: so only the vehicles nearest to the ego have theirs turned, within a budget.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from odscen.base.categories import Category
from odscen.carla.server.batch import WHEEL_CALLS, WheelTurn

if TYPE_CHECKING:
    from collections.abc import Mapping

    from odscen.records.run_plan import Plan
    from odscen.sumo.runner.in_step import Step

NEAR = 60.0
"""Metres from the ego beyond which no wheels are turned."""
WHEELBASE_SHARE = 0.6
"""Of a vehicle's length, as of usual cars, trucks and buses."""
RADIUS = {Category.CAR: 0.34, Category.VAN: 0.36, Category.TRUCK: 0.5, Category.BUS: 0.48}
"""Metres; of models on two wheels nothing is known, so theirs are left alone."""
MOST_STEER_DEG = 40.0
_JUMP = 6.0
"""Metres in one tick that are no driving."""
_STILL = 0.01
"""Metres in one tick below which the steering stays as it was."""


class Wheels:
    """Which wheels are to be turned in each tick, and how.

    Parameters
    ----------
    calls
        Calls in a tick at most; a vehicle takes :data:`~odscen.carla.server.batch.WHEEL_CALLS`.
    """

    def __init__(self, plan: Plan, *, calls: int) -> None:
        self._calls = calls
        self._most = calls // WHEEL_CALLS
        self._ego = next((row for row, actor in enumerate(plan.actors) if actor.ego), None)
        radii = [RADIUS.get(Category(actor.category), 0.0) for actor in plan.actors]
        self._radius = np.array(radii)
        self._wheelbase = [WHEELBASE_SHARE * actor.length for actor in plan.actors]
        self._last: dict[int, tuple[float, float, float]] = {}
        self._turns: dict[int, WheelTurn] = {}

    def turned(
        self, shown: Step, actors: Mapping[int, int], *, spent: int = 0
    ) -> dict[int, WheelTurn]:
        """Wheels for the tick that shows a step, by actor on the server.

        Parameters
        ----------
        actors
            Actor for each row of the plan that is on the server already.
        spent
            Calls of the tick that something else has taken: so many fewer are made.
        """
        near = self._nearest_vehicles(shown, actors)
        last, self._last = self._last, {}
        turns, self._turns = self._turns, {}
        for k in near:
            row = int(shown.index[k])
            at = self._last[row] = (float(shown.x[k]), float(shown.y[k]), float(shown.hdg[k]))
            before = turns.get(row, WheelTurn(0.0, 0.0))
            self._turns[row] = self._roll_and_steer(row, before, last.get(row, at), at)
        most = max(self._calls - spent, 0) // WHEEL_CALLS
        return {actors[row]: turn for row, turn in list(self._turns.items())[:most]}

    def _nearest_vehicles(self, shown: Step, actors: Mapping[int, int]) -> list[int]:
        """Positions in a step of the vehicles whose wheels are turned, the nearest first."""
        ego_rows = [] if self._ego is None else np.flatnonzero(shown.index == self._ego).tolist()
        if not ego_rows or not self._most:
            return []
        [ego] = ego_rows
        away = np.hypot(shown.x - shown.x[ego], shown.y - shown.y[ego])
        away[self._radius[shown.index] == 0.0] = np.inf
        order = np.argsort(away, kind="stable")
        near = [k for k in order[away[order] <= NEAR].tolist() if int(shown.index[k]) in actors]
        return near[: self._most]

    def _roll_and_steer(
        self,
        row: int,
        turn: WheelTurn,
        last: tuple[float, float, float],
        at: tuple[float, float, float],
    ) -> WheelTurn:
        """Wheels after a way: rolled by it, and steered as an arc of it takes.

        The front wheels stand at ``atan(wheelbase * change of heading / way)``.
        """
        dx, dy = at[0] - last[0], at[1] - last[1]
        way = dx * math.cos(at[2]) + dy * math.sin(at[2])
        if abs(way) < _STILL or abs(way) > _JUMP:
            return turn
        bend = math.remainder(at[2] - last[2], 2 * math.pi)
        steer = math.degrees(math.atan(self._wheelbase[row] * bend / way))
        steer = min(max(steer, -MOST_STEER_DEG), MOST_STEER_DEG)
        # Rolling ahead is a falling pitch in Unreal (``UVehicleWheel::GetRotationAngle``), and to
        # the right is positive there.
        pitch = math.fmod(turn.pitch - math.degrees(way / float(self._radius[row])), 360.0)
        return WheelTurn(-steer, pitch)
