"""Actions of rules in SUMO: positions, speeds and instants, from the recorded trajectories."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from odscen.lanegraph.query import node_id, node_index, walk_node_index
from tests.sumo.story_case import (
    LEFT,
    MIDDLE,
    RIGHT,
    Told,
    document,
    loaded,
    node_at,
    prepared,
    run,
    told,
    walk_node_at,
)

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

STEPS = (pytest.param(0.05, marks=pytest.mark.slow), 0.1, pytest.param(0.5, marks=pytest.mark.slow))
MOTORWAY, TOWN = "motorway_weave", "town_5x5"


def car(name: str, x: float, y: float, **fields: Any) -> dict[str, Any]:
    """A car on the straight carriageway, its body's centre about at x."""
    fields = {"category": "car", "goal": node_at(MOTORWAY, 900.0, MIDDLE)} | fields
    return {"id": name, "spawn": node_at(MOTORWAY, x, y), **fields}


def fast(name: str, x: float, y: float, speed: float = 20.0, **fields: Any) -> dict[str, Any]:
    return car(name, x, y, initial_speed=speed, speed=speed, **fields)


def after(seconds: float, *then: dict[str, Any], actor: str = "van", name: str = "r") -> Any:
    when = {"time": {"after": seconds}}
    return {"id": name, "actor": actor, "when": when, "then": list(then)}


def alone(folder: Path, *then: dict[str, Any], step: float, speed: float = 20.0) -> Told:
    """A van at 20 m/s on an empty road, which acts after 1.23 s."""
    actors = [fast("van", 370.0, MIDDLE, speed)]
    return run(document(MOTORWAY, actors, [after(1.23, *then)], step=step), folder)


@pytest.mark.slow
@pytest.mark.parametrize("step", STEPS)
def test_braking_at_6_from_20_stops_after_33_m_whatever_the_vehicle_type_allows(
    tmp_path: Path, step: float
) -> None:
    found = alone(tmp_path / "run", {"brake": {"by": 6.0, "hold": 2.0}}, step=step)
    van = found.tracks["van"]
    start = van.x[0] + 1.23 * 20.0
    stood = van.x[van.time > 1.23 + 20.0 / 6.0 + 0.5][0]
    assert stood - start == pytest.approx(20.0**2 / 12.0, abs=0.05)
    assert found.instant("r", "ended") == pytest.approx(1.23 + 20.0 / 6.0 + 2.0, abs=1e-6)
    inside = (van.time > 1.23 + step + 0.01) & (van.time < 4.5)
    falling = np.diff(van.speed[inside]) / step
    assert falling == pytest.approx(-6.0, abs=0.01)
    assert van.x[-1] > stood + 10.0


@pytest.mark.slow
@pytest.mark.parametrize("step", STEPS)
@pytest.mark.parametrize(
    ("change", "seconds", "metres"),
    [
        ({"to": 10.0, "rate": 4.0}, 2.5, 37.5),
        ({"to": 10.0, "over": 3.0}, 3.0, 45.0),
        ({"to": 10.0, "within": 60.0}, 4.0, 60.0),
        ({"to": 10.0, "over": 3.0, "shape": "cosine"}, 3.0, 45.0),
        ({"to": 10.0, "rate": 4.0, "shape": "cosine"}, 2.5 * math.pi / 2, 37.5 * math.pi / 2),
        ({"to": 10.0, "rate": 4.0, "shape": "cubic"}, 2.5 * 1.5, 37.5 * 1.5),
        ({"to": 24.0, "over": 2.0}, 2.0, 44.0),
        ({"to": 10.0, "shape": "step"}, 0.0, 0.0),
    ],
)
def test_a_change_of_speed_takes_its_time_and_its_metres(
    tmp_path: Path, change: dict[str, Any], seconds: float, metres: float, step: float
) -> None:
    found = alone(tmp_path / "run", {"speed": change}, step=step)
    van, end = found.tracks["van"], found.instant("r", "ended")
    assert end == pytest.approx(1.23 + seconds, abs=1e-6)
    later = end + 2.0
    there = float(np.interp(later, van.time, van.x))
    assert there - van.x[0] == pytest.approx(1.23 * 20.0 + metres + 2.0 * change["to"], abs=0.05)
    assert van.speed[van.time > end + step] == pytest.approx(change["to"], abs=0.01)


