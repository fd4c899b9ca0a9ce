"""Lights read and switched by a model; only a session hands this out."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

if TYPE_CHECKING:
    from collections.abc import Sequence

_STANDING = 0.1
"""m/s below which a vehicle stands."""
_HELD = "online"
"""SUMO's name of the program of a light whose state is set."""


class LaneTraffic(NamedTuple):
    """Vehicles, those that stand, seconds stood in all, and vehicles times speed that they lack."""

    vehicles: int
    queue: int
    waiting: float
    lost: float


class SwitchedLights:
    """Reads and switches them."""

    def __init__(self, sumo: Any) -> None:
        self._lane, self._vehicle, self._light = sumo.lane, sumo.vehicle, sumo.trafficlight
        self.known = frozenset(sumo.trafficlight.getIDList())

    def traffic(self, lanes: Sequence[str]) -> LaneTraffic:
        """Traffic of lanes, added up."""
        vehicles, queue, waiting, lost = 0, 0, 0.0, 0.0
        for lane in lanes:
            for name in self._lane.getLastStepVehicleIDs(lane):
                speed = self._vehicle.getSpeed(name)
                most = max(self._vehicle.getAllowedSpeed(name), _STANDING)
                vehicles += 1
                queue += speed < _STANDING
                waiting += self._vehicle.getAccumulatedWaitingTime(name)
                lost += 1.0 - min(speed / most, 1.0)
        return LaneTraffic(vehicles, queue, waiting, lost)

    def count(self, lane: str) -> int:
        """Vehicles on a lane."""
        return int(self._lane.getLastStepVehicleNumber(lane))

    def state(self, light: str) -> str:
        """Letters of a light."""
        return str(self._light.getRedYellowGreenState(light))

    def show(self, light: str, state: str) -> None:
        """Let a light show a state until it is given another one."""
        self._light.setRedYellowGreenState(light, state)

    def is_held(self, light: str) -> bool:
        """Whether a light shows what it was set to, and no program has been switched on since."""
        return str(self._light.getProgram(light)) == _HELD
