"""How alike generated traffic and SUMO's are.

Each vehicle has a row of *scene features*, :data:`FEATURES`, standardised by mean and deviation of
the reference. Over these rows

- Frechet distance of the normal distributions with their means and covariances (Dowson and
  Landau, 1982), the square: ``|m - n|^2 + tr(S + T - 2 (S T)^(1/2))``;
- MMD: squared maximum mean discrepancy (Gretton et al., 2012) with a Gaussian kernel, whose width
  is the median distance between rows of the reference; biased, so never below 0.

JSD is the Jensen-Shannon divergence in bits of histograms of one quantity, 0 to 1.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from odscen.learning.reference.gap_states import FREE, HALF_LENGTHS, gap_states
from odscen.learning.traffic_snapshots import STOPPED, SignalAhead

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from odscen.base.arrays import FloatArray, IntArray
    from odscen.lanegraph.graphs import LaneGraph
    from odscen.learning.reference.site_features import Site
    from odscen.learning.traffic_snapshots import LightView


FEATURES = (
    "gap ahead",
    "speed over limit",
    "speed of the leader",
    "stopped",
    "queue ahead",
    "distance to the junction",
    "distance from the junction",
    "vehicles ahead within about 30 m",
    "vehicles ahead within about 120 m",
    "vehicles on the lanes beside",
    "speed limit",
    "outermost lane",
    "length of the body",
    "red light ahead, and near",
    "vehicles within 25 m",
    "vehicles within 100 m",
)
"""Columns of :func:`scene_features`."""
MOST_ROWS = 800
"""Rows that a kernel is computed over; more are thinned out evenly."""
_RADII = (25.0, 100.0)
_WIDE = 1e-6


class TrafficScene(NamedTuple):
    """Vehicles on a map at one time: node, place in the categories, speed in m/s, and the lights.

    ``name`` keeps scenes apart that are the same run: intervals draw runs.
    """

    node: IntArray
    category: IntArray
    speed: FloatArray
    lights: LightView
    name: str = ""


class VehicleRows(NamedTuple):
    """What each vehicle of one scene sees.

    ``features`` has shape ``(V, 16)``; gaps and distances to the junction are in metres, without a
    leader the gap is NaN; speeds in m/s, headings in radians.
    """

    features: FloatArray
    gap: FloatArray
    speed: FloatArray
    to_junction: FloatArray
    heading: FloatArray


def scene_features(lanes: LaneGraph, site: Site, scene: TrafficScene) -> VehicleRows:
    """Look at the traffic from each vehicle."""
    from scipy.spatial import cKDTree

    node, category, speed, lights, _ = scene
    strips = site.strips
    states = gap_states(strips, node=node, category=category, speed=speed)
    to_end, limit = strips.to_end[node], site.limit[node]
    gap = states.gap[node] - HALF_LENGTHS[category]
    seen = states.leader[node] >= 0
    beside = np.zeros(len(node))
    for side in (0, 1):
        there = site.beside[node, side]
        row = np.maximum(there, 0)
        beside += np.where(there >= 0, states.near[row] + ~np.isnan(states.speed[row]), 0.0)
    red = lights.state[site.lane[strips.root[node]]] == SignalAhead.RED
    places = np.column_stack([lanes.x[node], lanes.y[node]])
    tree = cKDTree(places) if len(node) else None
    around = [
        np.array(tree.query_ball_point(places, radius, return_length=True)) - 1.0
        if tree is not None
        else np.empty(0)
        for radius in _RADII
    ]
    features = np.column_stack(
        [
            np.log1p(np.clip(np.where(seen, gap, FREE), 0.0, FREE)),
            speed / limit,
            np.where(seen, states.leader[node] / limit, 1.0),
            speed < STOPPED,
            np.minimum(states.queue[node], 10.0),
            np.log1p(to_end),
            np.log1p(np.minimum(strips.from_start[node], 1000.0)),
            states.near[node],
            states.far[node],
            beside,
            limit / 10.0,
            site.outer[node],
            2.0 * HALF_LENGTHS[category],
            red * np.exp(-to_end / 50.0),
            np.minimum(around[0], 20.0),
            np.minimum(around[1], 60.0),
        ]
    ).astype(np.float64)
    return VehicleRows(features, np.where(seen, gap, np.nan), speed, to_end, lanes.hdg[node])


def together(rows: Sequence[VehicleRows]) -> VehicleRows:
    """Rows of several scenes as one."""
    return VehicleRows(*(np.concatenate(arrays) for arrays in zip(*rows, strict=True)))


def frechet_distance(reference: FloatArray, other: FloatArray) -> float:
    """Frechet distance of two sets of rows, standardised by the reference.

    NaN of fewer than two rows, which have no covariance.
    """
    from scipy.linalg import sqrtm

    if min(len(reference), len(other)) < 2:
        return float("nan")
    one, two = _standardize_rows(reference, other)
    means = one.mean(axis=0) - two.mean(axis=0)
    first, second = np.cov(one.T), np.cov(two.T)
    root = np.real(sqrtm(first @ second + _WIDE * np.eye(len(first))))
    return max(float(means @ means + np.trace(first + second - 2.0 * root)), 0.0)


def mean_discrepancy(reference: FloatArray, other: FloatArray) -> float:
    """Squared maximum mean discrepancy of two sets of rows, standardised by the reference."""
    from scipy.spatial.distance import cdist

    one, two = (_thin_rows(rows) for rows in _standardize_rows(reference, other))
    squares = cdist(one, one, "sqeuclidean")
    width = max(float(np.median(squares[squares > 0])) if np.any(squares > 0) else 1.0, _WIDE)
    within, other_within, between = (
        np.exp(-found / width).mean()
        for found in (squares, cdist(two, two, "sqeuclidean"), cdist(one, two, "sqeuclidean"))
    )
    return max(float(within + other_within - 2.0 * between), 0.0)


def divergence(reference: FloatArray, other: FloatArray, bounds: FloatArray) -> float:
    """Jensen-Shannon divergence of two samples in bits, over bins; beyond them counts as the ends.

    NaN without a value in one of them.
    """
    shares = []
    for values in (reference, other):
        known = values[~np.isnan(values)]
        counts, _ = np.histogram(np.clip(known, bounds[0], bounds[-1]), bounds)
        if not counts.sum():
            return float("nan")
        shares.append(counts / counts.sum())
    middle = (shares[0] + shares[1]) / 2.0
    return float(sum(_entropy_to(share, middle) for share in shares) / 2.0)


GAP_BINS = np.concatenate([[-1.0], np.linspace(0.0, 20.0, 11), np.linspace(30.0, 150.0, 7)])
SPEED_BINS = np.concatenate([[0.0, STOPPED], np.arange(1.0, 41.0)])
DISTANCE_BINS = np.concatenate([np.arange(0.0, 100.0, 10.0), np.linspace(100.0, 500.0, 9)])
HEADING_BINS = np.linspace(-np.pi, np.pi, 13)


def turned(hdg: FloatArray) -> FloatArray:
    """Headings between -pi and pi."""
    found: FloatArray = np.angle(np.exp(1j * hdg))
    return found


MEASURES: dict[str, Callable[[VehicleRows, VehicleRows], float]] = {
    "frechet": lambda one, two: frechet_distance(one.features, two.features),
    "mmd": lambda one, two: mean_discrepancy(one.features, two.features),
    "jsd_gap": lambda one, two: divergence(one.gap, two.gap, GAP_BINS),
    "jsd_speed": lambda one, two: divergence(one.speed, two.speed, SPEED_BINS),
    "jsd_junction": lambda one, two: divergence(one.to_junction, two.to_junction, DISTANCE_BINS),
    "jsd_heading": lambda one, two: divergence(
        turned(one.heading), turned(two.heading), HEADING_BINS
    ),
    "stopped": lambda _, two: float(np.mean(two.speed < STOPPED)),
}
"""Functions of the rows of the reference and of the traffic that is measured."""


def novelty(scenes: Sequence[TrafficScene], known: Sequence[TrafficScene], *, near: int) -> float:
    """Share of vehicles that no single known scene has within ``near`` nodes of the same lane.

    For each scene the known one that has most of its vehicles counts: 0 is a copy of it. Node
    numbers of a lane follow each other. NaN without vehicles or known scenes.
    """
    shares = []
    for scene in scenes:
        if not len(scene.node) or not known:
            continue
        best = 1.0
        for other in known:
            ordered = np.sort(other.node)
            if len(ordered):
                place = np.clip(np.searchsorted(ordered, scene.node), 1, len(ordered) - 1)
                place = np.minimum(place, len(ordered) - 1)
                far = np.minimum(
                    np.abs(ordered[place] - scene.node),
                    np.abs(ordered[np.maximum(place - 1, 0)] - scene.node),
                )
                best = min(best, float(np.mean(far > near)))
        shares.append(best)
    return float(np.mean(shares)) if shares else float("nan")


def interval(
    scenes: Sequence[TrafficScene],
    measure: Callable[[Sequence[int]], float],
    *,
    draws: int = 40,
    level: float = 0.9,
    seed: int = 0,
) -> tuple[float, float]:
    """Bootstrap interval of a measure over scenes; scenes of one run are drawn together.

    Parameters
    ----------
    measure
        Of the places of the scenes drawn.
    draws
        How many. Those of which the measure is NaN do not count; without any that does the
        interval is not known (NaN).
    """
    if not draws:
        return float("nan"), float("nan")
    rng = np.random.default_rng(seed)
    groups: dict[str, list[int]] = {}
    for place, scene in enumerate(scenes):
        groups.setdefault(scene.name or str(place), []).append(place)
    members = list(groups.values())
    found = []
    for _ in range(draws):
        chosen = rng.integers(len(members), size=len(members))
        found.append(measure([place for drawn in chosen for place in members[drawn]]))
    known = [value for value in found if not math.isnan(value)]
    if not known:
        return float("nan"), float("nan")
    low, high = np.quantile(known, [(1 - level) / 2, (1 + level) / 2]).tolist()
    return float(low), float(high)


def _standardize_rows(reference: FloatArray, other: FloatArray) -> tuple[FloatArray, FloatArray]:
    mean, spread = reference.mean(axis=0), reference.std(axis=0)
    # A feature that does not vary in the reference would otherwise count without bounds.
    spread = np.where(spread > _SMALLEST, spread, 1.0)
    return (reference - mean) / spread, (other - mean) / spread


_SMALLEST = 1e-3


def _thin_rows(rows: FloatArray) -> FloatArray:
    if len(rows) <= MOST_ROWS:
        return rows
    return rows[np.linspace(0, len(rows) - 1, MOST_ROWS).astype(np.int64)]


def _entropy_to(shares: FloatArray, middle: FloatArray) -> float:
    some = shares > 0
    return float(np.sum(shares[some] * np.log2(shares[some] / middle[some])))
