"""A simulator from outside: installed, run by name, and its run read like any other."""

from __future__ import annotations

import doctest
import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import odscen
from odscen.app.running.runs import check_file, prepare_run
from odscen.app.scenarios import read_scenario, write_scenario
from odscen.base.errors import InputError
from odscen.maps.store import Workspace
from odscen.runs.run_settings import RunSettings
from odscen.scenario.document.rules_document import StoryRule
from odscen.simulators import base, positions
from odscen.simulators.installed import installed_simulators, open_simulator, simulator_names
from tests.app.conftest import sampled, workspace
from tests.installed_packages import install, install_shown
from tests.reporters import Listener

__all__ = ["sampled", "workspace"]

SETTINGS = RunSettings(until=60.0)


@pytest.fixture
def steady(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    """Name of the simulator of the document, which is installed."""
    heading = "## A simulator of your own"
    install_shown("simulators.md", heading, tmp_path / "site", monkeypatch)
    return "steady"


def test_one_list_has_those_that_ship_and_those_of_packages(steady: str) -> None:
    assert simulator_names() == [
        "sumo",
        "carla-mirror",
        "carla-native",
        "metadrive",
        "esmini",
        steady,
    ]
    offered = {one.name: one for one in installed_simulators()}
    assert not any(one.error for one in offered.values())
    assert offered[steady].summary == "All at a constant speed, through each other."
    assert [option.name for option in offered[steady].options] == ["speed"]
    assert [option.name for option in offered["carla-native"].options] == ["address", "physics"]


@pytest.mark.slow
def test_the_command_line_runs_it_into_a_whole_folder(
    steady: str, workspace: Workspace, sampled: Path, tmp_path: Path
) -> None:
    done = subprocess.run(
        [
            *(sys.executable, "-m", "odscen", "run", sampled, "--simulator", steady),
            *("--simulator-set", "speed=9", "--workspace", workspace.root, "--until", "60"),
            *("--out", tmp_path / "runs", "--json"),
        ],
        capture_output=True,
        text=True,
        check=True,
    )
    told = json.loads(done.stdout)
    assert {"scenario", "plan", "trajectories", "trips", "events", "actors", "report"} <= set(
        told["files"]
    )
    assert told["driven_by"] == "Steady traffic"
    assert not (Path(told["folder"]) / "sumo").exists(), "SUMO had no part in it"
    report = Path(told["files"]["report"]).read_text(encoding="utf-8")
    assert "Steady traffic" in report or told["scenario"] in report


def test_python_runs_it_and_reads_records_and_figures(
    steady: str, workspace: Workspace, sampled: Path, tmp_path: Path
) -> None:
    listener = Listener()
    run = odscen.run(
        workspace, sampled, simulator=steady, settings=SETTINGS, out=tmp_path, reporter=listener
    )
    assert run.status == "completed"
    assert listener.runs == [run]
    assert listener.progress
    counts = run.counts
    assert counts["planned"] == counts["inserted"] > 3
    assert run.summary["insertion_error_max"] < 0.5, "it leaves out lateral offsets"
    table = run.trajectories()
    # What is read is the speed of positions, which it takes from nodes two metres apart.
    assert table["speed"].median() == pytest.approx(8.0, abs=0.05)
    assert table["speed"].max() < 8.2
    steps = table.sort("id", "time").group_by("id", maintain_order=True)
    for _, rows in steps:
        moved = np.hypot(np.diff(rows["x"].to_numpy()), np.diff(rows["y"].to_numpy()))
        assert moved.max(initial=0.0) <= 8.0 * run.summary["step_length"] + 0.05
    arrived = run.actors().filter(run.actors()["status"] == "arrived")
    assert len(arrived) == counts["arrived"] > 0
    driven = arrived["route_length"].sum() / arrived["travel_time"].sum()
    assert driven == pytest.approx(8.0, rel=0.05), "arrivals are known to a step"
    assert run.figure("mean_travel_time") > 0.0
    assert run.report is not None
    again = odscen.Run.open(run.folder)
    assert again.figures == run.figures


def test_routes_lead_from_spawn_to_goal_on_the_lane_graph(
    workspace: Workspace, sampled: Path
) -> None:
    checked = check_file(workspace, sampled, settings=SETTINGS)
    routed = checked.run_map.routed_run(checked.scenario, SETTINGS)
    realized = prepare_run(checked).plan
    assert [actor.id for actor in routed.plan.actors] == [actor.id for actor in realized.actors]
    for actor, other in zip(routed.plan.actors, realized.actors, strict=True):
        assert actor == other, "planned as SUMO's"
        route = routed.routes[actor.id]
        assert (route.nodes[0], route.nodes[-1]) == (actor.spawn, actor.goal)
        assert route.points.shape == (len(route.nodes), 3)
        assert len(route.hdg) == len(route.nodes) == len(route.speed) + 1
        steps = np.hypot(*np.diff(route.points[:, :2], axis=0).T)
        assert steps.sum() == pytest.approx(actor.route_length)


def test_what_it_does_not_do_is_said_before_the_run_and_kept(
    steady: str, workspace: Workspace, sampled: Path, tmp_path: Path
) -> None:
    scenario = read_scenario(sampled)
    rule = {
        "id": "r", "actor": scenario.actors[0].id, "when": {"time": {"after": 1}},
        "then": [{"brake": {"by": 4}}],
    }  # fmt: skip
    ruled = scenario.model_copy(update={"rules": (StoryRule.model_validate(rule),)})
    file = write_scenario(ruled, tmp_path / "ruled.scenario.json")
    listener = Listener()
    run = odscen.run(
        workspace, file, simulator=steady, settings=SETTINGS, out=tmp_path, reporter=listener
    )
    words = "Steady traffic does not follow rule r"
    assert words in listener.words
    assert words in run.summary["problems"]


@pytest.mark.parametrize(
    ("settings", "words"),
    [({"meso": True}, "meso is SUMO's"), ({"simulator": "steddy"}, "there is no simulator")],
)
def test_what_it_cannot_follow_and_unknown_names_are_refused(
    steady: str, workspace: Workspace, sampled: Path, settings: dict[str, Any], words: str
) -> None:
    wanted = {"simulator": steady, **settings}
    with pytest.raises(InputError, match=words) as refused:
        odscen.run(workspace, sampled, settings=RunSettings(**wanted))
    if "simulator" in settings:
        assert "sumo, carla-mirror, carla-native, metadrive, esmini, steady" in str(refused.value)


@pytest.mark.parametrize(
    ("code", "words"),
    [
        ("import nowhere", "cannot be imported"),
        ("class Mine:\n    pass", "is no odscen.simulators.base.Simulator"),
    ],
)
def test_a_package_that_breaks_says_so_and_leaves_the_others(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, code: str, words: str
) -> None:
    entries = {"odscen.simulators": {"broken": "broken_one:Mine"}}
    install(tmp_path, monkeypatch, code=code, entry_points=entries)
    with pytest.raises(InputError, match=words):
        open_simulator("broken")
    assert "sumo" in simulator_names()


def test_code_that_raises_in_a_run_is_a_failed_run(
    workspace: Workspace, sampled: Path, tmp_path: Path
) -> None:
    class Crashing(base.Simulator[base.RoutedRun]):
        label = "Crashing"

        def prepare(self, scenario: Any, on: Any, settings: Any, _: Any) -> base.RoutedRun:
            return on.routed_run(scenario, settings)

        def run(self, *_: Any) -> Any:
            raise ZeroDivisionError("half a car")

    run = odscen.run(workspace, sampled, simulator=Crashing(), out=tmp_path)
    assert run.status == "failed"
    assert run.known["error"] == "Crashing: ZeroDivisionError('half a car')"


def test_the_example_of_the_seam_runs(
    workspace: Workspace, sampled: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("ODSCEN_WORKSPACE", str(tmp_path))
    names = {
        **vars(base), **vars(positions), "odscen": odscen, "workspace": workspace,
        "scenario": sampled,
    }  # fmt: skip
    (example,) = doctest.DocTestFinder(recurse=False).find(base.Simulator, "Simulator", globs=names)
    found = doctest.DocTestRunner(optionflags=doctest.ELLIPSIS).run(example)
    assert (found.attempted > 3, found.failed) == (True, 0)


def test_a_body_that_turns_on_the_spot_has_the_speed_of_its_centre(
    workspace: Workspace, sampled: Path, tmp_path: Path
) -> None:
    class Spinning(base.Simulator[base.RoutedRun]):
        label = "Spinning"

        def prepare(self, scenario: Any, on: Any, settings: Any, _: Any) -> base.RoutedRun:
            return on.routed_run(scenario, settings)

        def run(self, prepared: Any, folder: Path, reporter: Any) -> Any:
            record, name = positions.PositionRecord(prepared), prepared.plan.actors[0].id
            for time in record.times(reporter):
                turned = 4.0 * time if 2.0 <= time < 4.0 else 0.0
                at = positions.Position(name, 1.3 * time, 0.0, turned, speed=1.3)
                record.add(time, [at] if time < 6.0 else [])
            return record.write(folder)

    run = odscen.run(
        workspace, sampled, simulator=Spinning(), out=tmp_path,
        settings=RunSettings(until=8.0, step_length=0.1),
    )  # fmt: skip
    table = run.trajectories()
    assert table.height == 60
    assert table["hdg"].n_unique() > 15
    # Its front moves by up to 9 m/s meanwhile.
    assert table["speed"].to_numpy() == pytest.approx(1.3, abs=1e-6)


def test_whoever_is_nowhere_or_comes_back_is_refused(workspace: Workspace, sampled: Path) -> None:
    checked = check_file(workspace, sampled, settings=SETTINGS)
    routed = checked.run_map.routed_run(checked.scenario, SETTINGS)
    name = routed.plan.actors[0].id
    record = positions.PositionRecord(routed)
    with pytest.raises(InputError, match="is nowhere at 0 s"):
        record.add(0.0, [positions.Position(name, float("nan"), 0.0, 0.0)])
    with pytest.raises(InputError, match="no road user 'nobody'"):
        record.add(0.0, [positions.Position("nobody", 0.0, 0.0, 0.0)])
    record.add(0.0, [positions.Position(name, 0.0, 0.0, 0.0)])
    record.add(0.5, [])
    with pytest.raises(InputError, match="is back at 1 s"):
        record.add(1.0, [positions.Position(name, 0.0, 0.0, 0.0)])
