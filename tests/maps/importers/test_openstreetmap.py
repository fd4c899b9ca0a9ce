"""Maps from OpenStreetMap: what is drawn, what is reported, and that nothing leads nowhere."""

from __future__ import annotations

import bz2
import gzip
import math
from collections import Counter
from itertools import pairwise
from pathlib import Path
from typing import Any
from xml.etree import ElementTree as ET

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from odscen.base.errors import InputError, OdscenError
from odscen.convert.model.conversion_report import ReportEntry
from odscen.learning.offered_options import values_for
from odscen.maps.importers.openstreetmap import OpenStreetMapImporter
from odscen.maps.importers.osm.junctions import choose_exits, match_lanes
from odscen.maps.importers.osm.osm_file import Box, cut_out, is_osm, read_extract
from odscen.maps.importers.osm.street_line import (
    Pose,
    curve_between,
    curves_between,
    least_radius,
    smooth_line,
)
from odscen.maps.importers.osm.street_tags import (
    KMH,
    MPH,
    NO_LIMIT,
    StreetLane,
    country_at,
    mirror_tags,
    read_speed,
    read_street,
)
from odscen.maps.importers.registry import importer_for
from odscen.maps.store import Workspace
from odscen.opendrive.lanes import RoadTable
from odscen.opendrive.objects import object_outline
from odscen.opendrive.parse import parse
from odscen.opendrive.road_model import DRIVABLE_TYPES, OpenDrive

PLACES = Path(__file__).parents[4] / "shared" / "places" / "osm"
EXTRACTS = sorted(PLACES.glob("*.osm*"))
DEGREE = 111_195.0
"""Metres of a degree of latitude, about."""
LAT, LON = 48.0, 11.0
GERMANY, BRITAIN, AMERICA = country_at(48, 11), country_at(51.5, -0.1), country_at(37.8, -122.3)


def place_of(
    nodes: dict[int, tuple[float, float]],
    ways: dict[int, tuple[list[int], dict[str, str]]],
    *,
    node_tags: dict[int, dict[str, str]] | None = None,
    relations: list[tuple[dict[str, str], list[tuple[str, int, str]]]] | None = None,
    at: tuple[float, float] = (LAT, LON),
) -> bytes:
    """An .osm file of nodes in metres."""
    lat, lon = at
    narrow = DEGREE * math.cos(math.radians(lat))
    root = ET.Element("osm", version="0.6")

    def add_tags(parent: ET.Element, tags: dict[str, str]) -> None:
        for key, value in tags.items():
            ET.SubElement(parent, "tag", k=key, v=value)

    for number, (x, y) in nodes.items():
        item = ET.SubElement(
            root,
            "node",
            id=str(number),
            lat=f"{lat + y / DEGREE:.9f}",
            lon=f"{lon + x / narrow:.9f}",
        )
        add_tags(item, (node_tags or {}).get(number, {}))
    for number, (refs, tags) in ways.items():
        item = ET.SubElement(root, "way", id=str(number))
        for ref in refs:
            ET.SubElement(item, "nd", ref=str(ref))
        add_tags(item, tags)
    for number, (tags, members) in enumerate(relations or [], 900):
        item = ET.SubElement(root, "relation", id=str(number))
        for kind, ref, role in members:
            ET.SubElement(item, "member", type=kind, ref=str(ref), role=role)
        add_tags(item, tags)
    return ET.tostring(root)


CROSS = {1: (0.0, 0.0), 2: (0.0, 150.0), 3: (150.0, 0.0), 4: (0.0, -150.0), 5: (-150.0, 0.0)}
"""A middle, and places north, east, south and west of it."""


def crossroads(tags: dict[str, str], **more: Any) -> bytes:
    """Two roads that cross; ways 10 north, 11 east, 12 south, 13 west lead to the middle."""
    ways = {9 + k: ([k, 1], {"highway": "tertiary", **tags}) for k in (2, 3, 4, 5)}
    ways = {number - 1: way for number, way in ways.items()}
    return place_of(CROSS, ways, **more)


def imported(content: bytes, **options: Any) -> tuple[OpenDrive, list[ReportEntry]]:
    importer = OpenStreetMapImporter()
    result = importer.to_opendrive(content, values_for(OpenStreetMapImporter, options, name="osm"))
    return parse(result.xodr), list(result.entries)


def turns_of(odr: OpenDrive) -> Counter[tuple[str, str]]:
    """Connecting lanes for cars by the names of the roads they join."""
    names = {road.id: road.name for road in odr.roads.values()}
    found: Counter[tuple[str, str]] = Counter()
    for road in odr.roads.values():
        if road.junction and road.sections[0].lanes[-1].type == "driving":
            assert road.predecessor is not None
            assert road.successor is not None
            found[names[road.predecessor.element_id], names[road.successor.element_id]] += 1  # type: ignore[index]
    return found


def assert_leads_on(odr: OpenDrive) -> None:
    """Every connecting lane begins and ends on a lane of the road that it names, in place."""
    for road in odr.roads.values():
        if road.junction is None:
            continue
        for lane in road.sections[0].lanes.values():
            if lane.id == 0:
                continue
            for link, linked in (
                (road.predecessor, lane.predecessors),
                (road.successor, lane.successors),
            ):
                assert link is not None
                other = odr.roads[link.element_id]  # type: ignore[index]
                section = other.sections[-1 if link.contact_point == "end" else 0]
                assert linked
                assert set(linked) <= set(section.lanes)
        length = sum(geometry.length for geometry in road.geometry)
        assert length == pytest.approx(road.length, abs=1e-6)


# ----------------------------------------------------------------- files


