"""The only door to CARLA: a world in synchronous mode that is left as it was found.

The client speaks to one release of the server only, connects a single time when it is made, and
raises a plain ``RuntimeError`` for everything. So :func:`connect` first waits for the port, then
compares releases and maps, and says in its errors what to do.

``carla`` is an optional package (extra ``carla``), for CPython 3.11 and 3.12; it is imported when
somebody connects.
"""

from __future__ import annotations

import socket
import time
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, NamedTuple

from odscen.errors import CarlaError, MissingDependencyError

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping, Sequence
    from contextlib import AbstractContextManager

    from odscen.frames import CarlaPose

DEFAULT_PORT = 2000
_RETRY_SECONDS = 0.2
_UNSET_DELTA = 1e-6
"""Seconds: 0.9.16 shows an uninitialised number far below this where no time step is fixed."""


@dataclass(frozen=True, slots=True)
class Address:
    """Where a server listens, and how long (s) to wait for it and for each of its answers."""

    host: str = "localhost"
    port: int = DEFAULT_PORT
    timeout: float = 10.0

    def __str__(self) -> str:
        return f"{self.host}:{self.port}"


@dataclass(frozen=True, slots=True)
class ActorRequest:
    """An actor to spawn: id of its blueprint, pose of its origin, attributes that differ."""

    blueprint: str
    pose: CarlaPose
    attributes: Mapping[str, str] = field(default_factory=dict)


class SpawnAnswer(NamedTuple):
    """Id of a new actor, or ``None`` and the server's words why there is none."""

    actor: int | None
    problem: str


class CarlaSession:
    """A world that waits for our ticks. Made by :func:`connect` only.

    Attributes
    ----------
    world
        ``carla.World``; calls on it raise plain ``RuntimeError``, see :meth:`answering`.
    map_name
        Name of the server's map, without a folder.
    """

    def __init__(self, package: Any, client: Any, world: Any, *, address: Address) -> None:
        self._carla = package
        self._client = client
        self._address = address
        self._own: dict[int, None] = {}
        self._blueprints = world.get_blueprint_library()
        self.world = world
        self.map_name = str(world.get_map().name).rpartition("/")[2]

    def answering(self) -> AbstractContextManager[None]:
        """Context in which the client's errors become :class:`CarlaError`."""
        return _answering(self._address)

    def tick(self) -> int:
        """Advance by one time step; the number of the frame that is now to be seen.

        Raises
        ------
        CarlaError
            If the server does not answer.
        """
        with self.answering():
            return int(self.world.tick())

    def spawn(self, requests: Iterable[ActorRequest]) -> list[SpawnAnswer]:
        """Spawn actors in one call, in the order given; they are seen after the next tick.

        A refusal, as where another actor stands, is an answer and no error.

        Raises
        ------
        CarlaError
            If the server knows no such blueprint or attribute, or does not answer.
        """
        batch = [self._spawn_command(request) for request in requests]
        with self.answering():
            answers = self._client.apply_batch_sync(batch, False)
        spawned = [
            SpawnAnswer(None, answer.error) if answer.error else SpawnAnswer(answer.actor_id, "")
            for answer in answers
        ]
        self._own.update({answer.actor: None for answer in spawned if answer.actor is not None})
        return spawned

    def destroy(self, actors: Sequence[int]) -> None:
        """Destroy actors in one call; those that are gone already do not matter.

        Raises
        ------
        CarlaError
            If the server does not answer.
        """
        batch = [self._carla.command.DestroyActor(actor) for actor in actors]
        with self.answering():
            self._client.apply_batch_sync(batch, False)
        for actor in actors:
            self._own.pop(actor, None)

    def destroy_own(self) -> None:
        """Destroy all that :meth:`spawn` made, the youngest first: sensors before vehicles."""
        if self._own:
            self.destroy(list(reversed(self._own)))

    def _spawn_command(self, request: ActorRequest) -> Any:
        pose = request.pose
        at = self._carla.Transform(
            self._carla.Location(float(pose.x), float(pose.y), float(pose.z)),
            self._carla.Rotation(float(pose.pitch_deg), float(pose.yaw_deg), 0.0),
        )
        try:
            blueprint = self._blueprints.find(request.blueprint)
            for name, value in request.attributes.items():
                blueprint.set_attribute(name, value)
        except (IndexError, RuntimeError) as error:
            problem = (
                f"the CARLA server at {self._address} cannot make a {request.blueprint}: {error}"
            )
            raise CarlaError(problem) from error
        return self._carla.command.SpawnActor(blueprint, at)


