"""Lights that a program at a socket switches, such as an environment of :mod:`odscen.rl`.

Messages are those of :mod:`odscen.learning.behaviour.light_model`.
"""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

from odscen.learning.behaviour.light_model import observation_json, scene_json
from odscen.sumo.worker.behaviour.behaviour_doors import SocketDriver

if TYPE_CHECKING:
    import numpy as np

    from odscen.learning.behaviour.light_model import LightScene, LightsObservation


class LightSocket:
    """Asks the program; ``interval`` and ``time_limit`` are seconds, the latter of the clock."""

    def __init__(self, path: str, interval: float, time_limit: float) -> None:
        self.interval = interval
        self._driver = SocketDriver(path, 0, time_limit)

    def init_lights(self, rng: np.random.Generator, scene: LightScene) -> None:
        """Call it, and tell it the scene."""
        del rng
        self._driver.open_connection()
        self._driver.ask(scene_json(scene))

    def switch(self, observation: LightsObservation, state: None) -> list[int]:
        """Ask it."""
        del state
        stages: list[int] = json.loads(self._driver.ask(observation_json(observation)))
        return stages

    def close(self) -> None:
        """Hang up."""
        self._driver.close()
