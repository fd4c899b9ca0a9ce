"""RPCs about traffic lights."""

from __future__ import annotations

from tests.carla_standin import wire
from tests.carla_standin.rpc import Returns, rpc
from tests.carla_standin.world import World


class LightCalls:
    """Setting, timing and freezing. Methods take what is on the wire, without the metadata."""

    def __init__(self, world: World) -> None:
        self._world = world

    @rpc("set_traffic_light_state", Returns.VOID)
    def set_state(self, actor: int, state: int) -> None:
        self._world.lights[actor].set_state(state)

    @rpc("freeze_all_traffic_lights", Returns.VOID)
    def freeze(self, on: bool) -> None:
        self._world.lights.frozen = on

    @rpc("set_traffic_light_green_time", Returns.VOID)
    def set_green(self, actor: int, seconds: float) -> None:
        self._world.lights[actor].green = seconds

    @rpc("set_traffic_light_yellow_time", Returns.VOID)
    def set_yellow(self, actor: int, seconds: float) -> None:
        self._world.lights[actor].yellow = seconds

    @rpc("set_traffic_light_red_time", Returns.VOID)
    def set_red(self, actor: int, seconds: float) -> None:
        self._world.lights[actor].red = seconds

    @rpc("reset_traffic_light_group", Returns.VOID)
    def reset_group(self, actor: int) -> None:
        self._world.lights[actor].group.reset()

    @rpc("reset_all_traffic_lights", Returns.VOID)
    def reset_all(self) -> None:
        for group in self._world.lights.groups:
            group.reset()

    @rpc("get_group_traffic_lights")
    def group(self, actor: int) -> list[int]:
        return [light.actor.id for light in self._world.lights[actor].group.lights]

    @rpc("get_light_boxes")
    def boxes(self, actor: int) -> list[list[object]]:
        """One box half a metre wide, where the light is."""
        light = self._world.lights[actor].actor
        at = wire.transform(light.at)
        return [[at[0], [0.2, 0.2, 0.5], at[1], light.id]]
