"""What is damaged: a workspace with a map, scenarios, runs, tables, a suite, made once."""

from __future__ import annotations

import csv
import json
import re
import shutil
import time
import zipfile
from dataclasses import dataclass
from pathlib import Path

from bench.common import shared_maps
from bench.fuzz.limits import Ended, Limits, kill_tree

ROOT = Path(__file__).parents[2]
CROSSING = "signal_crossing"
_MADE = ".maps"
"""Names the maps; there once all of it is."""
PATIENCE = 600.0
"""Seconds for a command that makes material: nothing is known of it that takes longer."""
SMALL = 100_000
"""Bytes of the largest map that is damaged: the limits of time are for small maps."""


@dataclass(frozen=True, slots=True)
class Material:
    """Files of which trials take copies; nothing here is changed after it was made."""

    root: Path
    map_files: tuple[Path, ...]

    @property
    def workspace(self) -> Path:
        return self.root / "workspace"

    @property
    def scenario(self) -> Path:
        """With cars, pedestrians, flows, demand of each kind and programs of lights."""
        return self.root / "full.scenario.json"

    def file(self, name: str) -> Path:
        return self.root / name

    def copy_workspace(self, folder: Path, *parts: str) -> Path:
        """Copy parts of the workspace into the folder of a trial."""
        made = folder / "workspace"
        (made / "maps").mkdir(parents=True)
        for part in parts:
            shutil.copytree(self.workspace / part, made / part, dirs_exist_ok=True)
        return made


def prepare(root: Path, limits: Limits) -> Material:
    """Make the material with the command line itself, unless it has been made before."""
    root = root.resolve()
    if (root / _MADE).exists():
        return Material(root, tuple(map(Path, (root / _MADE).read_text().splitlines())))
    root.mkdir(parents=True)
    workspace = root / "workspace"
    shipped = [
        ROOT / "maps" / f"{name}.xodr"
        for name in (
            CROSSING,
            "roundabout",
            "motorway_weave",
            "t_junction_signs",
            "left_hand_crossing",
        )
    ]
    real = shared_maps()
    found = sorted((real / "esmini").glob("*.xodr")) if real else []
    files = [path for path in (*shipped, *found) if path.stat().st_size <= SMALL]
    material = Material(root, (*files, _full(root)))
    used = ["--workspace", str(workspace)]
    scenario = str(material.scenario)
    _ok(limits, root, "maps", "add", str(shipped[0]), *used)
    _ok(
        limits,
        root,
        "generate",
        "--map",
        CROSSING,
        "--seed",
        "3",
        "--fill",
        "0.3",
        "--out",
        str(root / "made"),
        *used,
    )
    (sampled,) = (root / "made").glob("*.scenario.json")
    _tables(root)
    shutil.copy(sampled, material.scenario)
    _ok(
        limits,
        root,
        "demand",
        "import",
        scenario,
        "--od",
        str(root / "od.csv"),
        "--zones",
        str(root / "zones.csv"),
        "--profile",
        str(root / "profile.csv"),
        *used,
    )
    _ok(limits, root, "demand", "import", scenario, "--counts", str(root / "counts.csv"), *used)
    _ok(limits, root, "demand", "add", scenario, "--per-km", "3", *used)
    _ok(limits, root, "signals", "webster", "--no-trial", scenario, *used)
    _ok(limits, root, "signals", "export", scenario, "--out", str(root / "tll.add.xml"), *used)
    _ok(limits, root, "signals", "import", scenario, str(root / "tll.add.xml"), *used)
    _ok(limits, root, "export", str(sampled), "--to", "graphml", "--out", str(root), *used)
    _ok(limits, root, "maps", "network", CROSSING, "--out", str(root / "net.net.xml"), *used)
    (root / "config.toml").write_text(CONFIG, encoding="utf-8")
    _runs(material, limits, sampled)
    _handed(material, limits, sampled)
    _received(material, limits)
    (root / _MADE).write_text("\n".join(map(str, material.map_files)), encoding="utf-8")
    return material


def _runs(material: Material, limits: Limits, sampled: Path) -> None:
    """A finished run, one in slices that was interrupted, and a suite with its baseline."""
    root, used = material.root, ["--workspace", str(material.workspace)]
    shutil.copy(sampled, root / "done.scenario.json")
    shutil.copy(sampled, root / "sliced.scenario.json")
    runs = str(material.workspace / "runs")
    _ok(
        limits,
        root,
        "run",
        str(root / "done.scenario.json"),
        "--until",
        "60",
        "--out",
        runs,
        "--criticality",
        *used,
    )
    interrupted = material.workspace / "runs" / "sliced"
    pid = limits.start(
        [
            "run",
            str(root / "sliced.scenario.json"),
            "--until",
            "6h",
            "--slice",
            "60",
            "--out",
            runs,
            *used,
        ],
        root,
    )
    _wait_for(interrupted / "slices", pid)
    limits.clean(0.0)
    suite = root / "suite"
    suite.mkdir()
    shutil.copy(ROOT / "maps" / f"{CROSSING}.xodr", suite)
    shutil.copy(sampled, suite / "one.scenario.json")
    (suite / "suite.toml").write_text(SUITE, encoding="utf-8")
    _ok(limits, root, "test", str(suite / "suite.toml"), "--update-baseline", *used)


