"""What drivers of odscen carry where traffic waits, against the Highway Capacity Manual (HCM).

Saturation flow: headways from the 4th to the last vehicle of a queue at a stop line, which the
HCM gives as 1,900 cars per hour and lane; on a straight approach at 50 km/h, and at
``signal_crossing``, whose connecting roads are limited to 30 km/h. Left turns from a minor road
with a stop and a yield sign, and from the major road, at ``t_junction_signs`` without its
crosswalks, against the potential capacity of HCM 7th edition, chapter 20; entries of
``roundabout`` against HCM 2010, chapter 22. Major and circulating traffic comes at random (Poisson)
and is counted where it conflicts; the minor queue never ends. Left turns through gaps of one lane
at the lights of ``signal_crossing``, 34 s of green in 69, against chapter 31 (critical and
follow-up headway 4.5 and 2.5 s, two vehicles at the end of each green; oncoming queues leave with
the saturation flow that was measured there). Vehicles are cars with normal drivers, as runs have
them, who take gaps as in runs.
``ODSCEN_BENCH_STEPS`` (0.1,0.2,0.5,1) and ``ODSCEN_BENCH_SEEDS`` (1) widen or narrow it.
"""

from __future__ import annotations

import math
import os
import random
import re
import statistics
import tempfile
from dataclasses import dataclass
from pathlib import Path
from xml.etree import ElementTree as ET

from bench.capacity import HOUR, build_own, run_tool
from odscen.base.categories import DEFAULT_BODY, Category
from odscen.figures.by_place.capacity import SNEAKERS
from odscen.scenario.document.drivers_document import Drivers
from odscen.scenario.signals.webster import CRITICAL_GAP, FOLLOW_UP
from odscen.sumo.realize.driving import draw_factor, driver
from odscen.sumo.realize.road_user import RoadUser
from odscen.sumo.realize.weather_effects import NO_EFFECT, WeatherEffect
from odscen.sumo.worker.simulation.session import open_session

MAPS = Path(__file__).parents[1] / "maps"
HCM_SATURATION = 1900.0
"""HCM's base saturation flow, cars per hour and lane."""
RED, GREEN, YELLOW = 60, 60, 3
FIRST = 4
"""Vehicle from which on the HCM measures."""
VOLUMES = (200, 400, 600, 800)
WARM_UP = 300.0
EAST = "2.0.f 2.1.f 1.2.b 1.1.b 1.0.b 4.1.b 4.0.b"
WEST = "4.0.f 4.1.f 1.0.f 1.1.f 1.2.f 2.1.b 2.0.b"


@dataclass(frozen=True)
class Turn:
    """A movement that gives way.

    ``own`` is the lane that it starts from, ``over`` are the routes of those who go first,
    ``counted`` the lanes at whose ends they are counted; ``critical`` and ``follow_up`` are the
    HCM's headways, s (the critical one of a left turn at a T-junction is 0.7 s less than at a
    crossing); none at a roundabout. ``starts`` are the lanes in which it and the others depart.
    """

    map: str
    route: str
    own: str
    over: tuple[str, ...]
    counted: tuple[str, ...]
    critical: float = 0.0
    follow_up: float = 0.0
    starts: tuple[str, str] = ("0", "0")

    def capacity(self, volume: float) -> float:
        """Vehicles per hour that the HCM says."""
        if not self.critical:
            return 1380.0 * math.exp(-0.00102 * volume)
        return (
            volume
            * math.exp(-volume * self.critical / HOUR)
            / (1.0 - math.exp(-volume * self.follow_up / HOUR))
        )


_T, _R = "t_junction_signs", "roundabout"
TURNS = {
    "left turn at a stop sign": Turn(
        _T, "3.0.f 3.1.f 2.1.b 2.0.b", "3.1.f_0", (EAST, WEST), ("2.1.f_0", "1.2.f_0"), 6.4, 3.5
    ),
    "left turn at a yield sign": Turn(
        _T, "5.0.f 5.1.f 4.1.b 4.0.b", "5.1.f_0", (EAST, WEST), ("4.1.f_0", "1.0.b_0"), 6.4, 3.5
    ),
    "left turn from the major road": Turn(
        _T, "4.0.f 4.1.f 1.0.f 1.1.f 1.2.f 3.1.b 3.0.b", "1.2.f_0", (EAST,), ("2.1.f_0",), 4.1, 2.2
    ),
    "roundabout entry": Turn(
        _R, "1.0.f 1.1.f 5.0.f 2.1.b 2.0.b", "1.1.f_0",
        ("4.0.f 4.1.f 8.0.f 5.0.f 6.0.f 3.1.b 3.0.b",), ("8.0.f_0",),
    ),
}  # fmt: skip


