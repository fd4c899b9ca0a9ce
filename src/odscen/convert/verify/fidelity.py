"""How faithfully a SUMO network follows the map it was made from, measured anew.

Everything is compared by geometry: neither the lane table nor the ids of the network are used, and
nothing of the conversion is. What the map says is taken from the road model
(:mod:`odscen.opendrive`), what SUMO has from the text of its ``.net.xml``.
"""

from __future__ import annotations

from collections import defaultdict
from itertools import combinations
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import shapely

from odscen.base.arrays import offsets
from odscen.convert.verify.fidelity_result import (
    CROSSWALK_SHARE,
    MAX_P99,
    NEAR,
    Deviation,
    FarPlace,
    Fidelity,
    LaneCover,
    LaneRelation,
    LostCrosswalk,
    UncoveredStretch,
    UnsafePair,
)
from odscen.convert.verify.net_reader import read_net
from odscen.convert.verify.polyline_finder import PIECE_MIN, STEP, Finder, Polylines
from odscen.convert.verify.signal_coverage import compare_lights
from odscen.opendrive.objects import crosswalks
from odscen.opendrive.road_model import DRIVABLE_TYPES, WALKABLE_TYPES
from odscen.opendrive.topology import cut_off_lanes, folded_lanes, lane_successors, side_links

if TYPE_CHECKING:
    from collections.abc import Collection, Iterator, Sequence

    from odscen.base.arrays import BoolArray, FloatArray, IntArray
    from odscen.base.ids import LaneKey, RoadId
    from odscen.convert.verify.net_reader import NetFile, NetFileJunction, NetFileLane, NetFileLink
    from odscen.opendrive.lanes import RoadTable
    from odscen.opendrive.road_model import OpenDrive


RoadLane = tuple["RoadId", int]
"""Road and lane id; sections do not matter for relations between roads."""

LanePair = tuple[RoadLane, RoadLane]

_END = 1.0
"""Metres at the end of a SUMO lane that say which lane of the map it comes from or leads to."""
_BETWEEN_CROSSWALKS = 12.0
"""Metres of road, at most, that a junction of SUMO may reach over."""
_END_SHARES = (0.1, 0.3, 0.5, 0.7, 0.9)
_LANE_SHARES = tuple((k + 0.5) / 10 for k in range(10))
_APART = 2.0
"""Metres aside at which a SUMO lane belongs to a lane of the map at most."""
_ALIKE = 0.05
"""Lanes of the map whose distances differ by less, in metres, count as equally near."""


def lane_relations(odr: OpenDrive, drivable: Sequence[LaneKey]) -> dict[LanePair, LaneKey]:
    """Relations between drivable lanes outside junctions, through any connecting lanes.

    Only those between different roads, or different sides of one.

    Returns
    -------
    dict
        From (lane, lane) to the lane, with its section, at whose end the relation begins.
    """
    successors = {key: list(after) for key, after in lane_successors(odr).items()}
    for side in side_links(odr):
        source, target = (side.main, side.other) if side.leaves else (side.other, side.main)
        successors[source].append(target)
    allowed = set(drivable)
    found: dict[LanePair, LaneKey] = {}
    for start in drivable:
        if odr.roads[start.road].junction is not None:
            continue
        todo, seen = [start], {start}
        while todo:
            for key in successors[todo.pop()]:
                if key in seen or key not in allowed:
                    continue
                seen.add(key)
                if odr.roads[key.road].junction is not None:
                    todo.append(key)
                elif is_between_roads((start.road, start.lane), (key.road, key.lane)):
                    found.setdefault(((start.road, start.lane), (key.road, key.lane)), start)
    return found


def paths_over_lanes(
    stated: Collection[LanePair], crossed: Collection[RoadLane]
) -> dict[LanePair, set[LanePair]]:
    """Relations that follow each other over lanes that SUMO leads across at once, by outer lanes.

    Parameters
    ----------
    stated
        As :func:`lane_relations` gives them.
    crossed
        Lanes outside of the map's junctions that have no edge of their own.
    """
    following: dict[RoadLane, list[RoadLane]] = defaultdict(list)
    for source, target in stated:
        following[source].append(target)
    paths: dict[LanePair, set[LanePair]] = defaultdict(set)
    for source, target in stated:
        todo: list[tuple[LanePair, ...]] = [((source, target),)]
        while todo:
            chain = todo.pop()
            last = chain[-1][1]
            if last not in crossed or any(last == passed for passed, _ in chain):
                continue
            for further in following[last]:
                longer = (*chain, (last, further))
                paths[source, further].update(longer)
                todo.append(longer)
    return paths


