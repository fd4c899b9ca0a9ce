"""Where runs of an experiment are carried out: in threads that wait for SUMO, or far away.

An executor takes orders, which are plain data, and gives outcomes in the order in which they come.
It loses none: an order whose worker has died is carried out again, by another worker. A worker
writes nothing that another one reads, so an order can be lost or carried out twice.
"""

from __future__ import annotations

import io
import json
import platform
import tarfile
import threading
import time
from concurrent.futures import FIRST_COMPLETED, ThreadPoolExecutor, wait
from dataclasses import dataclass
from functools import lru_cache
from importlib import import_module
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol

from odscen.app.maps import load_map
from odscen.app.running.batches import run_all
from odscen.app.running.runs import check_run
from odscen.app.variants import edited
from odscen.base.atomic_folders import scratch_folder
from odscen.base.errors import ConflictError, InputError, MissingDependencyError
from odscen.base.version import __version__
from odscen.experiments.table import REFUSED, outcome_row, row_of
from odscen.records.outcomes import RunStatus
from odscen.runs.reporter import SILENT, Reporter
from odscen.scenario.document.json_form import loads
from odscen.scenario.document.problems import validated
from odscen.scenario.document.sampling_config import SamplingConfig
from odscen.scenario.edits.edit_messages import read_edit
from odscen.scenario.sampling.sampler import sample_scenario
from odscen.scenario.sweeps.sweep_plan import concrete

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Mapping
    from concurrent.futures import Future

    from odscen.app.maps import LoadedMap
    from odscen.app.running.runs import CheckedRun
    from odscen.experiments.plan import Keep, ScenarioSource, StudyRun, StudyRuns
    from odscen.maps.map_entry import MapEntry
    from odscen.maps.store import Workspace
    from odscen.runs.finished_run import Run
    from odscen.runs.reporter import Progress
    from odscen.scenario.document.scenario_document import Scenario


@dataclass(frozen=True, slots=True)
class WorkOrder:
    """Runs to be carried out one after the other, and all that they need but the maps.

    Attributes
    ----------
    runs
        With the values of their parameters.
    sources
        Scenarios by name.
    variants
        Edits by name of the variant.
    keep
        Whose run folders are given back.
    target
        Folder, or URL that fsspec knows, that run folders are written to instead, as ``.tar``.
    formats
        Formats that the recording of each run is exported to.
    versions
        Of the one who orders, see :func:`versions`.
    """

    runs: tuple[tuple[StudyRun, Mapping[str, float]], ...]
    sources: Mapping[str, ScenarioSource]
    variants: Mapping[str, tuple[Mapping[str, Any], ...]]
    how: StudyRuns
    keep: Keep
    target: str | None
    formats: tuple[str, ...]
    versions: Mapping[str, str]

    def carry_out(self, workspace: Workspace, stopped: Callable[[], bool]) -> list[Outcome]:
        """Carry it out in a workspace that has all maps."""
        places = {source.map_name: workspace for source in self.sources.values()}
        return carry_out_order(self, places, stopped=stopped)


class Outcome(NamedTuple):
    """A run that has ended.

    Attributes
    ----------
    row
        Of the table; ``seconds`` of wall time beside.
    folder
        Its run folder as a tar file, if it is to be kept.
    exports
        Files of each format, by format and name.
    """

    name: str
    row: dict[str, Any]
    folder: bytes | None = None
    exports: Mapping[str, Mapping[str, bytes]] | None = None


def versions() -> dict[str, str]:
    """Versions that decide what comes out of a run: of odscen and of SUMO."""
    return {"odscen": __version__, "sumo": version("libsumo")}


def refuse_other_versions(
    wanted: Mapping[str, str],
    *,
    found: Mapping[str, str] | None = None,
    where: str | None = None,
) -> None:
    """Refuse to work with other versions than those of whoever orders it.

    Parameters
    ----------
    found
        Versions of the worker; those here if not given.
    where
        Names the worker.

    Raises
    ------
    ConflictError
        Names the worker and both versions.
    """
    own = versions() if found is None else found
    for name, theirs in wanted.items():
        if own.get(name) != theirs:
            place = where or f"the worker on {platform.node()}"
            raise ConflictError(
                f"{place} has {name} {own.get(name)}, the study needs {theirs}; install the same"
            )


