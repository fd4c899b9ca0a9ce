"""CARLA's Traffic Manager drives a scenario on the stand-in: see docs/carla.md."""

from __future__ import annotations

import json
import math
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl
import psutil
import pytest

from odscen.app.maps import load_map
from odscen.app.scenarios import read_scenario
from odscen.base.errors import InputError
from odscen.carla.native.native_plan import native_actors
from odscen.carla.native.native_run import NativeOptions, left_out
from odscen.maps.store import Workspace
from odscen.scenario.document.json_form import dumps
from odscen.scenario.document.measures_document import SpeedLimit
from odscen.scenario.document.rules_document import StoryRule
from odscen.scenario.document.scenario_document import Scenario, TripParking
from odscen.sumo.runner.prepare import prepare
from tests.carla.conftest import MAPS, Sample
from tests.carla_standin.process import StandIn

CROSSING = MAPS / "signal_crossing.xodr"
TOWN = MAPS / "town_5x5.xodr"


@pytest.fixture
def planned(workspace: Workspace) -> Any:
    """A function: scenario file to plan, lane graph and native actors."""

    def made(path: Path) -> Any:
        scenario = read_scenario(path)
        entry = workspace.map_for(scenario.map.name, scenario.map.sha256)
        graph = load_map(entry)
        run = prepare(scenario, graph.sumo, entry.path("net"))
        return run.plan, graph.sumo.graph, native_actors(scenario, graph.sumo.graph, run.plan)

    return made


@pytest.mark.slow
def test_everybody_begins_where_and_ends_where_the_plan_says(planned: Any, sample: Sample) -> None:
    plan, _, actors = planned(sample(TOWN, seed=3))
    assert len(actors) == len(plan.actors)
    for actor in actors:
        wanted = plan.actors[actor.row]
        assert (actor.at.x, actor.at.y, actor.at.hdg) == (wanted.x, wanted.y, wanted.hdg)
        assert actor.depart == wanted.depart
        steps = np.diff(actor.route[:, :2], axis=0)
        assert np.sum(np.hypot(*steps.T)) == pytest.approx(wanted.route_length)
        limit = np.inf if wanted.speed is None else wanted.speed
        assert actor.speed.max() <= limit + 1e-9


def words_of(scenario: Scenario) -> list[str]:
    return [words for _, words in left_out(scenario)]


@pytest.mark.slow
def test_what_carla_alone_does_not_do_of_rules_is_said(sample: Sample) -> None:
    scenario = read_scenario(sample(TOWN, seed=3))
    name = scenario.actors[0].id
    rule = {
        "id": "r", "actor": name, "when": {"time": {"after": 1}},
        "then": [{"brake": {"by": 4}}, {"together": [{"go": {}}, {"horn": {}}]}],
    }  # fmt: skip
    ruled = scenario.model_copy(update={"rules": (StoryRule.model_validate(rule),)})
    assert left_out(scenario) == []
    assert words_of(ruled) == [f"CARLA alone does not do rule r of {name}: brake, go, horn"]


@pytest.mark.slow
def test_what_carla_alone_does_not_do_of_actors_measures_and_parking_is_said(
    sample: Sample,
) -> None:
    scenario = read_scenario(sample(TOWN, seed=3))
    first, second, *others = scenario.actors
    measure = {"id": "slow", "kind": "speed_limit", "lanes": [first.spawn], "speed": 5.0}
    changed = scenario.model_copy(
        update={
            "actors": (
                first.model_copy(update={"crosses_anywhere": True, "ignores_red": True}),
                second.model_copy(update={"initial_speed": 5.0, "ignores_red": True}),
                *others,
            ),
            "measures": (SpeedLimit.model_construct(**measure),),
            "demand": scenario.demand.model_copy(update={"parking": TripParking(end=0.5)}),
        }
    )
    assert words_of(changed) == [
        f"CARLA alone does not do crosses_anywhere of {first.id}",
        f"CARLA alone does not do ignores_red of {first.id}, {second.id}",
        f"CARLA alone does not do initial_speed of {second.id}",
        "CARLA alone does not do measure slow (speed_limit)",
        "CARLA alone does not do parking at the begin and end of trips",
    ]


