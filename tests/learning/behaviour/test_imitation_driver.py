"""The driver that has learned: weights, what it sees, and that it drives like somebody."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from odscen.base.errors import InputError
from odscen.base.given_arrays import arrays_from_npz, npz_bytes
from odscen.learning.behaviour.behaviour_model import LightAhead
from odscen.learning.behaviour.imitation_driver import (
    FEATURES,
    DrivingRecorder,
    ImitationDriver,
    learned_driver,
    network_bytes,
    network_from_bytes,
    shipped_weights,
    sight,
)
from tests.learning.behaviour.road import scene, seen


def test_the_weights_that_ship_are_small_and_whole() -> None:
    data = shipped_weights()
    assert len(data) < 1_000_000
    network = network_from_bytes(data, file="shipped")
    assert network.weights[0].shape[0] == len(FEATURES)
    with pytest.raises(InputError, match=r"cut\.npz: it cannot be read"):
        network_from_bytes(data[:-100], file="cut.npz")
    with pytest.raises(InputError, match="there are no weights w5"):
        network_from_bytes(changed(data, "w5", None), file="short.npz")
    with pytest.raises(InputError, match="No such file"):
        ImitationDriver(weights="nowhere.npz")


def changed(data: bytes, name: str, array: Any) -> bytes:
    """The same file with another array of a name, or without one."""
    arrays = arrays_from_npz(data)
    arrays.pop(name)
    return npz_bytes(arrays if array is None else {**arrays, name: array})


@pytest.mark.parametrize(
    ("name", "array", "problem"),
    [
        ("w0", np.full((12, 32), np.nan, np.float32), "weights w0 are no numbers from -1e"),
        ("w1", np.full(32, 1e30, np.float32), "weights w1 are no numbers from -1e"),
        ("w2", np.zeros((32, 32), np.int64), "weights w2 are no numbers from -1e"),
        ("w2", np.zeros((32, 31), np.float32), r"weights \(32, 31\) and \(32,\) of layer 2"),
        ("w3", np.zeros((32, 1), np.float32), r"of layer 2 do not fit 32 inputs"),
        ("w4", np.array(["a"] * 32), "weights w4 are no numbers"),
        ("more", np.zeros(9_000_000), "its arrays have 72,0.* bytes; 64,000,000 are the most"),
    ],
)
def test_weights_that_nobody_can_compute_with_are_refused(
    name: str, array: Any, problem: str
) -> None:
    arrays = {**arrays_from_npz(shipped_weights()), name: array}
    with pytest.raises(InputError, match=problem):
        network_from_bytes(npz_bytes(arrays), file="w.npz")


def test_it_drives_on_when_free_and_brakes_behind_somebody_slow_and_before_red() -> None:
    road = scene(3)
    light = np.array([0, 0, LightAhead.RED], dtype=np.int32)
    view = seen(road, [0, 0, 1], [100.0, 113.0, 1970.0], [10.0, 3.0, 10.0], light=light)
    model = ImitationDriver()
    action, controlled = model.act(view, model.init(np.random.default_rng(0), road))
    assert controlled.all()
    behind, free, at_red = (action.speed - view.speed) / road.step_length
    assert free > 0.5
    assert behind < -0.2
    assert at_red < 0.0


def test_drawn_accelerations_depend_on_the_seed_alone() -> None:
    road, model = scene(2), ImitationDriver(sampled=True)
    view = seen(road, [0, 1], [100.0, 200.0], [10.0, 12.0])
    one, same, other = (
        model.act(view, model.init(np.random.default_rng(seed), road))[0].speed
        for seed in (1, 1, 4)
    )
    np.testing.assert_array_equal(one, same)
    assert not np.array_equal(one, other)


def test_a_recorder_pairs_what_was_seen_with_what_came_of_it(tmp_path) -> None:
    road, file = scene(2), tmp_path / "seen.npz"
    recorder = DrivingRecorder(str(file), every=2.0)
    for k, speed in enumerate(([10.0, 5.0], [11.0, 4.5], [20.0, 20.0])):
        view = seen(road, [0, 1], [100.0, 200.0], speed, time=0.5 * k)
        if k == 0:
            first = sight(view, road)
        _, controlled = recorder.act(view, road)
        assert not controlled.any()
    recorder.close()
    with np.load(file) as arrays:
        np.testing.assert_allclose(arrays["acceleration"], [2.0, -1.0])
        np.testing.assert_array_equal(arrays["x"], first)


@pytest.mark.slow
def test_training_learns_a_rule_and_the_same_seed_gives_the_same_bytes() -> None:
    rng = np.random.default_rng(0)
    x = rng.random((20_000, len(FEATURES))).astype(np.float32)
    acceleration = np.where(x[:, 2] < 0.5, -3.0, 1.0)
    one, same = (learned_driver(x, acceleration, np.random.default_rng(1), epochs=10) for _ in "ab")
    assert network_bytes(one, {}) == network_bytes(same, {})
    guess = one(x).argmax(axis=1)
    assert (guess == np.where(x[:, 2] < 0.5, 6, 14)).mean() > 0.9
