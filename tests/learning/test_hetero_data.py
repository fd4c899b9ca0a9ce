from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from odscen.base.categories import Category
from odscen.base.errors import InputError
from odscen.lanegraph.query import walk_node_ids
from odscen.learning.hetero_data import arrays_of, hetero_data, read_arrays
from odscen.scenario.document.scenario_document import Actor, MapReference, Scenario
from odscen.scenario.forms.array_form import to_arrays
from odscen.scenario.forms.array_reading import from_arrays
from tests.graphs import SHA256, fork


@pytest.mark.parametrize(
    ("about", "words"),
    [
        (None, r"it cannot be read as an \.npz file"),
        ("{", "no arrays of a run or a scenario"),
        (json.dumps({"format": "odscen-arrays", "version": 99}), "it is odscen-arrays 99; this"),
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


def test_the_arrays_of_a_scenario_become_a_valid_graph_and_come_back_whole() -> None:
    pytest.importorskip("torch_geometric")
    arrays = to_arrays(_on_the_fork(), fork())
    data = hetero_data(arrays)
    assert data.validate(raise_on_error=True)
    assert data["actor"].num_nodes == 2
    assert data["actor", "starts_at", "node"].edge_index.tolist() == [[0], [1]]
    assert data["actor", "starts_at", "walk"].edge_index.tolist() == [[1], [0]]
    assert data["actor", "goes_to", "node"].num_edges == 1
    assert data["actor"].x[0].tolist() == [1, *[0] * 6, 12.5, -1, 0, 0, 1]
    back = arrays_of(data)
    assert back.keys() == arrays.keys()
    for name, values in arrays.items():
        assert back[name].dtype == values.dtype, name
        assert np.array_equal(back[name], values, equal_nan=values.dtype.kind == "f"), name
    assert from_arrays(back) == _on_the_fork()


def test_a_speed_changed_in_the_data_is_changed_in_the_scenario() -> None:
    pytest.importorskip("torch_geometric")
    data = hetero_data(to_arrays(_on_the_fork(), fork()))
    data["actor"].actor_speed[0] = 3.0
    assert from_arrays(arrays_of(data)).actors[0].speed == 3.0


def test_data_of_a_run_does_not_go_back() -> None:
    pytest.importorskip("torch_geometric")
    with pytest.raises(InputError, match="only the data of a scenario"):
        arrays_of(hetero_data(_two_nodes()))


def _on_the_fork() -> Scenario:
    graph = fork()
    return Scenario(
        name="one",
        map=MapReference(name="toy", sha256=SHA256),
        roi=("r1", "j9", "r2"),
        actors=(
            Actor(
                id="car", category=Category.CAR, spawn="1.0.-1.1", goal="2.0.-1.3", speed=12.5,
                ego=True,
            ),
            Actor(id="anna", category=Category.PEDESTRIAN, spawn=walk_node_ids(graph)[0]),
        ),
    )  # fmt: skip
