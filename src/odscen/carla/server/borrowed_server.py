"""A CARLA server while it is borrowed: connected with, stepped, and given back as it was."""

from __future__ import annotations

import time
from contextlib import nullcontext, suppress
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Self

from odscen.base.errors import CarlaError
from odscen.carla.server.batch import ROLE, Batch
from odscen.carla.server.batch_commands import BatchCommands
from odscen.carla.server.client import answering, connect
from odscen.carla.server.releases import release_of

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping, Sequence
    from collections.abc import Set as AbstractSet
    from contextlib import AbstractContextManager
    from types import TracebackType

    from odscen.carla.server.batch import DoorMove, Spawn, WheelTurn
    from odscen.carla.server.client import Address


# ----------------------------------------------- the traffic lights of a server while they are ours
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


# --------------------------------------------------------- wheels and doors of vehicles on a server
class PartCalls:
    """Turns wheels, moves doors, and knows the vehicles that have them.

    Its calls raise the client's plain ``RuntimeError``.
    """

    def __init__(self, carla: Any) -> None:
        wheel = carla.VehicleWheelLocation
        self._front = (wheel.FL_Wheel, wheel.FR_Wheel)
        self._all = (*self._front, wheel.BL_Wheel, wheel.BR_Wheel)
        self._door = carla.VehicleDoor.names
        self._vehicles: dict[int, Any] = {}

    def move_doors(self, world: Any, moves: Mapping[int, tuple[DoorMove, ...]]) -> None:
        """Open and shut doors; who is gone is left out."""
        self._look_up(world, moves)
        for actor, doors in moves.items():
            vehicle = self._vehicles.get(actor)
            if vehicle is None:
                continue
            for door, opens in doors:
                (vehicle.open_door if opens else vehicle.close_door)(self._door[door])

    def turn(self, world: Any, turns: Mapping[int, WheelTurn]) -> None:
        """Turn the wheels of four-wheeled vehicles; who is gone is left out."""
        self._look_up(world, turns)
        for actor, turn in turns.items():
            vehicle = self._vehicles.get(actor)
            if vehicle is None:
                continue
            for wheel in self._front:
                vehicle.set_wheel_steer_direction(wheel, turn.steer)
            for wheel in self._all:
                vehicle.set_wheel_pitch_angle(wheel, turn.pitch)

    def _look_up(self, world: Any, actors: Iterable[int]) -> None:
        unknown = [actor for actor in actors if actor not in self._vehicles]
        if unknown:
            self._vehicles.update({actor.id: actor for actor in world.get_actors(unknown)})

    def forget(self, actors: Iterable[int]) -> None:
        """Forget vehicles that are gone."""
        for actor in actors:
            self._vehicles.pop(actor, None)


# -------------------------------------------------------------- A CARLA server while it is borrowed
GRACE = 15.0
"""Seconds that a server that has stopped answering gets to be given back after all."""
FREE_AIR = 12.0
"""Metres above the road where a body can be made that its place has no room for."""
_POLL = 0.001
"""Wall seconds between two looks for another client's tick."""


