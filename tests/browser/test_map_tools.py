"""Tools of the map: lengths and areas are measured, layers shown and hidden."""

from __future__ import annotations

import re
from collections.abc import Callable
from itertools import combinations
from pathlib import Path

import pytest
from lxml import etree
from playwright.sync_api import Locator, expect

from tests.browser.pages import OdscenPage
from tests.browser.test_keyboard import press
from tests.browser.test_narrow import wrong
from tests.browser.test_sharing import ALIKE, SVG, difference, taken
from tools.page import Served

PARTS = (".map-measured", ".map-legend", ".minimap", ".map-buttons", ".map-scale")
"""What lies on the map."""
NARROW_PARTS = (".map-measured", ".map-buttons", ".map-scale")


def ruler(user: OdscenPage) -> Locator:
    return user.page.get_by_role("button", name=re.compile("^Measure lengths"))


def measured(user: OdscenPage) -> Locator:
    return user.page.locator(".map-measured [role=status]")


def drawn(user: OdscenPage) -> str:
    """What is drawn of the scenario."""
    canvas = user.page.locator("canvas[data-layer=scene]")
    return str(canvas.evaluate("canvas => canvas.toDataURL()"))


def metres(text: str) -> float:
    found = re.search(r"Length ([\d.]+) m", text)
    assert found, text
    return float(found[1])


@pytest.mark.slow
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


@pytest.mark.slow
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


@pytest.mark.slow
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
def test_nothing_hangs_at_the_pointer_while_measuring(user: OdscenPage, sampled: str) -> None:
    user.open_editor(sampled)
    user.step("Road users").click()
    user.names.first.click()
    user.kind("Car").click()
    place = user.graph.starts(user.document()["roi"], 4)[0]
    user.map.area.focus()
    user.map.steer(place)
    user.map.hover(place)
    user.kind("Car").hover()
    user.map.view()
    empty = drawn(user)
    user.map.hover(place)
    user.map.view()
    assert drawn(user) != empty, "the car at the pointer is drawn"
    user.page.keyboard.press("r")
    user.map.view()
    assert drawn(user) == empty


@pytest.mark.slow
def test_escape_closes_a_list_before_it_ends_the_measuring(user: OdscenPage, sampled: str) -> None:
    user.open_editor(sampled)
    x, y = user.map.view()[:2]
    ruler(user).click()
    for dx in (0, 10):
        user.map.click((x + dx, y))
    layers = user.page.get_by_role("button", name="Layers of the map")
    press(user, layers)
    grid = user.page.get_by_role("checkbox", name="Grid with coordinates")
    expect(grid).to_be_focused()  # a moment after it is seen; before, keys are those of the map
    user.page.keyboard.press("Escape")
    expect(grid).to_have_count(0)
    assert metres(measured(user).inner_text()) == pytest.approx(10.0, abs=0.2)


@pytest.mark.slow
def test_what_is_measured_is_in_the_drawing_and_the_picture_of_the_map(
    user: OdscenPage, sampled: str, tmp_path: Path
) -> None:
    user.open_editor(sampled)
    x, y, scale = user.map.view()
    before = taken(user, tmp_path, "Export", "Picture of the map (PNG)")
    ruler(user).click()
    # Sides of 120 pixels, which have room for their lengths.
    step = 120 / scale
    for dx, dy in ((0, 0), (step, 0), (step, step), (0, 0)):
        user.map.click((x + dx, y + dy))
    drawing = taken(user, tmp_path, "Export", "Drawing of the map (SVG)")
    picture = taken(user, tmp_path, "Export", "Picture of the map (PNG)")
    # Each word is there twice: the line around it, and itself.
    texts = etree.parse(drawing).iter(f"{SVG}text")
    words = [str(one.text) for one in texts if one.get("fill") != "none"]
    lengths = sorted(float(one[:-2]) for one in words if re.fullmatch(r"[\d.]+ m", one))
    assert lengths == pytest.approx([step, step, step * 2**0.5], rel=0.03)
    assert difference(drawing, picture, user) < ALIKE
    assert before.read_bytes() != picture.read_bytes()


@pytest.mark.slow
def test_a_length_is_measured_by_touch(
    open_page: Callable[..., OdscenPage], served: Served, sampled: str
) -> None:
    user = open_page(served.url, has_touch=True)
    user.open_editor(sampled)
    before = user.document()
    ruler(user).tap()
    x, y = user.map.view()[:2]
    for dx in (0, 15):
        user.page.touchscreen.tap(*user.map.at(x + dx, y))
    assert metres(measured(user).inner_text()) == pytest.approx(15.0, abs=0.3)
    user.page.get_by_role("button", name="End measuring").tap()
    expect(measured(user)).to_have_count(0)
    assert user.document() == before


@pytest.mark.slow
@pytest.mark.parametrize("width", [1360, 390])
@pytest.mark.parametrize("language", ["en", "de"])
def test_nothing_on_the_map_lies_on_something_else(
    open_page: Callable[..., OdscenPage], served: Served, sampled: str, width: int, language: str
) -> None:
    size = {"width": width, "height": 844}
    user = open_page(served.url, viewport=size, locale=language)
    user.page.goto(f"/#/edit/{sampled}")
    user.page.locator(".map-scale").wait_for()
    user.map.area.press("r")
    # The longest that is said.
    x, y, scale = user.map.view()
    for dx in (-40, 0, 40):
        user.map.click((x + dx / scale, y))
    boxes = {}
    # On a narrow screen the legend and the overview give their place to the map.
    for name in PARTS if width > 390 else NARROW_PARTS:
        box = user.page.locator(name).bounding_box()
        assert box is not None, f"{name} is not shown"
        boxes[name] = box
    for (one, a), (other, b) in combinations(boxes.items(), 2):
        across = a["x"] < b["x"] + b["width"] and b["x"] < a["x"] + a["width"]
        along = a["y"] < b["y"] + b["height"] and b["y"] < a["y"] + a["height"]
        assert not (across and along), f"{one} lies on {other}: {a}, {b}"


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
