"""A suite: which scenarios are run with which seeds, what must come out, and what came of them."""

from __future__ import annotations

import re
import tomllib
from dataclasses import dataclass, field, replace
from enum import StrEnum
from typing import TYPE_CHECKING, Annotated, Literal, Self

from pydantic import (
    AfterValidator,
    BeforeValidator,
    Field,
    ValidationError,
    ValidationInfo,
    model_validator,
)

from odscen.app.scenarios import scenario_name
from odscen.base.errors import InputError, ScenarioError, in_file
from odscen.base.given_files import as_path, read_given_text
from odscen.experiments.own_figures import FigureEntry, FigureName, declared, refuse_tolerances
from odscen.experiments.tolerance import (
    FEWEST_SEEDS,
    DetectEntry,
    Tolerances,
    detection_of,
    parse_tolerance,
)
from odscen.figures.judging.expectations import CRITERIA, USABLE, parse_expectation
from odscen.figures.measures.registry import ALL_FIGURES
from odscen.scenario.document.document_parts import Label, Part
from odscen.scenario.document.problems import validation_problems
from odscen.scenario.sampling.sampler import Redraw  # noqa: TC001 (pydantic)

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

    from odscen.base.given_files import GivenPath
    from odscen.changes.map_change import MapChange
    from odscen.changes.scenario_differences import ScenarioChange
    from odscen.convert.model.conversion_settings import ConverterName
    from odscen.experiments.baseline import Baseline, Fingerprint
    from odscen.experiments.measure import Measured
    from odscen.experiments.tolerance import Detection, Sizing, Tolerance
    from odscen.experiments.verdict import BaselineVerdict, Cause
    from odscen.figures.judging.expectations import Expectation
    from odscen.figures.measures.figure import Figure
    from odscen.maps.map_entry import MapEntry


MOST_SEEDS = 1000


def _seed_numbers(seeds: object) -> object:
    """``20`` stands for the seeds 1 to 20."""
    if isinstance(seeds, int) and not isinstance(seeds, bool) and 0 < seeds <= MOST_SEEDS:
        return list(range(1, seeds + 1))
    return seeds


Seeds = Annotated[
    tuple[Annotated[int, Field(ge=0, lt=2**31)], ...],
    Field(min_length=1, max_length=MOST_SEEDS),
    BeforeValidator(_seed_numbers),
]
ToleranceTable = dict[str, str | dict[str, str]]

_WILD = re.compile(r"[*?\[]")

_PLACE_KINDS = {figure.kind for figure in ALL_FIGURES} - {"run"}


def _check_expectation(text: str, info: ValidationInfo) -> str:
    try:
        parse_expectation(text, own=info.context or {})
    except InputError as error:
        raise ValueError(error.problem) from error
    return text


def _check_tolerances(table: ToleranceTable, info: ValidationInfo) -> ToleranceTable:
    try:
        _read_tolerances(table, own=info.context or {})
    except InputError as error:
        raise ValueError(str(error)) from error
    return table


def _detect_of_change(entry: object) -> object:
    """``"5 %"`` stands for ``{ change = "5 %" }``."""
    return {"change": entry} if isinstance(entry, str) else entry


MapRule = Literal["report", "lanes", "fail"]
"""Which changes of a map fail: none, those of lanes, widths, limits and connections, or all."""


class _Settings(Part):
    """What may stand at the top, for all scenarios, or at one of them."""

    seeds: Seeds | None = None
    detect: Annotated[DetectEntry, BeforeValidator(_detect_of_change)] | None = None
    redraw: Redraw | None = None
    expect: tuple[Annotated[str, AfterValidator(_check_expectation)], ...] = ()
    usable: bool | None = None
    criteria: bool | None = None
    tolerance: Annotated[ToleranceTable, AfterValidator(_check_tolerances)] = Field(
        default_factory=dict
    )
    until: Annotated[float, Field(gt=0, le=1e9)] | None = None
    step_length: Annotated[float, Field(gt=0, le=1)] | None = None
    time_limit: Annotated[float, Field(gt=0)] | None = None
    better: Literal["pass", "fail"] | None = None
    map: MapRule | None = None
    inputs: Literal["report", "fail"] | None = None

    @model_validator(mode="after")
    def _seeds_or_detect(self) -> Self:
        if self.seeds is not None and self.detect is not None:
            raise ValueError("give seeds or detect, not both: detect chooses the seeds")
        return self


