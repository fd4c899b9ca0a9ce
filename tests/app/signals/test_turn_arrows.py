"""Protected stages beside permissive ones, for turns whose volumes ask for them."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING

import polars as pl
import pytest

from odscen.app.demand.demands import add_background
from odscen.app.maps import load_map
from odscen.app.signals.signal_optimisation import time_signals
from odscen.app.signals.signal_plans import signal_programs
from odscen.app.signals.turn_arrows import PRODUCTS, with_turn_arrows
from odscen.base.errors import InputError
from odscen.maps.store import Workspace
from odscen.scenario import edits
from odscen.scenario.document.scenario_document import MapReference
from odscen.sumo.calibrate.turning_volumes import planned_vehicles, turning_volumes
from tests.signal_case import (
    JUNCTION,
    MAP,
    ROOT,
    carried_out,
    entries,
    light,
    one_plan,
    scenario,
)

if TYPE_CHECKING:
    from pathlib import Path

    from odscen.scenario.document.scenario_document import Scenario
    from odscen.scenario.document.signals_document import JunctionTiming


@pytest.fixture(scope="module")
def workspace(tmp_path_factory: pytest.TempPathFactory) -> Workspace:
    store = Workspace.open(tmp_path_factory.mktemp("workspace"))
    store.add_map(MAP)
    store.add_map(ROOT / "maps" / "town_5x5.xodr")
    return store


def placed(workspace: Workspace, one: Scenario) -> Scenario:
    sha256 = workspace.map("signal_crossing").info["sha256"]
    return one.model_copy(update={"map": MapReference(name="signal_crossing", sha256=sha256)})


def main_road(workspace: Workspace, major: float, minor: float, control: str = "fixed") -> Scenario:
    """Vehicles an hour on each leg of the main road (1 and 3), and of the side road."""
    one = placed(workspace, scenario(None, control=control, walkers=0.0))
    spawns = entries()
    volumes = {spawns[n]: major if n in (0, 2) else minor for n in range(4)}
    flows = tuple(f.model_copy(update={"per_hour": volumes[f.spawn]}) for f in one.flows)
    return one.model_copy(update={"flows": flows})


def timing(one: Scenario) -> JunctionTiming:
    (found,) = one.signals.junctions
    return found


@pytest.mark.slow
def test_turns_get_an_arrow_where_the_product_of_volumes_asks_for_it(workspace: Workspace) -> None:
    one = main_road(workspace, 700.0, 200.0)
    new, arrows = with_turn_arrows(workspace, one)
    assert [(a.junction, a.approach, a.turn, a.lanes) for a in arrows] == [
        (JUNCTION, "r1", "left", 1),
        (JUNCTION, "r3", "left", 1),
    ], "bicycles beside the lane of cars are no opposing lane"
    assert any(a.vehicles * a.opposing > PRODUCTS[1] for a in arrows)
    stages = timing(new).stages
    assert len(stages) == 3
    assert (stages[1].permissive, stages[1].green, stages[1].on_call) == ((), 6.0, False)
    arrow = set(stages[1].protected)
    assert arrow <= set(stages[0].permissive), "the arrow lags"
    lefts = {m for g in timing(new).groups if g.id in arrow for m in g.movements}
    assert lefts == {"r1 left", "r3 left"}


def test_all_who_drive_against_a_turn_are_counted_whichever_lanes_they_may_take(
    workspace: Workspace,
) -> None:
    """Lanes for bicycles beside those for cars carry the same turns, and not all of them meet."""
    one = main_road(workspace, 700.0, 200.0)
    _, arrows = with_turn_arrows(workspace, one)
    sumo = load_map(workspace.map("signal_crossing")).sumo
    vehicles = [*planned_vehicles(one, sumo)]
    volumes = turning_volumes(vehicles, duration=one.simulation.duration).by_turn
    legs = {
        f"r{n}": {t: v.vehicles for t, v in volumes.items() if t.source == f"{n}.1.f"}
        for n in (1, 3)
    }
    opposite = {"r1": "r3", "r3": "r1"}
    for arrow in arrows:
        against = sum(legs[opposite[arrow.approach]].values())
        mates = next(a.vehicles for a in arrows if a.approach == opposite[arrow.approach])
        assert arrow.opposing == pytest.approx(against - mates), "straight on and to the right"
        assert arrow.vehicles in legs[arrow.approach].values()


def test_with_few_vehicles_the_light_keeps_the_program_of_the_map(workspace: Workspace) -> None:
    one = main_road(workspace, 300.0, 200.0)
    assert with_turn_arrows(workspace, one) == (one, ())


def test_an_interval_outside_the_scenario_is_refused(workspace: Workspace) -> None:
    one = main_road(workspace, 300.0, 200.0)
    for begin, end in ((500.0, 700.0), (300.0, 300.0)):
        with pytest.raises(InputError, match=f"{begin:g} to {end:g} s is no part of the scenario"):
            with_turn_arrows(workspace, one, begin=begin, end=end)


def test_with_actuated_control_arrows_come_on_call(workspace: Workspace) -> None:
    new, _ = with_turn_arrows(workspace, main_road(workspace, 700.0, 200.0, "actuated"))
    assert [stage.on_call for stage in timing(new).stages] == [False, True, False]


def test_turns_that_have_an_arrow_keep_it_and_a_light_has_four_stages_at_most(
    workspace: Workspace,
) -> None:
    """That of the guide has four stages, one of them for the left turns of the main road."""
    own = placed(workspace, scenario(one_plan(cycle=None), vehicles=1500.0))
    new, arrows = with_turn_arrows(workspace, own)
    assert arrows == ()
    assert new == own


@pytest.mark.slow
def test_turns_that_share_their_lane_go_through_gaps_alone(workspace: Workspace) -> None:
    """The lights of the town have no lane for left turns alone that meets oncoming traffic."""
    graph = load_map(workspace.map("town_5x5")).sumo.graph
    one = edits.new_scenario(graph, name="town", roi=graph.segments.ids, seed=1)
    one = add_background(workspace, one, name="all", per_km=60.0)
    assert with_turn_arrows(workspace, one) == (one, ())


def test_who_turns_through_gaps_never_sees_yellow_while_oncoming_traffic_goes_on(
    workspace: Workspace,
) -> None:
    """The yellow trap; and nothing else that meets has green together, but where one gives way."""
    for vehicles in (800.0, 1200.0):
        one = placed(workspace, scenario(None, vehicles=vehicles))
        new = time_signals(workspace, with_turn_arrows(workspace, one)[0]).scenario
        assert len(timing(new).stages) == 4
        (shown,) = signal_programs(workspace, new)
        phases = [phase.state for phase in shown.plans[0].phases]
        both = 0
        for before, now in pairwise([*phases, phases[0]]):
            for meeting in light().meetings:
                other = meeting.one + meeting.other - meeting.yields
                if meeting.yields < 0 or not meeting.shares:
                    assert not {now[meeting.one], now[meeting.other]} <= set("Ggy")
                    continue
                assert {now[meeting.yields], now[other]} != {"G"}
                turn = light().movements[meeting.yields].turn
                if turn == "left" and before[meeting.yields] + now[meeting.yields] == "gy":
                    assert now[other] not in "Gg"
                both += turn == "left" and now[meeting.yields] == "G"
        assert both


@pytest.mark.slow
def test_left_turns_with_arrows_wait_less_and_none_collides(
    workspace: Workspace, tmp_path: Path
) -> None:
    """At 850 vehicles an hour gaps are as good (27.0 s against 27.4); at 1,000 they run out."""
    losses = []
    one = main_road(workspace, 1000.0, 200.0)
    for name, given in (("gaps", one), ("arrows", with_turn_arrows(workspace, one)[0])):
        done = carried_out(time_signals(workspace, given).scenario, tmp_path / name)
        trips = pl.read_parquet(done.folder / "trips.parquet")
        losses.append(trips["time_loss"].mean())
        assert "collision" not in set(done.events()["kind"])
    assert losses[1] < 0.9 * losses[0]
