"""The scenarios of a workspace: saved with every edit, versioned, with undo and redo.

A scenario is the file ``scenarios/NAME.scenario.json`` that every other command reads; its history
lies in ``scenarios/.history/NAME/``. Each change names the version that it was made on, so that two
pages cannot silently overwrite each other.
"""

from __future__ import annotations

import shutil
import threading
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from odscen.app.editing import HistoryFolder, written_document
from odscen.app.removal import remove
from odscen.app.scenarios import SUFFIX
from odscen.base.errors import ConflictError, NotFoundError, ScenarioError
from odscen.base.folder_locks import locked
from odscen.base.system_errors import disk_errors
from odscen.base.text_files import clear_parts, write_text
from odscen.maps.folder_names import check_name, is_name
from odscen.maps.wastebasket import HISTORY, Wastebasket
from odscen.scenario.document.json_form import dumps, loads
from odscen.scenario.edits import rename
from odscen.scenario.edits.edit_history import History, document_sha256
from odscen.web.messages import ScenarioRow

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from pathlib import Path

    from odscen.maps.store import Workspace
    from odscen.maps.wastebasket import RemovedItem
    from odscen.scenario.document.scenario_document import Scenario
    from odscen.scenario.edits.edit_messages import EditBase
    from odscen.web.large.large_documents import LargeDocuments


_PATIENCE = 30.0
"""Wall seconds that a new scenario waits for another one, of another process, to be written."""
MOST_OPEN = 32
"""Scenarios that are kept in memory; others are read again when they are asked for."""

_FileState = tuple[int, int, int]


@dataclass(frozen=True, slots=True)
class Draft:
    """A scenario as it is now; ``before`` is what the last change of this process has changed."""

    name: str
    scenario: Scenario
    history: History
    before: Scenario | None = None


