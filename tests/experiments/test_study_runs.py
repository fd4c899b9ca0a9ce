"""Studies begun, interrupted, resumed and extended; outcomes are made up, but for three tests."""

from __future__ import annotations

import json
import tarfile
from typing import TYPE_CHECKING, Any

import polars as pl
import pytest

from odscen.app.running.batches import run_all
from odscen.app.running.runs import check_file
from odscen.base.errors import ConflictError, InputError
from odscen.base.folder_locks import locked
from odscen.experiments import studies as study_folder
from odscen.experiments import work as study_work
from odscen.experiments.plan import read_study_plan
from odscen.experiments.studies import (
    TABLE_FILE,
    begin_study,
    carry_out_study,
    extend_study,
    read_study,
    study_results,
    study_state,
)
from odscen.experiments.study_page import (
    difference_sentences,
    study_groups,
    write_study_page,
)
from odscen.experiments.work import LocalExecutor
from odscen.figures.measures.registry import RUN_FIGURES
from odscen.runs.run_settings import RunSettings
from odscen.scenario.sampling.sampler import sample_scenario
from tests.experiments.study_case import WARM, MadeUp, place, plan_file

if TYPE_CHECKING:
    from pathlib import Path

    from odscen.experiments.studies import EndedStudy
    from odscen.scenario.document.scenario_document import Scenario

PLAN: dict[str, Any] = {"variant": [WARM], "seeds": 5}


@pytest.fixture
def begun(tmp_path: Path) -> Path:
    out = tmp_path / "out"
    begin_study(place(), plan_file(tmp_path, **PLAN), out)
    return out


def test_a_study_that_is_killed_and_resumed_has_the_table_of_another(
    begun: Path, tmp_path: Path
) -> None:
    parts = []
    for most in (3, 4, None):
        executor = MadeUp(most=most, times=2)
        parts.append(executor.ran)
        if most is None:
            carry_out_study(begun, executor)
        else:
            with pytest.raises(KeyboardInterrupt):
                carry_out_study(begun, executor)
    assert [len(ran) for ran in parts] == [3, 4, 3]
    assert len({name for ran in parts for name in ran}) == 10
    other = tmp_path / "other"
    begin_study(place(), plan_file(tmp_path, **PLAN), other)
    ended = carry_out_study(other, MadeUp())
    assert ended.table["run"].n_unique() == 10
    assert (begun / TABLE_FILE).read_bytes() == (other / TABLE_FILE).read_bytes()


