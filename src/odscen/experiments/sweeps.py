"""Sweeps: a scenario run with many values of its parameters, or what is missing of them.

The folder: ``sweep.json`` (what is swept, and how it is judged), ``scenario.json`` (the scenario
with its formulas), ``cases/`` (each case as a scenario of numbers only), ``runs/`` (a run folder
for each), ``cases.parquet`` (a row for each) and ``sweep.html``.
"""

from __future__ import annotations

import json
import re
import time
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from odscen.app.exchange.exports import export
from odscen.app.running.batches import run_all
from odscen.app.running.runs import check_run
from odscen.app.scenarios import SUFFIX, read_scenario, scenario_name
from odscen.base.atomic_folders import scratch_folder
from odscen.base.checksums import SUMS_FILE, check_files, seal_files, unseal_files
from odscen.base.durations import clock
from odscen.base.errors import (
    ConflictError,
    DamagedError,
    InputError,
    NotFoundError,
    ScenarioError,
    in_file,
)
from odscen.base.folder_locks import locked
from odscen.base.given_files import as_path
from odscen.base.stored_files import read_document, tables
from odscen.base.system_errors import disk_errors
from odscen.base.text_files import write_text
from odscen.experiments.journal import KeptRuns
from odscen.experiments.sweep_page import SweepShown, safe_boundary, sweep_page
from odscen.experiments.table import REFUSED, SWEEP, MeasuredRun, columns_of, read_limit
from odscen.experiments.work import LocalExecutor, PreparedOrder, PreparedOrders, carry_out
from odscen.formats.openscenario.dialect import Dialect
from odscen.learning.behaviour.behaviour_model import BehaviourDoor
from odscen.records.outcomes import RunStatus
from odscen.runs import layout
from odscen.runs.finished_run import Run
from odscen.runs.recording import Recording
from odscen.runs.run_settings import RunSettings
from odscen.scenario.document.json_form import dumps, loads
from odscen.scenario.sweeps.sweep_plan import concrete, plan_from_data

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    import polars as pl

    from odscen.app.running.runs import CheckedRun
    from odscen.base.given_files import GivenPath
    from odscen.experiments.table import Limit
    from odscen.experiments.work import Outcome
    from odscen.maps.store import Workspace
    from odscen.scenario.document.scenario_document import Scenario
    from odscen.scenario.sweeps.sweep_plan import SweepPlan


FORMAT: Final = "odscen-sweep"
VERSION: Final = 1
SWEEP_FILE, SCENARIO_FILE = "sweep.json", "scenario.json"


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
    openscenario
        Version of OpenSCENARIO in which each case is written as well, ``1.0`` to ``1.3``.
    behaviour
        What drives vehicles instead of SUMO.
    """

    safe: Sequence[str] = ()
    figures: Sequence[str] = ()
    own: Mapping[str, Callable[[Run], float | None]] = field(default_factory=dict)
    seed: int | None = None
    reports: bool = False
    openscenario: str | None = None
    behaviour: BehaviourDoor | None = None

    def to_dict(self) -> dict[str, Any]:
        """JSON-ready; columns of one's own by name."""
        data = {
            "safe": list(self.safe),
            "figures": [*self.figures, *self.own],
            "seed": self.seed,
        }
        return data if self.behaviour is None else data | {"behaviour": asdict(self.behaviour)}


def settings_from_dict(data: Mapping[str, Any]) -> SweepSettings:
    """Read what :meth:`SweepSettings.to_dict` writes, of a sweep without columns of one's own."""
    given = data.get("behaviour")
    return SweepSettings(
        tuple(data["safe"]),
        tuple(data["figures"]),
        seed=data["seed"],
        behaviour=None if given is None else BehaviourDoor(**given),
    )


def read_plan(out: Path) -> tuple[SweepPlan, dict[str, Any]]:
    """Read what a folder varies, and how it is judged.

    Raises
    ------
    InputError
        If there is no sweep.
    DamagedError
        If what it says is not as it was written.
    """
    file = out / SWEEP_FILE
    if not file.is_file():
        raise InputError("no sweep is here: it has no sweep.json", file=str(out))
    check_files(out, only=(SWEEP_FILE, SCENARIO_FILE))
    with in_file(str(file)):
        data = read_document(file.read_bytes(), form=FORMAT, version=VERSION, what="a sweep")
        plan, settings = data.get("plan"), data.get("settings")
        if not isinstance(plan, dict) or not isinstance(settings, dict):
            raise InputError("a sweep has a plan and settings, and this has none")
        return plan_from_data(plan), settings


