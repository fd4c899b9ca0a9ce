"""A second client, in a process of its own, that writes down all that a server shows.

``python -m tests.carla.observer HOST PORT FILE EGO`` says ``ready`` once it listens, and writes
FILE when its standard input is closed.
"""

from __future__ import annotations

import json
import subprocess
import sys
import threading
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Any, Self

from tests.carla_standin.process import StandIn

ROOT = Path(__file__).parents[2]
ROLE = "odscen."


@dataclass(frozen=True, slots=True)
class Frame:
    """One frame: road users by their id in the scenario, and lights by signal id.

    A road user is x, y, z, pitch, yaw (degrees), then its velocity x, y, z.
    """

    number: int
    elapsed: float
    users: dict[str, list[float]]
    lights: dict[str, str]


class Observer:
    """Watches a stand-in inside a ``with``; the frames are there afterwards.

    ``ego`` is the id of the one with the role ``hero``.
    """

    def __init__(self, server: StandIn, file: Path, *, ego: str = "ego") -> None:
        self._server, self._file, self._ego = server, file, ego
        self.frames: list[Frame] = []
        self.boxes: dict[str, list[float]] = {}

    def __enter__(self) -> Self:
        self._process = subprocess.Popen(
            [
                sys.executable, "-m", "tests.carla.observer", self._server.host,
                str(self._server.port), str(self._file), self._ego,
            ],
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, cwd=ROOT,
        )  # fmt: skip
        assert self._process.stdout is not None
        assert self._process.stdout.readline() == "ready\n"
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._process.communicate(timeout=180)
        seen = json.loads(self._file.read_text())
        self.frames = [Frame(**frame) for frame in seen["frames"]]
        self.boxes = seen["boxes"]


class Notes:
    """What has been seen so far."""

    def __init__(self, world: Any, ego: str) -> None:
        self._world, self._ego = world, ego
        self._raw: list[Any] = []
        self._shown: list[tuple[int, dict[int, str]]] = []
        self._names: dict[int, str] = {}
        self._frames: dict[int, dict[str, Any]] = {}
        self._boxes: dict[str, list[float]] = {}
        lights = world.get_actors().filter("traffic.traffic_light*")
        self._lights = {light.id: light for light in lights}
        self._signs = {light.id: light.get_opendrive_id() for light in lights}
        world.on_tick(self._hear)

    def _hear(self, snapshot: Any) -> None:
        self._raw.append(snapshot)
        # The client keeps the newest state only: read while this one is it.
        states = {number: str(light.get_state()) for number, light in self._lights.items()}
        self._shown.append((snapshot.frame, states))

    def take(self) -> None:
        """Write down what has been heard."""
        while self._raw:
            snapshot = self._raw.pop(0)
            seen = {actor.id: actor for actor in snapshot}
            self._meet([number for number in seen if number not in self._names])
            self._frames[snapshot.frame] = {
                "number": snapshot.frame,
                "elapsed": snapshot.timestamp.elapsed_seconds,
                "users": {
                    self._names[number]: _numbers(actor)
                    for number, actor in seen.items()
                    if self._names.get(number)
                },
                "lights": {},
            }

    def _meet(self, fresh: list[int]) -> None:
        for actor in self._world.get_actors(fresh) if fresh else ():
            role = actor.attributes.get("role_name", "")
            role = ROLE + self._ego if role == "hero" else role
            ours = role.startswith(ROLE) and role != ROLE + "measure"
            self._names[actor.id] = role.removeprefix(ROLE) if ours else ""
            if ours:
                box = actor.bounding_box
                self._boxes[self._names[actor.id]] = [
                    box.location.x, box.location.z, box.extent.x, box.extent.z, box.location.y
                ]  # fmt: skip

    def to_json(self) -> str:
        """Frames in their order, and boxes of road users."""
        for number, states in self._shown:
            if number in self._frames:
                lights = {self._signs[light]: state for light, state in states.items()}
                self._frames[number]["lights"] = lights
        frames = [self._frames[number] for number in sorted(self._frames)]
        return json.dumps({"frames": frames, "boxes": self._boxes})


def _numbers(actor: Any) -> list[float]:
    at, v = actor.get_transform(), actor.get_velocity()
    where, turn = at.location, at.rotation
    return [where.x, where.y, where.z, turn.pitch, turn.yaw, v.x, v.y, v.z]


def main() -> None:
    import carla

    host, port, file, ego = sys.argv[1:]
    client = carla.Client(host, int(port))
    client.set_timeout(10.0)
    notes = Notes(client.get_world(), ego)
    sys.stdout.write("ready\n")
    sys.stdout.flush()
    done = threading.Event()
    threading.Thread(target=lambda: (sys.stdin.read(), done.set()), daemon=True).start()
    while not done.wait(0.02):
        notes.take()
    notes.take()
    Path(file).write_text(notes.to_json())


if __name__ == "__main__":
    main()
