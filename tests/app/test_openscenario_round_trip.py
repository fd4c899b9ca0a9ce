"""Exports read again: the same scenario, but for what the export lists; also files of others."""

from __future__ import annotations

import json
import re
import shutil
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest
from lxml import etree

from odscen.app.exchange.exports import export
from odscen.app.exchange.imports import import_file
from odscen.app.generation import generate
from odscen.app.scenarios import read_scenario
from odscen.app.template_scenarios import template_scenario
from odscen.changes.acting_differences import acting_differences
from odscen.formats.openscenario.dialect import VERSIONS
from odscen.scenario.document.sampling_config import SamplingConfig
from odscen.scenario.document.scenario_document import Environment
from odscen.scenario.sampling.generation_settings import GenerationSettings
from tests.sumo.story_case import MIDDLE, document, entry, node_at, workspace

if TYPE_CHECKING:
    from odscen.scenario.document.scenario_document import Scenario

PLACES = {
    "cut-in": "motorway_weave",
    "lead-brakes": "motorway_weave",
    "bus-leaves": "motorway_weave",
    "hidden-child": "signal_crossing",
    "mid-block": "signal_crossing",
    "red-light": "signal_crossing",
    "oncoming": "rural_hills",
}
SHARED = Path(__file__).parents[3] / "shared"


def there_and_back(
    scenario: Scenario, folder: Path, version: str
) -> tuple[Scenario, dict[str, list[dict[str, str]]]]:
    """Scenario that an export is read as, and what the export lists."""
    files = export(workspace(), scenario, folder, to="openscenario", options={"version": version})
    (file,) = (one for one in files if one.suffix == ".xosc")
    (notes,) = (one for one in files if one.name.endswith(".export.json"))
    return import_file(workspace(), file).scenario, json.loads(notes.read_text())


def unlisted(before: Scenario, after: Scenario, notes: dict[str, Any]) -> list[str]:
    """Differences whose place is in none of the lists of the export."""
    listed = {row["place"] for rows in notes.values() for row in rows}
    return [
        one.words
        for one in acting_differences(before, after)
        if not any(_covers(place, _indexed(before, one.place)) for place in listed)
    ]


def _covers(listed: str, place: str) -> bool:
    """Whether a listed place is the place, or that of what it is in; or a part of its condition."""
    return (
        place == listed
        or place.startswith((f"{listed}.", f"{listed}["))
        or (place.endswith(".when") and listed.startswith(place))
    )


def _indexed(scenario: Scenario, place: tuple[str, ...]) -> str:
    """A place as exports write it: ``rules[1].then[0]``."""
    if place[0] in ("rules", "actors"):
        ids = [one.id for one in getattr(scenario, place[0])]
        head = f"{place[0]}[{ids.index(place[1])}]"
        rest = list(place[2:])
        if rest[:1] == ["then"] and len(rest) > 1:
            rest[:2] = [f"then[{rest[1]}]"]
        return ".".join([head, *rest])
    return ".".join(place)


@pytest.mark.slow
@pytest.mark.parametrize("version", VERSIONS)
@pytest.mark.parametrize("template", PLACES)
def test_a_template_comes_back_but_for_what_the_export_lists(
    template: str, version: str, tmp_path: Path
) -> None:
    entry(PLACES[template])
    before = template_scenario(workspace(), template, PLACES[template])
    after, notes = there_and_back(before, tmp_path, version)
    assert unlisted(before, after, notes) == []
    assert [one.id for one in after.actors] == [one.id for one in before.actors]
    if version != "1.0":
        assert [one.id for one in after.rules] == [one.id for one in before.rules]


@pytest.mark.parametrize("template", ["cut-in", "bus-leaves", "lead-brakes"])
def test_a_scene_that_openscenario_can_say_comes_back_whole(template: str, tmp_path: Path) -> None:
    entry(PLACES[template])
    judged = template_scenario(workspace(), template, PLACES[template])
    assert there_and_back(judged, tmp_path / "judged", "1.2")[1]["left_out"] == [
        {"place": "criteria", "reason": "OpenSCENARIO has no word for it"}
    ]
    before = judged.model_copy(update={"criteria": ()})
    after, notes = there_and_back(before, tmp_path, "1.2")
    assert notes == {"approximated": [], "left_out": []}
    assert acting_differences(before, after) == ()


@pytest.mark.parametrize("after_story", ["auto", "never", 2.5])
def test_how_long_a_run_goes_on_after_its_story_comes_back(
    after_story: float | str, tmp_path: Path
) -> None:
    entry("motorway_weave")
    scenario = template_scenario(workspace(), "cut-in", "motorway_weave")
    simulation = scenario.simulation.model_copy(update={"after_story": after_story})
    before = scenario.model_copy(update={"simulation": simulation})
    after, _ = there_and_back(before, tmp_path, "1.2")
    assert after.simulation.after_story == after_story


