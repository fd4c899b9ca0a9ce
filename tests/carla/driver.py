"""Somebody else who drives: ``python -m tests.carla.driver``, options as JSON on stdin.

Makes its cars, says ``ready``, and drives them straight ahead, with speeds by simulated time, once
traffic has appeared. It ends with its standard input.
"""

from __future__ import annotations

import json
import subprocess
import sys
import threading
import time
from pathlib import Path
from types import TracebackType
from typing import Any, NamedTuple, Self

from tests.carla_standin.process import StandIn

ROOT = Path(__file__).parents[2]
PAUSE = 0.2
"""Wall seconds between ticks: time enough for others to send what they want to be seen."""
Place = tuple[float, float, float, float]


class Car(NamedTuple):
    """A car: x, y, z, yaw; m/s from seconds on; seconds after which it is taken away."""

    pose: Place
    speeds: list[tuple[float, float]]
    role: str = "hero"
    gone: float = 1e9


class Driver:
    """Drives inside a ``with``.

    With ``led`` it makes the world's ticks as well, each of so many seconds, until it ends; then it
    says how many ticks others have made meanwhile.
    """

    def __init__(self, server: StandIn, *cars: Car, led: float | None = None) -> None:
        self._options = {"port": server.port, "cars": cars, "led": led}

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
        told, _ = self._process.communicate(timeout=120)
        self.ticks_of_others = int(told)


def made(world: Any, car: Car) -> Any:
    """Actor of a car."""
    import carla

    blueprint = world.get_blueprint_library().find("vehicle.tesla.model3")
    blueprint.set_attribute("role_name", car.role)
    x, y, z, yaw = car.pose
    place = carla.Transform(carla.Location(x, y, z), carla.Rotation(0.0, yaw, 0.0))
    return world.spawn_actor(blueprint, place)


def main() -> None:
    import carla

    options = json.loads(sys.stdin.readline())
    client = carla.Client("127.0.0.1", options["port"])
    client.set_timeout(10.0)
    world = client.get_world()
    cars = [Car(*car) for car in options["cars"]]
    actors = [made(world, car) for car in cars]
    alone = len(world.get_actors())
    begun: list[float] = []
    gone: set[int] = set()

    def drive(snapshot: Any) -> None:
        now = snapshot.timestamp.elapsed_seconds
        if not begun and len(list(snapshot)) > alone and snapshot.timestamp.delta_seconds > 0.06:
            begun.append(now)
        for number, (car, actor) in enumerate(zip(cars, actors, strict=True)):
            if not begun or number in gone:
                continue
            since = now - begun[0]
            if since >= car.gone:
                gone.add(number)
                actor.destroy()
                continue
            past = [speed for at, speed in car.speeds if since >= at]
            actor.enable_constant_velocity(carla.Vector3D(past[-1], 0.0, 0.0))

    world.on_tick(drive)
    if options["led"]:
        settings = world.get_settings()
        settings.synchronous_mode, settings.fixed_delta_seconds = True, options["led"]
        world.apply_settings(settings)
    sys.stdout.write("ready\n")
    sys.stdout.flush()
    done = threading.Event()
    threading.Thread(target=lambda: (sys.stdin.read(), done.set()), daemon=True).start()
    last, others = None, 0
    while options["led"] and not done.is_set():
        frame = world.tick()
        others += 0 if last is None else frame - last - 1
        last = frame
        time.sleep(PAUSE)
    done.wait()
    sys.stdout.write(f"{others}\n")


if __name__ == "__main__":
    main()