class Drafts:
    """All scenarios of a workspace; one change at a time.

    Parameters
    ----------
    large
        Children that read large ones for the list; ``None`` to read all here.
    """

    def __init__(self, workspace: Workspace, large: LargeDocuments | None = None) -> None:
        self._workspace = workspace
        self._large = large
        self._rows: dict[str, tuple[_FileState, ScenarioRow]] = {}
        self._folder = workspace.scenarios
        self._lock = threading.RLock()
        self._open: dict[str, Draft] = {}
        clear_parts(self._folder)

    def rows(self) -> list[ScenarioRow]:
        """All scenarios, those changed last first."""
        files = self._folder.glob(f"*{SUFFIX}") if self._folder.is_dir() else ()
        names = [path.name.removesuffix(SUFFIX) for path in files]
        rows = []
        for name in filter(is_name, names):
            with suppress(FileNotFoundError, NotFoundError):  # just removed
                rows.append(self.row(name))
        return sorted(rows, key=lambda row: (-row.modified, row.name))

    def row(self, name: str) -> ScenarioRow:
        """What the list says of a scenario; known until its file changes."""
        state = _file_state(self._path_of(name))
        known = self._rows.get(name)
        if known is not None and known[0] == state:
            return known[1]
        if self._large is not None and self._large.is_large(name):
            row = ScenarioRow(**self._large.row_of(name))
        else:
            row = self._describe_draft(name)
        self._rows[name] = state, row
        return row

    def get(self, name: str) -> Draft:
        """One scenario; a file that another program has changed is read again.

        Raises
        ------
        NotFoundError
            If there is none of that name.
        ScenarioError
            If its file is not a scenario.
        """
        with self._lock, disk_errors("scenarios"):
            path = self._path_of(name)
            if not path.is_file():
                raise NotFoundError("scenario", name, [row.name for row in self.rows()])
            text = path.read_text(encoding="utf-8", errors="replace")
            known = self._open.get(name)
            sha256 = document_sha256(text)
            if known is not None and known.history.sha256 == sha256:
                return self._keep_open(known)
            scenario = loads(text, file=f"{name}{SUFFIX}")
            return self._keep_open(Draft(name, scenario, self._history_of(name).open(text)))

    def create(
        self, scenario: Scenario, name: str | None, *, stem: str, label: str, renamed: bool = False
    ) -> Draft:
        """Save a new scenario; a free name is made from ``stem`` if none is given.

        Parameters
        ----------
        renamed
            Call the document by the name, too.

        Raises
        ------
        ConflictError
            If the name is taken.
        """
        alone = locked(self._folder / HISTORY, what="the list of scenarios", patience=_PATIENCE)
        with self._lock, disk_errors("scenarios"), alone:
            name = self._free_name(stem) if name is None else check_name(name, what="scenario")
            self._refuse_taken(name)
            if renamed:
                scenario = rename(scenario, name=name)
            text = dumps(scenario)
            begun = self._history_of(name).begin(text, label=label)
            write_text(self._path_of(name), text)
            return self._keep_open(Draft(name, scenario, begun))

    def change(
        self,
        name: str,
        version: int,
        label: str,
        edit: Callable[[Scenario], Scenario],
        *,
        edits: Sequence[EditBase] = (),
    ) -> Draft:
        """Make an edit and save it.

        Parameters
        ----------
        edits
            Edits by name that it is made of, if it is; the history keeps them.

        Raises
        ------
        ConflictError
            If ``version`` is not the newest.
        InputError
            If the edit is refused.
        """
        with self._lock, disk_errors("scenarios"):
            old = self.of_version(name, version)
            scenario, text = written_document(edit(old.scenario))
            data = [message.data for message in edits]
            new = self._history_of(name).add(old.history, text, label=label, edits=data)
            return self._save_draft(Draft(name, scenario, new, old.scenario), text)

    def undo(self, name: str, version: int) -> Draft:
        """Take the last edit back; :class:`ConflictError` if there is none."""
        return self._move_in_history(name, version, -1)

    def redo(self, name: str, version: int) -> Draft:
        """Make the edit again that was taken back last; :class:`ConflictError` if there is none."""
        return self._move_in_history(name, version, +1)

    def rename(self, name: str, new: str) -> Draft:
        """Give a scenario's file another name."""
        with self._lock, disk_errors("scenarios"):
            draft = self.get(name)
            check_name(new, what="scenario")
            self._refuse_taken(new)
            shutil.rmtree(self._history_of(new).folder, ignore_errors=True)
            with suppress(FileNotFoundError):
                self._history_of(name).folder.rename(self._history_of(new).folder)
            self._path_of(name).rename(self._path_of(new))
            del self._open[name]
            return self._keep_open(replace(draft, name=new))

    def keep(self, name: str, file: str, text: str) -> None:
        """Keep a file beside the history of a scenario; it goes where the scenario goes."""
        with self._lock, disk_errors("scenarios"):
            write_text(self._history_of(name).folder / file, text)

    def kept(self, name: str, file: str) -> str | None:
        """What was kept under that name; ``None`` if nothing was, or there is no scenario."""
        try:
            return (self._history_of(name).folder / file).read_text(encoding="utf-8")
        except FileNotFoundError:
            return None

    def remove(self, name: str) -> RemovedItem:
        """Move a scenario and its history into the wastebasket."""
        with self._lock:
            if not self._path_of(name).is_file():
                raise NotFoundError("scenario", name, [row.name for row in self.rows()])
            self._open.pop(name, None)
            return remove(self._workspace, "scenario", name)

    def restore(self, item: str) -> RemovedItem:
        """Put an item of the wastebasket back, between two changes of scenarios."""
        with self._lock:
            return Wastebasket(self._workspace).restore(item)

    def _move_in_history(self, name: str, version: int, step: int) -> Draft:
        with self._lock, disk_errors("scenarios"):
            old = self.of_version(name, version)
            if (old.history.undo if step < 0 else old.history.redo) is None:
                raise ConflictError(
                    f"there is nothing to {'undo' if step < 0 else 'redo'}", current=version
                )
            new, text = self._history_of(name).move(old.history, step)
            scenario = loads(text, file=f"{name}{SUFFIX}")
            return self._save_draft(Draft(name, scenario, new, old.scenario), text)

    def _save_draft(self, draft: Draft, text: str) -> Draft:
        write_text(self._path_of(draft.name), text)
        return self._keep_open(draft)

    def _keep_open(self, draft: Draft) -> Draft:
        """Keep a scenario in memory, and close those that were looked at longest ago."""
        self._open.pop(draft.name, None)
        self._open[draft.name] = draft
        while len(self._open) > MOST_OPEN:
            del self._open[next(iter(self._open))]
        return draft

    def of_version(self, name: str, version: int) -> Draft:
        """One scenario, that has to be at ``version``; :class:`ConflictError` if it is not."""
        draft = self.get(name)
        current = draft.history.version
        if version != current:
            raise ConflictError(
                f"scenario {name!r} has changed: it is at version {current}, not {version}",
                current=current,
            )
        return draft

    def _describe_draft(self, name: str) -> ScenarioRow:
        modified = self._path_of(name).stat().st_mtime
        try:
            draft = self.get(name)
        except ScenarioError as error:
            return ScenarioRow(name=name, modified=modified, version=0, error=str(error))
        scenario = draft.scenario
        return ScenarioRow(
            name=name,
            title=scenario.name,
            map=scenario.map.name,
            actors=len(scenario.actors),
            flows=len(scenario.flows),
            modified=modified,
            version=draft.history.version,
        )

    def _free_name(self, stem: str) -> str:
        number = 1
        while self._path_of(name := f"{stem[:56]}-{number}").exists():
            number += 1
        return name

    def _refuse_taken(self, name: str) -> None:
        if self._path_of(name).exists():
            raise ConflictError(f"there is a scenario named {name!r} already")

    def _path_of(self, name: str) -> Path:
        return self._folder / f"{check_name(name, what='scenario')}{SUFFIX}"

    def _history_of(self, name: str) -> HistoryFolder:
        return HistoryFolder(self._folder / HISTORY / check_name(name, what="scenario"))


def _file_state(path: Path) -> _FileState:
    """What changes with a file."""
    stat = path.stat()
    return stat.st_ino, stat.st_size, stat.st_mtime_ns
