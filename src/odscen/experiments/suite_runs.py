"""Runs of a suite: scenarios checked on their maps, run with their seeds, kept as results.

What is wrong with one scenario is an error of that scenario; the others go on. Results are written
to a file, so that parts which were run elsewhere are judged together; it has nothing of verdicts,
as those follow from the figures, the suite and its baselines.
"""

from __future__ import annotations

import hashlib
import os
import shutil
import threading
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple

from odscen.app.running.runs import check_run
from odscen.app.scenarios import read_scenario
from odscen.base.checksums import seal_text, unsealed
from odscen.base.errors import InputError, ToolError, in_file
from odscen.base.given_files import read_given
from odscen.base.stored_files import documents, read_document
from odscen.convert.model.conversion_settings import ConversionSettings
from odscen.experiments.baseline import fingerprint, read_baseline
from odscen.experiments.journal import KeptRuns
from odscen.experiments.measure import FigureKey, measure
from odscen.experiments.own_figures import own_values
from odscen.experiments.suite import SeedResult
from odscen.experiments.tolerance import Sizing
from odscen.experiments.verdict import causes_between
from odscen.experiments.work import PreparedOrder, PreparedOrders, carry_out
from odscen.figures.judging.criteria import missed_rows, missed_words
from odscen.figures.judging.expectations import CRITERIA, USABLE, evaluate, needs_criticality
from odscen.maps.folder_names import name_from_file
from odscen.records.outcomes import RunStatus
from odscen.records.row_text import json_with_rows
from odscen.runs.judged import read_judged
from odscen.runs.recording import Recording
from odscen.runs.reporter import Reporter
from odscen.runs.run_settings import RunSettings
from odscen.simulators.assets import shipped_assets

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping, Sequence
    from pathlib import Path

    from odscen.app.running.runs import CheckedRun
    from odscen.experiments.baseline import Baseline, Fingerprint
    from odscen.experiments.suite import Case, CaseResult, Suite, SuiteResult
    from odscen.experiments.work import LocalExecutor, Outcome
    from odscen.maps.map_entry import MapEntry
    from odscen.maps.store import Workspace
    from odscen.runs.finished_run import Run
    from odscen.runs.reporter import Progress
    from odscen.scenario.document.scenario_document import Scenario


@dataclass(slots=True)
class LoadedCase:
    """A case with its scenario on the map that it will run on; ``run`` is without a seed.

    ``runs`` by seed, and ``refused``, the words of a seed that could not be run, are filled later.
    So is ``sizing``, with the seeds of ``case``, where those are chosen for a new baseline.
    """

    case: Case
    run: CheckedRun
    made_of: Fingerprint
    baseline: Baseline | None
    sizing: Sizing | None = None
    runs: dict[int, SeedResult] = field(default_factory=dict)
    refused: dict[int, str] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class UnusableCase:
    """A case that cannot be run, and why; with its map and baseline, where those are there."""

    case: Case
    error: InputError | ToolError
    entry: MapEntry | None = None
    baseline: Baseline | None = None


def load_cases(
    workspace: Workspace, suite: Suite, *, with_baseline: bool
) -> list[LoadedCase | UnusableCase]:
    """Read and check every scenario of a suite on its map.

    Raises
    ------
    InputError
        If the suite, as a whole, names a map that is not there and that no scenario is on.
    """
    maps = _SuiteMaps(workspace, suite)
    loaded: list[LoadedCase | UnusableCase] = []
    for case in suite.cases:
        try:
            loaded.append(_load_case(workspace, case, maps, with_baseline=with_baseline))
        except (InputError, ToolError) as error:
            loaded.append(_unusable_case(case, error, maps))
    if suite.whole:
        maps.refuse_unused()
    return loaded


def _unusable_case(case: Case, error: InputError | ToolError, maps: _SuiteMaps) -> UnusableCase:
    with suppress(InputError, ToolError):  # which may be the error itself
        entry = maps.of(read_scenario(case.file))
        baseline = None if case.baseline is None else read_baseline(case.baseline)
        return UnusableCase(case, error, entry, baseline)
    return UnusableCase(case, error)


def _load_case(
    workspace: Workspace, case: Case, maps: _SuiteMaps, *, with_baseline: bool
) -> LoadedCase:
    scenario = read_scenario(case.file)
    with in_file(str(case.file)):
        entry = maps.of(scenario)
        # The suite names the map to test on; a baseline knows if it is not the one of before.
        reference = scenario.map.model_copy(update={"sha256": entry.sha256})
        scenario = scenario.model_copy(update={"map": reference})
        settings = _run_settings(case)
        run = check_run(workspace, scenario, name=case.name, settings=settings, entry=entry)
    network = None if entry.converter == "odscen" else entry.net_sha256
    made_of = fingerprint(scenario, entry.sha256, settings, network=network)
    baseline = read_baseline(case.baseline) if with_baseline and case.baseline else None
    run = replace(run, assets=shipped_assets())  # a baseline holds in every workspace
    if baseline is None:
        return LoadedCase(case, run, made_of, None)
    if case.detect is not None and not case.other_seeds:
        case = replace(case, seeds=baseline.seeds)
    return LoadedCase(case, run, made_of, baseline, baseline.sizing)


