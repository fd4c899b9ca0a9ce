"""A recorded run by odscen against bare ``sumo`` that records the same from the same files.

Aim: at most 1.10 with 1,000 vehicles or more. odscen's part is the whole worker process: start of
Python and libsumo, recording events, writing actors and events. The cost of recording itself is the
second ratio, to ``sumo`` without output.
"""

from __future__ import annotations

import os
import random
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path

from bench.common import without_output
from odscen.records.run_plan import Plan, PlannedActor
from odscen.runs import layout
from odscen.sumo.realize.measure_files import interval_of, measures_xml
from odscen.sumo.realize.sumocfg import SumocfgSettings, sumo_config

VEHICLES = 1500
CROSSINGS = 20
SECONDS = 600.0
REPEATS = 3


def main() -> None:
    import sumo

    binaries = Path(sumo.SUMO_HOME) / "bin"
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        prepare(folder, binaries)
        config = folder / layout.SUMO_FOLDER / layout.CONFIG_FILE
        bare = without_output(config)
        commands = {
            "odscen": [
                sys.executable,
                "-m",
                "odscen.sumo.worker.simulate",
                str(folder / layout.PLAN_FILE),
            ],
            "sumo": [str(binaries / "sumo"), "-c", str(config)],
            "bare": [str(binaries / "sumo"), "-c", str(bare)],
        }
        times = interleaved(commands)
        same = (folder / layout.TRAJECTORIES_FILE).read_bytes() == (
            config.with_name(layout.TRAJECTORIES_FILE).read_bytes()
        )
    middle = {name: statistics.median(values) for name, values in times.items()}
    to_peer = statistics.median(a / b for a, b in zip(times["odscen"], times["sumo"], strict=True))
    to_bare = statistics.median(a / b for a, b in zip(times["odscen"], times["bare"], strict=True))
    print(
        f"recorded run, {VEHICLES} vehicles, {SECONDS:g} s: odscen {middle['odscen']:.2f} s, "
        f"sumo with the same output {middle['sumo']:.2f} s, ratio {to_peer:.2f} (aim 1.10); "
        f"sumo without output {middle['bare']:.2f} s, ratio {to_bare:.2f}; "
        f"trajectories {'identical' if same else 'DIFFER'}"
    )


def interleaved(commands: dict[str, list[str]]) -> dict[str, list[float]]:
    """CPU seconds of each command, in turn; one round goes first and is not counted.

    CPU seconds, user and system, because wall time on a shared machine measures the neighbours.
    """
    times: dict[str, list[float]] = {name: [] for name in commands}
    for turn in range(REPEATS + 1):
        for name, command in commands.items():
            before = os.times()
            subprocess.run(command, check=True, capture_output=True)
            after = os.times()
            spent = after.children_user + after.children_system
            spent -= before.children_user + before.children_system
            if turn:
                times[name].append(spent)
    return times


def prepare(folder: Path, binaries: Path) -> None:
    """Write a run folder: a signalised grid, ways of 10 to 25 streets, departures within 60 s."""
    sumo_folder = folder / layout.SUMO_FOLDER
    sumo_folder.mkdir()
    net = sumo_folder / layout.NET_FILE
    subprocess.run(
        [
            binaries / "netgenerate", "--grid", f"--grid.number={CROSSINGS}", "--grid.length=200",
            "--default.lanenumber=2", "--tls.guess", "--no-turnarounds", "-o", net,
        ],
        check=True,
        capture_output=True,
    )  # fmt: skip
    (sumo_folder / layout.ROUTES_FILE).write_text(_routes(net), encoding="utf-8")
    settings = SumocfgSettings(until=SECONDS, step_length=0.5, seed=1, measures=True)
    (sumo_folder / layout.CONFIG_FILE).write_text(sumo_config(settings), encoding="utf-8")
    measures = measures_xml(interval_of(SECONDS), emissions=True)
    (sumo_folder / layout.MEASURES_FILE).write_text(measures, encoding="utf-8")
    actors = tuple(
        PlannedActor(
            id=f"v{i}", category="car", spawn="1.0.-1.0", goal="1.0.-1.1", depart=_depart(i),
            length=5.0, width=1.8, x=0.0, y=0.0, z=0.0, hdg=0.0,
        )
        for i in range(VEHICLES)
    )  # fmt: skip
    plan = Plan("bench", 1, SECONDS, 0.5, (0.0, 0.0), actors)
    (folder / layout.PLAN_FILE).write_text(plan.to_json(), encoding="utf-8")


def _depart(index: int) -> float:
    return round(60.0 * index / VEHICLES, 2)


def _routes(net: Path) -> str:
    import sumolib

    rng = random.Random(1)
    edges = sorted(sumolib.net.readNet(str(net)).getEdges(), key=lambda edge: edge.getID())
    lines = ["<routes>", '    <vType id="car" speedFactor="1" speedDev="0"/>']
    for index in range(VEHICLES):
        way = [rng.choice(edges)]
        for _ in range(rng.randint(10, 25)):
            onwards = sorted(way[-1].getOutgoing(), key=lambda edge: edge.getID())
            if not onwards:
                break
            way.append(rng.choice(onwards))
        lines.append(
            f'    <vehicle id="v{index}" type="car" depart="{_depart(index)}" departLane="best" '
            f'departPos="random_free" departSpeed="0"><route edges="'
            f'{" ".join(edge.getID() for edge in way)}"/></vehicle>'
        )
    return "\n".join([*lines, "</routes>", ""])
