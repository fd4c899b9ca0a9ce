"""Points of the roads of a map that the lane graph does not have."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from odscen.base.ids import RoadId
from odscen.opendrive.lanes import RoadTable
from odscen.opendrive.parse import parse

if TYPE_CHECKING:
    from odscen.maps.map_entry import MapEntry


class RoadPoints:
    """Points of the roads of a map, which is read when the first one is asked for."""

    def __init__(self, entry: MapEntry) -> None:
        self._entry = entry
        self._loaded: RoadTable | None = None

    def _table(self) -> RoadTable:
        if self._loaded is None:
            self._loaded = RoadTable.of(parse(self._entry.read("xodr")))
        return self._loaded

    def point(self, road: str, s: float, t: float) -> tuple[float, float, float] | None:
        """X, y and heading with growing s, at s and t of a road; ``None`` if there is none."""
        table = self._table()
        row = table.road_index.get(RoadId(road))
        if row is None:
            return None
        found = table.plan.at(np.array([row]), np.array([s]))
        x, y, hdg = float(found.x[0]), float(found.y[0]), float(found.hdg[0])
        return x - t * float(np.sin(hdg)), y + t * float(np.cos(hdg)), hdg

    def lane_t(self, road: str, lane: int, s: float) -> float | None:
        """T of the middle of a lane of any type at s; ``None`` if there is none."""
        table = self._table()
        row = table.road_index.get(RoadId(road))
        if row is None:
            return None
        if lane == 0:
            return float(table.lane_offset(np.array([row]), np.array([s]))[0])
        for one in table.lanes_at(row, s):
            if table.lane_id[one] == lane:
                inner, outer = table.lane_borders(np.array([one]), np.array([s]))
                return float(inner[0] + outer[0]) / 2.0
        return None
