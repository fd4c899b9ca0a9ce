"""The stand-in's process: ``python -m tests.carla_standin``, started by :mod:`.process`.

It reads one line of JSON with its options from standard input, says ``{"port": ...}`` once it
listens, and then answers one line of JSON for each it reads. It ends with its standard input, so
that it cannot outlive the test that started it.
"""

from __future__ import annotations

import asyncio
import json
import os
import sys
from collections import Counter
from pathlib import Path
from typing import Any

from tests.carla_standin import wire
from tests.carla_standin.actor_calls import ActorCalls
from tests.carla_standin.commands import BatchCalls
from tests.carla_standin.light_calls import LightCalls
from tests.carla_standin.road_map import RoadMap
from tests.carla_standin.rpc import MethodTable, RpcServer
from tests.carla_standin.streams import StreamServer
from tests.carla_standin.switches import Switches
from tests.carla_standin.wire import transform
from tests.carla_standin.world import ASYNC_DELTA, World
from tests.carla_standin.world_calls import WorldCalls


class StandIn:
    """Everything in the process, and what tests may ask of it behind CARLA's back."""

    def __init__(self, options: dict[str, Any]) -> None:
        wire.speak(options["speaks"])
        maps = {name: Path(file) for name, file in options["maps"].items()}
        self.streams = StreamServer()
        self.switches = Switches()
        self.set(**options["switches"])
        first = next(iter(maps))
        road_map = RoadMap.read(maps[first], f"Carla/Maps/{first}")
        self.world = World(road_map, self.streams, self.switches)
        self.world.box_offset = tuple(options["box_offset"])
        self._world_calls = WorldCalls(self.world, self.streams, self.switches, maps=maps)
        actors, lights = ActorCalls(self.world, self.switches), LightCalls(self.world)
        self._batch = BatchCalls(actors, lights, self._world_calls)
        self.methods = MethodTable(
            self._world_calls, actors, lights, self._batch, switches=self.switches
        )

    def set(self, **switches: Any) -> None:
        """Change switches."""
        self.switches.change(**switches)
        self.streams.refusing = self.switches.refuse_streams

    def calls(self) -> Counter[str]:
        """How often each RPC was called."""
        return self.methods.calls

    def reset_calls(self) -> None:
        """Count RPCs anew."""
        self.methods.calls.clear()

    def generation(self) -> list[Any]:
        """Parameters by which a world was made of an OpenDRIVE text, as they were sent."""
        return self._world_calls.generation

    def commands(self) -> dict[int, list[Any]]:
        """For each actor the last command that drove it or put it somewhere."""
        return self._batch.last

    def load(self, name: str) -> None:
        """Load another map, as another client might."""
        self._world_calls.load(name)

    def actors(self) -> list[dict[str, Any]]:
        """All actors as the server has them."""
        return [
            {
                "id": actor.id,
                "type_id": actor.type_id,
                "transform": transform(actor.at),
                "velocity": actor.velocity,
                "parent": actor.parent.id if actor.parent else None,
                "physics": actor.physics,
                "autopilot": actor.autopilot,
                "lights": actor.lights,
                "wheels": actor.wheels,
                "doors": sorted(actor.doors),
                "left_doors": actor.left_doors,
            }
            for actor in self.world.actors.values()
        ]

    async def tick_by_clock(self) -> None:
        """Tick while no client does."""
        while True:
            await asyncio.sleep(ASYNC_DELTA)
            if not self.world.synchronous:
                self.world.tick()
                await self.methods.catch_up()

    async def obey(self) -> None:
        """Answer the test until it closes standard input."""
        loop = asyncio.get_running_loop()
        reader = asyncio.StreamReader()
        await loop.connect_read_pipe(lambda: asyncio.StreamReaderProtocol(reader), sys.stdin)
        while line := await reader.readline():
            name, arguments = json.loads(line)
            try:
                say({"result": getattr(self, name)(**arguments)})
            except Exception as error:
                say({"error": repr(error)})


def say(message: dict[str, Any]) -> None:
    """Write one line to the test."""
    sys.stdout.write(json.dumps(message) + "\n")
    sys.stdout.flush()


async def main() -> None:
    """Serve until the test has had enough."""
    stand_in = StandIn(json.loads(sys.stdin.readline()))
    await stand_in.streams.start()
    port = await RpcServer(stand_in.methods).start()
    async with asyncio.TaskGroup() as tasks:
        tasks.create_task(stand_in.tick_by_clock())
        say({"port": port})
        await stand_in.obey()
        # Open connections are cut, not wound up: nothing here is worth a farewell.
        os._exit(0)


if __name__ == "__main__":
    asyncio.run(main())