class _ScenarioEntry(_Settings):
    file: Label


class _SuiteDocument(_Settings):
    name: Label | None = None
    maps: tuple[Label, ...] = ()
    scenarios: tuple[Label, ...] = ()
    scenario: tuple[_ScenarioEntry, ...] = ()
    baselines: Label | None = None
    converter: Literal["odscen", "netconvert"] | None = None
    figures: dict[FigureName, FigureEntry] = Field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Case:
    """One scenario of a suite, with everything that is set for it.

    Attributes
    ----------
    file
        Of the scenario; need not be there.
    until, step_length
        Seconds; the scenario's own without.
    time_limit
        Wall seconds of one run.
    baseline
        Its file, whether it is there or not; ``None`` if only expectations count.
    better_fails
        Whether a figure fails, too, that is better than its tolerance allows.
    map_rule
        Which changes of its map since the baseline fail.
    inputs_fail
        Whether it fails when anything that it is made of has changed, versions of odscen and SUMO
        apart.
    redraw
        What a seed draws.
    detect
        The change that the seeds are chosen to catch: those are the baseline's, and ``seeds``
        stands for them until there is one. ``None`` where the suite names seeds.
    other_seeds
        Whether the seeds were given in place of the suite's: a baseline whose scatter decides is
        then good for seeds that it does not have.
    """

    name: str
    file: Path
    seeds: tuple[int, ...]
    expectations: tuple[Expectation, ...]
    tolerances: Tolerances
    until: float | None
    step_length: float | None
    baseline: Path | None
    time_limit: float | None = None
    better_fails: bool = False
    map_rule: MapRule = "lanes"
    inputs_fail: bool = False
    redraw: Redraw = "open"
    detect: Detection | None = None
    other_seeds: bool = False


@dataclass(frozen=True, slots=True)
class Suite:
    """A suite as it was read.

    Attributes
    ----------
    maps
        The .xodr files to test on; need not be there.
    converter
        Who writes their SUMO networks; ``None`` is odscen for ``maps``, and for those of the
        workspace who did.
    missing
        Baselines whose scenario the suite does not have.
    figures
        The suite's own figures of a run, by name.
    whole
        Whether it is all of the suite, not a part.
    """

    name: str
    file: Path
    maps: tuple[Path, ...]
    cases: tuple[Case, ...]
    converter: ConverterName | None = None
    missing: tuple[Path, ...] = ()
    figures: Mapping[str, Figure] = field(default_factory=dict)
    whole: bool = True

    def with_seeds(self, seeds: tuple[int, ...]) -> Suite:
        """Return the suite with other seeds for all scenarios."""
        cases = [replace(case, seeds=seeds, other_seeds=True) for case in self.cases]
        return replace(self, cases=tuple(cases))

    def shard(self, number: int, count: int) -> Suite:
        """Return the ``number``-th of ``count`` parts, from 1: every scenario is in one of them.

        Scenarios are dealt in the order of their names, those that are missing with the others.
        """
        names = sorted({case.name for case in self.cases} | {path.stem for path in self.missing})
        mine = set(names[number - 1 :: count])
        return replace(
            self,
            cases=tuple(case for case in self.cases if case.name in mine),
            missing=tuple(path for path in self.missing if path.stem in mine),
            whole=count == 1,
        )


def missing_case(baseline: Path) -> Case:
    """Stand for a scenario that only its baseline knows; the baseline is its file."""
    return Case(baseline.stem, baseline, (), (), Tolerances({}), None, None, baseline)


def read_suite(file: GivenPath) -> Suite:
    """Read a suite; paths in it are relative to the file.

    Parameters
    ----------
    file
        TOML, see docs/regression.md.

    Returns
    -------
    Suite
        For :func:`odscen.run_suite`.

    Raises
    ------
    InputError
        If the file cannot be read, or a path in it leads nowhere.
    ScenarioError
        If it is not a suite; names every key at fault.
    """
    file = as_path(file)
    try:
        data = tomllib.loads(read_given_text(file))
    except (ValueError, RecursionError) as error:
        raise InputError(f"the suite cannot be read: {error}", file=str(file)) from error
    own = declared(data)
    try:
        document = _SuiteDocument.model_validate(data, context=own)
    except ValidationError as error:
        raise ScenarioError(
            "the suite has problems", problems=validation_problems(error), file=str(file)
        ) from error
    with in_file(str(file)):
        refuse_tolerances(own)
        return _suite_of_document(document, file, own)


