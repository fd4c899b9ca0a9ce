"""Run a suite: scenarios times seeds, each judged by its expectations and its baseline.

Seeds of a new baseline are chosen scenario by scenario, so that they catch what they are to. How
far differences scatter where something has changed, only a change can tell, and changes are not
alike in it. So a pilot runs each scenario as it is and, with the same seeds, with two changes:
drivers who keep a longer headway, chosen so that the figure changes by about as much as is to be
caught, and steps of another length, which move all traffic about. The one that scatters more
counts. More seeds are run as long as those that are there ask for more.
"""

from __future__ import annotations

import gzip
import json
import shutil
import zlib
from dataclasses import replace
from statistics import fmean
from typing import TYPE_CHECKING, NamedTuple

from odscen.base.atomic_folders import scratch_folder
from odscen.base.errors import InputError, OdscenError
from odscen.base.given_files import MOST, as_path
from odscen.base.text_files import write_file
from odscen.changes.map_differences import map_differences
from odscen.changes.scenario_differences import scenario_differences
from odscen.experiments.baseline import (
    baseline_of,
    map_digest,
    seeds_for_small_changes,
    seeds_that_hardly_vary,
    write_baseline,
)
from odscen.experiments.suite import CaseResult, SuiteResult, missing_case
from odscen.experiments.suite_runs import LoadedCase, RunPlace, SeedRunner, load_cases, take_parts
from odscen.experiments.tolerance import FEWEST_SEEDS, size_of
from odscen.experiments.verdict import (
    VERSIONS,
    Cause,
    Effect,
    causes_between,
    hold_against,
    likeliest_first,
)
from odscen.experiments.work import LocalExecutor
from odscen.lanegraph.query import segment_of_node
from odscen.opendrive.parse import parse
from odscen.opendrive.parse_rules import MAX_BYTES
from odscen.scenario.document.json_form import dumps, loads
from odscen.sumo.realize.driving import normal_headway

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
    from pathlib import Path

    from odscen.app.running.runs import CheckedRun
    from odscen.base.given_files import GivenPath
    from odscen.changes.map_change import ChangedThing, MapChange
    from odscen.changes.scenario_differences import ScenarioChange
    from odscen.experiments.baseline import Baseline, Fingerprint
    from odscen.experiments.measure import Measured
    from odscen.experiments.suite import Case, Suite
    from odscen.experiments.suite_runs import RunCase, UnusableCase
    from odscen.experiments.tolerance import Detection
    from odscen.experiments.verdict import BaselineVerdict, Change
    from odscen.maps.map_entry import MapEntry
    from odscen.maps.store import Workspace
    from odscen.opendrive.road_model import OpenDrive
    from odscen.runs.run_settings import RunSettings
    from odscen.scenario.document.scenario_document import Scenario


PILOT = 16
"""Seeds, at least, from which the scatter of differences is estimated."""

PROBE = 1.0
"""Seconds more of headway with which its effect on the figure is estimated."""

_LEAST, _MOST = 0.02, 1.5
"""Share of the probe, at least and at most, that the pilot takes."""

_LONGEST = 5.0
"""Seconds of headway that a scenario may have."""

_LONGEST_STEP = 1.0
"""Seconds."""


def choose_seeds(
    cases: Sequence[LoadedCase], runner: SeedRunner, place: RunPlace, aside: RunPlace
) -> None:
    """Give each case that has a change to catch its seeds, its sizing and its runs.

    A case with runs that fail keeps the seeds that it was run with, and has no sizing.

    Parameters
    ----------
    place
        Of runs of the scenarios as they are.
    aside
        Of runs of the scenarios with a change, none of which stays.
    """
    pilots = [_Pilot(case, case.case.detect) for case in cases if case.case.detect is not None]
    pilots = _run_as_they_are(pilots, runner, place)
    for pilot in pilots:
        pilot.slower = pilot.with_headway(PROBE, seeds=FEWEST_SEEDS)
    runner.run([pilot.slower for pilot in pilots], aside)
    for pilot in pilots:
        pilot.slower = pilot.with_headway(pilot.more_headway(), seeds=pilot.count)
    while pilots:
        runner.run([pilot.slower for pilot in pilots], aside)
        runner.run([pilot.stepped for pilot in pilots], aside)
        pilots = [pilot for pilot in pilots if pilot.goes_on()]
        pilots = _run_as_they_are(pilots, runner, place)


