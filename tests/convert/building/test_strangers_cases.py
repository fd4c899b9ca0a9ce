"""Small files of other writers that were refused, or lost what they say: what they become."""

from __future__ import annotations

from pathlib import Path

import pytest

from odscen.convert.model.access import allowed
from odscen.convert.model.conversion_report import ElementOutcome
from odscen.opendrive.parse import parse
from tests.convert.maps import Converted, of_model

CASES = Path(__file__).parents[4] / "shared" / "cases" / "maps"


def built(name: str) -> Converted:
    path = CASES / f"{name}.xodr"
    if not path.is_file():
        pytest.skip("cases of strangers are not here (../shared/cases/maps)")
    return of_model(parse(path.read_bytes(), file=path.name))


def waiting_lanes(made: Converted) -> dict[str, str]:
    """State of the links out of each edge at the junction: ``M`` has priority, ``m`` waits."""
    edges = made.edges()
    return {
        link.get("from"): link.get("state")
        for link in made.xml.iter("connection")
        if link.get("from") in edges and link.get("to") in edges
    }


@pytest.mark.parametrize("name", ["access0", "access18"])
def test_access_in_both_forms_is_who_may_use_the_lane(name: str) -> None:
    lanes = built(name).network.table.lanes
    cars = allowed("driving")
    expected = {
        "1.0.f_0": allowed("bus"),
        "2.0.f_0": cars - {"bicycle"},
        "3.0.f_0": cars - {"truck", "trailer"},
        "4.0.f_0": frozenset({"bicycle"}),
        "5.0.f_0": cars - {"passenger", "private", "evehicle", "hov", "vip"},
        "6.0.f_0": cars,
    }
    assert {lane: lanes[lane].allowed for lane in expected} == expected


@pytest.mark.parametrize(
    ("name", "state"),
    [("sg_SEB1", "m"), ("sg_CN1010203", "m"), ("sg_GB601", "s"), ("sg_DE301", "M")],
)
def test_signs_of_other_countries_say_who_waits(name: str, state: str) -> None:
    assert waiting_lanes(built(name))["4.0.f"] == state


def test_a_road_of_eleven_metres_between_crosswalks_keeps_both_junctions_and_lights() -> None:
    made = built("short11")
    assert {light.get("id") for light in made.xml.iter("tlLogic")} == {"J10", "J20"}
    assert {"2.0.f", "2.0.b"} <= set(made.edges())


def test_a_lane_link_that_one_lane_states_is_a_connection() -> None:
    assert ("33.0.f_0", "34.0.f_0") in built("esmini447").links()


@pytest.mark.parametrize(
    ("name", "edges"), [("negwidth10cm", 2), ("sumo14828", 2), ("curve10", 3), ("unit_KMH", 2)]
)
def test_what_refused_a_whole_map_is_no_reason_any_more(name: str, edges: int) -> None:
    assert len(built(name).edges()) == edges


def test_units_of_speed_are_understood() -> None:
    lanes = built("units").network.table.lanes
    limits = [lanes[f"{road}.0.f_0"].speed for road in range(1, 8)]
    # 30 mph, 50 km/h, 13.9 and 10 m/s, "no limit" (130 km/h), "undefined" (a town's), 2.68 mph
    assert limits == pytest.approx([13.41, 13.89, 13.9, 10.0, 36.11, 13.89, 1.2], abs=0.01)


def test_a_road_of_a_junction_that_nothing_is_linked_to_is_a_plain_road() -> None:
    network = built("all_in_junction").network
    assert {"1.0.f_0", "1.0.b_0"} <= network.table.lanes.keys()
    repaired = [
        entry for entry in network.report.entries if entry.outcome is ElementOutcome.REPAIRED
    ]
    assert any("read as a road outside junctions" in entry.reason for entry in repaired)
