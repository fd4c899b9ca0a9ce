"""Curves that those who want more than the limit drive as everyone does.

SUMO knows one speed for each lane, which each vehicle multiplies by one factor. Lanes in curves
have the speed at which drivers go through them, so that a vehicle whose factor is 1.7, as it wants
50 km/h in a zone of 30, would take a right angle with 2.8 times the usual acceleration to the side.
Here its factor is lowered before a curve, early enough to brake as for any other, and given back
once its body has left the curve.
"""

from __future__ import annotations

from contextlib import suppress
from typing import TYPE_CHECKING, Any

from odscen.base.bends import largest_curvature
from odscen.sumo.worker.simulation.foreign_traffic import is_foreign
from odscen.sumo.worker.simulation.planned_looks import PlannedLooks, seconds_to

if TYPE_CHECKING:
    from collections.abc import Callable, Collection

    from odscen.sumo.worker.simulation.road_lanes import RoadLanes

FASTEST = 1.17
"""Factor on limits up to which one is a fast driver, and not one who wants a certain speed."""
IN_CURVES = 1.1
"""Factor in curves of who wants more: the mean of sporty drivers."""
_BRAKING = 0.85
"""Share of the deceleration that a driver plans with, which SUMO's driver takes for the curve."""
_SIDEWAYS = 3.5
"""m/s2 to the side from which on a lane, driven at its limit times :data:`FASTEST`, is a curve."""
_WINDOW = 6.0
"""Metres over which a bend of a lane is measured."""
_LONGEST_WAIT = 2.0
"""Seconds after which a vehicle is looked at again in any case."""
_SPARE = 2.0
"""Metres before a curve at which its speed is to be reached."""


class CurveSpeeds:
    """Lets vehicles that want more than the limit slow down for curves.

    Parameters
    ----------
    sumo, errors
        libsumo, and what it raises.
    lanes
        Those of the network.
    native
        Gives the function of libsumo behind one of Python, by domain and name.
    """

    def __init__(
        self,
        sumo: Any,
        errors: tuple[type[Exception], ...],
        lanes: RoadLanes,
        native: Callable[[str, str], Any],
    ) -> None:
        self._sumo, self._errors, self._lanes = sumo, errors, lanes
        self._factor_of = native("vehicle", "getSpeedFactor")
        self._looks = PlannedLooks(sumo, native)
        self._wanted: dict[str, float] = {}
        self._slowed: set[str] = set()
        self._bent: dict[str, bool] = {}

    def before_step(
        self, *, only: frozenset[str] | None = None, moved: Collection[str] = ()
    ) -> None:
        """Lower or give back the factors of those who come to a curve, or have left one.

        Parameters
        ----------
        only
            Who is looked at; ``None``: everyone.
        moved
            Whose speed something else chooses.
        """
        wanting = []
        for name in self._looks.next_step():
            if is_foreign(name) or (only is not None and name not in only):
                continue
            with suppress(*self._errors):  # a rule may have removed it at once
                if (factor := float(self._factor_of(name))) > FASTEST:
                    self._wanted[name] = factor
                    wanting.append(name)
        for name in (*wanting, *self._looks.take_due()):
            try:
                self._look_at(name, is_moved=name in moved)
            except self._errors:  # it has arrived
                self._wanted.pop(name, None)
                self._slowed.discard(name)

    def forget(self) -> None:
        """Give all their factors back, before the state is saved."""
        for name in sorted(self._slowed):
            with suppress(*self._errors):
                self._sumo.vehicle.setSpeedFactor(name, self._wanted[name])
        self._slowed.clear()
        self._looks.plan_all_now()

    def _look_at(self, name: str, *, is_moved: bool) -> None:
        vehicle = self._sumo.vehicle
        lane = vehicle.getLaneID(name)
        if not lane or is_moved:
            slows, again = False, 0.0
        else:
            slows, again = self._look_ahead(name, lane)
        if slows != (name in self._slowed):
            vehicle.setSpeedFactor(name, IN_CURVES if slows else self._wanted[name])
            (self._slowed.add if slows else self._slowed.discard)(name)
        self._looks.plan(name, min(again, _LONGEST_WAIT))

    def _look_ahead(self, name: str, lane: str) -> tuple[bool, float]:
        """Whether a vehicle is to slow down for a curve, and seconds for which that is so.

        It is where its front is in a curve, its rear may still be, or it has to brake for one.
        """
        vehicle, of = self._sumo.vehicle, self._sumo.lane
        position, speed = vehicle.getLanePosition(name), vehicle.getSpeed(name)
        gains, rest = vehicle.getAccel(name), of.getLength(lane) - position
        twice = 2.0 * _BRAKING * vehicle.getDecel(name)
        if self._is_bent(lane):
            return True, seconds_to(rest, speed, gains)
        if name in self._slowed and position < (length := vehicle.getLength(name)):
            return True, seconds_to(length - position, speed, gains)
        likely = speed + gains * self._looks.step_length
        horizon = (likely + gains * _LONGEST_WAIT) * _LONGEST_WAIT + _SPARE
        horizon += (likely + gains * _LONGEST_WAIT) ** 2 / twice
        for ahead in self._lanes.ahead(name, lane):
            if rest > horizon:
                break
            if self._is_bent(ahead):
                slow = of.getMaxSpeed(ahead) * IN_CURVES
                braking = max(0.0, likely * likely - slow * slow) / twice
                spare = rest - likely * self._looks.step_length - braking - _SPARE
                # Who gains speed meanwhile needs more room for braking, too.
                return (True, 0.0) if spare <= 0.0 else (False, spare / (3.0 * max(likely, slow)))
            rest += of.getLength(ahead)
        return False, _LONGEST_WAIT

    def _is_bent(self, lane: str) -> bool:
        """Whether a lane bends so much that a factor on its limit would be felt."""
        known = self._bent.get(lane)
        if known is None:
            of = self._sumo.lane
            speed = of.getMaxSpeed(lane) * FASTEST
            known = self._bent[lane] = (
                speed * speed * largest_curvature(of.getShape(lane), _WINDOW) > _SIDEWAYS
            )
        return known