def test_extracts_are_recognised_packed_or_not_and_lanelet2_is_not() -> None:
    content = crossroads({})
    for packed, name in (
        (content, "a.osm"),
        (gzip.compress(content), "a.osm.gz"),
        (bz2.compress(content), "a.osm.bz2"),
    ):
        assert is_osm(packed, name)
        assert importer_for(packed, name).name == "openstreetmap"
        assert len(read_extract(packed).nodes) == 5
    assert not is_osm(
        content.replace(b"highway", b"type").replace(b"tertiary", b"lanelet"), "a.osm"
    )
    assert not is_osm(gzip.compress(b"<net/>"), "a.net.xml.gz")


def test_pbf_holds_what_the_xml_holds(tmp_path: Path) -> None:
    osmium = pytest.importorskip("osmium")
    content = crossroads({}, relations=[({"type": "restriction"}, [("way", 10, "from")])])
    (tmp_path / "a.osm").write_bytes(content)
    with osmium.SimpleWriter(str(tmp_path / "a.osm.pbf")) as writer:
        for item in osmium.FileProcessor(str(tmp_path / "a.osm")):
            writer.add(item)
    packed = (tmp_path / "a.osm.pbf").read_bytes()
    assert importer_for(packed, "a.osm.pbf").name == "openstreetmap"
    first, second = read_extract(content), read_extract(packed)
    assert (first.ways, first.relations) == (second.ways, second.relations)
    for number, node in first.nodes.items():
        assert second.nodes[number].lat == pytest.approx(node.lat, abs=1e-7)
    with pytest.raises(InputError, match=r"\.osm\.pbf file is damaged"):
        read_extract(packed[:-30])


def test_several_packed_parts_are_read_as_one_and_a_cut_one_is_refused() -> None:
    content = crossroads({})
    half = len(content) // 2
    two = bz2.compress(content[:half]) + bz2.compress(content[half:])
    assert len(read_extract(two).ways) == 4
    for packed in (gzip.compress(content)[:-20], bz2.compress(content)[:-20]):
        with pytest.raises(InputError, match="cut off"):
            read_extract(packed)
    with pytest.raises(InputError, match="damaged"):
        read_extract(b"\x1f\x8b\x08\x00" + b"\xff" * 40)


def test_a_file_that_unpacks_to_too_much_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("odscen.maps.importers.osm.osm_file.MOST_UNPACKED", 1000)
    with pytest.raises(OdscenError, match="more than 1000 bytes"):
        read_extract(gzip.compress(crossroads({}) + b" " * 5000))


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"<osm><node id='x' lat='1' lon='1'/></osm>", "id is 'x', no whole number"),
        (b"<osm><node id='1' lat='91' lon='1'/></osm>", "node 1: lat is '91'"),
        (b"<osm><node id='1' lat='nan' lon='1'/></osm>", "node 1: lat is 'nan'"),
        (b"<osm></osm>", "there is no node"),
        (b"<osm><node id='1' lat='1' lon='1'/></osm>", "there is no road for vehicles"),
        (b"<osm><node id='1'", "not well-formed XML"),
    ],
)
def test_what_is_wrong_is_refused_with_element_and_value(content: bytes, message: str) -> None:
    with pytest.raises(InputError, match=message):
        imported(content)


def test_a_box_cuts_ways_on_its_border() -> None:
    extract = read_extract(crossroads({}))
    narrow = DEGREE * math.cos(math.radians(LAT))
    box = Box(LON - 50 / narrow, LAT - 40 / DEGREE, LON + 60 / narrow, LAT + 100 / DEGREE)
    cut = cut_out(extract, box)
    ends = {way.id: cut.nodes[way.nodes[0]] for way in cut.ways.values()}
    assert ends[10].lat == pytest.approx(box.north, abs=1e-9)
    assert ends[11].lon == pytest.approx(box.east, abs=1e-9)
    odr, _ = imported(crossroads({}), box=f"{box.west},{box.south},{box.east},{box.north}")
    assert odr.header.north is not None
    assert sum(road.length for road in odr.roads.values() if not road.junction) < 250
    for bad in ("1,2,3", "3,2,1,4", "a,b,c,d"):
        with pytest.raises(InputError, match="box is"):
            imported(crossroads({}), box=bad)


# ----------------------------------------------------------------- tags


@pytest.mark.parametrize(
    ("value", "speed"),
    [
        ("50", 50 * KMH),
        ("30 mph", 30 * MPH),
        ("30mph", 30 * MPH),
        ("none", NO_LIMIT),
        ("walk", 7 * KMH),
        ("DE:urban", 50 * KMH),
        ("DE:rural", 100 * KMH),
        ("DE:zone:30", 30 * KMH),
        ("DE:zone30", 30 * KMH),
        ("GB:nsl_restricted", 30 * MPH),
        ("signals", None),
        ("5000", None),
    ],
)
def test_limits_are_read_in_their_units_and_by_zone(value: str, speed: float | None) -> None:
    got = read_speed(value, GERMANY)
    assert got is None if speed is None else got == pytest.approx(speed)


@pytest.mark.parametrize(
    ("tags", "ahead", "back"),
    [
        ({}, 1, 1),
        ({"oneway": "yes"}, 1, 0),
        ({"oneway": "yes", "lanes": "3"}, 3, 0),
        ({"lanes": "4"}, 2, 2),
        ({"lanes": "3", "lanes:forward": "1"}, 1, 2),
        ({"lanes": "3", "turn:lanes:forward": "left|through"}, 2, 1),
        ({"lanes": "5", "lanes:forward": "2"}, 2, 3),
        ({"lanes": "x"}, 1, 1),
        ({"junction": "roundabout"}, 1, 0),
    ],
)
def test_lanes_are_divided_between_the_directions(
    tags: dict[str, str], ahead: int, back: int
) -> None:
    section = read_street({"highway": "primary", **tags}, GERMANY, walks={}).section
    assert (len(section.right), len(section.left)) == (ahead, back)
    right, left = section.edges()
    # The line of the way is the middle of the carriageway.
    assert right == pytest.approx(-left)


