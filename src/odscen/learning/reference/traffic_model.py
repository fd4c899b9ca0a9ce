"""The model of traffic: whether a vehicle is on a node, of which category, and how fast it is.

Row after row of the strips, from the stop lines backwards, with ``x`` the road, the light and the
traffic already placed ahead:

    P(vehicle | x) = logistic(occupied(x) + bias)
    P(category | outer lane, limit) from counts
    P(speed class | x, category) = softmax(speed(x, category))

Speed classes are: stopped, then equal steps of the ratio of speed to limit.
"""

from __future__ import annotations

import io
import json
import zipfile
import zlib
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from odscen.base.errors import InputError
from odscen.learning.fill import VEHICLES
from odscen.learning.reference.small_network import SmallNetwork
from odscen.learning.traffic_snapshots import STOPPED

if TYPE_CHECKING:
    from odscen.base.arrays import BoolArray, FloatArray, IntArray

VERSION = 4
STEP = 0.05
"""Of the ratio of speed to limit."""
CLASSES = 29
"""Of speed: stopped, and ratios up to 1.4."""
LIMIT_BOUNDS = (10.0, 17.0)
"""m/s; categories are counted by speed limit below, between and above."""
_CONTEXTS = 2 * (len(LIMIT_BOUNDS) + 1)
_LAYERS = 6


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
    """

    occupied: SmallNetwork
    speed: SmallNetwork
    categories: FloatArray
    about: dict[str, Any]


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
    try:
        with np.load(io.BytesIO(data), allow_pickle=False) as archive:
            arrays = {name: archive[name] for name in archive.files}
        head = json.loads(str(arrays["about"][0]))
        occupied, speed = (
            SmallNetwork(tuple(arrays[f"{name}_{k}"] for k in range(_LAYERS)))
            for name in ("occupied", "speed")
        )
        categories = arrays["categories"].reshape(_CONTEXTS, len(VEHICLES))
        about, version = head["about"], head["version"]
    except (
        zipfile.BadZipFile, zlib.error, EOFError, OSError, KeyError, ValueError, TypeError,
        IndexError,
    ) as error:  # fmt: skip
        raise InputError(f"it is no model of traffic: {error}", file=file) from error
    if version != VERSION:
        raise InputError(f"version is {version}; this odscen reads {VERSION}", file=file)
    return TrafficModel(occupied, speed, categories, about)
