"""A camera straight above the ego, or above the whole region where there is none.

Pictures arrive in the client's threads some time after their tick. A thread of ours takes them as
they come and passes them on, so that neither encoding nor a slow disk holds a tick up.
"""

from __future__ import annotations

import math
import queue
import threading
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from odscen.base.errors import CarlaError, OdscenError
from odscen.carla.sensors.pictures import Picture, picture_files, still
from odscen.carla.server.batch import ROLE, ActorPlace

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from odscen.carla.sensors.pictures import Wish
    from odscen.carla.server.carla_server import Server
    from odscen.records.run_plan import Plan

BLUEPRINT = "sensor.camera.rgb"
FIELD_OF_VIEW = 60.0
"""Degrees from the left to the right edge of a picture."""
EGO_SPAN = 120.0
"""Metres of ground from left to right around an ego."""
MARGIN = 1.1
_NORTH = -90.0
"""CARLA's yaw of north, which is up in the picture as on every map of ours."""
_WAITING = 50
"""Pictures that may wait for their turn; when more come, the oldest is dropped."""
_LAST = 2.0
"""Wall seconds that the last pictures get to arrive in."""


@dataclass(frozen=True, slots=True)
class View:
    """What a camera shows: middle and width of the ground, metres, OpenDRIVE frame."""

    x: float
    y: float
    z: float
    span: float = EGO_SPAN

    @property
    def altitude(self) -> float:
        """Metres above the ground at which a camera sees just that."""
        return self.span / 2.0 / math.tan(math.radians(FIELD_OF_VIEW) / 2.0)


def first_view(plan: Plan, wish: Wish) -> View:
    """View around the ego's place at the beginning, else of all places that a run begins at."""
    ego = next((actor for actor in plan.actors if actor.ego), None)
    if ego is not None:
        return View(ego.x, ego.y, ego.z)
    if not plan.actors:
        return View(0.0, 0.0, 0.0)
    places = np.array([(actor.x, actor.y, actor.z) for actor in plan.actors])
    low, high = places.min(axis=0), places.max(axis=0)
    width, height = (high - low)[:2]
    span = max(MARGIN * max(width, height * wish.width / wish.height), EGO_SPAN)
    x, y = ((low + high) / 2.0)[:2]
    return View(float(x), float(y), float(high[2]), float(span))


class Camera:
    """A camera that looks down. Made by :func:`open_camera` only.

    Attributes
    ----------
    number
        Its actor on the server.
    taken, dropped
        Pictures that have come, and those of them that were given up because too many waited.
    """

    def __init__(self, server: Server, number: int, span: float) -> None:
        self.number = number
        self._server = server
        self._handle = server.world.get_actor(number)
        self._span = span
        self._pictures: queue.SimpleQueue[Picture | None] = queue.SimpleQueue()
        self.taken = self.dropped = 0

    def above(self, x: float, y: float, z: float) -> ActorPlace:
        """Where it is to be to look at a place; metres, OpenDRIVE frame."""
        view = View(x, y, z, self._span)
        return ActorPlace(x, -y, z + view.altitude, -90.0, _NORTH)

    def follow(self, x: float, y: float, z: float) -> None:
        """Look at another place from the next tick on; does not wait for the server."""
        self._handle.set_transform(_view_from_above(self._server, View(x, y, z, self._span)))

    def listen(self) -> None:
        """Let pictures come."""
        self._handle.listen(self._take_image)

    def _take_image(self, image: Any) -> None:
        self.taken += 1
        if self._pictures.qsize() >= _WAITING:
            with suppress(queue.Empty):
                self._pictures.get_nowait()
            self.dropped += 1
        data = bytes(image.raw_data)
        self._pictures.put(Picture(image.timestamp, image.width, image.height, data))

    def close(self) -> None:
        """Let no more come; what has come is passed on."""
        with suppress(RuntimeError):
            self._handle.stop()
        self._pictures.put(None)

    def pass_on(self, take: Callable[[Picture], None]) -> None:
        """Pass pictures on until it is closed."""
        while (picture := self._pictures.get()) is not None:
            take(picture)


@contextmanager
def open_camera(
    server: Server,
    view: View,
    take: Callable[[Picture], None],
    *,
    width: int,
    height: int,
    rate: float,
) -> Iterator[Camera]:
    """Put a camera up on a synchronized server for a while.

    Parameters
    ----------
    take
        Called with each picture in a thread of its own. An error of ours that it raises is raised
        when the context ends, and no more pictures are passed on.
    width, height
        Pixels.
    rate
        Pictures per simulated second.

    Raises
    ------
    CarlaError
        If the server will not have it.
    """
    number = _put_up(server, view, width=width, height=height, rate=rate)
    camera = Camera(server, number, view.span)
    failed: list[OdscenError | OSError] = []

    def work() -> None:
        try:
            camera.pass_on(take)
        except (OdscenError, OSError) as error:
            failed.append(error)

    worker = threading.Thread(target=work, name="pictures", daemon=True)
    worker.start()
    camera.listen()
    try:
        yield camera
    finally:
        camera.close()
        worker.join(_LAST + _WAITING)
        with suppress(CarlaError):
            server.destroy([number])
    if failed:
        raise failed[0]


@contextmanager
def watch_from_above(
    server: Server,
    view: View,
    wish: Wish,
    on_picture: Callable[[bytes], None] | None,
    *,
    keep: Callable[[Picture], None] | None = None,
) -> Iterator[Camera]:
    """Put a camera up whose pictures are written as wished, and reported as JPEG.

    Parameters
    ----------
    keep
        Called with each picture, in a thread of its own.

    Raises
    ------
    CarlaError
        If the server will not have it.
    WorkspaceError
        If a file cannot be written; the run has gone on without.
    """
    with picture_files(wish) as write:

        def take(picture: Picture) -> None:
            write(picture)
            if keep is not None:
                keep(picture)
            if on_picture is not None:
                on_picture(still(picture, "jpeg"))

        with open_camera(
            server, view, take, width=wish.width, height=wish.height, rate=wish.rate
        ) as camera:
            yield camera


def _put_up(server: Server, view: View, *, width: int, height: int, rate: float) -> int:
    place = _view_from_above(server, view)
    blueprint = server.world.get_blueprint_library().find(BLUEPRINT)
    values = {
        "role_name": ROLE + "camera",
        "image_size_x": str(width),
        "image_size_y": str(height),
        "fov": str(FIELD_OF_VIEW),
        "sensor_tick": str(1.0 / rate),
    }
    for name, value in values.items():
        if blueprint.has_attribute(name):
            blueprint.set_attribute(name, value)
    (answer,) = server.spawn([server.package.command.SpawnActor(blueprint, place)])
    if not isinstance(answer, int):
        raise CarlaError(
            f"the CARLA server at {server.address} has no place for a camera: {answer}"
        )
    server.tick()
    return answer


def _view_from_above(server: Server, view: View) -> Any:
    carla = server.package
    place = carla.Location(float(view.x), -float(view.y), float(view.z) + view.altitude)
    return carla.Transform(place, carla.Rotation(-90.0, _NORTH, 0.0))
