"""The page in a real browser, on a server of its own: for tests, benchmarks and screenshots."""

from __future__ import annotations

import re
import subprocess
import sys
import time
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from playwright.sync_api import sync_playwright

from tools import chromium

if TYPE_CHECKING:
    from collections.abc import Iterator

    from playwright.sync_api import Browser

ROOT = Path(__file__).parents[1]
BUILT = ROOT / "src/odscen/web/static/index.html"
TOUR_SEEN = "odscen.tour"
"""Key under which a browser remembers that its user has seen the first-use tour."""


@dataclass(frozen=True)
class Served:
    """A running ``odscen serve``."""

    url: str
    workspace: Path
    process: subprocess.Popen[str]


@contextmanager
def served(workspace: Path, *options: str) -> Iterator[Served]:
    """``odscen serve`` as a process with more options, on a free port of this machine."""
    command = [sys.executable, "-m", "odscen", "serve", "--no-browser", "--no-token", "--port", "0"]
    log = workspace / "serve.log"
    with (
        log.open("w", encoding="utf-8") as told,
        subprocess.Popen(
            [*command, "--workspace", str(workspace), *options], stderr=told, text=True
        ) as process,
    ):
        try:
            yield Served(_address(log, process), workspace, process)
        finally:
            process.terminate()
            process.wait(timeout=30)


def _address(log: Path, process: subprocess.Popen[str]) -> str:
    """Where the server says that it is; it listens before it says so."""
    while not (
        found := re.search(r"odscen is at (http://\S+?)/\s", log.read_text(encoding="utf-8"))
    ):
        if process.poll() is not None:
            raise RuntimeError(log.read_text(encoding="utf-8"))
        time.sleep(0.02)
    return found[1]


@contextmanager
def launched() -> Iterator[Browser]:
    """A headless Chromium that draws in software."""
    path = chromium.find()
    if path is None:
        raise RuntimeError("no Chromium here; `python -m tools.chromium` says what to do")
    with sync_playwright() as play:
        browser = play.chromium.launch(executable_path=path, args=list(chromium.FLAGS))
        try:
            yield browser
        finally:
            browser.close()
