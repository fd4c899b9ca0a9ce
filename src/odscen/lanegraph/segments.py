"""Segments: the parts of a map that a region of interest is made of (requirements R25 to R27).

Each junction with roads of its own is one segment. Roads that follow each other without a junction
between them are joined to a chain, and each chain is divided into equal segments of about
:data:`TARGET_LENGTH`. A junction that owns no roads (direct, or a virtual one without connecting
roads) has nothing that could be placed in it: the chains that meet there are neighbours directly.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal, NamedTuple

import numpy as np

from odscen.base.ids import JunctionId, RoadId, SegmentId
from odscen.lanegraph.graphs import SegmentPart, Segments

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from odscen.base.arrays import FloatArray, IntArray
    from odscen.opendrive.road_model import ContactPoint, OpenDrive, Road, RoadLink

TARGET_LENGTH = 100.0
"""Metres; a chain of length L has ``max(1, round(L / TARGET_LENGTH))`` segments."""

MIN_PART = 1e-3
"""Metres; a shorter stretch of a road is not listed as a part of a segment."""


class _RoadEnd(NamedTuple):
    """One end of a road."""

    road: RoadId
    side: ContactPoint


class _RoadStep(NamedTuple):
    """A road in a chain; ``forward`` if the chain runs with growing s."""

    road: RoadId
    forward: bool


class _SegmentSpan(NamedTuple):
    """Which segments a road lies in: row ``base + floor((start + sign * s) / length)``."""

    base: int
    start: float
    sign: float
    length: float
    last: int

    def row(self, s: float) -> int:
        return self.base + min(max(int((self.start + self.sign * s) // self.length), 0), self.last)


@dataclass(frozen=True, slots=True)
class _RoadChain:
    steps: tuple[_RoadStep, ...]
    closed: bool
    length: float
    count: int

    @property
    def segment_length(self) -> float:
        return self.length / self.count


@dataclass(frozen=True, slots=True, eq=False)
class SegmentMap:
    """The segments, and which of them each place of a road belongs to.

    The arrays have one row per road, in the order of the file: place s of that road lies in segment
    ``base + clip(floor((start + sign * s) / length), 0, last)``.
    """

    segments: Segments
    base: IntArray
    start: FloatArray
    sign: FloatArray
    length: FloatArray
    last: IntArray

    def at(self, road: IntArray, s: FloatArray) -> IntArray:
        """Rows of the segments at road coordinates s of the roads in rows ``road``."""
        position = (self.start[road] + self.sign[road] * s) / self.length[road]
        segment = np.clip(np.floor(position), 0, self.last[road]).astype(np.int64)
        rows: IntArray = self.base[road] + segment
        return rows


def build_segments(odr: OpenDrive, *, target_length: float = TARGET_LENGTH) -> SegmentMap:
    """Divide a map into segments.

    Parameters
    ----------
    odr
        The road model.
    target_length
        Metres; see :data:`TARGET_LENGTH`.
    """
    owned = _roads_of_junctions(odr)
    chains = _find_chains(odr, target_length)
    rows = _SegmentRows([], [], [], {}, {})
    for chain in chains:
        rows.add_chain(chain, odr)
    for junction, roads in owned.items():
        rows.add_junction(junction, roads)
    pairs = {*_pairs_inside_chains(chains, rows.places), *_pairs_across_links(odr, rows)}
    adjacency = sorted({(min(pair), max(pair)) for pair in pairs if pair[0] != pair[1]})
    segments = Segments(
        ids=_make_distinct(rows.ids),
        kinds=tuple("junction" if name.startswith("j") else "road" for name in rows.ids),
        parts=tuple(rows.parts),
        lengths=np.array(rows.lengths, dtype=np.float64),
        adjacency=np.array(adjacency, dtype=np.int32).reshape(-1, 2),
    )
    table = [rows.places[road] for road in odr.roads]
    return SegmentMap(
        segments=segments,
        base=np.array([place.base for place in table], dtype=np.int64),
        start=np.array([place.start for place in table], dtype=np.float64),
        sign=np.array([place.sign for place in table], dtype=np.float64),
        length=np.array([place.length for place in table], dtype=np.float64),
        last=np.array([place.last for place in table], dtype=np.int64),
    )


@dataclass(slots=True)
class _SegmentRows:
    """The segments while they are listed."""

    ids: list[str]
    parts: list[tuple[SegmentPart, ...]]
    lengths: list[float]
    places: dict[RoadId, _SegmentSpan]
    junctions: dict[JunctionId, int]

    def add_chain(self, chain: _RoadChain, odr: OpenDrive) -> None:
        self.places.update(_place_segments(chain, odr, base=len(self.ids)))
        name = segment_name("road", chain.steps[0].road)
        self.ids += [name] if chain.count == 1 else [f"{name}-{k}" for k in range(chain.count)]
        self.parts += _segment_parts(chain, odr)
        self.lengths += [chain.segment_length] * chain.count

    def add_junction(self, junction: JunctionId, roads: list[Road]) -> None:
        row = len(self.ids)
        self.junctions[junction] = row
        self.places.update({road.id: _SegmentSpan(row, 0.0, 1.0, 1.0, 0) for road in roads})
        self.ids.append(segment_name("junction", junction))
        self.parts.append(tuple(SegmentPart(road.id, 0.0, road.length) for road in roads))
        self.lengths.append(sum(road.length for road in roads))


def segment_name(kind: Literal["road", "junction"], own: str) -> str:
    """Give the name of the segment of a road or junction with the id ``own``.

    Names of segments are joined with ``>`` for movements and count stations, so that it is written
    ``%3E`` where an id has one.
    """
    return f"{kind[0]}{own.replace('>', '%3E')}"


def _make_distinct(ids: list[str]) -> tuple[SegmentId, ...]:
    """Mark an id that occurs again (roads ``1`` and ``1-0``) with underscores."""
    seen: dict[str, None] = {}
    for name in ids:
        fresh = name
        while fresh in seen:
            fresh += "_"
        seen[fresh] = None
    return tuple(map(SegmentId, seen))


def _roads_of_junctions(odr: OpenDrive) -> dict[JunctionId, list[Road]]:
    """Group connecting roads by junction; junctions named only by a road come last."""
    owned: dict[JunctionId, list[Road]] = {junction: [] for junction in odr.junctions}
    for road in odr.roads.values():
        if road.junction is not None:
            owned.setdefault(road.junction, []).append(road)
    return {junction: roads for junction, roads in owned.items() if roads}


def _link_at_side(road: Road, side: ContactPoint) -> RoadLink | None:
    return road.predecessor if side == "start" else road.successor


def _opposite_end(end: _RoadEnd) -> _RoadEnd:
    return _RoadEnd(end.road, "end" if end.side == "start" else "start")


def _find_joints(odr: OpenDrive) -> dict[_RoadEnd, _RoadEnd]:
    """Find the ends of ordinary roads that name each other: each with the one that it meets."""
    named: dict[_RoadEnd, _RoadEnd] = {}
    for road in odr.roads.values():
        if road.junction is not None:
            continue
        for side in ("start", "end"):
            link = _link_at_side(road, side)
            if link is None or link.element_type != "road" or link.contact_point is None:
                continue
            other = odr.roads.get(RoadId(link.element_id))
            if other is not None and other.junction is None and link.element_s is None:
                named[_RoadEnd(road.id, side)] = _RoadEnd(other.id, link.contact_point)
    return {end: other for end, other in named.items() if named.get(other) == end}


def _find_chains(odr: OpenDrive, target_length: float) -> list[_RoadChain]:
    """Maximal chains of ordinary roads: open ones first, then loops, each in file order."""
    joints = _find_joints(odr)
    ordinary = [road.id for road in odr.roads.values() if road.junction is None]
    seen: set[RoadId] = set()
    chains: list[_RoadChain] = []
    for closed in (False, True):
        for road in ordinary:
            starts = [_RoadEnd(road, "start"), _RoadEnd(road, "end")]
            start = next((end for end in starts if closed or end not in joints), None)
            if road in seen or start is None:
                continue
            steps = _walk_roads(start, joints)
            seen.update(step.road for step in steps)
            length = sum(odr.roads[step.road].length for step in steps)
            count = max(1, round(length / target_length))
            chains.append(_RoadChain(tuple(steps), closed, max(length, MIN_PART), count))
    return chains


def _walk_roads(start: _RoadEnd, joints: Mapping[_RoadEnd, _RoadEnd]) -> list[_RoadStep]:
    """Roads met when one enters at ``start`` and continues to the end or once round the loop."""
    steps: list[_RoadStep] = []
    seen: set[RoadId] = set()
    entry: _RoadEnd | None = start
    while entry is not None and entry.road not in seen:
        steps.append(_RoadStep(entry.road, entry.side == "start"))
        seen.add(entry.road)
        entry = joints.get(_opposite_end(entry))
    return steps


def _place_segments(
    chain: _RoadChain, odr: OpenDrive, *, base: int
) -> Iterator[tuple[RoadId, _SegmentSpan]]:
    done = 0.0
    for step in chain.steps:
        length = odr.roads[step.road].length
        start, sign = (done, 1.0) if step.forward else (done + length, -1.0)
        yield step.road, _SegmentSpan(base, start, sign, chain.segment_length, chain.count - 1)
        done += length


def _segment_parts(chain: _RoadChain, odr: OpenDrive) -> list[tuple[SegmentPart, ...]]:
    """List the stretches of roads in each segment of the chain."""
    segment_parts: list[list[SegmentPart]] = [[] for _ in range(chain.count)]
    done = 0.0
    for step in chain.steps:
        length = odr.roads[step.road].length
        first = min(int(done // chain.segment_length), chain.count - 1)
        last = min(int((done + length) // chain.segment_length), chain.count - 1)
        for segment in range(first, last + 1):
            low = max(0.0, segment * chain.segment_length - done)
            high = min(length, (segment + 1) * chain.segment_length - done)
            if high - low < min(MIN_PART, length / 2):
                continue
            s_from, s_to = (low, high) if step.forward else (length - high, length - low)
            segment_parts[segment].append(SegmentPart(step.road, s_from, s_to))
        done += length
    return [tuple(parts) for parts in segment_parts]


def _pairs_inside_chains(
    chains: list[_RoadChain], places: Mapping[RoadId, _SegmentSpan]
) -> Iterator[tuple[int, int]]:
    for chain in chains:
        base = places[chain.steps[0].road].base
        for segment in range(chain.count - 1):
            yield base + segment, base + segment + 1
        if chain.closed:
            yield base, base + chain.count - 1


def _pairs_across_links(odr: OpenDrive, rows: _SegmentRows) -> Iterator[tuple[int, int]]:
    """Pairs of segments that meet at the end of a road, as its link or a junction says."""
    places = rows.places
    for road in odr.roads.values():
        for side in ("start", "end"):
            link = _link_at_side(road, side)
            here = places[road.id].row(0.0 if side == "start" else road.length)
            if link is None:
                continue
            if link.element_type == "junction":
                there = rows.junctions.get(JunctionId(link.element_id))
            else:
                there = _row_at_link(odr, link, places)
            if there is not None:
                yield here, there
    yield from _pairs_across_connections(odr, places)


def _pairs_across_connections(
    odr: OpenDrive, places: Mapping[RoadId, _SegmentSpan]
) -> Iterator[tuple[int, int]]:
    """Pairs of segments that a junction's connections name."""
    for junction in odr.junctions.values():
        for connection in junction.connections:
            incoming = odr.roads.get(connection.incoming_road)
            connecting = odr.roads.get(connection.connecting_road)
            if incoming is None or connecting is None:
                continue
            there = places[connecting.id].row(
                0.0 if connection.contact_point == "start" else connecting.length
            )
            for s in _places_at_junction(incoming, junction.id):
                yield places[incoming.id].row(s), there


def _row_at_link(
    odr: OpenDrive, link: RoadLink, places: Mapping[RoadId, _SegmentSpan]
) -> int | None:
    other = odr.roads.get(RoadId(link.element_id))
    if other is None:
        return None
    if link.element_s is not None:
        return places[other.id].row(link.element_s)
    return places[other.id].row(other.length if link.contact_point == "end" else 0.0)


def _places_at_junction(incoming: Road, junction: JunctionId) -> list[float]:
    """Find the ends (their s) of ``incoming`` that lead into the junction.

    Any place will do for a connecting road: it lies in one segment.
    """
    places = [
        s
        for s, link in ((0.0, incoming.predecessor), (incoming.length, incoming.successor))
        if link is not None and link.element_type == "junction" and link.element_id == junction
    ]
    return places or ([0.0] if incoming.junction is not None else [])
