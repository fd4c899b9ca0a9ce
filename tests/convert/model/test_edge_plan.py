"""Where roads are cut into edges, and what their lanes are."""

from __future__ import annotations

import re

import numpy as np
import pytest

from odscen.base.ids import LaneKey
from odscen.convert.lane_table.table_json import table_from_json, table_to_json
from odscen.convert.model.conversion_report import ElementOutcome
from odscen.convert.verify.fidelity import verify
from odscen.sumo.realize.sumo_map import SumoMap
from odscen.sumo.realize.usable import usable_places
from tests.convert.maps import Converted, converted, named, of_model
from tests.lanegraph.roads import junction, lane, network, road, section


def made(*parts: str) -> Converted:
    return of_model(network(*parts))


def lengths(found: Converted) -> dict[str, float]:
    """Length of the first lane of each edge, to a decimetre."""
    return {name: round(float(edge[0].get("length")), 1) for name, edge in found.edges().items()}


def links(found: Converted) -> set[tuple[str, str]]:
    return set(found.links())


def type_at(s: float, kmh: int) -> str:
    return f'<type s="{s}" type="town"><speed max="{kmh}" unit="km/h"/></type><planView>'


def mark(at: float, change: str) -> str:
    return f'<roadMark sOffset="{at}" type="solid" color="standard" laneChange="{change}"/></lane>'


def crosswalk(s: float, *, t: float = 0.0, along: float = 4.0, across: float = 7.0) -> str:
    corners = [(-1, -1), (1, -1), (1, 1), (-1, 1)]
    outline = "".join(
        f'<cornerLocal u="{u * along / 2}" v="{v * across / 2}" z="0" height="0"/>'
        for u, v in corners
    )
    return (
        f'<object id="c{s}" type="crosswalk" s="{s}" t="{t}" zOffset="0" hdg="0"'
        f' orientation="none"><outline>{outline}</outline></object>'
    )


def test_sections_whose_lanes_simply_continue_are_one_edge() -> None:
    found = made(
        road(
            "1",
            section(lane(-1, after=-1), lane(1, after=1)),
            section(lane(-1, before=-1, after=-1), lane(1, before=1, after=1), s=30.0),
            section(lane(-1, before=-1), lane(1, before=1), s=60.0),
        )
    )
    assert lengths(found) == {"1.0.f": 100.0, "1.0.b": 100.0}
    assert found.links() == []


def test_a_lane_more_begins_a_new_edge() -> None:
    found = made(
        road(
            "1",
            section(lane(-1, after=-1)),
            section(lane(-1, before=-1), lane(-2), s=60.0),
        )
    )
    assert lengths(found) == pytest.approx({"1.0.f": 60.0, "1.1.f": 40.0}, abs=0.11)
    assert links(found) == {("1.0.f_0", "1.1.f_1")}


def test_a_change_of_the_limit_begins_a_new_edge() -> None:
    limited = road("1", section(lane(-1), lane(1)), speed='<speed max="50" unit="km/h"/>').replace(
        "<planView>", type_at(40.0, 30)
    )
    speeds = {name: edge[0].get("speed") for name, edge in made(limited).edges().items()}
    assert speeds == {"1.0.f": "13.89", "1.0.b": "13.89", "1.1.f": "8.33", "1.1.b": "8.33"}
    assert lengths(made(limited))["1.1.f"] == pytest.approx(60.0, abs=0.11)


def test_a_limit_that_stays_the_same_begins_none() -> None:
    limited = road("1", section(lane(-1)), speed='<speed max="50" unit="km/h"/>')
    assert len(made(limited.replace("<planView>", type_at(40.0, 50))).edges()) == 1


def changes(edge) -> list[tuple[bool, bool]]:
    """Whether each lane may be left to the left and to the right."""
    return [(one.get("changeLeft") is None, one.get("changeRight") is None) for one in edge]


def test_a_solid_line_begins_a_new_edge_without_lane_changes() -> None:
    first = lane(-1).replace("</lane>", mark(60.0, "none"))
    edges = made(road("1", section(first, lane(-2)))).edges()
    assert [float(e[0].get("length")) for e in edges.values()] == pytest.approx([60, 40], abs=0.11)
    (right, left), (right_then, left_then) = (changes(edge) for edge in edges.values())
    assert left[1]
    assert right[0]
    assert not left_then[1]
    assert not right_then[0]


def test_a_line_that_may_be_crossed_one_way_is_crossed_one_way() -> None:
    [edge] = made(road("1", section(lane(-1, change="increase"), lane(-2)))).edges().values()
    right, left = changes(edge)
    assert right[0], "lane ids increase to the left"
    assert not left[1]


