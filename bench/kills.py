"""A long run killed again and again, against the same run left alone.

``python -m bench.kills [MAP.xodr] [--hours H] [--slice S] [--weekday TRIPS] [--kills N] [--seed N]
[--meso]``: traffic on a map (the shipped town, half an hour, if not given) in slices of 2 minutes;
with ``--weekday`` the hours from 7:00 on of a weekday with so many trips. The command line is
killed at 100 random moments, of the run or of one that was resumed, by signal 9 alone or together
with all of its processes, or by SIGTERM, and resumed each time, the last time to its end. The
results must be the same bytes, nothing that was there before a kill may be gone or different after
it, and nothing else may be left at the end.
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
from collections import Counter
from contextlib import suppress
from pathlib import Path

from odscen.app.demand import demands
from odscen.app.generation import generate
from odscen.app.scenarios import SUFFIX, read_scenario, write_scenario
from odscen.base.atomic_folders import clear_leftovers
from odscen.maps.shipped import shipped_maps
from odscen.maps.store import Workspace
from odscen.runs.layout import RECORDED
from odscen.runs.recorded import recorded_files
from odscen.scenario.demand.day_profiles import DAY, curve
from odscen.scenario.document.json_form import dumps
from odscen.scenario.document.scenario_document import Flow
from odscen.scenario.edits.demand_edits import set_clock
from odscen.scenario.sampling.generation_settings import GenerationSettings

FLOWS = 40
PER_HOUR = 900.0
HOW = ("SIGKILL", "SIGKILL to all", "SIGTERM")
LONGEST = 0.7
"""Wall seconds until a kill at most, as a share of what the run alone takes."""


def main(
    given: Path | None = None,
    hours: float = 0.5,
    trips: float | None = None,
    kills: int = 100,
    *,
    meso: bool = False,
    slice_length: float = 120.0,
    seed: int = 1,
) -> None:
    path = given or next(p for p in shipped_maps() if p.stem == "town_5x5")
    chance = random.Random(seed)
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
        run = [*cli, "run", str(scenario), *options, "--slice", f"{slice_length:g}"]
        run += ["--meso"] if meso else []
        start = time.perf_counter()
        subprocess.run([*run, "--out", str(folder / "alone")], check=True, capture_output=True)
        alone = time.perf_counter() - start
        target = folder / "killed" / scenario.name.removesuffix(SUFFIX)
        command = run = [*run, "--out", str(target.parent)]
        resume = [*cli, "resume", str(target), *options]
        expected = results(folder / "alone" / target.name)
        lost = compared = differing = refused = resumed = 0
        moments: Counter[str] = Counter()
        ended = False
        while not ended:
            before = recorded(target)
            patience = chance.uniform(0.2, LONGEST * alone) if moments.total() < kills else None
            how = chance.choice(HOW)
            code = kill(command, patience, how=how)
            if code is None and whole(target):
                code = 0  # its end was on the disk, and only telling it was cut short
            if code is not None:
                if code:
                    refused += 1
                else:
                    compared += 1
                    differing += results(target) != expected
                shutil.rmtree(target, ignore_errors=True)
                command, ended = run, patience is None
                continue
            moments[how] += 1
            resumed += command is resume
            after = recorded(target)
            lost += sum(after.get(file) != content for file, content in before.items())
            command = resume if (target / "status.json").is_file() else run
        clear_leftovers(target.parent)
        left = [path.name for path in target.parent.iterdir()]
    ways = ", ".join(f"{moments[how]} by {how}" for how in HOW)
    print(
        f"{path.stem}{', meso' if meso else ''}, {hours:g} h in slices of {slice_length:g} s, "
        f"{alone:.0f} s of wall time alone: killed {moments.total()} times ({ways}), {resumed} of "
        f"them a run that was resumed; {lost} files lost or changed by a kill; {compared} runs "
        f"came to their end, {differing} with other results; {refused} ended otherwise; "
        f"left behind: {', '.join(left) or 'nothing'}"
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
        update={"matrices": (matrix.model_copy(update={"trips": rows, "end": hours * 3600.0}),)}
    )
    simulation = scenario.simulation.model_copy(update={"duration": hours * 3600.0})
    scenario = scenario.model_copy(update={"demand": demand, "simulation": simulation})
    path = workspace.scenarios / f"morning{SUFFIX}"
    return write_scenario(scenario, path)


def kill(command: list[str], seconds: float | None, *, how: str) -> int | None:
    """Start a command and kill it after so many seconds; its exit code if it had ended by then."""
    with subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as process:
        try:
            process.wait(seconds)
        except subprocess.TimeoutExpired:
            children = Path(f"/proc/{process.pid}/task/{process.pid}/children").read_text().split()
            process.send_signal(signal.SIGTERM if how == "SIGTERM" else signal.SIGKILL)
            # The worker leads a session, with what it has started.
            for child in children if how == "SIGKILL to all" else []:
                with suppress(ProcessLookupError):
                    os.killpg(int(child), signal.SIGKILL)
            process.wait()
            return None
        return process.returncode


def whole(run: Path) -> bool:
    """Whether a run has ended: not the summary of one that was interrupted."""
    return (run / "summary.json").is_file() and not (run / "status.json").is_file()


def recorded(run: Path) -> dict[str, bytes]:
    files = [file for name in RECORDED for file in recorded_files(run, name)]
    return {str(file.relative_to(run)): file.read_bytes() for file in files}


def results(run: Path) -> dict[str, bytes]:
    files = [run / "actors.json", run / "events.json"]
    return recorded(run) | {file.name: file.read_bytes() for file in files}


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("map", nargs="?", type=Path)
    parser.add_argument("--hours", type=float, default=0.5)
    parser.add_argument("--slice", type=float, default=120.0)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--weekday", type=float, metavar="TRIPS")
    parser.add_argument("--kills", type=int, default=100)
    parser.add_argument("--meso", action="store_true")
    asked = parser.parse_args()
    main(
        asked.map, asked.hours, asked.weekday, asked.kills,
        meso=asked.meso, slice_length=asked.slice, seed=asked.seed,
    )  # fmt: skip
