"""Routes of OpenSCENARIO files: their places in order, and straight on where there is none."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from odscen.app.exchange.imports import ImportedFile, import_file
from odscen.lanegraph.query import node_index
from odscen.maps.shipped import shipped_maps
from odscen.maps.store import Workspace
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
