"""Everything that later steps need of a map, made once from its .xodr (requirement R7)."""

from __future__ import annotations

import hashlib
import json
import time
from typing import TYPE_CHECKING, Any

import numpy as np

from odscen.base.work_beside import work_beside
from odscen.convert.lane_table.table_json import table_to_json
from odscen.convert.model.conversion_report import ConversionReport
from odscen.convert.verify.fidelity import verify
from odscen.drawing.map_shapes import map_drawing
from odscen.drawing.map_sheet import render_drawing
from odscen.lanegraph.build_graphs import build_map_graph
from odscen.lanegraph.graph_files import to_graphml, to_npz_bytes
from odscen.lanegraph.graphs import MapGraph, Relation
from odscen.lanegraph.map_statistics import map_semantics, map_statistics
from odscen.maps.converters import MapInput, converted
from odscen.opendrive.lanes import RoadTable
from odscen.opendrive.parse import parse

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from odscen.convert.lane_table.table import SumoLight
    from odscen.convert.model.conversion_settings import ConversionSettings
    from odscen.convert.verify.fidelity_result import Fidelity
    from odscen.lanegraph.map_statistics import MapStatistics
    from odscen.maps.converters import GivenNetwork
    from odscen.maps.importers.base import ImportRecord
    from odscen.opendrive.parse import ReadRoads
    from odscen.opendrive.road_model import OpenDrive


FORMAT = "odscen-map"

FILES = {
    "xodr": "map.xodr",
    "info": "map.json",
    "graph": "graph.graphml",
    "graph_npz": "graph.npz",
    "net": "net.net.xml",
    "lane_table": "lane_table.json",
    "drawing": "drawing.json",
    "preview": "preview.svg",
}
"""Name of each file in a map's folder."""


def build_map(
    folder: Path,
    *,
    name: str,
    file: str,
    sha256: str,
    settings: ConversionSettings,
    builder: str,
    given: GivenNetwork | None,
    imported: ImportRecord | None,
    most_lanes: float,
    progress: Callable[[str, float], None],
    known: ReadRoads | None = None,
) -> None:
    """Fill ``folder`` with all of :data:`FILES`.

    Parameters
    ----------
    folder
        Holds the .xodr; ``file`` is its name for messages and ``sha256`` its hash.
    settings
        How it is converted; with a converter.
    builder
        Version of the folder's content.
    given
        A network that was brought in for the map.
    imported
        How the .xodr was made from a file of another format, which is in the folder, too.
    most_lanes
        Metres that all drivable lanes, or all walks, may have together.
    progress
        Called with what comes next and the share done.
    known
        Roads of the file that have been read already.

    Raises
    ------
    OpenDriveError
        If the map cannot be read.
    InputError
        If the given network cannot be read or is none of this map.
    ToolError
        If netconvert cannot convert the map.
    """
    start = time.perf_counter()
    progress("reading the map", 0.0)
    content = (folder / FILES["xodr"]).read_bytes()
    odr = parse(content, file=file, known=known)
    table = RoadTable.of(odr)
    progress("building the lane graph", 0.1)
    graph = build_map_graph(
        odr,
        name=name,
        sha256=sha256,
        spacing=settings.spacing,
        table=table,
        most_lanes=most_lanes,
    )
    statistics = map_statistics(odr, table, graph)
    progress("making the SUMO network", 0.3)
    with work_beside(lambda: _write_pictures(folder, name, odr, table, graph, statistics)):
        network = converted(settings.converter, MapInput(content, odr, table, graph.walks, given))
        progress("comparing the SUMO network with the map", 0.7)
        fidelity = verify(network.net_xml, odr, table, offset=network.table.net_offset)
    (folder / FILES["net"]).write_bytes(network.net_xml)
    (folder / FILES["lane_table"]).write_text(table_to_json(network.table), encoding="utf-8")
    header, report = odr.header, network.report
    if imported is not None:
        report = ConversionReport.of((*imported.entries, *report.entries), report.figures)
    info: dict[str, Any] = {
        "format": FORMAT,
        "builder": builder,
        "name": name,
        "source": file,
        "sha256": sha256,
        "spacing": settings.spacing,
        "opendrive": {"version": f"{header.rev_major}.{header.rev_minor}", "rule": odr.rule},
        "statistics": statistics.to_dict(),
        "graph": graph_counts(graph),
        "network": {
            "converter": settings.converter,
            "source": given.source if given else None,
            "sha256": hashlib.sha256(network.net_xml).hexdigest(),
        },
        "sumo": {"net_file": FILES["net"], **network.table.counts},
        "lights": [_describe_light(light) for light in network.table.lights],
        "files": FILES if imported is None else {**FILES, "original": imported.original},
        "semantics": map_semantics(odr, table),
        "report": report.to_dict(),
        "fidelity": _measure_fidelity(fidelity),
        **({} if imported is None else {"import": imported.to_dict()}),
        "build_seconds": round(time.perf_counter() - start, 3),
    }
    text = json.dumps(info, indent=1, ensure_ascii=False, allow_nan=False)
    (folder / FILES["info"]).write_text(text + "\n", encoding="utf-8")
    progress("done", 1.0)


def _write_pictures(
    folder: Path,
    name: str,
    odr: OpenDrive,
    table: RoadTable,
    graph: MapGraph,
    statistics: MapStatistics,
) -> None:
    """Write the graph and the drawings of a map."""
    (folder / FILES["graph_npz"]).write_bytes(to_npz_bytes(graph))
    (folder / FILES["graph"]).write_bytes(to_graphml(graph))
    drawing = map_drawing(odr, table, name=name)
    (folder / FILES["drawing"]).write_text(drawing.to_json(), encoding="utf-8")
    preview = render_drawing(drawing, statistics=statistics)
    (folder / FILES["preview"]).write_text(preview, encoding="utf-8")


def _measure_fidelity(fidelity: Fidelity) -> dict[str, Any]:
    """Whether the SUMO network follows the map, and the limits that are not held."""
    missed = [
        {"name": verdict.name, "value": float(verdict.value), "limit": float(verdict.limit)}
        for verdict in fidelity.verdicts
        if not verdict.ok
    ]
    return {"passed": not missed, "not_held": missed}


def _describe_light(light: SumoLight) -> dict[str, Any]:
    """A traffic light, as scenarios name and time it."""
    return {
        "id": light.id,
        "junctions": list(light.junctions),
        "signals": sorted({signal for signals in light.signals for signal in signals}),
        "green": [phase.duration for phase in light.phases if phase.is_stage],
        "cycle": sum(phase.duration for phase in light.phases),
    }


def graph_counts(graph: MapGraph) -> dict[str, Any]:
    """Sizes of the graphs of a map, as ``maps show`` gives them."""
    relations = np.bincount(graph.lanes.relation, minlength=3)
    return {
        "spacing": graph.lanes.spacing,
        "nodes": len(graph.lanes.s),
        "successor_edges": int(relations[Relation.SUCCESSOR]),
        "left_edges": int(relations[Relation.LEFT]),
        "right_edges": int(relations[Relation.RIGHT]),
        "segments": len(graph.segments.ids),
        "pedestrian_nodes": len(graph.walks.s),
        "pedestrian_edges": len(graph.walks.source),
    }
