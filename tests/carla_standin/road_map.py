"""A map of the stand-in: its OpenDRIVE text, spawn points, traffic lights and signs.

Places are in CARLA's frame: y and yaw have the opposite sign of OpenDRIVE's.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from math import pi
from pathlib import Path

import numpy as np
from scipy.spatial import cKDTree

from odscen.base.frames import CarlaPose, XodrPose, xodr_to_carla
from odscen.opendrive.lanes import RoadTable
from odscen.opendrive.objects import signal_kind
from odscen.opendrive.parse import parse
from odscen.opendrive.road_model import OpenDrive, Signal
from tests.carla_standin.generated import SIDEWALK_LIFT, Generation, flattened, strips_of
from tests.carla_standin.lane_mesh import LaneMesh
from tests.carla_standin.wire import Pose

_SPAWN_EVERY = 25.0
"""Metres between spawn points of a lane."""
_SPAWN_HEIGHT = 0.5
"""Metres above the road, as CARLA's own spawn points float."""
_GROUND_EVERY = 1.0
"""Metres between points of a lane whose heights are known."""
_GROUND_NEAR = 2.5
"""Metres from such a point at which its height is still that of the ground for what is made."""
_BESIDE = 1.5
"""Metres beside the lanes where the ground of a world made by hand goes on as at their border."""
_GAP = 0.01
"""Metres beside the lanes of a generated world that still carry: joints have no gaps."""
_SIGNS = {"stop": "traffic.stop", "yield": "traffic.yield"}


@dataclass(frozen=True, slots=True)
class RoadSign:
    """A traffic light, stop or yield sign; ``id`` is the OpenDRIVE signal's."""

    id: str
    type_id: str
    at: Pose


@dataclass(frozen=True, eq=False)
class RoadMap:
    """What the server knows of a map.

    ``groups`` are the traffic lights that take turns: one group per junction, in it one set of
    signal ids per controller. A light without a controller is a group of its own.
    """

    name: str
    text: str
    spawn_points: tuple[Pose, ...]
    signs: tuple[RoadSign, ...]
    groups: tuple[tuple[frozenset[str], ...], ...]
    ground: np.ndarray
    """Points of all lanes, shape ``(N, 3)``."""
    walks: np.ndarray
    """Which of them are on sidewalks, shape ``(N,)``."""
    mesh: LaneMesh
    """What bodies stand on."""
    made: Generation | None = None
    """How a generated world was made; ``None`` for one that was made by hand."""

    @cached_property
    def _tree(self) -> cKDTree | None:
        return cKDTree(self.ground[:, :2]) if len(self.ground) else None

    def ground_at(self, x: float, y: float) -> np.ndarray:
        """Heights of the ground below and above a place; several where roads cross, or none."""
        if self.made is not None:
            return self.mesh.around(x, y, _GAP)[1]
        if self._tree is None:
            return np.empty(0)
        near = self._tree.query_ball_point((x, y), _GROUND_NEAR, return_sorted=True)
        heights: np.ndarray = self.ground[near, 2]
        return heights

    def surface(self, x: float, y: float, z: float, kerb: float) -> tuple[float, bool] | None:
        """Height of what is below a place, and whether that is a sidewalk, ``kerb`` metres high.

        Sidewalks stand above the file's surface (pull request 2491 of carla-simulator/carla), from
        their border on; those of a generated world are as high as they were made. Of lanes that
        overlap the uppermost counts.
        """
        away, height, rows = self.mesh.around(x, y, _BESIDE if self.made is None else _GAP)
        walks = self.mesh.walks[rows]
        height = height + np.where(walks, self.kerb(kerb), 0.0)
        fits = height <= z
        if not fits.any():
            return None
        away, height, walks = away[fits], height[fits], walks[fits]
        nearest = away <= away.min() + 1e-9
        best = int(np.flatnonzero(nearest)[np.argmax(height[nearest])])
        return float(height[best]), bool(walks[best])

    def kerb(self, metres: float) -> float:
        """By how much sidewalks are higher than the ground is known here: not if it was made so."""
        return metres if self.made is None else 0.0

    @cached_property
    def _walk_tree(self) -> cKDTree:
        return cKDTree(self.ground[self.walks, :2])

    def walk_height(self, x: float, y: float) -> float:
        """Height of the sidewalk that is nearest to a place; there has to be one on the map."""
        nearest = self._walk_tree.query((x, y))[1]
        return self._height(int(np.flatnonzero(self.walks)[nearest]), x, y)

    def _height(self, best: int, x: float, y: float) -> float:
        """Between a point and the next one of its lane, that way or the other."""
        here = self.ground[best]
        beside = self.ground[[k for k in (best - 1, best + 1) if 0 <= k < len(self.ground)]]
        along = beside - here
        length = np.hypot(along[:, 0], along[:, 1])
        share = (along[:, 0] * (x - here[0]) + along[:, 1] * (y - here[1])) / length**2
        fits = (length < 1.5 * _GROUND_EVERY) & (share >= 0.0)
        rise = along[fits, 2] * np.minimum(share[fits], 1.0)
        return float(here[2] + (rise[0] if len(rise) else 0.0))

    @classmethod
    def read(cls, file: Path, name: str) -> RoadMap:
        """Read an .xodr file."""
        return cls.of(file.read_text(encoding="utf-8"), name)

    @classmethod
    def of(cls, text: str, name: str, made: Generation | None = None) -> RoadMap:
        """Map of an OpenDRIVE text; of a generated world with how it was made."""
        odr = parse(text.encode(), file=name)
        table = RoadTable.of(odr)
        signs = tuple(_signs(odr, table))
        lights = {sign.id for sign in signs if sign.type_id == "traffic.traffic_light"}
        points = tuple(_spawn_points(odr, table))
        groups = _groups(odr, lights)
        if made is None:
            return cls(name, text, points, signs, groups, *_ground(table), LaneMesh.of(table))
        table = flattened(table)
        ground, walks = _ground(table)
        ground[walks, 2] += SIDEWALK_LIFT
        mesh = LaneMesh.join(*strips_of(odr, table, made))
        return cls(name, text, points, signs, groups, ground, walks, mesh, made)


