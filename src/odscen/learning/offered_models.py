"""Generators and behaviour models that can be chosen by name: those that ship, and installed ones.

Only these are for people who choose from a list; a module or a program is named where one's own
code is run, on the command line.
"""

from __future__ import annotations

import inspect
from importlib.metadata import entry_points
from typing import TYPE_CHECKING, Any, NamedTuple

from odscen.base.errors import InputError
from odscen.learning.offered_options import OfferedOption, options_of

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable


class OfferedModel(NamedTuple):
    """One that is installed; ``error`` says why it cannot be used, or is empty."""

    name: str
    summary: str
    options: tuple[OfferedOption, ...] = ()
    error: str = ""


def installed_names(group: str, shipped: Iterable[str]) -> list[str]:
    """Names of those that ship, and of entry points of a group after them."""
    first = [*shipped]
    return [*first, *sorted({one.name for one in entry_points(group=group)} - {*first})]


def offered_models(names: Iterable[str], find: Callable[[str], Any]) -> tuple[OfferedModel, ...]:
    """What those of some names say of themselves; ``find`` returns the class of a name."""
    return tuple(_offered(name, find) for name in names)


def _offered(name: str, find: Callable[[str], Any]) -> OfferedModel:
    try:
        found = find(name)
        summary = (inspect.getdoc(found) or "").partition("\n")[0]
        return OfferedModel(name, summary, options_of(found))
    except InputError as error:
        return OfferedModel(name, "", error=error.problem)
