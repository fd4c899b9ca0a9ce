from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest
from lxml import etree

from odscen.app.maps import LoadedMap, load_map
from odscen.maps.store import Workspace
from odscen.scenario.document.scenario_document import MapReference, Scenario
from odscen.sumo.realize.traffic_measures.breakdowns import breakdowns
from odscen.sumo.realize.traffic_measures.measure_actions import (
    MeasureActions,
    measure_actions,
    narrowed,
)
from odscen.sumo.realize.traffic_measures.measured_lanes import periods
from tests.sumo.runner.test_long_runs import TOWN

if TYPE_CHECKING:
    from odscen.sumo.realize.traffic_measures.breakdowns import Breakdown


@pytest.fixture(scope="module")
def town(tmp_path_factory: pytest.TempPathFactory) -> LoadedMap:
    return load_map(Workspace.open(tmp_path_factory.mktemp("town")).add_map(TOWN))


def scenario(town: LoadedMap, *measures: dict[str, Any]) -> Scenario:
    graph = town.sumo.graph
    place = MapReference(name=graph.map_name, sha256=graph.map_sha256, spacing=graph.lanes.spacing)
    numbered = [{"id": f"m{n}", **one} for n, one in enumerate(measures)]
    return Scenario.model_validate(
        {"name": "test", "map": place, "roi": ("r25",), "measures": numbered}
    )


def actions(town: LoadedMap, *measures: dict[str, Any], until: float = 600.0) -> MeasureActions:
    return measure_actions(scenario(town, *measures), town.sumo, until=until, step_length=0.5)


def xml(one: MeasureActions) -> etree._Element:
    assert one.xml is not None
    return etree.fromstring(one.xml.encode())


@pytest.mark.slow
def test_without_measures_nothing_is_written(town: LoadedMap) -> None:
    assert actions(town) == MeasureActions()
    late = {"kind": "closure", "places": ["r25"], "begin": 600.0}
    assert actions(town, late) == MeasureActions()


@pytest.mark.slow
def test_a_closed_road_is_closed_where_one_enters_it_and_stays_open_for_who_is_on_it(
    town: LoadedMap,
) -> None:
    found = actions(town, {"kind": "closure", "places": ["r25"], "begin": 60.0, "end": 120.0})
    net = town.sumo.net
    closed = [str(one.get("id")) for one in xml(found).iter("closingLaneReroute")]
    assert closed
    assert all(net.lanes[lane].internal for lane in closed)
    own = {"25.0", "25.1", "25.2"}
    led = {net.leaving(lane)[-1].edge.rsplit(".", 1)[0] for lane in closed}
    assert led <= own
    (interval,) = xml(found).iter("interval")
    assert dict(interval.attrib) == {"begin": "60", "end": "120"}
    cars = [one for one in found.closed if one.vclass == "passenger"]
    assert [(one.begin, one.end) for one in cars] == [(60.0, 120.0)]
    assert all(target.rsplit(".", 1)[0] in own for _, target in cars[0].pairs)
    assert all(source.rsplit(".", 1)[0] not in own for source, _ in cars[0].pairs)


@pytest.mark.parametrize(
    ("begin", "end", "written"),
    [
        (0.0, 0.1, ("0", "0.5")),
        (10.3, 20.7, ("10.5", "20.5")),
        (100800.5, 172800.5, ("100800.5", "172800.5")),
    ],
)
def test_closures_begin_and_end_with_a_step(
    town: LoadedMap, begin: float, end: float, written: tuple[str, str]
) -> None:
    closure = {"kind": "closure", "places": ["r25"], "begin": begin, "end": end}
    (interval,) = xml(actions(town, closure, until=1e6)).iter("interval")
    assert (interval.get("begin"), interval.get("end")) == written


