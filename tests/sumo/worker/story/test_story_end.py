"""The run of a scene ends some seconds after its story, and is judged by its criteria."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import pytest

from odscen.figures.judging.criteria import awaited_actors, criteria_of
from odscen.runs.run_settings import RunSettings
from odscen.scenario.document.json_form import dumps, loads
from odscen.scenario.document.rules_document import StoryRule
from odscen.scenario.story.rule_states import RuleState, Running
from odscen.scenario.story.story_end import story_has_ended
from tests.sumo.story_case import MIDDLE, RIGHT, document, node_at, prepared, run, told
from tests.sumo.worker.story.test_story_run import MOTORWAY, STEPS, after, fast

if TYPE_CHECKING:
    from pathlib import Path

    from odscen.scenario.document.scenario_document import Scenario
    from tests.sumo.story_case import Told

ARRIVES = 60.0
"""Seconds in which every car of the motorway has arrived."""


def scene(rules: list[dict[str, Any]], *, after_story: Any = "auto", **parts: Any) -> Scenario:
    """Two cars on a motorway for ten minutes at the most."""
    actors = parts.pop("actors", [fast("van", 370.0, MIDDLE), fast("other", 420.0, RIGHT)])
    made = document(MOTORWAY, actors, rules, until=600.0, **parts)
    data = json.loads(dumps(made))
    data["simulation"]["after_story"] = after_story
    return loads(json.dumps(data))


def end_of(found: Told) -> float:
    return float(json.loads((found.folder / "summary.json").read_text())["sim_seconds"])


SLOWER = after(1.0, {"speed": {"to": 10.0, "over": 2.0}}, actor="van", name="slow")


@pytest.mark.slow
@pytest.mark.parametrize("step", STEPS)
def test_a_scene_ends_ten_seconds_after_its_last_rule(tmp_path: Path, step: float) -> None:
    """The rule is over at 3.0 s; the run ends with the step in which 13.0 s are over."""
    found = run(scene([SLOWER], step=step), tmp_path / "run")
    [ended] = [one for one in found.events if one.kind == "story_ended"]
    assert found.instant("slow", "ended") == pytest.approx(3.0, abs=1e-6)
    assert ended.time == pytest.approx(3.0, abs=step + 1e-6)
    assert end_of(found) == pytest.approx(ended.time + 10.0, abs=step + 1e-6)
    summary = json.loads((found.folder / "summary.json").read_text())
    assert (summary["status"], summary["stopped"], summary["scene"]) == ("completed", False, True)
    assert summary["usable"] == {"level": "usable", "headline": "usable", "reasons": []}


@pytest.mark.slow
@pytest.mark.parametrize(
    ("after_story", "least", "most"),
    [(2.0, 5.0, 5.2), (0.0, 3.0, 3.2), ("never", 20.0, ARRIVES)],
)
def test_how_long_a_run_goes_on_is_said(
    tmp_path: Path, after_story: Any, least: float, most: float
) -> None:
    found = run(scene([SLOWER], after_story=after_story), tmp_path / "run")
    assert least <= end_of(found) <= most


def test_a_run_with_traffic_is_one_of_traffic() -> None:
    """Its plan has none of the fields, and it goes on."""
    flow = {"id": "f", "spawn": node_at(MOTORWAY, 700.0, MIDDLE), "per_hour": 60.0, "end": 60.0}
    made = scene([SLOWER], flows=[flow])
    assert not made.is_scene
    plan = prepared(made).plan
    assert (plan.scene, plan.after_story, plan.awaits) == (False, None, ())
    assert not {"scene", "after_story", "awaits"} & set(json.loads(plan.to_json()))
    assert RunSettings(after_story=3.0).settle_time(made) == 3.0
    assert RunSettings(meso=True).settle_time(scene([SLOWER])) is None


@pytest.mark.slow
def test_what_criteria_ask_about_arrivals_is_awaited(tmp_path: Path) -> None:
    made = scene([SLOWER], criteria=["arrived(other) == 1", "collided == 0"])
    assert prepared(made).plan.awaits == ("other",)
    found = run(made, tmp_path / "run")
    [arrived] = [one for one in found.events if one.kind == "arrived" and one.actor == "other"]
    assert end_of(found) > arrived.time > 13.0
    summary = json.loads((found.folder / "summary.json").read_text())
    assert [row["passed"] for row in summary["criteria"]] == [True, True]
    everyone = awaited_actors(criteria_of(["mean_delay <= 40 s"]), made)
    assert everyone == ("van", "other")


@pytest.mark.slow
def test_a_rule_that_never_fires_is_awaited_while_somebody_drives(tmp_path: Path) -> None:
    """It waits for a speed that is not reached: the run ends when both have arrived."""
    never = {"id": "never", "actor": "van", "when": {"speed": {"above": 90.0}},
             "then": [{"brake": {"by": 2}}]}  # fmt: skip
    found = run(scene([SLOWER, never]), tmp_path / "run")
    assert end_of(found) > 20.0
    assert not [one for one in found.events if one.kind == "story_ended"]


@pytest.mark.slow
def test_when_nobody_has_moved_for_a_minute_the_story_has_ended(tmp_path: Path) -> None:
    """Both brake from 2 s on and stand; what waits for a place that they do not reach is over."""
    stop = [after(2.0, {"brake": {"by": 5.0}}, actor=one, name=f"stop-{one}")
            for one in ("van", "other")]  # fmt: skip
    never = {"id": "never", "actor": "van", "when": {"travelled": {"above": 500.0}},
             "then": [{"go": {}}]}  # fmt: skip
    found = run(scene([*stop, never]), tmp_path / "run")
    [ended] = [one for one in found.events if one.kind == "story_ended"]
    standing = max(float(one.time[one.speed > 0.1][-1]) for one in found.tracks.values())
    assert ended.time == pytest.approx(standing + 60.0, abs=1.5)
    assert ended.detail == "no road user moves any more"
    assert end_of(found) == pytest.approx(ended.time + 10.0, abs=0.2)
    whole, sliced = found.events, told(prepared(scene([*stop, never]), slice_length=20.0),
                                       tmp_path / "sliced")  # fmt: skip
    assert end_of(sliced) == end_of(found)
    assert [one for one in sliced.events if one.rule] == [one for one in whole if one.rule]


def rule(name: str, when: dict[str, Any], *then: dict[str, Any], times: int = 1) -> StoryRule:
    data = {"id": name, "actor": "a", "when": when, "then": list(then) or [{"go": {}}]}
    return StoryRule.model_validate(data | {"times": times})


NEAR = {"distance": {"to": "b", "below": 5.0}}
FIRED = RuleState(fired=1, started=[1.0], ended=[2.0])


@pytest.mark.parametrize(
    ("when", "gone", "still", "ended"),
    [
        (NEAR, "", False, False),
        (NEAR, "b", False, True),
        (NEAR, "", True, True),
        ({"any": [NEAR, {"time": {"after": 99.0}}]}, "b", True, False),
        ({"all": [NEAR, {"time": {"after": 99.0}}]}, "b", False, True),
        ({"rule": {"id": "first"}}, "", True, False),
        ({"rule": {"id": "none"}}, "", False, True),
        ({"rule": {"id": "second"}}, "", False, True),  # it waits for itself
        ({"stopped": {"of": "b", "seconds": 90.0}}, "", True, False),
        ({"stopped": {"of": "b", "seconds": 5.0}}, "", True, True),
        ({"not": NEAR}, "b", True, False),
    ],
)
def test_a_rule_can_fire_as_long_as_its_condition_can_come_true(
    when: dict[str, Any], gone: str, still: bool, ended: bool
) -> None:
    rules = {one.id: one for one in (rule("first", NEAR), rule("second", when))}
    states = {"first": FIRED, "second": RuleState()}
    assert ended is story_has_ended(
        rules, states, now=9.0, gone=lambda name: name == gone, still=still
    )


def test_what_has_no_end_of_its_own_does_not_hold_the_story_up() -> None:
    keeps = rule("keeps", NEAR, {"keep_gap": {"to": "b", "metres": 10.0}})
    parked = rule("parked", NEAR, {"replay": {"rows": [[0, 1, 2, 0], [3600, 1, 2, 0]]}})
    drives = rule("drives", NEAR, {"replay": {"rows": [[0, 1, 2, 0], [3600, 9, 2, 0]]}})
    for one, end, ended in ((keeps, float("inf"), True), (keeps, 12.0, False),
                            (parked, 3600.0, True), (drives, 3600.0, False)):  # fmt: skip
        state = RuleState(fired=1, item=0, running=[Running(0, end)], started=[0.0])
        found = story_has_ended(
            {one.id: one}, {one.id: state}, now=5.0, gone=lambda _: False, still=False
        )
        assert found is ended
