"""Figures that are computed when they are asked for are those of a run that has them at once."""

from __future__ import annotations

import json
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path

import pytest

from odscen.base.errors import DamagedError
from odscen.figures.judging.expectations import parse_expectation
from odscen.figures.measures.registry import run_figure
from odscen.runs import layout
from odscen.runs.deferred_figures import measured_summary, whole_summary
from odscen.runs.ended import RECORDS_ONLY
from odscen.runs.finished_run import Run
from odscen.runs.run_settings import RunSettings
from odscen.runs.run_sums import damaged_in
from odscen.sumo.runner.run_folder import SumoPreparedRun
from odscen.sumo.runner.run_jobs import run_prepared
from tests.sumo.conftest import Prepare

CLOCK = ("wall_seconds", "real_time_factor")


@pytest.fixture
def prepared(prepare: Prepare) -> SumoPreparedRun:
    """Of a map, as all runs but those of other tests."""
    return replace(prepare(), about={"map": "grid", "map_sha256": "0" * 64, "meso": False})


@pytest.fixture
def waiting(prepared: SumoPreparedRun, tmp_path: Path) -> Run:
    """A run whose figures have not been asked for."""
    return run_prepared(prepared, tmp_path / "waiting", figures=False)


@pytest.mark.slow
def test_a_run_that_is_opened_ends_with_the_bytes_of_one_that_was_measured_at_once(
    prepared: SumoPreparedRun, waiting: Run, tmp_path: Path
) -> None:
    measured = run_prepared(prepared, tmp_path / "measured")
    assert not (waiting.folder / layout.FIGURES_FILE).exists()
    assert waiting.status == "completed"
    assert waiting.counts == measured.counts
    assert waiting.known["figures"] == {}
    assert Run.open(waiting.folder).figures == measured.figures
    ours, theirs = _files(waiting.folder), _files(measured.folder)
    assert ours.keys() == theirs.keys()
    summaries = [json.loads(files.pop(layout.SUMMARY_FILE)) for files in (ours, theirs)]
    assert list(summaries[0]) == list(summaries[1])
    assert _without_clock(summaries[0]) == _without_clock(summaries[1])
    for name in ("SHA256SUMS", layout.LOG_FILE):
        ours.pop(name), theirs.pop(name)
    assert ours == theirs
    assert damaged_in(waiting.folder) == []
    assert waiting.summary == summaries[0], "one that was held meanwhile reads what is there"


@pytest.mark.slow
def test_figures_of_actors_do_not_have_all_others_computed(waiting: Run) -> None:
    figure = run_figure("mean_travel_time")
    assert figure is not None
    value = waiting.value_of(figure)
    assert value is not None
    assert waiting.figure("arrived") == 5
    assert waiting.known[RECORDS_ONLY]
    assert waiting.summary["figures"]["mean_travel_time"] == value


def test_two_who_open_a_run_at_a_time_read_the_same(waiting: Run) -> None:
    with ThreadPoolExecutor(2) as pool:
        one, other = pool.map(measured_summary, [waiting.folder] * 2)
    assert one == other
    assert one["figures"]
    assert damaged_in(waiting.folder) == []


def test_nothing_is_computed_from_damaged_records(waiting: Run) -> None:
    (waiting.folder / layout.ACTORS_FILE).write_text("{}", encoding="utf-8")
    for read in (measured_summary, whole_summary):
        with pytest.raises(DamagedError, match=r"actors\.json"):
            read(waiting.folder)
    assert not (waiting.folder / layout.FIGURES_FILE).exists()


@pytest.mark.slow
def test_what_is_expected_of_a_run_is_held_against_figures_at_once(
    prepared: SumoPreparedRun, tmp_path: Path
) -> None:
    settings = RunSettings(expectations=(parse_expectation("mean_speed >= 1 km/h"),))
    judged = run_prepared(replace(prepared, settings=settings), tmp_path / "run", figures=False)
    assert RECORDS_ONLY not in judged.known
    assert judged.expectations_met


def _files(folder: Path) -> dict[str, bytes]:
    return {
        path.relative_to(folder).as_posix(): path.read_bytes()
        for path in folder.rglob("*")
        if path.is_file()
    }


def _without_clock(summary: dict[str, object]) -> dict[str, object]:
    return {name: value for name, value in summary.items() if name not in CLOCK}
