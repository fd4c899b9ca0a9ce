"""Studies: begun, resumed, extended, and how far they are.

>>> begin_study(workspace, Path("morning.study.toml"), Path("morning-study"))
>>> ended = carry_out_study(Path("morning-study"), LocalExecutor(workspace, processes=2))
>>> ended.table.group_by("variant").agg(pl.col("mean_delay").mean())

The folder: ``study.json`` has the plan with its scenarios, ``scenarios/`` the documents,
``journal.jsonl`` and ``rows/`` the runs that have ended, ``results.parquet`` the table, ``runs/``
the run folders that are kept, and ``study.html`` the report.
"""

from __future__ import annotations

import json
from collections import Counter
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from odscen.app.scenarios import SUFFIX
from odscen.base.atomic_folders import clear_leftovers, new_folder
from odscen.base.checksums import (
    SUMS_FILE,
    check_files,
    digest,
    read_checked,
    seal,
    seal_files,
    unseal_files,
    unsealed,
    write_sums,
)
from odscen.base.errors import ConflictError, InputError, in_file
from odscen.base.folder_locks import is_locked, locked
from odscen.base.given_files import as_path
from odscen.base.stored_files import documents, read_document
from odscen.base.system_errors import disk_errors
from odscen.base.text_files import write_text
from odscen.experiments.journal import StudyJournal, read_rows
from odscen.experiments.plan import (
    AS_DESIGNED,
    ScenarioSource,
    StudyPlan,
    found_sources,
    grid_of,
    read_study_plan,
    refuse_other,
)
from odscen.experiments.table import REFUSED, refuse_taken_names, study_table
from odscen.experiments.work import LocalExecutor, WorkOrder, carry_out, unpacked, versions
from odscen.records.outcomes import RunStatus
from odscen.scenario.document.problems import validated

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping

    import polars as pl

    from odscen.base.given_files import GivenPath
    from odscen.experiments.journal import Rows
    from odscen.experiments.plan import StudyGrid, StudyRun
    from odscen.experiments.work import Executor, Outcome
    from odscen.maps.store import Workspace


FORMAT: Final = "odscen-study"
VERSION: Final = 1
STUDY_FILE: Final = "study.json"
TABLE_FILE: Final = "results.parquet"
PAGE_FILE: Final = "study.html"
RUNS_FOLDER: Final = "runs"
_SCENARIOS: Final = "scenarios"


def is_study(folder: Path) -> bool:
    """Whether a folder holds a study."""
    return (folder / STUDY_FILE).is_file()


def write_study(folder: Path, grid: StudyGrid) -> None:
    """Write what a study runs; documents first, so that a study that is there is whole."""
    rows = []
    configs = _number_configs(grid)
    for source in grid.sources.values():
        row: dict[str, Any] = {
            "name": source.name,
            "map": source.map_name,
            "map_sha256": source.map_sha256,
        }
        if source.text is None:
            row |= {"seed": source.seed, "config": configs[json.dumps(source.config)]}
        else:
            row["sha256"] = digest(source.text.encode())
            write_text(folder / _SCENARIOS / f"{source.name}{SUFFIX}", source.text)
        rows.append(row)
    data = {
        "format": FORMAT,
        "version": VERSION,
        "versions": versions(),
        "plan": grid.plan.model_dump(mode="json"),
        "configs": [json.loads(text) for text in _number_configs(grid)],
        "scenarios": rows,
    }
    if not (folder / STUDY_FILE).is_file():
        write_sums(folder, {})  # of what follows; rows of its journal carry their own
    write_text(folder / STUDY_FILE, seal(data, indent=1))


def _number_configs(grid: StudyGrid) -> dict[str, int]:
    """Configurations of sampling, each once, with its number."""
    each = (
        json.dumps(source.config) for source in grid.sources.values() if source.config is not None
    )
    return {text: number for number, text in enumerate(dict.fromkeys(each))}


def read_study(folder: Path) -> StudyGrid:
    """Read what a study runs.

    Raises
    ------
    InputError
        If there is no study, or it cannot be read.
    DamagedError
        If it is not as it was written.
    """
    data = _read_document(folder)
    with in_file(str(folder / STUDY_FILE)), documents("a study"):
        plan = validated(StudyPlan, data["plan"])
        configs = data["configs"]
        sources = {row["name"]: _read_source(folder, row, configs) for row in data["scenarios"]}
    return grid_of(plan, sources)


