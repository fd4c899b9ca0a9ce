"""The folder of a study: what it runs, what has ended, and the table.

``study.json`` has the plan with its scenarios, ``scenarios/`` the documents, ``journal.jsonl`` and
``rows/`` the runs that have ended, ``results.parquet`` the table, ``runs/`` the run folders that
are kept, and ``study.html`` the report.
"""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any, Final

from odscen.app.scenarios import SUFFIX
from odscen.base.errors import ConflictError, InputError, in_file
from odscen.base.stored_files import documents, read_document
from odscen.base.text_files import write_text
from odscen.experiments.studies.study_grid import ScenarioSource, grid_of
from odscen.experiments.studies.study_plan import StudyPlan
from odscen.experiments.studies.study_rows import study_table
from odscen.experiments.studies.study_work import versions
from odscen.scenario.document.problems import validated

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

    import polars as pl

    from odscen.experiments.studies.study_grid import StudyGrid
    from odscen.experiments.studies.study_journal import Rows

FORMAT: Final = "odscen-study"
VERSION: Final = 1
STUDY_FILE: Final = "study.json"
TABLE_FILE: Final = "results.parquet"
PAGE_FILE: Final = "study.html"
RUNS_FOLDER: Final = "runs"
_SCENARIOS: Final = "scenarios"


def is_study(folder: Path) -> bool:
    """Whether a folder holds a study."""
    return (folder / STUDY_FILE).is_file()


def write_study(folder: Path, grid: StudyGrid) -> None:
    """Write what a study runs; documents first, so that a study that is there is whole."""
    rows = []
    configs = _configs(grid)
    for source in grid.sources.values():
        row: dict[str, Any] = {
            "name": source.name,
            "map": source.map_name,
            "map_sha256": source.map_sha256,
        }
        if source.text is None:
            row |= {"seed": source.seed, "config": configs[json.dumps(source.config)]}
        else:
            write_text(folder / _SCENARIOS / f"{source.name}{SUFFIX}", source.text)
        rows.append(row)
    said = {
        "format": FORMAT,
        "version": VERSION,
        "versions": versions(),
        "plan": grid.plan.model_dump(mode="json"),
        "configs": [json.loads(text) for text in _configs(grid)],
        "scenarios": rows,
    }
    write_text(folder / STUDY_FILE, json.dumps(said, indent=1, ensure_ascii=False) + "\n")


def _configs(grid: StudyGrid) -> dict[str, int]:
    """Configurations of sampling, each once, with its number."""
    each = (json.dumps(one.config) for one in grid.sources.values() if one.config is not None)
    return {text: number for number, text in enumerate(dict.fromkeys(each))}


def read_study(folder: Path) -> StudyGrid:
    """Read what a study runs.

    Raises
    ------
    InputError
        If there is no study, or it is not as it was written.
    """
    data = _read(folder)
    with in_file(str(folder / STUDY_FILE)), documents("a study"):
        plan = validated(StudyPlan, data["plan"])
        configs = data["configs"]
        sources = {row["name"]: _source(folder, row, configs) for row in data["scenarios"]}
    return grid_of(plan, sources)


def _read(folder: Path) -> dict[str, Any]:
    file = folder / STUDY_FILE
    if not file.is_file():
        raise InputError(f"no study is here: it has no {STUDY_FILE}", file=str(folder))
    with in_file(str(file)):
        return read_document(file.read_bytes(), form=FORMAT, version=VERSION, what="a study")


def _source(folder: Path, row: Mapping[str, Any], configs: list[Any]) -> ScenarioSource:
    name, about = str(row["name"]), (str(row["map"]), str(row["map_sha256"]))
    if "config" in row:
        return ScenarioSource(name, *about, seed=int(row["seed"]), config=configs[row["config"]])
    text = (folder / _SCENARIOS / f"{name}{SUFFIX}").read_text(encoding="utf-8")
    return ScenarioSource(name, *about, text=text)


def refuse_other_odscen(folder: Path) -> None:
    """Refuse to add to a study that another odscen or SUMO has begun.

    Raises
    ------
    ConflictError
        Names both versions.
    """
    theirs, ours = _read(folder).get("versions", {}), versions()
    for name, own in ours.items():
        if theirs.get(name) != own:
            raise ConflictError(
                f"{folder} was begun with {name} {theirs.get(name)}, this is {own}: "
                "its table would hold both; run the plan in another folder"
            )


def write_table(folder: Path, grid: StudyGrid, rows: Rows) -> pl.DataFrame:
    """Write the table whole; equal rows give equal bytes, in whatever order they came."""
    table = study_table(grid, rows)
    part = folder / f".{TABLE_FILE}.part"
    table.write_parquet(part)
    part.replace(folder / TABLE_FILE)
    return table
