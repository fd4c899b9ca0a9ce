"""A byte that changes in a stored file, of each kind of folder, is noticed by whoever reads it."""

from __future__ import annotations

from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

import pytest

from odscen.app.exchange.exports import export_run
from odscen.app.running.reports import renew_report
from odscen.app.running.runs import run
from odscen.base.errors import InputError
from odscen.experiments.comparisons import compare
from odscen.experiments.datasets import make_dataset
from odscen.experiments.measure import FigureKey
from odscen.experiments.studies import (
    begin_study,
    carry_out_study,
    read_study,
    study_results,
    study_state,
)
from odscen.experiments.suite import CaseResult, SeedResult
from odscen.experiments.suite_runs import read_parts, results_json
from odscen.experiments.sweeps import SweepSettings, opened_case, read_sweep, read_table, sweep
from odscen.runs.finished_run import Run
from odscen.runs.run_settings import RunSettings
from odscen.scenario.document.json_form import loads
from odscen.scenario.sweeps.sweep_plan import SweepPlan, axis_from_text
from odscen.web.kept_runs import KeptRuns
from tests.experiments.changed_bytes import changed_byte, stored_files
from tests.experiments.study_case import MadeUp, place, plan_file, short_scenario
from tests.experiments.test_dataset_runs import MadeUpExports
from tests.experiments.test_dataset_runs import plan as dataset_plan
from tests.sumo.story_case import entry

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping
    from pathlib import Path

SHARES = (0.0, 0.1, 0.35, 0.5, 0.8, 1.0)
"""Of the length of each file: where a byte is changed."""


def unnoticed(
    folder: Path,
    readers: Mapping[str, Callable[[], Any]],
    *,
    leave: tuple[str, ...] = (),
    read_by: Callable[[str, str], bool] = lambda _reader, _file: True,
) -> list[tuple[str, str, float]]:
    """Readers that a changed byte does not stop, with the file and the place in it."""
    found = []
    for number, name in enumerate(stored_files(folder, leave=leave)):
        share = SHARES[number % len(SHARES)]
        for place_in_file in {share, 1.0}:
            # The lowest bit leaves text what it is, the highest one makes it none.
            for bit in (0x01, 0x80):
                with changed_byte(folder / name, share=place_in_file, bit=bit):
                    found += _unnoticed_by(readers, name, place_in_file, read_by)
    for read in readers.values():  # all is as it was
        read()
    return found


def _unnoticed_by(
    readers: Mapping[str, Callable[[], Any]],
    name: str,
    place_in_file: float,
    read_by: Callable[[str, str], bool],
) -> list[tuple[str, str, float]]:
    found = []
    for reader, read in readers.items():
        if not read_by(reader, name):
            continue
        try:
            read()
        except InputError:
            continue
        found.append((reader, name, place_in_file))
    return found


@pytest.mark.slow
def test_of_a_finished_run(tmp_path: Path) -> None:
    folder = run(
        place(), short_scenario(tmp_path, seconds=4.0), out=tmp_path, settings=RunSettings(until=3)
    ).folder
    readers = {
        "Run.open": lambda: Run.open(folder),
        "report": lambda: renew_report(place(), folder, out=tmp_path / "again.html"),
        "compare": lambda: compare(folder, folder),
        "export": lambda: export_run(place(), folder, tmp_path / "out", to="pyg"),
        "page": lambda: KeptRuns(tmp_path).whole(folder.name),
    }
    report = ("Run.open", "report", "export")  # which make it anew, or do not look at it
    assert not unnoticed(
        folder, readers, read_by=lambda who, name: who not in report or name != "report.html"
    )


