"""Run a suite: scenarios times seeds, each judged by its expectations and its baseline."""

from __future__ import annotations

import tempfile
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from odscen.base.errors import InputError
from odscen.experiments.regression.baseline import (
    baseline_of,
    map_digest,
    seeds_for_small_changes,
    seeds_that_hardly_vary,
    write_baseline,
)
from odscen.experiments.regression.case_results import CaseResult, SuiteResult
from odscen.experiments.regression.causes import VERSIONS, Cause, causes_between, likeliest_first
from odscen.experiments.regression.kept_maps import change_words, changes_since, keep_map
from odscen.experiments.regression.seed_sizing import choose_seeds
from odscen.experiments.regression.verdict import hold_against
from odscen.experiments.suites.suite import missing_case
from odscen.experiments.suites.suite_loading import LoadedCase, load_cases
from odscen.experiments.suites.suite_parts import take_parts
from odscen.experiments.suites.suite_runs import RunPlace, SeedRunner

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterable, Mapping

    from odscen.changes.map_change import MapChange
    from odscen.experiments.regression.baseline import Baseline
    from odscen.experiments.regression.measure import Measured
    from odscen.experiments.regression.verdict import Change
    from odscen.experiments.suites.suite import Case, Suite
    from odscen.experiments.suites.suite_loading import UnusableCase
    from odscen.experiments.suites.suite_parts import RunCase
    from odscen.maps.map_entry import MapEntry
    from odscen.maps.store import Workspace


class Update(NamedTuple):
    """Whether baselines are written anew; ``force`` also of scenarios that fall short."""

    wanted: bool = False
    force: bool = False


NO_UPDATE = Update()
_MAP_CHANGES = 20
"""Differences of a map that are listed; odscen maps diff has all."""


def run_suite(
    workspace: Workspace,
    suite: Suite,
    *,
    processes: int = 1,
    update: Update = NO_UPDATE,
    out: Path | None = None,
    progress: Callable[[str, float], None] | None = None,
    parts: Mapping[str, RunCase] | None = None,
) -> SuiteResult:
    """Run every scenario of a suite with every seed, and judge what comes out.

    A scenario that cannot be read, does not fit its map, or whose map or baseline cannot be used is
    an error of its own, and the others run.

    Parameters
    ----------
    processes
        How many run at a time.
    update
        Whether baselines are written anew of what comes out, instead of holding it against them.
    out
        Keeps the runs there, one folder per scenario and seed, with reports; else they are deleted.
    parts
        What was run elsewhere, by scenario: nothing is run then, and that is judged.

    Raises
    ------
    InputError
        If the suite names a map that is not there and that no scenario is on, a part has a
        scenario that the suite does not have, or baselines are to be written with seeds that were
        given in place of those that the suite has odscen choose.
    WorkspaceError
        If the workspace or ``out`` cannot be written.
    """
    cases = load_cases(workspace, suite, with_baseline=not update.wanted)
    loaded = [case for case in cases if isinstance(case, LoadedCase)]
    if parts is not None:
        take_parts(cases, loaded, parts, sizing=update.wanted)
    else:
        if update.wanted:
            _refuse_given_seeds(suite)
        with tempfile.TemporaryDirectory(prefix="odscen-test-") as temporary:
            runner = SeedRunner(suite, processes, progress)
            place = RunPlace(out or Path(temporary), keep=out is not None)
            if update.wanted:
                aside = RunPlace(Path(temporary) / "changed", keep=False)
                choose_seeds(loaded, runner, place, aside)
            runner.run(loaded, place)
    judged = [_result(case, update) for case in cases]
    return SuiteResult(suite, (*judged, *map(_missing, suite.missing)))


def _refuse_given_seeds(suite: Suite) -> None:
    chosen = [case.name for case in suite.cases if case.other_seeds and case.detect is not None]
    if chosen:
        raise InputError(
            f"seeds of {chosen[0]} are chosen by its detect when baselines are written; give none",
            file=str(suite.file),
            element="detect",
        )


def _missing(baseline: Path) -> CaseResult:
    problem = f"the suite has no scenario of this name; delete {baseline} if it is to go"
    return CaseResult(missing_case(baseline), missing=(problem,))


def _result(loaded: LoadedCase | UnusableCase, update: Update) -> CaseResult:
    if isinstance(loaded, LoadedCase):
        return _judge(loaded, update)
    return _unusable(loaded)


def _unusable(case: UnusableCase) -> CaseResult:
    """A scenario that could not be run; what has changed on its map is the likeliest reason."""
    error, entry, before = case.error, case.entry, case.baseline
    result = CaseResult(case.case, errors=(str(error),), error_code=error.exit_code)
    if entry is None or before is None or before.fingerprint.get("map") == map_digest(entry):
        return result
    cause = Cause("map", "the map")
    changes = _map_changes(case.case, entry, before)
    if changes is None:
        return replace(result, causes=(cause,))
    notes = tuple(one.words for one in changes[:_MAP_CHANGES])
    return replace(result, causes=(_in_words(cause, changes),), notes=notes)


