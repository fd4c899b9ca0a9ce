"""Datasets made: a study whose recordings are exported, then divided, and described by a card.

A folder has ``study/`` (the study, resumable), ``train/pyg/shard-00000/`` and so on,
``runs.parquet`` (a row for each run that is in it), ``dataset.json`` and ``README.md``. While it is
made, ``staged/`` has what each run was exported to. The card comes last: a dataset with a card is
complete.
"""

from __future__ import annotations

import fnmatch
import io
import json
import pickle
import shutil
from collections import Counter
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any, Final, Literal, Self

from pydantic import Field, model_validator

from odscen.base.atomic_folders import new_folder
from odscen.base.checksums import SUMS_FILE, check_files, digest, file_digest, write_sums
from odscen.base.errors import ConflictError, InputError, in_file
from odscen.base.folder_locks import locked
from odscen.base.given_files import as_path, is_path
from odscen.base.system_errors import disk_errors
from odscen.base.text_files import write_file, write_text
from odscen.experiments.plan import StudyPlan, found_sources, grid_of, read_plan_data
from odscen.experiments.studies import begin_study_of, carry_out_study
from odscen.experiments.table import (
    STUDY,
    columns_of,
    read_limit,
    refuse_taken_names,
    study_figures,
)
from odscen.experiments.work import LocalExecutor, versions
from odscen.figures.measures.usability import UsabilityLevel
from odscen.formats.scenarionet_format import pickled
from odscen.records.outcomes import RunStatus
from odscen.scenario.document.document_parts import Label, Part
from odscen.scenario.document.problems import validated

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping, Sequence
    from pathlib import Path

    import polars as pl

    from odscen.base.given_files import GivenPath
    from odscen.experiments.plan import StudyGrid
    from odscen.experiments.table import Limit
    from odscen.experiments.work import Executor, Outcome
    from odscen.maps.store import Workspace


_INDEXES: Final = ("dataset_summary.pkl", "dataset_mapping.pkl")
_RECORDS, _INDEX = "scenarios.tfrecord", "index.json"


def write_shards(
    out: Path, staged: Path, runs: Sequence[str], *, form: str, size: int
) -> list[Path]:
    """Write the shards of a split in one format.

    Parameters
    ----------
    out
        Folder for the shards.
    staged
        Has a folder of files for each run.
    runs
        Names of those folders, in order.
    size
        Runs in a shard.

    Returns
    -------
    list of Path
        Folders, in order; the same files give the same bytes.
    """
    written = []
    for number, first in enumerate(range(0, len(runs), size)):
        part = runs[first : first + size]
        files = {run: _staged_files(staged / run) for run in part}
        folder = out / f"shard-{number:05d}"
        with new_folder(folder) as making:
            _WRITERS.get(form, _copy_files)(making, files)
        written.append(folder)
    return written


def _staged_files(folder: Path) -> list[Path]:
    """Files that a run was exported to, as they were written.

    Hidden ones are none of them: what a process that was killed had begun to write.
    """
    check_files(folder)
    return sorted(
        path for path in folder.iterdir() if path.name != SUMS_FILE and path.name[0] != "."
    )


def _plain_array(shape: tuple[int, ...], kind: str, content: bytearray) -> Any:
    """Array of numbers or texts as :func:`odscen.formats.scenarionet_format.pickled` has them."""
    import numpy as np

    if np.dtype(kind).hasobject:
        raise pickle.UnpicklingError("it holds an array of objects")
    return np.ndarray(shape, kind, content)


_PLAIN: Final[dict[tuple[str, str], Callable[..., Any]]] = {
    ("numpy", "ndarray"): _plain_array,
    ("builtins", "bytearray"): bytearray,
}


class _PlainUnpickler(pickle.Unpickler):
    """Reads texts, numbers, lists and arrays of them; all else would be code, and is refused."""

    def find_class(self, module: str, name: str) -> Any:
        if (module, name) in _PLAIN:
            return _PLAIN[module, name]
        raise pickle.UnpicklingError(f"it holds {module}.{name}, which is no plain value")


def _plain_values(path: Path) -> dict[str, object]:
    """Index of a run in ScenarioNet's form."""
    try:
        found = _PlainUnpickler(io.BytesIO(path.read_bytes())).load()
        return dict(found)
    except Exception as error:  # whatever a file that is none leads to
        raise InputError(f"not an index of scenarios: {error}", file=str(path)) from error