def _handed(material: Material, limits: Limits, sampled: Path) -> None:
    """What others hand over: scenes with a catalog, a feed, plans; and folders of experiments."""
    root, used = material.root, ["--workspace", str(material.workspace)]
    for source in (sampled, material.scenario):
        for version in ("1.0", "1.3"):
            out = root / f"exported-{source.name.partition('.')[0]}-{version}"
            given = ("--to", "openscenario", "--version", version, "--out", str(out))
            _ok(limits, root, "export", str(source), *given, *used)
    scenes = root / "osc"
    (scenes / "own").mkdir(parents=True)
    for number, file in enumerate(sorted(root.glob("exported-*/*.xosc"))):
        shutil.copy(file, scenes / f"exported-{number}.xosc")
        for beside in file.parent.glob("*.xodr"):
            shutil.copy(beside, scenes)
    write_scenes(scenes)
    turned = json.loads(sampled.read_text(encoding="utf-8"))
    turned |= {
        "parameters": {
            "gap": {"value": 10.0, "min": 0.0, "max": 100.0},
            "speed": {"value": 10.0, "min": 1.0, "max": 20.0},
        },
        "flows": [{"id": "f", "spawn": turned["actors"][7]["spawn"], "per_hour": "20 * $gap"}],
        "simulation": {"duration": 4.0},
    }
    turned["actors"] = turned["actors"][:4]
    turned["actors"][0]["speed"] = "$speed"
    (root / "turned.scenario.json").write_text(json.dumps(turned), encoding="utf-8")
    buses = turned | {"name": "buses", "parameters": {}, "flows": [], "demand": {"clock": 25200.0}}
    buses["actors"] = []
    buses["simulation"] = {"duration": 3600.0}
    (root / "buses.scenario.json").write_text(json.dumps(buses), encoding="utf-8")
    (root / "study.toml").write_text(STUDY, encoding="utf-8")
    (root / "dataset.toml").write_text(DATASET, encoding="utf-8")
    ended = limits.run(("feed",), root, question=lambda: write_feed(material))
    if ended.code:
        raise RuntimeError(f"the feed cannot be made: {ended.err}")
    folders, turned_file = root / "folders", str(root / "turned.scenario.json")
    swept = ["sweep", turned_file, "--vary", "gap=6,20", "--out", str(folders / "sweep")]
    _ok(limits, root, *swept, *used)
    _ok(
        limits,
        root,
        "study",
        "run",
        str(root / "study.toml"),
        "--out",
        str(folders / "study"),
        *used,
    )
    _ok(
        limits,
        root,
        "dataset",
        str(root / "dataset.toml"),
        "--out",
        str(folders / "dataset"),
        *used,
    )
    suite, results = str(root / "suite" / "suite.toml"), folders / "suite" / "results.json"
    results.parent.mkdir()
    _ok(limits, root, "test", suite, "--results", str(results), *used)


def _received(material: Material, limits: Limits) -> None:
    """Recordings, pictures, a history and weights; one of each kept in the workspace."""
    from bench.fuzz.received_material import write_received

    root = material.root
    ended = limits.run(("received",), root, question=lambda: write_received(root))
    if ended.code:
        raise RuntimeError(f"what is received cannot be made: {ended.err}")


def write_scenes(folder: Path) -> None:
    """A cut-in with conditions of many kinds, and one whose manoeuvre is in a catalog."""
    from tests.app.test_scenario_imports import FILE, ROAD, SPEED

    (folder / "road.xodr").write_text(ROAD, encoding="utf-8")
    scene = FILE.replace("ACTION", SPEED)
    (folder / "scene.xosc").write_text(scene, encoding="utf-8")
    entry = SPEED.replace('value="5"', 'value="$mps"').replace('value="2"', 'value="$kph"')
    event = f'<Event name="later"><Action name="y"><PrivateAction>{entry}</PrivateAction></Action>'
    (folder / "own" / "moves.xosc").write_text(
        '<OpenSCENARIO><FileHeader revMajor="1" revMinor="2"/><Catalog name="moves">'
        '<Maneuver name="faster"><ParameterDeclarations><ParameterDeclaration name="mps" '
        f'parameterType="double" value="1"/></ParameterDeclarations>{event}</Event></Maneuver>'
        "</Catalog></OpenSCENARIO>",
        encoding="utf-8",
    )
    reference = (
        '<CatalogReference catalogName="moves" entryName="faster"><ParameterAssignments>'
        '<ParameterAssignment parameterRef="mps" value="${$kph / 4}"/></ParameterAssignments>'
        "</CatalogReference>"
    )
    places = '<CatalogLocations><ManeuverCatalog><Directory path="own"/></ManeuverCatalog>'
    text = re.sub(r"<Maneuver name.*</Maneuver>", reference, scene, flags=re.DOTALL)
    text = text.replace("<RoadNetwork>", f"{places}</CatalogLocations><RoadNetwork>")
    (folder / "referring.xosc").write_text(text, encoding="utf-8")


