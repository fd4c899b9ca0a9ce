"""OpenSCENARIO files of others imported, exported and imported again: what acts otherwise then.

``python -m bench osc_round_trip --folder FOLDER --maps MAPS`` takes each file that imports with
nothing refused, by default of those in ``shared/osc`` beside the project. Differences in names, in
the order of lists and in declarations of parameters, whose values are put in, do not count.
"""

from __future__ import annotations

import argparse
import math
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING

from bench.osc_import import SHARED, is_scenario
from odscen.app.exchange.exports import export
from odscen.app.exchange.imports import import_file
from odscen.base.errors import OdscenError
from odscen.changes.acting_differences import acting_differences
from odscen.lanegraph.query import is_walk_node_id, node_index
from odscen.maps.store import Workspace

if TYPE_CHECKING:
    from odscen.app.exchange.imports import ImportedFile
    from odscen.lanegraph.graphs import MapGraph
    from odscen.scenario.document.scenario_document import Scenario

_NAMES = frozenset({"parameters", "description"})
"""Parts of a document that do not act."""


def main() -> None:
    """Print each file that comes back otherwise, and totals."""
    parser = argparse.ArgumentParser(prog="bench osc_round_trip", description=__doc__)
    parser.add_argument("--folder", type=Path, default=SHARED / "osc")
    parser.add_argument("--maps", type=Path, default=SHARED / "maps" / "carla-2019")
    parser.add_argument("--version", default="1.2")
    given = parser.parse_args()
    files = sorted(one for one in given.folder.rglob("*.xosc") if is_scenario(one))
    whole = same = 0
    with tempfile.TemporaryDirectory(prefix="odscen-bench-") as scratch:
        workspace = Workspace.open(Path(scratch) / "workspace")
        for row, file in enumerate(files):
            read = _wholly_taken(workspace, file, given.maps)
            if read is None:
                continue
            found = _differences(workspace, read, Path(scratch) / str(row), given.version)
            whole, same = whole + 1, same + (not found)
            for words in found:
                print(f"{file.name}: {words[:160]}", flush=True)
    print(
        f"{len(files)} files, {whole} with nothing refused: {same} say the same when they are "
        f"written in {given.version} and read again"
    )


def _wholly_taken(workspace: Workspace, file: Path, maps: Path) -> ImportedFile | None:
    try:
        read = import_file(workspace, file, maps=maps if maps.is_dir() else None)
    except OdscenError:
        return None
    return None if read.lists["refused"] else read


def _differences(workspace: Workspace, read: ImportedFile, out: Path, version: str) -> list[str]:
    files = export(workspace, read.scenario, out, to="openscenario", options={"version": version})
    (file,) = (one for one in files if one.suffix == ".xosc")
    after = import_file(workspace, file).scenario
    graph = workspace.map(read.scenario.map.name).graph()
    found = acting_differences(read.scenario, after, placed=placed(graph, read.scenario))
    return [one.words for one in found if one.place[0] not in _NAMES]


def placed(graph: MapGraph, scenario: Scenario) -> dict[str, list[float]]:
    """Where the centres of actors on lanes are placed: x and y (m) and heading (rad)."""
    lanes, found = graph.lanes, {}
    for actor in scenario.actors:
        if is_walk_node_id(actor.spawn):
            continue
        node = node_index(graph, actor.spawn)
        hdg, left = float(lanes.hdg[node]), actor.lateral_offset
        x, y = lanes.x[node] - left * math.sin(hdg), lanes.y[node] + left * math.cos(hdg)
        found[actor.id] = [float(x), float(y), hdg]
    return found
