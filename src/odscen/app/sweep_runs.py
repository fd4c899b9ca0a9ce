"""Sweeps: a scenario run with many values of its parameters, a row for each, and where it is safe.

The folder of a sweep holds ``sweep.json`` (what is swept), ``scenario.json`` (the scenario with its
formulas), ``cases/`` (each case as a scenario of numbers only), ``runs/`` (a run folder for each),
``cases.parquet`` (a row for each) and ``sweep.html``. The table is made from the run folders, so a
sweep that was interrupted gives the same bytes when it has been resumed.
"""

from __future__ import annotations

import json
import time
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Final

from odscen.app.runs import check_run, run_all
from odscen.app.scenarios import SUFFIX, scenario_name
from odscen.base.durations import clock
from odscen.base.errors import ConflictError, InputError, ScenarioError, in_file
from odscen.base.folder_locks import locked
from odscen.base.stored_files import read_document
from odscen.base.system_errors import disk_errors
from odscen.base.text_files import write_text
from odscen.results.measures.registry import run_figure
from odscen.results.records.outcomes import RunStatus
from odscen.results.records.run_records import events_from_json
from odscen.results.sweeps.safe_boundary import safe_boundary
from odscen.results.sweeps.sweep_page import SweepShown, sweep_page
from odscen.results.sweeps.sweep_rows import OUTCOME, limit_from_text, outcome_of
from odscen.scenario.document.json_form import dumps, loads
from odscen.scenario.sweeps.sweep_plan import concrete, plan_from_data
from odscen.sumo.folder import layout
from odscen.sumo.folder.finished_run import Run
from odscen.sumo.folder.recorded import read_conflicts
from odscen.sumo.realize.recording import Recording
from odscen.sumo.realize.run_settings import RunSettings

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Mapping, Sequence
    from pathlib import Path

    import polars as pl

    from odscen.app.runs import CheckedRun
    from odscen.results.sweeps.sweep_rows import Limit
    from odscen.scenario.document.scenario_document import Scenario
    from odscen.scenario.sweeps.sweep_plan import SweepPlan
    from odscen.sumo.runner.run_jobs import RunJob
    from odscen.sumo.worker.protocol import Progress
    from odscen.workspace.store import Workspace

FORMAT: Final = "odscen-sweep"
VERSION: Final = 1
SWEEP_FILE, SCENARIO_FILE, TABLE_FILE, PAGE_FILE = (
    "sweep.json", "scenario.json", "cases.parquet", "sweep.html",
)  # fmt: skip
_WATCHES_CLOSENESS = Recording(emissions=False, criticality=True)


@dataclass(frozen=True, slots=True)
class SweepSettings:
    """How a sweep is run and judged.

    Attributes
    ----------
    safe
        Limits that a case needs to keep to be safe, besides no collision: ``min_ttc >= 1.5``.
    figures
        Figures of runs that are columns as well.
    own
        Columns of one's own: functions of a finished run.
    seed
        Of every run; the scenario's if not given.
    reports
        Whether each run has a report.
    """

    safe: Sequence[str] = ()
    figures: Sequence[str] = ()
    own: Mapping[str, Callable[[Run], float | None]] = field(default_factory=dict)
    seed: int | None = None
    reports: bool = False

    def to_dict(self) -> dict[str, Any]:
        """JSON-ready; columns of one's own by name."""
        return {
            "safe": list(self.safe),
            "figures": [*self.figures, *self.own],
            "seed": self.seed,
        }


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


def sweep(
    workspace: Workspace,
    scenario: Scenario,
    plan: SweepPlan,
    out: Path,
    *,
    settings: SweepSettings | None = None,
    processes: int = 1,
    tell: Callable[[str], None] | None = None,
    progress: Callable[[RunJob, Progress], None] | None = None,
    done: Callable[[int, int], None] | None = None,
) -> Sweep:
    """Run every case of a plan; cases that ``out`` has from an earlier, interrupted time are kept.

    Parameters
    ----------
    scenario
        With the parameters.
    out
        Folder of the sweep.
    processes
        How many run at a time.
    tell
        Called with how many cases there are, and, after the first, with what the rest will take.
    progress, done
        Called from the threads that wait for runs; ``done`` with how many of how many have ended.

    Raises
    ------
    InputError
        If a parameter, limit or figure is unknown, or no case can be run.
    ConflictError
        If another sweep is in ``out``.
    """
    settings = settings or SweepSettings()
    limits = _limits(settings)
    _refuse_unknown(plan, scenario)
    with disk_errors(f"sweep {out}"), locked(out, what=f"sweep {out.name!r}"):
        cases = _named(plan)
        _begin(out, scenario, plan, settings)
        checked, refused = _checked(workspace, scenario, cases, out, settings)
        left = [run for run in checked if not _is_done(run.folder)]
        if tell is not None:
            tell(_first_words(len(cases), len(refused), len(left), plan))
        _run(left, len(checked), processes, settings, tell=tell, progress=progress, done=done)
        rows = _rows(scenario, cases, refused, out, settings, limits)
        return _written(out, scenario, plan, rows, limits)


