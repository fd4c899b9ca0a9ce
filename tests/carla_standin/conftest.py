"""A stand-in on a small map with traffic lights, and the real client on it."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

from tests.carla_standin.process import StandIn

DELTA = 0.05
MAPS = Path(__file__).parents[2] / "maps"


@dataclass(frozen=True, slots=True)
class Connected:
    """A running stand-in, a client and the world it got; the world is synchronous."""

    server: StandIn
    client: Any
    world: Any

    def blueprint(self, name: str) -> Any:
        return self.world.get_blueprint_library().find(name)

    def spawn(self, name: str, at: Any, **more: Any) -> Any:
        return self.world.spawn_actor(self.blueprint(name), at, **more)


def connect(server: StandIn, *, timeout: float = 5.0) -> Any:
    import carla

    client = carla.Client(server.host, server.port)
    client.set_timeout(timeout)
    return client


def synchronize(client: Any) -> Any:
    """Get the world and let it wait for this client's ticks."""
    world = client.get_world()
    settings = world.get_settings()
    settings.synchronous_mode = True
    settings.fixed_delta_seconds = DELTA
    world.apply_settings(settings)
    return world


@pytest.fixture
def server() -> Iterator[StandIn]:
    # Bodies may touch the ground, so that tests can put them at plain places.
    file = MAPS / "signal_crossing.xodr"
    with StandIn(file, map_name="Crossing", refuse_grounded=False) as server:
        yield server


@pytest.fixture
def connected(server: StandIn) -> Connected:
    client = connect(server)
    return Connected(server, client, synchronize(client))
