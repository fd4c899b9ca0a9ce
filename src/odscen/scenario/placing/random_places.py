"""Sampled places: a given number of bodies on nodes, at random, none too near another."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from odscen.scenario.document.distributions import draw_key
from odscen.scenario.placing.bodies import box_at
from odscen.scenario.placing.spawn_room import crowd_for

if TYPE_CHECKING:
    from collections.abc import Iterator

    from odscen.base.categories import Category
    from odscen.scenario.placing.bodies import Crowd
    from odscen.scenario.placing.supply import Supply


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
    spots = _thrown(supply, count, rng)
    if len(spots) < count:
        chosen = rng.choice(len(supply.fit), size=count, replace=False)
        spots = [Spot(supply.fit.nodes[i], supply.fit.categories[i]) for i in chosen]
    return tuple(sorted(spots))


def _thrown(supply: Supply, count: int, rng: np.random.Generator) -> list[Spot]:
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
