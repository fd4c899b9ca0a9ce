"""The same extracts of OpenStreetMap by odscen and by the converters that others use.

SUMO's netconvert with the options of its osmWebWizard for cars, bicycles and pedestrians;
CARLA's Osm2Odr, an older netconvert, which is told a projection at the place; CommonRoad's
Scenario Designer by way of its own format. Each writes OpenDRIVE, and all that is counted is read
from these files by this script alone; what the extracts have is counted on them. Extracts are those
of ``$ODSCEN_TEST_PLACES``, else of ``../shared/places/osm``. ``$ODSCEN_CARLA_PYTHON`` and
``$ODSCEN_CRDESIGNER_PYTHON`` are Pythons with the packages carla and
commonroad-scenario-designer; without them these are left out. ``--pictures FOLDER`` draws the maps
of each extract beside each other as PNG.
"""

from __future__ import annotations

import argparse
import math
import os
import subprocess
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path
from typing import TYPE_CHECKING
from xml.etree import ElementTree as ET

import numpy as np
import pyproj
import shapely
import sumo
from PIL import Image

from bench.common import osm_extracts, unpacked
from odscen.base.errors import OdscenError
from odscen.maps.importers.base import ImportSettings
from odscen.maps.map_pictures import draw_map
from odscen.maps.store import Workspace
from odscen.opendrive.lanes import RoadTable
from odscen.opendrive.parse import parse

if TYPE_CHECKING:
    from collections.abc import Callable

TYPEMAPS = (
    "osmNetconvert",
    "osmNetconvertUrbanDe",
    "osmNetconvertPedestrians",
    "osmNetconvertBicycle",
)
WIZARD = (
    "--geometry.remove", "--ramps.guess", "--junctions.join", "--tls.guess-signals",
    "--tls.discard-simple", "--tls.join", "--output.original-names", "--output.street-names",
    "--tls.default-type", "actuated", "--crossings.guess", "--osm.sidewalks", "--osm.bike-access",
)  # fmt: skip
CARLA = """
import carla, re, sys
text = open(sys.argv[1]).read()
places = re.findall(r"<node [^>]*lat=.([-0-9.]+). lon=.([-0-9.]+)", text)
lat, lon = (sum(map(float, values)) / len(places) for values in zip(*places))
settings = carla.Osm2OdrSettings()
settings.generate_traffic_lights = True
settings.center_map = False
settings.proj_string = f"+proj=tmerc +lat_0={lat} +lon_0={lon} +datum=WGS84"
open(sys.argv[2], "w").write(carla.Osm2Odr.convert(text, settings))
"""
CRDESIGNER = """
import sys
from pathlib import Path
from commonroad.common.file_writer import CommonRoadFileWriter, OverwriteExistingFile
from commonroad.planning.planning_problem import PlanningProblemSet
from crdesigner.map_conversion import map_conversion_interface as convert
scenario = convert.osm_to_commonroad(Path(sys.argv[1]))
between = sys.argv[2] + ".xml"
writer = CommonRoadFileWriter(scenario, PlanningProblemSet(), "a", "b", "c", set())
writer.write_to_file(between, OverwriteExistingFile.ALWAYS)
convert.commonroad_to_opendrive(Path(between), Path(sys.argv[2]))
"""
STREETS = {
    "motorway", "trunk", "primary", "secondary", "tertiary", "unclassified", "residential",
    "living_street", "motorway_link", "trunk_link", "primary_link", "secondary_link",
    "tertiary_link",
}  # fmt: skip
_SIDE = 700
"""Pixels of the width of a picture."""
DRIVING = {"driving", "entry", "exit", "onRamp", "offRamp", "bus", "taxi", "HOV", "bidirectional"}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--pictures", type=Path)
    options = parser.parse_args()
    extracts = osm_extracts()
    if not extracts:
        return
    tools: dict[str, Callable[[Path, Path], None]] = {
        "odscen": _convert_here,
        "netconvert": _netconvert,
    }
    for name, variable, script in (
        ("Osm2Odr", "ODSCEN_CARLA_PYTHON", CARLA),
        ("CommonRoad", "ODSCEN_CRDESIGNER_PYTHON", CRDESIGNER),
    ):
        python = os.environ.get(variable)
        if python:
            tools[name] = _run_script(python, script)
        else:
            print(f"without {name}: set {variable}")
    heads = ("extract", "by", *Figures.HEADS, "s")
    print("|", " | ".join(heads), "|")
    print("|---" * len(heads) + "|")
    for extract in extracts:
        content = unpacked(extract)
        name = extract.name.split(".")[0]
        pictures: list[Image.Image] = []
        print(f"| {name} | (the extract) | {' | '.join(count_extract(content))} | |", flush=True)
        for tool, convert in tools.items():
            with tempfile.TemporaryDirectory() as work:
                plain, out = Path(work) / f"{name}.osm", Path(work) / f"{name}.xodr"
                plain.write_bytes(content)
                start = time.perf_counter()
                try:
                    convert(plain, out)
                    seconds = time.perf_counter() - start
                    words = Figures(out.read_bytes(), content).words()
                except (OSError, OdscenError, ET.ParseError, subprocess.SubprocessError) as error:
                    said = (str(error).strip().splitlines() or ["failed"])[-1][:90]
                    print(f"|  | {tool} | failed: {said} |", flush=True)
                    continue
                print(f"|  | {tool} | {' | '.join(words)} | {seconds:.1f} |", flush=True)
                if options.pictures:
                    pictures.append(_draw(out, tool))
        if options.pictures:
            options.pictures.mkdir(parents=True, exist_ok=True)
            _lay_out(pictures).save(options.pictures / f"{name}.png", optimize=True)


