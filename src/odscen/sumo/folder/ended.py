"""Runs that have ended, by what they say of themselves."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

from odscen.base.errors import InputError
from odscen.sumo.folder.layout import SUMMARY_FILE
from odscen.sumo.folder.run_status import unfinished_words

if TYPE_CHECKING:
    from pathlib import Path


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
        msg = f"no finished run here: there is no {SUMMARY_FILE}"
        raise InputError(msg, file=str(run))
    try:
        summary = json.loads(file.read_text(encoding="utf-8"))
        summary["status"], summary["seed"]
    except (OSError, ValueError, KeyError, TypeError) as error:
        msg = f"not the summary of a run: {error!r}"
        raise InputError(msg, file=str(file)) from error
    return dict(summary)
