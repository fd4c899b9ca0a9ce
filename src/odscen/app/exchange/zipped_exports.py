"""Exports of a scenario in one file, for people who download them."""

from __future__ import annotations

import io
import json
import tempfile
import zipfile
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from odscen.app.export import export, export_run

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping

    from odscen.maps.store import Workspace
    from odscen.scenario.document.scenario_document import Scenario

NOTES = ".export.json"
"""Ending of the file that says what a format cannot."""
_DATE = (2026, 1, 1, 0, 0, 0)
"""Of every file in an archive: the same scenario gives the same bytes on any day."""


class ExportedFiles(NamedTuple):
    """Files of an export, by name.

    Attributes
    ----------
    contents
        Bytes of each, in the order of their names.
    """

    contents: dict[str, bytes]

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the files."""
        return tuple(self.contents)

    def notes(self) -> dict[str, Any] | None:
        """What is only approximated, and what is left out; ``None`` if the format has no such."""
        found = [content for name, content in self.contents.items() if name.endswith(NOTES)]
        notes: dict[str, Any] | None = json.loads(found[0]) if found else None
        return notes

    def zipped(self) -> bytes:
        """All of them as a ZIP archive; the same bytes each time."""
        made = io.BytesIO()
        with zipfile.ZipFile(made, "w", zipfile.ZIP_DEFLATED) as archive:
            for name, content in self.contents.items():
                entry = zipfile.ZipInfo(name, _DATE)
                entry.compress_type = zipfile.ZIP_DEFLATED
                entry.external_attr = 0o644 << 16
                archive.writestr(entry, content)
        return made.getvalue()


def exported(
    workspace: Workspace,
    scenario: Scenario,
    *,
    name: str,
    to: str,
    options: Mapping[str, str] | None = None,
) -> ExportedFiles:
    """Write a scenario in another format, see :func:`odscen.app.export.export`.

    Parameters
    ----------
    name
        That its files get.

    Raises
    ------
    NotFoundError, InputError, ScenarioError
        As of that function.
    """
    return _written(lambda out: export(workspace, scenario, out, to=to, options=options, name=name))


def exported_run(
    workspace: Workspace, run: Path, *, to: str, options: Mapping[str, str] | None = None
) -> ExportedFiles:
    """Write what happened in a run, see :func:`odscen.app.export.export_run`.

    Raises
    ------
    NotFoundError, InputError
        As of that function.
    """
    return _written(lambda out: export_run(workspace, run, out, to=to, options=options))


def _written(write: Callable[[Path], Iterable[Path]]) -> ExportedFiles:
    with tempfile.TemporaryDirectory(prefix="odscen-export-") as scratch:
        out = Path(scratch)
        return ExportedFiles(
            {one.relative_to(out).as_posix(): one.read_bytes() for one in write(out)}
        )
