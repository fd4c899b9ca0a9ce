"""How lights are best run when no demand is known: delay of programs under all mixes of loads.

A crossing of a wide road and a minor one with left-turn lanes, from ``tools/make_maps``, and the
shipped ``signal_crossing``. Of each mix (vehicles on a leg of the main road against one of the side
road) and level (vehicles an hour on all legs, at random in time), a fifth turns left and a fifth
right. Twenty minutes with SUMO's drivers, the same vehicles for all programs. The regret
of a program is what it has more than the best one of its row; *Webster* knows the demand.
``python -m bench default_programs`` prints the tables of ``docs/signals.md``.
"""

from __future__ import annotations

import random
import statistics
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any
from xml.etree import ElementTree as ET

from bench.capacity import VTYPE, build_own, run_tool
from odscen.convert.model.net import STAGE
from odscen.convert.signals.signal_programs import LEAST_GREEN, LONGEST_CYCLE, SHORTEST_CYCLE
from tools.make_maps.__main__ import SHIPPED, map_text

if TYPE_CHECKING:
    from collections.abc import Sequence

SECONDS = 1200
SEEDS = (1,)
MIXES = ((4, 1), (2, 1), (1, 1), (1, 2))
MAPS = {"arterial_crossing": (1500, 2500, 3500), "signal_crossing": (800, 1200, 1600)}
"""Vehicles an hour on all legs; the last is more than the crossing carries of some mixes."""
PROGRAMS = ("odscen's", "90 s", "by lanes", "Webster", "actuated", "self-adjusting")
SHARES = {"l": 0.2, "s": 0.6, "r": 0.2}
SATURATION = 1700.0
"""Vehicles an hour and lane that SUMO's default drivers make of a green."""


@dataclass(frozen=True)
class _Crossing:
    """A network with one light; ``legs`` are edges before it, of the main road first."""

    net: Path
    legs: tuple[str, ...]
    exits: dict[str, dict[str, str]]
    """Of each leg: the edge that each direction leads to."""
    lanes: dict[str, int]
    starts: dict[str, tuple[str, ...]]
    """Of each leg: edges from the border to it."""


def main() -> None:
    """Print a table for each map."""
    for name, levels in MAPS.items():
        with tempfile.TemporaryDirectory() as folder:
            crossing = _build_crossing(name, Path(folder))
            print(f"\n{name}: mean delay, s\n")
            print(f"| main : side | veh/h | {' | '.join(PROGRAMS)} | best |")
            print(f"|---|---|{'---|' * len(PROGRAMS)}---|")
            regrets: dict[str, list[float]] = {label: [] for label in PROGRAMS}
            for mix in MIXES:
                for level in levels:
                    delays = _delays(crossing, mix, level, Path(folder))
                    best = min(delays, key=lambda label: delays[label])
                    cells = " | ".join(f"{delays[label]:.1f}" for label in PROGRAMS)
                    print(f"| {mix[0]} : {mix[1]} | {level} | {cells} | {best} |", flush=True)
                    for label, delay in delays.items():
                        regrets[label].append(delay - delays[best])
            for what, of in (("mean", statistics.fmean), ("largest", max)):
                cells = " | ".join(f"{of(regrets[label]):.1f}" for label in PROGRAMS)
                print(f"| {what} regret | | {cells} | |", flush=True)


def _build_crossing(name: str, folder: Path) -> _Crossing:
    import sumolib

    file = SHIPPED / f"{name}.xodr"
    if not file.is_file():
        file = folder / f"{name}.xodr"
        file.write_text(map_text(name), encoding="utf-8")
    path = folder / "crossing.net.xml"
    build_own(file, path, control="fixed")
    net = sumolib.net.readNet(str(path))
    (light,) = net.getTrafficLights()
    exits: dict[str, dict[str, str]] = {}
    lanes: dict[str, set[int]] = {}
    for source, target, _ in light.getConnections():
        if source.allows("passenger") and target.allows("passenger"):
            leg, out = source.getEdge(), target.getEdge()
            way = next(c.getDirection() for c in leg.getOutgoing()[out])
            exits.setdefault(leg.getID(), {})[way] = out.getID()
            lanes.setdefault(leg.getID(), set()).add(source.getIndex())

    # The wide and fast road, and in a crossing of equals that from west to east, is the main one.
    def rank(leg: str) -> tuple[float, int, float]:
        (x0, y0), (x1, y1) = net.getEdge(leg).getShape()[0], net.getEdge(leg).getShape()[-1]
        return net.getEdge(leg).getSpeed(), len(lanes[leg]), abs(x1 - x0) - abs(y1 - y0)

    legs = tuple(sorted(exits, key=rank, reverse=True))
    counts = {leg: len(own) for leg, own in lanes.items()}
    return _Crossing(path, legs, exits, counts, {leg: _edges_to(net, leg) for leg in legs})


def _edges_to(net: Any, leg: str) -> tuple[str, ...]:
    edges = [net.getEdge(leg)]
    while before := [e for e in edges[0].getIncoming() if e.allows("passenger")]:
        edges.insert(0, before[0])
    return tuple(edge.getID() for edge in edges)


