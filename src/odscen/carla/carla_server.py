"""A CARLA server, borrowed for a while and given back as it was."""

from __future__ import annotations

import math
import time
from contextlib import contextmanager, suppress
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Self

from odscen.base.errors import CarlaError
from odscen.carla.batch import ActorPlace, Batch
from odscen.carla.blueprints import Shape
from odscen.carla.client import answering, connect
from odscen.carla.mirror import ROLE

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence
    from contextlib import AbstractContextManager
    from types import TracebackType

    from odscen.carla.batch import Spawn
    from odscen.carla.client import Address

LOAD_TIMEOUT = 120.0
"""Seconds that loading a map may take."""
GRACE = 15.0
"""Seconds that a server that has stopped answering gets to be given back after all."""

_ALOFT = 500.0
"""Metres above zero at which blueprints are measured."""
FREE_AIR = 12.0
"""Metres above the road where a body can be made that its place has no room for."""
_KIND = (
    ("base_type", "as_str"),
    ("special_type", "as_str"),
    ("generation", "as_int"),
    ("number_of_wheels", "as_int"),
)
"""Attributes of blueprints that say what they are, and how each is read."""
_APART = 50.0
"""Metres between those that are."""
_UNSET_DELTA = 1e-6
"""Seconds: 0.9.16 shows an uninitialised number far below this where no time step is fixed."""


