"""Small map graphs made by hand, so that tests state exact numbers.

``lane()`` describes one lane (a straight line or an arc), ``map_graph()`` makes the arrays out of a
list of them. Node ``k`` of a lane lies at ``(k + 0.5) * length / n``, as the builder does it.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from odscen.base.ids import JunctionId, LaneKey, RoadId, SegmentId
from odscen.lanegraph.graphs import (
    LaneGraph,
    Lanes,
    MapGraph,
    PedestrianGraph,
    Relation,
    SegmentPart,
    Segments,
    WalkKind,
)

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

SHA256 = "0" * 64


@dataclass(frozen=True)
class ToyLane:
    """One lane: where it starts, how it runs, what follows it and what lies beside it."""

    key: LaneKey
    x: float
    y: float
    hdg: float
    length: float
    segment: str
    curvature: float = 0.0
    width: float = 3.5
    speed_limit: float = 13.89
    z: float = 0.0
    junction: str | None = None
    next: tuple[LaneKey, ...] = ()
    left: LaneKey | None = None
    right: LaneKey | None = None
    change: bool = True


@dataclass(frozen=True)
class ToyWalk:
    """One straight sidewalk and the walks that its last node is joined to (their first nodes)."""

    key: LaneKey
    x: float
    y: float
    hdg: float
    length: float
    segment: str
    width: float = 2.0
    next: tuple[LaneKey, ...] = ()


def key(road: str, lane: int, section: int = 0) -> LaneKey:
    return LaneKey(RoadId(road), section, lane)


def map_graph(
    lanes: Sequence[ToyLane],
    *,
    walks: Sequence[ToyWalk] = (),
    adjacency: Iterable[tuple[str, str]] = (),
    spacing: float = 2.0,
    name: str = "toy",
) -> MapGraph:
    names = list(dict.fromkeys([one.segment for one in (*lanes, *walks)]))
    segments = _segments(names, lanes, adjacency)
    return MapGraph(
        map_name=name,
        map_sha256=SHA256,
        lanes=_lane_graph(lanes, names, spacing),
        segments=segments,
        walks=_walk_graph(walks, names, spacing),
    )


def _segments(
    names: list[str], lanes: Sequence[ToyLane], adjacency: Iterable[tuple[str, str]]
) -> Segments:
    pairs = sorted(tuple(sorted((names.index(a), names.index(b)))) for a, b in adjacency)
    junctions = {lane.segment for lane in lanes if lane.junction}
    parts = [
        tuple(
            SegmentPart(road, 0.0, length)
            for road, length in {
                lane.key.road: lane.length for lane in lanes if lane.segment == name
            }.items()
        )
        for name in names
    ]
    return Segments(
        ids=tuple(SegmentId(name) for name in names),
        kinds=tuple("junction" if name in junctions else "road" for name in names),
        parts=tuple(parts),
        lengths=np.array([sum(part.s_to for part in of) for of in parts]),
        adjacency=np.array(pairs, dtype=np.int32).reshape(-1, 2),
    )


@dataclass
class _Edges:
    rows: list[tuple[int, int, int, float]] = field(default_factory=list)

    def add(self, source: int, target: int, relation: int, length: float) -> None:
        self.rows.append((source, relation, target, length))


def _along(lane: ToyLane | ToyWalk, curvature: float, offset: np.ndarray) -> tuple[np.ndarray, ...]:
    hdg = lane.hdg + curvature * offset
    if curvature == 0.0:
        return lane.x + offset * np.cos(lane.hdg), lane.y + offset * np.sin(lane.hdg), hdg
    x = lane.x + (np.sin(hdg) - np.sin(lane.hdg)) / curvature
    y = lane.y - (np.cos(hdg) - np.cos(lane.hdg)) / curvature
    return x, y, hdg


def _offsets(length: float, spacing: float) -> np.ndarray:
    count = max(1, round(length / spacing))
    return (np.arange(count) + 0.5) * length / count


def _lane_graph(lanes: Sequence[ToyLane], names: list[str], spacing: float) -> LaneGraph:
    offsets = [_offsets(lane.length, spacing) for lane in lanes]
    first = np.concatenate([[0], np.cumsum([len(part) for part in offsets])]).astype(np.int32)
    row = {lane.key: index for index, lane in enumerate(lanes)}
    points = [_along(lane, lane.curvature, part) for lane, part in zip(lanes, offsets, strict=True)]
    counts = [len(part) for part in offsets]
    lane_of = np.repeat(np.arange(len(lanes), dtype=np.int32), counts)

    def beside(which: str) -> np.ndarray:
        rows = [row.get(getattr(lane, which), -1) for lane in lanes]
        return np.array(rows, dtype=np.int32)[lane_of]

    def each(field_name: str) -> np.ndarray:
        return np.array([getattr(lane, field_name) for lane in lanes], dtype=float)[lane_of]

    source, relation, target, length = _lane_edges(lanes, offsets, first, row, points)
    change = np.array(
        [lane.change * ((lane.left is not None) + 2 * (lane.right is not None)) for lane in lanes]
    )
    zeros = np.zeros(len(lane_of))
    offset = np.concatenate(offsets)
    return LaneGraph(
        spacing=spacing,
        lanes=Lanes(
            keys=tuple(lane.key for lane in lanes),
            types=("driving",) * len(lanes),
            junctions=tuple(JunctionId(j.junction) if j.junction else None for j in lanes),
            lengths=np.array([lane.length for lane in lanes]),
            forward=np.array([lane.key.lane < 0 for lane in lanes]),
            first_node=first,
        ),
        lane=lane_of,
        s=np.where(each("length") > 0, offset, offset),
        offset=offset,
        x=np.concatenate([p[0] for p in points]),
        y=np.concatenate([p[1] for p in points]),
        z=each("z"),
        hdg=np.concatenate([p[2] for p in points]),
        pitch=zeros,
        curvature=each("curvature"),
        width=each("width"),
        speed_limit=each("speed_limit"),
        left_lane=beside("left"),
        right_lane=beside("right"),
        lane_change=change.astype(np.uint8)[lane_of],
        segment=np.array([names.index(lane.segment) for lane in lanes], dtype=np.int32)[lane_of],
        source=source,
        target=target,
        relation=relation,
        length=length,
    )


def _lane_edges(
    lanes: Sequence[ToyLane],
    offsets: list[np.ndarray],
    first: np.ndarray,
    row: dict[LaneKey, int],
    points: list[tuple[np.ndarray, ...]],
) -> tuple[np.ndarray, ...]:
    edges = _Edges()
    for index, lane in enumerate(lanes):
        nodes = range(first[index], first[index + 1])
        gap = lane.length / len(nodes)
        for node in nodes[:-1]:
            edges.add(node, node + 1, Relation.SUCCESSOR, gap)
        for follower in lane.next:
            other = row[follower]
            far = lanes[other].length / len(offsets[other])
            edges.add(nodes[-1], int(first[other]), Relation.SUCCESSOR, (gap + far) / 2)
        for beside, relation in ((lane.left, Relation.LEFT), (lane.right, Relation.RIGHT)):
            if beside is None or not lane.change:
                continue
            other = row[beside]
            for k in range(len(nodes) - 1):
                here = np.array([p[k] for p in points[index][:2]])
                there = np.array([p[k + 1] for p in points[other][:2]])
                edges.add(
                    nodes[k], int(first[other]) + k + 1, relation, float(np.hypot(*(there - here)))
                )
    rows = sorted(edges.rows)
    table = np.array(rows, dtype=float).reshape(-1, 4)
    return (
        table[:, 0].astype(np.int32),
        table[:, 1].astype(np.uint8),
        table[:, 2].astype(np.int32),
        table[:, 3],
    )


def _walk_graph(walks: Sequence[ToyWalk], names: list[str], spacing: float) -> PedestrianGraph:
    offsets = [_offsets(walk.length, spacing) for walk in walks]
    counts = [len(part) for part in offsets]
    first = np.concatenate([[0], np.cumsum(counts)]).astype(np.int32)
    row = {walk.key: index for index, walk in enumerate(walks)}
    edges: list[tuple[int, int, int, float]] = []
    for index, walk in enumerate(walks):
        gap = walk.length / counts[index]
        nodes = range(int(first[index]), int(first[index + 1]))
        edges += [(node, node + 1, int(WalkKind.SIDEWALK), gap) for node in nodes[:-1]]
        for other in walk.next:
            ends = sorted((nodes[-1], int(first[row[other]])))
            edges.append((ends[0], ends[1], int(WalkKind.JOINT), spacing))
    edges.sort()
    table = np.array(edges, dtype=float).reshape(-1, 4)
    points = [_along(walk, 0.0, part) for walk, part in zip(walks, offsets, strict=True)]
    lane_of = np.repeat(np.arange(len(walks), dtype=np.int32), counts)

    def joined(k: int) -> np.ndarray:
        return np.concatenate([np.zeros(0), *(p[k] for p in points)])

    return PedestrianGraph(
        spacing=spacing,
        lane_keys=tuple(walk.key for walk in walks),
        roadside=np.zeros(len(walks), dtype=bool),
        first_node=first,
        lane=lane_of,
        s=np.concatenate([np.zeros(0), *offsets]),
        x=joined(0),
        y=joined(1),
        z=np.zeros(len(lane_of)),
        hdg=np.concatenate([np.zeros(0), *(p[2] for p in points)]),
        width=np.array([walk.width for walk in walks], dtype=float)[lane_of],
        segment=np.array([names.index(w.segment) for w in walks], dtype=np.int32)[lane_of],
        source=table[:, 0].astype(np.int32),
        target=table[:, 1].astype(np.int32),
        kind=table[:, 2].astype(np.uint8),
        length=table[:, 3],
        crosswalk=("",) * len(table),
    )


def two_lane_road(length: float = 100.0, *, spacing: float = 2.0) -> MapGraph:
    """Road 1, two lanes of the same direction along +x, -1 left of -2, a sidewalk beside them.

    One segment ``r1``; nodes ``1.0.-2.k`` come first (lane ids ascend).
    """
    left, right = key("1", -1), key("1", -2)
    return map_graph(
        [
            ToyLane(right, 0.0, -5.25, 0.0, length, "r1", left=left),
            ToyLane(left, 0.0, -1.75, 0.0, length, "r1", right=right),
        ],
        walks=[ToyWalk(key("1", -3), 0.0, -8.0, 0.0, length, "r1")],
        spacing=spacing,
    )


def fork() -> MapGraph:
    """Road 1 (100 m east) into junction 9, which goes on to road 2 (east) and road 3 (left, north).

    Segments r1, j9, r2, r3; road 1 also carries the opposite lane 1.0.1, which ends at x = 0.
    A sidewalk runs along road 1 and on along road 2.
    """
    a, back = key("1", -1), key("1", 1)
    ahead, turn = key("90", -1), key("91", -1)
    b, c = key("2", -1), key("3", -1)
    radius = 12.0
    quarter = radius * np.pi / 2
    return map_graph(
        [
            ToyLane(a, 0.0, -1.75, 0.0, 100.0, "r1", next=(ahead, turn)),
            ToyLane(back, 100.0, 1.75, np.pi, 100.0, "r1"),
            ToyLane(ahead, 100.0, -1.75, 0.0, 20.0, "j9", junction="9", next=(b,)),
            ToyLane(turn, 100.0, -1.75, 0.0, quarter, "j9", 1 / radius, junction="9", next=(c,)),
            ToyLane(b, 120.0, -1.75, 0.0, 60.0, "r2"),
            ToyLane(c, 112.0, 10.25, np.pi / 2, 60.0, "r3"),
        ],
        walks=[
            ToyWalk(key("1", -2), 0.0, -5.0, 0.0, 100.0, "r1", next=(key("2", -2),)),
            ToyWalk(key("2", -2), 120.0, -5.0, 0.0, 60.0, "r2"),
        ],
        adjacency=[("r1", "j9"), ("j9", "r2"), ("j9", "r3")],
    )


def ring(radius: float = 100.0) -> MapGraph:
    """One circular lane to the left that follows itself: a graph without a terminal node."""
    lane = key("1", -1)
    return map_graph(
        [ToyLane(lane, radius, 0.0, np.pi / 2, 2 * np.pi * radius, "r1", 1 / radius, next=(lane,))]
    )


def line_of_segments(count: int = 5) -> MapGraph:
    """Roads 1, 2, 3, ... of 40 m in a row, each a segment of its own: r1, r2, ..."""
    lanes = [
        ToyLane(
            key(str(i), -1),
            40.0 * (i - 1),
            -1.75,
            0.0,
            40.0,
            f"r{i}",
            next=(key(str(i + 1), -1),) if i < count else (),
        )
        for i in range(1, count + 1)
    ]
    return map_graph(lanes, adjacency=[(f"r{i}", f"r{i + 1}") for i in range(1, count)])
