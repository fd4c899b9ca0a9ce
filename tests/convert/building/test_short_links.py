"""Short roads between two junctions, with crosswalks and lights at both ends."""

from __future__ import annotations

import pytest

from odscen.convert.building.network import build_network
from odscen.convert.lane_table.sumo_network import SumoNetwork
from odscen.lanegraph.build_graphs import build_map_graph
from odscen.opendrive.lanes import RoadTable
from odscen.opendrive.parse import parse
from tests.opendrive.snippets import document, lane, road, section

ON = '<link><predecessor id="{0}"/><successor id="{0}"/></link>'
LANES = section(lane(1, inside=ON.format(1)), lane(-1, inside=ON.format(-1)))
LINK = '<{} elementType="{}" elementId="{}" {}/>'


def _placed(road_id: str, x: float, length: float, *, link: str, **more: str) -> str:
    plan = f'<geometry s="0" x="{x}" y="0" hdg="0" length="{length}"><line/></geometry>'
    return road(road_id, length=length, plan=plan, lanes=LANES, link=link, **more)


def _connecting(road_id: str, junction: str, x: float, before: str, after: str) -> str:
    link = LINK.format("predecessor", "road", before, 'contactPoint="end"')
    link += LINK.format("successor", "road", after, 'contactPoint="start"')
    return _placed(road_id, x, 20.0, link=link, junction=junction)


def _junction(junction: str, connecting: str, before: str, after: str) -> str:
    rows = "".join(
        f'<connection id="{n}" incomingRoad="{incoming}" connectingRoad="{connecting}" '
        f'contactPoint="{contact}"><laneLink from="{own}" to="{own}"/></connection>'
        for n, (incoming, contact, own) in enumerate(((before, "start", -1), (after, "end", 1)))
    )
    return f'<junction id="{junction}">{rows}</junction>'


def two_junctions(
    length: float, crosswalks: tuple[float, ...], *, deep: float = 3.0
) -> SumoNetwork:
    """Roads 1, 2 and 3 in a row; road 2 of ``length`` metres lies between junctions 10 and 20."""
    objects = "".join(
        f'<object id="{n}" type="crosswalk" s="{s}" t="0" length="{deep}" width="8"/>'
        for n, s in enumerate(crosswalks)
    )
    lights = "".join(
        f'<signal id="{n}" s="{s}" t="0" dynamic="yes" orientation="{way}" type="1000001"/>'
        for n, s, way in ((71, length - 0.5, "+"), (72, 0.5, "-"))
    )
    end, start = ("successor", "junction"), ("predecessor", "junction")
    odr = parse(
        document(
            _placed("1", 0.0, 100.0, link=LINK.format(*end, "10", "")),
            _connecting("11", "10", 100.0, "1", "2"),
            _placed(
                "2",
                120.0,
                length,
                link=LINK.format(*start, "10", "") + LINK.format(*end, "20", ""),
                inside=f"<objects>{objects}</objects><signals>{lights}</signals>",
            ),
            _connecting("21", "20", 120.0 + length, "2", "3"),
            _placed("3", 140.0 + length, 100.0, link=LINK.format(*start, "20", "")),
            _junction("10", "11", "1", "2"),
            _junction("20", "21", "2", "3"),
        )
    )
    table = RoadTable.of(odr)
    graph = build_map_graph(odr, name="m", sha256="0", table=table)
    return build_network(odr, table, graph.walks)


@pytest.mark.parametrize(
    ("length", "crosswalks"),
    [
        (9.0, (2.5, 6.5)),
        (11.0, (2.5, 8.5)),
        (14.0, (2.5, 11.5)),
        (17.0, (2.5, 8.5, 14.5)),
        (20.0, (2.5, 17.5)),
        (11.0, ()),
        (7.0, (1.6, 5.4)),
        (8.0, (2.0, 6.0)),
        (10.0, (2.0, 8.0)),
        (11.0, (0.5, 10.5)),
        (11.0, (-1.0, 12.0)),
        (12.0, (2.0, 10.0)),
        (13.0, (2.5, 10.5)),
        (15.0, (3.0, 12.0)),
        (18.0, (2.5, 15.5)),
    ],
)
@pytest.mark.parametrize("deep", [2.0, 3.0])
def test_a_short_road_with_crosswalks_at_both_ends_keeps_its_junctions_and_lights(
    length: float, crosswalks: tuple[float, ...], deep: float
) -> None:
    network = two_junctions(length, crosswalks, deep=deep)
    between = [
        one
        for one in network.table.edges.values()
        if one.id.startswith("2.") and (one.from_junction, one.to_junction) == ("J10", "J20")
    ]
    assert len(between) == 1
    assert between[0].length >= 0.9
    assert {light.junctions for light in network.table.lights} == {("10",), ("20",)}
    assert network.report.figures["crossings"] == len(crosswalks)
    assert not [entry for entry in network.report.entries if entry.outcome == "lost"]


@pytest.mark.parametrize(
    ("length", "crosswalks", "least"),
    [
        (6.0, (1.6, 4.4), 0.99),
        (4.6, (0.0, 4.6), 0.99),
        (4.6, (1.0, 2.0), 0.25),
        (2.9, (0.0,), 0.25),
        (2.9, (2.8,), 0.25),
        (1.4, (0.1,), 0.25),
        (0.2, (0.0,), 0.1),
        (0.3, (0.0, 0.3), 0.1),
    ],
)
def test_a_road_that_all_lies_under_crosswalks_keeps_an_edge_between_its_junctions(
    length: float, crosswalks: tuple[float, ...], least: float
) -> None:
    network = two_junctions(length, crosswalks)
    ways = {
        (one.from_junction, one.to_junction): one.length
        for one in network.table.edges.values()
        if one.id.startswith("2.") and one.function == "normal"
    }
    assert sorted(ways) == [("J10", "J20"), ("J20", "J10")]
    assert min(ways.values()) >= least
    assert network.report.figures["crossings"] == len(crosswalks)
    # The crossings belong to the junctions, and to no place of their own.
    names = {one.from_junction for one in network.table.edges.values() if one.from_junction}
    assert not [name for name in names if name.startswith("X")]
    assert not [entry for entry in network.report.entries if entry.outcome == "lost"]


def test_one_crosswalk_in_the_middle_of_a_short_road_leaves_both_junctions() -> None:
    network = two_junctions(11.0, (5.5,))
    assert {light.junctions for light in network.table.lights} >= {("10",)}
    assert len([one for one in network.table.edges.values() if one.function == "normal"]) >= 6