@pytest.mark.slow
@pytest.mark.parametrize("step", STEPS)
def test_a_stop_is_after_so_many_metres_and_lasts_until_go(tmp_path: Path, step: float) -> None:
    rules = [after(1.23, {"stop": {"within": 50.0}}), after(9.0, {"go": {}}, name="on")]
    actors = [fast("van", 370.0, MIDDLE)]
    found = run(document(MOTORWAY, actors, rules, step=step), tmp_path / "run")
    van = found.tracks["van"]
    assert found.instant("r", "ended") == pytest.approx(1.23 + 5.0, abs=1e-6)
    stood = van.x[(van.time > 6.8) & (van.time <= 9.0)]
    assert stood - van.x[0] == pytest.approx(1.23 * 20.0 + 50.0, abs=0.05)
    assert van.speed[-1] > 15.0


@pytest.mark.slow
@pytest.mark.parametrize("step", STEPS)
@pytest.mark.parametrize(("y", "by", "to"), [(RIGHT, 1, MIDDLE), (LEFT, -1, MIDDLE)])
def test_a_lane_change_is_a_half_cosine_from_lane_to_lane(
    tmp_path: Path, y: float, by: int, to: float, step: float
) -> None:
    actors = [fast("van", 370.0, y)]
    rules = [after(1.23, {"lane": {"by": by, "over": 3.0}})]
    van = run(document(MOTORWAY, actors, rules, step=step), tmp_path / "run").tracks["van"]
    share = np.clip((van.time - 1.23) / 3.0, 0.0, 1.0)
    wanted = y + (to - y) * (1.0 - np.cos(np.pi * share)) / 2.0
    assert van.y == pytest.approx(wanted, abs=0.05)
    assert van.x == pytest.approx(van.x[0] + 20.0 * van.time, abs=0.05)
    assert np.abs(van.hdg).max() < 0.15


SHARES: dict[str, Callable[[np.ndarray], np.ndarray]] = {
    "linear": lambda x: x,
    "cosine": lambda x: (1.0 - np.cos(np.pi * x)) / 2.0,
    "cubic": lambda x: x**2 * (3.0 - 2.0 * x),
}


@pytest.mark.parametrize(
    ("how", "seconds"),
    [
        ({"over": 3.0, "shape": "linear"}, 3.0),
        ({"over": 3.0, "shape": "cubic"}, 3.0),
        ({"within": 60.0, "shape": "cubic"}, 3.0),
        ({"rate": 1.5, "shape": "linear"}, 3.75 / 1.5),
        ({"rate": 1.5, "shape": "cubic"}, 1.5 * 3.75 / 1.5),
        ({"rate": 1.5}, math.pi / 2.0 * 3.75 / 1.5),
        ({}, 3.0),
    ],
)
def test_a_lane_change_has_the_shape_and_the_measure_that_it_is_given(
    tmp_path: Path, how: dict[str, Any], seconds: float
) -> None:
    actors = [fast("van", 370.0, RIGHT)]
    rules = [after(1.23, {"lane": {"by": 1, **how}})]
    found = run(document(MOTORWAY, actors, rules, until=7.0), tmp_path / "run")
    van = found.tracks["van"]
    share = np.clip((van.time - 1.23) / seconds, 0.0, 1.0)
    wanted = RIGHT + (MIDDLE - RIGHT) * SHARES[how.get("shape", "cosine")](share)
    assert van.y == pytest.approx(wanted, abs=0.05)
    assert found.instant("r", "ended") == pytest.approx(1.23 + seconds, abs=0.01)


