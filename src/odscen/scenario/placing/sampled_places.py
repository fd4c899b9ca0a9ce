"""Where sampled actors may start, category by category, and places drawn among them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from odscen.base.categories import Category
from odscen.scenario.document.distributions import draw_key
from odscen.scenario.placing.bodies import box_at
from odscen.scenario.placing.spawn_room import (
    MaximalCrowd,
    crowd_for,
    distance_to_end,
    max_fit,
    standing_room,
)

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from odscen.base.arrays import BoolArray
    from odscen.base.categories import Body
    from odscen.lanegraph.graphs import LaneGraph, PedestrianGraph
    from odscen.scenario.document.sampling_config import PlacingRules
    from odscen.scenario.placing.bodies import Crowd
    from odscen.scenario.placing.region import Region, Usable


@dataclass(frozen=True, slots=True)
class Supply:
    """Places for sampled actors on one of the two graphs of a region.

    Attributes
    ----------
    allowed
        For each category with a share, the nodes it may start on, shape ``(N,)`` or ``(P,)``.
    shares
        Relative share of each category.
    fit
        A maximal crowd, whose size is what a fill share counts by.
    """

    graph: LaneGraph | PedestrianGraph
    bodies: Mapping[Category, Body]
    allowed: Mapping[Category, BoolArray]
    shares: Mapping[Category, float]
    minimum_gap: float
    fit: MaximalCrowd


def vehicle_supply(
    region: Region, places: PlacingRules, shares: Mapping[Category, float], usable: Usable
) -> Supply:
    """Places for vehicles: on road lanes with room for the body and with a goal to reach."""
    lanes = region.graph.lanes
    spawnable = _or_all(usable.spawnable, len(lanes.x))
    centre = region.lanes & spawnable & _mask_of_roads(lanes, places)
    centre &= _with_goal(region, places, usable)
    excluded = set(places.exclude_segments)
    kept = np.array([name not in excluded for name in region.graph.segments.ids], dtype=np.bool_)
    centre &= kept[lanes.segment]
    allowed = {}
    for category, share in shares.items():
        if share > 0:
            limit = places.speed_limit_max.get(category, np.inf)
            body = usable.bodies[category]
            barred = usable.barred.get(category)
            open_to = spawnable if barred is None else spawnable & ~barred
            room = standing_room(lanes, body, allowed=open_to)
            allowed[category] = centre & open_to & room & ~(lanes.speed_limit > limit)
    wanted = {category: shares[category] for category in allowed}
    gap = places.minimum_gap
    fit = max_fit(lanes, usable.bodies, allowed, shares=wanted, minimum_gap=gap)
    return Supply(lanes, usable.bodies, allowed, wanted, gap, fit)


def walker_supply(region: Region, usable: Usable) -> Supply:
    """Places for pedestrians: on walks from which another place can be reached."""
    walks = region.graph.walks
    allowed = region.walks & _or_all(usable.walkable, len(walks.x))
    inside = region.walks[walks.source] & region.walks[walks.target]
    connected = np.zeros(len(walks.x), dtype=np.bool_)
    connected[walks.source[inside]] = True
    connected[walks.target[inside]] = True
    masks = {Category.PEDESTRIAN: allowed & connected}
    shares = {Category.PEDESTRIAN: 1.0}
    fit = max_fit(walks, usable.bodies, masks, shares=shares, minimum_gap=WALKER_GAP)
    return Supply(walks, usable.bodies, masks, shares, WALKER_GAP, fit)


WALKER_GAP = 0.5
"""Free length between two sampled pedestrians, metres."""


def _mask_of_roads(lanes: LaneGraph, places: PlacingRules) -> BoolArray:
    """Nodes of lanes outside junctions, of the types that are asked for."""
    types = set(places.lane_types)
    good = [
        junction is None and (not types or type_ in types)
        for junction, type_ in zip(lanes.lanes.junctions, lanes.lanes.types, strict=True)
    ]
    return np.array(good, dtype=np.bool_)[lanes.lane]


def _with_goal(region: Region, places: PlacingRules, usable: Usable) -> BoolArray:
    """Nodes with a goal candidate that can be driven to, none nearer than ``minimum_trip``."""
    lanes = region.graph.lanes
    inside = region.lanes
    leaves = np.zeros(len(lanes.x), dtype=np.bool_)
    leaves[lanes.source[inside[lanes.source] & inside[lanes.target]]] = True
    ends = np.flatnonzero(inside & ~leaves)
    to_end = distance_to_end(ends, lanes, inside)
    if usable.drivable is None:
        return inside & leaves & (to_end >= places.minimum_trip)
    driven = distance_to_end(ends[usable.drivable[ends]], lanes, inside & usable.drivable)
    # Where no end can be reached at all (a ring) the goals are the farthest nodes.
    reached = np.isfinite(driven) | (np.isinf(to_end) & usable.drivable)
    return inside & leaves & (to_end >= places.minimum_trip) & reached


def _or_all(mask: BoolArray | None, count: int) -> BoolArray:
    return np.ones(count, dtype=np.bool_) if mask is None else mask


class Spot(NamedTuple):
    """A body of this category on this node."""

    node: int
    category: Category


def place_at_random(supply: Supply, count: int, rng: np.random.Generator) -> tuple[Spot, ...]:
    """Place ``count`` bodies, at most as many as fit, in the order of the nodes.

    Bodies are thrown onto free nodes one after another, the longest first. When that jams (it does
    at about three quarters of what fits), ``count`` members of the maximal crowd are taken instead.
    """
    count = min(count, len(supply.fit))
    spots = _throw_spots(supply, count, rng)
    if len(spots) < count:
        chosen = rng.choice(len(supply.fit), size=count, replace=False)
        spots = [Spot(supply.fit.nodes[i], supply.fit.categories[i]) for i in chosen]
    return tuple(sorted(spots))


def _throw_spots(supply: Supply, count: int, rng: np.random.Generator) -> list[Spot]:
    crowd = crowd_for(supply.bodies, minimum_gap=supply.minimum_gap)
    free = {
        category: _free_nodes(supply, category, crowd, rng)
        for category, allowed in supply.allowed.items()
        if allowed.any()
    }
    shares = {category: supply.shares[category] for category in free}
    drawn = [draw_key(shares, rng) for _ in range(count)] if shares else []
    spots = []
    for wanted in sorted(drawn, key=lambda category: -supply.bodies[category].length):
        for category in (wanted, *(other for other in free if other is not wanted)):
            node = next(free[category], None)
            if node is not None:
                box = box_at(supply.graph, node, supply.bodies[category], gap=supply.minimum_gap)
                crowd.add(node, box)
                spots.append(Spot(node, category))
                break
        else:
            break
    return spots


def _free_nodes(
    supply: Supply, category: Category, crowd: Crowd, rng: np.random.Generator
) -> Iterator[int]:
    """Yield the nodes for a category in random order, those that are free when their turn comes."""
    nodes = rng.permutation(np.flatnonzero(supply.allowed[category])).tolist()
    body = supply.bodies[category]
    return (
        node
        for node in nodes
        if crowd.is_free(box_at(supply.graph, node, body, gap=supply.minimum_gap))
    )
