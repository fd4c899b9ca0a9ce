from __future__ import annotations

import numpy as np
import pytest

from odscen.convert.imported.geometric_table import (
    InnerChain,
    InnerLane,
    LanePoint,
    PathStretch,
    chain_intervals,
    chains_of,
    shortest_path,
)
from odscen.convert.imported.lane_matching import LaneSamples
from odscen.convert.imported.net_import import read_network
from odscen.opendrive.lanes import RoadTable
from odscen.opendrive.parse import parse
from tests.convert.imported.small_net import NET
from tests.opendrive.snippets import document, lane, road, section

ROADS = [
    road(
        name,
        length=length,
        plan=f'<geometry s="0" x="{x}" y="0" hdg="0" length="{length}"><line/></geometry>',
        lanes=section(lane(-1)),
    )
    for name, x, length in [("a", 0, 50), ("b", 50, 20), ("c", 50, 30), ("d", 80, 40)]
]
TABLE = RoadTable.of(parse(document(*ROADS)))
A, B, C, D = range(4)
LANES = LaneSamples.of(TABLE, np.arange(4))
AFTER = {A: (B, C), B: (D,), C: (D,)}


def test_the_shortest_path_is_taken_from_place_to_place() -> None:
    path = shortest_path(LanePoint(A, 48.0), LanePoint(D, 1.5), AFTER, LANES, longest=100.0)
    assert path is not None
    assert [part.lane for part in path] == [A, B, D]
    np.testing.assert_allclose([part[1:] for part in path], [(48, 50), (0, 20), (0, 1.5)])


def test_a_path_within_one_lane_needs_no_other() -> None:
    path = shortest_path(LanePoint(A, 10.0), LanePoint(A, 12.0), AFTER, LANES, longest=100.0)
    assert path == (PathStretch(A, 10.0, 12.0),)


@pytest.mark.parametrize(
    ("start", "end", "longest"),
    [
        (LanePoint(D, 1.0), LanePoint(A, 1.0), 500.0),
        (LanePoint(A, 48.0), LanePoint(D, 1.5), 20.0),
        (LanePoint(A, 12.0), LanePoint(A, 10.0), 500.0),
    ],
)
def test_where_no_path_is_short_enough_there_is_none(
    start: LanePoint, end: LanePoint, longest: float
) -> None:
    assert shortest_path(start, end, AFTER, LANES, longest=longest) is None


def test_a_path_is_divided_among_internal_lanes_in_proportion() -> None:
    path = (PathStretch(A, 48.0, 50.0), PathStretch(B, 0.0, 20.0), PathStretch(D, 0.0, 2.0))
    via = [InnerLane(7, 6.0, 6.1), InnerLane(8, 6.0, 5.9)]
    intervals = chain_intervals(path, via, LANES, step=1.0)
    ends = [
        (
            interval.lane,
            interval.sumo,
            *np.round([*interval.s[[0, -1]], *interval.pos[[0, -1]]], 3).tolist(),
        )
        for interval in intervals
    ]
    assert ends == [
        (A, 7, 48.0, 50.0, 0.0, 1.017),
        (B, 7, 0.0, 10.0, 1.017, 6.1),
        (B, 8, 10.0, 20.0, 0.0, 4.917),
        (D, 8, 0.0, 2.0, 4.917, 5.9),
    ]


def test_a_chain_runs_over_internal_lanes_from_normal_to_normal() -> None:
    assert chains_of(read_network(NET.encode()), ()) == [InnerChain("a_1", (":j_0_0",), "b_0")]


def test_a_stub_is_a_link_of_chains_and_not_their_end() -> None:
    net = read_network(NET.encode())
    assert chains_of(net, {"b_0"}) == []