def _read_document(folder: Path) -> dict[str, Any]:
    file = folder / STUDY_FILE
    if not file.is_file():
        raise InputError(f"no study is here: it has no {STUDY_FILE}", file=str(folder))
    with in_file(str(file)):
        read_document(file.read_bytes(), form=FORMAT, version=VERSION, what="a study")
    return unsealed(file)


def _read_source(folder: Path, row: Mapping[str, Any], configs: list[Any]) -> ScenarioSource:
    name, about = str(row["name"]), (str(row["map"]), str(row["map_sha256"]))
    if "config" in row:
        return ScenarioSource(name, *about, seed=int(row["seed"]), config=configs[row["config"]])
    file = f"{_SCENARIOS}/{name}{SUFFIX}"
    known = {file: str(row["sha256"])} if "sha256" in row else None
    text = read_checked(folder, file, known).decode()
    return ScenarioSource(name, *about, text=text)


def refuse_other_odscen(folder: Path) -> None:
    """Refuse to add to a study that another odscen or SUMO has begun.

    Raises
    ------
    ConflictError
        Names both versions.
    """
    theirs, ours = _read_document(folder).get("versions", {}), versions()
    for name, own in ours.items():
        if theirs.get(name) != own:
            raise ConflictError(
                f"{folder} was begun with {name} {theirs.get(name)}, this is {own}: "
                "its table would hold both; run the plan in another folder"
            )


def write_table(folder: Path, grid: StudyGrid, rows: Rows) -> pl.DataFrame:
    """Write the table whole; equal rows give equal bytes, in whatever order they came."""
    table = study_table(grid, rows)
    part = folder / f".{TABLE_FILE}.part"
    unseal_files(folder, (TABLE_FILE,))
    table.write_parquet(part)
    part.replace(folder / TABLE_FILE)
    if (folder / SUMS_FILE).is_file():
        seal_files(folder, (TABLE_FILE,))
    return table


@dataclass(frozen=True, slots=True)
class StudyState:
    """How far a study is.

    Attributes
    ----------
    runs
        How many there are.
    counts
        Runs that have ended, by status: ``completed``, ``failed``, ``refused``.
    problems
        Why runs failed or were refused, most frequent first: pairs of words and how many.
    seconds
        Wall seconds that a run has taken, on average; ``None`` without any.
    active
        Whether a process works on it.
    """

    folder: Path
    name: str
    runs: int
    counts: Mapping[str, int]
    problems: tuple[tuple[str, int], ...]
    seconds: float | None
    active: bool

    @property
    def ended(self) -> int:
        """Runs that have ended."""
        return sum(self.counts.values())

    @property
    def done(self) -> bool:
        """Whether all have."""
        return self.ended == self.runs

    def to_dict(self) -> dict[str, Any]:
        """JSON-ready."""
        return {
            "folder": str(self.folder),
            "name": self.name,
            "runs": self.runs,
            "ended": self.ended,
            "done": self.done,
            "active": self.active,
            "counts": dict(self.counts),
            "seconds_per_run": self.seconds,
            "problems": [{"words": words, "runs": count} for words, count in self.problems],
        }


@dataclass(frozen=True, slots=True, eq=False)
class EndedStudy:
    """A study, or what has ended of one, with its table.

    Attributes
    ----------
    state
        How far it is: counts of runs by status, and why runs failed.
    table
        A row for each run that has ended, in the order of the plan: ``run``, ``scenario``,
        ``variant``, ``case``, ``seed``, ``map``, the parameters, ``status``, ``detail``,
        ``usable``, ``criteria``, and every figure of runs in its unit.
    """

    state: StudyState
    table: pl.DataFrame


def begin_study(workspace: Workspace, plan_file: Path, out: Path) -> StudyGrid:
    """Write what a plan runs into a folder; one that has the same plan stays as it is.

    Raises
    ------
    InputError
        If the plan, or a scenario of it, cannot be used.
    ConflictError
        If another study is in the folder.
    """
    return begin_study_of(workspace, read_study_plan(plan_file), out, beside=plan_file.parent)


