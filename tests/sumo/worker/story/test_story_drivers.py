"""Vehicles that the story alone drives: they keep speed and lane, and hit what is in the way."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import pytest

from odscen.base.categories import Category
from odscen.figures.judging.criteria import criteria_rows
from odscen.lanegraph.query import node_index
from odscen.runs.judged import read_judged
from odscen.scenario.checks.scenario_checks import check
from tests.sumo.story_case import (
    MIDDLE,
    document,
    loaded,
    node_at,
    run,
)

if TYPE_CHECKING:
    from pathlib import Path

    from tests.sumo.story_case import Told

STEPS = (pytest.param(0.05, marks=pytest.mark.slow), 0.1, pytest.param(0.5, marks=pytest.mark.slow))
MOTORWAY = "motorway_weave"


def car(name: str, x: float, speed: float, y: float = MIDDLE, **fields: Any) -> dict[str, Any]:
    goal = node_at(MOTORWAY, 900.0, MIDDLE)
    return {
        "id": name, "category": "car", "spawn": node_at(MOTORWAY, x, y), "goal": goal,
        "initial_speed": speed, "driver": "story",
    } | fields  # fmt: skip


def after(seconds: float, *then: dict[str, Any], actor: str = "ego", name: str = "r") -> Any:
    when = {"time": {"after": seconds}}
    return {"id": name, "actor": actor, "when": when, "then": list(then)}


def gap_at_start(found: Told) -> float:
    ego, other = found.tracks["ego"], found.tracks["other"]
    return float(other.x[0] - other.length - ego.x[0])


@pytest.mark.slow
@pytest.mark.parametrize("step", STEPS)
def test_a_car_without_events_hits_the_stopped_one_when_the_gap_is_covered(
    tmp_path: Path, step: float
) -> None:
    """15 m/s and about 80 m: the bodies meet after gap / 15 m/s, where the other one stands."""
    actors = [car("ego", 370.0, 15.0, ego=True), car("other", 455.0, 0.0)]
    found = run(document(MOTORWAY, actors, [], step=step), tmp_path / "run")
    gap = gap_at_start(found)
    assert 75.0 < gap < 85.0
    [hit] = [one for one in found.events if one.kind == "collision"]
    assert {hit.actor, hit.partner} == {"ego", "other"}
    assert hit.time == pytest.approx(gap / 15.0, abs=0.05)
    other, ego = found.tracks["other"], found.tracks["ego"]
    assert hit.x == pytest.approx(other.x[0] - other.length, abs=0.05)
    assert (hit.values or {})["impact_speed"] == pytest.approx(15.0, abs=0.01)
    # ... and goes on through it, as nothing in the story stops it.
    assert ego.x == pytest.approx(ego.x[0] + 15.0 * ego.time, abs=0.05)


@pytest.mark.slow
@pytest.mark.parametrize(("first", "then", "hits"), [("sumo", "story", 1), ("story", "sumo", 0)])
def test_a_rule_gives_a_car_to_the_story_or_to_sumo(
    tmp_path: Path, first: str, then: str, hits: int
) -> None:
    """By the story it hits the stopped car 80 m ahead; by SUMO it does not."""
    actors = [car("ego", 370.0, 15.0, ego=True, driver=first), car("other", 455.0, 0.0)]
    rules = [after(1.0, {"drive": {"by": then}})]
    found = run(document(MOTORWAY, actors, rules, until=10.0), tmp_path / "run")
    assert len([one for one in found.events if one.kind == "collision"]) == hits
    if hits:
        later = found.tracks["ego"].speed[found.tracks["ego"].time > 1.05]
        assert later == pytest.approx(later[0], abs=0.01)


@pytest.mark.slow
def test_after_a_rule_the_story_keeps_what_the_rule_left(tmp_path: Path) -> None:
    """Braked to 5 m/s and released it stays at 5 m/s, however free the road is."""
    actors = [car("ego", 370.0, 15.0, ego=True)]
    rules = [after(1.0, {"speed": {"to": 5.0, "over": 2.0}}, {"release": {}})]
    ego = run(document(MOTORWAY, actors, rules), tmp_path / "run").tracks["ego"]
    assert ego.x[-1] - ego.x[0] == pytest.approx(15.0 + 20.0 + 5.0 * (ego.time[-1] - 3.0), abs=0.05)
    assert ego.speed[-1] == pytest.approx(5.0, abs=0.01)


def test_the_story_drives_no_pedestrian() -> None:
    scenario = document(MOTORWAY, [car("ego", 370.0, 15.0)], [])
    walker = scenario.actors[0].model_copy(update={"category": Category.PEDESTRIAN})
    found = check(
        scenario.model_copy(update={"actors": (walker,)}), loaded(MOTORWAY).sumo.graph, None
    )
    assert ("driver_not_possible", "actors[0].driver") in [(one.code, one.where) for one in found]


SUPERMINI = {"length": 4.2, "width": 1.75}


@pytest.mark.slow
def test_bodies_have_their_size_and_start_exactly_where_they_are_put(tmp_path: Path) -> None:
    """CCRs with an overlap of 50 %: a free gap of 30 m, closed at 12 m/s after 2.5 s."""
    first, second = node_at(MOTORWAY, 370.0, MIDDLE), node_at(MOTORWAY, 405.0, MIDDLE)
    lanes = loaded(MOTORWAY).sumo.graph.lanes
    apart = float(lanes.x[node_index(loaded(MOTORWAY).sumo.graph, second)]) - float(
        lanes.x[node_index(loaded(MOTORWAY).sumo.graph, first)]
    )
    free = 30.0 + SUPERMINI["length"] - apart
    actors = [
        car("ego", 370.0, 12.0, ego=True, size=SUPERMINI),
        car(
            "other", 405.0, 0.0, size=SUPERMINI, longitudinal_offset=free,
            lateral_offset=SUPERMINI["width"] / 2.0,
        ),
    ]  # fmt: skip
    found = run(document(MOTORWAY, actors, [], until=5.0), tmp_path / "run")
    assert found.tracks["ego"].length == 4.2
    assert gap_at_start(found) == pytest.approx(30.0, abs=0.01)
    [hit] = [one for one in found.events if one.kind == "collision"]
    assert hit.time == pytest.approx(2.5, abs=0.01)
    assert (hit.values or {})["overlap"] == pytest.approx(0.5, abs=0.01)
    texts = (
        "impact_speed(ego) >= 11.99",
        "impact_overlap(ego) >= 0.49",
        "min_distance(ego,other) > 0",
        "stopped(ego) == 1",
    )
    rows = criteria_rows(texts, {}, read_judged(tmp_path / "run"))
    assert [row["passed"] for row in rows] == [True, True, False, False]
    assert [row["value"] for row in rows] == pytest.approx([12.0, 0.5, 0.0, 0.0], abs=0.01)


@pytest.mark.slow
@pytest.mark.parametrize("step", STEPS)
def test_the_instant_and_place_of_an_impact_while_braking_are_those_of_the_closed_form(
    tmp_path: Path, step: float
) -> None:
    """CCRb: from 20 m/s with 4 m/s² after 1 s, onto a stopped car some 60 m ahead."""
    actors = [car("ego", 370.0, 20.0, ego=True), car("other", 435.0, 0.0)]
    rules = [after(1.0, {"brake": {"by": 4.0}})]
    found = run(document(MOTORWAY, actors, rules, step=step, until=8.0), tmp_path / "run")
    gap = gap_at_start(found)
    [hit] = [one for one in found.events if one.kind == "collision"]
    braked = (20.0 - math.sqrt(400.0 - 8.0 * (gap - 20.0))) / 4.0
    assert hit.time == pytest.approx(1.0 + braked, abs=0.05)
    assert (hit.values or {})["impact_speed"] == pytest.approx(20.0 - 4.0 * braked, abs=0.2)
    other = found.tracks["other"]
    assert hit.x == pytest.approx(other.x[0] - other.length, abs=0.05)


@pytest.mark.slow
def test_who_overlaps_at_first_is_told_and_those_whom_the_story_drives_may(tmp_path: Path) -> None:
    actors = [
        car("ego", 370.0, 12.0, ego=True),
        car("other", 374.0, 12.0, longitudinal_offset=-1.0),
    ]
    scenario = document(MOTORWAY, actors, [], until=2.0)
    graph = loaded(MOTORWAY).sumo.graph
    [told] = [one for one in check(scenario, graph, None) if one.code == "bodies_overlap"]
    assert (told.severity, told.where) == ("warning", "actors[1].spawn")
    found = run(scenario, tmp_path / "run")
    assert found.tracks["other"].x[0] - found.tracks["ego"].x[0] == pytest.approx(3.0, abs=0.01)
    assert [one.kind for one in found.events if one.kind == "collision"] == ["collision"]
    driven = [car("ego", 370.0, 12.0, driver="sumo"), actors[1] | {"driver": "sumo"}]
    [refused] = [
        one
        for one in check(document(MOTORWAY, driven, [], until=2.0), graph, None)
        if one.code == "bodies_overlap"
    ]
    assert refused.severity == "error"


@pytest.mark.slow
@pytest.mark.parametrize("step", STEPS)
def test_who_is_in_a_lane_off_its_route_goes_on_along_it_at_its_speed(
    tmp_path: Path, step: float
) -> None:
    """Its route turns left; a rule has put it on the lane for straight on, 20 m before the end."""
    name = "signal_crossing"
    van = {
        "id": "ego", "category": "car", "spawn": node_at(name, 100.0, 0.0, hdg=math.pi),
        "goal": node_at(name, -3.25, -140.0, hdg=-math.pi / 2), "initial_speed": 8.0,
        "driver": "story", "ego": True,
    }  # fmt: skip
    rules = [after(2.0, {"lane": {"by": -1, "over": 1.5}})]
    found = run(document(name, [van], rules, step=step, until=16.0), tmp_path / "run")
    ego = found.tracks["ego"]
    assert ego.speed == pytest.approx([8.0] * len(ego.speed), abs=0.05)
    assert ego.x[ego.time > 14.0] == pytest.approx(
        ego.x[0] - 8.0 * ego.time[ego.time > 14.0], abs=1.0
    )
    assert ego.y[ego.time > 14.0] == pytest.approx([3.25] * int((ego.time > 14.0).sum()), abs=0.1)


@pytest.mark.slow
def test_one_that_reverses_hits_at_the_sum_of_the_speeds(tmp_path: Path) -> None:
    actors = [car("ego", 370.0, 5.0, ego=True), car("other", 400.0, 2.0)]
    back = {"points": [[380.0, MIDDLE], [340.0, MIDDLE]], "behind": 4.0, "backwards": True,
            "speed": 2.0}  # fmt: skip
    rules = [after(0.0, {"path": back}, actor="other")]
    found = run(document(MOTORWAY, actors, rules, step=0.1), tmp_path / "run")
    [hit] = [one for one in found.events if one.kind == "collision"]
    assert (hit.values or {})["impact_speed"] == pytest.approx(7.0, abs=0.05)
    assert hit.time == pytest.approx(gap_at_start(found) / 7.0, abs=0.1)
