"""Corridors: a route through several junctions, along which vehicles are followed."""

from __future__ import annotations

import itertools
from collections import defaultdict
from contextlib import suppress
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from odscen.base.errors import InputError
from odscen.base.nearest_points import nearest
from odscen.base.shown import some_of
from odscen.lanegraph.graphs import Relation
from odscen.lanegraph.query import segment_rows
from odscen.lanegraph.shortest_paths import Router
from odscen.scenario.demand.count_stations import transitions

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    import polars as pl

    from odscen.base.arrays import BoolArray, FloatArray, Int32Array
    from odscen.lanegraph.graphs import MapGraph


LONGEST = 10
"""Junctions of a corridor that is chosen by itself, at most."""

_STEADY = 0.25
"""A corridor goes on while at least this share of the vehicles of its busiest turn does."""

_STRAIGHT = np.radians(40.0)
"""Change of direction at a junction up to which one goes straight on."""

_TRIED = 40
"""Turns, the busiest first, from which a corridor is tried."""


@dataclass(frozen=True, slots=True, eq=False)
class Corridor:
    """A route over segments in one direction.

    Attributes
    ----------
    segments
        Ids in driving direction, junctions included.
    starts
        Shape ``(K + 1,)``: metres along the corridor at which each begins; the last is its length.
    nodes
        Lane-graph nodes of all lanes that lead along it, shape ``(M,)``.
    along
        Metres along the corridor of each of them.
    """

    segments: tuple[str, ...]
    starts: FloatArray
    nodes: Int32Array
    along: FloatArray

    @property
    def length(self) -> float:
        """Metres."""
        return float(self.starts[-1])


def busiest_corridor(movements: pl.DataFrame, graph: MapGraph) -> Corridor | None:
    """Corridor on which most vehicles pass most junctions; ``None`` if no vehicle passed any.

    From each of the busiest turns that lead straight on a route is continued, forwards and
    backwards, with the busiest such turn that joins it. Of all routes found, the one with the
    largest sum of vehicles over its junctions.

    Parameters
    ----------
    movements
        With ``movement`` (``r1>j10>r2``) and ``vehicles``, over the whole run.
    """
    passed = movements.select("movement", "vehicles").iter_rows()
    turns = {tuple(str(name).split(">")): int(vehicles) for name, vehicles in passed if vehicles}
    ahead = _Headings(graph)
    # A vehicle that turns leaves the corridor, which turns itself only where none goes straight.
    turns = {turn: count for turn, count in turns.items() if ahead.straight(*turn)} or turns
    onwards = transitions(graph)
    before: dict[str, set[str]] = defaultdict(set)
    for segment, others in onwards.items():
        for other in others:
            before[other].add(segment)
    busiest = sorted(turns, key=lambda turn: (-turns[turn], turn))[:_TRIED]
    routes = {_grow_route(turn, turns, onwards, before) for turn in busiest}
    for _, route in sorted(routes, key=lambda found: (-found[0], found[1])):
        # Turns that join need not do so lane by lane.
        with suppress(InputError):
            return corridor_along(graph, route)
    return None


class _Headings:
    """Directions in which one leaves a segment for the next, and comes into it."""

    def __init__(self, graph: MapGraph) -> None:
        lanes, ids = graph.lanes, graph.segments.ids
        one, other = lanes.segment[lanes.source], lanes.segment[lanes.target]
        leaves = (one != other) & (lanes.relation == Relation.SUCCESSOR)
        self._out: dict[tuple[str, str], complex] = defaultdict(complex)
        self._into: dict[tuple[str, str], complex] = defaultdict(complex)
        for edge in np.flatnonzero(leaves).tolist():
            pair = str(ids[one[edge]]), str(ids[other[edge]])
            self._out[pair] += np.exp(1j * lanes.hdg[lanes.source[edge]])
            self._into[pair] += np.exp(1j * lanes.hdg[lanes.target[edge]])

    def straight(self, first: str, through: str, last: str) -> bool:
        """Whether one leaves the junction about as one came."""
        out, into = self._out.get((first, through)), self._into.get((through, last))
        if not out or not into:
            return False
        return bool(abs(np.angle(into / out)) < _STRAIGHT)


def _grow_route(
    turn: tuple[str, ...],
    turns: dict[tuple[str, ...], int],
    onwards: dict[str, set[str]],
    before: dict[str, set[str]],
) -> tuple[int, tuple[str, ...]]:
    """Route through ``turn``, after the vehicles of all its turns."""
    route, total, junctions = list(turn), turns[turn], 1
    least = _STEADY * turns[turn]
    for forwards in (True, False):
        while junctions < LONGEST:
            tip = route[-1] if forwards else route[0]
            joining = [
                (count, other)
                for other, count in turns.items()
                if other[0 if forwards else 2] == tip
                and count >= least
                and not set(other[1:] if forwards else other[:2]) & set(route)
            ]
            if joining:
                count, chosen = max(joining)
                route = [*route, *chosen[1:]] if forwards else [*chosen[:2], *route]
                total, junctions = total + count, junctions + 1
                continue
            # Between two junctions a road may be several segments long: follow it.
            beside = (onwards if forwards else before).get(tip, set())
            near = {name for name in beside if name[0] == "r"} - set(route)
            if len(near) != 1:
                break
            route = [*route, *near] if forwards else [*near, *route]
    # Road that led to no further junction is left out but for its first segment.
    inside = [place for place, name in enumerate(route) if name[0] == "j"]
    return total, tuple(route[max(inside[0] - 1, 0) : inside[-1] + 2])


