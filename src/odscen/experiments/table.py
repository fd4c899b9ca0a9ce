"""Tables of experiments: one list of columns, limits of their values, and a row for each run.

:data:`COLUMNS` has what is no figure of runs: one more is a line there, or a call of
:func:`register_column`, and tables, limits and expectations of all commands have it. A figure of
runs (see :mod:`odscen.figures.measures.registry`) is a column of studies and datasets by itself,
and of sweeps where it is asked for.

A value that is missing keeps no limit: a run without a mean delay, as nobody arrived, does not meet
``mean_delay <= 40 s``. Measures of encounters are the exception: where nothing came near, every
limit of how near things came is kept.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from odscen.app.figure_functions import installed_value, is_installed
from odscen.base.errors import InputError
from odscen.experiments.closeness import Closeness, closeness_of
from odscen.figures.judging.expectations import parse_expectation
from odscen.figures.measures.figure import Figure
from odscen.figures.measures.registry import RUN_FIGURES, run_figure
from odscen.records.outcomes import RunStatus
from odscen.records.run_events import events_from_json
from odscen.records.run_plan import Plan
from odscen.runs import layout
from odscen.runs.recorded import read_conflicts

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterable, Mapping, Sequence

    import polars as pl

    from odscen.experiments.plan import StudyGrid, StudyRun
    from odscen.figures.judging.expectations import Expectation
    from odscen.records.run_events import Event
    from odscen.runs.finished_run import Run

REFUSED: Final = "refused"
"""Status of a run that was not possible: its scenario has errors with these values."""
SWEEP, SEARCH, STUDY, SUITE = "sweep", "search", "study", "test"
"""Tables by command; that of a dataset is a study's."""
_ABOUT: Final = ("run", "scenario", "variant", "case", "seed", "map")
_OUTCOME: Final = ("status", "detail", "usable", "criteria")
_NEAR: Final = 1e-6


class MeasuredRun:
    """A run that has completed, and what several columns are made of.

    Parameters
    ----------
    watched
        Ids of those whose encounters count; ``None`` is everybody's.
    """

    def __init__(self, run: Run, watched: Collection[str] | None = None) -> None:
        self.run = run
        self._watched = watched

    @cached_property
    def outcome(self) -> Mapping[str, bool | float | None]:
        """Collisions and closest encounters, see :func:`outcome_of`."""
        text = (self.run.folder / layout.EVENTS_FILE).read_text(encoding="utf-8")
        conflicts = read_conflicts(self.run.folder)
        return outcome_of(events_from_json(text), conflicts, self.run.trajectories, self._watched)

    @cached_property
    def closeness(self) -> Closeness:
        """How close road users came, also where nothing was recorded as an encounter."""
        try:
            trajectories = self.run.trajectories()
        except InputError:  # nobody was on the road
            return Closeness(None, None)
        text = (self.run.folder / layout.PLAN_FILE).read_text(encoding="utf-8")
        bodies = {actor.id: (actor.length, actor.width) for actor in Plan.from_json(text).actors}
        return closeness_of(trajectories, bodies, self._watched)


@dataclass(frozen=True, slots=True)
class Column:
    """A column of tables of runs.

    Attributes
    ----------
    figure
        Its name, unit and words.
    value
        Computes it; ``None`` where a run does not have it.
    tables
        Which tables have it without being asked.
    encounter
        Whether it is a measure of encounters, so that no value means that nothing came near.
    """

    figure: Figure
    value: Callable[[MeasuredRun], bool | float | None]
    tables: tuple[str, ...] = (SWEEP, SEARCH, STUDY, SUITE)
    encounter: bool = False


def _make_column(name: str, unit: str, label: str, *, search_only: bool = False) -> Column:
    """Make a column of collisions and encounters of the road users that are watched."""
    figure = Figure(name=name, unit=unit, label=label, definition=f"{label}.", source="events")
    if search_only:
        return Column(figure, lambda run: getattr(run.closeness, name), (SEARCH,), encounter=True)
    return Column(
        figure, lambda run: run.outcome[name], (SWEEP, SEARCH), encounter=name != "collision"
    )


