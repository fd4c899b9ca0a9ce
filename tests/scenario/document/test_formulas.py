import json
import re
from typing import Any

import pytest

from odscen.base.errors import ScenarioError
from odscen.scenario.document.json_form import dumps, loads, with_values
from odscen.scenario.document.scenario_document import Scenario

RULE = {
    "id": "cut-in",
    "actor": "van",
    "when": {"all": [{"ttc": {"to": "ego", "below": "$gap"}}, {"time": {"after": 3}}]},
    "then": [{"walk": {"to": ["10 * $gap", 4], "speed": 2}}],
}


OTHER = {"gap": {"value": 3}, "twice": {"value": 6}}


def document(**parts: Any) -> dict[str, Any]:
    actors = [
        {"id": name, "category": "car", "spawn": "1.0.-1.0"} for name in ("ego", "van", "two")
    ]
    given: dict[str, Any] = {
        "format": "odscen-scenario",
        "version": 1,
        "name": "costs $5",
        "map": {"name": "toy", "sha256": "0" * 64},
        "roi": ["r$5"],
        "actors": actors,
        "rules": [RULE],
        "parameters": {
            "gap": {"value": 3, "unit": "s", "min": 1, "max": 5},
            "twice": {"value": "2 * $gap", "description": "of $gap"},
        },
    }
    given["actors"][1]["speed"] = "$twice + 4"
    return given | parts


def read(**parts: Any) -> Scenario:
    return loads(json.dumps(document(**parts)))


def test_numbers_come_in_for_formulas_wherever_a_number_is_expected() -> None:
    found = read(seed="$gap", simulation={"duration": "100 * $twice"})
    assert found.actors[1].speed == 10.0
    assert found.seed == 3
    assert found.simulation.duration == 600.0
    assert found.parameters["twice"].value == 6.0
    when, then = found.rules[0].when, found.rules[0].then[0]
    assert when.all is not None
    assert when.all[0].ttc is not None
    assert when.all[0].ttc.below == 3.0
    assert then.walk is not None
    assert then.walk.to == (30.0, 4.0)
    assert (found.name, found.roi) == ("costs $5", ("r$5",))
    assert found.parameters["twice"].description == "of $gap"


def test_a_document_is_written_with_its_formulas_and_reads_back() -> None:
    found = read(simulation={"duration": "200 * $gap"})
    text = dumps(found)
    assert loads(text) == found
    assert dumps(loads(text)) == text
    data = json.loads(text)
    assert data["actors"][1]["speed"] == "$twice + 4"
    assert data["simulation"]["duration"] == "200 * $gap"
    assert data["rules"][0]["then"][0]["walk"]["to"] == ["10 * $gap", 4.0]
    assert data["parameters"]["twice"]["value"] == "2 * $gap"
    assert "formulas" not in data


def test_a_formula_that_gives_a_default_is_written_all_the_same() -> None:
    found = read(simulation={"teleport_after": "100 * $gap"})
    assert found.simulation.teleport_after == 300.0
    assert json.loads(dumps(found))["simulation"]["teleport_after"] == "100 * $gap"


def test_a_document_without_parameters_is_as_before() -> None:
    data = document()
    del data["parameters"], data["rules"], data["actors"][1]["speed"]
    text = dumps(loads(json.dumps(data)))
    assert "parameters" not in json.loads(text)
    assert "formulas" not in text


def test_other_values_reach_all_that_is_computed_from_them() -> None:
    found = with_values(read(), {"gap": 2.5})
    assert found.parameters["twice"].value == 5.0
    assert found.actors[1].speed == 9.0
    assert found.rules[0].then[0].walk is not None
    assert found.rules[0].then[0].walk.to == (25.0, 4.0)
    assert json.loads(dumps(found))["actors"][1]["speed"] == "$twice + 4"


def test_parts_that_are_edited_keep_or_lose_their_own_formulas_only() -> None:
    found = read()
    ego, van, two = found.actors
    moved = found.model_copy(update={"actors": (two, ego, van)})
    assert json.loads(dumps(moved))["actors"][2]["speed"] == "$twice + 4"
    faster = found.model_copy(update={"actors": (ego, van.model_copy(update={"speed": 12.0}), two)})
    assert json.loads(dumps(faster))["actors"][1]["speed"] == 12.0
    gone = found.model_copy(update={"actors": (ego, two)})
    text = dumps(gone)
    assert "$twice + 4" not in text
    assert json.loads(text)["rules"][0]["when"]["all"][0]["ttc"]["below"] == "$gap"


@pytest.mark.parametrize(
    ("changed", "words"),
    [
        ({"seed": "$gapp"}, r"seed: '\$gapp' names \$gapp, which is no parameter"),
        ({"seed": "$gap / 0"}, r"seed: '\$gap / 0' has no value"),
        ({"seed": "$gap / 2"}, "seed: Input should be a valid integer"),
        (
            {"parameters": {"gap": {"value": "$later"}, "later": {"value": 1}}},
            r"parameters/gap/val",
        ),
        ({"parameters": {**OTHER, "x": {"value": 9, "max": 5}}}, r"x: .*value 9 is outside \.\.5"),
        ({"parameters": {**OTHER, "x": {"value": 3, "min": 5, "max": 4}}}, "min 5 is above max 4"),
        ({"parameters": {**OTHER, "a-b": {"value": 3}}}, "parameters.a-b"),
    ],
)
def test_what_has_no_value_is_refused_with_its_place(changed: dict[str, Any], words: str) -> None:
    with pytest.raises(ScenarioError) as refused:
        read(**changed)
    assert re.search(words, "\n".join([str(refused.value), *refused.value.problems]))


def test_values_outside_the_bounds_and_unknown_parameters_are_refused() -> None:
    with pytest.raises(ScenarioError, match="the scenario document has a problem") as refused:
        with_values(read(), {"gap": 6})
    assert "value 6 is outside 1..5 s" in refused.value.problems[0]
    with pytest.raises(ScenarioError, match="no parameter 'gup'; there are gap, twice"):
        with_values(read(), {"gup": 1})
