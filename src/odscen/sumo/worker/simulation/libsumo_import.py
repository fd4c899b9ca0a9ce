"""The import of libsumo: without what it prints, and without what it brings along unused."""

from __future__ import annotations

import importlib
import os
import sys
from types import ModuleType
from typing import Any


def import_libsumo() -> Any:
    """Import libsumo with stdout kept clean.

    With pyarrow importable libsumo prints a warning about Arrow to stdout when imported, which
    would break output that a program reads; it goes to stderr instead.

    It imports traci, and that takes two names of sumolib, which imports NumPy: a process that
    forks others must not have NumPy's threads. They are stood in for while libsumo is imported, in
    processes that are odscen's own and have one thread.
    """
    sys.stdout.flush()
    kept = os.dup(1)
    stand_ins = [] if "sumolib" in sys.modules else [_stand_in(*each) for each in _OF_SUMOLIB]
    for module in stand_ins:
        sys.modules[module.__name__] = module
    try:
        os.dup2(2, 1)
        import libsumo

        sys.stdout.flush()
    finally:
        os.dup2(kept, 1)
        os.close(kept)
        for module in stand_ins:
            del sys.modules[module.__name__]
    return libsumo


_OF_SUMOLIB = (("sumolib.net", "Phase"), ("sumolib.miscutils", "getFreeSocketPort"))
"""What traci takes, and calls where SUMO is another process only."""


def _stand_in(module: str, name: str) -> ModuleType:
    """Module with that one function, which calls the one of the real module."""
    stand_in = ModuleType(module)

    def call(*values: Any, **named: Any) -> Any:
        return getattr(importlib.import_module(module), name)(*values, **named)

    setattr(stand_in, name, call)
    return stand_in
