"""Every view in windows of several sizes, light and dark: axe finds nothing, no text is cut off."""

from __future__ import annotations

from collections.abc import Callable

import pytest
from playwright.sync_api import expect

from tests.browser.clipped_text import clipped_texts
from tests.browser.pages import OdscenPage, settle
from tests.browser.test_accessibility import AXE
from tools.page import Served

SIZES = {"1440": (1440, 900), "1024": (1024, 768), "390": (390, 844), "zoomed": (720, 450)}
"""Pixels of the windows; the last is the first at 200 %."""
STEPS = (
    "Map",
    "Region",
    "Weather and time",
    "Road users",
    "Demand",
    "Traffic lights",
    "Public transport",
    "Measures",
    "Rules",
    "Parameters",
    "Analysis",
    "Criteria",
    "Run",
)
AXE_RULES = """async () => (await axe.run({resultTypes: ['violations']})).violations
    .flatMap(rule => rule.nodes.map(node => `${rule.id}: ${node.html.slice(0, 120)}`))"""


@pytest.fixture(params=["light", "dark"])
def viewer(
    open_page: Callable[..., OdscenPage], served: Served, request: pytest.FixtureRequest
) -> OdscenPage:
    return open_page(served.url, color_scheme=request.param)


def wrong(user: OdscenPage, view: str) -> list[str]:
    """What is wrong with the view that is open, in a window of each size."""
    found = []
    for size, (width, height) in SIZES.items():
        user.page.set_viewport_size({"width": width, "height": height})
        settle(user.page)
        user.page.evaluate(AXE.read_text(encoding="utf-8"))
        found += [f"{view} {size}: {one}" for one in user.page.evaluate(AXE_RULES)]
        found += [f"{view} {size}: cut off {one}" for one in clipped_texts(user.page)]
    user.page.set_viewport_size({"width": 1360, "height": 850})
    return found


@pytest.mark.slow
def test_lists_in_windows_of_all_sizes(viewer: OdscenPage, sampled: str) -> None:
    found = []
    for view in ("", "studies", f"sweeps/{sampled}", f"runs/{sampled}"):
        viewer.page.goto(f"/#/{view}")
        expect(viewer.page.get_by_role("heading", level=1)).to_be_visible()
        found += wrong(viewer, view or "catalogue")
    assert not found, "\n".join(found)


@pytest.mark.slow
@pytest.mark.parametrize("step", STEPS)
def test_each_step_of_the_editor_in_windows_of_all_sizes(
    viewer: OdscenPage, sampled: str, step: str
) -> None:
    viewer.open_editor(sampled)
    viewer.step(step).click()
    found = wrong(viewer, step)
    assert not found, "\n".join(found)


@pytest.mark.slow
def test_a_run_its_recording_and_its_result_in_windows_of_all_sizes(
    viewer: OdscenPage, sampled: str
) -> None:
    answer = viewer.page.request.post("/api/runs", data={"scenario": sampled, "speed": 1.0})
    run = answer.json()["run"]
    viewer.page.goto(f"/#/run/{sampled}/{run}")
    viewer.wait_until_moving()
    found = wrong(viewer, "live view")
    viewer.choose_speed("As fast")
    expect(viewer.result).to_contain_text("finished")
    viewer.page.reload()
    expect(viewer.page.get_by_label("Moment of the run")).to_be_visible()
    for tab in ("Result", "Charts", "Road users", "Incidents", "Lights"):
        viewer.page.get_by_role("tab", name=tab).click()
        found += wrong(viewer, tab)
    assert not found, "\n".join(found)