def test_a_speed_that_is_set_at_once_is_not_drawn_out_into_a_headway(tmp_path: Path) -> None:
    """30 m behind one at 10 m/s it is set from 10 to 20 m/s: below a second 10 m later."""
    actors = [
        fast("ego", 430.0, MIDDLE, 10.0, ego=True),
        fast("van", 395.0, MIDDLE, 10.0, driver="story"),
    ]
    near = {"id": "near", "actor": "van", "when": {"headway": {"to": "ego", "below": 1.0}},
            "then": [{"speed": {"to": 10.0, "shape": "step"}}]}  # fmt: skip
    rules = [after(1.0, {"speed": {"to": 20.0, "shape": "step"}}), near]
    found = run(document(MOTORWAY, actors, rules, until=6.0), tmp_path / "run")
    ego, van = found.tracks["ego"], found.tracks["van"]
    free = float(np.interp(1.0, ego.time, ego.x) - ego.length - np.interp(1.0, van.time, van.x))
    assert 20.0 < free < 40.0  # a rule of odscen's own sees it within a step of the leap
    assert found.instant("near") == pytest.approx(1.0 + (free - 20.0) / 10.0, abs=0.02)


def test_a_change_within_metres_heeds_the_speed_and_ends_beside_the_centre(tmp_path: Path) -> None:
    actors = [fast("van", 370.0, RIGHT)]
    change = {"lane": {"by": 1, "within": 60.0, "offset": 0.5}}
    slow = {"speed": {"to": 10.0, "over": 2.0}}
    rules = [after(1.0, {"together": [change, slow]})]
    found = run(document(MOTORWAY, actors, rules, until=9.0), tmp_path / "run")
    van = found.tracks["van"]
    share = np.clip((van.x - van.x[0] - 20.0) / 60.0, 0.0, 1.0)
    wanted = RIGHT + (MIDDLE + 0.5 - RIGHT) * (1.0 - np.cos(np.pi * share)) / 2.0
    led = van.time < 6.0
    assert van.y[led] == pytest.approx(wanted[led], abs=0.06)
    # 30 m in the two seconds of braking, 30 m at 10 m/s
    assert found.instant("r", "ended") == pytest.approx(1.0 + 2.0 + 3.0, abs=0.02)


def test_a_gap_is_closed_with_its_rate_and_opened_with_its_braking(tmp_path: Path) -> None:
    actors = [fast("ego", 430.0, MIDDLE, 15.0, ego=True), fast("van", 370.0, MIDDLE)]
    gap = {"keep_gap": {"to": "ego", "metres": 15.0, "rate": 4.0, "braking": 1.5}}
    rules = [
        after(1.0, gap),
        after(12.0, {"speed": {"to": 5.0, "rate": 3.0}}, name="brakes", actor="ego"),
    ]
    found = run(document(MOTORWAY, actors, rules, until=18.0), tmp_path / "run")
    gained = np.diff(found.tracks["van"].speed) / np.diff(found.tracks["van"].time)
    assert gained.min() == pytest.approx(-1.5, abs=0.05)
    assert gained.max() <= 4.05


@pytest.mark.slow
@pytest.mark.parametrize("step", STEPS)
def test_an_offset_is_kept_beside_the_lane_and_taken_back(tmp_path: Path, step: float) -> None:
    there = {"offset": {"to": 0.8, "over": 2.0}}
    back = {"offset": {"to": 0.0, "over": 1.5}}
    rules = [after(1.23, there), after(5.0, back, name="back")]
    actors = [fast("van", 370.0, MIDDLE)]
    van = run(document(MOTORWAY, actors, rules, step=step), tmp_path / "run").tracks["van"]
    between = (van.time > 3.3) & (van.time <= 5.0)
    assert van.y[between] == pytest.approx(MIDDLE + 0.8, abs=0.01)
    assert van.y[van.time > 6.6] == pytest.approx(MIDDLE, abs=0.01)