LEFT_GREEN, CYCLE = 34.0, 69.0
"""Seconds, of the light at which turns go through gaps."""
LEFT_TURN = Turn(
    "signal_crossing", "1.0.f 1.1.f 4.1.b 4.0.b", "1.1.f_2", ("3.0.f 3.1.f 1.1.b 1.0.b",),
    ("3.1.f_1",), CRITICAL_GAP, FOLLOW_UP, ("2", "1"),
)  # fmt: skip


def main() -> None:
    steps = os.environ.get("ODSCEN_BENCH_STEPS", "0.1,0.2,0.5,1").split(",")
    seeds = [int(seed) for seed in os.environ.get("ODSCEN_BENCH_SEEDS", "1").split(",")]
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        crossing = _saturation_table(folder, steps, seeds)
        _turn_table(folder, steps, seeds)
        _permissive_table(folder, steps, seeds, crossing)


def _saturation_table(folder: Path, steps: list[str], seeds: list[int]) -> list[float]:
    """Print saturation flows; those of ``signal_crossing``, by step."""
    straight, crossing = folder / "straight.net.xml", folder / "crossing.net.xml"
    straight_road(straight)
    build_own(MAPS / "signal_crossing.xodr", crossing, control="fixed")
    rows = {
        "straight, 50 km/h": (straight, "in out", "in_0", Drivers()),
        "signal_crossing": (crossing, "1.0.f 1.1.f 3.1.b 3.0.b", "1.1.f_1", Drivers()),
        "straight, saturation_flow 1700": (
            straight,
            "in out",
            "in_0",
            Drivers(saturation_flow=1700),
        ),
    }
    print(f"| saturation flow, veh/h (HCM {HCM_SATURATION:.0f}); step, s | {' | '.join(steps)} |")
    print(f"|---|{'---|' * len(steps)}")
    for name, (net, route, lane, drivers) in rows.items():
        flows = [
            statistics.fmean(
                saturation_flow(folder, net, route, lane, s, seed, drivers) for seed in seeds
            )
            for s in steps
        ]
        print(f"| {name} | {' | '.join(f'{flow:.0f}' for flow in flows)} |", flush=True)
        if name == "signal_crossing":
            of_crossing = flows
    return of_crossing


def _turn_table(folder: Path, steps: list[str], seeds: list[int]) -> None:
    print("\n| capacity, veh/h, and share of HCM's; step | conflicting volume and capacity |")
    print("|---|---|")
    maps = {turn.map for turn in TURNS.values()}
    nets = {name: build_without_crosswalks(name, folder) for name in sorted(maps)}
    for name, turn in TURNS.items():
        for step in steps:
            cells = []
            for volume in VOLUMES:
                found = [
                    count_entered(folder, nets[turn.map], turn, volume, step, s) for s in seeds
                ]
                met, served, collided = (statistics.fmean(v) for v in zip(*found, strict=True))
                share = served / statistics.fmean(turn.capacity(one[0]) for one in found)
                hit = f", {collided:g} collisions" if collided else ""
                cells.append(f"{met:.0f}: {served:.0f} ({share:.2f}{hit})")
            print(f"| {name}; {step} s | {'; '.join(cells)} |", flush=True)


def build_without_crosswalks(name: str, folder: Path) -> Path:
    """Build the network of a shipped map on which nobody walks."""
    source, net = folder / f"{name}.xodr", folder / f"{name}.net.xml"
    text = (MAPS / f"{name}.xodr").read_text()
    source.write_text(
        re.sub(r'<object [^>]*type="crosswalk".*?</object>', "", text, flags=re.DOTALL)
    )
    build_own(source, net, control="fixed")
    return net


