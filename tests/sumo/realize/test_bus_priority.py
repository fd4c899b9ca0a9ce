"""Priority for buses at lights, in plain SUMO files."""

from __future__ import annotations

from typing import TYPE_CHECKING
from xml.etree import ElementTree as ET

import pytest

from odscen.base.categories import Category
from odscen.base.errors import ScenarioError
from odscen.scenario.document.signals_document import Signals
from odscen.scenario.signals.program_design import ONLY_PLAN
from odscen.sumo.folder.layout import SIGNALS_FILE
from odscen.sumo.realize.light_detectors import BUS_GREEN
from odscen.sumo.realize.realization import realize
from tests.signal_case import crossing, one_plan, scenario

if TYPE_CHECKING:
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


@pytest.mark.parametrize("control", ["fixed", "actuated"])
def test_detectors_see_buses_and_nobody_else(control: str) -> None:
    one = asked(control)
    routes = ET.fromstring(realize(one, crossing().sumo).files["routes.rou.xml"])
    buses = {kind.get("id") for kind in routes.iter("vType") if kind.get("vClass") == "bus"}
    areas = list(signals_of(one).iter("laneAreaDetector"))
    assert buses
    assert areas
    assert {frozenset((area.get("vTypes") or "").split()) for area in areas} == {frozenset(buses)}
    without = list(signals_of(asked(control, buses=0.0)).iter("laneAreaDetector"))
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


def test_a_fixed_time_program_of_the_scenario_has_no_priority() -> None:
    with pytest.raises(ScenarioError, match="make its control actuated"):
        realize(asked("fixed", program=True), crossing().sumo)
    assert (
        "laneAreaDetector"
        in realize(asked("actuated", program=True), crossing().sumo).files[SIGNALS_FILE]
    )
