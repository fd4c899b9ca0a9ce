"""A network that odscen has written, read as if it came from outside."""

from __future__ import annotations

from contextlib import nullcontext
from functools import cache

import numpy as np
import pytest

from odscen.base.errors import InputError
from odscen.convert.imported.geometric_table import geometric_table
from odscen.convert.imported.imported_network import imported_network
from odscen.convert.imported.net_import import read_network
from odscen.convert.lane_table.table import LaneTable
from odscen.convert.lane_table.table_json import table_from_json, table_to_json
from odscen.opendrive.road_model import DRIVABLE_TYPES
from tests.convert.maps import converted, named

MAPS = ("signal_crossing", "roundabout", "left_hand_crossing", "motorway_weave")


@cache
def by_geometry(name: str) -> LaneTable:
    made = converted(named(name))
    net = read_network(made.network.net_xml)
    return geometric_table(net, made.odr, made.roads, made.graph.walks)


@pytest.mark.parametrize("name", MAPS)
@pytest.mark.parametrize("inside", [False, True])
def test_places_on_lanes_are_those_of_the_table_that_odscen_writes(name: str, inside: bool) -> None:
    made = converted(named(name))
    lane, s = made.nodes(DRIVABLE_TYPES, inside=inside, spacing=1.0)
    found = by_geometry(name).sumo_places(made.roads.lane_keys, lane, s)
    true = made.places(lane, s)
    known = (true.lane >= 0) & (found.lane >= 0)
    assert np.mean(known[true.lane >= 0]) > 0.99
    ids = [tuple(table.lanes) for table in (by_geometry(name), made.network.table)]
    same = np.array([ids[0][a] == ids[1][b] for a, b in zip(found.lane, true.lane, strict=True)])
    # Where connecting lanes overlap or lanes meet, the other one is as true.
    assert np.mean(same[known]) > 0.97
    off = np.abs(found.pos - true.pos)[known & same]
    assert np.percentile(off, 99) < 0.1
    assert np.nanpercentile(found.deviation[known], 99) < 0.05


@pytest.mark.parametrize("name", MAPS)
def test_a_place_on_a_sumo_lane_leads_back_to_the_map(name: str) -> None:
    table = by_geometry(name)
    for interval in table.intervals[:200]:
        lane = table.lane_list[interval.sumo]
        middle = float(interval.pos[[0, -1]].mean())
        place = table.to_xodr(lane.id, middle)
        assert place is not None
        back = table.to_sumo(place.lane, place.s)
        assert back is not None
        if back.lane == lane.id:
            assert back.pos == pytest.approx(middle, abs=0.05)


def test_walks_beside_lanes_are_found_too() -> None:
    made = converted(named("roundabout"))
    own = {key for key in made.network.table.lane_keys if len(key) == 4}
    table = by_geometry("roundabout")
    found = {table.lane_keys[span.lane] for span in table.spans}
    assert own <= found


def test_lights_have_their_junction_stages_and_signals() -> None:
    made = converted(named("signal_crossing"))
    (light,), (own,) = by_geometry("signal_crossing").lights, made.network.table.lights
    assert (light.id, light.junctions, light.offset) == (own.id, own.junctions, own.offset)
    assert [(p.duration, p.state, p.name) for p in light.phases] == [
        (p.duration, p.state, p.name) for p in own.phases
    ]
    assert light.signals == own.signals


def test_persons_can_walk_where_they_could_and_keep_to_one_side() -> None:
    own = converted(named("left_hand_crossing")).network.table
    table = by_geometry("left_hand_crossing")
    assert table.walk_links == own.walk_links
    assert table.lefthand
    assert table.counts == own.counts


def test_the_table_is_the_same_every_time_and_can_be_stored() -> None:
    made = converted(named("signal_crossing"))
    net = read_network(made.network.net_xml)
    again = geometric_table(net, made.odr, made.roads, made.graph.walks)
    text = table_to_json(again)
    assert text == table_to_json(by_geometry("signal_crossing"))
    assert table_to_json(table_from_json(text)) == text


def test_the_report_counts_what_the_network_holds() -> None:
    made = converted(named("signal_crossing"))
    network = imported_network(made.network.net_xml, made.odr, made.roads, made.graph.walks)
    figures, own = network.report.figures, made.network.report.figures
    for name in ("driving_road_covered", "driving_junction_covered", "walking_road_covered"):
        assert figures[name] == pytest.approx(own[name], abs=5.0)
    assert (figures["connections_lost"], figures["connections_invented"]) == (0.0, 0.0)
    assert (figures["crosswalks"], figures["crosswalks_lost"]) == (4.0, 0.0)
    assert not [entry for entry in network.report.entries if entry.outcome == "lost"]


def test_a_network_of_another_map_is_refused_with_the_lengths() -> None:
    made, other = converted(named("motorway_weave")), converted(named("signal_crossing"))
    with pytest.raises(InputError, match=r"not one of this map: \d+ of \d+ m of its lanes"):
        imported_network(other.network.net_xml, made.odr, made.roads, made.graph.walks)


@pytest.mark.parametrize(
    ("access", "taken"),
    [('allow="tram"', True), ('allow="rail"', True), ('allow="bus"', False), ("", False)],
)
def test_tracks_beside_the_roads_of_a_map_do_not_make_a_network_a_strangers(
    access: str, taken: bool
) -> None:
    made = converted(named("t_junction_signs"))
    node = next(e.get("id") for e in made.xml.iter("junction") if e.get("type") == "dead_end")
    track = (
        f'<edge id="track" from="{node}" to="{node}" priority="1"><lane id="track_0" index="0" '
        f'{access} speed="20" length="9000" shape="0,900 9000,900"/></edge>'
    )
    net = made.network.net_xml.replace(b"<junction", track.encode() + b"<junction", 1)
    with nullcontext() if taken else pytest.raises(InputError, match="not one of this map"):
        imported_network(net, made.odr, made.roads, made.graph.walks)
