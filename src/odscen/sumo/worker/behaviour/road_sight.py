"""What a behaviour model sees: lanes once, and all vehicles before each step."""

from __future__ import annotations

from itertools import accumulate, pairwise
from operator import ne
from typing import TYPE_CHECKING, Any

import numpy as np

from odscen.learning.behaviour.behaviour_model import AHEAD, BehaviourScene, LightAhead
from odscen.learning.behaviour.lane_order import LaneOrder
from odscen.sumo.worker.behaviour.lazy_observation import LazyObservation

if TYPE_CHECKING:
    from collections.abc import Sequence

    from odscen.base.arrays import FloatArray, Int32Array, IntArray
    from odscen.learning.behaviour.behaviour_model import RoadObservation
    from odscen.records.run_plan import Plan
    from odscen.sumo.worker.simulation.driven_vehicles import DrivenVehicles, LaneFacts


# ---------------------------------------------------- lights at the ends of lanes, all read at once
_SHOWN = np.full(256, LightAhead.NONE, dtype=np.int32)
"""What letters of SUMO's lights mean, by their codes; off and blinking are no light."""
for _letters, _meaning in (
    (b"gG", LightAhead.GREEN), (b"yYu", LightAhead.YELLOW), (b"rs", LightAhead.RED),
):  # fmt: skip
    _SHOWN[list(_letters)] = _meaning


class SeenLights:
    """Links with a light have numbers, one light after the other."""

    def __init__(self, road: DrivenVehicles) -> None:
        links = road.light_links()
        self._road = road
        self._lights = sorted({light for light, _ in links.values()})
        self._sizes = [len(road.light_state(light)) for light in self._lights]
        first = dict(zip(self._lights, accumulate(self._sizes, initial=0), strict=False))
        self._number: dict[tuple[str, str], int] = {
            key: first[light] + place for key, (light, place) in links.items()
        }

    def number(self, lane: str, target: str) -> int:
        """Of the link from a lane to another; -1 without a light."""
        return self._number.get((lane, target), -1)

    def ahead(self, links: IntArray) -> Int32Array:
        """What lights show on links; :class:`LightAhead`, none for -1."""
        if not self._lights:
            return np.zeros(len(links), dtype=np.int32)
        # A program that another one has set may be longer or shorter than that of the network.
        states = [
            self._road.light_state(light)[:size].ljust(size)
            for light, size in zip(self._lights, self._sizes, strict=True)
        ]
        letters = np.frombuffer("".join(states).encode("ascii", "replace"), dtype=np.uint8)
        shown_lights: Int32Array = np.where(links >= 0, _SHOWN[letters[links]], LightAhead.NONE)
        return shown_lights


# ---------------------------------------------------------------------- what a behaviour model sees
_GETTERS = {
    "speed": "Speed", "acceleration": "Acceleration", "pos": "LanePosition",
    "left": "LateralLanePosition",
}  # fmt: skip
"""Fields that are a number of SUMO's."""


