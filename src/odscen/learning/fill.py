"""What generators of traffic are given and give back, and its check and repair.

All arrays and their units are in ``docs/generators.md``. A generator sees no document and no
simulator.

Every repair is named, with the road user by its place in the arrays. What is left passes every
check of scenarios, and no two bodies touch.
"""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol

import numpy as np

from odscen.base.categories import Category
from odscen.base.errors import InputError
from odscen.base.given_arrays import arrays_from_npz, npz_bytes
from odscen.lanegraph.graph_npz import graph_arrays
from odscen.learning.safe_speeds import safe_speeds
from odscen.learning.traffic_snapshots import no_lights
from odscen.scenario.checks.actor_checks import SPEED_MAX, SPEED_MIN
from odscen.scenario.document.problems import validated
from odscen.scenario.document.scenario_document import Actor
from odscen.scenario.placing.bodies import box_at
from odscen.scenario.placing.region import NodePlace, name_of
from odscen.scenario.placing.spawn_room import LANE_MARGIN, crowd_for

if TYPE_CHECKING:
    from collections.abc import Mapping

    from odscen.base.arrays import BoolArray
    from odscen.base.categories import Body
    from odscen.lanegraph.graphs import LaneGraph, MapGraph, PedestrianGraph
    from odscen.learning.traffic_snapshots import LightView
    from odscen.scenario.placing.bodies import Box
    from odscen.scenario.placing.region import Region


Array = np.ndarray[Any, np.dtype[Any]]

VEHICLES = tuple(category for category in Category if category is not Category.PEDESTRIAN)
OPTIONAL = {
    "initial_speed": "m/s", "desired_speed": "m/s", "goal": "node", "lateral_offset": "m",
    "depart": "s",
}  # fmt: skip
"""Columns of a fill that need not be there, with their units."""


NO_NODE = np.iinfo(np.int64).min
"""In place of a node that is no number."""


@dataclass(frozen=True, slots=True, eq=False)
class FillRequest:
    """What is to be filled.

    Attributes
    ----------
    graph
        The whole map.
    roads, walks
        Shape ``(N,)`` and ``(P,)``: nodes of the region of interest.
    allowed
        For each category the nodes on which it may start, inside the region; shape ``(N,)``, for
        pedestrians ``(P,)``. Categories that are not wanted have no entry.
    bodies
        Size of each category.
    vehicles, walkers
        How many are wanted.
    seed
        Of the scenario.
    given_lights
        What the traffic lights of the map show when the scenario begins; ``None`` for a map without
        lights.
    """

    graph: MapGraph
    roads: BoolArray
    walks: BoolArray
    allowed: Mapping[Category, BoolArray]
    bodies: Mapping[Category, Body]
    vehicles: int
    walkers: int
    seed: int
    given_lights: LightView | None = None

    @property
    def lights(self) -> LightView:
        """What lights show at the beginning, for each lane."""
        return self.given_lights or no_lights(len(self.graph.lanes.lanes.keys))

    def arrays(self) -> dict[str, Array]:
        """All of it as named arrays, the map's included."""
        none = np.zeros(len(self.graph.lanes.x), dtype=np.bool_)
        nobody = np.zeros(len(self.graph.walks.x), dtype=np.bool_)
        return {
            **graph_arrays(self.graph),
            "region": self.roads,
            "walk_region": self.walks,
            "categories": np.array([str(category) for category in Category]),
            "bodies": np.array([self.bodies[category] for category in Category], dtype=np.float64),
            "allowed": np.stack([self.allowed.get(category, none) for category in VEHICLES]),
            "walk_allowed": self.allowed.get(Category.PEDESTRIAN, nobody),
            "wanted": np.array([self.vehicles, self.walkers], dtype=np.int32),
            "seed": np.array([self.seed], dtype=np.int64),
            "lane_light": self.lights.state,
            "lane_light_since": self.lights.since,
        }


