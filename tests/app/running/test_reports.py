from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from odscen.app.running.reports import interval_rows, renew_report
from odscen.app.running.runs import run
from odscen.app.scenarios import read_scenario
from odscen.base.checksums import SUMS_FILE
from odscen.base.errors import DamagedError, InputError
from odscen.experiments.comparisons import read_runs
from odscen.maps.store import Workspace
from odscen.runs.run_settings import RunSettings


@pytest.fixture(scope="module")
def finished(workspace: Workspace, sampled: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("damaged")
    return run(workspace, sampled, settings=RunSettings(until=20.0), out=out).folder


DAMAGE = (b"", b"\xff" * 40, b"[" * 100_000, b"[]", b'{"status": "completed", "seed": 1}')


USED = {
    "summary.json": True,
    "plan.json": False,
    "actors.json": True,
    "events.json": False,
    "signals.json": False,
    "trajectories.parquet": True,
    "signal_states.parquet": False,
    "lane_places.json": True,
    "figures/segments.csv": True,
}
"""Files of a run, and whether a comparison reads them."""


@pytest.mark.slow
@pytest.mark.parametrize("name", USED)
def test_a_report_or_a_comparison_of_a_damaged_run_names_the_run_and_the_file(
    workspace: Workspace, finished: Path, tmp_path: Path, name: str
) -> None:
    run_folder = shutil.copytree(finished, tmp_path / "run")
    said = _refusals(workspace, run_folder, name)
    assert [len(found) for found in said.values()] == [len(DAMAGE) + 1] * 2
    for error in (*said["report"], *said["comparison"]):
        assert isinstance(error, DamagedError)
        assert str(run_folder) in str(error)
        assert [one.file for one in error.files] == [name]
    renew_report(workspace, run_folder, out=tmp_path / "report.html")


@pytest.mark.parametrize("name", USED)
def test_a_report_or_a_comparison_of_a_damaged_run_without_checksums_names_the_run(
    workspace: Workspace, finished: Path, tmp_path: Path, name: str
) -> None:
    run_folder = shutil.copytree(finished, tmp_path / "run")
    (run_folder / SUMS_FILE).unlink()
    said = _refusals(workspace, run_folder, name)
    assert bool(said["comparison"]) == USED[name]
    assert bool(said["report"]) == (name != "lane_places.json")
    every = [str(error) for found in said.values() for error in found]
    assert [one for one in every if str(run_folder) not in one] == []
    renew_report(workspace, run_folder, out=tmp_path / "report.html")


def _refusals(workspace: Workspace, folder: Path, name: str) -> dict[str, list[InputError]]:
    """What a report and a comparison say to each damage of a file, which is whole again then."""
    file = folder / name
    whole = file.read_bytes()
    said: dict[str, list[InputError]] = {"report": [], "comparison": []}
    for damaged in (*DAMAGE, whole[: len(whole) // 2]):
        file.write_bytes(damaged)
        for what, found in said.items():
            try:
                if what == "report":
                    renew_report(workspace, folder, out=folder.with_name("report.html"))
                else:
                    read_runs(folder)
            except InputError as error:
                found.append(error)
    file.write_bytes(whole)
    return said


@pytest.mark.slow
def test_a_warm_up_is_left_out_of_the_figures_and_can_be_chosen_anew_for_a_finished_run(
    workspace: Workspace, sampled: Path, tmp_path: Path
) -> None:
    settings = RunSettings(until=100.0, warm_up=25.0, interval=25.0)
    done = run(workspace, sampled, settings=settings, out=tmp_path)
    found = done.figures_by("network", over_time=True)
    assert found.select("begin", "end").rows() == [(25.0, 50.0), (50.0, 75.0), (75.0, 100.0)]
    assert (done.summary["warm_up"], done.summary["interval"]) == (25.0, 25.0)
    plain = run(workspace, sampled, settings=RunSettings(until=100.0), out=tmp_path / "plain")
    assert not {"warm_up", "interval"} & plain.summary.keys()
    assert done.counts == plain.counts, "the same traffic"
    assert (done.folder / "trajectories.parquet").read_bytes() == (
        plain.folder / "trajectories.parquet"
    ).read_bytes()
    rows = interval_rows(workspace, done, warm_up=0.0, interval=50.0)
    assert [(row["begin"], row["end"]) for row in rows["network"]] == [(0.0, 50.0), (50.0, 100.0)]
    assert rows["figures"]["vehicle_km"] == pytest.approx(plain.figure("vehicle_km"))
    assert rows["figures"]["vehicle_km"] > done.figure("vehicle_km")
    report = renew_report(workspace, done, interval=50.0, warm_up=0.0, out=tmp_path / "new.html")
    assert report.is_file()
    with pytest.raises(InputError, match="must be multiples of 5 s"):
        interval_rows(workspace, done, interval=7.0)


@pytest.mark.slow
def test_charts_of_a_run_with_a_clock_have_times_of_day(
    workspace: Workspace, sampled: Path, tmp_path: Path
) -> None:
    scenario = read_scenario(sampled)
    demand = scenario.demand.model_copy(update={"clock": 23.99 * 3600.0})
    late = scenario.model_copy(update={"demand": demand})
    done = run(workspace, late, settings=RunSettings(until=120.0), out=tmp_path)
    assert done.report is not None
    text = done.report.read_text()
    assert "time of day" in text
    assert ">0:00<" in text, "after midnight the day begins anew"
    assert "time since the start" not in text
