"""The lane graph against CARLA's own map library, which reads OpenDRIVE in C++ without a server.

The remainder, where the two disagree, is counted, limited and explained in docs/lane-graph.md.
"""

from __future__ import annotations

from collections import Counter, defaultdict
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from odscen.lanegraph.build_graphs import build_map_graph
from odscen.lanegraph.graphs import CHANGE_LEFT, CHANGE_RIGHT, MapGraph, Relation
from odscen.lanegraph.lane_nodes import MIN_LANE_WIDTH
from odscen.opendrive.lanes import RoadTable
from odscen.opendrive.parse import parse

if TYPE_CHECKING:
    from pathlib import Path

carla = pytest.importorskip("carla", reason="the package carla is the oracle")

TOWNS = (
    "carla-2019/Town01",
    "carla-2019/Town02",
    "carla-2019/Town03",
    "carla-2019/Town04",
    "carla-2019/Town05",
    "carla-2019/Town07",
    "carla-2020/Town01",
    "carla-2020/Town04",
    "carla-2020/Town07",
)
TINY = 0.003
"""Metres; CARLA's ``next()`` cannot be aimed at a lane that is shorter."""


class Comparison:
    """One town, read by both."""

    def __init__(self, path: Path) -> None:
        text = path.read_text(encoding="utf-8")
        odr = parse(text.encode(), file=path.name)
        self.table = RoadTable.of(odr)
        self.graph: MapGraph = build_map_graph(odr, name=path.stem, sha256="0" * 64)
        self.peer = carla.Map(path.stem, text)
        self.nodes = self.graph.lanes
        self.keys = self.nodes.lanes.keys
        self.row = np.array([self.table.lane_index[key] for key in self.keys])
        follows = self.nodes.relation == Relation.SUCCESSOR
        self.after: dict[int, list[int]] = defaultdict(list)
        for source, target in zip(
            self.nodes.source[follows].tolist(), self.nodes.target[follows].tolist(), strict=True
        ):
            self.after[source].append(target)

    def waypoint(self, node: int) -> Any:
        key = self.keys[self.nodes.lane[node]]
        return self.peer.get_waypoint_xodr(int(key.road), key.lane, float(self.nodes.s[node]))

    def gap(self, node: int, waypoint: Any) -> float:
        """Level distance of a node from a waypoint; CARLA's y points south."""
        place = waypoint.transform.location
        return float(np.hypot(place.x - self.nodes.x[node], -place.y - self.nodes.y[node]))

    def rest(self, node: int, *, ahead: bool) -> float:
        """Metres of s from the node to the end of its lane, ahead or behind while driving."""
        lane = self.nodes.lane[node]
        row, s = self.row[lane], self.nodes.s[node]
        to_s1 = bool(self.nodes.lanes.forward[lane]) == ahead
        return float(self.table.lane_s1[row] - s if to_s1 else s - self.table.lane_s0[row])

    def distances(self) -> list[float]:
        return [self.gap(node, self.waypoint(node)) for node in range(len(self.nodes.x))]

    def successors(self) -> Counter[str]:
        """Edges that ``next()`` confirms: a waypoint within 5 cm of the target."""
        counts: Counter[str] = Counter()
        for node, targets in self.after.items():
            waypoint = self.waypoint(node)
            for target in targets:
                if self.nodes.lane[node] == self.nodes.lane[target]:
                    metres = abs(self.nodes.s[target] - self.nodes.s[node])
                else:
                    metres = self.rest(node, ahead=True) + self.rest(target, ahead=False)
                found = waypoint.next(float(metres))
                confirmed = any(self.gap(target, other) < 0.05 for other in found)
                counts["confirmed" if confirmed else "not confirmed"] += 1
        return counts

    def followers(self) -> Counter[str]:
        """Lanes that ``next()`` finds just behind the end of each lane, and ours."""
        counts: Counter[str] = Counter()
        for node in (self.nodes.lanes.first_node[1:] - 1).tolist():
            lanes = [int(self.nodes.lane[target]) for target in self.after[node]]
            shortest = min((float(self.nodes.lanes.lengths[lane]) for lane in lanes), default=1.0)
            if shortest < TINY:
                counts["tiny"] += 1
                continue
            mine = {(int(self.keys[lane].road), self.keys[lane].lane) for lane in lanes}
            waypoint = self.waypoint(node)
            found = waypoint.next(self.rest(node, ahead=True) + min(0.02, shortest / 2))
            theirs = {(w.road_id, w.lane_id) for w in found}
            counts["same" if mine == theirs else "different"] += 1
        return counts

    def sides(self) -> Counter[str]:
        """Adjacent lanes of the same direction, and whether one may change to them."""
        counts: Counter[str] = Counter()
        for node in range(len(self.nodes.x)):
            waypoint = self.waypoint(node)
            flag = str(waypoint.lane_change)
            for side, lanes, bit in (
                ("left", self.nodes.left_lane, CHANGE_LEFT),
                ("right", self.nodes.right_lane, CHANGE_RIGHT),
            ):
                lane = int(lanes[node])
                mine = self.keys[lane].lane if lane >= 0 else None
                other = self.beside(waypoint, side)
                if mine is None and other is not None and other.lane_width < MIN_LANE_WIDTH:
                    counts["narrow"] += 1
                    continue
                same = mine == (other.lane_id if other is not None else None)
                counts["same neighbour" if same else "other neighbour"] += 1
                if mine is not None:
                    permitted = bool(self.nodes.lane_change[node] & bit)
                    agreed = permitted == (flag in (side.title(), "Both"))
                    counts["same rule" if agreed else "other rule"] += 1
        return counts

    @staticmethod
    def beside(waypoint: Any, side: str) -> Any:
        """The driving lane of the same direction on a side, or ``None``."""
        other = getattr(waypoint, f"get_{side}_lane")()
        if other is None or other.lane_type != carla.LaneType.Driving:
            return None
        return other if (other.lane_id > 0) == (waypoint.lane_id > 0) else None

    def peer_length(self, step: float = 0.5) -> float:
        """Length of all driving lanes by CARLA: chords between waypoints, and the bits at the ends.

        Waypoints lie at s = 0, step, 2 step, ... of each road. A run of them on one lane that ends
        with the road ends at its length; elsewhere a section ends half a step on, on average.
        """
        runs: dict[tuple[int, int, int], list[Any]] = defaultdict(list)
        for waypoint in self.peer.generate_waypoints(step):
            runs[waypoint.road_id, waypoint.section_id, waypoint.lane_id].append(waypoint)
        ends = dict(zip(self.table.road_ids, self.table.road_length.tolist(), strict=True))
        total = 0.0
        for (road, _, _), run in runs.items():
            places = np.array([(w.transform.location.x, w.transform.location.y) for w in run])
            s = np.array([w.s for w in run])
            places, s = places[np.argsort(s)], np.sort(s)
            chords = np.hypot(*np.diff(places, axis=0).T).sum()
            at_end = ends[str(road)] - s[-1]
            before = 0.0 if s[0] < step else step / 2
            total += chords + before + (at_end if at_end <= step else step / 2)
        return total