@pytest.mark.slow
@pytest.mark.parametrize("step", STEPS)
def test_actions_run_together_or_one_after_the_other(tmp_path: Path, step: float) -> None:
    together = {"together": [{"lane": {"by": 1, "over": 3.0}}, {"speed": {"to": 15, "over": 2}}]}
    then = (together, {"speed": {"to": 18.0, "rate": 2.0}})
    actors = [fast("van", 370.0, RIGHT)]
    found = run(document(MOTORWAY, actors, [after(1.23, *then)], step=step), tmp_path / "run")
    van = found.tracks["van"]
    assert found.instant("r", "ended") == pytest.approx(1.23 + 3.0 + 1.5, abs=1e-6)
    there = float(np.interp(8.0, van.time, van.x)) - van.x[0]
    rest = 8.0 - 5.73
    assert there == pytest.approx(1.23 * 20.0 + 35.0 + 15.0 + 1.5 * 16.5 + rest * 18.0, abs=0.05)
    assert van.y[-1] == pytest.approx(MIDDLE, abs=0.01)


@pytest.mark.slow
@pytest.mark.parametrize("step", STEPS)
@pytest.mark.parametrize("gap", [{"metres": 15.0}, {"seconds": 1.0}])
def test_a_gap_is_reached_and_kept(tmp_path: Path, gap: dict[str, float], step: float) -> None:
    actors = [fast("ego", 430.0, MIDDLE, 15.0, ego=True), fast("van", 370.0, MIDDLE)]
    rules = [after(1.0, {"keep_gap": {"to": "ego", "lasting": 16.0, **gap}})]
    found = run(document(MOTORWAY, actors, rules, step=step), tmp_path / "run")
    ego, van = found.tracks["ego"], found.tracks["van"]
    between = (np.interp(16.0, ego.time, ego.x) - ego.length) - np.interp(16.0, van.time, van.x)
    assert between == pytest.approx(15.0, abs=0.1)
    assert found.instant("r", "ended") == pytest.approx(17.0, abs=1e-6)


@pytest.mark.slow
def test_a_gap_that_is_reached_once_lets_the_next_rule_begin(tmp_path: Path) -> None:
    actors = [fast("ego", 430.0, MIDDLE, 15.0, ego=True), fast("van", 370.0, MIDDLE)]
    reach = {"keep_gap": {"to": "ego", "metres": 15.0, "once": True}}
    rules = [after(1.0, reach, {"speed": {"to": 5.0, "rate": 2.0}})]
    found = run(document(MOTORWAY, actors, rules), tmp_path / "run")
    ego, van = found.tracks["ego"], found.tracks["van"]
    end = found.instant("r", "ended")
    there = end - 10.0 / 2.0  # from the 15 m/s of the ego to 5 m/s with 2 m/s²
    between = (np.interp(there, ego.time, ego.x) - ego.length) - np.interp(there, van.time, van.x)
    assert between == pytest.approx(15.0, abs=0.2)
    assert there < 17.0
    assert van.speed[-1] == pytest.approx(5.0, abs=0.1)


@pytest.mark.slow
@pytest.mark.parametrize("step", STEPS)
@pytest.mark.parametrize("gap", [{"metres": 15.0}, {"seconds": 1.0}])
def test_a_gap_is_kept_ahead(tmp_path: Path, gap: dict[str, float], step: float) -> None:
    actors = [fast("ego", 370.0, MIDDLE, 15.0, ego=True), fast("van", 410.0, RIGHT, 15.0)]
    rules = [after(1.0, {"keep_gap": {"to": "ego", "ahead": True, "lasting": 11.0, **gap}})]
    found = run(document(MOTORWAY, actors, rules, step=step), tmp_path / "run")
    ego, van = found.tracks["ego"], found.tracks["van"]
    between = (np.interp(12.0, van.time, van.x) - van.length) - np.interp(12.0, ego.time, ego.x)
    assert between == pytest.approx(15.0, abs=0.1)


