"""A map of the stand-in: its OpenDRIVE text, spawn points, traffic lights and signs.

Places are in CARLA's frame: y and yaw have the opposite sign of OpenDRIVE's.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import pi
from pathlib import Path

import numpy as np

from odscen.base.frames import CarlaPose, XodrPose, xodr_to_carla
from odscen.opendrive.lanes import RoadTable
from odscen.opendrive.objects import signal_kind
from odscen.opendrive.parse import parse
from odscen.opendrive.road_model import OpenDrive, Signal
from tests.carla_standin.wire import Pose

_SPAWN_EVERY = 25.0
"""Metres between spawn points of a lane."""
_SPAWN_HEIGHT = 0.5
"""Metres above the road, as CARLA's own spawn points float."""
_SIGNS = {"stop": "traffic.stop", "yield": "traffic.yield"}


@dataclass(frozen=True, slots=True)
class RoadSign:
    """A traffic light, stop or yield sign; ``id`` is the OpenDRIVE signal's."""

    id: str
    type_id: str
    at: Pose


@dataclass(frozen=True, slots=True)
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

    @classmethod
    def read(cls, file: Path, name: str) -> RoadMap:
        """Read an .xodr file."""
        return cls.of(file.read_text(encoding="utf-8"), name)

    @classmethod
    def of(cls, text: str, name: str) -> RoadMap:
        """Map of an OpenDRIVE text."""
        odr = parse(text.encode(), file=name)
        table = RoadTable.of(odr)
        signs = tuple(_signs(odr, table))
        lights = {sign.id for sign in signs if sign.type_id == "traffic.traffic_light"}
        return cls(name, text, tuple(_spawn_points(odr, table)), signs, _groups(odr, lights))


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
