"""Scenarios as OpenSCENARIO: positions, triggers and actions, and ASAM's schemas and checks."""

from __future__ import annotations

import json
import math
import re
import subprocess
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest
from lxml import etree

from odscen.app.exchange.exports import export
from odscen.base.errors import InputError
from odscen.formats.openscenario.dialect import VERSIONS
from odscen.lanegraph.query import node_index
from odscen.scenario.story.action_kinds import ACTIONS
from odscen.scenario.story.condition_kinds import CONDITIONS
from tests.sumo.story_case import document, loaded, node_at, walk_node_at, workspace

if TYPE_CHECKING:
    from odscen.scenario.document.scenario_document import Scenario

ROOT = Path(__file__).parents[2]
TOWN = "town_5x5"
QC = ROOT / "build" / "qc"

WHEN: dict[str, dict[str, Any]] = {
    "time": {"time": {"after": 3.0}},
    "ttc": {"ttc": {"to": "ego", "below": 3.0}},
    "headway": {"headway": {"to": "ego", "below": 1.5}, "edge": "rising"},
    "to": {"distance": {"to": "ego", "below": 30.0, "along": "lane"}, "delay": 0.5},
    "place": {"distance": {"place": [270.0, 103.4], "below": 10.0, "free": False}},
    "relative_speed": {"relative_speed": {"to": "ego", "above": -2.0}},
    "speed": {"speed": {"of": "ego", "above": 5.0}},
    "acceleration": {"acceleration": {"below": -1.0}},
    "stopped": {"stopped": {"seconds": 2.0}},
    "reaches": {"reaches": {"of": "ego", "place": [270.0, 103.4], "within": 3.0}},
    "travelled": {"travelled": {"above": 40.0}},
    "rule": {"rule": {"id": "time", "has": "started"}},
    "touched": {"touched": {"to": "ego"}},
    "off_road": {"off_road": {}},
    "both": {"all": [{"time": {"after": 1.0}}, {"any": [
        {"speed": {"above": 3.0}}, {"not": {"ttc": {"to": "ego", "above": 4.0}}},
    ]}]},
}  # fmt: skip


def scenario() -> Scenario:
    goal = node_at(TOWN, 390.0, 103.4)
    actors: list[dict[str, Any]] = [
        {"id": "ego", "category": "car", "spawn": node_at(TOWN, 215.0, 103.4), "ego": True,
         "goal": goal, "initial_speed": 8.0, "speed": 12.0, "lateral_offset": 0.3},
        {"id": "van", "category": "van", "spawn": node_at(TOWN, 240.0, 103.4), "goal": goal},
        {"id": "late", "category": "bus", "spawn": node_at(TOWN, 300.0, 103.4), "depart": 4.0,
         "goal": goal, "style": "sporty"},
        {"id": "child", "category": "pedestrian", "spawn": walk_node_at(TOWN, 270.0, 100.5),
         "goal": walk_node_at(TOWN, 240.0, 109.5)},
    ]  # fmt: skip
    then: dict[str, list[dict[str, Any]]] = {
        "time": [{"speed": {"to": 4.0, "rate": 2.0}}, {"brake": {"by": 3.0, "hold": 1.0}}],
        "ttc": [{"lane": {"by": 1, "over": 2.5}}],
        "headway": [{"offset": {"to": -0.4, "over": 2.0}}],
        "to": [{"keep_gap": {"to": "ego", "seconds": 1.5, "lasting": 4.0}}],
        "place": [{"cut_in": {"to": "ego", "over": 3.0}}],
        "relative_speed": [{"together": [{"go": {}}, {"speed": {"to": 0.0, "shape": "step"}}]}],
        "speed": [{"stop": {"within": 12.0}}],
        "acceleration": [{"path": {"points": [[300.0, 103.4], [320.0, 104.0]], "speed": 6.0}}],
        "stopped": [{"path": {"points": [[300.0, 103.4], [320.0, 104.0]], "times": [1.0, 3.0]}}],
        "reaches": [{"replay": {"rows": [[0.0, 250.0, 103.4, 0.0], [2.0, 262.0, 103.4, 0.0]]}}],
        "travelled": [
            {
                "arrive": {
                    "at": [280.0, 103.4],
                    "to": "ego",
                    "when_at": [290.0, 103.4],
                    "speed": 7.0,
                    "steady": 5.0,
                }
            }
        ],
        "rule": [{"goal": {"to": goal}}],
        "touched": [{"vanish": {}}],
        "off_road": [{"release": {}}, {"drive": {"by": "story"}}],
        "both": [{"lights": {"indicator": "left", "brake": True}}],
    }
    rules = [
        {"id": name, "actor": "van", "when": when, "then": then[name], "times": 2}
        for name, when in WHEN.items()
    ]
    walk = {"walk": {"to": [270.0, 109.5], "through": [[270.0, 104.0]], "speed": 2.0}}
    rules.append({"id": "run", "actor": "child", "when": {"time": {"after": 2.0}}, "then": [walk]})
    rules.append(
        {"id": "horn", "actor": "van", "when": {"time": {"after": 2.0}}, "then": [{"horn": {}}]}
    )
    rules.append(
        {"id": "after", "actor": "van", "when": {"rule": {"id": "horn"}}, "then": [{"go": {}}]}
    )
    rules.append(
        {"id": "end", "actor": "van", "when": {"stopped": {"of": "ego", "seconds": 3.0}},
         "then": [{"end": {}}]}
    )  # fmt: skip
    rules.append(
        {"id": "gone", "actor": "van", "when": {"time": {"after": 9.0}},
         "then": [{"vanish": {}}, {"end": {}}]}
    )  # fmt: skip
    return document(TOWN, actors, rules, flows=[], environment={"preset": "HardRainNoon"})


