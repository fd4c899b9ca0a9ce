"""Tools of the map: lengths and areas are measured, layers shown and hidden."""

from __future__ import annotations

import re
from collections.abc import Callable

import pytest
from playwright.sync_api import Locator, expect

from tests.browser.pages import OdscenPage
from tests.browser.test_keyboard import press
from tests.browser.test_narrow import wrong
from tools.page import Served


def ruler(user: OdscenPage) -> Locator:
    return user.page.get_by_role("button", name=re.compile("^Measure lengths"))


def measured(user: OdscenPage) -> Locator:
    return user.page.locator(".map-measured [role=status]")


def metres(text: str) -> float:
    found = re.search(r"Length ([\d.]+) m", text)
    assert found, text
    return float(found[1])


def test_a_length_and_an_area_are_measured_and_the_scenario_stays_as_it_is(
    user: OdscenPage, sampled: str
) -> None:
    user.open_editor(sampled)
    before = user.document()
    user.step("Road users").click()
    user.names.first.click()
    user.kind("Car").click()
    place = user.graph.starts(before["roi"], 4)[0]
    user.map.area.focus()
    user.map.steer(place)
    ruler(user).click()
    expect(ruler(user)).to_have_attribute("aria-pressed", "true")
    x, y = user.map.view()[:2]
    for dx, dy in ((0, 0), (12, 0), (12, 9)):
        user.map.click((x + dx, y + dy))
    assert metres(measured(user).inner_text()) == pytest.approx(21.0, abs=0.3)
    user.map.click((x, y))
    expect(measured(user)).to_contain_text(re.compile(r"Area 5[345] m², perimeter 3[56]\.\d m"))
    for _ in range(2):
        user.page.keyboard.press("Backspace")
    assert metres(measured(user).inner_text()) == pytest.approx(12.0, abs=0.2)
    user.page.keyboard.press("Escape")
    expect(measured(user)).to_have_count(0)
    assert user.document() == before
    expect(user.undo).to_be_disabled()
    # The tool that was chosen before is at hand again.
    with user.changing():
        user.map.click(place)
    assert len(user.document()["actors"]) == len(before["actors"]) + 1


def test_a_length_is_measured_with_the_keyboard_alone(user: OdscenPage, sampled: str) -> None:
    user.open_editor(sampled)
    before = user.document()
    keyboard = user.page.keyboard
    user.tab_to(user.map.area)
    for key in ("r", "Enter", "ArrowRight", "ArrowRight", "Enter"):
        keyboard.press(key)
    scale = user.map.view()[2]
    assert metres(measured(user).inner_text()) == pytest.approx(120 / scale, rel=0.02)
    press(user, user.page.get_by_role("button", name="End measuring"))
    expect(measured(user)).to_have_count(0)
    assert user.document() == before


def test_layers_are_shown_and_hidden_and_remembered(user: OdscenPage, sampled: str) -> None:
    user.open_editor(sampled)
    page = user.page
    layers = page.get_by_role("button", name="Layers of the map")
    minimap = page.locator(".minimap")
    expect(minimap).to_be_visible()
    press(user, layers)
    for name in ("Grid with coordinates", "Overview map"):
        press(user, page.get_by_role("checkbox", name=name), "Space")
    expect(minimap).to_have_count(0)
    page.keyboard.press("Escape")
    expect(layers).to_be_focused()
    page.reload()
    user.wait_for_editor()
    expect(minimap).to_have_count(0)
    layers.click()
    expect(page.get_by_role("checkbox", name="Grid with coordinates")).to_be_checked()
    expect(page.get_by_role("checkbox", name="Names of roads")).not_to_be_checked()


@pytest.mark.slow
@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_tools_of_the_map_in_windows_of_all_sizes(
    open_page: Callable[..., OdscenPage], served: Served, sampled: str, scheme: str
) -> None:
    user = open_page(served.url, color_scheme=scheme)
    user.open_editor(sampled)
    ruler(user).click()
    x, y = user.map.view()[:2]
    for dx, dy in ((0, 0), (12, 0), (12, 9), (0, 0)):
        user.map.click((x + dx, y + dy))
    expect(measured(user)).to_contain_text("Area")
    found = wrong(user, "measured")
    user.page.get_by_role("button", name="Layers of the map").click()
    for name in ("Grid with coordinates", "Names of roads and junctions"):
        user.page.get_by_role("checkbox", name=name).check()
    found += wrong(user, "layers")
    assert not found, "\n".join(found)
