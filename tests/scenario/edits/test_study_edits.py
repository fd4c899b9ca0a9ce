from __future__ import annotations

import pytest

from odscen.base.errors import ScenarioError
from odscen.scenario import edits
from odscen.scenario.document.scenario_document import Scenario, Study
from tests.graphs import fork

GRAPH = fork()


def scenario() -> Scenario:
    return edits.new_scenario(GRAPH, name="test", roi=("r1", "j9", "r2", "r3"))


def test_times_and_stations_are_set_one_without_the_other() -> None:
    one = edits.set_study(scenario(), GRAPH, warm_up=600, interval=900)
    detector = {"id": "north", "nodes": ["1.0.-1.10"]}
    two = edits.set_study(one, GRAPH, detectors=[detector])
    assert (two.study.warm_up, two.study.interval) == (600, 900)
    assert [station.id for _, station in two.study.stations] == ["north"]
    three = edits.set_study(two, GRAPH, detectors=[], interval=None, warm_up=0)
    assert three.study == Study() == scenario().study


def test_a_station_where_the_map_has_no_lane_is_refused() -> None:
    with pytest.raises(ScenarioError, match=r"no node '7\.0\.-1\.10'"):
        edits.set_study(scenario(), GRAPH, detectors=[{"id": "north", "nodes": ["7.0.-1.10"]}])


def test_two_stations_with_one_id_are_refused() -> None:
    with pytest.raises(ScenarioError, match="'here' is taken"):
        edits.set_study(
            scenario(),
            GRAPH,
            detectors=[{"id": "here", "nodes": ["1.0.-1.10"]}],
            cordons=[{"id": "here", "entries": ["1.0.-1.10"], "exits": ["1.0.-1.20"]}],
        )


def test_a_section_without_an_end_is_refused_and_nothing_is_changed() -> None:
    before = scenario()
    with pytest.raises(ScenarioError, match="end"):
        edits.set_study(before, GRAPH, sections=[{"id": "a", "begin": ["1.0.-1.10"], "end": []}])
    assert before.study == Study()
