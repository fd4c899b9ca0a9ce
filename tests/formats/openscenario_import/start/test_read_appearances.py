"""Where entities of OpenSCENARIO files start, appear and go, on a straight road written here."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import pytest

from odscen.app.exchange.imports import import_file
from odscen.base.categories import DEFAULT_BODY, Category
from odscen.maps.store import Workspace

if TYPE_CHECKING:
    from pathlib import Path

    from odscen.app.exchange.imports import ImportedFile

WIDTH = '<width sOffset="0" a="3.5" b="0" c="0" d="0"/>'
ROAD = f"""<OpenDRIVE><header revMajor="1" revMinor="6"/>
<road id="0" length="500" junction="-1"><planView><geometry s="0" x="0" y="0" hdg="0"
length="500"><line/></geometry></planView><lanes><laneSection s="0"><center><lane id="0"
type="none"/></center><right><lane id="-1" type="driving">{WIDTH}</lane>
<lane id="-2" type="sidewalk">{WIDTH}</lane></right></laneSection></lanes></road></OpenDRIVE>"""
EGO = """<Private entityRef="Ego"><PrivateAction><TeleportAction><Position>
<LanePosition roadId="0" laneId="-1" s="51"/></Position></TeleportAction></PrivateAction>
<PrivateAction><LongitudinalAction><SpeedAction><SpeedActionDynamics dynamicsShape="step"
dynamicsDimension="time" value="0"/><SpeedActionTarget><AbsoluteTargetSpeed value="10"/>
</SpeedActionTarget></SpeedAction></LongitudinalAction></PrivateAction></Private>"""
CAR = '<ScenarioObject name="Other"><Vehicle name="v" vehicleCategory="car"/></ScenarioObject>'


def place(s: float, lane: int = -1) -> str:
    return f'<Position><LanePosition roadId="0" laneId="{lane}" s="{s}"/></Position>'


def event(action: str) -> str:
    return f"""<Story name="s"><Act name="a"><ManeuverGroup name="g" maximumExecutionCount="1">