def test_bodies_exact_starts_and_headways_ahead_come_back(tmp_path: Path) -> None:
    entry("motorway_weave")
    ego, van = (node_at("motorway_weave", x, MIDDLE) for x in (300.0, 340.0))
    actors = [
        {"id": "ego", "category": "car", "spawn": ego, "goal": None, "driver": "story",
         "size": {"length": 4.2, "width": 1.75}, "longitudinal_offset": 0.7, "ego": True},
        {"id": "van", "category": "van", "spawn": van, "goal": None, "driver": "story",
         "longitudinal_offset": -0.4, "lateral_offset": 0.5},
    ]  # fmt: skip
    when = {"headway": {"of": "ego", "to": "van", "above": 2.0, "ahead": True, "free": False}}
    rules = [{"id": "r", "actor": "van", "when": when, "then": [{"brake": {"by": 3.0}}]}]
    before = document("motorway_weave", actors, rules)
    after, _ = there_and_back(before, tmp_path, "1.2")
    assert [(one.size, one.longitudinal_offset, one.lateral_offset) for one in after.actors] == [
        (one.size, one.longitudinal_offset, one.lateral_offset) for one in before.actors
    ]
    assert after.rules[0].when == before.rules[0].when


@pytest.mark.slow
def test_sampled_scenarios_come_back_but_for_what_the_export_lists(tmp_path: Path) -> None:
    for name in ("town_5x5", "roundabout", "t_junction_signs"):
        entry(name)
    config = SamplingConfig(actors_max=20, ego=True, pedestrian_share=0.3)
    settings = GenerationSettings(config=config, count=10)
    for number, file in enumerate(generate(workspace(), settings=settings, out=tmp_path / "in")):
        before = read_scenario(file)
        after, notes = there_and_back(before, tmp_path / "out", VERSIONS[number % 4])
        assert unlisted(before, after, notes) == []
        assert len(after.actors) == len(before.actors) > 3
        assert not after.rules
        places = {one.place[0] for one in acting_differences(before, after)}
        assert places <= {"seed", "roi"}


@pytest.mark.parametrize("version", ["1.0", "1.3"])
def test_weather_and_time_come_back_unless_the_file_is_changed(
    version: str, tmp_path: Path
) -> None:
    entry("motorway_weave")
    scene = template_scenario(workspace(), "cut-in", "motorway_weave")
    sky = Environment(preset="MidRainSunset", parameters={"fog_density": 40.0})
    demand = scene.demand.model_copy(update={"clock": 6.5 * 3600})
    before = scene.model_copy(update={"environment": sky, "demand": demand})
    after, _ = there_and_back(before, tmp_path, version)
    assert (after.environment, after.demand.clock) == (sky, 6.5 * 3600)
    (file,) = tmp_path.glob("*.xosc")
    text = file.read_text()
    sight = re.search(r'visualRange="([0-9.]+)"', text)
    assert sight is not None
    file.write_text(text.replace(sight[0], 'visualRange="500"'))
    changed = import_file(workspace(), file).scenario.environment
    assert changed.preset == "ClearNoon"
    # 10 km (50 m / 10 km)^d = 500 m
    assert changed.parameters["fog_density"] == pytest.approx(56.542, abs=0.01)


@pytest.mark.slow
def test_who_departs_later_and_what_begins_with_another_rule_come_back(tmp_path: Path) -> None:
    goal = node_at("town_5x5", 390.0, 103.4)
    actors = [
        {"id": "ego", "category": "car", "spawn": node_at("town_5x5", 215.0, 103.4), "ego": True,
         "goal": goal, "initial_speed": 8.0, "lateral_offset": 0.3, "style": "sporty"},
        {"id": "bus", "category": "bus", "spawn": node_at("town_5x5", 300.0, 103.4),
         "goal": goal, "depart": 4.0, "via": [node_at("town_5x5", 330.0, 103.4)]},
    ]  # fmt: skip
    begun = {"rule": {"id": "slow", "has": "started"}}
    near = {"reaches": {"of": "ego", "place": node_at("town_5x5", 250.0, 103.4), "within": 3.0}}
    rules = [
        {"id": "slow", "actor": "ego", "when": {"time": {"after": 2.0}, "delay": 1.0},
         "then": [{"speed": {"to": 4.0, "rate": 2.0}}, {"release": {}}], "times": 2},
        {"id": "both", "actor": "ego", "when": {"all": [begun, near]}, "then": [{"go": {}}]},
        {"id": "any", "actor": "bus", "when": {"any": [begun, {"not": {
            "speed": {"of": "ego", "above": 5.0}}}]}, "then": [{"go": {}}]},
    ]  # fmt: skip
    before = document("town_5x5", actors, rules, flows=[])
    for version in ("1.1", "1.3"):
        after, notes = there_and_back(before, tmp_path / version, version)
        assert unlisted(before, after, notes) == []
        assert [rule.id for rule in after.rules] == ["slow", "both", "any"]
        assert after.actors == before.actors


