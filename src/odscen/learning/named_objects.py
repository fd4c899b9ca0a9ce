"""Code from outside by its name: an entry point, ``package.module:Name`` or ``FILE.py:Name``."""

from __future__ import annotations

import importlib
import importlib.util
from importlib.metadata import entry_points
from pathlib import Path
from typing import Any

from odscen.base.errors import InputError


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
        known = sorted(one.name for one in entry_points(group=group))
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