class BorrowedServer:
    """A CARLA server that this program has borrowed.

    A context manager: at its end every actor that it has made is gone, and settings, weather and
    traffic lights are as they were, however it ends; what could not be given back is in
    ``left_behind``, in words.

    Parameters
    ----------
    follows
        Whether the ticks, and the settings, are left to another client.

    Attributes
    ----------
    interruptions
        How often the stream of states was cut and came back.
    waited
        Seconds spent waiting for the server in batches and ticks.
    around_tick
        Entered for each tick that is made.
    roles
        More roles of actors that we make, besides those that begin with :data:`ROLE`.
    release
        What there is to know of its release.
    warnings
        What a user should know of this server, in words.

    Raises
    ------
    MissingDependencyError
        If the package ``carla`` is not installed.
    CarlaError
        If no server answers, or another release does.
    """

    def __init__(self, address: Address, *, follows: bool = False) -> None:
        self.address = address
        self.left_behind: list[str] = []
        self.roles: set[str] = set()
        self.interruptions = 0
        self.waited = 0.0
        self.around_tick: Callable[[], AbstractContextManager[None]] = nullcontext
        self._carla, self._client, warning = connect(address)
        self.release = release_of(self._client.get_client_version())
        self.warnings = [words for words in (warning, self.release.warning) if words]
        with self._expect_answer():
            self._world = self._client.get_world()
            self._library = self._world.get_blueprint_library()
            self._wording = BatchCommands(self._carla, self._library)
        self._own: set[int] = set()
        self._before: set[int] = set()
        self._settings: Any = None
        self._weather: Any = None
        self._lights = LightHold(self._carla)
        self._parts = PartCalls(self._carla)
        self._unsure = False
        self._frame: int | None = None
        self._follows = follows

    # ------------------------------------------------------------------------------- borrowing
    def __enter__(self) -> Self:
        with self._expect_answer():
            self._settings = self._world.get_settings()
            self._settings.fixed_delta_seconds = self.release.fixed_delta(self._settings)
            self._weather = self._world.get_weather()
            if self._follows:
                self.tick()
            elif not self._settings.synchronous_mode:
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
            self._lights.give_back(self._world)
            self._world.set_weather(self._weather)
            if not self._follows:
                self._world.apply_settings(self._settings)
            self._client.get_server_version()  # calls without an answer have arrived by now
        except RuntimeError:
            return False
        return True

    def _destroy_own(self) -> None:
        if self._unsure:  # an answer was lost: something may be there that was not reported
            with suppress(RuntimeError, CarlaError):  # a tick that is not shown
                self.tick()
            for actor in self._world.get_actors():
                role = actor.attributes.get("role_name", "")
                ours = role.startswith(ROLE) or role in self.roles
                if ours and actor.id not in self._before:
                    self._own.add(actor.id)
        destroy = self._carla.command.DestroyActor
        if self._own:
            self._client.apply_batch_sync([destroy(actor) for actor in sorted(self._own)], False)
            self._own.clear()
            if self._world.get_settings().synchronous_mode and not self._follows:
                with suppress(RuntimeError):
                    self._advance_tick()

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

    @property
    def ours(self) -> AbstractSet[int]:
        """The same, for asking whether one is among them."""
        return self._own

    def actors(self, numbers: Sequence[int]) -> list[Any]:
        """Actors of the client's by their numbers; those that are gone are left out."""
        with self._expect_answer():
            return list(self._world.get_actors(list(numbers)))

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
        with self._expect_answer():
            answers = [
                reply.error or int(reply.actor_id) for reply in self._apply_commands(commands)
            ]
        self._own |= {answer for answer in answers if isinstance(answer, int)}
        return answers

    def send(self, commands: Sequence[Any]) -> None:
        """Give commands in one call; no tick is made."""
        if commands:
            with self._expect_answer():
                self._apply_commands(commands)

    def destroy(self, actors: Sequence[int]) -> None:
        """Destroy actors of ours in one call; those that are gone already do not matter."""
        with self._expect_answer():
            self._destroy_actors(actors)

    # ------------------------------------------------------------------------------- time
    def clock(self) -> tuple[float, float]:
        """Simulated seconds of the server's newest state, and of the tick that led to it."""
        stamp = self._world.get_snapshot().timestamp
        return float(stamp.elapsed_seconds), float(stamp.delta_seconds)

    def own_time(self) -> float | None:
        """Simulated seconds after our last tick; ``None`` if there is none, or a newer state."""
        snapshot = self._world.get_snapshot()
        return float(snapshot.timestamp.elapsed_seconds) if snapshot.frame == self._frame else None

    def first_clock(self) -> tuple[float, float]:
        """As :meth:`clock`, behind a call that is answered: a recording then has when this was."""
        with self._expect_answer():
            self._world.get_settings()
        return self.clock()

    def synchronize(self, delta: float, *, sensed_speed: bool = False) -> None:
        """Let the server wait for our ticks, each of ``delta`` simulated seconds.

        Parameters
        ----------
        sensed_speed
            Whether vehicles keep physics, without gravity: they drive the last tick of their way
            by themselves, so that sensors see their velocity. Without physics it is 0.
        """
        self._wording.pushed = delta if sensed_speed else None
        self._frame = None
        with self._expect_answer():
            settings = self._world.get_settings()
            settings.synchronous_mode = True
            settings.fixed_delta_seconds = delta
            self._world.apply_settings(settings)

    # ------------------------------------------------------------------------------- ticks
    def apply(self, batch: Batch) -> list[int | str]:
        """Do all of a batch, in one call but for lights, wheels and doors, and make the tick.

        Returns
        -------
        list
            For each spawn the actor's id, or why there is none.
        """
        commands = self._wording.commands(batch)
        with self._expect_answer():
            self._lights.switch(batch.signals)
            self._parts.move_doors(self._world, batch.doors)
            self._parts.turn(self._world, batch.wheels)
            self._parts.forget(batch.destroy)
            # These get no answer, and a call that is answered keeps them from landing after the
            # tick (issue 8263 of carla-simulator/carla).
            responses = self._apply_commands(commands) if commands or batch.signals else []
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
            for n, response in zip(
                refused, self._apply_commands(self._wording.commands(higher)), strict=True
            ):
                answers[n] = response.error or int(response.actor_id)

    def tick(self) -> None:
        """Make a tick, or wait for another client's.

        A stream that was cut comes back by itself: one more tick shows it.

        Raises
        ------
        CarlaError
            If another client ticks as well: the world's time is no longer ours. If it is not to be
            ours, and no other client ticks.
        """
        if self._follows:
            self.await_tick(self.clock()[0])
            return
        start = time.perf_counter()
        try:
            frame = self._advance_tick()
        except RuntimeError:
            if not self.address.listens():
                raise
            frame = self._advance_tick()
            self.interruptions += 1
            self._frame = None
        self.waited += time.perf_counter() - start
        last, self._frame = self._frame, frame
        if last is not None and frame != last + 1:
            raise CarlaError(
                f"another client ticks the CARLA server at {self.address} as well: a tick led from "
                f"frame {last} to {frame}; only one client may tick"
            )

    def _advance_tick(self) -> int:
        with self.around_tick():
            return int(self._world.tick(self.address.timeout))

    def await_tick(self, after: float) -> None:
        """Wait until another client has made a tick since a time of :meth:`clock`.

        The client's own way to wait misses a tick that comes before it is called.

        Raises
        ------
        CarlaError
            If none comes.
        """
        start = time.perf_counter()
        while self.clock()[0] <= after:
            time.sleep(_POLL)
            if time.perf_counter() - start > self.address.timeout:
                raise CarlaError(
                    f"no client has ticked the CARLA server at {self.address} for "
                    f"{self.address.timeout:g} s, and the one that is followed has to"
                )
        self.waited += time.perf_counter() - start

    def _apply_commands(self, commands: Sequence[Any]) -> list[Any]:
        self._unsure = True
        start = time.perf_counter()
        responses = list(self._client.apply_batch_sync(list(commands), False))
        self.waited += time.perf_counter() - start
        self._unsure = False
        return responses

    def _destroy_actors(self, actors: Sequence[int]) -> None:
        if actors:
            self._apply_commands([self._carla.command.DestroyActor(actor) for actor in actors])
            self._own -= set(actors)

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
        return self._wording.spawn(name, role_name, at, pitch=pitch, yaw=yaw)

    # ------------------------------------------------------------------------------- errors
    def _expect_answer(self) -> AbstractContextManager[None]:
        return answering(self.address)
