"""Doors of behaviour models: one that ships, a class by name, another program.

An installed package offers one in its ``pyproject.toml``::

    [project.entry-points."odscen.behaviour"]
    mine = "my_package.drivers:MyDriver"
"""

from __future__ import annotations

import shlex
import shutil
from typing import TYPE_CHECKING, Any

from odscen.base.errors import InputError
from odscen.learning.named_objects import named_object
from odscen.sumo.worker.behaviour.piped_driver import PipedDriver, SocketDriver

if TYPE_CHECKING:
    from odscen.learning.behaviour.behaviour_model import BehaviourDoor, BehaviourModel

GROUP = "odscen.behaviour"
"""Of entry points."""
IDM, IMITATION = "idm", "imitation"
"""Names of the models that ship."""


def open_behaviour(door: BehaviourDoor, seed: int) -> BehaviourModel:
    """Find and make a model.

    Parameters
    ----------
    seed
        For another program.

    Raises
    ------
    InputError
        If there is none, or it cannot be imported or made.
    """
    given = [one for one in (door.name, door.command, door.socket) if one is not None]
    if len(given) != 1:
        msg = "a behaviour model is given by its name or as a command, not both"
        raise InputError(msg)
    if door.socket is not None:
        return SocketDriver(door.socket, seed, door.time_limit)
    if door.command is not None:
        if door.options:
            msg = "a command takes its options in its own line"
            raise InputError(msg, element="behaviour")
        return PipedDriver(_words(door.command), seed, door.time_limit)
    name = door.name or ""
    found = _found(name)
    try:
        made = found(**door.options) if isinstance(found, type) else found
    except Exception as error:  # whatever code from outside may raise
        msg = f"it cannot be made: {error!r}"
        raise InputError(msg, element=name) from error
    for method in ("init(rng, scene)", "act(observation, state)"):
        if not callable(getattr(made, method.partition("(")[0], None)):
            msg = f"it has no method `{method}`"
            raise InputError(msg, element=name)
    model: BehaviourModel = made
    return model


def _words(command: str) -> tuple[str, ...]:
    try:
        words = tuple(shlex.split(command))
    except ValueError as error:
        msg = f"{command!r} is no command: {error}"
        raise InputError(msg, element="behaviour") from error
    if not words or shutil.which(words[0]) is None:
        msg = "there is no such program"
        raise InputError(msg, element=words[0] if words else "behaviour")
    return words


def _found(name: str) -> Any:
    if name == IDM:
        from odscen.learning.behaviour.intelligent_driver import IntelligentDriver

        return IntelligentDriver
    if name == IMITATION:
        from odscen.learning.behaviour.imitation_driver import ImitationDriver

        return ImitationDriver
    shipped = f"{IDM!r} and {IMITATION!r} ship"
    return named_object(name, group=GROUP, what="behaviour", shipped=shipped)
