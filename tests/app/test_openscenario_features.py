"""What collections of OpenSCENARIO files use, one feature after the other, on a straight road.

Shapes of conditions and actions are those of Euro NCAP's, esmini's and ScenarioRunner's files.
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from odscen.app.exchange.imports import ImportedFile, import_file
from odscen.app.running.runs import run
from odscen.maps.store import Workspace
from odscen.runs.run_settings import RunSettings
from odscen.scenario.placing.bodies import body_of
from tests.app.test_scenario_imports import FILE, ROAD, SPEED

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

EVENT = """<Event name="{name}" priority="override"><Action name="x">{action}</Action>
<StartTrigger>{when}</StartTrigger></Event>"""
AFTER = (
    '<ByValueCondition><SimulationTimeCondition value="1" rule="greaterThan"/></ByValueCondition>'
)
STOP = FILE.index("</Maneuver>")
"""Where more events go."""


@pytest.fixture(scope="module")
def workspace(tmp_path_factory: pytest.TempPathFactory) -> Workspace:
    return Workspace.open(tmp_path_factory.mktemp("features"))


def when(*conditions: str) -> str:
    rows = (f'<Condition name="c" delay="0" conditionEdge="none">{one}</Condition>'
            for one in conditions)  # fmt: skip
    return f"<ConditionGroup>{''.join(rows)}</ConditionGroup>"


def event(name: str, action: str, *conditions: str) -> str:
    return EVENT.format(name=name, action=action, when=when(*(conditions or (AFTER,))))


def private(action: str) -> str:
    return f"<PrivateAction>{action}</PrivateAction>"


def scene(*events: str, **changed: str) -> str:
    """The file of the imports' tests with more events, and parts put before closing tags."""
    text = FILE[:STOP] + "".join(events) + FILE[STOP:]
    text = text.replace("ACTION", SPEED)
    for tag, more in changed.items():
        text = text.replace(f"</{tag}>", f"{more}</{tag}>", 1)
    return text


def read(workspace: Workspace, folder: Path, text: str, **others: str) -> ImportedFile:
    (folder / "road.xodr").write_text(ROAD)
    for name, content in others.items():
        (folder / f"{name}.xosc").write_text(content)
    (folder / "scene.xosc").write_text(text)
    found = import_file(workspace, folder / "scene.xosc")
    assert [one for one in found.problems if one.severity == "error"] == []
    return found


def rule(found: ImportedFile, name: str) -> dict[str, Any]:
    (one,) = (one for one in found.scenario.rules if one.id == name)
    return one.model_dump(mode="json", exclude_none=True, exclude_defaults=True)


def reasons(found: ImportedFile, verdict: str) -> set[str]:
    return {row.reason for row in found.lists[verdict]}


def entity_condition(kind: str) -> str:
    return (
        '<ByEntityCondition><TriggeringEntities triggeringEntitiesRule="any">'
        f'<EntityRef entityRef="Ego"/></TriggeringEntities><EntityCondition>{kind}'
        "</EntityCondition></ByEntityCondition>"
    )


WEATHER = """<Private><PrivateAction/></Private><GlobalAction><EnvironmentAction>
<Environment name="e"><TimeOfDay animation="true" dateTime="2026-03-01T07:30:00"/>
<Weather cloudState="overcast"><Sun intensity="0.5" azimuth="1.5707963" elevation="0.5235988"/>
<Fog visualRange="500"/><Precipitation precipitationType="{rain}" intensity="0.4"/></Weather>
<RoadCondition frictionScaleFactor="{friction}"/></Environment></EnvironmentAction>
</GlobalAction>"""


def weather(rain: str, friction: float) -> str:
    text = WEATHER.format(rain=rain, friction=friction)
    return text.removeprefix("<Private><PrivateAction/></Private>")


@pytest.mark.slow
def test_weather_time_and_road_are_those_of_the_scenario(
    workspace: Workspace, tmp_path: Path
) -> None:
    found = read(workspace, tmp_path, scene(Actions=weather("rain", 0.85)))
    told, clock = found.scenario.environment, found.scenario.demand.clock
    assert clock == 7.5 * 3600
    assert told.parameters == pytest.approx(
        {"cloudiness": 60, "sun_altitude_angle": 30, "sun_azimuth_angle": 90, "fog_distance": 0,
         "fog_density": 56.54, "precipitation": 40, "wetness": 50, "precipitation_deposits": 0},
        abs=0.01,
    )  # fmt: skip
    assert not told.affects_driving  # how all move is in the file
    tags = ("Environment", "TimeOfDay", "Sun", "Fog", "Precipitation", "RoadCondition")
    taken = {row.xpath.rpartition("/")[2] for row in found.lists["taken"]}
    assert taken >= set(tags)