@pytest.mark.slow
def test_a_path_has_one_point_for_each_junction_outside_of_any(
    planned: Any, sample: Sample
) -> None:
    _, graph, actors = planned(sample(TOWN, seed=3))
    lanes = graph.lanes
    inside = np.array([lanes.lanes.junctions[row] is not None for row in lanes.lane])
    places = np.column_stack([lanes.x, lanes.y])
    passed = 0
    for actor in actors:
        for point in actor.path:
            at = np.hypot(*(places - point[:2]).T) < 1e-9
            assert not inside[at].all()
            passed += 1
    assert passed > 20


def run(*arguments: object) -> tuple[int, dict[str, Any], str]:
    done = subprocess.run(
        [sys.executable, "-m", "odscen", "cosim", *map(str, arguments), "--native", "--json"],
        capture_output=True,
        text=True,
        check=False,
        timeout=150,
    )
    return done.returncode, json.loads(done.stdout), done.stderr


def start(*arguments: object) -> subprocess.Popen[str]:
    command = [sys.executable, "-m", "odscen", "cosim", *map(str, arguments)]
    return subprocess.Popen([*command, "--native", "--json"], stdout=subprocess.PIPE, text=True)


def wait_for_actors(server: StandIn) -> None:
    deadline = time.monotonic() + 120.0
    while len(left(server)) < 10:
        assert time.monotonic() < deadline
        time.sleep(0.1)


def left(server: StandIn) -> list[str]:
    kinds = ("vehicle.", "walker.", "sensor.", "controller.")
    return [a["type_id"] for a in server.actors() if a["type_id"].startswith(kinds)]


@pytest.fixture
def options(workspace: Workspace, tmp_path: Path) -> Any:
    pytest.importorskip("carla", reason="co-simulation needs the package carla")

    def made(server: StandIn) -> tuple[object, ...]:
        return (
            "--carla", f"{server.host}:{server.port}", "--workspace", workspace.root,
            "--out", tmp_path / "runs", "--no-physics",
        )  # fmt: skip

    return made


@pytest.mark.parametrize("tick", [0.1, 0.02])
def test_without_physics_another_tick_than_the_managers_is_refused(tick: float) -> None:
    with pytest.raises(InputError, match=rf"a tick of {tick:g} s would change their speed"):
        NativeOptions(physics=False, tick=tick)


@pytest.mark.slow
def test_carla_drives_a_scenario_into_a_run_folder(options: Any, sample: Sample) -> None:
    path = sample(TOWN, seed=3, fill=0.1)
    with StandIn(TOWN) as server:
        code, told, _ = run(path, *options(server), "--until", 40)
        assert left(server) == []
    assert code == 0
    assert told["driven_by"] == "carla"
    counts = told["actors"]
    assert counts["planned"] > 5
    assert counts["inserted"] == counts["planned"]
    assert told["insertion_error_max"] < 0.01
    assert counts["arrived"] > 0
    table = pl.read_parquet(told["files"]["trajectories"])
    moved = table.group_by("vehicle_id").agg(
        (pl.col("vehicle_x").last() - pl.col("vehicle_x").first()).abs()
        + (pl.col("vehicle_y").last() - pl.col("vehicle_y").first()).abs()
    )
    assert moved["vehicle_x"].median() > 20.0
    assert Path(told["files"]["report"]).is_file()
    assert told["figures"]["mean_travel_time"] > 0.0
    assert told["figures"]["mean_delay"] is None, "only SUMO measures what was lost"
    assert not [note for note in told["carla"]["notes"] if "left its route" in note]


@pytest.mark.slow
def test_vehicles_go_the_way_of_the_plan_and_stop_at_its_end(
    options: Any, sample: Sample, planned: Any, tmp_path: Path
) -> None:
    """One car alone, over several junctions: nothing but its path decides where it goes."""
    path = sample(TOWN, seed=3, fill=0.1)
    scenario = read_scenario(path)
    cars = [a for a in planned(path)[2] if a.category == "car" and len(a.path) >= 3]
    chosen = max(cars, key=lambda car: len(car.route))
    actors = tuple(actor for actor in scenario.actors if actor.id == chosen.id)
    alone = tmp_path / "alone.scenario.json"
    alone.write_text(dumps(scenario.model_copy(update={"actors": actors, "flows": ()})))
    with StandIn(TOWN) as server:
        _, told, _ = run(alone, *options(server), "--until", 120)
    assert told["actors"]["arrived"] == 1
    table = pl.read_parquet(told["files"]["trajectories"]).select("vehicle_x", "vehicle_y")
    plan, _, [car] = planned(alone)
    places = table.to_numpy() - np.array(plan.net_offset)
    gaps = [math.dist(place, point) for place in places for point in [_nearest(car.route, place)]]
    # Front against centre is half a length; a turn and a change of lane cut corners.
    assert max(gaps) < 6.0


