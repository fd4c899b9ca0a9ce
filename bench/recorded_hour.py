"""Recorded traffic of an hour, 300 road users at a time, 25 frames in a second.

Aims: reading 1 GB needs at most 2 GB of memory; an hour opens in 10 s on the page and is scrubbed
at 30 frames/s. Of CSV in the schemas of INTERACTION and inD, made here: vehicles on six rings. The
peer is polars that reads all columns of the same file and does nothing with them; in turn, in wall
and in computing seconds.
"""

from __future__ import annotations

import itertools
import os
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import polars as pl
from playwright.sync_api import Browser, Page

from tools import page as tool

HZ = 25
AT_ONCE = 300
LANES = 6
ROUNDS = 3
SCRUBBED = 5.0
_PEAK = "import resource; print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)"
_READERS = {
    "odscen": "import sys, odscen; odscen.read_recorded_traffic(sys.argv[1]).rows",
    "polars": "import sys, polars; polars.read_csv(sys.argv[1])",
}
_SCRUB = """async ([from, to, seconds]) => {
  const bar = document.querySelector('.rec-bar input');
  const set = Object.getOwnPropertyDescriptor(HTMLInputElement.prototype, 'value').set;
  const [low, high] = [Number(bar.min), Number(bar.max)];
  const begun = performance.now();
  let [frames, last, worst] = [0, begun, 0];
  while (performance.now() - begun < 1000 * seconds) {
    const share = from + ((to - from) * (performance.now() - begun)) / (1000 * seconds);
    set.call(bar, low + share * (high - low));
    bar.dispatchEvent(new Event('input', {bubbles: true}));
    await new Promise((done) => requestAnimationFrame(done));
    const now = performance.now();
    worst = Math.max(worst, now - last);
    last = now;
    frames += 1;
  }
  return [(1000 * frames) / (last - begun), worst];
}"""
_SHOWN = """() => {
  const figures = [...document.querySelectorAll('.strip .figure b')];
  return figures.length > 1 && Number(figures[1].textContent) > 0;
}"""


class Track(NamedTuple):
    """A vehicle on a ring: frames, places, velocity and heading."""

    number: int
    frame: Any
    x: Any
    y: Any
    vx: Any
    vy: Any
    hdg: Any


def main() -> None:
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        print(f"load of the machine: {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores")
        for file, seconds in (("vehicle_tracks_001.csv", 1910.0), ("01_tracks.csv", 1025.0)):
            read_file(write_tracks(folder / file, AT_ONCE, seconds, lasting=60.0))
            (folder / file).unlink()
        with tool.served(folder) as server, tool.launched() as browser:
            easy = write_tracks(folder / "vehicle_tracks_002.csv", 5, 3600.0, lasting=60.0)
            open_file(browser, server.url, easy)
            hour = write_tracks(folder / "vehicle_tracks_003.csv", AT_ONCE, 3600.0, lasting=3600.0)
            open_file(browser, server.url, hour)