@pytest.mark.slow
@pytest.mark.parametrize("step", STEPS)
def test_two_arrive_at_their_places_at_one_instant(tmp_path: Path, step: float) -> None:
    places = node_at(MOTORWAY, 640.0, MIDDLE), node_at(MOTORWAY, 600.0, RIGHT)
    actors = [fast("ego", 370.0, MIDDLE, ego=True), fast("van", 440.0, RIGHT, 10.0)]
    meet = {"arrive": {"at": places[1], "to": "ego", "when_at": places[0]}}
    found = run(document(MOTORWAY, actors, [after(1.23, meet)], step=step), tmp_path / "run")
    end = found.instant("r", "ended")
    lanes = loaded(MOTORWAY).sumo.graph.lanes
    for name, y in (("ego", MIDDLE), ("van", RIGHT)):
        track = found.tracks[name]
        wanted = lanes.x[int(np.argmin(np.hypot(
            lanes.x - (640.0 if name == "ego" else 600.0), lanes.y - y
        )))]  # fmt: skip
        x, _ = track.centre(end)
        speed = float(np.interp(end, track.time, track.speed))
        assert abs(x - wanted) / speed < 0.1


@pytest.mark.slow
def test_who_is_to_arrive_earlier_than_it_can_is_told_so(tmp_path: Path) -> None:
    places = node_at(MOTORWAY, 400.0, MIDDLE), node_at(MOTORWAY, 700.0, RIGHT)
    actors = [fast("ego", 370.0, MIDDLE, ego=True), fast("van", 400.0, RIGHT, 10.0)]
    meet = {"arrive": {"at": places[1], "to": "ego", "when_at": places[0]}}
    found = run(document(MOTORWAY, actors, [after(0.5, meet)]), tmp_path / "run")
    [event] = found.of_rule("r", "failed")
    assert "m/s to be there in time" in (event.detail or "")
    assert found.tracks["van"].speed[-1] > 9.0


@pytest.mark.slow
def test_a_vehicle_vanishes_at_once_and_release_gives_it_back(tmp_path: Path) -> None:
    rules = [after(3.0, {"vanish": {}})]
    actors = [fast("van", 370.0, MIDDLE), fast("other", 420.0, RIGHT)]
    rules.append(after(1.0, {"speed": {"to": 5.0, "rate": 5.0}}, actor="other", name="slow"))
    rules.append(after(6.0, {"release": {}}, actor="other", name="free"))
    found = run(document(MOTORWAY, actors, rules), tmp_path / "run")
    assert found.tracks["van"].time[-1] == pytest.approx(3.0, abs=0.11)
    other = found.tracks["other"]
    assert other.speed[(other.time > 4.5) & (other.time < 6.0)] == pytest.approx(5.0)
    assert other.speed[-1] > 15.0


@pytest.mark.slow
def test_rules_that_want_one_actor_at_once_follow_each_other_with_an_event(
    tmp_path: Path,
) -> None:
    rules = [
        after(1.0, {"speed": {"to": 5.0, "over": 8.0}}, name="slow"),
        after(3.0, {"speed": {"to": 25.0, "over": 2.0}}, name="fast"),
    ]
    found = run(document(MOTORWAY, [fast("van", 370.0, MIDDLE)], rules), tmp_path / "run")
    [event] = found.of_rule("slow", "overridden")
    assert event.time == pytest.approx(3.0)
    assert "'fast'" in (event.detail or "")
    assert found.instant("fast", "ended") == pytest.approx(5.0)


@pytest.mark.slow
def test_a_rule_on_a_vehicle_that_is_not_there_yet_says_so(tmp_path: Path) -> None:
    actors = [fast("van", 370.0, MIDDLE, depart=5.0), fast("other", 420.0, RIGHT)]
    rules = [
        after(1.0, {"lane": {"by": 1}}),
        {
            "id": "late", "actor": "van", "when": {"appeared": {"of": "van"}},
            "then": [{"speed": {"to": 10.0, "rate": 4.0}}],
        },
    ]  # fmt: skip
    found = run(document(MOTORWAY, actors, rules), tmp_path / "run")
    [event] = found.of_rule("r", "failed")
    assert event.detail == "'van' is not on the road"
    assert found.instant("late") == pytest.approx(5.0, abs=0.11)
    assert found.tracks["van"].speed[-1] == pytest.approx(10.0)


