"""All runs of a study, in order: scenarios x variants x cases of the parameters x seeds."""

from __future__ import annotations

import fnmatch
from dataclasses import dataclass
from itertools import product
from typing import TYPE_CHECKING, Any, NamedTuple

from odscen.app.scenarios import read_scenario, scenario_name
from odscen.base.errors import ConflictError, InputError
from odscen.experiments.studies.study_plan import MOST_RUNS
from odscen.scenario.document.json_form import content_sha256, dumps, loads
from odscen.scenario.document.problems import validated
from odscen.scenario.document.sampling_config import SamplingConfig
from odscen.scenario.sampling.generation_settings import GenerationSettings

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping
    from pathlib import Path

    from odscen.experiments.studies.study_plan import SampledScenarios, StudyPlan
    from odscen.maps.store import Workspace


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
    grid = StudyGrid(plan, sources, () if sweep is None else sweep.cases())
    if grid.count > MOST_RUNS:
        raise InputError(
            f"the study has {grid.count:,} runs; at most {MOST_RUNS:,} are possible: "
            "divide it, for example by maps"
        )
    return grid


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
    found: dict[str, ScenarioSource] = {}
    for source in (*_of_files(plan, workspace, beside), *_sampled(plan, workspace)):
        if source.name in found:
            raise InputError(f"two scenarios of the study are called {source.name!r}")
        found[source.name] = source
    return found


def _of_files(plan: StudyPlan, workspace: Workspace, beside: Path) -> Iterator[ScenarioSource]:
    for pattern in plan.scenarios:
        path = beside / pattern
        files = [path] if path.is_file() else sorted(beside.glob(pattern))
        if not files:
            raise InputError(f"scenarios: no file matches {pattern!r} in {beside}")
        for file in files:
            scenario = read_scenario(file)
            entry = workspace.map_for(scenario.map.name, scenario.map.sha256)
            refuse_unknown_parameters(plan, scenario.parameters, str(file))
            yield ScenarioSource(scenario_name(file), entry.name, entry.sha256, dumps(scenario))


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


def _sampled(plan: StudyPlan, workspace: Workspace) -> Iterator[ScenarioSource]:
    for one in plan.sample:
        settings = _sampling(one)
        config = settings.sampling.model_dump(mode="json")
        for name in _maps(one, workspace):
            refuse_unknown_parameters(plan, {}, f"{name} (sampled)")
            entry = workspace.map(name)
            for seed in range(one.seed, one.seed + one.count):
                yield ScenarioSource(
                    f"{name}-{seed:04d}", name, entry.sha256, seed=seed, config=config
                )


def _sampling(one: SampledScenarios) -> GenerationSettings:
    config = validated(SamplingConfig, one.config)
    return GenerationSettings(
        count=one.count,
        seed=one.seed,
        fill=one.fill,
        roi_segments=one.roi_segments,
        config=config,
    )


def _maps(one: SampledScenarios, workspace: Workspace) -> list[str]:
    names = workspace.map_names()
    found = [name for name in names if any(fnmatch.fnmatchcase(name, each) for each in one.maps)]
    for pattern in one.maps:
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
    theirs = {one.name: one for one in new.plan.variant}
    for one in old.plan.variant:
        if theirs.get(one.name) != one:
            raise ConflictError(
                f"variant {one.name!r} has changed or is not in the plan; name another folder"
            )
    if not old.plan.only_variants and new.plan.only_variants:
        raise ConflictError(
            "the scenarios as designed are not in the plan; a study can only be extended"
        )
