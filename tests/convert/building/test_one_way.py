"""Connecting lanes that stay without a neighbour, and roads that become one-way by that."""

from __future__ import annotations

from odscen.convert.model.conversion_report import ElementOutcome
from odscen.opendrive.parse import parse
from tests.convert.legs import crossing, entry, junction, leg, way
from tests.convert.maps import Converted, converted, named, of_model
from tests.opendrive.snippets import document, lane, road, section

LEGS = ("1", "2", "3", "4")


def lost(made: Converted) -> dict[str, str]:
    found = made.network.report.entries
    return {e.element: e.reason for e in found if e.outcome is ElementOutcome.LOST}


def test_a_connecting_lane_that_meets_nothing_is_counted_and_named() -> None:
    aside = way("1", links="<link/>").replace('y="0.0"', 'y="9"')
    made = of_model(parse(document(leg("1"), leg("3"), aside, junction(entry("1")))))
    reasons = lost(made)
    assert "leads to no lane" in reasons["road 10 > laneSection 0 > lane -1"]
    assert made.network.report.figures["connections_lost"] == 1
    assert made.network.report.figures["connections"] == 0


def test_a_two_way_road_that_can_only_be_left_or_entered_is_named() -> None:
    ways = [way("1"), way("2"), way("4")]
    entries = [entry("1"), entry("2"), entry("4")]
    made = of_model(parse(document(*(leg(name) for name in LEGS), *ways, junction(*entries))))
    reasons = lost(made)
    assert "only leave it for" in reasons["road 1 > successor"]
    assert "only enter it from" in reasons["road 3 > successor"]
    assert not {"road 2 > successor", "road 4 > successor"} & set(reasons)


def test_roads_with_both_directions_or_with_one_only_are_not_named() -> None:
    single = [leg("1", lanes=(-1,)), leg("3", lanes=(1,)), way("1"), junction(entry("1"))]
    for made in (of_model(parse(crossing({}))), of_model(parse(document(*single)))):
        assert not any("one-way" in reason for reason in lost(made).values())


def test_lanes_that_are_open_both_ways_are_reported() -> None:
    both = lane(1, kind="bidirectional"), lane(-1, more='direction="both"')
    reasons = lost(of_model(parse(document(road(lanes=section(*both))))))
    assert "lanes of type bidirectional are open both ways" in reasons["road 1"]
    assert "in one direction only" in reasons["road 1 > laneSection 0 > lane -1"]


def test_the_shipped_town_has_neither() -> None:
    made = converted(named("town_5x5"))
    assert not any("one-way" in reason or "meets" in reason for reason in lost(made).values())
    assert made.network.report.figures["connections_lost"] == 0
