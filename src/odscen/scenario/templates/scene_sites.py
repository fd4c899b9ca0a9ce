"""Where scenes are placed: stretches of lanes between junctions, and crossings of the road."""

from __future__ import annotations

import math
from collections import Counter
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple, TypeVar

import numpy as np
from scipy.spatial import cKDTree

from odscen.base.errors import ScenarioError
from odscen.lanegraph.graphs import Relation
from odscen.lanegraph.query import walk_node_id
from odscen.lanegraph.shortest_paths import Router

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from odscen.base.arrays import BoolArray, FloatArray, Int32Array, IntArray
    from odscen.lanegraph.graphs import LaneGraph
    from odscen.scenario.placing.region import Region, Usable


class NoPlaceError(ScenarioError):
    """No place of a map has room for a template; the message says where was looked and why not."""


class UnfitPlaceError(Exception):
    """A place does not fit; the reason reads on from "of so many places"."""


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
        nodes, along = self._follow_lanes(starts, metres)
        whole = along[:, -1] >= metres
        hdg = self.graph.lanes.hdg
        turned = np.abs(_wrap_angle(hdg[nodes] - hdg[starts][:, None])).max(axis=1, initial=0.0)
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

    def _follow_lanes(self, starts: IntArray, metres: float) -> tuple[IntArray, FloatArray]:
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
        except UnfitPlaceError as unfit:
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
    turn = np.round(np.abs(_wrap_angle(lanes.hdg[target] - lanes.hdg[source])), 6)
    # Of several that turn alike at first, the one that leads straight on a little later.
    order = np.lexsort((target, turn, source))
    source, target, length = source[order], target[order], length[order]
    first = np.ones(len(source), dtype=np.bool_)
    first[1:] = source[1:] != source[:-1]
    after[source[first]], metres[source[first]] = target[first], length[first]
    return after, metres


def _wrap_angle(angle: FloatArray) -> FloatArray:
    return (angle + np.pi) % (2 * np.pi) - np.pi


WIDEST = 30.0
"""Metres from sidewalk to sidewalk, at most."""
_LEVEL = 2.5
_ON = 5.0
"""Metres that a pedestrian walks on at least on the far side."""
_FROM_CORNER = 10.0
"""Metres that are kept from crosswalks."""


class RoadCrossing(NamedTuple):
    """A straight line across a road.

    Attributes
    ----------
    start, goal
        Pedestrian nodes: where the walk begins, and where it leads in the end.
    end
        Where it is over the road: a node, or x and y if no path leads on from there.
    meets
        Where it crosses the lane's centre line, OpenDRIVE frame, m.
    along
        Metres of that place along the stretch.
    metres
        From the start to there.
    """

    start: str
    end: str | list[float]
    goal: str
    meets: tuple[float, float]
    along: float
    metres: float


class WalkSides:
    """The pedestrian nodes of a map, asked what lies beside a lane."""

    def __init__(self, region: Region, usable: Usable) -> None:
        self._graph = region.graph
        self._router = region.walk_router
        self._usable: BoolArray = region.walks.copy()
        if usable.walkable is not None:
            self._usable &= usable.walkable

    def crossing(
        self, stretch: LaneStretch, along: float, *, near: int, beyond: float = 0.0
    ) -> RoadCrossing:
        """Find a line across the road about ``along`` metres from the beginning of a stretch.

        Parameters
        ----------
        near
            Side on which it begins, 1 is left.
        beyond
            Metres from the lane's centre line to the start, at least.

        Raises
        ------
        UnfitPlaceError
            If there is none.
        """
        lanes, walks = self._graph.lanes, self._graph.walks
        place = int(np.argmin(np.abs(stretch.along - along)))
        node = int(stretch.nodes[place])
        if self._walk_node_tree is None:
            raise UnfitPlaceError("have no sidewalk")
        c, s = math.cos(lanes.hdg[node]), math.sin(lanes.hdg[node])
        around = np.array(
            sorted(self._walk_node_tree.query_ball_point((lanes.x[node], lanes.y[node]), 32))
        )
        around = around.astype(np.int64)
        around = around[self._usable[around] & (np.abs(walks.z[around] - lanes.z[node]) < _LEVEL)]
        dx, dy = walks.x[around] - lanes.x[node], walks.y[around] - lanes.y[node]
        ahead, left = dx * c + dy * s, dy * c - dx * s
        start = _nearest_to_side(
            around, ahead, left * near, beyond + float(lanes.width[node]) / 2.0
        )
        if start is None:
            raise UnfitPlaceError("have no sidewalk on the near side")
        met = float(ahead[around == start][0])
        end = _nearest_to_side(around, ahead - met, -left * near, float(lanes.width[node]) / 2.0)
        if end is None:
            raise UnfitPlaceError("have no sidewalk on the far side")
        across = float(abs(left[around == start][0]))
        if across + float(abs(left[around == end][0])) > WIDEST:
            raise UnfitPlaceError(f"are wider than {WIDEST:.0f} m")
        meets = float(lanes.x[node] + met * c), float(lanes.y[node] + met * s)
        if self._is_near_crosswalk(meets):
            raise UnfitPlaceError(f"have a crosswalk within {_FROM_CORNER:.0f} m")
        goal = self._goal_behind(start, end)
        there: str | list[float] = walk_node_id(self._graph, end)
        if goal is None:  # nothing joins the two sides: it stays where it gets to
            goal = self._goal_behind(start, start)
            there = [round(float(at[end]), 3) for at in (walks.x, walks.y)]
        if goal is None:
            raise UnfitPlaceError("have a sidewalk from which no path leads on")
        return RoadCrossing(
            walk_node_id(self._graph, start),
            there,
            walk_node_id(self._graph, goal),
            (round(meets[0], 3), round(meets[1], 3)),
            float(stretch.along[place]) + met,
            across,
        )

    def _goal_behind(self, start: int, behind: int) -> int | None:
        """Nearest place behind a node that walks from the start may lead to."""
        goals: Int32Array = self._router.goal_candidates(start)
        metres = np.round(self._router.distances(behind)[goals], 3)
        fits = np.isfinite(metres) & (metres > _ON) & self._usable[goals]
        order = np.lexsort((goals[fits], metres[fits]))
        return int(goals[fits][order[0]]) if len(order) else None

    def _is_near_crosswalk(self, place: tuple[float, float]) -> bool:
        if self._crosswalk_tree is None:
            return False
        return bool(self._crosswalk_tree.query(place)[0] < _FROM_CORNER)

    @cached_property
    def _walk_node_tree(self) -> cKDTree | None:
        walks = self._graph.walks
        return cKDTree(np.stack([walks.x, walks.y], axis=1)) if len(walks.x) else None

    @cached_property
    def _crosswalk_tree(self) -> cKDTree | None:
        walks = self._graph.walks
        over = np.array([bool(name) for name in walks.crosswalk], dtype=np.bool_)
        if not over.any():
            return None
        ends = walks.source[over], walks.target[over]
        middle = [(at[ends[0]] + at[ends[1]]) / 2.0 for at in (walks.x, walks.y)]
        return cKDTree(np.stack(middle, axis=1))


def _nearest_to_side(rows: IntArray, ahead: object, aside: object, least: float) -> int | None:
    """Row of the node that is nearest to a line straight to one side, at least so far off."""
    along, away = np.abs(np.asarray(ahead)), np.asarray(aside)
    fits = (along <= 2.5) & (away >= least)
    if not fits.any():
        return None
    order = np.lexsort((rows[fits], np.round(along[fits], 3), np.round(away[fits], 0)))
    return int(rows[fits][order[0]])
