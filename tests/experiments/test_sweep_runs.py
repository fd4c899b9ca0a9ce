"""Sweeps of a cut-in: rows, boundary, page and resuming, with real runs."""

from __future__ import annotations

import json
import shutil
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import polars as pl
import pytest

from odscen.app.exchange.exports import export
from odscen.app.running.runs import run
from odscen.base.errors import ConflictError, InputError
from odscen.experiments.sweeps import SweepSettings, read_sweep, sweep
from odscen.runs.finished_run import Run
from odscen.runs.recording import Recording
from odscen.runs.run_settings import RunSettings
from odscen.scenario.document.json_form import dumps, loads
from odscen.scenario.sweeps.sweep_plan import SweepPlan, axis_from_text
from tests.own_figure import install
from tests.sumo.story_case import MIDDLE, RIGHT, document, node_at, workspace

if TYPE_CHECKING:
    from pathlib import Path

    from odscen.experiments.sweeps import Sweep
    from odscen.scenario.document.scenario_document import Scenario

MOTORWAY = "motorway_weave"
SETTINGS = SweepSettings(safe=("min_ttc >= 0.8",), figures=("mean_speed",))
PLAN = SweepPlan((axis_from_text("gap=10,40"), axis_from_text("van=12,26")))


def actor(name: str, x: float, y: float, speed: Any, **fields: Any) -> dict[str, Any]:
    goal = node_at(MOTORWAY, 900.0, MIDDLE)
    spawn = node_at(MOTORWAY, x, y)
    about = {"id": name, "category": "car", "spawn": spawn, "goal": goal}
    return about | {"speed": speed, "initial_speed": speed} | fields


@pytest.fixture(scope="module")
def cut_in() -> Scenario:
    """A van comes over when the ego, at 30 m/s behind it on the next lane, is `gap` metres away."""
    data = json.loads(dumps(document(MOTORWAY, [], [], until=12.0)))
    when = {"distance": {"of": "ego", "to": "van", "along": "longitudinal", "below": "$gap"}}
    return loads(
        json.dumps(
            data
            | {
                "actors": [
                    actor("ego", 300.0, MIDDLE, 30.0, ego=True),
                    actor("van", 360.0, RIGHT, "$van"),
                ],
                "rules": [{"id": "r", "actor": "van", "when": when, "then": [{"lane": {"by": 1}}]}],
                "parameters": {
                    "gap": {"value": 20, "unit": "m", "min": 5, "max": 50},
                    "van": {"value": 20, "unit": "m/s", "min": 10, "max": 30},
                },
            }
        )
    )


@pytest.fixture(scope="module")
def swept(cut_in: Scenario, tmp_path_factory: pytest.TempPathFactory) -> Sweep:
    return sweep(
        workspace(), cut_in, PLAN, tmp_path_factory.mktemp("sweep") / "out", settings=SETTINGS
    )


@pytest.mark.slow
def test_each_case_is_a_row_with_its_outcome(swept: Sweep) -> None:
    table = swept.table
    assert table["case"].to_list() == ["case-001", "case-002", "case-003", "case-004"]
    assert table["gap"].to_list() == [10.0, 10.0, 40.0, 40.0]
    assert table["van"].to_list() == [12.0, 26.0, 12.0, 26.0]
    assert set(table["status"]) == {"completed"}
    hit = table.filter(pl.col("collision"))
    assert 1 <= hit.height < 4
    # the ego comes up at 30 - 12 m/s at most, and has braked by then
    assert all(0.0 < speed <= 18.1 for speed in hit["impact_speed"])
    assert not any(hit["safe"])
    calm = table.filter(pl.col("van") == 26.0)
    assert calm["safe"].to_list() == [True, True]
    assert swept.table.equals(pl.read_parquet(swept.folder / "cases.parquet"))


@pytest.mark.slow
def test_the_boundary_lies_between_safe_cases_and_others(swept: Sweep) -> None:
    assert swept.boundary
    for end in (point for stretch in swept.boundary for point in stretch):
        assert 10.0 <= end[0] <= 40.0
        assert 12.0 <= end[1] <= 26.0