def _suite_of_document(document: _SuiteDocument, file: Path, own: Mapping[str, Figure]) -> Suite:
    named = [("scenarios", pattern, _ScenarioEntry(file=pattern)) for pattern in document.scenarios]
    named += [("scenario", entry.file, entry) for entry in document.scenario]
    folder = None if document.baselines is None else file.parent / document.baselines
    cases: dict[str, Case] = {}
    for key, pattern, entry in named:
        for path in _files_of_pattern(file, key, pattern):
            case = _case_of_entry(document, entry, path, folder, own)
            if case.name in cases and key == "scenarios":
                raise InputError(
                    f"{path} has the name of {cases[case.name].file}; baselines go by name",
                    file=str(file),
                    element=key,
                )
            cases[case.name] = case  # a [[scenario]] says more of one listed before
    if not cases:
        raise InputError("the suite names no scenario", file=str(file), element="scenarios")
    maps = [path for pattern in document.maps for path in _files_of_pattern(file, "maps", pattern)]
    old = () if folder is None else sorted(folder.glob("*.json"))
    return Suite(
        name=document.name or file.stem,
        file=file,
        maps=tuple(dict.fromkeys(maps)),
        cases=tuple(cases.values()),
        converter=document.converter,
        missing=tuple(path for path in old if path.stem not in cases),
        figures=own,
    )


def _files_of_pattern(file: Path, key: str, pattern: str) -> list[Path]:
    """Files of a pattern; one that is named need not be there, which is its scenario's error."""
    if not _WILD.search(pattern):
        return [file.parent / pattern]
    try:
        found = sorted(path for path in file.parent.glob(pattern) if path.is_file())
    except (ValueError, NotImplementedError) as error:
        raise InputError(f"{pattern!r}: {error}", file=str(file), element=key) from error
    if not found:
        raise InputError(
            f"there is no file {pattern!r} in {file.parent}", file=str(file), element=key
        )
    return found


def _case_of_entry(
    document: _SuiteDocument,
    entry: _ScenarioEntry,
    path: Path,
    folder: Path | None,
    own: Mapping[str, Figure],
) -> Case:
    name = scenario_name(path)
    tolerances = _read_tolerances(document.tolerance, own=own) | _read_tolerances(
        entry.tolerance, own=own
    )
    wanted = document.usable if entry.usable is None else entry.usable
    expect = dict.fromkeys((*document.expect, *entry.expect))
    seeds, detect = _seeds_and_detect(document, entry, own)
    if detect is not None:
        _refuse_undetectable(detect, tolerances, folder)
    if wanted is not False:
        expect = {USABLE.text: None, **expect}
    if (document.criteria if entry.criteria is None else entry.criteria) is not False:
        expect = {**expect, CRITERIA.text: None}
    return Case(
        name=name,
        file=path,
        seeds=seeds,
        detect=detect,
        expectations=tuple(parse_expectation(text, own=own) for text in expect),
        tolerances=Tolerances(tolerances, own),
        until=entry.until or document.until,
        step_length=entry.step_length or document.step_length,
        baseline=None if folder is None else folder / f"{name}.json",
        time_limit=entry.time_limit or document.time_limit,
        better_fails=(entry.better or document.better) == "fail",
        map_rule=entry.map or document.map or "lanes",
        inputs_fail=(entry.inputs or document.inputs) == "fail",
        redraw=entry.redraw or document.redraw or "open",
    )