@pytest.mark.slow
def test_a_lane_that_is_not_there_or_ends_is_told_and_sumo_drives_on(tmp_path: Path) -> None:
    actors = [fast("van", 370.0, LEFT)]
    found = run(document(MOTORWAY, actors, [after(1.0, {"lane": {"by": 1}})]), tmp_path / "run")
    [event] = found.of_rule("r", "failed")
    assert event.detail == "there is no lane 1 to the left for it"
    assert found.tracks["van"].x[-1] > found.tracks["van"].x[0] + 300.0


@pytest.mark.slow
def test_bodies_that_meet_beside_their_lanes_have_collided_at_their_instant(
    tmp_path: Path,
) -> None:
    """Two trucks, 2.5 m wide, on lanes 3.75 m apart: SUMO sees nothing until a lane is left."""
    truck = {"category": "truck"}
    actors = [fast("ego", 400.0, MIDDLE, 15.0, **truck), fast("van", 400.0, RIGHT, 15.0, **truck)]
    rules = [after(2.0, {"offset": {"to": 1.5, "over": 2.0}})]
    scenario = document(MOTORWAY, actors, rules)
    plan = prepared(scenario).plan
    free = 3.75 - plan.actors[0].width
    found = run(scenario, tmp_path / "run")
    [hit] = [one for one in found.events if one.kind == "collision"]
    assert (hit.actor, hit.partner, hit.detail) in (
        ("ego", "van", "bodies"), ("van", "ego", "bodies")
    )  # fmt: skip
    assert hit.y == pytest.approx(MIDDLE - plan.actors[0].width / 2.0, abs=0.3)
    instant = 2.0 + 2.0 * math.acos(1.0 - 2.0 * free / 1.5) / math.pi
    assert hit.time == pytest.approx(instant, abs=0.2)
    sideways = 1.5 * math.pi / 4.0
    assert 0.0 < (hit.values or {})["impact_speed"] <= sideways + 0.01


SOUTH, NORTH = 100.5, 109.5
"""y of the sidewalks of a street that runs along x; cars drive east on 103.4."""


def crossing_child(**then: Any) -> tuple[list[dict[str, Any]], list[dict[str, Any]], str]:
    start, far = walk_node_at(TOWN, 270.0, SOUTH), walk_node_at(TOWN, 270.0, NORTH)
    goal = walk_node_at(TOWN, 240.0, NORTH)
    ego = {
        "id": "ego", "category": "car", "spawn": node_at(TOWN, 215.0, 103.4),
        "goal": node_at(TOWN, 390.0, 103.4), "initial_speed": 8.0, "ego": True,
    }  # fmt: skip
    child = {"id": "child", "category": "pedestrian", "spawn": start, "goal": goal}
    rules = [
        after(0.0, {"stop": {}}, actor="child", name="wait"),
        {
            "id": "run", "actor": "child",
            "when": {"distance": {
                "of": "ego", "place": [270.0, 103.4], "along": "lane", "below": 20.0,
            }},
            "then": [{"walk": {"to": far, "speed": 2.0} | then}],
        },
    ]  # fmt: skip
    return [ego, child], rules, far


@pytest.mark.slow
@pytest.mark.parametrize("step", STEPS)
def test_a_walker_crosses_mid_block_and_the_ego_brakes(tmp_path: Path, step: float) -> None:
    actors, rules, far = crossing_child()
    found = run(document(TOWN, actors, rules, step=step, until=30.0), tmp_path / "run")
    child, ego = found.tracks["child"], found.tracks["ego"]
    begins, ends = found.instant("run"), found.instant("run", "ended")
    walks = loaded(TOWN).sumo.graph.walks
    row = walk_node_index(loaded(TOWN).sumo.graph, far)
    waiting = child.centre(child.time[child.time < begins][-1])
    metres = math.dist(waiting, (walks.x[row], walks.y[row]))
    assert ends - begins == pytest.approx(metres / 2.0, abs=1e-6)
    for time in child.time[(child.time > begins) & (child.time < ends)]:
        share = (time - begins) / (ends - begins)
        wanted = [a + (b - a) * share for a, b in zip(
            waiting, (walks.x[row], walks.y[row]), strict=True
        )]  # fmt: skip
        assert child.centre(time) == pytest.approx(wanted, abs=0.05)
    near = (ego.time > begins) & (ego.time < ends)
    assert ego.speed[near].min() < ego.speed[ego.time < begins].max() - 2.0
    # Back on foot it walks on to its goal.
    assert child.x[-1] < 262.0
    assert child.y[-1] > NORTH - 1.0


