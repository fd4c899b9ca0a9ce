import re
import xml.etree.ElementTree as ET
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np
import pyproj
import pytest

from odscen.opendrive.lanes import RoadTable
from odscen.opendrive.objects import crosswalks, signal_kind, stop_lines
from odscen.opendrive.parse import parse
from odscen.opendrive.road_model import DRIVABLE_TYPES
from odscen.opendrive.topology import lane_successors

MAPS = sorted((Path(__file__).parents[2] / "maps").glob("*.xodr"))
NAMES = [path.stem for path in MAPS]
CROSSINGS = [name for name in NAMES if name not in ("motorway_weave", "rural_hills")]

AMID_A_ROAD = {"bus_street": {"3", "4"}}
"""Controllers of lights at a crosswalk of a plain road."""


@dataclass(frozen=True)
class Shipped:
    """A shipped map: its elements, our road model, and all ends of lanes as traffic meets them."""

    root: ET.Element
    odr: object
    table: RoadTable

    def ends(self, rows, *, leaving):
        """Points of lane centres where traffic enters (or leaves) the lanes; driving heading."""
        forward = self.table.lane_forward[rows]
        s = np.where(forward == leaving, self.table.lane_s1[rows], self.table.lane_s0[rows])
        points = self.table.lane_points(rows, s)
        hdg = points.hdg + np.where(forward, 0.0, np.pi)
        return np.stack([points.x, points.y, points.z], axis=1), hdg


@cache
def shipped(name):
    path = next(path for path in MAPS if path.stem == name)
    odr = parse(path.read_bytes(), file=path.name)
    return Shipped(ET.parse(path).getroot(), odr, RoadTable.of(odr))


every_map = pytest.mark.parametrize("name", NAMES)
every_crossing = pytest.mark.parametrize("name", CROSSINGS)


def samples(table, rows, step=0.5):
    """Rows repeated and s, about every ``step`` metres along the lanes."""
    counts = np.maximum(2, ((table.lane_s1 - table.lane_s0)[rows] / step).astype(int))
    s = [
        np.linspace(table.lane_s0[r], table.lane_s1[r], n)
        for r, n in zip(rows, counts, strict=True)
    ]
    return np.repeat(rows, counts), np.concatenate(s)


def rows_where(shipped_map, keep):
    """Rows of the lanes for which ``keep(type, road)`` holds."""
    table, roads = shipped_map.table, list(shipped_map.odr.roads.values())
    return np.array(
        [
            row
            for row, kind in enumerate(table.lane_type)
            if keep(kind, roads[table.lane_road[row]])
        ],
        dtype=np.int64,
    )


def test_all_the_maps_are_there_and_small():
    assert NAMES == [
        "bus_street",
        "left_hand_crossing",
        "motorway_weave",
        "roundabout",
        "rural_hills",
        "signal_crossing",
        "t_junction_signs",
        "town_5x5",
    ]
    assert max(path.stat().st_size for path in MAPS) < 500_000


@every_map
def test_the_script_writes_the_same_bytes_again(name):
    pytest.importorskip("scenariogeneration", reason="needs the maintainers' tools")
    from tools.make_maps.__main__ import map_text

    path = next(path for path in MAPS if path.stem == name)
    assert map_text(name).encode() == path.read_bytes()


@pytest.mark.slow
def test_the_large_town_has_over_a_hundred_junctions():
    pytest.importorskip("scenariogeneration", reason="needs the maintainers' tools")
    from tools.make_maps.__main__ import map_text

    odr = parse(map_text("large_town"))
    assert len(odr.junctions) > 100
    assert odr.notes == ()


@pytest.mark.slow
def test_towns_that_are_joined_are_one_network_without_a_gap():
    pytest.importorskip("scenariogeneration", reason="needs the maintainers' tools")
    from tools.make_maps.__main__ import map_text

    odr = parse(map_text("towns_10"))
    assert odr.notes == ()
    country = [road for road in odr.roads.values() if road.name == "Country Road"]
    assert len(country) == 13
    successors = lane_successors(odr)
    reached, fresh = set(), {key for key in successors if key.road == country[0].id}
    while fresh:
        reached |= fresh
        fresh = {lane for key in fresh for lane in successors.get(key, ())} - reached
    assert {road.id for road in country} <= {key.road for key in reached}
    assert len({key.road for key in reached}) > 0.9 * len(odr.roads)