def test_bicycle_lanes_between_lanes_for_turning_are_lanes_of_their_own() -> None:
    tags = {
        "highway": "tertiary",
        "oneway": "yes",
        "lanes": "2",
        "turn:lanes": "left|left|through|through",
        "bicycle:lanes": "no|designated|no|designated",
        "access:lanes": "yes|no|yes|no",
        "width:lanes": "3.3|2|4|2",
        "placement": "middle_of:3",
        "sidewalk": "right",
    }
    reading = read_street(tags, GERMANY, walks={})
    kinds = [lane.kind for lane in reading.section.right]
    assert kinds == ["driving", "biking", "driving", "biking", "sidewalk"]
    assert reading.section.offset == pytest.approx(3.3 + 2 + 4 / 2)
    assert reading.section.right[2].turns == {"through"}
    assert {"turn:lanes", "width:lanes", "placement"} <= set(reading.used)


def test_lists_that_contradict_each_other_are_listed() -> None:
    tags = {
        "highway": "primary",
        "lanes": "4",
        "oneway": "yes",
        "turn:lanes": "left|through|through|right",
        "width:lanes": "3|3",
    }
    reading = read_street(tags, GERMANY, walks={})
    assert len(reading.section.right) == 4
    assert "width:lanes" in reading.ignored


def test_a_bus_lane_is_for_buses_and_a_road_for_buses_only_too() -> None:
    tags = {"highway": "primary", "oneway": "yes", "lanes": "2", "bus:lanes": "|designated"}
    kinds = [lane.kind for lane in read_street(tags, GERMANY, walks={}).section.right]
    assert kinds == ["driving", "bus"]
    only = {"highway": "service", "access": "no", "bus": "yes"}
    assert {lane.kind for lane in read_street(only, GERMANY, walks={}).section.right} == {"bus"}


def test_a_sidewalk_is_drawn_once_by_tag_or_by_the_footway_beside() -> None:
    def sides(tags: dict[str, str], **walks: bool) -> tuple[int, int]:
        section = read_street({"highway": "residential", **tags}, GERMANY, walks=walks).section
        return tuple(  # type: ignore[return-value]
            sum(lane.kind == "sidewalk" for lane in side) for side in (section.left, section.right)
        )

    assert sides({"sidewalk": "both"}, left=True, right=True) == (1, 1)
    assert sides({"sidewalk": "separate"}, left=True) == (1, 0)
    assert sides({"sidewalk": "no"}, left=True, right=True) == (0, 0)
    assert sides({}, right=True) == (0, 1)
    assert sides({"sidewalk:left": "yes", "sidewalk:right": "no"}) == (1, 0)


def test_where_traffic_keeps_left_tags_are_mirrored() -> None:
    tags = {
        "turn:lanes:forward": "left|through;slight_right",
        "sidewalk": "left",
        "name": "Left Street",
        "cycleway:left": "lane",
        "change:lanes": "not_left|yes",
    }
    mirrored = mirror_tags(tags)
    assert mirrored["turn:lanes:forward"] == "through;slight_left|right"
    assert mirrored["sidewalk"] == "right"
    assert mirrored["name"] == "Left Street"
    assert mirrored["cycleway:right"] == "lane"
    assert mirrored["change:lanes"] == "yes|not_right"
    assert mirror_tags(mirrored) == tags


def test_countries_are_known_by_place() -> None:
    assert (GERMANY.code, BRITAIN.code, AMERICA.code) == ("DE", "GB", "US")
    left = [(51.5, -0.1), (53.3, -6.3), (35.7, 139.7), (-33.9, 151.2), (28.6, 77.2), (-26.2, 28.0)]
    right = [(48.9, 2.35), (40.4, -3.7), (52.5, 13.4), (39.9, 116.4), (37.6, 127.0), (-23.5, -46.6)]
    assert all(country_at(*place).keeps_left for place in left)
    assert not any(country_at(*place).keeps_left for place in right)


# ----------------------------------------------------------------- lines


@given(
    st.lists(
        st.tuples(st.floats(5.0, 60.0), st.floats(-math.pi * 0.8, math.pi * 0.8)),
        min_size=1,
        max_size=8,
    )
)
@settings(max_examples=60, deadline=None)
def test_lines_run_without_a_kink_between_their_ends(steps: list[tuple[float, float]]) -> None:
    x = y = heading = 0.0
    points = [(x, y)]
    for length, turn in steps:
        heading += turn
        x, y = x + length * math.cos(heading), y + length * math.sin(heading)
        points.append((x, y))
    line = smooth_line(points)
    for before, after in zip(line.arcs[:-1], line.arcs[1:], strict=True):
        end = before.pose(before.length)
        assert math.hypot(end.x - after.start.x, end.y - after.start.y) < 1e-6
        assert abs(math.remainder(end.hdg - after.start.hdg, 2 * math.pi)) < 1e-6
    first, last = line.pose(0.0), line.pose(line.length)
    closed = math.hypot(points[0][0] - points[-1][0], points[0][1] - points[-1][1]) < 1.0
    if not closed:
        assert (first.x, first.y) == pytest.approx(points[0], abs=1e-6)
        assert (last.x, last.y) == pytest.approx(points[-1], abs=0.01)


