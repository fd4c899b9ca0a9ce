"""One network that roadgen writes as OpenDRIVE, Lanelet2, OpenStreetMap and for SUMO."""

from __future__ import annotations

import math
import subprocess
from typing import TYPE_CHECKING

import numpy as np
import pytest
import sumo
from scipy.spatial import cKDTree

from odscen.app.exchange.imports import import_file
from odscen.maps.store import Workspace
from odscen.opendrive.lanes import RoadTable
from odscen.opendrive.parse import parse

if TYPE_CHECKING:
    from pathlib import Path

    from odscen.base.arrays import FloatArray
    from odscen.opendrive.road_model import OpenDrive

roadgen = pytest.importorskip("roadgen", reason="the package roadgen is not installed")


@pytest.fixture(scope="module")
def written(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A crossing of four roads of two lanes each way, one of them with an arc of 50 m radius."""
    folder = tmp_path_factory.mktemp("roadgen")
    network = roadgen.Map(name="cross", origin=(49.0, 8.4, 0.0))
    lanes = [
        roadgen.Lane(width=3.5, direction=direction)
        for direction in ("backward", "backward", "forward", "forward")
    ]
    bent = roadgen.Alignment((20.0, 0.0, 0.0), 0.0)
    bent.line(40.0)
    bent.arc(60.0, 0.02, 1.0)
    bent.line(30.0)
    arms = [network.add_road(lanes=lanes, alignment=bent, name="bent", speed_limit_kph=50)]
    for k in (1, 2, 3):
        x, y = round(math.cos(k * math.pi / 2)), round(math.sin(k * math.pi / 2))
        ends = {"start": (20.0 * x, 20.0 * y, 0.0), "end": (120.0 * x, 120.0 * y, 2.0 * k)}
        arms.append(network.add_road(lanes=lanes, name=f"arm{k}", speed_limit_kph=50, **ends))
    junction = network.add_junction("J")
    for k, arm in enumerate(arms):
        for other in arms[k + 1 :]:
            network.connect(arm, other, junction=junction, ends=("start", "start"))
    network.export_opendrive(str(folder / "cross.xodr"))
    network.export_lanelet2(str(folder / "lanelets.osm"))
    network.export_osm(str(folder / "streets.osm"))
    network.export_sumo(str(folder))
    subprocess.run(
        [f"{sumo.SUMO_HOME}/bin/netconvert", "-c", "cross.netccfg"],
        cwd=folder,
        check=True,
        capture_output=True,
    )
    return folder


def read_map(workspace: Workspace, name: str) -> OpenDrive:
    return parse(workspace.map(name).path("xodr").read_bytes(), file=name)


def place_borders(odr: OpenDrive, *, inside: bool) -> FloatArray:
    """Places every 2 cm on both borders of all driving lanes, (n, 2), m."""
    table, found = RoadTable.of(odr), []
    for row, key in enumerate(table.lane_keys):
        if (
            table.lane_type[row] != "driving"
            or (odr.roads[key.road].junction is not None) != inside
        ):
            continue
        begin, end = table.lane_s0[row], table.lane_s1[row]
        s = np.linspace(begin, end, max(2, int((end - begin) / 0.02)))
        for at in (0.0, 1.0):
            points = table.lane_points(np.full(len(s), row), s, at=at)
            found.append(np.column_stack([points.x, points.y]))
    return np.vstack(found)


def farthest(one: FloatArray, other: FloatArray) -> float:
    """99th percentile of the distance from either to the other, m."""
    return max(
        float(np.quantile(cKDTree(a).query(b)[0], 0.99)) for a, b in ((one, other), (other, one))
    )


def test_lanelets_have_the_borders_of_the_opendrive(written: Path, tmp_path: Path) -> None:
    workspace = Workspace.open(tmp_path)
    workspace.add_map(written / "cross.xodr")
    workspace.add_map(written / "lanelets.osm")
    given, lanelets = read_map(workspace, "cross"), read_map(workspace, "lanelets")
    for inside in (False, True):
        borders = (place_borders(odr, inside=inside) for odr in (given, lanelets))
        assert farthest(*borders) < 0.022  # 2 cm, and half a step between places
    assert len(lanelets.junctions) == 1
    assert workspace.map("lanelets").info["fidelity"]["passed"]


def test_the_sumo_network_has_them_outside_the_junction(written: Path, tmp_path: Path) -> None:
    workspace = Workspace.open(tmp_path)
    workspace.add_map(written / "cross.xodr", name="given")
    import_file(workspace, written / "cross.net.xml")
    borders = (
        place_borders(read_map(workspace, name), inside=False) for name in ("given", "cross")
    )
    assert farthest(*borders) < 0.022


def test_streets_have_its_lanes_limits_and_turns(written: Path, tmp_path: Path) -> None:
    workspace = Workspace.open(tmp_path)
    workspace.add_map(written / "cross.xodr")
    workspace.add_map(written / "streets.osm")
    given, streets = read_map(workspace, "cross"), read_map(workspace, "streets")
    assert len(streets.junctions) == 1
    outside = [road for road in streets.roads.values() if road.junction is None]
    assert len(outside) == 4
    for road in outside:
        lanes = road.sections[0].lanes.values()
        assert sum(lane.type == "driving" for lane in lanes) == 4
    table = RoadTable.of(streets)
    driving = [row for row, kind in enumerate(table.lane_type) if kind == "driving"]
    limits = table.speed_limit(np.array(driving), np.zeros(len(driving)))
    assert limits.max() == pytest.approx(50 / 3.6)

    def pairs(odr: OpenDrive) -> set[tuple[str, str]]:
        """Names of the roads that turns lead from and to."""
        return {
            tuple(
                odr.roads[link.element_id].name
                for link in (road.predecessor, road.successor)
            )
            for road in odr.roads.values()
            if road.junction is not None
        }  # fmt: skip

    def both_ways(found: set[tuple[str, str]]) -> set[frozenset[str]]:
        return {frozenset(pair) for pair in found}

    assert both_ways(pairs(streets)) == both_ways(pairs(given))
