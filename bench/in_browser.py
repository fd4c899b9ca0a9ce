"""What a user of the page waits for: a large map, the first picture of a run, a run with a crowd.

Aims: the editor usable 2 s after a town is chosen, the first live frame 1.5 s after Run; with 2,000
vehicles 20 simulated steps a second held and seen, a run in a hurry slowed by at most 10 % by being
watched, and by nothing by a client that never reads.
"""

from __future__ import annotations

import statistics
import tempfile
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any

import httpx2
from playwright.sync_api import Browser, Page
from websockets.sync.client import connect

from bench.canvas import TOWN
from bench.common import shared_maps
from odscen.app.generation import generate
from odscen.app.scenarios import SUFFIX
from odscen.maps.shipped import shipped_maps
from odscen.maps.store import Workspace
from odscen.scenario.sampling.generation_settings import GenerationSettings
from tests.browser.pages import OdscenPage
from tools import page as tool

SHIPPED = "signal_crossing"
STEP = 0.05
PACED_SECONDS = 60.0
HURRIED_SECONDS = 20.0
REPEATS = 3

_PROBE = """
window.odscenProbe = {pressed: 0, frames: []};
addEventListener('pointerdown', () => { window.odscenProbe.pressed = performance.now(); }, true);
const Plain = WebSocket;
window.WebSocket = class extends Plain {
  constructor(...a) {
    super(...a);
    this.addEventListener('message', ({data}) => {
      if (typeof data === 'string') return;
      const [step, , count] = new Float32Array(data, 0, 3);
      requestAnimationFrame(() => window.odscenProbe.frames.push([performance.now(), step, count]));
    });
  }
};
"""
"""Notes when a frame that has come is drawn, and when a button was pressed last."""

_USABLE = """() => {
  const map = document.querySelector('[role=application]');
  if (!map || map.dataset.view === '0 0 1') return false;
  return performance.now() - window.odscenProbe.pressed;
}"""


def main() -> None:
    with tempfile.TemporaryDirectory() as name, ExitStack() as stack:
        workspace = Workspace.open(Path(name))
        workspace.add_map(next(path for path in shipped_maps() if path.stem == SHIPPED))
        small = _sampled(workspace, SHIPPED, fill=0.3)
        shared = shared_maps()
        town = Path(TOWN).stem
        crowd = None
        if shared is not None:
            workspace.add_map(shared / TOWN)
            crowd = _sampled(workspace, town, fill=0.9, roi_segments=400)
        server = stack.enter_context(tool.served(Path(name)))
        browser = stack.enter_context(tool.launched())
        first_frame(browser, server.url, small)
        if crowd is None:
            print(f"no folder of real maps with {TOWN} here: nothing large is measured")
            return
        usable(browser, server.url, town)
        paced(browser, server.url, crowd)
        hurried(browser, server.url, crowd)


def _sampled(workspace: Workspace, map_name: str, **options: Any) -> str:
    path = generate(workspace, settings=GenerationSettings(map_name=map_name, seed=5, **options))[0]
    return path.name.removesuffix(SUFFIX)


@contextmanager
def _user(browser: Browser, url: str) -> Iterator[OdscenPage]:
    with browser.new_context(base_url=url, viewport={"width": 1360, "height": 850}) as context:
        context.add_init_script(f"localStorage.setItem({tool.TOUR_SEEN!r}, 'seen')")
        context.add_init_script(_PROBE)
        yield OdscenPage(context.new_page())


def first_frame(browser: Browser, url: str, scenario: str) -> None:
    """From Run to the first frame that is drawn."""
    times = []
    for _ in range(6):
        with _user(browser, url) as user:
            user.open_editor(scenario)
            user.step("Run").click()
            user.run.click()
            page = user.page
            page.wait_for_function("window.odscenProbe.frames.length")
            seconds = page.evaluate("odscenProbe.frames[0][0] - odscenProbe.pressed") / 1000
            times.append(seconds)
            user.control("Stop").click()
            user.result.wait_for()
    print(
        f"from Run to the first live frame on {SHIPPED}: {times[0]:.2f} s for the first run of a "
        f"server, then {statistics.median(times[1:]):.2f} s (aim 1.5)"
    )


