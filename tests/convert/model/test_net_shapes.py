from __future__ import annotations

import numpy as np
import pytest

from odscen.base.ids import SumoEdgeId, SumoLaneId
from odscen.convert.model.net import INTERNAL, NetEdge, NetLane, NetLink
from odscen.convert.model.net_shapes import inner_border, link_paths

BEND = np.array([[0.0, 0.0, 1.0], [10.0, 0.0, 1.0], [10.0, 10.0, 2.0]])


def lane(name: str, shape: np.ndarray, *, width: float = 4.0, length: float = 9.0) -> NetLane:
    return NetLane(SumoLaneId(name), 0, length, 8.0, width, frozenset(), shape)


@pytest.mark.parametrize(("lefthand", "side"), [(False, 1.0), (True, -1.0)])
def test_the_border_lies_half_a_width_inwards_also_in_bends(lefthand: bool, side: float) -> None:
    border = inner_border([lane("a_0", BEND + 50.0), lane("a_1", BEND)], lefthand=lefthand)
    np.testing.assert_allclose(
        border, BEND + side * np.array([[0.0, 2.0, 0.0], [-2.0, 2.0, 0.0], [-2.0, 0.0, 0.0]])
    )


def test_the_path_of_a_connection_with_a_waiting_place_runs_over_both_internal_lanes() -> None:
    edges = [
        NetEdge(SumoEdgeId(name), INTERNAL, (lane(f"{name}_0", shape, length=length),))
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
    paths = link_paths(edges, links)
    np.testing.assert_allclose(paths[first].shape, BEND)
    assert (paths[first].speed, paths[first].waits_at) == (8.0, 10.0)
    assert paths[second].waits_at is None
