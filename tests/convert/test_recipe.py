from __future__ import annotations

import pytest
from lxml import etree

from odscen.convert.recipe import TYPEMAP_FILE, ladder, typemap
from odscen.opendrive.model import DRIVABLE_TYPES, WALKABLE_TYPES

TYPES = {found.get("id"): found for found in etree.fromstring(typemap())}


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
def test_nobody_uses_other_lanes(name: str) -> None:
    assert TYPES[name].get("disallow") == "all"


def test_each_rung_gives_up_something_and_keeps_the_side_of_the_road() -> None:
    rungs = ladder(lefthand=True)
    assert rungs[0].gives_up == ""
    assert all(rung.gives_up for rung in rungs[1:])
    assert all("--lefthand" in rung.options for rung in rungs)
    assert not any("--lefthand" in rung.options for rung in ladder(lefthand=False))
    assert f"--type-files={TYPEMAP_FILE}" in rungs[0].options
