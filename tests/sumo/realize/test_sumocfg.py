from __future__ import annotations

from xml.etree import ElementTree as ET

from odscen.sumo.realize.sumocfg import SumocfgSettings, sumo_config


def options(**settings: object) -> dict[str, str]:
    values = SumocfgSettings(until=60.0, step_length=0.5, seed=1, **settings)  # type: ignore[arg-type]
    return {one.tag: one.get("value", "") for one in ET.fromstring(sumo_config(values)).iter()}


def test_what_a_scenario_says_of_the_simulation_reaches_sumo() -> None:
    found = options(
        time_to_teleport=120.0,
        action_step=1.0,
        lateral_resolution=0.8,
        pedestrians="nonInteracting",
    )
    assert found["time-to-teleport"] == "120"
    assert found["default.action-step-length"] == "1"
    assert found["lateral-resolution"] == "0.8"
    assert found["pedestrian.model"] == "nonInteracting"


def test_what_it_does_not_say_is_left_to_sumo_and_zero_never_teleports() -> None:
    found = options(time_to_teleport=0.0)
    assert found["time-to-teleport"] == "-1"
    assert not {"default.action-step-length", "lateral-resolution"} & set(found)


def test_meso_has_neither_places_in_lanes_nor_stripes() -> None:
    found = options(meso=True, lateral_resolution=0.8)
    assert "lateral-resolution" not in found
    assert found["pedestrian.model"] == "nonInteracting"
