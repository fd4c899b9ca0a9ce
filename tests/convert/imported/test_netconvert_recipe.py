from __future__ import annotations

import re

import pytest
from lxml import etree

from odscen.convert.imported.netconvert_recipe import (
    TYPES_FILE,
    lane_types,
    recipe,
    with_lane_limits,
)
from odscen.opendrive.road_model import DRIVABLE_TYPES, WALKABLE_TYPES

TYPES = {found.get("id"): found for found in etree.fromstring(lane_types())}


@pytest.mark.parametrize("name", sorted(DRIVABLE_TYPES - {"bus", "taxi"}))
def test_cars_may_use_drivable_lanes_and_pedestrians_may_not(name: str) -> None:
    barred = TYPES[name].get("disallow", "").split()
    assert "passenger" not in barred
    assert "pedestrian" in barred
    assert TYPES[name].get("allow") is None


@pytest.mark.parametrize("name", ["onRamp", "offRamp", "mwyEntry", "mwyExit", "connectingRamp"])
def test_bicycles_stay_off_motorway_ramps(name: str) -> None:
    assert "bicycle" in TYPES[name].get("disallow", "").split()


@pytest.mark.parametrize("name", sorted(WALKABLE_TYPES))
def test_only_pedestrians_use_sidewalks(name: str) -> None:
    assert TYPES[name].get("allow") == "pedestrian"


@pytest.mark.parametrize(
    "name", ["shoulder", "border", "none", "parking", "median", "bidirectional"]
)
def test_other_lanes_are_closed(name: str) -> None:
    assert TYPES[name].get("disallow") == "all"


def test_each_step_gives_up_something_and_keeps_the_side_of_the_road() -> None:
    steps = recipe(lefthand=True)
    assert steps[0].gives_up == ""
    assert all(step.gives_up for step in steps[1:])
    assert all("--lefthand" in step.options for step in steps)
    assert not any("--lefthand" in step.options for step in recipe(lefthand=False))
    assert f"--type-files={TYPES_FILE}" in steps[0].options


LIMITED = (
    '<OpenDRIVE><road id="1"><type s="0"><speed max="30" unit="km/h"/></type>'
    '<type s="40"><speed max="50" unit="km/h"/></type><lanes><laneSection s="0"><right>'
    '<lane id="-1" type="driving"/><lane id="-2" type="sidewalk"/></right></laneSection>'
    '<laneSection s="40"><right><lane id="-1" type="driving"/>'
    '<lane id="-2" type="driving"><speed sOffset="0" max="7"/></lane></right></laneSection>'
    "</lanes></road></OpenDRIVE>"
)


def test_limits_of_roads_are_given_to_the_lanes_that_have_none() -> None:
    prepared, entries = with_lane_limits(LIMITED.encode())
    found = [
        [(speed.get("max"), speed.get("unit")) for speed in lane.iterfind("speed")]
        for lane in etree.fromstring(prepared).iter("lane")
    ]
    assert found == [[("30", "km/h")], [], [("50", "km/h")], [("7", None)]]
    assert [entry.outcome for entry in entries] == ["repaired"]


def test_a_limit_that_begins_within_a_section_is_lost_and_reported() -> None:
    _, entries = with_lane_limits(LIMITED.replace('<type s="40">', '<type s="20">').encode())
    assert entries[1][:2] == ("lost", "road 1 > type s=20")


def test_a_map_without_limits_is_given_as_it_is() -> None:
    text = re.sub(r"<type.*</type>", "", LIMITED).encode()
    assert with_lane_limits(text) == (text, ())
