"""OpenSCENARIO files as scenarios, on a straight road written here."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

import pytest

from odscen.app.exchange.imports import import_file
from odscen.base.errors import InputError, NoMapError
from odscen.maps.store import Workspace

if TYPE_CHECKING:
    from pathlib import Path

ROAD = """<OpenDRIVE><header revMajor="1" revMinor="6"/>
<road id="0" length="500" junction="-1"><planView><geometry s="0" x="0" y="0" hdg="0"
length="500"><line/></geometry></planView><lanes><laneSection s="0"><center><lane id="0"
type="none"/></center><right>
<lane id="-1" type="driving"><width sOffset="0" a="3.5" b="0" c="0" d="0"/></lane>
<lane id="-2" type="driving"><width sOffset="0" a="3.5" b="0" c="0" d="0"/></lane>
</right></laneSection></lanes></road></OpenDRIVE>"""

FILE = """<OpenSCENARIO><FileHeader revMajor="1" revMinor="2" description="cut-in"/>
<ParameterDeclarations>
<ParameterDeclaration name="kph" parameterType="double" value="36"/></ParameterDeclarations>
<RoadNetwork><LogicFile filepath="road.xodr"/></RoadNetwork><Entities>
<ScenarioObject name="Ego"><Vehicle name="v" vehicleCategory="car"><BoundingBox>
<Center x="1.4" y="0" z="0.7"/><Dimensions width="1.8" length="5" height="1.5"/></BoundingBox>
</Vehicle></ScenarioObject>
<ScenarioObject name="Other"><Vehicle name="v" vehicleCategory="van"/></ScenarioObject>
</Entities><Storyboard><Init><Actions>
<Private entityRef="Ego"><PrivateAction><TeleportAction><Position>
<LanePosition roadId="0" laneId="-1" s="48.6"/></Position></TeleportAction></PrivateAction>
<PrivateAction><LongitudinalAction><SpeedAction>
<SpeedActionDynamics dynamicsShape="step" dynamicsDimension="time" value="0"/>
<SpeedActionTarget><AbsoluteTargetSpeed value="${$kph / 3.6}"/></SpeedActionTarget>
</SpeedAction></LongitudinalAction></PrivateAction></Private>
<Private entityRef="Other"><PrivateAction><TeleportAction><Position>
<RelativeLanePosition entityRef="Ego" dLane="-1" ds="40"/></Position></TeleportAction>
</PrivateAction></Private></Actions></Init>
<Story name="s"><Act name="a"><ManeuverGroup name="g" maximumExecutionCount="1">
<Actors selectTriggeringEntities="false"><EntityRef entityRef="Other"/></Actors>
<Maneuver name="m"><Event name="cut in" priority="override"><Action name="x"><PrivateAction>
<LateralAction><LaneChangeAction><LaneChangeActionDynamics dynamicsShape="sinusoidal"
dynamicsDimension="time" value="2.5"/><LaneChangeTarget>
<RelativeTargetLane entityRef="Other" value="1"/></LaneChangeTarget></LaneChangeAction>
</LateralAction></PrivateAction></Action><StartTrigger><ConditionGroup>
<Condition name="c" delay="0.5" conditionEdge="rising"><ByEntityCondition>
<TriggeringEntities triggeringEntitiesRule="any"><EntityRef entityRef="Ego"/>
</TriggeringEntities><EntityCondition><TimeHeadwayCondition entityRef="Other" value="3"
freespace="true" rule="lessThan"/></EntityCondition></ByEntityCondition></Condition>
</ConditionGroup></StartTrigger></Event><Event name="later" priority="parallel"><Action name="y">
<PrivateAction>ACTION</PrivateAction></Action><StartTrigger><ConditionGroup>
<Condition name="d" delay="0" conditionEdge="none"><ByValueCondition>
<StoryboardElementStateCondition storyboardElementType="event" storyboardElementRef="cut in"
state="completeState"/></ByValueCondition></Condition></ConditionGroup></StartTrigger></Event>
</Maneuver></ManeuverGroup><StartTrigger><ConditionGroup><Condition name="t" delay="0"
conditionEdge="none"><ByValueCondition><SimulationTimeCondition value="0"
rule="greaterOrEqual"/></ByValueCondition></Condition></ConditionGroup></StartTrigger></Act>
</Story><StopTrigger><ConditionGroup><Condition name="end" delay="0" conditionEdge="none">
<ByValueCondition><SimulationTimeCondition value="20" rule="greaterThan"/></ByValueCondition>
</Condition></ConditionGroup></StopTrigger></Storyboard></OpenSCENARIO>"""
SPEED = (
    '<LongitudinalAction><SpeedAction><SpeedActionDynamics dynamicsShape="linear" '
    'dynamicsDimension="rate" value="2"/><SpeedActionTarget><AbsoluteTargetSpeed value="5"/>'
    "</SpeedActionTarget></SpeedAction></LongitudinalAction>"
)


@pytest.fixture(scope="module")
def workspace(tmp_path_factory: pytest.TempPathFactory) -> Workspace:
    return Workspace.open(tmp_path_factory.mktemp("imports"))


def given(folder: Path, text: str) -> Path:
    (folder / "road.xodr").write_text(ROAD)
    file = folder / "scene.xosc"
    file.write_text(text)
    return file


def test_a_cut_in_becomes_rules_with_its_numbers(workspace: Workspace, tmp_path: Path) -> None:
    file = given(tmp_path, FILE.replace("ACTION", SPEED))
    found = import_file(workspace, file)
    scenario, rules = found.scenario, {rule.id: rule for rule in found.scenario.rules}
    ego, other = scenario.actors
    assert (ego.spawn, ego.initial_speed, ego.ego) == ("0.0.-1.25", 10.0, True)
    assert (other.spawn, str(other.category)) == ("0.0.-2.44", "van")
    assert ego.size is not None
    assert (ego.size.length, ego.size.width, ego.size.height, other.size) == (5.0, 1.8, 1.5, None)
    # Nodes are at odd metres: the centre 1.4 m ahead of 48.6 m, and 40 m on from there.
    assert (ego.longitudinal_offset, other.longitudinal_offset) == (-1.0, -0.4)
    assert scenario.simulation.duration == 20
    headway, change = rules["cut-in"].when, rules["cut-in"].then[0].lane
    assert headway.headway is not None
    assert change is not None
    assert (headway.headway.below, headway.delay, headway.edge) == (3, 0.5, "rising")
    assert (change.by, change.over) == (1, 2.5)
    after, speed = rules["later"].when.rule, rules["later"].then[0].speed
    assert after is not None
    assert speed is not None
    assert (after.id, after.has, speed.to, speed.rate) == ("cut-in", "ended", 5, 2)
    assert found.lists["refused"] == []
    approximated = {row.reason for row in found.lists["approximated"]}
    assert "runs beside other events of its maneuver" in approximated
    assert [one for one in found.problems if one.severity == "error"] == []


def test_each_element_is_in_one_list_with_its_line(workspace: Workspace, tmp_path: Path) -> None:
    found = import_file(workspace, given(tmp_path, FILE.replace("ACTION", SPEED)))
    rows = [row.xpath for rows in found.lists.values() for row in rows]
    assert (
        len(rows)
        == len(set(rows))
        == FILE.replace("ACTION", SPEED).count("</") + FILE.replace("ACTION", SPEED).count("/>")
    )
    (declared,) = (row for row in found.lists["taken"] if row.xpath.endswith("Declaration"))
    assert declared.line == 3


def test_what_has_no_counterpart_is_refused_and_the_rest_stays(
    workspace: Workspace, tmp_path: Path
) -> None:
    action = '<TrailerAction><ConnectTrailerAction trailerRef="Ego"/></TrailerAction>'
    found = import_file(workspace, given(tmp_path, FILE.replace("ACTION", action)))
    assert "odscen has no ConnectTrailerAction" in {r.reason for r in found.lists["refused"]}
    assert {rule.id for rule in found.scenario.rules} == {"init-Ego", "init-Other", "cut-in"}


@pytest.mark.parametrize(("title", "y"), [("a scene", "-1.75"), ("CARLA:a scene", "1.75")])
def test_files_in_the_frame_of_carla_are_turned_over(
    workspace: Workspace, tmp_path: Path, title: str, y: str
) -> None:
    text = FILE.replace("ACTION", SPEED)
    text = re.sub(r'(<FileHeader [^>]*description=")[^"]*', rf"\g<1>{title}", text)
    place = f'<WorldPosition x="90" y="{y}" h="0"/>'
    text = re.sub(r"<LanePosition .*?/>", place, text, count=1, flags=re.DOTALL)
    ego, _ = import_file(workspace, given(tmp_path, text)).scenario.actors
    assert ego.spawn.startswith("0.0.-1.")


@pytest.mark.parametrize(
    ("old", "new", "why"),
    [
        ('value="2"', 'value="fast"', "value='fast' is no number"),
        ('value="5"', "", "it has no value"),
    ],
)
def test_an_action_without_its_value_costs_its_event_and_no_more(
    workspace: Workspace, tmp_path: Path, old: str, new: str, why: str
) -> None:
    action = SPEED.replace(old, new)
    found = import_file(workspace, given(tmp_path, FILE.replace("ACTION", action)))
    (refused,) = found.lists["refused"]
    assert why in refused.reason
    assert {rule.id for rule in found.scenario.rules} == {"init-Ego", "init-Other", "cut-in"}


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('s="48.6"', 's="far"', "s='far' is no number"),
        ("$kph /", "$mph /", r"names \$mph, which is no parameter"),
        ("</OpenSCENARIO>", "", "not well-formed XML"),
        ("Storyboard>", "Board>", "there is no Storyboard"),
    ],
)
def test_broken_files_say_what_is_wrong(
    workspace: Workspace, tmp_path: Path, old: str, new: str, words: str
) -> None:
    text = FILE.replace("ACTION", SPEED).replace(old, new)
    with pytest.raises(InputError, match=words):
        import_file(workspace, given(tmp_path, text))


def test_a_refused_file_leaves_the_maps_as_they_were(tmp_path: Path) -> None:
    workspace = Workspace.open(tmp_path / "workspace")
    file = given(tmp_path, FILE.replace("ACTION", SPEED).replace("Storyboard>", "Board>"))
    with pytest.raises(InputError, match="there is no Storyboard"):
        import_file(workspace, file, on_map=str(tmp_path / "road.xodr"))
    with pytest.raises(InputError, match="there is no Storyboard"):
        import_file(workspace, file)
    assert list(workspace.root.glob("maps/[!.]*")) == []
    file = given(tmp_path, FILE.replace("ACTION", SPEED))
    assert import_file(workspace, file).scenario is not None
    assert workspace.map_names() == ["road"]


def test_another_map_of_the_same_name_stays_what_it_is(tmp_path: Path) -> None:
    workspace = Workspace.open(tmp_path / "workspace")
    file = given(tmp_path, FILE.replace("ACTION", SPEED))
    before = import_file(workspace, file).scenario
    file.with_name("road.xodr").write_text(ROAD.replace('length="500"', 'length="600"'))
    after = import_file(workspace, file).scenario
    assert before is not None
    assert after is not None
    assert (before.map.name, after.map.name) == ("road", "road-2")
    assert workspace.map("road").sha256 == before.map.sha256


@pytest.mark.parametrize(
    ("named", "words"),
    [
        ("", "names no map"),
        ('<LogicFile filepath="elsewhere.xodr"/>', "its map 'elsewhere' is not found"),
    ],
)
def test_without_its_map_a_file_has_a_report_and_with_a_given_one_it_is_read(
    named: str, words: str, workspace: Workspace, tmp_path: Path
) -> None:
    text = FILE.replace("ACTION", SPEED).replace('<LogicFile filepath="road.xodr"/>', named)
    file = given(tmp_path, text)
    out = tmp_path / "out.scenario.json"
    with pytest.raises(NoMapError, match=f"{words}.*; give one with --map") as missing:
        import_file(workspace, file, out=out)
    lists = missing.value.lists
    refused = {row.xpath.rpartition("/")[2] for row in lists["refused"]}
    assert {"RoadNetwork", "LanePosition", "RelativeLanePosition"} <= refused
    assert "Event[1]" not in refused
    taken = {row.xpath.rpartition("/")[2] for row in lists["taken"]}
    assert {"AbsoluteTargetSpeed", "TimeHeadwayCondition", "LaneChangeAction"} <= taken
    assert not out.exists()
    found = import_file(workspace, file, out=out, on_map=str(tmp_path / "road.xodr"))
    assert (found.lists["refused"], [one.spawn for one in found.scenario.actors]) == (
        [],
        ["0.0.-1.25", "0.0.-2.44"],
    )
    same = import_file(workspace, file, on_map=found.scenario.map.name)
    assert same.scenario == found.scenario


def test_names_are_not_computed(workspace: Workspace, tmp_path: Path) -> None:
    text = FILE.replace("ACTION", SPEED).replace('name="c"', 'name="c ${_ + $kph}"')
    found = import_file(workspace, given(tmp_path, text))
    assert found.lists["refused"] == []


def test_a_pedestrian_is_on_wheels_where_there_is_nothing_to_walk_on(
    workspace: Workspace, tmp_path: Path
) -> None:
    text = FILE.replace("ACTION", SPEED)
    text = text.replace('<Vehicle name="v" vehicleCategory="van"/>', '<Pedestrian name="p"/>')
    file = given(tmp_path, text)
    road = file.with_name("road.xodr")
    road.write_text(ROAD.replace("</planView>", '</planView><type s="0" type="motorway"/>'))
    found = import_file(workspace, file)
    _, other = found.scenario.actors
    assert (str(other.category), other.spawn) == ("motorcycle", "0.0.-2.44")
    assert "a motorcycle of its size: the map has nothing to walk on" in {
        row.reason for row in found.lists["approximated"]
    }
    assert [one for one in found.problems if one.severity == "error"] == []


@pytest.mark.parametrize(("value", "by"), [("1", 2), ("-1", None), ("-2", -1)])
def test_a_lane_beside_another_counts_from_where_both_start(
    workspace: Workspace, tmp_path: Path, value: str, by: int | None
) -> None:
    """The ego starts in the left one of two lanes, the other in the right one."""
    text = FILE.replace("ACTION", SPEED).replace(
        '<RelativeTargetLane entityRef="Other" value="1"/>',
        f'<RelativeTargetLane entityRef="Ego" value="{value}"/>',
    )
    found = import_file(workspace, given(tmp_path, text))
    changes = [rule.then[0].lane for rule in found.scenario.rules if rule.id == "cut-in"]
    assert [one.by for one in changes if one is not None] == ([] if by is None else [by])


@pytest.mark.parametrize(
    ("element", "name"),
    [("act", "a"), ("maneuverGroup", "g"), ("maneuver", "m"), ("maneuver", "a/g/m")],
)
def test_what_starts_with_an_act_starts_by_its_trigger(
    workspace: Workspace, tmp_path: Path, element: str, name: str
) -> None:
    text = FILE.replace("ACTION", SPEED).replace(
        'storyboardElementType="event" storyboardElementRef="cut in"\nstate="completeState"',
        f'storyboardElementType="{element}" storyboardElementRef="{name}" state="startTransition"',
    )
    text = text.replace('<SimulationTimeCondition value="0"', '<SimulationTimeCondition value="4"')
    found = import_file(workspace, given(tmp_path, text))
    assert found.lists["refused"] == []
    rules = {rule.id: rule.when for rule in found.scenario.rules}
    held = rules["later"].time
    # The act's own trigger and the state of what it starts are the same, and are said once.
    assert held is not None
    assert held.after == 4


def test_what_appears_does_the_rest_when_it_is_there(workspace: Workspace, tmp_path: Path) -> None:
    text = FILE.replace("ACTION", SPEED)
    text = text.replace('<Vehicle name="v" vehicleCategory="van"/>', '<Pedestrian name="p"/>')
    found = import_file(workspace, given(tmp_path, text))
    (rule,) = (one for one in found.scenario.rules if one.id == "init-Other")
    appears, stops = rule.then
    assert appears.appear is not None
    assert stops.stop is not None