def read_sweep(out: Path) -> tuple[Scenario, SweepPlan, dict[str, Any]]:
    """Read what a folder sweeps, and how it is judged.

    Raises
    ------
    InputError
        If there is no sweep.
    """
    plan, settings = read_plan(out)
    text = (out / SCENARIO_FILE).read_bytes()
    return loads(text, file=str(out / SCENARIO_FILE)), plan, settings


def begin_sweep(out: Path, scenario: Scenario, plan: SweepPlan, settings: SweepSettings) -> None:
    """Write what is swept.

    Raises
    ------
    ConflictError
        If the folder holds another sweep.
    """
    head = {"format": FORMAT, "version": VERSION}
    description = head | {"plan": plan.to_dict(), "settings": settings.to_dict()}
    begin_folder(out, {SWEEP_FILE: description}, scenario, what="sweep")


def begin_folder(
    out: Path, description: Mapping[str, Mapping[str, Any]], scenario: Scenario, *, what: str
) -> None:
    """Write what the folder of a sweep or a search is about, by file, and its scenario.

    Raises
    ------
    ConflictError
        If the folder holds another one.
    """
    files = {
        name: json.dumps(data, indent=2, ensure_ascii=False) + "\n"
        for name, data in description.items()
    }
    files[SCENARIO_FILE] = dumps(scenario)
    there = {name: out / name for name in files if (out / name).is_file()}
    for name, file in there.items():
        if file.read_bytes() != files[name].encode():
            raise ConflictError(f"{out} holds another {what} ({name} differs); name another folder")
    if there and (out / SUMS_FILE).is_file():
        check_files(out, may_miss=(TABLE_FILE, PAGE_FILE, ARCHIVE_FILE))
    for name in files.keys() - there.keys():
        write_text(out / name, files[name])
    seal_files(out, files)


TABLE_FILE: Final = "cases.parquet"
PAGE_FILE: Final = "sweep.html"
ARCHIVE_FILE: Final = "criticals.json"
"""Of a search."""


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


class CaseRuns:
    """Cases of a scenario in a folder: checked, run where they have not been, and read as rows.

    Parameters
    ----------
    table
        Whose columns rows have: of a sweep or a search.

    Raises
    ------
    InputError
        If a figure, or a column of a limit, is unknown.
    """

    def __init__(
        self, scenario: Scenario, out: Path, settings: SweepSettings, *, table: str = SWEEP
    ) -> None:
        self.columns = columns_of(table, settings.figures, settings.own)
        self.limits = tuple(read_limit(text, self.columns) for text in settings.safe)
        self.refused: dict[str, str] = {}
        self._scenario, self._out, self._settings = scenario, out, settings
        self._watched = watched_actors(scenario)
        # Those of a sweep are computed when they are first asked for.
        self._with_figures = table != SWEEP or bool(settings.figures)

    def check(
        self, workspace: Workspace, cases: Mapping[str, Mapping[str, float]]
    ) -> list[CheckedRun]:
        """Check each case as a run; why others are not possible is in ``refused``."""
        scenario, out = self._scenario, self._out
        entry = workspace.map_for(scenario.map.name, scenario.map.sha256)
        given = RunSettings(
            seed=self._settings.seed,
            recording=WATCHES_CLOSENESS,
            behaviour=self._settings.behaviour,
        )
        runs, written = [], []
        for name, values in cases.items():
            try:
                case = concrete(scenario, values, name=name)
                run = check_run(
                    workspace, case, name=name, out=out / "runs", settings=given, entry=entry
                )
            except ScenarioError as error:
                self.refused[name] = "; ".join([error.problem, *error.problems])
                continue
            file = out / "cases" / f"{name}{SUFFIX}"
            if not file.is_file():
                write_text(file, dumps(case))
                written.append(f"cases/{file.name}")
            runs.append(run)
        if written:
            seal_files(out, written)
        return runs

    def run(
        self,
        executor: LocalExecutor,
        runs: Sequence[CheckedRun],
        record: KeptRuns,
        *,
        count: int,
        done: Callable[[int, int], None] | None = None,
    ) -> None:
        """Run cases; their folders are the record of what has ended."""

        def take(outcome: Outcome) -> None:
            if outcome.row["status"] == REFUSED:
                self.refused[outcome.name] = str(outcome.row["detail"])

        orders = PreparedOrders(
            PreparedOrder(run, self._settings.reports, self._with_figures) for run in runs
        )
        carry_out(executor.outcomes(orders), record, count=count, take=take, done=done)

    def rows(self, cases: Mapping[str, Mapping[str, float]]) -> list[dict[str, Any]]:
        """A row for each case, from its run folder; one that has not been run yet is waiting."""
        rows = []
        for name, values in cases.items():
            row: dict[str, Any] = {"case": name, "status": REFUSED, "safe": None}
            row |= {"detail": self.refused.get(name), **values}
            measures: dict[str, Any] = dict.fromkeys(self.columns)
            folder = self._out / "runs" / name
            if name not in self.refused and not (folder / layout.SUMMARY_FILE).is_file():
                row["status"] = "waiting"
            elif name not in self.refused:
                run = Run.open(folder)
                row["status"] = str(run.status)
                if run.status is RunStatus.COMPLETED:
                    measured = MeasuredRun(run, self._watched)
                    measures = {key: column.value(measured) for key, column in self.columns.items()}
                    known = {"planned": run.counts.get("planned"), **measures}
                    row["safe"] = not measures["collision"] and all(
                        limit.holds(known) for limit in self.limits
                    )
                else:
                    row["detail"] = str(run.known["error"])
            rows.append(row | measures)
        return rows


