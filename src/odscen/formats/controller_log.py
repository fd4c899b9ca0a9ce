"""Event logs of traffic signal controllers: ``timestamp, device, event, parameter``.

Events are numbered as in "Indiana Traffic Signal Hi Resolution Data Logger Enumerations" (Purdue
University, 2012, doi.org/10.4231/K4RN35SH): 1, 8 and 10 begin green, yellow and red clearance of a
phase, 21 to 23 walk, its clearance and don't walk, 61 to 65 those of an overlap, 81 and 82 end and
begin the call of a detector, 90 is a push button.
"""

from __future__ import annotations

import io
import re
from typing import TYPE_CHECKING, Final

from odscen.base.errors import InputError
from odscen.base.shown import shown

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    import polars as pl

EVENT_TITLES: Final[Mapping[str, tuple[str, ...]]] = {
    "time": ("timestamp", "time", "datetime", "eventtime"),
    "device": ("deviceid", "device", "signalid", "signal", "controllerid", "locationidentifier"),
    "event": ("eventid", "event", "eventcode", "code"),
    "parameter": ("parameter", "param", "eventparam", "parametercode"),
}
"""Titles of columns, in small letters without other signs."""
_DETECTOR_TITLES: Final[Mapping[str, tuple[str, ...]]] = {
    "device": EVENT_TITLES["device"],
    "phase": ("phase", "phasenumber", "protectedphase"),
    "parameter": ("parameter", "detector", "channel", "detectorchannel"),
    "function": ("function", "use", "detectiontype"),
}
_STAMPS: Final = (
    "%Y-%m-%d %H:%M:%S%.f", "%Y-%m-%dT%H:%M:%S%.f", "%m/%d/%Y %H:%M:%S%.f", "%d.%m.%Y %H:%M:%S%.f",
)  # fmt: skip
_MOST_NUMBER: Final = 65_535
FUNCTIONS: Final = ("advance", "presence")
"""What detectors are for: arrivals are counted at those far from the stop line, and splits are
judged by those at it."""


def is_controller_log(titles: Sequence[str]) -> bool:
    """Whether a table with these titles is an event log."""
    bare = {_bare_title(title) for title in titles}
    return all(bare.intersection(names) for names in EVENT_TITLES.values())


def read_controller_log(content: bytes) -> pl.DataFrame:
    """Read a log from CSV (comma, semicolon or tab) or Parquet.

    Returns
    -------
    polars.DataFrame
        ``time`` (datetime), ``device`` (text), ``event`` and ``parameter`` (numbers), by time.

    Raises
    ------
    InputError
        If it is no such log; names row and value.
    """
    import polars as pl

    table = _take_columns(_read_table(content), EVENT_TITLES)
    if table.is_empty():
        raise InputError("the log has no events")
    stamps = table["time"]
    if stamps.dtype == pl.String:
        bare = stamps.str.strip_chars()
        parsed = [bare.str.to_datetime(form, time_unit="ms", strict=False) for form in _STAMPS]
        times = pl.select(pl.coalesce(parsed)).to_series()
    elif stamps.dtype == pl.Datetime:
        times = stamps.dt.replace_time_zone(None).cast(pl.Datetime("ms"))
    else:
        raise InputError(
            f"its times are no stamps such as 2024-04-15 12:00:00.5, but {shown(stamps[0])}"
        )
    wrong = times.is_null().arg_true()
    if len(wrong):
        raise InputError(
            f"row {wrong[0] + 1}: {shown(stamps[wrong[0]])} is no time such as "
            "2024-04-15 12:00:00.5"
        )
    return pl.DataFrame(
        {
            "time": times,
            "device": table["device"].cast(pl.String).str.strip_chars(),
            "event": _whole_numbers(table["event"]),
            "parameter": _whole_numbers(table["parameter"]),
        }
    ).sort("time", maintain_order=True)


def read_log_detectors(content: bytes) -> pl.DataFrame:
    """Read which detectors of a log are before which phase, and what for.

    Returns
    -------
    polars.DataFrame
        ``device``, ``phase``, ``parameter`` (number of the detector) and ``function`` in small
        letters: ``advance``, ``presence``, or others, which no measure here needs.

    Raises
    ------
    InputError
        If columns are missing, or no detector is for any of :data:`FUNCTIONS`.
    """
    import polars as pl

    table = _take_columns(_read_table(content), _DETECTOR_TITLES)
    found = pl.DataFrame(
        {
            "device": table["device"].cast(pl.String).str.strip_chars(),
            "phase": _whole_numbers(table["phase"]),
            "parameter": _whole_numbers(table["parameter"]),
            "function": table["function"].cast(pl.String).str.strip_chars().str.to_lowercase(),
        }
    )
    if not found["function"].is_in(FUNCTIONS).any():
        raise InputError(f"no detector has the function {' or '.join(FUNCTIONS)}")
    return found


def _read_table(content: bytes) -> pl.DataFrame:
    import polars as pl

    if not content.strip():
        raise InputError("the file is empty")
    if content.startswith(b"PK\x03\x04"):
        raise InputError("this is an Excel file; save the log as CSV")
    if content.lstrip()[:1] == b"<":
        raise InputError("this is XML; programs of SUMO are taken with `odscen signals import`")
    try:
        if content.startswith(b"PAR1"):
            return pl.read_parquet(io.BytesIO(content))
        first = content.split(b"\n", 1)[0]
        separator = max(b",;\t", key=first.count)
        return pl.read_csv(
            io.BytesIO(content.removeprefix(b"\xef\xbb\xbf")),
            separator=chr(separator),
            infer_schema=False,
        )
    except (pl.exceptions.PolarsError, OSError, ValueError) as error:
        raise InputError(f"this is no table that can be read: {shown(str(error))}") from error


def _take_columns(table: pl.DataFrame, titles: Mapping[str, Sequence[str]]) -> pl.DataFrame:
    bare = {_bare_title(title): title for title in reversed(table.columns)}
    chosen = {
        name: next((bare[known] for known in all_known if known in bare), None)
        for name, all_known in titles.items()
    }
    missing = [name for name, title in chosen.items() if title is None]
    if missing:
        raise InputError(
            f"there is no column for {', '.join(missing)}; its columns are "
            f"{', '.join(shown(title) for title in table.columns[:12])}"
        )
    return table.select(**{name: str(title) for name, title in chosen.items()})


def _bare_title(title: str) -> str:
    return re.sub(r"[^a-z]", "", title.lower())


def _whole_numbers(column: pl.Series) -> pl.Series:
    import polars as pl

    numbers = (
        column.str.strip_chars().cast(pl.Float64, strict=False)
        if column.dtype == pl.String
        else column.cast(pl.Float64, strict=False)
    )
    whole = numbers.cast(pl.Int64, strict=False)
    wrong = ((whole != numbers) | ~numbers.is_between(0, _MOST_NUMBER)).fill_null(value=True)
    if wrong.any():
        row = int(wrong.arg_true()[0])
        raise InputError(
            f"row {row + 1}: {column.name} is no whole number from 0 to {_MOST_NUMBER}: "
            f"{shown(column[row])}"
        )
    return whole