@pytest.mark.slow
def test_a_walker_that_stops_on_the_road_stays_there_and_is_waited_for(tmp_path: Path) -> None:
    actors, rules, _ = crossing_child(to=[270.6, 103.4])
    found = run(document(TOWN, actors, rules, until=30.0), tmp_path / "run")
    child, ego = found.tracks["child"], found.tracks["ego"]
    assert child.centre(30.0) == pytest.approx((270.6, 103.4), abs=0.05)
    assert ego.speed[-1] < 0.5
    assert ego.x[-1] < 270.6 - 0.3


def test_a_walker_who_is_stopped_on_its_line_stands_there_until_the_end(tmp_path: Path) -> None:
    actors, rules, _ = crossing_child()
    rules.append(after(0.0, {"stop": {}}, actor="child", name="halt"))
    rules[-1]["when"] = {"rule": {"id": "run", "has": "started"}, "delay": 1.5}
    found = run(document(TOWN, actors, rules, until=25.0), tmp_path / "run")
    child, begins = found.tracks["child"], found.instant("run")
    assert found.instant("halt") == pytest.approx(begins + 1.5, abs=1e-6)
    start, there = child.centre(begins), child.centre(25.0)
    assert math.dist(start, there) == pytest.approx(1.5 * 2.0, abs=0.05)
    assert np.hypot(np.diff(child.x), np.diff(child.y)).max() < 0.25
    # Its walk is not over: it was stopped.
    assert [one.kind for one in found.events if one.rule == "run"] == [
        "rule_started",
        "rule_overridden",
    ]


def test_a_walker_who_has_waited_reaches_its_speed_as_the_rule_says(tmp_path: Path) -> None:
    actors, rules, _ = crossing_child()
    path = {"path": {"points": [[270.6, 103.4], [270.6, NORTH]]}}
    rules[1]["then"] = [{"together": [{"speed": {"to": 3.0, "rate": 1.0}}, path]}]
    found = run(document(TOWN, actors, rules, until=20.0), tmp_path / "run")
    child, begins = found.tracks["child"], found.instant("run")
    for seconds in (1.0, 2.0, 3.0):
        covered = math.dist(child.centre(begins), child.centre(begins + seconds))
        assert covered == pytest.approx(seconds**2 / 2.0, abs=0.05), seconds


@pytest.mark.slow
@pytest.mark.parametrize("step", STEPS)
def test_a_walker_arrives_where_the_ego_is_at_that_instant(tmp_path: Path, step: float) -> None:
    actors, rules, _ = crossing_child()
    [ego, _] = actors
    ego["speed"] = 8.0
    place = node_at(TOWN, 270.0, 103.4)
    rules[1]["then"] = [{"arrive": {"at": [270.6, 101.4], "to": "ego", "when_at": place}}]
    rules[1]["when"] = {"time": {"after": 3.0}}
    found = run(document(TOWN, actors, rules, step=step, until=12.0), tmp_path / "run")
    end = found.instant("run", "ended")
    assert found.tracks["child"].centre(end) == pytest.approx((270.6, 101.4), abs=0.05)
    graph = loaded(TOWN).sumo.graph
    x, _ = found.tracks["ego"].centre(end)
    assert abs(x - graph.lanes.x[node_index(graph, place)]) / 8.0 < 0.1


