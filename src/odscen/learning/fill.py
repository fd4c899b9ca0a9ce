"""The contract with a generator of traffic: what it is given, and what it gives back, as arrays.

All arrays and their units are in ``docs/generators.md``. A generator sees no document and no
simulator; what it gives back is checked by :mod:`odscen.learning.fill_check`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from odscen.base.categories import Category
from odscen.base.errors import InputError
from odscen.base.given_arrays import arrays_from_npz, npz_bytes
from odscen.lanegraph.graph_npz import graph_arrays
from odscen.learning.traffic_snapshots import no_lights

if TYPE_CHECKING:
    from collections.abc import Mapping

    from odscen.base.arrays import BoolArray
    from odscen.base.categories import Body
    from odscen.lanegraph.graphs import MapGraph
    from odscen.learning.traffic_snapshots import LightView

Array = np.ndarray[Any, np.dtype[Any]]

VEHICLES = tuple(one for one in Category if one is not Category.PEDESTRIAN)
OPTIONAL = {
    "initial_speed": "m/s", "desired_speed": "m/s", "goal": "node", "lateral_offset": "m",
    "depart": "s",
}  # fmt: skip
"""Columns of a fill that need not be there, with their units."""


NO_NODE = np.iinfo(np.int64).min
"""In place of a node that is no number."""


@dataclass(frozen=True, slots=True, eq=False)
class FillRequest:
    """What is to be filled.

    Attributes
    ----------
    graph
        The whole map.
    roads, walks
        Shape ``(N,)`` and ``(P,)``: nodes of the region of interest.
    allowed
        For each category the nodes on which it may start, inside the region; shape ``(N,)``, for
        pedestrians ``(P,)``. Categories that are not wanted have no entry.
    bodies
        Size of each category.
    vehicles, walkers
        How many are wanted.
    seed
        Of the scenario.
    given_lights
        What the traffic lights of the map show when the scenario begins; ``None`` for a map without
        lights.
    """

    graph: MapGraph
    roads: BoolArray
    walks: BoolArray
    allowed: Mapping[Category, BoolArray]
    bodies: Mapping[Category, Body]
    vehicles: int
    walkers: int
    seed: int
    given_lights: LightView | None = None

    @property
    def lights(self) -> LightView:
        """What lights show at the beginning, for each lane."""
        return self.given_lights or no_lights(len(self.graph.lanes.lanes.keys))

    def arrays(self) -> dict[str, Array]:
        """All of it as named arrays, the map's included."""
        none = np.zeros(len(self.graph.lanes.x), dtype=np.bool_)
        nobody = np.zeros(len(self.graph.walks.x), dtype=np.bool_)
        return {
            **graph_arrays(self.graph),
            "region": self.roads,
            "walk_region": self.walks,
            "categories": np.array([str(one) for one in Category]),
            "bodies": np.array([self.bodies[one] for one in Category], dtype=np.float64),
            "allowed": np.stack([self.allowed.get(one, none) for one in VEHICLES]),
            "walk_allowed": self.allowed.get(Category.PEDESTRIAN, nobody),
            "wanted": np.array([self.vehicles, self.walkers], dtype=np.int32),
            "seed": np.array([self.seed], dtype=np.int64),
            "lane_light": self.lights.state,
            "lane_light_since": self.lights.since,
        }


@dataclass(frozen=True, slots=True, eq=False)
class Fill:
    """Road users that a generator places; all arrays have one value for each of them.

    Attributes
    ----------
    node
        Node of the lane graph, of a pedestrian one of the pedestrian graph.
    category
        Name of the category, or its place in :class:`~odscen.base.categories.Category`.
    initial_speed
        m/s; NaN, or no array, is from rest.
    desired_speed
        m/s; NaN, or no array, is the limit, or the usual walking speed.
    goal
        Node of the same graph; -1, or no array, leaves it to the seed.
    lateral_offset
        Metres to the left of the centre line of the lane.
    depart
        Seconds.
    """

    node: Array
    category: Array
    initial_speed: Array | None = None
    desired_speed: Array | None = None
    goal: Array | None = None
    lateral_offset: Array | None = None
    depart: Array | None = None


class Generator(Protocol):
    """Places traffic on a map; one object may be asked many times."""

    def fill(
        self, graph: MapGraph, request: FillRequest, rng: np.random.Generator
    ) -> Fill | Mapping[str, Array]:
        """Fill a region.

        Parameters
        ----------
        graph
            The map, also in the request.
        request
            What is wanted, and where it may be.
        rng
            The only source of chance: it follows the scenario's seed.
        """


def request_bytes(request: FillRequest) -> bytes:
    """Write a request as an .npz file, without pickles; the same request gives the same bytes."""
    return npz_bytes(request.arrays())


def fill_from_bytes(data: bytes, *, file: str) -> Fill:
    """Read the arrays of an .npz file as a fill; what else it has is not looked at.

    Raises
    ------
    InputError
        If it is no such file, or an array is missing or malformed.
    """
    arrays = arrays_from_npz(data, file=file, only=("node", "category", *OPTIONAL))
    return fill_from_arrays(arrays, file=file)


def fill_from_arrays(arrays: Mapping[str, Array], *, file: str | None = None) -> Fill:
    """Make a fill of arrays that may be of other kinds of numbers, or be no arrays.

    Raises
    ------
    InputError
        If one is missing, has another shape, or no numbers of its kind.
    """
    given = {name: np.asarray(value) for name, value in arrays.items() if value is not None}
    for name in ("node", "category"):
        if name not in given:
            raise InputError(f"array {name!r} is missing", file=file, element=name)
    count = len(given["node"]) if given["node"].ndim == 1 else -1
    for name, array in given.items():
        if array.shape != (count,):
            raise InputError(
                f"it has shape {array.shape}, not one value for each road user",
                file=file,
                element=name,
            )
    columns = {
        name: _whole(given[name], name, file) if name in ("node", "goal") else
        _categories(given[name], file) if name == "category" else
        _numbers(given[name], name, file)
        for name in ("node", "category", *OPTIONAL)
        if name in given
    }  # fmt: skip
    return Fill(**columns)


def _whole(array: Array, name: str, file: str | None) -> Array:
    if array.dtype.kind in "iu":
        return array.astype(np.int64)
    numbers = _numbers(array, name, file)
    odd = np.flatnonzero(~(np.isnan(numbers) | (numbers == np.round(numbers))))
    if len(odd):
        raise InputError(
            f"{float(numbers[odd[0]])!r} of road user {odd[0]} is no whole number",
            file=file,
            element=name,
        )
    known = np.isfinite(numbers) & (np.abs(numbers) < 2**53)
    return np.where(known, numbers, NO_NODE).astype(np.int64)


def _numbers(array: Array, name: str, file: str | None) -> Array:
    if array.dtype.kind not in "fiu":
        raise InputError(f"it has values of {array.dtype}, not numbers", file=file, element=name)
    return array.astype(np.float64)


def _categories(array: Array, file: str | None) -> Array:
    if not len(array):  # an empty list has numbers of any kind
        return array.astype(np.str_)
    if array.dtype.kind == "S":
        return np.char.decode(array, "utf-8", "replace")
    if array.dtype.kind == "U":
        return array
    if array.dtype.kind in "iu":
        names = [*(str(one) for one in Category)]
        return np.array([names[k] if 0 <= k < len(names) else str(k) for k in array.tolist()])
    raise InputError(
        f"it has values of {array.dtype}, not names of categories or their numbers",
        file=file,
        element="category",
    )