COLUMNS: Final[dict[str, Column]] = {
    column.figure.name: column
    for column in (
        _make_column("collision", "", "Whether there was a collision"),
        _make_column("impact_speed", "m/s", "Speed of the hardest impact"),
        _make_column("min_ttc", "s", "Minimum TTC"),
        _make_column("min_pet", "s", "Minimum post-encroachment time"),
        _make_column("max_drac", "m/s2", "Maximum deceleration required to avoid a crash"),
        _make_column("clearance", "m", "Least distance of two bodies", search_only=True),
        _make_column("conflict_distance", "m", "Distance from a conflict point", search_only=True),
    )
}
"""By name, in the order of the tables; figures of runs are not among them."""
OUTCOME: Final = tuple(name for name, column in COLUMNS.items() if SWEEP in column.tables)


def register_column(column: Column) -> None:
    """Add a column to the tables that it names; suites have it as a figure that they can expect."""
    COLUMNS[column.figure.name] = column


def column_units() -> dict[str, str]:
    """Units of the columns that have one, as pages show them."""
    units = {name: column.figure.unit for name, column in COLUMNS.items() if SWEEP in column.tables}
    return {name: unit.replace("m/s2", "m/s\u00b2") for name, unit in units.items() if unit}


def columns_of(
    table: str,
    figures: Sequence[str] = (),
    own: Mapping[str, Callable[[Run], float | None]] | None = None,
) -> dict[str, Column]:
    """Columns of a table, in order.

    Parameters
    ----------
    figures
        Figures of runs, or of installed packages, that are asked for.
    own
        Functions of a finished run by name.

    Raises
    ------
    InputError
        If a figure is unknown.
    """
    columns = {name: column for name, column in COLUMNS.items() if table in column.tables}
    columns |= {name: _figure_column(name) for name in figures}
    for name, function in (own or {}).items():
        figure = Figure(name=name, unit="", label=name, definition="", source="")
        columns[name] = Column(figure, lambda measured, call=function: call(measured.run))  # type: ignore[misc]
    return columns


def _figure_column(name: str) -> Column:
    if (figure := run_figure(name)) is not None:
        entry = figure
        return Column(entry, lambda measured: measured.run.value_of(entry))
    if name in COLUMNS:
        return COLUMNS[name]
    if not is_installed(name):
        raise InputError(
            f"no figure of runs is called {name!r}, and no installed package offers one"
        )
    own = Figure(name=name, unit="", label=name, definition="", source="")
    return Column(own, lambda measured: installed_value(name, measured.run))


def study_figures() -> dict[str, Figure]:
    """Figures of each run of a study or dataset, in the order of its table."""
    more = {name: column.figure for name, column in COLUMNS.items() if STUDY in column.tables}
    return {figure.name: figure for figure in RUN_FIGURES} | more


@dataclass(frozen=True, slots=True)
class Limit:
    """What a row needs to hold, such as ``min_ttc >= 1.5 s``."""

    expectation: Expectation
    column: Column

    def holds(self, row: Mapping[str, Any]) -> bool:
        """Whether a row keeps it; where it is a share of the planned, with its ``planned``."""
        value = row[self.expectation.name]
        if value is None:
            return self.column.encounter
        if self.expectation.share:
            planned = float(row.get("planned") or 0.0)
            return planned > 0.0 and self.expectation.holds(float(value) / planned)
        return self.expectation.holds(float(value))

    def __str__(self) -> str:
        text = self.expectation.text
        number = self.expectation.bound
        if text[-1:].isdigit():  # without a unit
            return f"{self.expectation.name} {self.expectation.op} {number:g}"
        return " ".join(text.split())