def permissive_capacity(volume: float, saturation: float = HCM_SATURATION) -> float:
    """Left turns an hour through gaps of oncoming traffic: HCM chapter 31.

    Parameters
    ----------
    saturation
        Vehicles an hour with which oncoming queues leave.
    """
    arriving, leaving = volume / HOUR, saturation / HOUR
    queue = arriving * (CYCLE - LEFT_GREEN) / (leaving - arriving)
    through = LEFT_TURN.capacity(volume)
    return (through * max(0.0, LEFT_GREEN - queue) + HOUR * SNEAKERS) / CYCLE


def _permissive_table(
    folder: Path, steps: list[str], seeds: list[int], saturation: list[float]
) -> None:
    print("\n| permissive left turn at lights, veh/h, and share of HCM's; step | oncoming |")
    print("|---|---|")
    net = folder / "lights.net.xml"
    build_own(MAPS / "signal_crossing.xodr", net, control="fixed")
    for step, leaving in zip(steps, saturation, strict=True):
        cells = []
        for volume in VOLUMES:
            found = [_permissive(folder, net, volume, step, seed) for seed in seeds]
            met, served, collided = (statistics.fmean(v) for v in zip(*found, strict=True))
            share = served / permissive_capacity(met, leaving)
            hit = f", {collided:g} collisions" if collided else ""
            cells.append(f"{met:.0f}: {served:.0f} ({share:.2f}{hit})")
        print(f"| {step} s | {'; '.join(cells)} |", flush=True)


def _permissive(
    folder: Path, net: Path, volume: int, step: str, seed: int
) -> tuple[float, float, float]:
    """Oncoming vehicles and left turns, an hour, and collisions."""
    root = ET.parse(net).getroot()
    light = next(root.iter("tlLogic")).get("id", "")
    roads = {
        int(link.get("linkIndex", 0)): (link.get("from"), link.get("dir"))
        for link in root.iter("connection")
        if link.get("tl") == light
    }
    shown = [roads[index] for index in sorted(roads)]
    phases = "".join(
        f'<phase duration="{seconds}" state="'
        + "".join(
            "r" if road not in ("1.1.f", "3.1.f") else left if turn == "l" else other
            for road, turn in shown
        )
        + '"/>'
        for seconds, left, other in (
            (LEFT_GREEN, "g", "G"),
            (YELLOW, "y", "y"),
            (CYCLE - LEFT_GREEN - YELLOW, "r", "r"),
        )
    )
    program = f'<tlLogic id="{light}" type="static" programID="gaps" offset="0">{phases}</tlLogic>'
    return count_entered(folder, net, LEFT_TURN, volume, step, seed, program)


def straight_road(net: Path, *, limit: float = 13.89) -> None:
    """Write a lane with a light after 800 m; ``limit`` in m/s."""
    nodes, edges = net.with_suffix(".nod.xml"), net.with_suffix(".edg.xml")
    nodes.write_text(
        '<nodes><node id="a" x="0" y="0"/><node id="light" x="800" y="0" type="traffic_light"/>'
        '<node id="b" x="1300" y="0"/></nodes>'
    )
    edges.write_text(
        f'<edges><edge id="in" from="a" to="light" numLanes="1" speed="{limit}"/>'
        f'<edge id="out" from="light" to="b" numLanes="1" speed="{limit}"/></edges>'
    )
    run_tool("netconvert", "-n", nodes, "-e", edges, "-o", net, "--no-warnings")


