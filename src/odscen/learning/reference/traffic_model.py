"""The model of traffic: whether a vehicle is on a node, of which category, and how fast it is.

Row after row of the strips, from the stop lines backwards, with ``x`` the road, the light and the
traffic already placed ahead:

    P(vehicle | x) = logistic(occupied(x) + bias)
    P(category | outer lane, limit) from counts
    P(speed class | x, category) = softmax(speed(x, category))

Speed classes are: stopped, then equal steps of the ratio of speed to limit.

    h1 = tanh(x W0 + b0),  h2 = tanh(h1 W1 + b1),  y = h2 W2 + b2

Trained with Adam (Kingma and Ba, 2015) on the cross-entropy of classes; two classes with one
output are a logistic regression on ``h2``.
"""

from __future__ import annotations

import io
import json
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING, Any, Self

import numpy as np

from odscen.base.errors import InputError, in_file
from odscen.base.given_arrays import arrays_from_npz
from odscen.base.stored_files import documents
from odscen.learning.fill import VEHICLES
from odscen.learning.reference.binned_statistics import BinnedStatistics
from odscen.learning.traffic_snapshots import STOPPED

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from odscen.base.arrays import BoolArray, FloatArray, IntArray
    from odscen.learning.fill import Array


_BATCH = 1024
LAYERS = 6
"""Arrays of a network: a matrix and a vector for each of its three layers."""
MOST_WEIGHTS = 64_000_000
"""Bytes of a file of weights, unpacked; those that ship have 11 and 60 kB."""
_LARGEST_WEIGHT = 1e6
"""Above it sums are no numbers any more; those that were learned are below 10."""


