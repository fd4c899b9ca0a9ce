"""Scenarios edited step by step, with undo and redo; the page and Python have one history.

The history of a scenario of the workspace lies in ``scenarios/.history/NAME/``: one packed document
for each edit and an index, so that an edit writes one small file and the index, whatever the length
of the history. Beside a document lie the edits by name that have led to it, where it was made by
such.
"""

from __future__ import annotations

import json
import re
import shutil
import zlib
from contextlib import suppress
from dataclasses import asdict
from typing import TYPE_CHECKING, Any, NamedTuple

from odscen.app.maps import map_of
from odscen.app.scenarios import SUFFIX, read_scenario, write_scenario
from odscen.app.variants import apply_edit, edited
from odscen.base.errors import ConflictError, InputError, NotFoundError
from odscen.base.folder_locks import locked
from odscen.base.given_files import as_path, is_path, read_given_text
from odscen.base.system_errors import disk_errors
from odscen.base.text_files import write_text
from odscen.maps.folder_names import check_name
from odscen.maps.wastebasket import HISTORY
from odscen.scenario.document.json_form import dumps, loads
from odscen.scenario.edits.edit_history import (
    NO_HISTORY,
    History,
    HistoryEntry,
    document_sha256,
    open_history,
)
from odscen.scenario.edits.edit_messages import EDIT_MESSAGES, edits_label, read_edit
from odscen.scenario.edits.edit_registry import EDIT_ENTRIES

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping, Sequence
    from pathlib import Path

    from odscen.base.given_files import GivenPath
    from odscen.maps.store import Workspace
    from odscen.scenario.document.scenario_document import Scenario

_INDEX = "index.json"
_FILE = re.compile(r"[0-9]{8,}\.json\.z")
"""Names of files of a history."""
_MOST_BYTES = 1 << 28
_LOCK_PATIENCE = 30.0
"""Wall seconds to wait until another process has written a scenario of the workspace."""