@pytest.mark.slow
def test_of_a_sweep(tmp_path: Path) -> None:
    scenario = loads(short_scenario(tmp_path, seconds=3.0).read_bytes())
    plan, out = SweepPlan((axis_from_text("per_minute=2,4"),)), tmp_path / "sweep"

    def resume() -> None:
        sweep(place(), scenario, plan, out, settings=SweepSettings())

    resume()
    assert not unnoticed(out, {"resume": resume}, leave=("runs",))
    readers: dict[str, Callable[[], Any]] = {
        "plan": lambda: read_sweep(out),
        "table": lambda: read_table(out),
        "case": lambda: opened_case(out, "case-001"),
    }
    read = {"plan": (), "table": ("cases.parquet",), "case": ("cases/case-001.scenario.json",)}
    both = ("SHA256SUMS", "sweep.json", "scenario.json")
    assert not unnoticed(
        out,
        readers,
        leave=("runs",),
        read_by=lambda who, name: name in (*both, *read[who]),
    )
    case = out / "runs" / "case-001"
    assert not unnoticed(case, {"resume": resume}, leave=("report.html",))


@pytest.mark.parametrize("most", [1, None])
def test_of_a_study_that_has_ended_or_was_interrupted(tmp_path: Path, most: int | None) -> None:
    out = tmp_path / "study"
    begin_study(place(), plan_file(tmp_path), out)
    try:
        carry_out_study(out, MadeUp(most=most))
    except KeyboardInterrupt:
        assert most
    readers: dict[str, Callable[[], Any]] = {
        "plan": lambda: read_study(out),
        "state": lambda: study_state(out),
        "results": lambda: study_results(out),
    }
    if most is None:
        readers["resume"] = lambda: carry_out_study(out, MadeUp())
    read = {"plan": ("study.json", "scenarios")}
    read["state"] = read["results"] = (*read["plan"], "journal.jsonl")
    read["resume"] = (*read["state"], "results.parquet", "SHA256SUMS")
    assert not unnoticed(
        out, readers, read_by=lambda who, name: name.partition("/")[0] in read[who]
    )


@pytest.mark.slow
def test_of_a_dataset(tmp_path: Path) -> None:
    entry("signal_crossing")
    entry("t_junction_signs")
    asked = dataset_plan(formats=["pyg", "scenarionet", "waymo"], shard=2)

    def resume() -> None:
        make_dataset(place(), asked, tmp_path, MadeUpExports(), beside=tmp_path)

    resume()
    assert not unnoticed(tmp_path, {"resume": resume})


def test_what_a_run_of_a_dataset_was_exported_to_is_read_as_it_was_written(tmp_path: Path) -> None:
    entry("signal_crossing")
    entry("t_junction_signs")
    asked = dataset_plan(formats=["scenarionet"])
    with pytest.raises(KeyboardInterrupt):
        make_dataset(place(), asked, tmp_path, MadeUpExports(most=2), beside=tmp_path)
    (index, *_) = sorted(tmp_path.glob("staged/scenarionet/*/dataset_summary.pkl"))
    # A pickle that runs a command when it is read, also where its checksum is written anew.
    index.write_bytes(b"cos\nsystem\n(S'touch executed'\ntR.")
    with pytest.raises(InputError, match=r"dataset_summary\.pkl"):
        make_dataset(place(), asked, tmp_path, MadeUpExports(), beside=tmp_path)
    (index.parent / "SHA256SUMS").unlink()
    with pytest.raises(InputError, match="which is no plain value"):
        make_dataset(place(), asked, tmp_path, MadeUpExports(), beside=tmp_path)


@pytest.mark.slow
def test_of_results_of_a_suite(tmp_path: Path) -> None:
    """They are written by one job and judged by another."""
    file = tmp_path / "results.json"
    run_of_seed = SeedResult(1, 0.5, None, (), {FigureKey("run", "", "mean_delay"): 12.5})
    case: Any = SimpleNamespace(name="crossing")
    made: Any = SimpleNamespace(
        suite=SimpleNamespace(name="all"),
        cases=(CaseResult(case, (run_of_seed,), made_of={"odscen": "0.2.0"}),),
    )
    file.write_text(results_json(made, beside=tmp_path), encoding="utf-8")
    assert not unnoticed(tmp_path, {"merge": lambda: read_parts([tmp_path])})
    content = file.read_bytes()
    for place_in_file in range(len(content)):
        for bit in (0x01, 0x80):
            changed = bytearray(content)
            changed[place_in_file] ^= bit
            file.write_bytes(changed)
            with pytest.raises(InputError):
                read_parts([file])
