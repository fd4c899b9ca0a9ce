"""Lanelet2 maps as OpenDRIVE: borders, relations, regulations, and what is listed."""

from __future__ import annotations

import itertools
import math
import re
import xml.etree.ElementTree as ET
from collections import Counter
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from odscen.base.errors import InputError
from odscen.base.ids import RoadId
from odscen.maps.importers.lanelet2.importer import Lanelet2Importer
from odscen.maps.importers.lanelet2.lanelet_roads import read_speed
from odscen.maps.importers.registry import importer_for
from odscen.opendrive.lanes import RoadTable
from odscen.opendrive.objects import crosswalks, signal_kind, stop_lines
from odscen.opendrive.parse import parse
from odscen.opendrive.topology import lane_successors
from tests.maps.importers.lanelet_files import LaneletFile

if TYPE_CHECKING:
    from odscen.maps.importers.base import ImportedMap
    from odscen.opendrive.road_model import OpenDrive

SHARED = Path(__file__).parents[4] / "shared" / "places" / "lanelet2"
NEAR = 0.02
"""Metres by which borders may differ from the file: the aim of the requirement."""


def imported(content: bytes, **options: str) -> ImportedMap:
    return Lanelet2Importer().to_opendrive(content, {"origin": "", "traffic": "auto", **options})


def model_of(result: ImportedMap) -> OpenDrive:
    model = parse(result.xodr)
    assert model.notes == ()
    return model


def rows_of(result: ImportedMap) -> dict[str, list[tuple[str, str, str]]]:
    """Outcome, element and reason of each row, by the id in the file."""
    found: dict[str, list[tuple[str, str, str]]] = {}
    for row in result.entries:
        found.setdefault(row.source_id or "", []).append((row.outcome, row.element, row.reason))
    return found


def border_lines(model: OpenDrive) -> shapely.MultiLineString:
    """All lane borders of a map, sampled every 5 cm along the border, not along the road.

    Outside a bend a border is many times as long as its road, and coarse samples cut its corners.
    """
    table = RoadTable.of(model)
    lines = []
    for row in range(len(table.lane_keys)):
        start, end = table.lane_s0[row], table.lane_s1[row]
        for side in (0, 1):
            s = np.linspace(start, end, max(2, math.ceil((end - start) / 0.05)))
            line = border_points(table, row, side, s)
            steps = np.maximum(np.ceil(np.hypot(*np.diff(line, axis=0).T) / 0.05), 1.0)
            index = np.concatenate([[0.0], np.cumsum(steps)])
            s = np.interp(np.arange(index[-1] + 1.0), index, s)
            lines.append(shapely.LineString(border_points(table, row, side, s)))
    return shapely.MultiLineString(lines)


def border_points(table: RoadTable, lane: int, side: int, s: np.ndarray) -> np.ndarray:
    """Points of the inner (0) or outer (1) border of a lane at s."""
    t = table.lane_borders(np.full(s.size, lane), s)[side]
    roads = np.full(s.size, table.lane_road[lane])
    x, y, _ = table.points(roads, s, t, np.zeros(s.size))
    return np.stack([x, y], axis=1)


def distances(model: OpenDrive, lines: list[np.ndarray]) -> np.ndarray:
    """Distances of points every half metre of lines from the nearest lane border."""
    borders = list(border_lines(model).geoms)
    tree = shapely.STRtree(borders)
    points = []
    for line in lines:
        run = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(line, axis=0).T))])
        at = np.arange(0.0, run[-1], 0.5)
        points.append(np.stack([np.interp(at, run, column) for column in line.T], axis=1))
    _, apart = tree.query_nearest(
        shapely.points(np.concatenate(points)), return_distance=True, all_matches=False
    )
    return apart


