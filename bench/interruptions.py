"""A long run killed with signal 9 again and again, against the same run left alone.

``python -m bench.interruptions [MAP.xodr] [--hours H] [--weekday TRIPS] [--kills N] [--meso]``:
traffic on a map (the shipped town, 2 hours, if not given) in slices of 10 minutes; with
``--weekday`` the hours from 7:00 on of a weekday with so many trips. The command line
is killed at 20 random moments, half of the time with all of its processes, and resumed each time,
the last time to its end. The results must be the same bytes, and nothing that was there before a
kill may be gone or different after it.
"""

from __future__ import annotations

import argparse
import os
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from contextlib import suppress
from pathlib import Path

from odscen.app import demands
from odscen.app.scenarios import SUFFIX, generate, read_scenario, write_scenario
from odscen.catalog.shipped import shipped_maps
from odscen.catalog.store import Workspace
from odscen.scenario.demand_edits import set_clock
from odscen.scenario.document import Flow
from odscen.scenario.files import dumps
from odscen.scenario.generation_settings import GenerationSettings
from odscen.scenario.profiles import DAY, curve
from odscen.sumo.layout import RECORDED
from odscen.sumo.recorded import recorded_files

SLICE = 600.0
FLOWS = 40
PER_HOUR = 900.0
LONGEST = 0.7
"""Wall seconds until a kill at most, as a share of what the run alone takes."""


def main(
    given: Path | None = None,
    hours: float = 2.0,
    trips: float | None = None,
    kills: int = 20,
    *,
    meso: bool = False,
) -> None:
    path = given or next(p for p in shipped_maps() if p.stem == "town_5x5")
    chance = random.Random(1)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        workspace = Workspace.open(folder / "workspace")
        entry = workspace.add_map(path)
        if trips is None:
            scenario = traffic(workspace, entry.name, hours)
        else:
            scenario = morning(workspace, entry.name, hours, trips)
        cli = [sys.executable, "-m", "odscen"]
        options = ["--workspace", str(workspace.root)]
        run = [*cli, "run", str(scenario), *options, "--slice", f"{SLICE:g}"]
        run += ["--meso"] if meso else []
        start = time.perf_counter()
        subprocess.run([*run, "--out", str(folder / "alone")], check=True, capture_output=True)
        alone = time.perf_counter() - start
        target = folder / "killed" / scenario.name.removesuffix(SUFFIX)
        command = run = [*run, "--out", str(target.parent)]
        resume = [*cli, "resume", str(target), *options]
        expected = results(folder / "alone" / target.name)
        moments = lost = compared = differing = 0
        ended = False
        while not ended:
            before = recorded(target)
            patience = chance.uniform(0.2, LONGEST * alone) if moments < kills else None
            if kill(command, patience, worker=chance.random() < 0.5):
                compared += 1
                differing += results(target) != expected
                shutil.rmtree(target)
                command, ended = run, patience is None
                continue
            moments += 1
            after = recorded(target)
            lost += sum(after.get(file) != content for file, content in before.items())
            command = resume if (target / "status.json").is_file() else run
    print(
        f"{path.stem}{', meso' if meso else ''}, {hours:g} h in slices of {SLICE:g} s, "
        f"{alone:.0f} s of wall time alone: "
        f"killed {moments} times; {lost} files lost or changed by a kill; "
        f"{compared} runs came to their end, {differing} with other results"
    )


def traffic(workspace: Workspace, name: str, hours: float) -> Path:
    """Write a scenario of flows from places that sampling has chosen."""
    (path,) = generate(workspace, settings=GenerationSettings(map_name=name, seed=1, fill=0.5))
    sampled = read_scenario(path)
    flows = tuple(
        Flow(
            id=f"flow{i}", spawn=actor.spawn, per_hour=PER_HOUR / FLOWS, end=hours * 3600.0,
            mix={actor.category: 1.0},
        )
        for i, actor in enumerate(sampled.actors[:FLOWS])
    )  # fmt: skip
    simulation = sampled.simulation.model_copy(update={"duration": hours * 3600.0})
    update = {"actors": (), "flows": flows, "simulation": simulation}
    path.write_text(dumps(sampled.model_copy(update=update)), encoding="utf-8")
    return path


def morning(workspace: Workspace, name: str, hours: float, trips: float) -> Path:
    """Write a scenario of the hours from 7:00 on of a weekday, with their share of its trips.

    A matrix has the trips of the whole run: so all of them, as many as the share of the hours.
    """
    scenario, _ = demands.whole_day(workspace, name, trips=trips)
    scenario = set_clock(scenario, clock=7 * 3600.0)
    (matrix,) = scenario.demand.matrices
    part = curve(scenario.demand, matrix.profile).amount(hours * 3600.0) / DAY
    rows = tuple((origin, goal, number * part) for origin, goal, number in matrix.trips)
    demand = scenario.demand.model_copy(
        update={"matrices": (matrix.model_copy(update={"trips": rows}),)}
    )
    simulation = scenario.simulation.model_copy(update={"duration": hours * 3600.0})
    scenario = scenario.model_copy(update={"demand": demand, "simulation": simulation})
    path = workspace.scenarios / f"morning{SUFFIX}"
    return write_scenario(scenario, path)


def kill(command: list[str], seconds: float | None, *, worker: bool) -> bool:
    """Start a command and kill it after so many seconds; whether it had ended by then."""
    with subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as process:
        try:
            process.wait(seconds)
        except subprocess.TimeoutExpired:
            children = Path(f"/proc/{process.pid}/task/{process.pid}/children").read_text().split()
            process.send_signal(signal.SIGKILL)
            for child in children if worker else []:  # it leads a session, with what it started
                with suppress(ProcessLookupError):
                    os.killpg(int(child), signal.SIGKILL)
            return False
    return True


def recorded(run: Path) -> dict[str, bytes]:
    files = [file for name in RECORDED for file in recorded_files(run, name)]
    return {str(file.relative_to(run)): file.read_bytes() for file in files}


def results(run: Path) -> dict[str, bytes]:
    files = [run / "actors.json", run / "events.json"]
    return recorded(run) | {file.name: file.read_bytes() for file in files}


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("map", nargs="?", type=Path)
    parser.add_argument("--hours", type=float, default=2.0)
    parser.add_argument("--weekday", type=float, metavar="TRIPS")
    parser.add_argument("--kills", type=int, default=20)
    parser.add_argument("--meso", action="store_true")
    asked = parser.parse_args()
    main(asked.map, asked.hours, asked.weekday, asked.kills, meso=asked.meso)
