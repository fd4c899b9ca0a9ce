"""Plans of datasets: a study, formats, splits by town, and which runs are kept."""

from __future__ import annotations

import fnmatch
from typing import TYPE_CHECKING, Annotated, Final, Self

from pydantic import Field, model_validator

from odscen.base.errors import InputError, in_file
from odscen.base.given_files import as_path
from odscen.experiments.dataset_shards import (
    MOST_ROWS,
    Compressible,
    DatasetFormat,
)
from odscen.experiments.plan import StudyPlan, read_plan_data
from odscen.experiments.table import STUDY, columns_of, read_limit, study_figures
from odscen.learning.run_datasets import HUGGINGFACE
from odscen.scenario.document.document_parts import Label, Part
from odscen.scenario.document.problems import validated

if TYPE_CHECKING:
    from collections.abc import Iterable

    from odscen.base.given_files import GivenPath
    from odscen.experiments.table import Limit

_TAKEN: Final = ("pictures", "staged", "study")
"""Folders of a dataset that are no splits."""
SplitName = Annotated[str, Field(pattern=r"^[a-z][a-z0-9_-]{0,31}$")]
TRAIN: Final = "train"


def _make_one_split() -> dict[str, tuple[str, ...]]:
    return {TRAIN: ("*",)}


class DatasetPlan(Part):
    """The plan of a dataset.

    Attributes
    ----------
    licence
        Under which it is given away; the licences of the maps are yours to know.
    formats
        ``pyg``, ``webdataset``, ``huggingface``, ``scenarionet``, ``waymo``, ``commonroad``.
    compress
        Formats whose files are compressed, of those whose readers take that: ``waymo``, as gzip.
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
    compress: tuple[Compressible, ...] = ()
    splits: dict[SplitName, tuple[Label, ...]] = Field(default_factory=_make_one_split)
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
    def _check_consistency(self) -> Self:
        if not self.study.run.trajectories:
            raise ValueError("study.run.trajectories: a dataset is made of them")
        if len(set(self.formats)) < len(self.formats):
            raise ValueError("formats has a format twice")
        if absent := [form for form in self.compress if form not in self.formats]:
            raise ValueError(f"compress has {absent[0]}, which is not in formats")
        if taken := [name for name in self.splits if name in _TAKEN]:
            raise ValueError(f"splits: {taken[0]} is a folder of every dataset; name it otherwise")
        if HUGGINGFACE in self.formats:
            self._check_for_parquet()
        try:
            self.limits()
        except InputError as error:
            raise ValueError(f"keep_if: {error.problem}") from error
        return self

    def _check_for_parquet(self) -> None:
        if self.shard > MOST_ROWS:
            raise ValueError(
                f"shard is {self.shard}; of {HUGGINGFACE} at most {MOST_ROWS} runs fit in memory"
            )
        plain = [split_word(name) for name in self.splits]
        if len(set(plain)) < len(plain):
            raise ValueError(
                f"splits: {HUGGINGFACE} cannot tell names apart that differ in - and _ only"
            )

    def limits(self) -> tuple[Limit, ...]:
        """Read ``keep_if``.

        Raises
        ------
        InputError
            If a figure is unknown.
        """
        columns = columns_of(STUDY, tuple(study_figures()))
        return tuple(read_limit(text, columns) for text in self.keep_if)

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


def split_word(name: str) -> str:
    """Name of a split as Hugging Face's datasets has it, which knows no hyphens."""
    return name.replace("-", "_")


def read_dataset_plan(file: GivenPath) -> DatasetPlan:
    """Read a plan, JSON or TOML.

    Raises
    ------
    InputError
        If the file cannot be read.
    ScenarioError
        With every problem of it.
    """
    file = as_path(file)
    data = read_plan_data(file)
    with in_file(str(file)):
        return validated(DatasetPlan, data)
