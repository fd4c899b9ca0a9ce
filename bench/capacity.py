"""What a network carries, against what netconvert makes of the same map: arrivals and delay.

Cars only, the same trips on both networks, an hour each with SUMO defaults (0.5 s steps). Trips
join places on driving lanes outside junctions, drawn with a fixed seed from the waypoints of
``carla.Map``, that both networks have a lane for; those that either cannot route are left out. A
level is trips per hour and kilometre of lane. Delay is SUMO's time loss and insertion delay, the
time until the end for those that never entered; the time of a trip is that of those that arrived.
``ODSCEN_BENCH_LEVELS`` (100,300,500) and ``ODSCEN_BENCH_SEEDS`` (1,2) widen or narrow it,
``ODSCEN_BENCH_MAPS`` names the maps, also those that ``tools/make_maps`` makes on demand;
``ODSCEN_BENCH_SECONDS`` ends an hour earlier, and ``ODSCEN_BENCH_LIGHTS`` is ``on`` to leave out
runs with all lights off and bare maps.

Collisions are counted inside junctions, too.

With lights as programmed and with all of them off. netconvert does not read stop and yield signs,
nor most speed limits, and lets cars corner with 5.5 m/s2; who stops, or slows down from 100 km/h or
for a turn, has delay that one who need not has not. So there is a third network, netconvert's with
the map's limits and stop signs and the speeds of odscen's turns (:mod:`bench.same_limits`), and
maps with such signs or limits are measured once more without them ("bare").
"""

from __future__ import annotations

import math
import os
import random
import statistics
import subprocess
import tempfile
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple
from xml.etree import ElementTree as ET

from bench.common import shared_maps
from bench.same_limits import add_signs_and_inner_limits, map_with_limits

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

HOUR = 3600.0
END = float(os.environ.get("ODSCEN_BENCH_SECONDS", HOUR))
ONLY_ON = os.environ.get("ODSCEN_BENCH_LIGHTS") == "on"
CONTROL = os.environ.get("ODSCEN_BENCH_CONTROL")
"""How our lights are run, as a scenario says it."""
SPACING = 2.0
FROM_ENDS = 15.0
NARROWEST = 2.5
REACH = 3.0
LEAST_LANES = 1.0
"""Kilometres of lanes of a map that is measured."""

VTYPE = '<vType id="car" vClass="passenger" length="4.6" width="1.8" speedDev="0.1"/>'
PERSONS = 800
WALKED = f"on, {PERSONS} walking on ours"
HIGH_LEVELS = {"signal_crossing": (2500, 5000, 8000)}


class _Place(NamedTuple):
    """A place on a lane of one network."""

    edge: str
    pos: float


class _Outcome(NamedTuple):
    """Means over seeds."""

    arrived: float
    delay: float
    time: float
    teleports: float
    collisions: float


DIGITS = _Outcome(0, 0, 0, 1, 1)
"""Decimals that are printed: one collision in two seeds is 0.5, which would round to 0."""


def main() -> None:
    try:
        import carla  # noqa: F401
    except ImportError:
        print("capacity: the package carla is not installed")
        return
    levels = [int(v) for v in os.environ.get("ODSCEN_BENCH_LEVELS", "100,300,500").split(",")]
    seeds = [int(v) for v in os.environ.get("ODSCEN_BENCH_SEEDS", "1,2").split(",")]
    print("ours / netconvert's / netconvert's with the same limits, stop signs and speeds in turns")
    print(
        "| map | lights | per hour and km | arrived | delay, s | trip, s | teleports | collisions |"
    )
    print("|---|---|---|---|---|---|---|---|")
    ratios = []
    for name in _maps():
        with tempfile.TemporaryDirectory() as folder:
            path = name if isinstance(name, Path) else _made_map(name, Path(folder))
            versions = _versions(path, Path(folder))
            for file, label in versions[: 1 if ONLY_ON else None]:
                try:
                    bench = _bench_of(file, Path(folder), label, places=path)
                except subprocess.CalledProcessError:
                    print(f"| {label} | | | netconvert cannot read it |")
                    break
                if bench.kilometres < LEAST_LANES and path.stem not in HIGH_LEVELS:
                    break
                for level in HIGH_LEVELS.get(path.stem, levels):
                    ratios += bench.measure(level, seeds)
    if ratios:
        print(f"median ratio of delays, of the same limits {statistics.median(ratios):.2f}")


