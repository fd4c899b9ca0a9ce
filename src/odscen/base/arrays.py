"""Arrays by their type, and index arithmetic on them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from collections.abc import Iterable

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
Int32Array = NDArray[np.int32]
BoolArray = NDArray[np.bool_]

Bounds = tuple[float, float, float, float]
"""``min_x, min_y, max_x, max_y`` in metres."""


def offsets(sizes: Iterable[int] | IntArray) -> IntArray:
    """``(K + 1,)`` starts of groups of the given sizes, laid one after the other."""
    listed = sizes if isinstance(sizes, np.ndarray) else np.fromiter(sizes, dtype=np.int64)
    return np.concatenate(([0], np.cumsum(listed))).astype(np.int64)


def ranges(first: IntArray, sizes: IntArray, *, step: IntArray | int = 1) -> IntArray:
    """Concatenation of ``first[k] + step[k] * arange(sizes[k])`` without a loop."""
    start = offsets(sizes)
    within = np.arange(start[-1], dtype=np.int64) - np.repeat(start[:-1], sizes)
    steps = np.repeat(np.broadcast_to(np.asarray(step, dtype=np.int64), sizes.shape), sizes)
    everything: IntArray = np.repeat(first, sizes).astype(np.int64) + steps * within
    return everything
