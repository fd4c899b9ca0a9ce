"""Pictures of a signal program: the light of the guide on the shipped crossing."""

from __future__ import annotations

import itertools
from dataclasses import replace
from functools import cache
from typing import TYPE_CHECKING

import pytest
from lxml import etree

from odscen.drawing.map_shapes import map_drawing
from odscen.opendrive.lanes import RoadTable
from odscen.opendrive.parse import parse
from odscen.records.light_programs import stage_spans
from odscen.reports.signal_charts import phase_spans, plan_chart, plan_scale
from odscen.reports.signal_pictures import (
    JunctionPictures,
    PictureFrame,
    junction_ground,
)
from odscen.reports.signal_sheet import detector_rows, signal_sheet, split_rows
from odscen.sumo.realize.lights.light_realization import realized_lights
from tests.signal_case import MAP, crossing, program, scenario

if TYPE_CHECKING:
    from odscen.drawing.map_drawing import MapDrawing
    from odscen.records.light_programs import LightProgram

SVG = "{http://www.w3.org/2000/svg}"


@cache
def drawing() -> MapDrawing:
    odr = parse(MAP.read_bytes(), file=MAP.name)
    return map_drawing(odr, RoadTable.of(odr), name="signal_crossing")


@cache
def light(control: str = "actuated") -> LightProgram:
    (one,) = realized_lights(scenario(program(), control=control), crossing().sumo, until=86_400.0)
    return one.shown


def movements(picture: object, kind: str) -> int:
    """How many movements of vehicles a picture shows so."""
    root = etree.fromstring(str(picture))
    return [path.get("class") for path in root.iter("path")].count(f"movement {kind}")


def test_stages_have_the_seconds_groups_and_splits_of_the_program() -> None:
    day, evening = light().plans
    assert [(one.id, one.begin, one.seconds, one.split) for one in stage_spans(day)] == [
        ("1", 0.0, 20.0, 32.0), ("2", 32.0, 6.0, 12.0),
        ("3", 44.0, 12.0, 21.0), ("4", 65.0, 7.0, 19.0),
    ]  # fmt: skip
    assert sum(one.split for one in stage_spans(day)) == day.cycle == 84.0
    assert [one.seconds for one in stage_spans(evening)] == [14.0, 6.0, 10.0, 7.0]
    first, second, _, call = stage_spans(day)
    assert first.groups(light()) == ("V1", "V1L", "V3", "V3L", "P2", "P4")
    assert first.groups(light(), "g") == ("V1", "V1L", "V3", "V3L")
    assert second.groups(light(), "g") == ()
    assert call.on_call


def test_the_pictures_of_the_stages_show_who_has_green_and_who_gives_way() -> None:
    one, two, three, four = JunctionPictures(light()).stages(light().plans[0])
    state = one.stage.state
    walks = {link for group in light().groups if group.walk for link in group.links}
    drive = [letter for link, letter in enumerate(state) if link not in walks]
    assert movements(one.picture, "green") == drive.count("G") == 4
    assert movements(one.picture, "permissive") == drive.count("g") == 6
    assert movements(one.picture, "green walk") == 2
    assert (movements(two.picture, "green"), movements(two.picture, "permissive")) == (2, 0)
    assert movements(four.picture, "green walk") == 1
    assert movements(four.picture, "red") == 20
    assert (two.words, three.detail, four.detail) == ("stage 2: 6 s", "V2 V4 P3", "P1 on call")
    title = etree.fromstring(str(one.picture)).findtext("title")
    assert title == "stage 1: 20 s; green: V1 V1L V3 V3L P2 P4; gives way: V1 V1L V3 V3L"


def test_detectors_lie_where_the_scenario_puts_them() -> None:
    loops = [one for one in light().detectors if one.name == "D1"]
    waiting = [one for one in light().detectors if one.call]
    stop_line = light().groups[0].paths[0][0][0]
    assert [one.place[1][0] - stop_line for one in loops] == pytest.approx([30.0] * 3, abs=0.1)
    for one in loops:
        (x0, y0), (x1, y1) = one.place
        assert (x0 - x1, abs(y0 - y1)) == pytest.approx((2.0, 0.0), abs=0.1)
    assert len({one.place[0][1] for one in loops}) == 3
    crossing_ends = next(group.paths[0] for group in light().groups if group.id == "P1")
    assert {one.place[0] for one in waiting} == {crossing_ends[0], crossing_ends[-1]}
    assert detector_rows(light()) == [
        ("D1", "3", "30", "3", "prolongs stage 1"),
        ("C0", "1", "", "", "calls stage 4"),
        ("C1", "1", "", "", "calls stage 4"),
    ]


