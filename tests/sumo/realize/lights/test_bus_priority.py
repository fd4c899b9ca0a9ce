"""Priority for buses at lights, in plain SUMO files."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING
from xml.etree import ElementTree as ET

import pytest

from odscen.base.categories import Category
from odscen.base.errors import ScenarioError
from odscen.runs.layout import SIGNALS_FILE
from odscen.runs.recorded import read_light_states
from odscen.scenario.document.signals_document import Signals
from odscen.scenario.signals.program_design import ONLY_PLAN
from odscen.sumo.realize.lights.light_detectors import BUS_GREEN
from odscen.sumo.realize.realization import realize
from tests.signal_case import carried_out, crossing, one_plan, program, scenario

if TYPE_CHECKING:
    from pathlib import Path

    from odscen.scenario.document.scenario_document import Scenario


def asked(control: str, *, buses: float = 0.2, program: bool = False) -> Scenario:
    one = scenario(one_plan() if program else None, control=control)
    mix = {Category.CAR: 1.0 - buses, Category.BUS: buses} if buses else {Category.CAR: 1.0}
    flows = tuple(
        flow if Category.PEDESTRIAN in flow.mix else flow.model_copy(update={"mix": mix})
        for flow in one.flows
    )
    signals = Signals(
        control=one.signals.control, junctions=one.signals.junctions, bus_priority=True
    )
    return one.model_copy(update={"flows": flows, "signals": signals})


def signals_of(one: Scenario) -> ET.Element:
    return ET.fromstring(realize(one, crossing().sumo).files[SIGNALS_FILE])


def bus_areas(one: Scenario) -> list[ET.Element]:
    areas = signals_of(one).iter("laneAreaDetector")
    return [area for area in areas if ".bus." in (area.get("id") or "")]


@pytest.mark.parametrize("control", ["fixed", "actuated"])
def test_detectors_see_buses_and_nobody_else(control: str) -> None:
    one = asked(control)
    routes = ET.fromstring(realize(one, crossing().sumo).files["routes.rou.xml"])
    buses = {kind.get("id") for kind in routes.iter("vType") if kind.get("vClass") == "bus"}
    areas = bus_areas(one)
    assert buses
    assert areas
    assert {frozenset((area.get("vTypes") or "").split()) for area in areas} == {frozenset(buses)}
    without = bus_areas(asked(control, buses=0.0))
    assert {area.get("vTypes") for area in without} == {"bus"}


def test_a_fixed_time_program_keeps_its_cycle_where_no_bus_comes() -> None:
    (program,) = signals_of(asked("fixed")).iter("tlLogic")
    phases = list(program.iter("phase"))
    stages = [n for n, phase in enumerate(phases) if (phase.get("name") or "").startswith("stage")]
    assert program.get("programID") == ONLY_PLAN
    assert len(stages) == 2
    for n in stages:
        longer, on_time = (int(name) for name in (phases[n].get("next") or "").split())
        assert phases[n].get("maxDur") == phases[n].get("duration")
        assert on_time == n + 1
        assert phases[longer].get("state") == phases[n].get("state")
        assert phases[longer].get("maxDur") == f"{BUS_GREEN:g}"


@pytest.mark.slow
def test_an_actuated_program_with_a_cycle_keeps_to_it_with_priority(tmp_path: Path) -> None:
    stages = [{**stage, "min_green": 5, "max_green": 30} for stage in program()["stages"][:3]]
    junction = one_plan(stages=[*stages, program()["stages"][3]], cycle=84, bus_priority=True)
    plain = scenario(junction, control="actuated")
    one = plain.model_copy(update={"flows": asked("actuated").flows})
    states = read_light_states(carried_out(one, tmp_path).folder)
    assert states is not None
    rows = list(zip(states["time"].to_list(), states["name"].to_list(), strict=True))
    ends = [
        after for (_, name), (after, then) in pairwise(rows)
        if name == "stage 1" and then != "stage 1"
    ]  # fmt: skip
    assert len(ends) > 5
    assert {round((end - 20.0) % 84.0, 3) for end in ends} <= {0.0, 84.0}


def test_a_fixed_time_program_of_the_scenario_has_no_priority() -> None:
    with pytest.raises(ScenarioError, match="make its control actuated"):
        realize(asked("fixed", program=True), crossing().sumo)
    assert (
        "laneAreaDetector"
        in realize(asked("actuated", program=True), crossing().sumo).files[SIGNALS_FILE]
    )
