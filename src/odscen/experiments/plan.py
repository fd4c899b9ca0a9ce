"""What an experiment runs: scenarios x variants x cases of the parameters x seeds, in order.

The plan of a study is one JSON or TOML file:

>>> plan = read_study_plan(Path("morning.study.toml"))
>>> plan.seeds
(1, 2, 3)
"""

from __future__ import annotations

import fnmatch
import re
import tomllib
from dataclasses import dataclass
from itertools import product
from pathlib import Path, PurePath
from typing import TYPE_CHECKING, Annotated, Any, Final, Literal, NamedTuple, Self

from pydantic import BeforeValidator, Field, model_validator
from pydantic_core import from_json

from odscen.app.scenarios import read_scenario, scenario_name
from odscen.base.errors import ConflictError, InputError, in_file
from odscen.base.given_files import as_path, read_given_text
from odscen.runs.recording import Recording
from odscen.runs.run_settings import RunSettings
from odscen.scenario.document.document_parts import Label, Part
from odscen.scenario.document.json_form import content_sha256, dumps, loads
from odscen.scenario.document.problems import validated
from odscen.scenario.document.sampling_config import SamplingConfig
from odscen.scenario.sampling.generation_settings import GenerationSettings
from odscen.scenario.sampling.sampler import Redraw  # noqa: TC001 (pydantic)
from odscen.scenario.sweeps.sweep_plan import plan_from_data

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from odscen.base.given_files import GivenPath
    from odscen.maps.store import Workspace
    from odscen.scenario.sweeps.sweep_plan import SweepPlan


MOST_RUNS: Final = 1_000_000
"""Of one study; their names are held in memory."""
AS_DESIGNED: Final = "as-designed"
"""Name of the variant without edits."""
Keep = Literal["none", "failed", "all"]
_PLAIN: Final = r"^[A-Za-z0-9][A-Za-z0-9_.-]{0,99}$"
_SEEDS: Final = re.compile(r"(\d{1,10})-(\d{1,10})")


def _seed_numbers(seeds: object) -> object:
    """``20`` stands for the seeds 1 to 20, ``"101-150"`` for these."""
    if isinstance(seeds, str) and (match := _SEEDS.fullmatch(seeds.strip())):
        first, last = int(match[1]), int(match[2])
        return list(range(first, min(last, first + MOST_RUNS) + 1))
    if isinstance(seeds, int) and not isinstance(seeds, bool) and 0 < seeds <= MOST_RUNS:
        return list(range(1, seeds + 1))
    return seeds


Seeds = Annotated[
    tuple[Annotated[int, Field(ge=0, lt=2**31)], ...],
    Field(min_length=1, max_length=MOST_RUNS),
    BeforeValidator(_seed_numbers),
]


class StudyVariant(Part):
    """A variant of every scenario: edits as ``odscen variant`` takes them, in order."""

    name: Annotated[str, Field(pattern=_PLAIN)]
    edits: Annotated[tuple[dict[str, Any], ...], Field(min_length=1)]


class SampledScenarios(Part):
    """Scenarios that are sampled: ``count`` on each map whose name one of ``maps`` matches.

    Scenario ``k`` of a map has ``seed + k``, as of ``odscen generate``.
    """

    maps: Annotated[tuple[Label, ...], Field(min_length=1)]
    count: Annotated[int, Field(ge=1, le=MOST_RUNS)] = 1
    seed: Annotated[int, Field(ge=0, lt=2**30)] = 0
    fill: Annotated[float, Field(ge=0, le=1)] | None = None
    roi_segments: Annotated[int, Field(ge=1)] | None = None
    config: dict[str, Any] = Field(default_factory=dict)


class StudyRuns(Part):
    """How each run is run; what is not given is the scenario's own."""

    until: Annotated[float, Field(gt=0, le=1e9)] | None = None
    step_length: Annotated[float, Field(gt=0, le=1)] | None = None
    redraw: Redraw = "open"
    warm_up: float | None = None
    interval: float | None = None
    time_limit: Annotated[float, Field(gt=0)] | None = None
    meso: bool = False
    criticality: bool = False
    trajectories: bool = True

    def settings(self, seed: int) -> RunSettings:
        """Settings of a run with a seed; errors of :class:`RunSettings`."""
        given = self.model_dump(exclude={"criticality", "trajectories"})
        recording = Recording(trajectories=self.trajectories, criticality=self.criticality)
        return RunSettings(**given, seed=seed, recording=recording)


