"""Curves are driven with a lateral acceleration that drivers choose."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from odscen.convert.model.curve_speed import (
    HEAVY,
    HEAVY_CLASSES,
    comfortable_speed,
    sharpest_bend,
)
from odscen.opendrive.parse import parse
from tests.convert.maps import of_model
from tests.opendrive.snippets import document, lane, road, section


@given(st.floats(3.0, 3000.0))
def test_a_curve_is_driven_slower_the_sharper_it_is_and_slower_by_trucks(radius):
    speed = float(comfortable_speed(1.0 / radius))
    assert 1.7 < speed**2 / radius < 3.21 or speed == pytest.approx(2.0)
    assert float(comfortable_speed(-1.0 / radius)) == speed
    assert float(comfortable_speed(1.0 / (1.01 * radius))) >= speed
    heavy = float(comfortable_speed(1.0 / radius, share=HEAVY))
    assert heavy == pytest.approx(speed * math.sqrt(HEAVY), rel=0.12) or heavy == 2.0
    assert math.isinf(float(comfortable_speed(0.0)))


@given(st.floats(5.0, 100.0), st.floats(0.3, 3.0))
def test_the_bend_of_a_line_is_that_of_its_arc_however_it_is_drawn(radius, angle):
    # Chords of 1 cm of sagitta, as shapes of lanes have them; a kink of a degree is no curve.
    count = max(3, math.ceil(angle / (2.0 * math.acos(1.0 - 0.01 / radius))))
    turn = np.linspace(0.0, angle, count + 1)
    shape = np.column_stack((radius * np.sin(turn), radius * (1.0 - np.cos(turn))))
    if radius * angle > 12.0:
        assert sharpest_bend(shape) == pytest.approx(1.0 / radius, rel=0.2)
    straight = np.array([[0.0, 0.0], [50.0, 0.0], [100.0, 0.9]])
    assert sharpest_bend(straight) < 1.0 / 150.0


def _curved_road(radius: float, limit: str = "50") -> str:
    bend = radius * math.pi / 2.0
    plan = (
        f'<geometry s="0" x="0" y="0" hdg="0" length="100"><line/></geometry>'
        f'<geometry s="100" x="100" y="0" hdg="0" length="{bend}"><arc curvature="{1 / radius}"/>'
        f'</geometry><geometry s="{100 + bend}" x="{100 + radius}" y="{radius}" '
        f'hdg="{math.pi / 2}" length="100"><line/></geometry>'
    )
    return road(
        "1",
        length=200.0 + bend,
        plan=plan,
        lanes=section(lane(-1, width=3.5), lane(1, width=3.5)),
        inside=f'<type s="0" type="town"><speed max="{limit}" unit="km/h"/></type>',
    )


def _driven(made: Any) -> list[Any]:
    """Edges outside junctions that vehicles use."""
    found = [one for one in made.xml.iter("edge") if one.get("function") is None]
    return [edge for edge in found if edge[0].get("allow") != "pedestrian"]


def test_a_road_is_cut_where_its_curve_is_slower_and_the_limit_stays_elsewhere():
    made = of_model(parse(document(_curved_road(10.0))))
    lanes = {one.get("id"): one for one in made.xml.iter("lane")}
    edges = {one.get("id"): one for one in _driven(made)}
    assert sorted(edges) == [f"1.{n}.{side}" for n in range(3) for side in "bf"]
    for n in (0, 2):
        assert lanes[f"1.{n}.f_0"].get("speed") == "13.89"
        assert edges[f"1.{n}.f"].get("type") is None
    # Left turn: the lane that runs with s is the outer one, radius 11.75 m; the other 8.25 m.
    outer, inner = (float(lanes[f"1.1.{side}_0"].get("speed")) for side in "fb")
    assert outer == pytest.approx(math.sqrt(3.1 * 11.75), rel=0.03)
    assert inner == pytest.approx(math.sqrt(3.1 * 8.25), rel=0.03)
    assert 10.0 * math.pi / 2 < float(lanes["1.1.f_0"].get("length")) < 30.0
    # What trucks and buses drive there is a restriction of the edge's type.
    kind = next(k for k in made.xml.iter("type") if k.get("id") == edges["1.1.f"].get("type"))
    heavy = {one.get("vClass"): float(one.get("speed")) for one in kind.iter("restriction")}
    assert set(heavy) == set(HEAVY_CLASSES)
    assert heavy["truck"] == pytest.approx(outer * math.sqrt(HEAVY), rel=0.03)


@pytest.mark.parametrize(("radius", "limit"), [(10.0, "15"), (200.0, "50"), (2000.0, "130")])
def test_a_curve_that_the_limit_allows_changes_nothing(radius, limit):
    made = of_model(parse(document(_curved_road(radius, limit))))
    edges = _driven(made)
    assert [edge.get("id") for edge in edges] == ["1.0.f", "1.0.b"]
    assert {edge[0].get("speed") for edge in edges} == {f"{float(limit) / 3.6:.2f}"}
    assert not list(made.xml.iter("type"))
