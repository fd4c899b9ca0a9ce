"""Stretches of lanes between junctions, on which scenes are placed."""

from __future__ import annotations

from collections import Counter
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple, TypeVar

import numpy as np

from odscen.lanegraph.graphs import Relation
from odscen.lanegraph.shortest_paths import Router
from odscen.scenario.templates.no_place import NoPlaceError, Unfit

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from odscen.base.arrays import BoolArray, FloatArray, IntArray
    from odscen.lanegraph.graphs import LaneGraph
    from odscen.scenario.placing.region import Region
    from odscen.scenario.placing.usable_nodes import Usable

EVERY = 10.0
"""Metres between the beginnings of stretches that are looked at on one lane."""
ONWARD = 50.0
"""Metres that vehicles drive on behind a stretch at least, if the road goes on."""
_SAME = 0.5
"""Metres by which a path may differ from the shortest: changes of lane are a little shorter."""

_Found = TypeVar("_Found")


class LaneStretch(NamedTuple):
    """Nodes of lanes one after another, outside junctions.

    Attributes
    ----------
    nodes, along
        Shape ``(K,)``: nodes of the lane graph, and metres from the first.
    bend
        The most that its heading differs from that at its beginning, rad.
    """

    nodes: IntArray
    along: FloatArray
    bend: float


class LaneStretches:
    """The lanes of a map, followed straight on."""

    def __init__(self, region: Region, usable: Usable) -> None:
        self.graph = region.graph
        lanes = self.graph.lanes
        self.drivable: BoolArray = region.lanes.copy()
        if usable.drivable is not None:
            self.drivable &= usable.drivable
        self.spawnable = self.drivable if usable.spawnable is None else usable.spawnable
        kept = [kind == "driving" for kind in lanes.lanes.types]
        open_road = [junction is None for junction in lanes.lanes.junctions]
        of_lane = np.array(kept, dtype=np.bool_) & np.array(open_road, dtype=np.bool_)
        self.plain: BoolArray = of_lane[lanes.lane] & self.drivable
        self.next, self.step = _straight_on(lanes, self.drivable)

    def beginnings(self) -> IntArray:
        """Nodes at which stretches may begin: every few metres of each lane."""
        lanes = self.graph.lanes
        stride = max(1, round(EVERY / lanes.spacing))
        number = np.arange(len(lanes.x)) - lanes.lanes.first_node[lanes.lane]
        return np.flatnonzero(self.plain & (number % stride == 0))

    def of_length(self, metres: float, *, bend: float) -> tuple[list[LaneStretch], Counter[str]]:
        """Stretches of at least so many metres that bend no more, the straightest first.

        Also why the others do not fit.
        """
        starts = self.beginnings()
        nodes, along = self._followed(starts, metres)
        whole = along[:, -1] >= metres
        hdg = self.graph.lanes.hdg
        turned = np.abs(_wrapped(hdg[nodes] - hdg[starts][:, None])).max(axis=1, initial=0.0)
        straight = turned <= bend
        why = Counter(
            {
                f"are shorter than {metres:.0f} m between junctions": int((~whole).sum()),
                f"bend by more than {np.degrees(bend):.0f} degrees": int((whole & ~straight).sum()),
            }
        )
        rows = np.flatnonzero(whole & straight)
        rows = rows[np.lexsort((rows, np.round(turned[rows], 2)))]
        found = [LaneStretch(nodes[row], along[row], float(turned[row])) for row in rows.tolist()]
        return found, why

    def goal(self, spawn: int, by: int) -> int:
        """Where a vehicle goes that is to pass a node: the nearest end behind it, or the node."""
        from_spawn = self.router.distances(spawn)
        behind = self.router.distances(by)
        goals = self.router.goal_candidates(spawn)
        detour = np.abs(from_spawn[goals] - from_spawn[by] - behind[goals])
        goals = goals[(detour < _SAME) & np.isfinite(behind[goals])]
        far = goals[behind[goals] > ONWARD]
        if len(far):
            return int(far[np.lexsort((far, np.round(behind[far], 3)))[0]])
        return int(goals[np.argmax(behind[goals])]) if len(goals) else by

    @cached_property
    def router(self) -> Router:
        """Paths on the lanes that can be driven."""
        return Router(self.graph, self.drivable)

    def _followed(self, starts: IntArray, metres: float) -> tuple[IntArray, FloatArray]:
        """Nodes and metres along, shapes ``(C, K)``; where a lane ends both stay as they are."""
        nodes, along = [starts], [np.zeros(len(starts))]
        for _ in range(int(np.ceil(metres / (self.graph.lanes.spacing * 0.5)))):
            if not len(starts) or (along[-1] >= metres).all():
                break
            after = self.next[nodes[-1]]
            goes = (after >= 0) & self.plain[after]
            goes &= along[-1] < metres
            if not goes.any():
                break
            along.append(along[-1] + np.where(goes, self.step[nodes[-1]], 0.0))
            nodes.append(np.where(goes, after, nodes[-1]))
        return np.stack(nodes, axis=1), np.stack(along, axis=1)


def first_fit(
    candidates: Iterable[LaneStretch],
    why: Counter[str],
    place: Callable[[LaneStretch], _Found],
    *,
    what: str,
    map_name: str,
) -> _Found:
    """What the first stretch gives on which there is room.

    Raises
    ------
    NoPlaceError
        If none has; says how many were looked at, and why they do not fit.
    """
    for candidate in candidates:
        try:
            return place(candidate)
        except Unfit as unfit:
            why[str(unfit)] += 1
    number = sum(why.values())
    reasons = "; ".join(f"{count} {reason}" for reason, count in why.most_common() if count)
    looked = f"of {number} places, {reasons}" if number else "it has no such places"
    raise NoPlaceError(f"map {map_name!r} has no room for {what}: {looked}")


def _straight_on(lanes: LaneGraph, drivable: BoolArray) -> tuple[IntArray, FloatArray]:
    """Node behind each that turns least, -1 at ends, and metres to it."""
    after = np.full(len(lanes.x), -1, dtype=np.int64)
    metres = np.zeros(len(lanes.x))
    follows = lanes.relation == Relation.SUCCESSOR
    source, target = lanes.source[follows], lanes.target[follows]
    length = lanes.length[follows]
    ok = drivable[source] & drivable[target]
    source, target, length = source[ok], target[ok], length[ok]
    turn = np.round(np.abs(_wrapped(lanes.hdg[target] - lanes.hdg[source])), 6)
    # Of several that turn alike at first, the one that leads straight on a little later.
    order = np.lexsort((target, turn, source))
    source, target, length = source[order], target[order], length[order]
    first = np.ones(len(source), dtype=np.bool_)
    first[1:] = source[1:] != source[:-1]
    after[source[first]], metres[source[first]] = target[first], length[first]
    return after, metres


def _wrapped(angle: FloatArray) -> FloatArray:
    return (angle + np.pi) % (2 * np.pi) - np.pi