def is_between_roads(source: RoadLane, target: RoadLane) -> bool:
    """Whether two lanes belong to different roads, or to different sides of one."""
    return source[0] != target[0] or (source[1] < 0) != (target[1] < 0)


class Ends(NamedTuple):
    """Lanes of the map that the start and the end of a SUMO lane lie on, best first."""

    start: tuple[RoadLane, ...]
    end: tuple[RoadLane, ...]


def sumo_ends(
    lanes: Sequence[NetFileLane], outer: Finder, lane_of: Sequence[RoadLane]
) -> dict[str, Ends]:
    """Find the lanes of the map at both ends of SUMO lanes, by geometry.

    The last metre decides (the whole lane, if it is shorter). Where several lanes of the map lie on
    each other there, the roads that the SUMO lane follows as a whole go first; if that does not
    tell either, all of them hold.

    Parameters
    ----------
    outer, lane_of
        Pieces of the map's drivable lanes outside junctions; lane of each owner of a piece.
    """
    lines = Polylines.of([lane.shape for lane in lanes])
    reach = np.minimum(_END, lines.lengths)
    shares = np.array(_END_SHARES)
    starts = _score_lanes(lines, reach[:, None] * shares, outer, lane_of)
    ends = _score_lanes(lines, lines.lengths[:, None] - reach[:, None] * shares, outer, lane_of)
    along = lines.lengths[:, None] * np.array(_LANE_SHARES)
    whole = _score_lanes(lines, along, outer, [(road, 0) for road, _ in lane_of])
    return {
        lane.id: Ends(_best_lanes(starts[k], whole[k]), _best_lanes(ends[k], whole[k]))
        for k, lane in enumerate(lanes)
    }


def passed_over(
    lanes: Sequence[NetFileLane], outer: Finder, lane_of: Sequence[RoadLane]
) -> set[LanePair]:
    """Pairs of lanes of the map that follow each other along one SUMO lane.

    Where a road ends without a junction, SUMO may have its node a little before or behind, or none.
    Parameters as for :func:`sumo_ends`.
    """
    places = Polylines.of([lane.shape for lane in lanes]).cut(_END)
    _, piece = outer.nearest(places, _APART)
    places, piece = places.take(piece >= 0), piece[piece >= 0]
    owner = outer.pieces.owner[piece]
    passed = (places.owner[1:] == places.owner[:-1]) & (owner[1:] != owner[:-1])
    pairs = zip(owner[:-1][passed].tolist(), owner[1:][passed].tolist(), strict=True)
    return {(lane_of[a], lane_of[b]) for a, b in pairs}


def _score_lanes(
    lines: Polylines, along: FloatArray, outer: Finder, lane_of: Sequence[RoadLane]
) -> list[dict[RoadLane, float]]:
    """Mean distance of the places of each line from the lanes of the map near it."""
    count = along.shape[1]
    line = np.repeat(np.arange(len(along)), count)
    kept = np.flatnonzero(lines.lengths[line] >= PIECE_MIN)
    places = lines.at(line[kept], along.ravel()[kept], np.ones(len(kept)))
    place, piece, apart = outer.around(places, _APART, directed=True)
    nearest: dict[tuple[int, RoadLane], float] = {}
    owners = outer.pieces.owner[piece].tolist()
    for row, owner, distance in zip(place.tolist(), owners, apart.tolist(), strict=True):
        key = (row, lane_of[owner])
        nearest[key] = min(nearest.get(key, _APART), distance)
    scores: list[dict[RoadLane, float]] = [defaultdict(lambda: _APART) for _ in range(len(along))]
    for (row, lane), distance in nearest.items():
        # Places without this lane count as far as any lane may be.
        scores[places.owner[row]][lane] -= (_APART - distance) / count
    return scores


def _best_lanes(
    scores: dict[RoadLane, float], whole: dict[RoadLane, float]
) -> tuple[RoadLane, ...]:
    alike = _lowest_lanes(scores)
    if len({road for road, _ in alike}) > 1:
        followed = _lowest_lanes({(road, 0): whole[road, 0] for road, _ in alike})
        alike = [lane for lane in alike if (lane[0], 0) in followed]
    return tuple(alike)


def _lowest_lanes(scores: dict[RoadLane, float]) -> list[RoadLane]:
    limit = min(scores.values(), default=0.0) + _ALIKE
    return sorted((lane for lane in scores if scores[lane] <= limit), key=lambda ln: scores[ln])


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
                    x, y = _middle_of_links(net, links[a], links[b])
                    yield UnsafePair(program.tl, phase, indices, "g" in (one, other), x, y)


