"""One SUMO junction: internal lanes, links, right of way, crossings and its traffic light."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import shapely
from numpy.lib.stride_tricks import sliding_window_view

from odscen.base.ids import SumoEdgeId
from odscen.convert.building.junction_ruling import (
    junction_kind,
    ruled,
    sight_without_sign,
    signposts,
)
from odscen.convert.model.lane_alignment import divided_shape, drawn_length
from odscen.convert.model.net import (
    INTERNAL,
    LEAST_LENGTH,
    NetEdge,
    NetJunction,
    NetLane,
    NetLink,
    TrafficLight,
)
from odscen.convert.model.net_ids import internal_edge_id, lane_id
from odscen.convert.model.right_of_way import MOST_WIDTH, OPPOSING, Sign, wrapped
from odscen.convert.signals.light_links import direction, light_links, nearer_edge
from odscen.convert.signals.shared_green import LightLinks, light_stages, link_conflicts
from odscen.convert.signals.signal_programs import program

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from collections.abc import Set as AbstractSet

    from odscen.base.arrays import FloatArray
    from odscen.base.ids import SumoLaneId
    from odscen.convert.building.junction_ruling import Ruling
    from odscen.convert.model.net import Request
    from odscen.convert.model.right_of_way import Conflicts, Movement, Walkway
    from odscen.convert.pedestrian.pedestrian_network import PlacedCrossing


BUS_LENGTH = 12.0
"""Metres of the longest body that turns are made for."""

MOST_SWEPT = 4.0
"""Metres that are added to the width of an internal lane, at most."""

LEAST_BENT = 0.25
"""Metres that a path which goes straight on bends aside, from which on that is allowed for."""

_STRAIGHT = math.radians(30.0)
"""Turns of less than that go straight on."""

_STEP = 0.5
"""Metres between the places at which a body is looked at."""


def swept_width(movement: Movement, length: float) -> float:
    """Metres by which an internal lane is wider for a bus: SUMO keeps others off a lane's width.

    Half of what a lane is wider lies on the side of the flank: hence twice the sagitta.

    Parameters
    ----------
    length
        Metres of the path.
    """
    radius = length / max(abs(movement.turn), 1e-3)
    aside = max(BUS_LENGTH**2 / (8.0 * radius), bent_aside(movement))
    return min(2.0 * aside, MOST_SWEPT)


def bent_aside(movement: Movement) -> float:
    """Metres to which a bus that goes straight on over a bent path, as of an S, leaves it.

    0 for turns, for straight paths and for those that bend aside by less than ``LEAST_BENT``.
    """
    if abs(movement.turn) >= _STRAIGHT:
        return 0.0
    path = _with_ends(movement.shape[:, :2])
    along = np.concatenate(([0.0], np.cumsum(np.hypot(*np.diff(path, axis=0).T))))
    places = np.arange(0.0, along[-1], _STEP)
    xy = np.column_stack([np.interp(places, along, path[:, k]) for k in (0, 1)])
    body = round(BUS_LENGTH / _STEP) + 1
    deepest = float(_arc_heights(np.moveaxis(sliding_window_view(xy, body, axis=0), 2, 1)).max())
    return deepest if deepest >= LEAST_BENT else 0.0


def _with_ends(path: FloatArray) -> FloatArray:
    """Path ``(K, 2)`` with the length of a bus straight on before and behind it."""
    first, last = path[0] - path[1], path[-1] - path[-2]
    before = path[0] + first / np.hypot(*first) * BUS_LENGTH
    behind = path[-1] + last / np.hypot(*last) * BUS_LENGTH
    return np.vstack([before, path, behind])


def _arc_heights(arcs: FloatArray) -> FloatArray:
    """Metres to which arcs ``(N, K, 2)`` leave their chords."""
    chord = arcs[:, -1] - arcs[:, 0]
    offset = arcs - arcs[:, :1]
    aside = np.abs(chord[:, :1] * offset[..., 1] - chord[:, 1:] * offset[..., 0]).max(axis=1)
    heights: FloatArray = aside / np.hypot(chord[:, 0], chord[:, 1])
    return heights


LEAST_ROOM = 4.0
"""Metres between the stop line and the waiting place, at least."""

WIDEST = 3.0
"""Metres from the path of others at which one waits, at most; less between narrow lanes."""

BEFORE = 0.5
"""Metres that are left free before the other path."""

_TURN = math.radians(30.0)


def waiting_places(
    movements: Sequence[Movement],
    walkways: Sequence[Walkway],
    rights: Sequence[Request],
    waiting: Sequence[bool],
    *,
    side: float,
    lit: bool,
) -> dict[int, float]:
    """Metres along the path to the waiting place, of each movement that has one.

    Parameters
    ----------
    rights
        Of the movements, then of the crossings over ``walkways``.
    waiting
        Whether those of a movement wait inside at all.
    side
        1 where traffic keeps right, -1 where it keeps left.
    lit
        Whether lights hold back those who cross near the stop line.
    """
    lines = [shapely.LineString(movement.shape[:, :2]) for movement in movements]
    areas = [
        shapely.LineString(w.axis[:, :2]).buffer(w.width / 2.0 + 1.0, cap_style="flat")
        for w in walkways
    ]
    found: dict[int, float] = {}
    for number, movement in enumerate(movements):
        if not waiting[number] or side * movement.turn < _TURN:
            continue
        before = rights[number].yields_to
        towards = {
            _comes_towards(movement, movements[n]) or movements[n].source[0] == movement.source[0]
            for n in before
            if n < len(movements)
        }
        # Without lights nobody holds back traffic from the sides for those who stand inside.
        if not (towards == {True} or (lit and True in towards)):
            continue
        line = lines[number]
        places = [
            lines[n].buffer(_clearance_between(movement, movements[n]))
            if n < len(movements)
            else areas[n - len(movements)]
            for n in sorted(before)
        ]
        ways = [_metres_to_place(line, place) for place in places]
        if lit:
            crossings = [n >= len(movements) for n in sorted(before)]
            ways = [
                way
                for way, walked in zip(ways, crossings, strict=True)
                if not (walked and way < LEAST_ROOM)
            ]
        place = min(ways, default=0.0) - BEFORE
        if place >= LEAST_ROOM and line.length - place >= 1.0:
            found[number] = round(place, 2)
    return found


def _clearance_between(one: Movement, other: Movement) -> float:
    """Metres between paths at which even a lorry that waits is not in the way of a bus."""
    apart = max(MOST_WIDTH, min(WIDEST, 0.9 * min(one.width, other.width)))
    return apart + bent_aside(other)


def _comes_towards(one: Movement, other: Movement) -> bool:
    return abs(wrapped(other.heading_in - one.heading_in)) > OPPOSING


def _metres_to_place(line: shapely.LineString, place: shapely.Geometry) -> float:
    """Metres along a line to where it first is in a place."""
    shared = line.intersection(place)
    if shared.is_empty:
        return float(line.length)
    places = shapely.points(shapely.get_coordinates(shared))
    return float(shapely.line_locate_point(line, places).min())


def inner_junctions(
    name: str,
    movements: Sequence[Movement],
    rights: Sequence[Request],
    beyond: Mapping[int, NetLane],
) -> tuple[NetJunction, ...]:
    """SUMO's internal junctions of a junction.

    SUMO sees vehicles on the internal lane of another path only if the two centre lines cross, or
    lead to one lane. Of paths that only come near each other, as of two opposing turns, the lane
    that leads out is therefore one to give way to as well, like the lanes that lead in.

    Parameters
    ----------
    beyond
        Lane after the waiting place, by movement.
    """
    lines = [shapely.LineString(movement.shape[:, :2]) for movement in movements]
    result = []
    for number, lane in beyond.items():
        right = rights[number]
        before = [n for n in sorted(right.yields_to) if n < len(movements)]
        leading_out = [
            beyond[n].id if n in beyond else lane_id(internal_edge_id(name, n))
            for n in before
            if movements[n].target != movements[number].target
            and not lines[number].intersects(lines[n])
        ]
        towards = dict.fromkeys([*(lane_id(*movements[n].source) for n in before), *leading_out])
        paths = [
            lane_id(internal_edge_id(name, n)) for n in sorted(right.foes) if n < len(movements)
        ]
        x, y, z = (float(value) for value in lane.shape[0])
        own = lane_id(internal_edge_id(name, number))
        result.append(
            NetJunction(lane.id, "internal", (x, y, z), lane.shape, (own, *towards), tuple(paths))
        )
    return tuple(result)


@dataclass(frozen=True, slots=True, eq=False)
class Passage:
    """A movement with all that its internal lane needs.

    ``lights`` are the OpenDRIVE signals that control it; ``heavy_speed`` is that of trucks and
    buses in its curve, m/s.
    """

    movement: Movement
    length: float
    speed: float
    allowed: frozenset[str]
    type: str
    xodr: tuple[str, ...]
    lights: tuple[str, ...] = ()
    heavy_speed: float = math.inf


class Surroundings(NamedTuple):
    """What a junction needs to know beside its passages.

    Attributes
    ----------
    place, outline
        Where it is: ``(x, y, z)`` and shape ``(K, 3)``.
    incoming
        Lanes that end there, with those that lead nowhere.
    high_low
        Pairs of OpenDRIVE roads, incoming or connecting, of which the first has priority.
    controllers
        Controller of each signal.
    xodr
        OpenDRIVE junctions, for the file.
    walk_signals
        Pedestrian lights of a crosswalk on a plain road.
    """

    place: tuple[float, float, float]
    outline: FloatArray
    incoming: tuple[SumoLaneId, ...]
    high_low: frozenset[tuple[str, str]]
    controllers: Mapping[str, str]
    lefthand: bool
    xodr: str
    walk_signals: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True, eq=False)
class BuiltJunction:
    """The parts of a junction.

    ``lanes`` are the internal lanes of its passages, in their order; of a passage whose vehicles
    wait inside, the lane up to there. ``beyond`` has the lane after that place, and how many metres
    from the stop line it is.
    """

    junction: NetJunction
    inner: tuple[NetEdge, ...]
    links: tuple[NetLink, ...]
    light: TrafficLight | None
    lanes: tuple[NetLane, ...]
    beyond: Mapping[int, tuple[NetLane, float]]
    waiting: tuple[NetJunction, ...]
    conflicts: Conflicts


def build_junction(
    name: str,
    passages: Sequence[Passage],
    crossings: Sequence[PlacedCrossing],
    around: Surroundings,
) -> BuiltJunction:
    """Make a junction.

    Parameters
    ----------
    passages
        Sorted by the lane that they come from: SUMO numbers links in that order.
    crossings
        Sorted by the walking area at which they start.
    """
    signalled = any(passage.lights for passage in passages)
    # Pedestrian lights alone: vehicles have a light as well, or nobody could ever cross.
    signalled_walk = not signalled and bool(around.walk_signals and crossings and passages)
    signalled |= signalled_walk
    if signalled:
        # At a light on a plain road the lanes beside those that it is valid for are free.
        whole = bool(around.xodr or crossings)
        passages = _obey_approach_signals(passages, whole_edges=whole)
    cars = ["passenger" in passage.allowed for passage in passages]
    walkways = [crossing.walkway for crossing in crossings]
    ruling = ruled(
        _mark_unsignalled_yield(passages)
        if signalled and not signalled_walk
        else [passage.movement for passage in passages],
        walkways,
        cars,
        high_low=around.high_low,
        lefthand=around.lefthand,
        signalled=signalled,
    )
    movements, conflicts, rights = ruling.movements, ruling.conflicts, ruling.rights
    places = waiting_places(
        movements,
        walkways,
        rights,
        [car and not ruling.rules.all_stop and not ruling.equal for car in cars],
        side=-1.0 if around.lefthand else 1.0,
        lit=signalled,
    )
    light, rows = None, dict[int, int]()
    if signalled:
        light, rows = _build_light(name, passages, ruling, crossings, around, places.keys())
    inside = _JunctionInterior(name, passages, signposts(ruling, rows), rows, places)
    walked, walk_links = _build_crossings(name, passages, crossings, conflicts, rows, len(passages))
    starts = [lane_id(crossing.start) for crossing in crossings]
    last = [inside.beyond[n][0] if n in places else lane for n, lane in enumerate(inside.lanes)]
    junction = NetJunction(
        name,
        junction_kind(ruling) if passages or crossings else "dead_end",
        around.place,
        around.outline,
        tuple(dict.fromkeys((*_source_lanes(passages), *around.incoming, *starts))),
        (*(lane.id for lane in last), *(edge.lanes[0].id for edge in walked)),
        tuple(replace(right, waits_inside=n in places) for n, right in enumerate(rights)),
        around.xodr,
    )
    beyond = {n: lane for n, (lane, _) in inside.beyond.items()}
    return BuiltJunction(
        junction,
        (*inside.edges, *walked),
        (*inside.links, *walk_links),
        light,
        tuple(inside.lanes),
        inside.beyond,
        inner_junctions(name, movements, rights, beyond),
        conflicts,
    )


def _mark_unsignalled_yield(passages: Sequence[Passage]) -> list[Movement]:
    """Movements where there are lights: those that none controls give way."""
    return [
        p.movement if p.lights else replace(p.movement, sign=max(p.movement.sign, Sign.YIELD))
        for p in passages
    ]


def _source_lanes(passages: Sequence[Passage]) -> list[SumoLaneId]:
    return [lane_id(*passage.movement.source) for passage in passages]


def _obey_approach_signals(passages: Sequence[Passage], *, whole_edges: bool) -> list[Passage]:
    """Let passages without a signal obey those of the lane, or else edge, that they come from."""
    result: list[Passage] = []
    for passage in passages:
        edge, lane = passage.movement.source
        same = [
            (other.movement.source[1] != lane, other.lights)
            for other in passages
            if other.lights
            and other.movement.source[0] == edge
            and (whole_edges or other.movement.source[1] == lane)
        ]
        lights = passage.lights or (min(same)[1] if same else ())
        result.append(replace(passage, lights=lights))
    return result


class _JunctionInterior:
    """Internal lanes and links of a junction's passages."""

    def __init__(
        self,
        name: str,
        passages: Sequence[Passage],
        states: Sequence[tuple[str, float | None]],
        rows: Mapping[int, int],
        places: Mapping[int, float],
    ) -> None:
        self.lanes: list[NetLane] = []
        self.edges: list[NetEdge] = []
        self.links: list[NetLink] = []
        self.beyond: dict[int, tuple[NetLane, float]] = {}
        free = len(passages)
        for number, (passage, state) in enumerate(zip(passages, states, strict=True)):
            edge = internal_edge_id(name, number)
            first = _inner_lane(edge, passage)
            parts = [(edge, first)]
            if number in places:
                before, after = divided_shape(passage.movement.shape, places[number])
                rest = internal_edge_id(name, free)
                free += 1
                second = _with_shape(_inner_lane(rest, passage), after)
                parts = [(edge, _with_shape(first, before)), (rest, second)]
                self.beyond[number] = second, places[number]
            self.lanes.append(parts[0][1])
            light = (name, rows[number]) if number in rows else ("", -1)
            self._connect_passage(passage, state, light, parts)

    def _connect_passage(
        self,
        passage: Passage,
        right: tuple[str, float | None],
        light: tuple[str, int],
        parts: Sequence[tuple[SumoEdgeId, NetLane]],
    ) -> None:
        first = parts[0][1]
        movement, turn = passage.movement, direction(passage.movement.turn)
        (source, source_lane), (edge, target_lane) = movement.source, movement.target
        target = SumoEdgeId(edge)
        ends = SumoEdgeId(source), target, source_lane, target_lane
        state, sight = right
        self.links.append(NetLink(*ends, first.id, turn, state, *light, sight))
        for (inner, lane), (_, after) in zip(parts, (*parts[1:], ("", None)), strict=True):
            self.edges.append(NetEdge(inner, INTERNAL, (lane,)))
            link = NetLink(inner, target, 0, target_lane, direction=turn)
            if after:
                seen = None if movement.sign else sight_without_sign(movement.speed)
                link = replace(link, via=after.id, state="m", visibility=seen)
            self.links.append(link)


