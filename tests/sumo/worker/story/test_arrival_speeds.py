"""Arrivals at a speed that is reached before the place: by trajectories, and by the law alone."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from pydantic import ValidationError

from odscen.scenario.document.rules_document import Arriving
from odscen.scenario.story.action_kinds import arrival_law
from tests.sumo.story_case import MIDDLE, RIGHT, Track, document, loaded, node_at, run
from tests.sumo.worker.story.test_story_run import (
    MOTORWAY,
    STEPS,
    TOWN,
    after,
    crossing_child,
    fast,
)

if TYPE_CHECKING:
    from pathlib import Path

MEET: dict[str, Any] = {"at": [0.0, 0.0], "to": "ego", "when_at": [1.0, 0.0]}


@pytest.mark.parametrize(
    ("at_first", "speed", "steady", "rest", "left", "turn", "between"),
    [
        (15.0, 10.0, 0.0, 100.0, 8.0, 4.0, 12.5),  # evenly: 12.5 m/s is the mean
        (0.0, 0.0, 0.0, 30.0, 6.0, 3.0, 10.0),
        (10.0, 10.0, 0.0, 100.0, 8.0, 4.0, 15.0),
        (0.0, 10.0, 20.0, 60.0, 8.0, 5.162278, 11.937129),
        (10.0, 10.0, 0.0, 60.0, 8.0, 4.0, 5.0),
        (12.0, 4.0, 0.0, 40.0, 8.0, 6.0, 0.0),
    ],
)
def test_who_arrives_turns_once_between_two_changes_of_one_rate_with_all_metres_in_time(
    at_first: float, speed: float, steady: float, rest: float, left: float, turn: float,
    between: float,
) -> None:  # fmt: skip
    part = Arriving.model_validate({**MEET, "speed": speed, "steady": steady})
    law = arrival_law(part, 3.0, rest, left, at_first)
    assert law.speed(3.0) == pytest.approx(at_first)
    assert law.metres(3.0, 3.0 + left) == pytest.approx(rest)
    assert law.v1 == speed
    begin = left - (steady / speed if speed else 0.0)
    assert law.speed(3.0 + begin) == pytest.approx(speed)
    assert law.speed(3.0 + turn) == pytest.approx(between, abs=1e-5)
    first, second = (between - at_first) / turn, (speed - between) / (begin - turn)
    assert abs(first) == pytest.approx(abs(second), abs=1e-4)


@pytest.mark.parametrize(
    ("at_first", "speed", "rest", "left", "stops", "leaves"),
    [(0.0, 10.0, 30.0, 8.0, 0.0, 2.0), (10.0, 5.0, 25.0, 12.0, 4.0, 10.0)],
)
def test_who_would_be_there_too_early_stands_in_between(
    at_first: float, speed: float, rest: float, left: float, stops: float, leaves: float
) -> None:
    law = arrival_law(Arriving.model_validate({**MEET, "speed": speed}), 3.0, rest, left, at_first)
    assert law.metres(3.0, 3.0 + left) == pytest.approx(rest)
    assert law.speed(3.0) == pytest.approx(at_first)
    assert [law.speed(3.0 + at) for at in (stops, leaves)] == pytest.approx([0.0, 0.0])
    assert law.metres(3.0 + stops, 3.0 + leaves) == pytest.approx(0.0)


@pytest.mark.parametrize(("speed", "steady"), [(None, 0.0), (2.0, 40.0)])
def test_without_a_speed_on_arrival_or_metres_to_reach_it_the_speed_is_even(
    speed: float | None, steady: float
) -> None:
    part = Arriving.model_validate({**MEET, "speed": speed, "steady": steady})
    law = arrival_law(part, 3.0, 30.0, 6.0, 12.0)
    assert [law.speed(3.0 + at) for at in (0.0, 3.0, 6.0)] == [5.0, 5.0, 5.0]


@pytest.mark.slow
@pytest.mark.parametrize("when_at", [(0.0, 1.5), (-3.5, 1.5), (-6.5, 0.0)])
def test_a_place_in_a_junction_beside_the_lane_is_met_where_it_is_abreast(
    tmp_path: Path, when_at: tuple[float, float]
) -> None:
    name = "signal_crossing"
    west, south = node_at(name, -60.0, -1.75), node_at(name, 1.75, -80.0, hdg=np.pi / 2)
    actors = [
        {"id": "ego", "category": "car", "spawn": west, "goal": node_at(name, 100.0, -1.75),
         "initial_speed": 8.0, "speed": 8.0, "ego": True, "driver": "story"},
        {"id": "van", "category": "car", "spawn": south,
         "goal": node_at(name, 1.75, 100.0, hdg=np.pi / 2), "initial_speed": 8.0,
         "driver": "story"},
    ]  # fmt: skip
    meet = {"at": [-2.0, 0.0], "to": "ego", "when_at": list(when_at), "speed": 5.0}
    found = run(document(name, actors, [after(0.5, {"arrive": meet})], until=12.0), tmp_path)
    assert found.of_rule("r", "failed") == []
    end = found.instant("r", "ended")
    assert found.tracks["van"].centre(end)[1] == pytest.approx(0.0, abs=0.08)
    assert found.tracks["ego"].centre(end)[0] == pytest.approx(when_at[0], abs=0.08)


def test_no_place_is_reached_at_a_standstill_that_lasts_for_metres() -> None:
    with pytest.raises(ValidationError, match="steady for 5 m wants a speed above 0"):
        Arriving.model_validate({**MEET, "speed": 0.0, "steady": 5.0})


@pytest.mark.slow
@pytest.mark.parametrize("step", STEPS)
def test_who_arrives_drives_the_last_metres_at_the_speed_on_arrival(
    tmp_path: Path, step: float
) -> None:
    places = node_at(MOTORWAY, 640.0, MIDDLE), node_at(MOTORWAY, 600.0, RIGHT)
    actors = [fast("ego", 370.0, MIDDLE, ego=True), fast("van", 440.0, RIGHT, 10.0)]
    meet = {"at": places[1], "to": "ego", "when_at": places[0], "speed": 16.0, "steady": 40.0}
    rules = [after(1.23, {"arrive": meet})]
    found = run(document(MOTORWAY, actors, rules, step=step), tmp_path / "run")
    end, van = found.instant("r", "ended"), found.tracks["van"]
    nodes = loaded(MOTORWAY).sumo.graph.lanes
    for name, x in (("ego", 640.0), ("van", 600.0)):
        wanted = float(nodes.x[np.argmin(np.hypot(nodes.x - x, nodes.y - van.y[0]))])
        place, _ = found.tracks[name].centre(end)
        assert abs(place - wanted) / 16.0 < 0.1
    last = _moving(van, end - 40.0 / 16.0 + step, end)
    assert last == pytest.approx(np.full(len(last), 16.0), abs=0.01)
    before = np.abs(np.diff(_moving(van, 1.5 + step, end - 40.0 / 16.0)))
    one_rate = np.abs(before - np.median(before)) < 0.01  # but where it turns
    assert np.count_nonzero(~one_rate) <= 2


@pytest.mark.slow
def test_a_walker_waits_and_arrives_at_its_speed(tmp_path: Path) -> None:
    actors, rules, _ = crossing_child()
    [ego, _] = actors
    ego["speed"] = 8.0
    place = node_at(TOWN, 270.0, 103.4)
    meet = {"at": [270.6, 101.4], "to": "ego", "when_at": place, "speed": 3.0, "steady": 0.9}
    rules[1]["then"], rules[1]["when"] = [{"arrive": meet}], {"time": {"after": 3.0}}
    found = run(document(TOWN, actors, rules, until=12.0), tmp_path / "run")
    end, child = found.instant("run", "ended"), found.tracks["child"]
    assert child.centre(end) == pytest.approx((270.6, 101.4), abs=0.08)
    step = float(child.time[child.time < end - 1e-6][-1])  # it stops within the one after
    metres = float(np.hypot(*np.subtract(child.centre(step), child.centre(step - 0.1))))
    assert metres == pytest.approx(0.3, abs=0.02)


def _moving(track: Track, begin: float, end: float) -> np.ndarray:
    return track.speed[(track.time > begin) & (track.time < end)]