def _run_as_they_are(pilots: Sequence[_Pilot], runner: SeedRunner, place: RunPlace) -> list[_Pilot]:
    """Run scenarios with the seeds that they are to have by now; those that work are left."""
    for pilot in pilots:
        pilot.case.case = _with_seeds(pilot.case, pilot.count)
    runner.run([pilot.case for pilot in pilots], place)
    return [pilot for pilot in pilots if _case_works(pilot.case)]


def _case_works(case: LoadedCase) -> bool:
    return not case.refused and not any(run.error for run in case.runs.values())


def _with_seeds(case: LoadedCase, count: int) -> Case:
    return replace(case.case, seeds=tuple(range(1, count + 1)))


class _Pilot:
    """A scenario as it is and, with the same seeds, with changes; ``count`` seeds by now."""

    def __init__(self, case: LoadedCase, detect: Detection) -> None:
        self.case = case
        self.detect = detect
        self.count = min(PILOT, detect.seeds_max)
        self.slower = case
        self.stepped = self._change_case(
            replace(case.run, settings=with_other_steps(case.run)), seeds=self.count
        )

    def _change_case(self, run: CheckedRun, *, seeds: int) -> LoadedCase:
        return replace(self.case, case=_with_seeds(self.case, seeds), run=run, runs={}, refused={})

    def with_headway(self, more: float, *, seeds: int) -> LoadedCase:
        """The scenario with drivers who keep so many seconds more."""
        run = replace(self.case.run, scenario=with_longer_headway(self.case.run.scenario, more))
        return self._change_case(run, seeds=seeds)

    def more_headway(self) -> float:
        """Seconds with which the figure changes by what is to be caught, if it is proportional."""
        pairs = self._figure_pairs(self.slower)
        effect = abs(fmean(new - old for old, new in pairs)) if pairs else 0.0
        share = self.detect.size(fmean(old for old, _ in pairs)) / effect if effect else _MOST
        return PROBE * min(_MOST, max(_LEAST, share))

    def goes_on(self) -> bool:
        """Whether more seeds are to be run; else the case has its seeds."""
        pairs = self._figure_pairs(self.slower)
        if len(pairs) < FEWEST_SEEDS:
            self.case.refused[-1] = (
                f"{len(pairs)} of {self.count} pairs of runs, as it is and with a longer headway, "
                f"have {self.detect.figure.name}; {FEWEST_SEEDS} are needed to choose seeds"
            )
            return False
        sizing = size_of(self.detect, pairs, self._figure_pairs(self.stepped))
        if sizing.seeds > self.count:
            self.count = min(sizing.seeds, 2 * self.count)
            for changed in (self.slower, self.stepped):
                changed.case = _with_seeds(changed, self.count)
            return True
        self.case.case = _with_seeds(self.case, sizing.seeds)
        self.case.sizing = sizing
        self._leave_others()
        return False

    def _figure_pairs(self, changed: LoadedCase) -> list[tuple[float, float]]:
        """The figure as it is and with a change, of seeds that have it on both sides."""
        key = self.detect.key
        found = [
            (run.figures.get(key), changed.runs[seed].figures.get(key))
            for seed, run in sorted(self.case.runs.items())
            if seed in changed.runs
        ]
        return [(old, new) for old, new in found if old is not None and new is not None]

    def _leave_others(self) -> None:
        """Forget runs of the pilot that the baseline does not need."""
        for seed in self.case.runs.keys() - set(self.case.case.seeds):
            run = self.case.runs.pop(seed)
            if run.folder is not None:
                shutil.rmtree(run.folder)


def with_longer_headway(scenario: Scenario, more: float) -> Scenario:
    """Let drivers keep so many seconds more; driver sets with a headway of their own stay."""
    headway = min(_LONGEST, normal_headway(scenario.drivers) + more)
    drivers = scenario.drivers.model_copy(
        update={"headway": round(headway, 3), "saturation_flow": None}
    )
    return scenario.model_copy(update={"drivers": drivers})


def with_other_steps(run: CheckedRun) -> RunSettings:
    """Double the length of steps; half it where that would be above a second."""
    step = run.settings.step_length or run.scenario.simulation.step_length
    return replace(run.settings, step_length=2 * step if 2 * step <= _LONGEST_STEP else step / 2)


LANE_CHANGES: frozenset[ChangedThing] = frozenset(
    {"road", "lane", "lane type", "lane direction", "width", "limit", "permission", "connection"}
)
"""What of a map says where vehicles may drive and how fast: fails unless a suite says otherwise."""

FOLDER = "maps"
_NAMED = 2


