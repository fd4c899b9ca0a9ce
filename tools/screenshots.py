"""Writes docs/images/page-*.png: every view of the page, light and dark.

``python -m tools.screenshots [FOLDER]``.
"""

from __future__ import annotations

import io
import re
import sys
import tempfile
from pathlib import Path

from PIL import Image
from playwright.sync_api import Browser, expect

from odscen.app.maps import load_map
from odscen.app.scenarios import SUFFIX, generate, write_scenario
from odscen.scenario import edits
from odscen.scenario.demand.count_stations import transitions
from odscen.scenario.document.scenario_document import MapReference, Scenario
from odscen.scenario.sampling.generation_settings import GenerationSettings
from odscen.workspace.shipped import shipped_maps
from odscen.workspace.store import Workspace
from tests.browser.pages import OdscenPage, settle
from tests.signal_case import program
from tests.signal_case import scenario as lit_scenario
from tools import page as tool

IMAGES = tool.ROOT / "docs/images"
MAP = "town_5x5"
SMALL = "signal_crossing"
COUNTED, LONG, LIT = "morning", "night", "signals"
SIZE = {"width": 1280, "height": 800}
LARGEST = 400_000


class Camera:
    """Takes pictures of one page in one colour scheme."""

    def __init__(self, user: OdscenPage, scheme: str, folder: Path) -> None:
        self.user, self.scheme, self.folder = user, scheme, folder

    def take(self, view: str) -> None:
        """Keep what is seen now, once nothing moves, under the view's name."""
        settle(self.user.page)
        raw = Image.open(io.BytesIO(self.user.page.screenshot())).convert("RGB")
        path = self.folder / f"page-{view}-{self.scheme}.png"
        raw.save(path, optimize=True)
        size = path.stat().st_size
        if size > LARGEST:
            sys.exit(f"{path} has {size} bytes, more than {LARGEST}")
        print(f"{path.name}: {size // 1000} kB")


def main() -> None:
    folder = Path(sys.argv[1]) if sys.argv[1:] else IMAGES
    folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as name:
        workspace = Workspace.open(Path(name))
        for path in shipped_maps():
            workspace.add_map(path)
        made = generate(
            workspace, settings=GenerationSettings(map_name=MAP, seed=5, fill=0.15, roi_segments=7)
        )[0]
        scenario = made.name.removesuffix(SUFFIX)
        _counted(workspace)
        _long(workspace)
        _lit(workspace)
        with tool.served(Path(name)) as server, tool.launched() as browser:
            for scheme in ("light", "dark"):
                _views(browser, server.url, scheme, scenario, folder)
                _traffic_views(browser, server.url, scheme, folder)
                _signal_view(browser, server.url, scheme, folder)


def _counted(workspace: Workspace) -> None:
    """Save a scenario with background traffic and counts, some of which contradict each other."""
    graph = load_map(workspace.map(MAP)).sumo.graph
    scenario = edits.new_scenario(graph, name=COUNTED, roi=graph.segments.ids)
    scenario = edits.set_clock(scenario, clock=7.5 * 3600)
    mix = {"car": 8, "van": 1, "bicycle": 1}
    scenario = edits.set_background(
        scenario, graph, background="others", per_km=2, profile="weekday", mix=mix
    )
    streams = sorted(
        (one, other)
        for one, others in transitions(graph).items()
        for other in others
        if one.startswith("r")
    )[::3]
    rows = [(f"{one}>{other}", 0, 600, 5 + 7 * n % 30) for n, (one, other) in enumerate(streams)]
    scenario = edits.set_counts(scenario, graph, counts="survey", rows=rows)
    _save(workspace, COUNTED, scenario)


def _long(workspace: Workspace) -> None:
    """Save a scenario of hours."""
    graph = load_map(workspace.map(SMALL)).sumo.graph
    scenario = edits.new_scenario(graph, name=LONG, roi=graph.segments.ids)
    scenario = edits.set_simulation(scenario, duration=24 * 3600, step_length=1.0)
    scenario = edits.set_background(scenario, graph, background="others", trips=1200)
    _save(workspace, LONG, scenario)


def _lit(workspace: Workspace) -> None:
    """Save a scenario with the signal program of the guide."""
    info = workspace.map(SMALL).info
    one = lit_scenario(program(), control="actuated", clock=12 * 3600.0, until=300.0)
    reference = MapReference(name=SMALL, sha256=info["sha256"])
    _save(workspace, LIT, one.model_copy(update={"map": reference}))


