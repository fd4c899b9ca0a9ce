"""``odscen maps add`` of a whole town, everything included, against netconvert alone.

The peer only makes the SUMO network; we also make the lane graph, the lane table, GraphML,
statistics and the drawing. Aim: carla-2019/Town04 within 3 s.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
from pathlib import Path

import sumo

from bench.common import paired, shared_maps


def main() -> None:
    maps = shared_maps()
    if maps is None:
        print("skipped: no real maps here (set ODSCEN_TEST_MAPS)")
        return
    town = maps / "carla-2019" / "Town04.xodr"
    with tempfile.TemporaryDirectory() as folder:
        ours, peer, ratio = paired(
            lambda: _add(town, tempfile.mkdtemp(dir=folder)),
            lambda: _netconvert(town, Path(folder) / "net.net.xml"),
            repeats=5,
        )
    print(f"maps add {town.name} {ours:.2f} s, netconvert alone {peer:.2f} s, ratio {ratio:.1f}")


def _add(town: Path, workspace: str) -> None:
    command = [sys.executable, "-m", "odscen", "maps", "add", str(town), "--workspace", workspace]
    subprocess.run(command, check=True, capture_output=True)


def _netconvert(town: Path, net: Path) -> None:
    command = [
        str(Path(sumo.SUMO_HOME) / "bin" / "netconvert"),
        "--opendrive-files",
        str(town),
        "-o",
        str(net),
    ]
    subprocess.run(command, check=True, capture_output=True)