@contextmanager
def connect(
    address: Address, *, delta: float, opendrive: str | None = None, generate: bool = False
) -> Iterator[CarlaSession]:
    """Take a server's world in hand; on leaving, destroy what was spawned and restore settings.

    Parameters
    ----------
    address
        Of the server; a server that is just starting is waited for.
    delta
        Simulated seconds of a tick.
    opendrive
        Text of the map that the server has to have; without it any will do.
    generate
        Let the server make its world from ``opendrive`` if it has another map: bare roads, which
        stay there afterwards.

    Raises
    ------
    MissingDependencyError
        If the package ``carla`` is not installed.
    CarlaError
        If there is no server, it is another release or has another map, or it goes away. An error
        inside the context is never hidden by one of restoring.
    """
    package = _package()
    _await_port(address)
    with _answering(address):
        client = package.Client(address.host, address.port)
        client.set_timeout(address.timeout)
        _check_release(client, address)
        world = _world(client, address, opendrive=opendrive, generate=generate)
        settings = world.get_settings()
        session = CarlaSession(package, client, world, address=address)
    with _restored(session, settings, address=address):
        with _answering(address):
            _synchronize(world, delta=delta)
        yield session


@contextmanager
def _restored(session: CarlaSession, settings: Any, *, address: Address) -> Iterator[None]:
    try:
        yield
    except BaseException:
        # The first error is the one to tell; a server that went away cannot be restored at all.
        with suppress(CarlaError):
            _restore(session, settings, address=address)
        raise
    _restore(session, settings, address=address)


def _restore(session: CarlaSession, settings: Any, *, address: Address) -> None:
    if (settings.fixed_delta_seconds or 0.0) < _UNSET_DELTA:
        settings.fixed_delta_seconds = None
    session.destroy_own()
    with _answering(address):
        session.world.apply_settings(settings)


def _package() -> Any:
    try:
        import carla
    except ImportError as error:
        problem = (
            "the package carla is not installed: pip install 'odscen[carla]' on CPython 3.11 or "
            "3.12 (there is none for newer ones)"
        )
        raise MissingDependencyError(problem) from error
    return carla


def _await_port(address: Address) -> None:
    """Wait until somebody listens: a client that is made too early is dead for ever."""
    deadline = time.monotonic() + address.timeout
    while True:
        try:
            socket.create_connection((address.host, address.port), timeout=address.timeout).close()
        except socket.gaierror as error:
            problem = f"no machine named {address.host!r}: check the host of the CARLA server"
            raise CarlaError(problem) from error
        except OSError as error:
            if time.monotonic() >= deadline:
                problem = (
                    f"no CARLA server at {address} after {address.timeout:g} s "
                    f"({error.strerror or error}): "
                    "start CARLA there, or name the host and port where it runs"
                )
                raise CarlaError(problem) from error
            time.sleep(_RETRY_SECONDS)
        else:
            return


def _check_release(client: Any, address: Address) -> None:
    mine, theirs = client.get_client_version(), client.get_server_version()
    if theirs != mine:
        problem = (
            f"the CARLA server at {address} is release {theirs}, the package carla is {mine}: "
            f"start a server of release {mine}"
        )
        raise CarlaError(problem)


def _world(client: Any, address: Address, *, opendrive: str | None, generate: bool) -> Any:
    world = client.get_world()
    if opendrive is None:
        return world
    road_map = world.get_map()
    if _same_map(road_map.to_opendrive(), opendrive):
        return world
    if generate:
        return client.generate_opendrive_world(opendrive)
    problem = (
        f"the CARLA server at {address} has another map, {road_map.name}: load the scenario's map "
        "there, or let the server make its world from the scenario's map"
    )
    raise CarlaError(problem)


def _same_map(one: str, other: str) -> bool:
    """Whether two OpenDRIVE texts differ in white space at most, as after a copy."""
    return one == other or one.lstrip("\ufeff").split() == other.lstrip("\ufeff").split()


def _synchronize(world: Any, *, delta: float) -> None:
    settings = world.get_settings()
    settings.synchronous_mode = True
    settings.fixed_delta_seconds = delta
    world.apply_settings(settings)


@contextmanager
def _answering(address: Address) -> Iterator[None]:
    """Turn the client's ``RuntimeError`` into ours: a time-out is all that it ever notices."""
    try:
        yield
    except RuntimeError as error:
        if "time-out" in str(error):
            problem = (
                f"the CARLA server at {address} has not answered for {address.timeout:g} s: it may "
                "have crashed, hang, be loading a map, or be something else; look at its window or "
                "log, then try again"
            )
            raise CarlaError(problem) from error
        problem = f"the CARLA server at {address} refused"
        raise CarlaError(problem, output=str(error)) from error