@dataclass(frozen=True, slots=True, eq=False)
class SmallNetwork:
    """Weights of the three layers: matrices ``(in, out)`` and vectors ``(out,)`` in turn."""

    weights: tuple[Array, ...]

    @classmethod
    def from_arrays(
        cls, arrays: Mapping[str, Array], name: str, *, inputs: int, outputs: int | None = None
    ) -> Self:
        """Network of the arrays ``NAME0`` to ``NAME5`` of a file.

        Raises
        ------
        InputError
            If one is missing, is none of its shape, or has values that are no numbers or too large
            to compute with.
        """
        found, width = [], inputs
        for layer in range(LAYERS // 2):
            matrix, vector = (_read_weights(arrays, f"{name}{2 * layer + k}") for k in (0, 1))
            last = layer == LAYERS // 2 - 1
            wanted = outputs if last and outputs is not None else vector.size
            if matrix.shape != (width, wanted) or vector.shape != (wanted,):
                raise InputError(
                    f"weights {matrix.shape} and {vector.shape} of layer {layer + 1} do not fit "
                    f"{width} inputs and {wanted} outputs"
                )
            found += [matrix, vector]
            width = wanted
        return cls(tuple(found))

    def __call__(self, x: Array) -> Array:
        """Outputs ``(rows, classes)`` of inputs ``(rows, features)``, float32."""
        return self.layers(np.asarray(x, dtype=np.float32))[-1]

    def layers(self, x: Array) -> tuple[Array, ...]:
        """Input, both hidden layers and outputs."""
        first, a, second, b, third, c = self.weights
        one = np.tanh(x @ first + a)
        two = np.tanh(one @ second + b)
        return x, one, two, two @ third + c

    def gradients(self, layers: tuple[Array, ...], error: Array) -> list[Array]:
        """Gradients of the weights for the gradient of the outputs, in the order of the weights."""
        x, one, two, _ = layers
        _, _, second, _, third, _ = self.weights
        at_two = (error @ third.T) * (1.0 - two**2)
        at_one = (at_two @ second.T) * (1.0 - one**2)
        return [
            x.T @ at_one, at_one.sum(axis=0),
            one.T @ at_two, at_two.sum(axis=0),
            two.T @ error, error.sum(axis=0),
        ]  # fmt: skip


def _read_weights(arrays: Mapping[str, Array], name: str) -> Array:
    """Weights of a file as numbers to compute with."""
    if name not in arrays:
        raise InputError(f"there are no weights {name}")
    found = arrays[name]
    if found.dtype.kind != "f" or not (np.abs(found) <= _LARGEST_WEIGHT).all():
        raise InputError(
            f"weights {name} are no numbers from -{_LARGEST_WEIGHT:g} to {_LARGEST_WEIGHT:g}"
        )
    return found.astype(np.float32)


def new_network(features: int, hidden: int, outputs: int, rng: np.random.Generator) -> SmallNetwork:
    """Network with random weights, of variance 1 / inputs."""
    sizes = (features, hidden, hidden, outputs)
    weights: list[Array] = []
    for inputs, outs in pairwise(sizes):
        matrix = rng.normal(size=(inputs, outs)) / np.sqrt(inputs)
        weights += [matrix.astype(np.float32), np.zeros(outs, dtype=np.float32)]
    return SmallNetwork(tuple(weights))


def trained(
    network: SmallNetwork,
    x: Array,
    target: IntArray,
    rng: np.random.Generator,
    *,
    epochs: int,
    weight: FloatArray | None = None,
    decay: float = 0.0,
    rate: float = 3e-3,
) -> SmallNetwork:
    """Train a network on rows; the step length falls to nothing along a half cosine.

    Parameters
    ----------
    x
        Shape ``(rows, features)``.
    target
        Class of each row; of a network with one output 0 or 1.
    weight
        How much each row counts; 1 in the mean.
    decay
        Of the matrices, for each step and unit of the rate (Loshchilov and Hutter, 2019).
    """
    weights = [weight.copy() for weight in network.weights]
    first = [np.zeros_like(weight) for weight in weights]
    second = [np.zeros_like(weight) for weight in weights]
    steps = epochs * -(-len(x) // _BATCH)
    for step, rows in enumerate(_draw_batches(len(x), epochs, rng), start=1):
        current = SmallNetwork(tuple(weights))
        layers = current.layers(np.asarray(x[rows], dtype=np.float32))
        error = _output_gradient(layers[-1], target[rows]) / np.float32(len(rows))
        if weight is not None:
            error *= weight[rows, None].astype(np.float32)
        now = rate * 0.5 * (1.0 + np.cos(np.pi * step / steps)) + 1e-5
        for k, gradient in enumerate(current.gradients(layers, error)):
            first[k] = 0.9 * first[k] + 0.1 * gradient
            second[k] = 0.999 * second[k] + 0.001 * gradient**2
            mean = first[k] / (1.0 - 0.9**step)
            spread = np.sqrt(second[k] / (1.0 - 0.999**step)) + 1e-8
            shrunk = decay * weights[k] if k % 2 == 0 else 0.0
            weights[k] -= (now * (mean / spread + shrunk)).astype(np.float32)
    return SmallNetwork(tuple(weights))


def logistic(values: Array) -> Array:
    """``1 / (1 + exp(-v))`` without overflow."""
    found: Array = 0.5 * (1.0 + np.tanh(0.5 * values))
    return found


def softmax(values: Array) -> Array:
    """Shares of classes, each row of which adds up to one."""
    raised = np.exp(values - values.max(axis=1, keepdims=True))
    found: Array = raised / raised.sum(axis=1, keepdims=True)
    return found


def _output_gradient(outputs: Array, target: IntArray) -> Array:
    """Gradient of the cross-entropy of each row."""
    if outputs.shape[1] == 1:
        return (logistic(outputs) - target[:, None]).astype(np.float32)
    error = softmax(outputs)
    error[np.arange(len(target)), target] -= 1.0
    return error.astype(np.float32)


def _draw_batches(count: int, epochs: int, rng: np.random.Generator) -> Iterator[IntArray]:
    for _ in range(epochs):
        order = rng.permutation(count)
        for start in range(0, count, _BATCH):
            yield order[start : start + _BATCH]


VERSION = 5
STEP = 0.05
"""Of the ratio of speed to limit."""
CLASSES = 29
"""Of speed: stopped, and ratios up to 1.4."""
LIMIT_BOUNDS = (10.0, 17.0)
"""m/s; categories are counted by speed limit below, between and above."""
_CONTEXTS = 2 * (len(LIMIT_BOUNDS) + 1)


@dataclass(frozen=True, slots=True, eq=False)
class TrafficModel:
    """What was learned.

    Attributes
    ----------
    occupied
        Logit of a vehicle on a node.
    speed
        Logits of the speed classes; its input ends with one column for each category.
    categories
        Shape ``(6, 6)``: share of each category by :func:`context`.
    about
        How it was trained; values that JSON can hold.
    statistics
        What is placed by where the model is no good.
    """

    occupied: SmallNetwork
    speed: SmallNetwork
    categories: FloatArray
    about: dict[str, Any]
    statistics: BinnedStatistics


def context(outer: BoolArray, limit: FloatArray) -> IntArray:
    """Row of the table of categories for places of a road."""
    found: IntArray = np.digitize(limit, LIMIT_BOUNDS) * 2 + outer.astype(np.int64)
    return found


def speed_class(speed: FloatArray, limit: FloatArray) -> IntArray:
    """Class of speeds, m/s."""
    ratio = 1 + (speed / limit / STEP).astype(np.int64)
    found: IntArray = np.where(speed < STOPPED, 0, np.minimum(ratio, CLASSES - 1))
    return found


def speed_within(classes: IntArray, limit: FloatArray, share: FloatArray) -> FloatArray:
    """Speeds of classes, m/s; ``share`` says where inside the class."""
    moving = np.maximum((classes - 1 + share) * STEP * limit, STOPPED)
    found: FloatArray = np.where(classes == 0, 0.0, moving)
    return found


def least_speeds(limit: FloatArray) -> FloatArray:
    """Slowest speed of each class, m/s, ``(V, CLASSES)``."""
    found: FloatArray = np.maximum(np.arange(CLASSES) - 1, 0) * STEP * limit[:, None]
    return found


def density_column(vehicles: int, metres: float) -> float:
    """Feature of how dense traffic is to be, of vehicles on metres of lane."""
    return float(np.log(0.5 + vehicles / max(metres, 1.0) * 1000.0) / 2.0)


def with_category(columns: FloatArray, category: IntArray) -> FloatArray:
    """Input of the network of speeds."""
    return np.column_stack([columns, np.eye(len(VEHICLES))[category]])


def model_bytes(model: TrafficModel) -> bytes:
    """Write a model as an .npz file; the same model gives the same bytes."""
    text = json.dumps({"version": VERSION, "about": model.about}, sort_keys=True)
    arrays: dict[str, Any] = {"about": np.array([text]), "categories": model.categories}
    for name, network in (("occupied", model.occupied), ("speed", model.speed)):
        arrays |= {f"{name}_{k}": weights for k, weights in enumerate(network.weights)}
    arrays |= model.statistics.to_arrays()
    buffer = io.BytesIO()
    np.savez(buffer, allow_pickle=False, **arrays)
    return buffer.getvalue()


def model_from_bytes(data: bytes, *, file: str) -> TrafficModel:
    """Inverse of :func:`model_bytes`.

    Raises
    ------
    InputError
        If it is no model.
    """
    arrays = arrays_from_npz(data, file=file, most=MOST_WEIGHTS)
    with in_file(file), documents("a model of traffic", RecursionError):
        head = json.loads(str(arrays["about"][0]))
        about, version = head["about"], head["version"]
        if version != VERSION:
            raise InputError(f"version is {version}; this odscen reads {VERSION}")
        occupied, speed = (
            SmallNetwork.from_arrays(
                arrays, f"{name}_", inputs=arrays[f"{name}_0"].shape[0], outputs=outputs
            )
            for name, outputs in (("occupied", 1), ("speed", CLASSES))
        )
        columns = occupied.weights[0].shape[0] + len(VEHICLES)
        if speed.weights[0].shape[0] != columns:
            raise InputError(
                f"weights of speeds have {speed.weights[0].shape[0]} inputs, not {columns}"
            )
        categories = arrays["categories"].astype(np.float64).reshape(_CONTEXTS, len(VEHICLES))
        if not ((categories >= 0.0) & (categories <= 1.0)).all():
            raise InputError("shares of categories are from 0 to 1")
        statistics = BinnedStatistics.from_arrays(arrays)
    return TrafficModel(occupied, speed, categories, about, statistics)