def _seeds_and_detect(
    document: _SuiteDocument, entry: _ScenarioEntry, own: Mapping[str, Figure]
) -> tuple[tuple[int, ...], Detection | None]:
    """What the scenario says, else what the suite says; one of both is there at most."""
    nearest: _Settings = entry
    if entry.seeds is None and entry.detect is None:
        nearest = document
    if nearest.detect is None:
        return tuple(dict.fromkeys(nearest.seeds or (0,))), None
    known = {figure.name: figure for figure in ALL_FIGURES if figure.kind == "run"}
    try:
        detect = detection_of(nearest.detect, {**known, **own})
    except InputError as error:
        raise InputError(error.problem, element=f"detect.{error.element}") from error
    return tuple(range(1, FEWEST_SEEDS + 1)), detect


def _refuse_undetectable(
    detect: Detection,
    tolerances: Mapping[tuple[str, str], Tolerance],
    folder: Path | None,
) -> None:
    """Refuse a change that could not be caught, or for which seeds could not be kept."""
    name = detect.figure.name
    if folder is None:
        raise InputError(
            "a change is caught against baselines; name their folder", element="baselines"
        )
    if ("run", name) in tolerances:
        raise InputError(
            f"detect sets what is allowed of {name}; leave out one of them",
            element=f"tolerance.{name}",
        )


def _read_tolerances(
    table: ToleranceTable, *, own: Mapping[str, Figure]
) -> dict[tuple[str, str], Tolerance]:
    """Tolerances by kind of place and figure; ``segment.vehicles`` is in a table."""
    tolerances = {}
    for key, value in table.items():
        kind, rows = ("run", {key: value}) if isinstance(value, str) else (key, value)
        known = {figure.name: figure for figure in ALL_FIGURES if figure.kind == kind}
        known |= own if kind == "run" else {}
        for name, text in rows.items():
            where = f"tolerance.{name}" if kind == "run" else f"tolerance.{kind}.{name}"
            if name not in known:
                listed = ", ".join(sorted(known) or sorted(_PLACE_KINDS))
                raise InputError(f"no figure has this name; known are {listed}", element=where)
            try:
                tolerances[kind, name] = parse_tolerance(str(text), known[name])
            except InputError as error:
                raise InputError(error.problem, element=where) from error
    return tolerances


class CaseStatus(StrEnum):
    """Verdict on a scenario of a suite, the worst first.

    ``error``: it could not be run, or a run failed. ``failed``: an expectation or a tolerance is
    not met. ``missing``: the baseline has the scenario, or a seed, and the suite does not.
    ``new``: the baseline is not there. ``changed``: it passes, with other inputs than the
    baseline's or with better figures. ``passed``: as it was.
    """

    ERROR = "error"
    FAILED = "failed"
    MISSING = "missing"
    NEW = "new"
    CHANGED = "changed"
    PASSED = "passed"

    @property
    def passes(self) -> bool:
        """Whether CI may go on."""
        return self in (CaseStatus.CHANGED, CaseStatus.PASSED)


@dataclass(frozen=True, slots=True)
class SeedResult:
    """One run of a case.

    Attributes
    ----------
    error
        Why it failed, in SUMO's words; ``None`` if it did not.
    missed
        Expectations that it does not meet, in ours.
    folder
        Where it is kept; ``None`` if it was deleted.
    unusable
        Why its figures cannot be used, if the suite expects that they can; one of ``missed``.
    """

    seed: int
    wall_seconds: float
    error: str | None
    missed: tuple[str, ...]
    figures: Measured
    folder: Path | None = None
    unusable: str | None = None