@dataclass(frozen=True, slots=True, eq=False)
class Fill:
    """Road users that a generator places; all arrays have one value for each of them.

    Attributes
    ----------
    node
        Node of the lane graph, of a pedestrian one of the pedestrian graph.
    category
        Name of the category, or its place in :class:`~odscen.base.categories.Category`.
    initial_speed
        m/s; NaN, or no array, is from rest.
    desired_speed
        m/s; NaN, or no array, is the limit, or the usual walking speed.
    goal
        Node of the same graph; -1, or no array, leaves it to the seed.
    lateral_offset
        Metres to the left of the centre line of the lane.
    depart
        Seconds.
    """

    node: Array
    category: Array
    initial_speed: Array | None = None
    desired_speed: Array | None = None
    goal: Array | None = None
    lateral_offset: Array | None = None
    depart: Array | None = None


class Generator(Protocol):
    """Places traffic on a map; one object may be asked many times."""

    def fill(
        self, graph: MapGraph, request: FillRequest, rng: np.random.Generator
    ) -> Fill | Mapping[str, Array]:
        """Fill a region.

        Parameters
        ----------
        graph
            The map, also in the request.
        request
            What is wanted, and where it may be.
        rng
            The only source of chance: it follows the scenario's seed.
        """


def request_bytes(request: FillRequest) -> bytes:
    """Write a request as an .npz file, without pickles; the same request gives the same bytes."""
    return npz_bytes(request.arrays())


def fill_from_bytes(data: bytes, *, file: str) -> Fill:
    """Read the arrays of an .npz file as a fill; what else it has is not looked at.

    Raises
    ------
    InputError
        If it is no such file, or an array is missing or malformed.
    """
    arrays = arrays_from_npz(data, file=file, only=("node", "category", *OPTIONAL))
    return fill_from_arrays(arrays, file=file)


def fill_from_arrays(arrays: Mapping[str, Array], *, file: str | None = None) -> Fill:
    """Make a fill of arrays that may be of other kinds of numbers, or be no arrays.

    Raises
    ------
    InputError
        If one is missing, has another shape, or no numbers of its kind.
    """
    given = {name: np.asarray(value) for name, value in arrays.items() if value is not None}
    for name in ("node", "category"):
        if name not in given:
            raise InputError(f"array {name!r} is missing", file=file, element=name)
    count = len(given["node"]) if given["node"].ndim == 1 else -1
    for name, array in given.items():
        if array.shape != (count,):
            raise InputError(
                f"it has shape {array.shape}, not one value for each road user",
                file=file,
                element=name,
            )
    columns = {
        name: _whole_numbers(given[name], name, file) if name in ("node", "goal") else
        _check_categories(given[name], file) if name == "category" else
        _check_numbers(given[name], name, file)
        for name in ("node", "category", *OPTIONAL)
        if name in given
    }  # fmt: skip
    return Fill(**columns)


def _whole_numbers(array: Array, name: str, file: str | None) -> Array:
    if array.dtype.kind in "iu":
        return array.astype(np.int64)
    numbers = _check_numbers(array, name, file)
    odd = np.flatnonzero(~(np.isnan(numbers) | (numbers == np.round(numbers))))
    if len(odd):
        raise InputError(
            f"{float(numbers[odd[0]])!r} of road user {odd[0]} is no whole number",
            file=file,
            element=name,
        )
    known = np.isfinite(numbers) & (np.abs(numbers) < 2**53)
    return np.where(known, numbers, NO_NODE).astype(np.int64)


def _check_numbers(array: Array, name: str, file: str | None) -> Array:
    if array.dtype.kind not in "fiu":
        raise InputError(f"it has values of {array.dtype}, not numbers", file=file, element=name)
    return array.astype(np.float64)


