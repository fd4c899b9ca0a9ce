"""Exact lane shapes: SUMO's lanes laid on the centre lines of the OpenDRIVE lanes they stand for.

netconvert draws its own curves through junctions, and lanes of constant width outside. The lane
table knows which stretch of which OpenDRIVE lane each SUMO lane stands for; here its shape becomes
that stretch. What the table does not relate keeps its form and follows its neighbours' ends.
Why this way: ``docs/decisions/0002-exact-lane-shapes.md``.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
from lxml import etree
from numpy.typing import NDArray

from odscen.convert.net import INTERNAL, NORMAL, Net

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from odscen.convert.lane_table import LaneTable
    from odscen.convert.net import NetLane
    from odscen.convert.pieces import Piece
    from odscen.ids import SumoLaneId
    from odscen.opendrive.lanes import RoadTable

FloatArray = NDArray[np.float64]
IndexArray = NDArray[np.intp]

CHORD_ERROR = 0.01
"""Metres between a lane's centre line and its shape, at most."""

_DENSE = 0.5
"""Metres between the places from which the vertices of a shape are chosen."""

_KEPT_REST = 1.0
"""Metres of a SUMO lane without OpenDRIVE lane that keep netconvert's form; less is left out."""

_MOVED_END = 0.02
"""Metres: ends this close to the lane before or after are moved onto it; else a vertex is added."""

_LEAST = 1e-3
"""Metres between vertices, and of a shape."""

_DIGITS = 4


def exact_net(net: Net, table: LaneTable, roads: RoadTable) -> Net:
    """Lay the lanes of a network on the OpenDRIVE lanes that they stand for.

    Parameters
    ----------
    table
        The lane table of ``net``.
    roads
        The map that both were made from.

    Returns
    -------
    Net
        The same network but for shapes and lengths of normal and internal lanes. Lanes of one edge
        have one length, the mean of their shapes, as netconvert has it. Ends of consecutive lanes
        coincide.
    """
    shapes = _traced(net, table, roads)
    traced = set(shapes)
    for lane in net.lanes.values():
        if lane.id not in shapes and net.edges[lane.edge].function in (NORMAL, INTERNAL):
            shapes[lane.id] = lane.shape
    _join(net, shapes, traced)
    flat = not table.elevation
    moved = {
        lane: _rounded(shape, flat=flat)
        for lane, shape in shapes.items()
        if shape is not net.lanes[lane].shape
    }
    lengths = _lengths(net, moved)
    lanes = {
        lane.id: replace(
            lane, shape=moved.get(lane.id, lane.shape), length=lengths.get(lane.id, lane.length)
        )
        for lane in net.lanes.values()
    }
    return replace(net, lanes=lanes)


def rewrite_shapes(net_xml: bytes, net: Net) -> bytes:
    """Write shapes and lengths of ``net`` into the file that it came from, where they differ."""
    parser = etree.XMLParser(resolve_entities=False, no_network=True, huge_tree=True)
    root = etree.fromstring(net_xml, parser)
    before = Net.parse(net_xml).lanes
    for element in root.iterfind("edge/lane"):
        lane = net.lanes[element.get("id")]  # type: ignore[index]
        old = before[lane.id]
        if lane.length != old.length:
            element.set("length", f"{lane.length:.{_DIGITS}f}")
        if not np.array_equal(lane.shape, old.shape):
            element.set("shape", _text(lane, net.net_offset))
    content: bytes = etree.tostring(root.getroottree(), xml_declaration=True, encoding="UTF-8")
    return content


def _text(lane: NetLane, offset: tuple[float, float]) -> str:
    points = lane.shape + np.array([*offset, 0.0])
    if not lane.shape[:, 2].any():
        return " ".join([f"{x:.4f},{y:.4f}" for x, y, _ in points.tolist()])
    return " ".join([f"{x:.4f},{y:.4f},{z:.4f}" for x, y, z in points.tolist()])


def _rounded(shape: FloatArray, *, flat: bool) -> FloatArray:
    result: FloatArray = np.round(shape, _DIGITS)
    if flat:
        result[:, 2] = 0.0
    return result