class StudyPlan(Part):
    """The plan: every scenario with every variant, every case of the parameters and every seed.

    Attributes
    ----------
    name
        For people.
    scenarios
        Files, or patterns of files, relative to the plan.
    sample
        Scenarios that are sampled.
    seeds
        ``20`` for 1 to 20, a list, or ``"101-150"``.
    variant, only_variants
        Variants; the scenario as designed is one of them unless ``only_variants``.
    vary, method, samples, sample_seed
        Parameters, as ``vary``, ``method``, ``samples`` and ``seed`` of a sweep.
    run
        How each is run.
    keep
        Which run folders stay: ``none`` (only rows of the table), ``failed`` or ``all``.
    """

    name: Label
    scenarios: tuple[Label, ...] = ()
    sample: tuple[SampledScenarios, ...] = ()
    seeds: Seeds = (1,)
    variant: tuple[StudyVariant, ...] = ()
    only_variants: bool = False
    vary: tuple[dict[str, Any], ...] = ()
    method: Label | None = None
    samples: Annotated[int, Field(ge=1)] | None = None
    sample_seed: Annotated[int, Field(ge=0)] = 0
    run: StudyRuns = StudyRuns()
    keep: Keep = "none"

    @model_validator(mode="after")
    def _check_consistency(self) -> Self:
        if not self.scenarios and not self.sample:
            raise ValueError("nothing is run: give scenarios (files) or sample")
        if len(set(self.seeds)) < len(self.seeds):
            raise ValueError("seeds has a seed twice")
        names = self.variant_names
        if len(set(names)) < len(names) or not names:
            raise ValueError("variant: each needs a name of its own, and there must be one")
        try:
            if (sweep := self.sweep()) is not None:
                sweep.cases()
            self.run.settings(0)
        except InputError as error:
            raise ValueError(error.problem) from error
        return self

    @property
    def variant_names(self) -> tuple[str, ...]:
        """Names of all variants, in order."""
        own = tuple(variant.name for variant in self.variant)
        return own if self.only_variants else (AS_DESIGNED, *own)

    def sweep(self) -> SweepPlan | None:
        """What the parameters are; ``None`` if none is varied.

        Raises
        ------
        InputError
            If it is not possible.
        """
        if not self.vary:
            if self.samples is not None or self.method is not None:
                raise InputError("method and samples are of vary, and nothing is varied")
            return None
        data: dict[str, Any] = {"vary": list(self.vary), "seed": self.sample_seed}
        if self.samples is not None:
            data["samples"] = self.samples
        if self.method is not None:
            data["method"] = self.method
        return plan_from_data(data)


def read_plan_data(file: Path) -> dict[str, Any]:
    """Read the object that a plan file holds, TOML by its ending or else JSON.

    Raises
    ------
    InputError
        If it cannot be read, or holds something else.
    """
    text = read_given_text(file)
    with in_file(str(file)):
        try:
            data = tomllib.loads(text) if file.suffix == ".toml" else from_json(text)
        except (ValueError, RecursionError) as error:
            raise InputError(f"not a plan: {error}") from error
        if not isinstance(data, dict):
            raise InputError("not a plan: it must be an object with scenarios or sample")
        return data


def read_study_plan(file: GivenPath) -> StudyPlan:
    """Read a plan.

    Raises
    ------
    InputError
        If the file cannot be read.
    ScenarioError
        With every problem of it, each with its place and value.
    """
    file = as_path(file)
    data = read_plan_data(file)
    with in_file(str(file)):
        return validated(StudyPlan, data)


class StudyRun(NamedTuple):
    """One run of a study.

    Attributes
    ----------
    name
        Its own in the study, and a path: ``crossing/as-designed/case-3/seed-1``.
    case
        Number of the values from 1 on; 0 if no parameter is varied.
    """

    name: str
    scenario: str
    variant: str
    case: int
    seed: int


