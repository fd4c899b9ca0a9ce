"""Whole networks: shipped and real maps, and what users find in them."""

from __future__ import annotations

import os
import subprocess
from pathlib import Path

import numpy as np
import pytest
import sumo

from odscen.base.ids import LaneKey, RoadId
from odscen.convert.building.network import build_network
from odscen.convert.lane_table.table_json import table_from_json, table_to_json
from odscen.convert.model.access import allowed
from odscen.convert.model.conversion_report import ElementOutcome
from odscen.opendrive.lanes import RoadTable
from odscen.opendrive.parse import parse
from odscen.opendrive.road_model import DRIVABLE_TYPES, WALKABLE_TYPES
from tests.convert.legs import crossing
from tests.convert.maps import Converted, converted, each_map, named, of_model
from tests.opendrive.snippets import document, lane, road, section

SUMO = Path(sumo.SUMO_HOME) / "bin" / "sumo"

CURVE = '<geometry s="0" x="5" y="-7" hdg="0.3" length="60"><arc curvature="0.01"/></geometry>'
STREET = document(
    road(
        plan=CURVE,
        length=60.0,
        lanes=section(
            lane(2, kind="sidewalk", width=2.0),
            lane(1),
            lane(-1),
            lane(-2, kind="biking", width=1.5),
            lane(-3, kind="sidewalk", width=2.0),
        ),
    )
)


@pytest.mark.parametrize(
    ("number", "vclass"),
    [(2, "pedestrian"), (1, "passenger"), (-1, "bus"), (-2, "bicycle"), (-3, "pedestrian")],
)
def test_each_kind_of_lane_is_found_where_it_is(number: int, vclass: str) -> None:
    table = of_model(parse(STREET)).network.table
    place = table.to_sumo(LaneKey(RoadId("1"), 0, number), 20.0)
    assert place is not None
    assert table.allowed(place.lane, vclass)
    assert place.deviation < 0.01


def test_traffic_against_s_runs_the_other_way() -> None:
    table = of_model(parse(STREET)).network.table
    near, far = (table.to_sumo(LaneKey(RoadId("1"), 0, 1), s) for s in (20.0, 40.0))
    assert near is not None
    assert far is not None
    assert near.pos > far.pos


@each_map()
def test_sumo_loads_the_network_without_a_word(path: Path, tmp_path: Path) -> None:
    net = tmp_path / "net.net.xml"
    net.write_bytes(converted(path).network.net_xml)
    done = subprocess.run(
        [SUMO, "-n", net, "--end", "1", "--no-step-log"],
        env={**os.environ, "SUMO_HOME": sumo.SUMO_HOME},
        capture_output=True,
        text=True,
        check=False,
    )
    assert (done.returncode, done.stderr) == (0, "")


@each_map()
def test_no_lane_is_for_both_persons_and_cars(path: Path) -> None:
    for found in converted(path).network.table.lane_list:
        assert not (found.allows("pedestrian") and found.allows("passenger")), found.id


@each_map()
def test_every_place_where_one_may_spawn_is_in_the_network(path: Path) -> None:
    made = converted(path)
    kinds = {k for k in made.roads.lane_type if k in DRIVABLE_TYPES | WALKABLE_TYPES}
    assert kinds
    for types, least in ((DRIVABLE_TYPES, 0.997), (WALKABLE_TYPES, 0.98)):
        lanes, s = made.nodes(types)
        wide = made.roads.lane_width(lanes, s) > 0.3 if len(lanes) else np.zeros(0, dtype=bool)
        found = made.places(lanes[wide], s[wide]).lane >= 0
        assert found.size == 0 or found.mean() >= least


@each_map()
def test_the_table_survives_json(path: Path) -> None:
    text = table_to_json(converted(path).network.table)
    assert table_to_json(table_from_json(text)) == text


@pytest.mark.slow
@pytest.mark.parametrize("name", ["signal_crossing", "esmini/fabriksgatan_traffic_lights"])
def test_two_conversions_give_the_same_bytes(name: str) -> None:
    content = named(name).read_bytes()
    one, two = (of_model(parse(content)).network for _ in range(2))
    assert one.net_xml == two.net_xml
    assert table_to_json(one.table) == table_to_json(two.table)
    assert one.report == two.report


def kind(made: Converted, key: LaneKey) -> str:
    return made.roads.lane_type[made.roads.lane_index[key]]


@pytest.mark.parametrize(
    ("name", "lefthand"), [("left_hand_crossing", True), ("esmini/e6mini-lht", True),
                           ("signal_crossing", False)]
)  # fmt: skip
def test_traffic_keeps_to_the_side_of_the_map(name: str, lefthand: bool) -> None:
    made = converted(named(name))
    table = made.network.table
    assert table.lefthand is lefthand
    for interval in table.intervals:
        key = table.lane_keys[interval.lane]
        if isinstance(key, LaneKey) and kind(made, key) in DRIVABLE_TYPES:
            assert (interval.s[-1] > interval.s[0]) == ((key.lane > 0) == lefthand)


