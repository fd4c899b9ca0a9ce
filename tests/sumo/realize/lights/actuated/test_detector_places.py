"""Where detectors of lights lie on the map."""

from __future__ import annotations

from math import dist

import pytest

from odscen.records.light_programs import programs_from_json, programs_to_json
from odscen.sumo.realize.lights.light_realization import RealizedLight, realized_lights
from tests.signal_case import crossing, one_plan, scenario


def with_buses(control: str = "actuated", *, own: bool = False) -> RealizedLight:
    junction = one_plan(bus_priority=True) if own else {"junction": "10001", "bus_priority": True}
    (light,) = realized_lights(scenario(junction, control=control), crossing().sumo)
    return light


@pytest.mark.parametrize("control", ["fixed", "actuated"])
def test_buses_are_seen_in_the_last_80_metres_before_each_stop_line(control: str) -> None:
    light = with_buses(control).shown
    areas = [one for one in light.detectors if one.bus]
    stop_lines = {path[0] for group in light.groups if not group.walk for path in group.paths}
    assert len(areas) == 8
    for one in areas:
        # The lanes at the stop lines are 20 m long: the areas lie on those before them, too.
        assert one.length == pytest.approx(80.0, abs=0.1)
        assert min(dist(one.place[-1], at) for at in stop_lines) < 0.1
        assert dist(one.place[0], (0.0, 0.0)) > dist(one.place[-1], (0.0, 0.0)) + 75.0
    assert {one.stages for one in areas} == {("1",), ("2",)}


def test_an_area_on_a_lane_that_buses_may_not_use_is_not_shown() -> None:
    realized = with_buses()
    net = crossing().sumo.net
    admitted = {one.id for one in realized.buses if net.lanes[one.lane].allows("bus")}
    assert len(realized.buses) == 12
    assert {one.id for one in realized.shown.detectors if one.bus} == admitted


def test_an_area_has_all_stages_in_which_its_lane_has_green() -> None:
    light = with_buses(own=True).shown
    assert {one.stages for one in light.detectors if one.bus} == {("1",), ("1", "2"), ("3",)}
    assert programs_from_json(programs_to_json((light,))) == (light,)


def test_without_priority_there_are_no_areas() -> None:
    (light,) = realized_lights(scenario(None, control="actuated"), crossing().sumo)
    assert not any(one.bus for one in light.shown.detectors)
