"""Graphs of the maps that ship."""

from __future__ import annotations

from odscen.lanegraph.build_graphs import build_map_graph
from odscen.lanegraph.graphs import MapGraph
from odscen.maps.shipped import shipped_maps
from odscen.opendrive.parse import parse


def shipped(name: str) -> MapGraph:
    (path,) = (one for one in shipped_maps() if one.stem == name)
    odr = parse(path.read_bytes(), file=path.name)
    return build_map_graph(odr, name=name, sha256="0" * 64)
