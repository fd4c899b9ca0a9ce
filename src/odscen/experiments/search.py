"""Search for critical cases of a scenario: propose some, run them, learn from them, propose more.

The folder is like that of a sweep, with ``search.json`` instead of ``sweep.json`` and
``criticals.json``, the archive. What is proposed depends on the seed and on what came of the cases
before, so a search that was interrupted proposes the same again, finds their runs there, and goes
on.
"""

from __future__ import annotations

import json
from dataclasses import dataclass, replace
from itertools import combinations
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from odscen.app.running.batches import run_all
from odscen.base.errors import InputError
from odscen.base.folder_locks import locked
from odscen.base.system_errors import disk_errors
from odscen.base.text_files import write_text
from odscen.experiments.proposals import proposer_of
from odscen.experiments.sweep_rows import Closeness, closeness_of, criticality
from odscen.experiments.sweeps import (
    SweepSettings,
    begin_folder,
    checked_cases,
    has_completed,
    limits_of,
    refuse_unknown,
    rows_of,
    watched_actors,
    write_cases,
)
from odscen.records.run_plan import Plan
from odscen.runs import layout
from odscen.runs.reporter import Reporter
from odscen.scenario.sweeps.sweep_plan import MOST_CASES, SweepPlan

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Sequence
    from pathlib import Path

    import polars as pl

    from odscen.base.arrays import FloatArray
    from odscen.experiments.sweep_rows import Limit
    from odscen.maps.store import Workspace
    from odscen.runs.finished_run import Run
    from odscen.scenario.document.scenario_document import Scenario
    from odscen.scenario.sweeps.sweep_plan import Range, Table


DISTINCT: Final = 0.1
"""Share of a range by which two cases differ in some parameter if they are not the same again."""
CELLS: Final = 5
"""Parts of each range in which coverage is counted."""


def distinct(places: FloatArray, scores: Sequence[float], *, apart: float = DISTINCT) -> list[int]:
    """Rows of an archive: the most critical of cases that are alike.

    Parameters
    ----------
    places
        Critical cases in the unit cube, shape ``(cases, axes)``.
    scores
        How critical each is; the earlier of two that are equal is kept.
    apart
        Two cases are alike if no share differs by so much.

    Returns
    -------
    list of int
        Rows in order, so that any two are ``apart`` and every other case is like one of them.
    """
    kept: list[int] = []
    for row in sorted(range(len(places)), key=lambda row: (-scores[row], row)):
        away = np.abs(places[kept] - places[row]).max(axis=1) if kept else np.array([1.0])
        if np.all(away >= apart):
            kept.append(row)
    return sorted(kept)


def pair_coverage(places: FloatArray, *, cells: int = CELLS) -> float:
    """Share of the cells of all planes of two axes in which a case lies; of one axis, of its parts.

    Each axis has ``cells`` equal parts. It is the share of pairs of values that were tried, as in
    combinatorial testing of strength two; ``n`` cases cover at most ``n`` cells of a plane.
    """
    if not len(places):
        return 0.0
    parts = np.minimum((places * cells).astype(np.int64), cells - 1)
    axes = places.shape[1]
    if axes == 1:
        return len(np.unique(parts)) / cells
    found = [len(np.unique(parts[:, [a, b]], axis=0)) for a, b in combinations(range(axes), 2)]
    return float(np.mean(found)) / cells**2


FORMAT: Final = "odscen-search"
VERSION: Final = 1
SEARCH_FILE, ARCHIVE_FILE = "search.json", "criticals.json"


@dataclass(frozen=True, slots=True)
class SearchSettings:
    """How a search goes on.

    Attributes
    ----------
    method
        ``random``, ``latin`` or ``tpe``.
    runs
        How many cases, at most :data:`~odscen.scenario.sweeps.sweep_plan.MOST_CASES`.
    batch
        How many cases are proposed before the first of them is run; a part of the search, other
        than how many run at a time.
    seed
        Of the proposals.
    """

    method: str = "tpe"
    runs: int = 100
    batch: int = 4
    seed: int = 0

    def __post_init__(self) -> None:
        for name, most in (("runs", MOST_CASES), ("batch", MOST_CASES)):
            value = getattr(self, name)
            if not 1 <= value <= most:
                raise InputError(f"{name} must lie between 1 and {most:,}, not {value}")


@dataclass(frozen=True, slots=True, eq=False)
class SearchResult:
    """What a search has found.

    Attributes
    ----------
    folder
        With all files.
    table
        A row for each case, as of a sweep, with ``clearance`` and ``conflict_distance`` (m) and
        ``criticality``.
    critical
        Names of the cases that are not safe.
    archive
        Those of them that differ, the most critical of any that are alike.
    coverage
        Share of pairs of values that were tried,
        see :func:`odscen.experiments.search.pair_coverage`.
    """

    folder: Path
    table: pl.DataFrame
    critical: tuple[str, ...]
    archive: tuple[str, ...]
    coverage: float


