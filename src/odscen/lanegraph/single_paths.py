"""Reachability, goal candidates and shortest paths for a single query.

Who has several asks a :class:`~odscen.lanegraph.shortest_paths.Router`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from odscen.lanegraph.shortest_paths import Router, WalkRouter

if TYPE_CHECKING:
    from odscen.base.arrays import BoolArray, Int32Array
    from odscen.lanegraph.graphs import MapGraph


def goal_candidates(graph: MapGraph, roi_mask: BoolArray | None, spawn: int) -> Int32Array:
    """Goal candidates of a vehicle; see :meth:`Router.goal_candidates`."""
    return Router(graph, roi_mask).goal_candidates(spawn)


def walk_goal_candidates(graph: MapGraph, roi_mask: BoolArray | None, spawn: int) -> Int32Array:
    """Goal candidates of a walker; see :meth:`WalkRouter.goal_candidates`."""
    return WalkRouter(graph, roi_mask).goal_candidates(spawn)


def shortest_path(
    graph: MapGraph, source: int, target: int, mask: BoolArray | None = None
) -> Int32Array:
    """Lane-graph nodes of the shortest path, both ends included; empty if there is none."""
    return Router(graph, mask).path(source, target)


def walk_shortest_path(
    graph: MapGraph, source: int, target: int, mask: BoolArray | None = None
) -> Int32Array:
    """Pedestrian nodes of the shortest path, both ends included; empty if there is none."""
    return WalkRouter(graph, mask).path(source, target)


def reachable(graph: MapGraph, source: int, mask: BoolArray | None = None) -> BoolArray:
    """Lane-graph nodes that can be reached from ``source``, itself included; shape ``(N,)``."""
    return Router(graph, mask).reachable(source)


def walk_reachable(graph: MapGraph, source: int, mask: BoolArray | None = None) -> BoolArray:
    """Pedestrian nodes that can be reached from ``source``, itself included; shape ``(P,)``."""
    return WalkRouter(graph, mask).reachable(source)
