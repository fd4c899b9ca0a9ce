"""Options of commands that let something else drive than SUMO."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from odscen.base.errors import InputError
from odscen.learning.behaviour.behaviour_model import BehaviourDoor

BehaviourOption = Annotated[
    str | None,
    typer.Option(
        help="What drives vehicles instead of SUMO: idm, imitation, an entry point, "
        "package.module:Class or FILE.py:Class.",
        metavar="NAME",
    ),
]
BehaviourSettingOption = Annotated[
    list[str] | None,
    typer.Option(
        "--behaviour-set", help="A setting of it: headway=0.8; repeatable.", metavar="NAME=VALUE"
    ),
]
BehaviourCommandOption = Annotated[
    str | None,
    typer.Option("--behaviour-cmd", help="A program that drives, over a pipe.", metavar="COMMAND"),
]
BehaviourTimeoutOption = Annotated[
    float,
    typer.Option(
        "--behaviour-timeout", min=0.001, help="Wall seconds that it may take for one step."
    ),
]


def behaviour_door(
    name: str | None, given: list[str] | None, command: str | None, time_limit: float
) -> BehaviourDoor | None:
    """Where the model comes from; ``None`` if SUMO drives.

    Raises
    ------
    InputError
        If a setting has no name, or belongs to nothing.
    """
    if name is None and command is None:
        if given:
            msg = "--behaviour-set needs --behaviour"
            raise InputError(msg)
        return None
    options: dict[str, float | str] = {}
    for text in given or ():
        key, sign, value = text.partition("=")
        if not sign or not key.isidentifier():
            msg = f"{text!r} sets nothing; write for example headway=0.8"
            raise InputError(msg, element="--behaviour-set")
        try:
            options[key] = float(value)
        except ValueError:
            options[key] = value
    if name is not None and name.partition(":")[0].endswith(".py"):
        file, _, attribute = name.rpartition(":")
        name = f"{Path(file).resolve()}:{attribute}"  # runs may go on in another folder
    return BehaviourDoor(name=name, command=command, time_limit=time_limit, options=options)
