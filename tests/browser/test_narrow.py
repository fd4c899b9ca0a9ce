"""Every view in windows of several sizes, light and dark, in both languages, three dimensions too:
axe finds nothing, no text is cut off, and on a narrow screen the map stays in sight.
"""

from __future__ import annotations

import re
from collections.abc import Callable

import pytest
from playwright.sync_api import expect

from tests.browser.clipped_text import clipped_texts
from tests.browser.conftest import ARTEFACTS
from tests.browser.pages import OdscenPage, settle
from tests.browser.test_accessibility import AXE
from tests.browser.test_german_sentences import GERMAN
from tests.browser.test_mending import spot
from tools.page import Served

SIZES = {"1440": (1440, 900), "1024": (1024, 768), "390": (390, 844), "zoomed": (720, 450)}
"""Pixels of the windows; the last is the first at 200 %."""
STEPS = 13
ROAD_USERS = 3
"""Number of that step."""
TABS = 5
AXE_RULES = """async () => (await axe.run({resultTypes: ['violations']})).violations
    .flatMap(rule => rule.nodes.map(node => `${rule.id}: ${node.html.slice(0, 120)}`))"""


@pytest.fixture(params=["light-en", "dark-en", "light-de", "dark-de"])
def viewer(
    open_page: Callable[..., OdscenPage], served: Served, request: pytest.FixtureRequest
) -> OdscenPage:
    scheme, language = request.param.split("-")
    user = open_page(served.url, color_scheme=scheme)
    if language == "de":
        user.page.add_init_script(GERMAN)
    return user


def wrong(user: OdscenPage, view: str) -> list[str]:
    """What is wrong with the view that is open, in a window of each size."""
    found = []
    folder = ARTEFACTS / "narrow"
    folder.mkdir(parents=True, exist_ok=True)
    language = user.page.evaluate("document.documentElement.lang")
    for size, (width, height) in SIZES.items():
        user.page.set_viewport_size({"width": width, "height": height})
        settle(user.page)
        name = re.sub(r"\W+", "-", f"{view}-{language}-{size}")
        user.page.screenshot(path=folder / f"{name}.png")
        user.page.evaluate(AXE.read_text(encoding="utf-8"))
        found += [f"{view} {size}: {one}" for one in user.page.evaluate(AXE_RULES)]
        found += [f"{view} {size}: cut off {one}" for one in clipped_texts(user.page)]
    user.page.set_viewport_size({"width": 1360, "height": 850})
    return found


def assert_map_in_sight(user: OdscenPage) -> None:
    """On a screen of 390 pixels a good part of the map is seen, without scrolling."""
    usual = user.page.viewport_size
    assert usual is not None
    user.page.set_viewport_size({"width": 390, "height": 844})
    settle(user.page)
    box = user.map.area.bounding_box()
    assert box is not None
    seen = min(box["y"] + box["height"], 844) - max(box["y"], 0)
    assert seen * box["width"] > 0.25 * 390 * 844
    user.page.set_viewport_size(usual)


@pytest.mark.slow
def test_lists_in_windows_of_all_sizes(viewer: OdscenPage, sampled: str) -> None:
    found = []
    for view in ("", "studies", f"sweeps/{sampled}", f"runs/{sampled}"):
        viewer.page.goto(f"/#/{view}")
        expect(viewer.page.get_by_role("heading", level=1)).to_be_visible()
        found += wrong(viewer, view or "catalogue")
    assert not found, "\n".join(found)


@pytest.mark.slow
def test_each_step_of_the_editor_in_windows_of_all_sizes(viewer: OdscenPage, sampled: str) -> None:
    page = viewer.page
    page.goto(f"/#/edit/{sampled}")
    heads = page.locator(".step-head")
    expect(heads).to_have_count(STEPS)
    found = []
    for number in range(STEPS):
        heads.nth(number).click()
        expect(heads.nth(number)).to_have_attribute("aria-expanded", "true")
        found += wrong(viewer, f"step {number + 1}")
    heads.nth(ROAD_USERS).click()
    page.locator("[data-row] .row-button").first.click()
    expect(page.get_by_label(re.compile("^Ego: "))).to_be_visible()
    found += wrong(viewer, "a road user")
    assert_map_in_sight(viewer)
    page.keyboard.press("Control+k")
    expect(page.get_by_role("dialog")).to_be_visible()
    found += wrong(viewer, "palette")
    page.keyboard.press("Escape")
    page.get_by_role("banner").locator("[aria-haspopup=menu]").first.click()
    page.get_by_role("menuitem").nth(4).click()
    expect(page.get_by_role("dialog")).to_be_visible()
    found += wrong(viewer, "compare")
    assert not found, "\n".join(found)


@pytest.mark.slow
def test_a_run_its_recording_and_its_result_in_windows_of_all_sizes(
    viewer: OdscenPage, sampled: str
) -> None:
    page = viewer.page
    runs = [
        page.request.post("/api/runs", data={"scenario": sampled, "speed": speed}).json()["run"]
        for speed in (1.0, None)
    ]
    page.goto(f"/#/run/{sampled}/{runs[0]}")
    expect(viewer.map.area).to_be_visible()
    expect(page.locator(".strip .figure b").first).not_to_have_text(re.compile(r"^0:00[.,]0$"))
    found = wrong(viewer, "live view")
    while viewer.get(f"/runs/{runs[1]}")["state"] not in ("completed", "failed"):
        page.wait_for_timeout(300)
    page.goto(f"/#/run/{sampled}/{runs[1]}")
    tabs = page.get_by_role("tab")
    expect(page.get_by_role("slider")).to_be_visible()
    for number in range(TABS):
        tabs.nth(number).click()
        found += wrong(viewer, f"tab {number + 1}")
    assert_map_in_sight(viewer)
    page.set_viewport_size({"width": 390, "height": 844})
    settle(page)
    tools = page.locator(".map-tools-row > *")
    boxes = [box for one in tools.all() if (box := one.bounding_box()) is not None]
    assert len(boxes) >= 4
    assert all(box["x"] >= 0 and box["x"] + box["width"] <= 390 for box in boxes)
    assert not found, "\n".join(found)


@pytest.mark.slow
def test_three_dimensions_in_windows_of_all_sizes(viewer: OdscenPage, sampled: str) -> None:
    page = viewer.page
    answer = page.request.post("/api/runs", data={"scenario": sampled, "speed": None})
    run = answer.json()["run"]
    while viewer.get(f"/runs/{run}")["state"] not in ("completed", "failed"):
        page.wait_for_timeout(300)
    found = []
    for view in (f"run/{sampled}/{run}", f"edit/{sampled}"):
        for camera in ("above", "seat"):
            page.goto("/#/studies")  # so that the address is read anew
            page.goto(f"/#/{view}?camera={camera}")
            expect(page.locator(".scenery canvas")).to_be_visible()
            page.wait_for_timeout(800)
            found += wrong(viewer, f"3D {view.split('/')[0]} {camera}")
    assert not found, "\n".join(found)


@pytest.mark.slow
def test_the_page_that_mends_a_map_in_windows_of_all_sizes(viewer: OdscenPage) -> None:
    viewer.page.goto("/#/mend/signal_crossing")
    expect(viewer.map.area).to_be_visible()
    found = wrong(viewer, "mending")
    viewer.map.click(spot("1", -2, 70.0))
    side = viewer.page.locator(".import-side")
    expect(side.locator("input").first).to_be_visible()
    found += wrong(viewer, "mending a lane")
    assert_map_in_sight(viewer)
    assert not found, "\n".join(found)
