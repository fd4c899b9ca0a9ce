"""Maps converted once per test session: the shipped ones, real ones if they are here, and texts."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache, cached_property
from pathlib import Path
from typing import TYPE_CHECKING
from xml.etree import ElementTree as ET

import numpy as np
import pytest

from odscen.convert.building.network import build_network
from odscen.convert.lane_table.sumo_network import SumoNetwork
from odscen.lanegraph.build_graphs import build_map_graph
from odscen.lanegraph.graphs import MapGraph
from odscen.opendrive.lanes import RoadTable
from odscen.opendrive.parse import parse
from tests.conftest import shared_map_files

if TYPE_CHECKING:
    from odscen.convert.lane_table.table import SumoPlaces
    from odscen.opendrive.road_model import OpenDrive

FOLDER = Path(__file__).parents[2] / "maps"
SHIPPED = tuple(sorted(FOLDER.glob("*.xodr")))


def _named(path: Path) -> str:
    return path.stem if path in SHIPPED else f"{path.parent.name}/{path.stem}"


def each_map() -> pytest.MarkDecorator:
    """Parametrise ``path`` with all maps."""
    params = [pytest.param(path, id=_named(path)) for path in (*SHIPPED, *shared_map_files())]
    if not shared_map_files():
        skip = pytest.mark.skip(reason="real maps: name their folder in ODSCEN_TEST_MAPS")
        params.append(pytest.param(None, id="real maps", marks=skip))
    return pytest.mark.parametrize("path", params)


def named(name: str) -> Path:
    """File of a map, shipped (``roundabout``) or real (``carla-2020/Town04``)."""
    found = next((p for p in (*SHIPPED, *shared_map_files()) if _named(p) == name), None)
    if found is None:
        pytest.skip("real maps are not here; name their folder in ODSCEN_TEST_MAPS")
    return found


@dataclass(frozen=True)
class Converted:
    odr: OpenDrive
    roads: RoadTable
    graph: MapGraph
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

    @cached_property
    def xml(self) -> ET.Element:
        return ET.fromstring(self.network.net_xml)

    @cached_property
    def shapes(self) -> dict[str, np.ndarray]:
        """Shape ``(K, 3)`` of each lane of the file, OpenDRIVE frame."""
        offset = np.array([*map(float, self.xml.find("location").get("netOffset").split(",")), 0.0])
        return {lane.get("id"): shape(lane) - offset for lane in self.xml.iter("lane")}

    def edges(self, function: str = "normal") -> dict[str, ET.Element]:
        """Edges of the file for vehicles, or else of another function, by id."""
        return {
            edge.get("id"): edge
            for edge in self.xml.iter("edge")
            if edge.get("function", "normal") == function
            and (function != "normal" or edge[0].get("allow") != "pedestrian")
        }

    def links(self) -> list[tuple[str, str]]:
        """Lanes outside junctions from and to which vehicles can drive."""
        edges = self.edges()
        return [
            (f"{link.get('from')}_{link.get('fromLane')}", f"{link.get('to')}_{link.get('toLane')}")
            for link in self.xml.iter("connection")
            if link.get("from") in edges and link.get("to") in edges
        ]

    def along(self, lane: str, pos: np.ndarray) -> np.ndarray:
        """Places, shape ``(N, 3)``, at positions of a lane as SUMO counts them."""
        drawn = self.shapes[lane]
        arc = np.concatenate(([0.0], np.cumsum(np.linalg.norm(np.diff(drawn, axis=0), axis=1))))
        at = np.asarray(pos) * arc[-1] / self.network.table.lanes[lane].length
        return np.column_stack([np.interp(at, arc, drawn[:, axis]) for axis in range(3)])


def shape(element: ET.Element) -> np.ndarray:
    """Shape ``(K, 3)`` of a lane or junction, SUMO frame."""
    points = [[float(v) for v in point.split(",")] for point in element.get("shape").split()]
    return np.array([(*point, 0.0)[:3] for point in points])


@cache
def converted(path: Path) -> Converted:
    """Convert a file; the network is the same every time, so it is done once."""
    return of_model(parse(path.read_bytes(), file=path.name))


def of_model(odr: OpenDrive) -> Converted:
    roads = RoadTable.of(odr)
    graph = build_map_graph(odr, name="map", sha256="0" * 64, table=roads)
    return Converted(odr, roads, graph, build_network(odr, roads, graph.walks))
