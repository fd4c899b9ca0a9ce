"""Generators and behaviour models by name: those that ship, installed ones, and code from outside.

Only these are for people who choose from a list; a module or a program is named where one's own
code is run, on the command line.
"""

from __future__ import annotations

import importlib.util
import inspect
from importlib.metadata import entry_points
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from odscen.base.errors import InputError
from odscen.learning.offered_options import OfferedOption, options_of

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable


def named_object(name: str, *, group: str, what: str, shipped: str) -> Any:
    """Load what a name stands for.

    Parameters
    ----------
    group
        Of entry points.
    what
        How messages call it: ``generator``.
    shipped
        Names that odscen itself has, for messages.

    Raises
    ------
    InputError
        If there is none, or it cannot be imported.
    """
    module, colon, attribute = name.rpartition(":")
    if not colon:
        return _entry_point(name, group=group, what=what, shipped=shipped)
    try:
        if module.endswith(".py"):
            return getattr(_of_file(Path(module)), attribute)
        return getattr(importlib.import_module(module), attribute)
    except Exception as error:  # whatever an import may raise
        raise InputError(f"it cannot be imported: {error!r}", element=name) from error


def _entry_point(name: str, *, group: str, what: str, shipped: str) -> Any:
    points = [*entry_points(group=group, name=name)]
    if not points:
        known = sorted(entry_point.name for entry_point in entry_points(group=group))
        offered = (
            f"installed packages offer {', '.join(known)}"
            if known
            else "no installed package offers one"
        )
        raise InputError(
            f"there is no {what} {name!r}; {shipped} with odscen, {offered}, and "
            "package.module:Class is one",
            element=what,
        )
    try:
        return points[0].load()
    except Exception as error:  # whatever an import may raise
        raise InputError(
            f"it cannot be imported from {points[0].value}: {error!r}", element=name
        ) from error


def _of_file(file: Path) -> Any:
    spec = importlib.util.spec_from_file_location(f"odscen_given_{file.stem}", file)
    if spec is None or spec.loader is None or not file.is_file():
        raise ImportError(f"{file} is no Python file")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


class OfferedModel(NamedTuple):
    """One that is installed; ``error`` says why it cannot be used, or is empty."""

    name: str
    summary: str
    options: tuple[OfferedOption, ...] = ()
    error: str = ""


def installed_names(group: str, shipped: Iterable[str]) -> list[str]:
    """Names of those that ship, and of entry points of a group after them."""
    first = [*shipped]
    return [
        *first,
        *sorted({entry_point.name for entry_point in entry_points(group=group)} - {*first}),
    ]


def offered_models(names: Iterable[str], find: Callable[[str], Any]) -> tuple[OfferedModel, ...]:
    """What those of some names say of themselves; ``find`` returns the class of a name."""
    return tuple(_describe_model(name, find) for name in names)


def _describe_model(name: str, find: Callable[[str], Any]) -> OfferedModel:
    try:
        found = find(name)
        summary = (inspect.getdoc(found) or "").partition("\n")[0]
        return OfferedModel(name, summary, options_of(found))
    except InputError as error:
        return OfferedModel(name, "", error=error.problem)