def search(
    workspace: Workspace,
    scenario: Scenario,
    axes: Sequence[Range | Table],
    out: Path,
    *,
    search_settings: SearchSettings,
    settings: SweepSettings | None = None,
    processes: int = 1,
    done: Callable[[int, int], None] | None = None,
) -> SearchResult:
    """Look for cases that are not safe; what ``out`` has from an interrupted search is kept.

    Parameters
    ----------
    scenario
        With the parameters.
    axes
        What is varied, and between which bounds.
    out
        Folder of the search.
    settings
        How a case is run and judged.
    processes
        How many run at a time.
    done
        Called from the threads that wait for runs, with how many of how many have ended.

    Raises
    ------
    InputError
        If a parameter, limit, figure or method is unknown.
    ConflictError
        If another search is in ``out``.
    MissingDependencyError
        If the method needs a package that is not installed.
    """
    settings = settings or SweepSettings()
    watched = watched_actors(scenario)
    own = {name: _measure(name, watched) for name in Closeness._fields}
    judged = replace(settings, own={**settings.own, **own})
    limits = limits_of(judged)
    plan = SweepPlan(tuple(axes), "random", search_settings.runs, search_settings.seed)
    refuse_unknown(plan.names, scenario)
    proposer = proposer_of(
        search_settings.method,
        axes=len(plan.axes),
        runs=search_settings.runs,
        seed=search_settings.seed,
    )
    with disk_errors(f"search {out}"), locked(out, what=f"search {out.name!r}"):
        said = _said(plan, search_settings, settings)
        begin_folder(out, {SEARCH_FILE: said}, scenario, what="search")
        looking = _Looking(workspace, scenario, plan, out, judged, limits, processes, done)
        while (left := search_settings.runs - len(looking.rows)) > 0:
            places = proposer.ask(min(search_settings.batch, left))
            proposer.tell(looking.run(places))
        return looking.found()


class _Looking(Reporter):
    """Cases that have been run so far."""

    def __init__(
        self,
        workspace: Workspace,
        scenario: Scenario,
        plan: SweepPlan,
        out: Path,
        settings: SweepSettings,
        limits: Sequence[Limit],
        processes: int,
        done: Callable[[int, int], None] | None,
    ) -> None:
        self.rows: list[dict[str, Any]] = []
        self._settings = settings
        self._workspace, self._scenario, self._out = workspace, scenario, out
        self._plan, self._limits, self._processes, self._done = plan, limits, processes, done
        self._places: list[list[float]] = []

    def run(self, places: FloatArray) -> list[float | None]:
        """Run cases at places of the unit cube; how critical each was, ``None``: not possible."""
        digits = max(3, len(str(self._plan.samples)))
        cases = {}
        for number, place in enumerate(places.tolist(), start=len(self.rows) + 1):
            parts = [axis.at(share) for axis, share in zip(self._plan.axes, place, strict=True)]
            values = (value for part in parts for value in part)
            cases[f"case-{number:0{digits}}"] = dict(zip(self._plan.names, values, strict=True))
        checked, refused = checked_cases(
            self._workspace, self._scenario, cases, self._out, self._settings
        )
        run_all(
            [run for run in checked if not has_completed(run.folder)],
            processes=self._processes,
            reports=self._settings.reports,
            reporter=self,
        )
        rows = rows_of(
            self._scenario,
            cases,
            self._out,
            refused=refused,
            settings=self._settings,
            limits=self._limits,
        )
        for row in rows:
            row["criticality"] = None if row["safe"] is None else criticality(row)
        self._places += places.tolist()
        self.rows += rows
        return [row["criticality"] for row in rows]

    def found(self) -> SearchResult:
        """Write the table, the page and the archive."""
        places = np.array(self._places).reshape(len(self.rows), -1)
        critical = [k for k, row in enumerate(self.rows) if row["safe"] is False]
        scores = [self.rows[k]["criticality"] for k in critical]
        kept = [critical[k] for k in distinct(places[critical], scores)]
        table = write_cases(
            self._out, self._scenario, self._plan.names, rows=self.rows, limits=self._limits
        )
        found = SearchResult(
            folder=self._out,
            table=table,
            critical=tuple(self.rows[k]["case"] for k in critical),
            archive=tuple(self.rows[k]["case"] for k in kept),
            coverage=pair_coverage(places),
        )
        archive = {
            "format": "odscen-criticals",
            "version": VERSION,
            "runs": len(self.rows),
            "critical": list(found.critical),
            "coverage": round(found.coverage, 6),
            "archive": [self.rows[k] for k in kept],
        }
        text = json.dumps(archive, indent=2, ensure_ascii=False) + "\n"
        write_text(self._out / ARCHIVE_FILE, text)
        return found

    def finished(self, run: Run) -> None:
        """Say how many have ended."""
        del run
        if self._done is not None:
            ended = len([*(self._out / "runs").glob(f"case-*/{layout.SUMMARY_FILE}")])
            self._done(ended, self._plan.samples or 0)


def _said(plan: SweepPlan, how: SearchSettings, settings: SweepSettings) -> dict[str, Any]:
    """What ``search.json`` says."""
    return {
        "format": FORMAT,
        "version": VERSION,
        "vary": plan.to_dict()["vary"],
        "method": how.method,
        "runs": how.runs,
        "batch": how.batch,
        "seed": how.seed,
        "settings": settings.to_dict(),
    }


def _measure(name: str, watched: Collection[str] | None) -> Callable[[Run], float | None]:
    """A column that :class:`Closeness` has a value for."""

    def measured(run: Run) -> float | None:
        value: float | None = getattr(_closeness(run, watched), name)
        return value

    return measured


def _closeness(run: Run, watched: Collection[str] | None) -> Closeness:
    try:
        trajectories = run.trajectories()
    except InputError:  # nobody was on the road
        return Closeness(None, None)
    text = (run.folder / layout.PLAN_FILE).read_text(encoding="utf-8")
    bodies = {one.id: (one.length, one.width) for one in Plan.from_json(text).actors}
    return closeness_of(trajectories, bodies, watched)