def lane_reach(model: OpenDrive) -> dict[tuple[str, int], set[tuple[str, int]]]:
    """Lanes outside junctions that each of them leads to, through any connecting road."""
    after = lane_successors(model)
    reach: dict[tuple[str, int], set[tuple[str, int]]] = {}
    for key in after:
        if model.roads[key.road].junction is not None:
            continue
        todo, found = list(after[key]), set()
        while todo:
            other = todo.pop()
            if model.roads[other.road].junction is None:
                found.add((other.road, other.lane))
            else:
                todo.extend(after[other])
        reach[key.road, key.lane] = found
    return reach


def straight_file(**tags: str) -> LaneletFile:
    """One lanelet from the origin 50 m to the east, 3.5 m wide."""
    file = LaneletFile()
    file.lanelet(file.way([(0, 0), (50, 0)]), file.way([(0, -3.5), (50, -3.5)]), **tags)
    return file


def fork_file() -> tuple[LaneletFile, dict[str, str]]:
    """An approach from the west; straight on and a left turn, and what follows them."""
    file = LaneletFile()
    left = [(0, 0), (20, 0)], [(0, -3.5), (20, -3.5)]
    turn_left = [(20, 0), (24, 1.5), (26.5, 5), (27, 12)]
    turn_right = [(20, -3.5), (25, -2.5), (29, 2), (30.5, 12)]
    ids = {
        "approach": file.lanelet(file.way(left[0]), file.way(left[1])),
        "straight": file.lanelet(file.way([(20, 0), (40, 0)]), file.way([(20, -3.5), (40, -3.5)])),
        "turn": file.lanelet(file.way(turn_left), file.way(turn_right)),
        "ahead": file.lanelet(file.way([(40, 0), (60, 0)]), file.way([(40, -3.5), (60, -3.5)])),
        "north": file.lanelet(file.way([(27, 12), (27, 40)]), file.way([(30.5, 12), (30.5, 40)])),
    }
    return file, ids


# ----------------------------------------------------------------------------- recognising
def test_lanelets_are_told_from_plain_openstreetmap_by_content() -> None:
    content = bytes(straight_file())
    assert importer_for(content, "place.osm").name == "lanelet2"
    plain = b"<osm version='0.6'><node id='1' lat='48' lon='11'/></osm>"
    assert not Lanelet2Importer().detect(plain, "place.osm")


# ----------------------------------------------------------------------------- geometry
@pytest.mark.slow
@settings(max_examples=12, deadline=None)
@given(
    bends=st.lists(st.floats(-0.05, 0.05), min_size=2, max_size=6),
    lanes=st.integers(1, 4),
    width=st.floats(2.5, 4.5),
    slope=st.floats(-0.05, 0.05),
    spacing=st.floats(1.0, 12.0),
)
def test_lane_borders_are_within_two_centimetres_of_any_road(
    bends: list[float], lanes: int, width: float, slope: float, spacing: float
) -> None:
    # A centre line of arcs of 15 m, and borders on both sides of it.
    s = np.arange(0.0, 15.0 * len(bends) + 1e-9, min(spacing, 7.5 * len(bends)))
    fine = np.linspace(0.0, s[-1], 2000)
    hdg = np.cumsum(np.interp(fine, np.arange(len(bends)) * 15.0, bends)) * (fine[1] - fine[0])
    x, y = (np.cumsum(f(hdg)) * (fine[1] - fine[0]) for f in (np.cos, np.sin))
    at = np.searchsorted(fine, s).clip(0, fine.size - 1)
    file = LaneletFile()
    lines = []
    for k in range(lanes + 1):
        t = width * (lanes / 2 - k)
        points = np.stack(
            [x[at] - t * np.sin(hdg[at]), y[at] + t * np.cos(hdg[at]), 5.0 + slope * s], axis=1
        )
        lines.append(points)
    ways = [file.way([tuple(map(float, p)) for p in line]) for line in lines]
    for left, right in itertools.pairwise(ways):
        file.lanelet(left, right)
    model = model_of(imported(bytes(file)))
    (road,) = model.roads.values()
    assert len(road.sections[0].lanes) == lanes + 1
    assert distances(model, [line[:, :2] for line in lines]).max() < NEAR
    table = RoadTable.of(model)
    row = np.zeros(2, dtype=np.int64)
    z = table.points(row, np.array([0.0, road.length]), np.zeros(2), np.zeros(2))[2]
    # Ends are square to the road: before or behind those of the borders, by more on wide roads, as
    # borders of points 12 m apart may leave a bend at a quarter of a radian.
    behind = max(3.0, 0.25 * lanes * width)
    assert z == pytest.approx([5.0, 5.0 + slope * s[-1]], abs=0.05 * behind)