def _copy_files(folder: Path, files: Mapping[str, Sequence[Path]]) -> None:
    for paths in files.values():
        for path in paths:
            (folder / path.name).write_bytes(path.read_bytes())


def _merge_scenarionet(folder: Path, files: Mapping[str, Sequence[Path]]) -> None:
    """Copy the descriptions, and make one index of all."""
    for index in _INDEXES:
        whole: dict[str, object] = {}
        for paths in files.values():
            for path in paths:
                if path.name == index:
                    whole |= _plain_values(path)
        (folder / index).write_bytes(pickled(whole))
    rest = {
        run: [path for path in paths if path.name not in _INDEXES] for run, paths in files.items()
    }
    _copy_files(folder, rest)


def _merge_waymo(folder: Path, files: Mapping[str, Sequence[Path]]) -> None:
    """Write all records one after the other: a file of the format may have any number."""
    listed = []
    with (folder / _RECORDS).open("wb") as records:
        for paths in files.values():
            for path in paths:
                if path.suffix == ".tfrecord":
                    records.write(path.read_bytes())
                else:
                    listed.append(json.loads(path.read_bytes()))
    text = json.dumps({"runs": listed}, indent=1, ensure_ascii=False) + "\n"
    (folder / _INDEX).write_text(text, encoding="utf-8")


_WRITERS: Final[dict[str, Callable[[Path, Mapping[str, Sequence[Path]]], None]]] = {
    "scenarionet": _merge_scenarionet,
    "waymo": _merge_waymo,
}


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
    def _check_consistency(self) -> Self:
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


STATISTICS = ("planned", "arrived", "collided", "mean_speed", "mean_delay")
"""Figures of runs that the card gives the mean of."""


@dataclass(frozen=True, slots=True)
class DatasetFacts:
    """What the card says.

    Attributes
    ----------
    maps
        SHA-256 of the .xodr and split, by name.
    versions
        Of odscen and SUMO.
    table
        Runs that are in it, with ``split``.
    left_out
        How many runs are not, by reason.
    files
        Bytes and SHA-256 of each file, by path.
    """

    plan: DatasetPlan
    maps: Mapping[str, tuple[str, str]]
    versions: Mapping[str, str]
    table: pl.DataFrame
    left_out: Mapping[str, int]
    files: Mapping[str, tuple[int, str]]

    def splits(self) -> list[dict[str, Any]]:
        """A row for each split: maps, runs, and means of figures."""
        import polars as pl

        rows = []
        for split in self.plan.splits:
            own = self.table.filter(pl.col("split") == split)
            row: dict[str, Any] = {"split": split, "maps": own["map"].n_unique()}
            row |= {"scenarios": own["scenario"].n_unique(), "runs": own.height}
            for name in STATISTICS:
                value: Any = own[name].mean()
                row[name] = None if value is None else round(float(value), 4)
            rows.append(row)
        return rows

    def to_dict(self) -> dict[str, Any]:
        """JSON-ready, without a clock: the same dataset gives the same bytes."""
        return {
            "format": "odscen-dataset",
            "version": 1,
            "name": self.plan.name,
            "licence": self.plan.licence,
            "versions": dict(self.versions),
            "maps": [
                {"name": name, "sha256": sha256, "split": split}
                for name, (sha256, split) in self.maps.items()
            ],
            "splits": self.splits(),
            "left_out": dict(self.left_out),
            "plan": self.plan.model_dump(mode="json"),
            "files": [
                {"path": path, "bytes": size, "sha256": sha256}
                for path, (size, sha256) in self.files.items()
            ],
        }