@cache
def written(version: str, folder: Path) -> tuple[Path, dict[str, Any]]:
    files = export(
        workspace(), scenario(), folder / version, to="openscenario", options={"version": version}
    )
    (file,) = (path for path in files if path.suffix == ".xosc")
    (notes,) = (path for path in files if path.name.endswith(".export.json"))
    return file, json.loads(notes.read_text(encoding="utf-8"))


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("xosc")


@pytest.fixture(scope="module")
def tree(folder: Path) -> Any:
    return etree.parse(written("1.2", folder)[0])


def the(tree: Any, path: str) -> Any:
    (found,) = tree.xpath(path)
    return found


def event(tree: Any, name: str) -> Any:
    return the(tree, f'//Event[@name="{name}"]')


def test_an_actor_begins_with_its_rear_axle_where_its_body_needs_it(tree: Any) -> None:
    lanes = loaded(TOWN).sumo.graph.lanes
    node = node_index(loaded(TOWN).sumo.graph, scenario().actors[0].spawn)
    at = the(tree, '//Private[@entityRef="ego"]//WorldPosition').attrib
    box = the(tree, '//ScenarioObject[@name="ego"]//BoundingBox/Center').attrib
    hdg, ahead = float(at["h"]), float(box["x"])
    assert hdg == pytest.approx(lanes.hdg[node], abs=1e-6)
    # the centre of the body is 0.3 m left of the node
    left = (-0.3 * math.sin(hdg), 0.3 * math.cos(hdg))
    assert float(at["x"]) + ahead * math.cos(hdg) == pytest.approx(
        lanes.x[node] + left[0], abs=1e-5
    )
    assert float(at["y"]) + ahead * math.sin(hdg) == pytest.approx(
        lanes.y[node] + left[1], abs=1e-5
    )
    speed = the(tree, '//Private[@entityRef="ego"]//AbsoluteTargetSpeed')
    assert float(speed.get("value")) == 8.0


def test_goals_are_lane_positions_and_other_fields_properties(tree: Any) -> None:
    key = the(tree, '//Private[@entityRef="van"]//AcquirePositionAction//LanePosition').attrib
    name = scenario().actors[1].goal
    assert name is not None
    assert name.startswith(f"{key['roadId']}.")
    assert name.split(".")[2] == key["laneId"]
    properties = {
        one.get("name"): one.get("value")
        for one in the(tree, '//ScenarioObject[@name="late"]//Properties')
    }
    late = scenario().actors[2]
    assert properties == {
        "type": "simulation",
        "odscen.style": "sporty",
        "odscen.spawn": late.spawn,
        "odscen.goal": late.goal,
        "odscen.depart": "4.0",
    }


