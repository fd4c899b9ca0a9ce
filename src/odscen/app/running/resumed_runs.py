"""An interrupted run goes on, and gets its report."""

from __future__ import annotations

from contextlib import suppress
from typing import TYPE_CHECKING, Any

from odscen.app.maps import load_map
from odscen.app.removal import removed_map
from odscen.app.running.reports import write_report
from odscen.base.errors import InputError
from odscen.base.given_files import as_path
from odscen.runs.reporter import SILENT
from odscen.sumo.runner import long_runs

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

    from odscen.base.given_files import GivenPath
    from odscen.learning.behaviour.behaviour_model import BehaviourDoor
    from odscen.maps.store import Workspace
    from odscen.runs.finished_run import Run
    from odscen.runs.reporter import Reporter
    from odscen.sumo.runner.worker_process import Companion


def resume(
    workspace: Workspace,
    run: GivenPath,
    *,
    time_limit: float | None = None,
    reporter: Reporter = SILENT,
    live: Companion | None = None,
    behaviour: BehaviourDoor | None = None,
) -> Run:
    """Resume an interrupted run and write its report.

    Parameters
    ----------
    workspace
        Has the map.
    run
        Its folder, or its name in the workspace.
    time_limit
        Wall seconds after which it is interrupted again.
    reporter
        Hears where it goes on, what is damaged, and how far it is, in this thread.
    live
        Makes it a run that can be watched and steered.
    behaviour
        What drives instead of SUMO, named again where it is a program, a module or a file.

    Returns
    -------
    Run
        With the same results as if it had not been interrupted.

    Raises
    ------
    NotFoundError
        If there is no such run.
    ConflictError
        If it has ended, or is going on.
    InputError
        If it is driven by code that only its folder names.
    """

    def finish(folder: Path, summary: Mapping[str, Any]) -> None:
        entry = None
        with suppress(InputError):  # the map has been removed meanwhile
            entry = workspace.map_for(summary["map"], summary["map_sha256"])
        entry = entry or removed_map(workspace, summary["map_sha256"])
        write_report(folder, summary, loaded=None if entry is None else load_map(entry))

    own = as_path(run)
    folder = own if own.is_dir() else workspace.runs / own
    result = long_runs.resume(
        folder,
        reporter=reporter,
        time_limit=time_limit,
        finish=finish,
        live=live,
        behaviour=behaviour,
    )
    reporter.finished(result)
    return result