def _versions(path: Path, folder: Path) -> list[tuple[Path, str]]:
    """The map and, where it has limits or signs that netconvert does not read, a bare one."""
    from odscen.opendrive.objects import signal_kind
    from odscen.opendrive.parse import parse

    label = path.stem if path.parent.name == "maps" else f"{path.parent.name}/{path.stem}"
    root = ET.fromstring(path.read_bytes())
    odr = parse(path.read_bytes(), file=path.name)
    signs = {
        signal.id
        for road in odr.roads.values()
        for signal in road.signals
        if signal_kind(signal) in ("stop", "yield")
    }
    stripped = 0
    for parent in list(root.iter()):
        for child in list(parent):
            sign = child.tag in ("signal", "signalReference") and child.get("id") in signs
            if child.tag == "speed" or sign:
                parent.remove(child)
                stripped += 1
            elif child.tag == "type" and parent.tag == "road":
                child.set("type", "town")
    if not stripped:
        return [(path, label)]
    bare = folder / path.name
    bare.write_bytes(ET.tostring(root))
    return [(path, label), (bare, f"{label}, bare")]


def _made_map(name: str, folder: Path) -> Path:
    from tools.make_maps.__main__ import map_text

    path = folder / "maps" / f"{name}.xodr"
    path.parent.mkdir()
    path.write_text(map_text(name), encoding="utf-8", newline="\n")
    return path


def _maps() -> list[Path | str]:
    """Files of maps, and names of those that are made."""
    own = sorted((Path(__file__).parents[1] / "maps").glob("*.xodr"))
    shared = shared_maps()
    found = own + (sorted(shared.rglob("*.xodr")) if shared else [])
    names = [name for name in os.environ.get("ODSCEN_BENCH_MAPS", "").split(",") if name]
    called = {path: {path.stem, f"{path.parent.name}/{path.stem}"} for path in found}
    if not names:
        return [*found]
    made = [name for name in names if not any(name in own for own in called.values())]
    return [*(path for path in found if called[path] & set(names)), *made]


def _bench_of(path: Path, folder: Path, label: str, *, places: Path) -> NetworkBench:
    """Ours of an OpenDRIVE map, netconvert's, and netconvert's with the same limits."""
    import carla

    files = {"ours": folder / "ours.net.xml", "netconvert": folder / "peer.net.xml"}
    build_own(path, files["ours"], control=CONTROL)
    text = path.read_text(encoding="utf-8", errors="replace")
    left = ["--lefthand"] if 'rule="LHT"' in text else []
    run_tool("netconvert", "--opendrive-files", path, "-o", files["netconvert"],
          "--no-turnarounds", "--no-warnings", *left)  # fmt: skip
    limited, net = folder / "limited.xodr", folder / "limited.net.xml"
    map_with_limits(path, limited)
    run_tool("netconvert", "--opendrive-files", limited, "-o", net,
          "--no-turnarounds", "--no-warnings", *left)  # fmt: skip
    add_signs_and_inner_limits(path, files["ours"], net)
    files["limited"] = net
    text = places.read_text(encoding="utf-8", errors="replace")
    lengths = {r.get("id"): float(r.get("length", 0)) for r in ET.fromstring(text).iter("road")}
    waypoints = [
        w
        for w in carla.Map(path.stem, text).generate_waypoints(SPACING)
        if not w.is_junction
        and w.lane_width >= NARROWEST
        and FROM_ENDS < w.s < lengths.get(str(w.road_id), 0.0) - FROM_ENDS
    ]
    return NetworkBench(folder, label, files, [_place_of(w.transform) for w in waypoints])


def _place_of(transform: Any) -> tuple[float, float, float]:
    """x, y and heading in OpenDRIVE's frame of a transform of CARLA's."""
    location, yaw = transform.location, transform.rotation.yaw
    return location.x, -location.y, math.radians(-yaw)


