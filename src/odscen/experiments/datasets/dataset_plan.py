"""What a dataset has: runs of a study, formats, splits by town, and which runs are left out."""

from __future__ import annotations

import fnmatch
from typing import TYPE_CHECKING, Annotated, Final, Literal, Self

from pydantic import Field, model_validator

from odscen.base.errors import InputError, in_file
from odscen.experiments.cases.sweep_rows import limit_from_text
from odscen.experiments.studies.study_plan import StudyPlan, read_plan_data
from odscen.experiments.studies.study_rows import FIGURE_COLUMNS
from odscen.scenario.document.document_parts import Label, Part
from odscen.scenario.document.problems import validated

if TYPE_CHECKING:
    from collections.abc import Iterable
    from pathlib import Path

    from odscen.experiments.cases.sweep_rows import Limit

DatasetFormat = Literal["pyg", "scenarionet", "waymo", "commonroad"]
SplitName = Annotated[str, Field(pattern=r"^[a-z][a-z0-9_-]{0,31}$")]
TRAIN: Final = "train"


def _one_split() -> dict[str, tuple[str, ...]]:
    return {TRAIN: ("*",)}


class DatasetPlan(Part):
    """The plan of a dataset.

    Attributes
    ----------
    licence
        Under which it is given away; the licences of the maps are yours to know.
    formats
        Of ``odscen export``.
    splits
        Patterns of map names by split; a map belongs to the first that matches.
    keep_if
        What a run must hold to be in it, such as ``arrived >= 5``: figures of runs.
    usable
        Whether runs that are not usable are left out.
    shard
        Runs in a shard.
    study
        The runs.
    """

    name: Label
    licence: Label
    description: str = ""
    formats: Annotated[tuple[DatasetFormat, ...], Field(min_length=1)] = ("pyg",)
    splits: dict[SplitName, tuple[Label, ...]] = Field(default_factory=_one_split)
    keep_if: tuple[Label, ...] = ()
    usable: bool = True
    shard: Annotated[int, Field(ge=1, le=100_000)] = 100
    study: StudyPlan

    @model_validator(mode="before")
    @classmethod
    def _named_study(cls, data: object) -> object:
        if isinstance(data, dict) and isinstance(data.get("study"), dict):
            return {**data, "study": {"name": data.get("name"), **data["study"]}}
        return data

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        if not self.study.run.trajectories:
            raise ValueError("study.run.trajectories: a dataset is made of them")
        if len(set(self.formats)) < len(self.formats):
            raise ValueError("formats has a format twice")
        try:
            self.limits()
        except InputError as error:
            raise ValueError(f"keep_if: {error.problem}") from error
        return self

    def limits(self) -> tuple[Limit, ...]:
        """Read ``keep_if``.

        Raises
        ------
        InputError
            If a figure is unknown.
        """
        return tuple(limit_from_text(text, FIGURE_COLUMNS) for text in self.keep_if)

    def split_of(self, map_name: str) -> str | None:
        """Split of a map; ``None`` if no pattern matches."""
        for split, patterns in self.splits.items():
            if any(fnmatch.fnmatchcase(map_name, pattern) for pattern in patterns):
                return split
        return None

    def refuse_without_split(self, maps: Iterable[str]) -> None:
        """Raise :class:`InputError` if a map belongs to no split."""
        for name in maps:
            if self.split_of(name) is None:
                raise InputError(f"splits: no pattern matches map {name!r}")


def read_dataset_plan(file: Path) -> DatasetPlan:
    """Read a plan, JSON or TOML.

    Raises
    ------
    InputError
        If the file cannot be read.
    ScenarioError
        With every problem of it.
    """
    data = read_plan_data(file)
    with in_file(str(file)):
        return validated(DatasetPlan, data)