def card_text(facts: DatasetFacts) -> str:
    """The card in Markdown."""
    plan, total = facts.plan, facts.table.height
    size = sum(size for size, _ in facts.files.values())
    parts = [
        f"# {plan.name}\n",
        f"{plan.description}\n" if plan.description else "",
        f"{total:,} recordings of simulated traffic on {len(facts.maps)} maps, "
        f"{size / 1e6:,.1f} MB, made by odscen {facts.versions['odscen']} with SUMO "
        f"{facts.versions['sumo']}. Licence: {plan.licence}.\n",
        f"Formats: {', '.join(plan.formats)}; at most {plan.shard} runs in a shard. "
        "Splits are by town: no map is in two of them.\n",
        "## Splits\n",
        _markdown_table(
            ["split", "maps", "scenarios", "runs", *STATISTICS],
            [list(row.values()) for row in facts.splits()],
        ),
        "Figures are means over runs; units as in the figures of odscen "
        "(mean_speed m/s, mean_delay s).\n",
        "## Maps\n",
        _markdown_table(
            ["map", "split", "sha256 of the .xodr"],
            [[name, split, sha256] for name, (sha256, split) in facts.maps.items()],
        ),
        "## How it was made\n",
        _describe_making(plan),
        "## What was left out\n",
        _left_out(facts),
        "The same plan, maps and versions give the same files; `dataset.json` has the plan and "
        "the checksum of each file, `runs.parquet` the figures of each run.",
    ]
    return "\n".join(part for part in parts if part) + "\n"


def _describe_making(plan: DatasetPlan) -> str:
    study = plan.study
    seeds = f"{len(study.seeds)} seeds ({study.seeds[0]} to {study.seeds[-1]}) of each scenario"
    sampled = [
        f"- {sampling.count} sampled scenarios on each map of {', '.join(sampling.maps)}, "
        f"seeds from {sampling.seed} on"
        for sampling in study.sample
    ]
    files = [f"- scenarios {', '.join(study.scenarios)}"] if study.scenarios else []
    variants = [f"- variants {', '.join(study.variant_names)}"] if study.variant else []
    return "\n".join([*sampled, *files, *variants, f"- {seeds}"]) + "\n"


def _left_out(facts: DatasetFacts) -> str:
    if not facts.left_out:
        return "Nothing.\n"
    rows = [[count, words] for words, count in facts.left_out.items()]
    return _markdown_table(["runs", "why"], rows)


def _markdown_table(heads: Sequence[str], rows: Sequence[Sequence[object]]) -> str:
    lines = [heads, ["---"] * len(heads), *rows]
    return "".join(f"| {' | '.join(map(_markdown_cell, line))} |\n" for line in lines)


def _markdown_cell(value: object) -> str:
    text = "-" if value is None else str(value)
    return text.replace("|", "\\|").replace("\n", " ")


PLAN_FILE: Final = "plan.json"
STUDY_FOLDER: Final = "study"
STAGED_FOLDER: Final = "staged"
TABLE_FILE: Final = "runs.parquet"
FACTS_FILE: Final = "dataset.json"
CARD_FILE: Final = "README.md"


def make_dataset(
    workspace: Workspace,
    plan: DatasetPlan | GivenPath,
    out: GivenPath,
    executor: Executor | None = None,
    *,
    beside: GivenPath | None = None,
    processes: int = 1,
    done: Callable[[int, int], None] | None = None,
) -> DatasetFacts:
    """Make a dataset, or what is missing of it; a complete one stays as it is.

    Parameters
    ----------
    workspace
        Has the maps.
    plan
        The plan, or its file, JSON or TOML.
    out
        Folder of the dataset.
    executor
        What carries out the runs; this machine if not given.
    beside
        Folder that files of the plan are relative to; that of its file, else the working directory,
        if not given.
    processes
        How many run at a time on this machine.
    done
        Called with how many of how many runs have ended.

    Raises
    ------
    InputError
        If the plan cannot be used, or a map belongs to no split.
    ConflictError
        If another dataset is in the folder, or another process works there.
    """
    if is_path(plan):
        beside = as_path(plan).parent if beside is None else beside
        plan = read_dataset_plan(plan)
    out, beside = as_path(out), as_path("." if beside is None else beside)
    executor = executor or LocalExecutor(workspace, processes)
    with disk_errors(f"dataset {out}"), locked(out, what=f"dataset {out.name!r}"):
        if (out / SUMS_FILE).is_file():
            check_files(out)
        # Before anything is written: a plan that is refused leaves the folder to another one.
        sources = found_sources(plan.study, workspace, beside=beside)
        plan.refuse_without_split(dict.fromkeys(source.map_name for source in sources.values()))
        refuse_taken_names(grid_of(plan.study, sources).parameters)
        _begin_dataset(out, plan)
        study = out / STUDY_FOLDER
        grid = begin_study_of(workspace, plan.study, study, beside=beside)

        def take(outcome: Outcome) -> None:
            _stage_exports(out, outcome)

        ended = carry_out_study(study, executor, formats=plan.formats, take=take, done=done)
        table, left_out = _choose_runs(plan, ended.table)
        return _finish_dataset(out, plan, grid, table, left_out)


