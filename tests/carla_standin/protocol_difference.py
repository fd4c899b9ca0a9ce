"""Where a call differs from the one that was recorded, in words."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

COMMANDS = (
    "SpawnActor", "DestroyActor", "ApplyVehicleControl", "ApplyVehicleAckermannControl",
    "ApplyWalkerControl", "ApplyVehiclePhysicsControl", "ApplyTransform", "ApplyWalkerState",
    "ApplyTargetVelocity", "ApplyTargetAngularVelocity", "ApplyImpulse", "ApplyForce",
    "ApplyAngularImpulse", "ApplyTorque", "SetSimulatePhysics", "SetEnableGravity",
    "SetAutopilot", "ShowDebugTelemetry", "SetVehicleLightState", "ApplyLocation",
    "ConsoleCommand", "SetTrafficLightState",
)  # fmt: skip
"""Of a batch, by index, in 0.9.16."""
_OWN_ADDRESS = ("query_lights_state", "update_lights_state", "update_day_night_cycle")
"""Calls that begin with the client's idea of where the server is."""
_ATTACHMENT = 3
"""Field of SpawnActor that is uninitialised memory in the wheel."""


def call_differences(
    name: str, recorded: list[Any], now: list[Any], *, tolerance: float
) -> Iterator[str]:
    """Differences of two calls' parameters, the first being the metadata.

    Parameters
    ----------
    tolerance
        By how much numbers may differ.
    """
    if name != "apply_batch":
        yield from _differences(_plain(name, recorded), _plain(name, now), "", tolerance)
        return
    before, after = recorded[1], now[1]
    if len(before) != len(after):
        yield f": {len(before)} commands recorded, {len(after)} now"
    for k, ((one,), (other,)) in enumerate(zip(before, after, strict=False)):
        if one[0] != other[0]:
            yield f" command {k}: {COMMANDS[one[0]]} recorded, {COMMANDS[other[0]]} now"
        else:
            where = f" command {k}, {COMMANDS[one[0]]}"
            yield from _differences(_unmasked(one), _unmasked(other), where, tolerance)


def _plain(name: str, params: list[Any]) -> list[Any]:
    if name in _OWN_ADDRESS:
        return [params[0], *params[2:]]
    if name == "get_actors_by_id":
        return [params[0], sorted(params[1])]
    return params


def _unmasked(command: list[Any]) -> list[Any]:
    index, fields = command
    if COMMANDS[index] != "SpawnActor":
        return command
    return [index, [*fields[:_ATTACHMENT], 0, *fields[_ATTACHMENT + 1 :]]]


def _differences(recorded: Any, now: Any, where: str, tolerance: float) -> Iterator[str]:
    if isinstance(recorded, list) and isinstance(now, list) and len(recorded) == len(now):
        for k, (one, other) in enumerate(zip(recorded, now, strict=True)):
            yield from _differences(one, other, f"{where}[{k}]", tolerance)
    elif _is_number(recorded) and _is_number(now):
        if abs(recorded - now) > tolerance:
            yield f"{where}: {recorded:g} recorded, {now:g} now"
    elif recorded != now:
        yield f"{where}: {recorded!r} recorded, {now!r} now"


def _is_number(value: Any) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool)
