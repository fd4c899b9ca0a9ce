"""RPCs about the server, the map, the episode, ticks and the weather."""

from __future__ import annotations

import asyncio
import hashlib
from collections.abc import Mapping
from pathlib import Path, PurePosixPath
from typing import Any

from tests.carla_standin import wire
from tests.carla_standin.generated import Generation
from tests.carla_standin.navigation import navigation_mesh
from tests.carla_standin.road_map import RoadMap
from tests.carla_standin.rpc import Returns, rpc
from tests.carla_standin.streams import StreamServer
from tests.carla_standin.switches import Switches
from tests.carla_standin.world import World

_OPENDRIVE_MAP = "OpenDriveMap"
_FOLDER = "Carla/Maps"


class WorldCalls:
    """Connecting, loading, ticking. Methods take what is on the wire, without the metadata.

    Parameters
    ----------
    maps
        The maps that can be loaded: names without a folder, and their .xodr files.
    """

    def __init__(
        self,
        world: World,
        streams: StreamServer,
        switches: Switches,
        *,
        maps: Mapping[str, Path],
    ) -> None:
        self._world = world
        self._streams = streams
        self._switches = switches
        self._maps = maps
        self._copied = ""
        self.generation: list[Any] = []
        self._meshes: dict[str, bytes] = {}

    @rpc("version")
    def version(self) -> str:
        return self._switches.version

    # ------------------------------------------------------------------------------- episodes
    @rpc("get_episode_info")
    def episode(self) -> list[Any]:
        return [self._world.episode, [self._streams.token(wire.WORLD_OBSERVER)]]

    @rpc("get_sensor_token")
    def sensor_token(self, stream: int) -> list[bytes]:
        return [self._streams.expect(stream)]

    @rpc("get_available_maps")
    def available_maps(self) -> list[str]:
        return [f"/Game/{_FOLDER}/{name}" for name in self._maps]

    @rpc("load_new_episode", Returns.VOID)
    def load(self, name: str, reset_settings: bool = True, _layers: int = 0) -> None:
        """Load a map by name; no name stands for the present one."""
        world = self._world
        short = PurePosixPath(name).name
        if not name:
            road_map = world.map
        elif short == _OPENDRIVE_MAP and self._copied:
            made = Generation.of(self.generation)
            road_map = RoadMap.of(self._copied, f"{_FOLDER}/{_OPENDRIVE_MAP}", made)
        elif short in self._maps:
            road_map = RoadMap.read(self._maps[short], f"{_FOLDER}/{short}")
        else:
            raise wire.RefusedError(f"Map '{name}' not found")
        if reset_settings:
            world.reset_settings()
        world.open(road_map)
        world.show()

    @rpc("copy_opendrive_to_file", Returns.VOID)
    def copy_opendrive(self, text: str, parameters: list[Any]) -> None:
        self._copied, self.generation = text, parameters

    @rpc("get_map_info")
    def map_info(self) -> list[Any]:
        spawn_points = [wire.transform(at) for at in self._world.map.spawn_points]
        return [self._world.map.name, spawn_points]

    @rpc("get_map_data")
    def map_data(self) -> str:
        return self._world.map.text

    @rpc("project_point")
    async def project(self, place: list[float], _direction: list[float], reach: float) -> list[Any]:
        """What is straight below a place: a road or a sidewalk, no bodies."""
        await asyncio.sleep(self._switches.ground_seconds)
        x, y, z = place
        found = self._world.surface(x, y, z)
        if found is None or z - found[0] > reach or self._switches.blind_ground:
            return [False, [[0.0, 0.0, 0.0], 0]]
        return [True, [[x, y, found[0]], 2 if found[1] else 1]]

    @rpc("get_required_files")
    def required_files(self, folder: str) -> list[str]:
        """Files that a client is to have. It keeps them by name, so the name is the content's."""
        if folder != "Nav" or not self._navigation():
            return []
        digest = hashlib.sha256(self._navigation()).hexdigest()[:16]
        return [f"{_FOLDER}/Nav/{PurePosixPath(self._world.map.name).name}-{digest}.bin"]

    @rpc("request_file")
    def file(self, _name: str) -> bytes:
        return self._navigation()

    def _navigation(self) -> bytes:
        """Navigation mesh of the present map; empty if none is served."""
        if not self._switches.navigation:
            return b""
        name = self._world.map.name
        if name not in self._meshes:
            self._meshes[name] = navigation_mesh(self._world.map, self._switches.kerb)
        return self._meshes[name]

    @rpc("query_lights_state")
    @rpc("get_names_of_all_objects")
    @rpc("get_all_level_BBs")
    @rpc("get_environment_objects")
    def nothing(self, *_: Any) -> list[Any]:
        """Street lights, buildings and other things that are not there."""
        return []

    @rpc("load_map_layer", Returns.VOID)
    @rpc("unload_map_layer", Returns.VOID)
    @rpc("update_lights_state", Returns.VOID)
    @rpc("update_day_night_cycle", Returns.VOID)
    @rpc("draw_debug_shape", Returns.VOID)
    def unseen(self, *_: Any) -> None:
        """Accept what nothing here could show."""

    @rpc("get_actor_definitions")
    def actor_definitions(self) -> list[Any]:
        return [definition.wire() for definition in self._world.definitions.values()]

    # ------------------------------------------------------------------------------- ticks
    @rpc("get_episode_settings")
    def settings(self) -> list[Any]:
        return self._world.settings

    @rpc("set_episode_settings")
    def set_settings(self, settings: list[Any]) -> int:
        self._world.settings = settings
        return self._world.frame

    @rpc("tick_cue")
    async def tick(self) -> int:
        await self._streams.settled()
        if self._switches.before_tick():
            self._streams.drop()
        await asyncio.sleep(self._switches.tick_seconds)
        return self._world.tick()

    # ------------------------------------------------------------------------------- weather
    @rpc("get_weather_parameters")
    def weather(self) -> list[float]:
        return self._world.weather

    @rpc("set_weather_parameters", Returns.VOID)
    def set_weather(self, weather: list[float]) -> None:
        self._world.weather = weather

    # ------------------------------------------------------------------------------- managers
    @rpc("is_traffic_manager_running")
    def has_traffic_manager(self, port: int) -> bool:
        return port in self._world.traffic_managers

    @rpc("get_traffic_manager_running")
    def traffic_manager(self, port: int) -> list[Any]:
        host = self._world.traffic_managers.get(port)
        return ["", 0] if host is None else [host, port]

    @rpc("add_traffic_manager_running")
    def add_traffic_manager(self, where: list[Any]) -> bool:
        host, port = where
        is_new = port not in self._world.traffic_managers
        self._world.traffic_managers.setdefault(port, host)
        return is_new

    @rpc("destroy_traffic_manager")
    def destroy_traffic_manager(self, port: int) -> bool:
        return self._world.traffic_managers.pop(port, None) is not None
