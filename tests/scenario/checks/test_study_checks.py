from __future__ import annotations

from typing import Any

import pytest

from odscen.changes.scenario_differences import scenario_differences
from odscen.scenario.checks.scenario_checks import check
from odscen.scenario.document.json_form import dumps, loads
from odscen.scenario.document.scenario_document import MapReference, Scenario
from odscen.scenario.forms.graph_form import from_graphml, to_graphml
from tests.graphs import SHA256, fork

GRAPH = fork()
NODES = ("1.0.-1.0", "1.0.-1.1")
STUDY = {
    "warm_up": 600,
    "interval": 900,
    "detectors": [{"id": "d", "nodes": NODES[:1]}],
    "sections": [{"id": "s", "begin": NODES[:1], "end": NODES[1:]}],
    "cordons": [{"id": "c", "entries": NODES[:1], "exits": NODES[1:]}],
}


def scenario(study: dict[str, Any] | None = None) -> Scenario:
    return Scenario.model_validate(
        {
            "name": "test",
            "map": MapReference(name="toy", sha256=SHA256),
            "roi": ("r1", "j9", "r2", "r3"),
            **({} if study is None else {"study": study}),
        }
    )


def codes(study: dict[str, Any]) -> list[tuple[str, str]]:
    found = check(scenario(study), GRAPH, lights=())
    return [(one.code, one.where) for one in found if one.code != "no_actors"]


def test_a_study_without_mistakes_has_no_problems() -> None:
    assert codes(STUDY) == []


@pytest.mark.parametrize(
    ("study", "code", "where"),
    [
        ({"detectors": [{"id": "d", "nodes": ["7.0.-1.0"]}]}, "unknown_node",
         "study.detectors[0].nodes[0]"),
        ({"sections": [{"id": "s", "begin": NODES[:1], "end": ["north"]}]}, "unknown_node",
         "study.sections[0].end[0]"),
        ({**STUDY, "detectors": [{"id": "c", "nodes": NODES[:1]}]}, "duplicate_id",
         "study.cordons[0].id"),
    ],
)  # fmt: skip
def test_stations_that_cannot_be_placed_are_problems(
    study: dict[str, Any], code: str, where: str
) -> None:
    assert codes(study) == [(code, where)]


def test_a_study_goes_through_json_and_graphml_and_its_changes_are_named() -> None:
    one = scenario(STUDY)
    assert loads(dumps(one)) == one
    assert from_graphml(to_graphml(one, GRAPH)) == one
    assert '"study"' not in dumps(scenario()), "documents without one stay as they were"
    moved = scenario({**STUDY, "detectors": [{"id": "d", "nodes": NODES[1:]}]})
    (change,) = scenario_differences(one, moved)
    assert change.words.startswith("study, detector d, nodes")
