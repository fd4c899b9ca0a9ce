"""Cycles stretched, and programs of the map taken over."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from odscen.app.maps import map_of
from odscen.app.signals.program_editing import stretch_cycle, take_over_program
from odscen.app.signals.signal_plans import signal_programs
from odscen.base.errors import InputError, NotFoundError
from odscen.maps.shipped import shipped_maps
from odscen.maps.store import Workspace
from odscen.records.light_programs import stage_spans
from odscen.scenario import edits
from odscen.scenario.document.scenario_document import MapReference
from tests.signal_case import JUNCTION, MAP, program, scenario

if TYPE_CHECKING:
    from odscen.records.light_programs import StageSpan
    from odscen.scenario.document.scenario_document import Scenario


@pytest.fixture(scope="module")
def workspace(tmp_path_factory: pytest.TempPathFactory) -> Workspace:
    store = Workspace.open(tmp_path_factory.mktemp("workspace"))
    store.add_map(MAP)
    return store


def placed(workspace: Workspace, one: Scenario) -> Scenario:
    sha256 = workspace.map("signal_crossing").info["sha256"]
    return one.model_copy(update={"map": MapReference(name="signal_crossing", sha256=sha256)})


def spans(workspace: Workspace, one: Scenario) -> tuple[StageSpan, ...]:
    (light,) = signal_programs(workspace, one, whole_day=True)
    return stage_spans(light.plans[0])


@pytest.mark.slow
def test_a_program_that_is_taken_over_has_the_maps_stages_times_and_bounds(
    workspace: Workspace,
) -> None:
    one = placed(workspace, scenario(None, control="actuated"))
    one = edits.set_green(one, map_of(workspace, one).lights, JUNCTION, stage="1", green=18)
    new = take_over_program(workspace, one, JUNCTION)
    before, after = spans(workspace, one), spans(workspace, new)
    assert [(s.id, s.seconds, s.least, s.most) for s in after] == [
        ("1", 18.0, 8.0, 36.0),
        ("2", 13.0, 8.0, 26.0),
    ]
    assert [s.state for s in after] == [s.state for s in before]
    with pytest.raises(InputError, match="has a program of this scenario already"):
        take_over_program(workspace, new, JUNCTION)
    with pytest.raises(NotFoundError, match="99"):
        take_over_program(workspace, one, "99")


def test_an_extended_light_that_is_taken_over_has_fixed_times(workspace: Workspace) -> None:
    one = placed(workspace, scenario({"junction": JUNCTION, "control": "extended"}))
    taken = take_over_program(workspace, one, JUNCTION)
    (timing,) = taken.signals.junctions
    assert timing.control == "fixed"
    assert [(s.seconds, s.most) for s in spans(workspace, taken)] == [
        (s.seconds, 0.0) for s in spans(workspace, one)
    ]


def test_another_cycle_divides_what_is_more_in_proportion_and_keeps_intergreens(
    workspace: Workspace,
) -> None:
    one = placed(workspace, scenario(program()))
    longer = stretch_cycle(workspace, one, JUNCTION, cycle=100, plan="day")
    (timing,) = longer.signals.junctions
    day, evening = timing.plans
    assert (day.cycle, evening) == (100.0, one.signals.junctions[0].plans[1])
    # 16 s more for vehicles; the stage for pedestrians only keeps its 7 s.
    assert day.green == {"1": 30.0, "2": 8.0, "3": 16.0, "4": 7.0}
    with pytest.raises(InputError, match=r"needs a cycle of .* but it is to be 40 s"):
        stretch_cycle(workspace, one, JUNCTION, cycle=40, plan="day")


@pytest.mark.slow
def test_the_program_of_every_light_of_the_shipped_maps_can_be_taken_over(
    tmp_path_factory: pytest.TempPathFactory,
) -> None:
    store = Workspace.open(tmp_path_factory.mktemp("shipped"))
    taken = 0
    for path in shipped_maps():
        entry = store.add_map(path)
        one = edits.new_scenario(entry.graph(), name=path.stem)
        for light in map_of(store, one).lights:
            take_over_program(store, one, light.names[0])
            taken += 1
    assert taken == 10
