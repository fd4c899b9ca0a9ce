"""A run as one HTML file to hand on: its report, with a replay, that opens offline anywhere."""

from __future__ import annotations

from typing import TYPE_CHECKING

from odscen.base.errors import InputError
from odscen.formats.base import Format

if TYPE_CHECKING:
    from odscen.formats.base import ExportFiles, ExportSource


def write_page(source: ExportSource) -> ExportFiles:
    """Write the page of a run.

    Raises
    ------
    InputError
        If it is no run that has completed.
    """
    if source.report is None:
        raise InputError("this format says what happened in a run: name the folder of one")
    return {f"{source.name}.html": source.report()}


FORMAT = Format(
    id="html",
    title="One page with replay and report (HTML)",
    label="a run as one HTML file with replay, report and criteria, which opens offline",
    of=("run",),
    write=write_page,
)
