"""The table between OpenDRIVE lanes and SUMO lanes: the one way to cross over.

It also keeps what else is needed to know of the network, so that ``net.net.xml`` is not parsed
again. Made by :mod:`odscen.convert.building.network`, stored as JSON by
:mod:`odscen.convert.lane_table.table_json`.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import NDArray

    from odscen.base.arrays import FloatArray, Int32Array
    from odscen.base.ids import JunctionId, LaneKey, Roadside, SumoEdgeId, SumoLaneId
    from odscen.convert.model.net import LightLink, LinkConflict, Phase


SIMPLE_S = 0.005
"""Metres: knots that change s by less than this are left out."""
SIMPLE_DEVIATION = 0.01
"""Metres: the same for the deviation, which is a figure for reports and limits."""

LEAST_STEP = 1e-3
"""Metres between knots."""


class MappingInterval(NamedTuple):
    """Knots of a monotone, piecewise linear relation between s and pos.

    Attributes
    ----------
    lane
        Row of the OpenDRIVE lane.
    sumo
        Row of the SUMO lane.
    pos
        Ascending positions on the SUMO lane, metres, in terms of its length attribute.
    s
        Road coordinates, strictly ascending or strictly descending.
    deviation
        Distance between the two lane centres at each knot, metres.
    """

    lane: int
    sumo: int
    pos: FloatArray
    s: FloatArray
    deviation: FloatArray

    @property
    def span(self) -> tuple[float, float]:
        """Smallest and largest s."""
        ends = float(self.s[0]), float(self.s[-1])
        return min(ends), max(ends)


def monotone(interval: MappingInterval, *, growing: bool) -> MappingInterval | None:
    """Drop knots that run backwards; ``None`` if fewer than two are left."""
    s = interval.s if growing else -interval.s
    keep = np.flatnonzero(s >= np.maximum.accumulate(s))
    steps = (np.diff(s[keep]) > LEAST_STEP) & (np.diff(interval.pos[keep]) > LEAST_STEP)
    keep = keep[np.concatenate(([True], steps))] if len(keep) else keep
    if len(keep) < 2:
        return None
    return MappingInterval(
        interval.lane, interval.sumo, interval.pos[keep], interval.s[keep], interval.deviation[keep]
    )


def simplified(interval: MappingInterval) -> MappingInterval:
    """Leave out knots that a straight line between their neighbours gives anyway."""
    keep = np.zeros(len(interval.pos), dtype=np.bool_)
    keep[[0, -1]] = True
    open_spans = [(0, len(interval.pos) - 1)]
    while open_spans:
        low, high = open_spans.pop()
        if high - low < 2:
            continue
        inner = slice(low + 1, high)
        share = (interval.pos[inner] - interval.pos[low]) / (interval.pos[high] - interval.pos[low])
        error_s = np.abs(
            interval.s[low] + share * (interval.s[high] - interval.s[low]) - interval.s[inner]
        )
        line = interval.deviation[low] + share * (
            interval.deviation[high] - interval.deviation[low]
        )
        error = np.maximum(
            error_s / SIMPLE_S, np.abs(line - interval.deviation[inner]) / SIMPLE_DEVIATION
        )
        worst = int(np.argmax(error))
        if error[worst] > 1.0:
            middle = low + 1 + worst
            keep[middle] = True
            open_spans += [(low, middle), (middle, high)]
    return MappingInterval(
        interval.lane, interval.sumo, interval.pos[keep], interval.s[keep], interval.deviation[keep]
    )


class Span(NamedTuple):
    """Where an interval answers which SUMO lane is here: s from ``low`` to ``high`` of its lane."""

    lane: int
    low: float
    high: float
    interval: int


def answering(intervals: Sequence[MappingInterval], *, least: float = 0.01) -> list[Span]:
    """Divide the OpenDRIVE lanes among their mapping intervals; sorted, without overlaps.

    Where several SUMO lanes run over the same stretch (connections that share a connecting lane),
    the one with the smallest mean deviation answers, of equals the first. Remainders shorter than
    ``least`` metres are left out.
    """
    order = sorted(range(len(intervals)), key=lambda i: (_mean_deviation(intervals[i]), i))
    spans: dict[int, list[Span]] = {}
    for i in order:
        low, high = intervals[i].span
        lane = intervals[i].lane
        taken = spans.setdefault(lane, [])
        free = _free_spans(low, high, taken)
        taken += [Span(lane, a, b, i) for a, b in free if b - a >= least]
        taken.sort()
    return sorted(span for taken in spans.values() for span in taken)


def _free_spans(low: float, high: float, taken: Sequence[Span]) -> list[tuple[float, float]]:
    """What sorted, disjoint spans leave free from ``low`` to ``high``."""
    free: list[tuple[float, float]] = []
    for span in taken:
        if span.high <= low or span.low >= high:
            continue
        if span.low > low:
            free.append((low, span.low))
        low = span.high
    if high > low:
        free.append((low, high))
    return free


def _mean_deviation(interval: MappingInterval) -> float:
    return round(float(np.mean(interval.deviation)), 3)


SNAP = 0.65
"""Metres: a place this close beside the end of an interval is taken to be on it."""

_STRIDE = 1e6
"""Longer than any lane: lane number times this plus s sorts by lane, then s (exact to 1e-5 m)."""


@dataclass(frozen=True, slots=True, eq=False)
class Lookup:
    """Piecewise linear functions on intervals of many lanes, sorted by lane and place."""

    interval_lane: NDArray[np.int64]
    low: FloatArray
    high: FloatArray
    interval_key: FloatArray
    function: NDArray[np.int64]
    first: NDArray[np.int64]
    knot_key: FloatArray
    x: FloatArray
    y: FloatArray
    deviation: FloatArray

    @classmethod
    def of(
        cls,
        knots: Sequence[tuple[FloatArray, FloatArray, FloatArray]],
        intervals: Sequence[tuple[int, float, float, int]],
    ) -> Lookup:
        """Gather functions and the intervals on which they answer.

        Parameters
        ----------
        knots
            Per function x (ascending), y and deviation at its knots.
        intervals
            Lane, smallest and largest x, and number of the function; sorted, without overlaps.
        """
        table = np.array(intervals, dtype=np.float64).reshape(-1, 4)
        counts = [len(x) for x, _, _ in knots]
        first = np.concatenate(([0], np.cumsum(counts, dtype=np.int64))).astype(np.int64)
        parts = [np.concatenate([knot[i] for knot in knots] or [np.zeros(0)]) for i in range(3)]
        owner = np.repeat(np.arange(len(counts)), counts)
        return cls(
            table[:, 0].astype(np.int64),
            table[:, 1],
            table[:, 2],
            table[:, 0] * _STRIDE + table[:, 1],
            table[:, 3].astype(np.int64),
            first,
            owner * _STRIDE + parts[0],
            *parts,
        )

    def find(
        self, lane: NDArray[np.int64], x: FloatArray
    ) -> tuple[NDArray[np.int64], FloatArray, FloatArray]:
        """Find the function that answers (-1: none), the place on it, and how far off that is."""
        none = np.full(len(x), -1, dtype=np.int64)
        if not len(self.low):
            return none, x, np.zeros(len(x))
        after = np.searchsorted(self.interval_key, lane * _STRIDE + x, side="right")
        best, gap = none, np.full(len(x), np.inf)
        for candidate in (after - 1, after):
            index = np.clip(candidate, 0, len(self.low) - 1)
            off = np.maximum(np.maximum(self.low[index] - x, x - self.high[index]), 0.0)
            better = (self.interval_lane[index] == lane) & (off < gap) & (off <= SNAP)
            best = np.where(better, index, best)
            gap = np.where(better, off, gap)
        index = np.maximum(best, 0)
        on = np.clip(x, self.low[index], self.high[index])
        return np.where(best < 0, -1, self.function[index]), on, np.where(best < 0, 0.0, gap)

    def value(self, function: NDArray[np.int64], x: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Value and deviation at places ``x`` of functions ``function``."""
        if not len(self.x):
            return np.zeros(len(x)), np.zeros(len(x))
        own = np.maximum(function, 0)
        after = np.searchsorted(self.knot_key, own * _STRIDE + x, side="right")
        after = np.clip(after, self.first[own] + 1, self.first[own + 1] - 1)
        before = after - 1
        share = (x - self.x[before]) / (self.x[after] - self.x[before])
        share = np.clip(share, 0.0, 1.0)
        return (
            self.y[before] + share * (self.y[after] - self.y[before]),
            self.deviation[before] + share * (self.deviation[after] - self.deviation[before]),
        )


