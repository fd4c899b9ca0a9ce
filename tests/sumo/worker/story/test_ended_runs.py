"""Runs that a rule ends: complete, in one piece or in slices, the same bytes each time."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import pytest

from tests.sumo.story_case import MIDDLE, RIGHT, document, prepared, run, told
from tests.sumo.worker.story.test_story_run import MOTORWAY, STEPS, after, fast

if TYPE_CHECKING:
    from pathlib import Path

    from odscen.scenario.document.scenario_document import Scenario


def ending(step: float, **parts: Any) -> Scenario:
    """A run of 20 s at the most; it ends when the van has slowed down to 10 m/s."""
    slow = after(1.23, {"speed": {"to": 5.0, "rate": 4.0}}, name="slow")
    when = {"speed": {"of": "van", "below": 10.0}}
    end = {"id": "over", "actor": "other", "when": when, "then": [{"end": {}}]}
    actors = [
        fast("van", 370.0, MIDDLE),
        fast("other", 420.0, RIGHT),
        fast("late", 370.0, RIGHT, depart=15.0),
    ]
    return document(MOTORWAY, actors, [slow, end], step=step, **parts)


@pytest.mark.parametrize("step", STEPS)
def test_a_rule_ends_the_run_with_the_step_in_which_it_fires(tmp_path: Path, step: float) -> None:
    found = run(ending(step), tmp_path / "run")
    instant = 1.23 + 10.0 / 4.0
    assert found.instant("over") == pytest.approx(instant, abs=step)  # speeds are means of steps
    assert [one.detail for one in found.of_rule("over", "acted")] == ["ends the run"]
    van = found.tracks["van"]
    assert van.time[-1] <= found.instant("over") < van.time[-1] + step
    assert "late" not in found.tracks
    summary = json.loads((tmp_path / "run" / "summary.json").read_text())
    assert (summary["status"], summary["stopped"]) == ("completed", False)
    assert summary["sim_seconds"] == pytest.approx(van.time[-1] + step)
    assert summary["actors"]["inserted"] == 2


@pytest.mark.slow
def test_a_run_that_a_rule_ends_is_the_same_twice_and_ends_in_its_slice(tmp_path: Path) -> None:
    whole = [run(ending(0.1), tmp_path / name).folder for name in ("a", "b")]
    for name in ("events.json", "actors.json", "trajectories.parquet"):
        one, other = ((folder / name).read_bytes() for folder in whole)
        assert one == other
    sliced = told(prepared(ending(0.1), slice_length=2.0), tmp_path / "c")
    assert sliced.tracks["van"].time[-1] == pytest.approx(3.7)
    assert sliced.instant("over") == pytest.approx(3.73, abs=0.1)