def watched_actors(scenario: Scenario) -> frozenset[str] | None:
    """Whose collisions and encounters a sweep is about: egos, or actors of rules, or everybody."""
    egos = frozenset(actor.id for actor in scenario.actors if actor.ego)
    return egos or frozenset(rule.actor for rule in scenario.rules) or None


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
    return Sweep(out, table, _find_boundary(plan, rows))


def write_cases(
    out: Path,
    scenario: Scenario,
    names: Sequence[str],
    *,
    rows: Sequence[Mapping[str, Any]],
    limits: Sequence[Limit],
) -> pl.DataFrame:
    """Write the table and the page of cases; ``names`` are the parameters that are varied."""
    table = _make_table(rows)
    unseal_files(out, (TABLE_FILE, PAGE_FILE))
    part = out / f".{TABLE_FILE}.part"
    table.write_parquet(part)
    part.replace(out / TABLE_FILE)
    shown = SweepShown(
        scenario_name(scenario),
        {name: scenario.parameters[name].unit for name in names},
        ["no collision", *map(str, limits)],
        rows,
        {row["case"]: _case_links(out, row["case"]) for row in rows},
    )
    write_text(out / PAGE_FILE, sweep_page(shown))
    seal_files(out, (TABLE_FILE, PAGE_FILE))
    return table


def read_table(out: Path) -> Sweep:
    """Read the table of a sweep; of one that has not ended, from the runs that there are.

    Raises
    ------
    InputError
        If there is no sweep.
    """
    import polars as pl

    scenario, plan, description = read_sweep(out)
    if (out / TABLE_FILE).is_file():
        check_files(out, only=(TABLE_FILE,))
        with tables(str(out / TABLE_FILE)):
            table = pl.read_parquet(out / TABLE_FILE)
    else:
        runs = CaseRuns(scenario, out, settings_from_dict(description))
        table = _make_table(runs.rows(named_cases(plan)))
    return Sweep(out, table, _find_boundary(plan, table.to_dicts()))


def named_cases(plan: SweepPlan) -> dict[str, dict[str, float]]:
    """Values of each case by its name, ``case-001``; names sort as the cases do."""
    cases = plan.cases()
    digits = max(3, len(str(len(cases))))
    return {f"case-{number:0{digits}}": values for number, values in enumerate(cases, start=1)}


def _make_table(rows: Sequence[Mapping[str, Any]]) -> pl.DataFrame:
    import polars as pl

    texts, flags = {"case", "status", "detail"}, {"safe", "collision"}
    schema = {
        name: pl.String if name in texts else pl.Boolean if name in flags else pl.Float64
        for name in rows[0]
    }
    return pl.DataFrame(rows, schema=schema, orient="row")


def _find_boundary(plan: SweepPlan, rows: Sequence[Mapping[str, Any]]) -> tuple[Any, ...]:
    import numpy as np

    if len(plan.names) != 2:
        return ()
    known = [row for row in rows if row["safe"] is not None]
    points = np.array([[row[name] for name in plan.names] for row in known]).reshape(-1, 2)
    safe = np.array([row["safe"] for row in known], dtype=bool)
    return tuple((tuple(a), tuple(b)) for a, b in safe_boundary(points, safe).tolist())


