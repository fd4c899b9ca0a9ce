import json
import re
from pathlib import Path

from pydantic import TypeAdapter

from odscen.scenario.document.json_form import loads
from odscen.scenario.document.measures_document import Measure
from odscen.scenario.document.sampling_config import SamplingConfig, loads_config
from odscen.scenario.document.scenario_document import Demand, Transit
from odscen.scenario.document.signals_document import JunctionTiming

ROOT = Path(__file__).parents[3]
DOCS = ROOT / "docs"


def block(page: str, language: str) -> str:
    text = (DOCS / page).read_text(encoding="utf-8")
    found = re.search(rf"```{language}\n(.*?)```", text, re.DOTALL)
    assert found
    return found[1]


def test_the_example_in_the_guide_is_a_scenario() -> None:
    text = block("scenario-format.md", "json")
    text = text.replace("ab1f...64 hexadecimal digits", "a" * 64)
    assert [actor.id for actor in loads(text).actors] == ["car-1", "bus-1", "anna"]


def test_the_example_configuration_can_be_read_and_states_the_defaults() -> None:
    example, default = loads_config(block("sampling.md", "toml")), SamplingConfig()
    assert example.behaviour == default.behaviour
    assert example.places == default.places
    assert example.roi == default.roi


def test_every_code_of_the_checks_is_listed_in_the_guide() -> None:
    sources = sorted((ROOT / "src/odscen/scenario/checks").glob("*.py"))
    code = re.compile(r"(?:error|warning)\(\s*\"([a-z_]+)\"")
    used = {name for path in sources for name in code.findall(path.read_text(encoding="utf-8"))}
    guide = (DOCS / "scenario-format.md").read_text(encoding="utf-8")
    assert len(used) > 20
    assert sorted(name for name in used if f"`{name}`" not in guide) == []


def test_the_example_of_demand_is_one() -> None:
    example = json.loads("{" + block("demand.md", "json") + "}")["demand"]
    demand = Demand.model_validate_json(json.dumps(example), strict=True)
    named = ["west", "ramp", "commuters", "survey", "others"]
    assert [part.id for _, part in demand.parts] == named


def test_the_example_of_public_transport_is_one() -> None:
    example = json.loads("{" + block("transit.md", "json") + "}")["transit"]
    transit = Transit.model_validate_json(json.dumps(example), strict=True)
    assert [one.stop for one in transit.lines[0].stops] == [stop.id for stop in transit.stops]


def test_the_examples_of_measures_are_measures_and_each_has_its_picture() -> None:
    text = (DOCS / "measures.md").read_text(encoding="utf-8")
    examples = re.findall(r"```json\n(.*?)\n```", text, re.DOTALL)
    measures = [TypeAdapter(Measure).validate_json(one, strict=True) for one in examples]
    kinds = {one.kind for one in measures}
    assert kinds == {
        "closure", "roadworks", "incident", "speed_limit", "permission", "signal_outage",
    }  # fmt: skip
    for one in measures:
        assert f"images/measure-{one.id}.svg" in text
        assert (DOCS / f"images/measure-{one.id}.svg").is_file()


def test_the_example_of_a_signal_program_is_one() -> None:
    timing = JunctionTiming.model_validate_json(block("signals.md", "json"), strict=True)
    assert [plan.id for plan in timing.plans] == ["day", "evening"]