def map_before(entry: MapEntry, digest: str, workspace: Workspace | None) -> MapEntry | None:
    """Find the map of a baseline, by its digest; ``None`` where the workspace has lost it.

    Parameters
    ----------
    entry
        The map of now, which may be the same.
    digest
        ``map`` of the baseline's fingerprint: the beginning of a SHA-256.
    """
    if not digest or entry.sha256.startswith(digest):
        return entry
    if workspace is None:
        return None
    return workspace.first_map(lambda map_entry: map_entry.sha256.startswith(digest))


class _SuiteMaps:
    """The maps of a suite, each built once; one that cannot be is the error of its scenarios."""

    def __init__(self, workspace: Workspace, suite: Suite) -> None:
        self._workspace = workspace
        self._suite = suite
        self._files = {name_from_file(path): path for path in suite.maps}
        self._asked: set[str] = set()
        self._known: dict[tuple[str, str, float], MapEntry | InputError | ToolError] = {}

    def of(self, scenario: Scenario) -> MapEntry:
        """Find the map of a scenario.

        Raises
        ------
        InputError, ToolError
            If it is not there or cannot be built, each time that it is asked for.
        """
        reference = scenario.map
        self._asked.add(reference.name)
        key = reference.name, reference.sha256, reference.spacing
        if key not in self._known:
            try:
                self._known[key] = self._find_map(scenario)
            except (InputError, ToolError) as error:
                self._known[key] = error
        found = self._known[key]
        if isinstance(found, Exception):
            raise found
        return found

    def refuse_unused(self) -> None:
        """Refuse a suite with a map that is not there, if that is no scenario's error.

        Raises
        ------
        InputError
            With the first of them.
        """
        for name, path in self._files.items():
            if name not in self._asked and not path.is_file():
                raise InputError(
                    f"there is no file {path}, and no scenario is on a map of that name",
                    file=str(self._suite.file),
                    element="maps",
                )

    def _find_map(self, scenario: Scenario) -> MapEntry:
        """The map of the suite, built beside those of the workspace if need be; else one of these.

        So the workspace has no map more to choose or draw from, and none in place of another.
        """
        workspace, converter = self._workspace, self._suite.converter
        name = scenario.map.name
        source = self._files.get(name)
        if source is None:
            own = workspace.map_for(name, scenario.map.sha256)
            if converter in (None, own.converter):
                return own
            source = own.checked("xodr")
        wished = ConversionSettings(spacing=scenario.map.spacing, converter=converter or "odscen")
        try:
            content = source.read_bytes()
        except OSError as error:
            raise InputError(error.strerror or str(error), file=str(source)) from error
        sha256 = hashlib.sha256(content).hexdigest()
        there = workspace.first_map(
            lambda map_entry: (map_entry.sha256, map_entry.conversion) == (sha256, wished)
        )
        if there is not None:
            return there
        kept = workspace.of_suites()
        free = name not in {*workspace.map_names(), *kept.map_names()}
        new = name if free else f"{name[:40]}-{sha256[:8]}-{wished.converter}"
        return kept.add_map(source, name=new, settings=wished)


def _run_settings(case: Case) -> RunSettings:
    return RunSettings(
        redraw=case.redraw,
        until=case.until,
        step_length=case.step_length,
        recording=Recording(criticality=needs_criticality(case.expectations)),
        time_limit=case.time_limit,
    )


class RunPlace(NamedTuple):
    """Where runs lie, in a folder per scenario and seed, and whether they stay, with reports."""

    root: Path
    keep: bool


