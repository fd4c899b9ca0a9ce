"""What is taken away of a view: pictures and drawings of the map."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from lxml import etree
from PIL import Image
from playwright.sync_api import Page, expect

from tests.browser.pages import OdscenPage
from tests.browser.test_interruptions import MOMENT, begun
from tools.page import Served

SVG = "{http://www.w3.org/2000/svg}"
ALIKE = 6.0
"""Most levels (of 255) by which two drawings of the same differ on average: edges of shapes."""


def taken(user: OdscenPage, folder: Path, menu: str, entry: str) -> Path:
    """Download what a menu offers."""
    user.page.get_by_role("button", name=menu).click()
    with user.page.expect_download() as download:
        user.page.get_by_role("menuitem", name=entry).click()
    path = folder / f"{len(list(folder.iterdir()))}-{download.value.suggested_filename}"
    download.value.save_as(path)
    return path


def difference(drawing: Path, picture: Path, user: OdscenPage) -> float:
    """By how much the drawing, shown by a browser, differs from the picture beside its legend."""
    with Image.open(picture) as opened:
        wanted = np.asarray(opened.convert("RGB"), dtype=float)
    height, width, _ = wanted.shape
    viewer = user.page.context.new_page()
    viewer.set_viewport_size({"width": width, "height": height})
    viewer.goto(drawing.as_uri())
    shown = drawing.with_suffix(".shown.png")
    viewer.screenshot(path=shown)
    viewer.close()
    with Image.open(shown) as opened:
        got = np.asarray(opened.convert("RGB"), dtype=float)
    return float(np.abs(got - wanted)[: height // 2].mean())


@pytest.mark.slow
@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_the_drawing_of_a_map_is_the_picture_of_it_with_a_legend(
    open_page: Callable[..., OdscenPage],
    served: Served,
    sampled: str,
    tmp_path: Path,
    scheme: str,
) -> None:
    user = open_page(served.url, color_scheme=scheme)
    user.open_editor(sampled)
    user.step("Road users").click()
    user.names.first.click()
    user.map.area.press("+")
    user.page.wait_for_timeout(500)
    drawing = taken(user, tmp_path, "Export", "Drawing of the map (SVG)")
    picture = taken(user, tmp_path, "Export", "Picture of the map (PNG)")
    words = [one.text for one in etree.parse(drawing).iter(f"{SVG}text")]
    assert {"Vehicle start", "Pedestrian start"} <= set(words)
    assert difference(drawing, picture, user) < ALIKE


@pytest.mark.slow
def test_the_drawing_of_a_recording_has_its_road_users_and_says_what_colours_mean(
    user: OdscenPage, sampled: str, tmp_path: Path
) -> None:
    answer = user.page.request.post("/api/runs", data={"scenario": sampled, "speed": None})
    run = answer.json()["run"]
    while user.get(f"/runs/{run}")["state"] != "completed":
        user.page.wait_for_timeout(300)
    user.page.goto(f"/#/run/{sampled}/{run}")
    user.page.get_by_label("Moment of the run").fill(str(MOMENT))
    empty = taken(user, tmp_path, "Share", "Drawing of the map (SVG)")
    user.choose("Colour by", "Speed")
    coloured = taken(user, tmp_path, "Share", "Drawing of the map (SVG)")
    picture = taken(user, tmp_path, "Share", "Picture of the map (PNG)")
    assert difference(coloured, picture, user) < ALIKE
    before, after = (
        {one.text for one in etree.parse(path).iter(f"{SVG}text")} for path in (empty, coloured)
    )
    assert "Car" in before
    assert "Car" not in after
    assert any("km/h" in str(one) for one in after)


def _look_around(reader: Page, folder: Path) -> None:
    """The replay in three dimensions, from above and from the seat, moves on, and goes again."""
    scenery = reader.locator("#replay-scenery")
    reader.get_by_role("slider", name="Time").press("PageUp")
    seen = []
    for look, key in (("above", ""), ("seat", ""), ("seat", "PageUp")):
        reader.get_by_label("View").select_option(look)
        if key:
            reader.get_by_role("slider", name="Time").press(key)
        expect(scenery.locator("canvas")).to_be_visible()
        reader.wait_for_timeout(900)
        scenery.screenshot(path=folder / f"scenery-{len(seen)}.png")
        with Image.open(folder / f"scenery-{len(seen)}.png") as opened:
            seen.append(np.asarray(opened.convert("RGB"), dtype=float))
    assert len(np.unique(seen[0][::7, ::7].reshape(-1, 3), axis=0)) > 20
    assert np.abs(seen[0] - seen[1]).mean() > 5
    assert np.abs(seen[1] - seen[2]).mean() > 1
    reader.get_by_label("View").select_option("plan")
    expect(scenery).to_be_hidden()


@pytest.mark.slow
def test_the_page_of_a_run_is_handed_on_and_replays_offline(
    open_page: Callable[..., OdscenPage], served: Served, sampled: str, tmp_path: Path
) -> None:
    user = open_page(served.url)
    begun(user, sampled, speed=None)
    page = taken(user, tmp_path, "Share", "Page with replay and report (HTML)")
    reader = user.page.context.new_page()
    problems: list[str] = []
    reader.on("pageerror", lambda error: problems.append(str(error)))
    # What a browser without a graphics card says of its speed is none.
    slow = "GL Driver Message"
    reader.on("console", lambda one: problems.extend([one.text] if slow not in one.text else []))
    reader.context.set_offline(True)
    try:
        reader.goto(page.as_uri())
        stage = reader.locator("#replay-stage")
        shown = int(stage.get_attribute("data-shown") or 0)
        assert shown > 0
        before = stage.screenshot()
        reader.get_by_role("button", name="Play").click()
        expect(stage).to_have_attribute("data-time", re.compile(r"^[1-9]"))  # seconds
        reader.get_by_role("button", name="Pause").click()
        assert stage.screenshot() != before
        reader.get_by_role("slider", name="Time").focus()
        reader.keyboard.press("Home")
        assert stage.get_attribute("data-time") == "0"
        _look_around(reader, tmp_path)
        assert problems == []
    finally:
        reader.context.set_offline(False)
        reader.close()
