"""Vehicles of other programs at random poses: whatever they do, SUMO goes on.

``python -m bench foreign_poses`` puts vehicles and pedestrians that another program drives at
10,000 random poses among traffic: on lanes along and against them, inside junctions, on walks and
crosswalks, beside the road, over others, beyond the map, and at places that are no numbers. Each
stays for some steps, drives on or is gone again. A run is a process of its own, and prints how many
poses it has shown and how it ended; aim: all of them complete.
"""

from __future__ import annotations

import argparse
import json
import math
import signal
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from bench.common import shared_maps
from odscen.app.generation import generate
from odscen.app.maps import load_map
from odscen.app.running.runs import carry_out, check_run, prepare_run
from odscen.app.scenarios import read_scenario
from odscen.maps.map_entry import MapEntry
from odscen.maps.shipped import shipped_maps
from odscen.maps.store import Workspace
from odscen.runs.run_settings import RunSettings
from odscen.scenario.document.sampling_config import SamplingConfig
from odscen.scenario.sampling.generation_settings import GenerationSettings
from odscen.sumo.runner.elevation import ElevationLookup
from odscen.sumo.runner.in_step import InStep, Step
from odscen.sumo.worker.protocol import ForeignUser, Outside

POSES = 10_000
AT_ONCE = 20
POSES_OF_RUN = 500
STEP = 0.1
_STUCK = 60
"""Seconds after which a step that has not ended counts as never ending."""
BODIES = (
    ("passenger", 4.5, 1.8),
    ("delivery", 6.0, 2.2),
    ("truck", 12.0, 2.5),
    ("bus", 18.0, 2.55),
    ("motorcycle", 2.2, 0.8),
    ("bicycle", 1.8, 0.6),
    ("emergency", 6.5, 2.1),
    ("pedestrian", 0.5, 0.5),
)
"""SUMO's class, length and width."""
KINDS = (
    "along a lane", "against a lane", "across a lane", "beside a lane", "on a walk",
    "over another", "anywhere", "off the map", "far away", "no number",
)  # fmt: skip
_NO_NUMBERS = (math.nan, math.inf, -math.inf, 1e300)


@dataclass
class PosesShown:
    """Another program with road users at random poses.

    Parameters
    ----------
    entry
        The map.
    wanted
        How many poses.

    Attributes
    ----------
    shown
        How many of each kind so far.
    last
        Those of the newest step, as they were sent.
    """

    entry: MapEntry
    seed: int
    wanted: int
    shown: dict[str, int] = field(default_factory=dict)
    last: list[ForeignUser] = field(default_factory=list)

    def __post_init__(self) -> None:
        loaded = load_map(self.entry).sumo.graph
        self._lanes, self._walks = loaded.lanes, loaded.walks
        self._random = np.random.default_rng(self.seed)
        self._offset = self.entry.lane_table().net_offset
        self._steps_left = [0] * AT_ONCE
        self._users: list[ForeignUser | None] = [None] * AT_ONCE
        self._others: list[tuple[float, float, float]] = []
        self._names = 0
        self.in_step: InStep | None = None

    def on_step(self, step: Step) -> None:
        """Move all on, and put those whose time is over somewhere else."""
        assert self.in_step is not None
        signal.alarm(_STUCK)
        self._others = list(zip(step.x, step.y, step.hdg, strict=True))
        if sum(self.shown.values()) >= self.wanted:
            self.in_step.stop()
            return
        for slot in range(AT_ONCE):
            self._steps_left[slot] -= 1
            user = self._users[slot]
            if self._steps_left[slot] <= 0:
                self._steps_left[slot] = int(self._random.integers(1, 7))
                gone = self._random.random() < 0.15
                self._users[slot] = None if gone else self._put_somewhere(user)
            elif user is not None and math.isfinite(user.angle_deg):
                turn = math.radians(user.angle_deg)
                x = user.x + user.speed * STEP * math.sin(turn)
                self._users[slot] = user._replace(
                    x=x, y=user.y + user.speed * STEP * math.cos(turn)
                )
        self.last = [user for user in self._users if user is not None]
        self.in_step.show_outside(Outside(self.last))

    def _put_somewhere(self, user: ForeignUser | None) -> ForeignUser:
        """Put one somewhere else, now and then as somebody new."""
        random = self._random
        if user is None or random.random() < 0.3:
            self._names += 1
            body = BODIES[int(random.integers(len(BODIES)))]
            user = ForeignUser(str(self._names), body[0], 0.0, 0.0, 0.0, 0.0, body[1], body[2])
        kind = KINDS[int(random.integers(len(KINDS)))]
        self.shown[kind] = self.shown.get(kind, 0) + 1
        x, y, hdg = self._draw_pose(kind)
        speed = float(random.choice([0.0, 5.0, 14.0, 60.0]))
        if kind == "no number":
            values = [x, y, math.degrees(hdg), speed]
            values[int(random.integers(4))] = float(random.choice(_NO_NUMBERS))
            x, y, angle, speed = values
        else:
            angle = 90.0 - math.degrees(hdg)
        dx, dy = self._offset
        return user._replace(x=x + dx, y=y + dy, angle_deg=angle, speed=speed)

    def _draw_pose(self, kind: str) -> tuple[float, float, float]:
        """x, y and heading in the OpenDRIVE frame."""
        random, lanes, walks = self._random, self._lanes, self._walks
        row = int(random.integers(len(lanes.x)))
        x, y, hdg = float(lanes.x[row]), float(lanes.y[row]), float(lanes.hdg[row])
        if kind == "against a lane":
            return x, y, hdg + math.pi
        if kind == "across a lane":
            return x, y, float(random.uniform(-math.pi, math.pi))
        if kind == "beside a lane":
            aside = float(random.uniform(-12.0, 12.0))
            return x - aside * math.sin(hdg), y + aside * math.cos(hdg), hdg
        if kind == "on a walk" and len(walks.x):
            at = int(random.integers(len(walks.x)))
            return float(walks.x[at]), float(walks.y[at]), float(walks.hdg[at])
        if kind == "over another" and self._others:
            return self._others[int(random.integers(len(self._others)))]
        if kind in ("anywhere", "off the map", "far away"):
            margin = {"anywhere": 0.0, "off the map": 300.0, "far away": 1e6}[kind]
            return (
                float(random.uniform(lanes.x.min() - margin, lanes.x.max() + margin)),
                float(random.uniform(lanes.y.min() - margin, lanes.y.max() + margin)),
                float(random.uniform(-10.0, 10.0)),
            )
        return x, y, hdg


