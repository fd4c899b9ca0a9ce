"""The generator that ships with odscen: ``--generator reference``.

A vehicle on its way has mostly changed to the lane that its route needs. A goal drawn for one that
has just been put on the road knows nothing of that, and makes it brake hard before the junction at
which it is on the wrong lane.
"""

from __future__ import annotations

import logging
from functools import cache, lru_cache
from importlib.resources import files
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra

from odscen.base.categories import Category
from odscen.lanegraph.graphs import Relation
from odscen.lanegraph.shortest_paths import Router
from odscen.learning.fill import VEHICLES, Fill
from odscen.learning.reference.binned_statistics import NOBODY, PlacedTraffic, place_binned
from odscen.learning.reference.gap_states import GapStates
from odscen.learning.reference.site_features import (
    junction_columns,
    light_columns,
    site_of,
    traffic_columns,
)
from odscen.learning.reference.traffic_model import (
    context,
    density_column,
    least_speeds,
    logistic,
    model_from_bytes,
    softmax,
    speed_within,
    with_category,
)
from odscen.learning.safe_speeds import STANDING_GAP, safe_speed
from odscen.learning.traffic_snapshots import SignalAhead
from odscen.scenario.checks.actor_checks import SPEED_MAX

if TYPE_CHECKING:
    from odscen.base.arrays import BoolArray, FloatArray, IntArray
    from odscen.lanegraph.graphs import LaneGraph, MapGraph, PedestrianGraph
    from odscen.learning.fill import Array, FillRequest
    from odscen.learning.reference.site_features import Site
    from odscen.learning.reference.traffic_model import TrafficModel
    from odscen.learning.traffic_snapshots import LightView


NO_GOAL = -1
TRIES = 32
"""Goals that are tried for all vehicles together."""
AHEAD = 120.0
"""Metres that a vehicle follows its lane at least, where a goal allows it."""
SECONDS = 8.0
"""And for how long at its speed."""
BRAKING = 4.0
"""m/s² with which a vehicle slows down at most for a bend on the way to its goal."""
_SIDEWAYS = 5.5
"""m/s² across the driving direction that limit the speed in a bend inside a junction."""
_SLOWEST = 2.0
"""m/s; no bend is slower."""
_CHANGE = 30.0
"""Metres that a lane change counts as on the way to a goal."""


def onward_goals(
    graph: MapGraph,
    roads: BoolArray,
    *,
    node: IntArray,
    speed: FloatArray,
    rng: np.random.Generator,
) -> IntArray:
    """Draw goals among the ends of the region, or of its lanes where it has none.

    Parameters
    ----------
    roads
        Shape ``(N,)``: nodes of the region.
    node, speed
        Of each vehicle; m/s.

    Returns
    -------
    Node for each vehicle, :data:`NO_GOAL` where none of those tried can be reached.
    """
    lanes = graph.lanes
    router = Router(graph, roads)
    ends = np.flatnonzero(roads)[router.out_degree == 0]
    on_lanes = _last_nodes(lanes, roads)
    found = np.full(len(node), NO_GOAL, dtype=np.int64)
    onwards = _LanesOnwards.of(lanes, roads)
    wanted = np.maximum(AHEAD, SECONDS * speed)
    for pool in (ends, on_lanes):
        open_ = np.flatnonzero(found == NO_GOAL)
        goals = rng.permutation(pool)[:TRIES]
        if not len(open_) or not len(goals):
            continue
        free = onwards.free_metres(node[open_], goals, wanted[open_], speed[open_])
        row, table = router.reach(node[open_].astype(np.int32), goals.astype(np.int32))
        free[~table[row].T | (goals[:, None] == node[open_])] = -1.0
        order = rng.permuted(np.tile(np.arange(len(goals)), (len(open_), 1)), axis=1).T
        best = np.argmax(np.take_along_axis(free, order, axis=0), axis=0)
        chosen = order[best, np.arange(len(open_))]
        leads = free[chosen, np.arange(len(open_))] >= 0.0
        found[open_[leads]] = goals[chosen[leads]]
    return found


