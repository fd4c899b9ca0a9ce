from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from odscen.base.ids import LaneKey
from odscen.opendrive.lanes import RoadTable
from odscen.opendrive.parse import parse
from odscen.opendrive.topology import cut_off_lanes, lane_successors
from tests.conftest import shared_map_files
from tests.opendrive.snippets import document, lane, road, section


def link(predecessor: int | None = None, successor: int | None = None) -> str:
    before = "" if predecessor is None else f'<predecessor id="{predecessor}"/>'
    after = "" if successor is None else f'<successor id="{successor}"/>'
    return f"<link>{before}{after}</link>"


def to_road(tag: str, road_id: str, contact: str) -> str:
    return f'<{tag} elementType="road" elementId="{road_id}" contactPoint="{contact}"/>'


def to_junction(tag: str, junction_id: str) -> str:
    return f'<{tag} elementType="junction" elementId="{junction_id}"/>'


def successors(*parts: str) -> dict[str, list[str]]:
    found = lane_successors(parse(document(*parts)))
    return {str(key): [str(other) for other in others] for key, others in found.items()}


def both(predecessor: int | None = None, successor: int | None = None) -> str:
    """Lanes 1 and -1 that are linked alike, the left one with signs turned."""
    left = tuple(None if value is None else -value for value in (predecessor, successor))
    return section(lane(1, inside=link(*left)), lane(-1, inside=link(predecessor, successor)))


def test_sections_follow_each_other_in_driving_direction() -> None:
    lanes = both(successor=-1) + both(predecessor=-1).replace('s="0.0"', 's="50"')
    assert successors(road(lanes=lanes)) == {
        "1.0.-1": ["1.1.-1"],
        "1.0.1": [],
        "1.1.-1": [],
        "1.1.1": ["1.0.1"],
    }


def test_left_hand_traffic_runs_the_other_way() -> None:
    lanes = both(successor=-1) + both(predecessor=-1).replace('s="0.0"', 's="50"')
    found = successors(road(lanes=lanes, more='rule="LHT"'))
    assert (found["1.0.1"], found["1.1.-1"]) == (["1.1.1"], ["1.0.-1"])


@pytest.mark.parametrize("contact", ["start", "end"])
def test_roads_may_meet_start_to_end_or_end_to_end(contact: str) -> None:
    side = -1 if contact == "start" else 1
    tag = "predecessor" if contact == "start" else "successor"
    one = road("1", link=to_road("successor", "2", contact), lanes=both(successor=side))
    values = {tag: side}
    two = road("2", link=to_road(tag, "1", "end"), lanes=both(**values))
    found = successors(one, two)
    assert found["1.0.-1"] == [f"2.0.{side}"]
    assert found[f"2.0.{-side}"] == ["1.0.1"]


def test_a_link_to_a_lane_of_the_opposite_direction_is_not_followed() -> None:
    one = road("1", link=to_road("successor", "2", "start"), lanes=both(successor=1))
    two = road("2", link=to_road("predecessor", "1", "end"), lanes=both(predecessor=1))
    assert all(not others for others in successors(one, two).values())


def test_connections_lead_into_a_junction_and_road_links_out_of_it() -> None:
    one = road("1", link=to_junction("successor", "9"), lanes=both())
    two = road("2", link=to_junction("predecessor", "9"), lanes=both())
    inner = road(
        "3",
        junction="9",
        link=to_road("predecessor", "1", "end") + to_road("successor", "2", "start"),
        lanes=section(lane(-1, inside=link(-1, -1))),
    )
    junction = (
        '<junction id="9"><connection id="0" incomingRoad="1" connectingRoad="3" '
        'contactPoint="start"><laneLink from="-1" to="-1"/></connection></junction>'
    )
    found = successors(one, two, inner, junction)
    assert (found["1.0.-1"], found["3.0.-1"]) == (["3.0.-1"], ["2.0.-1"])


@pytest.mark.parametrize(
    ("kinds", "cut_off"),
    [
        (("restricted", "driving"), ["3.0.-1"]),
        (("driving", "sidewalk"), ["3.0.-1"]),
        (("driving", "driving"), []),
        (("biking", "driving"), ["3.0.-1"]),
    ],
)
def test_a_connecting_lane_from_or_to_a_path_is_cut_off(
    kinds: tuple[str, str], cut_off: list[str]
) -> None:
    one = road("1", link=to_junction("successor", "9"), lanes=section(lane(-1, kind=kinds[0])))
    two = road("2", link=to_junction("predecessor", "9"), lanes=section(lane(-1, kind=kinds[1])))
    inner = road(
        "3",
        junction="9",
        link=to_road("predecessor", "1", "end") + to_road("successor", "2", "start"),
        lanes=section(lane(-1, inside=link(-1, -1))),
    )
    junction = (
        '<junction id="9"><connection id="0" incomingRoad="1" connectingRoad="3" '
        'contactPoint="start"><laneLink from="-1" to="-1"/></connection></junction>'
    )
    odr = parse(document(one, two, inner, junction))
    assert [str(key) for key in cut_off_lanes(odr)] == cut_off