def run_among_traffic(
    workspace: Workspace, entry: MapEntry, folder: Path, *, seed: int, poses: int
) -> tuple[PosesShown, str | None]:
    """Show so many poses in one run; what was shown, and why the run has failed if it has."""
    config = SamplingConfig(duration=600.0)
    settings = GenerationSettings(map_name=entry.name, seed=seed, config=config)
    [path] = generate(workspace, settings=settings, out=folder)
    checked = check_run(
        workspace, read_scenario(path), name=f"{entry.name}-{seed}", out=folder,
        settings=RunSettings(step_length=STEP), entry=entry,
    )  # fmt: skip
    prepared = prepare_run(checked)
    ground = ElevationLookup(load_map(entry).sumo.graph, entry.lane_table())
    shown = PosesShown(entry, seed, poses)
    shown.in_step = InStep(prepared.plan, ground, shown.on_step)
    signal.signal(signal.SIGALRM, _raise_stuck)
    try:
        done = carry_out(checked, prepared, live=shown.in_step, reports=False, figures=False)
    except TimeoutError as error:
        return shown, str(error)
    finally:
        signal.alarm(0)
    return shown, done.summary.get("error") if done.status == "failed" else None


def _first_line(error: str | None) -> str:
    return "complete" if error is None else error.splitlines()[0]


def _raise_stuck(*_: object) -> None:
    raise TimeoutError(f"a step took more than {_STUCK} s")


def main(arguments: Sequence[str] | None = None) -> None:
    """Print a line for each run, and the total."""
    parser = argparse.ArgumentParser(prog="bench foreign_poses", description=__doc__)
    parser.add_argument("--poses", type=int, default=POSES, help="How many in all.")
    parser.add_argument("--seed", type=int, default=0, help="Of the first run.")
    parser.add_argument("--map", help="Only the maps with this in their name.")
    parser.add_argument("--workspace", type=Path, help="Keeps the maps, for another time.")
    options = parser.parse_args(arguments)
    real = shared_maps()
    towns = [real / "carla-2019" / "Town05.xodr", *sorted(real.glob("esmini/fab*"))] if real else []
    sources = [one for one in (*shipped_maps(), *towns) if (options.map or "") in one.stem]
    total, failed = 0, 0
    with tempfile.TemporaryDirectory(prefix="odscen-bench-") as root:
        workspace = Workspace.open(options.workspace or Path(root) / "workspace")
        known = {entry.name: entry for entry in workspace.maps()}
        entries = [known.get(one.stem) or workspace.add_map(one) for one in sources]
        seed = options.seed
        while total < options.poses:
            entry = entries[seed % len(entries)]
            poses = min(POSES_OF_RUN, options.poses - total)
            shown, error = run_among_traffic(
                workspace, entry, Path(root) / str(seed), seed=seed, poses=poses
            )
            count = sum(shown.shown.values())
            print(f"seed {seed:4d} {entry.name:<28} {count:4d} poses: {_first_line(error)}")
            if error is not None:
                failed += 1
                print(json.dumps(shown.last))
            total += max(count, 1)
            seed += 1
    print(f"{total} poses, {failed} runs failed")


if __name__ == "__main__":
    main()
