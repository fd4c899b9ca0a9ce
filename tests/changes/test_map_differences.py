"""Twenty small edits of a town, each told exactly; what is only written otherwise is not."""

from __future__ import annotations

import copy
from pathlib import Path
from typing import TYPE_CHECKING

import pytest
from lxml import etree

from odscen.changes.map_differences import map_differences
from odscen.opendrive.parse import parse

if TYPE_CHECKING:
    from collections.abc import Callable

    from odscen.changes.map_change import MapChange

    Edit = Callable[[etree._Element], None]

TOWN = (Path(__file__).parents[2] / "maps" / "town_5x5.xodr").read_bytes()
BEFORE = parse(TOWN)


def differences(edit: Edit) -> tuple[MapChange, ...]:
    root = etree.fromstring(TOWN)
    edit(root)
    return map_differences(BEFORE, parse(etree.tostring(root)))


def words(edit: Edit) -> list[str]:
    return [one.words for one in differences(edit)]


def road(root: etree._Element, road_id: str = "1") -> etree._Element:
    return next(one for one in root.iter("road") if one.get("id") == road_id)


def lane(root: etree._Element, lane_id: str, road_id: str = "1") -> etree._Element:
    return next(one for one in road(root, road_id).iter("lane") if one.get("id") == lane_id)


def first(root: etree._Element, path: str) -> etree._Element:
    found = root.find(path)
    assert found is not None, path
    return found


def drop(element: etree._Element) -> None:
    parent = element.getparent()
    assert parent is not None
    parent.remove(element)


def narrow_a_lane(root: etree._Element) -> None:
    first(lane(root, "1"), "width").set("a", "2.4")


def widen_half_a_lane(root: etree._Element) -> None:
    width = copy.deepcopy(first(lane(root, "-1"), "width"))
    width.set("sOffset", "40")
    width.set("a", "3.5")
    first(lane(root, "-1"), "width").addnext(width)


def remove_the_outer_lane(root: etree._Element) -> None:
    drop(lane(root, "-2"))


def add_a_lane(root: etree._Element) -> None:
    new = copy.deepcopy(lane(root, "-2"))
    new.set("id", "-3")
    new.set("type", "biking")
    lane(root, "-2").addnext(new)


def make_a_bus_lane(root: etree._Element) -> None:
    lane(root, "1").set("type", "bus")


def set_the_limit_of_a_road(root: etree._Element) -> None:
    for number in ("1", "-1"):
        for speed in lane(root, number).findall("speed"):
            drop(speed)
    speed = first(road(root), "type/speed")
    speed.set("max", "20")
    speed.set("unit", "km/h")


def set_the_limit_of_a_lane(root: etree._Element) -> None:
    speed = etree.SubElement(lane(root, "1"), "speed")
    speed.attrib.update({"sOffset": "30", "max": "20", "unit": "km/h"})


def ban_trucks(root: etree._Element) -> None:
    access = etree.SubElement(lane(root, "1"), "access")
    access.attrib.update({"sOffset": "0", "rule": "deny", "restriction": "trucks"})


def paint_a_solid_line(root: etree._Element) -> None:
    for mark in lane(root, "0").findall("roadMark"):
        mark.attrib.update({"type": "solid", "laneChange": "none"})


def rename_a_road(root: etree._Element) -> None:
    road(root).set("name", "Elm Street")


def raise_a_road(root: etree._Element) -> None:
    profile = etree.Element("elevationProfile")
    first(road(root), "planView").addnext(profile)
    elevation = etree.SubElement(profile, "elevation")
    elevation.attrib.update({"s": "0", "a": "0.3", "b": "0", "c": "0", "d": "0"})


def shift_a_road(root: etree._Element) -> None:
    geometry = first(road(root), "planView/geometry")
    geometry.set("y", str(float(geometry.get("y", "")) + 0.5))


def cut_a_link(root: etree._Element) -> None:
    drop(first(road(root), "link/successor"))