def _save(workspace: Workspace, name: str, scenario: Scenario) -> None:
    write_scenario(scenario, workspace.scenarios / f"{name}{SUFFIX}")


def _traffic_views(browser: Browser, url: str, scheme: str, folder: Path) -> None:
    with browser.new_context(base_url=url, viewport=SIZE, color_scheme=scheme) as context:
        context.add_init_script(f"localStorage.setItem({tool.TOUR_SEEN!r}, 'seen')")
        user = OdscenPage(context.new_page())
        camera = Camera(user, scheme, folder)
        user.open_editor(COUNTED)
        user.step("Traffic").click()
        camera.take("traffic")
        user.step("Run").click()
        user.choose_pace("As fast as possible")
        user.run.click()
        expect(user.result).to_contain_text("finished", timeout=120_000)
        user.page.get_by_role("tab", name="Counts").click()
        expect(user.page.get_by_role("heading", name="counts met")).to_be_visible()
        camera.take("counts")
        user.open_editor(LONG)
        user.step("Run").click()
        user.run.click()
        expect(user.page.get_by_text(re.compile(r"^\d of \d parts completed"))).to_be_visible(
            timeout=120_000
        )
        user.control("Resume later").click()
        expect(user.result).to_contain_text("interrupted")
        camera.take("interrupted")


def _signal_view(browser: Browser, url: str, scheme: str, folder: Path) -> None:
    with browser.new_context(base_url=url, viewport=SIZE, color_scheme=scheme) as context:
        context.add_init_script(f"localStorage.setItem({tool.TOUR_SEEN!r}, 'seen')")
        user = OdscenPage(context.new_page())
        user.open_editor(LIT)
        user.step("Run").click()
        user.choose_pace("As fast as possible")
        user.run.click()
        expect(user.result).to_contain_text("finished", timeout=120_000)
        user.page.get_by_role("button", name="Watch again").click()
        moment = user.page.get_by_label("Moment of the run")
        expect(moment).to_be_visible()
        moment.fill("188")
        user.page.get_by_role("tab", name="Lights").click()
        expect(user.page.get_by_role("heading", name="Stages")).to_be_visible()
        user.map.area.focus()
        for _ in range(3):
            user.page.keyboard.press("+")
        user.page.get_by_role("tab", name="Lights").focus()
        Camera(user, scheme, folder).take("signals")


def _views(browser: Browser, url: str, scheme: str, scenario: str, folder: Path) -> None:
    with browser.new_context(base_url=url, viewport=SIZE, color_scheme=scheme) as context:
        context.add_init_script(f"localStorage.setItem({tool.TOUR_SEEN!r}, 'seen')")
        user = OdscenPage(context.new_page())
        camera = Camera(user, scheme, folder)
        user.open_catalogue()
        expect(user.maps).to_have_count(len(shipped_maps()))
        user.page.wait_for_load_state("networkidle")  # the cards' pictures
        camera.take("catalogue")
        user.page.get_by_role("button", name=f"Import report of {MAP}").click()
        expect(user.page.get_by_role("dialog")).to_be_visible()
        user.page.wait_for_load_state("networkidle")
        camera.take("conversion")
        user.page.keyboard.press("Escape")
        user.open_editor(scenario)
        for step in ("Region", "Weather and time"):
            user.step(step).click()
            if step == "Region":
                user.page.get_by_role("button", name="Show the region").click()
            camera.take(step.split(maxsplit=1)[0].lower())
        user.step("Road users").click()
        user.names.first.click()
        expect(user.ego).to_be_visible()
        user.page.get_by_role("button", name="Show goals").click()
        camera.take("road-users")
        user.step("Run").click()
        user.run.click()
        user.wait_until_moving()
        expect(user.figure("Time").first).to_have_text("0:06.0", timeout=30_000)
        user.control("Pause").click()
        expect(user.control("Resume")).to_be_enabled()
        camera.take("run")
        user.control("Resume").click()
        user.choose_speed("As fast")
        expect(user.result).to_contain_text("finished", timeout=60_000)
        expect(user.result.get_by_role("link", name="Full report")).to_be_visible()
        camera.take("result")
        user.page.get_by_role("tab", name="Charts").click()
        expect(user.page.get_by_role("img").first).to_be_visible()
        user.page.wait_for_load_state("networkidle")
        camera.take("charts")
        user.page.get_by_role("tab", name="Runs").click()
        camera.take("runs")


if __name__ == "__main__":
    main()