def _convert_here(extract: Path, out: Path) -> None:
    with tempfile.TemporaryDirectory() as folder:
        workspace = Workspace.open(Path(folder))
        entry = workspace.add_map(extract, name="place", importing=ImportSettings("openstreetmap"))
        out.write_bytes(entry.read("xodr"))


def _netconvert(extract: Path, out: Path) -> None:
    home = Path(sumo.SUMO_HOME)
    types = ",".join(str(home / "data" / "typemap" / f"{name}.typ.xml") for name in TYPEMAPS)
    command = [
        str(home / "bin" / "netconvert"), "--osm-files", str(extract), "--type-files", types,
        *WIZARD, "--opendrive-output", str(out), "-o", str(out.with_suffix(".net.xml")),
    ]  # fmt: skip
    subprocess.run(command, check=True, capture_output=True, timeout=600)


def _run_script(python: str, script: str) -> Callable[[Path, Path], None]:
    def convert(extract: Path, out: Path) -> None:
        # SUMO's data of this environment are not those of the peer's.
        known = {key: value for key, value in os.environ.items() if key != "SUMO_HOME"}
        environment = known | {
            "PROJ_DATA": pyproj.datadir.get_data_dir(),
            "QT_QPA_PLATFORM": "offscreen",
        }
        subprocess.run(
            [python, "-c", script, str(extract), str(out)],
            check=True,
            capture_output=True,
            timeout=900,
            env=environment,
        )

    return convert


def count_extract(content: bytes) -> list[str]:
    """What an extract has of what is counted on the maps; lanes are not said by most of it."""
    counts: Counter[str] = Counter()
    for item in ET.fromstring(content):
        if item.get("action") == "delete":
            continue
        tags = {tag.get("k", ""): tag.get("v", "") for tag in item.iter("tag")}
        kind = tags.get("highway")
        if item.tag == "node":
            counts[kind or ""] += 1
        elif item.tag == "way" and kind in STREETS:
            counts["streets"] += 1
            counts["limited"] += any(key.startswith("maxspeed") for key in tags)
        elif item.tag == "relation" and tags.get("type", "").startswith("restriction"):
            counts["restrictions"] += 1
    limited = f"{100 * counts['limited'] / max(counts['streets'], 1):.0f} %"
    signs = counts["stop"] + counts["give_way"]
    shown = ["", "", "", "", counts["crossing"], counts["traffic_signals"], "", signs, limited, ""]
    return [str(value) for value in shown]