def test_cars_never_get_onto_sidewalks_or_shoulders() -> None:
    for name in ("carla-2019/Town03", "carla-2020/Town04"):
        made = converted(named(name))
        for interval in made.network.table.intervals:
            key = made.network.table.lane_keys[interval.lane]
            if made.network.table.lane_list[interval.sumo].allows("passenger"):
                assert isinstance(key, LaneKey)
                assert kind(made, key) in DRIVABLE_TYPES


def test_limits_of_the_map_are_those_of_the_network_but_in_curves() -> None:
    table = converted(named("carla-2019/Town04")).network.table
    limits = {29.06, 24.59, 15.65, 13.41}
    metres: dict[float, float] = {}
    for found in table.lane_list:
        if found.allows("passenger") and table.edges[found.edge].function == "normal":
            speed = round(found.speed, 2)
            metres[speed] = metres.get(speed, 0.0) + found.length
    assert limits <= set(metres)
    assert max(metres) == 29.06
    # Its motorway has curves of 150 m radius and a limit of 105 km/h.
    assert sum(metres[limit] for limit in limits) > 0.5 * sum(metres.values())


def test_roundabouts_are_known_as_such() -> None:
    made = converted(named("roundabout"))
    [roundabout] = made.xml.iter("roundabout")
    assert roundabout.get("edges").split() == ["5.0.f", "6.0.f", "7.0.f", "8.0.f"]
    assert len(roundabout.get("nodes").split()) == 4
    assert made.network.report.figures["roundabouts"] == 1


@pytest.mark.parametrize(
    ("name", "count"), [("town_5x5", 2), ("t_junction_signs", 0), ("carla-2020/Town01", 0)]
)
def test_no_other_streets_are_taken_for_roundabouts(name: str, count: int) -> None:
    assert len(converted(named(name)).xml.findall("roundabout")) == count


def test_a_map_without_roads_for_cars_has_a_network_for_persons() -> None:
    made = of_model(parse(document(road(lanes=section(lane(-1, kind="sidewalk"))))))
    assert made.edges() == {}
    assert made.network.table.to_sumo(LaneKey(RoadId("1"), 0, -1), 50.0) is not None


def test_what_has_no_place_in_sumo_is_in_the_report() -> None:
    report = converted(named("carla-2020/Town01")).network.report
    assert any(e.outcome is ElementOutcome.LOST and "shoulder" in e.reason for e in report.entries)
    assert any(
        e.outcome is ElementOutcome.GUESSED and "no timing" in e.reason for e in report.entries
    )
    assert report.figures["traffic_lights"] == 12
    assert report.figures["connections"] >= 88
    assert report.figures["connections_lost"] == 0


def test_what_the_parser_repaired_is_in_the_report() -> None:
    report = converted(named("esmini/soderleden")).network.report
    assert ElementOutcome.REPAIRED in {entry.outcome for entry in report.entries}


def test_build_network_needs_nothing_but_the_model() -> None:
    odr = parse(STREET)
    roads = RoadTable.of(odr)
    made = of_model(odr)
    assert build_network(odr, roads, made.graph.walks).net_xml == made.network.net_xml


def test_a_faulty_junction_table_makes_the_network_of_the_sound_one() -> None:
    sound = crossing({})
    bare = sound.replace('<laneLink from="-1" to="-1"/>', "").replace(
        '<successor id="1"/>', '<successor id="-9"/>'
    )
    network = of_model(parse(bare)).network
    assert network.net_xml == of_model(parse(sound)).network.net_xml
    repaired = [e for e in network.report.entries if "junction-table" in e.reason]
    assert {e.outcome for e in repaired} == {ElementOutcome.REPAIRED}
    assert len(repaired) == 8
    assert network.report.figures["connections_lost"] == 0


def test_the_street_of_buses_has_what_it_ships_for() -> None:
    """Lanes for buses by access, a short link, lights amid a road, signs of three countries."""
    made = converted(named("bus_street"))
    lanes = made.network.table.lanes
    buses = {
        lane
        for lane, own in lanes.items()
        if own.allowed == allowed("bus") and not lane.startswith(":")
    }
    # Road 5 is cut where its lights are.
    sections = ["1.1", "5.1", "5.2", "7.1", "9.1"]
    assert buses == {f"{section}.{way}_0" for section in sections for way in "fb"}
    short = [lane for lane in lanes if lane.startswith("3.0.")]
    assert len(short) == 4
    assert len(made.xml.findall("tlLogic")) == 2
    assert len(made.xml.findall("edge[@function='crossing']")) == 13
    countries = {signal.country for road in made.odr.roads.values() for signal in road.signals}
    assert countries == {"OpenDRIVE", "DE", "FR", "SE"}
    waits = {
        link.get("from"): link.get("state")
        for link in made.xml.iter("connection")
        if link.get("from") in {"4.1.f", "6.1.f", "8.1.f"}
    }
    assert waits == {"4.1.f": "m", "6.1.f": "s", "8.1.f": "m"}
