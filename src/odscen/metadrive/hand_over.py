"""What MetaDrive's process is given: values as JSON, states, paths and lanes as arrays.

``job.json``: ``step`` (s), ``steps``, ``seed`` and ``users``, in the order of the plan, each with
``id``, ``body`` (``vehicle``, ``cyclist``, ``pedestrian``), ``length``, ``width``, ``height``
(metres), ``grip`` (share of that of a dry road), ``drive`` (one of :data:`DRIVES`), ``path`` (its
number, or -1) and ``arrives`` (whether the path ends at its goal).

``job.npz``, metres, rad, m/s, OpenDRIVE frame, groups of rows between ``..._start[k]`` and
``[k + 1]``:

- ``start``; ``row``, ``x``, ``y``, ``hdg``, ``speed``: who is where at each step, body centres;
- ``path_start``; ``path_xy``, ``path_time``, ``path_speed``: of the driven, places in a row, when
  SUMO had it there, and the speed wanted there;
- ``lane_start``; ``lane_xy``; ``border_start``; ``border_xy``; ``lane_limit``: lanes of the map.
"""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.spatial import cKDTree

from odscen.base.arrays import offsets
from odscen.base.categories import DEFAULT_BODY, Category

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from pathlib import Path

    from odscen.base.arrays import FloatArray, IntArray
    from odscen.formats.recordings.run_recording import LaneElement
    from odscen.lanegraph.graphs import LaneGraph
    from odscen.records.run_plan import Plan, PlannedActor
    from odscen.simulators.assets import Assets
    from odscen.sumo.runner.tracked_run import SumoTracks

DRIVES = ("replay", "tracking", "idm")
"""What moves a road user in MetaDrive: it is put where SUMO had it; physics, steered and driven to
be where SUMO had it at each time; physics and MetaDrive's IDM on the way that SUMO had it take."""
DRIVEN = frozenset({Category.CAR, Category.VAN, Category.TRUCK, Category.BUS})
"""Categories that MetaDrive's vehicles stand for; the others are replayed."""
NEAR = 60.0
"""Metres from where a road user is within which lanes are built in MetaDrive."""
SIDEWAYS = 2.5
"""m/s^2 at most to the side in a bend, for the speed that is wanted there."""
SLOWING = 2.0
"""m/s^2 with which one slows down before a bend."""
_SAME_DIRECTION = 0.7
"""Radians by which a node's direction may differ from that of who is on its lane."""
_APART = 0.5
"""Metres between two points of a path at least, for its bends."""


def write_job(
    folder: Path,
    *,
    plan: Plan,
    tracks: SumoTracks,
    drives: Sequence[str],
    lanes: Sequence[LaneElement],
    graph: LaneGraph,
    assets: Assets,
    grip: float,
) -> None:
    """Write the two files of a job.

    Parameters
    ----------
    drives
        Of each road user of the plan.
    lanes
        Of the map; those near road users are built.
    grip
        Share of a dry road's that tyres have.
    """
    paths = _Paths(graph)
    users: list[dict[str, Any]] = []
    last = set(tracks.row[tracks.start[-2] :].tolist()) if len(tracks.times) else set()
    order = np.argsort(tracks.row, kind="stable")
    first = np.searchsorted(tracks.row[order], np.arange(len(plan.actors) + 1))
    for number, actor in enumerate(plan.actors):
        own = order[first[number] : first[number + 1]]
        drive = drives[number] if len(own) else "replay"
        path = -1
        if drive != "replay":
            path = paths.add(actor, tracks, own)
        body = _body_of(actor, assets)
        users.append(
            {
                "id": actor.id,
                **body,
                "grip": round(grip, 6),
                "drive": drive,
                "path": path,
                "arrives": number not in last,
            }
        )
    steps = round(plan.until / plan.step_length)
    job = {"step": plan.step_length, "steps": steps, "seed": plan.seed % 2**31, "users": users}
    (folder / "job.json").write_text(json.dumps(job, ensure_ascii=False), encoding="utf-8")
    states = {name: getattr(tracks, name) for name in ("start", "row", "x", "y", "hdg", "speed")}
    np.savez(folder / "job.npz", **states, **paths.arrays(), **_lanes_near(lanes, tracks))


def drives_of(plan: Plan, *, ego: str, traffic: str) -> list[str]:
    """What moves each road user of a plan; two-wheelers and pedestrians are replayed."""
    return [
        (ego if actor.ego else traffic) if actor.category in DRIVEN else "replay"
        for actor in plan.actors
    ]


def _body_of(actor: PlannedActor, assets: Assets) -> dict[str, Any]:
    category = Category(actor.category)
    model = assets.blueprints.get(actor.model) if actor.model else None
    height = (model.body if model else DEFAULT_BODY[category]).height
    kinds = {Category.PEDESTRIAN: "pedestrian", Category.BICYCLE: "cyclist"}
    return {
        "body": kinds.get(category, "vehicle"),
        "length": actor.length,
        "width": actor.width,
        "height": height,
    }