def forbid_a_turn(root: etree._Element) -> None:
    drop(first(root, "junction[@id='10001']/connection"))


def remove_a_connecting_road(root: etree._Element) -> None:
    connection = first(root, "junction[@id='10001']/connection")
    drop(road(root, connection.get("connectingRoad", "")))
    drop(connection)


def add_a_priority(root: etree._Element) -> None:
    junction = first(root, "junction[@id='10001']")
    for priority in junction.findall("priority")[1:]:
        drop(priority)


def remove_a_sign(root: etree._Element) -> None:
    drop(first(road(root), "signals/signal"))


def move_a_sign(root: etree._Element) -> None:
    signal = first(road(root), "signals/signal")
    signal.set("s", "9")


def make_it_a_stop_sign(root: etree._Element) -> None:
    first(road(root), "signals/signal").set("type", "206")


def add_a_sign(root: etree._Element) -> None:
    signals = first(road(root), "signals")
    new = copy.deepcopy(first(signals, "signal"))
    new.attrib.update({"id": "900", "s": "60", "type": "274", "value": "20", "unit": "km/h"})
    signals.append(new)


def remove_a_crosswalk(root: etree._Element) -> None:
    drop(first(road(root), "objects/object[@type='crosswalk']"))


def move_a_crosswalk(root: etree._Element) -> None:
    first(road(root), "objects/object[@type='crosswalk']").set("s", "6.5")


def take_a_signal_from_its_controller(root: etree._Element) -> None:
    drop(first(root, "controller/control"))


@pytest.mark.parametrize(
    ("edit", "said"),
    [
        (narrow_a_lane, ["width of lane 1 of road 1, s 0 to 77 m: 3.25 m -> 2.4 m"]),
        (widen_half_a_lane, ["width of lane -1 of road 1, s 40 to 77 m: 3.25 m -> 3.5 m"]),
        (remove_the_outer_lane, ["lane -2 of road 1, s 0 to 77 m: removed (sidewalk)"]),
        (add_a_lane, ["lane -3 of road 1, s 0 to 77 m: added (biking)"]),
        (make_a_bus_lane, ["lane type of lane 1 of road 1, s 0 to 77 m: driving -> bus"]),
        (set_the_limit_of_a_road, ["limit of road 1, s 0 to 77 m: 30 km/h -> 20 km/h"]),
        (set_the_limit_of_a_lane, ["limit of lane 1 of road 1, s 30 to 77 m: 30 km/h -> 20 km/h"]),
        (
            ban_trucks,
            ["permission of lane 1 of road 1, s 0 to 77 m: as the lane's type -> deny trucks"],
        ),
        (
            paint_a_solid_line,
            [
                "road mark of the centre line of road 1, s 25 to 52 m: "
                "broken white -> solid white, lane change none"
            ],
        ),
        (rename_a_road, ["name of road 1: East Street 2 -> Elm Street"]),
        (raise_a_road, ["elevation of road 1 at s 0 m: 0 m -> 0.3 m"]),
        (shift_a_road, ["line of road 1, s 0 to 77 m: moved (by up to 0.5 m)"]),
        (cut_a_link, ["successor of road 1: junction 10006 -> none"]),
        (
            forbid_a_turn,
            ["connection from lane 2 of road 1 to lane -2 of road 57 (junction 10001): removed"],
        ),
        (remove_a_connecting_road, ["road 57: removed (21.994 m of junction 10001)"]),
        (add_a_priority, ["priority of road 53 over road 1 at junction 10001: removed"]),
        (remove_a_sign, ["signal 1 (type 205) of road 1: removed"]),
        (move_a_sign, ["signal 1 (type 205) of road 1: s 5 m, t 3.85 m -> s 9 m, t 3.85 m"]),
        (make_it_a_stop_sign, ["type of signal 1 (type 205) of road 1: 205 -> 206"]),
        (add_a_sign, ["signal 900 (type 274) of road 1: added"]),
        (remove_a_crosswalk, ["crosswalk 1 of road 1: removed"]),
        (move_a_crosswalk, ["crosswalk 1 of road 1: s 2.5 m, t 0 m -> s 6.5 m, t 0 m"]),
        (
            take_a_signal_from_its_controller,
            ["signals of controller 1: 11, 12, 4, 8, 9 -> 11, 12, 8, 9"],
        ),
    ],
)
def test_a_small_edit_is_told_exactly_and_nothing_else(edit: Edit, said: list[str]) -> None:
    assert words(edit) == said


