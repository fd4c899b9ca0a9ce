"""Figures of a map, and what its signs and crossings say and where (requirements R9, R18)."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from odscen.base.arrays import Bounds, ranges
from odscen.opendrive.objects import crosswalks, signal_kind, stop_lines
from odscen.opendrive.road_model import DRIVABLE_TYPES

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from odscen.base.arrays import Bounds
    from odscen.lanegraph.graphs import MapGraph
    from odscen.opendrive.lanes import RoadTable
    from odscen.opendrive.road_model import OpenDrive


_MOST_POINTS = 1_000_000
"""Points that lanes are measured at; every metre, but for maps of whole countries."""


@dataclass(frozen=True, slots=True)
class MapStatistics:
    """Figures of a map; metres and m/s.

    Attributes
    ----------
    bounds
        ``min_x, min_y, max_x, max_y`` of the drivable lanes in the OpenDRIVE frame.
    road_length
        Of all reference lines.
    connecting_road_length
        The part of it that lies in junctions, where roads run across each other.
    driving_lane_length
        Of the centre lines of all drivable lanes, junctions included.
    traffic_lights, pedestrian_lights, stop_signs, yield_signs
        Signals of that kind, each counted once however often it is referred to.
    speed_limit_min, speed_limit_max
        Smallest and largest limit that holds on a drivable lane; ``None`` if the map has none.
    rule
        ``RHT``, ``LHT`` or ``mixed``.
    """

    bounds: Bounds
    road_length: float
    connecting_road_length: float
    driving_lane_length: float
    roads: int
    junctions: int
    crosswalks: int
    traffic_lights: int
    pedestrian_lights: int
    stop_signs: int
    yield_signs: int
    stop_lines: int
    speed_limit_min: float | None
    speed_limit_max: float | None
    rule: str

    def to_dict(self) -> dict[str, Any]:
        """For ``map.json``; lengths to the millimetre."""
        values = asdict(self)
        rounded = {
            key: round(value, 3) if isinstance(value, float) else value
            for key, value in values.items()
        }
        return {**rounded, "bounds": [round(value, 3) for value in self.bounds]}


def map_statistics(
    odr: OpenDrive, table: RoadTable, graph: MapGraph | None = None
) -> MapStatistics:
    """Figures of a map.

    Parameters
    ----------
    odr, table
        The road model and its evaluation.
    graph
        If given, its lane lengths are used and not measured again.
    """
    drivable = np.flatnonzero([kind in DRIVABLE_TYPES for kind in table.lane_type])
    length, bounds = _measure_lanes(table, drivable)
    if graph is not None:
        length = float(graph.lanes.lanes.lengths.sum())
    signals = [signal for road in odr.roads.values() for signal in road.signals]
    kinds = [signal_kind(signal) for signal in signals]
    limits = speed_limits(odr)
    return MapStatistics(
        bounds=bounds,
        road_length=sum(road.length for road in odr.roads.values()),
        connecting_road_length=sum(
            road.length for road in odr.roads.values() if road.junction is not None
        ),
        driving_lane_length=length,
        roads=len(odr.roads),
        junctions=len(odr.junctions),
        crosswalks=len(crosswalks(odr, table)),
        traffic_lights=kinds.count("traffic_light"),
        pedestrian_lights=kinds.count("pedestrian_light"),
        stop_signs=kinds.count("stop"),
        yield_signs=kinds.count("yield"),
        stop_lines=len(stop_lines(odr, table)),
        speed_limit_min=min(limits, default=None),
        speed_limit_max=max(limits, default=None),
        rule=odr.rule,
    )


def _measure_lanes(table: RoadTable, rows: NDArray[np.int64]) -> tuple[float, Bounds]:
    """Length of the centre lines and bounds of the borders, sampled about every metre."""
    if len(rows) == 0:
        return 0.0, (0.0, 0.0, 0.0, 0.0)
    s0, s1 = table.lane_s0[rows], table.lane_s1[rows]
    step = max(1.0, float(np.sum(s1 - s0)) / _MOST_POINTS)
    n = np.maximum(np.ceil((s1 - s0) / step), 1.0).astype(np.int64) + 1
    lane = np.repeat(np.arange(len(rows)), n)
    share = ranges(np.zeros(len(n), dtype=np.int64), n) / (n - 1)[lane]
    s = np.minimum(s0[lane] * (1.0 - share) + s1[lane] * share, s1[lane] - 1e-6)
    centre = table.lane_points(rows[lane], s)
    steps = np.sqrt(np.diff(centre.x) ** 2 + np.diff(centre.y) ** 2 + np.diff(centre.z) ** 2)
    length = float(steps[np.diff(lane) == 0].sum())
    edges = [table.lane_points(rows[lane], s, at=at) for at in (0.0, 1.0)]
    x = np.concatenate([edge.x for edge in edges])
    y = np.concatenate([edge.y for edge in edges])
    return length, (float(x.min()), float(y.min()), float(x.max()), float(y.max()))


def speed_limits(odr: OpenDrive) -> list[float]:
    """All finite limits that hold on drivable lanes, m/s; a lane's own limit beats its road's."""
    found: set[float] = set()
    for road in odr.roads.values():
        for section in road.sections:
            for lane in section.lanes.values():
                if lane.type not in DRIVABLE_TYPES or lane.id == 0:
                    continue
                limits = [speed.max for speed in lane.speeds] or [
                    kind.speed for kind in road.types if kind.speed is not None
                ]
                found.update(limit for limit in limits if 0.0 < limit < np.inf)
    return sorted(found)


def map_semantics(odr: OpenDrive, table: RoadTable) -> dict[str, list[dict[str, Any]]]:
    """Every crosswalk, stop line, light and sign with its place, for ``map.json``.

    Positions in the OpenDRIVE frame, metres; ``value`` of speed limits in m/s.
    """
    return {
        "crosswalks": [
            {
                "id": f"{walk.road}:{walk.object_id}",
                "road": walk.road,
                "polygon": _round_points(walk.polygon),
                "from": _round_points(walk.axis)[0],
                "to": _round_points(walk.axis)[1],
                "width": round(float(walk.width), 3),
            }
            for walk in crosswalks(odr, table)
        ],
        "stop_lines": [
            {
                "id": f"{line.road}:{line.object_id}",
                "road": line.road,
                "ends": _round_points(line.ends),
            }
            for line in stop_lines(odr, table)
        ],
        "signals": _list_signals(odr, table),
    }


def _list_signals(odr: OpenDrive, table: RoadTable) -> list[dict[str, Any]]:
    signals = [(name, signal) for name, road in odr.roads.items() for signal in road.signals]
    known = [(name, signal, signal_kind(signal)) for name, signal in signals]
    known = [item for item in known if item[2] != "other"]
    if not known:
        return []
    road = np.array([table.road_index[name] for name, _, _ in known], dtype=np.int64)
    s, t = np.array([(signal.s, signal.t) for _, signal, _ in known]).T
    x, y, z = table.points(road, s, t)
    return [
        {
            "kind": kind,
            "id": signal.id,
            "road": name,
            "s": round(signal.s, 3),
            "t": round(signal.t, 3),
            "x": round(float(x[k]), 3),
            "y": round(float(y[k]), 3),
            "z": round(float(z[k]) + signal.z_offset, 3),
            "orientation": signal.orientation,
            "lanes": [[part.from_lane, part.to_lane] for part in signal.validities],
            "value": signal.value if kind == "speed_limit" else None,
        }
        for k, (name, signal, kind) in enumerate(known)
    ]


def _round_points(points: NDArray[np.float64]) -> list[list[float]]:
    rows: list[list[float]] = np.round(np.asarray(points, dtype=np.float64), 3).tolist()
    return rows