@given(st.floats(-60, 60), st.floats(-60, 60), st.floats(-2.8, 2.8))
@settings(max_examples=60, deadline=None)
def test_curves_begin_and_end_at_their_poses(x: float, y: float, turn: float) -> None:
    if math.hypot(x, y) < 3:
        return
    curve = curve_between(Pose(5.0, 6.0, 0.4), Pose(5.0 + x, 6.0 + y, 0.4 + turn))
    places = curve.places(400)
    assert places[0] == pytest.approx((5.0, 6.0))
    assert places[-1] == pytest.approx((5.0 + x, 6.0 + y), abs=1e-6)
    walked = float(np.hypot(*np.diff(places, axis=0).T).sum())
    assert curve.length == pytest.approx(walked, rel=1e-3)


# ----------------------------------------------------------------- turns


LEFT, STRAIGHT, RIGHT = math.pi / 2, 0.0, -math.pi / 2


def lane(*turns: str) -> StreetLane:
    return StreetLane("driving", 3.25, frozenset(turns))


@pytest.mark.parametrize(
    ("lanes", "turns", "counts", "expected"),
    [
        ([lane()], [LEFT, STRAIGHT, RIGHT], [1, 1, 1], [{0, 1, 2}]),
        ([lane(), lane()], [LEFT, STRAIGHT, RIGHT], [1, 2, 1], [{0, 1}, {1, 2}]),
        ([lane(), lane()], [LEFT, STRAIGHT, RIGHT], [1, 1, 1], [{0}, {1, 2}]),
        ([lane(), lane(), lane()], [LEFT, STRAIGHT, RIGHT], [1, 2, 1], [{0}, {1}, {1, 2}]),
        ([lane(), lane()], [LEFT, RIGHT], [1, 1], [{0}, {1}]),
        (
            [lane("left"), lane("through", "right")],
            [LEFT, STRAIGHT, RIGHT],
            [1, 1, 1],
            [{0}, {1, 2}],
        ),
        ([lane("left"), lane("none"), lane("none")], [LEFT, STRAIGHT], [1, 2], [{0}, {1}, {1}]),
        ([lane("slight_left"), lane("slight_right")], [0.3, -0.3], [1, 1], [{0}, {1}]),
        ([lane("left"), lane("right")], [LEFT, STRAIGHT, RIGHT], [1, 1, 1], [{0}, {2}]),
    ],
)
def test_lanes_turn_as_their_arrows_say_or_as_is_usual(
    lanes: list[StreetLane], turns: list[float], counts: list[int], expected: list[set[int]]
) -> None:
    assert choose_exits(lanes, turns, counts)[0] == expected


@given(
    st.lists(
        st.frozensets(
            st.sampled_from(["left", "through", "right", "none", "slight_left", "reverse"]),
            max_size=2,
        ),
        min_size=1,
        max_size=5,
    ),
    st.lists(st.floats(-2.6, 2.6), min_size=1, max_size=5),
)
@settings(max_examples=200, deadline=None)
def test_no_lane_leads_nowhere(tokens: list[frozenset[str]], turns: list[float]) -> None:
    lanes = [StreetLane("driving", 3.0, said) for said in tokens]
    exits, _ = choose_exits(lanes, sorted(turns, reverse=True), [1] * len(turns))
    assert all(exits)


def test_left_turns_keep_left_and_lanes_too_many_merge() -> None:
    assert match_lanes([0, 1], [0, 1, 2], LEFT, from_left=True) == [(0, 0), (1, 1)]
    assert match_lanes([1, 2], [0, 1, 2], RIGHT, from_left=False) == [(1, 1), (2, 2)]
    assert match_lanes([0, 1, 2], [0, 1], STRAIGHT, from_left=False) == [(0, 0), (1, 0), (2, 1)]


# ----------------------------------------------------------------- junctions


def named_crossroads(tags: dict[int, dict[str, str]] | None = None, **more: Any) -> bytes:
    names = {10: "north", 11: "east", 12: "south", 13: "west"}
    ways = {
        number: (
            [number - 8, 1],
            {"highway": "tertiary", "name": name, **(tags or {}).get(number, {})},
        )
        for number, name in names.items()
    }
    return place_of(CROSS, ways, **more)


def test_crossroads_have_twelve_turns_and_right_of_way_as_the_law_has_it() -> None:
    odr, entries = imported(named_crossroads())
    assert len(odr.junctions) == 1
    turns = turns_of(odr)
    assert len(turns) == 12
    assert not any(a == b for a, b in turns)
    assert_leads_on(odr)
    junction = next(iter(odr.junctions.values()))
    assert junction.priorities == ()
    # Corners have room for the curve of a bus: its inner radius is 6 m and more.
    ends = [road.length for road in odr.roads.values() if not road.junction]
    assert all(130.0 < length < 145.0 for length in ends)
    assert all(entry.confidence is not None for entry in entries)
    assert all(entry.source_id for entry in entries)


def test_a_priority_road_goes_first_whatever_its_class() -> None:
    tags = {"highway": "residential", "priority_road": "designated"}
    odr, entries = imported(named_crossroads(tags={10: tags, 12: tags}))
    names = {str(road.id): road.name for road in odr.roads.values()}
    (junction,) = odr.junctions.values()
    pairs = {(names[str(high)], names[str(low)]) for high, low in junction.priorities}
    assert pairs == {(a, b) for a in ("north", "south") for b in ("east", "west")}
    (said,) = [e for e in entries if "the priority road" in e.reason]
    assert said.confidence == 0.9


def test_a_lane_that_only_faces_a_one_way_street_turns_back() -> None:
    # Two ways as far as a node, and from there on one way towards it.
    ways = {
        10: ([1, 2], {"highway": "residential"}),
        11: ([3, 2], {"highway": "residential", "oneway": "yes"}),
    }
    odr, _ = imported(place_of({1: (0.0, 0.0), 2: (80.0, 0.0), 3: (160.0, 0.0)}, ways))
    assert_leads_on(odr)


