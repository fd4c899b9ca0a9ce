"""Traffic that is driven before a scenario begins: queues where lights are red, and by seed."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from odscen.app.generation import generate
from odscen.app.generators import GeneratorDoor
from odscen.app.learned.snapshot_data import light_logs
from odscen.app.light_moments import draw_moment, signals_at
from odscen.app.maps import load_map
from odscen.app.moving_starts import warm_up_scenario
from odscen.app.running.batches import run_all
from odscen.app.running.runs import check_run
from odscen.app.scenarios import read_scenario
from odscen.base.errors import InputError
from odscen.learning.traffic_snapshots import SignalAhead
from odscen.maps.store import Workspace
from odscen.runs.run_settings import RunSettings
from odscen.scenario.placing.region import Region, place_of
from odscen.scenario.sampling.generation_settings import GenerationSettings
from odscen.sumo.realize.signals_ahead import lights_at, lights_at_start
from tests.app.conftest import CROSSING

SETTINGS = GenerationSettings(map_name=CROSSING, seed=4, count=3, fill=0.3)


def generated(workspace: Workspace, out: Path, seconds: float) -> list[Path]:
    door = GeneratorDoor("reference", warm_up=seconds)
    return generate(workspace, settings=SETTINGS, out=out, generator=door)


@pytest.mark.parametrize("seconds", [0.0, pytest.param(45.0, marks=pytest.mark.slow)])
def test_nobody_goes_at_a_stop_line_that_has_been_red_for_a_while(
    workspace: Workspace, tmp_path: Path, seconds: float
) -> None:
    loaded = load_map(workspace.map(CROSSING))
    lanes, at_red = loaded.sumo.graph.lanes, []
    for file in generated(workspace, tmp_path, seconds):
        scenario = read_scenario(file)
        lights = lights_at_start(loaded.sumo, scenario.signals)
        for actor in scenario.actors:
            place = place_of(loaded.sumo.graph, actor.spawn)
            assert place is not None
            if place.walk:
                continue
            lane = int(lanes.lane[place.node])
            to_line = lanes.lanes.lengths[lane] - lanes.offset[place.node]
            red = lights.state[lane] == SignalAhead.RED and lights.since[lane] >= 5.0
            if red and to_line < 10.0:
                at_red.append(actor.initial_speed or 0.0)
    assert len(at_red) >= 6
    assert max(at_red) <= 2.0


@pytest.mark.parametrize("moment", [5.0, 30.0, 3599.0])
def test_lights_show_after_a_warm_up_what_they_show_when_the_scenario_begins(
    workspace: Workspace, tmp_path: Path, moment: float
) -> None:
    loaded = load_map(workspace.map(CROSSING))
    region = Region.of(loaded.sumo.graph, loaded.sumo.graph.segments.ids)
    shown = []
    for seconds, signals in (
        (37.0, signals_at(loaded, moment - 37.0)),
        (1.0, signals_at(loaded, moment)),
    ):
        scenario = warm_up_scenario(
            loaded, region, (), density=5.0, seconds=seconds, seed=1, signals=signals
        )
        checked = check_run(
            workspace, scenario, name=f"{seconds}", out=tmp_path, settings=RunSettings(warm_up=0.0)
        )
        (run,) = run_all([checked], reports=False, figures=False)
        at = seconds if seconds > 1.0 else 0.0
        shown.append(lights_at(loaded.sumo, light_logs(run), at).state)
    begins = lights_at_start(loaded.sumo, signals_at(loaded, moment)).state
    assert (begins != SignalAhead.NONE).sum() >= 4
    np.testing.assert_array_equal(shown[0], begins)
    np.testing.assert_array_equal(shown[1], begins)


def test_scenarios_begin_at_moments_of_their_own_and_the_same_seed_at_the_same(
    workspace: Workspace, tmp_path: Path
) -> None:
    one, other = (generated(workspace, tmp_path / name, 0.0) for name in ("one", "other"))
    assert [file.read_bytes() for file in one] == [file.read_bytes() for file in other]
    signals = [read_scenario(file).signals for file in one]
    loaded = load_map(workspace.map(CROSSING))
    assert signals == [signals_at(loaded, draw_moment(seed)) for seed in (4, 5, 6)]
    assert len({scenario.junctions[0].offset for scenario in signals}) == 3


@pytest.mark.slow
def test_a_warm_up_keeps_about_as_many_vehicles_and_all_pedestrians(
    workspace: Workspace, tmp_path: Path
) -> None:
    placed, driven, again = (
        [read_scenario(file) for file in generated(workspace, tmp_path / name, seconds)]
        for name, seconds in (("placed", 0.0), ("driven", 60.0), ("again", 60.0))
    )
    assert driven == again
    for before, after in zip(placed, driven, strict=True):
        vehicles, walkers = (
            [sum((actor.category == "pedestrian") is walks for actor in scenario.actors)
             for scenario in (before, after)]
            for walks in (False, True)
        )  # fmt: skip
        assert walkers[0] == walkers[1]
        assert 0.8 * vehicles[0] <= vehicles[1] <= 1.1 * vehicles[0]
        spawns = [{actor.spawn for actor in scenario.actors} for scenario in (before, after)]
        assert len(spawns[0] & spawns[1]) < 0.7 * len(spawns[0])
        assert before.signals == after.signals


@pytest.mark.parametrize("seconds", [-1.0, 3601.0, float("nan")])
def test_an_impossible_warm_up_is_refused(
    workspace: Workspace, tmp_path: Path, seconds: float
) -> None:
    with pytest.raises(InputError, match="a warm-up takes 0 to 3600 s"):
        generated(workspace, tmp_path, seconds)
