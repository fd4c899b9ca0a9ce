"""Scenarios in foreign formats.

A new format is a module in ``odscen/interchange`` with an ``EXPORTER``, and its line in
:data:`EXPORTERS`; the command line and its help read that. Nothing heavy is imported to read it.
"""

from __future__ import annotations

import shutil
from typing import TYPE_CHECKING

from odscen.errors import NotFoundError, WorkspaceError, in_file
from odscen.interchange import graph_form, sumo_files

if TYPE_CHECKING:
    from pathlib import Path

    from odscen.catalog.store import Workspace
    from odscen.interchange.exporter import ExportFiles

EXPORTERS = {
    one.name: one
    for one in (
        sumo_files.EXPORTER,
        graph_form.EXPORTER,
    )
}
"""Every format by its name."""


def export(workspace: Workspace, path: Path, out: Path, *, to: str) -> list[Path]:
    """Write a scenario in another format.

    Parameters
    ----------
    path
        Scenario file.
    out
        Folder for the files; made if need be.
    to
        One of :data:`EXPORTERS`.

    Returns
    -------
    list of Path
        The files, sorted.

    Raises
    ------
    NotFoundError
        If there is no such format.
    ScenarioError
        If the scenario has errors that the format cannot do with.
    WorkspaceError
        If the folder cannot be written.
    """
    from odscen.app.maps import map_of
    from odscen.app.scenarios import check_scenario, read_scenario, scenario_name
    from odscen.interchange.exporter import ExportSource
    from odscen.scenario.problems import refuse_errors

    if to not in EXPORTERS:
        what = "format"
        raise NotFoundError(what, to, list(EXPORTERS))
    exporter, scenario = EXPORTERS[to], read_scenario(path)
    if exporter.checked:
        with in_file(str(path)):
            refuse_errors(check_scenario(workspace, scenario))
    loaded = map_of(workspace, scenario)
    source = ExportSource(
        scenario_name(path), scenario, loaded.sumo, loaded.entry.path("net"), workspace.assets()
    )
    return _write(exporter.files(source), out)


def _write(files: ExportFiles, out: Path) -> list[Path]:
    written = []
    try:
        for name, content in sorted(files.items()):
            path = out / name
            path.parent.mkdir(parents=True, exist_ok=True)
            if isinstance(content, str):
                path.write_text(content, encoding="utf-8")
            else:
                shutil.copyfile(content, path)
            written.append(path)
    except OSError as error:
        msg = f"{out}: {error.strerror or error}"
        raise WorkspaceError(msg) from error
    return written