def _case_links(out: Path, case: str) -> list[tuple[str, str]]:
    given = {
        "scenario": f"cases/{case}{SUFFIX}",
        "OpenSCENARIO": f"cases/{case}.xosc",
        "report": f"runs/{case}/{layout.REPORT_FILE}",
    }
    return [(words, path) for words, path in given.items() if (out / path).is_file()]


WATCHES_CLOSENESS = Recording(emissions=False, criticality=True)
"""What of each case is recorded."""


def sweep(
    workspace: Workspace,
    scenario: Scenario,
    plan: SweepPlan,
    out: GivenPath,
    *,
    settings: SweepSettings | None = None,
    processes: int = 1,
    tell: Callable[[str], None] | None = None,
    check: Callable[[], None] | None = None,
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
    check
        Called now and then while runs are waited for; what it raises ends them.
    done
        Called with how many of how many have ended.

    Raises
    ------
    InputError
        If a parameter, limit or figure is unknown, or no case can be run.
    ConflictError
        If another sweep is in ``out``.
    """
    settings, out = settings or SweepSettings(), as_path(out)
    runs = CaseRuns(scenario, out, settings)
    if settings.openscenario is not None:
        Dialect.of(settings.openscenario)  # an unknown version is refused before anything runs
    refuse_unknown(plan.names, scenario)
    with disk_errors(f"sweep {out}"), locked(out, what=f"sweep {out.name!r}"):
        cases = named_cases(plan)
        new = not (out / SWEEP_FILE).is_file()
        begin_sweep(out, scenario, plan, settings)
        checked = runs.check(workspace, cases)
        if not checked:
            if new:  # the folder is left to another sweep
                for name in (SWEEP_FILE, SCENARIO_FILE, SUMS_FILE):
                    (out / name).unlink()
            raise InputError(
                f"no case of the sweep can be run: {next(iter(runs.refused.values()))}"
            )
        left = [run for run in checked if not has_completed(run.folder)]
        record = KeptRuns({run.name for run in checked} - {run.name for run in left})
        if tell is not None:
            words = f"{len(cases)} cases of {', '.join(plan.names)}"
            if runs.refused:
                words += f", {len(runs.refused)} of them not possible"
            tell(f"{words}; {len(left)} to run" if len(left) < len(checked) else words)
        # The first one alone, so that it says what the others will take.
        for some in (left[:1], left[1:]):
            began = time.monotonic()
            executor = LocalExecutor(workspace, processes, check)
            runs.run(executor, some, record, count=len(checked), done=done)
            if some and some[0] is left[0] and len(left) > 1 and tell is not None:
                spent, rest = time.monotonic() - began, len(left) - 1
                disk = sum(f.stat().st_size for f in some[0].folder.rglob("*") if f.is_file())
                tell(
                    f"the first took {spent:.1f} s and {disk / 1e6:.1f} MB: about "
                    f"{clock(rest * spent / processes + 59)} h and {rest * disk / 1e6:,.0f} MB for "
                    f"the other {rest}"
                )
        if settings.openscenario is not None:
            for run in checked:
                file = out / "cases" / f"{run.name}{SUFFIX}"
                options = {"version": settings.openscenario}
                written = export(workspace, file, out / "cases", to="openscenario", options=options)
                seal_files(out, [f"cases/{source.name}" for source in written])
        return write_table(out, scenario, plan, rows=runs.rows(cases), limits=runs.limits)


def refuse_unknown(names: Sequence[str], scenario: Scenario) -> None:
    """Raise :class:`InputError` if what is varied is no parameter of the scenario."""
    for name in names:
        if name not in scenario.parameters:
            known = ", ".join(scenario.parameters) or "none"
            raise InputError(f"the scenario has no parameter {name!r}; it has {known}")


def has_completed(folder: Path) -> bool:
    """Whether a folder holds a run that has completed.

    Raises
    ------
    DamagedError
        If one is there, and a file of it is not as it was written.
    """
    try:
        return Run.open(folder).status is RunStatus.COMPLETED
    except DamagedError:
        raise
    except InputError:
        return False


_CASE: Final = re.compile(r"case-\d{3,9}")
_TTC: Final = "min_ttc"
_RECORDED: Final = 3.0
"""Seconds to which times to collision are recorded: a criterion above them has no meaning."""


def opened_case(out: Path, case: str) -> Scenario:
    """One case as a scenario of numbers that runs alone as it did in the sweep.

    It has the seed of the sweep's runs. What the sweep calls safe of an ego become its criteria, so
    that its result says the same: ``collided(ego) == 0`` and limits of time to collision.

    Parameters
    ----------
    out
        Folder of the sweep.
    case
        Name of the case, ``case-012``.

    Raises
    ------
    NotFoundError
        If there is no such case, or it is not possible.
    InputError
        If there is no sweep.
    """
    file = out / "cases" / f"{case}{SUFFIX}"
    if not _CASE.fullmatch(case) or not file.is_file():
        raise NotFoundError(f"case of sweep {out.name!r}", case, [])
    whole, _, description = read_sweep(out)
    check_files(out, only=(f"cases/{file.name}",))
    found = read_scenario(file)
    limits = [
        limit for text in description["safe"] if (limit := _parse_ttc_limit(text)) is not None
    ]
    criteria = list(found.criteria)
    if any(actor.ego for actor in found.actors):
        own = ["collided(ego) == 0", *(_describe_criterion(limit) for limit in limits)]
        criteria += [text for text in own if text not in criteria]
    changes = {
        "name": f"{whole.name[:100]}, {case}",
        "seed": found.seed if description["seed"] is None else description["seed"],
        "criteria": tuple(criteria),
    }
    return found.model_copy(update=changes)


def _describe_criterion(limit: Limit) -> str:
    return f"{_TTC}(ego) {limit.expectation.op} {limit.expectation.bound:g} s"


def _parse_ttc_limit(text: str) -> Limit | None:
    """A limit if it is one of time to collision that a criterion can hold as well."""
    if re.match(rf"\s*{_TTC}\s*>", text) is None:
        return None
    limit = read_limit(text, columns_of(SWEEP))
    return limit if limit.expectation.bound <= _RECORDED else None


PATIENCE: Final = 60.0
"""Wall seconds that the one case may take."""
_TRIED: Final = 8
"""Cases that are looked at until one is possible."""


@dataclass(frozen=True, slots=True)
class SweepEstimate:
    """What one case has taken.

    Attributes
    ----------
    case
        Its name; it is one from the middle of the plan.
    seconds
        Wall seconds of computing.
    disk
        Bytes of its folder.
    whole
        Whether it came to its end; if not, it takes longer.
    """

    case: str
    seconds: float
    disk: int
    whole: bool


def estimate(
    workspace: Workspace,
    scenario: Scenario,
    plan: SweepPlan,
    *,
    settings: SweepSettings,
    patience: float = PATIENCE,
) -> SweepEstimate:
    """Run one case of a plan and measure it; nothing of it is kept.

    Parameters
    ----------
    patience
        Wall seconds after which it is given up.

    Raises
    ------
    InputError
        If a parameter, limit or figure is unknown, or no case that was tried is possible.
    """
    refuse_unknown(plan.names, scenario)
    CaseRuns(scenario, Path(), settings)  # an unknown figure or limit is refused
    with scratch_folder() as folder:
        began = time.monotonic()
        run = _find_possible_case(workspace, scenario, plan, settings, patience, folder)
        (ended,) = run_all([run], reports=False, figures=False)
        seconds = time.monotonic() - began
        disk = sum(file.stat().st_size for file in run.folder.rglob("*") if file.is_file())
    whole = ended.status is RunStatus.COMPLETED
    if not whole and seconds < patience:
        raise InputError(f"{run.name} was tried, and has failed: {ended.known['error']}")
    return SweepEstimate(run.name, seconds, disk, whole)


def _find_possible_case(
    workspace: Workspace,
    scenario: Scenario,
    plan: SweepPlan,
    settings: SweepSettings,
    patience: float,
    out: Path,
) -> CheckedRun:
    """A case that can be run, as near to the middle of the plan as can be."""
    cases = list(named_cases(plan).items())
    nearest = sorted(range(len(cases)), key=lambda index: abs(index - len(cases) // 2))
    given = RunSettings(seed=settings.seed, recording=WATCHES_CLOSENESS, time_limit=patience)
    first: ScenarioError | None = None
    for name, values in (cases[index] for index in nearest[:_TRIED]):
        try:
            case = concrete(scenario, values, name=name)
            return check_run(workspace, case, name=name, out=out, settings=given)
        except ScenarioError as error:
            first = first or error
    reason = "" if first is None else "; ".join([first.problem, *first.problems])
    raise InputError(f"of the cases that were tried none is possible: {reason}")