class RoadSight:
    """Sees it. What is ahead is looked up anew where a vehicle changes lanes."""

    def __init__(self, road: DrivenVehicles, plan: Plan, time: float) -> None:
        self._road = road
        self._vehicles = [actor for actor in plan.actors if not actor.person]
        self._row = {actor.id: row for row, actor in enumerate(self._vehicles)}
        self._offset = plan.net_offset
        lanes = road.lanes()
        self._lanes = {lane.id: lane for lane in lanes}
        self._lane_row = {lane.id: row for row, lane in enumerate(lanes)}
        self.scene = self._make_scene(lanes, plan, time)
        self._inside = frozenset(via for lane in lanes for _, via in lane.links if via)
        self._lights = SeenLights(road)
        count = len(self._vehicles)
        self._ahead = np.full((count, AHEAD), -1, dtype=np.int32)
        self._can = np.zeros((count, 2), dtype=np.bool_)
        self._link = np.full(count, -1, dtype=np.int64)
        self._lane = np.full(count, -1, dtype=np.int32)
        self._lane_ids: list[str | None] = [None] * count
        self._route_index = [-1] * count
        self._moved: dict[int, str] = {}
        """Rows and ids of vehicles that have come to another lane."""
        self._paths: dict[tuple[str, tuple[str, ...], str], tuple[list[int], bool, bool, str]] = {}
        self._names: list[str] = []
        self._index = np.empty(0, dtype=np.int32)
        self._rows: list[int] = []
        self._before: tuple[list[str], list[str]] = [], []
        self._steps = 0
        self._read_at = 0
        """Number of the step in which lanes were read last."""

    def look(self, time: float) -> tuple[LazyObservation, list[str]]:
        """Everyone on the road, and their ids; the same list where nobody has come or gone."""
        self._steps += 1
        names = self._road.present(self._row)
        if names is not self._names:
            self._names = names
            self._rows = [self._row[name] for name in names]
            self._index = np.array(self._rows, dtype=np.int32)
        return LazyObservation(time, self._index.copy(), self._read_field), names

    def _read_field(self, field: str, seen: RoadObservation) -> dict[str, Any]:
        """Read a field of this step, and those that come with it."""
        if field in _GETTERS:
            return {field: self._road.numbers(_GETTERS[field], self._names)}
        if field in ("x", "y", "hdg"):
            return self._body_centres()
        if field == "lane":
            return {"lane": self._lanes_now()}
        if field in ("leader", "gap"):
            length = self.scene.vehicle_length[self._index]
            order = LaneOrder(seen.lane, seen.pos, length)
            leader, gap = order.leaders(self._lanes_ahead(), self.scene.lane_length)
            return {"leader": leader, "gap": gap}
        if field == "light":
            self._lanes_ahead()
            return {"light": self._lights.ahead(self._link[self._index])}
        ahead, can = self._lanes_ahead(), self._can[self._index]
        return {"ahead": ahead, "can_left": can[:, 0], "can_right": can[:, 1]}

    def _body_centres(self) -> dict[str, FloatArray]:
        """Centres of bodies, from the middle of their fronts."""
        x, y = self._road.fronts(self._names)
        half = 0.5 * self.scene.vehicle_length[self._index]
        hdg = np.radians(90.0 - self._road.numbers("Angle", self._names))
        return {
            "x": x - half * np.cos(hdg) - self._offset[0],
            "y": y - half * np.sin(hdg) - self._offset[1],
            "hdg": np.arctan2(np.sin(hdg), np.cos(hdg)),
        }

    def _lanes_now(self) -> Int32Array:
        """Row of the lane of each vehicle on the road."""
        if self._read_at != self._steps:
            names, rows = self._names, self._rows
            lanes = self._road.lanes_of(names)
            if names is self._before[0]:
                other = np.fromiter(map(ne, lanes, self._before[1]), np.bool_, len(lanes))
                places = np.flatnonzero(other).tolist()
            else:
                known = self._lane_ids
                places = [k for k, row in enumerate(rows) if known[row] != lanes[k]]
            for place in places:
                row, lane = rows[place], lanes[place]
                self._lane[row] = self._lane_row.get(lane, -1)
                self._lane_ids[row] = lane
                self._moved[row] = names[place]
            if self._read_at != self._steps - 1:
                self._look_for_rings()
            self._before, self._read_at = (names, lanes), self._steps
        found: Int32Array = self._lane[self._index]
        return found

    def _look_for_rings(self) -> None:
        """Find who is on the same lane as when it was last looked at, but was elsewhere."""
        for row, name in zip(self._rows, self._names, strict=True):
            if self._route_index[row] != self._road.route_index(name):
                self._moved[row] = name

    def _lanes_ahead(self) -> Int32Array:
        """Bring what is ahead of vehicles up to date; rows of lanes ``(N, AHEAD)``."""
        self._lanes_now()
        if self._moved:
            present = set(self._rows)
            for row, name in self._moved.items():
                if row in present:
                    self._route_index[row] = self._road.route_index(name)
                    self._look_ahead(name, row, str(self._lane_ids[row]))
            self._moved.clear()
        lanes: Int32Array = self._ahead[self._index]
        return lanes

    def _look_ahead(self, name: str, row: int, lane: str) -> None:
        """Find where a vehicle goes from a lane that it has just come to."""
        if lane not in self._lanes:
            self._ahead[row], self._can[row], self._link[row] = -1, False, -1
            return
        edges, kind = self._road.coming_edges(name), self._road.vehicle_class(name)
        key = lane, edges[: AHEAD + 1], kind
        if key not in self._paths:
            self._paths[key] = self._path_ahead(*key)
        path, left, right, target = self._paths[key]
        self._ahead[row] = path
        self._can[row] = left, right
        self._link[row] = self._lights.number(lane, target)

    def _path_ahead(
        self, lane: str, edges: tuple[str, ...], kind: str
    ) -> tuple[list[int], bool, bool, str]:
        """Rows of the lanes ahead, whether either lane beside leads on, where the lane leads."""
        rows_ahead: list[int] = []
        first, at, left = "", self._lanes[lane], list(edges)
        while len(rows_ahead) < AHEAD:
            target, via = self._lane_onward(at, left)
            first = first or target
            if not target:
                break
            if at.id not in self._inside:
                left = left[1:]
            for name in (via, "" if via else target):
                if name in self._lane_row:
                    rows_ahead.append(self._lane_row[name])
                    at = self._lanes[name]
        row, scene = self._lane_row[lane], self.scene
        inside = lane in self._inside
        beside = [
            not inside and self._leads_on(int(side[row]), edges, kind)
            for side in (scene.lane_left, scene.lane_right)
        ]
        padded = (rows_ahead + [-1] * AHEAD)[:AHEAD]
        return padded, beside[0], beside[1], first

    def _lane_onward(self, lane: LaneFacts, edges: Sequence[str]) -> tuple[str, str]:
        """Lane that one leads to along some edges, and the lane in between; empty: none."""
        if lane.id in self._inside:
            return lane.links[0] if lane.links else ("", "")
        for target, via in lane.links:
            if edges and target in self._lanes and self._lanes[target].edge == edges[0]:
                return target, via
        return "", ""

    def _leads_on(self, row: int, edges: Sequence[str], kind: str) -> bool:
        if row < 0:
            return False
        lane = self._lanes[str(self.scene.lane_id[row])]
        if lane.allowed and kind not in lane.allowed:
            return False
        return not edges or bool(self._lane_onward(lane, edges)[0])

    def _make_scene(self, lanes: Sequence[LaneFacts], plan: Plan, time: float) -> BehaviourScene:
        """Arrays of vehicles and lanes."""
        vehicles = self._vehicles
        shapes = [np.array(lane.shape, dtype=np.float64).reshape(-1, 2) for lane in lanes]
        points = np.concatenate([np.empty((0, 2)), *shapes]) - np.array(plan.net_offset)
        left, right = _lanes_beside(lanes)
        return BehaviourScene(
            step_length=plan.step_length,
            time=time,
            vehicle_id=np.array([vehicle.id for vehicle in vehicles], dtype=np.str_),
            vehicle_category=np.array(
                [str(vehicle.category) for vehicle in vehicles], dtype=np.str_
            ),
            vehicle_length=np.array([vehicle.length for vehicle in vehicles]),
            vehicle_width=np.array([vehicle.width for vehicle in vehicles]),
            desired_speed=np.array(
                [np.nan if vehicle.speed is None else vehicle.speed for vehicle in vehicles],
                dtype=np.float64,
            ),
            speed_factor=np.array([vehicle.speed_factor for vehicle in vehicles]),
            ego=np.array([vehicle.ego for vehicle in vehicles], dtype=np.bool_),
            lane_id=np.array([lane.id for lane in lanes], dtype=np.str_),
            lane_length=np.array([lane.length for lane in lanes]),
            lane_limit=np.array([lane.limit for lane in lanes]),
            lane_width=np.array([lane.width for lane in lanes]),
            lane_left=left,
            lane_right=right,
            lane_shape_start=np.cumsum([0, *map(len, shapes)]).astype(np.int32),
            lane_shape_x=points[:, 0],
            lane_shape_y=points[:, 1],
        )


def _lanes_beside(lanes: Sequence[LaneFacts]) -> tuple[Int32Array, Int32Array]:
    """Rows of the lanes beside; those of an edge follow each other from the right."""
    left = np.full(len(lanes), -1, dtype=np.int32)
    right = left.copy()
    for row, (one, other) in enumerate(pairwise(lanes)):
        if one.edge == other.edge:
            left[row], right[row + 1] = row + 1, row
    return left, right