def usable(browser: Browser, url: str, name: str) -> None:
    """From the choice of a town to an editor that shows it."""
    times = []
    for _ in range(4):
        with _user(browser, url) as user:
            user.open_catalogue()
            user.new_scenario(name).click()
            times.append(user.page.wait_for_function(_USABLE).json_value() / 1000)
    print(
        f"editor usable after choosing {name}: {times[0]:.2f} s the first time, then "
        f"{statistics.median(times[1:]):.2f} s (aim 2)"
    )


def paced(browser: Browser, url: str, scenario: str) -> None:
    """Real time with a crowd, seen by a user who also pans the map."""
    with _user(browser, url) as user:
        run = _start(url, scenario, speed=1, until=PACED_SECONDS)
        user.page.goto(f"/#/run/{scenario}/{run}")
        user.page.wait_for_function("odscenProbe.frames.length > 20", timeout=120_000)
        for what, pan in (("still", False), ("panned all the time", True)):
            begun = len(_frames(user.page))
            end = time.monotonic() + 6
            while time.monotonic() < end:
                if pan:
                    _pan(user)
                else:
                    user.page.wait_for_timeout(200)
            seen = _frames(user.page)[begun:]
            seconds = (seen[-1][0] - seen[0][0]) / 1000
            steps = (seen[-1][1] - seen[0][1]) / seconds
            print(
                f"{seen[-1][2]:.0f} vehicles at 20 steps/s, map {what}: {steps:.1f} steps/s and "
                f"{(len(seen) - 1) / seconds:.1f} drawn frames/s (aim 20)"
            )
        httpx2.post(f"{url}/api/runs/{run}/control", json={"action": "stop"})


def _frames(page: Page) -> list[list[float]]:
    found: list[list[float]] = page.evaluate("odscenProbe.frames")
    return found


def _pan(user: OdscenPage) -> None:
    mouse = user.page.mouse
    mouse.move(700, 400)
    mouse.down()
    for k in range(20):
        mouse.move(700 - 6 * k, 400 - 3 * k)
    for k in range(20):
        mouse.move(580 + 6 * k, 340 + 3 * k)
    mouse.up()


def hurried(browser: Browser, url: str, scenario: str) -> None:
    """The same run as fast as it can: unwatched, with a client that never reads, and watched."""
    times: dict[str, list[float]] = {"unwatched": [], "never read": [], "watched": []}
    for _ in range(REPEATS):
        for kind, values in times.items():
            with ExitStack() as stack:
                user = stack.enter_context(_user(browser, url)) if kind == "watched" else None
                run = _start(url, scenario, speed=None, until=HURRIED_SECONDS)
                if kind == "never read":
                    live = f"{url.replace('http', 'ws')}/api/runs/{run}/live"
                    never = connect(live, max_queue=1, close_timeout=0.1, ping_interval=None)
                    stack.enter_context(never)
                if user:
                    user.page.goto(f"/#/run/{scenario}/{run}")
                values.append(_duration(url, run))
    base = statistics.median(times["unwatched"])
    for kind, values in times.items():
        ratios = [a / b for a, b in zip(values, times["unwatched"], strict=True)]
        print(
            f"{HURRIED_SECONDS:g} s with a crowd, {kind}: {statistics.median(values):.2f} s, "
            f"{statistics.median(ratios):.3f} of unwatched ({base:.2f} s; aim 1.10)"
        )


def _start(url: str, scenario: str, *, speed: float | None, until: float) -> str:
    wish = {"scenario": scenario, "speed": speed, "step_length": STEP, "until": until}
    answer = httpx2.post(f"{url}/api/runs", json=wish, timeout=60)
    answer.raise_for_status()
    return str(answer.json()["run"])


def _duration(url: str, run: str) -> float:
    """Wall seconds between the first step and the last."""
    begun = None
    while True:
        state = httpx2.get(f"{url}/api/runs/{run}").json()["state"]
        if begun is None and state == "running":
            begun = time.monotonic()
        if state not in ("preparing", "running"):
            if begun is None:
                raise RuntimeError(f"{run}: {state} before it ran")
            return time.monotonic() - begun
        time.sleep(0.05)