def test_skewed_ends_belong_to_the_road_behind_and_are_exact_there() -> None:
    file = LaneletFile()
    left = [(0, 0), (30, 0), (60, 0)]
    right = [(0, -4), (27, -4), (60, -4)]
    for k in (0, 1):
        file.lanelet(
            file.way(left[k : k + 2]),
            file.way(right[k : k + 2]),
            subtype=("road", "bus_lane")[k],
        )
    model = model_of(imported(bytes(file)))
    first, second = model.roads.values()
    assert first.length == pytest.approx(27.0)
    assert second.length == pytest.approx(33.0)
    assert first.successor is not None
    assert first.successor.element_id == second.id
    assert [lane.successors for lane in first.sections[0].lanes.values()] == [(), (-1,)]


def test_lanelets_that_follow_lane_by_lane_are_one_road_with_limits_along_it() -> None:
    file = LaneletFile()
    for start, speed in ((0, "30"), (40, "50 km/h"), (80, "20 mph")):
        end = start + 40
        file.lanelet(
            file.way([(start, 0), (end, 0)]),
            file.way([(start, -3), (end, -3)]),
            speed_limit=speed,
        )
    (road,) = model_of(imported(bytes(file))).roads.values()
    assert road.length == pytest.approx(120.0)
    speeds = road.sections[0].lanes[-1].speeds
    assert [limit.s for limit in speeds] == pytest.approx([0.0, 40.0, 80.0])
    assert [limit.max for limit in speeds] == pytest.approx([30 / 3.6, 50 / 3.6, 20 * 0.44704])


def test_both_directions_that_share_a_line_are_one_road() -> None:
    file = LaneletFile()
    middle = file.way([(0, 0), (40, 0)], type="line_thin", subtype="dashed")
    file.lanelet(middle, file.way([(0, -3), (40, -3)]))
    file.lanelet(middle, file.way([(0, 3.2), (40, 3.2)]))
    model = model_of(imported(bytes(file)))
    (road,) = model.roads.values()
    assert road.rule == "RHT"
    lanes = road.sections[0].lanes
    assert set(lanes) == {1, 0, -1}
    assert lanes[0].road_marks[0].type == "broken"
    widths = {lane: lanes[lane].widths[0].a for lane in (1, -1)}
    assert sorted(widths.values()) == pytest.approx([3.0, 3.2])


def test_traffic_keeps_left_where_oncoming_lanes_are_on_the_right() -> None:
    file = LaneletFile()
    middle = file.way([(0, 0), (40, 0)])
    east = file.lanelet(file.way([(0, 3), (40, 3)]), middle)
    file.lanelet(file.way([(40, -3), (0, -3)]), file.way([(40, 0), (0, 0)]))
    result = imported(bytes(file))
    model = model_of(result)
    (road,) = model.roads.values()
    assert road.rule == "LHT"
    table = RoadTable.of(model)
    row = next(k for k, key in enumerate(table.lane_keys) if key.lane == 1)
    # The lane left of the line in the middle runs with s, to the east.
    assert bool(table.lane_forward[row])
    assert rows_of(result)[east][0][1] == f"road {road.id} > lane 1"


def test_bounds_of_several_ways_in_any_order_and_direction_are_one_line() -> None:
    file = LaneletFile()
    parts = [[(0, 0), (10, 0)], [(25, 0), (10, 0)], [(25, 0), (50, 0)]]
    ways = [file.way(part) for part in parts]
    file.lanelet([ways[2], ways[0], ways[1]], file.way([(50, -3), (0, -3)]))
    (road,) = model_of(imported(bytes(file))).roads.values()
    assert road.length == pytest.approx(50.0)