<Actors selectTriggeringEntities="false"><EntityRef entityRef="Other"/></Actors><Maneuver name="m">
<Event name="e" priority="parallel"><Action name="x">{action}</Action><StartTrigger><ConditionGroup>
<Condition name="c" delay="0" conditionEdge="none"><ByValueCondition><SimulationTimeCondition
value="5" rule="greaterThan"/></ByValueCondition></Condition></ConditionGroup></StartTrigger>
</Event></Maneuver></ManeuverGroup></Act></Story>"""


def private(action: str) -> str:
    return f"<PrivateAction>{action}</PrivateAction>"


def route(shape: str) -> str:
    return (
        '<RoutingAction><FollowTrajectoryAction><Trajectory name="t" closed="false"><Shape>'
        f"{shape}</Shape></Trajectory><TimeReference><None/></TimeReference>"
        "</FollowTrajectoryAction></RoutingAction>"
    )


@pytest.fixture(scope="module")
def workspace(tmp_path_factory: pytest.TempPathFactory) -> Workspace:
    return Workspace.open(tmp_path_factory.mktemp("appearances"))


def read(
    workspace: Workspace, folder: Path, *, other: str = CAR, init: str = "", story: str = ""
) -> ImportedFile:
    (folder / "road.xodr").write_text(ROAD)
    file = folder / "scene.xosc"
    file.write_text(
        '<OpenSCENARIO><FileHeader revMajor="1" revMinor="2" description="d"/><RoadNetwork>'
        '<LogicFile filepath="road.xodr"/></RoadNetwork><Entities><ScenarioObject name="Ego">'
        f'<Vehicle name="v" vehicleCategory="car"/></ScenarioObject>{other}</Entities>'
        f"<Storyboard><Init><Actions>{EGO}{init}</Actions></Init>{story}</Storyboard>"
        "</OpenSCENARIO>"
    )
    return import_file(workspace, file)


def reasons(found: ImportedFile, verdict: str) -> set[str]:
    return {row.reason for row in found.lists[verdict]}


def added(s: float) -> str:
    return (
        '<GlobalAction><EntityAction entityRef="Other"><AddEntityAction>'
        f"{place(s)}</AddEntityAction></EntityAction></GlobalAction>"
    )


def test_an_entity_added_at_first_is_on_the_road_at_once(
    workspace: Workspace, tmp_path: Path
) -> None:
    found = read(workspace, tmp_path, init=added(101))
    assert found.lists["refused"] == []
    assert found.scenario.actors[1].spawn == "0.0.-1.50"
    assert not any(one.appear for rule in found.scenario.rules for one in rule.then)


def test_an_entity_added_by_the_story_appears_there_and_does_what_it_does_at_first(
    workspace: Workspace, tmp_path: Path
) -> None:
    speed = EGO[EGO.index("<PrivateAction><Long") :].replace('"10"', '"7"')
    init = f'<Private entityRef="Other">{speed}'
    found = read(workspace, tmp_path, init=init, story=event(added(101)))
    assert found.lists["refused"] == []
    (rule,) = (one for one in found.scenario.rules if one.actor == "Other")
    appear, drive = rule.then
    assert appear.appear is not None
    assert appear.appear.at == (101, -1.75, 0)
    assert drive.speed is not None
    assert drive.speed.to == 7
    assert found.scenario.actors[1].initial_speed == 7


def test_an_entity_deleted_by_the_story_vanishes(workspace: Workspace, tmp_path: Path) -> None:
    gone = (
        '<GlobalAction><EntityAction entityRef="Other"><DeleteEntityAction/></EntityAction>'
        "</GlobalAction>"
    )
    found = read(workspace, tmp_path, init=added(101), story=event(gone))
    (rule,) = (one for one in found.scenario.rules if one.id == "e")
    assert (rule.actor, rule.then[0].kind) == ("Other", "vanish")


def test_a_teleport_of_an_actor_on_the_road_puts_it_there_for_a_step(
    workspace: Workspace, tmp_path: Path
) -> None:
    jump = private(f"<TeleportAction>{place(301)}</TeleportAction>")
    found = read(workspace, tmp_path, init=added(101), story=event(jump))
    (rule,) = (one for one in found.scenario.rules if one.id == "e")
    assert rule.then[0].replay is not None
    assert rule.then[0].replay.rows[0] == (0, 301, -1.75, 0)
    assert "it is led there for 0.1 s, and drives on" in reasons(found, "approximated")


def test_a_teleport_to_a_place_known_in_the_run_only_is_refused(
    workspace: Workspace, tmp_path: Path
) -> None:
    beside = (
        '<TeleportAction><Position><RelativeObjectPosition entityRef="Ego" dx="9" dy="0"/>'
        "</Position></TeleportAction>"
    )
    found = read(workspace, tmp_path, init=added(101), story=event(private(beside)))
    words = "a place relative to 'Ego', which moves: it is known in the run only"
    assert words in reasons(found, "refused")


@pytest.mark.parametrize(
    ("gap", "metres"),
    [
        ('distance="30" freespace="false"', 30.0),
        ('timeGap="2" freespace="true"', 20 + DEFAULT_BODY[Category.CAR].length),
    ],
)
def test_a_gap_at_first_moves_the_start_ahead_within_half_a_node(
    workspace: Workspace, tmp_path: Path, gap: str, metres: float
) -> None:
    init = (
        f'<Private entityRef="Other">{private(f"<TeleportAction>{place(61)}</TeleportAction>")}'
        "<PrivateAction><LongitudinalAction><LongitudinalDistanceAction continuous='false' "
        f"displacement='leadingReferencedEntity' entityRef='Ego' {gap}/></LongitudinalAction>"
        "</PrivateAction></Private>"
    )
    found = read(workspace, tmp_path, init=init)
    assert found.lists["refused"] == []
    nodes = [int(one.spawn.rpartition(".")[2]) for one in found.scenario.actors]
    assert abs(2 * (nodes[1] - nodes[0]) - metres) <= 1.0


def test_a_pedestrian_starts_on_the_lane_of_a_sidewalk(
    workspace: Workspace, tmp_path: Path
) -> None:
    walker = (
        '<ScenarioObject name="Other"><Pedestrian name="p" pedestrianCategory="pedestrian" '
        'mass="80"/></ScenarioObject>'
    )
    start = private(f"<TeleportAction>{place(80.5, -2)}</TeleportAction>")
    found = read(
        workspace, tmp_path, other=walker, init=f'<Private entityRef="Other">{start}</Private>'
    )
    assert found.lists["refused"] == []
    appear = next(one.appear for rule in found.scenario.rules for one in rule.then if one.appear)
    assert appear.at == pytest.approx((80.5, -5.25, 0))


def test_a_body_that_no_catalog_has_is_a_car_and_said_so(
    workspace: Workspace, tmp_path: Path
) -> None:
    other = (
        '<ScenarioObject name="Other"><CatalogReference catalogName="cars" entryName="red"/>'
        "</ScenarioObject>"
    )
    found = read(workspace, tmp_path, other=other, init=added(101))
    assert found.lists["refused"] == []
    assert str(found.scenario.actors[1].category) == "car"
    words = "no catalog has 'cars' with 'red': a car of the usual size"
    assert words in reasons(found, "approximated")


def test_a_clothoid_is_sampled_and_says_how_far_it_is_off(
    workspace: Workspace, tmp_path: Path
) -> None:
    arc = f'<Clothoid curvature="0.01" curvaturePrime="0" length="50">{place(101)}</Clothoid>'
    found = read(workspace, tmp_path, init=added(101), story=event(private(route(arc))))
    assert found.lists["refused"] == []
    (rule,) = (one for one in found.scenario.rules if one.id == "e")
    assert rule.then[0].path is not None
    x, y = map(float, rule.then[0].path.points[-1])
    turn = 0.5
    # The reference point is led along the curve itself, half a body behind the front.
    assert x == pytest.approx(101 + 100 * math.sin(turn), abs=0.01)
    assert y == pytest.approx(-1.75 + 100 * (1 - math.cos(turn)), abs=0.01)
    assert rule.then[0].path.behind == 2.5
    words = "a polyline of points up to 1 m apart, up to 0.001 m off the curve"
    assert words in reasons(found, "approximated")


def test_a_nurbs_of_a_quarter_circle_ends_where_it_should(
    workspace: Workspace, tmp_path: Path
) -> None:
    def control(x: float, y: float, weight: float) -> str:
        return (
            f'<ControlPoint weight="{weight}"><Position><WorldPosition x="{x}" y="{y}" h="0"/>'
            "</Position></ControlPoint>"
        )

    knots = "".join(f'<Knot value="{one}"/>' for one in (0, 0, 0, 1, 1, 1))
    shape = (
        f'<Nurbs order="3">{control(100, 0, 1)}{control(140, 0, math.sqrt(0.5))}'
        f"{control(140, 40, 1)}{knots}</Nurbs>"
    )
    walker = (
        '<ScenarioObject name="Other"><Pedestrian name="p" pedestrianCategory="pedestrian" '
        'mass="80"/></ScenarioObject>'
    )
    start = private(f"<TeleportAction>{place(80.5, -2)}</TeleportAction>")
    found = read(
        workspace, tmp_path, other=walker, init=f'<Private entityRef="Other">{start}</Private>',
        story=event(private(route(shape))),
    )  # fmt: skip
    assert found.lists["refused"] == []
    (rule,) = (one for one in found.scenario.rules if one.id == "e")
    assert rule.then[0].path is not None
    for x, y in ((float(one[0]), float(one[1])) for one in rule.then[0].path.points):
        assert math.hypot(x - 100, y - 40) == pytest.approx(40, abs=1e-3)


def test_an_entity_without_a_place_starts_on_its_trajectory(
    workspace: Workspace, tmp_path: Path
) -> None:
    line = f"<Polyline><Vertex>{place(121)}</Vertex><Vertex>{place(161)}</Vertex></Polyline>"
    init = f'<Private entityRef="Other">{private(route(line))}</Private>'
    found = read(workspace, tmp_path, init=init)
    assert found.lists["refused"] == []
    assert found.scenario.actors[1].spawn == "0.0.-1.60"


def test_a_speed_profile_is_one_speed_after_the_other(workspace: Workspace, tmp_path: Path) -> None:
    profile = (
        '<LongitudinalAction><SpeedProfileAction followingMode="follow"><SpeedProfileEntry '
        'time="2" speed="4"/><SpeedProfileEntry time="3" speed="9"/></SpeedProfileAction>'
        "</LongitudinalAction>"
    )
    found = read(workspace, tmp_path, init=added(101), story=event(private(profile)))
    (rule,) = (one for one in found.scenario.rules if one.id == "e")
    speeds = [(one.speed.to, one.speed.over) for one in rule.then if one.speed]
    assert speeds == [(4, 2), (9, 3)]


def at_first(text: str) -> str:
    return f'<Private entityRef="Other">{private(f"<TeleportAction>{text}</TeleportAction>")}'


def test_a_vehicle_that_starts_beside_all_lanes_is_there_a_step_later(
    workspace: Workspace, tmp_path: Path
) -> None:
    beside = '<Position><WorldPosition x="101" y="2.25" h="0"/></Position>'
    found = read(workspace, tmp_path, init=f"{at_first(beside)}</Private>")
    assert found.lists["refused"] == []
    other = found.scenario.actors[1]
    assert (other.spawn, other.lateral_offset) == ("0.0.-1.50", 0.0)
    first = next(one for one in found.scenario.rules if one.actor == "Other").then[0]
    assert first.offset is not None
    assert (first.offset.to, first.offset.over) == (4.0, 0.1)
    assert "on the lane 4.0 m beside at first, and there 0.1 s later" in reasons(
        found, "approximated"
    )


@pytest.mark.parametrize(
    ("s", "spawn", "ahead", "overlap"),
    [(51, "0.0.-1.25", 0.0, 1), (54, "0.0.-1.27", -1.0, 1), (60, "0.0.-1.30", -1.0, 0)],
)
def test_those_whom_the_story_drives_overlap_at_first_where_the_file_has_it(
    workspace: Workspace, tmp_path: Path, s: float, spawn: str, ahead: float, overlap: int
) -> None:
    """The centre of the ego is on node 25, at s = 51 m."""
    found = read(workspace, tmp_path, init=f"{at_first(place(s))}</Private>")
    ego, other = found.scenario.actors
    assert (ego.spawn, ego.longitudinal_offset) == ("0.0.-1.25", 0.0)
    assert (other.spawn, other.longitudinal_offset) == (spawn, ahead)
    said = [(one.code, one.severity) for one in found.problems if one.code == "bodies_overlap"]
    assert said == [("bodies_overlap", "warning")] * overlap


@pytest.mark.parametrize(("ahead", "refused"), [(0, 0), (5, 2)])
def test_who_is_only_lifted_stays_and_who_jumps_from_where_it_is_then_is_refused(
    workspace: Workspace, tmp_path: Path, ahead: float, refused: int
) -> None:
    jump = (
        '<TeleportAction><Position><RelativeObjectPosition entityRef="Other" '
        f'dx="{ahead}" dy="0" dz="0.3"/></Position></TeleportAction>'
    )
    found = read(workspace, tmp_path, init=added(101), story=event(private(jump)))
    assert len(found.lists["refused"]) == refused
    assert not any(rule.id == "e" for rule in found.scenario.rules)
    words = "height or tilt" if not refused else "is known in the run only"
    said = reasons(found, "refused" if refused else "approximated")
    assert any(words in one for one in said)


@pytest.mark.parametrize("once", [True, False])
def test_a_gap_ahead_in_the_story_is_kept_ahead_or_reached_once(
    workspace: Workspace, tmp_path: Path, *, once: bool
) -> None:
    continuous = "false" if once else "true"
    gap = (
        '<LongitudinalAction><LongitudinalDistanceAction entityRef="Ego" distance="30" '
        f'continuous="{continuous}" freespace="true" displacement="leadingReferencedEntity"/>'
        "</LongitudinalAction>"
    )
    found = read(workspace, tmp_path, init=added(101), story=event(private(gap)))
    assert found.lists["refused"] == []
    (rule,) = (one for one in found.scenario.rules if one.id == "e")
    keep = rule.then[0].keep_gap
    assert keep is not None
    assert (keep.to, keep.metres, keep.ahead, keep.once) == ("Ego", 30, True, once)


def lane_change(lane: int) -> str:
    return (
        '<LateralAction><LaneChangeAction><LaneChangeActionDynamics dynamicsShape="sinusoidal" '
        'dynamicsDimension="time" value="4"/><LaneChangeTarget>'
        f'<AbsoluteTargetLane value="{lane}"/></LaneChangeTarget>'
        "</LaneChangeAction></LateralAction>"
    )


def test_lanes_count_from_the_last_one_that_the_file_names(
    workspace: Workspace, tmp_path: Path
) -> None:
    story = "".join(event(private(lane_change(one))) for one in (-1, -2, -1))
    found = read(workspace, tmp_path, init=added(101), story=story)
    then = [one.then[0] for one in found.scenario.rules if one.id.startswith("e")]
    assert then[0].offset is not None
    assert (then[0].offset.to, then[0].offset.over) == (0, 4)
    assert [one.lane.by for one in then[1:] if one.lane] == [-1, 1]


def test_a_lateral_distance_is_an_offset_from_the_own_lane(
    workspace: Workspace, tmp_path: Path
) -> None:
    beside = (
        '<LateralAction><LateralDistanceAction entityRef="Ego" distance="2.5" freespace="false" '
        'continuous="true" displacement="leftToReferencedEntity"/></LateralAction>'
    )
    found = read(workspace, tmp_path, init=added(101), story=event(private(beside)))
    assert found.lists["refused"] == []
    (rule,) = (one for one in found.scenario.rules if one.id == "e")
    assert rule.then[0].offset is not None
    assert rule.then[0].offset.to == 2.5


def test_a_name_that_is_no_parameter_refuses_its_event_alone(
    workspace: Workspace, tmp_path: Path
) -> None:
    speed = EGO[EGO.index("<LongitudinalAction>") : EGO.index("</PrivateAction></Private>")]
    story = event(private(speed.replace('"10"', '"$Nothing"'))) + event(private(speed))
    found = read(workspace, tmp_path, init=added(101), story=story)
    assert any("no parameter of the file" in one for one in reasons(found, "refused"))
    rules = [one for one in found.scenario.rules if one.id.startswith("e")]
    assert [one.then[0].speed.to for one in rules if one.then[0].speed] == [10]
