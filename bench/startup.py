"""How long one command takes: alone, and handed to the process that stays (``ODSCEN_RESIDENT``).

``odscen --help`` against an interpreter that does nothing (aim: at most 0.3 s); then a run of some
twenty road users for 60 s (aim 0.35 s), ``check``, ``generate`` and ``maps show`` (0.3 s) on Town04
where it is there, else on a crossing. Alone and handed over are timed in turn, with a pause before
each, in which the next process gets ready.
"""

from __future__ import annotations

import os
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import TYPE_CHECKING

from bench.common import compile_modules, paired, shared_maps
from odscen.cli.resident.client import VARIABLE

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

CROSSING = Path(__file__).parents[1] / "maps" / "signal_crossing.xodr"
ROUNDS = 7
PAUSE = 1.5
"""Wall seconds."""
RESIDENT = {VARIABLE: "1"}


def main() -> None:
    compile_modules()
    ours, peer, ratio = paired(
        lambda: _call("-m", "odscen", "--help"), lambda: _call("-c", "pass"), repeats=15
    )
    print(f"odscen --help {ours:.3f} s, python -c pass {peer:.3f} s, ratio {ratio:.1f}")
    shared = shared_maps()
    town = None if shared is None else shared / "carla-2019" / "Town04.xodr"
    path = CROSSING if town is None or not town.exists() else town
    with tempfile.TemporaryDirectory() as folder:
        for name, command in _commands(Path(folder), path).items():
            alone, handed = _in_turn(command, Path(folder))
            print(
                f"{name} on {path.stem}: alone {_words(alone)}, handed over {_words(handed)}, "
                f"ratio {statistics.median(a / b for a, b in zip(handed, alone, strict=True)):.2f}"
            )


def _commands(folder: Path, path: Path) -> dict[str, list[str]]:
    """Words of each command behind ``odscen``, with what it needs in the folder."""
    workspace = ["--workspace", str(folder / "workspace")]
    generate = ["generate", "--map", path.stem, "--seed", "1", "--fill", "0.1", "--roi-segments"]
    generate += ["20", "--out", str(folder / "made"), *workspace]
    _call("-m", "odscen", "maps", "add", str(path), *workspace)
    _call("-m", "odscen", *generate)
    scenario = str(next((folder / "made").glob("*.scenario.json")))
    run = ["run", scenario, "--until", "60", "--out", str(folder / "runs"), "--overwrite"]
    return {
        "run": [*run, *workspace],
        "run without figures and report": [*run, "--no-report", *workspace],
        "check": ["check", scenario, *workspace],
        "generate": generate,
        "maps show": ["maps", "show", path.stem, *workspace],
    }


def _in_turn(command: Sequence[str], folder: Path) -> tuple[list[float], list[float]]:
    """Wall seconds of a command alone, and handed over; two rounds before are not counted."""
    alone, handed = [], []
    for _ in range(2 + ROUNDS):
        for seconds, variables in ((alone, {}), (handed, RESIDENT)):
            time.sleep(PAUSE)
            start = time.perf_counter()
            _call("-m", "odscen", *command, variables=variables, folder=folder)
            seconds.append(time.perf_counter() - start)
    return alone[2:], handed[2:]


def _words(seconds: Sequence[float]) -> str:
    return f"{statistics.median(seconds):.2f} s ({min(seconds):.2f} to {max(seconds):.2f})"


def _call(
    *words: str, variables: Mapping[str, str] | None = None, folder: Path | None = None
) -> None:
    subprocess.run(
        [sys.executable, *words],
        check=True,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        env={**os.environ, **(variables or {})},
        cwd=folder,
    )