def test_a_direct_junction_joins_roads_without_a_road_between() -> None:
    one = road("1", link=to_junction("successor", "9"), lanes=section(lane(-1), lane(-2)))
    two = road("2", link=to_junction("predecessor", "9"), lanes=section(lane(-1)))
    three = road("3", link=to_junction("predecessor", "9"), lanes=section(lane(-1)))
    connection = (
        '<connection id="{0}" incomingRoad="1" linkedRoad="{0}" contactPoint="start">'
        '<laneLink from="{1}" to="-1"/></connection>'
    )
    junction = (
        f'<junction id="9" type="direct">{connection.format(2, -1)}{connection.format(3, -2)}'
        "</junction>"
    )
    found = successors(one, two, three, junction)
    assert (found["1.0.-1"], found["1.0.-2"]) == (["2.0.-1"], ["3.0.-1"])


def test_a_direct_junction_also_merges_roads() -> None:
    """The linked road's traffic runs into the incoming road: the link is read backwards."""
    one = road("1", link=to_junction("predecessor", "9"), lanes=section(lane(-1)))
    two = road("2", link=to_junction("successor", "9"), lanes=section(lane(-1)))
    junction = (
        '<junction id="9" type="direct"><connection id="0" incomingRoad="1" linkedRoad="2" '
        'contactPoint="end"><laneLink from="-1" to="-1"/></connection></junction>'
    )
    assert successors(one, two, junction) == {"1.0.-1": [], "2.0.-1": ["1.0.-1"]}


@pytest.mark.parametrize("file", shared_map_files(), ids=lambda f: f"{f.parent.name}/{f.stem}")
def test_driving_lanes_that_follow_each_other_meet(file: Path) -> None:
    odr = parse(file.read_bytes())
    table = RoadTable.of(odr)
    pairs = [
        (table.lane_index[key], table.lane_index[other])
        for key, others in lane_successors(odr).items()
        for other in others
        if table.lane_type[table.lane_index[key]] == "driving"
        and table.lane_type[table.lane_index[other]] == "driving"
    ]
    here, there = np.array(pairs, dtype=np.int64).reshape(-1, 2).T
    forward_here, forward_there = table.lane_forward[here], table.lane_forward[there]
    end = table.lane_points(here, np.where(forward_here, table.lane_s1[here], table.lane_s0[here]))
    start = table.lane_points(
        there, np.where(forward_there, table.lane_s0[there], table.lane_s1[there])
    )
    gap = np.hypot(end.x - start.x, end.y - start.y)
    # soderleden links a lane to one that starts half a lane beside it; Town07 shifts by 0.5 m.
    assert np.sum(gap > 0.05) <= 4
    turn = (start.hdg + np.pi * ~forward_there) - (end.hdg + np.pi * ~forward_here)
    straight = gap <= 0.05
    assert (
        np.percentile(np.abs((turn + np.pi) % (2 * np.pi) - np.pi)[straight], 99, method="lower")
        < (0.1)
        if straight.any()
        else True
    )


@pytest.mark.parametrize("name", ["Town01", "Town04"])
def test_relations_of_driving_lanes_are_those_of_carla(shared_maps: Path, name: str) -> None:
    """Checked on the 2020 towns: those of 2019 have sections too short to probe with waypoints."""
    carla = pytest.importorskip("carla")
    text = (shared_maps / "carla-2020" / f"{name}.xodr").read_text()
    odr = parse(text)
    table, ours = RoadTable.of(odr), lane_successors(odr)
    theirs: dict[LaneKey, set[LaneKey]] = {}
    for waypoint in carla.Map(name, text).generate_waypoints(2.0):
        key = LaneKey(str(waypoint.road_id), waypoint.section_id, waypoint.lane_id)
        index = table.lane_index[key]
        rest = abs(
            (table.lane_s1 if table.lane_forward[index] else table.lane_s0)[index] - waypoint.s
        )
        found = theirs.setdefault(key, set())
        if rest <= 2.0 + 1e-6:
            found |= {
                LaneKey(str(n.road_id), n.section_id, n.lane_id) for n in waypoint.next(rest + 0.02)
            } - {key}
    assert math.fsum(map(len, theirs.values())) > 100
    assert {key: set(ours[key]) for key in theirs} == theirs