def read_sweep(out: Path) -> tuple[Scenario, SweepPlan, dict[str, Any]]:
    """Read what a folder sweeps, and how it is judged.

    Raises
    ------
    InputError
        If there is no sweep.
    """
    file = out / SWEEP_FILE
    if not file.is_file():
        msg = "no sweep is here: it has no sweep.json"
        raise InputError(msg, file=str(out))
    with in_file(str(file)):
        data = read_document(file.read_bytes(), form=FORMAT, version=VERSION, what="a sweep")
        plan = plan_from_data(data["plan"])
    text = (out / SCENARIO_FILE).read_bytes()
    return loads(text, file=str(out / SCENARIO_FILE)), plan, data["settings"]


def _limits(settings: SweepSettings) -> tuple[Limit, ...]:
    for name in settings.figures:
        if run_figure(name) is None:
            msg = f"no figure of runs is called {name!r}"
            raise InputError(msg)
    columns = [*OUTCOME, *settings.figures, *settings.own]
    return tuple(limit_from_text(text, columns) for text in settings.safe)


def _refuse_unknown(plan: SweepPlan, scenario: Scenario) -> None:
    for name in plan.names:
        if name not in scenario.parameters:
            known = ", ".join(scenario.parameters) or "none"
            msg = f"the scenario has no parameter {name!r}; it has {known}"
            raise InputError(msg)


def _named(plan: SweepPlan) -> dict[str, dict[str, float]]:
    """Values of each case by its name, ``case-001``; names sort as the cases do."""
    cases = plan.cases()
    digits = max(3, len(str(len(cases))))
    return {f"case-{number:0{digits}}": values for number, values in enumerate(cases, start=1)}


def _begin(out: Path, scenario: Scenario, plan: SweepPlan, settings: SweepSettings) -> None:
    """Write what is swept, or refuse a folder that holds another sweep."""
    head = {"format": FORMAT, "version": VERSION}
    said = head | {"plan": plan.to_dict(), "settings": settings.to_dict()}
    text = json.dumps(said, indent=2, ensure_ascii=False) + "\n"
    own = dumps(scenario)
    files = {SWEEP_FILE: text, SCENARIO_FILE: own}
    there = {name: out / name for name in files if (out / name).is_file()}
    for name, file in there.items():
        if file.read_text(encoding="utf-8") != files[name]:
            msg = f"{out} holds another sweep ({name} differs); name another folder"
            raise ConflictError(msg)
    for name in files.keys() - there.keys():
        write_text(out / name, files[name])


def _checked(
    workspace: Workspace,
    scenario: Scenario,
    cases: Mapping[str, Mapping[str, float]],
    out: Path,
    settings: SweepSettings,
) -> tuple[list[CheckedRun], dict[str, str]]:
    """Each case as a run, and those that are not possible with the reason."""
    entry = workspace.map_for(scenario.map.name, scenario.map.sha256)
    given = RunSettings(seed=settings.seed, recording=_WATCHES_CLOSENESS)
    runs, refused = [], {}
    for name, values in cases.items():
        try:
            case = concrete(scenario, values, name=name)
            run = check_run(
                workspace, case, name=name, out=out / "runs", settings=given, entry=entry
            )
        except ScenarioError as error:
            refused[name] = "; ".join([error.problem, *error.problems])
            continue
        file = out / "cases" / f"{name}{SUFFIX}"
        if not file.is_file():
            write_text(file, dumps(case))
        runs.append(run)
    if not runs:
        first = next(iter(refused.values()))
        msg = f"no case of the sweep can be run: {first}"
        raise InputError(msg)
    return runs, refused