@every_map
def test_our_own_reader_has_nothing_to_remark(name):
    assert shipped(name).odr.notes == ()


@every_map
def test_the_header_says_who_when_and_where(name):
    header = shipped(name).root.find("header").attrib
    assert (header["name"], header["vendor"]) == (name, "odscen")
    assert header["date"] == "2026-01-01T00:00:00"
    crs = pyproj.CRS(shipped(name).root.findtext("header/geoReference"))
    assert crs.is_projected


@every_map
def test_ids_are_unique_and_numbers_are_numbers(name):
    root = shipped(name).root
    for tag in ("road", "junction", "object", "signal", "controller[@name]"):
        ids = [element.get("id") for element in root.findall(f".//{tag}")]
        assert len(ids) == len(set(ids)), tag
    values = [value for element in root.iter() for value in element.attrib.values()]
    assert not [value for value in values if re.fullmatch("[+-]?(nan|inf)", value, re.IGNORECASE)]


@every_map
def test_lanes_meet_within_two_centimetres_and_one_degree(name):
    here = shipped(name)
    index = here.table.lane_index
    pairs = [(index[a], index[b]) for a, bs in lane_successors(here.odr).items() for b in bs]
    before, after = np.array(pairs).T
    end, end_hdg = here.ends(before, leaving=True)
    start, start_hdg = here.ends(after, leaving=False)
    turn = np.abs((end_hdg - start_hdg + np.pi) % (2 * np.pi) - np.pi)
    assert np.linalg.norm(end - start, axis=1).max() < 0.02
    assert np.degrees(turn).max() < 1.0


@every_map
def test_heights_and_banks_have_no_steps(name):
    here = shipped(name)
    for road in here.root.iter("road"):
        row, length = here.table.road_index[road.get("id")], float(road.get("length"))
        starts = [
            float(e.get("s")) for tag in ("elevation", "superelevation") for e in road.iter(tag)
        ]
        s = np.array([s for s in starts if 0.01 < s < length - 0.01])
        rows = np.full(s.shape, row)
        low, high = here.table.reference(rows, s - 1e-6), here.table.reference(rows, s + 1e-6)
        assert np.abs(low.z - high.z).max(initial=0.0) < 1e-4
        assert np.abs(low.pitch - high.pitch).max(initial=0.0) < 1e-3
        assert np.abs(low.roll - high.roll).max(initial=0.0) < 1e-4


@every_map
def test_cars_can_follow_every_curve(name):
    here = shipped(name)
    rows = rows_where(here, lambda kind, _: kind in DRIVABLE_TYPES)
    lane, s = samples(here.table, rows)
    points = here.table.lane_points(lane, s)
    radius = 1.0 / np.maximum(np.abs(points.curvature), 1e-9)
    assert radius.min() > 6.0
    assert np.degrees(np.abs(points.pitch)).max() < 6.0


@every_map
def test_every_movement_exists(name):
    """Each road by which traffic arrives at a junction leads to each other one it can leave by."""
    here = shipped(name)
    odr = here.odr
    followers = lane_successors(odr)
    for junction in odr.junctions.values():
        reached, arriving = {}, set()
        connecting = {c.connecting_road: c.incoming_road for c in junction.connections}
        for lane, following in followers.items():
            drivable = here.table.lane_type[here.table.lane_index[lane]] in DRIVABLE_TYPES
            if not drivable:
                continue
            if any(f.road in connecting for f in following):
                arriving.add(lane.road)
            if lane.road in connecting:
                reached.setdefault(connecting[lane.road], set()).update(f.road for f in following)
        leaving = set().union(*reached.values())
        assert len(arriving | leaving) >= 3
        for road in arriving:
            assert reached[road] == leaving - {road}


@every_map
def test_lanes_end_only_at_the_borders_of_the_map_or_by_becoming_narrow(name):
    here = shipped(name)
    table, odr = here.table, here.odr
    preceded = {b for bs in lane_successors(odr).values() for b in bs}
    for lane, following in lane_successors(odr).items():
        row = table.lane_index[lane]
        if table.lane_type[row] not in DRIVABLE_TYPES:
            continue
        road, forward = odr.roads[lane.road], table.lane_forward[row]
        at_end, at_start = lane.section + 1 == len(road.sections), lane.section == 0
        width = table.lane_width(np.array([row, row]), np.array([table.lane_s0[row], 1e9]))
        if not following:
            border = road.successor is None if forward else road.predecessor is None
            assert (border and (at_end if forward else at_start)) or width[int(forward)] < 1e-6
        if lane not in preceded:
            border = road.predecessor is None if forward else road.successor is None
            assert (border and (at_start if forward else at_end)) or width[1 - int(forward)] < 1e-6


