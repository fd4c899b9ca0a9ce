"""Connecting lanes that lead back, and lanes that cross themselves: converters write both."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from odscen.base.ids import LaneKey, RoadId
from odscen.convert.building.network import build_network
from odscen.convert.model.lane_alignment import Stretch, evaluate
from odscen.convert.verify.fidelity import verify
from odscen.convert.verify.net_reader import read_net
from odscen.lanegraph.build_graphs import build_map_graph
from odscen.opendrive.lanes import RoadTable
from odscen.opendrive.parse import parse
from odscen.opendrive.topology import folded_lanes
from tests.opendrive.snippets import document, lane, road, section

ON = '<link><predecessor id="-1"/><successor id="-1"/></link>'
END = '<successor elementType="junction" elementId="9"/>'
START = '<predecessor elementType="junction" elementId="9"/>'


def _straight(road_id: str, x: float, length: float, *, heading: float = 0.0, **more: str) -> str:
    plan = f'<geometry s="0" x="{x}" y="0" hdg="{heading}" length="{length}"><line/></geometry>'
    return road(road_id, length=length, plan=plan, lanes=section(lane(-1, inside=ON)), **more)


def overlapping(back: float, *, before: float = 80.0) -> bytes:
    """Road 1 along x to 0, road 2 from ``-back``; connecting road 3 leads from 0 to there."""
    link = '<predecessor elementType="road" elementId="1" contactPoint="end"/>'
    link += '<successor elementType="road" elementId="2" contactPoint="start"/>'
    table = (
        '<connection id="0" incomingRoad="1" connectingRoad="3" contactPoint="start">'
        '<laneLink from="-1" to="-1"/></connection>'
    )
    return document(
        _straight("1", -before, before, link=END),
        _straight("2", -back, 90.0, link=START),
        _straight("3", 0.0, back, heading=np.pi, link=link, junction="9"),
        f'<junction id="9">{table}</junction>',
    ).encode()


@pytest.mark.parametrize("back", [0.5, 1.88, 3.0, 6.4, 11.0])
def test_a_connecting_lane_that_leads_back_is_passed_over(back: float) -> None:
    odr = parse(overlapping(back))
    table = RoadTable.of(odr)
    assert folded_lanes(odr, table) == {LaneKey(RoadId("3"), 0, -1)}
    graph = build_map_graph(odr, name="m", sha256="0", table=table)
    network = build_network(odr, table, graph.walks)
    lanes = read_net(network.net_xml).lanes
    ahead = [step for one in lanes.values() if one.cars for step in np.diff(one.shape[:, 0])]
    assert min(ahead) > 0.0
    (inner,) = [one for one in lanes.values() if one.function == "internal"]
    first, second = [one for one in lanes.values() if one.cars and one.function == "normal"]
    assert first.shape[-1, 0] == pytest.approx(inner.shape[0, 0], abs=0.02)
    assert inner.shape[-1, 0] == pytest.approx(second.shape[0, 0], abs=0.02)
    fidelity = verify(network.net_xml, odr, table)
    assert (fidelity.relations, fidelity.missing, fidelity.invented) == (1, (), ())
    assert fidelity.passed


def test_a_long_way_back_and_one_that_turns_are_no_folds() -> None:
    odr = parse(overlapping(13.0))
    assert folded_lanes(odr, RoadTable.of(odr)) == frozenset()
    text = overlapping(6.0).decode()
    bend = '<geometry s="0" x="0" y="0" hdg="0" length="6.0"><arc curvature="0.5"/></geometry>'
    old = f'<geometry s="0" x="0.0" y="0" hdg="{np.pi}" length="6.0"><line/></geometry>'
    assert old in text
    odr = parse(text.replace(old, bend).encode())
    assert folded_lanes(odr, RoadTable.of(odr)) == frozenset()


@pytest.mark.parametrize("reach", [6.1, 6.3, 6.5, 7.0])
def test_a_lane_inside_a_bend_sharper_than_its_distance_does_not_run_back(reach: float) -> None:
    # A quarter turn to the right: the second lane lies farther out than the radius of the bend.
    plan = (
        f'<geometry s="0" x="0" y="0" hdg="0" length="{1.6228 * reach}"><paramPoly3 '
        f'pRange="normalized" aU="0" bU="{2 * reach}" cU="{-reach}" dU="0" '
        f'aV="0" bV="0" cV="{-reach}" dV="0"/></geometry>'
    )
    lanes = section(lane(-1, width=3.2), lane(-2, width=3.2))
    odr = parse(document(road("1", length=1.6228 * reach, plan=plan, lanes=lanes)))
    table = RoadTable.of(odr)
    row = table.lane_index[LaneKey(RoadId("1"), 0, -2)]
    length = float(table.lane_s1[row])
    places = table.lane_points(np.full(200, row), np.linspace(0.0, length, 200))
    raw = np.diff(np.stack([places.x, places.y], axis=1), axis=0)
    assert min(float(a @ b) for a, b in pairwise(raw)) < 0.0 or reach > 6.5
    for ends in ((0.0, length), (length, 0.0)):
        (line,) = evaluate([(Stretch(row, *ends),)], table)
        steps = np.diff(line.shape[:, :2], axis=0)
        assert min(float(a @ b) for a, b in pairwise(steps)) > 0.0
        assert line.length == pytest.approx(line.arc[0][-1])
        assert np.all(np.diff(line.arc[0]) >= 0.0)