def test_snow_and_ice_are_the_nearest_that_there_is(workspace: Workspace, tmp_path: Path) -> None:
    found = read(workspace, tmp_path, scene(Actions=weather("snow", 0.3)))
    assert found.scenario.environment.parameters["wetness"] == 100
    assert reasons(found, "approximated") >= {
        "rain of as much water", "grip is 0.7 to 1 times that of a dry road",
    }  # fmt: skip


def test_weather_that_changes_in_the_story_stays_as_it_is(
    workspace: Workspace, tmp_path: Path
) -> None:
    text = scene(event("storm", weather("rain", 0.8)))
    found = read(workspace, tmp_path, text)
    assert found.scenario.environment.parameters == {}
    assert "the weather of a scenario is the same from its start to its end" in reasons(
        found, "ignored"
    )


def test_a_time_of_day_is_a_time_of_the_run(workspace: Workspace, tmp_path: Path) -> None:
    at = (
        '<ByValueCondition><TimeOfDayCondition rule="greaterThan" '
        'dateTime="2026-03-01T07:30:12"/></ByValueCondition>'
    )
    text = scene(event("late", private(SPEED), at), Actions=weather("dry", 1.0))
    assert rule(read(workspace, tmp_path, text), "late")["when"] == {"time": {"after": 12.0}}


VARIABLES = """<VariableDeclarations><VariableDeclaration name="hit" variableType="boolean"
value="false"/></VariableDeclarations><RoadNetwork>"""
IS_HIT = (
    '<ByValueCondition><VariableCondition variableRef="hit" rule="equalTo" value="true"/>'
    "</ByValueCondition>"
)


def sets(value: str) -> str:
    return (
        f'<GlobalAction><VariableAction variableRef="hit"><SetAction value="{value}"/>'
        "</VariableAction></GlobalAction>"
    )


def test_a_variable_that_an_event_sets_is_that_event(workspace: Workspace, tmp_path: Path) -> None:
    touched = entity_condition('<CollisionCondition><EntityRef entityRef="Other"/>'
                               "</CollisionCondition>")  # fmt: skip
    text = scene(event("brake", private(SPEED), IS_HIT), event("sees", sets("true"), touched))
    found = read(workspace, tmp_path, text.replace("<RoadNetwork>", VARIABLES))
    assert rule(found, "brake")["when"] == {"touched": {"of": "Ego", "to": "Other"}}
    assert found.lists["refused"] == []


def test_a_variable_that_init_sets_or_nothing_does_is_what_it_is(
    workspace: Workspace, tmp_path: Path
) -> None:
    text = scene(event("brake", private(SPEED), IS_HIT)).replace("<RoadNetwork>", VARIABLES)
    never = {"not": {"time": {"after": 0.0}}}
    assert rule(read(workspace, tmp_path, text), "brake")["when"] == never
    text = text.replace("</Actions>", f"{sets('true')}</Actions>", 1)
    assert rule(read(workspace, tmp_path, text), "brake")["when"] == {"time": {"after": 0.0}}


def test_an_event_may_wait_for_one_that_comes_later_in_the_file(
    workspace: Workspace, tmp_path: Path
) -> None:
    after = (
        '<ByValueCondition><StoryboardElementStateCondition storyboardElementType="event" '
        'storyboardElementRef="second" state="endTransition"/></ByValueCondition>'
    )
    text = scene(event("first", private(SPEED), after), event("second", private(SPEED)))
    found = read(workspace, tmp_path, text)
    assert rule(found, "first")["when"] == {"rule": {"id": "second"}}  # ended
    text = text.replace('Ref="second"', 'Ref="third"')
    found = read(workspace, tmp_path, text)
    assert "'third', which is left out or is not there" in reasons(found, "refused")


SELECTION = """<EntitySelection name="all"><Members><ByType objectType="vehicle"/></Members>
</EntitySelection><EntitySelection name="van"><Members><EntityRef entityRef="Other"/></Members>
</EntitySelection>"""


def test_a_selection_is_its_members(workspace: Workspace, tmp_path: Path) -> None:
    text = scene(Entities=SELECTION)
    old = '"false"><EntityRef entityRef="Other"/>'
    text = text.replace(old, old.replace("Other", "all"))
    found = read(workspace, tmp_path, text)
    later = [one for one in found.scenario.rules if one.id.startswith("later")]
    assert [one.actor for one in later] == ["Ego", "Other"]


