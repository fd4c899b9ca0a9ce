"""Lights that models switch in real runs: any stage after any other, never without what is safe."""

from __future__ import annotations

from functools import cache
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np
import polars as pl
import pytest

from odscen import edit
from odscen.base.errors import InputError
from odscen.learning.behaviour.behaviour_model import BehaviourDoor
from odscen.learning.behaviour.signal_agent import PpoLearner, SignalAgent
from odscen.runs.recording import Recording
from odscen.runs.run_settings import RunSettings
from odscen.sumo.realize.lights.light_stages import (
    lights_from_json,
    lights_json,
    switched_lights,
)
from odscen.sumo.runner.prepare import prepare
from odscen.sumo.runner.run_jobs import run_prepared
from odscen.sumo.worker.behaviour.behaviour_doors import open_behaviour
from tests.sumo.story_case import document, entry, loaded
from tests.sumo.worker.behaviour.models import HERE

if TYPE_CHECKING:
    from pathlib import Path

    from odscen.runs.finished_run import Run
    from odscen.scenario.document.scenario_document import Scenario
    from odscen.sumo.realize.lights.light_stages import SwitchedLight

CROSSING = "signal_crossing"


@cache
def rush(until: float = 60.0, trips: int = 40) -> Scenario:
    graph = loaded(CROSSING).sumo.graph
    empty = edit.new_scenario(graph, name="rush", roi=graph.segments.ids)
    timed = edit.set_simulation(empty, duration=until)
    return edit.set_background(timed, graph, background="all", trips=trips)


def switched(out: Path, *, slices: float | None = None, until: float = 60.0, **door: Any) -> Run:
    settings = RunSettings(
        slice_length=slices,
        recording=Recording(emissions=False),
        behaviour=BehaviourDoor(**door) if door else None,
    )
    net = entry(CROSSING).checked("net")
    prepared = prepare(rush(until), loaded(CROSSING).sumo, net, settings=settings)
    return run_prepared(prepared, out)


def states(run: Run) -> list[tuple[float, str]]:
    """What the light of the crossing has shown: seconds, and the state from then on."""
    assert run.status == "completed", run.summary["error"]
    files = sorted(run.folder.glob("signal_states*/*.parquet")) or [
        run.folder / "signal_states.parquet"
    ]
    table = pl.concat([pl.read_parquet(file) for file in files]).sort("time")
    shown = list(zip(table["time"], table["state"], strict=True))
    return [shown[0], *(b for a, b in pairwise(shown) if a[1] != b[1])]


def light() -> SwitchedLight:
    (found,) = switched_lights(rush(), loaded(CROSSING).sumo)
    return found


def test_stages_ways_and_approaches_are_those_of_the_map() -> None:
    found = light()
    assert found.facts.stages == ("1", "2")
    assert found.facts.least_green == (8.0, 8.0)
    assert found.facts.change == ((0.0, 12.0), (12.0, 0.0))
    assert len(found.facts.lanes) == 12
    # Each lane with the one before it, where the road is widened.
    assert set(found.facts.lengths) == {124.95}
    assert all(sum(served) == 6 for served in found.facts.serves)
    assert lights_from_json(lights_json((found,))) == (found,)


def test_on_a_way_nothing_turns_green_and_what_ends_shows_yellow() -> None:
    found = light()
    for one, other in ((0, 1), (1, 0)):
        before, shown = found.facts.states[one], [state for _, state in found.ways[one][other]]
        assert any("y" in state for state in shown)
        for state in shown:
            for was, now in zip(before, state, strict=True):
                assert not (was == "r" and now in "gG")


@pytest.mark.slow
def test_a_light_is_switched_as_soon_as_it_may_and_by_its_way(tmp_path: Path) -> None:
    run = switched(tmp_path / "turns", name=f"{HERE}:InTurn")
    found, shown = light(), states(run)
    greens = [(time, state) for time, state in shown if state in found.facts.states]
    assert [state for _, state in greens[:3]] == [found.facts.states[k] for k in (0, 1, 0)]
    # Least green and change: a stage every 20 s.
    assert [b[0] - a[0] for a, b in pairwise(greens[:3])] == [20.0, 20.0]
    assert run.summary["behaviour"] == f"{HERE}:InTurn"


@pytest.mark.slow
def test_a_light_that_is_never_switched_stays_and_its_other_approaches_wait(tmp_path: Path) -> None:
    run = switched(tmp_path / "stays", name=f"{HERE}:Stubborn")
    assert states(run) == [(0.0, light().facts.states[0])]
    assert run.summary["actors"]["arrived"] < run.summary["actors"]["planned"]


@pytest.mark.slow
def test_a_run_in_slices_goes_on_with_the_change_that_a_slice_ended_in(tmp_path: Path) -> None:
    # A slice ends every 10 s, so within greens and within changes.
    run = switched(tmp_path / "slices", slices=10.0, name=f"{HERE}:InTurn")
    found, shown = light(), states(run)
    allowed = {state for row in found.ways for way in row for _, state in way}
    assert {state for _, state in shown} <= allowed | set(found.facts.states)
    greens = [(time, state) for time, state in shown if state in found.facts.states]
    assert len(greens) >= 2
    assert [b[0] - a[0] for a, b in pairwise(greens)] == [20.0, 20.0]


@pytest.mark.slow
@pytest.mark.parametrize("name", ["max-pressure", "signal-agent"])
def test_the_controls_that_ship_give_the_same_bytes_twice(tmp_path: Path, name: str) -> None:
    file = SignalAgent(PpoLearner(np.random.default_rng(1), updates=1).policy).save(
        tmp_path / "agent.npz"
    )
    options = {"agent": str(file)} if name == "signal-agent" else {}
    runs = [switched(tmp_path / str(k), name=name, options=options) for k in range(2)]
    assert len(states(runs[0])) > 3
    first, second = (run.folder / "trajectories.parquet" for run in runs)
    assert first.read_bytes() == second.read_bytes()


@pytest.mark.slow
def test_a_wrong_stage_fails_the_run_with_the_light_and_the_number(tmp_path: Path) -> None:
    run = switched(tmp_path / "wrong", name=f"{HERE}:Stubborn", options={"stage": 7.0})
    assert run.status == "failed"
    assert "Stubborn at 0 s: light 'J10001' has stages 0 to 1, not 7" in run.summary["error"]


def test_without_lights_a_control_is_refused() -> None:
    scenario = document("motorway_weave", [], [], until=5.0)
    sumo, net = loaded("motorway_weave").sumo, entry("motorway_weave").checked("net")
    settings = RunSettings(behaviour=BehaviourDoor(name="max-pressure"))
    with pytest.raises(InputError, match="map 'motorway_weave' has none with two stages"):
        prepare(scenario, sumo, net, settings=settings)


def test_half_a_control_and_a_file_that_is_no_agent_are_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"init_lights\(rng, scene\)"):
        open_behaviour(BehaviourDoor(name=f"{__name__}:Half"), 1)
    with pytest.raises(InputError, match="needs the file of an agent"):
        open_behaviour(BehaviourDoor(name="signal-agent"), 1)
    options = {"agent": str(tmp_path / "none.npz")}
    with pytest.raises(InputError, match=r"none\.npz: No such file"):
        open_behaviour(BehaviourDoor(name="signal-agent", options=options), 1)


class Half:
    def switch(self, seen: Any, state: Any) -> Any:
        raise NotImplementedError
