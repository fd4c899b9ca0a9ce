"""Counts of vehicles: where, how well traffic meets them, and which contradict each other."""

from __future__ import annotations

import math
from collections import defaultdict
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from odscen.scenario.demand.zones import place_segments

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping, Sequence

    from odscen.lanegraph.graphs import MapGraph
    from odscen.scenario.document.scenario_document import Counts, Demand

GOOD = 5.0
"""GEH up to which a count is met; the usual bound, for example of the UK's WebTAG unit M3.1."""

SLACK_GEH = 1.0
SLACK_VEHICLES = 3.0
"""Counts contradict each other if they are apart by more than both: some vehicles are between two
places when a slice ends."""


class Observation(NamedTuple):
    """One count: a place, a slice of time (seconds), and the vehicles that passed."""

    counts: str
    place: str
    begin: float
    end: float
    counted: float


@dataclass(frozen=True, slots=True)
class Contradiction:
    """Counts that no traffic can meet together, in words."""

    counts: str
    places: tuple[str, ...]
    begin: float
    end: float
    message: str


def observations(demand: Demand) -> list[Observation]:
    """All counts of a scenario in the order of the document."""
    return [Observation(part.id, *row) for part in demand.counts for row in part.rows]


def geh(modelled: float, counted: float, seconds: float) -> float:
    """GEH statistic of two numbers of vehicles in a slice of time.

    ``sqrt(2 (m - c)^2 / (m + c))`` with both as vehicles per hour.
    """
    m, c = (number * 3600.0 / seconds for number in (modelled, counted))
    return math.sqrt(2.0 * (m - c) ** 2 / (m + c)) if m + c > 0 else 0.0


class StationFinder:
    """Finds out which count stations a route passes.

    Parameters
    ----------
    places
        As the document writes them, such as ``r12>j54``; those with unknown segments are never
        passed.
    """

    def __init__(self, graph: MapGraph, places: Iterable[str]) -> None:
        rows = {str(name): row for row, name in enumerate(graph.segments.ids)}
        self.places = tuple(dict.fromkeys(places))
        self._windows: dict[tuple[int, ...], int] = {}
        for index, place in enumerate(self.places):
            names = place_segments(place)
            if all(name in rows for name in names):
                self._windows[tuple(rows[name] for name in names)] = index
        self._lengths = sorted({len(window) for window in self._windows})

    def of(self, segments: Sequence[int]) -> list[tuple[int, int]]:
        """Places that are passed, and where on the route that is done.

        Parameters
        ----------
        segments
            Rows of the segments in the order in which they are passed.

        Returns
        -------
        Positions in ``places`` with the position in ``segments`` of the place's last segment.
        """
        return sorted(
            (
                (place, first + length - 1)
                for length in self._lengths
                for first in range(len(segments) - length + 1)
                if (place := self._windows.get(tuple(segments[first : first + length]))) is not None
            ),
            key=lambda found: (found[1], found[0]),
        )


def transitions(graph: MapGraph) -> dict[str, set[str]]:
    """Segments that vehicles can get into from each segment directly."""
    lanes, ids = graph.lanes, graph.segments.ids
    pairs = np.stack([lanes.segment[lanes.source], lanes.segment[lanes.target]], axis=1)
    found: dict[str, set[str]] = defaultdict(set)
    for one, other in np.unique(pairs[pairs[:, 0] != pairs[:, 1]], axis=0).tolist():
        found[ids[one]].add(ids[other])
    return found


def place_points(graph: MapGraph, places: Iterable[str]) -> dict[str, tuple[float, float]]:
    """Where count stations are on the map: x and y in metres, OpenDRIVE frame.

    A segment is at the middle of its nodes; a flow where lanes lead from one segment into the
    next; a turn in the middle of the flows that it is made of. Places with unknown segments, or
    between which no lane leads, have none.
    """
    lanes, ids = graph.lanes, graph.segments.ids
    rows = {str(name): row for row, name in enumerate(ids)}
    x, y = np.asarray(lanes.x), np.asarray(lanes.y)
    crosses = lanes.segment[lanes.source] != lanes.segment[lanes.target]
    source, target = lanes.source[crosses], lanes.target[crosses]
    ends = lanes.segment[source], lanes.segment[target]
    found: dict[str, tuple[float, float]] = {}
    for place in dict.fromkeys(places):
        names = place_segments(place)
        if not all(name in rows for name in names):
            continue
        place_rows = [rows[name] for name in names]
        groups = (
            [np.flatnonzero(lanes.segment == place_rows[0])]
            if len(place_rows) == 1
            else [source[(ends[0] == a) & (ends[1] == b)] for a, b in pairwise(place_rows)]
        )
        if all(len(group) for group in groups):
            found[place] = (
                float(np.mean([x[group].mean() for group in groups])),
                float(np.mean([y[group].mean() for group in groups])),
            )
    return found


