"""What a process imports before it forks others for simulations."""

from __future__ import annotations

from typing import TYPE_CHECKING

from odscen.runs.layout import BEHAVIOUR_FILE, STORY_FILE, SUMO_FOLDER

if TYPE_CHECKING:
    from pathlib import Path


def import_all() -> None:
    """Import all that a simulation needs, without anything of SUMO having run."""
    # Not polars, nor numpy: what is here each fork has to be given, and tables are made elsewhere.
    import lxml.etree

    from odscen.sumo.outputs import output_tables
    from odscen.sumo.worker.simulation import libsumo_import

    del lxml, output_tables
    libsumo_import.import_libsumo()


def import_for(folder: Path, *, watched: bool = False) -> None:
    """Import what the run in ``folder`` needs and others do not, if there is anything."""
    if watched:
        import odscen.sumo.worker.snapshots
    if (folder / SUMO_FOLDER / STORY_FILE).is_file():
        import odscen.sumo.worker.story.story_run
    if (folder / SUMO_FOLDER / BEHAVIOUR_FILE).is_file():
        import odscen.sumo.worker.behaviour.opened_model  # noqa: F401
