from __future__ import annotations

import json
from typing import Any

import pytest

from odscen.base.categories import Category
from odscen.base.errors import ScenarioError
from odscen.changes.scenario_differences import scenario_differences
from odscen.scenario.document.json_form import dumps, loads
from odscen.scenario.document.measures_document import banned_by, measure_words
from odscen.scenario.document.scenario_document import MapReference, Scenario
from odscen.scenario.forms.graph_form import from_graphml, to_graphml
from tests.graphs import SHA256, fork

MEASURES: list[dict[str, Any]] = [
    {"id": "shut", "kind": "closure", "begin": 60.0, "end": 120.0, "places": ["r1", "r1>j9>r2"]},
    {"id": "works", "kind": "roadworks", "places": ["r2"], "speed": 8.0, "width": 3.1},
    {"id": "broken", "kind": "incident", "end": 300.0, "lane": "1.0.-1", "s": 10.0},
    {"id": "slow", "kind": "speed_limit", "places": ["1.0.-1"], "speed": 8.33},
    {"id": "buses", "kind": "permission", "places": ["1.0.-1"], "allowed": ["bus"]},
    {"id": "dark", "kind": "signal_outage", "junction": "9", "shows": "flashing"},
]


def scenario(measures: list[dict[str, Any]]) -> Scenario:
    fields = {"name": "test", "map": MapReference(name="toy", sha256=SHA256), "roi": ["r1"]}
    return loads(json.dumps({**fields, "map": fields["map"].model_dump(), "measures": measures}))


def test_every_kind_of_measure_survives_json_and_the_graph_form_without_loss() -> None:
    whole = scenario(MEASURES)
    assert json.loads(dumps(whole))["measures"] == MEASURES
    assert loads(dumps(whole)) == whole
    assert from_graphml(to_graphml(whole, fork())) == whole


def test_a_document_without_measures_is_written_as_before() -> None:
    assert "measures" not in dumps(scenario([]))
    assert "measures" not in to_graphml(scenario([]), fork())


@pytest.mark.parametrize(
    ("measure", "words"),
    [
        ({"kind": "closure", "places": ["r1"], "begin": 9, "end": 9}, "not after it begins"),
        ({"kind": "closure", "places": []}, "at least 1 item"),
        ({"kind": "roadworks", "places": ["r1"]}, "speed, closed_lanes and width"),
        ({"kind": "permission", "places": ["r1"]}, "either allowed or banned"),
        ({"kind": "permission", "places": ["r1"], "banned": ["pedestrian"]}, "about vehicles"),
        ({"kind": "strike", "places": ["r1"]}, "measures[0]"),
        ({"places": ["r1"]}, "measures[0]"),
    ],
)
def test_what_makes_no_sense_is_refused_with_its_place(measure: dict[str, Any], words: str) -> None:
    with pytest.raises(ScenarioError) as error:
        scenario([{"id": "one", **measure}])
    assert "measures[0]" in str(error.value)
    assert words in str(error.value)


def test_a_permission_says_who_is_banned_either_way() -> None:
    buses, trucks = scenario(
        [
            {"id": "a", "kind": "permission", "places": ["r1"], "allowed": ["bus", "bicycle"]},
            {"id": "b", "kind": "permission", "places": ["r1"], "banned": ["truck"]},
        ]
    ).measures
    assert banned_by(buses) == (
        Category.CAR, Category.VAN, Category.TRUCK, Category.MOTORCYCLE,
    )  # fmt: skip
    assert banned_by(trucks) == (Category.TRUCK,)


def test_each_measure_has_words() -> None:
    assert [measure_words(one) for one in scenario(MEASURES).measures] == [
        "closed: r1, r1>j9>r2",
        "roadworks on r2: limit 29 km/h, lanes 3.1 m wide",
        "broken-down vehicle on lane 1.0.-1 at s 10 m",
        "speed limit 30 km/h: 1.0.-1",
        "only bus: 1.0.-1",
        "traffic light 9 flashing",
    ]


def test_differences_name_a_measure_by_its_id() -> None:
    later = [{**MEASURES[0], "end": 180.0}, *MEASURES[1:]]
    (change,) = scenario_differences(scenario(MEASURES), scenario(later))
    assert change.words == "measure shut, end: 120.0 -> 180.0"
