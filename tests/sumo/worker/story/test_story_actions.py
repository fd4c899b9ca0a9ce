"""Rules that cut in, follow paths, replay, appear, go elsewhere, switch lights: by trajectories."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from odscen.figures.measures.latent_delay import due, latent_delay
from odscen.figures.measures.summary import actors_from_json
from odscen.lanegraph.query import node_id, node_index, walk_node_index
from tests.sumo.story_case import (
    LEFT,
    MIDDLE,
    RIGHT,
    document,
    loaded,
    node_at,
    run,
    walk_node_at,
)
from tests.sumo.worker.story.test_story_run import MOTORWAY, STEPS, TOWN, after, fast

if TYPE_CHECKING:
    from pathlib import Path

    from tests.sumo.story_case import Told, Track


def along(track: Track, time: float) -> float:
    return float(np.interp(time, track.time, track.x))


def kinds(found: Told, rule: str) -> list[str]:
    return [str(one.kind) for one in found.events if one.rule == rule]


@pytest.mark.slow
@pytest.mark.parametrize("step", STEPS)
@pytest.mark.parametrize("gap", [8.0, 20.0])
def test_a_cut_in_ends_in_the_lane_of_the_other_with_the_gap_that_was_asked_for(
    tmp_path: Path, gap: float, step: float
) -> None:
    actors = [fast("ego", 370.0, MIDDLE, ego=True), fast("van", 390.0, RIGHT, 21.0)]
    rules = [after(1.23, {"cut_in": {"to": "ego", "gap": gap, "over": 3.0}})]
    found = run(document(MOTORWAY, actors, rules, step=step), tmp_path / "run")
    end = found.instant("r", "ended")
    assert end == pytest.approx(4.23, abs=1e-6)
    ego, van = found.tracks["ego"], found.tracks["van"]
    # The ego keeps its speed until someone is in its lane; what it does then is SUMO's.
    before = 1.23 + 1.5
    ego_end = along(ego, before) + 20.0 * (end - before)
    if along(ego, end) == pytest.approx(ego_end, abs=0.05):
        assert along(van, end) - van.length - along(ego, end) == pytest.approx(gap, abs=0.1)
    share = np.clip((van.time - 1.23) / 3.0, 0.0, 1.0)
    wanted = RIGHT + (MIDDLE - RIGHT) * (1.0 - np.cos(np.pi * share)) / 2.0
    assert van.y[van.time < end] == pytest.approx(wanted[van.time < end], abs=0.05)


@pytest.mark.slow
def test_a_gap_that_cannot_be_reached_in_time_is_said(tmp_path: Path) -> None:
    actors = [fast("ego", 500.0, MIDDLE, ego=True), fast("van", 370.0, RIGHT)]
    rules = [after(1.0, {"cut_in": {"to": "ego", "gap": 10.0, "over": 1.0}})]
    found = run(document(MOTORWAY, actors, rules), tmp_path / "run")
    [event] = found.of_rule("r", "failed")
    assert "for a gap of 10 m in time" in (event.detail or "")


@pytest.mark.slow
def test_a_lane_is_named_by_a_place_that_it_leads_to(tmp_path: Path) -> None:
    there = node_at(MOTORWAY, 600.0, LEFT)
    rules = [after(1.0, {"lane": {"to": there, "over": 4.0}})]
    found = run(document(MOTORWAY, [fast("van", 370.0, RIGHT)], rules), tmp_path / "run")
    van = found.tracks["van"]
    assert van.y[van.time > 5.1][:20] == pytest.approx(LEFT, abs=0.05)
    rules = [after(1.0, {"lane": {"to": [600.0, 300.0]}})]
    found = run(document(MOTORWAY, [fast("van", 370.0, RIGHT)], rules), tmp_path / "far")
    [event] = found.of_rule("r", "failed")
    assert event.detail == "none of the lanes beside it leads to the place"


@pytest.mark.slow
@pytest.mark.parametrize("step", STEPS)
def test_a_path_is_followed_to_the_times_of_its_points(tmp_path: Path, step: float) -> None:
    points = [[430.0, RIGHT + 1.0], [470.0, MIDDLE], [520.0, MIDDLE]]
    rules = [after(1.23, {"path": {"points": points, "times": [2.0, 4.5, 7.0]}})]
    actors = [fast("van", 370.0, RIGHT)]
    found = run(document(MOTORWAY, actors, rules, step=step), tmp_path / "run")
    van = found.tracks["van"]
    assert found.instant("r", "ended") == pytest.approx(8.23, abs=1e-6)
    begin = (along(van, 0.0) + 1.23 * 20.0, RIGHT)
    knots = [(1.23, begin), *zip((3.23, 5.73, 8.23), points, strict=True)]
    inside = van.time[(van.time >= 1.23) & (van.time <= 8.23)]
    for k, value in ((0, van.x), (1, van.y)):
        wanted = np.interp(inside, [t for t, _ in knots], [p[k] for _, p in knots])
        got = np.interp(inside, van.time, value)
        assert got == pytest.approx(wanted, abs=0.05)
    assert van.x[-1] > 600.0, "SUMO leads it on"


@pytest.mark.slow
@pytest.mark.parametrize("step", STEPS)
def test_speeds_at_the_points_of_a_path_change_evenly(tmp_path: Path, step: float) -> None:
    rules = [after(1.0, {"path": {"points": [[450.0, MIDDLE], [500.0, MIDDLE]],
                                  "speeds": [10.0, 15.0]}})]  # fmt: skip
    found = run(document(MOTORWAY, [fast("van", 370.0, MIDDLE)], rules, step=step), tmp_path / "r")
    van = found.tracks["van"]
    first = 450.0 - (along(van, 0.0) + 20.0)
    ends = 1.0 + first / 15.0 + 50.0 / 12.5
    assert found.instant("r", "ended") == pytest.approx(ends, abs=0.01)
    assert float(np.interp(1.0 + first / 15.0, van.time, van.x)) == pytest.approx(450.0, abs=0.3)
    assert along(van, ends) == pytest.approx(500.0, abs=0.3)


@pytest.mark.slow
def test_a_path_off_the_route_is_followed_and_sumo_leads_back_to_the_goal(tmp_path: Path) -> None:
    van = {
        "id": "van", "category": "car", "spawn": node_at(TOWN, 215.0, 103.4),
        "goal": node_at(TOWN, 390.0, 103.4), "initial_speed": 8.0,
    }  # fmt: skip
    rules = [
        after(1.0, {"path": {"points": [[240.0, 104.5], [250.0, 102.0], [262.0, 103.4]],
                             "speed": 8.0}})
    ]  # fmt: skip
    found = run(document(TOWN, [van], rules, until=60.0), tmp_path / "run")
    track = found.tracks["van"]
    middle = np.argmin(np.abs(track.x - 250.0))
    assert track.y[middle] == pytest.approx(102.0, abs=0.2)
    assert track.x[-1] > 385.0


@pytest.mark.slow
def test_where_no_route_leads_on_from_the_end_of_a_path_that_is_said(tmp_path: Path) -> None:
    rules = [after(1.0, {"path": {"points": [[500.0, 300.0]], "speed": 20.0}})]
    found = run(document(MOTORWAY, [fast("van", 370.0, MIDDLE)], rules), tmp_path / "run")
    van = found.tracks["van"]
    begin, end = along(van, 1.0), found.instant("r", "ended")
    length = math.dist((begin, MIDDLE), (500.0, 300.0))
    assert end == pytest.approx(1.0 + length / 20.0, abs=0.01)
    middle = (begin + 500.0) / 2.0, (MIDDLE + 300.0) / 2.0
    assert van.at(1.0 + length / 40.0) == pytest.approx(middle, abs=0.05)
    [event] = [one for one in found.events if one.kind == "rule_failed"]
    assert event.detail == "no route leads from where it is to its goal"


@pytest.mark.slow
def test_a_walker_follows_a_path_across_the_road(tmp_path: Path) -> None:
    child = {
        "id": "child", "category": "pedestrian", "spawn": walk_node_at(TOWN, 270.0, 100.5),
        "goal": walk_node_at(TOWN, 240.0, 109.5),
    }  # fmt: skip
    far = walk_node_at(TOWN, 270.0, 109.5)
    path = {"points": [[272.0, 103.0], far], "times": [2.0, 5.0]}
    rules = [after(1.0, {"path": path}, actor="child")]
    found = run(document(TOWN, [child], rules, until=15.0), tmp_path / "run")
    track = found.tracks["child"]
    assert track.centre(3.0) == pytest.approx((272.0, 103.0), abs=0.05)
    row = walk_node_index(loaded(TOWN).sumo.graph, far)
    walks = loaded(TOWN).sumo.graph.walks
    assert track.centre(6.0) == pytest.approx((walks.x[row], walks.y[row]), abs=0.05)


def recorded(track: Track, begin: float, end: float) -> list[list[float]]:
    inside = track.time[(track.time >= begin - 1e-9) & (track.time <= end + 1e-9)]
    headings = np.unwrap(track.hdg)
    return [
        [round(t - begin, 6), *track.centre(t), float(np.interp(t, track.time, headings))]
        for t in map(float, inside)
    ]


@pytest.mark.slow
@pytest.mark.parametrize("step", STEPS)
def test_a_recorded_trajectory_is_replayed_exactly_and_traffic_reacts(
    tmp_path: Path, step: float
) -> None:
    then = ({"lane": {"by": 1, "over": 3.0}}, {"brake": {"by": 5.0}})
    first = run(
        document(MOTORWAY, [fast("van", 420.0, RIGHT)], [after(1.0, *then)], step=0.1),
        tmp_path / "first",
    ).tracks["van"]
    rows = recorded(first, 1.0, 12.0)
    actors = [fast("van", 420.0, RIGHT), fast("other", 350.0, MIDDLE)]
    rules = [after(1.0, {"replay": {"rows": rows}}), after(2.0, {"horn": {}}, name="h")]
    found = run(document(MOTORWAY, actors, rules, step=step), tmp_path / "again")
    van, other = found.tracks["van"], found.tracks["other"]
    for t in van.time[(van.time >= 1.0 + step) & (van.time <= 12.0)]:
        assert van.centre(float(t)) == pytest.approx(first.centre(float(t)), abs=0.05)
    assert found.instant("r", "ended") == pytest.approx(12.0, abs=1e-6)
    assert other.speed[other.time > 11.0][0] < 6.0, "it brakes behind"
    assert along(van, 11.9) - van.length > along(other, 11.9)
    assert not [one for one in found.events if one.kind == "collision"]


@pytest.mark.slow
@pytest.mark.parametrize("step", STEPS)
def test_an_actor_appears_when_a_rule_says_so_where_it_says(tmp_path: Path, step: float) -> None:
    actors = [fast("ego", 370.0, MIDDLE, 10.0, ego=True), fast("van", 460.0, RIGHT)]
    at = [430.0, LEFT + 0.5, 0.1]
    rules = [
        after(3.0, {"appear": {"at": at, "speed": 15.0}}, {"speed": {"to": 12.0, "rate": 2.0}})
    ]
    found = run(document(MOTORWAY, actors, rules, step=step), tmp_path / "run")
    van = found.tracks["van"]
    assert van.time[0] == pytest.approx(3.0 + step)
    assert van.centre(float(van.time[0])) == pytest.approx(at[:2], abs=0.02)
    assert van.speed[0] == pytest.approx(15.0, abs=0.01)
    assert kinds(found, "r") == ["rule_started", "rule_acted", "rule_ended"]
    assert found.instant("r", "ended") == pytest.approx(3.0 + step + 1.5, abs=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize("step", STEPS)
def test_whom_the_story_drives_has_driven_on_since_it_appeared(tmp_path: Path, step: float) -> None:
    actors = [
        fast("ego", 370.0, MIDDLE, 10.0, ego=True),
        fast("van", 460.0, RIGHT, driver="story"),
    ]
    rules = [after(3.0, {"appear": {"at": [430.0, LEFT, 0.0], "speed": 15.0}})]
    van = run(document(MOTORWAY, actors, rules, step=step), tmp_path / "run").tracks["van"]
    assert van.time[0] == pytest.approx(3.0 + step)
    x = np.array([van.centre(float(time))[0] for time in van.time])
    assert x == pytest.approx(430.0 + 15.0 * (van.time - 3.0), abs=0.02)


@pytest.mark.slow
def test_a_run_waits_for_whom_a_rule_lets_appear(tmp_path: Path) -> None:
    actors = [
        fast("van", 860.0, MIDDLE, depart=0.0),
        {"id": "child", "category": "car", "spawn": node_at(MOTORWAY, 800.0, RIGHT),
         "goal": node_at(MOTORWAY, 900.0, RIGHT)},
    ]  # fmt: skip
    rules = [after(9.0, {"appear": {}}, actor="child")]
    found = run(document(MOTORWAY, actors, rules, until=40.0), tmp_path / "run")
    assert found.tracks["van"].time[-1] < 8.0
    assert found.tracks["child"].time[0] == pytest.approx(9.1)
    assert [one.actor for one in found.events if one.kind == "arrived"] == ["van", "child"]


@pytest.mark.slow
@pytest.mark.parametrize(("when", "appears"), [(9.0, True), (90.0, False)])
def test_whoever_appears_by_a_rule_waits_for_no_room_before(
    tmp_path: Path, when: float, appears: bool
) -> None:
    actors = [
        fast("van", 370.0, MIDDLE),
        {"id": "late", "category": "car", "spawn": node_at(MOTORWAY, 800.0, RIGHT),
         "goal": node_at(MOTORWAY, 900.0, RIGHT)},
    ]  # fmt: skip
    rules = [after(when, {"appear": {}}, actor="late")]
    run(document(MOTORWAY, actors, rules, until=40.0), tmp_path / "run")
    rows = actors_from_json((tmp_path / "run" / "actors.json").read_text())
    late = next(one for one in rows if one.id == "late")
    assert (late.depart, late.depart_delay) == ((9.1, 0.0) if appears else (40.0, None))
    assert {one.id for one in due(rows, 40.0)} == ({"van", "late"} if appears else {"van"})
    assert latent_delay(late, 40.0) == 0.0


@pytest.mark.slow
def test_a_child_appears_on_its_sidewalk_and_walks(tmp_path: Path) -> None:
    spawn = walk_node_at(TOWN, 270.0, 100.5)
    child = {
        "id": "child", "category": "pedestrian", "spawn": spawn,
        "goal": walk_node_at(TOWN, 240.0, 109.5),
    }  # fmt: skip
    rules = [after(2.0, {"appear": {}}, actor="child")]
    found = run(document(TOWN, [child], rules, until=10.0), tmp_path / "run")
    track = found.tracks["child"]
    assert track.time[0] == pytest.approx(2.1)
    assert track.centre(2.1) == pytest.approx((270.0, 100.5), abs=1.5)
    assert track.travelled[-1] > 5.0


@pytest.mark.slow
def test_a_new_goal_is_where_the_trip_then_ends(tmp_path: Path) -> None:
    goal = node_at(MOTORWAY, 640.0, MIDDLE)
    rules = [after(2.0, {"goal": {"to": goal}})]
    found = run(document(MOTORWAY, [fast("van", 370.0, MIDDLE)], rules, until=40.0), tmp_path / "a")
    graph = loaded(MOTORWAY).sumo.graph
    x = float(graph.lanes.x[node_index(graph, goal)])
    assert found.tracks["van"].centre(99.0)[0] == pytest.approx(x, abs=2.1)
    [arrived] = [one for one in found.events if one.kind == "arrived"]
    assert arrived.actor == "van"
    assert [one.detail for one in found.of_rule("r", "acted")] == [f"goal {goal}"]


@pytest.mark.slow
def test_a_walker_goes_to_its_new_goal(tmp_path: Path) -> None:
    goal = walk_node_at(TOWN, 300.0, 100.5)
    child = {
        "id": "child", "category": "pedestrian", "spawn": walk_node_at(TOWN, 270.0, 100.5),
        "goal": walk_node_at(TOWN, 240.0, 100.5),
    }  # fmt: skip
    rules = [after(5.0, {"goal": {"to": goal}}, actor="child")]
    found = run(document(TOWN, [child], rules, until=60.0), tmp_path / "run")
    track = found.tracks["child"]
    assert track.x.min() == pytest.approx(270.0 - 5.0 * 1.4, abs=1.5)
    assert track.x[-1] == pytest.approx(300.0, abs=1.5)
    assert [one.actor for one in found.events if one.kind == "arrived"] == ["child"]


def waiting_at_red() -> tuple[dict[str, Any], dict[str, Any]]:
    """A car before a red light, and its movement."""
    made_on = loaded("signal_crossing")
    light, graph = made_on.lights[0], made_on.sumo.graph
    keys = list(map(str, graph.lanes.lanes.keys))
    state = made_on.sumo.lights[0].phases[0].state
    movement = next(
        one
        for one, letter in zip(light.movements, state, strict=True)
        if one.turn == "straight" and one.lanes[0] in keys and letter == "r"
    )
    last = int(graph.lanes.lanes.first_node[keys.index(movement.lanes[0]) + 1]) - 1
    car = {"id": "van", "category": "car", "spawn": node_id(graph, last - 10)}
    return car, {"light": light.names[0], "movement": movement.name}


@pytest.mark.slow
@pytest.mark.parametrize("shows", ["green", "off"])
def test_a_rule_switches_a_light_and_the_car_at_red_goes(tmp_path: Path, shows: str) -> None:
    car, movement = waiting_at_red()
    name = "signal_crossing"
    waits = run(document(name, [car], [after(0.0, {"release": {}})], until=90.0), tmp_path / "a")
    asked = movement if shows == "green" else {"light": movement["light"], "shows": "off"}
    rules = [after(6.0, {"signal": asked})]
    goes = run(document(name, [car], rules, until=90.0), tmp_path / "b")
    slow, fast_ = (float(told.tracks["van"].time[-1]) for told in (waits, goes))
    assert fast_ < slow - 8.0
    [said] = goes.of_rule("r", "acted")
    assert said.detail is not None
    assert said.detail.startswith(f"light {movement['light']}:")
    assert said.detail.endswith(shows)


@pytest.mark.slow
def test_a_light_that_was_off_shows_its_program_again(tmp_path: Path) -> None:
    car, movement = waiting_at_red()
    off, on = ({"light": movement["light"], "shows": one} for one in ("off", "program"))
    shown = {"signal": {**movement, "shows": "red"}}
    rules = [
        after(0.0, {"signal": off}, name="off"),
        {"id": "on", "actor": "van", "when": {"time": {"after": 2.0}}, "then": [{"signal": on}]},
        {"id": "red", "actor": "van", "when": {"all": [{"rule": {"id": "on"}}, shown]},
         "then": [{"release": {}}]},
    ]  # fmt: skip
    found = run(document("signal_crossing", [car], rules, until=30.0), tmp_path / "run")
    assert found.instant("red") == pytest.approx(2.1, abs=0.11)


@pytest.mark.slow
def test_lights_and_horn_are_reported(tmp_path: Path) -> None:
    rules = [
        after(1.0, {"lights": {"indicator": "left", "high_beam": True}}, {"horn": {}}),
        after(3.0, {"lights": {}}, name="off"),
    ]
    found = run(document(MOTORWAY, [fast("van", 370.0, MIDDLE)], rules), tmp_path / "run")
    said = [(one.time, one.detail) for one in found.events if one.kind == "rule_acted"]
    assert said == [
        (1.0, "lights: left, high_beam"),
        (1.0, "horn"),
        (3.0, "lights: the driver's"),
    ]
    assert math.isfinite(said[0][0])


@pytest.mark.slow
def test_what_is_to_appear_beside_all_lanes_appears_where_it_is_placed_with_a_word(
    tmp_path: Path,
) -> None:
    place = [500.0, MIDDLE - 12.0, 0.0]
    rows = [[0.0, *place], [1.0, *place]]
    then = [{"appear": {"at": place}}, {"replay": {"rows": rows}}]
    rule = {"id": "r", "actor": "van", "when": {"time": {"after": 1.0}}, "then": then}
    van = {
        "id": "van", "category": "car", "spawn": node_at(MOTORWAY, 370.0, MIDDLE),
        "goal": node_at(MOTORWAY, 900.0, MIDDLE),
    }  # fmt: skip
    found = run(document(MOTORWAY, [van], [rule], until=4.0), tmp_path / "run")
    [said] = [one for one in found.events if one.kind == "rule_failed"]
    assert said.detail is not None
    assert said.detail.startswith("it appears where it is placed, as 500, ")
    first = found.tracks["van"]
    assert first.centre(float(first.time[0]))[0] == pytest.approx(370.0, abs=3.0)


@pytest.mark.parametrize("backwards", [False, True])
def test_the_point_behind_the_front_is_on_the_path_and_its_speed_is_that_of_the_point(
    tmp_path: Path, backwards: bool
) -> None:
    # A quarter of a circle of 12 m, as a line of steps of 1 degree, to the left of the direction.
    way = -1.0 if backwards else 1.0
    begin = 372.0 - way * 5.0
    turns = np.radians(np.arange(1.0, 91.0))
    circle = [
        (begin + way * 12.0 * math.sin(a), MIDDLE + 12.0 * (1.0 - math.cos(a))) for a in turns
    ]
    path = {"points": [[begin, MIDDLE], *map(list, circle)], "behind": 3.5, "backwards": backwards,
            "speed": 5.0}  # fmt: skip
    actors = [fast("van", 370.0, MIDDLE, 5.0, driver="story")]
    found = run(document(MOTORWAY, actors, [after(0.0, {"path": path})], step=0.1), tmp_path / "r")
    van, end = found.tracks["van"], found.instant("r", "ended")
    inside = (van.time > 2.0) & (van.time < end)
    x, y, hdg = van.x[inside], van.y[inside], van.hdg[inside]
    point_x, point_y = x - 3.5 * np.cos(hdg), y - 3.5 * np.sin(hdg)
    away = np.hypot(point_x - begin, point_y - (MIDDLE + 12.0))
    assert len(away) > 15
    assert away == pytest.approx(12.0, abs=0.01)
    # It heads along the tangent, or against it.
    turned = np.arctan2(way * (point_x - begin), MIDDLE + 12.0 - point_y)
    wanted = turned if not backwards else -turned
    assert np.cos(hdg - wanted).min() > math.cos(math.radians(1.0))
    # The point goes at 5 m/s, the front faster.
    arcs = 12.0 * turned
    assert np.diff(arcs) / np.diff(van.time[inside]) == pytest.approx(5.0, abs=0.1)


@pytest.mark.slow
def test_a_van_without_a_goal_goes_on_along_the_lane_into_which_it_has_cut(tmp_path: Path) -> None:
    """The goal drawn for it is to the left of where it ends up; it stopped for a gap back there."""
    name, west = "signal_crossing", math.pi
    spawns = {
        "van": node_at(name, 120.0, 0.0, hdg=west),
        "ego": node_at(name, 140.0, 3.25, hdg=west),
    }
    actors = [
        {
            "id": one, "category": "van", "spawn": spawn, "speed": speed, "initial_speed": speed,
        } for (one, spawn), speed in zip(spawns.items(), (3.5, 7.0), strict=True)
    ]  # fmt: skip
    actors[1]["goal"] = node_at(name, -146.0, 3.25, hdg=west)
    rules = [after(1.0, {"cut_in": {"to": "ego", "over": 3.0}})]
    found = run(document(name, actors, rules), tmp_path / "run")
    assert found.tracks["van"].travelled[-1] == pytest.approx(3.5 * 20.0, abs=1.0)