class Server:
    """A CARLA server that this program has borrowed.

    A context manager: at its end every actor that it has made is gone, and settings, weather and
    traffic lights are as they were, however it ends; what could not be given back is in
    ``left_behind``, in words.

    Attributes
    ----------
    interruptions
        How often the stream of states was cut and came back.
    waited
        Seconds spent waiting for the server in batches and ticks.

    Raises
    ------
    MissingDependencyError
        If the package ``carla`` is not installed.
    CarlaError
        If no server answers, or another release does.
    """

    def __init__(self, address: Address) -> None:
        self.address = address
        self.left_behind: list[str] = []
        self.interruptions = 0
        self.waited = 0.0
        self._carla, self._client = connect(address)
        with self._answering():
            self._world = self._client.get_world()
            self._library = self._world.get_blueprint_library()
        self._own: set[int] = set()
        self._before: set[int] = set()
        self._settings: Any = None
        self._weather: Any = None
        self._lights: dict[int, Any] = {}
        self._light_states: dict[int, Any] = {}
        self._lights_frozen: bool | None = None
        self._unsure = False

    # ------------------------------------------------------------------------------- borrowing
    def __enter__(self) -> Self:
        with self._answering():
            self._settings = self._world.get_settings()
            if (self._settings.fixed_delta_seconds or 0.0) < _UNSET_DELTA:
                self._settings.fixed_delta_seconds = None
            self._weather = self._world.get_weather()
            if not self._settings.synchronous_mode:
                self._world.wait_for_tick(self.address.timeout)
            self._before = {actor.id for actor in self._world.get_actors()}
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Give everything back; never raises."""
        deadline = time.monotonic() + max(GRACE, self.address.timeout)
        while not self._give_back():
            if time.monotonic() >= deadline or not self.address.listens():
                self.left_behind.append(
                    f"the CARLA server at {self.address} has stopped answering: what was made "
                    "there, if it still runs, could not be taken back"
                )
                return

    def _give_back(self) -> bool:
        """Try to undo everything; false if the server does not answer."""
        try:
            self._client.get_server_version()
            self._destroy_own()
            if self._lights_frozen is not None:
                self._release_lights(frozen=self._lights_frozen)
            self._world.set_weather(self._weather)
            self._world.apply_settings(self._settings)
            self._client.get_server_version()  # calls without an answer have arrived by now
        except RuntimeError:
            return False
        return True

    def _destroy_own(self) -> None:
        if self._unsure:  # an answer was lost: something may be there that was not reported
            with suppress(RuntimeError):  # a tick that is not shown
                self._world.tick(self.address.timeout)
            for actor in self._world.get_actors():
                role = actor.attributes.get("role_name", "")
                if role.startswith(ROLE) and actor.id not in self._before:
                    self._own.add(actor.id)
        destroy = self._carla.command.DestroyActor
        if self._own:
            self._client.apply_batch_sync([destroy(actor) for actor in sorted(self._own)], False)
            self._own.clear()
            if self._world.get_settings().synchronous_mode:
                with suppress(RuntimeError):
                    self._world.tick(self.address.timeout)

    def _release_lights(self, *, frozen: bool) -> None:
        for actor, state in self._light_states.items():
            self._lights[actor].set_state(state)
        self._world.freeze_all_traffic_lights(frozen)

    # ------------------------------------------------------------------------------- for others
    @property
    def package(self) -> Any:
        """The package ``carla``, for values of its types."""
        return self._carla

    @property
    def client(self) -> Any:
        """The ``carla.Client``; its calls raise plain ``RuntimeError``."""
        return self._client

    @property
    def world(self) -> Any:
        """The ``carla.World``; its calls raise plain ``RuntimeError``."""
        return self._world

    @property
    def own(self) -> tuple[int, ...]:
        """Actors that have been made and not yet been taken away."""
        return tuple(sorted(self._own))

    def inherit(self, actors: Sequence[int]) -> None:
        """Take over from a process that has died: its actors, and a world that waits for ticks.

        At the end they are gone, with those of our names that it had no time to tell of, and the
        world's time goes on by itself.
        """
        self._own |= set(actors)
        self._unsure, self._before = True, set()
        self._settings.synchronous_mode = False
        self._settings.fixed_delta_seconds = None

    def spawn(self, commands: Sequence[Any]) -> list[int | str]:
        """Make actors in one call; the id of each, or why there is none. No tick is made."""
        if not commands:
            return []
        with self._answering():
            answers = [reply.error or int(reply.actor_id) for reply in self._apply(commands)]
        self._own |= {answer for answer in answers if isinstance(answer, int)}
        return answers

    def send(self, commands: Sequence[Any]) -> None:
        """Give commands in one call; no tick is made."""
        if commands:
            with self._answering():
                self._apply(commands)

    def destroy(self, actors: Sequence[int]) -> None:
        """Destroy actors of ours in one call; those that are gone already do not matter."""
        with self._answering():
            self._destroy(actors)

    # ------------------------------------------------------------------------------- the map
    @property
    def map_name(self) -> str:
        """Name of the map that is loaded, without its folder."""
        with self._answering():
            return str(self._world.get_map().name).rpartition("/")[2]

    def opendrive(self) -> str:
        """OpenDRIVE text of the map that is loaded."""
        with self._answering():
            return str(self._world.get_map().to_opendrive())

    def available_maps(self) -> list[str]:
        """Names of the maps that the server can load, without their folders, sorted."""
        with self._answering():
            names = self._client.get_available_maps()
        return sorted({str(name).rpartition("/")[2] for name in names})

    def load_map(self, name: str) -> None:
        """Load one of the server's maps; everything on the present one is gone."""
        with self._long():
            self._world = self._client.load_world(name, False)
        self._look_again()

    def load_opendrive(self, xodr: str) -> None:
        """Let the server make a bare road surface of an OpenDRIVE text and load it."""
        with self._long():
            parameters = self._carla.OpendriveGenerationParameters()
            self._world = self._client.generate_opendrive_world(xodr, parameters, False)
        self._look_again()

    def _look_again(self) -> None:
        with self._answering():
            self._library = self._world.get_blueprint_library()
            self._before = {actor.id for actor in self._world.get_actors()}

    # ------------------------------------------------------------------------------- settings
    def synchronize(self, delta: float) -> None:
        """Let the server wait for our ticks, each of ``delta`` simulated seconds."""
        with self._answering():
            settings = self._world.get_settings()
            settings.synchronous_mode = True
            settings.fixed_delta_seconds = delta
            self._world.apply_settings(settings)

    def set_weather(self, parameters: Mapping[str, float]) -> None:
        """Set weather and the sun; parameters that are not named keep the server's values."""
        with self._answering():
            weather = self._world.get_weather()
            for name, value in parameters.items():
                if hasattr(weather, name):
                    setattr(weather, name, float(value))
            self._world.set_weather(weather)

    # ------------------------------------------------------------------------------- the library
    def library(self) -> list[str]:
        """Ids of all blueprints, sorted."""
        with self._answering():
            return sorted(blueprint.id for blueprint in self._library)

    def describe(self, beginnings: tuple[str, ...]) -> dict[str, dict[str, str]]:
        """What blueprints whose ids begin so say of their kind, by id."""
        with self._answering():
            return {
                blueprint.id: {
                    name: str(getattr(blueprint.get_attribute(name), read)())
                    for name, read in _KIND
                    if blueprint.has_attribute(name)
                }
                for blueprint in self._library
                if blueprint.id.startswith(beginnings)
            }

    def shapes(self, names: Sequence[str]) -> dict[str, Shape]:
        """Bounding boxes of blueprints, from one of each made aloft and taken away again."""
        wanted = sorted(set(names))
        commands = [
            self.spawn_command(name, ROLE + "measure", (_APART * number, 0.0, _ALOFT))
            for number, name in enumerate(wanted)
        ]
        shapes: dict[str, Shape] = {}
        with self._answering():
            made = {
                name: answer.actor_id
                for name, answer in zip(wanted, self._apply(commands), strict=True)
                if not answer.error
            }
            self._own |= set(made.values())
            self.tick()
            for name, number in made.items():
                shapes[name] = self.shape(number)
            self._destroy(sorted(made.values()))
        return shapes

    def shape(self, actor: int) -> Shape:
        """Bounding box of an actor."""
        with self._answering():
            box = self._world.get_actor(actor).bounding_box
        return Shape(
            (box.extent.x, box.extent.y, box.extent.z),
            (box.location.x, box.location.y, box.location.z),
        )

    # ------------------------------------------------------------------------------- the ego
    def find_role(self, role_name: str) -> int | None:
        """Vehicle that has a role, the one with the smallest id."""
        with self._answering():
            vehicles = self._world.get_actors().filter("vehicle.*")
            found = [v.id for v in vehicles if v.attributes.get("role_name") == role_name]
        return min(found, default=None)

    def spawn_free(self, blueprint: str, role_name: str, at: ActorPlace) -> int:
        """Make a vehicle that has physics and that another program is to drive.

        Raises
        ------
        CarlaError
            If the server refuses it.
        """
        with self._answering():
            command = self.spawn_command(blueprint, role_name, at[:3], pitch=at.pitch, yaw=at.yaw)
            answer = self._apply([command])[0]
            if answer.error:
                msg = f"the CARLA server at {self.address} refused the {role_name}: {answer.error}"
                raise CarlaError(msg)
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
        found = self._world.get_snapshot().find(actor)
        if found is None:
            msg = f"actor {actor} is gone from the CARLA server at {self.address}"
            raise CarlaError(msg)
        at = found.get_transform()
        where, turn = at.location, at.rotation
        return ActorPlace(where.x, where.y, where.z, turn.pitch, turn.yaw)

    def speed(self, actor: int, at: ActorPlace) -> float:
        """m/s ahead of an actor that is at a place, 0 if it goes backwards."""
        velocity = self._world.get_snapshot().find(actor).get_velocity()
        yaw = math.radians(at.yaw)
        return max(0.0, float(velocity.x * math.cos(yaw) + velocity.y * math.sin(yaw)))

    # ------------------------------------------------------------------------------- lights
    def take_lights(self) -> dict[str, int]:
        """Freeze the traffic lights under our control; actor by OpenDRIVE signal id."""
        with self._answering():
            lights = list(self._world.get_actors().filter("traffic.traffic_light*"))
            self._lights = {light.id: light for light in lights}
            self._light_states = {light.id: light.get_state() for light in lights}
            self._lights_frozen = bool(lights) and all(light.is_frozen() for light in lights)
            self._world.freeze_all_traffic_lights(True)
            return {str(light.get_opendrive_id()): light.id for light in lights}

    def light_states(self) -> dict[int, str]:
        """State of each light taken, in the newest state of the server, by actor."""
        return {number: str(light.get_state()) for number, light in self._lights.items()}

    # ------------------------------------------------------------------------------- ticks
    def apply(self, batch: Batch) -> list[int | str]:
        """Do all of a batch, in one call but for lights that change, and make the tick.

        Returns
        -------
        list
            For each spawn the actor's id, or why there is none.
        """
        states = self._carla.TrafficLightState
        commands = self._commands(batch)
        with self._answering():
            for actor, state in batch.signals.items():
                self._lights[actor].set_state(getattr(states, state))
            responses = self._apply(commands) if commands else []
            self._own -= set(batch.destroy)
            first = len(batch.destroy)
            answers = [
                response.error or int(response.actor_id)
                for response in responses[first : first + len(batch.spawn)]
            ]
            self._try_in_free_air(batch.spawn, answers)
            self._own |= {answer for answer in answers if isinstance(answer, int)}
            self.tick()
        return answers

    def _try_in_free_air(self, spawns: Sequence[Spawn], answers: list[int | str]) -> None:
        """Make those that were refused high above: they are set to their place before the tick.

        A server refuses a body that touches another one, as wide models beside each other do.
        """
        refused = [n for n, answer in enumerate(answers) if isinstance(answer, str)]
        if refused:
            higher = Batch(spawn=tuple(replace(spawns[n], lift=FREE_AIR) for n in refused))
            for n, response in zip(refused, self._apply(self._commands(higher)), strict=True):
                answers[n] = response.error or int(response.actor_id)

    def tick(self) -> None:
        """Make a tick. A stream that was cut comes back by itself: one more tick shows it."""
        start = time.perf_counter()
        try:
            self._world.tick(self.address.timeout)
        except RuntimeError:
            if not self.address.listens():
                raise
            self._world.tick(self.address.timeout)
            self.interruptions += 1
        self.waited += time.perf_counter() - start

    def _apply(self, commands: Sequence[Any]) -> list[Any]:
        self._unsure = True
        start = time.perf_counter()
        responses = list(self._client.apply_batch_sync(list(commands), False))
        self.waited += time.perf_counter() - start
        self._unsure = False
        return responses

    def _destroy(self, actors: Sequence[int]) -> None:
        if actors:
            self._apply([self._carla.command.DestroyActor(actor) for actor in actors])
            self._own -= set(actors)

    def _commands(self, batch: Batch) -> list[Any]:
        command, carla = self._carla.command, self._carla
        transform, velocity = command.ApplyTransform, command.ApplyTargetVelocity
        walker, vector = command.ApplyWalkerState, carla.Vector3D
        flags = carla.VehicleLightState
        commands = [command.DestroyActor(actor) for actor in batch.destroy]
        for spawn in batch.spawn:
            x, y, z, pitch, yaw = spawn.at
            made = self.spawn_command(
                spawn.blueprint, spawn.role_name, (x, y, z + spawn.lift), pitch=pitch, yaw=yaw
            )
            future, place = command.FutureActor, self._transform(spawn.at)
            made = made.then(command.SetSimulatePhysics(future, False))
            if spawn.walks:
                made = made.then(walker(future, place, spawn.speed))
            else:
                made = made.then(transform(future, place))
                made = made.then(velocity(future, vector(*spawn.velocity)))
                made = made.then(command.SetVehicleLightState(future, flags(spawn.flags)))
            commands.append(made)
        for move in batch.move:
            place = self._transform(move.at)
            if move.walks:
                commands.append(walker(move.actor, place, move.speed))
            else:
                commands.append(transform(move.actor, place))
                commands.append(velocity(move.actor, vector(*move.velocity)))
        commands += [
            command.SetVehicleLightState(shine.actor, flags(shine.flags)) for shine in batch.shine
        ]
        return commands

    def _transform(self, at: ActorPlace) -> Any:
        x, y, z, pitch, yaw = at
        carla = self._carla
        return carla.Transform(carla.Location(x, y, z), carla.Rotation(pitch, yaw, 0.0))

    def spawn_command(
        self,
        name: str,
        role_name: str,
        at: tuple[float, float, float],
        *,
        pitch: float = 0.0,
        yaw: float = 0.0,
    ) -> Any:
        """Command that makes an actor of a blueprint; metres and degrees, CARLA's frame."""
        carla = self._carla
        blueprint = self._library.find(name)
        if blueprint.has_attribute("role_name"):
            blueprint.set_attribute("role_name", role_name)
        if blueprint.has_attribute("is_invincible"):
            blueprint.set_attribute("is_invincible", "true")
        place = carla.Transform(carla.Location(*at), carla.Rotation(pitch, yaw, 0.0))
        return carla.command.SpawnActor(blueprint, place)

    # ------------------------------------------------------------------------------- errors
    def _answering(self) -> AbstractContextManager[None]:
        return answering(self.address)

    @contextmanager
    def _long(self) -> Iterator[None]:
        self._client.set_timeout(max(LOAD_TIMEOUT, self.address.timeout))
        try:
            with self._answering():
                yield
        finally:
            self._client.set_timeout(self.address.timeout)
