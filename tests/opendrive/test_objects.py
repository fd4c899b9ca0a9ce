from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from odscen.opendrive.lanes import RoadTable
from odscen.opendrive.objects import (
    crosswalks,
    object_outline,
    signal_kind,
    stop_lines,
)
from odscen.opendrive.parse import parse
from odscen.opendrive.road_model import OpenDrive
from tests.opendrive.snippets import LINE, document, road


def model_with(objects: str, *, hdg: float = 0.0) -> tuple[OpenDrive, RoadTable]:
    plan = LINE.replace('hdg="0"', f'hdg="{hdg!r}"')
    odr = parse(document(road(plan=plan, inside=f"<objects>{objects}</objects>")))
    return odr, RoadTable.of(odr)


def box(u: float, v: float) -> str:
    corners = [(u, v), (-u, v), (-u, -v), (u, -v), (u, v)]
    return "".join(f'<cornerLocal u="{a}" v="{b}" z="0"/>' for a, b in corners)


@pytest.mark.slow
@given(st.floats(-3.2, 3.2), st.floats(-0.3, 0.3))
def test_a_crosswalk_is_crossed_across_its_road_whatever_the_headings(
    hdg: float, skew: float
) -> None:
    text = (
        f'<object id="7" type="crosswalk" s="40" t="0.5" hdg="{math.pi / 2 + skew!r}">'
        f"<outline>{box(4.0, 1.5)}</outline></object>"
    )
    (crosswalk,) = crosswalks(*model_with(text, hdg=hdg))
    assert crosswalk.polygon.shape == (4, 2)
    assert crosswalk.width == pytest.approx(3.0)
    along = crosswalk.axis[1] - crosswalk.axis[0]
    assert np.hypot(*along) == pytest.approx(8.0)
    assert math.remainder(math.atan2(along[1], along[0]) - hdg - math.pi / 2 - skew, math.pi) == (
        pytest.approx(0.0, abs=1e-9)
    )
    middle = (40 * math.cos(hdg) - 0.5 * math.sin(hdg), 40 * math.sin(hdg) + 0.5 * math.cos(hdg))
    assert crosswalk.axis.mean(axis=0) == pytest.approx(middle)


def test_a_wide_short_crosswalk_is_still_crossed_across_the_road() -> None:
    text = '<object id="7" type="crosswalk" s="40" t="0" length="5" width="4" hdg="0"/>'
    (crosswalk,) = crosswalks(*model_with(text))
    assert crosswalk.axis == pytest.approx(np.array([[40.0, -2.0], [40.0, 2.0]]))
    assert crosswalk.width == pytest.approx(5.0)


def test_corners_in_road_coordinates_follow_the_road() -> None:
    corners = "".join(
        f'<cornerRoad s="{s}" t="{t}" dz="0.1"/>' for s, t in ((10, -4), (13, -4), (13, 4), (10, 4))
    )
    outlines = f"<outlines><outline>{corners}</outline></outlines>"
    text = f'<object id="1" name="Zebra" type="none" s="0" t="0">{outlines}</object>'
    (crosswalk,) = crosswalks(*model_with(text))
    assert sorted(map(tuple, crosswalk.polygon.tolist())) == [(10, -4), (10, 4), (13, -4), (13, 4)]
    assert crosswalk.z == pytest.approx(0.1)


def test_a_crosswalk_drawn_as_a_line_has_a_usual_width() -> None:
    corners = '<cornerRoad id="0" s="79" t="-3"/><cornerRoad id="1" s="79" t="3"/>'
    outlines = f"<outlines><outline>{corners}</outline></outlines>"
    text = f'<object id="1" type="crosswalk" s="79" t="0">{outlines}</object>'
    (found,) = crosswalks(*model_with(text))
    assert found.width == pytest.approx(3.0)
    assert sorted(map(tuple, found.axis.round(9).tolist())) == [(79, -3), (79, 3)]


def test_a_crosswalk_without_a_size_is_left_out() -> None:
    assert crosswalks(*model_with('<object id="1" type="crosswalk" s="4" t="0"/>')) == ()


@pytest.mark.parametrize("name", ["StopLine", "stop_line", "Stop line", "stop-line"])
def test_a_stop_line_without_thickness_has_two_ends(name: str) -> None:
    text = (
        f'<object id="1" type="-1" name="{name}" s="95" t="-1.75" length="3.5" width="0" '
        f'hdg="{math.pi / 2!r}" orientation="+"/>'
    )
    (line,) = stop_lines(*model_with(text))
    assert sorted(map(tuple, line.ends.round(9).tolist())) == [(95, -3.5), (95, 0)]
    assert (line.s, line.orientation) == (95.0, "+")


def test_a_round_object_has_a_round_outline() -> None:
    odr, table = model_with('<object id="1" type="pole" s="5" t="4" radius="0.25"/>')
    (outline,) = object_outline(table, next(iter(odr.roads)), odr.roads["1"].objects[0])
    assert np.hypot(outline[:, 0] - 5, outline[:, 1] - 4) == pytest.approx(0.25)


@pytest.mark.parametrize(
    ("attributes", "kind"),
    [
        ('type="1000001" dynamic="yes"', "traffic_light"),
        ('type="1000011" dynamic="yes"', "traffic_light"),
        ('type="1000002" dynamic="yes"', "pedestrian_light"),
        ('type="206" subtype="-1"', "stop"),
        ('type="R1-1" country="us"', "stop"),
        ('type="205" subtype="-1"', "yield"),
        ('type="274" subtype="50"', "speed_limit"),
        ('type="c" subtype="31" country="se"', "speed_limit"),
        ('type="" name="274-50"', "speed_limit"),
        ('type="-1" name="Sign_Stop"', "stop"),
        ('type="" name="Signal_3Light_Post01"', "traffic_light"),
        ('type="traffic_light" dynamic="yes"', "traffic_light"),
        ('type="trafficLight" dynamic="no"', "traffic_light"),
        ('type="traffic_signals" dynamic="yes"', "traffic_light"),
        ('type="1.000.001" dynamic="yes"', "traffic_light"),
        ('type="pedestrian_light" dynamic="yes"', "pedestrian_light"),
        ('type="give_way"', "yield"),
        ('type="Yield Sign"', "yield"),
        ('type="stop"', "stop"),
        ('type="stopSign"', "stop"),
        ('type="bus_stop"', "other"),
        ('type="101" name="de_274-30"', "other"),
        ('type=""', "other"),
    ],
)
def test_signals_are_known_by_type_and_without_one_by_name(attributes: str, kind: str) -> None:
    inside = f'<signals><signal id="1" s="5" t="0" {attributes}/></signals>'
    (signal,) = parse(document(road(inside=inside))).roads["1"].signals
    assert signal_kind(signal) == kind


@pytest.mark.parametrize(("name", "count"), [("Town04", 27), ("Town07", 7)])
def test_crosswalks_of_the_towns_are_where_carla_sees_them(
    shared_maps: Path, name: str, count: int
) -> None:
    carla = pytest.importorskip("carla")
    text = (shared_maps / "carla-2020" / f"{name}.xodr").read_text()
    odr = parse(text)
    found = crosswalks(odr, RoadTable.of(odr))
    assert len(found) == count
    theirs = np.array([(p.x, -p.y) for p in carla.Map(name, text).get_crosswalks()])
    corners = np.concatenate([crosswalk.polygon for crosswalk in found])
    distance = np.hypot(*(corners[:, None, :] - theirs[None, :, :]).transpose(2, 0, 1)).min(axis=1)
    assert distance.max() < 0.001
    assert all(2.0 < crosswalk.width < 3.5 for crosswalk in found)
