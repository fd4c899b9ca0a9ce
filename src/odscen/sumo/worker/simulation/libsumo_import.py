"""The import of libsumo: without what it prints, and without what it brings along unused."""

from __future__ import annotations

import os
import sys
from typing import Any

from odscen.base.late_modules import function_when_used


def import_libsumo() -> Any:
    """Import libsumo with stdout kept clean.

    With pyarrow importable libsumo prints a warning about Arrow to stdout when imported, which
    would break output that a program reads; it goes to stderr instead.
    """
    sys.stdout.flush()
    kept = os.dup(1)
    # It imports traci, and that sumolib for two names, and that NumPy and much else.
    unused = "sumolib" not in sys.modules
    if unused:
        for module, name in _OF_SUMOLIB:
            function_when_used(module, name)
    try:
        os.dup2(2, 1)
        import libsumo

        sys.stdout.flush()
    finally:
        os.dup2(kept, 1)
        os.close(kept)
        if unused:
            for module, _ in _OF_SUMOLIB:
                del sys.modules[module]
    return libsumo


_OF_SUMOLIB = (("sumolib.net", "Phase"), ("sumolib.miscutils", "getFreeSocketPort"))
"""What traci takes, and calls where SUMO is another process only."""
