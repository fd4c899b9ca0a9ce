"""A run of a study as a row of its table: what it is of, how it ended, and its figures."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

from odscen.base.errors import InputError
from odscen.figures.measures.registry import RUN_FIGURES
from odscen.records.outcomes import RunStatus

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    import polars as pl

    from odscen.experiments.plan import StudyGrid, StudyRun
    from odscen.runs.finished_run import Run

REFUSED: Final = "refused"
"""Status of a run that was not possible: its scenario has errors with these values."""
_ABOUT: Final = ("run", "scenario", "variant", "case", "seed", "map")
_OUTCOME: Final = ("status", "detail", "usable", "criteria")
FIGURE_COLUMNS: Final = tuple(figure.name for figure in RUN_FIGURES)


def row_of(result: Run) -> dict[str, Any]:
    """How a run ended: ``status``, ``detail`` (why it failed), ``usable``, ``criteria``, figures.

    ``criteria`` is whether all of the scenario were met, ``None`` without any.
    """
    summary = result.summary
    criteria = [row["passed"] for row in summary.get("criteria") or ()]
    row = outcome_row(result.status, summary["error"])
    row["usable"] = result.usability.get("level")
    row["criteria"] = all(criteria) if criteria else None
    if result.status is RunStatus.COMPLETED:
        row |= {figure.name: figure.of_summary(summary) for figure in RUN_FIGURES}
    return {name: value for name, value in row.items() if value is not None}


def outcome_row(status: str, detail: str | None) -> dict[str, Any]:
    """A row of a run that has no figures."""
    return {"status": str(status), "detail": detail}


def refuse_taken_names(parameters: Iterable[str]) -> None:
    """Raise :class:`InputError` if a parameter has the name of a column of the table."""
    taken = {*_ABOUT, *_OUTCOME, *FIGURE_COLUMNS}
    for name in parameters:
        if name in taken:
            raise InputError(
                f"parameter {name!r} has the name of a column of the table; call it otherwise"
            )


def study_table(grid: StudyGrid, rows: Mapping[str, Mapping[str, Any]]) -> pl.DataFrame:
    """All runs that have ended, in the order of the plan.

    Parameters
    ----------
    rows
        By name of the run, as :func:`row_of` gives them.

    Returns
    -------
    polars.DataFrame
        ``run``, ``scenario``, ``variant``, ``case``, ``seed``, ``map``, the parameters, ``status``,
        ``detail``, ``usable``, ``criteria``, and every figure of runs in its unit; null where a
        run does not have it.
    """
    import polars as pl

    schema: dict[str, Any] = dict.fromkeys(("run", "scenario", "variant"), pl.String)
    schema |= {"case": pl.Int64, "seed": pl.Int64, "map": pl.String}
    schema |= dict.fromkeys(grid.parameters, pl.Float64)
    schema |= dict.fromkeys(("status", "detail", "usable"), pl.String) | {"criteria": pl.Boolean}
    schema |= dict.fromkeys(FIGURE_COLUMNS, pl.Float64)
    ended = [run for run in grid.runs() if run.name in rows]
    columns: dict[str, Sequence[Any]] = {
        "run": [run.name for run in ended],
        "scenario": [run.scenario for run in ended],
        "variant": [run.variant for run in ended],
        "case": [run.case or None for run in ended],
        "seed": [run.seed for run in ended],
        "map": [grid.sources[run.scenario].map_name for run in ended],
        **{name: _values(grid, ended, name) for name in grid.parameters},
    }
    said = [rows[run.name] for run in ended]
    for name in schema:
        if name not in columns:
            columns[name] = [row.get(name) for row in said]
    return pl.DataFrame(columns, schema=schema)


def _values(grid: StudyGrid, runs: Sequence[StudyRun], name: str) -> list[float]:
    return [grid.values(run.case)[name] for run in runs]