def _check_categories(array: Array, file: str | None) -> Array:
    if not len(array):  # an empty list has numbers of any kind
        return array.astype(np.str_)
    if array.dtype.kind == "S":
        return np.char.decode(array, "utf-8", "replace")
    if array.dtype.kind == "U":
        return array
    if array.dtype.kind in "iu":
        names = [*(str(category) for category in Category)]
        return np.array([names[k] if 0 <= k < len(names) else str(k) for k in array.tolist()])
    raise InputError(
        f"it has values of {array.dtype}, not names of categories or their numbers",
        file=file,
        element="category",
    )


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
    for draft in drafts:
        counter[draft.category] += 1
        walk = draft.category is Category.PEDESTRIAN
        goal = None if draft.goal is None else name_of(region.graph, NodePlace(walk, draft.goal))
        fields = {
            "id": f"{draft.category}-{counter[draft.category]}",
            "category": draft.category,
            "spawn": name_of(region.graph, NodePlace(walk, draft.node)),
            "goal": goal,
            "speed": draft.desired,
            "lateral_offset": draft.left,
            "depart": draft.depart,
            "initial_speed": draft.initial,
        }
        actors.append(validated(Actor, fields))
    remarks = sorted(check.remarks, key=lambda remark: remark.row)
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
            category = self._category_of(row)
            if category is None:
                continue
            node = int(self._fill.node[row])
            problem = self._find_problem(node, category)
            if problem:
                others.append((row, category, node, problem))
            else:
                found.append(self._put_user(row, category, node))
        for row, category, node, problem in others:
            near = self._nearest_free_node(node, category)
            if near is None:
                self._note_remark(row, "dropped", "node", f"{problem}, and no node near it is free")
            else:
                self._note_remark(row, "moved", "node", f"{problem}; it is on node {near}")
                found.append(self._put_user(row, category, near))
        return sorted(found)

    def draft(self, row: int, category: Category, node: int) -> _Draft:
        """One road user with all but what its goal and its neighbours allow."""
        walk = category is Category.PEDESTRIAN
        limit = self._speed_limit_at(category, node)
        initial = None if walk else self._initial_speed(row)
        desired = self._desired_speed(row, category)
        if initial is not None:
            if desired is None and math.isfinite(limit):
                # By the limit itself, as the drivers' own factors might be below it.
                desired = round(min(limit, SPEED_MAX[category]), 2)
            most = SPEED_MAX[category] if desired is None else desired
            initial = self._clamp_value(row, "initial_speed", initial, 0.0, most)
        goal = self._value_of(row, "goal")
        return _Draft(
            row, category, node, desired, initial,
            None if goal is None or goal == -1 else int(goal),
            self._lateral_offset(row, category, node), self._depart_time(row),
        )  # fmt: skip

    def with_goals(self, drafts: list[_Draft]) -> list[_Draft]:
        """Leave goals open that are not there, or that no path leads to."""
        region, found = self._region, []
        names = {
            walk: len((region.graph.walks if walk else region.graph.lanes).x)
            for walk in (False, True)
        }
        known = [
            draft
            for draft in drafts
            if draft.goal is not None
            and 0 <= draft.goal < names[draft.category is Category.PEDESTRIAN]
        ]
        region.look_up(
            (name_of(region.graph, NodePlace(walk, draft.node)),
             name_of(region.graph, NodePlace(walk, draft.goal or 0)))
            for draft in known for walk in (draft.category is Category.PEDESTRIAN,)
        )  # fmt: skip
        rows = {draft.row for draft in known}
        for draft in drafts:
            walk = draft.category is Category.PEDESTRIAN
            if draft.goal is None:
                found.append(draft)
            elif draft.row not in rows:
                self._note_remark(draft.row, "opened", "goal", f"there is no node {draft.goal}")
                found.append(draft._replace(goal=None))
            elif region.leads(NodePlace(walk, draft.node), NodePlace(walk, draft.goal)):
                found.append(draft)
            else:
                why = f"no path inside the region leads from node {draft.node} to {draft.goal}"
                self._note_remark(draft.row, "opened", "goal", why)
                found.append(draft._replace(goal=None))
        return found

    def with_safe_speeds(self, drafts: list[_Draft]) -> list[_Draft]:
        """Lower initial speeds so that everyone can stop behind the one ahead."""
        driving = [
            draft
            for draft in drafts
            if draft.category is not Category.PEDESTRIAN and draft.depart == 0.0
        ]
        speeds = safe_speeds(
            self._region.graph.lanes,
            nodes=[draft.node for draft in driving],
            lengths=[self._request.bodies[draft.category].length for draft in driving],
            speeds=[draft.initial or 0.0 for draft in driving],
        )
        safe = {one.row: speed for one, speed in zip(driving, speeds, strict=True)}
        found = []
        for draft in drafts:
            speed = safe.get(draft.row)
            if draft.initial is None or speed is None or speed >= draft.initial:
                found.append(draft)
                continue
            lowered = math.floor(speed * 100.0) / 100.0
            why = (
                f"{draft.initial:g} m/s is too fast for the gap ahead; it departs with {lowered:g}"
            )
            self._note_remark(draft.row, "clamped", "initial_speed", why)
            found.append(draft._replace(initial=lowered))
        return found

    def _category_of(self, row: int) -> Category | None:
        text = str(self._fill.category[row])
        if text not in {str(category) for category in Category}:
            self._note_remark(row, "dropped", "category", f"there is no category {text!r}")
            return None
        category = Category(text)
        if category not in self._request.allowed:
            self._note_remark(row, "dropped", "category", f"no {text} is wanted here")
            return None
        return category

    def _find_problem(self, node: int, category: Category) -> str:
        """Why a road user cannot be on a node, empty if it can."""
        if not 0 <= node < len(self._graph_for(category).x):
            return "it has no node" if node == NO_NODE else f"there is no node {node}"
        if not self._request.allowed[category][node]:
            walk = category is Category.PEDESTRIAN
            inside = (self._request.walks if walk else self._request.roads)[node]
            return f"node {node} {'has no room for it' if inside else 'is outside the region'}"
        return f"node {node} is taken" if self._is_taken(node, category) else ""

    def _put_user(self, row: int, category: Category, node: int) -> tuple[int, Category, int]:
        self._crowd.add(row, self._body_box(node, category))
        return row, category, node

    def _nearest_free_node(self, node: int, category: Category) -> int | None:
        graph = self._graph_for(category)
        if not 0 <= node < len(graph.x):
            return None
        away = np.hypot(graph.x - graph.x[node], graph.y - graph.y[node])
        near = np.flatnonzero(self._request.allowed[category] & (away <= MOST_MOVED))
        ordered = near[np.lexsort((near, away[near]))].tolist()
        return next(
            (node_near for node_near in ordered if not self._is_taken(node_near, category)), None
        )

    def _is_taken(self, node: int, category: Category) -> bool:
        return not self._crowd.is_free(self._body_box(node, category))

    def _body_box(self, node: int, category: Category) -> Box:
        return box_at(self._graph_for(category), node, self._request.bodies[category], gap=GAP)

    def _graph_for(self, category: Category) -> LaneGraph | PedestrianGraph:
        graph = self._region.graph
        return graph.walks if category is Category.PEDESTRIAN else graph.lanes

    def _speed_limit_at(self, category: Category, node: int) -> float:
        if category is Category.PEDESTRIAN:
            return math.inf
        limit = float(self._region.graph.lanes.speed_limit[node])
        return limit if limit > 0.0 else math.inf

    def _initial_speed(self, row: int) -> float | None:
        value = self._value_of(row, "initial_speed")
        if value is None:
            return None
        if math.isinf(value):
            self._note_remark(row, "opened", "initial_speed", f"{value} m/s; it departs from rest")
            return None
        return value

    def _desired_speed(self, row: int, category: Category) -> float | None:
        value = self._value_of(row, "desired_speed")
        if value is None:
            return None
        low, high = SPEED_MIN[category], SPEED_MAX[category]
        return self._clamp_value(row, "desired_speed", value, low, high)

    def _lateral_offset(self, row: int, category: Category, node: int) -> float:
        value = self._value_of(row, "lateral_offset")
        if value is None:
            return 0.0
        graph = self._graph_for(category)
        room = (float(graph.width[node]) - self._request.bodies[category].width) / 2.0 - LANE_MARGIN
        room = math.floor(max(room, 0.0) * 100.0) / 100.0
        return self._clamp_value(row, "lateral_offset", value, -room, room)

    def _depart_time(self, row: int) -> float:
        value = self._value_of(row, "depart")
        return 0.0 if value is None else self._clamp_value(row, "depart", value, 0.0, LATEST)

    def _clamp_value(self, row: int, column: str, value: float, low: float, high: float) -> float:
        kept = round(min(max(value, low), high), 2)
        if abs(kept - value) > 0.005 + 1e-9:
            why = f"{value:g} is not between {low:g} and {high:g}; it is {kept:g}"
            self._note_remark(row, "clamped", column, why)
        return kept

    def _value_of(self, row: int, column: str) -> float | None:
        """What an optional column says; ``None`` where it leaves it open."""
        array: Array | None = getattr(self._fill, column)
        if array is None or math.isnan(value := float(array[row])):
            return None
        return value

    def _note_remark(self, row: int, what: str, column: str, why: str) -> None:
        self.remarks.append(FillRemark(row, what, column, why))