def _is_done(folder: Path) -> bool:
    try:
        return Run.open(folder).status is RunStatus.COMPLETED
    except InputError:
        return False


def _first_words(cases: int, refused: int, left: int, plan: SweepPlan) -> str:
    words = f"{cases} cases of {', '.join(plan.names)}"
    if refused:
        words += f", {refused} of them not possible"
    return f"{words}; {left} to run" if left < cases - refused else words


def _run(
    left: Sequence[CheckedRun],
    count: int,
    processes: int,
    settings: SweepSettings,
    *,
    tell: Callable[[str], None] | None,
    progress: Callable[[RunJob, Progress], None] | None,
    done: Callable[[int, int], None] | None,
) -> None:
    """Run the first case alone, say what the others will take, and run them."""
    ended = count - len(left)

    def one_more(_job: RunJob, _run: Run) -> None:
        nonlocal ended
        ended += 1
        if done is not None:
            done(ended, count)

    for these in (left[:1], left[1:]):
        if not these:
            continue
        began = time.monotonic()
        run_all(
            these,
            processes=processes,
            reports=settings.reports,
            progress=progress,
            done=one_more,
        )
        if these[0] is left[0] and len(left) > 1 and tell is not None:
            spent = time.monotonic() - began
            disk = sum(f.stat().st_size for f in these[0].folder.rglob("*") if f.is_file())
            rest = len(left) - 1
            tell(
                f"the first took {spent:.1f} s and {disk / 1e6:.1f} MB: about "
                f"{clock(rest * spent / processes + 59)} h and {rest * disk / 1e6:,.0f} MB for the "
                f"other {rest}"
            )


def _rows(
    scenario: Scenario,
    cases: Mapping[str, Mapping[str, float]],
    refused: Mapping[str, str],
    out: Path,
    settings: SweepSettings,
    limits: Sequence[Limit],
) -> list[dict[str, Any]]:
    watched = watched_actors(scenario)
    rows = []
    for name, values in cases.items():
        row: dict[str, Any] = {"case": name, "status": "refused", "safe": None}
        row |= {"detail": refused.get(name), **values}
        measured = dict.fromkeys([*OUTCOME, *settings.figures, *settings.own])
        if name not in refused:
            run = Run.open(out / "runs" / name)
            row["status"] = str(run.status)
            if run.status is RunStatus.COMPLETED:
                measured = _measured(run, settings, watched)
                row["safe"] = not measured["collision"] and all(
                    limit.holds(measured) for limit in limits
                )
            else:
                row["detail"] = str(run.summary["error"])
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
        found[name] = None if entry is None else entry.of_summary(run.summary)
    return found | {name: function(run) for name, function in settings.own.items()}


def _written(
    out: Path,
    scenario: Scenario,
    plan: SweepPlan,
    rows: Sequence[Mapping[str, Any]],
    limits: Sequence[Limit],
) -> Sweep:
    import numpy as np
    import polars as pl

    texts, flags = {"case", "status", "detail"}, {"safe", "collision"}
    schema = {
        name: pl.String if name in texts else pl.Boolean if name in flags else pl.Float64
        for name in rows[0]
    }
    table = pl.DataFrame(rows, schema=schema, orient="row")
    part = out / f".{TABLE_FILE}.part"
    table.write_parquet(part)
    part.replace(out / TABLE_FILE)
    boundary: tuple[Any, ...] = ()
    if len(plan.names) == 2:
        known = [row for row in rows if row["safe"] is not None]
        points = np.array([[row[name] for name in plan.names] for row in known]).reshape(-1, 2)
        safe = np.array([row["safe"] for row in known], dtype=bool)
        boundary = tuple((tuple(a), tuple(b)) for a, b in safe_boundary(points, safe).tolist())
    shown = SweepShown(
        scenario_name(scenario),
        {name: scenario.parameters[name].unit for name in plan.names},
        ["no collision", *map(str, limits)],
        rows,
        {row["case"]: _links(out, row["case"]) for row in rows},
    )
    write_text(out / PAGE_FILE, sweep_page(shown))
    return Sweep(out, table, boundary)


def _links(out: Path, case: str) -> list[tuple[str, str]]:
    given = {"scenario": f"cases/{case}{SUFFIX}", "report": f"runs/{case}/{layout.REPORT_FILE}"}
    return [(words, path) for words, path in given.items() if (out / path).is_file()]