def _middle_of_links(net: NetFile, *links: NetFileLink) -> tuple[float, float]:
    """Where two links meet, about: the middle between their lanes."""
    shapes = [net.lanes[link.via or link.target].shape for link in links]
    x, y = np.mean(
        [0.5 * (shape.min(axis=0) + shape.max(axis=0)) for shape in shapes], axis=0
    ).tolist()
    return x, y


REACH = 10.0
"""Metres beyond which no lane is looked for; a lane with none so near counts as that far off."""

_PLACE_STEP = 1.0
_MIN_WIDTH = 0.05
"""Where a lane is narrower than this, in metres, it is not there yet."""
_MIN_GAP = 1.0


def verify(
    net_xml: bytes,
    odr: OpenDrive,
    table: RoadTable,
    *,
    offset: tuple[float, float] | None = None,
) -> Fidelity:
    """Compare a SUMO network with the map it was made from.

    Parameters
    ----------
    net_xml
        Text of the ``.net.xml``.
    odr, table
        Road model of the map and its evaluation.
    offset
        SUMO position minus OpenDRIVE position, metres; the network's netOffset if not given.

    Raises
    ------
    InputError
        If the network cannot be read.
    """
    net = read_net(net_xml, offset=offset)
    cut_off, folded = cut_off_lanes(odr), folded_lanes(odr, table)
    drivable = _MapLanes(odr, table, DRIVABLE_TYPES, without=cut_off | folded)
    walkable = _MapLanes(odr, table, WALKABLE_TYPES)
    drives = net.driving("normal", "internal")
    on_roads, far_on_roads = _measure_deviation(net.driving("normal"), drivable)
    inside, far_inside = _measure_deviation(net.driving("internal"), drivable)
    covered = drivable.covered(drives, directed=True)
    walks = [
        ln for ln in net.lanes.values() if ln.function == "normal" and ln.walks and not ln.cars
    ]
    walked = walkable.covered(walks, directed=False)
    relations, missing, invented = _compare_relations(net, odr, drivable, folded - cut_off)
    shown, lost = _compare_crosswalks(net, odr, table)
    return Fidelity(
        normal=on_roads,
        internal=inside,
        far_places=tuple(sorted(far_on_roads + far_inside, key=lambda far: -far.metres)),
        coverage=drivable.cover(covered, drivable.everywhere),
        coverage_roads=drivable.cover(covered, ~drivable.inside),
        coverage_junctions=drivable.cover(covered, drivable.inside),
        gaps=drivable.gaps(covered),
        relations=relations,
        missing=missing,
        invented=invented,
        sidewalks=walkable.cover(walked, walkable.everywhere),
        sidewalk_gaps=walkable.gaps(walked),
        crosswalks=shown,
        lost_crosswalks=lost,
        cars_on_sidewalks=_cars_on(walkable, drivable, drives),
        signals=compare_lights(net, odr, drivable.finder, drivable.keys()),
        unsafe_pairs=unsafe_pairs(net),
        wrong_side=odr.rule != "mixed" and net.left_hand != (odr.rule == "LHT"),
    )