def keep_map(baselines: Path, entry: MapEntry, digest: str) -> None:
    """Keep the OpenDRIVE text of a map, compressed; a map that is kept already is left alone."""
    file = _path_of_kept_map(baselines, digest)
    if not file.is_file():
        write_file(file, gzip.compress(entry.read("xodr"), mtime=0))


def keep_scenario(baselines: Path, name: str, scenario: Scenario, made_of: Fingerprint) -> None:
    """Keep the scenario of a baseline, compressed, to say later which fields have changed."""
    kept = {"made_of": _scenario_parts(made_of), "scenario": json.loads(dumps(scenario))}
    text = json.dumps(kept, sort_keys=True, separators=(",", ":"))
    write_file(_path_of_kept_scenario(baselines, name), gzip.compress(text.encode(), mtime=0))


def scenario_changes_since(
    baselines: Path, name: str, made_of: Fingerprint, scenario: Scenario
) -> tuple[ScenarioChange, ...]:
    """Fields that differ from the scenario of a baseline; none where that one is not kept.

    Parameters
    ----------
    baselines
        Folder of the baseline.
    made_of
        Fingerprint of the baseline.
    scenario
        The one of now.
    """
    try:
        with gzip.open(_path_of_kept_scenario(baselines, name)) as stream:
            kept = json.loads(stream.read(MOST))
        if kept["made_of"] != _scenario_parts(made_of):
            return ()
        return scenario_differences(loads(json.dumps(kept["scenario"])), scenario)
    except (OSError, EOFError, zlib.error, ValueError, KeyError, TypeError, OdscenError):
        return ()


def _path_of_kept_scenario(baselines: Path, name: str) -> Path:
    return baselines / "scenarios" / f"{name}.json.gz"


def _scenario_parts(made_of: Fingerprint) -> Fingerprint:
    return {name: digest for name, digest in made_of.items() if name.startswith("scenario.")}


def _scenario_as_run(run: CheckedRun) -> Scenario:
    """The scenario with what the suite says of its simulation."""
    until, step_length = run.settings.times(run.scenario)
    own = run.scenario.simulation.model_copy(update={"duration": until, "step_length": step_length})
    return run.scenario.model_copy(update={"simulation": own})


def changes_since(baselines: Path, digest: str, entry: MapEntry) -> tuple[MapChange, ...] | None:
    """What has changed on a map since the baseline; ``None`` where its map is not kept.

    Parameters
    ----------
    baselines
        Folder of the baseline.
    digest
        ``map`` of the baseline's fingerprint.
    entry
        The map of now.
    """
    before = _read_kept_map(_path_of_kept_map(baselines, digest), digest)
    if before is None:
        return None
    return map_differences(before, parse(entry.read("xodr"), file=entry.path("xodr").name))


def change_words(changes: tuple[MapChange, ...]) -> str:
    """The first differences in words, and how many more there are."""
    if not changes:
        return "the map is written otherwise, but means the same"
    first = sorted(changes, key=lambda change: change.what not in LANE_CHANGES)
    named = "; ".join(change.words for change in first[:_NAMED])
    more = len(changes) - _NAMED
    return f"the map: {named}" + (f"; and {more} more" if more > 0 else "")


def _path_of_kept_map(baselines: Path, digest: str) -> Path:
    return baselines / FOLDER / f"{digest}.xodr.gz"


