"""Templates in SUMO: the wanted geometry, computed from the trajectories and the map alone."""

from __future__ import annotations

import json
import math
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from shapely import LineString, affinity, box

from odscen.lanegraph.query import node_index, walk_node_index
from odscen.scenario.document.json_form import dumps, loads
from odscen.scenario.templates.template_registry import TEMPLATES, place_template
from tests.sumo.story_case import Told, Track, loaded, prepared, run, told

if TYPE_CHECKING:
    from pathlib import Path

    from odscen.scenario.document.scenario_document import Scenario

STEPS = (pytest.param(0.05, marks=pytest.mark.slow), 0.1, pytest.param(0.5, marks=pytest.mark.slow))
MAPS = {
    "cut-in": "motorway_weave",
    "lead-brakes": "rural_hills",
    "hidden-child": "town_5x5",
    "mid-block": "town_5x5",
    "red-light": "signal_crossing",
    "oncoming": "rural_hills",
    "bus-leaves": "motorway_weave",
}
SECONDS, METRES = 0.1, 0.05


def scene(name: str, *, step: float | None = None, **values: float) -> Scenario:
    made_on = loaded(MAPS[name])
    scenario = place_template(
        TEMPLATES[name], made_on.sumo.graph, made_on.usable, made_on.lights,
        values=values, name=name,
    )  # fmt: skip
    data = json.loads(dumps(scenario))
    if step is not None:
        data["simulation"]["step_length"] = step
    return loads(json.dumps(data))


def amid_traffic(scenario: Scenario, vehicles: int = 300) -> Scenario:
    """The scene with others that drive anywhere on the map and depart while it is played."""
    data = json.loads(dumps(scenario))
    until = scenario.simulation.duration
    data["demand"] = {"background": [{"id": "others", "end": until, "trips": vehicles}]}
    return loads(json.dumps(data))


def at(track: Track, time: float, what: str = "speed") -> float:
    return float(np.interp(time, track.time, getattr(track, what)))


def gap(behind: Track, ahead: Track, time: float) -> float:
    """Free metres along the heading of the one behind, as bodies lie at an instant."""
    (x, y), (fx, fy) = ahead.centre(time), behind.at(time)
    hdg = at(behind, time, "hdg")
    metres = (x - fx) * math.cos(hdg) + (y - fy) * math.sin(hdg)
    return metres - ahead.length / 2.0


def place(name: str, node: str) -> tuple[float, float]:
    graph = loaded(MAPS[name]).sumo.graph
    if node.startswith("ped."):
        row = walk_node_index(graph, node)
        return float(graph.walks.x[row]), float(graph.walks.y[row])
    row = node_index(graph, node)
    return float(graph.lanes.x[row]), float(graph.lanes.y[row])


def rule_of(scenario: Scenario, name: str) -> Any:
    return next(one for one in scenario.rules if one.id == name)


def check_cut_in(scenario: Scenario, found: Told) -> None:
    """UN R157: the TTC when the body is 0.3 m over the border between the lanes."""
    graph = loaded("motorway_weave").sumo.graph
    ego, other = found.tracks["ego"], found.tracks["challenger"]
    width = graph.lanes.width[node_index(graph, scenario.actors[1].spawn)]
    begins, ends = found.instant("cut-in"), found.instant("cut-in", "ended")
    start, hdg = other.at(begins), at(other, 0.0, "hdg")
    times = np.linspace(begins, ends, 3001)
    aside = np.array([
        abs((other.at(t)[1] - start[1]) * math.cos(hdg)
            - (other.at(t)[0] - start[0]) * math.sin(hdg))
        for t in times
    ])  # fmt: skip
    enters = float(times[np.argmax(aside >= width / 2.0 - 0.9 + 0.3)])
    before = ego.time <= enters
    closing = float(ego.speed[before][-1] - other.speed[before][-1])
    wanted = (60 - 40) / 3.6 / 12.0 + 0.35
    assert closing == pytest.approx(20 / 3.6, abs=0.2)  # its speed has a part sideways
    assert gap(ego, other, enters) / closing == pytest.approx(wanted, abs=SECONDS)
    x, y = other.at(ends + 0.5)
    there = (y - start[1]) * math.cos(hdg) - (x - start[0]) * math.sin(hdg)
    assert abs(there) == pytest.approx(width, abs=METRES)