@pytest.mark.slow
def test_a_scenario_is_sampled_once_for_all_of_its_seeds(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    sample = {"maps": ["signal_crossing"], "count": 2, "fill": 0.05}
    (tmp_path / "sampled.json").write_text(
        json.dumps({"name": "sampled", "sample": [sample], "seeds": 2, "run": {"until": 5}}),
        encoding="utf-8",
    )
    sampled: list[str] = []

    def counted(*given: Any, name: str, **more: Any) -> Scenario:
        sampled.append(name)
        return sample_scenario(*given, name=name, **more)

    monkeypatch.setattr(study_work, "sample_scenario", counted)
    begin_study(place(), tmp_path / "sampled.json", tmp_path / "out")
    ended = carry_out_study(tmp_path / "out", LocalExecutor(place(), 1))
    assert ended.state.counts["completed"] == 4
    assert sampled == ["signal_crossing-0000", "signal_crossing-0001"]


def test_state_and_table_of_a_study_that_has_not_ended(begun: Path) -> None:
    with pytest.raises(KeyboardInterrupt):
        carry_out_study(begun, MadeUp(most=4, broken=frozenset({"crossing/as-designed/seed-1"})))
    state = study_state(begun)
    assert (state.runs, state.ended, state.done, state.active) == (10, 4, False, False)
    assert state.counts == {"completed": 3, "failed": 1, "refused": 0}
    assert state.problems == (("out of luck", 1),)
    assert study_results(begun).table.height == 4
    with locked(begun, what="study"):
        assert study_state(begun).active


def test_those_that_failed_are_run_again_if_asked(begun: Path) -> None:
    broken = frozenset({"crossing/slow/seed-2"})
    carry_out_study(begun, MadeUp(broken=broken))
    nothing = MadeUp()
    carry_out_study(begun, nothing)
    assert nothing.ran == []
    again = MadeUp()
    ended = carry_out_study(begun, again, again=True)
    assert again.ran == ["crossing/slow/seed-2"]
    assert ended.state.counts["completed"] == 10


def test_more_seeds_leave_what_there_is(begun: Path, tmp_path: Path) -> None:
    carry_out_study(begun, MadeUp())
    plan = read_study_plan(plan_file(tmp_path, variant=[WARM], seeds=6))
    with pytest.raises(ConflictError, match="10 runs, the plan has 12: odscen study extend"):
        begin_study(place(), tmp_path / "plan.json", begun)
    extend_study(place(), begun, plan)
    executor = MadeUp()
    ended = carry_out_study(begun, executor)
    assert sorted(executor.ran) == ["crossing/as-designed/seed-6", "crossing/slow/seed-6"]
    assert ended.table["seed"].to_list() == [1, 2, 3, 4, 5, 6] * 2
    assert read_study(begun).plan.seeds == (1, 2, 3, 4, 5, 6)


def test_another_odscen_does_not_add_to_a_study(
    begun: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(study_folder, "versions", lambda: {"odscen": "9.9", "sumo": "1.28.0"})
    with pytest.raises(ConflictError, match=r"begun with odscen \S+, this is 9\.9"):
        carry_out_study(begun, MadeUp())


def test_a_folder_without_a_study_is_refused(tmp_path: Path) -> None:
    for wrong in (study_state, study_results):
        with pytest.raises(InputError, match="no study is here"):
            wrong(tmp_path)


def test_a_parameter_is_not_called_as_a_column(tmp_path: Path) -> None:
    plan_file(tmp_path)
    file = tmp_path / "crossing.scenario.json"
    text = file.read_text("utf-8").replace("per_minute", "mean_delay")
    file.write_text(text, encoding="utf-8")
    vary = [{"parameter": "mean_delay", "values": [2, 4]}]
    with pytest.raises(InputError, match="'mean_delay' has the name of a column"):
        begin_study(place(), plan_file(tmp_path, vary=vary), tmp_path / "out")


@pytest.mark.slow
def test_the_report_pairs_runs_of_variants_by_seed(begun: Path) -> None:
    carry_out_study(begun, MadeUp(broken=frozenset({"crossing/slow/seed-2"})))
    table = study_results(begun).table
    (first, slow), (found,) = study_groups(begun, ["mean_speed"])
    assert (first.variant, first.runs, slow.variant, slow.runs) == ("as-designed", 5, "slow", 4)
    own = table.filter(pl.col("variant") == "as-designed")["mean_speed"]
    assert first.figures["mean_speed"].mean == pytest.approx(own.mean())
    done = table.filter(pl.col("status") == "completed")
    kept = own.gather([0, 2, 3, 4]).mean()
    other = done.filter(pl.col("variant") == "slow")["mean_speed"].mean()
    assert found.runs == 4
    assert found.figures["mean_speed"].mean == pytest.approx(other - kept)
    page = write_study_page(begun, ["mean_speed"], begun / "study.html").read_text("utf-8")
    assert "1 of 10 runs failed" in page
    assert "out of luck" in page
    (sentence,) = difference_sentences(begun, ["mean_speed"])
    assert sentence in page
    interval = found.figures["mean_speed"]
    change = "rises" if interval.mean > 0.0 else "falls"
    clear = abs(interval.mean) > interval.half_width
    assert sentence.startswith("slow, compared with as-designed: ")
    assert (f"mean speed {change} by" in sentence) == clear
    assert "4 pairs of runs" in sentence
    with pytest.raises(InputError, match="no figure of runs is called 'luck'"):
        study_groups(begun, ["luck"])


@pytest.fixture(scope="module")
def real(tmp_path_factory: pytest.TempPathFactory) -> EndedStudy:
    """Two seeds, of a case that is possible and one beyond the bounds of its parameter."""
    folder = tmp_path_factory.mktemp("study")
    vary = [{"parameter": "per_minute", "values": [4, 30]}]
    begin_study(place(), plan_file(folder, vary=vary, keep="all"), folder / "out")
    return carry_out_study(folder / "out", LocalExecutor(place(), 2), target=str(folder / "kept"))


@pytest.mark.slow
def test_each_run_is_a_row_and_one_that_is_not_possible_says_why(real: EndedStudy) -> None:
    assert real.table["status"].to_list() == ["completed", "completed", "refused", "refused"]
    assert real.table["per_minute"].to_list() == [4.0, 4.0, 30.0, 30.0]
    assert real.table["case"].to_list() == [1, 1, 2, 2]
    assert "per_minute" in real.table["detail"][2]
    assert real.table["mean_speed"].drop_nulls().len() == 2
    assert set(real.table.columns) >= {figure.name for figure in RUN_FIGURES}


@pytest.mark.slow
def test_a_row_has_the_figures_of_the_run_alone(real: EndedStudy, tmp_path: Path) -> None:
    file = plan_file(tmp_path).with_name("crossing.scenario.json")
    text = file.read_text("utf-8").replace('{"value": 3', '{"value": 4')
    file.write_text(text, encoding="utf-8")
    checked = check_file(place(), file, out=tmp_path, settings=RunSettings(seed=2))
    (alone,) = run_all([checked], reports=False)
    row = real.table.row(1, named=True)
    assert {name: row[name] for name in alone.figures} == dict(alone.figures)
    assert row["arrived"] == alone.counts["arrived"]


def test_run_folders_that_are_kept_go_to_the_target(real: EndedStudy) -> None:
    kept = real.state.folder.parent / "kept"
    files = sorted(path.relative_to(kept).as_posix() for path in kept.rglob("*.tar"))
    assert files == [f"crossing/as-designed/case-1/seed-{seed}.tar" for seed in (1, 2)]
    with tarfile.open(kept / files[0]) as archive:
        assert {"summary.json", "trajectories.parquet"} <= set(archive.getnames())