@pytest.mark.slow
def test_the_same_rules_give_the_same_bytes_twice(tmp_path: Path) -> None:
    actors, rules, _ = crossing_child()
    scenario = document(TOWN, actors, rules, until=20.0)
    first, second = (told(prepared(scenario), tmp_path / name).folder for name in ("a", "b"))
    for name in ("events.json", "trajectories.parquet", "actors.json"):
        assert (first / name).read_bytes() == (second / name).read_bytes()


@pytest.mark.slow
def test_a_walker_released_on_the_road_stays_there_with_an_event(tmp_path: Path) -> None:
    """SUMO ends in a fault where a person waits on an edge without sidewalk."""
    actors, rules, _ = crossing_child()
    rules.append(after(6.0, {"release": {}}, actor="child", name="free"))
    far = walk_node_at(TOWN, 270.0, NORTH)
    rules.append(after(12.0, {"walk": {"to": far, "speed": 2.0}}, actor="child", name="again"))
    found = run(document(TOWN, actors, rules, until=30.0), tmp_path / "run")
    [event] = [one for one in found.events if one.kind == "rule_failed"]
    assert event.detail == "there is no sidewalk to resume its walk on; it stays where it is"
    child = found.tracks["child"]
    waits = (child.time > 6.5) & (child.time < 12.0)
    assert np.ptp(child.y[waits]) < 0.01
    assert child.y[-1] > NORTH - 1.0


def test_a_lane_that_ends_during_a_change_ends_the_change_with_an_event(tmp_path: Path) -> None:
    lanes = loaded(MOTORWAY).sumo.graph.lanes
    first = lanes.lanes.first_node
    for row, kind in enumerate(lanes.lanes.types):
        last = int(first[row + 1]) - 12
        left = int(lanes.left_lane[last])
        if kind == "entry" and last > first[row] and left >= 0:
            break
    else:
        pytest.fail("no entry lane")
    beside_it = range(int(first[left]), int(first[left + 1]))
    start = min(beside_it, key=lambda node: math.dist(
        (lanes.x[node], lanes.y[node]), (lanes.x[last], lanes.y[last])
    ))  # fmt: skip
    van = {
        "id": "van", "category": "car", "spawn": node_id(loaded(MOTORWAY).sumo.graph, start),
        "initial_speed": 20.0, "speed": 20.0,
    }  # fmt: skip
    rules = [after(0.0, {"lane": {"by": -1, "over": 6.0}})]
    found = run(document(MOTORWAY, [van], rules), tmp_path / "run")
    [event] = found.of_rule("r", "failed")
    assert event.detail == "the lane ends before it is there"
    assert found.tracks["van"].travelled[-1] > 100.0


@pytest.mark.slow
def test_a_rule_waits_for_green_and_another_lets_a_car_run_the_red(tmp_path: Path) -> None:
    name = "signal_crossing"
    made_on = loaded(name)
    light = made_on.lights[0]
    graph = made_on.sumo.graph
    keys = list(map(str, graph.lanes.lanes.keys))
    first_state = made_on.sumo.lights[0].phases[0].state
    movement = next(
        one
        for one, letter in zip(light.movements, first_state, strict=True)
        if one.turn == "straight" and one.lanes[0] in keys and letter == "r"
    )
    lane = keys.index(movement.lanes[0])
    last = int(graph.lanes.lanes.first_node[lane + 1]) - 1
    car_ = {
        "id": "van", "category": "car", "spawn": node_id(graph, last - 20), "depart": 0.0,
        "initial_speed": 8.0,
    }  # fmt: skip
    green = {"light": light.names[0], "movement": movement.name, "shows": "green"}
    rules = [{
        "id": "green", "actor": "van", "when": {"signal": green}, "then": [{"ignore": {}}]
    }]  # fmt: skip
    waits = run(document(name, [car_], rules, until=90.0), tmp_path / "waits")
    turns_green = waits.instant("green")
    assert turns_green > 0.0
    jumps = run(
        document(name, [car_], [after(0.0, {"ignore": {"red": True}})], until=90.0),
        tmp_path / "jumps",
    )
    fast_one, slow_one = (told.tracks["van"].time[-1] for told in (jumps, waits))
    assert fast_one < turns_green < slow_one