@dataclass(frozen=True, slots=True)
class ScenarioSource:
    """Where a scenario comes from: its document, or what it is sampled by.

    Attributes
    ----------
    map_name, map_sha256
        The map.
    text
        The document; ``None`` of a sampled one.
    seed
        Of the sampling.
    config
        Of the sampling, JSON-ready.
    """

    name: str
    map_name: str
    map_sha256: str
    text: str | None = None
    seed: int = 0
    config: Mapping[str, Any] | None = None

    @property
    def identity(self) -> tuple[object, ...]:
        """Equal for scenarios that are the same document."""
        own = content_sha256(loads(self.text)) if self.text is not None else None
        return self.map_sha256, own, self.seed, repr(self.config)


@dataclass(frozen=True, slots=True)
class StudyGrid:
    """A plan with its scenarios found.

    Attributes
    ----------
    sources
        Scenarios by name, in order.
    cases
        Values of the parameters, case by case; empty if none is varied.
    """

    plan: StudyPlan
    sources: Mapping[str, ScenarioSource]
    cases: tuple[Mapping[str, float], ...]

    @property
    def count(self) -> int:
        """How many runs there are."""
        variants = len(self.plan.variant_names)
        return len(self.sources) * variants * max(len(self.cases), 1) * len(self.plan.seeds)

    @property
    def parameters(self) -> tuple[str, ...]:
        """Parameters that are varied."""
        return tuple(self.cases[0]) if self.cases else ()

    def runs(self) -> Iterator[StudyRun]:
        """All runs, in order."""
        numbers = range(1, len(self.cases) + 1) if self.cases else (0,)
        each = product(self.sources, self.plan.variant_names, numbers, self.plan.seeds)
        for scenario, variant, case, seed in each:
            part = f"/case-{case}" if case else ""
            yield StudyRun(f"{scenario}/{variant}{part}/seed-{seed}", scenario, variant, case, seed)

    def values(self, case: int) -> Mapping[str, float]:
        """Values of a case."""
        return self.cases[case - 1] if case else {}


def grid_of(plan: StudyPlan, sources: Mapping[str, ScenarioSource]) -> StudyGrid:
    """All runs of a plan.

    Raises
    ------
    InputError
        If there are too many.
    """
    sweep = plan.sweep()
    cases = () if sweep is None else sweep.cases()
    _refuse_too_many(plan, scenarios=len(sources), cases=max(len(cases), 1))
    return StudyGrid(plan, sources, cases)


def _refuse_too_many(plan: StudyPlan, *, scenarios: int, cases: int) -> None:
    """Raise :class:`InputError` if a study has more runs than may be, and say of what."""
    variants, seeds = len(plan.variant_names), len(plan.seeds)
    number = scenarios * variants * cases * seeds
    if number > MOST_RUNS:
        raise InputError(
            f"the study has {number:,} runs; at most {MOST_RUNS:,} are possible: "
            f"divide it, for example by maps (scenarios: {scenarios:,}, variants: {variants:,}, "
            f"cases: {cases:,}, seeds: {seeds:,})"
        )


def found_sources(
    plan: StudyPlan, workspace: Workspace, *, beside: Path
) -> dict[str, ScenarioSource]:
    """Scenarios of a plan: files that are read, and what is sampled.

    Parameters
    ----------
    beside
        Folder that file names are relative to.

    Raises
    ------
    InputError
        If a pattern matches no file or no map, or two scenarios have the same name.
    NotFoundError
        If the workspace does not have a map.
    """
    sources: dict[str, ScenarioSource] = {}
    for source in (
        *_read_scenario_files(plan, workspace, beside),
        *_sampled_sources(plan, workspace),
    ):
        if source.name in sources:
            raise InputError(f"two scenarios of the study are called {source.name!r}")
        sources[source.name] = source
    return sources


def _read_scenario_files(
    plan: StudyPlan, workspace: Workspace, beside: Path
) -> Iterator[ScenarioSource]:
    for pattern in plan.scenarios:
        path = beside / pattern
        try:
            files = [path] if path.is_file() else _matching_files(beside, pattern)
        except (ValueError, NotImplementedError) as error:
            raise InputError(f"scenarios: {pattern!r} is no pattern of files: {error}") from error
        if not files:
            raise InputError(f"scenarios: no file matches {pattern!r} in {beside}")
        for file in files:
            scenario = read_scenario(file)
            entry = workspace.map_for(scenario.map.name, scenario.map.sha256)
            refuse_unknown_parameters(plan, scenario.parameters, str(file))
            yield ScenarioSource(scenario_name(file), entry.name, entry.sha256, dumps(scenario))


