"""Every kind of condition and of action in one run in slices, killed and resumed.

Six seconds a slice: rules wait, act and are over on either side of the boundaries.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest

from odscen.scenario.document.rules_document import rule_parts
from odscen.scenario.story.action_kinds import ACTIONS
from odscen.scenario.story.condition_kinds import CONDITIONS
from odscen.sumo.runner.long_runs import resume
from odscen.sumo.runner.run_jobs import run_prepared
from tests.sumo.conftest import start_killed_workers
from tests.sumo.runner.test_long_runs import results
from tests.sumo.story_case import document, node_at, prepared, read, walk_node_at

if TYPE_CHECKING:
    from pathlib import Path

    from odscen.scenario.document.scenario_document import Scenario

TOWN, LIGHT = "town_5x5", "10002"
SLICE, UNTIL = 6.0, 24.0
EAST, LEFT_LANE, RIGHT_LANE = 103.4, 193.4, 190.1
"""y of lanes that lead east: of a street with one of them, and of one with two."""
ROWS = [[0.1 * k, 250.0 - 0.8 * k + 0.002 * k * k, 106.6, 3.14159265] for k in range(121)]
"""A car that drives west and slows down, for 12 s."""


def _car(name: str, x: float, y: float, **fields: Any) -> dict[str, Any]:
    goal = node_at(TOWN, 390.0, EAST) if y == EAST else node_at(TOWN, 295.0, LEFT_LANE)
    usual = {"category": "car", "goal": goal, "initial_speed": 8.0, "speed": 9.0}
    return {"id": name, "spawn": node_at(TOWN, x, y), **usual, **fields}


def _walker(name: str, x: float, y: float = 100.5) -> dict[str, Any]:
    return {
        "id": name, "category": "pedestrian", "spawn": walk_node_at(TOWN, x, y),
        "goal": walk_node_at(TOWN, 240.0, 109.5),
    }  # fmt: skip


def _rule(name: str, actor: str, when: dict[str, Any], *then: dict[str, Any]) -> dict[str, Any]:
    return {"id": name, "actor": actor, "when": when, "then": list(then)}


def _after(seconds: float) -> dict[str, Any]:
    return {"time": {"after": seconds}}


def scenario() -> Scenario:
    """Twelve road users, each led by rules that begin at one of the kinds."""
    actors = [
        _car("ego", 215.0, EAST, ego=True),
        _car("tail", 214.0, RIGHT_LANE),
        _car("van", 246.0, RIGHT_LANE, category="van"),
        _car("cutter", 232.0, LEFT_LANE, initial_speed=9.0),
        _car("late", 212.0, LEFT_LANE, initial_speed=4.0),
        _car("taxi", 345.0, EAST, initial_speed=0.0),
        _car("gone", 372.0, EAST, initial_speed=4.0, driver="story"),
        {"id": "tape", "category": "car", "spawn": node_at(TOWN, 250.0, 106.6, hdg=3.1416)},
        _walker("child", 270.0),
        _walker("other", 280.0),
        _walker("drawn", 290.0),
        _walker("guest", 230.0),
    ]  # fmt: skip
    far = walk_node_at(TOWN, 270.0, 109.5)
    ego_near = {"of": "ego", "place": [270.0, EAST], "along": "lane", "below": 25.0}
    green = {"light": LIGHT, "movement": "r2>r3"}
    met = walk_node_at(TOWN, 280.0, 100.5)
    straight_on = node_at(TOWN, 280.0, LEFT_LANE)
    rules = [
        _rule("wait", "child", _after(0.0), {"stop": {}}),
        _rule("run", "child", {"distance": ego_near}, {"walk": {"to": far, "speed": 1.2}}),
        _rule("drawn", "drawn", _after(3.1),
              {"path": {"points": [[285.0, 104.0], met], "times": [4.0, 8.0]}}),
        _rule("stays", "other", {"appeared": {}}, {"stop": {}}),
        _rule("touch", "other", {"touched": {"to": "drawn"}}, {"go": {}}),
        _rule("goal", "guest", {"travelled": {"above": 3.0}},
              {"goal": {"to": walk_node_at(TOWN, 222.0, 100.5)}}),
        _rule("tape", "tape", _after(1.05), {"replay": {"rows": ROWS}}),
        _rule("aside", "ego", {"all": [{"speed": {"above": 3.0}}, _after(2.0)]},
              {"offset": {"to": -2.6, "over": 2.0}}, {"offset": {"to": 0.0, "over": 2.0}}),
        _rule("off", "ego", {"off_road": {}}, {"horn": {}}),
        _rule("cut", "cutter", {"ttc": {"of": "cutter", "to": "van", "above": 0.0}, "delay": 2.5},
              {"cut_in": {"to": "tail", "over": 3.0}}),
        _rule("gap", "tail", {"headway": {"to": "van", "above": 0.1}},
              {"keep_gap": {"to": "van", "metres": 12.0, "lasting": 9.0}}),
        _rule("blink", "van", {"relative_speed": {"to": "tail", "above": -50.0}},
              {"lights": {"indicator": "left"}}, {"ignore": {"right_of_way": True}},
              {"lane": {"to": straight_on, "over": 2.0}}, {"speed": {"to": 4.0, "over": 3.0}},
              {"brake": {"by": 2.0, "hold": 3.0}}),
        _rule("free", "van",
              {"stopped": {"seconds": 0.5}, "edge": "rising"},
              {"drive": {"by": "story"}}, {"release": {}}),
        _rule("comes", "late", {"any": [{"rule": {"id": "blink", "has": "started"}, "delay": 5.5},
                                        {"speed": {"of": "ego", "above": 90.0}}]},
              {"appear": {}}, {"speed": {"to": 6.0, "rate": 1.0}}),
        _rule("meets", "late", {"all": [{"rule": {"id": "comes"}},
                                        {"acceleration": {"above": -50.0}}]},
              {"arrive": {"at": node_at(TOWN, 242.0, LEFT_LANE), "to": "ego",
                          "when_at": node_at(TOWN, 296.0, EAST)}}),
        _rule("leaves", "gone", {"not": {"reaches": {"place": [0.0, 0.0]}}, "delay": 7.2},
              {"vanish": {}}),
        _rule("dark", "taxi", {"signal": {**green, "shows": "green"}},
              {"signal": {"light": LIGHT, "shows": "off"}}),
        _rule("light", "taxi", {"all": [{"rule": {"id": "dark"}}, _after(13.0)]},
              {"signal": {"light": LIGHT, "shows": "program"}}, {"signal": green}),
        _rule("end", "taxi", _after(UNTIL - 0.4), {"end": {}}),
    ]  # fmt: skip
    return document(TOWN, actors, rules, until=UNTIL)


@pytest.fixture(scope="module")
def alone(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("kinds") / "run"
    assert run_prepared(prepared(scenario(), slice_length=SLICE), folder).status == "completed"
    return folder


def test_every_condition_and_every_action_is_used_and_none_fails(alone: Path) -> None:
    rules = scenario().rules
    used = [part for rule in rules for part in rule_parts(rule, "")]
    own = {"own"}  # of packages: tests/sumo/runner/test_own_kinds_in_slices.py
    assert {one.kind for one in used if ".when" in one.where} == set(CONDITIONS) - own
    assert {one.kind for one in used if ".then" in one.where} == set(ACTIONS) - own
    events = read(alone).events
    assert [one for one in events if one.kind == "rule_failed"] == []
    started = {one.rule for one in events if one.kind == "rule_started"}
    assert started == {rule.id for rule in rules}
    over = {one.rule for one in events if one.kind in ("rule_ended", "rule_overridden")}
    assert {rule.id for rule in rules} - over == set()


@pytest.mark.slow
@pytest.mark.parametrize("number", [1, 2, 3])
def test_killed_after_any_slice_it_ends_with_the_same_bytes(
    alone: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, number: int
) -> None:
    run = tmp_path / "run"
    with monkeypatch.context() as patch:
        start_killed_workers(patch)
        patch.setenv("KILL_AFTER_SLICE", str(number))
        assert run_prepared(prepared(scenario(), slice_length=SLICE), run).status == "failed"
    assert resume(run).status == "completed"
    assert results(run) == results(alone)