def test_a_few_metres_of_another_line_begin_no_edge() -> None:
    first = lane(-1).replace("</lane>", mark(60.0, "none")).replace("</lane>", mark(65.0, "both"))
    assert len(made(road("1", section(first, lane(-2)))).edges()) == 1


def test_a_crosswalk_between_junctions_becomes_one() -> None:
    found = made(road("1", section(lane(-1), lane(1)), objects=crosswalk(50.0)))
    assert lengths(found) == pytest.approx(
        {"1.0.f": 47.0, "1.0.b": 47.0, "1.1.f": 47.0, "1.1.b": 47.0}, abs=0.3
    )
    assert links(found) == {("1.0.f_0", "1.1.f_0"), ("1.1.b_0", "1.0.b_0")}
    [crossing] = found.edges("crossing").values()
    assert set(crossing.get("crossingEdges").split()) <= set(found.edges())
    [yielding] = [j for j in found.xml.iter("junction") if len(j.findall("request")) > 2]
    assert {request.get("response") for request in yielding.findall("request")} == {"100", "000"}


@pytest.mark.parametrize(("place", "length"), [(2.0, 100.0), (98.5, 100.0), (4.0, 8.0)])
def test_a_crosswalk_at_a_dead_end_leaves_a_stub_behind_it(place: float, length: float) -> None:
    lanes = section(lane(-1), lane(1))
    found = made(road("1", lanes, length=length, objects=crosswalk(place)))
    assert links(found) == {("1.0.f_0", "1.1.f_0"), ("1.1.b_0", "1.0.b_0")}
    assert verify(found.network.net_xml, found.odr, found.roads).passed


def test_a_map_without_anything_to_move_on_is_an_empty_network() -> None:
    found = made(road("1", section(lane(-1, kind="shoulder"))))
    assert found.edges() == {}
    table = table_from_json(table_to_json(found.network.table))
    assert table.to_sumo(LaneKey("1", 0, -1), 5.0) is None
    usable = usable_places(SumoMap.of(found.graph, table))
    assert not usable.spawnable.any()
    assert not usable.walkable.any()


def test_crosswalks_close_to_each_other_are_in_one_junction() -> None:
    both = crosswalk(50.0) + crosswalk(58.0)
    found = made(road("1", section(lane(-1)), objects=both))
    assert len(found.edges()) == 2
    assert len(found.edges("crossing")) == 2
    assert sum(len(j.findall("request")) == 3 for j in found.xml.iter("junction")) == 1


def test_a_lane_that_tapers_ends_where_it_is_gone() -> None:
    gone = '<width sOffset="50" a="0" b="0" c="0" d="0"/><roadMark'
    taper = lane(-2, width=3.5, slope=-0.07).replace("<roadMark", gone, 1)
    found = made(road("1", section(lane(-1), taper)))
    both, one = found.edges().values()
    assert (len(both), len(one)) == (2, 1)
    assert float(both[0].get("length")) == pytest.approx(50.0, abs=1.0)
    assert found.links() == [("1.0.f_1", "1.1.f_0")], "the lane that is gone leads nowhere"


def test_a_lane_that_opens_begins_where_it_is_there() -> None:
    opening = lane(-2, width=0.0, slope=0.035)
    found = made(road("1", section(lane(-1), opening)))
    one, both = found.edges().values()
    assert (len(one), len(both)) == (1, 2)
    assert float(both[0].get("length")) == pytest.approx(98.5, abs=0.5)
    assert found.links() == [("1.0.f_0", "1.1.f_1")]


def test_lanes_that_are_nowhere_wide_are_none() -> None:
    found = made(road("1", section(lane(-1), lane(-2, width=0.0))))
    assert [len(edge) for edge in found.edges().values()] == [1]


SIDES = str.maketrans("fb", "bf")


@pytest.mark.parametrize("rule", ["RHT", "LHT"])
def test_lane_0_is_on_the_side_of_the_kerb(rule: str) -> None:
    four = section(lane(-2), lane(-1), lane(1), lane(2))
    found = made(road("1", four, rule=rule))
    right, left = [-5.25, -1.75], [5.25, 1.75]
    for name, expected in {"1.0.f": right, "1.0.b": left}.items():
        edge = found.edges()[name if rule == "RHT" else name.translate(SIDES)]
        assert [found.shapes[one.get("id")][0, 1] for one in edge] == expected
    x = {name: np.diff(found.shapes[edge[0].get("id")][[0, -1], 0])[0]
         for name, edge in found.edges().items()}  # fmt: skip
    assert x["1.0.f"] > 0 > x["1.0.b"]
    assert found.xml.get("lefthand") == ("true" if rule == "LHT" else None)


