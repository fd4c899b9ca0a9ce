"""Runs in MetaDrive: with a stand-in for its process, and with the real one where it is there.

``ODSCEN_METADRIVE_PYTHON`` names a Python that has it.
"""

from __future__ import annotations

import json
import os
import sys
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pytest

import odscen
from odscen.app.scenarios import read_scenario, write_scenario
from odscen.base.errors import InputError, MissingDependencyError
from odscen.metadrive import metadrive_run
from odscen.metadrive.metadrive_run import PYTHON_VARIABLE, MetaDrive
from odscen.runs.run_settings import RunSettings
from odscen.scenario.document.rules_document import StoryRule
from tests.reporters import Listener

if TYPE_CHECKING:
    from odscen.maps.store import Workspace
    from odscen.runs.finished_run import Run

SETTINGS = RunSettings(until=40.0)
STAND_IN = Path(__file__).with_name("stand_in_child.py")
REAL = os.environ.get(PYTHON_VARIABLE, "")
real = pytest.mark.skipif(not REAL, reason=f"{PYTHON_VARIABLE} names no Python with MetaDrive")


@pytest.fixture
def stand_in(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(metadrive_run, "CHILD", STAND_IN)
    monkeypatch.setattr(MetaDrive, "_ask_version", lambda _: ("0.0", "3.11"))
    monkeypatch.setenv(PYTHON_VARIABLE, sys.executable)


@pytest.fixture(scope="module")
def with_ego(sampled: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The scenario, one of its cars being the ego."""
    scenario = read_scenario(sampled)
    number = next(k for k, actor in enumerate(scenario.actors) if actor.category == "car")
    actors = list(scenario.actors)
    actors[number] = actors[number].model_copy(update={"ego": True})
    made = scenario.model_copy(update={"actors": tuple(actors)})
    return write_scenario(made, tmp_path_factory.mktemp("ego") / "ego.scenario.json")


def parity_of(run: Run) -> dict[str, object]:
    found: dict[str, object] = json.loads((run.folder / "parity.json").read_text(encoding="utf-8"))
    return found


@pytest.mark.slow
@pytest.mark.usefixtures("stand_in")
def test_a_run_is_replayed_with_records_figures_and_parity(
    workspace: Workspace, sampled: Path, tmp_path: Path
) -> None:
    listener = Listener()
    run = odscen.run(
        workspace, sampled, simulator="metadrive", settings=SETTINGS, out=tmp_path / "md",
        reporter=listener,
    )  # fmt: skip
    sumo = odscen.run(workspace, sampled, settings=SETTINGS, out=tmp_path / "sumo")
    assert run.status == "completed"
    assert run.summary["driven_by"] == "MetaDrive"
    assert run.summary["versions"]["metadrive"] == "0.0"
    assert listener.progress
    for name in ("planned", "inserted", "arrived"):
        assert run.counts[name] == sumo.counts[name] > 3
    mine, other = (one.trajectories().sort("time", "id") for one in (run, sumo))
    assert mine["id"].to_list() == other["id"].to_list()
    apart = np.hypot(*(mine[name].to_numpy() - other[name].to_numpy() for name in ("x", "y")))
    assert apart.max() < 1e-3
    parity = parity_of(run)
    assert parity["share_mirrored"] == 1.0
    assert parity["shown_by"] == "MetaDrive"
    assert parity["position_error_m"]["max"] < 1e-6  # type: ignore[index]
    page = (run.folder / "parity.html").read_text(encoding="utf-8")
    assert "SUMO and MetaDrive compared" in page
    assert "CARLA" not in page
    assert run.report is not None
    assert [one.name for one in (tmp_path / "md").iterdir()] == [run.folder.name], "SUMO's is gone"


@pytest.mark.slow
@pytest.mark.usefixtures("stand_in")
def test_a_contact_is_a_collision_once_and_said(
    workspace: Workspace,
    sampled: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setenv("MISBEHAVE", "contact")
    listener = Listener()
    run = odscen.run(
        workspace, sampled, simulator="metadrive", settings=SETTINGS, out=tmp_path,
        reporter=listener,
    )  # fmt: skip
    assert run.counts["collided"] == 2, "both of them, once"
    assert any("in MetaDrive for 1.5 s" in words for words in listener.words)


@pytest.mark.slow
@pytest.mark.usefixtures("stand_in")
def test_who_is_not_shown_is_in_the_parity_report(
    workspace: Workspace,
    sampled: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setenv("MISBEHAVE", "leaves")
    run = odscen.run(workspace, sampled, simulator="metadrive", settings=SETTINGS, out=tmp_path)
    parity = parity_of(run)
    assert parity["share_mirrored"] < 1.0  # type: ignore[operator]
    (absent,) = parity["absent"]  # type: ignore[misc]
    assert absent["since"] == 10.0


@pytest.mark.slow
@pytest.mark.usefixtures("stand_in")
def test_a_process_that_ends_is_a_failed_run_with_its_words(
    workspace: Workspace,
    sampled: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setenv("MISBEHAVE", "ends")
    run = odscen.run(workspace, sampled, simulator="metadrive", settings=SETTINGS, out=tmp_path)
    assert run.status == "failed"
    assert "the stand-in was told to end" in run.summary["error"]
    assert run.summary["sim_seconds"] == 5.0, "what it did so far is kept"


def test_a_python_without_metadrive_is_named_before_anything_runs(
    workspace: Workspace, sampled: Path, tmp_path: Path
) -> None:
    played = MetaDrive(python=sys.executable)
    with pytest.raises(MissingDependencyError, match="has no MetaDrive"):
        odscen.run(workspace, sampled, simulator=played, out=tmp_path)
    nowhere = MetaDrive(python=str(tmp_path / "python"))
    with pytest.raises(MissingDependencyError, match="cannot be started"):
        odscen.run(workspace, sampled, simulator=nowhere, out=tmp_path)
    assert not any(tmp_path.iterdir())


def test_another_word_for_what_moves_the_ego_is_refused() -> None:
    with pytest.raises(InputError, match="'fast' is none of replay, tracking, idm"):
        MetaDrive(ego="fast")


def test_what_is_not_done_is_said_by_what_drives(with_ego: Path) -> None:
    scenario = read_scenario(with_ego)
    ego = next(actor.id for actor in scenario.actors if actor.ego)
    rule = {"id": "r", "actor": ego, "when": {"time": {"after": 1}}, "then": [{"brake": {"by": 4}}]}
    ruled = scenario.model_copy(update={"rules": (StoryRule.model_validate(rule),)})

    class Level:
        class graph:  # noqa: N801
            class lanes:  # noqa: N801
                z = np.zeros(3)

    def words(**options: str) -> list[str]:
        return [one.message for one in MetaDrive(**options).unsupported(ruled, Level)]  # type: ignore[arg-type]

    sky = "MetaDrive has no traffic lights and no weather: only SUMO's drivers react to them"
    assert words(ego="tracking") == words(ego="replay") == [sky]
    above, seen, rules = words(ego="idm")
    assert above == sky
    assert seen == "who is driven by MetaDrive's IDM sees no traffic light, sign or right of way"
    assert rules == f"MetaDrive's IDM does not follow rule r of {ego}"


@real
@pytest.mark.slow
def test_metadrive_replays_a_run_exactly_and_its_physics_keep_near_it(
    workspace: Workspace, with_ego: Path, tmp_path: Path
) -> None:
    settings = RunSettings(until=60.0)
    bounds = {"replay": (1e-4, 1e-4), "tracking": (1.5, 10.0)}
    for drive, (usual, most) in bounds.items():
        played = MetaDrive(ego=drive, traffic=drive)
        out = tmp_path / drive
        run = odscen.run(workspace, with_ego, simulator=played, settings=settings, out=out)
        assert run.status == "completed", run.summary["error"]
        parity = parity_of(run)
        assert parity["share_mirrored"] == 1.0
        error = parity["position_error_m"]
        assert error["p95"] < usual  # type: ignore[index]
        assert error["max"] < most  # type: ignore[index]


@real
@pytest.mark.slow
def test_metadrives_policy_drives_the_ego_and_runs_are_the_same_each_time(
    workspace: Workspace, with_ego: Path, tmp_path: Path
) -> None:
    runs = [
        odscen.run(
            workspace, with_ego, simulator="metadrive", settings=RunSettings(until=60.0), out=out
        )
        for out in (tmp_path / "a", tmp_path / "b")
    ]
    first, second = ((run.folder / "trajectories.parquet").read_bytes() for run in runs)
    assert first == second
    ego = next(actor.id for actor in read_scenario(with_ego).actors if actor.ego)
    rows = runs[0].trajectories().sort("time")
    own = rows.filter(rows["id"] == ego)
    moved = np.hypot(np.diff(own["x"].to_numpy()), np.diff(own["y"].to_numpy()))
    assert moved.sum() > 50.0
    assert moved.max() < 20.0 * runs[0].summary["step_length"], "it drives and does not jump"
    parity = parity_of(runs[0])
    assert parity["worst"][0]["actor"] == ego  # type: ignore[index]
    assert parity["worst"][0]["position"] > 0.5  # type: ignore[index]
