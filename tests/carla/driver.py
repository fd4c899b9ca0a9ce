"""Somebody else who drives the hero: ``python -m tests.carla.driver``, options as JSON on stdin.

Makes a car with the role ``hero``, says ``ready``, and drives it straight ahead, with speeds by
simulated time, once traffic has appeared. It ends with its standard input.
"""

from __future__ import annotations

import json
import subprocess
import sys
import threading
from pathlib import Path
from types import TracebackType
from typing import Any, Self

from tests.carla_standin.process import StandIn

ROOT = Path(__file__).parents[2]


class Driver:
    """Drives inside a ``with``. ``pose`` is x, y, z, yaw; ``speeds`` maps seconds to m/s."""

    def __init__(
        self,
        server: StandIn,
        pose: tuple[float, float, float, float],
        speeds: list[tuple[float, float]],
    ) -> None:
        self._options = {"port": server.port, "pose": pose, "speeds": speeds}

    def __enter__(self) -> Self:
        self._process = subprocess.Popen(
            [sys.executable, "-m", "tests.carla.driver"],
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, cwd=ROOT,
        )  # fmt: skip
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        self._process.stdin.write(json.dumps(self._options) + "\n")
        self._process.stdin.flush()
        assert self._process.stdout.readline() == "ready\n"
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._process.communicate(timeout=30)


def main() -> None:
    import carla

    options = json.loads(sys.stdin.readline())
    client = carla.Client("127.0.0.1", options["port"])
    client.set_timeout(10.0)
    world = client.get_world()
    blueprint = world.get_blueprint_library().find("vehicle.tesla.model3")
    blueprint.set_attribute("role_name", "hero")
    x, y, z, yaw = options["pose"]
    hero = world.spawn_actor(
        blueprint, carla.Transform(carla.Location(x, y, z), carla.Rotation(0.0, yaw, 0.0))
    )
    alone = len(world.get_actors())
    begun: list[float] = []

    def drive(snapshot: Any) -> None:
        now = snapshot.timestamp.elapsed_seconds
        if not begun and len(list(snapshot)) > alone and snapshot.timestamp.delta_seconds > 0.06:
            begun.append(now)
        if begun:
            past = [speed for at, speed in options["speeds"] if now - begun[0] >= at]
            hero.enable_constant_velocity(carla.Vector3D(past[-1], 0.0, 0.0))

    world.on_tick(drive)
    sys.stdout.write("ready\n")
    sys.stdout.flush()
    done = threading.Event()
    threading.Thread(target=lambda: (sys.stdin.read(), done.set()), daemon=True).start()
    done.wait()


if __name__ == "__main__":
    main()
