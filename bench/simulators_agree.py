"""Ten scenarios in every simulator that is at hand, each held against SUMO.

``python -m bench.simulators_agree [COUNT [SECONDS]]``: 10 scenarios of 20 s if nothing is said.
They have rules, traffic lights, pedestrians and weather. CARLA is the stand-in of the tests, by the
client that is installed and those of the folder ``ODSCEN_CARLA_CLIENTS`` (see
``tests/carla/server/test_other_clients.py``); MetaDrive, replaying all, is that of
``ODSCEN_METADRIVE_PYTHON``. Who is not there has a row that says so. Before the table comes what
each simulator has said before its runs that it cannot do. The exit code is 1 if a simulator is
beyond the bounds.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any, NamedTuple

import odscen
from odscen.app.generation import generate
from odscen.app.scenarios import read_scenario, write_scenario
from odscen.maps.store import Workspace
from odscen.runs.finished_run import Run
from odscen.scenario.document.rules_document import StoryRule
from odscen.scenario.sampling.generation_settings import GenerationSettings
from odscen.simulators.assets import shipped_assets
from tests.carla_standin.process import USUAL, StandIn
from tests.carla_standin.wire import SPOKEN

MAPS = Path(__file__).parents[1] / "maps"
TOWNS = ("signal_crossing", "town_5x5")
METRES, DEGREES = 0.001, 0.01
"""By which a place and a heading may differ from SUMO's."""
ASKED = ("0.9.13", "0.9.14", *SPOKEN)


class Parity(NamedTuple):
    """How far a run is from SUMO's; metres, degrees."""

    states: int
    share: float
    place: float
    heading: float
    lights: int
    wrong: int
    same: bool

    @property
    def within(self) -> bool:
        """Whether it is within the bounds."""
        near = self.place <= METRES and self.heading <= DEGREES
        return near and self.share == 1.0 and self.wrong == 0 and self.same


def make_scenarios(workspace: Workspace, folder: Path, count: int) -> list[tuple[Path, Path]]:
    """Scenarios, each with its map: sampled, in weather of their own, with a rule for the ego."""
    presets = list(shipped_assets().presets)
    made = []
    for number in range(count):
        xodr = MAPS / f"{TOWNS[number % len(TOWNS)]}.xodr"
        workspace.add_map(xodr)
        settings = GenerationSettings(map_name=xodr.stem, seed=number, fill=0.2, roi_segments=12)
        (path,) = generate(workspace, settings=settings)
        scenario = read_scenario(path)
        actors = list(scenario.actors)
        index = next(k for k, actor in enumerate(actors) if actor.category == "car")
        actors[index] = actors[index].model_copy(update={"ego": True, "depart": 0.0})
        rule = {
            "id": "slows", "actor": actors[index].id, "when": {"time": {"after": 4 + number % 3}},
            "then": [{"brake": {"by": 2.0 + 0.2 * number}}],
        }  # fmt: skip
        sky = scenario.environment.model_copy(update={"preset": presets[number % len(presets)]})
        scenario = scenario.model_copy(
            update={
                "actors": tuple(actors),
                "rules": (StoryRule.model_validate(rule),),
                "environment": sky,
            }
        )
        made.append((write_scenario(scenario, folder / f"s{number}.scenario.json"), xodr))
    return made


def carry_out(words: list[Any], variables: dict[str, str]) -> dict[str, Any]:
    """What a command of odscen prints as JSON; its other words under ``said``."""
    done = subprocess.run(
        [sys.executable, "-m", "odscen", *map(str, words), "--json"],
        env={**os.environ, **variables}, capture_output=True, text=True, check=False,
    )  # fmt: skip
    if done.returncode not in (0, 1) or not done.stdout:
        raise SystemExit(f"{' '.join(map(str, words))}: {done.stderr}")
    printed: dict[str, Any] = json.loads(done.stdout)
    return printed


