"""Who may use a lane: by its type and by ``<access>``, in both forms of the standard."""

from __future__ import annotations

from pathlib import Path
from xml.etree import ElementTree as ET

import pytest

from odscen.base.categories import Category
from odscen.base.ids import LaneKey, RoadId
from odscen.convert.building.network import build_network
from odscen.convert.lane_table.sumo_network import SumoNetwork
from odscen.convert.model.access import allowed
from odscen.lanegraph.build_graphs import build_map_graph
from odscen.lanegraph.graphs import MapGraph
from odscen.opendrive.lanes import RoadTable
from odscen.opendrive.parse import parse
from odscen.opendrive.road_model import OpenDrive
from odscen.scenario.document.sampling_config import SamplingConfig, overridden
from odscen.scenario.sampling.sampler import sample_scenario
from odscen.sumo.realize.sumo_map import SumoMap
from odscen.sumo.realize.usable import usable_places
from tests.convert.maps import converted, each_map
from tests.opendrive.snippets import document, lane, road, section


def access(rule: str, *names: str, new: bool = False, s: float = 0.0) -> str:
    """``<access>`` in the form of 1.4 to 1.7, or in that of 1.8."""
    start = f'<access sOffset="{s}" rule="{rule}"'
    if new:
        inside = "".join(f'<restriction type="{name}"/>' for name in names)
        return f"{start}>{inside}</access>"
    return "".join(f'{start} restriction="{name}"/>' for name in names)


def one_lane(inside: str, kind: str = "driving") -> OpenDrive:
    return parse(document(road(lanes=section(lane(-1, inside=inside, kind=kind)))))


def built(odr: OpenDrive) -> tuple[SumoNetwork, MapGraph]:
    table = RoadTable.of(odr)
    graph = build_map_graph(odr, name="m", sha256="0" * 64, table=table)
    return build_network(odr, table, graph.walks), graph


def permissions(odr: OpenDrive) -> list[frozenset[str]]:
    """Classes of the lanes for vehicles, in the order of the network."""
    network, _ = built(odr)
    return [
        one.allowed
        for one in network.table.lanes.values()
        if one.allowed != frozenset({"pedestrian"})
    ]


@pytest.mark.parametrize("new", [False, True])
@pytest.mark.parametrize(
    ("rule", "names", "classes"),
    [
        ("allow", ("bus",), allowed("bus")),
        ("allow", ("bus", "taxi"), allowed("bus") | {"taxi"}),
        ("allow", ("taxi",), allowed("taxi")),
        ("allow", ("bicycle",), frozenset({"bicycle"})),
        ("deny", ("bicycle",), allowed("driving") - {"bicycle"}),
        ("deny", ("truck",), allowed("driving") - {"truck", "trailer"}),
        ("deny", ("trucks", "bus"), allowed("driving") - {"truck", "trailer", "bus", "coach"}),
        (
            "deny",
            ("passengerCar",),
            allowed("driving") - {"passenger", "private", "evehicle", "hov", "vip"},
        ),
        (
            "allow",
            ("delivery", "truck"),
            {"delivery", "truck", "trailer", "emergency", "authority"},
        ),
        ("allow", ("none",), allowed("driving")),
        ("deny", ("none",), allowed("driving")),
        ("allow", ("simulator",), allowed("driving")),
        ("deny", ("throughTraffic",), allowed("driving")),
        ("deny", ("pedestrian",), allowed("driving")),
    ],
)
def test_access_of_both_forms_is_the_permission_of_the_sumo_lane(
    rule: str, names: tuple[str, ...], classes: frozenset[str], new: bool
) -> None:
    assert permissions(one_lane(access(rule, *names, new=new))) == [frozenset(classes)]


def test_a_lane_is_what_access_makes_of_it_in_the_lane_graph_too() -> None:
    for name, kind in (("bus", "bus"), ("taxi", "taxi"), ("HOV", "HOV")):
        assert built(one_lane(access("allow", name)))[1].lanes.lanes.types == (kind,)
    assert built(one_lane(access("allow", "bicycle")))[1].lanes.lanes.types == ()
    assert built(one_lane(access("deny", "truck")))[1].lanes.lanes.types == ("driving",)


def test_a_bus_lane_is_one_by_its_type_and_by_access_alike() -> None:
    by_type, by_access = one_lane("", kind="bus"), one_lane(access("allow", "bus"))
    assert built(by_type)[0].net_xml == built(by_access)[0].net_xml


def test_access_that_begins_on_the_way_cuts_the_edge_there() -> None:
    odr = one_lane(access("deny", "truck", s=40.0) + access("deny", "none", s=70.0))
    network, _ = built(odr)
    lanes = [network.table.lanes[one] for one in sorted(network.table.lanes) if ".f_" in one]
    assert ["truck" in one.allowed for one in lanes] == [True, False, True]
    assert [round(one.length) for one in lanes] == [40, 30, 30]


