"""How a scenario is mirrored."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from odscen.base.errors import InputError
from odscen.carla.mirror.foreign_actors import ForeignRoles
from odscen.carla.mirror.nearby import Nearby
from odscen.carla.sensors.pictures import Wish
from odscen.carla.server.client import Address

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from odscen.carla.sensors.sensor_file import SensorWish
    from odscen.sumo.runner.in_step import Step


TICK = 0.05
"""Simulated seconds of a tick of CARLA's, at most, unless asked for otherwise."""


@dataclass(frozen=True, slots=True)
class CosimOptions:
    """How a scenario is mirrored.

    Attributes
    ----------
    address
        Of the server.
    tick
        Simulated seconds of a tick of CARLA's; a step of SUMO's is a whole number of them. The
        largest part of a step that is at most :data:`TICK` if not given.
    nearby
        Who is shown.
    external_ego
        Whether the ego is driven in CARLA, by the owner of the actor with the role ``hero``.
    foreign
        Who else on the server SUMO's traffic is to see; nobody if not given.
    carla_signals
        Whether CARLA's traffic lights go by their own programs, and SUMO's by them.
    follow
        Whether another client makes the ticks, and loads the map.
    load_map
        Whether the server may be told to load the scenario's map.
    parity
        Whether both worlds are taken down and compared.
    sensed_speed
        Whether vehicles keep physics, without gravity, so that sensors see their velocity. Their
        wheels and doors are left alone then: a server turns no wheel of one that has physics.
    wheel_calls
        Calls in a tick, at most, by which wheels of the vehicles nearest to the ego are turned, and
        doors of those at stops opened and shut.
    sensors
        What is attached to the ego and recorded, into ``sensors`` of the run's folder.
    hook
        Called after each tick with the ``carla.World`` and the actors shown, by id.
    pictures
        Files that a camera from above is to write.
    on_picture
        Called with each of its pictures as JPEG, in a thread of its own.
    on_step
        Called with each step when it has been shown; false ends the run.
    """

    address: Address = field(default_factory=Address)
    tick: float | None = None
    nearby: Nearby = field(default_factory=Nearby)
    external_ego: bool = False
    foreign: ForeignRoles | None = field(default_factory=ForeignRoles)
    carla_signals: bool = False
    follow: bool = False
    load_map: bool = True
    parity: bool = True
    sensed_speed: bool = False
    wheel_calls: int = 24
    sensors: tuple[SensorWish, ...] = ()
    hook: Callable[[Any, Mapping[str, Any]], object] | None = None
    pictures: Wish = field(default_factory=Wish)
    on_picture: Callable[[bytes], None] | None = None
    on_step: Callable[[Step], bool] | None = None

    def check(self) -> None:
        """Refuse what cannot be done before anything is begun.

        Raises
        ------
        InputError
            If options contradict each other, or pictures cannot be made.
        """
        if self.follow and (self.tick is not None or self.sensed_speed):
            option = "a tick" if self.tick is not None else "sensed speed"
            raise InputError(f"{option} cannot be set where another client makes the ticks")
        if self.pictures.any or self.on_picture:
            self.pictures.check()

    def ticks(self, step_length: float) -> int:
        """How many ticks a step of SUMO's is.

        Raises
        ------
        InputError
            If it is not a whole number of them.
        """
        if self.tick is None:
            return max(1, int(np.ceil(step_length / TICK - 1e-9)))
        count = round(step_length / self.tick)
        if count < 1 or abs(count * self.tick - step_length) > 1e-9:
            raise InputError(
                f"a step of {step_length:g} s is no whole number of ticks of {self.tick:g} s"
            )
        return count