def _traced(net: Net, table: LaneTable, roads: RoadTable) -> dict[SumoLaneId, FloatArray]:
    """Shapes of the lanes that the table relates, in driving direction."""
    lanes = list(net.lanes.values())
    own = _pieces_by_lane(table)
    flat = [piece for row in sorted(own) for piece in own[row]]
    if not flat:
        return {}
    points, first = _points(flat, table, roads)
    shapes: list[FloatArray] = []
    rows = sorted(own)
    index = 0
    for row in rows:
        parts: list[FloatArray] = []
        position = 0.0
        for piece in own[row]:
            if piece.pos[0] - position > _KEPT_REST:
                parts.append(_cut(lanes[row], position, float(piece.pos[0])))
            parts.append(points[first[index] : first[index + 1]])
            position = float(piece.pos[-1])
            index += 1
        if lanes[row].length - position > _KEPT_REST:
            parts.append(_cut(lanes[row], position, lanes[row].length))
        shapes.append(_distinct(np.concatenate(parts)))
    kept = _thinned(shapes)
    return {lanes[row].id: shape for row, shape in zip(rows, kept, strict=True) if len(shape) > 1}


def _pieces_by_lane(table: LaneTable) -> dict[int, list[Piece]]:
    """Pieces of each SUMO lane in order, without those that overlap earlier ones.

    Chains through stubs share lanes and may divide them differently; the first one counts.
    """
    own: dict[int, list[Piece]] = {}
    for piece in table.pieces:
        taken = own.setdefault(piece.sumo, [])
        low, high = float(piece.pos[0]), float(piece.pos[-1])
        slack = 0.1 * (high - low)
        if all(other.pos[-1] <= low + slack or other.pos[0] >= high - slack for other in taken):
            taken.append(piece)
            taken.sort(key=lambda one: float(one.pos[0]))
    return own


def _points(
    pieces: Sequence[Piece], table: LaneTable, roads: RoadTable
) -> tuple[FloatArray, IndexArray]:
    """Points ``(N, 3)`` along the lane centres of pieces, and the first of each piece."""
    rows = np.array([roads.lane_index[table.lane_keys[piece.lane]] for piece in pieces])
    start = np.array([piece.s[0] for piece in pieces])
    end = np.array([piece.s[-1] for piece in pieces])
    counts = np.maximum(1, np.ceil(np.abs(end - start) / _DENSE)).astype(np.intp) + 1
    first = np.concatenate(([0], np.cumsum(counts))).astype(np.intp)
    owner = np.repeat(np.arange(len(counts)), counts)
    share = (np.arange(first[-1]) - first[owner]) / (counts[owner] - 1)
    found = roads.lane_points(rows[owner], start[owner] + share * (end - start)[owner])
    return np.column_stack((found.x, found.y, found.z)), first


def _cut(lane: NetLane, low: float, high: float) -> FloatArray:
    """Part of a lane's shape between two positions, in terms of its length attribute."""
    arc = _arc(lane.shape)
    bounds = np.array([low, high]) * (arc[-1] / lane.length)
    inner = (arc > bounds[0]) & (arc < bounds[1])
    ends = np.column_stack([np.interp(bounds, arc, lane.shape[:, axis]) for axis in range(3)])
    return np.vstack((ends[:1], lane.shape[inner], ends[1:]))


def _arc(shape: FloatArray) -> FloatArray:
    """Length up to each vertex, metres, in space, as SUMO measures it."""
    steps = np.sqrt((np.diff(shape, axis=0) ** 2).sum(axis=1))
    return np.concatenate(([0.0], np.cumsum(steps)))


def _distinct(shape: FloatArray) -> FloatArray:
    """Drop vertices on top of the one before; the last one stays."""
    steps = np.hypot(*np.diff(shape[:, :2], axis=0).T)
    keep = np.concatenate(([True], steps > _LEAST))
    if not keep[-1] and keep.sum() > 1:
        keep[np.flatnonzero(keep)[-1]] = False
        keep[-1] = True
    return shape[keep]


