"""The network learns what it is shown, and its gradients are those of its errors."""

from __future__ import annotations

import numpy as np
import pytest

from odscen.learning.reference.traffic_model import logistic, new_network, softmax, trained


def test_gradients_are_those_of_finite_differences() -> None:
    rng = np.random.default_rng(1)
    network = new_network(3, 4, 2, rng)
    x = rng.normal(size=(5, 3)).astype(np.float32)
    target = np.array([0, 1, 1, 0, 1])

    def loss() -> float:
        shares = softmax(network(x).astype(np.float64))
        return -float(np.log(shares[np.arange(5), target]).sum())

    error = softmax(network(x))
    error[np.arange(5), target] -= 1.0
    gradients = network.gradients(network.layers(x), error)
    for matrix, gradient in zip(network.weights, gradients, strict=True):
        flat, step = matrix.reshape(-1), 1e-2
        before = float(flat[0])
        flat[0] = before + step
        above = loss()
        flat[0] = before - step
        below = loss()
        flat[0] = before
        assert (above - below) / (2 * step) == pytest.approx(
            float(gradient.reshape(-1)[0]), abs=5e-3
        )


def test_it_learns_what_no_line_separates() -> None:
    rng = np.random.default_rng(2)
    x = rng.uniform(-1.0, 1.0, size=(2000, 2))
    target = (x[:, 0] * x[:, 1] > 0).astype(np.int64)
    network = trained(new_network(2, 12, 1, rng), x, target, rng, epochs=120, rate=2e-2)
    right = (logistic(network(x))[:, 0] > 0.5) == target
    assert right.mean() > 0.93


def test_the_same_seed_gives_the_same_weights() -> None:
    def weights() -> bytes:
        rng = np.random.default_rng(3)
        x = rng.normal(size=(300, 2))
        made = trained(new_network(2, 4, 3, rng), x, (x[:, 0] > 0).astype(np.int64), rng, epochs=2)
        return b"".join(one.tobytes() for one in made.weights)

    assert weights() == weights()