def check_lead_brakes(_: Scenario, found: Told) -> None:
    ego, lead = found.tracks["ego"], found.tracks["lead"]
    begins, ends = found.instant("brake"), found.instant("brake", "ended")
    assert begins == pytest.approx(4.0, abs=1e-3)
    along = float(np.hypot(*(np.array(lead.centre(begins)) - ego.at(begins))))
    assert along - lead.length / 2.0 == pytest.approx(40.0, abs=0.1)
    speed = 50 / 3.6
    assert ends - begins == pytest.approx(speed / 6.0, abs=0.01)
    metres = np.interp([begins, ends + 0.5], lead.time, lead.travelled)
    assert metres[1] - metres[0] == pytest.approx(speed**2 / 12.0, abs=METRES)
    assert ego.speed[-1] < 0.2
    assert gap(ego, lead, float(ego.time[-1])) > 0.0


def check_walker(scenario: Scenario, found: Told) -> None:
    """Start when the ego's front is v t away, and be where the paths meet after t."""
    name = scenario.name
    walker = "child" if name == "hidden-child" else "walker"
    rule = rule_of(scenario, "cross")
    meets = rule.then[0].walk.through[0]
    ego, foot = found.tracks["ego"], found.tracks[walker]
    begins = found.instant("cross")
    start = place(name, next(one.spawn for one in scenario.actors if one.id == walker))
    seconds = math.dist(start, meets) / (5 / 3.6)
    wanted = ego.speed[ego.time < begins][-1] * seconds
    assert math.dist(ego.at(begins), meets) == pytest.approx(wanted, abs=METRES)
    assert foot.centre(begins + seconds) == pytest.approx(meets, abs=METRES + SECONDS * 5 / 3.6)
    arrives = found.instant("cross", "ended")
    last = float(foot.time[foot.time < arrives][-1])  # then SUMO puts it on its own line
    rest = math.dist(foot.centre(last), place(name, rule.then[0].walk.to))
    assert rest == pytest.approx((arrives - last) * 5 / 3.6, abs=METRES)
    during = (ego.time > begins) & (ego.time < arrives)
    assert ego.speed[during].min() < ego.speed[ego.time < begins][-1] - 2.0  # it brakes


def check_red_light(scenario: Scenario, found: Told) -> None:
    arrive = rule_of(scenario, "run").then[0].arrive
    ends = [one.time for one in found.of_rule("run", "ended")]
    ego, runner = found.tracks["ego"], found.tracks["runner"]
    assert ends
    for track, node in ((ego, arrive.when_at), (runner, arrive.at)):
        where = np.array(place(scenario.name, node))
        away = np.hypot(*(np.array([track.centre(t) for t in track.time]) - where).T)
        nearest = int(np.argmin(away))
        assert abs(away[nearest]) < track.speed[nearest] * 0.5
        fine = np.linspace(track.time[nearest] - 0.5, track.time[nearest] + 0.5, 2001)
        metres = [math.dist(track.centre(float(t)), where) for t in fine]
        assert fine[int(np.argmin(metres))] == pytest.approx(ends[0], abs=SECONDS)
    step = scenario.simulation.step_length  # it follows the ego's acceleration a step later
    assert at(runner, ends[0]) == pytest.approx(50 / 3.6, abs=0.6 if step <= 0.1 else 3.0)


def check_oncoming(scenario: Scenario, found: Told) -> None:
    car, ego = found.tracks["overtaker"], found.tracks["ego"]
    begins, back = found.instant("overtake"), found.instant("overtake", "ended")
    wanted = rule_of(scenario, "overtake").when.all[1].distance.below
    assert gap_between_fronts(car, ego, begins) == pytest.approx(wanted, abs=METRES)
    closing = at(car, back) + at(ego, back)
    assert gap_between_fronts(car, ego, back) / closing == pytest.approx(1.0, abs=SECONDS)
    bicycle = found.tracks["bicycle"]
    assert gap(bicycle, car, back) > 6.0


