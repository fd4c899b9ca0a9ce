"""A sweep as a table: a row for each case, where it is safe, and the page.

All of it is made from the run folders, so a sweep that was interrupted gives the same bytes when
it has been resumed.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

from odscen.app.figure_functions import installed_value, is_installed
from odscen.app.scenarios import SUFFIX, scenario_name
from odscen.base.errors import InputError
from odscen.base.text_files import write_text
from odscen.experiments.cases.safe_boundary import safe_boundary
from odscen.experiments.cases.sweep_page import SweepShown, sweep_page
from odscen.experiments.cases.sweep_rows import OUTCOME, limit_from_text, outcome_of
from odscen.experiments.sweeps.sweep_folder import read_sweep, settings_from_dict
from odscen.figures.measures.registry import run_figure
from odscen.records.outcomes import RunStatus
from odscen.records.run_events import events_from_json
from odscen.runs import layout
from odscen.runs.finished_run import Run
from odscen.runs.recorded import read_conflicts

if TYPE_CHECKING:
    from collections.abc import Collection, Mapping, Sequence
    from pathlib import Path

    import polars as pl

    from odscen.experiments.cases.sweep_rows import Limit
    from odscen.experiments.sweeps.sweep_folder import SweepSettings
    from odscen.scenario.document.scenario_document import Scenario
    from odscen.scenario.sweeps.sweep_plan import SweepPlan

TABLE_FILE: Final = "cases.parquet"
PAGE_FILE: Final = "sweep.html"


@dataclass(frozen=True, slots=True, eq=False)
class Sweep:
    """A sweep that has been run.

    Attributes
    ----------
    folder
        With all files.
    table
        One row per case: ``case``, ``status``, ``safe``, ``detail``, the parameters, ``collision``,
        ``impact_speed`` (m/s), ``min_ttc`` (s), ``min_pet`` (s), ``max_drac`` (m/s^2), and figures
        that were asked for. ``safe`` is null where a case was not run.
    boundary
        Stretches ``((x, y), (x, y))`` of the boundary between safe cases and others, in the plane
        of the parameters, if there are two.
    """

    folder: Path
    table: pl.DataFrame
    boundary: tuple[tuple[tuple[float, float], tuple[float, float]], ...]


def limits_of(settings: SweepSettings) -> tuple[Limit, ...]:
    """Read what a safe case keeps.

    Raises
    ------
    InputError
        If a figure or a column of a limit is unknown.
    """
    for name in settings.figures:
        if run_figure(name) is None and not is_installed(name):
            raise InputError(
                f"no figure of runs is called {name!r}, and no installed package offers one"
            )
    columns = [*OUTCOME, *settings.figures, *settings.own]
    return tuple(limit_from_text(text, columns) for text in settings.safe)


def rows_of(
    scenario: Scenario,
    cases: Mapping[str, Mapping[str, float]],
    out: Path,
    *,
    refused: Mapping[str, str],
    settings: SweepSettings,
    limits: Sequence[Limit],
) -> list[dict[str, Any]]:
    """A row for each case, from its run folder; ``refused`` are cases without, and why.

    The ``status`` of a case that has not been run yet is ``waiting``.
    """
    watched = watched_actors(scenario)
    rows = []
    for name, values in cases.items():
        row: dict[str, Any] = {"case": name, "status": "refused", "safe": None}
        row |= {"detail": refused.get(name), **values}
        measured = dict.fromkeys([*OUTCOME, *settings.figures, *settings.own])
        folder = out / "runs" / name
        if name not in refused and not (folder / layout.SUMMARY_FILE).is_file():
            row["status"] = "waiting"
        elif name not in refused:
            run = Run.open(folder)
            row["status"] = str(run.status)
            if run.status is RunStatus.COMPLETED:
                measured = _measured(run, settings, watched)
                row["safe"] = not measured["collision"] and all(
                    limit.holds(measured) for limit in limits
                )
            else:
                row["detail"] = str(run.known["error"])
        rows.append(row | measured)
    return rows


def watched_actors(scenario: Scenario) -> frozenset[str] | None:
    """Whose collisions and encounters a sweep is about: egos, or actors of rules, or everybody."""
    egos = frozenset(actor.id for actor in scenario.actors if actor.ego)
    return egos or frozenset(rule.actor for rule in scenario.rules) or None


def _measured(run: Run, settings: SweepSettings, watched: Collection[str] | None) -> dict[str, Any]:
    events = events_from_json((run.folder / layout.EVENTS_FILE).read_text(encoding="utf-8"))
    found: dict[str, Any] = dict(
        outcome_of(events, read_conflicts(run.folder), run.trajectories, watched)
    )
    for name in settings.figures:
        entry = run_figure(name)
        found[name] = installed_value(name, run) if entry is None else run.value_of(entry)
    return found | {name: function(run) for name, function in settings.own.items()}


def write_table(
    out: Path,
    scenario: Scenario,
    plan: SweepPlan,
    *,
    rows: Sequence[Mapping[str, Any]],
    limits: Sequence[Limit],
) -> Sweep:
    """Write table and page of all cases."""
    table = write_cases(out, scenario, plan.names, rows=rows, limits=limits)
    return Sweep(out, table, _boundary(plan, rows))


def write_cases(
    out: Path,
    scenario: Scenario,
    names: Sequence[str],
    *,
    rows: Sequence[Mapping[str, Any]],
    limits: Sequence[Limit],
) -> pl.DataFrame:
    """Write the table and the page of cases; ``names`` are the parameters that are varied."""
    table = _as_table(rows)
    part = out / f".{TABLE_FILE}.part"
    table.write_parquet(part)
    part.replace(out / TABLE_FILE)
    shown = SweepShown(
        scenario_name(scenario),
        {name: scenario.parameters[name].unit for name in names},
        ["no collision", *map(str, limits)],
        rows,
        {row["case"]: _links(out, row["case"]) for row in rows},
    )
    write_text(out / PAGE_FILE, sweep_page(shown))
    return table


def read_table(out: Path) -> Sweep:
    """Read the table of a sweep; of one that has not ended, from the runs that there are.

    Raises
    ------
    InputError
        If there is no sweep.
    """
    import polars as pl

    scenario, plan, said = read_sweep(out)
    if (out / TABLE_FILE).is_file():
        table = pl.read_parquet(out / TABLE_FILE)
    else:
        settings = settings_from_dict(said)
        limits = limits_of(settings)
        cases = named_cases(plan)
        table = _as_table(
            rows_of(scenario, cases, out, refused={}, settings=settings, limits=limits)
        )
    return Sweep(out, table, _boundary(plan, table.to_dicts()))


def named_cases(plan: SweepPlan) -> dict[str, dict[str, float]]:
    """Values of each case by its name, ``case-001``; names sort as the cases do."""
    cases = plan.cases()
    digits = max(3, len(str(len(cases))))
    return {f"case-{number:0{digits}}": values for number, values in enumerate(cases, start=1)}


def _as_table(rows: Sequence[Mapping[str, Any]]) -> pl.DataFrame:
    import polars as pl

    texts, flags = {"case", "status", "detail"}, {"safe", "collision"}
    schema = {
        name: pl.String if name in texts else pl.Boolean if name in flags else pl.Float64
        for name in rows[0]
    }
    return pl.DataFrame(rows, schema=schema, orient="row")


def _boundary(plan: SweepPlan, rows: Sequence[Mapping[str, Any]]) -> tuple[Any, ...]:
    import numpy as np

    if len(plan.names) != 2:
        return ()
    known = [row for row in rows if row["safe"] is not None]
    points = np.array([[row[name] for name in plan.names] for row in known]).reshape(-1, 2)
    safe = np.array([row["safe"] for row in known], dtype=bool)
    return tuple((tuple(a), tuple(b)) for a, b in safe_boundary(points, safe).tolist())


def _links(out: Path, case: str) -> list[tuple[str, str]]:
    given = {
        "scenario": f"cases/{case}{SUFFIX}",
        "OpenSCENARIO": f"cases/{case}.xosc",
        "report": f"runs/{case}/{layout.REPORT_FILE}",
    }
    return [(words, path) for words, path in given.items() if (out / path).is_file()]