def carry_out_order(
    order: WorkOrder,
    workspaces: Mapping[str, Workspace],
    *,
    stopped: Callable[[], bool] = lambda: False,
) -> list[Outcome]:
    """Carry out an order; what goes wrong in a run is in its row.

    Parameters
    ----------
    workspaces
        By name of the map, each with that map and the assets.
    stopped
        Asked again and again; once true, what is under way is given up.

    Raises
    ------
    ConflictError
        If this is not the version of odscen or SUMO that the order is for.
    """
    refuse_other_versions(order.versions)
    return [_carry_out_order(order, *each, workspaces, stopped) for each in order.runs]


def _carry_out_order(
    order: WorkOrder,
    run: StudyRun,
    values: Mapping[str, float],
    workspaces: Mapping[str, Workspace],
    stopped: Callable[[], bool],
) -> Outcome:
    began = time.monotonic()
    workspace = workspaces[order.sources[run.scenario].map_name]
    with scratch_folder() as folder:
        try:
            checked = _check_order_run(order, run, values, workspace, folder)
            outcome = _simulate_run(order, run, checked, workspace, stopped)
        except InputError as error:
            outcome = Outcome(run.name, outcome_row(REFUSED, _describe_error(error)))
    outcome.row["seconds"] = round(time.monotonic() - began, 3)
    return outcome


def _describe_error(error: InputError) -> str:
    return "; ".join([str(error), *getattr(error, "problems", ())])


def _check_order_run(
    order: WorkOrder,
    run: StudyRun,
    values: Mapping[str, float],
    workspace: Workspace,
    out: Path,
) -> CheckedRun:
    source = order.sources[run.scenario]
    entry = _find_entry(workspace, source)
    loaded = load_map(entry)
    scenario = _read_or_sample(source, loaded)
    if edits := order.variants.get(run.variant, ()):
        scenario = edited(scenario, [read_edit(dict(edit)) for edit in edits], loaded)
    if values:
        scenario = concrete(scenario, values, name=run.name)
    name = run.name.replace("/", "-")
    return check_run(
        workspace, scenario, name=name, out=out, settings=order.how.settings(run.seed), entry=entry
    )


@lru_cache(maxsize=16)
def _entry_of(workspace: Workspace, name: str, sha256: str) -> MapEntry:
    return workspace.map_for(name, sha256)


def _find_entry(workspace: Workspace, source: ScenarioSource) -> MapEntry:
    return _entry_of(workspace, source.map_name, source.map_sha256)


def _read_or_sample(source: ScenarioSource, loaded: LoadedMap) -> Scenario:
    if source.text is not None:
        return _read_scenario(source.text, source.name)
    return _sample_scenario(source.name, loaded, source.seed, json.dumps(source.config or {}))


@lru_cache(maxsize=4)
def _sample_scenario(name: str, loaded: LoadedMap, seed: int, config: str) -> Scenario:
    """Sample a scenario, once for all of its seeds and variants."""
    return sample_scenario(
        loaded.sumo.graph,
        validated(SamplingConfig, json.loads(config)),
        seed=seed,
        name=name,
        usable=loaded.usable,
    )


@lru_cache(maxsize=4)
def _read_scenario(text: str, name: str) -> Scenario:
    return loads(text, file=name)


