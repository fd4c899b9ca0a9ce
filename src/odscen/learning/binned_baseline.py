"""Baselines beside the reference generator: binned statistics, which know each node on its own."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from odscen.learning.fill import VEHICLES
from odscen.learning.reference.model_training import placed
from odscen.learning.reference.reference_generator import PlacedTraffic
from odscen.learning.traffic_snapshots import STOPPED

if TYPE_CHECKING:
    from collections.abc import Iterable

    from odscen.base.arrays import BoolArray, FloatArray, IntArray
    from odscen.learning.reference.model_training import Example
    from odscen.learning.reference.site_features import Site
    from odscen.learning.traffic_snapshots import LightView

_TO_END = (10.0, 20.0, 35.0, 60.0, 120.0)
_LIMITS = (10.0, 17.0)
_RATIOS = np.concatenate([[0.0, 0.005], np.linspace(0.05, 1.4, 28)])
APART = 1.0
"""Free metres kept between bodies."""
_TRIES = 6


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


def bins_of(site: Site, lights: LightView) -> IntArray:
    """Bin of each node, shape ``(N,)``."""
    state = lights.state[site.lane[site.strips.root]].astype(np.int64)
    place = np.digitize(site.strips.to_end, _TO_END)
    limit = np.digitize(site.limit, _LIMITS)
    found: IntArray = ((place * 4 + state) * 3 + limit) * 2 + site.outer
    return found


BINS = (len(_TO_END) + 1) * 4 * 3 * 2


def binned_statistics(examples: Iterable[Example]) -> BinnedStatistics:
    """Count vehicles of snapshots in bins."""
    nodes = np.zeros(BINS)
    speeds = np.zeros((BINS, len(_RATIOS) - 1))
    categories = np.zeros((BINS, len(VEHICLES)))
    for example in examples:
        site, snapshot = example.of.site, example.snapshot
        bins = bins_of(site, snapshot.lights)
        nodes += np.bincount(bins[example.of.allowed.any(axis=0)], minlength=BINS)
        good = placed(example)
        node = snapshot.node[good]
        ratio = snapshot.speed[good] / site.limit[node]
        ratio = np.where(snapshot.speed[good] < STOPPED, 0.0, np.maximum(ratio, 0.01))
        kind = np.clip(np.digitize(ratio, _RATIOS) - 1, 0, len(_RATIOS) - 2)
        np.add.at(speeds, (bins[node], kind), 1.0)
        np.add.at(categories, (bins[node], snapshot.category[good]), 1.0)
    all_speeds, all_categories = speeds.sum(axis=0), categories.sum(axis=0)
    speeds += 1e-3 * all_speeds / max(all_speeds.sum(), 1.0)
    categories += 1e-3 * all_categories / max(all_categories.sum(), 1.0)
    return BinnedStatistics(speeds.sum(axis=1) / np.maximum(nodes, 1.0), speeds, categories)


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
    rate = statistics.rate[bins] * allowed.any(axis=0)
    chosen: dict[int, int] = {}
    if rate.sum() > 0:
        order = rng.choice(len(rate), size=min(_TRIES * wanted, int((rate > 0).sum())),
                           replace=False, p=rate / rate.sum())  # fmt: skip
        for place in order.tolist():
            if len(chosen) == wanted:
                break
            odds = statistics.categories[bins[place]] * allowed[:, place]
            kind_of = int(rng.choice(len(odds), p=odds / odds.sum()))
            if _free(site, place, kind_of, chosen, lengths):
                chosen[place] = kind_of
    nodes = np.array(list(chosen), dtype=np.int64)
    category = np.array(list(chosen.values()), dtype=np.int64)
    kinds = statistics.speeds[bins[nodes]]
    ends = np.cumsum(kinds, axis=1)
    kind = (ends <= (rng.random(len(nodes)) * ends[:, -1])[:, None]).sum(axis=1)
    low, high = _RATIOS[kind], _RATIOS[kind + 1]
    ratio = low + (high - low) * rng.random(len(nodes))
    speed = np.where(kind == 0, 0.0, np.maximum(ratio * site.limit[nodes], STOPPED))
    return PlacedTraffic(nodes, category, speed)


def _free(
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