def test_a_closed_lane_is_closed_itself_and_only_for_those_who_are_banned(town: LoadedMap) -> None:
    found = actions(town, {"kind": "permission", "places": ["12.0.-2"], "allowed": ["bus"]})
    lanes = list(xml(found).iter("closingLaneReroute"))
    assert len(lanes) == 3  # of as many edges in a row
    assert all(not town.sumo.net.lanes[str(one.get("id"))].internal for one in lanes)
    allowed = str(lanes[0].get("allow")).split()
    assert "bus" in allowed
    assert not {"passenger", "truck", "bicycle"} & set(allowed)
    assert "pedestrian" not in allowed  # as in the network


def test_one_closed_lane_of_two_breaks_only_turns_that_no_other_lane_makes(
    town: LoadedMap,
) -> None:
    both = actions(town, {"kind": "closure", "places": ["12.0.-1", "12.0.-2"]})
    one = actions(town, {"kind": "closure", "places": ["12.0.-2"]})
    pairs = [
        {pair for period in found.closed if period.vclass == "passenger" for pair in period.pairs}
        for found in (both, one)
    ]
    assert all(target.startswith("12.") for _, target in pairs[0])
    assert len(pairs[0]) == 3  # from the three other roads of the junction
    turns = {(source.split(".")[0], target.split(".")[0]) for source, target in pairs[1]}
    assert ("12", "22") in turns  # to the right, from the right lane alone
    assert ("12", "23") not in turns


def test_of_several_limits_the_lowest_holds_and_narrow_lanes_lower_them(town: LoadedMap) -> None:
    found = actions(
        town,
        {"kind": "speed_limit", "places": ["r25"], "speed": 8.0, "begin": 100.0, "end": 300.0},
        {"kind": "roadworks", "places": ["25.0.-1"], "speed": 6.0, "begin": 200.0, "width": 3.4},
    )
    steps = {
        tuple((str(step.get("time")), str(step.get("speed"))) for step in sign)
        for sign in xml(found).iter("variableSpeedSign")
    }
    lowered = f"{round(6.0 - 3.1 / 3.6, 4):g}"
    assert (("100", "8"), ("300", "-1")) in steps
    assert (("100", "8"), ("200", lowered)) in steps


@pytest.mark.parametrize(
    ("width", "kmh"), [(3.7, 0.0), (3.5, 3.1), (3.35, 3.1), (3.2, 10.6), (2.8, 10.6)]
)
def test_narrow_lanes_take_off_what_hcm_says(width: float, kmh: float) -> None:
    assert narrowed(width) * 3.6 == pytest.approx(kmh)


def test_periods_cut_a_run_at_every_begin_and_end() -> None:
    cut = list(periods([(10.0, 50.0), (20.0, 900.0)], 100.0))
    assert cut == [(0.0, 10.0), (10.0, 20.0), (20.0, 50.0), (50.0, 100.0)]


def test_the_plan_says_what_measures_do_and_where(town: LoadedMap) -> None:
    found = actions(
        town,
        {"kind": "closure", "places": ["r25"], "begin": 60.0},
        {"kind": "signal_outage", "junction": "10016", "end": 50.0},
        {"kind": "incident", "lane": "23.0.-1", "s": 40.0},
    )
    assert [(one.id, one.begin, one.end) for one in found.measures] == [
        ("m1", 0.0, 50.0),
        ("m2", 0.0, 600.0),
        ("m0", 60.0, 600.0),
    ]
    assert all(one.lines for one in found.measures)
    xs = [x for line in found.measures[2].lines for x in line[::2]]
    assert min(xs) == pytest.approx(210.0, abs=2.0)
    assert max(xs) == pytest.approx(305.0, abs=2.0)


def test_the_vehicle_of_an_incident_can_stop_where_it_is_to(town: LoadedMap) -> None:
    one = scenario(
        town, {"kind": "incident", "lane": "23.0.-1", "s": 40.0, "begin": 100.0, "end": 200.0}
    )
    found: Breakdown
    (found,) = breakdowns(one, town.sumo, until=600.0)
    lane = town.sumo.net.lanes[found.stop_lane]
    assert found.edges[-1] == lane.edge
    assert 0.0 < found.stop_pos <= lane.length
    assert 90.0 < found.depart < 100.0
    assert found.until == 200.0
