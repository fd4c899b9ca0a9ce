"""Rules in a run in slices: killed and resumed, it ends with the bytes of the run left alone."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from odscen.sumo.runner.long_runs import resume
from odscen.sumo.runner.run_jobs import run_prepared
from tests.sumo.conftest import start_killed_workers
from tests.sumo.runner.test_long_runs import results
from tests.sumo.story_case import document, node_at, prepared, read, walk_node_at

if TYPE_CHECKING:
    from pathlib import Path

    from odscen.sumo.runner.run_folder import SumoPreparedRun

TOWN = "town_5x5"
SLICE, UNTIL = 6.0, 24.0


def story() -> SumoPreparedRun:
    """At 6 s a child is on the road, a car brakes, another is between two lanes; rules wait."""
    actors: list[dict[str, Any]] = [
        {
            "id": "ego", "category": "car", "spawn": node_at(TOWN, 215.0, 103.4), "ego": True,
            "goal": node_at(TOWN, 390.0, 103.4), "initial_speed": 8.0,
        },
        {
            "id": "child", "category": "pedestrian", "spawn": walk_node_at(TOWN, 270.0, 100.5),
            "goal": walk_node_at(TOWN, 240.0, 109.5),
        },
        {
            "id": "van", "category": "van", "spawn": node_at(TOWN, 216.0, 190.1),
            "goal": node_at(TOWN, 295.0, 193.4), "initial_speed": 8.0, "speed": 9.0,
        },
    ]  # fmt: skip
    far = walk_node_at(TOWN, 270.0, 109.5)
    near = {"of": "ego", "place": [270.0, 103.4], "along": "lane", "below": 20.0}
    rules: list[dict[str, Any]] = [
        {"id": "wait", "actor": "child", "when": {"time": {"after": 0}}, "then": [{"stop": {}}]},
        {
            "id": "run", "actor": "child", "when": {"distance": near},
            "then": [{"walk": {"to": far, "speed": 2.0}}],
        },
        {
            "id": "over", "actor": "van", "when": {"time": {"after": 5.0}},
            "then": [
                {"together": [
                    {"lane": {"by": 1, "over": 2.5}}, {"speed": {"to": 4.0, "over": 3.0}},
                ]},
                {"brake": {"by": 2.0, "hold": 3.0}},
            ],
        },
        {
            "id": "late", "actor": "ego",
            "when": {"all": [
                {"rule": {"id": "over"}},
                {"travelled": {"above": 20.0}, "delay": 4.0},
            ]},
            "then": [{"speed": {"to": 2.0, "rate": 3.0}}, {"release": {}}],
        },
    ]  # fmt: skip
    return prepared(document(TOWN, actors, rules, until=UNTIL), slice_length=SLICE)


@pytest.fixture(scope="module")
def alone(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("story") / "run"
    assert run_prepared(story(), folder).status == "completed"
    return folder


@pytest.mark.slow
@pytest.mark.parametrize("number", [1, 2, 3])
def test_killed_after_any_slice_a_run_with_rules_ends_with_the_same_bytes(
    alone: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, number: int
) -> None:
    run = tmp_path / "run"
    with monkeypatch.context() as patch:
        start_killed_workers(patch)
        patch.setenv("KILL_AFTER_SLICE", str(number))
        assert run_prepared(story(), run).status == "failed"
    assert resume(run).status == "completed"
    assert results(run) == results(alone)


def test_slices_leave_no_trace_in_what_rules_do(alone: Path, tmp_path: Path) -> None:
    whole = story()
    plan = replace(whole.plan, slice_length=None)
    folder = tmp_path / "whole"
    assert run_prepared(replace(whole, plan=plan), folder).status == "completed"
    cut, one = read(alone), read(folder)
    said = [[event for event in told.events if event.rule] for told in (cut, one)]
    assert [(event.rule, event.kind) for event in said[0]] == [
        (event.rule, event.kind) for event in said[1]
    ]
    assert [event.time for event in said[0]] == pytest.approx(
        [event.time for event in said[1]], abs=1e-3
    )
    assert {"run", "over", "late"} <= {event.rule for event in said[0]}
    for name, until in (("child", 8.0), ("van", 12.0)):
        first, second = cut.tracks[name], one.tracks[name]
        seen = first.time < until
        assert np.array_equal(first.time[seen], second.time[second.time < until])
        assert first.x[seen] == pytest.approx(second.x[second.time < until], abs=1e-3)
        assert first.y[seen] == pytest.approx(second.y[second.time < until], abs=1e-3)
