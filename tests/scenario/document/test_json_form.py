import json
import os
from pathlib import Path

import pytest
from hypothesis import given

from odscen.base.categories import Category
from odscen.base.errors import ScenarioError
from odscen.scenario.document.drivers_document import Drivers
from odscen.scenario.document.json_form import dumps, loads, schema
from odscen.scenario.document.scenario_document import Actor, MapReference, Scenario
from odscen.scenario.document.signals_document import JunctionTiming, Signals
from odscen.scenario.forms.any_form import read_any
from tests.scenario.strategies import scenarios

SCHEMA = Path(__file__).parents[3] / "docs" / "scenario.schema.json"
MAP = MapReference(name="toy", sha256="0" * 64)


@pytest.mark.slow
@given(scenarios)
def test_a_document_reads_back_as_it_was_written(scenario: Scenario) -> None:
    text = dumps(scenario)
    assert loads(text) == scenario
    assert dumps(loads(text)) == text
    assert read_any(text.encode()) == scenario


def test_each_actor_is_one_line_without_defaults() -> None:
    actor = Actor(id="car-1", category=Category.CAR, spawn="1.0.-1.0", speed=12.5)
    text = dumps(Scenario(name="one", map=MAP, roi=("r1",), actors=(actor,)))
    line = '    {"id": "car-1", "category": "car", "spawn": "1.0.-1.0", "speed": 12.5}'
    assert line in text.splitlines()


def test_signals_are_written_only_where_they_are_not_the_maps_and_without_defaults() -> None:
    plain = Scenario(name="one", map=MAP, roi=("r1",))
    assert "signals" not in dumps(plain)
    timing = JunctionTiming(junction="54", green=(20.0, 7.0))
    text = dumps(plain.model_copy(update={"signals": Signals(junctions=(timing,))}))
    line = '  "signals": {"junctions": [{"junction": "54", "green": [20.0, 7.0]}]},'
    assert line in text.splitlines()


def test_drivers_are_written_only_where_they_are_not_the_usual_ones() -> None:
    plain = Scenario(name="one", map=MAP, roi=("r1",))
    assert "drivers" not in dumps(plain)
    text = dumps(plain.model_copy(update={"drivers": Drivers(saturation_flow=1900)}))
    assert '  "drivers": {"saturation_flow": 1900.0},' in text.splitlines()


def test_headway_and_saturation_flow_are_not_both_given() -> None:
    text = dumps(Scenario(name="one", map=MAP, roi=("r1",), drivers=Drivers(headway=1.5)))
    both = text.replace('"headway": 1.5', '"headway": 1.5, "saturation_flow": 1900')
    with pytest.raises(ScenarioError) as caught:
        loads(both, file="x.json")
    assert "give one of saturation_flow and headway" in "".join(caught.value.problems)


def test_all_problems_are_reported_with_their_places() -> None:
    document = {
        "name": "x",
        "map": {"name": "toy", "sha256": "0" * 64},
        "roi": ["r1"],
        "actors": [
            {"id": "a", "category": "car", "spawn": "1.0.-1.0"},
            {"id": "b", "category": "ship", "spawn": "1.0.-1.0", "speed": -1, "wings": 2},
        ],
    }
    with pytest.raises(ScenarioError) as caught:
        loads(json.dumps(document), file="x.json")
    assert caught.value.file == "x.json"
    places = [problem.split(":")[0] for problem in caught.value.problems]
    assert places == ["actors[1].category", "actors[1].speed", "actors[1].wings"]
    assert "-1" in caught.value.problems[1]


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("", "EOF"),
        ("{", "EOF"),
        ("[]", "must be a JSON object"),
        ('{"format": "something-else"}', "something-else"),
        ('{"format": "odscen-scenario", "version": 99}', "newer odscen"),
        ('{"name": "x", "map": 3, "roi": []}', "map"),
        ("[" * 100_000, "recursion"),
    ],
)
def test_what_is_not_a_scenario_says_so(text: str, reason: str) -> None:
    with pytest.raises(ScenarioError, match=r"(?s).*") as caught:
        read_any(text)
    assert reason in str(caught.value)


def test_bytes_that_are_not_text_are_refused() -> None:
    with pytest.raises(ScenarioError, match="byte 1 is not UTF-8"):
        read_any(b"{\xff")


def test_a_signal_program_has_a_line_for_each_group_and_stage() -> None:
    plain = Scenario(name="one", map=MAP, roi=("r1",))
    timing = JunctionTiming.model_validate(
        {
            "junction": "54",
            "groups": [{"id": "V1", "movements": ["r1"]}, {"id": "V2", "movements": ["r2"]}],
            "stages": [{"id": "1", "protected": ["V1"], "green": 20}],
        }
    )
    scenario = plain.model_copy(update={"signals": Signals(junctions=(timing,))})
    text = dumps(scenario)
    assert '        {"id": "V2", "movements": ["r2"]}' in text.splitlines()
    assert loads(text) == scenario


def test_numbers_in_quotes_are_not_numbers() -> None:
    with pytest.raises(ScenarioError, match="seed"):
        loads(
            '{"name": "x", "map": {"name": "t", "sha256": "'
            + "0" * 64
            + '"}, "roi": [], "seed": "3"}'
        )


@pytest.mark.golden
def test_the_published_schema_is_that_of_the_code() -> None:
    text = json.dumps(schema(), indent=2) + "\n"
    if os.environ.get("ODSCEN_GOLDEN") == "write":
        SCHEMA.write_text(text, encoding="utf-8")
    assert SCHEMA.read_text(encoding="utf-8") == text
