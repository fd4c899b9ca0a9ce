"""Figures of a finished run that are functions from outside: named in a file, or installed.

A package offers such figures by entry points::

    [project.entry-points."odscen.figures"]
    queue = "my_figures:queue"

Their names are then used as those of odscen's own figures are: in columns of sweeps, on the command
line and in the page.
"""

from __future__ import annotations

import inspect
from importlib.metadata import entry_points
from typing import TYPE_CHECKING, NamedTuple

from odscen.base.errors import InputError
from odscen.figures.measures.registry import names_of

if TYPE_CHECKING:
    from collections.abc import Callable

    from odscen.runs.finished_run import Run

GROUP = "odscen.figures"


class InstalledFigure(NamedTuple):
    """A figure of an installed package; ``error`` says why it cannot be used, or is empty."""

    name: str
    definition: str
    error: str = ""


def installed_figures() -> tuple[InstalledFigure, ...]:
    """Figures of installed packages by name, with the first line of what each says of itself."""
    names = {entry_point.name for entry_point in entry_points(group=GROUP)} - {*names_of("run")}
    figures = []
    for name in sorted(names):
        try:
            documentation = inspect.getdoc(_import_function(name)) or ""
            figures.append(InstalledFigure(name, documentation.partition("\n")[0]))
        except InputError as error:
            figures.append(InstalledFigure(name, "", error.problem))
    return tuple(figures)


def is_installed(name: str) -> bool:
    """Whether a package offers a figure of this name."""
    return bool(entry_points(group=GROUP, name=name))


def installed_value(name: str, run: Run) -> float | None:
    """Compute an installed figure of a run.

    Raises
    ------
    InputError
        If it cannot be imported, raises, or returns anything but a number or ``None``.
    """
    return value_of(_import_function(name), run, source=name, element="figures")


def value_of(
    function: Callable[[Run], object], run: Run, *, source: str, element: str
) -> float | None:
    """Call a function from outside with a finished run.

    Raises
    ------
    InputError
        If it raises, or returns anything but a number or ``None``; names ``source``.
    """
    try:
        value = function(run)
    except Exception as error:  # whatever the user's own code raises
        raise InputError(f"{source}: {type(error).__name__}: {error}", element=element) from error
    if value is not None and (isinstance(value, bool) or not isinstance(value, int | float)):
        raise InputError(f"{source} returned {value!r}, not a number or None", element=element)
    return None if value is None else float(value)


def _import_function(name: str) -> Callable[[Run], object]:
    (point, *_) = entry_points(group=GROUP, name=name)
    try:
        found = point.load()
    except Exception as error:  # whatever an import may raise
        raise InputError(
            f"it cannot be imported from {point.value}: {error!r}", element=name
        ) from error
    if not callable(found):
        raise InputError(f"{point.value} is no function of a finished run", element=name)
    return found  # type: ignore[no-any-return]