def saturation_flow(
    folder: Path,
    net: Path,
    route: str,
    lane: str,
    step: str,
    seed: int,
    drivers: Drivers,
    weather: WeatherEffect = NO_EFFECT,
) -> float:
    """Vehicles per hour of green that leave a queue, after the first."""
    light = next(one for one in ET.parse(net).getroot().iter("tlLogic"))
    width = len(light.find("phase").get("state", ""))  # type: ignore[union-attr]
    phases = "".join(
        f'<phase duration="{seconds}" state="{state * width}"/>'
        for seconds, state in ((RED, "r"), (GREEN, "G"), (YELLOW, "y"))
    )
    loop = folder / "loop.xml"
    (folder / "extra.xml").write_text(
        f'<additional><tlLogic id="{light.get("id")}" type="static" programID="queue" offset="0">'
        f'{phases}</tlLogic><instantInductionLoop id="line" lane="{lane}" pos="-0.1"'
        f' file="{loop}"/></additional>'
    )
    queue = [(float(second), route, lane.rpartition("_")[2]) for second in range(2400)]
    run_cars(folder, net, queue, seed=seed, step=step, end=2460.0, drivers=drivers, weather=weather)
    cycle = RED + GREEN + YELLOW
    passed: dict[int, list[float]] = {}
    for event in ET.parse(loop).getroot():
        if event.get("state") == "enter":
            number, second = divmod(float(event.get("time", 0)), cycle)
            if number >= 2 and RED <= second <= RED + GREEN:
                passed.setdefault(int(number), []).append(second)
    headways = [
        (max(times) - sorted(times)[FIRST - 1]) / (len(times) - FIRST) for times in passed.values()
    ]
    return HOUR / statistics.fmean(headways)


def count_entered(
    folder: Path, net: Path, turn: Turn, volume: int, step: str, seed: int, program: str = ""
) -> tuple[float, float, float]:
    """Conflicting volume and capacity, vehicles per hour, and collisions."""
    rng = random.Random(seed)
    end = WARM_UP + HOUR
    departs = [(k * 1.8, turn.route, turn.starts[0]) for k in range(int(end / 1.8))]
    for route in turn.over:
        time = 0.0
        while (time := time + rng.expovariate(volume / len(turn.over) / HOUR)) < end:
            departs.append((time, route, turn.starts[1]))
    loops, lanes = folder / "loop.xml", (turn.own, *turn.counted)
    (folder / "extra.xml").write_text(
        f"<additional>{program}"
        + "".join(
            f'<inductionLoop id="{lane}" lane="{lane}" pos="-0.5" period="{WARM_UP:g}"'
            f' file="{loops}"/>'
            for lane in lanes
        )
        + "</additional>"
    )
    run_cars(folder, net, sorted(departs), seed=seed, step=step, end=end)
    counts = dict.fromkeys(lanes, 0)
    for row in ET.parse(loops).getroot():
        if float(row.get("begin", 0)) >= WARM_UP:
            counts[row.get("id", "")] += int(row.get("nVehContrib", 0))
    safety = ET.parse(folder / "stats.xml").getroot().find("safety")
    collisions = 0.0 if safety is None else float(safety.get("collisions", 0))
    return float(sum(counts[lane] for lane in turn.counted)), float(counts[turn.own]), collisions


def run_cars(
    folder: Path,
    net: Path,
    departs: list[tuple[float, str, str]],
    *,
    seed: int,
    step: str,
    end: float,
    drivers: Drivers | None = None,
    weather: WeatherEffect = NO_EFFECT,
) -> None:
    """Run cars that depart at a time on a route and lane, with what ``extra.xml`` says."""
    user = RoadUser("car", Category.CAR, 0, 0, depart=0.0)
    manner = driver(
        user,
        DEFAULT_BODY[Category.CAR],
        factor=1.0,
        limit=None,
        weather=weather,
        drivers=drivers or Drivers(),
        step_length=float(step),
    )
    attributes = " ".join(f'{name}="{value}"' for name, value in manner.attributes)
    cars = (
        f'<vehicle id="{number}" type="car" depart="{time:.1f}" departLane="{lane}"'
        f' departSpeed="max" speedFactor="'
        f'{draw_factor(seed, str(number), "normal", Category.CAR) * weather.speed}">'
        f'<route edges="{route}"/>'
        "</vehicle>"
        for number, (time, route, lane) in enumerate(departs)
    )
    routes = folder / "routes.xml"
    routes.write_text(f'<routes><vType id="car" {attributes}/>{"".join(cars)}</routes>')
    arguments = ["-n", net, "-r", routes, "-a", folder / "extra.xml",
          "--step-length", step, "--seed", seed, "--statistic-output", folder / "stats.xml",
          "--collision.action", "warn", "--collision.mingap-factor", "0",
          "--collision.check-junctions", "--no-step-log", "--no-warnings"]  # fmt: skip
    with open_session([str(argument) for argument in arguments]) as session:
        while session.time < end:
            session.turning_gaps.before_step()
            session.step()
            session.turning_gaps.after_step()