# ----------------------------------------------------------------------------- junctions
def test_a_fork_is_a_junction_with_a_connecting_road_for_each_movement() -> None:
    file, ids = fork_file()
    result = imported(bytes(file))
    model = model_of(result)
    (junction,) = model.junctions.values()
    assert len(junction.connections) == 2
    place = {name: rows_of(result)[key][0][1] for name, key in ids.items()}
    road = {name: RoadId(path.split()[1]) for name, path in place.items()}
    reach = lane_reach(model)
    # Where the movements have parted they are roads again: those that follow them.
    assert reach[road["approach"], -1] == {(road["ahead"], -1), (road["north"], -1)}
    for name in ("straight", "turn"):
        assert model.roads[road[name]].junction == junction.id


def test_lanelets_that_cross_without_branching_are_cut_and_connect() -> None:
    file = LaneletFile()
    file.lanelet(file.way([(0, 1.5), (60, 1.5)]), file.way([(0, -1.5), (60, -1.5)]))
    file.lanelet(file.way([(28.5, -30), (28.5, 30)]), file.way([(31.5, -30), (31.5, 30)]))
    model = model_of(imported(bytes(file)))
    (junction,) = model.junctions.values()
    assert len(junction.connections) == 2
    assert sum(road.junction is None for road in model.roads.values()) == 4
    assert all(len(found) <= 1 for found in lane_reach(model).values())
    assert sum(map(len, lane_reach(model).values())) == 2


def test_lanelets_on_a_bridge_do_not_meet_those_below() -> None:
    file = LaneletFile()
    file.lanelet(file.way([(0, 1.5, 6), (60, 1.5, 6)]), file.way([(0, -1.5, 6), (60, -1.5, 6)]))
    file.lanelet(
        file.way([(28.5, -30, 0), (28.5, 30, 0)]), file.way([(31.5, -30, 0), (31.5, 30, 0)])
    )
    model = model_of(imported(bytes(file)))
    assert model.junctions == {}
    assert len(model.roads) == 2


@pytest.mark.slow
def test_a_long_ramp_connects_only_where_it_lies_on_the_road() -> None:
    file = LaneletFile()
    file.lanelet(file.way([(0, 0), (50, 0)]), file.way([(0, -4), (50, -4)]))
    file.lanelet(file.way([(50, 0), (400, 0)]), file.way([(50, -4), (400, -4)]))
    ramp = [(50, 0), (100, -6), (200, -26), (400, -80)]
    ramp_right = [(50, -4), (100, -10), (200, -30), (400, -84)]
    file.lanelet(file.way(ramp), file.way(ramp_right))
    model = model_of(imported(bytes(file)))
    connecting = [road for road in model.roads.values() if road.junction is not None]
    assert len(connecting) == 2
    assert max(road.length for road in connecting) < 110.0
    assert distances(model, [np.array(ramp, float), np.array(ramp_right, float)]).max() < NEAR


# ----------------------------------------------------------------------------- regulations
def test_a_traffic_light_controls_its_lanes_through_a_controller_of_the_junction() -> None:
    file, ids = fork_file()
    head = file.way([(41, -4, 5), (41, -5, 5)], type="traffic_light", subtype="red_yellow_green")
    line = file.way([(19, 0), (19, -3.5)], type="stop_line")
    light = file.regulatory("traffic_light", [("way", "refers", head), ("way", "ref_line", line)])
    file.refer(ids["approach"], light)
    result = imported(bytes(file))
    model = model_of(result)
    (junction,) = model.junctions.values()
    assert junction.controllers == (light,)
    assert model.controllers[light].controls == ((head, "0"),)
    road = model.roads[RoadId(rows_of(result)[ids["approach"]][0][1].split()[1])]
    (signal,) = road.signals
    assert signal_kind(signal) == "traffic_light"
    assert (signal.s, signal.orientation) == (pytest.approx(19.0), "+")
    assert signal.validities == ((-1, -1),)
    (stop,) = stop_lines(model, RoadTable.of(model))
    assert np.sort(stop.ends[:, 1]) == pytest.approx([-3.5, 0.0], abs=0.01)
    assert stop.ends[:, 0] == pytest.approx([19.0, 19.0], abs=0.01)