def test_whoever_triggers_acts(workspace: Workspace, tmp_path: Path) -> None:
    near = entity_condition(
        '<ReachPositionCondition tolerance="2"><Position><LanePosition roadId="0" laneId="-1" '
        's="100"/></Position></ReachPositionCondition>'
    )
    text = scene()
    text = text.replace('<Actors selectTriggeringEntities="false"><EntityRef entityRef="Other"/>',
                        '<Actors selectTriggeringEntities="true">')  # fmt: skip
    head, tail = text.split("</ManeuverGroup><StartTrigger>")
    tail = tail[tail.index("</StartTrigger>") :]
    text = f"{head}</ManeuverGroup><StartTrigger>{when(near)}{tail}"
    found = read(workspace, tmp_path, text)
    assert rule(found, "later")["actor"] == "Ego"


LINE = """<Trajectory name="across" closed="false"><ParameterDeclarations>
<ParameterDeclaration name="at" parameterType="double" value="120"/></ParameterDeclarations>
<Shape><Polyline><Vertex><Position><LanePosition roadId="0" laneId="-1" s="$at" offset="-4">
<Orientation h="${pi/2}" type="relative"/></LanePosition></Position></Vertex><Vertex><Position>
<LanePosition roadId="0" laneId="-1" s="$at" offset="6"/></Position></Vertex></Polyline></Shape>
</Trajectory>"""
CATALOG = """<OpenSCENARIO><FileHeader revMajor="1" revMinor="3" description="c"/>
<Catalog name="Lines">{line}</Catalog></OpenSCENARIO>""".replace("{line}", LINE)
REF = """<TrajectoryRef><CatalogReference catalogName="Lines" entryName="across">
<ParameterAssignments><ParameterAssignment parameterRef="at" value="${100 + 20}"/>
</ParameterAssignments></CatalogReference></TrajectoryRef>"""
FOLLOW = (
    '<RoutingAction><FollowTrajectoryAction initialDistanceOffset="1"><TimeReference><None/>'
    '</TimeReference><TrajectoryFollowingMode followingMode="position"/>'
    f"{REF}</FollowTrajectoryAction></RoutingAction>"
)
MEET = f"""<SynchronizeAction masterEntityRef="Ego"><TargetPositionMaster>
<LanePosition roadId="0" laneId="-1" s="116"/></TargetPositionMaster><TargetPosition>
<TrajectoryPosition s="4">{REF}</TrajectoryPosition></TargetPosition><FinalSpeed>
<AbsoluteSpeed value="1.4"><TargetDistanceSteadyState distance="2"/></AbsoluteSpeed></FinalSpeed>
</SynchronizeAction>"""
WALKER = """<ScenarioObject name="VRU"><Pedestrian name="p" mass="80" model="p"
pedestrianCategory="pedestrian"/></ScenarioObject>"""
GROUP = """<ManeuverGroup name="meets" maximumExecutionCount="1"><Actors
selectTriggeringEntities="false"><EntityRef entityRef="VRU"/></Actors><Maneuver name="m2">
EVENT</Maneuver></ManeuverGroup>"""


def meeting(road_user: str) -> str:
    """Euro NCAP's way: on a trajectory of a catalog at first, and synchronized with the ego."""
    text = scene(
        Entities=road_user,
        CatalogLocations="",
        Actions=f'<Private entityRef="VRU">{private(FOLLOW)}</Private>',
        ManeuverGroup="",
    )
    group = GROUP.replace("EVENT", event("meet", private(MEET)))
    text = text.replace("</ManeuverGroup>", f"</ManeuverGroup>{group}", 1)
    places = '<CatalogLocations><TrajectoryCatalog><Directory path="."/></TrajectoryCatalog>'
    return text.replace("<RoadNetwork>", f"{places}</CatalogLocations><RoadNetwork>")


def at_once(text: str) -> str:
    """The same without the trigger of the synchronization."""
    before, name, rest = text.partition('<Event name="meet"')
    return before + name + re.sub(r"(?s)<StartTrigger>.*?</StartTrigger>", "", rest, count=1)