def begin_study_of(workspace: Workspace, plan: StudyPlan, out: Path, *, beside: Path) -> StudyGrid:
    """Do as :func:`begin_study` with a plan whose files are relative to ``beside``."""
    grid = grid_of(plan, found_sources(plan, workspace, beside=beside))
    refuse_taken_names(grid.parameters)
    with disk_errors(f"study {out}"), locked(out, what=f"study {out.name!r}"):
        if is_study(out):
            old = read_study(out)
            refuse_other(old, grid)
            if grid.count != old.count:
                raise ConflictError(
                    f"{out} holds this study with {old.count:,} runs, the plan has "
                    f"{grid.count:,}: odscen study extend adds those that are new"
                )
            return old
        out.mkdir(parents=True, exist_ok=True)
        write_study(out, grid)
    return grid


def extend_study(
    workspace: Workspace, out: Path, plan: StudyPlan, *, beside: Path | None = None
) -> StudyGrid:
    """Add runs to a study: more seeds, scenarios, variants or cases; those it has stay.

    Parameters
    ----------
    plan
        The whole of it, as it is to be.
    beside
        Folder that files of the plan are relative to; ``None`` if its scenarios are the study's.

    Raises
    ------
    ConflictError
        If the plan leaves out or changes what the study has.
    """
    with disk_errors(f"study {out}"), locked(out, what=f"study {out.name!r}"):
        old = read_study(out)
        refuse_other_odscen(out)
        found = old.sources if beside is None else found_sources(plan, workspace, beside=beside)
        new = grid_of(plan, found)
        refuse_taken_names(new.parameters)
        refuse_other(old, new)
        write_study(out, new)
    return new


def run_experiment(
    workspace: Workspace,
    out: GivenPath,
    *,
    plan: StudyPlan | GivenPath,
    processes: int = 1,
    done: Callable[[int, int], None] | None = None,
) -> EndedStudy:
    """Run scenarios x variants x cases x seeds, or what is missing of them in a folder.

    Parameters
    ----------
    workspace
        Has the maps.
    out
        Folder of the study.
    plan
        What is run, or the file that says so; names of scenario files are relative to the file,
        else to the current folder.
    processes
        How many run at a time.
    done
        Called with how many of how many have ended.

    Returns
    -------
    EndedStudy
        Its state and table. A run that fails is a row of it.

    Raises
    ------
    InputError
        If the plan, or a scenario of it, cannot be used.
    ConflictError
        If another study is in the folder, or another process works on it.
    """
    folder = as_path(out)
    if isinstance(plan, StudyPlan):
        begin_study_of(workspace, plan, folder, beside=Path())
    else:
        begin_study(workspace, as_path(plan), folder)
    return carry_out_study(folder, LocalExecutor(workspace, processes), done=done)


def resume_experiment(
    workspace: Workspace,
    out: GivenPath,
    *,
    processes: int = 1,
    failed: bool = False,
    done: Callable[[int, int], None] | None = None,
) -> EndedStudy:
    """Run what is missing in the folder of an experiment; no run is made twice.

    Parameters
    ----------
    workspace
        Has the maps.
    out
        Folder of the study.
    processes
        How many run at a time.
    failed
        Whether runs that failed, or were not possible, are made again.
    done
        Called with how many of how many have ended.

    Returns
    -------
    EndedStudy
        Its state and table.

    Raises
    ------
    InputError
        If there is no study.
    ConflictError
        If another process works on it, or another odscen has begun it.
    """
    executor = LocalExecutor(workspace, processes)
    return carry_out_study(as_path(out), executor, again=failed, done=done)


