"""Road users of native mode that are still to come: who is due, and how often each was tried."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from odscen.base.frames import xodr_to_carla
from odscen.carla.server.batch import LIFTS, ROLE

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from odscen.carla.native.native_plan import NativeActor
    from odscen.carla.server.carla_server import Server

RETRY_SECONDS = 0.5
"""Simulated seconds between two tries to spawn a road user."""


@dataclass(slots=True)
class _SpawnTries:
    next: float = 0.0
    count: int = 0
    reason: str = ""


class SpawnQueue:
    """Road users that are to be spawned, in order of departure.

    Parameters
    ----------
    server
        Synchronized.
    actors
        Who is to come.
    blueprints
        By row of the plan.
    """

    def __init__(
        self, server: Server, actors: Sequence[NativeActor], blueprints: Sequence[str]
    ) -> None:
        self._server = server
        self._blueprints = blueprints
        self._waiting = sorted(actors, key=lambda actor: (actor.depart, actor.row))
        self._tries: dict[int, _SpawnTries] = {}

    def __len__(self) -> int:
        """How many are still to come."""
        return len(self._waiting)

    @property
    def most_tries(self) -> int:
        """How often the one who was refused most often was tried."""
        return max((tries.count for tries in self._tries.values()), default=0)

    def refusals(self) -> dict[str, str]:
        """Why the server refused a road user, by id; of those that were not spawned."""
        return {
            actor.id: self._tries[actor.row].reason
            for actor in self._waiting
            if actor.row in self._tries
        }

    def spawn_due(self, time: float) -> Iterator[tuple[NativeActor, int]]:
        """Spawn who is due at ``time``, seconds; yields each with the number of its actor."""
        due = [
            actor for actor in self._waiting if actor.depart <= time and self._may_try(actor, time)
        ]
        for _ in LIFTS:  # all in this tick: a body on the ground is refused, and one above it taken
            commands = [self._spawn_command(actor) for actor in due]
            answers = self._server.spawn(commands) if commands else []
            refused = []
            for actor, answer in zip(due, answers, strict=True):
                if isinstance(answer, int):
                    self._waiting.remove(actor)
                    yield actor, answer
                else:
                    self._note_refusal(actor, answer, time)
                    refused.append(actor)
            due = refused

    def _may_try(self, actor: NativeActor, time: float) -> bool:
        tries = self._tries.get(actor.row)
        return tries is None or tries.next <= time

    def _note_refusal(self, actor: NativeActor, reason: str, time: float) -> None:
        tries = self._tries.setdefault(actor.row, _SpawnTries())
        tries.next, tries.reason = time + RETRY_SECONDS, reason
        tries.count += 1

    def _spawn_command(self, actor: NativeActor) -> Any:
        """At the exact place; only the height gives way, and physics lets a vehicle settle."""
        tries = self._tries.get(actor.row)
        lift = LIFTS[tries.count % len(LIFTS)] if tries else LIFTS[0]
        if actor.person:
            lift += actor.height / 2.0
        at = xodr_to_carla(actor.at)
        return self._server.spawn_command(
            self._blueprints[actor.row],
            "hero" if actor.ego else ROLE + actor.id,
            (float(at.x), float(at.y), float(at.z) + lift),
            pitch=float(at.pitch_deg),
            yaw=float(at.yaw_deg),
        )
