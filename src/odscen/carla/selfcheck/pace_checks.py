"""Checks of how fast a server is: ticks with many actors, and answers about the ground."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING

import numpy as np

from odscen.carla.selfcheck.body_checks import usual_car
from odscen.carla.selfcheck.check_line import judged
from odscen.carla.server.batch import ROLE, ActorPlace, Batch, Move, Spawn, Velocity

if TYPE_CHECKING:
    from odscen.carla.selfcheck.check_line import CheckLimits, CheckLine
    from odscen.carla.server.carla_server import Server

PACE, GROUND_PACE = "ticks with 100 actors", "answers about the ground"
ACTORS = 100
TICKS = 40
"""Ticks that are timed, after a few that are not."""
_UNTIMED = 5
_ASKED = 20
_ALOFT = 500.0
"""Metres above zero, where nothing is."""
_APART = 12.0
_STILL = Velocity(0.0, 0.0, 0.0)


def pace_lines(server: Server, limits: CheckLimits) -> list[CheckLine]:
    """Ticks per second of wall time while 100 cars are moved in each."""
    car = usual_car(server)
    places = [
        ActorPlace(_APART * (k % 10), _APART * (k // 10), _ALOFT, 0.0, 0.0) for k in range(ACTORS)
    ]
    spawns = [
        Spawn(car, f"{ROLE}selfcheck.{k}", at, _STILL, 0.0, False, 0.0, 0)
        for k, at in enumerate(places)
    ]
    made = [
        (answer, at)
        for answer, at in zip(server.apply(Batch(spawn=tuple(spawns))), places, strict=True)
        if isinstance(answer, int)
    ]
    took = []
    for tick in range(_UNTIMED + TICKS):
        moves = tuple(
            Move(actor, at._replace(x=at.x + 0.5 * tick), _STILL, 0.0, False) for actor, at in made
        )
        start = time.perf_counter()
        server.apply(Batch(move=moves))
        took.append(time.perf_counter() - start)
    server.destroy([actor for actor, _ in made])
    server.tick()
    seconds = np.array(took[_UNTIMED:])
    pace = len(seconds) / float(seconds.sum())
    middle, high = (float(value) for value in np.percentile(seconds * 1e3, [50, 95]))
    return [
        judged(
            PACE,
            f"{ACTORS} actors, at least {limits.pace:g} ticks a second",
            f"{len(made)} actors, {pace:.1f} a second "
            f"(median {middle:.1f} ms, 95th percentile {high:.1f} ms)",
            ok=len(made) == ACTORS and pace >= limits.pace,
            note="the client's share included; without cameras",
        )
    ]


def ground_pace_lines(server: Server, limits: CheckLimits) -> list[CheckLine]:
    """How long the server takes to say what is below a place."""
    places = (server.spawn_places() or [ActorPlace(0.0, 0.0, 0.0, 0.0, 0.0)]) * _ASKED
    took = []
    for at in places[:_ASKED]:
        start = time.perf_counter()
        server.ground_below(at.x, at.y, at.z + 1.0, 5.0)
        took.append((time.perf_counter() - start) * 1e3)
    middle, high = (float(value) for value in np.percentile(took, [50, 95]))
    return [
        judged(
            GROUND_PACE,
            f"in {limits.ground_ms:g} ms at the median",
            f"{middle:.2f} ms (95th percentile {high:.2f} ms)",
            ok=middle <= limits.ground_ms,
            note="pedestrians ask up to 12 times a step of SUMO's",
        )
    ]