@every_map
def test_lanes_are_as_wide_as_they_should_be(name):
    here = shipped(name)
    table = here.table
    for row, kind in enumerate(table.lane_type):
        ends = table.lane_width(np.array([row, row]), np.array([table.lane_s0[row], 1e9]))
        low, high = {"driving": (3.0, 3.75), "sidewalk": (2.0, 4.0)}.get(kind, (0.0, 3.75))
        opens = kind == "driving" and ends.min() < 1e-6  # a lane that begins or ends
        assert ends.max() <= high + 1e-6
        assert ends.min() >= low - 1e-6 or opens


@every_map
def test_every_lane_has_a_speed_limit(name):
    here = shipped(name)
    rows = rows_where(here, lambda kind, _: kind in DRIVABLE_TYPES)
    lane, s = samples(here.table, rows, step=20.0)
    limit = here.table.speed_limit(lane, s) * 3.6
    assert limit.min() >= 29.9
    assert limit.max() <= (130.1 if name == "motorway_weave" else 100.1)


@every_map
def test_lane_changes_between_lanes_of_one_direction_are_marked(name):
    """Broken lines allow them, solid ones do not, and every carriageway ends at a solid line."""
    here = shipped(name)
    for section in here.root.findall("./road[@junction='-1']//laneSection"):
        for side in ("left", "right"):
            lanes = {abs(int(lane.get("id"))): lane for lane in section.findall(f"{side}/lane")}
            for number, lane in sorted(lanes.items()):
                if lane.get("type") not in DRIVABLE_TYPES:
                    continue
                beside = number + 1 in lanes and lanes[number + 1].get("type") in DRIVABLE_TYPES
                marks = [(m.get("type"), m.get("laneChange")) for m in lane.findall("roadMark")]
                allowed = {("broken", "both"), ("solid", "none")} if beside else {("solid", "none")}
                assert marks
                assert set(marks) <= allowed


@pytest.mark.slow
@every_crossing
def test_crosswalks_lead_from_sidewalk_to_sidewalk_behind_stop_lines(name):
    here = shipped(name)
    walks, lines = crosswalks(here.odr, here.table), stop_lines(here.odr, here.table)
    assert walks
    for walk in walks:
        road = here.odr.roads[walk.road]
        obj = next(o for o in road.objects if o.id == walk.object_id)
        row = here.table.road_index[walk.road]
        sides = here.table.lanes_at(row, obj.s)
        sidewalks = [r for r in sides if here.table.lane_type[r] == "sidewalk"]
        assert len(sidewalks) == 2
        for end in walk.axis:
            gaps = []
            for lane in sidewalks:
                inner = here.table.lane_points(np.array([lane]), np.array([obj.s]), at=0.0)
                outer = here.table.lane_points(np.array([lane]), np.array([obj.s]), at=1.0)
                a, b = np.array([inner.x[0], inner.y[0]]), np.array([outer.x[0], outer.y[0]])
                gaps.append(float((end - a) @ (b - a)) / float((b - a) @ (b - a)))
            assert sum(0.0 < gap < 0.5 for gap in gaps) == 1  # on one of the two, near the curb
        at_end = obj.s > road.length / 2
        distance = [
            (obj.s - line.s if at_end else line.s - obj.s)
            for line in lines
            if line.road == walk.road and (line.s > road.length / 2) == at_end
        ]
        ahead = [gap for gap in distance if gap > 0.0]  # a crosswalk amid the road has both
        assert ahead
        assert 1.5 < min(ahead) < 4.0


@every_crossing
def test_sidewalks_go_around_every_corner(name):
    here = shipped(name)
    followers = lane_successors(here.odr)
    preceded = {b for bs in followers.values() for b in bs}
    for lane in followers:
        if here.table.lane_type[here.table.lane_index[lane]] != "sidewalk":
            continue
        road = here.odr.roads[lane.road]
        if road.predecessor is not None and road.successor is not None:
            assert lane in preceded
            assert followers[lane]


