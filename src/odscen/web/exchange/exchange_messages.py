"""What goes over the wire about imports and exports."""

from __future__ import annotations

from odscen.web.messages import Answer


class ImportRow(Answer):
    """An element of a file, and why it is in its list.

    ``x`` and ``y`` are metres in the OpenDRIVE frame: the place on the map that it is about, if
    that is known.
    """

    file: str
    xpath: str
    line: int
    reason: str
    x: float | None
    y: float | None


class ImportInfo(Answer):
    """What became of each element of the file that a scenario was imported from.

    ``added`` says whether its map came with it; ``sweep`` whether there is a plan of a sweep.
    """

    scenario: str
    file: str
    map: str
    added: bool
    sweep: bool
    refused: list[ImportRow]
    approximated: list[ImportRow]
    ignored: list[ImportRow]
    taken: list[ImportRow]


class ExportNote(Answer):
    """A part of a scenario, and what becomes of it."""

    place: str
    reason: str


class ExportInfo(Answer):
    """Files of an export, and what its format says in part only, or not at all."""

    files: list[str]
    approximated: list[ExportNote]
    left_out: list[ExportNote]