def _simulate_run(
    order: WorkOrder,
    run: StudyRun,
    checked: CheckedRun,
    workspace: Workspace,
    stopped: Callable[[], bool],
) -> Outcome:
    refusals: list[str] = []
    ended = run_all(
        [checked],
        reports=False,
        reporter=_StoppableReporter(stopped),
        refused=lambda _name, error: refusals.append(_describe_error(error)),
    )
    if not ended:
        return Outcome(run.name, outcome_row(REFUSED, refusals[0]))
    (result,) = ended
    row, failed = row_of(result), result.status is RunStatus.FAILED
    kept = None
    if order.keep == "all" or (order.keep == "failed" and failed):
        kept = packed(result.folder)
        if order.target is not None:
            put(order.target, f"{run.name}.tar", kept)
            kept = None
    exports = None
    if order.formats and not failed:
        try:
            exports = _export_run(order.formats, workspace, result)
        except InputError as error:
            row = outcome_row(REFUSED, f"cannot be exported: {_describe_error(error)}")
    return Outcome(run.name, row, kept, exports)


class GivenUpError(Exception):
    """The study has been stopped, and what is under way with it."""


class _StoppableReporter(Reporter):
    """Ends a run whose experiment has been stopped."""

    def __init__(self, stopped: Callable[[], bool], own: Reporter = SILENT) -> None:
        self._stopped, self._own = stopped, own

    def advanced(self, progress: Progress) -> None:
        if self._stopped():
            raise GivenUpError
        self._own.advanced(progress)


def _export_run(
    formats: tuple[str, ...], workspace: Workspace, result: Run
) -> dict[str, dict[str, bytes]]:
    from odscen.app.exchange.dataset_exports import dataset_contents

    return dataset_contents(workspace, result.folder, formats)


def packed(folder: Path) -> bytes:
    """A folder as a tar file; the same files give the same bytes."""
    buffer = io.BytesIO()
    with tarfile.open(fileobj=buffer, mode="w", format=tarfile.PAX_FORMAT) as archive:
        for path in sorted(folder.rglob("*")):
            if path.is_file():
                content = path.read_bytes()
                archive.addfile(
                    member(path.relative_to(folder).as_posix(), len(content)), io.BytesIO(content)
                )
    return buffer.getvalue()


def member(name: str, size: int) -> tarfile.TarInfo:
    """Head of a file in a tar file, without times and owners."""
    info = tarfile.TarInfo(name)
    info.size, info.mode = size, 0o644
    return info


def unpacked(content: bytes, folder: Path) -> None:
    """Write the files of a tar file into a folder, nothing outside of it."""
    with tarfile.open(fileobj=io.BytesIO(content)) as archive:
        archive.extractall(folder, filter="data")


def put(target: str, name: str, content: bytes) -> None:
    """Write a file whole to a folder or a URL; again, it is the same file.

    Raises
    ------
    MissingDependencyError
        If it is a URL and fsspec is not installed.
    """
    if "://" not in target:
        from odscen.base.text_files import write_file

        write_file(Path(target) / name, content)
        return
    try:
        import fsspec
    except ImportError as error:
        raise MissingDependencyError(
            f"{target} needs fsspec: pip install 'odscen[dask]'"
        ) from error
    with fsspec.open(f"{target.rstrip('/')}/{name}", "wb", auto_mkdir=True) as file:
        file.write(content)


_LISTEN = 0.2
"""Wall seconds after which a wait looks for Ctrl-C."""


class Orders(Protocol):
    """Gives the next order."""

    def next(self, most: int) -> WorkOrder | None:
        """An order of at most so many runs; ``None`` when there are no more."""


class LocalOrder(Protocol):
    """Runs that this machine can carry out."""

    def carry_out(self, workspace: Workspace, stopped: Callable[[], bool]) -> list[Outcome]:
        """Carry them out; asked again and again, ``stopped`` ends what is under way."""


class LocalOrders(Protocol):
    """Gives the next order for this machine."""

    def next(self, most: int) -> LocalOrder | None:
        """An order of at most so many runs; ``None`` when there are no more."""