def _change_program(
    label: str, logic: ET.Element, crossing: _Crossing, volumes: dict[str, float]
) -> None:
    """Make one of :data:`PROGRAMS` of odscen's ``tlLogic``, given the vehicles an hour of legs."""
    stages = _stage_legs(logic, crossing)
    lanes = [float(max(crossing.lanes[leg] for leg in legs)) for _, legs in stages]
    ratios = [max(_flow_ratio(crossing, leg, volumes) for leg in legs) for _, legs in stages]
    total = sum(float(phase.get("duration", 0)) for phase in logic.iter("phase"))
    green = sum(float(phase.get("duration", 0)) for phase, _ in stages)
    lost = total - green
    match label:
        case "90 s":
            _set_greens(stages, 90.0 - lost, [1.0] * len(stages))
        case "by lanes":
            _set_greens(stages, green, lanes)
        case "Webster":
            cycle = (1.5 * lost + 5.0) / max(1.0 - sum(ratios), 0.01)
            cycle = min(max(cycle, SHORTEST_CYCLE), LONGEST_CYCLE)
            _set_greens(stages, cycle - lost, ratios)
        case "actuated":
            _let_adapt(logic, "actuated")
        case "self-adjusting":
            _let_adapt(logic, "delay_based")


def _flow_ratio(crossing: _Crossing, leg: str, volumes: dict[str, float]) -> float:
    """Volume of a leg without its left turns, which have a lane, over what its lanes carry."""
    return 0.8 * volumes[leg] / ((crossing.lanes[leg] - 1) * SATURATION)


def _stage_legs(logic: ET.Element, crossing: _Crossing) -> list[tuple[ET.Element, set[str]]]:
    """Phases that are stages, with the legs that have green."""
    root = ET.parse(crossing.net).getroot()
    links = {
        int(link.get("linkIndex", 0)): link.get("from", "")
        for link in root.iter("connection")
        if link.get("tl") == logic.get("id")
    }
    return [
        (phase, legs)
        for phase in logic.iter("phase")
        if phase.get("name", "").startswith(STAGE)
        and (
            legs := {
                links[n]
                for n, letter in enumerate(phase.get("state", ""))
                if letter in "Gg" and links[n] in crossing.lanes
            }
        )
    ]


def _set_greens(
    stages: Sequence[tuple[ET.Element, set[str]]], green: float, weights: Sequence[float]
) -> None:
    """Divide seconds of green among stages in proportion to weights."""
    for (phase, _), weight in zip(stages, weights, strict=True):
        phase.set("duration", f"{max(round(green * weight / sum(weights)), LEAST_GREEN):g}")


def _let_adapt(logic: ET.Element, kind: str) -> None:
    """Let SUMO prolong stages up to twice their green, from the least green on."""
    logic.set("type", kind)
    for phase in logic.iter("phase"):
        if phase.get("name", "").startswith(STAGE):
            seconds = float(phase.get("duration", 0))
            phase.set("minDur", f"{min(LEAST_GREEN, seconds):g}")
            phase.set("maxDur", f"{2.0 * seconds:g}")


def _delays(
    crossing: _Crossing, mix: tuple[int, int], level: int, folder: Path
) -> dict[str, float]:
    """Mean delay with each program, insertion delay included; all that depart count."""
    parts = [mix[0] if number < 2 else mix[1] for number in range(4)]
    volumes = {
        leg: level * part / sum(parts) for leg, part in zip(crossing.legs, parts, strict=True)
    }
    routes, departs = _vehicles(crossing, volumes, folder)
    text = crossing.net.read_text(encoding="utf-8")
    delays = {}
    for label in PROGRAMS:
        root = ET.fromstring(text)
        for logic in root.iter("tlLogic"):
            _change_program(label, logic, crossing, volumes)
        net = folder / "changed.net.xml"
        net.write_bytes(ET.tostring(root))
        delays[label] = statistics.fmean(_drive(net, routes, departs, folder, s) for s in SEEDS)
    return delays


def _vehicles(
    crossing: _Crossing, volumes: dict[str, float], folder: Path
) -> tuple[Path, dict[str, float]]:
    rng = random.Random(1)
    rows: list[tuple[float, str]] = []
    for leg, volume in volumes.items():
        time = rng.expovariate(volume / 3600.0)
        while time < SECONDS:
            ways = sorted(set(crossing.exits[leg]) & SHARES.keys())
            way = rng.choices(ways, [SHARES[letter] for letter in ways])[0]
            rows.append((time, " ".join((*crossing.starts[leg], crossing.exits[leg][way]))))
            time += rng.expovariate(volume / 3600.0)
    rows.sort()
    lines = [
        f'<vehicle id="{number}" type="car" depart="{time:.1f}" departLane="best"'
        f' departSpeed="max"><route edges="{edges}"/></vehicle>'
        for number, (time, edges) in enumerate(rows)
    ]
    file = folder / "routes.xml"
    file.write_text(f"<routes>{VTYPE}{''.join(lines)}</routes>")
    return file, {str(number): time for number, (time, _) in enumerate(rows)}


def _drive(net: Path, routes: Path, departs: dict[str, float], folder: Path, seed: int) -> float:
    info = folder / "info.xml"
    run_tool("sumo", "-n", net, "-r", routes, "--end", str(SECONDS), "--step-length", "0.5",
          "--seed", str(seed), "--tripinfo-output", info, "--tripinfo-output.write-unfinished",
          "--no-warnings", "--no-step-log")  # fmt: skip
    seen = {trip.get("id", ""): trip for trip in ET.parse(info).getroot().iter("tripinfo")}
    delays: Sequence[float] = [
        float(seen[key].get("timeLoss", 0)) + max(0.0, float(seen[key].get("departDelay", 0)))
        if key in seen
        else SECONDS - depart
        for key, depart in departs.items()
    ]
    return statistics.fmean(delays)