def _inner_lane(edge: SumoEdgeId, passage: Passage) -> NetLane:
    return NetLane(
        lane_id(edge),
        0,
        round(max(passage.length, LEAST_LENGTH), 4),
        passage.speed,
        round(passage.movement.width + swept_width(passage.movement, passage.length), 2),
        passage.allowed,
        passage.movement.shape,
        passage.type,
        xodr=passage.xodr,
        heavy_speed=passage.heavy_speed,
    )


def _with_shape(lane: NetLane, shape: FloatArray) -> NetLane:
    return replace(lane, shape=shape, length=round(max(drawn_length(shape), LEAST_LENGTH), 4))


def _build_crossings(
    name: str,
    passages: Sequence[Passage],
    crossings: Sequence[PlacedCrossing],
    conflicts: Conflicts,
    rows: Mapping[int, int],
    first: int,
) -> tuple[list[NetEdge], list[NetLink]]:
    edges: list[NetEdge] = []
    links: list[NetLink] = []
    for index, (crossing, crossed) in enumerate(zip(crossings, conflicts.crossed, strict=True)):
        row = rows.get(first + index, -1)
        over = dict.fromkeys(nearer_edge(passages[n].movement, crossing) for n in crossed)
        edges.append(replace(crossing.edge, crosses=tuple(over)))
        light = name if row >= 0 else ""
        links.append(NetLink(crossing.start, crossing.edge.id, light=light, light_index=row))
        links.append(crossing.link)
    return edges, links


