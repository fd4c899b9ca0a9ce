"""What the SUMO files of a run say of lanes, connections and drivers, for figures by place."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from odscen.base.errors import InputError
from odscen.base.xml_reading import read_xml
from odscen.convert.verify.net_reader import read_net
from odscen.results.by_place.facilities import NetFacts
from odscen.sumo.folder import layout
from odscen.sumo.outputs.xml_rows import elements

if TYPE_CHECKING:
    from pathlib import Path

    import polars as pl

    from odscen.convert.verify.net_reader import NetFile

HEAVY = ("truck", "trailer", "bus", "coach", "fire", "tram")
"""SUMO's vehicle classes that count as heavy vehicles."""


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
        return _facts(net, routes)
    except (OSError, ValueError, etree.XMLSyntaxError) as error:
        msg = f"the SUMO files of the run cannot be read: {error}"
        raise InputError(msg, file=str(run / layout.SUMO_FOLDER)) from error


def _facts(net: Path, routes: Path) -> NetFacts:
    import polars as pl

    content = net.read_bytes()
    root = read_xml(content, huge=True)
    limits = [
        (lane.get("id"), edge.get("id"), float(lane.get("speed", "13.89")))
        for edge in root.iterfind("edge")
        for lane in edge.iterfind("lane")
    ]
    ring = {name for one in root.iterfind("roundabout") for name in one.get("edges", "").split()}
    yields = _giving_way(read_net(content))
    links = {
        via: (
            via,
            one.get("state", "M"),
            via in yields,
            one.get("to") in ring,
            one.get("from") in ring,
        )
        for one in root.iterfind("connection")
        if (via := one.get("via"))
    }
    flags = dict.fromkeys(("gives_way", "onto_ring", "from_ring"), pl.Boolean)
    return NetFacts(
        limits=pl.DataFrame(
            limits,
            schema={"lane": pl.String, "edge": pl.String, "limit": pl.Float64},
            orient="row",
        ),
        links=pl.DataFrame(
            list(links.values()),
            schema={"via": pl.String, "state": pl.String, **flags},
            orient="row",
        ),
        drivers=_drivers(routes),
    )


def _giving_way(net: NetFile) -> set[str]:
    """First lanes inside of connections that give way to other vehicles; of people do not count."""
    found = set()
    rows = net.request_rows()
    for junction in net.junctions:
        links = rows[junction.id]
        driven = {k for k, link in enumerate(links) if net.lanes[link.target].function == "normal"}
        for index in driven:
            if junction.yields.get(index, frozenset()) & driven:
                found.add(links[index].via)
    return found


def _drivers(routes: Path) -> pl.DataFrame:
    import polars as pl

    kinds: dict[str, tuple[float, float, bool]] = {}
    rows = []
    for found in elements(routes, "vType", "vehicle", "trip"):
        if found.tag == "vType":
            speed, vclass = float(found.get("maxSpeed", "55.55")), found.get("vClass", "")
            desired = float(found.get("desiredMaxSpeed", _DESIRED.get(vclass, math.inf)))
            kinds[found.get("id", "")] = speed, desired, vclass in HEAVY
        else:
            speed, desired, heavy = kinds.get(found.get("type", ""), (55.55, math.inf, False))
            factor = float(found.get("speedFactor", "1"))
            serves = found.find("stop") is not None
            rows.append((found.get("id"), factor, min(speed, desired * factor), heavy, serves))
    schema = {
        "id": pl.String,
        "factor": pl.Float64,
        "max_speed": pl.Float64,
        "heavy": pl.Boolean,
        "serves": pl.Boolean,
    }
    return pl.DataFrame(rows, schema=schema, orient="row")
