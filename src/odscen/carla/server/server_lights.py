"""The traffic lights of a server while they are ours."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Mapping


class LightHold:
    """Traffic lights that were looked at, and how they were before we took them.

    Its calls raise the client's plain ``RuntimeError``.
    """

    def __init__(self, carla: Any) -> None:
        self._carla = carla
        self._lights: dict[int, Any] = {}
        self._before: dict[int, Any] = {}
        self._was_frozen: bool | None = None

    def watch(self, world: Any) -> dict[str, int]:
        """Look at the lights, which the server switches; actor by OpenDRIVE signal id."""
        lights = list(world.get_actors().filter("traffic.traffic_light*"))
        self._lights = {light.id: light for light in lights}
        return {str(light.get_opendrive_id()): light.id for light in lights}

    def take(self, world: Any) -> dict[str, int]:
        """Freeze the lights under our control; actor by OpenDRIVE signal id."""
        joined = self.watch(world)
        lights = list(self._lights.values())
        self._before = {light.id: light.get_state() for light in lights}
        self._was_frozen = bool(lights) and all(light.is_frozen() for light in lights)
        world.freeze_all_traffic_lights(True)
        return joined

    def switch(self, states: Mapping[int, str]) -> None:
        """Set states by actor; no answer is waited for."""
        for actor, state in states.items():
            self._lights[actor].set_state(getattr(self._carla.TrafficLightState, state))

    def shown(self) -> dict[int, str]:
        """State of each light in the newest state of the server, by actor."""
        return {number: str(light.get_state()) for number, light in self._lights.items()}

    def give_back(self, world: Any) -> None:
        """Set the lights to what they were before they were taken, if they were."""
        if self._was_frozen is None:
            return
        for actor, state in self._before.items():
            self._lights[actor].set_state(state)
        world.freeze_all_traffic_lights(self._was_frozen)