class NetworkBench:
    """Networks of one map, on which the same trips are driven.

    Parameters
    ----------
    folder
        For what is written.
    label
        Of its rows.
    files
        The networks, ours first and the one to compare with last.
    places
        Places that trips join: x and y in metres of the map, and heading.
    """

    def __init__(
        self,
        folder: Path,
        label: str,
        files: Mapping[str, Path],
        places: Sequence[tuple[float, float, float]],
    ) -> None:
        import sumolib

        self._label, self._folder, self._files = label, folder, dict(files)
        self._control = signals_of(files["ours"])
        self._waypoints = places
        self.kilometres = len(places) * SPACING / 1000.0
        self._nets = {name: sumolib.net.readNet(str(f)) for name, f in self._files.items()}
        self._known: dict[int, dict[str, _Place] | None] = {}

    def measure(self, level: int, seeds: Sequence[int]) -> list[float]:
        """Print a row with lights and one without; ratios of the delays to the last one's."""
        departs = self._trips(max(20, int(level * self.kilometres)))
        lit = bool(
            self._nets["ours"].getTrafficLights() or self._nets["netconvert"].getTrafficLights()
        )
        ratios = []
        modes = ["on", "off"][: 1 if ONLY_ON else None] if lit else ["none"]
        if lit and level == HIGH_LEVELS.get(self._label, (0,))[-1]:
            self._walks()
            modes.append(WALKED)
        for lights in modes:
            outcomes = [self._run(name, departs, seeds, lights) for name in self._files]
            values = [
                " / ".join(f"{value:.{digits}f}" for value in some)
                for digits, some in zip(DIGITS, zip(*outcomes, strict=True), strict=True)
            ]
            print(f"| {self._label} | {lights} | {level} | {' | '.join(values)} |", flush=True)
            ratios.append(outcomes[0].delay / max(outcomes[-1].delay, 0.1))
        return ratios

    def _trips(self, count: int) -> dict[str, float]:
        """Departures of trips that both networks can route, which are left in the folder."""
        rng = random.Random(1)
        number = len(self._waypoints)
        trips: list[tuple[int, int, float]] = []
        for _ in range(50 * count):
            one, other = rng.randrange(number), rng.randrange(number)
            if one != other and self._places(one) and self._places(other):
                trips.append((one, other, rng.uniform(0.0, HOUR)))
            if len(trips) == count:
                break
        trips.sort(key=lambda trip: trip[2])
        routed = {name: self._routed(name, trips) for name in self._files}
        both = [key for key in routed["ours"] if all(key in some for some in routed.values())]
        for name, vehicles in routed.items():
            text = "".join(
                ET.tostring(vehicles[key], encoding="unicode")
                for key in both
                if trips[int(key)][2] < END
            )
            (self._folder / f"{name}.rou.xml").write_text(f"<routes>{VTYPE}{text}</routes>")
        return {key: trips[int(key)][2] for key in both if trips[int(key)][2] < END}

    def _walks(self) -> None:
        """Write persons who walk from pavement to pavement, over all crossings."""
        rng = random.Random(1)
        pavements = [
            edge.getID()
            for edge in self._nets["ours"].getEdges(withInternal=False)
            if edge.allows("pedestrian") and not edge.allows("passenger")
        ]
        rows = []
        for number, depart in enumerate(sorted(rng.uniform(0.0, HOUR) for _ in range(PERSONS))):
            one, other = rng.sample(pavements, 2)
            rows.append(
                f'<person id="p{number}" depart="{depart:.1f}">'
                f'<walk from="{one}" to="{other}"/></person>'
            )
        (self._folder / "walks.xml").write_text(f"<routes>{''.join(rows)}</routes>")

    def _routed(self, name: str, trips: Sequence[tuple[int, int, float]]) -> dict[str, ET.Element]:
        rows = [VTYPE]
        for number, (one, other, depart) in enumerate(trips):
            start, end = (self._places(p) or {} for p in (one, other))
            rows.append(
                f'<trip id="{number}" type="car" depart="{depart:.1f}" from="{start[name].edge}"'
                f' departLane="best" departSpeed="max" departPos="{start[name].pos:.1f}"'
                f' to="{end[name].edge}" arrivalPos="{end[name].pos:.1f}"/>'
            )
        source, target = self._folder / "trips.xml", self._folder / "routed.xml"
        source.write_text(f"<routes>{''.join(rows)}</routes>")
        run_tool("duarouter", "-n", self._files[name], "-r", source, "-o", target,
              "--ignore-errors", "--no-warnings", "--no-step-log")  # fmt: skip
        return {v.get("id", ""): v for v in ET.parse(target).getroot().iter("vehicle")}

    def _places(self, number: int) -> dict[str, _Place] | None:
        if number not in self._known:
            place = self._waypoints[number]
            found = {name: _nearest(net, *place) for name, net in self._nets.items()}
            whole = {name: place for name, place in found.items() if place}
            self._known[number] = whole if len(whole) == len(found) else None
        return self._known[number]

    def _run(
        self, name: str, departs: dict[str, float], seeds: Sequence[int], lights: str
    ) -> _Outcome:
        outcomes = []
        info, stats = self._folder / "info.xml", self._folder / "stats.xml"
        off = ["--tls.all-off"] if lights == "off" else []
        if name == "ours" and lights != "off" and self._control.exists():
            off = ["-a", str(self._control)]
        routes = [
            f"{name}.rou.xml",
            *(["walks.xml"] if lights == WALKED and name == "ours" else []),
        ]
        files = ",".join(str(self._folder / file) for file in routes)
        for seed in seeds:
            run_tool("sumo", "-n", self._files[name], "-r", files,
                  "--end", f"{END:g}", "--step-length", "0.5", "--seed", str(seed),
                  "--tripinfo-output", info, "--tripinfo-output.write-unfinished",
                  "--statistic-output", stats, "--no-warnings", "--no-step-log",
                  "--collision.check-junctions", "true", "--collision.action", "warn",
                  *off)  # fmt: skip
            seen = {t.get("id"): t for t in ET.parse(info).getroot().iter("tripinfo")}
            root = ET.parse(stats).getroot()
            counts = [root.find("teleports"), root.find("safety")]
            arrived = [
                float(t.get("duration", 0))
                for t in seen.values()
                if float(t.get("arrival", -1)) >= 0
            ]
            delays = [_delay(seen.get(key), depart) for key, depart in departs.items()]
            outcomes.append(
                _Outcome(
                    len(arrived),
                    statistics.fmean(delays),
                    statistics.fmean(arrived) if arrived else 0.0,
                    float(counts[0].get("total", 0)) if counts[0] is not None else 0.0,
                    float(counts[1].get("collisions", 0)) if counts[1] is not None else 0.0,
                )
            )
        return _Outcome(*(statistics.fmean(values) for values in zip(*outcomes, strict=True)))


