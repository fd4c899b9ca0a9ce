"""Which segment, junction and movement each SUMO lane of a map belongs to."""

from __future__ import annotations

import polars as pl
import pytest

from odscen.scenario.demand.count_stations import transitions
from odscen.sumo.realize.sumo_lane_places import lane_places
from tests.sumo import toys
from tests.sumo.runner.test_on_maps import SHIPPED, built

col = pl.col


def test_a_street_over_a_junction():
    """Lanes inside of SUMO's junction begin before it, and belong to it as a whole."""
    places = lane_places(toys.sumo_map())
    lanes = {row["lane"]: row for row in places.lanes.iter_rows(named=True)}
    assert {name: row["segment"] for name, row in lanes.items()} == {
        "in_1": "r1", "in_2": "r1", ":9_0_0": "j9", ":9_0_1": "j9", "out_1": "r3", "out_2": "r3",
    }  # fmt: skip
    assert [lanes[name]["entry"] for name in ("in_1", ":9_0_0", "out_1")] == [False, True, True]
    assert places.movements.rows() == [("r1>j9>r3", "j9", "priority", 24.0)]
    to_it = places.ways.filter(col("via").is_null())["lane"].to_list()
    assert to_it == ["in_1", "in_2"]
    assert dict(places.segments.rows()) == {"r1": 98.0, "r3": 98.0}


@pytest.mark.slow
@pytest.mark.parametrize("name", [*SHIPPED, "motorway_weave", "t_junction_signs", "town_5x5"])
def test_every_lane_for_vehicles_has_one_place_on_shipped_maps(name):
    sumo_map = built(name).sumo
    places = lane_places(sumo_map)
    driven = {lane.id for lane in sumo_map.net.lanes.values() if lane.allows("passenger")}
    assert driven <= set(places.lanes["lane"])
    assert places.lanes.group_by("lane").agg(col("share").sum())["share"].to_list() == (
        pytest.approx([1.0] * places.lanes["lane"].n_unique())
    )
    assert not places.ways["lane"].is_duplicated().any()
    segments = sumo_map.graph.segments
    kinds = dict(zip(segments.ids, segments.kinds, strict=True))
    assert set(kinds) == {*places.segments["segment"], *places.junctions["junction"]}


@pytest.mark.slow
@pytest.mark.parametrize("name", SHIPPED)
def test_movements_are_those_of_the_lane_graph(name):
    sumo_map = built(name).sumo
    onwards = transitions(sumo_map.graph)
    for movement in lane_places(sumo_map).movements["movement"]:
        before, junction, behind = movement.split(">")
        assert junction in onwards[before]
        assert behind in onwards[junction]


@pytest.mark.parametrize("name", SHIPPED)
def test_a_segment_is_as_long_as_its_road(name):
    """But for what SUMO's junctions take of it."""
    sumo_map = built(name).sumo
    lengths = dict(lane_places(sumo_map).segments.rows())
    segments = sumo_map.graph.segments
    for name_, kind, length in zip(segments.ids, segments.kinds, segments.lengths, strict=True):
        if kind == "road":
            assert lengths[name_] == pytest.approx(length, rel=0.2)


def test_signals_control_the_junctions_that_they_stand_in():
    assert lane_places(built("signal_crossing").sumo).junctions["control"].to_list() == ["signal"]
    assert set(lane_places(built("roundabout").sumo).junctions["control"]) == {"priority"}