@every_map
def test_lights_are_controlled_and_act_on_their_connecting_roads(name):
    here = shipped(name)
    odr = here.odr
    controlled = [c.get("signalId") for c in here.root.iterfind("controller/control")]
    lights = {
        signal.id: road
        for road in odr.roads.values()
        for signal in road.signals
        if signal_kind(signal) in ("traffic_light", "pedestrian_light")
    }
    assert sorted(controlled) == sorted(lights)
    own = {j: set(junction.controllers) for j, junction in odr.junctions.items()}
    known = {c.get("id") for c in here.root.findall("controller")} - AMID_A_ROAD.get(name, set())
    assert sorted(known) == sorted(number for numbers in own.values() for number in numbers)
    for junction in odr.junctions.values():
        for connection in junction.connections:
            road = odr.roads[connection.connecting_road]
            references = {reference.id for reference in road.signal_references}
            cars = any(
                lane.type in DRIVABLE_TYPES for s in road.sections for lane in s.lanes.values()
            )
            assert len(references) == (1 if junction.controllers and cars else 0)
            assert all(lights[r].id == connection.incoming_road for r in references)


@every_map
def test_traffic_keeps_to_its_side(name):
    """Oncoming lanes are on the other hand than the rule of the road says."""
    here = shipped(name)
    left_hand = name == "left_hand_crossing"
    assert here.odr.rule == ("LHT" if left_hand else "RHT")
    table, index = here.table, here.table.lane_index
    for key, row in index.items():
        other = index.get(key._replace(lane=-key.lane))
        if abs(key.lane) != 1 or other is None or table.lane_type[other] not in DRIVABLE_TYPES:
            continue
        if table.lane_type[row] not in DRIVABLE_TYPES:
            continue
        (place, hdg), (beside, _) = (
            here.ends(np.array([r]), leaving=leaving)
            for r, leaving in ((row, True), (other, False))
        )
        ahead, aside = np.array([np.cos(hdg[0]), np.sin(hdg[0])]), (beside - place)[0, :2]
        to_the_left = ahead[0] * aside[1] - ahead[1] * aside[0] > 0
        assert to_the_left != left_hand


def test_the_rural_road_uses_what_it_is_for():
    root = shipped("rural_hills").root
    for tag in ("spiral", "arc", "paramPoly3", "superelevation", "laneOffset"):
        assert len(root.findall(f".//{tag}")) >= 3
    assert len({e.get("a") for e in root.iter("elevation")}) > 10
    assert {m.get("type") for m in root.findall(".//center/lane/roadMark")} == {
        "broken",
        "solid",
        "broken solid",
        "solid broken",
    }
    assert sum(float(r.get("length")) for r in root.iter("road") if r.get("junction") == "-1") > 4e3


@pytest.mark.slow
def test_varied_towns_differ_and_each_is_the_same_every_time():
    pytest.importorskip("scenariogeneration", reason="needs the maintainers' tools")
    from tools.make_maps.__main__ import map_text

    one, again, other, wide = (map_text(f"varied_town_{seed}") for seed in ("05", "05", "06", "28"))
    assert one == again
    assert one != other
    assert len(parse(one).junctions) >= 9
    assert most_lanes(one) == 2
    assert most_lanes(wide) == 4


@pytest.mark.slow
def test_arterial_towns_have_wide_roads_lights_and_ramps_and_are_the_same_every_time():
    pytest.importorskip("scenariogeneration", reason="needs the maintainers' tools")
    from tools.make_maps.__main__ import map_text

    with_ramps, again, other = (map_text(f"arterial_town_{seed}") for seed in ("00", "00", "02"))
    assert with_ramps == again
    assert with_ramps != other
    assert most_lanes(with_ramps) >= 3
    root = ET.fromstring(with_ramps)
    assert {road.get("name") for road in root.iter("road")} >= {"On-ramp"}
    assert root.find(".//signal[@name='Light']") is not None
    limits = [float(speed.get("max")) for speed in root.iterfind("road/type/speed")]
    assert max(limits) >= 60.0


def most_lanes(text: str) -> int:
    """Lanes for cars each way of the widest road."""
    roads = ET.fromstring(text).iterfind("road[@junction='-1']")
    sides = [side for road in roads for side in road.iterfind(".//right")]
    return max(len(side.findall("lane[@type='driving']")) for side in sides)
