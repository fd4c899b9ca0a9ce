"""Edges of a graph as scipy's matrix of shortest edges."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from scipy import sparse

    from odscen.base.arrays import FloatArray, Int32Array

MIN_EDGE_LENGTH = 1e-6
"""Metres; scipy's sparse graphs drop edges of weight zero."""


def shortest_edges(
    count: int, rows: Int32Array, columns: Int32Array, length: FloatArray
) -> sparse.csr_matrix[np.float64]:
    """CSR matrix with the shortest of parallel edges (scipy would add them up)."""
    from scipy import sparse  # late: much imports this for its constant

    weight = np.maximum(length, MIN_EDGE_LENGTH)
    order = np.lexsort((weight, columns, rows))
    rows, columns, weight = rows[order], columns[order], weight[order]
    first = np.ones(len(rows), dtype=np.bool_)
    first[1:] = (rows[1:] != rows[:-1]) | (columns[1:] != columns[:-1])
    shape = (count, count)
    return sparse.csr_matrix((weight[first], (rows[first], columns[first])), shape=shape)
