"""What a generator gives back as actors: what is plainly wrong is repaired, the rest dropped.

Every repair is named, with the road user by its place in the arrays. What is left passes every
check of scenarios, and no two bodies touch.
"""

from __future__ import annotations

import math
from collections import Counter
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from odscen.base.categories import Category
from odscen.learning.fill import NO_NODE
from odscen.learning.safe_speeds import safe_speeds
from odscen.scenario.checks.actor_checks import SPEED_MAX, SPEED_MIN
from odscen.scenario.document.scenario_document import Actor
from odscen.scenario.document.validation import validated
from odscen.scenario.placing.bodies import box_at
from odscen.scenario.placing.region import NodePlace, name_of
from odscen.scenario.placing.spawn_room import LANE_MARGIN, crowd_for

if TYPE_CHECKING:
    from odscen.lanegraph.graphs import LaneGraph, PedestrianGraph
    from odscen.learning.fill import Array, Fill, FillRequest
    from odscen.scenario.placing.bodies import Box
    from odscen.scenario.placing.region import Region

GAP = 0.5
"""Free metres that are kept between two bodies: queues stand closer than sampled traffic."""
MOST_MOVED = 20.0
"""Metres that a road user is moved at most to a node that is free."""
LATEST = 86_400.0
"""Seconds; no departure is later."""


class FillRemark(NamedTuple):
    """What was done to one road user of a fill, and why.

    ``what`` is ``dropped``, ``moved``, ``clamped`` or ``opened``: left to the limit, the seed or
    rest. ``column`` is the array that it is about, ``row`` the place in it.
    """

    row: int
    what: str
    column: str
    why: str


class CheckedFill(NamedTuple):
    """Actors made of a fill of ``given`` road users, and what was done to them."""

    actors: tuple[Actor, ...]
    remarks: tuple[FillRemark, ...]
    given: int


class _Draft(NamedTuple):
    row: int
    category: Category
    node: int
    desired: float | None
    initial: float | None
    goal: int | None
    left: float
    depart: float


def checked_fill(fill: Fill, request: FillRequest, region: Region) -> CheckedFill:
    """Make actors of what a generator has placed.

    Of two that overlap the first in the arrays keeps its place. A road user whose node is not
    allowed, or taken, moves to the nearest node within :data:`MOST_MOVED` metres that is free.
    Initial speeds from which a vehicle could not stop behind the one ahead are lowered.
    """
    check = _FillCheck(fill, request, region)
    drafts = [check.draft(*placed) for placed in check.places()]
    drafts = check.with_safe_speeds(check.with_goals(drafts))
    counter: Counter[Category] = Counter()
    actors = []
    for one in drafts:
        counter[one.category] += 1
        walk = one.category is Category.PEDESTRIAN
        goal = None if one.goal is None else name_of(region.graph, NodePlace(walk, one.goal))
        fields = {
            "id": f"{one.category}-{counter[one.category]}",
            "category": one.category,
            "spawn": name_of(region.graph, NodePlace(walk, one.node)),
            "goal": goal,
            "speed": one.desired,
            "lateral_offset": one.left,
            "depart": one.depart,
            "initial_speed": one.initial,
        }
        actors.append(validated(Actor, fields))
    remarks = sorted(check.remarks, key=lambda one: one.row)
    return CheckedFill(tuple(actors), tuple(remarks), len(fill.node))


