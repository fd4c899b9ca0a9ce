"""Sensors attached to an actor, and what they see, as files.

A folder for each sensor: pictures as PNG, points of a lidar (x, y, z, intensity) and detections of
a radar (velocity, azimuth, altitude, depth) as ``.npy`` of shape ``(N, 4)``, float32, in CARLA's
units and the sensor's frame. ``index.csv`` has a row for each file: number, frame and simulated
seconds of the server, and where the sensor was, CARLA's frame.
"""

from __future__ import annotations

import queue
import threading
from contextlib import suppress
from typing import TYPE_CHECKING, Any

import numpy as np

from odscen.base.errors import CarlaError, WorkspaceError
from odscen.carla.sensors.pictures import Picture, still
from odscen.carla.server.batch import ROLE

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from odscen.carla.sensors.sensor_file import SensorWish
    from odscen.carla.server.carla_server import Server

COLUMNS = ("number", "frame", "time", "x", "y", "z", "pitch", "yaw", "roll")
"""Of ``index.csv``."""
_LAST = 60.0
"""Wall seconds that writing what has come may take at the end."""


class SensorRecording:
    """Records sensors from :meth:`attach` to :meth:`close`.

    Parameters
    ----------
    folder
        Gets a folder for each sensor.

    Attributes
    ----------
    counts
        Files written, by sensor.
    """

    def __init__(self, server: Server, wishes: Sequence[SensorWish], folder: Path) -> None:
        self.counts = {wish.name: 0 for wish in wishes}
        self._server = server
        self._wishes = tuple(wishes)
        self._folder = folder
        self._handles: dict[int, Any] = {}
        self._queue: queue.SimpleQueue[tuple[SensorWish, Any] | None] = queue.SimpleQueue()
        self._failed: OSError | None = None
        self._worker: threading.Thread | None = None

    @property
    def attached(self) -> bool:
        """Whether the sensors are there."""
        return bool(self._handles)

    def attach(self, actor: int) -> None:
        """Put all sensors on an actor and let them see from the next tick on.

        Raises
        ------
        CarlaError
            If the server does not know a sensor or an attribute, or will not have it.
        WorkspaceError
            If a folder cannot be made.
        """
        try:
            for wish in self._wishes:
                (self._folder / wish.name).mkdir(parents=True, exist_ok=True)
                self._write_row(wish, COLUMNS)
        except OSError as error:
            raise self._describe_disk_error(error) from error
        if self._worker is None:
            self._worker = threading.Thread(target=self._write_queued, name="sensors", daemon=True)
            self._worker.start()
        commands = [self._spawn_command(wish, actor) for wish in self._wishes]
        answers = self._server.spawn(commands)
        for wish, answer in zip(self._wishes, answers, strict=True):
            if not isinstance(answer, int):
                raise CarlaError(
                    f"the CARLA server refused the sensor {wish.name} ({wish.type}): {answer}"
                )
        made = self._server.actors([answer for answer in answers if isinstance(answer, int)])
        self._handles = {handle.id: handle for handle in made}
        for wish, number in zip(self._wishes, answers, strict=True):
            handle = self._handles[int(number)]
            handle.listen(lambda data, wish=wish: self._queue.put((wish, _copy_measurement(data))))

    def detach(self) -> None:
        """Take all sensors away: their actor goes, or the run ends."""
        for handle in self._handles.values():
            with suppress(RuntimeError):
                handle.stop()
        with suppress(CarlaError):
            self._server.destroy(sorted(self._handles))
        self._handles = {}

    def close(self) -> None:
        """Write what has come.

        Raises
        ------
        WorkspaceError
            If a file could not be written.
        """
        self.detach()
        if self._worker is not None:
            self._queue.put(None)
            self._worker.join(_LAST)
            self._worker = None
        if self._failed is not None:
            raise self._describe_disk_error(self._failed) from self._failed

    def _spawn_command(self, wish: SensorWish, actor: int) -> Any:
        carla, place = self._server.package, wish.place
        blueprint = self._server.blueprint(wish.type)
        for name, value in {"role_name": ROLE + wish.name, **wish.values()}.items():
            if blueprint.has_attribute(name):
                blueprint.set_attribute(name, value)
            elif name != "role_name":
                raise CarlaError(f"the sensor {wish.name}: {wish.type} has no attribute {name!r}")
        at = carla.Transform(
            carla.Location(place.x, place.y, place.z),
            carla.Rotation(place.pitch, place.yaw, place.roll),
        )
        return carla.command.SpawnActor(blueprint, at, actor)

    def _write_queued(self) -> None:
        while (item := self._queue.get()) is not None:
            if self._failed is not None:
                continue
            wish, (data, row) = item
            number = self.counts[wish.name] + 1
            try:
                self._write_measurement(self._folder / wish.name, number, data)
                self._write_row(wish, (number, *row))
            except OSError as error:
                self._failed = error
            else:
                self.counts[wish.name] = number

    def _write_measurement(self, folder: Path, number: int, data: Picture | np.ndarray) -> None:
        if isinstance(data, Picture):
            (folder / f"{number:06d}.png").write_bytes(still(data, "png"))
        else:
            np.save(folder / f"{number:06d}.npy", data)

    def _write_row(self, wish: SensorWish, row: Sequence[object]) -> None:
        texts = (f"{value:.6f}" if isinstance(value, float) else str(value) for value in row)
        with (self._folder / wish.name / "index.csv").open("a", encoding="utf-8") as file:
            file.write(",".join(texts) + "\n")

    def _describe_disk_error(self, error: OSError) -> WorkspaceError:
        return WorkspaceError(f"sensors: {error.filename or ''}: {error.strerror or error}")


def _copy_measurement(data: Any) -> tuple[Picture | np.ndarray, tuple[object, ...]]:
    """Copy a measurement, which the client takes back after the call, and describe it."""
    at = data.transform
    where, turn = at.location, at.rotation
    row = (
        data.frame, float(data.timestamp),
        where.x, where.y, where.z, turn.pitch, turn.yaw, turn.roll,
    )  # fmt: skip
    if hasattr(data, "fov") and hasattr(data, "height"):
        return Picture(data.timestamp, data.width, data.height, bytes(data.raw_data)), row
    if hasattr(data, "horizontal_angle"):
        points = np.frombuffer(bytes(data.raw_data), dtype=np.float32).reshape(-1, 4)
        return points.copy(), row
    seen = [
        (detection.velocity, detection.azimuth, detection.altitude, detection.depth)
        for detection in data
    ]
    return np.array(seen, dtype=np.float32).reshape(-1, 4), row