def contradictions(counts: Counts, graph: MapGraph) -> Iterator[Contradiction]:
    """Yield counts that cannot be right together.

    - Turns out of a flow, or into one, that together are more than the flow; or less, where all
      of them are counted.
    - A junction with all entries and exits counted into which more, or fewer, go than come out.
    """
    onwards = transitions(graph)
    before: dict[str, set[str]] = defaultdict(set)
    for segment, others in onwards.items():
        for other in others:
            before[other].add(segment)
    slices: dict[tuple[float, float], dict[tuple[str, ...], float]] = defaultdict(dict)
    for place, begin, end, number in counts.rows:
        slices[begin, end][place_segments(place)] = number
    for (begin, end), counted in sorted(slices.items()):
        found = [
            *_compare_flows(counted, onwards, before),
            *_compare_balances(counted, graph, onwards, before),
        ]
        for places, message in found:
            yield Contradiction(counts.id, places, begin, end, message)


_Found = tuple[tuple[str, ...], str]


def _compare_flows(
    counted: Mapping[tuple[str, ...], float],
    onwards: Mapping[str, set[str]],
    before: Mapping[str, set[str]],
) -> Iterator[_Found]:
    leaving: dict[tuple[str, ...], list[tuple[str, ...]]] = defaultdict(list)
    coming: dict[tuple[str, ...], list[tuple[str, ...]]] = defaultdict(list)
    for place in counted:
        if len(place) == 3:
            leaving[place[:2]].append(place)
            coming[place[1:]].append(place)
    for flow, number in counted.items():
        if len(flow) != 2:
            continue
        out, into = leaving.get(flow, []), coming.get(flow, [])
        every_out = onwards.get(flow[1], set()) <= {turn[2] for turn in out} | {flow[0]}
        every_in = before.get(flow[0], set()) <= {turn[0] for turn in into} | {flow[1]}
        for some, every, word in ((out, every_out, "continue"), (into, every_in, "come")):
            total = sum(counted[turn] for turn in some)
            apart = _counts_differ(total, number)
            if some and apart and (total > number or every):
                name = _name_flow(flow)
                yield (
                    (name, *map(_name_flow, some)),
                    f"{number:g} were counted at {name}, but the turns by which they {word} add "
                    f"up to {total:g}",
                )


def _compare_balances(
    counted: Mapping[tuple[str, ...], float],
    graph: MapGraph,
    onwards: Mapping[str, set[str]],
    before: Mapping[str, set[str]],
) -> Iterator[_Found]:
    for name, kind in zip(graph.segments.ids, graph.segments.kinds, strict=True):
        if kind != "junction":
            continue
        entries = [(neighbour, str(name)) for neighbour in sorted(before.get(name, ()))]
        exits = [(str(name), onward) for onward in sorted(onwards.get(name, ()))]
        if not entries or not exits or not all(pair in counted for pair in (*entries, *exits)):
            continue
        coming = sum(counted[pair] for pair in entries)
        leaving = sum(counted[pair] for pair in exits)
        if _counts_differ(coming, leaving):
            yield (
                tuple(map(_name_flow, (*entries, *exits))),
                f"{coming:g} were counted on all entries of {name}, but {leaving:g} on all exits",
            )


def _name_flow(segments: Sequence[str]) -> str:
    return ">".join(segments)


def _counts_differ(one: float, other: float) -> bool:
    return abs(one - other) > SLACK_VEHICLES and geh(one, other, 3600.0) > SLACK_GEH
