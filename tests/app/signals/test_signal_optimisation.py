"""Lights timed after the demand of scenarios."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from odscen.app.demand.demands import add_background
from odscen.app.maps import load_map
from odscen.app.signals.program_editing import take_over_program
from odscen.app.signals.signal_optimisation import time_signals
from odscen.app.signals.signal_plans import signal_programs
from odscen.base.errors import InputError, NotFoundError
from odscen.maps.store import Workspace
from odscen.scenario import edits
from odscen.scenario.document.scenario_document import MapReference
from odscen.scenario.edits.edit_registry import changed_part
from odscen.sumo.calibrate.light_timing import with_timings
from odscen.sumo.realize.realization import realize
from tests.signal_case import MAP, ROOT, crossing, one_plan, program, scenario

if TYPE_CHECKING:
    from odscen.scenario.document.scenario_document import Scenario


@pytest.fixture(scope="module")
def workspace(tmp_path_factory: pytest.TempPathFactory) -> Workspace:
    store = Workspace.open(tmp_path_factory.mktemp("workspace"))
    store.add_map(MAP)
    store.add_map(ROOT / "maps" / "t_junction_signs.xodr")
    return store


def placed(workspace: Workspace, one: Scenario, name: str = "signal_crossing") -> Scenario:
    sha256 = workspace.map(name).info["sha256"]
    return one.model_copy(update={"map": MapReference(name=name, sha256=sha256)})


@pytest.mark.slow
def test_volumes_are_those_of_the_vehicles_of_a_run(workspace: Workspace) -> None:
    one = placed(workspace, scenario(None, vehicles=360.0))
    planned = realize(one, crossing().sumo).plan.actors
    departs = [actor.depart for actor in planned if actor.category != "pedestrian"]
    timed = time_signals(workspace, one)
    (light,) = timed.lights
    assert (timed.begin, timed.end) == (0.0, 600.0)
    assert sum(m.vehicles for m in light.movements) == pytest.approx(6 * len(departs))
    assert sum(lane.load.volume for lane in light.lanes) == pytest.approx(6 * len(departs))
    (light,) = time_signals(workspace, one, begin=100.0, end=200.0).lights
    inside = sum(100.0 <= depart < 200.0 for depart in departs)
    assert sum(m.vehicles for m in light.movements) == pytest.approx(36 * inside)


def test_turns_through_gaps_wait_for_the_queue_that_comes_towards_them(
    workspace: Workspace,
) -> None:
    (light,) = time_signals(workspace, placed(workspace, scenario(None, vehicles=500.0))).lights
    loads = {lane.load.lane: lane.load for lane in light.lanes}
    left = next(one for one in loads.values() if one.turns == ("left",) and "1.0" in one.lane)
    queue = max(one.ratio for one in loads.values() if one.lane.startswith("3.") and one != left
                and one.turns != ("left",))  # fmt: skip
    gaps = left.volume / left.saturation
    assert queue > 0.05
    assert left.blocked == pytest.approx(queue)
    assert left.ratio == pytest.approx(queue + (1.0 - queue) * gaps)
    assert light.splits.ratios[0] >= left.ratio
    assert all(one.blocked == 0.0 for one in loads.values() if one.turns != ("left",))


def test_cars_keep_off_the_lanes_of_bicycles(workspace: Workspace) -> None:
    """Lane -3 of each leg is for bicycles: it carried half of the cars that went straight on."""
    one = placed(workspace, scenario(None, vehicles=500.0))
    flow = one.flows[0]
    riders = flow.model_copy(update={"id": "riders", "per_hour": 120.0, "mix": {"bicycle": 1.0}})
    mixed = one.model_copy(update={"flows": (*one.flows, riders)})
    loads = {
        name: {
            lane.load.lane: lane.load.volume
            for lane in time_signals(workspace, two).lights[0].lanes
        }
        for name, two in (("cars", one), ("mixed", mixed))
    }
    assert not [lane for lane in loads["cars"] if lane.endswith("-3")]
    beside = {lane: volume for lane, volume in loads["mixed"].items() if lane.endswith("-3")}
    assert 0.0 < sum(beside.values()) <= 120.0
    assert len(beside) == 1


def test_greens_of_the_map_and_of_a_program_are_replaced_and_add_up(workspace: Workspace) -> None:
    for junction in (None, one_plan(cycle=None, on_call=None)):
        one = placed(workspace, scenario(junction, vehicles=500.0))
        (light,) = time_signals(workspace, one).lights
        new = time_signals(workspace, one).scenario
        (shown,) = signal_programs(workspace, new)
        assert shown.plans[0].cycle == pytest.approx(light.times.cycle)
        assert [p.seconds for p in shown.plans[0].phases if p.stage] == list(light.times.green)
        assert light.times.green != light.before.green
        assert 40.0 <= light.times.cycle <= 120.0
        for stage, phase in zip(light.times.stages, light.times.green, strict=True):
            assert phase >= 6.0, stage


def test_of_plans_of_the_day_the_one_of_the_interval_is_timed(workspace: Workspace) -> None:
    one = placed(workspace, scenario(program(), clock=19 * 3600.0, vehicles=400.0))
    timed = time_signals(workspace, one)
    (junction,) = timed.scenario.signals.junctions
    (before,) = one.signals.junctions
    assert timed.lights[0].times.plan == "evening"
    assert junction.plans[0] == before.plans[0]
    assert junction.plans[1].cycle == timed.lights[0].times.cycle
    assert junction.stages == before.stages


def test_more_traffic_than_greens_carry_is_named(workspace: Workspace) -> None:
    heavy = placed(workspace, scenario(None, vehicles=3000.0))
    timed = time_signals(workspace, heavy)
    assert timed.oversaturated == ("10001",)
    assert timed.lights[0].times.cycle == 120.0
    assert timed.to_dict()["lights"][0]["cycle_wanted"] is None
    light = placed(workspace, scenario(None, vehicles=60.0))
    assert time_signals(workspace, light).oversaturated == ()


def test_without_vehicles_or_lights_nothing_is_timed(workspace: Workspace) -> None:
    one = placed(workspace, scenario(None))
    with pytest.raises(InputError, match="no vehicle that departs between 0 and 600 s"):
        time_signals(workspace, one.model_copy(update={"flows": ()}))
    with pytest.raises(InputError, match="'t_junction_signs' has no traffic lights"):
        time_signals(workspace, placed(workspace, one, "t_junction_signs"))
    with pytest.raises(NotFoundError, match="10001"):
        time_signals(workspace, one, junctions=["9"])


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"begin": 500.0, "end": 700.0}, "500 to 700 s is no part of the scenario"),
        ({"bounds": (90.0, 60.0)}, "shortest cycle of 90 s"),
        ({"saturation": 0.0}, "saturation flow of 0"),
    ],
)
def test_settings_that_cannot_be_are_refused(
    workspace: Workspace, settings: dict[str, float], message: str
) -> None:
    with pytest.raises(InputError, match=message):
        time_signals(workspace, placed(workspace, scenario(None)), **settings)  # type: ignore[arg-type]


@pytest.mark.slow
def test_lights_of_a_coordination_whose_cycles_differ_get_one(workspace: Workspace) -> None:
    """As when one of them has got an arrow, and with it a longer cycle."""
    workspace.add_map(ROOT / "maps" / "town_5x5.xodr")
    loaded = load_map(workspace.map("town_5x5"))
    town = edits.new_scenario(loaded.sumo.graph, name="town", roi=loaded.sumo.graph.segments.ids)
    town = add_background(workspace, town, name="all", per_km=30.0)
    junctions = [light.names[0] for light in loaded.lights[:2]]
    for name in junctions:
        town = take_over_program(workspace, town, name)
    cycles = [plan.cycle for light in signal_programs(workspace, town)[:2] for plan in light.plans]
    assert cycles == [40.0, 46.0]
    town = with_timings(town, [
        changed_part(one, {"coordination": "Avenue", "cycle": cycle})
        for one, cycle in zip(town.signals.junctions, cycles, strict=True)
    ])  # fmt: skip
    timed = time_signals(workspace, town, junctions=junctions[:1]).scenario
    assert len({timing.cycle for timing in timed.signals.junctions}) == 1
    shown = {light.plans[0].cycle for light in signal_programs(workspace, timed)[:2]}
    assert shown == {timed.signals.junctions[0].cycle}