def test_a_rest_at_the_end_of_a_path_and_an_offset_by_nothing_come_back(tmp_path: Path) -> None:
    goal, spawn = (node_at("town_5x5", x, 103.4) for x in (390.0, 215.0))
    actors = [
        {"id": "ego", "category": "car", "spawn": spawn, "goal": goal, "initial_speed": 8.0},
        {"id": "van", "category": "van", "spawn": node_at("town_5x5", 240.0, 103.4), "goal": goal},
    ]
    path = {"points": [[230.0, 103.4], [250.0, 103.4], [250.0, 103.4]], "times": [2.0, 4.0, 6.0]}
    rules = [
        {"id": "rests", "actor": "ego", "when": {"time": {"after": 0.0}}, "then": [{"path": path}]},
        {"id": "beside", "actor": "van", "when": {"time": {"after": 1.0}}, "then": [
            {"appear": {"at": [262.0, 105.0, 0.0], "speed": 5.0}},
            {"offset": {"to": 1.5, "over": 0.1}},
            {"offset": {"to": 1.5, "over": 4.0}},
        ]},
    ]  # fmt: skip
    before = document("town_5x5", actors, rules, flows=[])
    after, _ = there_and_back(before, tmp_path, "1.2")
    assert acting_differences(before, after) == ()


def test_what_is_changed_in_the_file_holds_and_not_the_property(tmp_path: Path) -> None:
    entry("motorway_weave")
    before = template_scenario(workspace(), "cut-in", "motorway_weave")
    export(workspace(), before, tmp_path, to="openscenario", options={"version": "1.2"})
    (file,) = tmp_path.glob("*.xosc")
    tree = etree.parse(file)
    ego = tree.find('.//Private[@entityRef="ego"]')
    assert ego is not None
    place, speed = ego.find(".//WorldPosition"), ego.find(".//AbsoluteTargetSpeed")
    assert place is not None
    assert speed is not None
    place.set("x", f"{float(place.get('x', '')) + 10.0}")
    speed.set("value", "12.5")
    tree.write(file)
    after = import_file(workspace(), file).scenario
    changed = {one.place: one.after for one in acting_differences(before, after)}
    assert changed.keys() == {
        ("actors", "ego", "spawn"), ("actors", "ego", "initial_speed"), ("criteria",)
    }  # fmt: skip
    assert changed["actors", "ego", "initial_speed"] == "12.5"


@pytest.mark.parametrize(
    ("name", "value", "words"),
    [("goal", "", "goal: String should have at least 1"), ("spawn", "[1]", "spawn: Input should")],
)
def test_properties_that_no_actor_can_have_refuse_their_road_user(
    tmp_path: Path, name: str, value: str, words: str
) -> None:
    entry("motorway_weave")
    before = template_scenario(workspace(), "cut-in", "motorway_weave")
    export(workspace(), before, tmp_path, to="openscenario", options={"version": "1.2"})
    (file,) = tmp_path.glob("*.xosc")
    tree = etree.parse(file)
    (van,) = (one for one in before.actors if not one.ego)
    path = f'.//ScenarioObject[@name="{van.id}"]//Property[@name="odscen.{name}"]'
    (property_,) = tree.findall(path)
    property_.set("value", value)
    tree.write(file)
    found = import_file(workspace(), file)
    assert [one.id for one in found.scenario.actors] == [one.id for one in before.actors if one.ego]
    assert any(words in row.reason for row in found.lists["refused"])


def wholly_taken() -> list[Path]:
    files = sorted((SHARED / "osc").rglob("*.xosc")) if (SHARED / "osc").is_dir() else []
    return [one for one in files if "atalog" not in str(one)]


@pytest.mark.slow
def test_files_of_others_that_were_wholly_taken_say_the_same_when_they_are_written_again(
    tmp_path: Path,
) -> None:
    files = wholly_taken()
    if not files:
        pytest.skip("../shared/osc is not here: the collections of files to import")
    tried = 0
    for file in files[::5]:
        try:
            read = import_file(workspace(), file, maps=SHARED / "maps" / "carla-2020")
        except Exception:
            continue
        if read.lists["refused"] or any(one.severity == "error" for one in read.problems):
            continue
        after, notes = there_and_back(read.scenario, tmp_path / file.stem, "1.2")
        assert unlisted(read.scenario, after, notes) == [], file.name
        shutil.rmtree(tmp_path / file.stem)
        tried += 1
    assert tried > 5
