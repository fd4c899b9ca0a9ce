"""Pedestrians who cross anywhere: straight over the road, seen by drivers, the same in slices."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from odscen.records.run_plan import Plan
from odscen.runs.run_settings import RunSettings
from odscen.sumo.realize.realization import realize
from odscen.sumo.runner.long_runs import resume
from odscen.sumo.runner.run_jobs import run_prepared
from tests.sumo.conftest import start_killed_workers
from tests.sumo.runner.test_long_runs import results
from tests.sumo.story_case import (
    Told,
    document,
    loaded,
    node_at,
    prepared,
    read,
    run,
    walk_node_at,
)

if TYPE_CHECKING:
    from pathlib import Path

TOWN = "town_5x5"
NEAR, FAR = 100.5, 109.5
"""y of the sidewalks of a street that leads east; its lanes are between 101.7 and 108.3."""


def walker(spawn: float = 250.0, goal: float = 290.0, **fields: Any) -> dict[str, Any]:
    return {
        "id": "anna", "category": "pedestrian", "spawn": walk_node_at(TOWN, spawn, NEAR),
        "goal": walk_node_at(TOWN, goal, FAR), "crosses_anywhere": True,
    } | fields  # fmt: skip


def story_of(*actors: dict[str, Any], rules: Any = (), **settings: Any) -> str | None:
    scenario = document(TOWN, list(actors), list(rules), step=0.5)
    made = realize(scenario, loaded(TOWN).sumo, settings=RunSettings(**settings))
    return made.files.get("story.json")


def on_the_road(found: Told) -> np.ndarray:
    track = found.tracks["anna"]
    return (track.y > 102.0) & (track.y < 108.0)


@pytest.mark.slow
@pytest.mark.parametrize("step", [0.1, 0.5, 1.0])
def test_it_walks_straight_to_the_opposite_sidewalk_and_on_to_its_goal(
    tmp_path: Path, step: float
) -> None:
    found = run(document(TOWN, [walker()], [], step=step, until=120.0), tmp_path / "run")
    track, over = found.tracks["anna"], on_the_road(found)
    assert [e.kind for e in found.events if e.rule is None] == ["departed", "arrived"]
    assert [e.kind for e in found.events if e.rule == "anna.crosses"] == [
        "rule_started",
        "rule_ended",
    ]
    assert np.ptp(track.x[over]) < 2.0
    assert track.x[over].max() < 254.0
    end = track.x[-1], track.y[-1]
    assert np.hypot(end[0] - 290.0, end[1] - FAR) < 3.0
    planned = Plan.from_json((tmp_path / "run" / "plan.json").read_text()).actors[0]
    assert planned.route_length == pytest.approx(9.0 + 40.0, abs=3.0)
    assert track.travelled[-1] == pytest.approx(planned.route_length, abs=4.0)


@pytest.mark.slow
def test_without_it_the_crosswalk_is_used_and_nothing_is_different(tmp_path: Path) -> None:
    usual = walker(crosses_anywhere=False)
    assert story_of(usual) is None
    found = run(document(TOWN, [usual], [], step=0.5, until=300.0), tmp_path / "run")
    track, over = found.tracks["anna"], on_the_road(found)
    assert not ((track.x[over] > 225.0) & (track.x[over] < 300.0)).any()
    assert track.travelled[-1] > 65.0


def test_one_who_stays_on_its_side_does_not_cross() -> None:
    assert story_of(walker(goal=280.0) | {"goal": walk_node_at(TOWN, 280.0, NEAR)}) is None


@pytest.mark.slow
def test_places_on_the_way_are_passed_before_it_crosses(tmp_path: Path) -> None:
    past = walker(via=[walk_node_at(TOWN, 270.0, NEAR)])
    found = run(document(TOWN, [past], [], step=0.5, until=120.0), tmp_path / "run")
    track, over = found.tracks["anna"], on_the_road(found)
    assert track.x[over].min() > 266.0
    assert np.ptp(track.x[over]) < 2.5


def test_meso_and_rules_of_the_same_name_are_no_obstacle() -> None:
    assert story_of(walker(), meso=True) is None
    rule = {"id": "anna.crosses", "actor": "anna", "when": {"time": {"after": 90}},
            "then": [{"stop": {}}]}  # fmt: skip
    story = story_of(walker(), rules=[rule]) or ""
    assert '"id": "anna.crosses"' in story
    assert '"id": "anna.crosses_"' in story


@pytest.mark.slow
def test_a_driver_brakes_for_it(tmp_path: Path) -> None:
    ego = {
        "id": "ego", "category": "car", "spawn": node_at(TOWN, 228.0, 103.4), "ego": True,
        "goal": node_at(TOWN, 390.0, 103.4), "initial_speed": 8.0,
    }  # fmt: skip
    slow = walker(spawn=262.0, speed=1.0, depart=1.0)
    found = run(document(TOWN, [ego, slow], [], step=0.1, until=60.0), tmp_path / "run")
    car, over = found.tracks["ego"], on_the_road(found)
    seconds = found.tracks["anna"].time[over]
    during = (car.time >= seconds.min()) & (car.time <= seconds.max())
    assert car.speed[during].min() < 1.0
    assert not [e for e in found.events if "collision" in e.kind or "contact" in e.kind]
    assert car.speed[-1] > 5.0 or [e for e in found.events if e.kind == "arrived"]


@pytest.mark.slow
@pytest.mark.parametrize("number", [1, 2, 3])
def test_killed_on_the_road_and_resumed_it_ends_with_the_same_bytes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, number: int
) -> None:
    def sliced() -> Any:
        scenario = document(TOWN, [walker(speed=1.2)], [], step=0.5, until=24.0)
        return prepared(scenario, slice_length=4.0)

    alone, cut = tmp_path / "alone", tmp_path / "cut"
    assert run_prepared(sliced(), alone).status == "completed"
    with monkeypatch.context() as patch:
        start_killed_workers(patch)
        patch.setenv("KILL_AFTER_SLICE", str(number))
        assert run_prepared(sliced(), cut).status == "failed"
    assert resume(cut).status == "completed"
    assert results(cut) == results(alone)
    assert on_the_road(read(alone)).any()


IN_THE_ROAD = [
    (kind, ahead, speed, step)
    for step in (0.1, 0.5)
    for kind, ahead, speed in (
        ("stands", 25.0, 6.0),
        ("stands", 35.0, 8.0),
        ("stands", 45.0, 10.0),
        ("stands", 55.0, 12.0),
        ("stands", 75.0, 13.5),
        ("crosses", 35.0, 8.0),
        ("crosses", 45.0, 10.0),
        ("crosses", 55.0, 11.0),
        ("walks along", 25.0, 6.0),
        ("walks along", 35.0, 8.0),
    )
]


def meet_in_the_road(
    folder: Path, kind: str, ahead: float, speed: float, step: float, forced: Any = None
) -> Told:
    """Somebody steps into the ego's lane some metres ahead of it, and stays or walks there."""
    y, x = 103.4, 228.0 + ahead
    then = {
        "stands": {"walk": {"to": [x, y], "speed": 2.5}},
        "crosses": {"walk": {"to": [x, 106.6], "speed": 1.0}},
        "walks along": {"walk": {"to": [278.0, y], "through": [[x, y]], "speed": 2.0}},
    }[kind]
    ego = {
        "id": "ego", "category": "car", "spawn": node_at(TOWN, 228.0, y), "ego": True,
        "goal": node_at(TOWN, 390.0, y), "initial_speed": speed,
    }  # fmt: skip
    anna = walker(x) | {"crosses_anywhere": False, "goal": walk_node_at(TOWN, x + 20.0, NEAR)}
    start = {"time": {"after": step}}
    rules = [{"id": "steps", "actor": "anna", "when": start, "then": [then]}]
    if forced is not None:
        rules.append({"id": "forced", "actor": "ego", "when": start, "then": [forced]})
    return run(document(TOWN, [ego, anna], rules, step=step, until=25.0), folder)