def test_places_on_trajectories_of_catalogs_are_found(workspace: Workspace, tmp_path: Path) -> None:
    found = read(workspace, tmp_path, meeting(WALKER), lines=CATALOG)
    arrive = rule(found, "meet")["then"][0]["arrive"]
    # 4 m along a line that begins 4 m to the right of the middle of the lane, at y = -1.75 m
    assert arrive["at"] == pytest.approx([120, -1.75])
    assert arrive["when_at"] == pytest.approx([116 + 1.4, -1.75])  # centre of the body
    assert (arrive["speed"], arrive["steady"]) == (1.4, 2.0)
    places = [
        one.then[0].appear.at for one in found.scenario.rules
        if one.actor == "VRU" and one.then[0].appear is not None
    ]  # fmt: skip
    assert places == [pytest.approx((120, -4.75, np.pi / 2))]  # 1 m along it
    assert found.lists["refused"] == []


BICYCLE = WALKER.replace("Pedestrian", "Vehicle").replace("pedestrianC", "vehicleC").replace(
    '="pedestrian"', '="bicycle"')  # fmt: skip


@pytest.mark.parametrize("body", [WALKER, BICYCLE])
def test_what_begins_at_once_begins_where_the_actor_starts(
    workspace: Workspace, tmp_path: Path, body: str
) -> None:
    found = read(workspace, tmp_path, at_once(meeting(body)), lines=CATALOG)
    assert rule(found, "meet")["when"] == {"time": {"after": 0.1}}


@pytest.mark.slow
@pytest.mark.parametrize("begins", [str, at_once])
@pytest.mark.parametrize("body", [WALKER, BICYCLE])
def test_who_follows_a_trajectory_meets_the_ego_on_it(
    workspace: Workspace, tmp_path: Path, body: str, begins: Callable[[str], str]
) -> None:
    found = read(workspace, tmp_path, begins(meeting(body)), lines=CATALOG)
    settings = RunSettings(until=8.0)
    done = run(workspace, found.scenario, settings=settings, name="meet", out=tmp_path)
    rows = {str(key): one for (key,), one in done.trajectories().group_by("id")}
    other = rows["VRU"].filter(rows["VRU"]["time"] > 0.15)
    passes = float(np.interp(-1.75, other["y"], other["time"]))
    # ... when the axle of the ego, at s = 48.6 m at first, would come to s = 116 m at 10 m/s
    assert passes == pytest.approx((116 - 48.6) / 10, abs=0.05)
    assert other["x"].to_numpy() == pytest.approx(np.full(other.height, 120.0), abs=0.05)
    assert other["y"][-1] > -1.75 + 0.3  # and goes on


@pytest.mark.parametrize(
    ("final", "speed", "steady"),
    [
        ('<AbsoluteSpeed value="3"/>', 3.0, None),
        ('<AbsoluteSpeed value="3"><TargetTimeSteadyState time="2"/></AbsoluteSpeed>', 3.0, 6.0),
        ('<RelativeSpeedToMaster value="0.2" speedTargetValueType="factor"/>', 2.0, None),
        ('<RelativeSpeedToMaster value="-8" speedTargetValueType="delta"/>', 2.0, None),
    ],
)
def test_the_speed_on_arrival_is_that_of_the_file(
    workspace: Workspace, tmp_path: Path, final: str, speed: float, steady: float | None
) -> None:
    text = re.sub("<AbsoluteSpeed.*</AbsoluteSpeed>", final, meeting(WALKER))
    found = read(workspace, tmp_path, text, lines=CATALOG)
    arrive = rule(found, "meet")["then"][0]["arrive"]
    assert (arrive["speed"], arrive.get("steady")) == (speed, steady)
    assert any("/FinalSpeed" in row.xpath for row in found.lists["taken"])


ROUTE = """<RoutePosition><RouteRef><Route name="r" closed="false"><Waypoint
routeStrategy="shortest"><Position><LanePosition roadId="0" laneId="-2" s="10"/></Position>
</Waypoint><Waypoint routeStrategy="shortest"><Position><LanePosition roadId="0" laneId="-2"
s="400"/></Position></Waypoint></Route></RouteRef><InRoutePosition>{}</InRoutePosition>
</RoutePosition>"""
PLACES = {
    "a route": (ROUTE.format('<FromLaneCoordinates pathS="60" laneId="-2"/>'), (70, -5.25)),
    "a route by road": (ROUTE.format('<FromRoadCoordinates pathS="60" t="-5.25"/>'), (70, -5.25)),
    "where one is": (ROUTE.format('<FromCurrentEntity entityRef="Other"/>'), (88.6, -5.25)),
    "a road": ('<RoadPosition roadId="0" s="88" t="-5"/>', (88, -5)),
    "beside one": ('<RelativeRoadPosition entityRef="Ego" ds="30" dt="-3.5"/>', (78.6, -5.25)),
    "ahead of one": ('<RelativeObjectPosition entityRef="Ego" dx="20" dy="-3"/>', (68.6, -4.75)),
    "a shoulder": ('<LanePosition roadId="0" laneId="-3" s="90"/>', (90, -8.0)),
}  # fmt: skip