@pytest.mark.parametrize(
    ("end", "radius"),
    [
        (Pose(60.0, 8.0, math.pi / 2), 7.5),  # ends soon behind where its tangents meet
        (Pose(8.0, 60.0, math.pi / 2), 7.5),
        (Pose(15.6, 12.6, 0.0), 7.5),  # two arcs of 8 m, where one cubic has 5.1
    ],
)
def test_turns_have_the_radius_that_there_is_room_for(end: Pose, radius: float) -> None:
    parts = curves_between(Pose(0.0, 0.0, 0.0), end)
    assert least_radius(parts) > radius
    assert parts[-1].places()[-1] == pytest.approx([end.x, end.y], abs=1e-9)
    for one, after in pairwise(parts):
        assert one.places()[-1] == pytest.approx(after.places()[0], abs=1e-9)


def test_restrictions_forbid_and_prescribe_turns_over_nodes() -> None:
    no_left = (
        {"type": "restriction", "restriction": "no_left_turn"},
        [("way", 12, "from"), ("node", 1, "via"), ("way", 13, "to")],
    )
    only = (
        {"type": "restriction", "restriction": "only_straight_on"},
        [("way", 13, "from"), ("node", 1, "via"), ("way", 11, "to")],
    )
    odr, entries = imported(named_crossroads(relations=[no_left, only]))
    turns = turns_of(odr)
    assert ("south", "west") not in turns
    assert [b for a, b in turns if a == "west"] == ["east"]
    assert len(turns) == 12 - 1 - 2
    kept = {entry.source_id for entry in entries if entry.outcome == "kept"}
    assert {"relation 900", "relation 901"} <= kept


def test_a_restriction_over_a_way_forbids_the_turn_back_of_a_dual_carriageway() -> None:
    nodes = {
        1: (-150, 5),
        2: (0, 5),
        3: (150, 5),
        4: (-150, -5),
        5: (0, -5),
        6: (150, -5),
        7: (0, 150),
        8: (0, -150),
    }
    ways = {
        10: ([3, 2], {"highway": "primary", "oneway": "yes", "name": "east in"}),
        11: ([2, 1], {"highway": "primary", "oneway": "yes", "name": "west out"}),
        12: ([4, 5], {"highway": "primary", "oneway": "yes", "name": "west in"}),
        13: ([5, 6], {"highway": "primary", "oneway": "yes", "name": "east out"}),
        14: ([7, 2], {"highway": "tertiary", "name": "north"}),
        15: ([2, 5], {"highway": "tertiary", "name": "middle"}),
        16: ([5, 8], {"highway": "tertiary", "name": "south"}),
    }
    back = (
        {"type": "restriction", "restriction": "no_left_turn"},
        [("way", 12, "from"), ("way", 15, "via"), ("way", 14, "to")],
    )
    odr, _ = imported(place_of(nodes, ways))
    assert len(odr.junctions) == 1
    turns = turns_of(odr)
    assert turns["west in", "north"] == 1
    assert ("west in", "west out") not in turns
    assert "middle" not in {road.name for road in odr.roads.values()}
    assert_leads_on(odr)
    assert ("west in", "north") not in turns_of(
        imported(place_of(nodes, ways, relations=[back]))[0]
    )


def test_roads_that_merge_have_lanes_of_their_own_where_there_are_enough() -> None:
    nodes = {1: (-200, 0), 2: (0, 0), 3: (200, 0), 4: (-200, -40)}
    ways = {
        10: ([1, 2], {"highway": "motorway", "lanes": "2", "name": "main"}),
        11: ([4, 2], {"highway": "motorway_link", "lanes": "1", "name": "ramp"}),
        12: ([2, 3], {"highway": "motorway", "lanes": "3", "name": "on"}),
    }
    odr, _ = imported(place_of(nodes, ways))
    names = {road.id: road.name for road in odr.roads.values()}
    targets = {
        (names[road.predecessor.element_id], lane.predecessors[0]): lane.successors[0]  # type: ignore[index, union-attr]
        for road in odr.roads.values()
        if road.junction
        for lane in road.sections[0].lanes.values()
        if lane.id
    }
    assert targets == {("main", -1): -1, ("main", -2): -2, ("ramp", -1): -3}


def test_a_turn_bay_opens_before_the_junction_and_leads_left_only() -> None:
    nodes = {**CROSS, 6: (0.0, -40.0)}
    ways = {
        10: ([2, 1], {"highway": "secondary", "name": "north"}),
        11: ([3, 1], {"highway": "secondary", "name": "east"}),
        12: ([4, 6], {"highway": "secondary", "name": "south"}),
        14: (
            [6, 1],
            {
                "highway": "secondary",
                "name": "south",
                "lanes": "3",
                "lanes:forward": "2",
                "turn:lanes:forward": "left|through;right",
            },
        ),
        13: ([5, 1], {"highway": "secondary", "name": "west"}),
    }
    odr, _ = imported(place_of(nodes, ways))
    south = next(road for road in odr.roads.values() if road.name == "south")
    assert len(south.sections) == 2
    cars = [
        sum(lane.type == "driving" and lane.id < 0 for lane in s.lanes.values())
        for s in south.sections
    ]
    assert cars == [1, 2]
    # The bay is the inner lane, opens from nothing, and the lane for all continues outside.
    bay, through = south.sections[1].lanes[-1], south.sections[1].lanes[-2]
    assert bay.predecessors == ()
    assert through.predecessors == (-1,)
    assert bay.widths[0].a == 0.0
    assert turns_of(odr)["south", "west"] == 1
    assert turns_of(odr)["south", "north"] == 1
    assert_leads_on(odr)