def test_the_junction_is_drawn_with_groups_and_detectors_by_name() -> None:
    site = etree.fromstring(str(JunctionPictures(light(), drawing()).site()))
    words = [text.text for text in site.iter("text")]
    assert sorted(words) == sorted([*(group.id for group in light().groups), "D1", "C0", "C1"])
    assert sum(one.get("class") == "loop" for one in site.iter("path")) == 3
    assert sum(one.get("class") == "loop call" for one in site.iter("circle")) == 2
    told = [title.text for title in site.iter("title")]
    assert told[0] == "Junction 10001: 10 signal groups, 5 detectors"
    assert "D1: prolongs stage 1" in told


def test_areas_for_buses_are_drawn_along_their_lanes_and_listed_by_stage() -> None:
    one = scenario(program(bus_priority=True), control="actuated")
    (realized,) = realized_lights(one, crossing().sumo, until=86_400.0)
    shown = realized.shown
    assert [row for row in detector_rows(shown) if row[0] == "buses"] == [
        ("buses", "2", "0 to 80", "", "priority in stage 1"),
        ("buses", "2", "0 to 80", "", "priority in stage 1, 2"),
        ("buses", "4", "0 to 80", "", "priority in stage 3"),
    ]
    site = etree.fromstring(str(JunctionPictures(shown, drawing()).site()))
    bands = [one for one in site.iter("path") if one.get("class") == "bus-area"]
    assert len(bands) == 8
    assert {band.findtext("title") for band in bands} == {
        "buses: priority in stage 1", "buses: priority in stage 1, 2",
        "buses: priority in stage 3",
    }  # fmt: skip
    assert "buses" not in [text.text for text in site.iter("text")]
    told = "area in which buses are seen"
    assert told in signal_sheet(shown)
    assert told not in signal_sheet(light())


def test_stages_and_what_lies_between_them_make_the_cycle() -> None:
    spans = phase_spans(light().plans[0])
    assert [(one.begin, one.end, one.kind, one.stage) for one in spans[:6]] == [
        (0.0, 20.0, "stage", "1"),
        (20.0, 27.0, "between", ""),
        (27.0, 30.0, "yellow", ""),
        (30.0, 32.0, "between", ""),
        (32.0, 38.0, "stage", "2"),
        (38.0, 41.0, "yellow", ""),
    ]
    assert all(a.end == b.begin for a, b in itertools.pairwise(spans))
    assert spans[-1] == (72.0, 84.0, "all-red", "")
    assert split_rows(light(), light().plans[0])[3] == ("4 (on call)", "7", "19", "23", "P1")


def test_a_time_bar_of_any_width_says_where_its_seconds_begin_and_end() -> None:
    plan = light().plans[0]
    for width in (320.0, 760.0):
        chart = etree.fromstring(str(plan_chart(light(), plan, width=width)))
        begin, end = plan_scale(light(), plan, width=width).shares
        stages = [one for one in chart.iter("rect") if one.get("class") == "span"]
        assert len(stages) == 4
        assert float(stages[0].get("x")) == pytest.approx(begin * width, abs=0.1)
        last = list(chart.iter("rect"))[-1]
        right = float(last.get("x")) + float(last.get("width"))
        assert right == pytest.approx(end * width, abs=0.2)


def test_a_junction_has_the_shape_that_the_map_has() -> None:
    frame = PictureFrame.around([(-40.0, -40.0), (40.0, 40.0)], side=200.0, margin=0.0)
    ground = etree.fromstring(str(junction_ground(drawing(), frame)))
    assert [path.get("class") for path in ground][:2] == ["walked", "paved"]
    assert [path.get("class") for path in ground].count("stop-line") == 4
    assert frame.bounds == (-40.0, -40.0, 40.0, 40.0)
    numbers = [float(word) for word in ground[1].get("d").split() if word[0] in "-0123456789"]
    assert -1.0 <= min(numbers) <= max(numbers) <= 201.0


def test_a_sheet_is_one_svg_file_with_all_plans_and_the_same_bytes_each_time() -> None:
    sheet = signal_sheet(light(), drawing=drawing(), title="Main & First")
    root = etree.fromstring(sheet.encode())
    assert root.tag == f"{SVG}svg"
    words = [text.text for text in root.iter(f"{SVG}text")]
    assert "Plan day: cycle 84 s, offset 12 s" in words
    assert "Plan evening: cycle 76 s, offset 0 s" in words
    assert "Main & First · actuated · program of the scenario" in words
    stages = [one for one in root.iter(f"{SVG}svg") if "stage-picture" in one.get("class", "")]
    assert len(stages) == 8
    ids = [one.get("id") for one in root.iter() if one.get("id")]
    assert {use.get("href") for use in root.iter(f"{SVG}use")} == {f"#{ids[0]}"}
    assert "http" not in sheet.replace("http://www.w3.org/2000/svg", "")
    assert sheet == signal_sheet(light(), drawing=drawing(), title="Main & First")


def test_names_of_users_are_escaped() -> None:
    named = replace(light(), junctions=("<b>&",))
    root = etree.fromstring(signal_sheet(named).encode())
    assert "Traffic light of junction <b>&" in [text.text for text in root.iter(f"{SVG}text")]
