"""A function of a user's that is called after every tick, with the world and who is shown."""

from __future__ import annotations

import sys
from collections.abc import Iterator, Mapping
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

from odscen.base.errors import CarlaError, InputError

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence


class ShownActors(Mapping[str, Any]):
    """Actors of the client's by the id of the road user; each is fetched when it is asked for.

    Parameters
    ----------
    ids
        Of the plan's road users.
    actors
        Actor by row of the plan, of those who are shown now.
    """

    def __init__(self, world: Any, ids: Sequence[str], actors: Mapping[int, int]) -> None:
        self._world = world
        self._ids = tuple(ids)
        self._rows = {name: row for row, name in enumerate(ids)}
        self._actors = actors

    def __getitem__(self, name: str) -> Any:
        """Actor of a road user that is shown."""
        return self._world.get_actor(self._actors[self._rows[name]])

    def __iter__(self) -> Iterator[str]:
        """Ids of the road users that are shown."""
        return (self._ids[row] for row in tuple(self._actors))

    def __len__(self) -> int:
        """How many are shown."""
        return len(self._actors)


def load_hook(words: str) -> Callable[[Any, Mapping[str, Any]], object]:
    """Import ``package.module:function``; the working folder is looked into as well.

    Raises
    ------
    InputError
        If there is no such function.
    """
    module, colon, name = words.partition(":")
    if not (module and colon and name):
        raise InputError(f"the hook {words!r} is not package.module:function")
    folder = str(Path.cwd())
    sys.path.insert(0, folder)
    try:
        found = getattr(import_module(module), name)
    except (ImportError, AttributeError) as error:
        raise InputError(f"the hook {words} cannot be imported: {error}") from error
    finally:
        sys.path.remove(folder)
    if not callable(found):
        raise InputError(f"the hook {words} is no function")
    hook: Callable[[Any, Mapping[str, Any]], object] = found
    return hook


def call_hook(
    hook: Callable[[Any, Mapping[str, Any]], object], world: Any, shown: ShownActors
) -> None:
    """Call a hook.

    Raises
    ------
    CarlaError
        If it raises anything.
    """
    try:
        hook(world, shown)
    except Exception as error:
        raise CarlaError(
            f"the hook {getattr(hook, '__qualname__', hook)} failed: {error!r}"
        ) from error
