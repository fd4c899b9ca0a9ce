from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from odscen.app.running.batches import run_all, run_many
from odscen.app.running.runs import carry_out, check_file, check_run, prepare_run, run
from odscen.app.running.watched_runs import watch
from odscen.app.scenarios import read_scenario, write_scenario
from odscen.base.errors import ConflictError, ScenarioError
from odscen.figures.judging.expectations import parse_expectation
from odscen.maps.store import Workspace
from odscen.runs.new_run import SimulationOutcome
from odscen.runs.reporter import Reporter
from odscen.runs.run_settings import RunSettings
from odscen.sumo.runner.run_folder import SumoPreparedRun
from odscen.sumo.runner.sumo_simulator import SumoSimulator
from tests.reporters import Listener

SHORT = RunSettings(until=5.0)


def broken(sampled: Path, folder: Path) -> Path:
    scenario = read_scenario(sampled)
    twice = (*scenario.actors, scenario.actors[0])
    return write_scenario(
        scenario.model_copy(update={"actors": twice}), folder / "broken.scenario.json"
    )


def test_a_scenario_with_errors_is_refused_and_none_of_the_others_is_run(
    workspace: Workspace, sampled: Path, tmp_path: Path
) -> None:
    file = broken(sampled, tmp_path)
    with pytest.raises(ScenarioError) as refused:
        run_many(workspace, [sampled, file], settings=SHORT, out=tmp_path / "runs")
    assert refused.value.file == str(file)
    assert not (tmp_path / "runs").exists()


@pytest.mark.slow
def test_a_run_that_has_ended_is_replaced_only_where_that_is_said(
    workspace: Workspace, sampled: Path, tmp_path: Path
) -> None:
    first = run(workspace, sampled, settings=SHORT, out=tmp_path)
    before = (first.folder / "SHA256SUMS").read_bytes()
    other = replace(SHORT, seed=9)
    for again in (
        lambda: run(workspace, sampled, settings=other, out=tmp_path),
        lambda: run_many(workspace, [sampled], settings=other, out=tmp_path),
        lambda: watch(workspace, sampled, settings=other, out=tmp_path).__enter__(),
    ):
        with pytest.raises(ConflictError, match=r"holds a run that has ended.*overwrite=True"):
            again()
    assert (first.folder / "SHA256SUMS").read_bytes() == before
    again = run(workspace, sampled, settings=other, out=tmp_path, overwrite=True)
    assert (again.folder, again.known["seed"]) == (first.folder, 9)


@pytest.mark.slow
@pytest.mark.parametrize("overwrite", [True, False])
def test_a_folder_that_is_no_run_is_never_replaced(
    workspace: Workspace, sampled: Path, tmp_path: Path, overwrite: bool
) -> None:
    mine = tmp_path / "mine" / "thesis.txt"
    mine.parent.mkdir()
    (tmp_path / "empty").mkdir()
    mine.write_text("years of work")
    with pytest.raises(ConflictError, match="not empty, and no run is in it"):
        run(workspace, sampled, settings=SHORT, out=tmp_path, name="mine", overwrite=overwrite)
    assert mine.read_text() == "years of work"
    run(workspace, sampled, settings=SHORT, out=tmp_path, name="empty", overwrite=overwrite)


@pytest.mark.slow
def test_settings_reach_plan_and_summary_unchanged(
    workspace: Workspace, sampled: Path, tmp_path: Path
) -> None:
    wanted = parse_expectation("sim_seconds<1")
    settings = RunSettings(seed=9, until=5.0, step_length=0.25, expectations=(wanted,))
    ready = check_file(workspace, sampled, out=tmp_path, settings=settings)
    prepared = prepare_run(ready)
    assert prepared.settings is settings
    plan = prepared.plan
    assert (plan.seed, plan.until, plan.step_length) == (9, 5.0, 0.25)
    result = carry_out(ready, prepared)
    assert result.folder == ready.folder == tmp_path / sampled.name.removesuffix(".scenario.json")
    assert (result.summary["seed"], result.summary["sim_seconds"]) == (9, 5.0)
    assert [verdict["passed"] for verdict in result.summary["expectations"]] == [False]
    assert result.exit_code == 1


@pytest.mark.slow
def test_files_can_be_added_when_the_simulation_has_ended_and_before_the_report(
    workspace: Workspace, sampled: Path, tmp_path: Path
) -> None:
    seen: list[tuple[bool, bool]] = []

    class WithParity(SumoSimulator):
        def run(
            self, prepared: SumoPreparedRun, folder: Path, reporter: Reporter
        ) -> SimulationOutcome:
            outcome = super().run(prepared, folder, reporter)
            there = (folder / "actors.json").is_file(), (folder / "report.html").is_file()
            seen.append(there)
            (folder / "parity.html").write_text("{}", encoding="utf-8")
            return outcome

    ready = check_file(workspace, sampled, out=tmp_path, settings=SHORT, simulator=WithParity())
    result = carry_out(ready, prepare_run(ready))
    assert seen == [(True, False)]
    assert result.summary["files"]["parity"] == "parity.html"
    assert (result.folder / "report.html").is_file()


@pytest.mark.slow
def test_a_checked_scenario_is_run_several_times_without_reports_if_none_are_wanted(
    workspace: Workspace, sampled: Path, tmp_path: Path
) -> None:
    ready = check_run(workspace, read_scenario(sampled), name="own", out=tmp_path)
    runs = [
        replace(ready, name=f"s{seed}", folder=tmp_path / f"s{seed}", settings=own)
        for seed in (1, 2)
        for own in (RunSettings(seed=seed, until=5.0),)
    ]
    listener = Listener()
    results = run_all(runs, reports=False, reporter=listener)
    assert [run.folder.name for run in listener.runs] == ["s1", "s2"]
    assert [result.summary["seed"] for result in results] == [1, 2]
    assert not any((result.folder / "report.html").exists() for result in results)


@pytest.mark.slow
def test_scenarios_of_one_name_get_folders_of_their_own(
    workspace: Workspace, sampled: Path, tmp_path: Path
) -> None:
    results = run_many(workspace, [sampled, sampled], settings=SHORT, out=tmp_path)
    name = sampled.name.removesuffix(".scenario.json")
    assert [result.folder.name for result in results] == [name, f"{name}-2"]
    one, other = (result.folder / "trajectories.parquet" for result in results)
    assert one.read_bytes() == other.read_bytes()