def test_right_of_way_is_a_priority_of_the_junction_and_its_signs() -> None:
    file = LaneletFile()
    main = file.lanelet(file.way([(0, 1.5), (60, 1.5)]), file.way([(0, -1.5), (60, -1.5)]))
    side = file.lanelet(file.way([(28.5, -30), (28.5, 30)]), file.way([(31.5, -30), (31.5, 30)]))
    sign = file.way([(32, -5), (32.5, -5)], type="traffic_sign", subtype="de205")
    rule = file.regulatory(
        "right_of_way",
        [("relation", "right_of_way", main), ("relation", "yield", side), ("way", "refers", sign)],
    )
    result = imported(bytes(file))
    model = model_of(result)
    (junction,) = model.junctions.values()
    (priority,) = junction.priorities
    roads = {priority.high: 0.0, priority.low: math.pi / 2}
    for road, heading in roads.items():
        assert model.roads[road].geometry[0].hdg == pytest.approx(heading, abs=1e-6)
    signals = [signal for road in model.roads.values() for signal in road.signals]
    assert [signal_kind(signal) for signal in signals] == ["yield"]
    assert rows_of(result)[rule][0][0] == "kept"


def test_a_speed_limit_holds_on_the_lanelets_that_name_it() -> None:
    file = straight_file()
    limit = file.regulatory("speed_limit", [], sign_type="de274-60")
    file.refer(next(r.get("id", "") for r in file.root.iter("relation")), limit)
    (road,) = model_of(imported(bytes(file))).roads.values()
    assert road.sections[0].lanes[-1].speeds[0].max == pytest.approx(60 / 3.6)


@pytest.mark.parametrize(
    ("text", "speed"),
    [("50", 50 / 3.6), ("30 mph", 13.4112), ("8.5 mps", 8.5), ("60kmh", 60 / 3.6), ("walk", None)],
)
def test_speeds_are_read_with_their_units(text: str, speed: float | None) -> None:
    assert read_speed(text) == (None if speed is None else pytest.approx(speed))


def test_crosswalks_walkways_and_special_lanes_have_their_kinds() -> None:
    file = LaneletFile()
    lines = [file.way([(0, y), (60, y)]) for y in (0, -3.5, -6.5, -8.5)]
    for k, subtype in enumerate(("road", "bus_lane", "bicycle_lane")):
        file.lanelet(lines[k], lines[k + 1], subtype=subtype)
    crossing = file.lanelet(
        file.way([(30, 0.5), (30, -9)]), file.way([(27, 0.5), (27, -9)]), subtype="crosswalk"
    )
    file.lanelet(
        file.way([(0, -10), (60, -10)]),
        file.way([(0, -12), (60, -12)]),
        subtype="walkway",
        one_way="no",
    )
    model = model_of(imported(bytes(file)))
    road, walk = model.roads.values()
    assert [lane.type for lane in road.sections[0].lanes.values()] == [
        "none",
        "driving",
        "bus",
        "biking",
    ]
    assert [lane.type for lane in walk.sections[0].lanes.values()] == ["none", "sidewalk"]
    (crosswalk,) = crosswalks(model, RoadTable.of(model))
    assert crosswalk.object_id == crossing
    assert crosswalk.width == pytest.approx(3.0, abs=0.01)
    assert shapely.Polygon(crosswalk.polygon).area == pytest.approx(3.0 * 9.5, abs=0.05)


def test_what_opendrive_cannot_say_is_listed_with_its_id() -> None:
    file = straight_file()
    area = file.regulatory("detection_area", [])
    bound = file.way([(0, 9), (50, 9)])
    broken = file.lanelet(bound, "999999")
    tracked = file.lanelet(bound, file.way([(0, 6), (50, 6)]), subtype="rail")
    rows = rows_of(imported(bytes(file)))
    assert rows[area] == [
        (
            "lost",
            f"regulatory element {area}",
            "a regulatory element of the subtype 'detection_area': OpenDRIVE has none",
        )
    ]
    assert rows[broken][0][0] == "lost"
    assert "line 999999 is not in the file" in rows[broken][0][2]
    assert rows[tracked][0][0] == "lost"