@dataclass(frozen=True, slots=True)
class PreparedOrder:
    """A run that has been checked on this machine; its folder stays where it says.

    Attributes
    ----------
    reports, figures
        Whether its report is written, and whether its figures are computed at once.
    row_of
        Makes its row while the run is at hand.
    reporter
        Hears of it, from the thread that waits for it.
    """

    run: CheckedRun
    reports: bool = False
    figures: bool = True
    row_of: Callable[[Run], dict[str, Any]] | None = None
    reporter: Reporter = SILENT

    def carry_out(self, workspace: Workspace, stopped: Callable[[], bool]) -> list[Outcome]:
        """Carry it out; what cannot be prepared, or has no row, is refused."""
        del workspace
        reporter = _StoppableReporter(stopped, self.reporter)
        try:
            (result,) = run_all(
                [self.run], reports=self.reports, figures=self.figures, reporter=reporter
            )
            if self.row_of is not None:
                return [Outcome(self.run.name, self.row_of(result))]
        except InputError as error:
            return [Outcome(self.run.name, outcome_row(REFUSED, str(error)))]
        return [Outcome(self.run.name, outcome_row(result.status, result.known["error"]))]


class PreparedOrders:
    """Orders of one run each."""

    def __init__(self, orders: Iterable[PreparedOrder]) -> None:
        self._left = iter(orders)

    def next(self, most: int) -> PreparedOrder | None:
        """The next one."""
        del most
        return next(self._left, None)


class Executor(Protocol):
    """Carries out orders."""

    def outcomes(self, orders: Orders) -> Iterator[list[Outcome]]:
        """Outcomes of each order, when it has been carried out."""


@dataclass(frozen=True, slots=True)
class LocalExecutor:
    """Carries out orders on this machine, one run of SUMO in a process each.

    Attributes
    ----------
    workspace
        Has the maps.
    processes
        How many run at a time.
    check
        Called now and then while runs are waited for; what it raises ends them.
    """

    workspace: Workspace
    processes: int = 1
    check: Callable[[], None] | None = None

    def outcomes(self, orders: LocalOrders) -> Iterator[list[Outcome]]:
        """Outcomes of each order, of one run, when it has been carried out."""
        # What is otherwise imported at its first use, by several threads at a time: where two of
        # them wait for each other's imports, Python gives one a module that is half there.
        for name in ("numpy.ma", "polars"):
            import_module(name)
        stop = threading.Event()

        def work(order: LocalOrder) -> list[Outcome]:
            if stop.is_set():
                raise GivenUpError
            return order.carry_out(self.workspace, stop.is_set)

        with ThreadPoolExecutor(max_workers=max(1, self.processes)) as pool:
            running: set[Future[list[Outcome]]] = set()
            try:
                while True:
                    while len(running) < self.processes + 1 and (order := orders.next(1)):
                        running.add(pool.submit(work, order))
                    if not running:
                        return
                    ended, running = wait(running, timeout=_LISTEN, return_when=FIRST_COMPLETED)
                    if self.check is not None:
                        self.check()
                    for future in ended:
                        yield future.result()
            finally:
                stop.set()
                pool.shutdown(wait=False, cancel_futures=True)


class Record(Protocol):
    """What has ended: a journal, or the run folders where all are kept."""

    def __contains__(self, name: object) -> bool:
        """Whether a run has ended."""

    def __len__(self) -> int:
        """How many have."""

    def add(self, name: str, row: Mapping[str, Any]) -> bool:
        """Write down that a run has ended, and its row."""


def carry_out(
    outcomes: Iterable[list[Outcome]],
    record: Record,
    *,
    count: int,
    take: Callable[[Outcome], None] | None = None,
    done: Callable[[int, int], None] | None = None,
) -> None:
    """Take what an executor gives; runs that the record has count once.

    Parameters
    ----------
    count
        How many runs there are in all.
    take
        Called with each outcome before its row is kept, as a run without a row is run again.
    done
        Called with how many of how many have ended.
    """
    for some in outcomes:
        for outcome in some:
            if outcome.name in record:
                continue
            if take is not None:
                take(outcome)
            record.add(outcome.name, outcome.row)
        if done is not None:
            done(len(record), count)