def _ground(table: RoadTable) -> tuple[np.ndarray, np.ndarray]:
    rows, places = [], []
    for row in range(len(table.lane_keys)):
        count = max(1, int((table.lane_s1[row] - table.lane_s0[row]) // _GROUND_EVERY))
        rows += [row] * count
        places += [table.lane_s0[row] + number * _GROUND_EVERY for number in range(count)]
    if not rows:
        return np.empty((0, 3)), np.empty(0, dtype=np.bool_)
    points = table.lane_points(np.array(rows), np.array(places))
    walks = np.array([table.lane_type[row] == "sidewalk" for row in rows])
    return np.column_stack([points.x, -points.y, points.z]), walks


def _signs(odr: OpenDrive, table: RoadTable) -> list[RoadSign]:
    found = []
    for road in odr.roads.values():
        row = np.array([table.road_index[road.id]])
        for signal in road.signals:
            kind = signal_kind(signal)
            type_id = "traffic.traffic_light" if kind == "traffic_light" else _SIGNS.get(kind)
            if type_id is not None:
                found.append(RoadSign(signal.id, type_id, _place(table, row, signal)))
    return found


def _place(table: RoadTable, row: np.ndarray, signal: Signal) -> Pose:
    """Pose of a signal: it looks along its road, or the other way with orientation ``-``."""
    s = np.array([signal.s])
    x, y, z = table.points(row, s, np.array([signal.t]), signal.z_offset)
    hdg = table.reference(row, s).hdg + signal.h_offset + (pi if signal.orientation == "-" else 0.0)
    return _pose(xodr_to_carla(XodrPose(x[0], y[0], z[0], hdg[0])))


def _spawn_points(odr: OpenDrive, table: RoadTable) -> list[Pose]:
    lanes, places = [], []
    for row, key in enumerate(table.lane_keys):
        if table.lane_type[row] == "driving" and odr.roads[key.road].junction is None:
            start, end = table.lane_s0[row], table.lane_s1[row]
            count = int((end - start) // _SPAWN_EVERY)
            places += [start + (number + 0.5) * _SPAWN_EVERY for number in range(count)]
            lanes += [row] * count
    if not lanes:
        return []
    rows = np.array(lanes)
    points = table.lane_points(rows, np.array(places))
    forward = table.lane_forward[rows]
    poses = xodr_to_carla(
        XodrPose(
            points.x,
            points.y,
            points.z + _SPAWN_HEIGHT,
            points.hdg + np.where(forward, 0.0, pi),
            np.where(forward, points.pitch, -points.pitch),
        )
    )
    return [
        _pose(CarlaPose(*values))
        for values in np.column_stack([np.asarray(part) for part in poses]).tolist()
    ]


def _pose(at: CarlaPose) -> Pose:
    yaw = (float(at.yaw_deg) + 180.0) % 360.0 - 180.0
    return (float(at.x), float(at.y), float(at.z), float(at.pitch_deg), yaw, 0.0)


def _groups(odr: OpenDrive, lights: set[str]) -> tuple[tuple[frozenset[str], ...], ...]:
    groups: list[tuple[frozenset[str], ...]] = []
    free = set(lights)
    for junction in odr.junctions.values():
        turns = []
        for name in junction.controllers:
            controller = odr.controllers.get(name)
            signals = {signal for signal, _ in controller.controls} & free if controller else set()
            if signals:
                turns.append(frozenset(signals))
                free -= signals
        if turns:
            groups.append(tuple(turns))
    return (*groups, *((frozenset([light]),) for light in sorted(free)))
