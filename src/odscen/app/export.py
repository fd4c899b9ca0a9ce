"""Scenarios in foreign formats.

A new format is a module in ``odscen/interchange`` with an ``EXPORTER``, and its line in
:data:`EXPORTERS`; the command line and its help read that. Nothing heavy is imported to read it.
"""

from __future__ import annotations

import shutil
from contextlib import nullcontext
from pathlib import Path
from typing import TYPE_CHECKING

from odscen.base.errors import InputError, NotFoundError, WorkspaceError, in_file
from odscen.interchange import graphml_export, openscenario_export, sumo_export

if TYPE_CHECKING:
    from collections.abc import Mapping

    from odscen.interchange.exporter import ExportFiles
    from odscen.scenario.document.scenario_document import Scenario
    from odscen.workspace.store import Workspace

EXPORTERS = {
    one.name: one
    for one in (
        sumo_export.EXPORTER,
        graphml_export.EXPORTER,
        openscenario_export.EXPORTER,
    )
}
"""Every format by its name."""


def export(
    workspace: Workspace,
    scenario: Scenario | Path,
    out: Path,
    *,
    to: str,
    options: Mapping[str, str] | None = None,
) -> list[Path]:
    """Write a scenario in another format.

    Parameters
    ----------
    workspace
        Has the map.
    scenario
        The scenario, or its file.
    out
        Folder for the files; made if need be.
    to
        Name of the format, one of :data:`EXPORTERS`: ``sumo``, ``graphml``, ``openscenario``.
    options
        What the format lets one choose: of ``openscenario`` the ``version``.

    Returns
    -------
    list of Path
        The files, sorted.

    Raises
    ------
    NotFoundError
        If there is no such format.
    InputError
        If the format has no such option, or not with that value.
    ScenarioError
        If the scenario has errors that the format cannot do with.
    WorkspaceError
        If the folder cannot be written.
    """
    from odscen.app.maps import map_of
    from odscen.app.scenarios import check_scenario, given_scenario, scenario_name
    from odscen.interchange.exporter import ExportSource
    from odscen.scenario.document.problems import refuse_errors

    if to not in EXPORTERS:
        what = "format"
        raise NotFoundError(what, to, list(EXPORTERS))
    exporter, document = EXPORTERS[to], given_scenario(scenario)
    for option in options or {}:
        if option not in exporter.options:
            msg = f"the format {to} has no {option}"
            raise InputError(msg)
    if exporter.checked:
        with in_file(str(scenario)) if isinstance(scenario, Path) else nullcontext():
            refuse_errors(check_scenario(workspace, document))
    loaded = map_of(workspace, document)
    name, net = scenario_name(scenario), loaded.entry.checked("net")
    source = ExportSource(
        name=name,
        scenario=document,
        sumo_map=loaded.sumo,
        map_file=loaded.entry.checked("xodr"),
        net=net,
        assets=workspace.assets(),
        options=dict(options or {}),
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