class _FillCheck:
    """Checks one road user after the other, and remembers where those before it are."""

    def __init__(self, fill: Fill, request: FillRequest, region: Region) -> None:
        self.remarks: list[FillRemark] = []
        self._fill, self._request, self._region = fill, request, region
        self._crowd = crowd_for(request.bodies, minimum_gap=GAP)

    def places(self) -> list[tuple[int, Category, int]]:
        """Row, category and node of all that stay, in the order of the rows."""
        found: list[tuple[int, Category, int]] = []
        others: list[tuple[int, Category, int, str]] = []
        for row in range(len(self._fill.node)):
            category = self._category(row)
            if category is None:
                continue
            node = int(self._fill.node[row])
            problem = self._problem(node, category)
            if problem:
                others.append((row, category, node, problem))
            else:
                found.append(self._put(row, category, node))
        for row, category, node, problem in others:
            near = self._nearest(node, category)
            if near is None:
                self._note(row, "dropped", "node", f"{problem}, and no node near it is free")
            else:
                self._note(row, "moved", "node", f"{problem}; it is on node {near}")
                found.append(self._put(row, category, near))
        return sorted(found)

    def draft(self, row: int, category: Category, node: int) -> _Draft:
        """One road user with all but what its goal and its neighbours allow."""
        walk = category is Category.PEDESTRIAN
        limit = self._limit(category, node)
        initial = None if walk else self._initial(row)
        desired = self._desired(row, category)
        if initial is not None:
            if desired is None and math.isfinite(limit):
                # By the limit itself, as the drivers' own factors might be below it.
                desired = round(min(limit, SPEED_MAX[category]), 2)
            most = SPEED_MAX[category] if desired is None else desired
            initial = self._clamp(row, "initial_speed", initial, 0.0, most)
        goal = self._value(row, "goal")
        return _Draft(
            row, category, node, desired, initial,
            None if goal is None or goal == -1 else int(goal),
            self._left(row, category, node), self._depart(row),
        )  # fmt: skip

    def with_goals(self, drafts: list[_Draft]) -> list[_Draft]:
        """Leave goals open that are not there, or that no path leads to."""
        region, found = self._region, []
        names = {
            walk: len((region.graph.walks if walk else region.graph.lanes).x)
            for walk in (False, True)
        }
        known = [
            one
            for one in drafts
            if one.goal is not None and 0 <= one.goal < names[one.category is Category.PEDESTRIAN]
        ]
        region.look_up(
            (name_of(region.graph, NodePlace(walk, one.node)),
             name_of(region.graph, NodePlace(walk, one.goal or 0)))
            for one in known for walk in (one.category is Category.PEDESTRIAN,)
        )  # fmt: skip
        rows = {one.row for one in known}
        for one in drafts:
            walk = one.category is Category.PEDESTRIAN
            if one.goal is None:
                found.append(one)
            elif one.row not in rows:
                self._note(one.row, "opened", "goal", f"there is no node {one.goal}")
                found.append(one._replace(goal=None))
            elif region.leads(NodePlace(walk, one.node), NodePlace(walk, one.goal)):
                found.append(one)
            else:
                why = f"no path inside the region leads from node {one.node} to {one.goal}"
                self._note(one.row, "opened", "goal", why)
                found.append(one._replace(goal=None))
        return found

    def with_safe_speeds(self, drafts: list[_Draft]) -> list[_Draft]:
        """Lower initial speeds so that everyone can stop behind the one ahead."""
        driving = [
            one for one in drafts if one.category is not Category.PEDESTRIAN and one.depart == 0.0
        ]
        speeds = safe_speeds(
            self._region.graph.lanes,
            nodes=[one.node for one in driving],
            lengths=[self._request.bodies[one.category].length for one in driving],
            speeds=[one.initial or 0.0 for one in driving],
        )
        safe = {one.row: speed for one, speed in zip(driving, speeds, strict=True)}
        found = []
        for one in drafts:
            speed = safe.get(one.row)
            if one.initial is None or speed is None or speed >= one.initial:
                found.append(one)
                continue
            lowered = math.floor(speed * 100.0) / 100.0
            why = f"{one.initial:g} m/s is too fast for the gap ahead; it departs with {lowered:g}"
            self._note(one.row, "clamped", "initial_speed", why)
            found.append(one._replace(initial=lowered))
        return found

    def _category(self, row: int) -> Category | None:
        text = str(self._fill.category[row])
        if text not in {str(one) for one in Category}:
            self._note(row, "dropped", "category", f"there is no category {text!r}")
            return None
        category = Category(text)
        if category not in self._request.allowed:
            self._note(row, "dropped", "category", f"no {text} is wanted here")
            return None
        return category

    def _problem(self, node: int, category: Category) -> str:
        """Why a road user cannot be on a node, empty if it can."""
        if not 0 <= node < len(self._graph(category).x):
            return "it has no node" if node == NO_NODE else f"there is no node {node}"
        if not self._request.allowed[category][node]:
            walk = category is Category.PEDESTRIAN
            inside = (self._request.walks if walk else self._request.roads)[node]
            return f"node {node} {'has no room for it' if inside else 'is outside the region'}"
        return f"node {node} is taken" if self._taken(node, category) else ""

    def _put(self, row: int, category: Category, node: int) -> tuple[int, Category, int]:
        self._crowd.add(row, self._box(node, category))
        return row, category, node

    def _nearest(self, node: int, category: Category) -> int | None:
        graph = self._graph(category)
        if not 0 <= node < len(graph.x):
            return None
        away = np.hypot(graph.x - graph.x[node], graph.y - graph.y[node])
        near = np.flatnonzero(self._request.allowed[category] & (away <= MOST_MOVED))
        ordered = near[np.lexsort((near, away[near]))].tolist()
        return next((one for one in ordered if not self._taken(one, category)), None)

    def _taken(self, node: int, category: Category) -> bool:
        return not self._crowd.is_free(self._box(node, category))

    def _box(self, node: int, category: Category) -> Box:
        return box_at(self._graph(category), node, self._request.bodies[category], gap=GAP)

    def _graph(self, category: Category) -> LaneGraph | PedestrianGraph:
        graph = self._region.graph
        return graph.walks if category is Category.PEDESTRIAN else graph.lanes

    def _limit(self, category: Category, node: int) -> float:
        if category is Category.PEDESTRIAN:
            return math.inf
        limit = float(self._region.graph.lanes.speed_limit[node])
        return limit if limit > 0.0 else math.inf

    def _initial(self, row: int) -> float | None:
        value = self._value(row, "initial_speed")
        if value is None:
            return None
        if math.isinf(value):
            self._note(row, "opened", "initial_speed", f"{value} m/s; it departs from rest")
            return None
        return value

    def _desired(self, row: int, category: Category) -> float | None:
        value = self._value(row, "desired_speed")
        if value is None:
            return None
        low, high = SPEED_MIN[category], SPEED_MAX[category]
        return self._clamp(row, "desired_speed", value, low, high)

    def _left(self, row: int, category: Category, node: int) -> float:
        value = self._value(row, "lateral_offset")
        if value is None:
            return 0.0
        graph = self._graph(category)
        room = (float(graph.width[node]) - self._request.bodies[category].width) / 2.0 - LANE_MARGIN
        room = math.floor(max(room, 0.0) * 100.0) / 100.0
        return self._clamp(row, "lateral_offset", value, -room, room)

    def _depart(self, row: int) -> float:
        value = self._value(row, "depart")
        return 0.0 if value is None else self._clamp(row, "depart", value, 0.0, LATEST)

    def _clamp(self, row: int, column: str, value: float, low: float, high: float) -> float:
        kept = round(min(max(value, low), high), 2)
        if abs(kept - value) > 0.005 + 1e-9:
            why = f"{value:g} is not between {low:g} and {high:g}; it is {kept:g}"
            self._note(row, "clamped", column, why)
        return kept

    def _value(self, row: int, column: str) -> float | None:
        """What an optional column says; ``None`` where it leaves it open."""
        array: Array | None = getattr(self._fill, column)
        if array is None or math.isnan(value := float(array[row])):
            return None
        return value

    def _note(self, row: int, what: str, column: str, why: str) -> None:
        self.remarks.append(FillRemark(row, what, column, why))
