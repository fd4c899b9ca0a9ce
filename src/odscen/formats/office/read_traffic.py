"""Reads any file of trips, counts or detectors, by what is in it."""

from __future__ import annotations

from typing import TYPE_CHECKING

from odscen.base.errors import InputError
from odscen.base.given_files import MOST
from odscen.base.unpacking import unpack_gzip
from odscen.base.xml_reading import read_xml
from odscen.formats.controller_log import is_controller_log
from odscen.formats.office.free_table import (
    FreeTable,
    GivenTable,
    table_of_sheet,
    table_of_text,
)
from odscen.formats.office.sumo_traffic import read_sumo_traffic
from odscen.formats.office.traffic_file import ReadingOptions, TrafficFile, decoded
from odscen.formats.office.visum_matrix import is_visum, read_visum_matrix

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

DEFAULT = ReadingOptions()
_OLE = b"\xd0\xcf\x11\xe0"
"""Beginning of Excel files before 2007."""


def read_traffic(
    content: bytes,
    *,
    options: ReadingOptions = DEFAULT,
    known_columns: Callable[[GivenTable], Mapping[str, str]] | None = None,
) -> TrafficFile:
    """Read a file.

    Parameters
    ----------
    options
        What the user says of it.
    known_columns
        Gives the columns that were said before of a table with the same titles.

    Raises
    ------
    InputError
        If nothing is recognised in it, or nothing in it can be used; says what it seems to be.
    """
    read = _read_any(content, options, known_columns)
    if not (read.trips or read.volumes or read.turns or read.zones or read.stations):
        why = "its values are missing or 0"
        if read.left_out:
            why = f"{read.left_out[0].source}: {read.left_out[0].reason}"
        raise InputError(f"this is {read.what}, but no row of it can be used: {why}")
    return read


def _read_any(
    content: bytes,
    options: ReadingOptions,
    known_columns: Callable[[GivenTable], Mapping[str, str]] | None,
) -> TrafficFile:
    if not content.strip():
        raise InputError("the file is empty")
    if content.startswith(b"\x1f\x8b"):
        content = unpack_gzip(content, most=MOST)
    if content.startswith((b"PK\x03\x04", _OLE)):
        return _read_table(table_of_sheet(content), options, known_columns)
    if content.startswith(b"BI") and b"\x00" in content[:64]:
        raise InputError(
            "this looks like a binary matrix of VISUM; save it in VISUM in format V or O (text)"
        )
    text = decoded(content)
    if text.lstrip().startswith("<"):
        root = read_xml(content, huge=True)
        return read_sumo_traffic(root, attribute=options.columns.get("count"))
    if is_visum(text):
        return read_visum_matrix(text)
    if text.lstrip().startswith(("{", "[")):
        raise InputError("this is JSON; trips and counts are read from CSV, Excel, VISUM and SUMO")
    return _read_table(table_of_text(text), options, known_columns)


def _read_table(
    table: GivenTable,
    options: ReadingOptions,
    known_columns: Callable[[GivenTable], Mapping[str, str]] | None,
) -> TrafficFile:
    if is_controller_log(table.titles):
        raise InputError(
            "this is an event log of a signal controller; `odscen signals play-log` plays it back, "
            "`odscen signals log-measures` measures it"
        )
    kept = {} if known_columns is None else dict(known_columns(table))
    if not options.columns:
        options = ReadingOptions(kept, options.interval, options.date, options.time_zone)
    return FreeTable(table, options).read()
