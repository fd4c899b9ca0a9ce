"""Modules that are imported when they are first used, not when another library names them."""

from __future__ import annotations

import importlib
import importlib.util
import sys
from types import ModuleType
from typing import Any


def import_when_used(*names: str) -> None:
    """Put modules of packages where importers find them, to be loaded when they are first used.

    SciPy names all of NumPy, among it what builds Fortran and what tests arrays: a fifth of what
    SciPy takes to be imported. One that is there already, or is not installed, is left alone.
    """
    for name in names:
        package, _, own = name.rpartition(".")
        spec = None if name in sys.modules else importlib.util.find_spec(name)
        if spec is None or spec.loader is None:
            continue
        spec.loader = importlib.util.LazyLoader(spec.loader)
        module = importlib.util.module_from_spec(spec)
        sys.modules[name] = module
        spec.loader.exec_module(module)
        setattr(sys.modules[package], own, module)


def function_when_used(module: str, name: str) -> None:
    """Put a module where importers find it that has one function, which imports it when called.

    For a module of which a package takes that function and nothing else: SciPy's Laplacian needs
    all of its linear algebra, as much to import as all that its shortest paths need.
    """
    if module in sys.modules:
        return
    stand_in = ModuleType(module)

    def call(*values: Any, **named: Any) -> Any:
        if sys.modules.get(module) is stand_in:
            del sys.modules[module]
        return getattr(importlib.import_module(module), name)(*values, **named)

    setattr(stand_in, name, call)
    sys.modules[module] = stand_in


def names_when_used(*names: str) -> None:
    """Put modules where importers find them, to be loaded when a name of theirs is asked for.

    As :func:`import_when_used`, for modules of a package that is not there yet: it need not be
    imported to find them.
    """
    for name in names:
        if name not in sys.modules:
            sys.modules[name] = _stand_in(name)


def _stand_in(module: str) -> ModuleType:
    stand_in = ModuleType(module)

    def asked(name: str) -> Any:
        if sys.modules.get(module) is stand_in:
            del sys.modules[module]
        return getattr(importlib.import_module(module), name)

    setattr(stand_in, "__getattr__", asked)  # noqa: B010 - a module has none of its own
    return stand_in
