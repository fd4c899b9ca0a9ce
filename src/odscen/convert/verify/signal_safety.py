"""Greens of a SUMO network that conflict: movements that meet and are let go at one time."""

from __future__ import annotations

from collections import defaultdict
from itertools import combinations
from typing import TYPE_CHECKING

import numpy as np

from odscen.convert.verify.fidelity_result import UnsafePair

if TYPE_CHECKING:
    from collections.abc import Iterator

    from odscen.convert.verify.net_reader import NetFile, NetFileJunction, NetFileLink


def unsafe_pairs(net: NetFile) -> tuple[UnsafePair, ...]:
    """Pairs of links that conflict and have green together without one of them giving way.

    One gives way if its green is ``g`` and its request says that it yields to the other.
    """
    rows = net.request_rows()
    return tuple(
        pair for junction in net.junctions for pair in _unsafe_at(net, junction, rows[junction.id])
    )


def _unsafe_at(
    net: NetFile, junction: NetFileJunction, links: list[NetFileLink]
) -> Iterator[UnsafePair]:
    controlled: dict[str, list[int]] = defaultdict(list)
    for row, link in enumerate(links):
        if link.tl:
            controlled[link.tl].append(row)
    for program in net.programs:
        for a, b in combinations(controlled.get(program.tl, ()), 2):
            if b not in junction.foes.get(a, ()) and a not in junction.foes.get(b, ()):
                continue
            indices = (links[a].link_index, links[b].link_index)
            for phase, state in enumerate(program.states):
                one, other = (state[index : index + 1] for index in indices)
                if not {one, other} <= {"G", "g"}:
                    continue
                waits = one == "g" and b in junction.yields.get(a, ())
                if not waits and not (other == "g" and a in junction.yields.get(b, ())):
                    x, y = _middle(net, links[a], links[b])
                    yield UnsafePair(program.tl, phase, indices, "g" in (one, other), x, y)


def _middle(net: NetFile, *links: NetFileLink) -> tuple[float, float]:
    """Where two links meet, about: the middle between their lanes."""
    shapes = [net.lanes[link.via or link.target].shape for link in links]
    x, y = np.mean(
        [0.5 * (shape.min(axis=0) + shape.max(axis=0)) for shape in shapes], axis=0
    ).tolist()
    return x, y