class _MapLanes:
    """Lanes of the map of some types, cut into pieces.

    Attributes
    ----------
    rows
        Shape ``(L,)``: rows of ``RoadTable.lane_keys``; line k of ``lines`` is lane ``rows[k]``.
    finder
        Over pieces of the lanes' centres, in driving direction.
    places
        A metre apart, where the lanes are wide enough to be there.
    inside
        Shape ``(P,)``: which of the places lie on connecting roads.
    """

    def __init__(
        self,
        odr: OpenDrive,
        table: RoadTable,
        types: frozenset[str],
        *,
        without: Collection[LaneKey] = (),
    ) -> None:
        self.odr, self.table = odr, table
        chosen = [
            row
            for row, kind in enumerate(table.lane_type)
            if kind in types and table.lane_keys[row] not in without
        ]
        self.rows: IntArray = np.array(chosen, dtype=np.int64)
        self.lines = _centre_lines(table, self.rows)
        self.finder = Finder(self.lines.cut(STEP))
        places = self.lines.cut(_PLACE_STEP)
        self.places = places.take(places.width >= _MIN_WIDTH)
        in_junction = [
            self.odr.roads[table.lane_keys[row].road].junction is not None for row in chosen
        ]
        self.lane_inside = np.array(in_junction, dtype=bool)
        self.inside = self.lane_inside[self.places.owner]
        self.everywhere = np.ones_like(self.inside)

    def keys(self) -> list[LaneKey]:
        """The lanes; shape ``(L,)``."""
        return [self.table.lane_keys[row] for row in self.rows]

    def covered(self, lanes: list[NetFileLane], *, directed: bool) -> BoolArray:
        """Whether each place has one of the lanes beside it."""
        finder = Finder(Polylines.of([lane.shape for lane in lanes]).cut(STEP))
        distance, row = finder.nearest(self.places, 2.0 * NEAR, directed=directed)
        return (row >= 0) & (distance <= NEAR)

    def cover(self, covered: BoolArray, among: BoolArray) -> LaneCover:
        """Length of the places among which to count, and the share of it that is covered."""
        length = self.places.length[among]
        total = float(length.sum())
        share = float(length[covered[among]].sum()) / total if total else 1.0
        return LaneCover(total, share)

    def gaps(self, covered: BoolArray) -> tuple[UncoveredStretch, ...]:
        """Lanes that lack more than a metre, in the order of the map."""
        bare = self.places.take(~covered)
        lacking = np.bincount(bare.owner, weights=bare.length, minlength=len(self.rows))
        gaps = []
        for lane in np.flatnonzero(lacking > _MIN_GAP):
            where = np.flatnonzero(bare.owner == lane)
            place = _point_xy(bare.xy[where[len(where) // 2]])
            key = self.table.lane_keys[self.rows[lane]]
            gaps.append(UncoveredStretch(str(key), *place, float(lacking[lane])))
        return tuple(gaps)


def _centre_lines(table: RoadTable, rows: IntArray) -> Polylines:
    """Centre lines of lanes in driving direction, a point every 0.25 m of s."""
    s0, s1 = table.lane_s0[rows], table.lane_s1[rows]
    count = np.ceil((s1 - s0) / STEP).astype(np.int64) + 1
    count = np.maximum(count, 2)
    first = offsets(count)
    line = np.repeat(np.arange(len(rows)), count)
    share = (np.arange(first[-1]) - first[line]) / (count[line] - 1)
    forward = table.lane_forward[rows][line]
    share = np.where(forward, share, 1.0 - share)
    points = table.lane_points(rows[line], s0[line] + share * (s1 - s0)[line])
    return Polylines(np.stack([points.x, points.y, points.width], axis=1), first)


def _measure_deviation(
    lanes: list[NetFileLane], drivable: _MapLanes
) -> tuple[Deviation, list[FarPlace]]:
    """Distance of SUMO lanes from the map's, and the farthest place of each lane that is far."""
    places = Polylines.of([lane.shape for lane in lanes]).cut(_PLACE_STEP)
    distance, _ = drivable.finder.nearest(places, REACH)
    if not len(distance):
        return Deviation(len(lanes), 0, 0.0, 0.0, 0.0, 0.0, 0.0), []
    p50, p95, p99 = np.percentile(distance, (50, 95, 99)).tolist()
    far = float(np.mean(distance > NEAR))
    order = np.lexsort((-distance, places.owner))
    owner, at = np.unique(places.owner[order], return_index=True)
    worst = order[at]
    found = [
        FarPlace(lanes[lane].id, *_point_xy(places.xy[row]), float(distance[row]))
        for lane, row in zip(owner.tolist(), worst.tolist(), strict=True)
        if distance[row] > MAX_P99
    ]
    return Deviation(len(lanes), len(distance), p50, p95, p99, float(distance.max()), far), found


def _cars_on(walkable: _MapLanes, drivable: _MapLanes, lanes: list[NetFileLane]) -> tuple[str, ...]:
    """Lanes for cars that run along walkable lanes, and not along drivable ones, for the most."""
    cars = [lane for lane in lanes if lane.cars]
    places = Polylines.of([lane.shape for lane in cars]).cut(_PLACE_STEP)
    walked, _ = walkable.finder.nearest(places, 2.0 * NEAR, directed=False)
    driven, _ = drivable.finder.nearest(places, 2.0 * NEAR)
    on = np.where((walked <= NEAR) & (driven > NEAR), places.length, 0.0)
    length = np.bincount(places.owner, weights=on, minlength=len(cars))
    total = np.bincount(places.owner, weights=places.length, minlength=len(cars))
    return tuple(cars[k].id for k in np.flatnonzero(length > 0.5 * total))


def _compare_relations(
    net: NetFile, odr: OpenDrive, drivable: _MapLanes, folded: Collection[LaneKey]
) -> tuple[int, tuple[LaneRelation, ...], tuple[LaneRelation, ...]]:
    """Count the map's relations, over folded lanes too; list the missing and invented ones."""
    keys = drivable.keys()
    stated = lane_relations(odr, [*keys, *folded])
    pieces = drivable.finder.pieces
    outer = Finder(pieces.take(~drivable.lane_inside[pieces.owner]))
    lanes = {lane.id: lane for lane in net.driving("normal")}
    lane_of = [(key.road, key.lane) for key in keys]
    ends = sumo_ends(list(lanes.values()), outer, lane_of)
    crossed = _crossed_lanes(net, drivable)
    paths = paths_over_lanes(stated, crossed) | {pair: {pair} for pair in stated}
    held: set[LanePair] = set()
    for pair in passed_over(list(lanes.values()), outer, lane_of):
        held |= paths.get(pair, set())
    invented = []
    for link in net.links:
        if link.source not in lanes or link.target not in lanes:
            continue
        sources, targets = ends[link.source].end, ends[link.target].start
        pairs = [(a, b) for a in sources for b in targets]
        found = [pair for pair in pairs if pair in paths]
        held.update(*(paths[pair] for pair in found))
        # Within one side of a road SUMO may well divide and join edges as it needs.
        if not found and (not pairs or all(is_between_roads(*pair) for pair in pairs)):
            names = f"{link.source} to {link.target}"
            place = _point_xy(lanes[link.source].shape[-1])
            invented.append(LaneRelation(_name_lanes(sources), _name_lanes(targets), *place, names))
    line = {key: k for k, key in enumerate(keys)}
    last = drivable.lines.first[1:] - 1
    missing = [
        LaneRelation(
            _name_lanes([a]), _name_lanes([b]), *_point_xy(drivable.lines.points[last[line[start]]])
        )
        for (a, b), start in stated.items()
        if (a, b) not in held
    ]
    return len(stated), tuple(missing), tuple(invented)


def _crossed_lanes(net: NetFile, drivable: _MapLanes) -> set[RoadLane]:
    """Lanes outside of the map's junctions that vehicles of SUMO cross, and never stop on.

    They are shorter than a metre; or short, and all of them lies in a junction of SUMO, whose lanes
    lead over them: the crosswalks at both ends leave no room for an edge.
    """
    on_edges, in_junctions = (
        np.bincount(
            drivable.places.owner,
            weights=drivable.covered(net.driving(kind), directed=True),
            minlength=len(drivable.rows),
        )
        for kind in ("normal", "internal")
    )
    lengths: dict[RoadLane, float] = defaultdict(float)
    swallowed: dict[RoadLane, bool] = defaultdict(lambda: True)
    for k, key in enumerate(drivable.keys()):
        lane = (key.road, key.lane)
        lengths[lane] += float(drivable.lines.lengths[k])
        swallowed[lane] &= bool(on_edges[k] == 0 and in_junctions[k] > 0)
    return {
        lane
        for lane, length in lengths.items()
        if length < _END or (length < _BETWEEN_CROSSWALKS and swallowed[lane])
    }


def _point_xy(point: FloatArray) -> tuple[float, float]:
    return float(point[0]), float(point[1])


def _name_lanes(lanes: Sequence[RoadLane]) -> str:
    return f"{lanes[0][0]}.{lanes[0][1]}" if lanes else "?"


def _compare_crosswalks(
    net: NetFile, odr: OpenDrive, table: RoadTable
) -> tuple[int, tuple[LostCrosswalk, ...]]:
    """Count the crosswalks; list those that no crossing lies on."""
    crossings = [
        shapely.LineString(lane.shape).buffer(0.5 * lane.width, cap_style="flat")
        for lane in net.lanes.values()
        if lane.function == "crossing" and len(lane.shape) > 1
    ]
    tree = shapely.STRtree(crossings)
    found = crosswalks(odr, table)
    lost = []
    for crosswalk in found:
        area = shapely.make_valid(shapely.Polygon(crosswalk.polygon))
        over = [area.intersection(crossings[k]).area for k in tree.query(area).tolist()]
        share = max(over, default=0.0) / area.area
        if share <= CROSSWALK_SHARE:
            place = _point_xy(crosswalk.polygon.mean(axis=0))
            lost.append(LostCrosswalk(crosswalk.road, crosswalk.object_id, *place, share))
    return len(found), tuple(lost)
