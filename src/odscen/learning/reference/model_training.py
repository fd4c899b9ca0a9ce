"""Training of the model of traffic on snapshots; numpy alone, one thread is enough."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from odscen.base.errors import InputError
from odscen.learning.fill import VEHICLES
from odscen.learning.reference.binned_statistics import (
    BINS,
    RATIOS,
    BinnedStatistics,
    bins_of,
)
from odscen.learning.reference.gap_states import gap_states
from odscen.learning.reference.site_features import (
    junction_columns,
    light_columns,
    traffic_columns,
)
from odscen.learning.reference.traffic_model import (
    CLASSES,
    TrafficModel,
    context,
    density_column,
    new_network,
    speed_class,
    trained,
    with_category,
)
from odscen.learning.traffic_snapshots import STOPPED

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence

    from odscen.base.arrays import BoolArray, FloatArray, IntArray
    from odscen.learning.fill import Array
    from odscen.learning.reference.site_features import Site
    from odscen.learning.traffic_snapshots import Snapshot

HIDDEN = 32
NOISE = 0.1
"""Deviation of what is added to features of roads, so that single ones are not learned by heart.

Those of traffic stay as they are: blurred, they would tell too little of a queue to go on with it.
"""


@dataclass(frozen=True, slots=True, eq=False)
class LearnedMap:
    """A map that snapshots were taken on.

    Attributes
    ----------
    site
        The map as the model sees it.
    allowed
        Shape ``(6, N)``: nodes on which a generator may put each category of vehicles.
    spacing
        Metres between nodes.
    """

    site: Site
    allowed: BoolArray
    spacing: float

    @property
    def metres(self) -> float:
        """Length of lane on which vehicles may be put."""
        return float(self.allowed.any(axis=0).sum()) * self.spacing


class Example(NamedTuple):
    """A snapshot on its map."""

    of: LearnedMap
    snapshot: Snapshot


@dataclass(frozen=True, slots=True, kw_only=True)
class TrainingSettings:
    """How a model is trained.

    Attributes
    ----------
    seed
        Of the first weights, of the order of rows and of the empty nodes that are looked at.
    epochs
        How often each row is looked at.
    empty
        Empty nodes for each vehicle; they count for all the others.
    decay
        Of weights, see :func:`~odscen.learning.reference.traffic_model.trained`.
    balance
        0 counts every vehicle of all maps alike, 1 every map.
    """

    seed: int = 0
    epochs: int = 24
    empty: float = 8.0
    decay: float = 0.0
    balance: float = 0.5


def placed(example: Example) -> BoolArray:
    """Vehicles of a snapshot that a generator may place: outside junctions, where it is allowed."""
    node, category = example.snapshot.node, example.snapshot.category
    known = np.minimum(category, len(VEHICLES) - 1)
    return np.asarray((category < len(VEHICLES)) & example.of.allowed[known, node])


def train_model(
    examples: Sequence[Example],
    *,
    settings: TrainingSettings,
    about: dict[str, Any] | None = None,
    told: Callable[[str], None] | None = None,
) -> TrafficModel:
    """Train a model.

    Parameters
    ----------
    told
        Called with what is done next.

    Raises
    ------
    InputError
        If there is no vehicle to learn from.
    """
    rng = np.random.default_rng(settings.seed)
    tell = told or (lambda _: None)
    tell("looking at snapshots")
    rows = _collect_rows(examples, settings, rng)
    x = rows.x.copy()
    fixed = examples[0].of.site.columns.shape[1]
    x[:, :fixed] += (NOISE * rng.normal(size=(len(x), fixed))).astype(np.float32)
    tell(f"learning where vehicles are, from {len(x):,} nodes")
    occupied = trained(
        new_network(x.shape[1], HIDDEN, 1, rng),
        x,
        rows.taken,
        rng,
        epochs=settings.epochs,
        weight=rows.weight,
        decay=settings.decay,
    )
    # Empty nodes were thinned out: their odds are as much smaller as that.
    occupied.weights[-1][:] += np.float32(np.log(rows.kept))
    tell(f"learning speeds, from {len(rows.speed):,} vehicles")
    vehicles = rows.taken == 1
    x = with_category(x[vehicles], rows.category).astype(np.float32)
    weight = rows.weight[vehicles]
    speed = trained(
        new_network(x.shape[1], HIDDEN, CLASSES, rng),
        x,
        rows.speed,
        rng,
        epochs=3 * settings.epochs // 2,
        weight=weight / weight.mean(),
        decay=settings.decay,
    )
    said = {"seed": settings.seed, "epochs": settings.epochs, "vehicles": len(rows.speed)}
    return TrafficModel(
        occupied,
        speed,
        _category_shares(rows),
        {**said, **(about or {})},
        binned_statistics(examples),
    )


class _Rows(NamedTuple):
    """Nodes to learn from, vehicles and empty ones; ``kept`` is the share of the empty ones."""

    x: Array
    taken: IntArray
    category: IntArray
    speed: IntArray
    context: IntArray
    weight: FloatArray
    kept: float


class _SnapshotRows(NamedTuple):
    """Rows of one snapshot; the vehicles come first."""

    x: Array
    taken: IntArray
    category: IntArray
    speed: IntArray
    context: IntArray


def _collect_rows(
    examples: Sequence[Example], settings: TrainingSettings, rng: np.random.Generator
) -> _Rows:
    counts: dict[int, int] = {}
    nodes = 0
    for example in examples:
        counts[id(example.of)] = counts.get(id(example.of), 0) + int(placed(example).sum())
        nodes += int(example.of.allowed.any(axis=0).sum())
    vehicles = sum(counts.values())
    if not vehicles:
        raise InputError("there is no vehicle in these snapshots to learn from")
    kept = min(1.0, settings.empty * vehicles / max(nodes - vehicles, 1))
    looks = [_looked_at(example, kept, rng) for example in examples]
    weight = np.concatenate(
        [
            np.full(len(look.x), float(max(counts[id(one.of)], 1)) ** -settings.balance)
            for one, look in zip(examples, looks, strict=True)
        ]
    )
    return _Rows(
        np.concatenate([look.x for look in looks]),
        np.concatenate([look.taken for look in looks]),
        np.concatenate([look.category for look in looks]),
        np.concatenate([look.speed for look in looks]),
        np.concatenate([look.context for look in looks]),
        weight / weight.mean(),
        kept,
    )


def _looked_at(example: Example, kept: float, rng: np.random.Generator) -> _SnapshotRows:
    """Features and answers of one snapshot: all vehicles, and a share of the empty nodes."""
    site, snapshot = example.of.site, example.snapshot
    good = np.flatnonzero(placed(example))
    node, first = np.unique(snapshot.node[good], return_index=True)
    category, speed = snapshot.category[good[first]], snapshot.speed[good[first]]
    states = gap_states(site.strips, node=node, category=category, speed=speed)
    empty = np.asarray(example.of.allowed.any(axis=0))
    empty[node] = False
    nowhere = np.flatnonzero(empty)
    nowhere = nowhere[rng.random(len(nowhere)) < kept]
    nodes = np.concatenate([node, nowhere])
    density = density_column(len(node), example.of.metres)
    x = np.column_stack(
        [
            site.columns[nodes],
            light_columns(site, snapshot.lights)[nodes],
            np.full(len(nodes), density),
            junction_columns(site, states)[nodes],
            traffic_columns(site, states, nodes),
        ]
    )
    limit = site.limit[node]
    return _SnapshotRows(
        x.astype(np.float32),
        (np.arange(len(nodes)) < len(node)).astype(np.int64),
        category,
        speed_class(speed, limit),
        context(site.outer[node], limit),
    )


def _category_shares(rows: _Rows) -> FloatArray:
    """Share of each category in each context; rare contexts lean on all of them."""
    counts = np.zeros((6, len(VEHICLES)))
    np.add.at(counts, (rows.context, rows.category), 1.0)
    total = counts.sum(axis=0) / counts.sum()
    smoothed = counts + 20.0 * total + 1e-3
    return np.asarray(smoothed / smoothed.sum(axis=1, keepdims=True))


def binned_statistics(examples: Iterable[Example]) -> BinnedStatistics:
    """Count vehicles of snapshots in bins."""
    nodes = np.zeros(BINS)
    speeds = np.zeros((BINS, len(RATIOS) - 1))
    categories = np.zeros((BINS, len(VEHICLES)))
    for example in examples:
        site, snapshot = example.of.site, example.snapshot
        bins = bins_of(site, snapshot.lights)
        nodes += np.bincount(bins[example.of.allowed.any(axis=0)], minlength=BINS)
        good = placed(example)
        node = snapshot.node[good]
        ratio = snapshot.speed[good] / site.limit[node]
        ratio = np.where(snapshot.speed[good] < STOPPED, 0.0, np.maximum(ratio, 0.01))
        kind = np.clip(np.digitize(ratio, RATIOS) - 1, 0, len(RATIOS) - 2)
        np.add.at(speeds, (bins[node], kind), 1.0)
        np.add.at(categories, (bins[node], snapshot.category[good]), 1.0)
    all_speeds, all_categories = speeds.sum(axis=0), categories.sum(axis=0)
    speeds += 1e-3 * all_speeds / max(all_speeds.sum(), 1.0)
    categories += 1e-3 * all_categories / max(all_categories.sum(), 1.0)
    rate = speeds.sum(axis=1) / np.maximum(nodes, 1.0)
    return BinnedStatistics(rate, speeds, categories)