def _thinned(shapes: Sequence[FloatArray]) -> list[FloatArray]:
    """Leave out vertices within :data:`CHORD_ERROR` of the chord (Douglas-Peucker, all at once)."""
    counts = np.array([len(shape) for shape in shapes])
    bounds = np.concatenate(([0], np.cumsum(counts)))
    points = np.concatenate(list(shapes))
    keep = np.zeros(len(points), dtype=np.bool_)
    keep[bounds[:-1]] = keep[bounds[1:] - 1] = True
    while True:
        kept = np.flatnonzero(keep)
        span = np.cumsum(keep) - 1
        start = points[kept[span]]
        chord = points[kept[np.minimum(span + 1, len(kept) - 1)]] - start
        error = _beside(points - start, chord)
        error[keep] = 0.0
        worst = np.maximum.reduceat(error, kept)
        new = (error > CHORD_ERROR) & (error >= worst[span])
        if not new.any():
            break
        keep |= new
    return [points[a:b][keep[a:b]] for a, b in pairwise(bounds)]


def _beside(delta: FloatArray, chord: FloatArray) -> FloatArray:
    """Distance of points ``delta`` from the stretch from the origin to ``chord``."""
    square = np.maximum(np.einsum("ij,ij->i", chord, chord), 1e-12)
    share = np.clip(np.einsum("ij,ij->i", delta, chord) / square, 0.0, 1.0)
    distance: FloatArray = np.linalg.norm(delta - share[:, None] * chord, axis=1)
    return distance


def _join(net: Net, shapes: dict[SumoLaneId, FloatArray], traced: set[SumoLaneId]) -> None:
    """Make internal lanes begin and end where the lanes before and after do."""
    for before, after in _joints(net):
        one, two = shapes.get(before), shapes.get(after)
        if one is None or two is None:
            continue
        internal = net.edges[net.lanes[after].edge].function == INTERNAL
        if internal:
            shapes[after] = _led_to(two, one[-1], 0, exact=after in traced)
        else:
            shapes[before] = _led_to(one, two[0], -1, exact=before in traced)


def _joints(net: Net) -> Iterable[tuple[SumoLaneId, SumoLaneId]]:
    """Pairs of lanes that follow each other, one of them internal, upstream ones first."""
    pairs = [(c.from_lane, c.via or c.to_lane) for c in net.connections]
    functions = {lane.id: net.edges[lane.edge].function for lane in net.lanes.values()}
    pairs = [
        pair
        for pair in dict.fromkeys(pairs)
        if INTERNAL in (functions[pair[0]], functions[pair[1]])
        and {functions[pair[0]], functions[pair[1]]} <= {NORMAL, INTERNAL}
    ]
    # Ends at normal lanes first: then the two parts of a split lane meet where the first one ends.
    return sorted(pairs, key=lambda pair: functions[pair[0]] == functions[pair[1]])


def _led_to(shape: FloatArray, end: FloatArray, which: int, *, exact: bool) -> FloatArray:
    """Make a shape begin (``which`` 0) or end (-1) at a point.

    Exact shapes get a vertex more, others are sheared: the other end stays where it is.
    """
    gap = end - shape[which]
    distance = float(np.hypot(gap[0], gap[1]))
    if distance == 0.0:
        return shape
    if not exact:
        arc = _arc(shape)
        share = arc / arc[-1] if arc[-1] > 0 else np.linspace(0.0, 1.0, len(arc))
        sheared: FloatArray = shape + (share if which else 1.0 - share)[:, None] * gap
        return sheared
    if distance > _MOVED_END:
        parts = (shape, end[None]) if which else (end[None], shape)
        return np.vstack(parts)
    result = shape.copy()
    result[which] = end
    return result


def _lengths(net: Net, moved: Mapping[SumoLaneId, FloatArray]) -> dict[SumoLaneId, float]:
    """Lengths of the lanes of all edges with moved lanes: SUMO wants one per edge."""
    lengths: dict[SumoLaneId, float] = {}
    for edge in net.edges.values():
        if not any(lane in moved for lane in edge.lanes):
            continue
        drawn = [_arc(moved.get(lane, net.lanes[lane].shape))[-1] for lane in edge.lanes]
        length = max(round(float(np.mean(drawn)), _DIGITS), 0.1)
        lengths.update(dict.fromkeys(edge.lanes, length))
    return lengths