def read_parity(folder: Path, sumo: Run) -> Parity:
    """Read the parity report of a run, and whether the same were there as in SUMO alone."""
    found = json.loads((folder / "parity.json").read_text(encoding="utf-8"))
    keys = [run.trajectories().select("time", "id").sort("time", "id") for run in (
        Run.open(folder), sumo)]  # fmt: skip
    lights = found.get("lights") or {}
    return Parity(
        states=keys[0].height,
        share=found["share_mirrored"],
        place=found["position_error_m"]["max"],
        heading=found["heading_error_deg"]["max"],
        lights=lights.get("samples", 0),
        wrong=lights.get("wrong", 0),
        same=keys[0].equals(keys[1]),
    )


def client_of(release: str) -> dict[str, str] | None:
    """Variables by which a process has the client of a release; nothing if there is none."""
    if release == USUAL:
        return {}
    folder = Path(os.environ.get("ODSCEN_CARLA_CLIENTS", "-")) / release
    return {"PYTHONPATH": str(folder)} if folder.is_dir() else None


def main() -> None:
    given = [float(word) for word in sys.argv[1:]]
    count, seconds = (*given, *(10, 20)[len(given) :])
    said: dict[str, dict[str, None]] = {}
    rows: dict[str, list[Parity]] = {}
    absent: dict[str, str] = {}
    with tempfile.TemporaryDirectory() as root:
        workspace = Workspace.open(Path(root) / "workspace")
        users: list[str] = []
        for path, xodr in make_scenarios(workspace, Path(root), int(count)):
            common = [path, "--until", seconds, "--workspace", workspace.root, "--out"]
            out = Path(root) / path.stem
            settings = odscen.RunSettings(until=seconds)
            sumo = odscen.run(workspace, path, settings=settings, out=out / "sumo")
            users += sumo.trajectories().unique("id", maintain_order=True)[
                "category"].to_list()  # fmt: skip
            if os.environ.get("ODSCEN_METADRIVE_PYTHON"):
                words = [
                    "run", *common, out / "metadrive", "--simulator", "metadrive",
                    "--simulator-set", "ego=replay", "--simulator-set", "traffic=replay",
                ]  # fmt: skip
                told = carry_out(words, {})
                said.setdefault("MetaDrive", {}).update(dict.fromkeys(told["problems"]))
                rows.setdefault("MetaDrive", []).append(read_parity(Path(told["folder"]), sumo))
            else:
                absent["MetaDrive"] = "ODSCEN_METADRIVE_PYTHON names no Python"
            for release in ASKED:
                name, variables = f"CARLA {release}", client_of(release)
                if variables is None or release not in SPOKEN:
                    absent[name] = "no client for this Python"
                    continue
                with StandIn(xodr, speaks=release) as server:
                    address = f"{server.host}:{server.port}"
                    words = ["cosim", *common, out / release, "--carla", address]
                    told = carry_out(words, variables)
                warned = dict.fromkeys(told["carla"]["warnings"])
                said.setdefault(name, {}).update(warned)
                rows.setdefault(name, []).append(read_parity(Path(told["folder"]), sumo))
            print(f"{path.name} on {xodr.stem}: done", file=sys.stderr, flush=True)
    counts = {kind: users.count(kind) for kind in sorted(set(users))}
    print(f"{int(count)} scenarios of {seconds:g} s, road users: {counts}")
    for name, words in said.items():
        for each in words or ["nothing is left out"]:
            print(f"{name}: {each}")
    good = print_table(rows, absent)
    sys.exit(0 if good else 1)


def print_table(rows: dict[str, list[Parity]], absent: dict[str, str]) -> bool:
    """Print a line for each simulator; whether all are within the bounds."""
    print("| simulator | runs | states | shown | place, m | heading, degrees | lights | wrong |")
    print("|---|---|---|---|---|---|---|---|")
    good = True
    for name, found in sorted(rows.items()):
        good &= all(parity.within for parity in found)
        print(
            f"| {name} | {len(found)} | {sum(p.states for p in found):,} | "
            f"{min(p.share for p in found):.0%} | {max(p.place for p in found):.6f} | "
            f"{max(p.heading for p in found):.6f} | {sum(p.lights for p in found):,} | "
            f"{sum(p.wrong for p in found)} |"
        )
    for name, why in absent.items():
        print(f"| {name} | {why} | | | | | | |")
    return good


if __name__ == "__main__":
    main()
