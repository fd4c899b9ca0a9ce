"""What a process imports before it forks others for simulations."""

from __future__ import annotations

import ctypes
from contextlib import suppress
from pathlib import Path

from odscen.runs.layout import BEHAVIOUR_FILE, STORY_FILE, SUMO_FOLDER

_XERCES = "libxerces-c-3"
_INITIALIZE = (
    "_ZN11xercesc_3_216XMLPlatformUtils10InitializeEPKcS2_PNS_12PanicHandlerEPNS_13MemoryManagerE"
)
"""``xercesc::XMLPlatformUtils::Initialize(locale, home, handler, memory)``."""


def import_all() -> None:
    """Import all that a simulation needs, without anything of SUMO having run."""
    # Not polars, nor numpy: what is here each fork has to be given, and tables are made elsewhere.
    import lxml.etree

    from odscen.sumo.outputs import output_tables
    from odscen.sumo.worker.simulation import libsumo_import

    del lxml, output_tables
    libsumo_import.import_libsumo()
    _ready_xerces()


def import_for(folder: Path, *, watched: bool = False) -> None:
    """Import what the run in ``folder`` needs and others do not, if there is anything."""
    if watched:
        import odscen.sumo.worker.snapshots
    if (folder / SUMO_FOLDER / STORY_FILE).is_file():
        import odscen.sumo.worker.story.story_run
    if (folder / SUMO_FOLDER / BEHAVIOUR_FILE).is_file():
        import odscen.sumo.worker.behaviour.behaviour_run  # noqa: F401


def _ready_xerces() -> bool:
    """Have the XML reader that SUMO uses make its tables of characters, which are always the same.

    Each fork would make them, which takes a tenth of a short simulation. It is SUMO's own first
    call, and counted there: to make it again is nothing. Where its library is another one, or built
    in, nothing is done, and the answer is false.
    """
    with suppress(OSError, AttributeError):
        maps = Path("/proc/self/maps").read_text(encoding="utf-8", errors="replace")
        paths = {line.split(maxsplit=5)[-1] for line in maps.splitlines() if _XERCES in line}
        for path in paths:
            initialize = getattr(ctypes.CDLL(path), _INITIALIZE)
            initialize.argtypes, initialize.restype = [ctypes.c_char_p] * 4, None
            initialize(b"en_US", None, None, None)  # what it is called with by default
        return bool(paths)
    return False