@pytest.mark.slow
def test_the_other_way_round_what_was_removed_is_added() -> None:
    root = etree.fromstring(TOWN)
    remove_a_crosswalk(root)
    remove_the_outer_lane(root)
    found = map_differences(parse(etree.tostring(root)), BEFORE)
    assert [(one.kind, one.what) for one in found] == [("added", "lane"), ("added", "crosswalk")]


@pytest.mark.slow
def test_a_place_is_that_of_the_map_that_has_it() -> None:
    (removed,) = differences(remove_a_crosswalk)
    assert removed.place is not None
    assert (removed.place.road, removed.place.s0, removed.place.t) == ("1", 2.5, 0.0)
    (half,) = differences(widen_half_a_lane)
    assert half.place is not None
    assert (half.place.lane, half.place.s0, half.place.s1) == (-1, 40.0, 77.0)


def cut_a_section_in_two(root: etree._Element) -> None:
    section = first(road(root), "lanes/laneSection")
    second = copy.deepcopy(section)
    second.set("s", "60")
    for one in section.iter("lane"):
        link(one, "successor")
    for one in second.iter("lane"):
        link(one, "predecessor")
        for mark in one.findall("roadMark")[:-1]:
            drop(mark)
        for mark in one.findall("roadMark"):
            mark.set("sOffset", "0")
    section.addnext(second)


def link(one: etree._Element, name: str) -> None:
    if one.get("id") == "0":
        return
    links = one.find("link")
    if links is None:
        links = etree.SubElement(one, "link")
    etree.SubElement(links, name).set("id", one.get("id", ""))


def write_a_width_in_two_records(root: etree._Element) -> None:
    width = first(lane(root, "1"), "width")
    second = copy.deepcopy(width)
    second.set("sOffset", "33")
    width.addnext(second)


def turn_the_order_of_roads(root: etree._Element) -> None:
    roads = list(root.iter("road"))
    for one in roads:
        drop(one)
    for one in reversed(roads):
        root.insert(1, one)


def write_the_limit_at_the_lanes(root: etree._Element) -> None:
    for number in ("1", "-1"):
        speed = etree.SubElement(lane(root, number), "speed")
        speed.attrib.update({"sOffset": "0", "max": "30", "unit": "km/h"})


@pytest.mark.parametrize(
    "edit",
    [
        cut_a_section_in_two,
        write_a_width_in_two_records,
        turn_the_order_of_roads,
        write_the_limit_at_the_lanes,
    ],
)
def test_what_is_only_written_otherwise_is_no_difference(edit: Edit) -> None:
    assert words(edit) == []


@pytest.mark.slow
def test_a_road_with_another_id_is_known_by_where_it_lies() -> None:
    def renumber(root: etree._Element) -> None:
        road(root).set("id", "4711")
        for one in root.iter():
            for name in ("incomingRoad", "connectingRoad", "elementId", "high", "low"):
                if one.get(name) == "1" and one.get("elementType", "road") == "road":
                    one.set(name, "4711")

    assert words(renumber) == ["id of road 1: 1 -> 4711"]


def test_a_lane_taken_from_the_middle_is_told_by_what_its_neighbours_are() -> None:
    def take(root: etree._Element) -> None:
        drop(lane(root, "-1"))
        lane(root, "-2").set("id", "-1")

    found = differences(take)
    assert found[0].words == "lane -1 of road 1, s 0 to 77 m: removed (driving)"
    # The sidewalk has the number now that the links of the junction give to the lane.
    assert {one.what for one in found[1:]} == {"connection"}
