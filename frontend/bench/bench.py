"""Prints frames per second and picking times of the map canvas in headless Chromium.

Needs a running ``odscen serve`` with the map, and ``pip install playwright`` with a Chromium:
``python frontend/bench/bench.py http://127.0.0.1:8765 Town04``.
"""

from __future__ import annotations

import os
import subprocess
import sys
import time
from pathlib import Path

from playwright.sync_api import sync_playwright

PORT = 5179


def main(server: str, name: str) -> None:
    """Serve the sources, draw, print."""
    frontend = Path(__file__).parents[1]
    vite = subprocess.Popen(
        [
            "node",
            "node_modules/vite/bin/vite.js",
            "--port",
            str(PORT),
            "--strictPort",
            "--host",
            "127.0.0.1",
        ],
        cwd=frontend,
        env={**os.environ, "ODSCEN_SERVER": server},
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    try:
        time.sleep(3)
        with sync_playwright() as play:
            chromium = os.environ.get("CHROMIUM", "/usr/bin/chromium")
            browser = play.chromium.launch(
                executable_path=chromium, args=["--no-sandbox", "--disable-gpu"]
            )
            page = browser.new_page(viewport={"width": 1280, "height": 800})
            page.goto(f"http://127.0.0.1:{PORT}/bench/index.html?map={name}")
            page.wait_for_function("window.odscenBench", timeout=120_000)
            found = page.evaluate("window.odscenBench")
            browser.close()
    finally:
        vite.terminate()
        vite.wait()
    print(f"{found['map']}: {found['nodes']} nodes, {found['vehicles']} vehicles at 20 Hz")
    print(f"  loaded in {found['fetched']:.0f} ms, ready {found['ready']:.0f} ms later")
    for what, figures in found["results"].items():
        print(
            f"  {what:20} {figures['fps']:5.1f} frames/s, {figures['busy']:5.1f} ms each,"
            f" longest pause {figures['worst']:.0f} ms"
        )
    pick = found["pick"]
    print(f"  picking: median {pick['median']:.3f} ms, worst {pick['worst']:.3f} ms")


if __name__ == "__main__":
    main(*sys.argv[1:3])
