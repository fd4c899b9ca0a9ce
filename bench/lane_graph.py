"""Lane graph of a town, parse to finished edges, against carla.Map doing the same.

Ours: ``parse`` of the text, ``RoadTable.of``, nodes every 2 m with pose, width, curvature and speed
limit, and all successor, left and right edges as arrays. ``build_map_graph`` adds segments and the
pedestrian graph, which carla.Map does not have; it is printed beside.

Peer: ``carla.Map(name, text)``, ``generate_waypoints(2.0)``, and for each waypoint ``next(2.0)``,
``get_left_lane()``, ``get_right_lane()`` and ``lane_change``; and once more without the relations.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from bench.common import paired, shared_maps

if TYPE_CHECKING:
    from pathlib import Path

TOWNS = ("carla-2019/Town04", "carla-2020/Town04")
AIM = 3.0


def main() -> None:
    folder = shared_maps()
    if folder is None:
        print("lane graph: no maps at hand, name their folder in ODSCEN_TEST_MAPS")
        return
    try:
        import carla
    except ImportError:
        print("lane graph: the package carla is not installed")
        return
    for town in TOWNS:
        _compare(carla, folder / f"{town}.xodr", town)


def _compare(carla: object, path: Path, town: str) -> None:
    text = path.read_text(encoding="utf-8")
    data = text.encode()
    ours, full, ratio = paired(lambda: _lane_graph(data), lambda: _map(carla, text, relations=True))
    print(
        f"{town}: lane graph {ours:.3f} s, "
        f"carla.Map with waypoints, next, left, right {full:.3f} s, "
        f"ratio {ratio:.2f} (aim {AIM:g})"
    )
    ours, bare, ratio = paired(
        lambda: _lane_graph(data), lambda: _map(carla, text, relations=False)
    )
    print(f"{town}: the same against carla.Map with waypoints only {bare:.3f} s, ratio {ratio:.2f}")
    whole, _, ratio = paired(lambda: _map_graph(data), lambda: _map(carla, text, relations=True))
    print(f"{town}: with segments and pedestrian graph {whole:.3f} s, ratio {ratio:.2f}")


def _lane_graph(data: bytes) -> int:
    from odscen.lanegraph.build_graphs import connect
    from odscen.lanegraph.lane_nodes import place_nodes
    from odscen.opendrive.lanes import RoadTable
    from odscen.opendrive.parse import parse
    from odscen.opendrive.topology import lane_successors

    odr = parse(data)
    table = RoadTable.of(odr)
    nodes = place_nodes(table, 2.0)
    keys = [table.lane_keys[row] for row in nodes.lines.rows.tolist()]
    edges = connect(nodes, keys, lane_successors(odr))
    table.speed_limit(nodes.lines.rows[nodes.lane], nodes.s)
    return len(edges.source)


def _map_graph(data: bytes) -> int:
    from odscen.lanegraph.build_graphs import build_map_graph
    from odscen.opendrive.parse import parse

    return len(build_map_graph(parse(data), name="bench", sha256="0" * 64).lanes.source)


def _map(carla: object, text: str, *, relations: bool) -> int:
    waypoints = carla.Map("bench", text).generate_waypoints(2.0)
    if not relations:
        return len(waypoints)
    count = 0
    for waypoint in waypoints:
        count += len(waypoint.next(2.0))
        count += waypoint.get_left_lane() is not None
        count += waypoint.get_right_lane() is not None
        count += bool(waypoint.lane_change)
    return count