@pytest.mark.parametrize("name", PLACES)
def test_each_kind_of_place_is_on_the_map(tmp_path: Path, name: str) -> None:
    place, at = PLACES[name]
    there = entity_condition(
        f'<ReachPositionCondition tolerance="2"><Position>{place}</Position>'
        "</ReachPositionCondition>"
    )
    width = '<width sOffset="0" a="2" b="0" c="0" d="0"/>'
    road = ROAD.replace("</right>", f'<lane id="-3" type="shoulder">{width}</lane></right>')
    (tmp_path / "road.xodr").write_text(road)
    (tmp_path / "scene.xosc").write_text(scene(event("near", private(SPEED), there)))
    found = import_file(Workspace.open(tmp_path / "w"), tmp_path / "scene.xosc")
    assert rule(found, "near")["when"]["reaches"]["place"] == pytest.approx(
        (at[0] + 1.4, at[1]), abs=1.01
    )
    assert found.lists["refused"] == []  # the centre of the ego is 1.4 m ahead of its axle


def test_who_follows_a_route_against_the_road_looks_along_the_route(tmp_path: Path) -> None:
    route = ROUTE.replace('laneId="-2" s="10"', 'laneId="1" s="400"').replace(
        'laneId="-2"\ns="400"', 'laneId="1"\ns="10"'
    )
    place = route.format('<FromRoadCoordinates pathS="300" t="1.75"/>')
    there = entity_condition(
        f'<ReachPositionCondition tolerance="2"><Position>{place}</Position>'
        "</ReachPositionCondition>"
    )
    width = '<width sOffset="0" a="3.5" b="0" c="0" d="0"/>'
    left = f'<left><lane id="1" type="driving">{width}</lane></left><center>'
    (tmp_path / "road.xodr").write_text(ROAD.replace("<center>", left, 1))
    (tmp_path / "scene.xosc").write_text(scene(event("near", private(SPEED), there)))
    found = import_file(Workspace.open(tmp_path / "w"), tmp_path / "scene.xosc")
    # 300 m from s = 400 m against s, and the centre of the body 1.4 m ahead of its axle
    assert rule(found, "near")["when"]["reaches"]["place"] == pytest.approx((98.6, 1.75), abs=1e-3)


@pytest.mark.slow
def test_a_walker_without_a_speed_stands_on_its_trajectory(
    workspace: Workspace, tmp_path: Path
) -> None:
    found = read(workspace, tmp_path, meeting(WALKER), lines=CATALOG)
    [first] = [one for one in found.scenario.rules if one.id == "init-VRU"]
    doing = [action.model_dump(exclude_none=True, exclude_defaults=True) for action in first.then]
    assert "appear" in doing[0]
    assert "'speed': {'to': 0.0" in str(doing[1])
    settings = RunSettings(until=2.0)
    done = run(workspace, found.scenario, settings=settings, name="stands", out=tmp_path / "r")
    rows = done.trajectories()
    y = rows.filter((rows["id"] == "VRU") & (rows["time"] > 0.15))["y"].to_numpy()
    assert y == pytest.approx(np.full(len(y), -4.75), abs=0.01)


NOTHING = {
    "visibility": private('<VisibilityAction graphics="true" traffic="true" sensors="false"/>'),
    "lights": private('<AppearanceAction><LightStateAction><LightType><VehicleLight '
                      'vehicleLightType="indicatorLeft"/></LightType><LightState mode="flashing"/>'
                      "</LightStateAction></AppearanceAction>"),
    "controllers": private('<ControllerAction><AssignControllerAction><Controller name="c">'
                           "<Properties/></Controller></AssignControllerAction></ControllerAction>"),
    "commands": '<UserDefinedAction><CustomCommandAction type="x">y</CustomCommandAction>'
                "</UserDefinedAction>",
    "monitors": '<GlobalAction><SetMonitorAction monitorRef="m" value="true"/></GlobalAction>',
    "variables": sets("true"),
    "traffic that ends": '<GlobalAction><TrafficAction trafficName="t"><TrafficStopAction/>'
                         "</TrafficAction></GlobalAction>",
}  # fmt: skip


@pytest.mark.parametrize("name", NOTHING)
def test_what_moves_nobody_is_ignored_and_makes_no_rule(
    workspace: Workspace, tmp_path: Path, name: str
) -> None:
    found = read(workspace, tmp_path, scene(event("more", NOTHING[name])))
    assert "more" not in {one.id for one in found.scenario.rules}
    assert found.lists["refused"] == []


