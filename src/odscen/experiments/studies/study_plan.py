"""What a study runs: scenarios x variants x parameters x seeds. One JSON or TOML file.

>>> plan = read_study_plan(Path("morning.study.toml"))
>>> plan.seeds
(1, 2, 3)
"""

from __future__ import annotations

import json
import re
import tomllib
from typing import TYPE_CHECKING, Annotated, Any, Final, Literal, Self

from pydantic import BeforeValidator, Field, model_validator

from odscen.base.errors import InputError, in_file
from odscen.base.given_files import read_given_text
from odscen.runs.recording import Recording
from odscen.runs.run_settings import RunSettings
from odscen.scenario.document.document_parts import Label, Part
from odscen.scenario.document.problems import validated
from odscen.scenario.sampling.sampler import Redraw  # noqa: TC001 (pydantic)
from odscen.scenario.sweeps.sweep_plan import plan_from_data

if TYPE_CHECKING:
    from pathlib import Path

    from odscen.scenario.sweeps.sweep_plan import SweepPlan

MOST_RUNS: Final = 1_000_000
"""Of one study; their names are held in memory."""
AS_DESIGNED: Final = "as-designed"
"""Name of the variant without edits."""
Keep = Literal["none", "failed", "all"]
_PLAIN: Final = r"^[A-Za-z0-9][A-Za-z0-9_.-]{0,99}$"
_SEEDS: Final = re.compile(r"(\d{1,10})-(\d{1,10})")


def _counted(seeds: object) -> object:
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
    BeforeValidator(_counted),
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
    scenarios
        Files, or patterns of files, relative to the plan.
    sample
        Scenarios that are sampled.
    seeds
        ``20`` for 1 to 20, a list, or ``"101-150"``.
    variant
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
    method: Literal["grid", "latin", "sobol", "random"] | None = None
    samples: Annotated[int, Field(ge=1)] | None = None
    sample_seed: Annotated[int, Field(ge=0)] = 0
    run: StudyRuns = StudyRuns()
    keep: Keep = "none"

    @model_validator(mode="after")
    def _consistent(self) -> Self:
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
        own = tuple(one.name for one in self.variant)
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
        said: dict[str, Any] = {"vary": list(self.vary), "seed": self.sample_seed}
        if self.samples is not None:
            said["samples"] = self.samples
        if self.method is not None:
            said["method"] = self.method
        return plan_from_data(said)


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
            data = tomllib.loads(text) if file.suffix == ".toml" else json.loads(text)
        except (ValueError, RecursionError) as error:
            raise InputError(f"not a plan: {error}") from error
        if not isinstance(data, dict):
            raise InputError("not a plan: it must be an object with scenarios or sample")
        return data


def read_study_plan(file: Path) -> StudyPlan:
    """Read a plan.

    Raises
    ------
    InputError
        If the file cannot be read.
    ScenarioError
        With every problem of it, each with its place and value.
    """
    data = read_plan_data(file)
    with in_file(str(file)):
        return validated(StudyPlan, data)
