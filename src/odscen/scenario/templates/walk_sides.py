"""Where a pedestrian can cross a stretch of road, from sidewalk to sidewalk."""

from __future__ import annotations

import math
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from odscen.lanegraph.query import walk_node_id
from odscen.scenario.templates.no_place import Unfit

if TYPE_CHECKING:
    from odscen.base.arrays import BoolArray, Int32Array, IntArray
    from odscen.scenario.placing.region import Region
    from odscen.scenario.placing.usable_nodes import Usable
    from odscen.scenario.templates.lane_stretches import LaneStretch

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
        Unfit
            If there is none.
        """
        lanes, walks = self._graph.lanes, self._graph.walks
        place = int(np.argmin(np.abs(stretch.along - along)))
        node = int(stretch.nodes[place])
        if self._tree is None:
            raise Unfit("have no sidewalk")
        c, s = math.cos(lanes.hdg[node]), math.sin(lanes.hdg[node])
        around = np.array(sorted(self._tree.query_ball_point((lanes.x[node], lanes.y[node]), 32)))
        around = around.astype(np.int64)
        around = around[self._usable[around] & (np.abs(walks.z[around] - lanes.z[node]) < _LEVEL)]
        dx, dy = walks.x[around] - lanes.x[node], walks.y[around] - lanes.y[node]
        ahead, left = dx * c + dy * s, dy * c - dx * s
        start = _nearest(around, ahead, left * near, beyond + float(lanes.width[node]) / 2.0)
        if start is None:
            raise Unfit("have no sidewalk on the near side")
        met = float(ahead[around == start][0])
        end = _nearest(around, ahead - met, -left * near, float(lanes.width[node]) / 2.0)
        if end is None:
            raise Unfit("have no sidewalk on the far side")
        across = float(abs(left[around == start][0]))
        if across + float(abs(left[around == end][0])) > WIDEST:
            raise Unfit(f"are wider than {WIDEST:.0f} m")
        meets = float(lanes.x[node] + met * c), float(lanes.y[node] + met * s)
        if self._near_crosswalk(meets):
            raise Unfit(f"have a crosswalk within {_FROM_CORNER:.0f} m")
        goal = self._goal(start, end)
        there: str | list[float] = walk_node_id(self._graph, end)
        if goal is None:  # nothing joins the two sides: it stays where it gets to
            goal = self._goal(start, start)
            there = [round(float(at[end]), 3) for at in (walks.x, walks.y)]
        if goal is None:
            raise Unfit("have a sidewalk from which no path leads on")
        return RoadCrossing(
            walk_node_id(self._graph, start),
            there,
            walk_node_id(self._graph, goal),
            (round(meets[0], 3), round(meets[1], 3)),
            float(stretch.along[place]) + met,
            across,
        )

    def _goal(self, start: int, behind: int) -> int | None:
        """Nearest place behind a node that walks from the start may lead to."""
        goals: Int32Array = self._router.goal_candidates(start)
        metres = np.round(self._router.distances(behind)[goals], 3)
        fits = np.isfinite(metres) & (metres > _ON) & self._usable[goals]
        order = np.lexsort((goals[fits], metres[fits]))
        return int(goals[fits][order[0]]) if len(order) else None

    def _near_crosswalk(self, place: tuple[float, float]) -> bool:
        if self._crosswalks is None:
            return False
        return bool(self._crosswalks.query(place)[0] < _FROM_CORNER)

    @cached_property
    def _tree(self) -> cKDTree | None:
        walks = self._graph.walks
        return cKDTree(np.stack([walks.x, walks.y], axis=1)) if len(walks.x) else None

    @cached_property
    def _crosswalks(self) -> cKDTree | None:
        walks = self._graph.walks
        over = np.array([bool(name) for name in walks.crosswalk], dtype=np.bool_)
        if not over.any():
            return None
        ends = walks.source[over], walks.target[over]
        middle = [(at[ends[0]] + at[ends[1]]) / 2.0 for at in (walks.x, walks.y)]
        return cKDTree(np.stack(middle, axis=1))


def _nearest(rows: IntArray, ahead: object, aside: object, least: float) -> int | None:
    """Row of the node that is nearest to a line straight to one side, at least so far off."""
    along, away = np.abs(np.asarray(ahead)), np.asarray(aside)
    fits = (along <= 2.5) & (away >= least)
    if not fits.any():
        return None
    order = np.lexsort((rows[fits], np.round(along[fits], 3), np.round(away[fits], 0)))
    return int(rows[fits][order[0]])