def _matching_files(beside: Path, pattern: str) -> list[Path]:
    """Files of a pattern that is relative to a folder, or absolute."""
    path = PurePath(pattern)
    if not path.name:
        return []  # ".", "./" and "/" have no part that files could match
    root = Path(path.anchor) if path.is_absolute() else beside
    return sorted(root.glob(str(path.relative_to(path.anchor))))


def refuse_unknown_parameters(
    plan: StudyPlan, parameters: Mapping[str, object], place: str
) -> None:
    """Raise :class:`InputError` if a plan varies what is no parameter of a scenario."""
    sweep = plan.sweep()
    for name in () if sweep is None else sweep.names:
        if name not in parameters:
            raise InputError(
                f"the scenario has no parameter {name!r}; it has {', '.join(parameters) or 'none'}",
                file=place,
            )


def _sampled_sources(plan: StudyPlan, workspace: Workspace) -> Iterator[ScenarioSource]:
    # Counted before any is made: each sample may be a million on each of many maps.
    number = sum(sample.count * len(_match_maps(sample, workspace)) for sample in plan.sample)
    _refuse_too_many(plan, scenarios=number, cases=1)
    for scenarios in plan.sample:
        settings = _sampling_settings(scenarios)
        config = settings.sampling.model_dump(mode="json")
        for name in _match_maps(scenarios, workspace):
            refuse_unknown_parameters(plan, {}, f"{name} (sampled)")
            entry = workspace.map(name)
            for seed in range(scenarios.seed, scenarios.seed + scenarios.count):
                yield ScenarioSource(
                    f"{name}-{seed:04d}", name, entry.sha256, seed=seed, config=config
                )


def _sampling_settings(sampled_scenarios: SampledScenarios) -> GenerationSettings:
    config = validated(SamplingConfig, sampled_scenarios.config)
    return GenerationSettings(
        count=sampled_scenarios.count,
        seed=sampled_scenarios.seed,
        fill=sampled_scenarios.fill,
        roi_segments=sampled_scenarios.roi_segments,
        config=config,
    )


def _match_maps(sampled_scenarios: SampledScenarios, workspace: Workspace) -> list[str]:
    names = workspace.map_names()
    found = [
        name
        for name in names
        if any(fnmatch.fnmatchcase(name, each) for each in sampled_scenarios.maps)
    ]
    for pattern in sampled_scenarios.maps:
        if not fnmatch.filter(names, pattern):
            raise InputError(
                f"sample: no map matches {pattern!r}; there are {', '.join(names) or 'none'}"
            )
    return found


def refuse_other(old: StudyGrid, new: StudyGrid) -> None:
    """Refuse a plan that would change runs which a study has, or leave some out.

    Raises
    ------
    ConflictError
        Names what differs.
    """
    for what, one, other in (
        ("run", old.plan.run, new.plan.run),
        ("keep", old.plan.keep, new.plan.keep),
    ):
        if one != other:
            raise ConflictError(f"{what} differs from that of the study; name another folder")
    lost = sorted(set(old.plan.seeds) - set(new.plan.seeds))
    if lost:
        raise ConflictError(
            f"seed {lost[0]} of the study is not in the plan; a study can only be extended"
        )
    if old.cases != new.cases[: len(old.cases)] or bool(old.cases) != bool(new.cases):
        raise ConflictError(
            "the plan varies other values; cases can only be added after those of the study"
        )
    _refuse_other_variants(old, new)
    for name, source in old.sources.items():
        if name not in new.sources or new.sources[name].identity != source.identity:
            raise ConflictError(
                f"scenario {name!r} has changed or is not in the plan; name another folder"
            )


def _refuse_other_variants(old: StudyGrid, new: StudyGrid) -> None:
    theirs = {variant.name: variant for variant in new.plan.variant}
    for variant in old.plan.variant:
        if theirs.get(variant.name) != variant:
            raise ConflictError(
                f"variant {variant.name!r} has changed or is not in the plan; name another folder"
            )
    if not old.plan.only_variants and new.plan.only_variants:
        raise ConflictError(
            "the scenarios as designed are not in the plan; a study can only be extended"
        )
