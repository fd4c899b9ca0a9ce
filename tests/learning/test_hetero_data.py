from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from odscen.base.errors import InputError
from odscen.learning.hetero_data import hetero_data, read_arrays


@pytest.mark.parametrize(
    ("about", "words"),
    [
        (None, "no file of arrays"),
        ("{", "no file of arrays"),
        (json.dumps({"format": "odscen-arrays", "version": 99}), "99, not odscen-arrays 1"),
    ],
)
def test_other_files_are_refused_by_name(about: str | None, words: str, tmp_path: Path) -> None:
    file = tmp_path / "other.npz"
    if about is None:
        file.write_bytes(b"something else")
    else:
        np.savez(file, about=np.array(about))
    with pytest.raises(InputError, match=words) as caught:
        read_arrays(file)
    assert "other.npz" in str(caught.value)


def test_arrays_become_a_valid_heterogeneous_graph() -> None:
    pytest.importorskip("torch_geometric")  # `make test-interchange` has it, with whole towns
    arrays = _two_nodes()
    data = hetero_data(arrays)
    assert data.validate(raise_on_error=True)
    assert data["node", "successor", "node"].edge_index.tolist() == [[0], [1]]
    place = data["agent"].state[0, 0, :2].double() + data.origin
    assert place.tolist() == pytest.approx([5_000_001.0, 2.0])


def _two_nodes() -> dict[str, np.ndarray]:
    far = 5_000_000.0
    return {
        "node": np.array([[far, 0, 0, 0, 0, 3.5], [far + 2, 0, 0, 0, 0, 3.5]]),
        "node_speed_limit": np.array([13.9, np.nan]),
        "node_lane": np.zeros(2, dtype=np.int64),
        "node_edge": np.array([[0], [1]]),
        "node_edge_relation": np.zeros(1, dtype=np.uint8),
        "node_edge_length": np.array([2.0]),
        "walk": np.zeros((0, 5)),
        "walk_edge": np.zeros((2, 0), dtype=np.int64),
        "walk_edge_kind": np.zeros(0, dtype=np.uint8),
        "walk_edge_length": np.zeros(0),
        "lane_point": np.zeros((2, 9)),
        "lane_point_start": np.array([0, 2]),
        "lane_speed_limit": np.array([np.inf]),
        "lane_in_junction": np.array([False]),
        "lane_edge": np.zeros((2, 0), dtype=np.int64),
        "agent_valid": np.array([[True]]),
        "agent_state": np.array([[[far + 1, 2.0, 0.0, 0.0, 1.0]]]),
        "agent_size": np.array([[5.0, 1.8, 1.5]]),
        "agent_is_ego": np.array([True]),
        "agent_node": np.array([1]),
        "light_stop": np.zeros((0, 3)),
        "light_color": np.zeros((0, 1), dtype=np.uint8),
        "light_lane": np.zeros(0, dtype=np.int64),
        "time": np.array([0.0]),
    }