# ----------------------------------------------------------------------------- coordinates
def test_latitudes_are_utm_less_the_origin_that_was_chosen() -> None:
    file = straight_file()
    for node, (lat, lon) in zip(
        file.root.iter("node"),
        [(49.0, 8.4), (49.0, 8.401), (48.99997, 8.4), (48.99997, 8.401)],
        strict=True,
    ):
        for tag in list(node):
            node.remove(tag)
        node.set("lat", str(lat))
        node.set("lon", str(lon))
    model = model_of(imported(bytes(file), origin="49,8.4"))
    (road,) = model.roads.values()
    assert (road.geometry[0].x, road.geometry[0].y) == pytest.approx((0.0, 0.0), abs=1e-3)
    assert road.length == pytest.approx(73.14, abs=0.05)
    assert model.header.crs is not None
    with pytest.raises(InputError, match="origin 'here' is not LATITUDE,LONGITUDE"):
        imported(bytes(file), origin="here")


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"<osm><relation id='1'><tag k='type' v='lanelet'/></relation></osm>", "no node"),
        (b"<osm><node id='1' lat='x' lon='2'/></osm>", "node 1: lat='x' is no number"),
        (b"<osm><node id='1' lat='1' lon='2'>", "not well-formed XML"),
        (b"<osm><node id='1' lat='1' lon='2'/></osm>", "no lanelet"),
        (b"<osm><node id='1' lat='nan' lon='2'/></osm>", "lat='nan' is no number"),
        (b"<osm><node id='1' lat='89' lon='2'/></osm>", "outside UTM"),
    ],
)
def test_damaged_files_are_refused_with_place_and_value(content: bytes, message: str) -> None:
    with pytest.raises(InputError, match=re.escape(message)):
        imported(content)


def test_the_same_file_gives_the_same_bytes() -> None:
    content = bytes(fork_file()[0])
    assert imported(content).xodr == imported(content).xodr


# ----------------------------------------------------------------------------- real files
@pytest.mark.slow
@pytest.mark.parametrize("name", sorted(path.stem for path in SHARED.glob("*.osm")) or ["none"])
def test_real_maps_keep_borders_and_list_every_relation(name: str) -> None:
    file = SHARED / f"{name}.osm"
    if not file.is_file():
        pytest.skip("no Lanelet2 maps in ../shared/places")
    content = file.read_bytes()
    result = imported(content)
    rows = rows_of(result)
    # An independent count: every relation of the file has a row of its own.
    kinds: Counter[str] = Counter()
    for relation in ET.fromstring(content).iter("relation"):
        tags = {tag.get("k"): tag.get("v") for tag in relation.iter("tag")}
        kinds[str(tags.get("type"))] += 1
        assert relation.get("id") in rows, tags
    assert kinds["lanelet"] > 0
    lost = [row for row in result.entries if row.outcome == "lost"]
    # One of the maps ends within a junction: what no path leads over there is listed as such.
    unused = [row for row in lost if row.element.startswith("lanelet")]
    assert len(unused) <= 1
    assert all("no path through it" in row.reason for row in unused)
    # Borders: of all lanelets that the reader gives for vehicles.
    from odscen.maps.importers.lanelet2.lanelet_file import DRIVEN, read_lanelet_file

    source = read_lanelet_file(content)
    lines = [
        source.line(bound.nodes)[:, :2]
        for name, lanelet in source.lanelets.items()
        if lanelet.subtype in DRIVEN and str(name) not in {row.source_id for row in unused}
        for bound in (lanelet.left, lanelet.right)
    ]
    apart = distances(parse(result.xodr), lines)
    assert np.quantile(apart, 0.99) < NEAR
