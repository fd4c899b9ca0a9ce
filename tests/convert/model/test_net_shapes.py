from __future__ import annotations

import numpy as np
import pytest

from odscen.base.ids import SumoEdgeId, SumoLaneId
from odscen.convert.model.net import INTERNAL, Net, NetEdge, NetLane, NetLink
from odscen.convert.model.net_shapes import border

BEND = np.array([[0.0, 0.0, 1.0], [10.0, 0.0, 1.0], [10.0, 10.0, 2.0]])


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_border_keeps_its_distance_also_in_bends(side: float) -> None:
    expected = BEND + side * np.array([[0.0, 2.0, 0.0], [-2.0, 2.0, 0.0], [-2.0, 0.0, 0.0]])
    np.testing.assert_allclose(border(BEND, side * 2.0), expected)


def test_a_sharp_bend_is_cut_short() -> None:
    hairpin = np.array([[0.0, 0.0, 0.0], [10.0, 0.0, 0.0], [0.0, 0.1, 0.0]])
    assert np.abs(border(hairpin, 2.0) - hairpin).max() <= 4.0


def lane(name: str, shape: np.ndarray, length: float) -> NetLane:
    return NetLane(SumoLaneId(name), 0, length, 8.0, 3.0, frozenset(), shape)


def test_the_path_of_a_connection_with_a_waiting_place_runs_over_both_internal_lanes() -> None:
    edges = [
        NetEdge(SumoEdgeId(name), INTERNAL, (lane(f"{name}_0", shape, length),))
        for name, shape, length in (
            (":j_0", BEND[:2], 10.0),
            (":j_1", BEND[1:], 10.1),
            ("a", BEND, 1.0),
            ("b", BEND, 1.0),
        )
    ]
    first, second = SumoLaneId(":j_0_0"), SumoLaneId(":j_1_0")
    links = [
        NetLink(SumoEdgeId("a"), SumoEdgeId("b"), via=first),
        NetLink(SumoEdgeId(":j_0"), SumoEdgeId("b"), via=second),
        NetLink(SumoEdgeId(":j_1"), SumoEdgeId("b")),
    ]
    paths = Net((0.0, 0.0), False, tuple(edges), tuple(links), ()).link_paths()
    np.testing.assert_allclose(paths[first].shape, BEND)
    assert (paths[first].speed, paths[first].waits_at) == (8.0, 10.0)
    assert paths[second].waits_at is None
