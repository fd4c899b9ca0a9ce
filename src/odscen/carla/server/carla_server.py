"""A borrowed CARLA server: its map, its models, its ground, its lights and who is driven there."""

from __future__ import annotations

import math
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from odscen.base.errors import CarlaError
from odscen.carla.server.batch import ROLE, ActorPlace
from odscen.carla.server.batch_commands import BatchCommands
from odscen.carla.server.blueprints import Shape
from odscen.carla.server.borrowed_server import BorrowedServer

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

LOAD_TIMEOUT = 120.0
"""Seconds that loading a map may take."""
_ALOFT = 500.0
"""Metres above zero at which blueprints are measured."""
_APART = 50.0
"""Metres between those that are."""
_KIND = (
    ("base_type", "as_str"),
    ("special_type", "as_str"),
    ("generation", "as_int"),
    ("number_of_wheels", "as_int"),
)
"""Attributes of blueprints that say what they are, and how each is read."""


class Server(BorrowedServer):
    """A CARLA server that this program has borrowed, and what it can be asked for."""

    _projects = True
    """Whether it knows the call that says what is below a place."""

    # ------------------------------------------------------------------------------- the map
    @property
    def map_name(self) -> str:
        """Name of the map that is loaded, without its folder."""
        with self._expect_answer():
            return str(self._world.get_map().name).rpartition("/")[2]

    def opendrive(self) -> str:
        """OpenDRIVE text of the map that is loaded."""
        with self._expect_answer():
            return str(self._world.get_map().to_opendrive())

    def available_maps(self) -> list[str]:
        """Names of the maps that the server can load, without their folders, sorted."""
        with self._expect_answer():
            names = self._client.get_available_maps()
        return sorted({str(name).rpartition("/")[2] for name in names})

    def load_map(self, name: str) -> None:
        """Load one of the server's maps; everything on the present one is gone."""
        with self._allow_long_call():
            self._world = self._client.load_world(name, False)
        self._look_again()

    def load_opendrive(self, xodr: str) -> None:
        """Let the server make a bare road surface of an OpenDRIVE text and load it."""
        parameters = self.release.generation(self._carla)
        with self._allow_long_call():
            self._world = self._client.generate_opendrive_world(xodr, parameters, False)
        self._look_again()

    def _look_again(self) -> None:
        with self._expect_answer():
            self._library = self._world.get_blueprint_library()
            self._wording = BatchCommands(self._carla, self._library)
            self._before = {actor.id for actor in self._world.get_actors()}
        self._frame = None

    def spawn_places(self) -> list[ActorPlace]:
        """Places that the map recommends for vehicles; they float a little above the road."""
        with self._expect_answer():
            return [_actor_place(at) for at in self._world.get_map().get_spawn_points()]

    def lane_place(self, at: ActorPlace, *, sidewalk: bool = False) -> ActorPlace | None:
        """Nearest place on the centre line of a driving lane or a sidewalk, as the file has it."""
        kinds = self._carla.LaneType
        with self._expect_answer():
            waypoint = self._world.get_map().get_waypoint(
                self._carla.Location(*at[:3]),
                project_to_road=True,
                lane_type=kinds.Sidewalk if sidewalk else kinds.Driving,
            )
        return None if waypoint is None else _actor_place(waypoint.transform)

    # ------------------------------------------------------------------------------- the world
    def spectator_place(self) -> ActorPlace:
        """Where the server's window looks from."""
        with self._expect_answer():
            return _actor_place(self._world.get_spectator().get_transform())

    def active_distance(self) -> float:
        """Metres from a hero beyond which actors of a large map are dormant."""
        with self._expect_answer():
            return float(self._world.get_settings().actor_active_distance)

    def set_weather(self, parameters: Mapping[str, float]) -> None:
        """Set weather and the sun; parameters that are not named keep the server's values."""
        with self._expect_answer():
            weather = self._world.get_weather()
            for name, value in parameters.items():
                if hasattr(weather, name):
                    setattr(weather, name, float(value))
            self._world.set_weather(weather)

    # ------------------------------------------------------------------------------- the library
    def library(self) -> list[str]:
        """Ids of all blueprints, sorted."""
        with self._expect_answer():
            return sorted(blueprint.id for blueprint in self._library)

    def describe(self, beginnings: tuple[str, ...]) -> dict[str, dict[str, str]]:
        """What blueprints whose ids begin so say of their kind, by id."""
        with self._expect_answer():
            return {
                blueprint.id: {
                    name: str(getattr(blueprint.get_attribute(name), read)())
                    for name, read in _KIND
                    if blueprint.has_attribute(name)
                }
                for blueprint in self._library
                if blueprint.id.startswith(beginnings)
            }

    def blueprint(self, name: str) -> Any:
        """Blueprint of an id.

        Raises
        ------
        CarlaError
            If the server has none.
        """
        with self._expect_answer():
            if not self._library.filter(name):
                raise CarlaError(f"the CARLA server at {self.address} has no blueprint {name}")
            return self._library.find(name)

    def shapes(self, names: Sequence[str]) -> dict[str, Shape]:
        """Bounding boxes of blueprints, from one of each made aloft and taken away again."""
        wanted = sorted(set(names))
        commands = [
            self.spawn_command(name, ROLE + "measure", (_APART * number, 0.0, _ALOFT))
            for number, name in enumerate(wanted)
        ]
        shapes: dict[str, Shape] = {}
        with self._expect_answer():
            made = {
                name: answer.actor_id
                for name, answer in zip(wanted, self._apply_commands(commands), strict=True)
                if not answer.error
            }
            self._own |= set(made.values())
            self.tick()
            for name, number in made.items():
                shapes[name] = self.shape(number)
            self._destroy_actors(sorted(made.values()))
        return shapes

    def with_doors(self, names: Sequence[str]) -> frozenset[str]:
        """Those of some blueprints whose doors can be opened, as they say themselves."""
        wanted, name = set(names), "has_dynamic_doors"
        with self._expect_answer():
            known = [
                blueprint
                for blueprint in self._library
                if blueprint.id in wanted and blueprint.has_attribute(name)
            ]
            return frozenset(
                blueprint.id for blueprint in known if blueprint.get_attribute(name).as_bool()
            )

    def shape(self, actor: int) -> Shape:
        """Bounding box of an actor."""
        with self._expect_answer():
            box = self._world.get_actor(actor).bounding_box
        return Shape(
            (box.extent.x, box.extent.y, box.extent.z),
            (box.location.x, box.location.y, box.location.z),
        )

    def ground_below(self, x: float, y: float, z: float, reach: float) -> float | None:
        """Height of the ground at most ``reach`` metres straight below a place.

        ``None`` if there is none, if a body is in between, or if the server does not know the
        call, of which it then warns once. Metres, CARLA's frame.
        """
        if not self._projects:
            return None
        with self._expect_answer():
            try:
                hit = self._world.ground_projection(self._carla.Location(x, y, z), reach)
            except RuntimeError as error:
                if "time-out" in str(error):
                    raise
                self._projects = False
                self.warnings.append(
                    f"the server does not say where the ground is ({error}); pedestrians and "
                    "vehicles are put on the surface of the map's file"
                )
                return None
        if hit is None or not self.release.is_ground(hit.label):
            return None
        return float(hit.location.z)

    # ------------------------------------------------------------------------------- the ego
    def find_role(self, *role_names: str) -> int | None:
        """Vehicle that has the first role that any has; of several, the one with the least id."""
        with self._expect_answer():
            vehicles = self._world.get_actors().filter("vehicle.*")
            roles = sorted((v.attributes.get("role_name"), v.id) for v in vehicles)
        return next((number for name in role_names for role, number in roles if role == name), None)

    def spawn_free(self, blueprint: str, role_name: str, at: ActorPlace) -> int:
        """Make a vehicle that has physics and that another program is to drive.

        Raises
        ------
        CarlaError
            If the server refuses it.
        """
        with self._expect_answer():
            command = self.spawn_command(blueprint, role_name, at[:3], pitch=at.pitch, yaw=at.yaw)
            answer = self._apply_commands([command])[0]
            if answer.error:
                raise CarlaError(
                    f"the CARLA server at {self.address} refused the {role_name}: {answer.error}"
                )
            self._own.add(int(answer.actor_id))
            self.tick()
        return int(answer.actor_id)

    def place(self, actor: int) -> ActorPlace:
        """Where an actor is in the newest state.

        Raises
        ------
        CarlaError
            If it is gone.
        """
        actor_snapshot = self._world.get_snapshot().find(actor)
        if actor_snapshot is None:
            raise CarlaError(f"actor {actor} is gone from the CARLA server at {self.address}")
        return _actor_place(actor_snapshot.get_transform())

    def speed(self, actor: int, at: ActorPlace) -> float:
        """m/s ahead of an actor that is at a place, 0 if it goes backwards."""
        velocity = self._world.get_snapshot().find(actor).get_velocity()
        yaw = math.radians(at.yaw)
        return max(0.0, float(velocity.x * math.cos(yaw) + velocity.y * math.sin(yaw)))

    # ------------------------------------------------------------------------------- lights
    def watch_lights(self) -> dict[str, int]:
        """Look at the traffic lights, which the server switches; actor by OpenDRIVE signal id."""
        with self._expect_answer():
            return self._lights.watch(self._world)

    def take_lights(self) -> dict[str, int]:
        """Freeze the traffic lights under our control; actor by OpenDRIVE signal id."""
        with self._expect_answer():
            return self._lights.take(self._world)

    def light_states(self) -> dict[int, str]:
        """State of each light watched or taken, in the newest state of the server, by actor."""
        return self._lights.shown()

    @contextmanager
    def _allow_long_call(self) -> Iterator[None]:
        self._client.set_timeout(max(LOAD_TIMEOUT, self.address.timeout))
        try:
            with self._expect_answer():
                yield
        finally:
            self._client.set_timeout(self.address.timeout)


def _actor_place(at: Any) -> ActorPlace:
    where, turn = at.location, at.rotation
    return ActorPlace(where.x, where.y, where.z, turn.pitch, turn.yaw)