class HistoryFolder:
    """The history of one scenario on disk.

    Parameters
    ----------
    folder
        Need not be there.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    def read(self) -> History | None:
        """Read where the scenario is in its edits; ``None`` if nothing can be read."""
        try:
            data = json.loads((self.folder / _INDEX).read_text(encoding="utf-8"))
            entries = tuple(HistoryEntry(**entry) for entry in data["entries"])
            # Of a workspace that others hand over: what is not in this folder is not of it.
            if not all(_FILE.fullmatch(entry.file) for entry in entries):
                return None
            history = History(int(data["version"]), str(data["sha256"]), entries, data["position"])
            return history if 0 <= history.position < len(entries) else None
        except (OSError, ValueError, KeyError, TypeError):
            return None

    def continue_with(self, known: History | None, text: str) -> History:
        """Continue the history that is known of a document; see :func:`open_history`.

        A process that was killed has written the history and not the document, which is then one
        step behind it, or before it if that was an undo.
        """
        if known is not None and known.sha256 != document_sha256(text):
            for step in (-1, 1):
                place = known.position + step
                with suppress(InputError):
                    if 0 <= place < len(known.entries) and (
                        self.document(known.entries[place]) == text
                    ):
                        return known.move(step, text)
        return open_history(known, text)

    def open(self, text: str) -> History:
        """Read the history of a document; see :func:`open_history`."""
        known = self.read()
        opened = self.continue_with(known, text)
        if opened is not known:
            if known is None:
                shutil.rmtree(self.folder, ignore_errors=True)
            self.write_document(opened.current, text)
            self.write_index(opened, known or NO_HISTORY)
        return opened

    def begin(self, text: str, *, label: str) -> History:
        """Begin the history of a document; what was in the folder goes."""
        shutil.rmtree(self.folder, ignore_errors=True)
        return self.add(NO_HISTORY, text, label=label)

    def add(
        self, history: History, text: str, *, label: str, edits: Sequence[Mapping[str, Any]] = ()
    ) -> History:
        """Add a document, and the edits by name that have made it; on disk before it returns."""
        longer = history.add(text, label=label)
        self.write_document(longer.current, text, edits)
        self.write_index(longer, history)
        return longer

    def move(self, history: History, step: int) -> tuple[History, str]:
        """Go one edit back (-1) or forth (+1): the history, and the document there."""
        text = self.document(history.entries[history.position + step])
        moved = history.move(step, text)
        self.write_index(moved, history)
        return moved, text

    def write_document(
        self, entry: HistoryEntry, text: str, edits: Sequence[Mapping[str, Any]] = ()
    ) -> None:
        """Write the document of an entry, and its edits."""
        self.folder.mkdir(parents=True, exist_ok=True)
        (self.folder / entry.file).write_bytes(zlib.compress(text.encode(), 1))
        if edits:
            write_text(self._edits_file(entry), json.dumps(list(edits)))

    def write_index(self, history: History, before: History) -> None:
        """Write where the scenario is; what only the history before had is removed."""
        for entry in set(before.entries) - set(history.entries):
            with suppress(OSError):
                (self.folder / entry.file).unlink()
            with suppress(OSError):
                self._edits_file(entry).unlink()
        write_text(self.folder / _INDEX, json.dumps(asdict(history)))

    def document(self, entry: HistoryEntry) -> str:
        """Read the document of an entry.

        Raises
        ------
        InputError
            If it is not as it was written, or much longer than a document can be.
        """
        file = self.folder / entry.file
        try:
            unpacking = zlib.decompressobj()
            content = unpacking.decompress(file.read_bytes(), _MOST_BYTES)
            if unpacking.eof:
                return content.decode()
        except (OSError, zlib.error, UnicodeDecodeError):
            pass
        raise InputError("this step of the history is damaged, and cannot be shown", file=str(file))

    def edits(self, entry: HistoryEntry) -> tuple[dict[str, Any], ...]:
        """Read the edits by name that have made a document; none if it was made otherwise."""
        try:
            return tuple(json.loads(self._edits_file(entry).read_text(encoding="utf-8")))
        except (OSError, ValueError):
            return ()

    def _edits_file(self, entry: HistoryEntry) -> Path:
        return self.folder / f"{entry.file.partition('.')[0]}.edits.json"


def written_document(scenario: Scenario) -> tuple[Scenario, str]:
    """Return a scenario as it is read back from its text, and the text."""
    text = dumps(scenario)
    # A formula whose number was set to another is none any more; only reading finds these.
    return (loads(text) if scenario.formulas else scenario), text


def _read_document(file: Path) -> tuple[Scenario, str]:
    """Read a scenario, and its text; of the other forms the text that it has as a document."""
    scenario = read_scenario(file)
    return scenario, read_given_text(file) if file.suffix == ".json" else dumps(scenario)


class EditStep(NamedTuple):
    """A step of undo.

    Attributes
    ----------
    label
        In words.
    edits
        Edits by name that made it, as data; empty if a function made it.
    """

    label: str
    edits: tuple[dict[str, Any], ...]


class Editing:
    """A scenario that is edited, with undo and redo.

    Nothing is written before :meth:`save`. Of a scenario among those of the workspace the history
    is kept: undo goes back to what was done on the page or in Python before, and the page has the
    steps that are saved here.

    Parameters
    ----------
    workspace
        Has the map.
    scenario
        The scenario, or its file.

    Raises
    ------
    InputError
        If the file cannot be read.
    ScenarioError
        If it is not a scenario.

    Examples
    --------
    >>> editing = odscen.Editing(workspace, path)
    >>> editing.apply("set_seed", seed=3)
    >>> editing.undo()
    >>> editing.save()
    """

    def __init__(self, workspace: Workspace, scenario: Scenario | GivenPath) -> None:
        self._workspace = workspace
        self._file: Path | None = None
        self._folder: HistoryFolder | None = None
        self._documents: dict[HistoryEntry, str] = {}
        self._edits: dict[HistoryEntry, tuple[dict[str, Any], ...]] = {}
        if is_path(scenario):
            self._file = as_path(scenario)
            self._folder = self._history_folder(self._file)
            self.scenario, text = _read_document(self._file)
        else:
            self.scenario, text = scenario, dumps(scenario)
        known = self._folder.read() if self._folder is not None else None
        self._history = (
            open_history(known, text)
            if self._folder is None
            else self._folder.continue_with(known, text)
        )
        if self._history is not known:
            self._documents[self._history.current] = text
        self._kept = known or NO_HISTORY
        """As on disk."""
        self._file_sha256 = document_sha256(text)

    @staticmethod
    def kinds() -> dict[str, str]:
        """Edits that :meth:`apply` makes: what undo calls each; braces hold arguments."""
        return {kind: entry.label for kind, entry in EDIT_ENTRIES.items()}

    @staticmethod
    def arguments(kind: str) -> dict[str, Any]:
        """Arguments of an edit, as JSON Schema.

        Raises
        ------
        NotFoundError
            If there is no such edit.
        """
        if kind not in EDIT_MESSAGES:
            raise NotFoundError("edit", kind, list(EDIT_MESSAGES))
        return EDIT_MESSAGES[kind].model_json_schema()

    @property
    def undo_label(self) -> str | None:
        """The step that :meth:`undo` takes back, in words; ``None`` if there is none."""
        return self._history.undo

    @property
    def redo_label(self) -> str | None:
        """The step that :meth:`redo` makes again, in words; ``None`` if there is none."""
        return self._history.redo

    @property
    def steps(self) -> tuple[EditStep, ...]:
        """Steps that :meth:`undo` takes back, the oldest first.

        Their edits are data: ``odscen variant`` and :meth:`apply_all` make them of other scenarios.
        """
        entries = self._history.entries[1 : self._history.position + 1]
        return tuple(EditStep(entry.label, self._edits_of(entry)) for entry in entries)

    def apply(self, kind: str, /, **arguments: Any) -> Scenario:
        """Make an edit.

        Parameters
        ----------
        kind
            Its name, one of :meth:`kinds`.
        arguments
            As the edit has them; values of the document as objects or as JSON has them.

        Returns
        -------
        Scenario
            The scenario now.

        Raises
        ------
        ScenarioError
            If there is no such edit, an argument is not possible, or a rule forbids it. The
            scenario is then as it was.
        NotFoundError
            If there is no actor, flow or other part of that name.
        """
        edit = read_edit({"kind": kind, **arguments})
        made = apply_edit(edit, self.scenario, map_of(self._workspace, self.scenario))
        return self._append_edits(made, edit.label, (edit.data,))

    def apply_all(
        self, edits: Iterable[Mapping[str, Any]], *, label: str | None = None
    ) -> Scenario:
        """Make several edits, all or none of them, as one step of undo.

        Parameters
        ----------
        edits
            Each as data: ``kind`` and its arguments.
        label
            What they do together, in words.

        Returns
        -------
        Scenario
            The scenario now.

        Raises
        ------
        InputError
            If there are none.
        ScenarioError
            If an edit cannot be read or made; names it.
        NotFoundError
            If there is no part of a name.
        """
        read = [read_edit(edit) for edit in edits]
        if not read:
            raise InputError("there are no edits to make")
        made = edited(self.scenario, read, map_of(self._workspace, self.scenario))
        return self._append_edits(
            made, label or edits_label(read), tuple(edit.data for edit in read)
        )

    def change(self, label: str, function: Callable[[Scenario], Scenario]) -> Scenario:
        """Make a step of a function, such as one that imports demand or times lights.

        Parameters
        ----------
        label
            What it does, in words.
        function
            Returns the changed scenario.

        Returns
        -------
        Scenario
            The scenario now.
        """
        return self._append_edits(function(self.scenario), label, ())

    def undo(self) -> Scenario:
        """Take the last step back.

        Raises
        ------
        ConflictError
            If there is none.
        """
        if self._history.undo is None:
            raise ConflictError("there is nothing to undo")
        return self._move_in_history(-1)

    def redo(self) -> Scenario:
        """Make the step again that was taken back last.

        Raises
        ------
        ConflictError
            If there is none.
        """
        if self._history.redo is None:
            raise ConflictError("there is nothing to redo")
        return self._move_in_history(+1)

    def save(self, path: GivenPath | None = None) -> Path:
        """Write the scenario, and its history if it is among the scenarios of the workspace.

        Parameters
        ----------
        path
            File; the one that was opened or saved last if not given.

        Returns
        -------
        Path
            The file.

        Raises
        ------
        InputError
            If there is no file to save to.
        ConflictError
            If the file has been changed since it was opened, or another one would be overwritten.
        WorkspaceError
            If it cannot be written.
        """
        file = self._file if path is None else as_path(path)
        if file is None:
            raise InputError("the scenario has no file yet; name one")
        scenarios = self._workspace.scenarios / HISTORY
        with (
            disk_errors(str(file)),
            locked(scenarios, what="the list of scenarios", patience=_LOCK_PATIENCE),
        ):
            self._refuse_conflict(file)
            folder = self._history_folder(file)
            if folder is not None:
                self._write_history(folder)
            write_scenario(self.scenario, file)
        self._file, self._folder, self._file_sha256 = file, folder, self._history.sha256
        return file

    def _refuse_conflict(self, file: Path) -> None:
        if file != self._file:
            if file.exists():
                raise ConflictError(f"{file} is there already; give the scenario another name")
        elif document_sha256(_read_document(file)[1]) != self._file_sha256 or (
            self._folder is not None and (self._folder.read() or NO_HISTORY) != self._kept
        ):
            raise ConflictError(f"{file} has been changed since it was opened")

    def _write_history(self, folder: HistoryFolder) -> None:
        documents, edits = self._documents, self._edits
        if self._folder is None or folder.folder != self._folder.folder:  # all of it, elsewhere
            documents = {entry: self._document_of(entry) for entry in self._history.entries}
            edits = {entry: self._edits_of(entry) for entry in self._history.entries}
            shutil.rmtree(folder.folder, ignore_errors=True)
            self._kept = NO_HISTORY
        for entry in self._history.entries:
            if entry in documents:
                folder.write_document(entry, documents[entry], edits.get(entry, ()))
        folder.write_index(self._history, self._kept)
        self._kept, self._documents, self._edits = self._history, {}, {}

    def _append_edits(
        self, scenario: Scenario, label: str, edits: tuple[dict[str, Any], ...]
    ) -> Scenario:
        self.scenario, text = written_document(scenario)
        self._history = self._history.add(text, label=label)
        self._documents[self._history.current] = text
        self._edits[self._history.current] = edits
        return self.scenario

    def _move_in_history(self, step: int) -> Scenario:
        text = self._document_of(self._history.entries[self._history.position + step])
        self.scenario = loads(text)
        self._history = self._history.move(step, text)
        return self.scenario

    def _document_of(self, entry: HistoryEntry) -> str:
        if entry in self._documents or self._folder is None:
            return self._documents[entry]
        with disk_errors("scenarios"):
            return self._folder.document(entry)

    def _edits_of(self, entry: HistoryEntry) -> tuple[dict[str, Any], ...]:
        if entry in self._edits or self._folder is None:
            return self._edits.get(entry, ())
        return self._folder.edits(entry)

    def _history_folder(self, file: Path) -> HistoryFolder | None:
        """Where the history of a file is kept, if it is a scenario of the workspace."""
        scenarios = self._workspace.scenarios
        if file.parent.resolve() != scenarios.resolve() or not file.name.endswith(SUFFIX):
            return None
        name = check_name(file.name.removesuffix(SUFFIX), what="scenario")
        return HistoryFolder(scenarios / HISTORY / name)
