"""OpenSCENARIO files that were sent to the server, with the map and catalogs they name."""

from __future__ import annotations

import tempfile
from pathlib import Path, PurePosixPath
from typing import TYPE_CHECKING, Any, NamedTuple

from odscen.app.exchange.import_jobs import PLAN, REPORT, SCENARIO
from odscen.app.exchange.xosc_files import bare_map
from odscen.base.checksums import digest
from odscen.base.errors import InputError
from odscen.base.shown import printable
from odscen.maps.allowances import for_import
from odscen.maps.child_process import work_in_child
from odscen.maps.folder_names import check_name, name_from_file
from odscen.scenario.document.json_form import loads

if TYPE_CHECKING:
    from collections.abc import Sequence

    from odscen.formats.openscenario_import.xosc_reader import EgoDriver
    from odscen.maps.map_entry import MapEntry
    from odscen.maps.store import ProgressCallback, Workspace
    from odscen.scenario.document.scenario_document import Scenario

_JOBS = "odscen.app.exchange.import_jobs"
_MOST_FILES = 40


class SentFile(NamedTuple):
    """A file that was sent: the name that its sender gave it, and its content."""

    name: str
    content: bytes


class SentScenario(NamedTuple):
    """What has come of files that were sent.

    Attributes
    ----------
    stem
        Of the file, for a name of the scenario.
    added
        Whether its map was added to the workspace.
    report
        JSON: the lists ``taken``, ``approximated``, ``ignored`` and ``refused``.
    plan
        JSON: the plan of the sweep, of a parameter value distribution.
    """

    scenario: Scenario
    file: str
    stem: str
    added: bool
    report: str
    plan: str | None


def read_sent_scenario(
    workspace: Workspace,
    files: Sequence[SentFile],
    *,
    ego: EgoDriver = "story",
    progress: ProgressCallback,
) -> SentScenario:
    """Read an OpenSCENARIO file in a child process, with its map and catalogs if they were sent.

    Names are only ever compared: nothing on the disk but the workspace is looked at. A map that was
    sent and is not in the workspace is added, under a free name if its own is taken.

    Raises
    ------
    InputError
        If there is no scenario among the files, or several, or its map is neither among them nor in
        the workspace; names file and element.
    LimitError
        If reading needs more than files of their size may.
    """
    named = [SentFile(_bare(one.name), one.content) for one in files]
    stories = [one for one in named if not _is_map(one.name)]
    if not stories or len(named) > _MOST_FILES:
        what = "no OpenSCENARIO file (.xosc) was sent"
        msg = f"more than {_MOST_FILES} files were sent" if stories else what
        raise InputError(msg)
    size = sum(len(one.content) for one in stories)
    with tempfile.TemporaryDirectory(
        prefix="odscen-import-", ignore_cleanup_errors=True
    ) as scratch:
        folder = Path(scratch)
        given = [_laid_down(folder, row, one) for row, one in enumerate(stories)]

        def child(job: str, **arguments: Any) -> dict[str, Any]:
            return work_in_child(
                f"{_JOBS}:{job}",
                what="reading the scenario",
                arguments={"files": given, **arguments},
                folders=(folder,),
                allowance=for_import(size),
                progress=progress,
            )

        seen = child("look_at_sent")
        file = stories[seen["main"]].name
        entry, added = _map(workspace, named, seen["map"], file, progress)
        stem = name_from_file(Path(file))
        child(
            "read_sent",
            main=seen["main"],
            workspace=str(workspace.root),
            map_name=entry.name,
            name=stem,
            ego=ego,
            folder=scratch,
        )
        plan = folder / PLAN
        return SentScenario(
            loads((folder / SCENARIO).read_text(encoding="utf-8"), file=file),
            file,
            stem,
            added,
            (folder / REPORT).read_text(encoding="utf-8"),
            plan.read_text(encoding="utf-8") if plan.is_file() else None,
        )


def _map(
    workspace: Workspace,
    files: Sequence[SentFile],
    wanted: str,
    file: str,
    progress: ProgressCallback,
) -> tuple[MapEntry, bool]:
    """The map that a file names: the one that was sent with it, else that of the workspace."""
    bare = bare_map(wanted)
    maps = [one for one in files if _is_map(one.name)]
    if not bare:
        if len(maps) == 1:
            return _added(workspace, maps[0], progress)
        raise InputError(
            "it names no map (RoadNetwork/LogicFile): send one map together with it", file=file
        )
    for one in maps:
        if bare_map(one.name).lower() == bare.lower():
            return _added(workspace, one, progress)
    names = workspace.map_names()
    for name in (bare, name_from_file(Path(f"{bare}.xodr"))):
        if name in names:
            return workspace.map(name), False
    sent = ", ".join(one.name for one in maps)
    others = f" What was sent is {sent}." if sent else ""
    raise InputError(
        f"it plays on the map {bare + '.xodr'!r}, which is neither among the files nor in the "
        f"workspace.{others} Send that map together with the scenario, or add it first.",
        file=file,
    )


def _added(
    workspace: Workspace, sent: SentFile, progress: ProgressCallback
) -> tuple[MapEntry, bool]:
    """The map of this content; added if there is none."""
    sha256 = digest(sent.content)
    there = workspace.first_map(lambda one: one.sha256 == sha256)
    if there is not None:
        return there, False
    stem = name_from_file(Path(sent.name))
    name, number, taken = stem, 1, workspace.map_names()
    while name in taken:
        number += 1
        name = f"{stem[:56]}-{number}"

    def told(what: str, share: float) -> None:
        progress(what, 0.9 * share)

    entry = workspace.add_map_content(
        sent.content, file=f"{stem}.xodr", name=check_name(name), progress=told
    )
    return entry, True


def _laid_down(folder: Path, row: int, one: SentFile) -> dict[str, str]:
    """Write a file under a name of ours."""
    path = folder / f"sent-{row}"
    path.write_bytes(one.content)
    return {"name": one.name, "path": str(path)}


def _bare(name: str) -> str:
    """A name without folders, as it can be shown."""
    return printable(PurePosixPath(name.replace("\\", "/")).name) or "file"


def _is_map(name: str) -> bool:
    return name.lower().endswith(".xodr")