VERSION = 4


class SumoPlace(NamedTuple):
    """A place on a SUMO lane.

    ``pos`` and ``deviation`` (between the two lane centres there) in metres.
    """

    edge: SumoEdgeId
    lane: SumoLaneId
    index: int  # type: ignore[assignment]  # SUMO's word; hides tuple.index
    pos: float
    deviation: float
    internal: bool


class XodrPlace(NamedTuple):
    """A place on an OpenDRIVE lane; ``s`` and ``deviation`` in metres."""

    lane: LaneKey | Roadside
    s: float
    deviation: float


class SumoPlaces(NamedTuple):
    """Places on SUMO lanes, shape ``(N,)`` each.

    Attributes
    ----------
    lane
        Row of :attr:`LaneTable.lanes`, -1 where there is no SUMO lane.
    pos, deviation
        Metres; NaN where there is no SUMO lane.
    """

    lane: Int32Array
    pos: FloatArray
    deviation: FloatArray


class XodrPlaces(NamedTuple):
    """Places on OpenDRIVE lanes, shape ``(N,)`` each; ``lane`` is a row of ``lane_keys`` or -1."""

    lane: Int32Array
    s: FloatArray
    deviation: FloatArray


class SumoLane(NamedTuple):
    """A lane of the network; ``allowed`` are vehicle classes, ``None`` for all."""

    id: SumoLaneId
    edge: SumoEdgeId
    index: int  # type: ignore[assignment]
    length: float
    speed: float
    width: float
    allowed: frozenset[str] | None

    def allows(self, vclass: str) -> bool:
        """Whether vehicles of a class may use the lane."""
        return self.allowed is None or vclass in self.allowed


