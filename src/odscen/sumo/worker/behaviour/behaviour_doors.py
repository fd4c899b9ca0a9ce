"""Doors of behaviour models: one that ships, a class by name, another program.

An installed package offers one in its ``pyproject.toml``::

    [project.entry-points."odscen.behaviour"]
    mine = "my_package.drivers:MyDriver"

The page chooses among these and those that ship; it cannot name a module or a program.
"""

from __future__ import annotations

import json
import shlex
import shutil
from typing import TYPE_CHECKING, Any

from odscen.base.errors import InputError, NotFoundError
from odscen.learning.behaviour.behaviour_model import BehaviourDoor
from odscen.learning.offered_models import installed_names, named_object, offered_models
from odscen.learning.offered_options import values_for
from odscen.runs.layout import BEHAVIOUR_FILE
from odscen.sumo.worker.behaviour.piped_driver import PipedDriver, SocketDriver

if TYPE_CHECKING:
    from collections.abc import Mapping

    from odscen.learning.behaviour.behaviour_model import BehaviourModel
    from odscen.learning.offered_models import OfferedModel
    from odscen.learning.offered_options import OptionValue

GROUP = "odscen.behaviour"
"""Of entry points."""
IDM, IMITATION = "idm", "imitation"
"""Names of the models that ship."""
_SHIPPED = IDM, IMITATION


def open_behaviour(door: BehaviourDoor, seed: int) -> BehaviourModel:
    """Find and make a model.

    Parameters
    ----------
    seed
        For another program.

    Raises
    ------
    InputError
        If there is none, it cannot be imported or made, or an option is not possible.
    """
    given = [name for name in (door.name, door.command, door.socket) if name is not None]
    if len(given) != 1:
        raise InputError("a behaviour model is given by its name or as a command, not both")
    if door.socket is not None:
        return SocketDriver(door.socket, seed, door.time_limit)
    if door.command is not None:
        if door.options:
            raise InputError("a command takes its options in its own line", element="behaviour")
        return PipedDriver(_split_command(door.command), seed, door.time_limit)
    name = door.name or ""
    found = _find_behaviour(name)
    options = values_for(found, door.options, name=name, others=True)
    try:
        made = found(**options) if isinstance(found, type) else found
    except Exception as error:  # whatever code from outside may raise
        raise InputError(f"it cannot be made: {error!r}", element=name) from error
    for method in ("init(rng, scene)", "act(observation, state)"):
        if not callable(getattr(made, method.partition("(")[0], None)):
            raise InputError(f"it has no method `{method}`", element=name)
    model: BehaviourModel = made
    return model


def read_behaviour(text: str) -> BehaviourDoor:
    """Where the model of a run comes from, as its folder says.

    Raises
    ------
    InputError
        If that cannot be read.
    """
    try:
        return BehaviourDoor(**json.loads(text))
    except (TypeError, ValueError) as error:
        raise InputError(f"it names no behaviour model: {error}", file=BEHAVIOUR_FILE) from error


def is_installed(door: BehaviourDoor) -> bool:
    """Whether a model ships or belongs to an installed package, and is no code of a folder."""
    other = door.command is not None or door.socket is not None
    return not other and door.name in installed_names(GROUP, _SHIPPED)


def installed_behaviours() -> tuple[OfferedModel, ...]:
    """Models that ship and those of installed packages, by name, with their options."""
    return offered_models(installed_names(GROUP, _SHIPPED), _find_behaviour)


def chosen_behaviour(name: str, options: Mapping[str, OptionValue]) -> BehaviourDoor:
    """The door of one of :func:`installed_behaviours`, with none but the options that it offers.

    Raises
    ------
    NotFoundError
        If there is no such model; a module or a file is none.
    InputError
        If it cannot be imported, or an option is not possible.
    """
    known = installed_names(GROUP, _SHIPPED)
    if name not in known:
        raise NotFoundError("behaviour model", name, known)
    values = values_for(_find_behaviour(name), options, name=name)
    return BehaviourDoor(name=name, options={option: values[option] for option in options})


def _split_command(command: str) -> tuple[str, ...]:
    try:
        words = tuple(shlex.split(command))
    except ValueError as error:
        raise InputError(f"{command!r} is no command: {error}", element="behaviour") from error
    if not words or shutil.which(words[0]) is None:
        raise InputError("there is no such program", element=words[0] if words else "behaviour")
    return words


def _find_behaviour(name: str) -> Any:
    if name == IDM:
        from odscen.learning.behaviour.intelligent_driver import IntelligentDriver

        return IntelligentDriver
    if name == IMITATION:
        from odscen.learning.behaviour.imitation_driver import ImitationDriver

        return ImitationDriver
    shipped = f"{IDM!r} and {IMITATION!r} ship"
    return named_object(name, group=GROUP, what="behaviour", shipped=shipped)
