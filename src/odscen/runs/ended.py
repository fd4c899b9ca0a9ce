"""Runs that have ended, by what they say of themselves."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from odscen.base.errors import InputError, in_file
from odscen.base.stored_files import documents, read_json
from odscen.records.outcomes import RunStatus
from odscen.runs.layout import SUMMARY_FILE
from odscen.runs.run_status import unfinished_words

if TYPE_CHECKING:
    from pathlib import Path

RECORDS_ONLY = "records_only"
"""True in the summary of a run whose figures have not been computed yet."""

_PARTS: dict[str, type | tuple[type, ...]] = {
    "seed": int,
    "scenario": str,
    "map": str,
    "map_sha256": str,
    "actors": dict,
    "figures": dict,
    "files": dict,
    "sim_seconds": (int, float),
}
"""What every run that did not fail says of itself, and of which type."""


def read_summary(run: Path) -> dict[str, Any]:
    """Summary of a run, with its ``status`` and ``seed`` at least.

    Raises
    ------
    InputError
        If there is none, or it is something else; of an interrupted run it says how to resume it.
    """
    file = run / SUMMARY_FILE
    words = unfinished_words(run)
    if words is not None:
        raise InputError(words)
    if not file.is_file():
        raise InputError(f"no finished run here: there is no {SUMMARY_FILE}", file=str(run))
    what = "the summary of a run"
    with in_file(str(file)):
        try:
            summary = read_json(file.read_bytes(), what=what)
        except OSError as error:
            raise InputError(f"cannot be read: {error.strerror or error}") from error
        with documents(what):
            _check_summary(summary)
    return summary


def _check_summary(summary: dict[str, Any]) -> None:
    """Raise a ValueError or KeyError for what no run writes."""
    ended = RunStatus(summary["status"]) is not RunStatus.FAILED
    for name, kinds in _PARTS.items():
        value = summary[name] if ended or name == "seed" else summary.get(name)
        if not isinstance(value, kinds) or isinstance(value, bool):
            if value is None and not ended:
                continue
            raise ValueError(f"{name} cannot be {value!r:.60}")
    for name in ("figures", "actors"):
        for figure, value in (summary.get(name) or {}).items():
            if not isinstance(value, int | float | None):
                raise ValueError(f"{name} > {figure} cannot be {value!r:.60}")
