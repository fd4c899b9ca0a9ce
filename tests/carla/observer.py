"""A second client, in a process of its own, that writes down all that a server shows.

``python -m tests.carla.observer HOST PORT FILE`` says ``ready`` once it listens, and writes FILE
when its standard input is closed.
"""

from __future__ import annotations

import json
import subprocess
import sys
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
    """Watches a stand-in inside a ``with``; the frames are there afterwards."""

    def __init__(self, server: StandIn, file: Path) -> None:
        self._server, self._file = server, file
        self.frames: list[Frame] = []
        self.boxes: dict[str, list[float]] = {}

    def __enter__(self) -> Self:
        self._process = subprocess.Popen(
            [
                sys.executable, "-m", "tests.carla.observer", self._server.host,
                str(self._server.port), str(self._file),
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
        self._process.communicate(timeout=60)
        seen = json.loads(self._file.read_text())
        self.frames = [Frame(**frame) for frame in seen["frames"]]
        self.boxes = seen["boxes"]


def main() -> None:
    import carla

    host, port, file = sys.argv[1:]
    client = carla.Client(host, int(port))
    client.set_timeout(10.0)
    world = client.get_world()
    frames: dict[int, dict[str, Any]] = {}
    names: dict[int, str] = {}
    lights: dict[int, Any] = {}
    boxes: dict[str, list[float]] = {}
    raw: list[Any] = []
    world.on_tick(raw.append)

    def take() -> None:
        while raw:
            snapshot = raw.pop(0)
            users, numbers = {}, []
            for actor in snapshot:
                at, v = actor.get_transform(), actor.get_velocity()
                numbers.append(actor.id)
                users[actor.id] = [
                    at.location.x, at.location.y, at.location.z, at.rotation.pitch,
                    at.rotation.yaw, v.x, v.y, v.z,
                ]  # fmt: skip
            fresh = [number for number in numbers if number not in names]
            for actor in world.get_actors(fresh) if fresh else ():
                role = actor.attributes.get("role_name", "")
                names[actor.id] = role
                if actor.type_id == "traffic.traffic_light":
                    lights[actor.id] = actor
                elif role.startswith(ROLE):
                    box = actor.bounding_box
                    boxes[role.removeprefix(ROLE)] = [
                        box.location.x, box.location.z, box.extent.x, box.extent.z
                    ]  # fmt: skip
            frames[snapshot.frame] = {
                "number": snapshot.frame,
                "elapsed": snapshot.timestamp.elapsed_seconds,
                "users": {
                    names[number].removeprefix(ROLE): values
                    for number, values in users.items()
                    if names.get(number, "").startswith(ROLE)
                    and names[number] != ROLE + "measure"
                },
                "lights": {},
            }

    def watch_lights(snapshot: Any) -> None:
        # The client keeps the newest state only: read while this one is it.
        seen.append((snapshot.frame, {i: str(light.get_state()) for i, light in lights.items()}))

    take_first = world.get_actors().filter("traffic.traffic_light*")
    lights |= {actor.id: actor for actor in take_first}
    signs = {actor.id: actor.get_opendrive_id() for actor in take_first}
    seen: list[tuple[int, dict[int, str]]] = []
    world.on_tick(watch_lights)
    sys.stdout.write("ready\n")
    sys.stdout.flush()
    import threading

    done = threading.Event()

    def wait() -> None:
        sys.stdin.read()
        done.set()

    threading.Thread(target=wait, daemon=True).start()
    while not done.wait(0.02):
        take()
    take()
    for number, states in seen:
        if number in frames:
            frames[number]["lights"] = {signs[i]: s for i, s in states.items() if i in signs}
    Path(file).write_text(
        json.dumps({"frames": [frames[n] for n in sorted(frames)], "boxes": boxes})
    )


if __name__ == "__main__":
    main()