@pytest.mark.slow
def test_a_case_runs_alone_with_the_same_figures(swept: Sweep, tmp_path: Path) -> None:
    settings = RunSettings(recording=Recording(emissions=False, criticality=True))
    file = swept.folder / "cases" / "case-003.scenario.json"
    assert "$" not in file.read_text(encoding="utf-8")
    alone = run(workspace(), file, settings=settings, out=tmp_path)
    row = swept.table.row(2, named=True)
    assert alone.figures["min_ttc"] == row["min_ttc"]
    assert alone.figures["min_ttc"] is not None
    there = Run.open(swept.folder / "runs" / "case-003")
    assert alone.figures == there.figures
    assert alone.trajectories().equals(there.trajectories())


def test_the_page_has_each_case_and_links_that_lead_somewhere(swept: Sweep) -> None:
    page = (swept.folder / "sweep.html").read_text(encoding="utf-8")
    safe = swept.table["safe"].sum()
    assert f"{safe} of 4 safe" in page
    assert "no collision; min_ttc &gt;= 0.8" in page
    for name in swept.table["case"]:
        assert f'href="cases/{name}.scenario.json"' in page
        assert (swept.folder / "cases" / f"{name}.scenario.json").is_file()


@pytest.mark.slow
def test_a_sweep_that_was_interrupted_ends_with_the_same_bytes(
    swept: Sweep, cut_in: Scenario, tmp_path: Path
) -> None:
    folder = tmp_path / "out"
    shutil.copytree(swept.folder, folder)
    for name in ("case-002", "case-004"):
        shutil.rmtree(folder / "runs" / name)
    for name in ("cases.parquet", "sweep.html"):
        (folder / name).unlink()
    told: list[str] = []
    done: list[tuple[int, int]] = []
    sweep(
        workspace(), cut_in, PLAN, folder, settings=SETTINGS, tell=told.append,
        done=lambda *ended: done.append(ended),
    )  # fmt: skip
    assert told[0] == "4 cases of gap, van; 2 to run"
    assert "for the other 1" in told[1]
    assert done == [(3, 4), (4, 4)]
    for name in ("cases.parquet", "sweep.html", "sweep.json", "scenario.json"):
        assert (folder / name).read_bytes() == (swept.folder / name).read_bytes()


def test_a_finished_sweep_writes_its_cases_as_openscenario(
    swept: Sweep, cut_in: Scenario, tmp_path: Path
) -> None:
    folder = tmp_path / "out"
    shutil.copytree(swept.folder, folder)
    settings = replace(SETTINGS, openscenario="1.1")
    sweep(workspace(), cut_in, PLAN, folder, settings=settings)
    cases = folder / "cases"
    assert len(list(cases.glob("*.xosc"))) == 4
    alone = tmp_path / "alone"
    given = {"version": "1.1"}
    file = cases / "case-003.scenario.json"
    for one in export(workspace(), file, alone, to="openscenario", options=given):
        assert one.read_bytes() == (cases / one.name).read_bytes()
    texts = {(cases / f"case-00{number}.xosc").read_bytes() for number in (1, 2, 3, 4)}
    assert len(texts) == 4
    page = (folder / "sweep.html").read_text(encoding="utf-8")
    assert 'href="cases/case-003.xosc"' in page
    table = "cases.parquet"
    assert (folder / table).read_bytes() == (swept.folder / table).read_bytes()


def test_an_unknown_version_of_openscenario_is_refused_before_anything_runs(
    cut_in: Scenario, tmp_path: Path
) -> None:
    out = tmp_path / "out"
    with pytest.raises(InputError, match=r"0\.9"):
        sweep(workspace(), cut_in, PLAN, out, settings=SweepSettings(openscenario="0.9"))
    assert not out.exists()