def test_signals_of_a_junction_are_in_its_controllers_and_signs_face_their_traffic() -> None:
    odr, _ = imported(named_crossroads(node_tags={1: {"highway": "traffic_signals"}}))
    junction = next(iter(odr.junctions.values()))
    named = [s for c in junction.controllers for s, _ in odr.controllers[c].controls]
    lights = [s.id for road in odr.roads.values() for s in road.signals]
    assert sorted(named) == sorted(lights)
    assert len(lights) == 4
    assert len(junction.controllers) == 2

    nodes = {**CROSS, 6: (0.0, -20.0)}
    ways = {
        10: ([2, 1], {"highway": "primary"}),
        11: ([3, 1], {"highway": "primary"}),
        12: ([1, 6, 4], {"highway": "primary"}),
        13: ([5, 1], {"highway": "primary"}),
    }
    odr, _ = imported(
        place_of(nodes, ways, node_tags={6: {"highway": "stop", "direction": "backward"}})
    )
    signs = [s for road in odr.roads.values() for s in road.signals]
    assert len(signs) == 1
    stop = signs[0]
    assert stop.type == "206"
    # Who comes from the south drives against the way, which begins in the middle.
    assert stop.orientation == "-"
    assert stop.validities[0].from_lane == 1
    assert stop.s < 20.0


def test_a_roundabout_is_a_ring_of_roads_that_goes_first() -> None:
    ring = {
        10 + k: (15 * math.cos(k * math.pi / 8), 15 * math.sin(k * math.pi / 8)) for k in range(16)
    }
    nodes = {**ring, 2: (150, 0), 3: (0, 150), 4: (-150, 0), 5: (0, -150)}
    ways = {
        1: ([*range(10, 26), 10], {"highway": "tertiary", "junction": "roundabout"}),
        2: ([2, 10], {"highway": "tertiary", "name": "east"}),
        3: ([3, 14], {"highway": "tertiary", "name": "north"}),
        4: ([4, 18], {"highway": "tertiary", "name": "west"}),
        5: ([5, 22], {"highway": "tertiary", "name": "south"}),
    }
    odr, _ = imported(place_of(nodes, ways))
    assert len(odr.junctions) == 4
    for junction in odr.junctions.values():
        assert len(junction.priorities) == 1
    assert_leads_on(odr)
    # Traffic keeps right, so it runs counter-clockwise.
    ring_roads = [r for r in odr.roads.values() if not r.junction and not r.name]
    assert len(ring_roads) == 4
    assert all(
        len([x for x in r.sections[0].lanes.values() if x.type == "driving"]) == 1
        for r in ring_roads
    )
    assert sum(r.length for r in ring_roads) > 20.0


def test_a_dead_end_turns_round_and_the_edge_of_the_extract_does_not() -> None:
    nodes = {1: (0, 0), 2: (400, 0), 3: (200, 0), 4: (200, 120), 5: (0, 250), 6: (400, 250)}
    ways = {
        10: ([1, 3], {"highway": "residential", "name": "a"}),
        11: ([3, 2], {"highway": "residential", "name": "b"}),
        12: ([3, 4], {"highway": "residential", "name": "end"}),
        13: ([5, 6], {"highway": "residential"}),
    }
    odr, _ = imported(place_of(nodes, ways))
    assert turns_of(odr)["end", "end"] == 1
    assert sum(a == b for a, b in turns_of(odr)) == 1


def test_traffic_keeps_left_in_britain_and_every_lane_is_mirrored() -> None:
    right, _ = imported(named_crossroads({12: {"lanes": "3", "lanes:forward": "2"}}))
    left, _ = imported(
        named_crossroads({12: {"lanes": "3", "lanes:forward": "2"}}, at=(51.5, -0.1))
    )
    assert left.rule == "LHT"
    assert right.rule == "RHT"
    assert len(left.roads) == len(right.roads)
    south = next(road for road in left.roads.values() if road.name == "south")
    # The way leads north: two lanes left of the line for it.
    assert sum(x.id > 0 and x.type == "driving" for x in south.sections[0].lanes.values()) == 2
    assert_leads_on(left)
    forced, _ = imported(named_crossroads(at=(51.5, -0.1)), driving_side="right")
    assert forced.rule == "RHT"


def test_crossings_come_from_nodes_and_footways_and_stay_out_of_the_junction() -> None:
    nodes = {**CROSS, 6: (0.0, 9.0), 7: (60.0, -8.0), 8: (60.0, 8.0)}
    ways = {
        10: ([2, 6, 1], {"highway": "tertiary", "name": "north"}),
        11: ([3, 1], {"highway": "tertiary", "name": "east"}),
        12: ([4, 1], {"highway": "tertiary"}),
        13: ([5, 1], {"highway": "tertiary"}),
        20: ([7, 8], {"highway": "footway"}),
    }
    odr, entries = imported(place_of(nodes, ways, node_tags={6: {"highway": "crossing"}}))
    walks = {
        road.name: obj
        for road in odr.roads.values()
        for obj in road.objects
        if obj.type == "crosswalk"
    }
    assert set(walks) == {"north", "east"}
    north = next(road for road in odr.roads.values() if road.name == "north")
    # The road ends between the junction and the crossing, which is at 9 m: for the corner to have a
    # radius of 4.5 m, and the lane of 6, it moves by 0.8 m.
    assert 150.0 - walks["north"].s == pytest.approx(9.76, abs=0.1)
    assert north.length > walks["north"].s + 1.5
    assert 150.0 - walks["east"].s == pytest.approx(60.0, rel=0.01)
    sources = {entry.source_id: entry.outcome for entry in entries if "crossing" in entry.reason}
    assert sources["node 6"] == "kept"
    assert sources["way 20"] == "guessed"


