"""Internal SUMO lanes found on OpenDRIVE lanes, by what they connect.

netconvert draws its own curves through junctions, and lanes of different movements lie on top of
each other at junction mouths, so geometry does not tell them apart. But the lanes before and after
are known: the way between them through the OpenDRIVE lanes is what the internal lanes stand for.
Both are divided in proportion to length.
"""

from __future__ import annotations

import heapq
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from odscen.convert.net import INTERNAL, NORMAL
from odscen.convert.pieces import Piece

if TYPE_CHECKING:
    from collections.abc import Container, Iterable, Mapping, Sequence

    from odscen.convert.net import Net
    from odscen.convert.sampling import LaneSamples
    from odscen.ids import SumoLaneId

FloatArray = NDArray[np.float64]


MOST_LINKS = 12
"""Lanes in a chain; two for a junction, three for each stub between junctions."""


class Place(NamedTuple):
    """A place on an OpenDRIVE lane; ``lane`` is a position in ``LaneSamples.rows``."""

    lane: int
    s: float


@dataclass(frozen=True, slots=True)
class Chain:
    """Lanes that one after the other connect two normal lanes: internal ones and stubs."""

    before: SumoLaneId
    via: tuple[SumoLaneId, ...]
    after: SumoLaneId


def chains_of(net: Net, stubs: Container[SumoLaneId]) -> list[Chain]:
    """Return the chains of a network, in the order of its connections.

    Parameters
    ----------
    stubs
        Normal lanes that count as inner links of a chain: what netconvert leaves, a few decimetres
        long, of a road whose ends it has trimmed away.
    """
    after: dict[SumoLaneId, list[SumoLaneId]] = {}
    starts: list[SumoLaneId] = []
    for connection in net.connections:
        function = net.edges[net.lanes[connection.from_lane].edge].function
        target = net.edges[net.lanes[connection.to_lane].edge].function
        if function not in (NORMAL, INTERNAL) or target != NORMAL:
            continue
        after.setdefault(connection.from_lane, []).append(connection.via or connection.to_lane)
        if function == NORMAL and connection.from_lane not in stubs:
            starts.append(connection.from_lane)
    found: list[Chain] = []
    for start in dict.fromkeys(starts):
        open_ways: list[tuple[SumoLaneId, ...]] = [(lane,) for lane in reversed(after[start])]
        while open_ways:
            way = open_ways.pop()
            last = way[-1]
            if last not in stubs and net.edges[net.lanes[last].edge].function == NORMAL:
                found.append(Chain(start, way[:-1], last))
            elif len(way) < MOST_LINKS:
                further = [lane for lane in after.get(last, ()) if lane not in way]
                open_ways += [(*way, lane) for lane in reversed(further)]
    return found


class Stretch(NamedTuple):
    """A part of an OpenDRIVE lane in driving direction; ``start`` and ``end`` in metres of arc."""

    lane: int
    start: float
    end: float


def shortest_way(
    start: Place,
    end: Place,
    successors: Mapping[int, Sequence[int]],
    lanes: LaneSamples,
    *,
    longest: float,
) -> tuple[Stretch, ...] | None:
    """Return the shortest way between two places through successors, or ``None``.

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
        return (Stretch(start.lane, here, there),)
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
    way = [end.lane]
    while before[way[-1]] >= 0:
        way.append(before[way[-1]])
    first = Stretch(start.lane, here, lanes.length(start.lane))
    inner = (Stretch(lane, 0.0, lanes.length(lane)) for lane in way[-2:0:-1])
    return (first, *inner, Stretch(end.lane, 0.0, there))


class InternalLane(NamedTuple):
    """An internal lane: its row, and its length by shape and by attribute, metres."""

    row: int
    drawn: float
    length: float


def chain_pieces(
    way: Iterable[Stretch], via: Sequence[InternalLane], lanes: LaneSamples, *, step: float
) -> list[Piece]:
    """Divide a way among internal lanes in proportion; deviations are still to be measured.

    Pieces end where an OpenDRIVE lane or an internal lane ends.
    """
    stretches = [part for part in way if part.end - part.start > 1e-6]
    drawn = np.concatenate(([0.0], np.cumsum([lane.drawn for lane in via])))
    walked = np.concatenate(([0.0], np.cumsum([part.end - part.start for part in stretches])))
    if drawn[-1] <= 1e-6 or walked[-1] <= 1e-6:
        return []
    borders = drawn * (walked[-1] / drawn[-1])
    pieces: list[Piece] = []
    for index, part in enumerate(stretches):
        for other, lane in enumerate(via):
            low = max(walked[index], borders[other])
            high = min(walked[index + 1], borders[other + 1])
            if high - low < 1e-4:
                continue
            arc = np.linspace(low, high, max(2, int(np.ceil((high - low) / step)) + 1))
            share = (arc - borders[other]) / (borders[other + 1] - borders[other])
            s = lanes.s_at(part.lane, arc - walked[index] + part.start)
            row = int(lanes.rows[part.lane])
            pieces.append(Piece(row, lane.row, share * lane.length, s, np.zeros(len(s))))
    return pieces
