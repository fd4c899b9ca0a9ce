"""The plausibility check of the motion of a finished run, as a document."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import polars as pl

from odscen.app.running.reports import folder_of
from odscen.figures.measures.motion import (
    FORCED,
    KIND_UNITS,
    MotionKind,
    count_by_kind,
    implausible,
)
from odscen.records.row_text import rounded
from odscen.runs.finished_run import Run

if TYPE_CHECKING:
    from pathlib import Path

    from odscen.maps.store import Workspace


def motion_report(workspace: Workspace, run: Path) -> dict[str, Any]:
    """Check how road users of a run moved.

    Parameters
    ----------
    workspace
        Has the run, if it is given by its name.
    run
        Its folder, or its name.

    Returns
    -------
    ``run``; how many findings are ``implausible``, of ``hard_braking``, and ``forced``; ``counts``
    by kind, category and cause; ``findings``, each with its unit and whether it is ``counted`` as
    implausible. As :meth:`odscen.runs.finished_run.Run.motion`.

    Raises
    ------
    NotFoundError
        If there is no such run.
    InputError
        If no run has ended there, or its motion was not recorded.
    """
    folder = folder_of(workspace, run)
    found = Run.open(folder).motion()
    forced = pl.col("cause").is_in([str(cause) for cause in FORCED])
    hard = pl.col("kind") == str(MotionKind.HARD_BRAKING)
    marked = found.with_columns(counted=~forced & ~hard)
    return {
        "run": str(folder),
        "implausible": len(implausible(found)),
        "hard_braking": len(found.filter(hard & ~forced)),
        "forced": len(found.filter(forced)),
        "counts": [_with_unit(row) for row in count_by_kind(found).iter_rows(named=True)],
        "findings": [_with_unit(row) for row in marked.iter_rows(named=True)],
    }


def _with_unit(row: dict[str, Any]) -> dict[str, Any]:
    found: dict[str, Any] = rounded({**row, "unit": KIND_UNITS[MotionKind(row["kind"])]})
    return found