def test_a_folder_with_another_sweep_is_left_alone(swept: Sweep, cut_in: Scenario) -> None:
    before = (swept.folder / "sweep.json").read_bytes()
    other = SweepPlan((axis_from_text("gap=10,30"),))
    with pytest.raises(ConflictError, match=r"holds another sweep \(sweep.json differs\)"):
        sweep(workspace(), cut_in, other, swept.folder, settings=SETTINGS)
    assert (swept.folder / "sweep.json").read_bytes() == before


def test_what_a_folder_sweeps_can_be_read(swept: Sweep, cut_in: Scenario, tmp_path: Path) -> None:
    scenario, plan, settings = read_sweep(swept.folder)
    assert (scenario, plan) == (cut_in, PLAN)
    assert settings["safe"] == ["min_ttc >= 0.8"]
    with pytest.raises(InputError, match="no sweep is here"):
        read_sweep(tmp_path)


@pytest.mark.slow
def test_cases_that_are_not_possible_are_rows_with_the_reason(
    cut_in: Scenario, tmp_path: Path
) -> None:
    def stopped(run: Run) -> float | None:
        return float(run.summary["sim_seconds"])

    plan = SweepPlan((axis_from_text("gap=20,60"),))
    settings = SweepSettings(own={"seconds": stopped})
    found = sweep(workspace(), cut_in, plan, tmp_path / "out", settings=settings).table
    assert found["status"].to_list() == ["completed", "refused"]
    assert found["safe"].to_list()[1] is None
    assert "value 60 is outside 5..50 m" in found["detail"][1]
    assert found["seconds"].to_list() == [12.0, None]
    page = (tmp_path / "out" / "sweep.html").read_text(encoding="utf-8")
    assert "refused: case-002 (gap = 60)" in page


@pytest.mark.parametrize(
    ("axis", "safe", "words"),
    [
        ("gup=1,2", (), "no parameter 'gup'; it has gap, van"),
        ("gap=60,70", (), "no case of the sweep can be run: case-001"),
        ("gap=20", ("ttc > 1",), "no column 'ttc'; there are collision, impact_speed, min_ttc"),
        ("gap=20", ("safe please",), "is no limit; write for example"),
    ],
)
def test_a_sweep_that_cannot_be_is_refused(
    cut_in: Scenario, tmp_path: Path, axis: str, safe: tuple[str, ...], words: str
) -> None:
    plan = SweepPlan((axis_from_text(axis),))
    with pytest.raises(InputError, match=words):
        sweep(workspace(), cut_in, plan, tmp_path / "out", settings=SweepSettings(safe=safe))
    assert not list(tmp_path.rglob("*.json"))  # the folder is left to another sweep


@pytest.mark.slow
def test_a_figure_of_an_installed_package_is_a_column_and_can_be_limited(
    cut_in: Scenario, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    install(tmp_path, monkeypatch)
    plan = SweepPlan((axis_from_text("van=12,26"),))
    settings = SweepSettings(safe=("top_speed <= 29",), figures=("top_speed", "mean_speed"))
    found = sweep(workspace(), cut_in, plan, tmp_path / "sweep", settings=settings).table
    speeds = [
        Run.open(tmp_path / "sweep" / "runs" / case).trajectories()["speed"].max()
        for case in found["case"]
    ]
    assert found["top_speed"].to_list() == speeds
    assert found["safe"].to_list() == [False, False], "the ego begins at 30 m/s"


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("words", "words returned 'many', not a number or None"),
        ("fails", "fails: ZeroDivisionError: division by zero"),
        ("beauty", "no figure of runs is called 'beauty', and no installed package offers one"),
    ],
)
def test_a_figure_of_a_package_that_is_none_says_why(
    cut_in: Scenario, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str, words: str
) -> None:
    install(tmp_path, monkeypatch)
    plan = SweepPlan((axis_from_text("van=12"),))
    with pytest.raises(InputError, match=words):
        sweep(workspace(), cut_in, plan, tmp_path / "sweep", settings=SweepSettings(figures=[name]))
