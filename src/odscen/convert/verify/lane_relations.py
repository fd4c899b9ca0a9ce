"""Which lane leads to which outside junctions: as the map says, and as SUMO's ends say."""

from __future__ import annotations

from collections import defaultdict
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from odscen.convert.verify.polyline_finder import PIECE_MIN, Polylines
from odscen.opendrive.topology import lane_successors, side_links

if TYPE_CHECKING:
    from collections.abc import Collection, Mapping, Sequence

    from odscen.base.arrays import FloatArray
    from odscen.base.ids import LaneKey, RoadId
    from odscen.convert.verify.net_reader import NetFileLane
    from odscen.convert.verify.polyline_finder import Finder
    from odscen.opendrive.road_model import OpenDrive

RoadLane = tuple["RoadId", int]
"""Road and lane id; sections do not matter for relations between roads."""

LanePair = tuple[RoadLane, RoadLane]

_END = 1.0
"""Metres at the end of a SUMO lane that say which lane of the map it comes from or leads to."""
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


def paths_over_short_lanes(
    stated: Collection[LanePair], lengths: Mapping[RoadLane, float]
) -> dict[LanePair, set[LanePair]]:
    """Relations that follow each other over lanes shorter than a metre, by their outer lanes.

    Nothing ever stops on so short a lane: SUMO may lead across it at once.

    Parameters
    ----------
    stated
        As :func:`lane_relations` gives them.
    lengths
        Length of each drivable lane outside junctions, metres.
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
            if lengths[last] >= _END or any(last == passed for passed, _ in chain):
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
    starts = _scores(lines, reach[:, None] * shares, outer, lane_of)
    ends = _scores(lines, lines.lengths[:, None] - reach[:, None] * shares, outer, lane_of)
    along = lines.lengths[:, None] * np.array(_LANE_SHARES)
    whole = _scores(lines, along, outer, [(road, 0) for road, _ in lane_of])
    return {
        lane.id: Ends(_best(starts[k], whole[k]), _best(ends[k], whole[k]))
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


def _scores(
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


def _best(scores: dict[RoadLane, float], whole: dict[RoadLane, float]) -> tuple[RoadLane, ...]:
    alike = _lowest(scores)
    if len({road for road, _ in alike}) > 1:
        followed = _lowest({(road, 0): whole[road, 0] for road, _ in alike})
        alike = [lane for lane in alike if (lane[0], 0) in followed]
    return tuple(alike)


def _lowest(scores: dict[RoadLane, float]) -> list[RoadLane]:
    limit = min(scores.values(), default=0.0) + _ALIKE
    return sorted((lane for lane in scores if scores[lane] <= limit), key=lambda ln: scores[ln])