@pytest.fixture(scope="module", params=TOWNS)
def town(request: pytest.FixtureRequest, shared_maps: Path) -> Comparison:
    return Comparison(shared_maps / f"{request.param}.xodr")


def test_nodes_lie_on_the_lane_centres(town: Comparison) -> None:
    distances = town.distances()
    assert np.percentile(distances, 99) < 0.001
    assert max(distances) < 0.02


def test_changes_lead_about_one_spacing_forward(town: Comparison) -> None:
    nodes = town.nodes
    aside = nodes.relation != Relation.SUCCESSOR
    source, target = nodes.source[aside], nodes.target[aside]
    dx, dy = nodes.x[target] - nodes.x[source], nodes.y[target] - nodes.y[source]
    forward = dx * np.cos(nodes.hdg[source]) + dy * np.sin(nodes.hdg[source])
    assert np.all((forward > 0.9) & (forward < 3.2))


def test_driving_lanes_are_as_long(town: Comparison) -> None:
    ours = float(town.nodes.lanes.lengths.sum())
    assert ours == pytest.approx(town.peer_length(), rel=0.002)


def test_every_successor_is_confirmed_by_next(town: Comparison) -> None:
    counts = town.successors()
    assert counts["not confirmed"] == 0
    assert counts["confirmed"] == np.count_nonzero(town.nodes.relation == Relation.SUCCESSOR)


def test_the_same_lanes_follow_at_the_end_of_each_lane(town: Comparison) -> None:
    counts = town.followers()
    assert counts["different"] == 0
    assert counts["tiny"] <= 0.12 * len(town.keys)


def test_left_and_right_lanes_and_lane_change_agree(town: Comparison) -> None:
    counts = town.sides()
    assert counts["other neighbour"] == 0
    assert counts["other rule"] == 0
    assert counts["narrow"] <= 4