def test_access_of_a_connecting_lane_is_the_permission_of_the_internal_lane() -> None:
    link = '<{} elementType="{}" elementId="{}" {}/>'
    on = '<link><predecessor id="-1"/><successor id="-1"/></link>'
    plan = '<geometry s="0" x="{}" y="0" hdg="0" length="{}"><line/></geometry>'
    inner = road(
        "7",
        length=20.0,
        plan=plan.format(100, 20),
        junction="5",
        lanes=section(lane(-1, inside=on + access("deny", "truck"))),
        link=link.format("predecessor", "road", "1", 'contactPoint="end"')
        + link.format("successor", "road", "2", 'contactPoint="start"'),
    )
    odr = parse(
        document(
            road("1", lanes=section(lane(-1)), link=link.format("successor", "junction", "5", "")),
            inner,
            road(
                "2",
                plan=plan.format(120, 100),
                lanes=section(lane(-1)),
                link=link.format("predecessor", "junction", "5", ""),
            ),
            '<junction id="5"><connection id="0" incomingRoad="1" connectingRoad="7" '
            'contactPoint="start"><laneLink from="-1" to="-1"/></connection></junction>',
        )
    )
    network, _ = built(odr)
    inside = [one for one in network.table.lanes.values() if one.id.startswith(":")]
    assert [one.allowed for one in inside if "bus" in one.allowed] == [
        allowed("driving") - {"truck", "trailer"}
    ]


def test_a_connection_that_no_class_may_use_is_none() -> None:
    link = '<{} elementType="road" elementId="{}" contactPoint="{}"/>'
    on = '<link><successor id="-1"/></link>'
    odr = parse(
        document(
            road(
                "1",
                lanes=section(lane(-1, inside=on + access("allow", "delivery"))),
                link=link.format("successor", "2", "start"),
            ),
            road(
                "2",
                plan='<geometry s="0" x="100" y="0" hdg="0" length="100"><line/></geometry>',
                lanes=section(
                    lane(-1, inside=access("allow", "motorcycle") + access("deny", "emergency"))
                ),
                link=link.format("predecessor", "1", "end"),
            ),
        )
    )
    network, _ = built(odr)
    assert network.report.figures["connections"] == 0.0
    assert any("no vehicle class may use" in entry.reason for entry in network.report.entries)


def test_the_report_says_what_became_of_access() -> None:
    network, _ = built(one_lane(access("allow", "bus")))
    place = "road 1 > laneSection 0 > lane -1"
    told = [(e.outcome, e.reason) for e in network.report.entries if e.element == place]
    assert ("kept", "access from s=0: authority, bus, coach, emergency") in told
    for inside, reason in (
        (
            access("allow", "simulator"),
            "access: allow simulator has no vehicle class in SUMO; left out",
        ),
        (
            '<access sOffset="0" restriction="bus"/>',
            "access of bus without a rule: it may allow or deny; left out",
        ),
    ):
        network, _ = built(one_lane(inside))
        told = [(e.outcome, e.reason) for e in network.report.entries if e.element == place]
        assert ("lost", reason) in told


def test_a_lane_that_is_open_to_no_vehicle_has_that_as_its_reason() -> None:
    closed = access("allow", "delivery") + access("deny", "delivery") + access("deny", "emergency")
    network, _ = built(one_lane(closed))
    reasons = [e.reason for e in network.report.entries if e.element.endswith("lane -1")]
    assert any(one.endswith("no SUMO lane: by its access no vehicle may use it") for one in reasons)
    assert LaneKey(RoadId("1"), 0, -1) not in network.table.lane_keys


def stated_lanes(path: Path) -> dict[LaneKey, tuple[str, list[tuple[float, str, str]]]]:
    """Type and access of each lane, straight from the file: s of the road, rule and who."""
    found: dict[LaneKey, tuple[str, list[tuple[float, str, str]]]] = {}
    for road_ in ET.parse(path).getroot().iterfind("road"):
        for number, part in enumerate(road_.iterfind("lanes/laneSection")):
            for one in part.iterfind("*/lane"):
                rows = [
                    (float(part.get("s")) + float(item.get("sOffset")), item.get("rule", ""), name)
                    for item in one.iterfind("access")
                    for name in [
                        item.get("restriction"),
                        *(below.get("type") for below in item.iterfind("restriction")),
                    ]
                    if name
                ]
                key = LaneKey(RoadId(road_.get("id")), number, int(one.get("id")))
                found[key] = one.get("type"), rows
    return found