def _begin_dataset(out: Path, plan: DatasetPlan) -> None:
    text = json.dumps(plan.model_dump(mode="json"), indent=1, ensure_ascii=False) + "\n"
    file = out / PLAN_FILE
    if file.is_file():
        if file.read_bytes() != text.encode():
            raise ConflictError(f"{out} holds a dataset of another plan; name another folder")
        return
    out.mkdir(parents=True, exist_ok=True)
    write_text(file, text)
    write_sums(out, {PLAN_FILE: digest(text.encode())})


def folder_name(run: str) -> str:
    """Name of a run in the dataset."""
    return run.replace("/", "-")


def _stage_exports(out: Path, outcome: Outcome) -> None:
    for form, files in (outcome.exports or {}).items():
        folder = out / STAGED_FOLDER / form / folder_name(outcome.name)
        for name, content in files.items():
            write_file(folder / name, content)
        write_sums(folder, {name: digest(content) for name, content in files.items()})


def _choose_runs(plan: DatasetPlan, table: pl.DataFrame) -> tuple[pl.DataFrame, dict[str, int]]:
    """Runs that are in the dataset, with ``split``; how many are not, by reason."""
    import polars as pl

    limits = plan.limits()
    reasons: Counter[str] = Counter()
    kept = []
    for row in table.iter_rows(named=True):
        broken = [str(limit) for limit in limits if not limit.holds(row)]
        if row["status"] != str(RunStatus.COMPLETED):
            reasons[f"{row['status']}: {row['detail']}"] += 1
        elif plan.usable and row["usable"] == str(UsabilityLevel.NOT_USABLE):
            reasons["not usable"] += 1
        elif broken:
            reasons[f"not {broken[0]}"] += 1
        else:
            kept.append(row["run"])
    own = table.filter(pl.col("run").is_in(kept))
    splits = [plan.split_of(name) for name in own["map"]]
    return own.with_columns(pl.Series("split", splits, dtype=pl.String)), dict(
        reasons.most_common()
    )


def _finish_dataset(
    out: Path,
    plan: DatasetPlan,
    grid: StudyGrid,
    table: pl.DataFrame,
    left_out: Mapping[str, int],
) -> DatasetFacts:
    """Write shards, table and card, in this order, and remove what was staged.

    One that has a card has all shards.
    """
    import polars as pl

    staged = out / STAGED_FOLDER
    if not (out / CARD_FILE).is_file():
        for split in plan.splits:
            runs = [
                folder_name(run_name) for run_name in table.filter(pl.col("split") == split)["run"]
            ]
            for form in plan.formats:
                folder = out / split / form
                shutil.rmtree(folder, ignore_errors=True)
                write_shards(folder, staged / form, runs, form=form, size=plan.shard)
    part = out / f".{TABLE_FILE}.part"
    table.write_parquet(part)
    part.replace(out / TABLE_FILE)
    maps = {source.map_name: source.map_sha256 for source in grid.sources.values()}
    facts = DatasetFacts(
        plan,
        {name: (sha256, str(plan.split_of(name))) for name, sha256 in sorted(maps.items())},
        versions(),
        table,
        left_out,
        _list_dataset_files(out, plan),
    )
    said: dict[str, Any] = facts.to_dict()
    write_text(out / FACTS_FILE, json.dumps(said, indent=1, ensure_ascii=False) + "\n")
    write_text(out / CARD_FILE, card_text(facts))
    sums = {name: sha256 for name, (_, sha256) in facts.files.items()}
    sums |= {name: file_digest(out / name) for name in (PLAN_FILE, FACTS_FILE, CARD_FILE)}
    write_sums(out, sums)
    shutil.rmtree(staged, ignore_errors=True)
    return facts


def _list_dataset_files(out: Path, plan: DatasetPlan) -> dict[str, tuple[int, str]]:
    found = {TABLE_FILE: out / TABLE_FILE}
    for split in plan.splits:
        for path in sorted((out / split).rglob("*")):
            if path.is_file():
                found[path.relative_to(out).as_posix()] = path
    return {name: (path.stat().st_size, file_digest(path)) for name, path in found.items()}