def test_the_same_extract_gives_the_same_bytes() -> None:
    content = named_crossroads(node_tags={1: {"highway": "traffic_signals"}})
    options = values_for(OpenStreetMapImporter, {}, name="osm")
    first, second = (OpenStreetMapImporter().to_opendrive(content, options) for _ in range(2))
    assert first.xodr == second.xodr
    assert list(first.entries) == list(second.entries)


@pytest.mark.slow
def test_a_light_between_junctions_is_at_its_place_and_controls_traffic(tmp_path: Path) -> None:
    nodes = {1: (0, 0), 2: (200, 0), 3: (400, 0)}
    ways = {10: ([1, 2, 3], {"highway": "primary", "oneway": "yes"})}
    content = place_of(nodes, ways, node_tags={2: {"highway": "traffic_signals"}})
    file = tmp_path / "light.osm"
    file.write_bytes(content)
    entry = Workspace.open(tmp_path / "workspace").add_map(file)
    assert entry.read("net").count(b"<tlLogic") == 1
    figures = entry.info["report"]["figures"]
    assert figures.get("signals_lost", 0) == 0


# ----------------------------------------------------------------- extracts of others


def acting_elements(file: Path) -> set[str]:
    """Elements of an extract that act on traffic, found without anything of the importer."""
    content = file.read_bytes()
    root = ET.fromstring(bz2.decompress(content) if file.suffix == ".bz2" else content)
    found = set()
    for item in root:
        if item.get("action") == "delete":
            continue
        tags = {tag.get("k", ""): tag.get("v", "") for tag in item.iter("tag")}
        source = f"{item.tag} {item.get('id')}"
        if item.tag == "node" and tags.get("highway") in (
            "traffic_signals",
            "stop",
            "give_way",
            "crossing",
        ):
            found.add(source)
        if item.tag == "relation" and tags.get("type", "").startswith("restriction"):
            found.add(source)
        if item.tag == "way" and "highway" in tags:
            found |= {
                f"{source} {k}"
                for k in tags
                if k.startswith(("turn:lanes", "maxspeed"))
                and k not in ("maxspeed:type", "maxspeed:conditional")
            }
    return found


@pytest.mark.slow
@pytest.mark.skipif(not EXTRACTS, reason="the extracts of others are not there")
@pytest.mark.parametrize("file", EXTRACTS, ids=lambda file: file.name.split(".")[0])
def test_all_that_acts_on_traffic_in_extracts_is_acted_on_or_listed(file: Path) -> None:
    odr, entries = imported(file.read_bytes())
    assert_leads_on(odr)
    assert odr.notes == ()
    told = {entry.source_id for entry in entries}
    told |= {f"{entry.source_id} {entry.reason.partition('=')[0]}" for entry in entries}
    assert acting_elements(file) - told == set()
    drivable = [
        x
        for r in odr.roads.values()
        for s in r.sections
        for x in s.lanes.values()
        if x.type in DRIVABLE_TYPES
    ]
    assert drivable


# ------------------------------------------------------------------ what stands beside, and heights


def test_buildings_and_trees_stand_where_the_extract_has_them() -> None:
    """Corners within a centimetre of the extract's, also where traffic keeps left."""
    corners = [(20.0, 15.0), (50.0, 15.0), (50.0, 35.0), (30.0, 35.0), (30.0, 45.0), (20.0, 45.0)]
    nodes = CROSS | {20 + k: place for k, place in enumerate(corners)} | {40: (-20.0, -20.0)}
    nodes |= {60: (-10.0, -60.0), 61: (10.0, -60.0), 62: (10.0, -80.0), 63: (-10.0, -80.0)}
    ring = [*range(20, 26), 20]
    ways = {9 + k - 1: ([k, 1], {"highway": "tertiary"}) for k in (2, 3, 4, 5)}
    ways[30] = (ring, {"building": "yes", "building:levels": "4", "name": "Hall"})
    ways[31] = ([60, 61, 62, 63, 60], {"building": "yes"})
    content = place_of(nodes, ways, node_tags={40: {"natural": "tree", "height": "12 m"}})
    for side in ("right", "left"):
        odr, entries = imported(content, driving_side=side)
        table = RoadTable.of(odr)
        objects = {o.type: (r, o) for r, road in odr.roads.items() for o in road.objects}
        road, hall = objects["building"]
        assert hall.name == "Hall"
        assert hall.height == pytest.approx(12.8)
        (outline,) = object_outline(table, road, hall)
        # The extract's projection is at the middle of its streets, here the crossing.
        away = [np.hypot(*(outline[:, :2] - corner).T).min() for corner in corners]
        assert max(away) < 0.15
        assert len(outline) == len(corners)
        road, tree = objects["tree"]
        (crown,) = object_outline(table, road, tree)
        assert np.hypot(*(crown[:, :2].mean(axis=0) - (-20.0, -20.0))) < 0.1
        assert tree.height == 12.0
        # The one that the southern street runs through would stand on the road.
        lost = [e for e in entries if e.source_id == "way 31"]
        assert [e.outcome.value for e in lost] == ["lost"]