@each_map()
def test_permissions_of_every_lane_are_those_of_its_type_and_access(path: Path) -> None:
    network = converted(path).network.table
    stated = stated_lanes(path)
    seen = 0
    for interval in network.intervals:
        key, own = network.lane_keys[interval.lane], network.lane_list[interval.sumo]
        if not isinstance(key, LaneKey) or network.edges[own.edge].function != "normal":
            continue
        kind, rows = stated[key]
        if own.allowed == {"pedestrian"}:
            assert kind in ("sidewalk", "walking", "shared", "driving")
            continue
        middle = float(interval.s[0] + interval.s[-1]) / 2.0
        begun = [row for row in rows if row[0] <= middle]
        holding = {row[1:] for row in begun if row[0] == begun[-1][0]}
        if not holding:
            assert own.allowed == allowed(kind), key
        for rule, who in holding:
            classes = {"bus": "bus", "truck": "truck", "bicycle": "bicycle", "taxi": "taxi"}
            if who in classes:
                assert (classes[who] in own.allowed) == (rule == "allow"), key
        seen += 1
    assert seen


def test_sampling_places_nobody_on_a_lane_that_does_not_admit_them() -> None:
    plan = '<geometry s="0" x="0" y="0" hdg="0" length="600"><line/></geometry>'
    lanes = section(lane(-1), lane(-2), lane(-3, inside=access("deny", "truck", "bicycle")))
    network, graph = built(parse(document(road(length=600.0, plan=plan, lanes=lanes))))
    usable = usable_places(SumoMap.of(graph, network.table))
    config = overridden(SamplingConfig(), fill=1.0)
    scenario = sample_scenario(graph, config, seed=1, name="s", usable=usable)
    on_last = {one.category for one in scenario.actors if ".-3." in str(one.spawn)}
    others = {one.category for one in scenario.actors if ".-3." not in str(one.spawn)}
    assert {Category.TRUCK, Category.BICYCLE} <= others
    assert Category.CAR in on_last
    assert not on_last & {Category.TRUCK, Category.BICYCLE}
    free = built(parse(document(road(length=600.0, plan=plan))))
    assert usable_places(SumoMap.of(free[1], free[0].table)).barred == {}


EVERYBODY = ("passengerCar", "bus", "delivery", "emergency", "taxi", "bicycle", "motorcycle")


def test_a_lane_that_denies_every_road_user_by_name_is_a_restricted_one() -> None:
    open_lane = lane(-1)
    shut = lane(-2, inside=access("deny", *EVERYBODY, "truck", new=True))
    network, graph = built(parse(document(road(lanes=section(open_lane, shut)))))
    assert graph.lanes.lanes.types == ("driving",)
    assert [one.allowed for one in network.table.lanes.values() if "bus" in one.allowed] == [
        allowed("driving")
    ]
    reasons = [entry.reason for entry in network.report.entries]
    assert "lanes of type restricted, on which no access allows vehicles: left out" in reasons
    assert "access: deny bus; no vehicle uses the lane" in reasons


def test_a_lane_that_denies_every_road_user_from_a_place_on_ends_there() -> None:
    odr = one_lane(access("deny", *EVERYBODY, "truck", s=60.0))
    network, _ = built(odr)
    assert [
        round(one.length) for one in network.table.lanes.values() if "_" in one.id and "f" in one.id
    ] == [60]


def test_a_track_whose_access_allows_buses_is_a_bus_lane_with_trams() -> None:
    network, graph = built(one_lane(access("allow", "bus", "taxi"), kind="tram"))
    assert graph.lanes.lanes.types == ("bus",)
    assert [one.allowed for one in network.table.lanes.values() if "bus" in one.allowed] == [
        allowed("bus") | {"taxi", "tram"}
    ]


def test_a_track_stays_one_for_cyclists_and_from_a_place_on() -> None:
    for inside in (access("allow", "bicycle"), access("allow", "bus", s=40.0)):
        network, graph = built(one_lane(inside, kind="tram"))
        assert graph.lanes.lanes.types == ()
        assert {"tram"} in [one.allowed for one in network.table.lanes.values()]
        reasons = [e.reason for e in network.report.entries if e.outcome == "lost"]
        assert any(one.endswith("on a lane for rail vehicles alone; left out") for one in reasons)


def test_access_behind_the_end_of_its_lane_is_told_as_lost() -> None:
    network, _ = built(one_lane(access("allow", "bus", s=500.0)))
    reason = "access: allow bus from s=500, behind the end of the lane; left out"
    assert ("lost", reason) in [(e.outcome, e.reason) for e in network.report.entries]
    assert permissions(one_lane(access("allow", "bus", s=500.0))) == [allowed("driving")]
