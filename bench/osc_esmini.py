"""OpenSCENARIO files played by esmini and by odscen: how far apart the bodies are.

``python -m bench osc_esmini --esmini PROGRAM`` takes every file below a folder that is no catalog,
by default those in ``shared/osc`` beside the project, and plays it at steps of 0.05 s in esmini (a
program that one builds oneself, without graphics) and here. A row has the farthest actor: the 95th
percentile of the distance of its body's centre to that of esmini at the same instants, while both
have it, and when it was first 1 m. ``--seconds`` bounds both.
"""

from __future__ import annotations

import argparse
import json
import math
import os
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from bench.osc_import import SHARED, is_scenario
from odscen.app.exchange.imports import import_file
from odscen.app.running.runs import run
from odscen.base.errors import OdscenError
from odscen.formats.openscenario_import.world.read_entities import plain_id
from odscen.maps.store import Workspace

if TYPE_CHECKING:
    from collections.abc import Iterator

STEP = 0.05
_FIELDS = 31
"""Of an entity in a row of esmini's log."""
_FAR = 1.0
"""Metres."""
_LONGEST = 180
"""Seconds for a file."""


class _Track(NamedTuple):
    times: np.ndarray
    points: np.ndarray


def main() -> None:
    """Print a line for each file, and totals."""
    options = _options()
    files = sorted(one for one in options.folder.rglob(options.files) if _has_storyboard(one))
    with tempfile.TemporaryDirectory(prefix="odscen-bench-") as folder:
        workspace = options.workspace or Path(folder)
        rows = [_in_a_process(file, options, workspace) for file in files]
    known = [row["p95"] for row in rows if row.get("p95") is not None]
    close = sum(value <= _FAR for value in known)
    print(f"{len(rows)} files, {len(known)} compared, {close} within {_FAR:g} m")
    if options.json is not None:
        options.json.write_text(json.dumps(rows, indent=1) + "\n", encoding="utf-8")


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="bench osc_esmini", description=__doc__)
    parser.add_argument("--esmini", type=Path, required=True, help="The program.")
    parser.add_argument("--folder", type=Path, default=SHARED / "osc")
    parser.add_argument("--files", default="*.xosc", help="Which of them.")
    parser.add_argument("--maps", type=Path, default=SHARED / "maps" / "carla-2019")
    parser.add_argument("--seconds", type=float, default=40.0, help="Of a run at most.")
    parser.add_argument("--workspace", type=Path, help="Keeps the maps, for another time.")
    parser.add_argument("--json", type=Path, help="File that gets all of it.")
    return parser.parse_args()


def _has_storyboard(file: Path) -> bool:
    """Whether a file is played as it is: catalogs and distributions are not."""
    return is_scenario(file) and b"<Storyboard" in file.read_bytes()


def _in_a_process(file: Path, options: argparse.Namespace, workspace: Path) -> dict[str, Any]:
    given = [str(one) for one in (file, options.maps, options.esmini, workspace, options.seconds)]
    command = [sys.executable, "-m", "bench.osc_esmini", "--one", *given]
    child = subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, start_new_session=True
    )
    try:
        out, err = child.communicate(timeout=_LONGEST)
        lines = [line for line in out.splitlines() if line.startswith("{")]
        said = (err.strip().splitlines() or ["nothing"])[-1]
        row: dict[str, Any] = json.loads(lines[-1]) if lines else {"why": said}
    except subprocess.TimeoutExpired:
        os.killpg(child.pid, signal.SIGKILL)
        child.communicate()
        row = {"why": f"more than {_LONGEST} s"}
    row["file"] = file.name
    first = "" if row.get("since") is None else f"1 m at {row['since']:.2f} s"
    value = "       -" if row.get("p95") is None else f"{row['p95']:8.3f}"
    print(f"{file.stem[:58]:<58} {value} {row.get('actor', ''):<14} {first} {row.get('why', '')}")
    sys.stdout.flush()
    return row


def _compare(
    file: Path, maps: Path, esmini: Path, workspace: Path, seconds: float
) -> dict[str, Any]:
    with tempfile.TemporaryDirectory(prefix="odscen-bench-") as folder:
        theirs, said = _play_in_esmini(file, maps, esmini, seconds, Path(folder))
        if not theirs:
            return {"why": f"esmini: {said}"}
        try:
            ours = _play_here(file, maps, Workspace.open(workspace), seconds, Path(folder))
        except OdscenError as error:
            return {"why": f"odscen: {str(error).splitlines()[0]}"}
    return _farthest(theirs, ours)


