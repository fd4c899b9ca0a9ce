from __future__ import annotations

import pytest

from odscen.base.errors import NotFoundError, ScenarioError
from odscen.scenario import edits
from odscen.scenario.document.measures_document import RoadClosure, SignalOutage, SpeedLimit
from odscen.scenario.document.scenario_document import Scenario
from tests.graphs import fork

GRAPH = fork()


def scenario() -> Scenario:
    return edits.new_scenario(GRAPH, name="test", roi=("r1", "j9", "r2", "r3"))


def closure(*places: str, name: str = "shut") -> RoadClosure:
    return RoadClosure(id=name, kind="closure", places=places)


def test_a_measure_is_added_replaced_in_its_place_and_removed() -> None:
    one = edits.set_measure(scenario(), GRAPH, measure=closure("r2"))
    two = edits.set_measure(one, GRAPH, measure=closure("r3", name="other"))
    slow = SpeedLimit(id="shut", kind="speed_limit", places=("1.0.-1",), speed=5)
    three = edits.set_measure(two, GRAPH, measure=slow)
    assert [(m.id, m.kind) for m in three.measures] == [
        ("shut", "speed_limit"),
        ("other", "closure"),
    ]
    assert edits.remove_measure(three, measure="shut").measures == two.measures[1:]
    assert one.measures == (closure("r2"),)


def test_a_place_that_the_map_does_not_have_is_refused() -> None:
    with pytest.raises(ScenarioError, match="'r77' is neither a segment nor a lane"):
        edits.set_measure(scenario(), GRAPH, measure=closure("r77"))
    with pytest.raises(ScenarioError, match="no lane leads from 'r2' into 'r1'"):
        edits.set_measure(scenario(), GRAPH, measure=closure("r2>r1"))


def test_an_outage_needs_a_light_and_an_id_is_used_once() -> None:
    dark = SignalOutage(id="dark", kind="signal_outage", junction="9")
    with pytest.raises(ScenarioError, match="no traffic light in junction '9'"):
        edits.set_measure(scenario(), GRAPH, (), measure=dark)
    with_car = edits.add_actor(scenario(), GRAPH, category="car", spawn="1.0.-1.10")
    with pytest.raises(ScenarioError, match="'car-1' is taken"):
        edits.set_measure(with_car, GRAPH, measure=closure("r2", name="car-1"))


def test_a_measure_that_is_not_there_cannot_be_removed() -> None:
    with pytest.raises(NotFoundError, match="no measure named 'shut'"):
        edits.remove_measure(scenario(), measure="shut")


def test_a_renamed_measure_keeps_its_place() -> None:
    two = edits.set_measure(scenario(), GRAPH, measure=closure("r2"))
    two = edits.set_measure(two, GRAPH, measure=closure("r3", name="other"))
    renamed = edits.set_measure(two, GRAPH, measure=closure("r2", name="works"), instead_of="shut")
    assert [one.id for one in renamed.measures] == ["works", "other"]
