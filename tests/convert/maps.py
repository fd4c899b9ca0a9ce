"""Maps converted once per test session, and nodes to try the lane table on."""

from __future__ import annotations

import tempfile
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from odscen.convert.net import Net
from odscen.convert.network import SumoNetwork, build_network
from odscen.opendrive.lanes import RoadTable
from odscen.opendrive.parse import parse

if TYPE_CHECKING:
    from odscen.convert.lane_table import SumoPlaces
    from odscen.opendrive.model import OpenDrive


@dataclass(frozen=True)
class Converted:
    odr: OpenDrive
    roads: RoadTable
    network: SumoNetwork

    def nodes(
        self, types: frozenset[str], *, inside: bool = False, spacing: float = 2.0
    ) -> tuple[np.ndarray, np.ndarray]:
        """Lane rows and s, about every ``spacing`` metres along lanes of the given types."""
        roads = self.roads
        rows = [
            row
            for row, key in enumerate(roads.lane_keys)
            if roads.lane_type[row] in types
            and (self.odr.roads[key.road].junction is not None) == inside
        ]
        low, high = roads.lane_s0[rows], roads.lane_s1[rows]
        counts = np.maximum(1, np.round((high - low) / spacing)).astype(int)
        lane = np.repeat(rows, counts)
        within = np.concatenate([(np.arange(n) + 0.5) / n for n in counts] or [np.zeros(0)])
        return lane.astype(int), np.repeat(low, counts) + within * np.repeat(high - low, counts)

    def places(self, lane: np.ndarray, s: np.ndarray) -> SumoPlaces:
        return self.network.table.sumo_places(self.roads.lane_keys, lane, s)

    def net(self) -> Net:
        return Net.parse(self.network.net_xml)


@cache
def converted(path: Path) -> Converted:
    """Convert a file; the network is the same every time, so it is done once."""
    odr = parse(path.read_bytes(), file=path.name)
    roads = RoadTable.of(odr)
    with tempfile.TemporaryDirectory() as folder:
        return Converted(odr, roads, build_network(odr, roads, path, Path(folder)))


def converted_text(text: str, folder: Path) -> Converted:
    path = folder / "map.xodr"
    path.write_text(text, encoding="utf-8")
    odr = parse(text, file=path.name)
    roads = RoadTable.of(odr)
    return Converted(odr, roads, build_network(odr, roads, path, folder))