def _farthest(theirs: dict[str, _Track], ours: dict[str, _Track]) -> dict[str, Any]:
    found: dict[str, Any] = {}
    for name, track in theirs.items():
        if name not in ours:
            found.setdefault("missing", []).append(name)
            continue
        own = ours[name]
        inside = (track.times >= own.times[0] - 1e-6) & (track.times <= own.times[-1] + 1e-6)
        if not inside.any():
            continue
        times = track.times[inside]
        places = [np.interp(times, own.times, own.points[:, axis]) for axis in (0, 1)]
        away = np.hypot(*(track.points[inside].T - places))
        p95 = float(np.percentile(away, 95))
        lasts = {"theirs": float(track.times[-1]), "ours": float(own.times[-1])}
        found.setdefault("actors", {})[name] = {"p95": p95, "max": float(away.max()), **lasts}
        if p95 > found.get("p95", -1.0):
            late = np.flatnonzero(away > _FAR)
            since = float(times[late[0]]) if late.size else None
            found |= {"p95": p95, "actor": name, "since": since, "at_first": float(away[0])}
    return found


def _play_in_esmini(
    file: Path, maps: Path, esmini: Path, seconds: float, folder: Path
) -> tuple[dict[str, _Track], str]:
    log = folder / "log.csv"
    os.mkfifo(log)
    command = [
        str(esmini), "--osc", str(file), "--headless", "--fixed_timestep", str(STEP),
        "--csv_logger", str(log), "--disable_log", "--path", str(maps),
    ]  # fmt: skip
    rows: list[tuple[float, list[str]]] = []
    with (folder / "said").open("w+") as heard:
        child = subprocess.Popen(command, cwd=folder, stdout=heard, stderr=heard)
        reader = os.open(log, os.O_RDONLY | os.O_NONBLOCK)
        os.set_blocking(reader, False)
        for instant, fields in _logged_rows(reader, child):
            rows.append((instant, fields))
            if instant >= seconds:
                break
        os.close(reader)
        child.send_signal(signal.SIGKILL)
        child.wait()
        heard.seek(0)
        said = [line.strip() for line in heard.read().splitlines() if "rror" in line]
    found: dict[str, list[tuple[float, float, float]]] = {}
    taken: dict[str, str] = {}
    ids: set[str] = set()
    for instant, fields in rows:
        for begin in range(0, len(fields) - _FIELDS + 1, _FIELDS):
            one = fields[begin : begin + _FIELDS]
            name = taken.get(one[0]) or taken.setdefault(one[0], plain_id(one[0], ids))
            ahead, left, x, y, hdg = (float(one[column]) for column in (5, 6, 11, 12, 24))
            c, s = math.cos(hdg), math.sin(hdg)
            centre = (instant, x + ahead * c - left * s, y + ahead * s + left * c)
            found.setdefault(name, []).append(centre)
    tracks = {name: np.array(points) for name, points in found.items()}
    return {name: _Track(one[:, 0], one[:, 1:]) for name, one in tracks.items()}, " ".join(said[:1])


def _logged_rows(reader: int, child: subprocess.Popen[bytes]) -> Iterator[tuple[float, list[str]]]:
    rest = b""
    while True:
        try:
            part = os.read(reader, 1 << 16)
        except BlockingIOError:
            part = b""
        if not part:
            if child.poll() is not None:
                return
            time.sleep(0.01)
        *lines, rest = (rest + part).split(b"\n")
        for line in lines:
            fields = [field.strip() for field in line.decode().split(",")]
            if len(fields) > _FIELDS and fields[0].isdigit():
                yield float(fields[1]), fields[2:]


def _play_here(
    file: Path, maps: Path, workspace: Workspace, seconds: float, folder: Path
) -> dict[str, _Track]:
    made = import_file(workspace, file, maps=maps if maps.is_dir() else None).scenario
    if made is None:
        return {}
    lasts = min(made.simulation.duration, seconds)
    timing = made.simulation.model_copy(update={"step_length": STEP, "duration": lasts})
    done = run(workspace, made.model_copy(update={"simulation": timing}), name="run", out=folder)
    if done.status != "completed":
        raise OdscenError(str(done.summary.get("error")))
    table = done.trajectories()
    return {
        str(name): _Track(rows["time"].to_numpy(), rows.select("x", "y").to_numpy())
        for (name,), rows in table.partition_by("id", as_dict=True).items()
    }


if __name__ == "__main__":
    if "--one" in sys.argv:
        print(json.dumps(_compare(*map(Path, sys.argv[2:6]), float(sys.argv[6]))))
    else:
        main()
