"""Stops and lines in the document: edits, checks, and how they are written."""

from __future__ import annotations

from typing import Any

import pytest

from odscen.base.errors import NotFoundError, ScenarioError
from odscen.scenario import edits
from odscen.scenario.checks.scenario_checks import check
from odscen.scenario.document.json_form import dumps, loads
from odscen.scenario.document.scenario_document import Scenario
from tests.graphs import fork

GRAPH = fork()
STOPS = ({"stop": "market", "after": 60}, {"stop": "school"})


def empty() -> Scenario:
    return edits.new_scenario(GRAPH, name="lines", roi=("r1", "j9", "r2", "r3"))


def with_stops() -> Scenario:
    one = edits.set_stop(empty(), GRAPH, stop="market", node="1.0.-1.20", name="Market & Co")
    return edits.set_stop(one, GRAPH, stop="school", node="2.0.-1.10", bay=True)


def with_line(**fields: Any) -> Scenario:
    given = {"start": "1.0.-1.3", "stops": STOPS, "headway": 600, **fields}
    return edits.set_line(with_stops(), GRAPH, line="7", **given)


def test_lines_and_stops_survive_being_written_and_read() -> None:
    dwell = {"kind": "uniform", "low": 10, "high": 25}
    one = with_line(dwell=dwell, stops=({"stop": "market", "dwell": 30}, {"stop": "school"}))
    text = dumps(one)
    assert loads(text) == one
    assert '"dwell": {"kind": "uniform", "low": 10.0, "high": 25.0}' in text
    assert '{"stop": "market", "dwell": 30.0}' in text
    assert [problem.code for problem in check(one, GRAPH)] == []
    assert "transit" not in dumps(empty())


def test_departures_take_the_place_of_a_headway() -> None:
    one = edits.set_line(with_line(), GRAPH, line="7", departures=(0, 450))
    assert (one.transit.lines[0].headway, one.transit.lines[0].departures) == (None, (0, 450))
    assert len(one.transit.lines) == 1


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ({"stops": ({"stop": "marked"},)}, "serves stop 'marked'; there are market, school"),
        ({"start": "2.0.-1.3"}, "no way leads from '2.0.-1.3' to 'market'"),
        ({"stops": STOPS[::-1]}, "no way leads from 'school' to 'market'"),
        ({"start": "90.0.-1.2"}, "node '90.0.-1.2' is inside a junction"),
        ({"goal": "9.0.-1.2"}, "node '9.0.-1.2' is not on the map"),
        ({"goal": "3.0.-1.2"}, "no way leads from 'school' to '3.0.-1.2'"),
        ({"category": "pedestrian"}, "has pedestrians"),
        ({"departures": (0, 60)}, "one of headway and departures, not both"),
        ({"headway": None, "departures": (60, 0)}, "departures must grow"),
        (
            {"stops": ({"stop": "market", "after": 60}, {"stop": "school", "after": 60})},
            "must grow from stop to stop",
        ),
    ],
)
def test_a_line_that_cannot_be_driven_is_refused(fields: dict[str, Any], message: str) -> None:
    with pytest.raises(ScenarioError, match=message):
        with_line(**fields)


def test_a_stop_is_on_a_road_of_the_region_and_its_name_is_its_own() -> None:
    with pytest.raises(ScenarioError, match=r"node '1\.0\.-2\.4' is"):
        edits.set_stop(empty(), GRAPH, stop="a", node="1.0.-2.4")
    cut = edits.new_scenario(GRAPH, name="cut", roi=("r1",))
    with pytest.raises(ScenarioError, match="outside the region"):
        edits.set_stop(cut, GRAPH, stop="a", node="2.0.-1.3")


def test_a_stop_that_a_line_serves_stays_until_the_line_is_gone() -> None:
    one = with_line()
    with pytest.raises(ScenarioError, match="serves stop 'market'"):
        edits.remove_transit(one, GRAPH, part="market")
    left = edits.remove_transit(edits.remove_transit(one, GRAPH, part="7"), GRAPH, part="market")
    assert [stop.id for stop in left.transit.stops] == ["school"]
    with pytest.raises(NotFoundError, match="stop or line"):
        edits.remove_transit(left, GRAPH, part="7")


def test_a_line_shares_its_names_with_other_road_users() -> None:
    taken = edits.add_flow(empty(), GRAPH, spawn="1.0.-1.8", per_hour=30, id="7")
    taken = edits.set_stop(taken, GRAPH, stop="market", node="1.0.-1.20")
    with pytest.raises(ScenarioError, match="id '7' is taken"):
        edits.set_line(
            taken, GRAPH, line="7", start="1.0.-1.3", stops=({"stop": "market"},), headway=60
        )


def test_a_line_at_an_unknown_stop_is_told_some_of_those_that_there_are() -> None:
    stops = tuple({"id": f"s{n:03}", "node": "1.0.-1.20"} for n in range(500))
    lines = ({"id": "7", "start": "1.0.-1.3", "stops": ({"stop": "x"},), "headway": 60},)
    one = Scenario.model_validate(
        empty().model_dump() | {"transit": {"stops": stops, "lines": lines}}
    )
    (found,) = (problem for problem in check(one, GRAPH) if problem.code == "unknown_stop")
    assert found.message.endswith("s028, s029 and 470 more")
    assert len(found.message) < 400