def _delay(trip: ET.Element | None, depart: float) -> float:
    if trip is None:
        return END - depart
    return float(trip.get("timeLoss", 0)) + max(0.0, float(trip.get("departDelay", 0)))


def _nearest(net: Any, x: float, y: float, heading: float) -> _Place | None:
    """The nearest car lane that points the same way."""
    from sumolib.geomhelper import polygonOffsetAndDistanceToPoint, positionAtShapeOffset

    dx, dy = net.getLocationOffset()
    point = (x + dx, y + dy)
    for lane, _ in sorted(net.getNeighboringLanes(*point, REACH), key=lambda found: found[1]):
        if lane.getEdge().getFunction() or not lane.allows("passenger"):
            continue
        shape = lane.getShape()
        drawn = sum(math.dist(a, b) for a, b in pairwise(shape))
        way, _ = polygonOffsetAndDistanceToPoint(point, shape)
        before = positionAtShapeOffset(shape, max(way - 0.5, 0.0))
        after = positionAtShapeOffset(shape, min(way + 0.5, drawn - 1e-3))
        direction = math.atan2(after[1] - before[1], after[0] - before[0])
        if math.cos(direction - heading) > 0.7:
            return _Place(lane.getEdge().getID(), way / drawn * lane.getLength())
    return None


def build_own(path: Path, target: Path, *, control: str | None = None) -> None:
    """Write our network of an OpenDRIVE map, and how its lights are run if a control is said.

    Fixed times are in the network itself.
    """
    from odscen.convert.building.network import build_network
    from odscen.lanegraph.build_graphs import build_map_graph
    from odscen.opendrive.lanes import RoadTable
    from odscen.opendrive.parse import parse
    from odscen.scenario.document.signals_document import Signals
    from odscen.scenario.edits import new_scenario
    from odscen.sumo.realize.lights.light_realization import realized_lights
    from odscen.sumo.realize.lights.program_files import signals_xml
    from odscen.sumo.realize.sumo_map import SumoMap

    odr = parse(path.read_bytes(), file=path.name)
    table = RoadTable.of(odr)
    graph = build_map_graph(odr, name=path.stem, sha256="0" * 64, table=table)
    network = build_network(odr, table, graph.walks)
    fixed = network.net_xml.replace(b' type="actuated" ', b' type="static" ')
    target.write_bytes(fixed if control == "fixed" else network.net_xml)
    if control not in (None, "fixed"):
        lights = realized_lights(
            new_scenario(graph, name="control", roi=graph.segments.ids).model_copy(
                update={"signals": Signals.model_validate({"control": control})}
            ),
            SumoMap.of(graph, network.table),
        )
        if (text := signals_xml(lights)) is not None:
            signals_of(target).write_text(text, encoding="utf-8")


def signals_of(network: Path) -> Path:
    """File beside a network with how its lights are run; not there if as the network says."""
    return network.with_suffix(".signals.add.xml")


def run_tool(name: str, *arguments: object) -> None:
    """Run one of SUMO's programs."""
    import sumo

    home = Path(sumo.SUMO_HOME)
    subprocess.run(
        [home / "bin" / name, *map(str, arguments)],
        check=True, capture_output=True, env={**os.environ, "SUMO_HOME": str(home)},
    )  # fmt: skip
