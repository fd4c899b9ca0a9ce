"""Datasets made: a study whose recordings are exported, then divided, and described by a card.

A folder has ``study/`` (the study, resumable), ``train/pyg/shard-00000/`` and so on,
``pictures`` of maps, ``runs.parquet`` (a row for each run that is in it), ``dataset.json`` and
``README.md``. While it is made, ``staged/`` has what each run was exported to. The card comes last:
a dataset with a card is complete.
"""

from __future__ import annotations

import json
import shutil
from collections import Counter
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Final

from odscen.app.exchange.dataset_exports import STATISTICS, STATISTICS_FILE
from odscen.base.checksums import SUMS_FILE, check_files, digest, file_digest, write_sums
from odscen.base.errors import ConflictError, InputError
from odscen.base.folder_locks import locked
from odscen.base.given_files import as_path, is_path
from odscen.base.stored_files import documents
from odscen.base.system_errors import disk_errors
from odscen.base.text_files import write_file, write_text
from odscen.experiments.dataset_card import DatasetFacts, MapFacts, card_text, summed
from odscen.experiments.dataset_plan import DatasetPlan, read_dataset_plan
from odscen.experiments.dataset_shards import ShardSource, exported_formats, write_shards
from odscen.experiments.plan import found_sources, grid_of
from odscen.experiments.studies import begin_study_of, carry_out_study
from odscen.experiments.table import refuse_taken_names
from odscen.experiments.work import LocalExecutor, versions
from odscen.figures.measures.usability import UsabilityLevel
from odscen.learning.run_datasets import FACTS_FILE
from odscen.maps.folder_names import plain_name
from odscen.records.outcomes import RunStatus

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping
    from pathlib import Path

    import polars as pl

    from odscen.base.given_files import GivenPath
    from odscen.experiments.plan import StudyGrid
    from odscen.experiments.work import Executor, Outcome
    from odscen.maps.store import Workspace


PLAN_FILE: Final = "plan.json"
STUDY_FOLDER: Final = "study"
STAGED_FOLDER: Final = "staged"
TABLE_FILE: Final = "runs.parquet"
PICTURES_FOLDER: Final = "pictures"
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
        asked = grid_of(plan.study, sources)
        refuse_taken_names(asked.parameters)
        _refuse_equal_folders(asked)
        _begin_dataset(out, plan)
        study = out / STUDY_FOLDER
        grid = begin_study_of(workspace, plan.study, study, beside=beside)

        def take(outcome: Outcome) -> None:
            _stage_exports(out, outcome)

        ended = carry_out_study(
            study, executor, formats=exported_formats(plan.formats), take=take, done=done
        )
        table, left_out = _choose_runs(plan, ended.table)
        return _finish_dataset(out, workspace, plan, grid, table, left_out)


def _refuse_equal_folders(grid: StudyGrid) -> None:
    """Raise :class:`InputError` if two runs would have one name in the dataset."""
    known: dict[str, str] = {}
    for run in grid.runs():
        other = known.setdefault(folder_name(run.name), run.name)
        if other != run.name:
            raise InputError(
                f"runs {other} and {run.name} would both be {folder_name(run.name)!r} in the "
                "dataset; name a scenario or a variant otherwise"
            )


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
    workspace: Workspace,
    plan: DatasetPlan,
    grid: StudyGrid,
    table: pl.DataFrame,
    left_out: Mapping[str, int],
) -> DatasetFacts:
    """Write shards, table and card, in this order, and remove what was staged.

    One that has a card has all shards.
    """
    staged = out / STAGED_FOLDER
    if (out / CARD_FILE).is_file():
        maps = _read_maps(out / FACTS_FILE)
    else:
        rows = {folder_name(row["run"]): row for row in table.iter_rows(named=True)}
        source = ShardSource(workspace, staged, rows, plan.compress)
        for split in plan.splits:
            runs = [name for name, row in rows.items() if row["split"] == split]
            for form in plan.formats:
                write_shards(out / split / form, source, runs, form=form, size=plan.shard)
        maps = _collect_maps(plan, grid, staged, rows)
        maps = _draw_maps(out, workspace, maps)
    part = out / f".{TABLE_FILE}.part"
    table.write_parquet(part)
    part.replace(out / TABLE_FILE)
    files = _list_dataset_files(out, plan)
    facts = DatasetFacts(plan, maps, versions(), table, left_out, files)
    data: dict[str, Any] = facts.to_dict()
    write_text(out / FACTS_FILE, json.dumps(data, indent=1, ensure_ascii=False) + "\n")
    write_text(out / CARD_FILE, card_text(facts))
    sums = {name: sha256 for name, (_, sha256) in facts.files.items()}
    sums |= {name: file_digest(out / name) for name in (PLAN_FILE, FACTS_FILE, CARD_FILE)}
    write_sums(out, sums)
    shutil.rmtree(staged, ignore_errors=True)
    return facts


def _collect_maps(
    plan: DatasetPlan, grid: StudyGrid, staged: Path, rows: Mapping[str, Mapping[str, Any]]
) -> tuple[MapFacts, ...]:
    """All maps of the study, with what the runs on each that are in the dataset have together."""
    runs: dict[tuple[str, str], list[str]] = {
        (source.map_name, source.map_sha256): [] for source in grid.sources.values()
    }
    for name, row in rows.items():
        source = grid.sources[row["scenario"]]
        runs[source.map_name, source.map_sha256].append(name)
    facts = []
    for (name, sha256), own in sorted(runs.items()):
        files = [staged / STATISTICS / run / STATISTICS_FILE for run in own]
        whole = summed(json.loads(file.read_bytes()) for file in files if file.is_file())
        split = str(plan.split_of(name))
        facts.append(MapFacts(name, sha256, split, len(own), **whole))
    return tuple(facts)


def _read_maps(file: Path) -> tuple[MapFacts, ...]:
    """Maps of a dataset that is complete."""
    with documents("the facts of a dataset"):
        return tuple(
            MapFacts(
                entry["name"],
                entry["sha256"],
                entry["split"],
                entry.get("runs", 0),
                entry.get("seconds", 0.0),
                entry.get("most", {}),
                entry.get("road_users", {}),
                entry.get("picture"),
            )
            for entry in json.loads(file.read_bytes())["maps"]
        )


def _draw_maps(out: Path, workspace: Workspace, maps: tuple[MapFacts, ...]) -> tuple[MapFacts, ...]:
    """Draw the first map of each split that has runs."""
    shutil.rmtree(out / PICTURES_FOLDER, ignore_errors=True)  # what a kill has left of them
    drawn: set[str] = set()
    found = []
    for map_facts in maps:
        picture = None
        if map_facts.runs and map_facts.split not in drawn:
            drawn.add(map_facts.split)
            plain = plain_name(map_facts.name) or "map"
            picture = f"{PICTURES_FOLDER}/{plain}-{map_facts.sha256[:12]}.svg"
            drawing = workspace.map_for(map_facts.name, map_facts.sha256).plot()
            write_text(out / picture, drawing.svg)
        found.append(replace(map_facts, picture=picture))
    return tuple(found)


def _list_dataset_files(out: Path, plan: DatasetPlan) -> dict[str, tuple[int, str]]:
    found = {TABLE_FILE: out / TABLE_FILE}
    for folder in (*plan.splits, PICTURES_FOLDER):
        for path in sorted((out / folder).rglob("*")):
            if path.is_file():
                found[path.relative_to(out).as_posix()] = path
    return {name: (path.stat().st_size, file_digest(path)) for name, path in found.items()}