class SumoEdge(NamedTuple):
    """An edge of the network.

    ``function`` is normal, internal, crossing, walkingarea or connector; ``lanes`` by index.
    """

    id: SumoEdgeId
    function: str
    from_junction: str
    to_junction: str
    length: float
    lanes: tuple[SumoLaneId, ...]


class SumoLink(NamedTuple):
    """A connection between lanes; ``via`` is the internal lane, ``tl`` the traffic light, or empty.

    From a normal lane ``via`` is the first internal lane; the links from internal lanes lead on.
    """

    from_lane: SumoLaneId
    to_lane: SumoLaneId
    via: SumoLaneId
    tl: str


class SumoLight(NamedTuple):
    """A traffic light of the network, with its program.

    Attributes
    ----------
    junctions
        OpenDRIVE junctions that it is in; none at a crosswalk on the open road.
    phases
        In their order; the letters of a state are those of the links that the light rules.
    offset
        Seconds.
    signals
        For each link the OpenDRIVE signals behind it; none for crossings.
    links
        What each link is.
    conflicts
        Links that meet.
    """

    id: str
    junctions: tuple[JunctionId, ...]
    phases: tuple[Phase, ...]
    offset: float
    signals: tuple[tuple[str, ...], ...]
    links: tuple[LightLink, ...] = ()
    conflicts: tuple[LinkConflict, ...] = ()


