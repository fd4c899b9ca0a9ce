"""Files of foreign formats that were sent to the server, read by a child process.

Names are only ever compared: nothing on the disk but the workspace is looked at. The child reads
the file until that asks for a map; this process settles which one that is, adding it if it was
sent; then another child reads all of it.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from typing import TYPE_CHECKING, Any, Final, NamedTuple

from odscen.app.exchange.imports import (
    bare_map_name,
    known_or_added,
    map_of_network,
    maps_for_import,
    plan_text,
    read_content,
)
from odscen.base.atomic_folders import scratch_folder
from odscen.base.errors import InputError, OdscenError
from odscen.base.given_files import MOST, read_given
from odscen.base.shown import printable
from odscen.formats import find_format
from odscen.formats.base import VERDICTS
from odscen.maps.allowances import for_import
from odscen.maps.child_process import work_in_child
from odscen.maps.folder_names import name_from_file
from odscen.maps.store import Workspace
from odscen.scenario.document.json_form import dumps, loads

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping, Sequence

    from odscen.app.exchange.imports import AddedMaps
    from odscen.formats.base import Format, GivenFile
    from odscen.maps.map_entry import MapEntry
    from odscen.maps.store import ProgressCallback
    from odscen.scenario.document.scenario_document import Scenario

_MOST_FILES: Final = 40
_SCENARIO, _REPORT, _PLAN = "scenario.json", "report.json", "plan.json"
"""Files that a child writes; the last one if there is a plan."""
_NETWORK: Final = "asked.net.xml"
"""SUMO network that a child asks a map of."""


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
        JSON: the plan of the sweep, if the file varies parameters.
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
    of: str,
    options: Mapping[str, str] | None = None,
    progress: ProgressCallback,
) -> SentScenario:
    """Read a scenario of a foreign format, with its map and other files if they were sent.

    A map that was sent and is not in the workspace is added, under a free name if its own is taken,
    and removed again if the scenario is then refused.

    Raises
    ------
    NotFoundError
        If there is no such format.
    InputError
        If there is no scenario among the files, or several, or its map is neither among them nor in
        the workspace; names file and element.
    LimitError
        If reading needs more than files of their size may.
    """
    chosen = find_format(of)
    named = [
        SentFile(
            printable(PurePosixPath(file.name.replace("\\", "/")).name) or "file", file.content
        )
        for file in files
    ]
    stories = [sent for sent in named if not _is_map(sent.name)]
    if not stories:
        raise InputError(f"no {chosen.title} file ({' or '.join(chosen.suffixes[:1])}) was sent")
    if len(named) > _MOST_FILES:
        raise InputError(f"more than {_MOST_FILES} files were sent")
    size = sum(len(story.content) for story in stories)
    with scratch_folder() as folder:
        given = []
        for row, story in enumerate(stories):  # under names of ours
            path = folder / f"sent-{row}"
            path.write_bytes(story.content)
            given.append({"name": story.name, "path": str(path)})

        def read_in_child(map_name: str | None) -> dict[str, Any]:
            return work_in_child(
                f"{__name__}:read_sent",
                what="reading the scenario",
                arguments={
                    "of": of,
                    "files": given,
                    "workspace": str(workspace.root),
                    "map_name": map_name,
                    "options": dict(options or {}),
                    "folder": str(folder),
                },
                folders=(folder,),
                allowance=for_import(size),
                progress=progress,
            )

        seen = read_in_child(None)
        file = stories[seen["main"]].name
        with maps_for_import() as added:
            if seen.get("network") is not None:
                progress("making a map of the network", 0.1)
                network = (folder / _NETWORK).read_bytes()
                entry = map_of_network(
                    workspace, seen["network"], network, added=added,
                    progress=lambda what, share: progress(what, 0.1 + 0.8 * share),
                )  # fmt: skip
                read_in_child(entry.name)
            elif seen["map"] is not None:
                entry = _settle_map(workspace, named, seen["map"], file, added, progress)
                read_in_child(entry.name)
        plan = folder / _PLAN
        return SentScenario(
            loads((folder / _SCENARIO).read_text(encoding="utf-8"), file=file),
            file,
            name_from_file(Path(file)),
            bool(added),
            (folder / _REPORT).read_text(encoding="utf-8"),
            plan.read_text(encoding="utf-8") if plan.is_file() else None,
        )


def _settle_map(
    workspace: Workspace,
    files: Sequence[SentFile],
    wanted: str,
    file: str,
    added: AddedMaps,
    progress: ProgressCallback,
) -> MapEntry:
    """The map that a file names: the one that was sent with it, else that of the workspace."""
    bare = bare_map_name(wanted)
    maps = [file for file in files if _is_map(file.name)]

    def add(sent_map: SentFile) -> MapEntry:
        return known_or_added(
            workspace, sent_map.content, sent_map.name, added,
            lambda step, share: progress(step, 0.9 * share),
        )  # fmt: skip

    if not bare:
        if len(maps) == 1:
            return add(maps[0])
        raise InputError(
            "it names no map (RoadNetwork/LogicFile): send one map together with it", file=file
        )
    for sent_map in maps:
        if bare_map_name(sent_map.name).lower() == bare.lower():
            return add(sent_map)
    names = workspace.map_names()
    for name in (bare, name_from_file(Path(f"{bare}.xodr"))):
        if name in names:
            return workspace.map(name)
    sent = ", ".join(sent_map.name for sent_map in maps)
    others = f" What was sent is {sent}." if sent else ""
    raise InputError(
        f"it plays on the map {bare + '.xodr'!r}, which is neither among the files nor in the "
        f"workspace.{others} Send that map together with the scenario, or add it first.",
        file=file,
    )


def _is_map(name: str) -> bool:
    return name.lower().endswith(".xodr")


# ---------------------------------------------------------------------------- in the child


class _NetworkAskedError(OdscenError):
    """A reader asks for the map of a SUMO network."""

    def __init__(self, named: str, content: bytes) -> None:
        self.named, self.content = named, content
        super().__init__(named)


class _MapAskedError(OdscenError):
    """A reader asks for a map that is not settled yet.

    It is one of ours, so that it passes through formats of installed packages as it is.
    """

    def __init__(self, named: str) -> None:
        self.named = named
        super().__init__(named)


def read_sent(
    *,
    of: str,
    files: Sequence[Mapping[str, str]],
    workspace: str,
    map_name: str | None,
    options: Mapping[str, str],
    folder: str,
    progress: Callable[[str, float], None],
) -> dict[str, Any]:
    """Read the scenario, and write it and its report into a folder; a job of a child.

    Returns
    -------
    dict
        ``main``: which of the files it is; ``map``: the one that it asks for, as it names it, if
        that was not given and nothing was written; ``network``: name of a SUMO network whose map it
        asks for, which is then in the folder.
    """
    progress("reading the scenario" if map_name else "reading the file", 0.0)
    given = tuple((file["name"], Path(file["path"])) for file in files)
    chosen, store = find_format(of), Workspace.open(Path(workspace))
    main = _choose_main(chosen, [_FileAmongSent(row, given) for row in range(len(given))])

    def find_entry(named: str, _: GivenFile) -> MapEntry:
        if map_name is None:
            raise _MapAskedError(named)
        return store.map(map_name)

    def bring(named: str, network: bytes) -> MapEntry:
        if map_name is None:
            raise _NetworkAskedError(named, network)
        return store.map(map_name)

    try:
        content = read_content(
            store,
            of,
            _FileAmongSent(main, given),
            name=name_from_file(Path(given[main][0])),
            find_entry=find_entry,
            options=options,
            bring=bring,
        )
    except _NetworkAskedError as asked:
        (Path(folder) / _NETWORK).write_bytes(asked.content)
        return {"main": main, "map": None, "network": asked.named}
    except _MapAskedError as asked:
        return {"main": main, "map": asked.named}
    if content.scenario is None:
        raise InputError(
            "it has tracks of a recording and no scenario; odscen import makes a table of them",
            file=given[main][0],
        )
    rows = {
        verdict: [row._asdict() for row in content.lists.get(verdict, ())] for verdict in VERDICTS
    }
    out = Path(folder)
    (out / _SCENARIO).write_text(dumps(content.scenario), encoding="utf-8")
    (out / _REPORT).write_text(json.dumps(rows), encoding="utf-8")
    if content.plan is not None:
        (out / _PLAN).write_text(plan_text(content.plan), encoding="utf-8")
    return {"main": main, "map": None}


def _choose_main(chosen: Format, files: Sequence[GivenFile]) -> int:
    if chosen.choose_main is not None:
        return chosen.choose_main(files)
    rows = [row for row, one in enumerate(files) if one.name.lower().endswith(chosen.suffixes)]
    if len(rows) != 1:
        raise InputError(
            f"{len(rows)} of the files end with {' or '.join(chosen.suffixes)}: send one at a time",
            file=", ".join(file.name for file in files),
        )
    return rows[0]


@dataclass(frozen=True, slots=True)
class _FileAmongSent:
    """A file that was sent, together with others; nothing else on the disk is looked at.

    Attributes
    ----------
    row
        Which of them it is.
    given
        Name and place of all of them.
    """

    row: int
    given: tuple[tuple[str, Path], ...]

    @property
    def name(self) -> str:
        """Name that the sender gave it."""
        return self.given[self.row][0]

    @property
    def where(self) -> str:
        """The same."""
        return self.name

    @property
    def on_disk(self) -> Path:
        """Where the server keeps it."""
        return self.given[self.row][1]

    def read(self, *, most: int = MOST) -> bytes:
        """Its content."""
        try:
            return read_given(self.given[self.row][1], most=most)
        except InputError as error:
            raise InputError(error.problem, file=self.name) from error

    def other(self, named: str) -> _FileAmongSent:
        """The file of that name, whatever folder is named with it.

        Raises
        ------
        InputError
            If it was not sent.
        """
        bare = named.replace("\\", "/").rpartition("/")[2]
        for row, (name, _) in enumerate(self.given):
            if name == bare and row != self.row:
                return _FileAmongSent(row, self.given)
        raise InputError(
            f"it needs the file {bare!r}, which was not sent with it; send both files",
            file=self.name,
        )

    def others(
        self,
        folders: Sequence[str],  # noqa: ARG002 - they are told by their names
        suffix: str,  # noqa: ARG002
    ) -> Iterator[_FileAmongSent]:
        """All other files, whatever folders and ending are named."""
        for row, _ in sorted(enumerate(self.given), key=lambda pair: pair[1][0]):
            if row != self.row:
                yield _FileAmongSent(row, self.given)