def _nearest(way: np.ndarray, place: np.ndarray) -> np.ndarray:
    return way[np.argmin(np.hypot(*(way[:, :2] - place).T)), :2]


@pytest.mark.slow
def test_a_server_that_dies_is_told_in_words_and_what_was_told_is_kept(
    options: Any, sample: Sample
) -> None:
    path = sample(CROSSING, seed=5)
    with StandIn(CROSSING, die_at_tick=100) as server:
        code, told, _ = run(path, *options(server), "--until", 60, "--timeout", 2)
    assert code == 3
    assert told["status"] == "failed"
    assert str(server.port) in told["error"]
    assert pl.read_parquet(told["files"]["trajectories"]).height > 100


@pytest.mark.slow
def test_a_server_that_stands_still_too_long_ends_the_run_and_is_given_back(
    options: Any, sample: Sample
) -> None:
    """The Traffic Manager or the tick ends it, whichever waits just then: by crash or by word."""
    path = sample(CROSSING, seed=5)
    with StandIn(CROSSING, freeze_at_tick=60, freeze_seconds=8.0) as server:
        code, told, _ = run(path, *options(server), "--until", 60, "--timeout", 2)
        assert left(server) == []
    assert code == 3
    assert told["status"] == "failed"
    assert not [note for note in told["carla"]["notes"] if "taken back" in note]


@pytest.mark.slow
def test_a_spawn_that_is_refused_comes_later(options: Any, sample: Sample) -> None:
    path = sample(CROSSING, seed=5)
    with StandIn(CROSSING, refuse_spawn_every=3) as server:
        code, told, _ = run(path, *options(server), "--until", 10)
    assert code == 0
    assert told["actors"]["inserted"] == told["actors"]["planned"]
    assert told["figures"]["depart_delay_max"] > 0.0


@pytest.mark.slow
def test_a_server_that_takes_nobody_ends_the_run(options: Any, sample: Sample) -> None:
    path = sample(CROSSING, seed=5)
    with StandIn(CROSSING, refuse_spawn_every=1) as server:
        code, told, _ = run(path, *options(server), "--until", 5)
        assert left(server) == []
    assert (code, told["status"]) == (3, "failed")
    assert "takes no road user" in told["error"]
    assert "collision" in told["error"]


@pytest.mark.slow
def test_another_client_that_ticks_ends_the_run(options: Any, sample: Sample) -> None:
    carla = pytest.importorskip("carla", reason="co-simulation needs the package carla")
    path = sample(CROSSING, seed=5)
    with StandIn(CROSSING) as server:
        process = start(path, *options(server), "--until", 60)
        wait_for_actors(server)
        other = carla.Client(server.host, server.port)
        other.set_timeout(5.0)
        other.get_world().tick()
        out, _ = process.communicate(timeout=180)
        assert left(server) == []
    told = json.loads(out)
    assert (process.returncode, told["status"]) == (3, "failed")
    assert "only one client may tick" in told["error"]


@pytest.mark.slow
def test_what_a_crashed_traffic_manager_leaves_is_taken_away(options: Any, sample: Sample) -> None:
    path = sample(CROSSING, seed=5)
    with StandIn(CROSSING) as server:
        process = start(path, *options(server))
        wait_for_actors(server)
        children = psutil.Process(process.pid).children()
        [worker] = [one for one in children if "spawn_main" in " ".join(one.cmdline())]
        worker.send_signal(signal.SIGABRT)
        out, _ = process.communicate(timeout=180)
        assert left(server) == []
    told = json.loads(out)
    assert process.returncode == 3
    assert "Traffic Manager has given up" in told["error"]


@pytest.mark.slow
def test_ctrl_c_keeps_what_there_is_and_gives_the_server_back(options: Any, sample: Sample) -> None:
    path = sample(CROSSING, seed=5)
    with StandIn(CROSSING) as server:
        process = start(path, *options(server))
        wait_for_actors(server)
        process.send_signal(signal.SIGINT)
        out, _ = process.communicate(timeout=180)
        assert left(server) == []
    told = json.loads(out)
    assert process.returncode == 130
    assert told["carla"]["interrupted"]
    assert told["stopped"]
    assert told["actors"]["inserted"] > 0
