"""What a behaviour model sees: lanes once, and all vehicles before each step."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from odscen.learning.behaviour.behaviour_model import (
    AHEAD,
    BehaviourScene,
    LightAhead,
    RoadObservation,
)
from odscen.learning.behaviour.lane_order import LaneOrder

if TYPE_CHECKING:
    from collections.abc import Sequence

    from odscen.base.arrays import Int32Array
    from odscen.results.records.run_records import Plan
    from odscen.sumo.worker.driven_vehicles import DrivenVehicles, LaneFacts

_LETTERS = {
    **dict.fromkeys("gG", LightAhead.GREEN), **dict.fromkeys("yYu", LightAhead.YELLOW),
    **dict.fromkeys("rs", LightAhead.RED),
}  # fmt: skip
"""What letters of SUMO's lights mean; others (off, blinking) are no light."""


class RoadSight:
    """Sees it. Lane, leader, and what is ahead are looked up anew where a vehicle changes lanes."""

    def __init__(self, road: DrivenVehicles, plan: Plan, time: float) -> None:
        self._road = road
        self._vehicles = [actor for actor in plan.actors if not actor.person]
        self._row = {actor.id: row for row, actor in enumerate(self._vehicles)}
        self._offset = plan.net_offset
        lanes = road.lanes()
        self._lanes = {lane.id: lane for lane in lanes}
        self._lane_row = {lane.id: row for row, lane in enumerate(lanes)}
        self.scene = self._scene(lanes, plan, time)
        self._inside = frozenset(via for lane in lanes for _, via in lane.links if via)
        self._lights = road.light_links()
        count = len(self._vehicles)
        self._known: list[str | None] = [None] * count
        self._ahead = np.full((count, AHEAD), -1, dtype=np.int32)
        self._can = np.zeros((count, 2), dtype=np.bool_)
        self._link: list[tuple[str, int] | None] = [None] * count
        self._paths: dict[tuple[str, tuple[str, ...], str], tuple[list[int], bool, bool, str]] = {}

    def look(self, time: float) -> tuple[RoadObservation, list[str]]:
        """Everyone on the road, and their ids."""
        seen = self._road.traffic(self._row)
        rows = [self._row[name] for name in seen.names]
        for name, row, lane in zip(seen.names, rows, seen.lane, strict=True):
            if self._known[row] != lane:
                self._known[row] = lane
                self._look_ahead(name, row, lane)
        index = np.array(rows, dtype=np.int32)
        lanes = np.array([self._lane_row.get(lane, -1) for lane in seen.lane], dtype=np.int32)
        length = self.scene.vehicle_length[index]
        hdg = np.radians(90.0 - seen.angle_deg)
        ahead, can = self._ahead[index], self._can[index]
        leader, gap = LaneOrder(lanes, seen.pos, length).leaders(ahead, self.scene.lane_length)
        observation = RoadObservation(
            time=time,
            index=index,
            x=seen.x - 0.5 * length * np.cos(hdg) - self._offset[0],
            y=seen.y - 0.5 * length * np.sin(hdg) - self._offset[1],
            hdg=np.arctan2(np.sin(hdg), np.cos(hdg)),
            speed=seen.speed,
            acceleration=seen.acceleration,
            lane=lanes,
            pos=seen.pos,
            left=seen.left,
            leader=leader,
            gap=gap,
            ahead=ahead,
            can_left=can[:, 0],
            can_right=can[:, 1],
            light=self._lights_ahead(rows),
        )
        return observation, seen.names

    def _lights_ahead(self, rows: Sequence[int]) -> Int32Array:
        links = [self._link[row] for row in rows]
        states = {
            light: self._road.light_state(light)
            for light in {link[0] for link in links if link is not None}
        }
        shown = [
            LightAhead.NONE
            if link is None
            else _LETTERS.get(states[link[0]][link[1]], LightAhead.NONE)
            for link in links
        ]
        return np.array(shown, dtype=np.int32)

    def _look_ahead(self, name: str, row: int, lane: str) -> None:
        """Find where a vehicle goes from a lane that it has just come to."""
        if lane not in self._lanes:
            self._ahead[row], self._can[row], self._link[row] = -1, False, None
            return
        edges, kind = self._road.coming_edges(name), self._road.vehicle_class(name)
        key = lane, edges[: AHEAD + 1], kind
        if key not in self._paths:
            self._paths[key] = self._path(*key)
        path, left, right, target = self._paths[key]
        self._ahead[row] = path
        self._can[row] = left, right
        self._link[row] = self._lights.get((lane, target))

    def _path(
        self, lane: str, edges: tuple[str, ...], kind: str
    ) -> tuple[list[int], bool, bool, str]:
        """Rows of the lanes ahead, whether either lane beside leads on, where the lane leads."""
        found: list[int] = []
        first, one, left = "", self._lanes[lane], list(edges)
        while len(found) < AHEAD:
            target, via = self._onward(one, left)
            first = first or target
            if not target:
                break
            if one.id not in self._inside:
                left = left[1:]
            for name in (via, "" if via else target):
                if name in self._lane_row:
                    found.append(self._lane_row[name])
                    one = self._lanes[name]
        row, scene = self._lane_row[lane], self.scene
        inside = lane in self._inside
        beside = [
            not inside and self._leads_on(int(side[row]), edges, kind)
            for side in (scene.lane_left, scene.lane_right)
        ]
        padded = (found + [-1] * AHEAD)[:AHEAD]
        return padded, beside[0], beside[1], first

    def _onward(self, lane: LaneFacts, edges: Sequence[str]) -> tuple[str, str]:
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
        return not edges or bool(self._onward(lane, edges)[0])

    def _scene(self, lanes: Sequence[LaneFacts], plan: Plan, time: float) -> BehaviourScene:
        """Arrays of vehicles and lanes."""
        vehicles = self._vehicles
        shapes = [np.array(lane.shape, dtype=np.float64).reshape(-1, 2) for lane in lanes]
        points = np.concatenate([np.empty((0, 2)), *shapes]) - np.array(plan.net_offset)
        left, right = _beside(lanes)
        return BehaviourScene(
            step_length=plan.step_length,
            time=time,
            vehicle_id=np.array([one.id for one in vehicles], dtype=np.str_),
            vehicle_category=np.array([str(one.category) for one in vehicles], dtype=np.str_),
            vehicle_length=np.array([one.length for one in vehicles]),
            vehicle_width=np.array([one.width for one in vehicles]),
            desired_speed=np.array(
                [np.nan if one.speed is None else one.speed for one in vehicles], dtype=np.float64
            ),
            speed_factor=np.array([one.speed_factor for one in vehicles]),
            ego=np.array([one.ego for one in vehicles], dtype=np.bool_),
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


def _beside(lanes: Sequence[LaneFacts]) -> tuple[Int32Array, Int32Array]:
    """Rows of the lanes beside; those of an edge follow each other from the right."""
    left = np.full(len(lanes), -1, dtype=np.int32)
    right = left.copy()
    for row, (one, other) in enumerate(pairwise(lanes)):
        if one.edge == other.edge:
            left[row], right[row + 1] = row + 1, row
    return left, right
