"""Batches: the commands by index."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from tests.carla_standin import wire
from tests.carla_standin.actor_calls import ActorCalls
from tests.carla_standin.light_calls import LightCalls
from tests.carla_standin.rpc import Returns, rpc
from tests.carla_standin.world_calls import WorldCalls

_SPAWN, _CONSOLE = 0, 20
_PLACING = {2, 6, 7}
"""Commands that drive an actor or put it somewhere."""


class BatchCalls:
    """``apply_batch``: a batch goes on after a command that is refused.

    Attributes
    ----------
    last
        For each actor the last command that drove it or put it somewhere: index and arguments.
    """

    def __init__(self, actors: ActorCalls, lights: LightCalls, world: WorldCalls) -> None:
        self._actors = actors
        self._world = world
        self.last: dict[int, list[Any]] = {}
        self._commands: dict[int, Callable[..., Any]] = {
            1: actors.destroy,
            2: actors.drive,
            3: actors.note_vehicle,
            4: actors.walk,
            5: actors.set_physics_control,
            6: actors.set_transform,
            7: actors.set_walker_state,
            8: actors.set_velocity,
            9: actors.set_angular_velocity,
            10: actors.push,
            11: actors.pull,
            12: actors.take_note,
            13: actors.take_note,
            14: actors.simulate_physics,
            15: actors.set_gravity,
            16: actors.autopilot,
            17: actors.note_vehicle,
            18: actors.set_light_flags,
            19: actors.set_location,
            21: lights.set_state,
        }

    @rpc("apply_batch", Returns.PLAIN)
    async def apply(self, commands: list[Any], do_tick: bool) -> list[Any]:
        answers = [self._answer(*command) for command in commands]
        if do_tick:
            await self._world.tick()
        return answers

    def _answer(self, command: list[Any]) -> list[Any]:
        """Response with the id of the command's actor."""
        index, arguments = command
        try:
            if index == _SPAWN:
                return wire.value(self._spawn(*arguments))
            if index == _CONSOLE:
                return wire.value_error("the console is not served")
            self._commands[index](*arguments)
            if index in _PLACING:
                self.last[arguments[0]] = command
        except wire.RefusedError as error:
            return wire.value_error(str(error))
        return wire.value(arguments[0])

    def _spawn(
        self,
        description: list[Any],
        at: list[Any],
        parent: list[Any],
        *more: Any,
    ) -> int:
        do_after = more[-1]  # since 0.9.16 behind the kind of attachment and a socket
        if parent[0]:
            actor = self._actors.spawn_with_parent(description, at, parent[1])
        else:
            actor = self._actors.spawn(description, at)
        for ((index, arguments),) in do_after:
            # Whatever actor the client names: the new one is meant. Refusals are not reported.
            self._answer([index, [actor[0], *arguments[1:]]])
        return int(actor[0])
