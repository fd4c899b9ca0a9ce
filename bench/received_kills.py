"""Kills while a recording is kept, placed elsewhere or a picture is laid under a map.

``python -m bench received_kills [--kills N]``: each is begun in a process of its own, which is
killed at a random instant, half of the time with all processes below it. After that whatever is
there has to be whole, or nothing, and the next that opens the workspace leaves nothing behind.
"""

from __future__ import annotations

import argparse
import os
import random
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Sequence
from pathlib import Path

import psutil

from odscen.app.exchange.kept_recordings import recording_names
from odscen.base.checksums import check_files
from odscen.maps.background import BACKGROUNDS
from odscen.maps.shipped import shipped_maps
from odscen.maps.store import Workspace

MAP = "signal_crossing"
_BEGIN = """
import sys
from pathlib import Path
from odscen.app.exchange.kept_recordings import SentPath, add_recording, place_recording
from odscen.maps.background import PicturePoint
from odscen.maps.store import Workspace
what, root, file = sys.argv[1:]
place, quiet = Workspace.open(Path(root)), lambda *_: None
print("ready", flush=True)
if what == "recording":
    add_recording(place, [SentPath(Path(file).name, Path(file))], progress=quiet)
elif what == "placing":
    place_recording(place, "kept", on_map="signal_crossing", offset="0,0.1", progress=quiet)
else:
    points = [PicturePoint(0, 0, -50, 25), PicturePoint(200, 0, 50, 25)]
    place.set_background("signal_crossing", Path(file), points=points)
"""


def main() -> None:
    options = argparse.ArgumentParser(prog="bench received_kills")
    options.add_argument("--kills", type=int, default=24)
    options.add_argument("--seed", type=int, default=1)
    asked = options.parse_args()
    chance = random.Random(asked.seed)
    counted: Counter[str] = Counter()
    with tempfile.TemporaryDirectory(prefix="odscen-bench-") as name:
        folder = Path(name)
        place = Workspace.open(folder / "workspace")
        place.add_map(next(path for path in shipped_maps() if path.stem == MAP))
        files = write_files(folder)
        took = {}
        for what in files:
            begun = time.perf_counter()
            run(what, place, files[what], None)
            took[what] = time.perf_counter() - begun
        for n in range(asked.kills):
            what = list(files)[n % len(files)]
            before = state(place)
            killed = run(what, place, files[what], (chance.uniform(0.0, took[what]), n % 2 == 0))
            counted[f"{what}: {'killed' if killed else 'was over before'}"] += 1
            after = state(place)
            for problem in problems(place, before, after, what):
                counted[f"WRONG: {problem}"] += 1
    for what, number in sorted(counted.items()):
        print(f"{what}: {number}")
    sys.exit(any(what.startswith("WRONG") for what in counted))


def write_files(folder: Path) -> dict[str, Path]:
    """A recording, the one that is placed again, and a TIFF."""
    import numpy as np
    from PIL import Image

    from tests.formats.tracks.test_tracks_on_maps import crossing_traffic

    for name in ("kept.csv", "more.csv"):
        crossing_traffic().write_csv(folder / name)
    colours = np.random.default_rng(1).integers(0, 255, (1500, 2000, 3), dtype=np.uint8)
    Image.fromarray(colours).save(folder / "plan.tif")
    from odscen.app.exchange.kept_recordings import SentPath, add_recording

    sent = [SentPath("kept.csv", folder / "kept.csv")]
    add_recording(Workspace.open(folder / "workspace"), sent, progress=lambda *_: None)
    return {
        "recording": folder / "more.csv",
        "placing": folder / "kept.csv",
        "picture": folder / "plan.tif",
    }


def run(what: str, place: Workspace, file: Path, kill: tuple[float, bool] | None) -> bool:
    """Begin one, and kill it after so many seconds, perhaps with what is below it."""
    command = [sys.executable, "-c", _BEGIN, what, str(place.root), str(file)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, start_new_session=True) as begun:
        assert begun.stdout is not None
        begun.stdout.readline()
        if kill is None:
            if begun.wait():
                raise RuntimeError(f"{what} fails")
            return False
        time.sleep(kill[0])
        if begun.poll() is not None:
            return False
        below = psutil.Process(begun.pid).children(recursive=True)
        os.kill(begun.pid, signal.SIGKILL)
        for process in below if kill[1] else ():
            process.kill()
        psutil.wait_procs(below, timeout=20.0)
        return True


State = dict[str, tuple[int, ...]]


def state(place: Workspace) -> State:
    """What is there, by folder, with the time at which it was written; nothing hidden among it."""
    Workspace.open(place.root)  # clears away
    folders = [place.recordings, place.root / "maps" / BACKGROUNDS]
    found = [path for folder in folders if folder.is_dir() for path in folder.iterdir()]
    return {
        path.relative_to(place.root).as_posix(): (path.stat().st_mtime_ns, path.stat().st_ino)
        for path in sorted(found)
    }


def problems(place: Workspace, before: State, after: State, what: str) -> Sequence[str]:
    """What is lost, half there or left behind."""
    wrong = [f"{name} is lost" for name in before.keys() - after.keys()]
    wrong += [f"{name} is left" for name in after if Path(name).name.startswith(".")]
    new = [name for name in after.keys() - before.keys() if not Path(name).name.startswith(".")]
    if len(new) > (what == "recording"):
        wrong.append(f"{what} makes {new}")
    for name in after:
        if not Path(name).name.startswith("."):
            check_files(place.root / name)  # raises if it is not whole
    if len(recording_names(place)) != sum(
        name.startswith("recordings/") and "/." not in name for name in after
    ):
        wrong.append("a recording is not listed")
    return wrong


if __name__ == "__main__":
    main()
