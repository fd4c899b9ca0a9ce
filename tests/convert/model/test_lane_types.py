"""Lane types beside those for driving: who may use them, in SUMO and in the lane graph alike."""

from __future__ import annotations

import pytest

from odscen.convert.model.access import allowed
from odscen.convert.model.conversion_report import ElementOutcome
from odscen.convert.verify.fidelity import verify
from odscen.opendrive.parse import parse
from tests.convert.maps import Converted, of_model
from tests.opendrive.snippets import document, lane, road, section


def access(*names: str, rule: str = "allow") -> str:
    return "".join(f'<access sOffset="0" rule="{rule}" restriction="{one}"/>' for one in names)


def made(*lanes: str) -> Converted:
    return of_model(parse(document(road(lanes=section(*lanes)))))


def permissions(network: Converted) -> dict[str, frozenset[str]]:
    """Classes of each lane for vehicles, by the lanes of the map that it lies on."""
    table = network.network.table
    return {
        lane.get("id"): table.lanes[lane.get("id")].allowed
        for edge in network.edges().values()
        for lane in edge.iter("lane")
    }


def graph_lanes(network: Converted) -> set[int]:
    """Lanes that road users of the lane graph drive on."""
    lanes = network.graph.lanes
    return {lanes.lanes.keys[row].lane for row in set(lanes.lane.tolist())}


def lost(network: Converted) -> dict[str, str]:
    return {
        entry.element: entry.reason
        for entry in network.network.report.entries
        if entry.outcome is ElementOutcome.LOST
    }


@pytest.mark.parametrize(
    ("names", "classes"),
    [
        (("bus",), allowed("bus")),
        (("bus", "taxi"), allowed("bus") | {"taxi"}),
        (("taxi", "emergency"), allowed("taxi")),
        (("truck",), frozenset({"truck", "trailer", "emergency", "authority"})),
        (("emergency",), frozenset({"emergency", "authority"})),
        (("bicycle",), frozenset({"bicycle"})),
    ],
)
def test_a_restricted_lane_is_open_to_those_whom_its_access_allows(
    names: tuple[str, ...], classes: frozenset[str]
) -> None:
    network = made(lane(-1), lane(-2, kind="restricted", inside=access(*names)))
    assert permissions(network) == {"1.0.f_0": classes, "1.0.f_1": allowed("driving")}
    assert -2 in graph_lanes(network) or classes == {"bicycle"}
    assert verify(network.network.net_xml, network.odr, network.roads).passed


@pytest.mark.parametrize("inside", ["", access("none"), access("bus", rule="deny")])
def test_a_restricted_lane_that_is_opened_to_no_vehicle_stays_out(inside: str) -> None:
    network = made(lane(-1), lane(-2, kind="restricted", inside=inside))
    assert list(permissions(network)) == ["1.0.f_0"]
    assert graph_lanes(network) == {-1}
    assert "no access allows vehicles" in lost(network)["road 1"]


def test_a_shared_lane_is_for_all_road_users() -> None:
    network = made(lane(-1, kind="shared"))
    assert permissions(network) == {"1.0.f_0": allowed("driving")}
    assert graph_lanes(network) == {-1}
    assert lost(network) == {}


def test_a_shared_path_of_cyclists_and_walkers_is_closed_to_cars() -> None:
    network = made(lane(-1), lane(-2, kind="shared", inside=access("pedestrian", "bicycle")))
    assert permissions(network)["1.0.f_0"] == {"bicycle"}
    assert graph_lanes(network) == {-1}


def test_the_only_lane_of_a_narrow_road_is_used_the_way_of_its_side() -> None:
    network = made(lane(-1, kind="bidirectional", width=4.5))
    assert permissions(network) == {"1.0.f_0": allowed("driving")}
    assert graph_lanes(network) == {-1}
    assert "open both ways" in lost(network)["road 1 > laneSection 0 > lane -1"]


def test_a_lane_to_turn_left_from_both_ways_stays_out() -> None:
    network = made(lane(1), lane(-1, kind="bidirectional"), lane(-2))
    assert graph_lanes(network) == {1, -2}
    assert "open both ways" in lost(network)["road 1"]


TRACKS = {"tram": {"tram"}, "rail": {"rail", "rail_electric", "rail_fast", "rail_urban"}}


@pytest.mark.parametrize("kind", TRACKS)
def test_tracks_are_lanes_of_sumo_for_rail_vehicles_and_for_no_road_user(kind: str) -> None:
    network = made(lane(-1), lane(-2, kind=kind))
    assert permissions(network) == {"1.0.f_0": TRACKS[kind], "1.0.f_1": allowed("driving")}
    assert graph_lanes(network) == {-1}
    assert lost(network) == {}
    assert network.network.report.figures["rail_road_covered"] == pytest.approx(100.0)
    assert verify(network.network.net_xml, network.odr, network.roads).passed


def test_a_road_of_tracks_alone_leaves_the_graph_as_it_is() -> None:
    alone = made(lane(1, kind="tram"), lane(-1, kind="tram"))
    assert permissions(alone) == {"1.0.f_0": {"tram"}, "1.0.b_0": {"tram"}}
    assert len(alone.graph.lanes.x) == 0


@pytest.mark.parametrize(
    "kind", ["entry", "exit", "onRamp", "offRamp", "connectingRamp", "slipLane", "mwyExit", "HOV"]
)
def test_lanes_of_motorways_are_lanes_of_the_network(kind: str) -> None:
    network = made(lane(-1), lane(-2, kind=kind))
    assert permissions(network)["1.0.f_0"] == allowed(kind)
    assert graph_lanes(network) == {-1, -2}
