"""Binned statistics: traffic by the rates, speeds and categories that places of its kind have.

Rates know nothing of other vehicles, so they begin no queue that nothing has caused. They are what
the reference generator falls back to, and the baseline beside it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple, Self

import numpy as np

from odscen.base.errors import InputError
from odscen.learning.fill import VEHICLES
from odscen.learning.traffic_snapshots import STOPPED

if TYPE_CHECKING:
    from collections.abc import Mapping

    from odscen.base.arrays import BoolArray, FloatArray, IntArray
    from odscen.learning.fill import Array
    from odscen.learning.reference.site_features import Site
    from odscen.learning.traffic_snapshots import LightView


class PlacedTraffic(NamedTuple):
    """Vehicles on nodes; speeds in m/s."""

    node: IntArray
    category: IntArray
    speed: FloatArray


NOBODY = PlacedTraffic(np.empty(0, dtype=np.int64), np.empty(0, dtype=np.int64), np.empty(0))


_TO_END = (10.0, 20.0, 35.0, 60.0, 120.0)
_LIMITS = (10.0, 17.0)
RATIOS = np.concatenate([[0.0, 0.005], np.linspace(0.05, 1.4, 28)])
"""Bounds of the classes of speed over limit."""
APART = 1.0
"""Free metres kept between bodies."""
PREFIX = "statistics_"
"""Of the names of arrays in a file."""
_TRIES = 6
_MOST_COUNTED = 1e12


@dataclass(frozen=True, slots=True, eq=False)
class BinnedStatistics:
    """Rates and speeds by distance to the end of the road, light, speed limit and outer lane.

    Attributes
    ----------
    rate
        Shape ``(B,)``: vehicles for each node and snapshot.
    speeds
        Shape ``(B, C)``: counts of classes of speed over limit, stopped first.
    categories
        Shape ``(B, 6)``: counts of categories.
    """

    rate: FloatArray
    speeds: FloatArray
    categories: FloatArray

    @classmethod
    def from_arrays(cls, arrays: Mapping[str, Array]) -> Self:
        """Inverse of :meth:`to_arrays`.

        Raises
        ------
        InputError
            If an array is missing, is not of its shape, or has values that are no counts.
        """
        shapes = {
            "rate": (BINS,), "speeds": (BINS, len(RATIOS) - 1), "categories": (BINS, len(VEHICLES))
        }  # fmt: skip
        found = []
        for name, shape in shapes.items():
            array = arrays.get(PREFIX + name)
            if array is None:
                raise InputError(f"there are no statistics {name}")
            if array.shape != shape:
                raise InputError(f"statistics {name} have shape {array.shape}, not {shape}")
            if array.dtype.kind != "f" or not ((array >= 0.0) & (array <= _MOST_COUNTED)).all():
                raise InputError(f"statistics {name} are no numbers from 0 to {_MOST_COUNTED:g}")
            found.append(array.astype(np.float64))
        return cls(*found)

    def to_arrays(self) -> dict[str, Array]:
        """Arrays of a file of weights, float32."""
        arrays = {"rate": self.rate, "speeds": self.speeds, "categories": self.categories}
        return {PREFIX + name: array.astype(np.float32) for name, array in arrays.items()}


def bins_of(site: Site, lights: LightView) -> IntArray:
    """Bin of each node, shape ``(N,)``."""
    state = lights.state[site.lane[site.strips.root]].astype(np.int64)
    place = np.digitize(site.strips.to_end, _TO_END)
    limit = np.digitize(site.limit, _LIMITS)
    found: IntArray = ((place * 4 + state) * 3 + limit) * 2 + site.outer
    return found


BINS = (len(_TO_END) + 1) * 4 * 3 * 2


def place_binned(
    statistics: BinnedStatistics,
    site: Site,
    lights: LightView,
    allowed: BoolArray,
    *,
    wanted: int,
    lengths: FloatArray,
    rng: np.random.Generator,
) -> PlacedTraffic:
    """Place vehicles by the rates of their bins, none into another; parameters as of the model."""
    bins = bins_of(site, lights)
    # A lane may be open to kinds alone of which the statistics have seen none, in no bin.
    known = (statistics.categories[bins].T * allowed).any(axis=0)
    rate = statistics.rate[bins] * known
    chosen: dict[int, int] = {}
    if rate.sum() > 0:
        order = rng.choice(len(rate), size=min(_TRIES * wanted, int((rate > 0).sum())),
                           replace=False, p=rate / rate.sum())  # fmt: skip
        for place in order.tolist():
            if len(chosen) == wanted:
                break
            odds = statistics.categories[bins[place]] * allowed[:, place]
            kind_of = int(rng.choice(len(odds), p=odds / odds.sum()))
            if _is_free(site, place, kind_of, chosen, lengths):
                chosen[place] = kind_of
    nodes = np.array(list(chosen), dtype=np.int64)
    category = np.array(list(chosen.values()), dtype=np.int64)
    kinds = statistics.speeds[bins[nodes]]
    ends = np.cumsum(kinds, axis=1)
    kind = (ends <= (rng.random(len(nodes)) * ends[:, -1])[:, None]).sum(axis=1)
    low, high = RATIOS[kind], RATIOS[kind + 1]
    ratio = low + (high - low) * rng.random(len(nodes))
    speed = np.where(kind == 0, 0.0, np.maximum(ratio * site.limit[nodes], STOPPED))
    return PlacedTraffic(nodes, category, speed)


def _is_free(
    site: Site, node: int, category: int, chosen: dict[int, int], lengths: FloatArray
) -> bool:
    """Whether no vehicle on the same lane overlaps; nodes of a lane follow each other."""
    reach = int(np.ceil((lengths.max() + APART) / 2.0)) + 2
    for other in range(node - reach, node + reach + 1):
        if other in chosen and site.lane[other] == site.lane[node]:
            metres = abs(site.strips.to_end[other] - site.strips.to_end[node])
            if metres < (lengths[category] + lengths[chosen[other]]) / 2.0 + APART:
                return False
    return True