def _judge(loaded: LoadedCase, update: Update) -> CaseResult:
    """Status of a scenario that was run, without or with its baseline."""
    case = loaded.case
    runs = tuple(loaded.runs[seed] for seed in case.seeds if seed in loaded.runs)
    broken = [run.error for run in runs if run.error]
    missed = tuple(missed for run in runs for missed in run.missed)
    result = CaseResult(
        case,
        runs,
        map_name=loaded.run.scenario.map.name,
        entry=loaded.run.entry,
        made_of=loaded.made_of,
        baseline=loaded.baseline,
        sizing=loaded.sizing,
        errors=(*broken, *loaded.refused.values()),
        error_code=3 if broken else 2,
        failures=missed,
    )
    if case.baseline is None or result.errors:
        return result
    figures = {run.seed: run.figures for run in runs}
    result = replace(result, notes=seeds_that_hardly_vary(baseline_of(figures, {})))
    if update.wanted:
        return _updated(result, figures, force=update.force)
    if loaded.baseline is None:
        new = f"there is no baseline {case.baseline}; write it with --update-baseline"
        return replace(result, new=(new,))
    return _held(result, loaded, loaded.baseline, figures)


def _updated(result: CaseResult, figures: Mapping[int, Measured], *, force: bool) -> CaseResult:
    """Write the baseline, unless an expectation is missed."""
    file = result.case.baseline
    if file is None:
        return result
    if result.failures and not force:
        kept = "is left as it was" if file.is_file() else "is not written"
        note = f"the baseline {kept}, as expectations are not met; --force writes it"
        return replace(result, notes=(*result.notes, note))
    baseline = baseline_of(figures, result.made_of, sizing=result.sizing)
    write_baseline(baseline, file, scenario=result.name)
    if result.entry is not None:
        keep_map(file.parent, result.entry, result.made_of["map"])
    return replace(result, updated=True, notes=(*result.notes, *seeds_for_small_changes(baseline)))


def _held(
    result: CaseResult, loaded: LoadedCase, baseline: Baseline, figures: Mapping[int, Measured]
) -> CaseResult:
    """Hold a scenario against its baseline."""
    case = result.case
    verdict = hold_against(
        baseline, figures, case.tolerances, better_fails=case.better_fails, detect=case.detect
    )
    worst = sorted(verdict.failing, key=lambda change: -change.score)
    causes = likeliest_first(causes_between(baseline.fingerprint, loaded.made_of), worst)
    names = {cause.name for cause in causes}
    changes = _map_changes(case, result.entry, baseline) if "map" in names else None
    if changes is not None:
        causes = tuple(_in_words(cause, changes) for cause in causes)
    failures = [*result.failures, *(change.words for change in verdict.failing)]
    failures += _forbidden(case, names)
    # Scatter is known for seeds that the baseline does not have, but only on request.
    own = () if case.other_seeds and baseline.by_scatter else baseline.seeds
    return replace(
        result,
        causes=causes,
        verdict=verdict,
        failures=tuple(failures),
        missing=_seeds(own, figures, "the baseline has seed {}, which was not run"),
        new=(
            *(_seeds(figures, own, "the baseline has no seed {}") if own else ()),
            *_not_sized(case, baseline),
        ),
        notes=(
            *result.notes,
            *_notes(loaded, verdict.figures, names),
            *(one.words for one in (changes or ())[:_MAP_CHANGES]),
        ),
    )


def _forbidden(case: Case, changed: Collection[str]) -> list[str]:
    """Changed inputs that the suite does not allow, whatever becomes of the figures."""
    watched = set(changed) - set(VERSIONS) if case.inputs_fail else set()
    watched |= {"map"} & set(changed) if case.map_fails else set()
    said = "this suite allows no change of"
    return [f"{said} {', '.join(sorted(watched))}"] if watched else []


def _map_changes(
    case: Case, entry: MapEntry | None, baseline: Baseline
) -> tuple[MapChange, ...] | None:
    """What has changed on the map since the baseline, where its map is kept."""
    file, digest = case.baseline, baseline.fingerprint.get("map", "")
    if file is None or entry is None or digest == map_digest(entry):
        return None
    return changes_since(file.parent, digest, entry)


def _in_words(cause: Cause, changes: tuple[MapChange, ...]) -> Cause:
    return replace(cause, words=change_words(changes)) if cause.words == "the map" else cause


def _seeds(there: Iterable[int], known: Iterable[int], words: str) -> tuple[str, ...]:
    """Seeds of one side that the other does not have, in words."""
    listed = ", ".join(map(str, sorted(set(there) - set(known))))
    return (f"{words.format(listed)}; write it with --update-baseline",) if listed else ()


def _not_sized(case: Case, baseline: Baseline) -> tuple[str, ...]:
    """A suite that wants smaller changes to be caught than its baselines were made for."""
    detect = case.detect
    if detect is None or (baseline.sizing is not None and baseline.sizing.is_for(detect)):
        return ()
    wanted = (
        f"{detect.words} with probability {detect.power:g} and {detect.seeds_max} seeds at most"
    )
    return (f"the baseline was not made to catch {wanted}; write it with --update-baseline",)


def _notes(
    loaded: LoadedCase, figures: Iterable[Change], causes: Collection[str]
) -> tuple[str, ...]:
    """Say that demand given by the size or the speed of the map follows the map."""
    follows = [one for one in loaded.run.scenario.demand.background if one.trips is None]
    planned = any(change.key.figure == "planned" for change in figures)
    if not (planned and follows and "map" in causes and "demand" not in causes):
        return ()
    names = ", ".join(one.id for one in follows)
    return (f"the number of road users follows the map: {names} is given per km or as a share",)