@dataclass(frozen=True, eq=False)
class LaneTable:
    """Where OpenDRIVE lanes are in the SUMO network, and back; immutable.

    Attributes
    ----------
    lane_keys
        OpenDRIVE lanes, drivable, walkable and for bicycles, and walks beside lanes.
    lanes
        All SUMO lanes by id, in the order of the file.
    edges
        All SUMO edges by id.
    links
        All connections.
    walk_links
        Pairs of edges (smaller id first, sorted) between which a person can walk either way.
    intervals
        The relation itself; ``lane`` of an interval is a row of ``lane_keys``, ``sumo`` one of
        ``lanes``.
    net_offset
        SUMO position minus OpenDRIVE position, metres.
    boundary
        x_min, y_min, x_max, y_max in SUMO's frame, metres.
    counts
        Numbers of edges, lanes, junctions, tl_logics, crossings, ... for the catalogue.
    elevation
        Whether the network has heights.
    lights
        Traffic lights, in the order of the file.
    """

    lane_keys: tuple[LaneKey | Roadside, ...]
    lanes: dict[SumoLaneId, SumoLane]
    edges: dict[SumoEdgeId, SumoEdge]
    links: tuple[SumoLink, ...]
    walk_links: tuple[tuple[SumoEdgeId, SumoEdgeId], ...]
    intervals: tuple[MappingInterval, ...]
    net_offset: tuple[float, float]
    boundary: tuple[float, float, float, float]
    lefthand: bool
    counts: Mapping[str, int]
    elevation: bool
    lights: tuple[SumoLight, ...] = ()

    # Crossing over

    def to_sumo(self, lane: LaneKey | Roadside, s: float) -> SumoPlace | None:
        """Find the SUMO place of road coordinate ``s`` on an OpenDRIVE lane, if there is one."""
        places = self.sumo_places((lane,), np.zeros(1, dtype=np.int32), np.array([s]))
        if places.lane[0] < 0:
            return None
        sumo = self.lane_list[places.lane[0]]
        return SumoPlace(
            sumo.edge,
            sumo.id,
            sumo.index,
            float(places.pos[0]),
            float(places.deviation[0]),
            self.edges[sumo.edge].function == "internal",
        )

    def to_xodr(self, lane: SumoLaneId, pos: float) -> XodrPlace | None:
        """Find the OpenDRIVE place of position ``pos`` on a SUMO lane, if there is one."""
        row = self.lane_row.get(lane)
        if row is None:
            return None
        places = self.xodr_places(np.array([row]), np.array([pos]))
        if places.lane[0] < 0:
            return None
        key = self.lane_keys[places.lane[0]]
        return XodrPlace(key, float(places.s[0]), float(places.deviation[0]))

    def sumo_places(
        self, lane_keys: Sequence[LaneKey | Roadside], lane: NDArray[np.integer[Any]], s: FloatArray
    ) -> SumoPlaces:
        """Find SUMO places for many nodes.

        Parameters
        ----------
        lane_keys
            Any list of lanes, for example ``LaneGraph.lanes.keys``.
        lane
            Shape ``(N,)``: index into ``lane_keys``.
        s
            Shape ``(N,)``: road coordinates, metres.
        """
        rows = np.array([self.key_row.get(key, -1) for key in lane_keys], dtype=np.int64)
        own = rows[lane] if len(lane_keys) else np.full(len(s), -1)
        interval, s_on, gap = self._by_s.find(own, s)
        pos, deviation = self._by_s.value(interval, s_on)
        none = interval < 0
        return SumoPlaces(
            np.where(none, -1, self._interval_sumo[interval]).astype(np.int32),
            np.where(none, np.nan, pos),
            np.where(none, np.nan, np.hypot(deviation, gap)),
        )

    def xodr_places(self, lane: NDArray[np.integer[Any]], pos: FloatArray) -> XodrPlaces:
        """Find OpenDRIVE places for many positions; ``lane`` holds rows of ``lanes``."""
        interval, pos_on, gap = self._by_pos.find(np.asarray(lane, dtype=np.int64), pos)
        s, deviation = self._by_pos.value(interval, pos_on)
        none = interval < 0
        return XodrPlaces(
            np.where(none, -1, self._interval_lane[interval]).astype(np.int32),
            np.where(none, np.nan, s),
            np.where(none, np.nan, np.hypot(deviation, gap)),
        )

    # The network

    def allowed(self, lane: SumoLaneId, vclass: str) -> bool:
        """Whether vehicles of a class may use a lane."""
        return self.lanes[lane].allows(vclass)

    def walk_connected(self, one: SumoEdgeId, other: SumoEdgeId) -> bool:
        """Whether a person can walk from one edge to another at all."""
        groups = self._walk_groups
        return one == other or (one in groups and groups[one] == groups.get(other))

    @cached_property
    def walk_neighbours(self) -> dict[SumoEdgeId, tuple[SumoEdgeId, ...]]:
        """Edges that can be walked to from each edge without using a third, sorted."""
        found: dict[SumoEdgeId, set[SumoEdgeId]] = {}
        for one, other in self.walk_links:
            found.setdefault(one, set()).add(other)
            found.setdefault(other, set()).add(one)
        return {edge: tuple(sorted(others)) for edge, others in sorted(found.items())}

    @cached_property
    def links_from(self) -> dict[SumoLaneId, tuple[SumoLink, ...]]:
        """Connections that leave each lane."""
        found: dict[SumoLaneId, list[SumoLink]] = {}
        for link in self.links:
            found.setdefault(link.from_lane, []).append(link)
        return {lane: tuple(links) for lane, links in found.items()}

    @cached_property
    def lane_list(self) -> tuple[SumoLane, ...]:
        """The SUMO lanes by row."""
        return tuple(self.lanes.values())

    @cached_property
    def lane_row(self) -> dict[SumoLaneId, int]:
        """Row of each SUMO lane."""
        return {lane: row for row, lane in enumerate(self.lanes)}

    @cached_property
    def key_row(self) -> dict[LaneKey | Roadside, int]:
        """Row of each OpenDRIVE lane."""
        return {key: row for row, key in enumerate(self.lane_keys)}

    @cached_property
    def spans(self) -> list[Span]:
        """Which interval answers where on the OpenDRIVE lanes; sorted, without overlaps."""
        return answering(self.intervals)

    @cached_property
    def _walk_groups(self) -> dict[SumoEdgeId, int]:
        """Number of the connected part of the walking network that each edge is in."""
        row = {edge: number for number, edge in enumerate(self.walk_neighbours)}
        pairs = np.array([(row[a], row[b]) for a, b in self.walk_links]).reshape(-1, 2).T
        links = coo_array((np.ones(pairs.shape[1]), pairs.astype(int)), shape=(len(row), len(row)))
        _, group = connected_components(links, directed=False)
        return dict(zip(row, group.tolist(), strict=True))

    @cached_property
    def _interval_sumo(self) -> Int32Array:
        return np.array([interval.sumo for interval in self.intervals] or [-1], dtype=np.int32)

    @cached_property
    def _interval_lane(self) -> Int32Array:
        return np.array([interval.lane for interval in self.intervals] or [-1], dtype=np.int32)

    @cached_property
    def _by_s(self) -> Lookup:
        knots = [
            (interval.s, interval.pos, interval.deviation)
            if interval.s[0] < interval.s[-1]
            else (interval.s[::-1], interval.pos[::-1], interval.deviation[::-1])
            for interval in self.intervals
        ]
        return Lookup.of(
            knots, [(span.lane, span.low, span.high, span.interval) for span in self.spans]
        )

    @cached_property
    def _by_pos(self) -> Lookup:
        knots = [(interval.pos, interval.s, interval.deviation) for interval in self.intervals]
        spans = sorted(
            (interval.sumo, float(interval.pos[0]), float(interval.pos[-1]), index)
            for index, interval in enumerate(self.intervals)
        )
        return Lookup.of(knots, spans)