REFUSED = {
    "a swarm": (
        '<GlobalAction><TrafficAction trafficName="t"><TrafficSwarmAction innerRadius="10" '
        'offset="0" numberOfVehicles="9" semiMajorAxis="90" semiMinorAxis="50" velocity="9">'
        '<CentralObject entityRef="Ego"/></TrafficSwarmAction></TrafficAction></GlobalAction>',
        "it puts traffic of its own on the road; give the scenario flows or demand",
    ),
    "a trailer": (private("<TrailerAction><DisconnectTrailerAction/></TrailerAction>"),
                  "odscen has no DisconnectTrailerAction"),
    "a random route": (private("<RoutingAction><RandomRouteAction/></RoutingAction>"),
                       "odscen has no RandomRouteAction"),
    "a signal": (
        '<GlobalAction><InfrastructureAction><TrafficSignalAction><TrafficSignalStateAction '
        'name="7" state="green"/></TrafficSignalAction></InfrastructureAction></GlobalAction>',
        "signal '7' is over no movement of a light of the map",
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", REFUSED)
def test_what_would_act_is_refused_with_its_reason(
    workspace: Workspace, tmp_path: Path, name: str
) -> None:
    action, words = REFUSED[name]
    found = read(workspace, tmp_path, scene(event("more", action)))
    assert words in reasons(found, "refused")
    assert {one.id for one in found.scenario.rules} >= {"cut-in", "later"}


OFFSET = """<LateralAction><LaneOffsetAction continuous="true"><LaneOffsetActionDynamics
dynamicsShape="linear"/><LaneOffsetTarget><AbsoluteTargetLaneOffset value="{}"/></LaneOffsetTarget>
</LaneOffsetAction></LateralAction>"""
LANES = """<LateralAction><LaneChangeAction><LaneChangeActionDynamics dynamicsShape="sinusoidal"
value="3" dynamicsDimension="time"/><LaneChangeTarget><RelativeTargetLane entityRef="Other"
value="{}"/></LaneChangeTarget></LaneChangeAction></LateralAction>"""
PROFILE = """<LongitudinalAction><SpeedProfileAction followingMode="position">
<SpeedProfileEntry time="2" speed="10"/><SpeedProfileEntry time="3" speed="4"/>
</SpeedProfileAction></LongitudinalAction>"""


@pytest.mark.parametrize(
    ("action", "words"),
    [
        (
            OFFSET.format(14),
            "then[0].offset.to: Input should be less than or equal to 10, not 14.0",
        ),
        (LANES.format(13), "then[0].lane.by: Input should be less than or equal to 10, not 13"),
    ],
)
def test_what_is_beyond_the_bounds_of_rules_is_refused_with_its_value(
    workspace: Workspace, tmp_path: Path, action: str, words: str
) -> None:
    found = read(workspace, tmp_path, scene(event("more", private(action))))
    assert any(words in reason for reason in reasons(found, "refused"))
    assert "later" in {one.id for one in found.scenario.rules}


def test_a_speed_profile_at_first_is_a_rule_of_its_entries(
    workspace: Workspace, tmp_path: Path
) -> None:
    more = f'<Private entityRef="Ego">{private(PROFILE)}</Private>'
    found = read(workspace, tmp_path, scene(Actions=more))
    assert found.lists["refused"] == []
    speeds = [
        [item.speed.to for item in rule.then if item.speed]
        for rule in found.scenario.rules
        if rule.actor == "Ego"
    ]
    assert [10.0, 4.0] in speeds


def test_a_falling_edge_a_delay_and_a_count_are_those_of_the_rule(
    workspace: Workspace, tmp_path: Path
) -> None:
    slow = entity_condition('<SpeedCondition rule="lessThan" value="${2 + cos(0)}"/>')
    text = scene(event("again", private(SPEED), slow))
    text = text.replace('name="again"', 'name="again" maximumExecutionCount="3"')
    text = text.replace(f'delay="0" conditionEdge="none">{slow}',
                        f'delay="0.5" conditionEdge="falling">{slow}')  # fmt: skip
    made = rule(read(workspace, tmp_path, text), "again")
    assert (made["times"], made["when"]["delay"], made["when"]["edge"]) == (3, 0.5, "rising")
    assert made["when"]["not"] == {"speed": {"of": "Ego", "below": 3.0}}


def test_a_catalog_is_found_from_a_folder_above_the_file(
    workspace: Workspace, tmp_path: Path
) -> None:
    """Euro NCAP's files in ``NCAP/SET/`` name folders as if they were in ``NCAP/``."""
    inside = tmp_path / "ncap" / "set"
    (tmp_path / "catalogs").mkdir()
    inside.mkdir(parents=True)
    (tmp_path / "catalogs" / "lines.xosc").write_text(CATALOG)
    text = meeting(WALKER).replace('path="."', 'path="../catalogs"')
    found = read(workspace, inside, text)
    assert found.lists["refused"] == []
    assert found.scenario.actors[-1].id == "VRU"


PERFORMANCE = '<Performance maxSpeed="70" maxAcceleration="4" maxDeceleration="1.5"/>'


@pytest.mark.parametrize(
    ("dynamics", "to", "measure", "value"),
    [
        # From a standstill: a cubic from 0 to 20 m/s in T is at most 1.5 * 20 / T.
        ('dynamicsShape="cubic" dynamicsDimension="time" value="2"', 20.0, "over", 7.5),
        ('dynamicsShape="linear" dynamicsDimension="time" value="6"', 20.0, "over", 6.0),
        ('dynamicsShape="linear" dynamicsDimension="rate" value="9"', 20.0, "rate", 4.0),
        ('dynamicsShape="cubic" dynamicsDimension="rate" value="3"', 20.0, "rate", 3.0),
    ],
)
def test_speeds_change_no_faster_than_the_performance_of_a_vehicle(
    workspace: Workspace, tmp_path: Path, dynamics: str, to: float, measure: str, value: float
) -> None:
    text = scene().replace(SPEED, SPEED.replace(
        'dynamicsShape="linear" dynamicsDimension="rate" value="2"', dynamics
    ).replace('value="5"', f'value="{to}"'))  # fmt: skip
    van = '<Vehicle name="v" vehicleCategory="van"/>'
    limited = van.replace("/>", f">{PERFORMANCE}</Vehicle>")
    found = read(workspace, tmp_path, text.replace(van, limited))
    (part,) = rule(found, "later")["then"]
    assert part["speed"][measure] == pytest.approx(value, abs=1e-4)
    said = any("Performance" in reason for reason in reasons(found, "approximated"))
    assert said == (value in (7.5, 4.0))


@pytest.mark.slow
def test_a_gap_without_limits_is_there_from_the_start_and_held_when_the_other_one_brakes(
    workspace: Workspace, tmp_path: Path
) -> None:
    gap = (
        '<PrivateAction><LongitudinalAction><LongitudinalDistanceAction entityRef="Ego" '
        'freespace="true" continuous="true" distance="12" coordinateSystem="entity" '
        'displacement="leadingReferencedEntity"/></LongitudinalAction></PrivateAction>'
    )
    text = scene().replace("</PrivateAction></Private></Actions>",
                           f"</PrivateAction>{gap}</Private></Actions>")  # fmt: skip
    text = text.replace('dLane="-1" ds="40"', 'dLane="0" ds="40"')
    text = text.replace('<EntityRef entityRef="Other"/></Actors>',
                        '<EntityRef entityRef="Ego"/></Actors>', 1)  # fmt: skip
    braking = event("brakes", private(SPEED))
    found = read(workspace, tmp_path, text.replace("</Maneuver>", f"{braking}</Maneuver>"))
    done = run(workspace, found.scenario, settings=RunSettings(until=6.0), name="r", out=tmp_path)
    rows = done.trajectories().sort("time")
    ego, other = (rows.filter(rows["id"] == name)["x"].to_numpy() for name in ("Ego", "Other"))
    van = body_of(next(one for one in found.scenario.actors if one.id == "Other")).length
    apart = other[: len(ego)] - ego[: len(other)] - (5.0 + van) / 2.0
    speeds = rows.filter(rows["id"] == "Ego")["speed"]
    assert (speeds[0], speeds[-1]) == pytest.approx((10.0, 5.0), abs=0.3)
    assert apart == pytest.approx(12.0, abs=0.3)
    assert any("held with up to 100" in reason for reason in reasons(found, "approximated"))


def test_a_start_against_a_lane_without_an_opposite_one_is_said(
    workspace: Workspace, tmp_path: Path
) -> None:
    start = '<LanePosition roadId="0" laneId="-2" s="200"><Orientation type="relative" h="3.1416"/>'
    text = re.sub(r"<RelativeLanePosition .*?/>", f"{start}</LanePosition>", scene())
    found = read(workspace, tmp_path, text)
    assert any("heads against it" in reason for reason in reasons(found, "approximated"))


@pytest.mark.slow
def test_who_follows_a_trajectory_at_a_negative_speed_reverses_along_it_far_beside_all_lanes(
    workspace: Workspace, tmp_path: Path
) -> None:
    rows = "".join(
        f'<Vertex time="0"><Position><RoadPosition roadId="0" s="{s}" t="30"/></Position></Vertex>'
        for s in (200, 100)
    )
    shape = f"<Shape><Polyline>{rows}</Polyline></Shape>"
    follow = (
        '<PrivateAction><RoutingAction><FollowTrajectoryAction><TrajectoryRef><Trajectory name="t" '
        f'closed="false">{shape}</Trajectory></TrajectoryRef><TimeReference><None/></TimeReference>'
        '<TrajectoryFollowingMode followingMode="position"/></FollowTrajectoryAction>'
        "</RoutingAction></PrivateAction>"
    )
    text = scene().replace('value="${$kph / 3.6}"/>', 'value="-2"/>')
    place = '<LanePosition roadId="0" laneId="-1" s="48.6"/>'
    start = '<RoadPosition roadId="0" s="200" t="30"><Orientation type="absolute" h="0"/>'
    text = text.replace(place, f"{start}</RoadPosition>")
    text = text.replace("</SpeedAction></LongitudinalAction></PrivateAction></Private>",
        f"</SpeedAction></LongitudinalAction></PrivateAction>{follow}</Private>", 1)  # fmt: skip
    text = re.sub(r"<RelativeLanePosition .*?/>", place, text)
    found = read(workspace, tmp_path, text)
    done = run(workspace, found.scenario, settings=RunSettings(until=5.0), name="r", out=tmp_path)
    rows = done.trajectories().sort("time")
    ego = rows.filter(rows["id"] == "Ego", rows["time"] > 0.15)
    # The centre is 1.4 m ahead of the reference point, which begins at 200 m.
    assert ego["x"].to_numpy() == pytest.approx(201.4 - 2.0 * ego["time"].to_numpy(), abs=0.02)
    assert ego["y"].to_numpy() == pytest.approx(30.0, abs=0.01)
    assert np.cos(ego["hdg"].to_numpy()).min() > 0.999
    assert "backwards along its trajectory, at a positive speed" in reasons(found, "approximated")


def test_a_walker_that_has_only_a_speed_walks_on_along_its_lane(
    workspace: Workspace, tmp_path: Path
) -> None:
    start = """<Private entityRef="VRU"><PrivateAction><TeleportAction><Position>
<LanePosition roadId="0" laneId="-2" s="100" offset="0.5"/></Position></TeleportAction>
</PrivateAction><PrivateAction><LongitudinalAction><SpeedAction><SpeedActionDynamics
dynamicsShape="step" dynamicsDimension="time" value="0"/><SpeedActionTarget><AbsoluteTargetSpeed
value="2"/></SpeedActionTarget></SpeedAction></LongitudinalAction></PrivateAction></Private>"""
    text = scene(Entities=WALKER, Actions=start)
    walk = '<lane id="-3" type="sidewalk"><width sOffset="0" a="2" b="0" c="0" d="0"/></lane>'
    (tmp_path / "road.xodr").write_text(ROAD.replace("</right>", f"{walk}</right>"))
    (tmp_path / "scene.xosc").write_text(text)
    found = import_file(workspace, tmp_path / "scene.xosc")
    [first] = [one for one in found.scenario.rules if one.actor == "VRU"]
    path = next(part.path for item in first.then for part in item.parts if part.path is not None)
    assert path.points == ((600.0, -4.75),)
    assert "it walks on along its lane" in reasons(found, "approximated")


def test_a_speed_profile_that_is_alone_at_first_begins_at_its_first_speed(
    workspace: Workspace, tmp_path: Path
) -> None:
    begin = PROFILE.replace('time="2"', 'time="0"')
    more = f'<Private entityRef="Other">{private(begin)}</Private>'
    found = read(workspace, tmp_path, scene(Actions=more))
    other = next(one for one in found.scenario.actors if one.id == "Other")
    assert other.initial_speed == 10.0
    done = run(workspace, found.scenario, settings=RunSettings(until=2.5), name="r", out=tmp_path)
    rows = done.trajectories()
    motion = rows.filter((rows["id"] == "Other") & (rows["time"] > 0.05))
    wanted = np.interp(motion["time"].to_numpy(), [0.0, 3.0], [10.0, 4.0])
    assert motion["speed"].to_numpy() == pytest.approx(wanted, abs=0.25)
