"""Parking in the demand: how it is written, and what is refused."""

from __future__ import annotations

import pytest

from odscen.lanegraph.parking_areas import NO_PARKING
from odscen.scenario.checks.scenario_checks import check
from odscen.scenario.document.json_form import dumps, loads
from odscen.scenario.document.scenario_document import Scenario
from tests.parking_case import parking_scenario, parking_town


def codes(scenario: Scenario, *, parking: object = None) -> list[str]:
    town = parking_town()
    known = town.parking if parking is None else parking
    return [one.code for one in check(scenario, town.sumo.graph, parking=known)]  # type: ignore[arg-type]


@pytest.mark.slow
def test_parking_survives_being_written_and_read_and_is_left_out_without() -> None:
    one = parking_scenario({"begin": 0.2, "stay": {"kind": "uniform", "low": 60, "high": 90}})
    text = dumps(one)
    assert loads(text) == one
    assert '"begin": 0.2' in text
    assert "parking" not in dumps(parking_scenario({})).replace('"parking_town"', "").replace(
        '"name": "parking"', ""
    )


@pytest.mark.slow
def test_trips_that_park_on_a_map_with_places_are_in_order() -> None:
    assert codes(parking_scenario({"begin": 0.2, "end": 0.5})) == []


@pytest.mark.slow
def test_a_map_without_places_is_named() -> None:
    assert codes(parking_scenario({"end": 0.5}), parking=NO_PARKING) == ["no_parking"]
    assert codes(parking_scenario({}), parking=NO_PARKING) == []


def test_a_region_without_places_is_named() -> None:
    graph = parking_town().sumo.graph
    lanes = graph.lanes
    taken = {int(lanes.segment[area.node]) for area in parking_town().parking.areas}
    free = next(
        str(name)
        for row, name in enumerate(graph.segments.ids)
        if row not in taken and graph.segments.kinds[row] == "road"
    )
    scenario = parking_scenario({"end": 0.5}).model_copy(update={"roi": (free,)})
    assert "parking_outside_roi" in codes(scenario)


def test_parking_without_any_trips_is_pointed_out() -> None:
    scenario = parking_scenario({"end": 0.5})
    demand = scenario.demand.model_copy(update={"background": ()})
    found = codes(scenario.model_copy(update={"demand": demand}))
    assert found[-1:] == ["no_actors"] or "nothing_parks" in found
    assert "nothing_parks" in found


@pytest.mark.parametrize("share", [-0.1, 1.5])
def test_a_share_is_between_none_and_all(share: float) -> None:
    with pytest.raises(ValueError, match="parking"):
        parking_scenario({"begin": share})