def test_who_departs_later_is_added_then(tree: Any) -> None:
    assert tree.xpath('//Private[@entityRef="late"]') == []
    added = event(tree, "late departs")
    assert added.xpath(".//AddEntityAction")
    assert float(the(added, ".//SimulationTimeCondition").get("value")) == 4.0


def test_conditions_have_their_values_rules_delays_and_edges(tree: Any) -> None:
    ttc = the(event(tree, "ttc.then[0]"), ".//TimeToCollisionCondition")
    assert (ttc.get("value"), ttc.get("rule")) == ("3", "lessOrEqual")
    assert the(ttc, ".//EntityRef").get("entityRef") == "ego"
    headway = the(event(tree, "headway.then[0]"), ".//Condition")
    assert headway.get("conditionEdge") == "rising"
    near = the(event(tree, "to.then[0]"), ".//Condition")
    assert near.get("delay") == "0.5"
    distance = the(near, ".//RelativeDistanceCondition")
    assert (distance.get("coordinateSystem"), distance.get("freespace")) == ("road", "true")
    of = the(event(tree, "speed.then[0]"), ".//TriggeringEntities/EntityRef")
    assert of.get("entityRef") == "ego"


def test_nested_conditions_become_groups_of_which_any_fires(folder: Path) -> None:
    groups = event(etree.parse(written("1.3", folder)[0]), "both.then[0]").xpath(
        "./StartTrigger/ConditionGroup"
    )
    kinds = [[one.tag for one in group.xpath(".//*[@rule]")] for group in groups]
    assert kinds == [
        ["SimulationTimeCondition", "SpeedCondition"],
        ["SimulationTimeCondition", "TimeToCollisionCondition"],
    ]
    assert the(groups[1], ".//TimeToCollisionCondition").get("rule") == "lessOrEqual"


def test_items_of_then_follow_one_another(tree: Any) -> None:
    second = event(tree, "time.then[1]")
    state = the(second, ".//StoryboardElementStateCondition")
    assert state.get("storyboardElementRef") == "time.then[0]"
    assert state.get("state") == "completeState"
    assert second.get("maximumExecutionCount") == "2"
    started = event(tree, "rule.then[0]").xpath(".//StoryboardElementStateCondition/@state")
    assert started == ["runningState", "completeState"]


def test_actions_have_their_numbers(tree: Any) -> None:
    change = the(event(tree, "ttc.then[0]"), ".//LaneChangeAction")
    dynamics = the(change, "./LaneChangeActionDynamics").attrib
    assert (dynamics["dynamicsShape"], dynamics["value"]) == ("sinusoidal", "2.5")
    assert the(change, ".//RelativeTargetLane").get("value") == "1"
    lead = event(tree, "stopped.then[0]").xpath(".//Vertex")
    # It begins just before its first point, as nobody knows where the actor is by then.
    assert [vertex.get("time") for vertex in lead] == ["0.99", "1", "3"]
    ahead = float(the(tree, '//ScenarioObject[@name="van"]//BoundingBox/Center').get("x"))
    first = event(tree, "reaches.then[0]").xpath(".//Vertex//WorldPosition")[0]
    assert float(first.get("x")) == pytest.approx(250.0 - ahead, abs=1e-5)


def test_what_is_written_is_what_the_table_of_rules_names(folder: Path) -> None:
    latest = etree.parse(written("1.3", folder)[0])
    for rule in scenario().rules:
        if rule.id in ("horn", "after"):
            continue
        for index, item in enumerate(rule.then):
            if item.end is not None:  # the stop trigger, see below
                continue
            tags = {one.tag for one in event(latest, f"{rule.id}.then[{index}]").iter()}
            for part in item.parts:
                assert tags & set(re.findall(r"[A-Z]\w+", ACTIONS[part.kind].openscenario))
        if (kind := rule.when.kind) in CONDITIONS and rule.id != "end":
            tags = {one.tag for one in event(latest, f"{rule.id}.then[0]").iter()}
            assert tags & set(re.findall(r"[A-Z]\w+", CONDITIONS[kind].openscenario))