def fork(*connecting: str) -> Converted:
    """Two roads joined by connecting roads."""
    return made(
        road("1", section(lane(-1)), length=40.0, after="junction 9"),
        road("2", section(lane(-1)), x=60.0, length=40.0, before="junction 9"),
        *connecting,
        junction("9", *(("1", re.search('id="(1.)"', text)[1], "start") for text in connecting)),
    )


def connecting(name: str, *, length: float = 20.0, curvature: float = 0.0, hdg: float = 0.0) -> str:
    return road(
        name, section(lane(-1, before=-1, after=-1)), x=40.0, length=length, junction="9",
        curvature=curvature, hdg=hdg, before="road 1 end", after="road 2 start",
    )  # fmt: skip


def test_of_two_connections_between_two_lanes_the_shorter_is_taken_the_other_reported() -> None:
    # An arc of the same chord: radius 20 m, 60 degrees.
    detour = connecting("10", length=20.944, curvature=0.05, hdg=-np.pi / 6)
    found = fork(detour, connecting("11"))
    assert found.links() == [("1.0.f_0", "2.0.f_0")]
    [inner] = found.edges("internal").values()
    assert float(inner[0].get("length")) == pytest.approx(20.0)
    entries = found.network.report.entries
    assert any(
        entry.outcome is ElementOutcome.LOST and "shortest" in entry.reason for entry in entries
    )
    assert found.network.report.figures["connections_lost"] == 1


def test_a_direct_junction_leads_from_road_to_road() -> None:
    found = made(
        road("1", section(lane(-1)), length=40.0, after="junction 9"),
        road("2", section(lane(-1)), x=40.0, length=40.0, before="junction 9"),
        road("3", section(lane(-1)), x=40.0, hdg=-0.3, length=40.0, before="junction 9"),
        junction("9", ("1", "2", "start"), ("1", "3", "start"), kind="direct"),
    )
    assert links(found) == {("1.0.f_0", "2.0.f_0"), ("1.0.f_0", "3.0.f_0")}
    assert all(float(e[0].get("length")) <= 0.2 for e in found.edges("internal").values())


def test_a_real_direct_junction_is_driven_through_as_the_map_says() -> None:
    found = converted(named("esmini/direct_junction_simple"))
    assert found.network.report.figures["connections"] == 5
    assert len(found.links()) == 5


def test_junctions_with_nothing_but_connecting_roads_between_are_one() -> None:
    def inner(name: str, x: float, own: str, before: str, after: str) -> str:
        only = section(lane(-1, before=-1, after=-1))
        return road(name, only, x=x, length=20.0, junction=own, before=before, after=after)

    found = made(
        road("1", section(lane(-1)), length=40.0, after="junction 8"),
        inner("10", 40.0, "8", "road 1 end", "road 11 start"),
        inner("11", 60.0, "9", "road 10 end", "road 2 start"),
        road("2", section(lane(-1)), x=80.0, length=40.0, before="junction 9"),
        junction("8", ("1", "10", "start")),
        junction("9", ("10", "11", "start")),
    )
    assert links(found) == {("1.0.f_0", "2.0.f_0")}
    [internal] = found.edges("internal").values()
    assert float(internal[0].get("length")) == pytest.approx(40.0)
    [shared] = [j for j in found.xml.iter("junction") if j.findall("request")]
    assert shared.find("param[@key='opendrive']").get("value") == "8 9"


ODD = ["a b", "a&quot;b", "&lt;x&gt;", "Straße", "Strasse", ":1", "a_b", "a:b", "%", "&amp;", "ü"]


def test_odd_names_become_ids_that_sumo_takes_and_that_stay_apart() -> None:
    found = made(
        *(road(name, section(lane(-1), lane(1)), y=20.0 * k) for k, name in enumerate(ODD))
    )
    assert len(found.edges()) == 2 * len(ODD)
    junctions = [j.get("id") for j in found.xml.iter("junction")]
    assert len(set(junctions)) == len(junctions) >= 2 * len(ODD)
    for name in (*found.edges(), *junctions):
        assert re.fullmatch(r"[A-Za-z0-9_.-]+", name)
    for key in found.roads.lane_keys:
        if key.lane:
            assert found.network.table.to_sumo(key, 50.0) is not None