@dataclass(frozen=True, slots=True)
class SeedRunner:
    """Runs scenarios of a suite.

    Attributes
    ----------
    tell
        Called with the name of a run and how much of all runs has been carried out, 0 to 1.
    """

    suite: Suite
    executor: LocalExecutor
    tell: Callable[[str, float], None] | None = None

    def run(self, cases: Sequence[LoadedCase], place: RunPlace) -> None:
        """Run each case with those of its seeds that it was not run with, and keep the results."""
        asked: dict[str, tuple[LoadedCase, int]] = {}
        orders = []
        shares: dict[str, float] = {}
        lock = threading.Lock()

        def report(name: str, share: float) -> None:
            with lock:
                shares[name] = min(share, 1.0)
                total = sum(shares.values()) / len(asked)
            if self.tell is not None:
                self.tell(name, total)

        class SeedReporter(Reporter):
            """Adds up the progress of runs that go on at the same time."""

            def __init__(self, name: str) -> None:
                self._name = name

            def advanced(self, progress: Progress) -> None:
                report(self._name, progress.time / progress.until if progress.until else 0.0)

        def make_row(case: LoadedCase, seed: int, result: Run) -> dict[str, Any]:
            made = _seed_result(case, seed, result, self.suite, kept=place.keep)
            if not place.keep:
                shutil.rmtree(result.folder)
            return {"result": made}

        for case in cases:
            for seed in case.case.seeds:
                if seed in case.runs or seed in case.refused:
                    continue
                name = f"{case.case.name}/seed-{seed}"
                asked[name] = case, seed
                settings = replace(case.run.settings, seed=seed)
                run = replace(case.run, name=name, folder=place.root / name, settings=settings)
                row_of = partial(make_row, case, seed)
                orders.append(
                    PreparedOrder(
                        run, reports=place.keep, row_of=row_of, reporter=SeedReporter(name)
                    )
                )

        def take(outcome: Outcome) -> None:
            case, seed = asked[outcome.name]
            if "result" in outcome.row:
                case.runs[seed] = outcome.row["result"]
            else:
                case.refused[seed] = f"seed {seed}: {outcome.row['detail']}"
            report(outcome.name, 1.0)

        outcomes = self.executor.outcomes(PreparedOrders(orders))
        carry_out(outcomes, KeptRuns(), count=len(orders), take=take)


def _seed_result(
    loaded: LoadedCase, seed: int, result: Run, suite: Suite, *, kept: bool
) -> SeedResult:
    summary = result.summary
    folder, seconds = result.folder if kept else None, summary["wall_seconds"]
    if result.status is RunStatus.FAILED:
        # The folder is deleted unless runs are kept: its files are named, not where they lay.
        words = str(summary["error"])
        words = words if kept else words.replace(f"{result.folder}/", "")
        error = f"seed {seed}: the run failed: {words}"
        return SeedResult(seed, seconds, error, (), measure(result.folder, summary), folder)
    with in_file(str(suite.file)):
        own = own_values(suite.figures, result, beside=suite.file.parent, entry=loaded.run.entry)
    summary = {**summary, "figures": {**summary["figures"], **own}}
    verdicts = evaluate(loaded.case.expectations, summary, read_judged(result.folder))
    failed = [row for row in verdicts if not row.passed]
    unusable = None
    if USABLE.text in [row.expectation for row in failed]:
        unusable = f"seed {seed}: {result.usability.get('headline', 'not judged')}"
    missed = [
        f"seed {seed}: expected {verdict.expectation}, but it is "
        f"{'nothing' if verdict.value is None else f'{verdict.value:g}'}"
        for verdict in failed
        if verdict.expectation not in (USABLE.text, CRITERIA.text)
    ]
    if CRITERIA.text in [row.expectation for row in failed]:
        missed += [f"seed {seed}: {missed_words(row)}" for row in missed_rows(summary)]
    return SeedResult(
        seed,
        seconds,
        None,
        (*filter(None, [unusable]), *missed),
        measure(result.folder, summary),
        folder,
        unusable=unusable,
    )


RESULTS_FORMAT = "odscen-suite-results"
RESULTS_VERSION = 2
RESULTS_FILE = "results.json"
"""Name of such files in a folder that is to be merged."""


@dataclass(frozen=True, slots=True)
class RunCase:
    """A scenario that was run elsewhere.

    Attributes
    ----------
    source
        The file that says so.
    made_of
        What its runs were made of; empty if it could not be run.
    refused
        Why runs of it could not be prepared, in words.
    sizing
        What its seeds were chosen for.
    """

    name: str
    source: Path
    made_of: Fingerprint
    runs: tuple[SeedResult, ...]
    refused: tuple[str, ...]
    sizing: Sizing | None = None


def results_json(result: SuiteResult, *, beside: Path) -> str:
    """Text of the file with its seal; folders of runs are relative to ``beside``, where it lies."""
    head = {"format": RESULTS_FORMAT, "version": RESULTS_VERSION, "suite": result.suite.name}
    rows = (_case_row(case, beside) for case in result.cases)
    return seal_text(json_with_rows(head, "scenarios", rows), indent=2)


def _case_row(case: CaseResult, beside: Path) -> dict[str, Any]:
    failed = {run.error for run in case.runs}
    return {
        "name": case.name,
        "made_of": case.made_of,
        **({"detect": case.sizing.model_dump(mode="json")} if case.sizing else {}),
        "refused": [words for words in case.errors if case.made_of and words not in failed],
        "runs": [_run_row(run, beside) for run in case.runs],
    }


