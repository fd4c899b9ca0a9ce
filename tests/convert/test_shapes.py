"""SUMO's lanes after rewriting: on the OpenDRIVE lanes, junctions included."""

from pathlib import Path

import numpy as np
import pytest

from odscen.convert.lane_table import LaneTable
from odscen.convert.net import Net
from odscen.convert.network import SumoNetwork, build_network
from odscen.lanegraph.build import build_map_graph
from odscen.lanegraph.model import LaneGraph
from odscen.opendrive.lanes import RoadTable
from odscen.opendrive.parse import parse

SHIPPED = Path(__file__).parents[2] / "maps"
EXACT = ("signal_crossing", "roundabout", "t_junction_signs", "left_hand_crossing", "town_5x5")


def converted(path: Path, folder: Path) -> tuple[LaneGraph, SumoNetwork]:
    odr = parse(path.read_bytes(), file=path.name)
    table = RoadTable.of(odr)
    graph = build_map_graph(odr, name="t", sha256="0" * 64, table=table)
    return graph.lanes, build_network(odr, table, path, folder)


def deviations(graph: LaneGraph, table: LaneTable) -> tuple[np.ndarray, np.ndarray]:
    """Metres between each node and SUMO's lane, outside junctions and inside; NaN for none."""
    found = table.sumo_places(graph.lanes.keys, graph.lane, graph.s).deviation
    inside = np.array([junction is not None for junction in graph.lanes.junctions])[graph.lane]
    return found[~inside], found[inside]


@pytest.mark.parametrize("name", EXACT)
def test_every_node_of_a_shipped_map_lies_on_a_sumo_lane(name: str, tmp_path: Path) -> None:
    graph, network = converted(SHIPPED / f"{name}.xodr", tmp_path)
    for found in deviations(graph, network.table):
        assert np.isfinite(found).mean() > 0.995
        assert np.nanpercentile(found, 99) < 0.02
        assert np.nanmax(found) < 0.05


@pytest.mark.parametrize("name", ["carla-2020/Town01", "carla-2020/Town04", "esmini/fabriksgatan"])
def test_lanes_of_real_maps_are_exact_in_junctions_too(
    name: str, shared_maps: Path, tmp_path: Path
) -> None:
    graph, network = converted(shared_maps / f"{name}.xodr", tmp_path)
    for found in deviations(graph, network.table):
        assert np.isfinite(found).mean() > 0.995
        assert np.nanpercentile(found, 99) < 0.05


def test_lanes_that_follow_each_other_meet(tmp_path: Path) -> None:
    _, network = converted(SHIPPED / "signal_crossing.xodr", tmp_path)
    net = Net.parse(network.net_xml)
    gaps = [
        float(np.linalg.norm(net.lanes[one].shape[-1, :2] - net.lanes[two].shape[0, :2]))
        for connection in net.connections
        if (one := connection.from_lane)
        and (two := connection.via or connection.to_lane)
        and net.edges[net.lanes[one].edge].function in ("normal", "internal")
        and net.edges[net.lanes[two].edge].function in ("normal", "internal")
    ]
    assert len(gaps) > 30
    assert max(gaps) < 0.02