@pytest.mark.parametrize("version", ["1.0", "1.2"])
def test_rules_that_end_the_run_are_stop_triggers(folder: Path, version: str) -> None:
    tree = etree.parse(written(version, folder)[0])
    assert not tree.xpath('//Event[starts-with(@name, "end.")]')
    # ScenarioRunner asks the act when it is over, and not the storyboard
    for stop in ["Storyboard/StopTrigger", *(["//Act/StopTrigger"] * (version == "1.0"))]:
        groups = the(tree, stop).findall("ConditionGroup")
        kinds = [[one.tag for one in group.xpath(".//*[@value or @duration or @state]")
                  if one.tag.endswith("Condition")] for group in groups]  # fmt: skip
        assert kinds == [
            ["SimulationTimeCondition"],
            ["StandStillCondition"],
            ["StoryboardElementStateCondition"],
        ]  # fmt: skip
        last = groups[2].find(".//StoryboardElementStateCondition")
        assert (last.get("storyboardElementRef"), last.get("state")) == (
            "gone.then[0]", "completeState"
        )  # fmt: skip


def test_what_cannot_be_said_is_listed_with_its_place_and_what_waits_for_it(folder: Path) -> None:
    _, notes = written("1.2", folder)
    left = {row["place"]: row["reason"] for row in notes["left_out"]}
    horn = len(WHEN) + 1
    assert left[f"rules[{horn}]"] == "OpenSCENARIO has no action 'horn'"
    assert left[f"rules[{horn + 1}]"] == "rule 'horn', which is left out"
    assert left[f"rules[{len(WHEN) - 1}]"].startswith("lights of vehicles, which can be written")
    assert len(left) == 3
    assert {
        "place": "rules[2].then[0]",
        "reason": "an offset has no duration but an acceleration",
    } in (notes["approximated"])
    _, latest = written("1.3", folder)
    assert len(latest["left_out"]) == 2


def test_rain_is_wet_and_the_map_lies_beside(tree: Any, folder: Path) -> None:
    friction = float(the(tree, "//RoadCondition").get("frictionScaleFactor"))
    assert 0.65 < friction < 1.0
    assert the(tree, "//Precipitation").get("precipitationType") == "rain"
    file = written("1.2", folder)[0]
    beside = file.parent / the(tree, "//LogicFile").get("filepath")
    assert beside.read_bytes() == (ROOT / "maps" / f"{TOWN}.xodr").read_bytes()


@pytest.mark.parametrize("version", VERSIONS)
def test_the_file_is_valid_and_asams_checks_find_nothing(folder: Path, version: str) -> None:
    if not (QC / "bin" / "qc_openscenario").exists():
        pytest.skip("asam-qc-openscenarioxml is not here; `make check-maps` installs it")
    file = written(version, folder)[0]
    schema = next(QC.glob(f"lib/python*/site-packages/qc_openscenario/schema/{version}.0/*.xsd"))
    etree.XMLSchema(etree.parse(schema)).assertValid(etree.parse(file))
    done = subprocess.run(
        [QC / "bin" / "python", ROOT / "tools" / "check_maps.py", file],
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )
    assert done.returncode == 0, done.stdout
    completed = re.search(r"(\d+) checks completed, 0 issues", done.stdout)
    assert completed is not None
    assert int(completed[1]) >= 5


def test_the_version_is_the_one_asked_for_or_refused(folder: Path, tmp_path: Path) -> None:
    for version in VERSIONS:
        header = the(etree.parse(written(version, folder)[0]), "//FileHeader")
        assert f"{header.get('revMajor')}.{header.get('revMinor')}" == version
    with pytest.raises(InputError, match=r"'2.0' cannot be written; choose one of 1.0, 1.1"):
        export(
            workspace(), scenario(), tmp_path / "x", to="openscenario", options={"version": "2.0"}
        )
    with pytest.raises(InputError, match="the format sumo has no version"):
        export(workspace(), scenario(), tmp_path / "x", to="sumo", options={"version": "1.0"})
    assert not (tmp_path / "x").exists()
