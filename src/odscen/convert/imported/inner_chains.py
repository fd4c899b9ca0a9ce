"""Internal SUMO lanes found on OpenDRIVE lanes, by what they connect.

netconvert draws its own curves through junctions, and lanes of different movements lie on top of
each other at junction mouths, so geometry does not tell them apart. But the lanes before and after
are known: the path between them through the OpenDRIVE lanes is what the internal lanes stand for.
Both are divided in proportion to length.
"""

from __future__ import annotations

import heapq
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from odscen.convert.lane_table.mapping_intervals import MappingInterval
from odscen.convert.model.net import INTERNAL, NORMAL

if TYPE_CHECKING:
    from collections.abc import Container, Iterable, Mapping, Sequence

    from odscen.base.ids import SumoLaneId
    from odscen.convert.imported.lane_samples import LaneSamples
    from odscen.convert.imported.net_import import ImportedNet


MOST_LINKS = 12
"""Lanes in a chain; two for a junction, three for each stub between junctions."""

MOST_PATHS = 1000
"""Beginnings of chains from one lane that are followed: no junction has so many."""


class LanePoint(NamedTuple):
    """A place on an OpenDRIVE lane; ``lane`` is a position in ``LaneSamples.rows``."""

    lane: int
    s: float


@dataclass(frozen=True, slots=True)
class InnerChain:
    """Lanes that one after the other connect two normal lanes: internal ones and stubs."""

    before: SumoLaneId
    via: tuple[SumoLaneId, ...]
    after: SumoLaneId


def chains_of(net: ImportedNet, stubs: Container[SumoLaneId]) -> list[InnerChain]:
    """Return the chains of a network, in the order of its connections.

    Parameters
    ----------
    stubs
        Normal lanes that count as inner links of a chain: what netconvert leaves, a few decimetres
        long, of a road whose ends it has trimmed away.
    """
    after: dict[SumoLaneId, list[SumoLaneId]] = {}
    starts: list[SumoLaneId] = []
    for link in net.links:
        function = net.function(link.source)
        target = net.function(link.target)
        if function not in (NORMAL, INTERNAL) or target != NORMAL:
            continue
        after.setdefault(link.source, []).append(link.via or link.target)
        if function == NORMAL and link.source not in stubs:
            starts.append(link.source)
    found: list[InnerChain] = []
    for start in dict.fromkeys(starts):
        open_paths: list[tuple[SumoLaneId, ...]] = [(lane,) for lane in reversed(after[start])]
        for _ in range(MOST_PATHS):
            if not open_paths:
                break
            path = open_paths.pop()
            last = path[-1]
            if last not in stubs and net.function(last) == NORMAL:
                found.append(InnerChain(start, path[:-1], last))
            elif len(path) < MOST_LINKS:
                further = [lane for lane in after.get(last, ()) if lane not in path]
                open_paths += [(*path, lane) for lane in reversed(further)]
    return found


class PathStretch(NamedTuple):
    """A part of an OpenDRIVE lane in driving direction; ``start`` and ``end`` in metres of arc."""

    lane: int
    start: float
    end: float


def shortest_path(
    start: LanePoint,
    end: LanePoint,
    successors: Mapping[int, Sequence[int]],
    lanes: LaneSamples,
    *,
    longest: float,
) -> tuple[PathStretch, ...] | None:
    """Return the shortest path between two places through successors, or ``None``.

    Dijkstra's algorithm over lengths of lanes; ties go to the smaller number.

    Parameters
    ----------
    successors
        Lanes after each lane, as positions in ``LaneSamples.rows``.
    longest
        Metres; longer ways do not count.
    """
    here, there = lanes.arc_at(start.lane, start.s), lanes.arc_at(end.lane, end.s)
    if start.lane == end.lane and there > here:
        return (PathStretch(start.lane, here, there),)
    queue: list[tuple[float, int, int]] = [(lanes.length(start.lane) - here, start.lane, -1)]
    before: dict[int, int] = {}
    while queue:
        length, lane, previous = heapq.heappop(queue)
        if lane in before:
            continue
        before[lane] = previous
        if lane == end.lane:
            break
        for other in successors.get(lane, ()):
            further = length + (there if other == end.lane else lanes.length(other))
            if other not in before and further <= longest:
                heapq.heappush(queue, (further, other, lane))
    if end.lane not in before or end.lane == start.lane:
        return None
    path = [end.lane]
    while before[path[-1]] >= 0:
        path.append(before[path[-1]])
    first = PathStretch(start.lane, here, lanes.length(start.lane))
    inner = (PathStretch(lane, 0.0, lanes.length(lane)) for lane in path[-2:0:-1])
    return (first, *inner, PathStretch(end.lane, 0.0, there))


class InnerLane(NamedTuple):
    """An internal lane: its row, and its length by shape and by attribute, metres."""

    row: int
    drawn: float
    length: float


def chain_intervals(
    path: Iterable[PathStretch], via: Sequence[InnerLane], lanes: LaneSamples, *, step: float
) -> list[MappingInterval]:
    """Divide a path among internal lanes in proportion; deviations are still to be measured.

    Pieces end where an OpenDRIVE lane or an internal lane ends.
    """
    stretches = [part for part in path if part.end - part.start > 1e-6]
    drawn = np.concatenate(([0.0], np.cumsum([lane.drawn for lane in via])))
    passed = np.concatenate(([0.0], np.cumsum([part.end - part.start for part in stretches])))
    if drawn[-1] <= 1e-6 or passed[-1] <= 1e-6:
        return []
    borders = drawn * (passed[-1] / drawn[-1])
    intervals: list[MappingInterval] = []
    for index, part in enumerate(stretches):
        for other, lane in enumerate(via):
            low = max(passed[index], borders[other])
            high = min(passed[index + 1], borders[other + 1])
            if high - low < 1e-4:
                continue
            arc = np.linspace(low, high, max(2, int(np.ceil((high - low) / step)) + 1))
            share = (arc - borders[other]) / (borders[other + 1] - borders[other])
            s = lanes.s_at(part.lane, arc - passed[index] + part.start)
            intervals.append(
                MappingInterval(part.lane, lane.row, share * lane.length, s, np.zeros(len(s)))
            )
    return intervals
