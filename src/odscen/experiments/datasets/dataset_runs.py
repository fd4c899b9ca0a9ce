"""Datasets made: a study whose recordings are exported, then divided, and described by a card.

A folder has ``study/`` (the study, resumable), ``train/pyg/shard-00000/`` and so on,
``runs.parquet`` (a row for each run that is in it), ``dataset.json`` and ``README.md``. While it is
made, ``staged/`` has what each run was exported to. The card comes last: a dataset with a card is
complete.
"""

from __future__ import annotations

import json
import shutil
from collections import Counter
from typing import TYPE_CHECKING, Final

from odscen.base.checksums import file_digest
from odscen.base.errors import ConflictError
from odscen.base.folder_locks import locked
from odscen.base.system_errors import disk_errors
from odscen.base.text_files import write_file, write_text
from odscen.experiments.datasets.dataset_card import DatasetFacts, card_text
from odscen.experiments.datasets.dataset_shards import write_shards
from odscen.experiments.studies.study_runs import begin_study_of, carry_out_study
from odscen.experiments.studies.study_work import versions
from odscen.figures.measures.usability import UsabilityLevel
from odscen.records.outcomes import RunStatus

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping
    from pathlib import Path
    from typing import Any

    import polars as pl

    from odscen.experiments.datasets.dataset_plan import DatasetPlan
    from odscen.experiments.studies.executors import Executor
    from odscen.experiments.studies.study_grid import StudyGrid
    from odscen.experiments.studies.study_work import Outcome
    from odscen.maps.store import Workspace

PLAN_FILE: Final = "plan.json"
STUDY_FOLDER: Final = "study"
STAGED_FOLDER: Final = "staged"
TABLE_FILE: Final = "runs.parquet"
FACTS_FILE: Final = "dataset.json"
CARD_FILE: Final = "README.md"


def make_dataset(
    workspace: Workspace,
    plan: DatasetPlan,
    out: Path,
    executor: Executor,
    *,
    beside: Path,
    done: Callable[[int, int], None] | None = None,
) -> DatasetFacts:
    """Make a dataset, or what is missing of it; a complete one stays as it is.

    Parameters
    ----------
    beside
        Folder that files of the plan are relative to.
    done
        Called with how many of how many runs have ended.

    Raises
    ------
    InputError
        If the plan cannot be used, or a map belongs to no split.
    ConflictError
        If another dataset is in the folder, or another process works there.
    """
    with disk_errors(f"dataset {out}"), locked(out, what=f"dataset {out.name!r}"):
        out.mkdir(parents=True, exist_ok=True)
        _begin(out, plan)
        study = out / STUDY_FOLDER
        grid = begin_study_of(workspace, plan.study, study, beside=beside)
        plan.refuse_without_split({one.map_name: 0 for one in grid.sources.values()})

        def take(outcome: Outcome) -> None:
            _stage(out, outcome)

        ended = carry_out_study(study, executor, formats=plan.formats, take=take, done=done)
        table, left_out = _chosen(plan, ended.table)
        return _finished(out, plan, grid, table, left_out)


def _begin(out: Path, plan: DatasetPlan) -> None:
    text = json.dumps(plan.model_dump(mode="json"), indent=1, ensure_ascii=False) + "\n"
    file = out / PLAN_FILE
    if file.is_file():
        if file.read_text(encoding="utf-8") != text:
            raise ConflictError(f"{out} holds a dataset of another plan; name another folder")
        return
    write_text(file, text)


def folder_name(run: str) -> str:
    """Name of a run in the dataset."""
    return run.replace("/", "-")


def _stage(out: Path, outcome: Outcome) -> None:
    for form, files in (outcome.exports or {}).items():
        for name, content in files.items():
            write_file(out / STAGED_FOLDER / form / folder_name(outcome.name) / name, content)


def _chosen(plan: DatasetPlan, table: pl.DataFrame) -> tuple[pl.DataFrame, dict[str, int]]:
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


def _finished(
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
            runs = [folder_name(one) for one in table.filter(pl.col("split") == split)["run"]]
            for form in plan.formats:
                folder = out / split / form
                shutil.rmtree(folder, ignore_errors=True)
                write_shards(folder, staged / form, runs, form=form, size=plan.shard)
    part = out / f".{TABLE_FILE}.part"
    table.write_parquet(part)
    part.replace(out / TABLE_FILE)
    maps = {one.map_name: one.map_sha256 for one in grid.sources.values()}
    facts = DatasetFacts(
        plan,
        {name: (sha256, str(plan.split_of(name))) for name, sha256 in sorted(maps.items())},
        versions(),
        table,
        left_out,
        _files(out, plan),
    )
    said: dict[str, Any] = facts.to_dict()
    write_text(out / FACTS_FILE, json.dumps(said, indent=1, ensure_ascii=False) + "\n")
    write_text(out / CARD_FILE, card_text(facts))
    shutil.rmtree(staged, ignore_errors=True)
    return facts


def _files(out: Path, plan: DatasetPlan) -> dict[str, tuple[int, str]]:
    found = {TABLE_FILE: out / TABLE_FILE}
    for split in plan.splits:
        for path in sorted((out / split).rglob("*")):
            if path.is_file():
                found[path.relative_to(out).as_posix()] = path
    return {name: (path.stat().st_size, file_digest(path)) for name, path in found.items()}
