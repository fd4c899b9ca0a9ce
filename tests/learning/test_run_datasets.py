"""Runs put together in batches of one shape."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest

from odscen.base.errors import InputError
from odscen.learning.run_datasets import padded_batch

if TYPE_CHECKING:
    from odscen.base.given_arrays import Array


def arrays(agents: int, steps: int, lights: int = 1) -> dict[str, Array]:
    """Road users in a row from (500,000, 100) on, the last of them gone at the last instant."""
    state = np.zeros((agents, steps, 5))
    state[..., 0] = 500_000.0 + np.arange(agents)[:, None]
    state[..., 1] = 100.0
    valid = np.ones((agents, steps), dtype=np.bool_)
    valid[-1, -1] = False
    state[~valid] = 0.0
    return {
        "time": np.arange(steps) * 0.1,
        "agent_id": np.array([f"car-{k}" for k in range(agents)]),
        "agent_category": np.array(["van"] * (agents - 1) + ["pedestrian"]),
        "agent_size": np.full((agents, 3), 2.0),
        "agent_is_ego": np.arange(agents) == 0,
        "agent_state": state,
        "agent_valid": valid,
        "light_lane": np.arange(lights),
        "light_stop": np.full((lights, 3), [500_000.0, 100.0, 7.0]),
        "light_color": np.full((lights, steps), 3, dtype=np.uint8),
        # Two lanes of 3 and 2 points.
        "lane_point_start": np.array([0, 3, 5]),
        "lane_point": np.repeat(
            np.array([[500_000.0, 100.0, 0.0]] * 3) + np.arange(5)[:3, None], 3, axis=0
        )[:5].repeat(3, axis=1),
    }


def test_runs_of_several_sizes_have_one_shape_and_masks() -> None:
    batch = padded_batch([arrays(3, 4, lights=2), arrays(2, 6, lights=0)])
    shapes = {name: values.shape for name, values in batch.items()}
    assert shapes == {
        "origin": (2, 2), "time": (2, 6), "time_valid": (2, 6), "agent_state": (2, 3, 6, 5),
        "agent_valid": (2, 3, 6), "agent_size": (2, 3, 3), "agent_category": (2, 3),
        "agent_is_ego": (2, 3), "light_color": (2, 2, 6), "light_stop": (2, 2, 3),
        "light_valid": (2, 2),
    }  # fmt: skip
    assert all(values.dtype != object and values.dtype.kind in "fbu" for values in batch.values())
    assert batch["time_valid"].sum(axis=1).tolist() == [4, 6]
    assert batch["agent_valid"].sum(axis=(1, 2)).tolist() == [11, 11]
    assert batch["agent_category"].tolist() == [[1, 1, 6], [1, 6, 255]]
    assert batch["light_valid"].tolist() == [[True, True], [False, False]]


def test_places_are_exact_far_from_the_origin_of_the_map() -> None:
    run = arrays(3, 4)
    batch = padded_batch([run])
    back = batch["agent_state"][0, ..., :2].astype(np.float64) + batch["origin"][0]
    valid = run["agent_valid"]
    assert np.abs(back - run["agent_state"][..., :2])[valid].max() < 1e-6
    assert not batch["agent_state"][0][~valid].any()
    assert batch["light_stop"][0, 0] + [*batch["origin"][0], 0.0] == pytest.approx(
        [500_000.0, 100.0, 7.0]
    )


def test_lanes_have_so_many_points_from_end_to_end() -> None:
    points = np.zeros((5, 9))
    points[:, 0] = [0.0, 1.0, 2.0, 10.0, 14.0]
    points[:, 8] = 3.0
    run = arrays(1, 2) | {"lane_point": points}
    run["agent_state"][...] = 0.0
    batch = padded_batch([run], lanes=3, lane_points=5)
    assert batch["lane_point"][0, :, :, 0].tolist() == [
        [0.0, 0.5, 1.0, 1.5, 2.0], [10.0, 11.0, 12.0, 13.0, 14.0], [0.0] * 5,
    ]  # fmt: skip
    assert batch["lane_point"][0, :2, :, 8].tolist() == [[3.0] * 5] * 2
    assert batch["lane_valid"].tolist() == [[True, True, False]]


def test_what_does_not_fit_is_said() -> None:
    runs = [arrays(3, 4), arrays(5, 4)]
    with pytest.raises(InputError, match="agents is 4, and run 1 of the batch has 5"):
        padded_batch(runs, agents=4)
    with pytest.raises(InputError, match="lanes is 1, and run 0 of the batch has 2"):
        padded_batch(runs, lanes=1)
    with pytest.raises(InputError, match="a batch needs a run"):
        padded_batch([])
    light = {name: one for name, one in arrays(2, 2).items() if not name.startswith("lane")}
    with pytest.raises(InputError, match="a run has no map"):
        padded_batch([light], lanes=5)
