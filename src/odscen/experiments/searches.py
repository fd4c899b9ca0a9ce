"""Search for critical cases of a scenario: propose some, run them, learn from them, propose more.

The folder is like that of a sweep, with ``search.json`` instead of ``sweep.json`` and
``criticals.json``, the archive. What is proposed depends on the seed and on what came of the cases
before, so a search that was interrupted proposes the same again, finds their runs there, and goes
on.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from itertools import combinations
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from odscen.base.checksums import seal_files, unseal_files
from odscen.base.errors import InputError
from odscen.base.folder_locks import locked
from odscen.base.given_files import as_path
from odscen.base.system_errors import disk_errors
from odscen.base.text_files import write_text
from odscen.experiments.closeness import criticality
from odscen.experiments.journal import KeptRuns
from odscen.experiments.sweeps import (
    ARCHIVE_FILE,
    CaseRuns,
    SweepSettings,
    begin_folder,
    has_completed,
    refuse_unknown,
    write_cases,
)
from odscen.experiments.table import SEARCH
from odscen.experiments.work import LocalExecutor
from odscen.runs import layout
from odscen.scenario.sweeps.sweep_plan import MOST_CASES, SweepPlan, proposal_kind

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from pathlib import Path

    import polars as pl

    from odscen.base.arrays import FloatArray
    from odscen.base.given_files import GivenPath
    from odscen.maps.store import Workspace
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
_SUMMARIES: Final = f"runs/case-*/{layout.SUMMARY_FILE}"
SEARCH_FILE: Final = "search.json"


@dataclass(frozen=True, slots=True)
class SearchSettings:
    """How a search goes on.

    Attributes
    ----------
    method
        A kind of :data:`~odscen.scenario.sweeps.sweep_plan.PROPOSALS` that takes a number of cases.
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
        if not proposal_kind(self.method).counted:
            raise InputError(f"method {self.method} takes no number of runs; sweep has it")
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
        see :func:`odscen.experiments.searches.pair_coverage`.
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
    out: GivenPath,
    *,
    search_settings: SearchSettings,
    settings: SweepSettings | None = None,
    processes: int = 1,
    check: Callable[[], None] | None = None,
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
    check
        Called now and then while runs are waited for; what it raises ends them.
    done
        Called with how many of how many have ended.

    Raises
    ------
    InputError
        If a parameter, limit, figure or method is unknown.
    ConflictError
        If another search is in ``out``.
    MissingDependencyError
        If the method needs a package that is not installed.
    """
    settings, out = settings or SweepSettings(), as_path(out)
    cases = CaseRuns(scenario, out, settings, table=SEARCH)
    plan = SweepPlan(
        tuple(axes), search_settings.method, search_settings.runs, search_settings.seed
    )
    refuse_unknown(plan.names, scenario)
    proposer = proposal_kind(plan.method).start(plan)
    with disk_errors(f"search {out}"), locked(out, what=f"search {out.name!r}"):
        description = _describe_search(plan, search_settings, settings)
        begin_folder(out, {SEARCH_FILE: description}, scenario, what="search")
        executor = LocalExecutor(workspace, processes, check)
        looking = _SearchState(workspace, scenario, plan, out, cases, executor, done)
        while (left := search_settings.runs - len(looking.rows)) > 0:
            places = proposer.ask(min(search_settings.batch, left))
            proposer.tell(looking.run(places))
        return looking.found()


class _SearchState:
    """Cases that have been run so far."""

    def __init__(
        self,
        workspace: Workspace,
        scenario: Scenario,
        plan: SweepPlan,
        out: Path,
        case_runs: CaseRuns,
        executor: LocalExecutor,
        done: Callable[[int, int], None] | None,
    ) -> None:
        self.rows: list[dict[str, Any]] = []
        self._workspace, self._scenario, self._out = workspace, scenario, out
        self._plan, self._case_runs, self._executor = plan, case_runs, executor
        self._done = done
        self._places: list[list[float]] = []
        # Of the folder as it is: what an interrupted search has, whatever is asked for next.
        self._record = KeptRuns(file.parent.name for file in out.glob(_SUMMARIES))

    def run(self, places: FloatArray) -> list[float | None]:
        """Run cases at places of the unit cube; how critical each was, ``None``: not possible."""
        count = self._plan.samples or 0
        digits = max(3, len(str(count)))
        cases = {}
        for number, place in enumerate(places.tolist(), start=len(self.rows) + 1):
            cases[f"case-{number:0{digits}}"] = self._plan.values_at(place)
        checked = self._case_runs.check(self._workspace, cases)
        left = [run for run in checked if not has_completed(run.folder)]
        self._case_runs.run(self._executor, left, self._record, count=count, done=self._done)
        rows = self._case_runs.rows(cases)
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
            self._out,
            self._scenario,
            self._plan.names,
            rows=self.rows,
            limits=self._case_runs.limits,
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
        unseal_files(self._out, (ARCHIVE_FILE,))
        write_text(self._out / ARCHIVE_FILE, text)
        seal_files(self._out, (ARCHIVE_FILE,))
        return found


def _describe_search(
    plan: SweepPlan, how: SearchSettings, settings: SweepSettings
) -> dict[str, Any]:
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
