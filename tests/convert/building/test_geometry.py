"""SUMO lanes lie where the lanes of the map lie, and positions mean what they should."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from odscen.convert.model.access import is_used
from odscen.opendrive.parse import parse
from tests.convert.maps import Converted, converted, each_map, of_model, shape
from tests.opendrive.snippets import document, road, section

ASIDE = 0.02
"""Metres between the centre of a lane of the map and the shape of its SUMO lane, at most."""

AWAY = 0.02
"""Metres between a place of a lane and where SUMO's position of it is, for 99 % of the places."""

FAR = 0.06
"""The same at most: lanes of real maps overlap where they should meet, positions cannot."""

BACK = 0.01
"""Metres by which a place may have moved after the way to SUMO and back."""


class Tried:
    """All used lanes of a map, every metre, taken to SUMO."""

    def __init__(self, made: Converted, *, inside: bool) -> None:
        types = frozenset(kind for kind in made.roads.lane_type if is_used(kind))
        self.made = made
        lane, s = made.nodes(types, inside=inside, spacing=1.0)
        places = made.places(lane, s)
        # A place beside the end of an interval is taken to that end, and says how far that is.
        on = (places.lane >= 0) & (places.deviation < 1e-6)
        self.share = float(on.mean()) if len(on) else 1.0
        self.lane, self.s = lane[on], s[on]
        self.sumo, self.pos = places.lane[on], places.pos[on]

    def measured(self) -> tuple[np.ndarray, np.ndarray]:
        """Metres between the map's lane centres and SUMO's shapes, and SUMO's positions."""
        found = self.made.roads.lane_points(self.lane, self.s)
        exact = np.column_stack((found.x, found.y, found.z))
        aside, away = np.zeros(len(exact)), np.zeros(len(exact))
        lanes = self.made.network.table.lane_list
        for row in np.unique(self.sumo):
            own = np.flatnonzero(self.sumo == row)
            line = shapely.LineString(self.made.shapes[lanes[row].id][:, :2])
            aside[own] = shapely.distance(line, shapely.points(exact[own, :2]))
            place = self.made.along(lanes[row].id, self.pos[own])
            away[own] = np.linalg.norm(place - exact[own], axis=1)
        return aside, away

    def returned(self) -> tuple[np.ndarray, np.ndarray]:
        """Whether each place came back to its lane, and how many metres of s it moved."""
        table = self.made.network.table
        back = table.xodr_places(self.sumo, self.pos)
        keys = self.made.roads.lane_keys
        same = [
            row >= 0 and table.lane_keys[row] == keys[lane]
            for row, lane in zip(back.lane, self.lane, strict=True)
        ]
        return np.array(same, dtype=bool), np.abs(back.s - self.s)


@pytest.mark.slow
@pytest.mark.parametrize("inside", [False, True], ids=["roads", "junctions"])
@each_map()
def test_places_of_the_table_lie_on_the_lanes_of_the_map(path: Path, inside: bool) -> None:
    tried = Tried(converted(path), inside=inside)
    assert tried.share > 0.97 or inside
    aside, away = tried.measured()
    assert aside.max(initial=0.0) < ASIDE
    assert (away < AWAY).sum() >= 0.99 * len(away)
    assert away.max(initial=0.0) < FAR


@pytest.mark.parametrize("inside", [False, True], ids=["roads", "junctions"])
@each_map()
def test_the_way_to_sumo_and_back_ends_where_it_began(path: Path, inside: bool) -> None:
    same, moved = Tried(converted(path), inside=inside).returned()
    assert same.all()
    assert moved.max(initial=0.0) < BACK


@each_map()
def test_lengths_in_the_file_are_those_of_the_shapes(path: Path) -> None:
    for edge in converted(path).xml.iter("edge"):
        if edge.get("function") == "walkingarea":
            continue
        drawn = [np.linalg.norm(np.diff(shape(one), axis=0), axis=1).sum() for one in edge]
        stated = {float(one.get("length")) for one in edge}
        assert len(stated) == 1, "SUMO's edges have one length"
        assert stated.pop() == pytest.approx(max(float(np.mean(drawn)), 0.1), abs=0.01)


@each_map()
def test_lanes_meet_where_they_are_connected(path: Path) -> None:
    made = converted(path)
    inner = made.edges("internal")
    beyond = {
        f"{link.get('from')}_{link.get('fromLane')}": link.get("via")
        for link in made.xml.iter("connection")
        if link.get("from") in inner and link.get("via")
    }
    for link in made.xml.iter("connection"):
        via = link.get("via")
        if via is None or via.rsplit("_", 1)[0] not in inner:
            continue
        before = made.shapes[f"{link.get('from')}_{link.get('fromLane')}"][-1]
        after = made.shapes[f"{link.get('to')}_{link.get('toLane')}"][0]
        if via in beyond:  # those who turn across wait between two internal lanes
            after = made.shapes[beyond[via]][0]
        shape = made.shapes[via]
        assert np.linalg.norm(shape[0] - before) < 0.1, via
        assert np.linalg.norm(shape[-1] - after) < 0.1, via


@st.composite
def streets(draw: st.DrawFn) -> str:
    """A road of one geometry with hills, bank, an offset of its lanes and widths that change."""
    length = draw(st.floats(5.0, 300.0))
    bends = st.floats(-0.04, 0.04)
    form = draw(
        st.one_of(
            st.just("<line/>"),
            st.builds('<arc curvature="{!r}"/>'.format, bends),
            st.builds('<spiral curvStart="{!r}" curvEnd="{!r}"/>'.format, bends, bends),
        )
    )
    place = {name: draw(st.floats(-1000.0, 1000.0)) for name in "xy"}
    plan = (
        f'<geometry s="0" x="{place["x"]!r}" y="{place["y"]!r}" hdg="{draw(st.floats(-4, 4))!r}"'
        f' length="{length!r}">{form}</geometry>'
    )
    climb = draw(st.floats(-0.08, 0.08))
    hills = (
        f'<elevationProfile><elevation s="0" a="3" b="{climb!r}" c="0" d="0"/></elevationProfile>'
    )
    offset = f'<laneOffset s="0" a="{draw(st.floats(-3, 3))!r}" b="0.01" c="0" d="0"/>'
    rule = draw(st.sampled_from(["RHT", "LHT"]))
    lanes = []
    for number in (-3, -2, -1, 1, 2):
        start, end = draw(st.floats(2.0, 4.0)), draw(st.floats(2.0, 4.0))
        kind = {-3: "sidewalk", 2: "biking"}.get(number, "driving")
        lanes.append(
            f'<lane id="{number}" type="{kind}">'
            f'<width sOffset="0" a="{start!r}" b="{(end - start) / length!r}" c="0" d="0"/></lane>'
        )
    more = f'rule="{rule}"'
    return document(
        road(length=length, plan=plan, lanes=offset + section(*lanes), inside=hills, more=more)
    )


@pytest.mark.slow
@settings(deadline=None, max_examples=60)
@given(streets())
def test_any_street_lies_where_it_should_and_back(text: str) -> None:
    tried = Tried(of_model(parse(text)), inside=False)
    assert tried.share == 1.0
    assert max(values.max() for values in tried.measured()) < AWAY
    same, moved = tried.returned()
    assert same.all()
    assert moved.max() < BACK