def carry_out_study(
    out: Path,
    executor: Executor,
    *,
    target: str | None = None,
    again: bool = False,
    formats: tuple[str, ...] = (),
    take: Callable[[Outcome], None] | None = None,
    done: Callable[[int, int], None] | None = None,
) -> EndedStudy:
    """Carry out the runs of a study that have not ended, and write its table.

    Parameters
    ----------
    out
        Folder of a study that has been begun.
    executor
        Where they are carried out.
    target
        Folder or URL (as fsspec knows them) for run folders that are kept, as ``.tar``; the
        folder ``runs`` of the study if not given.
    again
        Runs those that failed or were refused again.
    formats
        Formats of ``odscen export`` that each run is exported to.
    take
        Called with the outcome of each run before its row is kept, so that what it writes is there
        for every row, also after a kill.
    done
        Called with how many of how many have ended.

    Raises
    ------
    InputError
        If there is no study.
    ConflictError
        If another process works on it, or another odscen has begun it.
    """
    with disk_errors(f"study {out}"), locked(out, what=f"study {out.name!r}"):
        grid = read_study(out)
        refuse_other_odscen(out)
        if (out / SUMS_FILE).is_file():
            check_files(out, may_miss=(TABLE_FILE,))
        clear_leftovers(out)
        with StudyJournal(out) as journal:
            if again:
                journal.forget(
                    name
                    for name, row in journal.rows.items()
                    if row["status"] != RunStatus.COMPLETED
                )
            orders = StudyOrders(grid, journal.rows, target=target, formats=formats)
            carry_out(
                executor.outcomes(orders),
                journal,
                count=grid.count,
                take=lambda outcome: _keep_outcome(out, outcome, take),
                done=done,
            )
            table = write_table(out, grid, journal.rows)
        state = _study_state(out, grid, journal.rows, active=False)
    return EndedStudy(state, table)


def _keep_outcome(out: Path, outcome: Outcome, more: Callable[[Outcome], None] | None) -> None:
    """Keep what a run has given beside its row."""
    if outcome.folder is not None:
        with new_folder(out / RUNS_FOLDER / outcome.name) as folder:
            unpacked(outcome.folder, folder)
    if more is not None:
        more(outcome)


class StudyOrders:
    """Runs of a study that have not ended, as orders.

    Parameters
    ----------
    ended
        Names of those that have.
    target
        For run folders that are kept.
    formats
        That each run is exported to.
    """

    def __init__(
        self,
        grid: StudyGrid,
        ended: Mapping[str, object],
        *,
        target: str | None = None,
        formats: tuple[str, ...] = (),
    ) -> None:
        known = set(ended)
        self._grid = grid
        self._target = target
        self._formats = formats
        self._left: Iterator[StudyRun] = (run for run in grid.runs() if run.name not in known)
        self._variants = {variant.name: variant.edits for variant in grid.plan.variant} | {
            AS_DESIGNED: ()
        }

    def next(self, most: int) -> WorkOrder | None:
        """An order of at most so many runs; ``None`` when there are no more."""
        runs = tuple(islice(self._left, most))
        if not runs:
            return None
        grid = self._grid
        sources: dict[str, ScenarioSource] = {
            run.scenario: grid.sources[run.scenario] for run in runs
        }
        return WorkOrder(
            tuple((run, grid.values(run.case)) for run in runs),
            sources,
            {run.variant: self._variants[run.variant] for run in runs},
            grid.plan.run,
            grid.plan.keep,
            self._target,
            self._formats,
            versions(),
        )


def study_state(out: Path) -> StudyState:
    """How far a study is, whether a process works on it or not.

    Raises
    ------
    InputError
        If there is no study.
    """
    return _study_state(out, read_study(out), read_rows(out), active=is_locked(out))


def study_results(out: GivenPath) -> EndedStudy:
    """Read the table of a study, of all runs that have ended by now.

    Parameters
    ----------
    out
        Folder of the study.

    Returns
    -------
    EndedStudy
        Its state and table; another process may work on it.

    Raises
    ------
    InputError
        If there is no study.
    """
    folder = as_path(out)
    grid, rows = read_study(folder), read_rows(folder)
    state = _study_state(folder, grid, rows, active=is_locked(folder))
    return EndedStudy(state, study_table(grid, rows))


def _study_state(
    out: Path, grid: StudyGrid, rows: Mapping[str, Mapping[str, Any]], *, active: bool
) -> StudyState:
    names = {run.name for run in grid.runs()}
    own = [row for name, row in rows.items() if name in names]
    counts = Counter(str(row["status"]) for row in own)
    problems = Counter(str(row["detail"]) for row in own if row["status"] != RunStatus.COMPLETED)
    seconds = [float(row["seconds"]) for row in own if "seconds" in row]
    return StudyState(
        out,
        grid.plan.name,
        grid.count,
        {name: counts.get(name, 0) for name in ("completed", "failed", REFUSED)},
        tuple(problems.most_common()),
        sum(seconds) / len(seconds) if seconds else None,
        active,
    )