def write_feed(material: Material) -> str:
    """The tables of a feed with two stops beside lanes of the crossing."""
    from odscen.maps.store import Workspace
    from tests.app.demand.test_transit_feeds import feed

    archive = feed(Workspace.open(material.workspace), material.root)
    with zipfile.ZipFile(archive) as tables:
        tables.extractall(material.root)
    return ""


def _wait_for(slices: Path, pid: int) -> None:
    """Kill a run once two slices are complete."""
    end = time.monotonic() + 60.0
    while time.monotonic() < end and len(list(slices.glob("[0-9]*"))) < 2:
        time.sleep(0.02)
    kill_tree(pid)


def _full(root: Path) -> Path:
    from tests.opendrive.full import FULL

    path = root / "every_element.xodr"
    path.write_text(FULL, encoding="utf-8")
    return path


def _tables(root: Path) -> None:
    """Tables of demand on the roads of the shipped crossing."""
    tables = {
        "zones": [("zone", "segment"), ("west", "r1"), ("east", "r2")],
        "od": [("from", "to", "trips"), ("west", "east", "12"), ("r3", "west", "7.5")],
        "counts": [
            ("place", "begin", "end", "count"),
            ("r1", "0", "900", "20"),
            ("r2>j10001", "0", "900", "15"),
        ],
        "profile": [("share",), ("1",), ("3",), ("2",)],
    }
    for name, rows in tables.items():
        with (root / f"{name}.csv").open("w", newline="", encoding="utf-8") as file:
            csv.writer(file).writerows(rows)


def _ok(limits: Limits, root: Path, *argv: str) -> Ended:
    ended = limits.run(argv, root, seconds=PATIENCE)
    if ended.code:
        raise RuntimeError(
            f"the material cannot be made: odscen {' '.join(argv)}: {ended.err}{ended.out}"
        )
    return ended


SUITE = """name = "one"
scenarios = ["one.scenario.json"]
maps = ["signal_crossing.xodr"]
baselines = "baselines"
seeds = [1]
until = 20
expect = ["arrived >= 0 %"]

[tolerance]
mean_delay = "10 % or 2 s"
"""
STUDY = """name = "rain"
scenarios = ["turned.scenario.json"]
seeds = 2
[[variant]]
name = "hard-rain"
edits = [{kind = "set_environment", preset = "HardRainNoon"}]
[[vary]]
parameter = "gap"
values = [6, 8]
[run]
until = 3
"""
DATASET = """name = "two"
licence = "CC-BY-4.0"
formats = ["pyg", "scenarionet"]
keep_if = ["planned >= 1"]
shard = 2
[splits]
train = ["signal*"]
[[study.sample]]
maps = ["signal*"]
count = 2
fill = 0.1
[study.run]
until = 3
"""
CONFIG = """fill = 0.2
pedestrian_share = 0.1
actors_max = 500
ego = false
duration = 600.0
[maps]
names = ["*"]
weight_by = "road_length"
[maps.where]
junctions = { min = 1 }
speed_limit_max = { max = 50.0 }
[roi]
segments = { kind = "uniform", low = 4, high = 16 }
[environment.presets]
ClearNoon = 3
HardRainNight = 1
[environment.parameters]
fog_density = { kind = "uniform", low = 0, high = 30 }
[vehicles]
car = 0.8
truck = 0.2
[places]
minimum_gap = 3.0
minimum_trip = 20.0
lane_types = []
exclude_segments = []
[places.speed_limit_max]
bicycle = 17.0
[behaviour]
speed_factor = { kind = "normal", mean = 1.0, std = 0.1, low = 0.7, high = 1.2 }
bicycle_speed = { kind = "choice", values = [4, 5], weights = [3, 1] }
styles = { cautious = 0.25, normal = 0.55, sporty = 0.2 }
depart = 0.0
crosses_anywhere = 0.1
ignores_red = 0.1
"""