def gap_between_fronts(one: Track, other: Track, time: float) -> float:
    (x, y), (u, v) = one.at(time), other.at(time)
    hdg = at(one, 0.0, "hdg")
    return (u - x) * math.cos(hdg) + (v - y) * math.sin(hdg)


def check_bus(_: Scenario, found: Told) -> None:
    ego, bus = found.tracks["ego"], found.tracks["bus"]
    begins, ends = found.instant("leave"), found.instant("leave", "ended")
    assert gap(ego, bus, begins) / at(ego, begins) == pytest.approx(5.0, abs=SECONDS)
    graph = loaded("motorway_weave").sumo.graph
    stood, (x, y) = bus.at(begins), bus.at(ends)
    hdg = at(bus, begins, "hdg")
    aside = (y - stood[1]) * math.cos(hdg) - (x - stood[0]) * math.sin(hdg)
    assert abs(aside) == pytest.approx(graph.lanes.width[0], abs=METRES)
    assert at(bus, ends + 0.5) == pytest.approx(30 / 3.6, abs=0.3)


CHECKS = {
    "cut-in": check_cut_in,
    "lead-brakes": check_lead_brakes,
    "hidden-child": check_walker,
    "mid-block": check_walker,
    "red-light": check_red_light,
    "oncoming": check_oncoming,
    "bus-leaves": check_bus,
}


@pytest.mark.slow
@pytest.mark.parametrize("step", STEPS)
@pytest.mark.parametrize("name", MAPS)
def test_a_template_has_the_geometry_that_its_numbers_say(
    tmp_path: Path, name: str, step: float
) -> None:
    scenario = scene(name, step=step)
    CHECKS[name](scenario, run(scenario, tmp_path / "run"))


@pytest.mark.slow
@pytest.mark.parametrize("name", MAPS)
def test_a_template_gives_the_same_bytes_twice(tmp_path: Path, name: str) -> None:
    scenario = scene(name)
    first, second = (told(prepared(scenario), tmp_path / one).folder for one in ("a", "b"))
    for file in ("events.json", "trajectories.parquet"):
        assert (first / file).read_bytes() == (second / file).read_bytes()


@pytest.mark.slow
@pytest.mark.parametrize("name", ["cut-in", "lead-brakes", "mid-block", "oncoming"])
def test_a_template_has_its_geometry_amid_300_others(tmp_path: Path, name: str) -> None:
    scenario = amid_traffic(scene(name))
    found = run(scenario, tmp_path / "run")
    assert len(found.tracks) > 150
    CHECKS[name](scenario, found)


@pytest.mark.parametrize("step", STEPS)
@pytest.mark.parametrize("name", ["roundabout", "left_hand_crossing"])
def test_on_a_road_of_one_lane_the_child_is_hidden_by_a_vehicle_beside_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str, step: float
) -> None:
    monkeypatch.setitem(MAPS, "hidden-child", name)
    scenario = scene("hidden-child", step=step)
    found = run(scenario, tmp_path / "run")
    check_walker(scenario, found)
    assert not found.of_rule("parked", "failed")
    ego, parked, child = (found.tracks[one] for one in ("ego", "parked", "child"))
    there = np.array([parked.centre(time) for time in parked.time[parked.time > 2.0 * step]])
    assert np.ptp(there, axis=0) == pytest.approx(0.0, abs=0.01)
    begins = found.instant("cross")
    before = ego.speed[ego.time < begins]
    assert before == pytest.approx(before[0], abs=0.01)  # nothing is in its lane
    sight = LineString([ego.at(begins - 0.5), child.centre(begins - 0.5)])
    x, y = parked.centre(begins)
    hdg = at(parked, begins, "hdg")
    body = affinity.translate(
        affinity.rotate(box(-2.2, -0.85, 2.2, 0.85), hdg, origin=(0, 0), use_radians=True), x, y
    )
    assert sight.intersects(body)
    assert not body.intersects(LineString(np.stack([ego.x, ego.y], axis=1)).buffer(0.9))