def _build_light(
    name: str,
    passages: Sequence[Passage],
    ruling: Ruling,
    crossings: Sequence[PlacedCrossing],
    around: Surroundings,
    waiting: AbstractSet[int],
) -> tuple[TrafficLight, dict[int, int]]:
    """Traffic light of a junction, and the row in it of each link that it rules."""
    controlled = [n for n, passage in enumerate(passages) if passage.lights]
    controlled = controlled or list(range(len(passages)))
    count = len(passages)
    rows = {
        link: row for row, link in enumerate((*controlled, *range(count, count + len(crossings))))
    }
    links = LightLinks(
        movements=[passage.movement for passage in passages],
        walkways=[crossing.walkway for crossing in crossings],
        signals=[passage.lights for passage in passages],
        controllers=[around.controllers.get(p.lights[0], "") if p.lights else "" for p in passages],
        bicycles=["passenger" not in p.allowed and "bicycle" in p.allowed for p in passages],
        conflicts=ruling.conflicts,
        rights=ruling.rights,
        side=-1.0 if around.lefthand else 1.0,
        waiting=waiting,
    )
    light = TrafficLight(
        name,
        program(light_stages(links, rows), len(rows)),
        signals=tuple(passages[n].lights if n < count else around.walk_signals for n in rows),
        links=light_links(rows, links.movements, crossings, ruling.conflicts.crossed),
        conflicts=link_conflicts(links, rows),
    )
    return light, rows


def outline(lanes: Sequence[tuple[FloatArray, float, bool]]) -> FloatArray:
    """Outline of a junction: around the ends of its lanes, shape ``(K, 3)``.

    Parameters
    ----------
    lanes
        Shape, width, and whether the lane ends there (or begins).
    """
    corners: list[FloatArray] = []
    for shape, width, ends in lanes:
        place = shape[-1] if ends else shape[0]
        step = shape[-1] - shape[-2] if ends else shape[1] - shape[0]
        length = max(float(np.hypot(step[0], step[1])), 1e-9)
        normal = np.array([-step[1], step[0], 0.0]) / length * (width / 2.0)
        corners += [place - normal, place + normal]
    points = np.array(corners)
    hull = shapely.MultiPoint(points[:, :2]).convex_hull
    if hull.geom_type != "Polygon":
        return points[[0, -1]]
    ring = np.array(hull.exterior.coords)[:-1]
    return np.column_stack((ring, np.full(len(ring), points[:, 2].mean())))