def read_limit(text: str, columns: Mapping[str, Column]) -> Limit:
    """Read a limit of a table, in the grammar of expectations.

    Raises
    ------
    InputError
        If it is none, there is no such column, or the unit does not fit.
    """
    figures = {name: column.figure for name, column in columns.items()}
    expectation = parse_expectation(text, columns=figures)
    return Limit(expectation, columns[expectation.name])


def outcome_of(
    events: Iterable[Event],
    conflicts: pl.DataFrame | None,
    trajectories: Callable[[], pl.DataFrame],
    watched: Collection[str] | None,
) -> dict[str, bool | float | None]:
    """Collisions and closest encounters of some road users; keys are :data:`OUTCOME`.

    Parameters
    ----------
    events
        Of the run.
    conflicts
        Of the run, as :func:`odscen.figures.measures.conflicts.conflict_table` gives them.
    trajectories
        Called where the speed of an impact is not in its event.
    watched
        Ids of whose; ``None`` is everybody's.
    """
    impacts: list[float] = []
    for event in events:
        if event.kind == "collision" and _concerns_watched(watched, event.actor, event.partner):
            known = (event.values or {}).get("impact_speed")
            impacts.append(_impact_speed(event, trajectories()) if known is None else float(known))
    found: dict[str, bool | float | None] = {
        "collision": bool(impacts),
        "impact_speed": max(impacts, default=None),
    }
    rows = [] if conflicts is None else conflicts.to_dicts()
    own = [row for row in rows if _concerns_watched(watched, row["one"], row["other"])]
    for name, column, best in (
        ("min_ttc", "ttc", min), ("min_pet", "pet", min), ("max_drac", "drac", max),
    ):  # fmt: skip
        found[name] = best((row[column] for row in own if row[column] is not None), default=None)
    return found


def _concerns_watched(watched: Collection[str] | None, *ids: str | None) -> bool:
    return watched is None or any(name in watched for name in ids)


def _impact_speed(event: Event, trajectories: pl.DataFrame) -> float:
    """Relative speed of the two of a collision at its record, m/s; NaN if they have none."""
    import polars as pl

    pair = trajectories.filter(
        pl.col("id").is_in([event.actor, event.partner]),
        (pl.col("time") - event.time).abs() < _NEAR,
    )
    if pair.height != 2:
        return float("nan")
    heading, speed = pair["hdg"].to_numpy(), pair["speed"].to_numpy()
    return float(np.hypot(*np.diff(speed * np.vstack([np.cos(heading), np.sin(heading)])).ravel()))


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
        more = {name: column for name, column in COLUMNS.items() if STUDY in column.tables}
        measured = MeasuredRun(result)
        row |= {name: column.value(measured) for name, column in more.items()}
    return {name: value for name, value in row.items() if value is not None}


def outcome_row(status: str, detail: str | None) -> dict[str, Any]:
    """A row of a run that has no figures."""
    return {"status": str(status), "detail": detail}


def refuse_taken_names(parameters: Iterable[str]) -> None:
    """Raise :class:`InputError` if a parameter has the name of a column of the table."""
    taken = {*_ABOUT, *_OUTCOME, *study_figures()}
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
    schema |= dict.fromkeys(study_figures(), pl.Float64)
    ended = [run for run in grid.runs() if run.name in rows]
    columns: dict[str, Sequence[Any]] = {
        "run": [run.name for run in ended],
        "scenario": [run.scenario for run in ended],
        "variant": [run.variant for run in ended],
        "case": [run.case or None for run in ended],
        "seed": [run.seed for run in ended],
        "map": [grid.sources[run.scenario].map_name for run in ended],
        **{name: _values_of_runs(grid, ended, name) for name in grid.parameters},
    }
    ended_rows = [rows[run.name] for run in ended]
    for name in schema:
        if name not in columns:
            columns[name] = [row.get(name) for row in ended_rows]
    return pl.DataFrame(columns, schema=schema)


def _values_of_runs(grid: StudyGrid, runs: Sequence[StudyRun], name: str) -> list[float]:
    return [grid.values(run.case)[name] for run in runs]
