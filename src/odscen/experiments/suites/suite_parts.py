"""What was run of a suite, as a file: parts that were run elsewhere are judged together from it.

One row per scenario, with what its runs were made of and their figures; nothing of verdicts, as
those follow from the figures, the suite and its baselines.
"""

from __future__ import annotations

import os
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

from odscen.base.errors import InputError, in_file
from odscen.base.given_files import read_given
from odscen.base.stored_files import documents, read_document
from odscen.experiments.regression.case_results import SeedResult
from odscen.experiments.regression.causes import causes_between
from odscen.experiments.regression.detection import Sizing
from odscen.experiments.regression.measure import FigureKey
from odscen.records.row_text import json_with_rows

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence
    from pathlib import Path

    from odscen.experiments.regression.baseline import Fingerprint
    from odscen.experiments.regression.case_results import CaseResult, SuiteResult
    from odscen.experiments.suites.suite_loading import LoadedCase, UnusableCase

FORMAT = "odscen-suite-results"
VERSION = 1
FILE = "results.json"
"""Name of such files in a folder that is to be merged."""


@dataclass(frozen=True, slots=True)
class RunCase:
    """A scenario that was run elsewhere.

    Attributes
    ----------
    source
        The file that says so.
    made_of
        What its runs were made of; empty if it could not be run.
    refused
        Why runs of it could not be prepared, in words.
    sizing
        What its seeds were chosen for.
    """

    name: str
    source: Path
    made_of: Fingerprint
    runs: tuple[SeedResult, ...]
    refused: tuple[str, ...]
    sizing: Sizing | None = None


def results_json(result: SuiteResult, *, beside: Path) -> str:
    """Text of the file; folders of runs are relative to ``beside``, where it will lie."""
    head = {"format": FORMAT, "version": VERSION, "suite": result.suite.name}
    return json_with_rows(head, "scenarios", (_row(case, beside) for case in result.cases))


def _row(case: CaseResult, beside: Path) -> dict[str, Any]:
    failed = {run.error for run in case.runs}
    return {
        "name": case.name,
        "made_of": case.made_of,
        **({"detect": case.sizing.model_dump(mode="json")} if case.sizing else {}),
        "refused": [words for words in case.errors if case.made_of and words not in failed],
        "runs": [_run(run, beside) for run in case.runs],
    }


def _run(run: SeedResult, beside: Path) -> dict[str, Any]:
    folder = None if run.folder is None else os.path.relpath(run.folder.resolve(), beside.resolve())
    return {
        "seed": run.seed,
        "wall_seconds": run.wall_seconds,
        "error": run.error,
        "missed": list(run.missed),
        "folder": None if folder is None else folder.replace(os.sep, "/"),
        "figures": [[*key, value] for key, value in run.figures.items()],
    }


def read_parts(paths: Iterable[Path]) -> dict[str, RunCase]:
    """Read what was run of a suite, by scenario.

    Parameters
    ----------
    paths
        Files, or folders that hold some, named :data:`FILE`, at any depth.

    Raises
    ------
    InputError
        If a file is none of ours, a folder has none, or two have the same scenario.
    """
    found: dict[str, RunCase] = {}
    for file in [file for path in paths for file in _files(path)]:
        with in_file(str(file)):
            data = read_document(
                read_given(file), form=FORMAT, version=VERSION, what="results of a suite"
            )
            with documents("results of a suite"):
                cases = [_case(row, file) for row in data["scenarios"]]
            for case in cases:
                if case.name in found:
                    raise InputError(f"{case.name} is in {found[case.name].source} as well")
                found[case.name] = case
    return found


def _files(path: Path) -> list[Path]:
    if not path.is_dir():
        return [path]
    found = sorted(path.rglob(FILE))
    if not found:
        raise InputError(f"no {FILE} in this folder", file=str(path))
    return found


def _case(row: Mapping[str, Any], file: Path) -> RunCase:
    chosen = row.get("detect")
    return RunCase(
        name=str(row["name"]),
        source=file,
        made_of={str(name): str(digest) for name, digest in row["made_of"].items()},
        runs=tuple(_seed_result(run, file.parent) for run in row["runs"]),
        refused=tuple(str(words) for words in row["refused"]),
        sizing=None if chosen is None else Sizing.model_validate(chosen),
    )


def _seed_result(row: Mapping[str, Any], beside: Path) -> SeedResult:
    figures = {
        FigureKey(kind, str(place), str(figure)): None if value is None else float(value)
        for kind, place, figure, value in row["figures"]
    }
    return SeedResult(
        seed=int(row["seed"]),
        wall_seconds=float(row["wall_seconds"]),
        error=None if row["error"] is None else str(row["error"]),
        missed=tuple(str(words) for words in row["missed"]),
        figures=figures,
        folder=None if row["folder"] is None else beside / str(row["folder"]),
    )


def take_parts(
    cases: Sequence[LoadedCase | UnusableCase],
    loaded: Sequence[LoadedCase],
    parts: Mapping[str, RunCase],
    *,
    sizing: bool = False,
) -> None:
    """Give each scenario its runs from the parts; what is not there is its error.

    ``sizing`` says that new baselines are made of them: seeds that odscen chooses are those that
    the parts have chosen.

    Raises
    ------
    InputError
        If a part has a scenario that the suite does not have.
    """
    known = {case.case.name for case in cases}
    for part in parts.values():
        if part.made_of and part.name not in known:
            raise InputError(
                f"the suite has no scenario {part.name!r}, which was run here",
                file=str(part.source),
            )
    for case in loaded:
        _take(case, parts.get(case.case.name), sizing=sizing)


def _take(case: LoadedCase, part: RunCase | None, *, sizing: bool) -> None:
    if part is None:
        case.refused[-1] = "none of the parts has run it: was one of them interrupted?"
        return
    differ = causes_between(part.made_of, case.made_of)
    if differ:
        words = ", ".join(cause.words for cause in differ)
        case.refused[-1] = f"{part.source} was made with other inputs than are here: {words}"
        return
    detect = case.case.detect
    if sizing and detect is not None:
        if part.sizing is None or not part.sizing.is_for(detect):
            case.refused[-1] = f"{part.source} was run without --update-baseline, or other detect"
            return
        case.sizing = part.sizing
        case.case = replace(case.case, seeds=tuple(run.seed for run in part.runs))
    case.runs.update({run.seed: run for run in part.runs if run.seed in case.case.seeds})
    case.refused.update(enumerate(part.refused, start=-len(part.refused)))
    lacking = [str(seed) for seed in case.case.seeds if seed not in case.runs]
    if lacking and not part.refused:
        case.refused[-1] = f"{part.source} has no run of seed {', '.join(lacking)}"