def _last_nodes(lanes: LaneGraph, roads: BoolArray) -> IntArray:
    """Last node of each lane outside junctions, where it is in the region."""
    outside = np.array([name is None for name in lanes.lanes.junctions], dtype=np.bool_)
    last = lanes.lanes.first_node[1:].astype(np.int64) - 1
    some = lanes.lanes.first_node[1:] > lanes.lanes.first_node[:-1]
    last = last[outside & some]
    return last[roads[last]]


class _LanesOnwards(NamedTuple):
    """Lanes of a region and where they lead; lanes are numbered as in the lane graph."""

    lanes: LaneGraph
    section: IntArray
    back: csr_array
    passing: FloatArray

    @classmethod
    def of(cls, lanes: LaneGraph, roads: BoolArray) -> _LanesOnwards:
        inside = roads[lanes.source] & roads[lanes.target]
        one, other = lanes.lane[lanes.source[inside]], lanes.lane[lanes.target[inside]]
        follows = lanes.relation[inside] == Relation.SUCCESSOR
        kept = one != other
        length = np.maximum(lanes.lanes.lengths, 0.1)
        cost = np.where(follows, length[other], _CHANGE)[kept]
        count = len(length)
        pairs = one[kept].astype(np.int64) * count + other[kept]
        order = np.lexsort((cost, pairs))
        pairs, first = np.unique(pairs[order], return_index=True)
        where = (pairs % count, pairs // count)
        names = [(key.road, key.section) for key in lanes.lanes.keys]
        rows = {name: row for row, name in enumerate(dict.fromkeys(names))}
        section = np.array([rows[name] for name in names], dtype=np.int64)
        back = csr_array((cost[order][first], where), shape=(count, count))
        return cls(lanes, section, back, _passing_speeds(lanes))

    def free_metres(
        self, node: IntArray, goals: IntArray, wanted: FloatArray, speed: FloatArray
    ) -> FloatArray:
        """Metres to the first lane change of each vehicle on its way to each goal, ``(K, V)``.

        Or to the first bend that it is too fast for. At most ``wanted``, which ``(V,)`` vehicles
        have; all of it to the goal without either.
        """
        lanes = self.lanes
        targets = lanes.lane[goals].astype(np.int64)
        _, ahead = dijkstra(self.back, indices=targets, return_predecessors=True)
        at = np.tile(lanes.lane[node].astype(np.int64), (len(goals), 1))
        rows = np.arange(len(goals))[:, None]
        metres = np.tile(lanes.lanes.lengths[at[0]] - lanes.offset[node], (len(goals), 1))
        going = metres < wanted
        while going.any():
            there = ahead[rows, at]
            arrived = there < 0
            beside = ~arrived & (self.section[at] == self.section[np.maximum(there, 0)])
            slow = self.passing[np.maximum(there, 0)]
            fast = ~arrived & (speed**2 > slow**2 + 2.0 * BRAKING * metres)
            metres = np.where(going & arrived, wanted, metres)
            metres = np.where(going & fast, 0.0, metres)
            going &= ~arrived & ~beside & ~fast
            at = np.where(going, there, at)
            metres = np.where(going, metres + lanes.lanes.lengths[at], metres)
            going &= metres < wanted
        found: FloatArray = np.minimum(metres, wanted)
        return found


def _passing_speeds(lanes: LaneGraph) -> FloatArray:
    """Speed at which each lane is driven, m/s: its limit, inside junctions less in bends."""
    count = len(lanes.lanes.keys)
    nodes = np.maximum(np.bincount(lanes.lane, minlength=count), 1)
    bend = np.bincount(lanes.lane, weights=np.abs(lanes.curvature), minlength=count) / nodes
    limit = np.full(count, np.inf)
    known = ~np.isnan(lanes.speed_limit)
    np.minimum.at(limit, lanes.lane[known], lanes.speed_limit[known])
    inside = np.array([name is not None for name in lanes.lanes.junctions], dtype=np.bool_)
    turning = np.where(inside, np.sqrt(_SIDEWAYS / np.maximum(bend, 1e-6)), np.inf)
    found: FloatArray = np.maximum(np.minimum(limit, turning), _SLOWEST)
    return found


WEIGHTS = "reference_model.npz"
PASSES = 13
BEFORE = 3
"""Passes after which what is behind junctions is as in traffic."""
BACK = 0.6
"""Share of the last step of the wish that the next may be, if it goes the other way."""
DENSER = 1.0
"""By how much the feature of density is changed at most, to have as many as are wanted."""
UNLIKE = 1.0
"""Logarithm of how much denser traffic it is told of, from which on a map is unlike the data.

In the mean over the passes it is at most 0.7 on varied towns and 0.8 on one with six vehicles;
mostly 1.0 to 2.0 where a motorway, or a road without a junction, is all that there is.
"""
MORE = 1.05
"""Share of the vehicles wanted that a pass may place at most; those too many are taken away."""
SHARPNESS = 2.0
"""Power of the shares of speeds of those who move: what is rare is often what nobody drives."""
GAP = 0.7
"""Metres between bodies, at least."""
_FACTOR = (1.0, 0.1, 0.75, 1.2)
"""Desired speed over the limit: mean, deviation, least and most, as sampling draws it."""
_CYCLING = (5.0, 1.0, 2.5, 9.0)


class ReferenceGenerator:
    """Places vehicles as they are in SUMO's traffic, queues before red lights included.

    Parameters
    ----------
    model
        What was learned; the model that ships if not given.
    """

    def __init__(self, model: TrafficModel | None = None) -> None:
        self._model = model or shipped_model()

    def fill(self, graph: MapGraph, request: FillRequest, rng: np.random.Generator) -> Fill:
        """Place vehicles and pedestrians; see :class:`~odscen.learning.fill.Generator`."""
        none = np.zeros(len(graph.lanes.x), dtype=np.bool_)
        allowed = np.stack([request.allowed.get(category, none) for category in VEHICLES])
        lengths = np.array([request.bodies[category].length for category in VEHICLES])
        site = _make_site(graph.lanes, graph.walks)
        traffic = place_traffic(
            self._model, site, request.lights, allowed,
            spacing=graph.lanes.spacing, wanted=request.vehicles, lengths=lengths, rng=rng,
        )  # fmt: skip
        desired = draw_desired_speeds(traffic, site.limit[traffic.node], rng)
        goal = onward_goals(graph, request.roads, node=traffic.node, speed=traffic.speed, rng=rng)
        walkers = _draw_walkers(request, rng)
        return fill_with_walkers(traffic, desired, goal, walkers)


def fill_with_walkers(
    traffic: PlacedTraffic, desired: FloatArray, goal: IntArray, walkers: IntArray
) -> Fill:
    """Put vehicles and pedestrians into one fill.

    Parameters
    ----------
    desired, goal
        Shape ``(V,)``: desired speeds of the vehicles, m/s, and nodes of their goals.
    walkers
        Shape ``(P,)``: nodes of the pedestrian graph.
    """
    rest = np.full(len(walkers), np.nan)
    return Fill(
        node=np.concatenate([traffic.node, walkers]),
        category=np.concatenate(
            [names_of(traffic.category), np.full(len(walkers), str(Category.PEDESTRIAN))]
        ),
        initial_speed=np.concatenate([traffic.speed, rest]),
        desired_speed=np.concatenate([desired, rest]),
        goal=np.concatenate([goal, np.full(len(walkers), NO_GOAL)]),
    )


def road_limits(graph: MapGraph) -> FloatArray:
    """Speed at which each node of the lane graph is driven at most, shape ``(N,)``, m/s."""
    return _make_site(graph.lanes, graph.walks).limit


def names_of(category: IntArray) -> Array:
    """Names of categories by their places."""
    return np.array([str(category) for category in Category])[category]


@cache
def shipped_model() -> TrafficModel:
    """Read the model that ships with odscen."""
    data = files("odscen.learning.reference").joinpath(WEIGHTS).read_bytes()
    return model_from_bytes(data, file=WEIGHTS)


def place_traffic(
    model: TrafficModel,
    site: Site,
    lights: LightView,
    allowed: BoolArray,
    *,
    spacing: float,
    wanted: int,
    lengths: FloatArray,
    rng: np.random.Generator,
) -> PlacedTraffic:
    """Place about as many vehicles as are wanted, never more.

    The whole map is placed several times, with another wish for more, until the number is close.
    What is behind a junction is what the time before has put there.

    Parameters
    ----------
    allowed
        Shape ``(6, N)``: nodes on which each category may be.
    spacing
        Metres between nodes.
    lengths
        Shape ``(6,)``: of the bodies, metres.
    """
    metres = float(allowed.any(axis=0).sum()) * spacing
    density = np.full(len(site.limit), density_column(wanted, metres))
    fixed = np.column_stack([site.columns, light_columns(site, lights), density])
    draw = _Draw(model, site, lights, allowed, lengths, fixed)
    wish, best, most, last = 0.0, NOBODY, 2.0, 0.0
    states, wishes = GapStates.empty(len(site.limit)), list[float]()
    for number in range(PASSES if wanted else 0):
        states, found = draw.traffic(wish, states, rng)
        if number >= BEFORE and _distance_from_wanted(found, wanted) < _distance_from_wanted(
            best, wanted
        ):
            best = found
        if number >= BEFORE and wanted <= len(found.node) <= MORE * wanted + 1.0:
            break
        aim = (1.0 + MORE) / 2.0 * wanted
        step = 1.2 * np.log((aim + 0.5) / (len(found.node) + 0.5))
        # Vehicles attract others, so that a little more may be many more: go back by less.
        most = most * BACK if step * last < 0.0 else most
        last = float(np.clip(step, -most, most))
        wish += last
        wishes.append(wish)
    # A single pass may have as many as are wanted in a queue that nothing has caused.
    asked = float(np.mean(wishes)) if wishes else 0.0
    if asked >= UNLIKE:
        words = (
            "the reference generator had to be asked for traffic %.1f times as dense as is wanted: "
            "the map, or so much traffic on it, is unlike what it has learned from, so vehicles "
            "are placed by binned statistics; --warm-up 30 lets them find their places"
        )
        logging.getLogger("odscen").warning(words, np.exp(asked))
        binned = place_binned(
            model.statistics, site, lights, allowed, wanted=wanted, lengths=lengths, rng=rng
        )
        if len(binned.node):
            return binned
    keep = np.sort(rng.permutation(len(best.node))[:wanted])
    return PlacedTraffic(best.node[keep], best.category[keep], best.speed[keep])


def _distance_from_wanted(found: PlacedTraffic, wanted: int) -> float:
    """How far a pass is from the number wanted: too few cannot be mended, too many can."""
    more = len(found.node) - wanted
    return -3.0 * more if more < 0 else more


class _Draw(NamedTuple):
    """All that one pass over the strips needs."""

    model: TrafficModel
    site: Site
    lights: LightView
    allowed: BoolArray
    lengths: FloatArray
    fixed: FloatArray

    def traffic(
        self, wish: float, before: GapStates, rng: np.random.Generator
    ) -> tuple[GapStates, PlacedTraffic]:
        """Place vehicles row after row, from the stop lines backwards.

        Parameters
        ----------
        wish
            Logarithm of how much denser traffic the model is told of than is wanted: it knows where
            more goes, into queues rather than onto empty lanes. Beyond what :data:`DENSER` allows
            the odds of all nodes are raised alike.
        before
            Traffic as it may be behind junctions.
        """
        site, states = self.site, GapStates.empty(len(self.site.limit))
        denser = float(np.clip(wish / 2.0, -DENSER, DENSER))
        bias = wish - 2.0 * denser
        fixed = np.column_stack([self.fixed, junction_columns(site, before)])
        fixed[:, self.fixed.shape[1] - 1] += denser
        anywhere = np.asarray(self.allowed.any(axis=0))
        found: list[PlacedTraffic] = []
        for row in site.strips.rows:
            states.advance(site.strips, row)
            free = row[anywhere[row] & (states.gap[row] > self.lengths.min() / 2.0 + GAP)]
            if not len(free):
                continue
            x = np.column_stack([fixed[free], traffic_columns(site, states, free)])
            chance = logistic(self.model.occupied(x)[:, 0] + bias)
            hit = np.flatnonzero(rng.random(len(free)) < chance)
            if len(hit):
                placed = self._draw_vehicles(free[hit], x[hit], states, rng)
                states.put(placed.node, placed.category, placed.speed)
                found.append(placed)
        if not found:
            return states, NOBODY
        return states, PlacedTraffic(*(np.concatenate(pair) for pair in zip(*found, strict=True)))

    def _draw_vehicles(
        self, nodes: IntArray, x: FloatArray, states: GapStates, rng: np.random.Generator
    ) -> PlacedTraffic:
        """Category and speed of vehicles on nodes; without one that fits there is none."""
        limit = self.site.limit[nodes]
        shares = self.model.categories[context(self.site.outer[nodes], limit)]
        fits = self.lengths[None, :] / 2.0 + GAP <= states.gap[nodes][:, None]
        shares = shares * (self.allowed[:, nodes].T & fits)
        some = shares.sum(axis=1) > 0
        nodes, x, limit, shares = nodes[some], x[some], limit[some], shares[some]
        category = _draw_columns(shares, rng)
        most = np.minimum(
            self._stoppable_speeds(nodes, category), self._safe_speeds(nodes, category, states)
        )
        logits = self.model.speed(with_category(x, category)).astype(np.float64)
        odds = _sharpen_shares(softmax(logits))
        # Those who would be too fast are none of the slower ones at the limit of what is safe.
        odds = np.where(least_speeds(limit) < most[:, None], odds, 0.0)
        odds[:, 0] = np.maximum(odds[:, 0], 1e-9)
        speed = speed_within(_draw_columns(odds, rng), limit, rng.random(len(nodes)))
        return PlacedTraffic(nodes, category, np.minimum(speed, most))

    def _safe_speeds(self, nodes: IntArray, category: IntArray, states: GapStates) -> FloatArray:
        """Krauss's safe speed behind the leader on the strip, m/s."""
        gap = states.gap[nodes] - self.lengths[category] / 2.0
        leader = states.leader[nodes]
        safe = safe_speed(gap - STANDING_GAP, np.maximum(leader, 0.0))
        return np.where(leader >= 0.0, safe, np.inf)

    def _stoppable_speeds(self, nodes: IntArray, category: IntArray) -> FloatArray:
        """Krauss's safe speed before a red light, m/s: that at which SUMO's drivers approach it."""
        root = self.site.strips.root[nodes]
        red = self.lights.state[self.site.lane[root]] == SignalAhead.RED
        metres = self.site.to_line[nodes] - self.lengths[category] / 2.0
        return np.where(red & (metres > -1.0), safe_speed(metres, 0.0), np.inf)


def _sharpen_shares(odds: FloatArray) -> FloatArray:
    """Raise the shares of speeds to a power, but for the share of those who are stopped."""
    moving = odds[:, 1:] ** SHARPNESS
    total = np.maximum(moving.sum(axis=1, keepdims=True), 1e-12)
    found: FloatArray = np.column_stack([odds[:, 0], moving / total * (1.0 - odds[:, :1])])
    return found


def _draw_columns(shares: FloatArray, rng: np.random.Generator) -> IntArray:
    """Draw a column for each row, by the shares in it."""
    ends = np.cumsum(shares, axis=1)
    at = rng.random(len(shares)) * ends[:, -1]
    found: IntArray = np.minimum((ends <= at[:, None]).sum(axis=1), shares.shape[1] - 1)
    return found


def draw_desired_speeds(
    traffic: PlacedTraffic, limit: FloatArray, rng: np.random.Generator
) -> FloatArray:
    """Draw desired speeds, m/s: about the limit, never below the speed at departure.

    Parameters
    ----------
    limit
        Shape ``(V,)``, m/s.
    """
    count = len(traffic.node)
    mean, spread, low, high = _FACTOR
    motor = np.clip(rng.normal(mean, spread, count), low, high) * limit
    mean, spread, low, high = _CYCLING
    cycling = np.clip(rng.normal(mean, spread, count), low, high)
    bicycle = traffic.category == [*Category].index(Category.BICYCLE)
    wanted = np.maximum(np.where(bicycle, cycling, motor), traffic.speed)
    most = np.array([SPEED_MAX[category] for category in VEHICLES])[traffic.category]
    return np.clip(wanted, 1.0, most)


def _draw_walkers(request: FillRequest, rng: np.random.Generator) -> IntArray:
    """Nodes of pedestrians: at random, as they are no part of what was learned."""
    allowed = request.allowed.get(Category.PEDESTRIAN)
    if allowed is None:
        return np.empty(0, dtype=np.int64)
    return rng.permutation(np.flatnonzero(allowed))[: request.walkers]


@lru_cache(maxsize=4)
def _make_site(lanes: LaneGraph, walks: PedestrianGraph) -> Site:
    return site_of(lanes, walks)
