"""SUMO's lanes after rewriting: on the OpenDRIVE lanes, junctions included."""

import subprocess
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from odscen.convert.lane_table import LaneTable
from odscen.convert.net import Net
from odscen.convert.netconvert import netconvert_path
from odscen.convert.network import SumoNetwork, build_network
from odscen.convert.shapes import CHORD_ERROR, _thinned
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


@pytest.mark.parametrize("name", ["rural_hills", "left_hand_crossing"])
def test_lengths_are_those_of_the_shapes_in_space(name: str, tmp_path: Path) -> None:
    _, network = converted(SHIPPED / f"{name}.xodr", tmp_path)
    net = Net.parse(network.net_xml)
    checked = 0
    for edge in net.edges.values():
        lengths = {net.lanes[lane].length for lane in edge.lanes}
        drawn = [
            np.sqrt((np.diff(net.lanes[lane].shape, axis=0) ** 2).sum(axis=1)).sum()
            for lane in edge.lanes
        ]
        if edge.function == "normal" and np.mean(drawn) > 0.1:
            assert len(lengths) == 1
            assert lengths.pop() == pytest.approx(np.mean(drawn), abs=0.01)
            checked += 1
    assert checked >= 6


def test_sumo_loads_the_network_without_a_word(tmp_path: Path) -> None:
    _, network = converted(SHIPPED / "rural_hills.xodr", tmp_path)
    path = tmp_path / "net.net.xml"
    path.write_bytes(network.net_xml)
    command = [str(netconvert_path().with_name("sumo")), "-n", str(path), "--end", "1"]
    command += ["--no-step-log", "--duration-log.disable", "--xml-validation", "never"]
    run = subprocess.run(command, capture_output=True, text=True, check=True, timeout=60)
    assert "Warning" not in run.stderr + run.stdout
    assert "Error" not in run.stderr + run.stdout


@given(
    turn=st.floats(-1.5, 1.5),
    radius=st.floats(4.0, 400.0),
    climb=st.floats(-0.1, 0.1),
    count=st.integers(3, 400),
)
def test_thinning_stays_within_its_tolerance_of_a_helix(
    turn: float, radius: float, climb: float, count: int
) -> None:
    angle = np.linspace(0.0, turn, count)
    curve = radius * np.column_stack((np.sin(angle), 1.0 - np.cos(angle), climb * np.abs(angle)))
    (thin,) = _thinned([curve])
    assert np.array_equal(thin[[0, -1]], curve[[0, -1]])
    for point in curve:
        start, chord = thin[:-1], np.diff(thin, axis=0)
        square = np.maximum((chord**2).sum(axis=1), 1e-12)
        share = np.clip(((point - start) * chord).sum(axis=1) / square, 0.0, 1.0)
        distance = np.linalg.norm(point - start - share[:, None] * chord, axis=1)
        assert distance.min() <= CHORD_ERROR + 1e-9
