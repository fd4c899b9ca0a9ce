"""What is asked for in a tick, as commands of the client's."""

from __future__ import annotations

import zlib
from typing import TYPE_CHECKING, Any

from odscen.carla.server.batch import ActorPlace

if TYPE_CHECKING:
    from odscen.carla.server.batch import Batch, Velocity


class BatchCommands:
    """Makes commands.

    Parameters
    ----------
    carla
        The package.
    library
        Blueprints of the world that is loaded.

    Attributes
    ----------
    pushed
        Seconds of a tick, if vehicles are to drive the last of their way by themselves.
    """

    def __init__(self, carla: Any, library: Any) -> None:
        self._carla, self._library = carla, library
        self.pushed: float | None = None

    def commands(self, batch: Batch) -> list[Any]:
        """All of a batch: destroy, spawn, move, then lights of vehicles, then cameras."""
        command, carla = self._carla.command, self._carla
        walker, flags = command.ApplyWalkerState, carla.VehicleLightState
        commands = [command.DestroyActor(actor) for actor in batch.destroy]
        for spawn in batch.spawn:
            x, y, z, pitch, yaw = spawn.at
            made = self.spawn(
                spawn.blueprint, spawn.role_name, (x, y, z + spawn.lift), pitch=pitch, yaw=yaw
            )
            future = command.FutureActor
            if spawn.walks:
                made = made.then(command.SetSimulatePhysics(future, False))
                made = made.then(walker(future, self._carla_transform(spawn.at), spawn.speed))
            else:
                if self.pushed is None:
                    made = made.then(command.SetSimulatePhysics(future, False))
                else:
                    made = made.then(command.SetEnableGravity(future, False))
                for put_command in self._put_commands(future, spawn.at, spawn.velocity):
                    made = made.then(put_command)
                made = made.then(command.SetVehicleLightState(future, flags(spawn.flags)))
            commands.append(made)
        for move in batch.move:
            if move.walks:
                commands.append(walker(move.actor, self._carla_transform(move.at), move.speed))
            else:
                commands += self._put_commands(move.actor, move.at, move.velocity)
        commands += [
            command.SetVehicleLightState(shine.actor, flags(shine.flags)) for shine in batch.shine
        ]
        commands += [
            command.ApplyTransform(actor, self._carla_transform(at))
            for actor, at in batch.views.items()
        ]
        return commands

    def _put_commands(self, actor: Any, at: ActorPlace, velocity: Velocity) -> list[Any]:
        """Commands after which a vehicle is at a place when the next tick has been made."""
        command = self._carla.command
        if self.pushed is None:
            return [command.ApplyTransform(actor, self._carla_transform(at))]
        x, y, z = (a - v * self.pushed for a, v in zip(at[:3], velocity, strict=True))
        return [
            command.ApplyTransform(
                actor, self._carla_transform(ActorPlace(x, y, z, at.pitch, at.yaw))
            ),
            command.ApplyTargetVelocity(actor, self._carla.Vector3D(*velocity)),
        ]

    def _carla_transform(self, at: ActorPlace) -> Any:
        x, y, z, pitch, yaw = at
        carla = self._carla
        return carla.Transform(carla.Location(x, y, z), carla.Rotation(pitch, yaw, 0.0))

    def spawn(
        self,
        name: str,
        role_name: str,
        at: tuple[float, float, float],
        *,
        pitch: float = 0.0,
        yaw: float = 0.0,
    ) -> Any:
        """Command that makes an actor of a blueprint; metres and degrees, CARLA's frame."""
        carla = self._carla
        blueprint = self._library.find(name)
        if blueprint.has_attribute("role_name"):
            blueprint.set_attribute("role_name", role_name)
        if blueprint.has_attribute("is_invincible"):
            blueprint.set_attribute("is_invincible", "true")
        if blueprint.has_attribute("color"):
            colours = blueprint.get_attribute("color").recommended_values
            if colours:  # the same one in every run
                blueprint.set_attribute(
                    "color", colours[zlib.crc32(role_name.encode()) % len(colours)]
                )
        place = carla.Transform(carla.Location(*at), carla.Rotation(pitch, yaw, 0.0))
        return carla.command.SpawnActor(blueprint, place)
