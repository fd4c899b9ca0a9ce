from types import SimpleNamespace

import numpy as np
import pytest

from odscen.lanegraph.node_heights import node_heights


def graph(lanes: list[float], walks: list[float]):
    return SimpleNamespace(
        lanes=SimpleNamespace(z=np.array(lanes)), walks=SimpleNamespace(z=np.array(walks))
    )


@pytest.mark.parametrize(
    ("lanes", "walks", "flat"),
    [
        ([2.0, 2.004], [2.15], True),  # a kerb
        ([2.0, 2.0], [], True),
        ([2.0, 2.006], [2.15], False),
        ([2.0, 2.0], [2.4], False),  # a bridge for people
    ],
)
def test_a_map_on_one_level_has_no_heights(lanes, walks, flat):
    z, beside = node_heights(graph(lanes, walks))
    assert (len(z), len(beside)) == ((0, 0) if flat else (len(lanes), len(walks)))