def test_a_bridge_is_above_the_street_that_it_crosses_and_its_ramps_are_no_steps() -> None:
    """6 m above it, 0 far from it, grades up to 8 %, and no step where roads meet."""
    nodes = {1: (-400.0, 0.0), 2: (-30.0, 0.0), 3: (30.0, 0.0), 4: (400.0, 0.0)}
    nodes |= {5: (0.0, -200.0), 6: (0.0, 200.0), 7: (-90.0, 0.0), 8: (-90.0, 120.0)}
    ways = {
        10: ([1, 7, 2], {"highway": "primary", "name": "high"}),
        11: ([2, 3], {"highway": "primary", "bridge": "yes", "layer": "1", "name": "high"}),
        12: ([3, 4], {"highway": "primary", "name": "high"}),
        13: ([5, 6], {"highway": "secondary", "name": "low"}),
        14: ([7, 8], {"highway": "residential", "name": "side"}),
    }
    odr, entries = imported(place_of(nodes, ways))
    table = RoadTable.of(odr)
    heights: dict[str, list[float]] = {"high": [], "low": [], "side": [], "": []}
    ends = {}
    for name, road in odr.roads.items():
        s = np.linspace(0.0, road.length, 200)
        line = table.reference(np.full(200, table.road_index[name]), s)
        heights[road.name] += line.z.tolist()
        # A turn is shorter than the way over the middle of the junction, so it is steeper.
        assert np.abs(np.diff(line.z) / np.diff(s)).max() < (0.12 if road.junction else 0.08)
        ends[name, "start"], ends[name, "end"] = line.z[0], line.z[-1]
    assert max(heights["high"]) == pytest.approx(6.0, abs=0.01)
    assert min(heights["high"]) == pytest.approx(0.0, abs=0.01)
    assert max(map(abs, heights["low"])) == 0.0
    assert 1.0 < max(heights["side"]) < 2.0
    for name, road in odr.roads.items():
        if road.junction:
            for link, own in ((road.predecessor, "start"), (road.successor, "end")):
                assert link is not None
                other = ends[link.element_id, link.contact_point]  # type: ignore[index]
                assert ends[name, own] == pytest.approx(other, abs=1e-6)
    (guess,) = [e for e in entries if e.source_id == "way 11" and "bridge" in e.reason]
    assert guess.reason == "bridge: 6 m above the ground, as it crosses OSM way 13"
    assert guess.outcome.value == "guessed"


def test_a_tunnel_is_below_the_street_above_it_and_a_bridge_over_water_stays_level() -> None:
    nodes = {1: (-300.0, 0.0), 2: (-80.0, 0.0), 3: (80.0, 0.0), 4: (300.0, 0.0)}
    nodes |= {5: (0.0, -200.0), 6: (0.0, -100.0), 7: (0.0, 200.0)}
    ways = {
        10: ([1, 2], {"highway": "primary", "name": "deep"}),
        11: ([2, 3], {"highway": "primary", "tunnel": "yes", "layer": "-2", "name": "deep"}),
        12: ([3, 4], {"highway": "primary", "name": "deep"}),
        13: ([5, 6], {"highway": "secondary", "name": "above", "bridge": "yes"}),
        14: ([6, 7], {"highway": "secondary", "name": "above"}),
    }
    odr, _ = imported(place_of(nodes, ways))
    table = RoadTable.of(odr)
    lowest = {"deep": 0.0, "above": 0.0}
    for name, road in odr.roads.items():
        if road.name:
            s = np.linspace(0.0, road.length, 200)
            line = table.reference(np.full(200, table.road_index[name]), s)
            lowest[road.name] = min(lowest[road.name], float(line.z.min()))
            assert line.z.max() < 0.01
    assert lowest == {"deep": pytest.approx(-6.0, abs=0.01), "above": 0.0}


def test_islands_lie_between_the_directions_and_bus_stops_at_their_place() -> None:
    square = {20: (20.0, 20.0), 21: (24.0, 20.0), 22: (24.0, 26.0), 23: (20.0, 26.0)}
    nodes = CROSS | square | {6: (0.0, 60.0), 7: (60.0, 0.0), 8: (-70.0, -7.0)}
    ways: dict[int, tuple[list[int], dict[str, str]]] = {
        10: ([2, 6, 1], {"highway": "tertiary", "name": "north"}),
        11: ([3, 7, 1], {"highway": "tertiary", "name": "east", "oneway": "yes"}),
        12: ([4, 1], {"highway": "tertiary"}),
        13: ([5, 1], {"highway": "tertiary", "name": "west"}),
        30: ([20, 21, 22, 23, 20], {"area:highway": "traffic_island"}),
    }
    island = {"highway": "crossing", "crossing:island": "yes"}
    stop = {"highway": "bus_stop", "name": "Town hall"}
    odr, entries = imported(place_of(nodes, ways, node_tags={6: island, 7: island, 8: stop}))
    table = RoadTable.of(odr)
    found = [(r, o) for r, road in odr.roads.items() for o in road.objects]
    islands = [(odr.roads[r].name, o) for r, o in found if o.type == "trafficIsland"]
    # One on each side of the crosswalk, on the line between the directions; cars pass beside.
    north = [o for name, o in islands if name == "north" and o.width == 1.2]
    walk = next(o for r, o in found if o.type == "crosswalk" and odr.roads[r].name == "north")
    assert sorted(round(o.s - walk.s, 3) for o in north) == [-2.5, 2.5]
    assert all(o.t == pytest.approx(0.0, abs=1e-9) for o in north)
    assert len(islands) == 3
    said = {(e.source_id, e.outcome.value) for e in entries if "island" in e.reason}
    assert said == {("node 6", "guessed"), ("node 7", "lost"), ("way 30", "guessed")}
    road, pole = next((r, o) for r, o in found if o.type == "pole")
    assert pole.name == "Bus stop Town hall"
    (outline,) = object_outline(table, road, pole)
    assert np.hypot(*(outline[:, :2].mean(axis=0) - (-70.0, -7.0))) < 0.3
    assert [e.outcome.value for e in entries if e.source_id == "node 8"] == ["guessed"]