class Figures:
    """What is counted on an OpenDRIVE file."""

    HEADS = (
        "driving, km of lane", "bicycle", "sidewalk", "dead ends", "crosswalks", "lights",
        "stop lines", "stop and yield signs", "limits", "beside the streets, m",
    )  # fmt: skip

    def __init__(self, content: bytes, extract: bytes) -> None:
        self.root = ET.fromstring(content)
        for element in self.root.iter():
            element.tag = element.tag.rpartition("}")[2]
        self.content, self.extract = content, extract
        self.roads = {road.get("id", ""): road for road in self.root.findall("road")}

    def words(self) -> list[str]:
        """A row of the table."""
        lanes = Counter[str]()
        limited = Counter[bool]()
        for road in self.roads.values():
            if road.get("junction", "-1") != "-1":
                continue
            sections = road.findall("lanes/laneSection")
            starts = [float(section.get("s", "0")) for section in sections]
            speed = road.find("type/speed") is not None
            ends = [*starts[1:], float(road.get("length", "0"))]
            for section, start, end in zip(sections, starts, ends, strict=True):
                for lane in section.iter("lane"):
                    kind = lane.get("type", "")
                    kind = "driving" if kind in DRIVING else kind
                    lanes["sidewalk" if kind == "walking" else kind] += (end - start) / 1000.0  # type: ignore[assignment]
                    if kind == "driving":
                        limited[speed or lane.find("speed") is not None] += end - start  # type: ignore[assignment]
        whole = sum(limited.values())
        return [
            f"{lanes['driving']:.1f}",
            f"{lanes['biking']:.1f}",
            f"{lanes['sidewalk']:.1f}",
            str(self._count_dead_ends()),
            str(self._count_objects("crosswalk")),
            str(self._count_lights()),
            str(self._count_objects("stop")),
            str(self._count_signs()),
            f"{100 * limited[True] / whole:.0f} %" if whole else "",
            self._measure_distance(),
        ]

    def _count_objects(self, word: str) -> int:
        return sum(
            word in f"{item.get('type')} {item.get('subtype')} {item.get('name')}".lower()
            or (word == "stop" and item.get("subtype") == "signalLines")
            for item in self.root.iter("object")
        )

    def _count_lights(self) -> int:
        return sum(signal.get("dynamic") == "yes" for signal in self.root.iter("signal"))

    def _count_signs(self) -> int:
        return sum(signal.get("type") in ("205", "206") for signal in self.root.iter("signal"))

    def _count_dead_ends(self) -> int:
        """Driving lanes that end at a junction that has no connection for them."""
        onward = {
            (connection.get("incomingRoad"), junction.get("id"), link.get("from"))
            for junction in self.root.findall("junction")
            for connection in junction.findall("connection")
            for link in connection.findall("laneLink")
        }
        # At the edge of an extract some write junctions without a connection.
        inner = {junction for _, junction, _ in onward}
        dead = 0
        for number, road in self.roads.items():
            if road.get("junction", "-1") != "-1":
                continue
            left = road.get("rule") == "LHT"
            sections = road.findall("lanes/laneSection")
            for side, section in (("predecessor", sections[0]), ("successor", sections[-1])):
                link = road.find(f"link/{side}")
                if link is None or link.get("elementType") != "junction":
                    continue
                if link.get("elementId") not in inner:
                    continue
                # Right lanes end at the successor, where traffic keeps right.
                towards = -1 if (side == "successor") != left else 1
                for lane in section.iter("lane"):
                    name = lane.get("id", "0")
                    if lane.get("type") in DRIVING and int(name) * towards > 0:
                        dead += (number, link.get("elementId"), name) not in onward
        return dead

    def _measure_distance(self) -> str:
        """95th percentile of how far streets of the extract are outside of the lanes, metres."""
        model = parse(self.content)
        if model.header.crs is None:
            return "no projection"
        project = pyproj.Transformer.from_crs("EPSG:4326", model.header.crs, always_xy=True)
        nodes, ways = {}, []
        for item in ET.fromstring(self.extract):
            if item.tag == "node":
                nodes[item.get("id")] = (float(item.get("lon", "0")), float(item.get("lat", "0")))
            tags = {tag.get("k"): tag.get("v") for tag in item.iter("tag")}
            if item.tag == "way" and tags.get("highway") in STREETS:
                ways.append([ref.get("ref") for ref in item.iter("nd")])
        table = RoadTable.of(model)
        areas = []
        for row, kind in enumerate(table.lane_type):
            if kind in DRIVING:
                s = np.linspace(float(table.lane_s0[row]), float(table.lane_s1[row]), 8)
                sides = [table.lane_points(np.full(8, row), s, at=at) for at in (0.0, 1.0)]
                left, right = (np.stack([side.x, side.y], axis=1) for side in sides)
                areas.append(shapely.make_valid(shapely.Polygon([*left, *right[::-1]])))
        surface = shapely.STRtree(areas)
        away = []
        for way in ways:
            places = [nodes[ref] for ref in way if ref in nodes]
            if len(places) < 2:
                continue
            x, y = project.transform(*np.array(places).T)
            offset = model.header.offset
            line = shapely.LineString(np.stack([x - offset[0], y - offset[1]], axis=1))
            if not math.isfinite(line.length):
                return "not finite"
            for at in np.arange(0.0, line.length, 5.0).tolist():
                point = line.interpolate(at)
                near = surface.query_nearest(point)
                away.append(float(shapely.distance(point, areas[int(near[0])])))
        return f"{np.percentile(away, 95):.1f}"


def _draw(xodr: Path, name: str) -> Image.Image:
    """The map, or nothing where it cannot be read."""
    with tempfile.TemporaryDirectory() as folder:
        picture = Path(folder) / "map.png"
        try:
            entry = Workspace.open(Path(folder) / "workspace").add_map(xodr, name=name)
        except OdscenError as error:
            print(f"  {name}: not drawn: {str(error)[:120]}", file=sys.stderr)
            return Image.new("RGB", (_SIDE, _SIDE), "white")
        draw_map(entry, picture, width=_SIDE, with_graph=False)
        return Image.open(picture).convert("RGB")


def _lay_out(pictures: list[Image.Image]) -> Image.Image:
    """Two beside each other."""
    high = max(picture.height for picture in pictures)
    sheet = Image.new("RGB", (2 * _SIDE, high * math.ceil(len(pictures) / 2)), "white")
    for number, picture in enumerate(pictures):
        sheet.paste(picture, (number % 2 * _SIDE, number // 2 * high))
    return sheet.quantize(64)