def tracks_on_rings(at_once: int, seconds: float, lasting: float) -> Iterator[Track]:
    """So many vehicles at each time, each for at most so long; another one follows it."""
    numbers = itertools.count(1)
    for vehicle in range(at_once):
        lane, place = vehicle % LANES, vehicle // LANES
        radius, speed = 160.0 + 3.5 * lane, 8.0 + lane
        first = lasting * (place * 7919 % 1000) / 1000.0 if lasting < seconds else 0.0
        edges = [0.0, *np.arange(first or lasting, seconds, lasting).tolist(), seconds]
        for begin, end in itertools.pairwise(edges):
            frame = np.arange(round(begin * HZ), round(end * HZ))
            if len(frame) < 2:
                continue
            t = frame / HZ
            angle = 2.0 * np.pi * place / -(-at_once // LANES)
            angle = angle + speed * t / radius + 0.02 * np.sin(t / 5.0)
            now = speed + 0.004 * radius * np.cos(t / 5.0)
            hdg = np.remainder(angle + 1.5 * np.pi, 2.0 * np.pi) - np.pi
            yield Track(
                next(numbers), frame, radius * np.cos(angle), radius * np.sin(angle),
                now * np.cos(hdg), now * np.sin(hdg), hdg,
            )  # fmt: skip


def write_tracks(path: Path, at_once: int, seconds: float, *, lasting: float) -> Path:
    """A table in the schema that its name is of, with the files beside it."""
    of_interaction = path.name.startswith("vehicle_tracks")
    users = []
    with path.open("wb") as out:
        for track in tracks_on_rings(at_once, seconds, lasting):
            rows = _interaction_rows(track) if of_interaction else _ind_rows(track)
            rows.write_csv(
                out, include_header=not users, float_precision=3 if of_interaction else 5
            )
            users.append((track.number, 1.8, 4.5, "car"))
    if not of_interaction:
        meta = pl.DataFrame(users, schema=["trackId", "width", "length", "class"], orient="row")
        meta.write_csv(path.with_name(path.name.replace("_tracks", "_tracksMeta")))
        beside = path.with_name(path.name.replace("_tracks", "_recordingMeta"))
        beside.write_text(f"recordingId,frameRate\n0,{HZ}\n", encoding="utf-8")
    return path


def _interaction_rows(track: Track) -> pl.DataFrame:
    return pl.DataFrame({"frame_id": track.frame + 1}).select(
        pl.lit(track.number).alias("track_id"),
        "frame_id",
        (pl.col("frame_id") * (1000 // HZ)).alias("timestamp_ms"),
        pl.lit("car").alias("agent_type"),
        *(pl.lit(pl.Series(name, getattr(track, name))) for name in ("x", "y", "vx", "vy")),
        pl.lit(pl.Series("psi_rad", track.hdg)),
        pl.lit(4.5).alias("length"),
        pl.lit(1.8).alias("width"),
    )


def _ind_rows(track: Track) -> pl.DataFrame:
    ax, ay = np.gradient(track.vx) * HZ, np.gradient(track.vy) * HZ
    along = np.hypot(track.vx, track.vy)
    none = np.zeros(len(track.frame))
    return pl.DataFrame(
        {
            "recordingId": none.astype(int), "trackId": none.astype(int) + track.number,
            "frame": track.frame, "trackLifetime": track.frame - track.frame[0],
            "xCenter": track.x, "yCenter": track.y, "heading": np.degrees(track.hdg) % 360.0,
            "width": none + 1.8, "length": none + 4.5, "xVelocity": track.vx,
            "yVelocity": track.vy, "xAcceleration": ax, "yAcceleration": ay, "lonVelocity": along,
            "latVelocity": none, "lonAcceleration": ax, "latAcceleration": ay,
        }
    )  # fmt: skip


def read_file(path: Path) -> None:
    """Peak memory and seconds of reading, in processes of their own, in turn."""
    found: dict[str, list[tuple[float, float, float]]] = {name: [] for name in _READERS}
    for _ in range(ROUNDS):
        for name, code in _READERS.items():
            before, begun = os.times(), time.perf_counter()
            done = subprocess.run(
                [sys.executable, "-c", f"{code}\n{_PEAK}", str(path)],
                check=True, capture_output=True, text=True,
            )  # fmt: skip
            wall, after = time.perf_counter() - begun, os.times()
            busy = after.children_user + after.children_system
            busy -= before.children_user + before.children_system
            found[name].append((wall, busy, int(done.stdout) * 1024 / 1e9))
    size = path.stat().st_size / 1e9
    for name, rounds in found.items():
        wall, busy, peak = (statistics.median(column) for column in zip(*rounds, strict=True))
        print(
            f"{path.name}, {size:.2f} GB, read by {name}: {wall:.1f} s, {busy:.1f} s of computing, "
            f"at most {peak:.2f} GB of memory" + (" (aim 2)" if name == "odscen" else "")
        )


def open_file(browser: Browser, url: str, path: Path) -> None:
    """From the choice of a file, or of what is kept of it, to its first moment; scrubbing."""
    with browser.new_context(base_url=url, viewport={"width": 1360, "height": 850}) as context:
        context.add_init_script(f"localStorage.setItem({tool.TOUR_SEEN!r}, 'seen')")
        page = context.new_page()
        page.goto("/")
        with page.expect_file_chooser() as chooser:
            page.get_by_role("button", name="Open a recording").click()
        begun = time.monotonic()
        chooser.value.set_files(path)
        page.wait_for_function(_SHOWN, timeout=600_000)
        dropped = time.monotonic() - begun
        kept = [_open_kept(page, path.stem) for _ in range(ROUNDS)]
        print(
            f"{path.name}, {path.stat().st_size / 1e9:.2f} GB: first moment {dropped:.1f} s after "
            f"it was chosen, {statistics.median(kept):.1f} s once it is kept (aim 10)"
        )
        for what, share in (("all of it", 1.0), ("40 s of it", 40.0 / 3600.0)):
            rounds = [page.evaluate(_SCRUB, [0.0, share, SCRUBBED]) for _ in range(ROUNDS)]
            frames, worst = (statistics.median(column) for column in zip(*rounds, strict=True))
            print(f"  scrubbed {what}: {frames:.0f} frames/s (aim 30), longest {worst:.0f} ms")


def _open_kept(page: Page, name: str) -> float:
    page.goto("/")
    link = page.get_by_role("region", name="Your recordings").get_by_role("link", name=name)
    link.wait_for()
    begun = time.monotonic()
    link.click()
    page.wait_for_function(_SHOWN, timeout=60_000)
    return time.monotonic() - begun


if __name__ == "__main__":
    main()