@pytest.mark.slow
@pytest.mark.parametrize(("kind", "ahead", "speed", "step"), IN_THE_ROAD)
def test_the_ego_stops_for_a_person_in_the_road(
    tmp_path: Path, kind: str, ahead: float, speed: float, step: float
) -> None:
    found = meet_in_the_road(tmp_path / "run", kind, ahead, speed, step)
    car, anna = found.tracks["ego"], found.tracks["anna"]
    assert not [e for e in found.events if "collision" in e.kind or "contact" in e.kind]
    assert car.speed.min() < 0.1
    beside = np.abs(np.interp(car.time, anna.time, anna.y) - car.y) < 0.9 + 0.25
    metres = (np.interp(car.time, anna.time, anna.x) - car.x)[beside]
    assert metres.min() > 1.0  # of free road before the person


@pytest.mark.slow
@pytest.mark.parametrize("step", [0.1, 0.5])
def test_the_ego_does_not_stop_where_a_rule_forces_it_to_drive(tmp_path: Path, step: float) -> None:
    forced = {"speed": {"to": 12.0, "over": 10.0}}
    found = meet_in_the_road(tmp_path / "run", "stands", 35.0, 8.0, step, forced)
    assert found.tracks["ego"].speed.min() >= 8.0
    assert [e.kind for e in found.events if "anna" in (e.actor, e.partner)].count("collision") == 1
