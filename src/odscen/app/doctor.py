"""What is damaged in a workspace: found, rebuilt where that can be, and else set aside.

Maps are built anew from their .xodr, figures and reports of runs from their records, and networks
of runs are those of their map. Where it is known how a file was, only the same bytes count as
rebuilt.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from odscen.app.map_repairs import see_to_assets, see_to_folder, see_to_map
from odscen.app.running.run_repairs import see_to_run
from odscen.base.system_errors import disk_errors
from odscen.maps.background import BACKGROUNDS
from odscen.maps.folder_names import is_name

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence
    from pathlib import Path

    from odscen.app.map_repairs import RepairStep
    from odscen.maps.store import Workspace


def examine(
    workspace: Workspace, runs: Sequence[Path] = (), *, repair: bool = False
) -> Iterator[RepairStep]:
    """Compare all in a workspace with its checksums; with ``repair``, see to what is damaged.

    Parameters
    ----------
    runs
        Folders of further runs.

    Yields
    ------
    RepairStep
        Each when it is done; none for what is whole.

    Raises
    ------
    WorkspaceError
        If something cannot be written.
    ConflictError
        If another process works on what is to be repaired.
    """
    with disk_errors(f"workspace {workspace.root}"):
        yield from see_to_assets(workspace, repair=repair)
        for name in workspace.map_names():
            yield from see_to_map(workspace, name, repair=repair)
        for what, within in (
            ("background", workspace.root / "maps" / BACKGROUNDS),
            ("recording", workspace.recordings),
        ):
            for folder in sorted(within.iterdir()) if within.is_dir() else ():
                if is_name(folder.name):
                    yield from see_to_folder(workspace, what, folder, repair=repair)
        kept = workspace.runs.iterdir() if workspace.runs.is_dir() else ()
        for run in sorted({*kept, *runs}):
            if run.is_dir() and not run.name.startswith("."):
                yield from see_to_run(workspace, run, repair=repair)