def _read_kept_map(file: Path, digest: str) -> OpenDrive | None:
    """A map that was kept; one that is damaged or missing tells nothing, and fails nothing."""
    try:
        with gzip.open(file) as stream:
            text = stream.read(MAX_BYTES)
        return parse(text, file=file.name) if digest else None
    except (OSError, EOFError, zlib.error, OdscenError):
        return None


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
    out: GivenPath | None = None,
    progress: Callable[[str, float], None] | None = None,
    parts: Mapping[str, RunCase] | None = None,
) -> SuiteResult:
    """Run every scenario of a suite with every seed, and judge what comes out.

    A scenario that cannot be read, does not fit its map, or whose map or baseline cannot be used is
    an error of its own, and the others run.

    Parameters
    ----------
    workspace
        Keeps the maps.
    suite
        As :func:`odscen.read_suite` reads it.
    processes
        How many run at a time.
    update
        Whether baselines are written anew of what comes out, instead of holding it against them.
    out
        Keeps the runs there, one folder per scenario and seed, with reports; else they are deleted.
    progress
        Called with the name of a run and how much of all runs has been carried out, 0 to 1.
    parts
        What was run elsewhere, by scenario: nothing is run then, and that is judged.

    Returns
    -------
    SuiteResult
        ``cases`` with status and problems of each scenario; ``exit_code`` is 0 if all pass.

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
        with scratch_folder() as temporary:
            runner = SeedRunner(suite, LocalExecutor(workspace, processes), progress)
            place = RunPlace(temporary if out is None else as_path(out), keep=out is not None)
            if update.wanted:
                aside = RunPlace(temporary / "changed", keep=False)
                choose_seeds(loaded, runner, place, aside)
            runner.run(loaded, place)
    judged = [_case_result(case, update) for case in cases]
    return SuiteResult(suite, (*judged, *map(_missing_result, suite.missing)))


def _refuse_given_seeds(suite: Suite) -> None:
    chosen = [case.name for case in suite.cases if case.other_seeds and case.detect is not None]
    if chosen:
        raise InputError(
            f"seeds of {chosen[0]} are chosen by its detect when baselines are written; give none",
            file=str(suite.file),
            element="detect",
        )


def _missing_result(baseline: Path) -> CaseResult:
    problem = f"the suite has no scenario of this name; delete {baseline} if it is to go"
    return CaseResult(missing_case(baseline), missing=(problem,))


def _case_result(loaded: LoadedCase | UnusableCase, update: Update) -> CaseResult:
    if isinstance(loaded, LoadedCase):
        return _judge_case(loaded, update)
    return _unusable_result(loaded)


def _unusable_result(case: UnusableCase) -> CaseResult:
    """A scenario that could not be run; what has changed on its map is the likeliest reason."""
    error, entry, before = case.error, case.entry, case.baseline
    result = CaseResult(case.case, errors=(str(error),), error_code=error.exit_code)
    if entry is None or before is None or before.fingerprint.get("map") == map_digest(entry):
        return result
    cause = Cause("map", "the map")
    changes = _map_changes(case.case, entry, before)
    if changes is None:
        return replace(result, causes=(cause,))
    notes = tuple(change.words for change in changes[:_MAP_CHANGES])
    return replace(
        result, causes=(_put_in_words(cause, changes),), notes=notes, map_changes=changes
    )


def _judge_case(loaded: LoadedCase, update: Update) -> CaseResult:
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
        warnings=tuple(str(problem) for problem in loaded.run.warnings),
    )
    if case.baseline is None or result.errors:
        return result
    figures = {run.seed: run.figures for run in runs}
    result = replace(result, notes=seeds_that_hardly_vary(baseline_of(figures, {})))
    if update.wanted:
        return _write_new_baseline(
            result, _scenario_as_run(loaded.run), figures, force=update.force
        )
    if loaded.baseline is None:
        new = f"there is no baseline {case.baseline}; write it with --update-baseline"
        return replace(result, new=(new,))
    return _hold_case(result, loaded, loaded.baseline, figures)


def _write_new_baseline(
    result: CaseResult, scenario: Scenario, figures: Mapping[int, Measured], *, force: bool
) -> CaseResult:
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
    keep_scenario(file.parent, result.name, scenario, result.made_of)
    return replace(result, updated=True, notes=(*result.notes, *seeds_for_small_changes(baseline)))


def _hold_case(
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
        causes = tuple(_put_in_words(cause, changes) for cause in causes)
    fields: tuple[ScenarioChange, ...] = ()
    if case.baseline is not None and any(cause.part for cause in causes):
        fields = scenario_changes_since(
            case.baseline.parent, case.name, baseline.fingerprint, _scenario_as_run(loaded.run)
        )
        fields = tuple(_with_map_times(change, loaded.run) for change in fields)
        causes = tuple(_with_fields(cause, fields) for cause in causes)
    failures = [*result.failures, *(change.words for change in verdict.failing)]
    failures += _forbidden_changes(case, names, changes or ())
    # Scatter is known for seeds that the baseline does not have, but only on request.
    own = () if case.other_seeds and baseline.by_scatter else baseline.seeds
    return replace(
        result,
        causes=causes,
        verdict=verdict,
        place=_describe_place(verdict, loaded.run),
        failures=tuple(failures),
        map_changes=changes or (),
        scenario_changes=fields,
        missing=_describe_missing_seeds(
            own, figures, "the baseline has seed {}, which was not run"
        ),
        new=(
            *(_describe_missing_seeds(figures, own, "the baseline has no seed {}") if own else ()),
            *_explain_sizing(case, baseline),
        ),
        notes=(
            *result.notes,
            *_note_map_dependence(loaded, verdict.figures, names),
            *(change.words for change in (changes or ())[:_MAP_CHANGES]),
        ),
    )


def _describe_place(verdict: BaselineVerdict, run: CheckedRun) -> str:
    """Where figures have changed most, beyond their tolerance if any is.

    Pedestrians have no figures of places: where actors alone differ, and none by more than is
    allowed, the first to depart leads to the reason.
    """
    most = verdict.where
    if most is None:
        return ""
    actors = {actor.id: actor for actor in run.scenario.actors}
    word = "most"
    if most.effect is Effect.ALLOWED:
        if most.key.kind == "actor":
            word = "first"
            known = [change for change in verdict.allowed if change.key.place in actors]
            most = min(known, key=lambda change: actors[change.key.place].depart, default=most)
        word += ", within what is allowed,"
    start = ""
    if most.key.kind == "actor" and (actor := actors.get(most.key.place)) is not None:
        segment = segment_of_node(run.map.sumo.graph, actor.spawn)
        start = f", which starts on segment {segment} at {actor.depart:g} s"
    return f"{word} at {most.words}{start}"


def _forbidden_changes(
    case: Case, changed: Collection[str], on_map: Sequence[MapChange]
) -> list[str]:
    """Changed inputs that the suite does not allow, whatever becomes of the figures."""
    watched = set(changed) - set(VERSIONS) if case.inputs_fail else set()
    watched |= {"map"} & set(changed) if case.map_rule == "fail" else set()
    if case.map_rule == "lanes" and "map" not in watched:
        watched |= {f"{change.what} on the map" for change in on_map if change.what in LANE_CHANGES}
    refusal = "this suite allows no change of"
    return [f"{refusal} {', '.join(sorted(watched))}"] if watched else []


def _map_changes(
    case: Case, entry: MapEntry | None, baseline: Baseline
) -> tuple[MapChange, ...] | None:
    """What has changed on the map since the baseline, where its map is kept."""
    file, digest = case.baseline, baseline.fingerprint.get("map", "")
    if file is None or entry is None or digest == map_digest(entry):
        return None
    return changes_since(file.parent, digest, entry)


def _put_in_words(cause: Cause, changes: tuple[MapChange, ...]) -> Cause:
    return replace(cause, words=change_words(changes)) if cause.words == "the map" else cause


def _with_fields(cause: Cause, changes: Sequence[ScenarioChange]) -> Cause:
    """The cause with the fields that have changed in its part of the scenario."""
    mine = [change.words for change in changes if cause.part and change.place[0] == cause.part]
    more = f"; and {len(mine) - _NAMED} more" if len(mine) > _NAMED else ""
    return replace(cause, details="; ".join(mine[:_NAMED]) + more)


def _with_map_times(change: ScenarioChange, run: CheckedRun) -> ScenarioChange:
    """The change of a light that has times of its own on one side: those of the map on the other.

    They are those of the map as it is now.
    """
    if change.place[:2] != ("signals", "junctions") or change.kind == "changed":
        return change
    green = next((x.green for x in run.map.lights if change.place[2] in x.names), None)
    if green is None:
        return change
    program = f"{json.dumps({'green': green})} of the map"
    if change.kind == "added":
        return replace(change, before=program)
    return replace(change, after=program)


def _describe_missing_seeds(
    there: Iterable[int], known: Iterable[int], words: str
) -> tuple[str, ...]:
    """Seeds of one side that the other does not have, in words."""
    listed = ", ".join(map(str, sorted(set(there) - set(known))))
    return (f"{words.format(listed)}; write it with --update-baseline",) if listed else ()


def _explain_sizing(case: Case, baseline: Baseline) -> tuple[str, ...]:
    """A suite that wants smaller changes to be caught than its baselines were made for."""
    detect = case.detect
    if detect is None or (baseline.sizing is not None and baseline.sizing.is_for(detect)):
        return ()
    wanted = (
        f"{detect.words} with probability {detect.power:g} and {detect.seeds_max} seeds at most"
    )
    return (f"the baseline was not made to catch {wanted}; write it with --update-baseline",)


def _note_map_dependence(
    loaded: LoadedCase, figures: Iterable[Change], causes: Collection[str]
) -> tuple[str, ...]:
    """Say that demand given by the size or the speed of the map follows the map."""
    follows = [
        background
        for background in loaded.run.scenario.demand.background
        if background.trips is None
    ]
    planned = any(change.key.figure == "planned" for change in figures)
    if not (planned and follows and "map" in causes and "demand" not in causes):
        return ()
    names = ", ".join(follow.id for follow in follows)
    return (f"the number of road users follows the map: {names} is given per km or as a share",)