@dataclass(frozen=True, slots=True)
class CaseResult:
    """What became of one scenario of a suite.

    Attributes
    ----------
    map_name
        Of the map that the scenario names; empty if it could not be read.
    entry
        The map that it was run on, whose name may be another; ``None`` if it was not run.
    made_of
        What its runs were made of.
    baseline
        What it was held against.
    causes
        What the runs are made of that the baseline was not made of, the likeliest first; empty
        without a baseline.
    verdict
        Against the baseline; ``None`` without one.
    place
        Where figures have changed most, in words; empty without a baseline, or if nothing has.
    errors, failures, missing, new
        The reasons for a status, in words, the worst first.
    error_code
        Exit code of its errors: 2 for bad input, 3 for a run or tool that failed.
    sizing
        What its seeds were chosen for; ``None`` where the suite names them.
    notes
        What else should be known.
    warnings
        What the checks of the scenario warn of.
    map_changes, scenario_changes
        What has changed since the baseline, where map and scenario of before are kept beside it.
    updated
        Whether the baseline was written anew.
    """

    case: Case
    runs: tuple[SeedResult, ...] = ()
    map_name: str = ""
    entry: MapEntry | None = None
    made_of: Fingerprint = field(default_factory=dict)
    baseline: Baseline | None = None
    causes: tuple[Cause, ...] = ()
    verdict: BaselineVerdict | None = None
    place: str = ""
    errors: tuple[str, ...] = ()
    failures: tuple[str, ...] = ()
    missing: tuple[str, ...] = ()
    new: tuple[str, ...] = ()
    error_code: int = 3
    sizing: Sizing | None = None
    notes: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()
    map_changes: tuple[MapChange, ...] = ()
    scenario_changes: tuple[ScenarioChange, ...] = ()
    updated: bool = False

    @property
    def name(self) -> str:
        """Of the scenario."""
        return self.case.name

    @property
    def status(self) -> CaseStatus:
        """The worst that can be said of it."""
        reasons = {
            CaseStatus.ERROR: self.errors,
            CaseStatus.FAILED: self.failures,
            CaseStatus.MISSING: self.missing,
            CaseStatus.NEW: self.new,
            CaseStatus.CHANGED: self.causes or self.better,
        }
        return next((status for status, found in reasons.items() if found), CaseStatus.PASSED)

    @property
    def label(self) -> str:
        """Status in words."""
        if self.status is CaseStatus.CHANGED and self.better:
            return "changed (better)"
        return "baseline written" if self.updated and self.status.passes else self.status.value

    @property
    def unusable(self) -> tuple[str, ...]:
        """Why the figures of runs cannot be used, seed by seed; empty if they can."""
        return tuple(run.unusable for run in self.runs if run.unusable)

    @property
    def better(self) -> bool:
        """Whether figures are better than the baseline by more than their tolerance."""
        return self.verdict is not None and bool(self.verdict.better)

    @property
    def changed_inputs(self) -> tuple[str, ...]:
        """The causes in words."""
        return tuple(cause.words for cause in self.causes)

    @property
    def problems(self) -> tuple[str, ...]:
        """Every reason not to pass, in words."""
        return (*self.errors, *self.failures, *self.missing, *self.new)

    @property
    def exit_code(self) -> int:
        """0 passes; 1 differs or falls short; 2 cannot be used; 3 a run failed."""
        if self.status is CaseStatus.ERROR:
            return self.error_code
        return 0 if self.status.passes else 1

    @property
    def wall_seconds(self) -> float:
        """Of all runs, one after the other."""
        return sum(run.wall_seconds for run in self.runs)

    @property
    def rank(self) -> tuple[int, float]:
        """Order by badness: the status, then how far the worst figure is off."""
        verdict = self.verdict
        worst = max((change.score for change in verdict.failing), default=0.0) if verdict else 0.0
        return list(CaseStatus).index(self.status), -worst


@dataclass(frozen=True, slots=True)
class SuiteResult:
    """A suite that has been run; ``cases`` are in its order, those that are missing at the end."""

    suite: Suite
    cases: tuple[CaseResult, ...]

    @property
    def exit_code(self) -> int:
        """The largest of the scenarios' codes: 3 before 2 before 1."""
        return max((case.exit_code for case in self.cases), default=0)

    @property
    def worst_first(self) -> tuple[CaseResult, ...]:
        """The scenarios, those to look at first first."""
        return tuple(sorted(self.cases, key=lambda case: (case.rank, case.name)))

    @property
    def counts(self) -> Mapping[CaseStatus, int]:
        """How many scenarios have each verdict, the worst first; without those that none has."""
        found = [case.status for case in self.cases]
        return {status: found.count(status) for status in CaseStatus if status in found}

    @property
    def touched(self) -> Mapping[str, tuple[str, ...]]:
        """Names of the scenarios that each changed input touches; maps by name."""
        found: dict[str, list[str]] = {}
        for case in self.cases:
            for cause in case.causes:
                words = f"the map {case.map_name}" if cause.name == "map" else cause.words
                found.setdefault(words, []).append(case.name)
        return {words: tuple(names) for words, names in found.items()}
