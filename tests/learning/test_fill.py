"""What a generator gives back, read from arrays: taken, or refused with a reason."""

from __future__ import annotations

import io
from typing import Any

import numpy as np
import pytest

from odscen.base.categories import DEFAULT_BODY, Category
from odscen.base.errors import InputError
from odscen.lanegraph.graph_npz import graph_arrays
from odscen.learning.fill import (
    NO_NODE,
    FillRequest,
    fill_from_arrays,
    fill_from_bytes,
    request_bytes,
)
from tests.graphs import two_lane_road

GOOD = {"node": np.array([1, 20]), "category": np.array(["car", "bus"])}


def npz(**arrays: Any) -> bytes:
    buffer = io.BytesIO()
    np.savez(buffer, **arrays)
    return buffer.getvalue()


def request() -> FillRequest:
    graph = two_lane_road(300.0)
    roads = np.ones(len(graph.lanes.x), dtype=bool)
    walks = np.ones(len(graph.walks.x), dtype=bool)
    return FillRequest(graph, roads, walks, {Category.CAR: roads}, DEFAULT_BODY, 5, 0, seed=3)


def test_a_request_has_the_map_where_cars_may_be_and_how_many_are_wanted() -> None:
    given = request()
    arrays = np.load(io.BytesIO(request_bytes(given)), allow_pickle=False)
    for name, array in graph_arrays(given.graph).items():
        np.testing.assert_array_equal(arrays[name], array)
    assert arrays["categories"].tolist() == [str(one) for one in Category]
    assert arrays["allowed"].shape == (6, len(given.graph.lanes.x))
    assert arrays["allowed"].any(axis=1).tolist() == [True, False, False, False, False, False]
    assert arrays["bodies"][0].tolist() == [5.0, 1.8, 1.5]
    assert arrays["wanted"].tolist() == [5, 0]
    assert arrays["seed"].tolist() == [3]


def test_the_same_request_gives_the_same_bytes() -> None:
    assert request_bytes(request()) == request_bytes(request())


def test_a_fill_may_use_any_numbers_and_the_places_of_categories() -> None:
    fill = fill_from_bytes(
        npz(node=np.array([1.0, 20.0]), category=np.array([0, 6], dtype=np.uint8), goal=[7, -1]),
        file="f",
    )
    assert fill.node.tolist() == [1, 20]
    assert fill.category.tolist() == ["car", "pedestrian"]
    assert fill.goal is not None
    assert fill.goal.tolist() == [7, -1]
    assert fill.initial_speed is None


def test_a_node_that_is_no_number_stays_one_that_is_nowhere() -> None:
    fill = fill_from_arrays({"node": np.array([np.nan, np.inf]), "category": GOOD["category"]})
    assert fill.node.tolist() == [NO_NODE, NO_NODE]


@pytest.mark.parametrize(
    ("arrays", "said"),
    [
        ({"category": GOOD["category"]}, "node: array 'node' is missing"),
        ({"node": GOOD["node"]}, "category: array 'category' is missing"),
        ({**GOOD, "goal": np.array([1, 2, 3])}, "goal: it has shape (3,), not one value for each"),
        ({**GOOD, "node": np.array(4)}, "node: it has shape ()"),
        ({**GOOD, "node": np.zeros((2, 1), dtype=int)}, "node: it has shape (2, 1)"),
        ({**GOOD, "node": np.array([1.5, 2.0])}, "node: 1.5 of road user 0 is no whole number"),
        ({**GOOD, "node": np.array(["a", "b"])}, "node: it has values of <U1, not numbers"),
        ({**GOOD, "node": np.array([True, False])}, "node: it has values of bool, not numbers"),
        ({**GOOD, "category": np.array([0.5, 1.0])}, "category: it has values of float64"),
        ({**GOOD, "initial_speed": np.array([1j, 0])}, "initial_speed: it has values of complex"),
        ({**GOOD, "depart": np.array(["now", "then"])}, "depart: it has values of <U4"),
    ],
)
def test_arrays_of_the_wrong_kind_are_refused_by_name(arrays: Any, said: str) -> None:
    with pytest.raises(InputError) as refused:
        fill_from_arrays(arrays, file="fill.npz")
    assert str(refused.value).startswith(f"fill.npz: {said}")


@pytest.mark.parametrize("share", [0.0, 0.1, 0.5, 0.9, 0.99])
def test_a_file_that_is_cut_off_is_refused(share: float) -> None:
    data = npz(**GOOD)
    with pytest.raises(InputError, match=r"f: it cannot be read as an \.npz file"):
        fill_from_bytes(data[: int(share * len(data))], file="f")


def test_objects_are_never_unpickled() -> None:
    data = npz(node=np.array([{"a": 1}, 2], dtype=object), category=GOOD["category"])
    with pytest.raises(InputError, match="f: array node: it is malformed: it has values of object"):
        fill_from_bytes(data, file="f")


def test_a_single_array_is_no_fill() -> None:
    buffer = io.BytesIO()
    np.save(buffer, np.arange(3))
    with pytest.raises(InputError, match="f: it is a single array"):
        fill_from_bytes(buffer.getvalue(), file="f")
