"""What a map of an OpenStreetMap extract carries, against netconvert's network of the same extract.

Cars only, the same trips on all networks, an hour each, as in :mod:`bench.capacity`, whose
environment variables hold here, too. netconvert reads the extract directly, with the options of
SUMO's osmWebWizard and the projection of our map; its lights are actuated, as the wizard has them,
or have fixed times, as ours. It drives 50 km/h where the extract says nothing and corners with
5.5 m/s2; so there is a third network, with fixed times, the limits that are usual in the country,
as our map has them, the speeds of its turns (:mod:`bench.same_limits`), and no turns back but at
dead ends: of trips between places drawn by chance one in ten would turn back in a junction.
Extracts are those of ``$ODSCEN_TEST_PLACES``, else of ``../shared/places/osm``.
"""

from __future__ import annotations

import os
import statistics
import subprocess
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING
from xml.etree import ElementTree as ET

import numpy as np
import sumo

from bench.capacity import FROM_ENDS, NARROWEST, NetworkBench, build_own, run_tool
from bench.common import osm_extracts, unpacked
from bench.osm_converters import TYPEMAPS, WIZARD
from bench.same_limits import add_signs_and_inner_limits
from odscen.lanegraph.build_graphs import build_map_graph
from odscen.maps.importers.base import ImportSettings
from odscen.maps.importers.osm.street_tags import CLASSES, country_at, read_street
from odscen.maps.importers.registry import import_map
from odscen.opendrive.lanes import RoadTable
from odscen.opendrive.parse import parse

if TYPE_CHECKING:
    from odscen.opendrive.road_model import OpenDrive

PEERS = ("actuated", "fixed", "limited")
LEAST_LANES = 0.5
"""Kilometres of lanes of an extract that is measured."""


def main() -> None:
    extracts = osm_extracts()
    if not extracts:
        return
    levels = [int(v) for v in os.environ.get("ODSCEN_BENCH_LEVELS", "100,300,500").split(",")]
    seeds = [int(v) for v in os.environ.get("ODSCEN_BENCH_SEEDS", "1,2").split(",")]
    wanted = os.environ.get("ODSCEN_BENCH_MAPS", "")
    print("ours / netconvert's, actuated / fixed times / fixed times and the same limits")
    print(
        "| extract | lights | per hour and km | arrived | delay, s | trip, s | teleports |"
        " collisions |"
    )
    print("|---|---|---|---|---|---|---|---|")
    ratios: list[float] = []
    for extract in extracts:
        name = extract.name.split(".")[0]
        if wanted and name not in wanted.split(","):
            continue
        with tempfile.TemporaryDirectory() as work:
            bench = _bench_of(extract, name, Path(work))
            if bench is not None:
                for level in levels:
                    ratios += bench.measure(level, seeds)
    if ratios:
        print(f"median ratio of delays, of the same limits {statistics.median(ratios):.2f}")


def _bench_of(extract: Path, name: str, folder: Path) -> NetworkBench | None:
    """The networks of an extract; ``None`` if it has hardly a street."""
    content = unpacked(extract)
    plain, xodr = folder / f"{name}.osm", folder / f"{name}.xodr"
    plain.write_bytes(content)
    opendrive, _ = import_map(
        content, plain.name, ImportSettings(), progress=lambda _what, _share: None
    )
    xodr.write_bytes(opendrive)
    odr = parse(opendrive, file=xodr.name)
    places = _find_places(odr)
    if len(places) * 2.0 / 1000.0 < LEAST_LANES:
        return None
    files = {kind: folder / f"{kind}.net.xml" for kind in ("ours", *PEERS)}
    build_own(xodr, files["ours"], control="fixed")
    projection = str(odr.header.geo_reference).strip()
    limited = folder / "limited.osm"
    limited.write_bytes(_with_limits(content))
    for kind in PEERS:
        try:
            _convert(limited if kind == "limited" else plain, files[kind], projection, kind)
        except subprocess.CalledProcessError as error:
            print(f"| {name} | netconvert: {error.stderr.decode().strip()[:90]} |")
            return None
    add_signs_and_inner_limits(xodr, files["ours"], files["limited"])
    return NetworkBench(folder, name, files, places)


def _find_places(odr: OpenDrive) -> list[tuple[float, float, float]]:
    """Places every two metres on lanes for cars, not near their ends: x, y, m, and heading, rad."""
    table = RoadTable.of(odr)
    lanes = build_map_graph(odr, name="extract", sha256="0" * 64, table=table).lanes
    rows = np.array([table.lane_index[key] for key in lanes.lanes.keys])[lanes.lane]
    inside = np.array([road.junction is not None for road in odr.roads.values()])
    lengths = np.array([road.length for road in odr.roads.values()])
    road = table.lane_road[rows]
    keep = (
        ~inside[road]
        & (table.lane_width(rows, lanes.s) >= NARROWEST)
        & (lanes.s > FROM_ENDS)
        & (lanes.s < lengths[road] - FROM_ENDS)
        & np.array([table.lane_type[row] == "driving" for row in rows])
    )
    columns = (lanes.x[keep], lanes.y[keep], lanes.hdg[keep])
    return list(zip(*(column.tolist() for column in columns), strict=True))


def _with_limits(content: bytes) -> bytes:
    """Write the limit that is usual in the country to all streets that have none."""
    root = ET.fromstring(content)
    nodes = [(float(n.get("lat", 0)), float(n.get("lon", 0))) for n in root.iter("node")]
    country = country_at(*(sum(values) / len(nodes) for values in zip(*nodes, strict=True)))
    for way in root.iter("way"):
        tags = {tag.get("k", ""): tag.get("v", "") for tag in way.iter("tag")}
        if tags.get("highway") in CLASSES and "maxspeed" not in tags:
            limit = read_street(tags, country, walks={}).section.speed_right
            if limit:
                ET.SubElement(way, "tag", {"k": "maxspeed", "v": f"{limit * 3.6:.1f}"})
    return ET.tostring(root)


def _convert(extract: Path, net: Path, projection: str, kind: str) -> None:
    """Have netconvert read an extract as osmWebWizard does, in the coordinates of our map."""
    home = Path(sumo.SUMO_HOME)
    types = ",".join(str(home / "data" / "typemap" / f"{name}.typ.xml") for name in TYPEMAPS)
    options = [o if o != "actuated" or kind == "actuated" else "static" for o in WIZARD]
    if kind == "limited":
        options += ["--no-turnarounds.except-deadend"]
    run_tool(
        "netconvert", "--osm-files", extract, "--type-files", types, *options,
        "--proj", projection, "--offset.disable-normalization", "-o", net, "--no-warnings",
    )  # fmt: skip


if __name__ == "__main__":
    main()