def path_between(graph: MapGraph, first: str, last: str) -> tuple[str, ...]:
    """Segments of the shortest path over the whole of ``first`` to the end of ``last``.

    Raises
    ------
    InputError
        If there is no such segment, or no path.
    """
    path = _find_shortest_path(graph, first, last, None)
    if path is None:
        raise InputError(f"one cannot drive from {first} to {last}")
    return _list_passed_segments(graph, path)


def _list_passed_segments(graph: MapGraph, path: Int32Array) -> tuple[str, ...]:
    """Segments in the order in which a path leads over them."""
    rows = graph.lanes.segment[path].tolist()
    return tuple(graph.segments.ids[row] for row, _ in itertools.groupby(rows))


def corridor_along(graph: MapGraph, segments: Sequence[str]) -> Corridor:
    """Corridor over ``segments``; junctions between two of them need not be named.

    Raises
    ------
    InputError
        If there is no such segment, or one cannot drive from one to the next.
    """
    named = [str(graph.segments.ids[row]) for name in segments
             for row in segment_rows(graph.segments, [name])]  # fmt: skip
    if not named:
        raise InputError("a corridor needs at least one segment")
    names = _with_junctions(graph, named)
    mask = np.isin(graph.lanes.segment, segment_rows(graph.segments, names))
    path = _find_shortest_path(graph, names[0], names[-1], mask)
    if path is None or list(_list_passed_segments(graph, path)) != names:
        raise InputError(
            f"one cannot drive along {some_of(names, most=20, between=', ')} in this order; "
            "--from and --to find a route"
        )
    return _measure_corridor(graph, names, path)


def _with_junctions(graph: MapGraph, names: Sequence[str]) -> list[str]:
    """Put the junctions in through which one gets from each segment to the next."""
    onwards = transitions(graph)
    whole = [names[0]]
    for one, other in itertools.pairwise(names):
        if other not in onwards.get(one, ()):
            between = sorted(mid for mid in onwards.get(one, ()) if other in onwards.get(mid, ()))
            if not between:
                raise InputError(
                    f"{other} does not follow {one}; name every segment between, or use --from "
                    "and --to"
                )
            whole.append(between[0])
        whole.append(other)
    return whole


def _find_shortest_path(
    graph: MapGraph, first: str, last: str, mask: BoolArray | None
) -> Int32Array | None:
    """Nodes of the shortest path from where one enters ``first`` to where one leaves ``last``."""
    lanes = graph.lanes
    start, end = (int(segment_rows(graph.segments, [name])[0]) for name in (first, last))
    inside = lanes.segment[lanes.source] == lanes.segment[lanes.target]
    entries = np.setdiff1d(np.flatnonzero(lanes.segment == start), lanes.target[inside])
    exits = np.setdiff1d(np.flatnonzero(lanes.segment == end), lanes.source[inside])
    router = Router(graph, mask)
    best: tuple[float, int, int] | None = None
    for entry in entries.tolist():
        far = router.distances(entry)[exits]
        if len(far) and np.isfinite(far).any():
            found = (float(far.min()), entry, int(exits[far.argmin()]))
            best = found if best is None else min(best, found)
    return None if best is None else router.path(best[1], best[2])


def _measure_corridor(graph: MapGraph, names: Sequence[str], path: Int32Array) -> Corridor:
    lanes = graph.lanes
    line = np.column_stack([lanes.x[path], lanes.y[path]])
    metres = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(line, axis=0).T))])
    rows = lanes.segment[path]
    first = np.flatnonzero(np.concatenate([[True], np.diff(rows) != 0]))
    nodes, along = [], []
    for begin, end in zip(first.tolist(), [*first[1:].tolist(), len(path)], strict=True):
        here = np.flatnonzero(lanes.segment == rows[begin])
        xy = np.column_stack([lanes.x[here], lanes.y[here]])
        away, near = nearest(xy, line[begin:end])
        near += begin
        heading = lanes.hdg[path[near]]
        offset = xy - line[near]
        ahead = offset[:, 0] * np.cos(heading) + offset[:, 1] * np.sin(heading)
        # Of a junction only what leads straight along; of a road all lanes of the direction.
        turned = np.cos(lanes.hdg[here] - heading)
        kept = turned > (0.9 if graph.segments.kinds[int(rows[begin])] == "junction" else 0.5)
        kept &= away < _WIDEST
        nodes.append(here[kept])
        along.append((metres[near] + ahead)[kept])
    return Corridor(
        tuple(names), np.append(metres[first], metres[-1]), np.concatenate(nodes),
        np.concatenate(along),
    )  # fmt: skip


_WIDEST = 20.0
"""Metres from the path to the outermost of its lanes."""


def junctions_of(corridor: Corridor, kinds: Iterable[str]) -> list[tuple[str, float, float]]:
    """Junctions of a corridor with where they begin and end, metres; kinds as its segments'."""
    pieces = zip(
        corridor.segments, itertools.pairwise(corridor.starts.tolist()), kinds, strict=True
    )
    return [(name, begin, end) for name, (begin, end), kind in pieces if kind == "junction"]