class _Paths:
    """Ways of those who are driven, with the speed that they want along them."""

    def __init__(self, graph: LaneGraph) -> None:
        self._graph = graph
        self._tree = cKDTree(np.column_stack([graph.x, graph.y]))
        self._parts: list[tuple[FloatArray, FloatArray, FloatArray]] = []

    def add(self, actor: PlannedActor, tracks: SumoTracks, rows: IntArray) -> int:
        """Add the way of a road user; its number."""
        xy = np.column_stack([tracks.x[rows], tracks.y[rows]])
        if len(xy) == 1:  # a way needs two points: it was there for one step
            ahead = np.array([np.cos(tracks.hdg[rows[0]]), np.sin(tracks.hdg[rows[0]])])
            xy = np.concatenate([xy, xy + 0.1 * ahead])
            rows = np.repeat(rows, 2)
        limit = self._find_limits(xy, tracks.hdg[rows]) * actor.speed_factor
        if actor.speed is not None:
            limit = np.minimum(limit, actor.speed)
        self._parts.append((xy, tracks.when[rows], speed_along(xy, limit)))
        return len(self._parts) - 1

    def arrays(self) -> Mapping[str, Any]:
        """All of them, as of the module."""
        parts = self._parts
        return {
            "path_start": offsets([len(xy) for xy, _, _ in parts]),
            "path_xy": np.concatenate([np.empty((0, 2)), *(xy for xy, _, _ in parts)]),
            "path_time": np.concatenate([np.empty(0), *(time for _, time, _ in parts)]),
            "path_speed": np.concatenate([np.empty(0), *(speed for _, _, speed in parts)]),
        }

    def _find_limits(self, xy: FloatArray, hdg: FloatArray) -> FloatArray:
        """Speed limit at each place: of the nearest node that runs the same way."""
        graph = self._graph
        _, near = self._tree.query(xy, k=min(8, len(graph.x)))
        near = near.reshape(len(xy), -1)
        turn = graph.hdg[near] - hdg[:, None]
        same = np.abs(np.arctan2(np.sin(turn), np.cos(turn))) < _SAME_DIRECTION
        chosen = np.take_along_axis(near, np.argmax(same, axis=1)[:, None], axis=1)[:, 0]
        limit: FloatArray = graph.speed_limit[chosen]
        return np.where(np.isfinite(limit), limit, 100.0)


def speed_along(xy: FloatArray, limit: FloatArray) -> FloatArray:
    """Speed wanted at each point: the limit, slower in bends and before them.

    ``v = sqrt(SIDEWAYS r)`` in a bend of radius ``r``; ``v[k]^2 <= v[k + 1]^2 + 2 SLOWING d``.
    """
    steps = np.hypot(*np.diff(xy, axis=0).T)
    along = np.concatenate([[0.0], np.cumsum(steps)])
    if along[-1] < 4.0 * _APART:
        return limit
    # Bends are those of points in equal steps: where one stands, points lie on each other.
    grid = np.linspace(0.0, along[-1], int(along[-1] / _APART) + 1)
    rising = np.concatenate([[True], steps > 1e-6])
    points = np.column_stack(
        [np.interp(grid, along[rising], xy[rising, column]) for column in (0, 1)]
    )
    hdg = np.unwrap(np.arctan2(*np.diff(points, axis=0).T[::-1]))
    turned = np.abs(np.gradient(hdg)) / (grid[1] - grid[0])
    smooth = np.convolve(np.pad(turned, 4, mode="edge"), np.ones(9) / 9.0, mode="valid")
    bend = np.sqrt(SIDEWAYS / np.maximum(smooth, 1e-6))
    wanted = np.minimum(np.interp(grid, along, limit), np.append(bend, bend[-1]))
    for k in range(len(wanted) - 2, -1, -1):
        most = np.sqrt(wanted[k + 1] ** 2 + 2.0 * SLOWING * (grid[k + 1] - grid[k]))
        wanted[k] = min(wanted[k], most)
    along_path: FloatArray = np.interp(along, grid, wanted)
    return along_path


def _lanes_near(lanes: Sequence[LaneElement], tracks: SumoTracks) -> Mapping[str, Any]:
    """Lanes within :data:`NEAR` of where a road user is at some time."""
    kept: list[LaneElement] = []
    if len(tracks.row):
        cells = np.unique(np.round(np.column_stack([tracks.x, tracks.y]) / 5.0), axis=0) * 5.0
        tree = cKDTree(cells)
        for lane in lanes:
            distance, _ = tree.query(lane.centre[:, :2], distance_upper_bound=NEAR)
            if np.isfinite(distance).any() and _is_long_enough(lane.centre[:, :2]):
                kept.append(lane)
    borders = [np.concatenate([lane.left, lane.right[::-1]])[:, :2] for lane in kept]
    limits = [lane.speed_limit if np.isfinite(lane.speed_limit) else 100.0 for lane in kept]
    return {
        "lane_start": offsets([len(lane.centre) for lane in kept]),
        "lane_xy": np.concatenate([np.empty((0, 2)), *(lane.centre[:, :2] for lane in kept)]),
        "border_start": offsets([len(border) for border in borders]),
        "border_xy": np.concatenate([np.empty((0, 2)), *borders]),
        "lane_limit": np.array(limits, dtype=np.float64),
    }


def _is_long_enough(centre: FloatArray) -> bool:
    """Whether MetaDrive can make a lane of it: it looks at places 0.1 m from its ends."""
    return float(np.hypot(*np.diff(centre, axis=0).T).sum()) > 0.5
