"""What the SUMO files of a run say of lanes, connections and drivers, for figures by place."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from odscen.base.errors import InputError
from odscen.base.xml_reading import read_xml
from odscen.convert.verify.net_reader import read_connections
from odscen.figures.by_place.facilities import NetFacts, no_links
from odscen.runs import layout
from odscen.runs.xml_rows import elements

if TYPE_CHECKING:
    from pathlib import Path

    import polars as pl

    from odscen.base.arrays import FloatArray
    from odscen.convert.verify.net_reader import NetConnections

HEAVY = ("truck", "trailer", "bus", "coach", "fire", "tram")
"""SUMO's vehicle classes that count as heavy vehicles."""


_LANE_WIDTH = "3.2"
"""Metres, SUMO's default."""

_DESIRED = {"bicycle": 20.0 / 3.6}
"""m/s, ``desiredMaxSpeed`` of vehicle classes for which SUMO has one; times the speed factor."""


def read_net_facts(run: Path) -> NetFacts | None:
    """Read network and routes of a run; ``None`` if it does not have them any more.

    Raises
    ------
    InputError
        If one of the files is not whole.
    """
    from lxml import etree

    net = run / layout.SUMO_FOLDER / layout.NET_FILE
    routes = run / layout.SUMO_FOLDER / layout.ROUTES_FILE
    if not (net.is_file() and routes.is_file()):
        return None
    try:
        return _read_facts(net, routes)
    except (OSError, ValueError, etree.XMLSyntaxError) as error:
        raise InputError(
            f"the SUMO files of the run cannot be read: {error}", file=str(run / layout.SUMO_FOLDER)
        ) from error


def _read_facts(net: Path, routes: Path) -> NetFacts:
    # Runs on one map have its network as the same file, see write_sumo_files.
    stat = net.stat()
    same = stat.st_dev, stat.st_ino, stat.st_size, stat.st_mtime_ns
    return replace(_net_facts(_NetFile(net, same)), drivers=_read_drivers(routes))


@dataclass(frozen=True, slots=True)
class _NetFile:
    """A network file, equal to every link to it."""

    path: Path = field(compare=False)
    same: tuple[int, ...]


@lru_cache(maxsize=4)
def _net_facts(net: _NetFile) -> NetFacts:
    """Facts of a network, without drivers."""
    import polars as pl

    root = read_xml(net.path.read_bytes(), huge=True)
    lanes = [(edge, lane) for edge in root.iterfind("edge") for lane in edge.iterfind("lane")]
    limits = [
        (
            lane.get("id"),
            edge.get("id"),
            float(lane.get("length", "0")),
            float(lane.get("speed", "13.89")),
        )
        for edge, lane in lanes
    ]
    ring = {
        name for element in root.iterfind("roundabout") for name in element.get("edges", "").split()
    }
    known = read_connections(root)
    yields = _giving_way(known)
    mirrored = str.maketrans("lLrR", "rRlL") if root.get("lefthand") == "true" else {}
    links = {
        via: (
            via,
            element.get("state", "M"),
            via in yields,
            element.get("to") in ring,
            element.get("from") in ring,
            yields.get(via, []),
            element.get("dir", "s").translate(mirrored),
        )
        for element in root.iterfind("connection")
        if (via := element.get("via"))
    }
    flags = dict.fromkeys(("gives_way", "onto_ring", "from_ring"), pl.Boolean)
    return NetFacts(
        limits=pl.DataFrame(
            limits,
            schema={
                "lane": pl.String,
                "edge": pl.String,
                "length": pl.Float64,
                "limit": pl.Float64,
            },
            orient="row",
        ),
        follows=_read_lane_successors(known),
        shapes={lane.get("id", ""): _parse_points(lane.get("shape", "")) for _, lane in lanes},
        widths={
            lane.get("id", ""): float(lane.get("width", _LANE_WIDTH))
            for edge, lane in lanes
            if edge.get("function") not in ("crossing", "walkingarea")
            and lane.get("allow") != "pedestrian"
        },
        inside=frozenset(
            lane.get("id", "") for edge, lane in lanes if edge.get("function") == "internal"
        ),
        links=pl.DataFrame(
            list(links.values()),
            schema={
                "via": pl.String,
                "state": pl.String,
                **flags,
                "yields_to": pl.List(pl.String),
                "turn": pl.String,
            },
            orient="row",
        ),
        drivers=pl.DataFrame(),
    )


def _read_lane_successors(net: NetConnections) -> pl.DataFrame:
    """Lane and lane behind it, over the lanes inside junctions."""
    import polars as pl

    rows = dict.fromkeys((link.source, link.via or link.target) for link in net.links)
    return pl.DataFrame(list(rows), schema=no_links().schema, orient="row")


def _parse_points(shape: str) -> FloatArray:
    points = [[float(part) for part in point.split(",")[:2]] for point in shape.split()]
    return np.array(points, dtype=np.float64).reshape(-1, 2)


def _giving_way(net: NetConnections) -> dict[str, list[str]]:
    """First lanes inside of connections that give way to other vehicles, and theirs.

    Giving way to people does not count.
    """
    yielding_edges = {}
    rows = net.request_rows()
    for junction in net.junctions:
        links = rows[junction.id]
        driven = {k for k, link in enumerate(links) if net.functions[link.target] == "normal"}
        for index in sorted(driven):
            before = junction.yields.get(index, frozenset()) & driven
            if before:
                yielding_edges[links[index].via] = sorted(links[other].via for other in before)
    return yielding_edges


def _number_or_none(text: str | None) -> float | None:
    """A place or a time, if it is a number and not one of SUMO's words."""
    try:
        return None if text is None else float(text)
    except ValueError:
        return None


def _read_drivers(routes: Path) -> pl.DataFrame:
    import polars as pl

    kinds: dict[str, tuple[float, float, float, bool]] = {}
    rows = []
    for found in elements(routes, "vType", "vehicle", "trip"):
        if found.tag == "vType":
            speed, vclass = float(found.get("maxSpeed", "55.55")), found.get("vClass", "")
            desired = float(found.get("desiredMaxSpeed", _DESIRED.get(vclass, math.inf)))
            length = float(found.get("length", "5"))
            kinds[found.get("id", "")] = speed, desired, length, vclass in HEAVY
        else:
            kind = kinds.get(found.get("type", ""), (55.55, math.inf, 5.0, False))
            speed, desired, length, heavy = kind
            factor = float(found.get("speedFactor", "1"))
            serves = found.find("stop") is not None
            top = min(speed, desired * factor)
            route = found.find("route")
            rows.append(
                (
                    found.get("id"),
                    factor,
                    top,
                    length,
                    heavy,
                    serves,
                    _number_or_none(found.get("arrivalPos")),
                    _number_or_none(found.get("depart")),
                    None if route is None else route.get("edges"),
                )
            )
    schema = {
        "id": pl.String,
        "factor": pl.Float64,
        "max_speed": pl.Float64,
        "length": pl.Float64,
        "heavy": pl.Boolean,
        "serves": pl.Boolean,
        "arrival_pos": pl.Float64,
        "depart": pl.Float64,
        "edges": pl.String,
    }
    return pl.DataFrame(rows, schema=schema, orient="row")