def _run_row(run: SeedResult, beside: Path) -> dict[str, Any]:
    folder = None if run.folder is None else os.path.relpath(run.folder.resolve(), beside.resolve())
    return {
        "seed": run.seed,
        "wall_seconds": run.wall_seconds,
        "error": run.error,
        "missed": list(run.missed),
        "folder": None if folder is None else folder.replace(os.sep, "/"),
        "figures": [[*key, value] for key, value in run.figures.items()],
    }


def read_parts(paths: Iterable[Path]) -> dict[str, RunCase]:
    """Read what was run of a suite, by scenario.

    Parameters
    ----------
    paths
        Files, or folders that hold some, named :data:`RESULTS_FILE`, at any depth.

    Raises
    ------
    InputError
        If a file is none of ours, a folder has none, or two have the same scenario.
    DamagedError
        If a file is not as it was written.
    """
    run_cases: dict[str, RunCase] = {}
    for file in [file for path in paths for file in _results_files(path)]:
        with in_file(str(file)):
            read_document(
                read_given(file),
                form=RESULTS_FORMAT,
                version=RESULTS_VERSION,
                what="results of a suite",
            )
            data = unsealed(file)
            with documents("results of a suite"):
                cases = [_read_case(row, file) for row in data["scenarios"]]
            for case in cases:
                if case.name in run_cases:
                    raise InputError(f"{case.name} is in {run_cases[case.name].source} as well")
                run_cases[case.name] = case
    return run_cases


def _results_files(path: Path) -> list[Path]:
    if not path.is_dir():
        return [path]
    found = sorted(path.rglob(RESULTS_FILE))
    if not found:
        raise InputError(f"no {RESULTS_FILE} in this folder", file=str(path))
    return found


def _read_case(row: Mapping[str, Any], file: Path) -> RunCase:
    chosen = row.get("detect")
    return RunCase(
        name=str(row["name"]),
        source=file,
        made_of={str(name): str(digest) for name, digest in row["made_of"].items()},
        runs=tuple(_read_seed_result(run, file.parent) for run in row["runs"]),
        refused=tuple(str(words) for words in row["refused"]),
        sizing=None if chosen is None else Sizing.model_validate(chosen),
    )


def _read_seed_result(row: Mapping[str, Any], beside: Path) -> SeedResult:
    figures = {
        FigureKey(kind, str(place), str(figure)): None if value is None else float(value)
        for kind, place, figure, value in row["figures"]
    }
    return SeedResult(
        seed=int(row["seed"]),
        wall_seconds=float(row["wall_seconds"]),
        error=None if row["error"] is None else str(row["error"]),
        missed=tuple(str(words) for words in row["missed"]),
        figures=figures,
        folder=None if row["folder"] is None else beside / str(row["folder"]),
    )


def take_parts(
    cases: Sequence[LoadedCase | UnusableCase],
    loaded: Sequence[LoadedCase],
    parts: Mapping[str, RunCase],
    *,
    sizing: bool = False,
) -> None:
    """Give each scenario its runs from the parts; what is not there is its error.

    ``sizing`` says that new baselines are made of them: seeds that odscen chooses are those that
    the parts have chosen.

    Raises
    ------
    InputError
        If a part has a scenario that the suite does not have.
    """
    known = {case.case.name for case in cases}
    for part in parts.values():
        if part.made_of and part.name not in known:
            raise InputError(
                f"the suite has no scenario {part.name!r}, which was run here",
                file=str(part.source),
            )
    for case in loaded:
        _give_runs(case, parts.get(case.case.name), sizing=sizing)


def _give_runs(case: LoadedCase, part: RunCase | None, *, sizing: bool) -> None:
    if part is None:
        case.refused[-1] = "none of the parts has run it: was one of them interrupted?"
        return
    differ = causes_between(part.made_of, case.made_of)
    if differ:
        words = ", ".join(cause.words for cause in differ)
        case.refused[-1] = f"{part.source} was made with other inputs than are here: {words}"
        return
    detect = case.case.detect
    if sizing and detect is not None:
        if part.sizing is None or not part.sizing.is_for(detect):
            case.refused[-1] = f"{part.source} was run without --update-baseline, or other detect"
            return
        case.sizing = part.sizing
        case.case = replace(case.case, seeds=tuple(run.seed for run in part.runs))
    case.runs.update({run.seed: run for run in part.runs if run.seed in case.case.seeds})
    case.refused.update(enumerate(part.refused, start=-len(part.refused)))
    lacking = [str(seed) for seed in case.case.seeds if seed not in case.runs]
    if lacking and not part.refused:
        case.refused[-1] = f"{part.source} has no run of seed {', '.join(lacking)}"
