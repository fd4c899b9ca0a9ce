"""Doors of vehicles that are at a stop: SUMO has bits for them, and never sets one.

A vehicle at a bus stop has the doors at the kerb open. Of a car that has taken a place in a parking
area somebody gets out: the driver's door is open for a moment. One that begins parked opens none,
for SUMO does not say beforehand when it leaves. All other stops leave doors shut.
"""

from __future__ import annotations

import math
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

from odscen.sumo.worker.simulation.observed import VehicleSignal

if TYPE_CHECKING:
    from collections.abc import Sequence

    from odscen.base.arrays import IntArray

GETTING_OUT = 4.0
"""Seconds for which the driver's door is open."""
_AT_BUS_STOP, _AT_PARKING_AREA = 16, 128
"""Bits of ``getStopState`` of TraCI."""
_DRIVEN = 1.0
"""Metres behind a car that has not begun in its place."""
_HEAD = 1 << 16
"""Bytes at the start of a network within which its first element begins."""


class StopDoors:
    """Knows which doors are open; asks SUMO for no vehicle but those that begin a stop.

    Parameters
    ----------
    sumo
        The running libsumo.
    """

    def __init__(self, sumo: Any) -> None:
        self._simulation, self._vehicle = sumo.simulation, sumo.vehicle
        self._open: dict[str, tuple[int, float]] = {}

    def signals(self, ids: Sequence[str], time: float) -> IntArray:
        """Bits of :class:`VehicleSignal` for each vehicle; to be called after each step.

        Parameters
        ----------
        time
            Simulated seconds.
        """
        import numpy as np

        simulation = self._simulation
        if simulation.getStopStartingVehiclesNumber():
            for name in simulation.getStopStartingVehiclesIDList():
                self._note_stop(name, time)
        if simulation.getStopEndingVehiclesNumber():
            for name in simulation.getStopEndingVehiclesIDList():
                self._open.pop(name, None)
        bits = np.zeros(len(ids), dtype=np.int64)
        if self._open:
            self._open = {name: own for name, own in self._open.items() if time < own[1]}
            bits[:] = [self._open.get(name, (0, 0.0))[0] for name in ids]
        return bits

    def _note_stop(self, name: str, time: float) -> None:
        state = self._vehicle.getStopState(name)
        kerb, road = VehicleSignal.DOOR_OPEN_RIGHT, VehicleSignal.DOOR_OPEN_LEFT
        if self._is_lefthand:
            kerb, road = road, kerb
        if state & _AT_BUS_STOP:
            self._open[name] = int(kerb), math.inf
        elif state & _AT_PARKING_AREA and self._vehicle.getDistance(name) > _DRIVEN:
            self._open[name] = int(road), time + GETTING_OUT

    @cached_property
    def _is_lefthand(self) -> bool:
        """Whether traffic keeps to the left: the network's word, which libsumo has no call for."""
        with Path(self._simulation.getOption("net-file")).open("rb") as file:
            head = file.read(_HEAD)
        element = head.partition(b"<net ")[2].partition(b">")[0]
        return b'lefthand="true"' in element
