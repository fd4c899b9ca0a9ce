"""Routes of OpenSCENARIO files: their places in order, and straight on where there is none."""

from __future__ import annotations

from typing import TYPE_CHECKING

import polars as pl
import pytest

from odscen.app.exchange.imports import ImportedFile, import_file
from odscen.app.running.runs import run
from odscen.lanegraph.query import node_index
from odscen.maps.shipped import shipped_maps
from odscen.maps.store import Workspace
from odscen.runs.run_settings import RunSettings
from tests.sumo.story_case import loaded

if TYPE_CHECKING:
    from pathlib import Path

MAP = "signal_crossing"
FILE = """<OpenSCENARIO><FileHeader revMajor="1" revMinor="1" date="2024-01-01T00:00:00"
 description="" author=""/><RoadNetwork><LogicFile filepath="signal_crossing.xodr"/></RoadNetwork>
<Entities><ScenarioObject name="car"><Vehicle name="car" vehicleCategory="car"/></ScenarioObject>
</Entities><Storyboard><Init><Actions><Private entityRef="car"><PrivateAction><TeleportAction>
<Position><WorldPosition x="-60" y="-1.75" h="0"/></Position></TeleportAction></PrivateAction>
{route}</Private></Actions></Init><StopTrigger/></Storyboard></OpenSCENARIO>"""
ROUTE = """<PrivateAction><RoutingAction><AssignRouteAction><Route name="r" closed="false">{places}
</Route></AssignRouteAction></RoutingAction></PrivateAction>"""
WAYPOINT = """<Waypoint routeStrategy="shortest"><Position><WorldPosition x="{}" y="{}" h="{}"/>
</Position></Waypoint>"""


def imported(tmp_path: Path, *places: tuple[float, float, float]) -> ImportedFile:
    route = ROUTE.format(places="".join(WAYPOINT.format(*one) for one in places))
    file = tmp_path / "routed.xosc"
    file.write_text(FILE.format(route=route if places else ""), encoding="utf-8")
    return import_file(Workspace.open(tmp_path / "workspace"), file, maps=shipped_maps()[0].parent)


def where(node: str | None) -> tuple[float, float]:
    graph = loaded(MAP).sumo.graph
    row = node_index(graph, node or "")
    return float(graph.lanes.x[row]), float(graph.lanes.y[row])


def test_who_has_no_route_goes_straight_on_over_crossings_and_the_report_says_so(
    tmp_path: Path,
) -> None:
    found = imported(tmp_path)
    assert found.scenario is not None
    (car,) = found.scenario.actors
    x, y = where(car.goal)
    assert x > 60.0
    assert -5.0 < y < 0.0
    rows = [row.reason for row in found.lists["approximated"]]
    assert "straight on at junctions and forks, as the file gives no route at first" in rows


def test_a_route_leads_through_its_places_but_for_the_one_behind(tmp_path: Path) -> None:
    found = imported(tmp_path, (-80.0, -1.75, 0.0), (30.0, -1.75, 0.0), (60.0, -1.75, 0.0))
    assert found.scenario is not None
    (car,) = found.scenario.actors
    assert [where(node)[0] for node in car.via] == pytest.approx([30.0], abs=2.5)
    assert where(car.goal)[0] == pytest.approx(60.0, abs=2.5)
    assert [one for one in found.problems if one.severity == "error"] == []


RAMP = """<OpenDRIVE><header revMajor="1" revMinor="4"/>
<road name="" length="100" id="7" junction="-1"><link><successor elementType="road"
 elementId="8" contactPoint="start"/></link><planView><geometry s="0" x="0" y="-3.5" hdg="0"
 length="100"><line/></geometry></planView><lanes><laneSection s="0"><center>
<lane id="0" type="none" level="false"/></center><right><lane id="-1" type="driving"
 level="false"><link><successor id="-2"/></link>
<width sOffset="0" a="3.5" b="0" c="0" d="0"/></lane></right></laneSection></lanes></road>
<road name="" length="400" id="8" junction="-1"><link><predecessor elementType="road"
 elementId="7" contactPoint="end"/></link><planView><geometry s="0" x="100" y="0" hdg="0"
 length="400"><line/></geometry></planView><lanes><laneSection s="0"><center>
<lane id="0" type="none" level="false"/></center><right>
<lane id="-1" type="driving" level="false"><width sOffset="0" a="3.5" b="0" c="0" d="0"/></lane>
<lane id="-2" type="driving" level="false"><link><predecessor id="-1"/></link>
<width sOffset="0" a="3.5" b="0" c="0" d="0"/></lane>
<lane id="-3" type="driving" level="false"><width sOffset="0" a="3.5" b="0" c="0" d="0"/></lane>
</right></laneSection></lanes></road></OpenDRIVE>"""
CHANGE = """<Story name="s"><Act name="a"><ManeuverGroup name="g" maximumExecutionCount="1">
<Actors selectTriggeringEntities="false"><EntityRef entityRef="car"/></Actors><Maneuver name="m">
<Event name="merge" priority="parallel"><Action name="x"><PrivateAction><LateralAction>
<LaneChangeAction><LaneChangeActionDynamics dynamicsShape="sinusoidal" dynamicsDimension="time"
 value="3"/><LaneChangeTarget><AbsoluteTargetLane value="{}"/></LaneChangeTarget></LaneChangeAction>
</LateralAction></PrivateAction></Action><StartTrigger><ConditionGroup><Condition name="c" delay="0"
 conditionEdge="none"><ByValueCondition><SimulationTimeCondition value="8" rule="greaterThan"/>
</ByValueCondition></Condition></ConditionGroup></StartTrigger></Event></Maneuver></ManeuverGroup>
</Act></Story><StopTrigger"""


@pytest.mark.parametrize(("lane", "by"), [(-3, -1), (-1, None)])
def test_a_lane_that_the_road_of_the_start_lacks_is_that_of_the_next_one_that_has_it(
    tmp_path: Path, lane: int, by: int | None
) -> None:
    (tmp_path / "ramp.xodr").write_text(RAMP, encoding="utf-8")
    text = FILE.format(route="").replace("signal_crossing", "ramp")
    text = text.replace('x="-60" y="-1.75"', 'x="20" y="-5.25"')
    text = text.replace("<StopTrigger", CHANGE.format(lane), 1)
    (tmp_path / "merge.xosc").write_text(text, encoding="utf-8")
    found = import_file(Workspace.open(tmp_path / "workspace"), tmp_path / "merge.xosc")
    assert found.scenario is not None
    (rule,) = (one for one in found.scenario.rules if one.id == "merge")
    (action,) = rule.then
    assert (action.lane.by if action.lane else None) == by


def test_who_stands_at_the_end_of_a_road_can_start_there(tmp_path: Path) -> None:
    (tmp_path / "ramp.xodr").write_text(RAMP, encoding="utf-8")
    text = FILE.format(route="").replace("signal_crossing", "ramp")
    text = text.replace('x="-60" y="-1.75"', 'x="499.5" y="-1.75"')
    (tmp_path / "end.xosc").write_text(text, encoding="utf-8")
    workspace = Workspace.open(tmp_path / "workspace")
    found = import_file(workspace, tmp_path / "end.xosc")
    assert [one for one in found.problems if one.severity == "error"] == []
    done = run(workspace, found.scenario, settings=RunSettings(until=2), name="r", out=tmp_path)
    last = done.trajectories().filter(pl.col("time") > 1.5)
    assert last["x"].to_numpy() == pytest.approx(499.5, abs=0.01)
